//! The corpus as files, with the findings that each must bring.

use std::fs;
use std::path::Path;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::{Case, Expected, Result, cases, document, store};

/// Version of the layout that [`export`] writes, as `major.minor.patch`.
pub(crate) const CORPUS_VERSION: &str = "1.1.0";

/// What `expected.json` says of a finding.
fn finding(expected: &Expected) -> Value {
    let mut json = json!({ "rule": expected.rule, "severity": expected.severity });
    if let Some(table) = &expected.table {
        json["table"] = table.as_str().into();
    }
    if expected.optional {
        json["optional"] = true.into();
    }
    json
}

/// What `expected.json` says of a case.
fn expected(case: &Case) -> Value {
    let encodings = case.encodings.iter().map(|stored| {
        let following = case.findings.iter().filter(|expected| expected.follows_in(*stored));
        let findings: Vec<Value> = following.map(finding).collect();
        let json = json!({ "path": stored.file_name(), "findings": findings });
        (stored.name().to_owned(), json)
    });
    let mut json = json!({
        "corpus_version": CORPUS_VERSION,
        "case": case.name,
        "title": case.title,
        "encodings": encodings.collect::<serde_json::Map<_, _>>(),
    });
    if let Some(rule) = case.rule() {
        json["rule"] = rule.into();
    }
    json
}

/// Writes every case below a folder that is not there yet: `<case>/sequence.mcap`, `<case>/sequence/` or
/// `<case>/collection/`, and `<case>/expected.json`, and the list of all in `corpus.json`. Returns the cases.
pub(crate) fn export(output: &Path) -> Result<Vec<Case>> {
    if output.exists() {
        return Err(format!("{}: exists already", output.display()));
    }
    let cases = cases()?;
    let list = cases.par_iter().map(|case| export_case(case, output)).collect::<Result<Vec<_>>>()?;
    write(&output.join("corpus.json"), &json!({ "corpus_version": CORPUS_VERSION, "cases": list }))?;
    Ok(cases)
}

fn export_case(case: &Case, output: &Path) -> Result<Value> {
    let folder = output.join(&case.name);
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let document = document(case).map_err(|error| format!("{}: {error}", case.name))?;
    for stored in case.encodings.iter().copied() {
        store(case, &document, stored, &folder.join(stored.file_name()))
            .map_err(|error| format!("{} ({}): {error}", case.name, stored.name()))?;
    }
    let expected = expected(case);
    write(&folder.join("expected.json"), &expected)?;
    Ok(expected)
}

fn write(path: &Path, json: &Value) -> Result<()> {
    let text = serde_json::to_string_pretty(json).map_err(|error| error.to_string())?;
    fs::write(path, text + "\n").map_err(|error| format!("{}: {error}", path.display()))
}
