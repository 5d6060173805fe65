//! Results of several runs, put together as if one run had made them all.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::content::Content;
use super::{Cell, CellKey, Error, Method, Plan, Store};
use crate::storage;

/// A run that is gathered.
struct Part {
    store: Store,
    plan: Plan,
    sequences: Vec<String>,
}

/// Puts the results of finished runs into one folder.
///
/// The runs have methods, estimates and noise in common; sequences and seeds are shared out among them, by either or by both.
/// What is made of the folder is what one run over all sequences and seeds would give, but for the times.
///
/// * `runs` — folders of results; the sequences come in the order in which these name them.
/// * `output` — the folder that is begun, or gone on with.
/// * `anew` — whether results that are there are removed first.
///
/// Gives the store, the plan of all together, and the names of the sequences.
///
/// # Errors
/// [`Error::Apart`] when runs do not belong together, [`Error::Missing`] when no run has a cell that the others promise; those of
/// the store.
pub fn gather(runs: &[PathBuf], output: &Path, anew: bool) -> Result<(Store, Plan, Vec<String>), Error> {
    let mut parts: Vec<Part> = Vec::new();
    for run in runs {
        if storage::same(run, output) {
            return Err(Error::Apart {
                path: run.clone(),
                difference: "it is the folder that is to be written".to_owned(),
            });
        }
        let (store, plan, sequences) = Store::finished(run)?;
        parts.push(Part { store, plan, sequences });
    }
    let Some(first) = parts.first() else {
        let reason = "no runs are given".to_owned();
        return Err(Error::Apart { path: output.to_owned(), difference: reason });
    };
    for part in &parts {
        agree(part, &first.plan, first.store.folder())?;
    }
    let mut plan = first.plan.clone();
    let seeds: BTreeSet<u64> = parts.iter().flat_map(|part| part.plan.seeds.iter().copied()).collect();
    plan.seeds = seeds.into_iter().collect();
    // Bounds are those of the first seed, as of one run.
    parts.sort_by_key(|part| part.plan.seeds.first().copied());
    let mut sequences: Vec<String> = Vec::new();
    for run in runs {
        let part = parts.iter().find(|part| part.store.folder() == run.as_path());
        for name in part.into_iter().flat_map(|part| &part.sequences) {
            if !sequences.contains(name) {
                sequences.push(name.clone());
            }
        }
    }
    // All is read before anything is written.
    let found: Vec<Gathered> =
        sequences.iter().map(|name| gathered(name, &plan, &parts)).collect::<Result<_, _>>()?;
    let store = Store::open(output, &plan, anew)?;
    for (name, (content, cells, bounds)) in sequences.iter().zip(&found) {
        store.expect(name, content)?;
        cells.iter().try_for_each(|cell| store.keep(cell))?;
        if let Some(bounds) = bounds {
            store.keep_bound(name, bounds)?;
        }
    }
    store.ran(&plan, &sequences)?;
    Ok((store, plan, sequences))
}

/// Refuses a run whose columns would not be those of the first.
fn agree(part: &Part, first: &Plan, first_folder: &Path) -> Result<(), Error> {
    let same = [
        ("choice of methods", part.plan.methods == first.methods),
        ("choice of estimates", part.plan.estimates == first.estimates),
        ("noise", (&part.plan.noise, part.plan.as_measured) == (&first.noise, first.as_measured)),
        ("choice of a bound", part.plan.bound == first.bound),
    ];
    let Some((what, _)) = same.into_iter().find(|(_, same)| !same) else { return Ok(()) };
    Err(Error::Apart {
        path: part.store.folder().to_owned(),
        difference: format!("it has another {what} than {}", first_folder.display()),
    })
}

/// What all runs have of a sequence: content, cells, bounds.
type Gathered = (Content, Vec<Cell>, Option<super::store::Bounds>);

fn gathered(sequence: &str, plan: &Plan, parts: &[Part]) -> Result<Gathered, Error> {
    let having = || parts.iter().filter(|part| part.sequences.iter().any(|name| name == sequence));
    let mut content: Option<Content> = None;
    let mut bounds = None;
    for part in having() {
        let found = part.store.content(sequence)?;
        if content.get_or_insert_with(|| found.clone()) != &found {
            return Err(Error::Apart {
                path: part.store.folder().to_owned(),
                difference: format!("its sequence `{sequence}` is another than that of the same name"),
            });
        }
        if bounds.is_none() {
            bounds = part.store.bound(sequence)?;
        }
    }
    let missing = |what: String| Error::Missing { sequence: sequence.to_owned(), what };
    let content = content.ok_or_else(|| missing("content".to_owned()))?;
    if plan.bound && bounds.is_none() {
        return Err(missing("bound".to_owned()));
    }
    let mut cells = Vec::new();
    let methods = plan.methods.iter().map(|method| method.name());
    for method in methods.chain(plan.estimates.iter().map(String::as_str)) {
        let seeds: &[u64] = if Method::of_name(method).is_some() { &plan.seeds } else { &[0] };
        for seed in seeds {
            let key = CellKey { sequence: sequence.to_owned(), method: method.to_owned(), seed: *seed };
            let mut cell: Option<Cell> = None;
            for part in having() {
                let Some(found) = part.store.cell(&key)? else { continue };
                let known = cell.get_or_insert_with(|| found.clone());
                if known.outcome != found.outcome || known.curve != found.curve {
                    return Err(Error::Apart {
                        path: part.store.folder().to_owned(),
                        difference: format!("{method} on `{sequence}` with seed {seed} came out otherwise"),
                    });
                }
            }
            cells.push(cell.ok_or_else(|| missing(format!("{method} with seed {seed}")))?);
        }
    }
    Ok((content, cells, bounds))
}
