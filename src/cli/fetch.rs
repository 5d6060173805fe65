//! `os fetch`: the images of a sequence, or what the first release has of it.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use serde_json::json;

use super::fetch_progress::FetchProgress;
use super::{Outcome, text};
use crate::datasets::{self, MAX_RECIPE_BYTES, Recipe};
use crate::fetch::{self, Fetched, Mirror, Options, Patience, What};
use crate::simulate;
use crate::storage::{self, File};

/// Download the images of a sequence, or what the first text release has of it.
///
/// The image-based sequences of the paper are known by name; `os schema dataset-recipe` describes the recipe of
/// another. A download that is cut goes on where it was when the command is given again. Lengths and digests
/// that the recipe knows are held against what comes; others are printed, so that they can be written into it.
/// The folder appears when all is there.
///
/// A mirror has the files as SEQUENCE/FILE or as FILE.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os fetch                                          what there is
  os fetch livingroom0                              the images, into livingroom0/
  os fetch hospital --what text-release -o release  what the first release has of it
  os fetch office1 --mirror /data/icl-nuim          from a disk; or from http://...
  os fetch my-dataset.toml -o images --keep-archives

What is being downloaded lies in NAME.download/ beside the folder, for a URL in the current one.")]
pub(super) struct Args {
    /// Recipe: a file, or the name of one that travels with the program; without it, these are listed.
    recipe: Option<String>,
    /// Which files.
    #[arg(long, value_enum, default_value_t, requires = "recipe")]
    what: WhatArg,
    /// Folder to make, or URL; by default the name of the sequence.
    #[arg(short, long, value_name = "DIR", requires = "recipe")]
    output: Option<PathBuf>,
    /// Folder or URL that has the files, instead of those of the recipe.
    #[arg(long, value_name = "DIR|URL", requires = "recipe")]
    mirror: Option<String>,
    /// Leave the downloaded archives in NAME.download/.
    #[arg(long, requires = "recipe")]
    keep_archives: bool,
    /// Replace the folder if it exists.
    #[arg(long, requires = "recipe")]
    force: bool,
    /// Attempts in vain before a server is given up.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    attempts: u32,
    /// Longest silence of a server, seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    timeout: u64,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum WhatArg {
    /// The images.
    #[default]
    Raw,
    /// The archives of the first text release.
    TextRelease,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Some(name) = &args.recipe else {
        return list(args.json, stdout);
    };
    let recipe = recipe_of(name)?;
    let (what, part) = match args.what {
        WhatArg::Raw => (What::Raw, Some(&recipe.raw)),
        WhatArg::TextRelease => (What::TextRelease, recipe.text_release.as_ref()),
    };
    let default = Patience::default();
    let silence = Duration::from_secs(args.timeout);
    let options = Options {
        what,
        mirror: args.mirror.as_deref().map(Mirror::of),
        keep_archives: args.keep_archives,
        force: args.force,
        patience: Patience {
            attempts: args.attempts,
            connect: default.connect.min(silence),
            answer: silence,
            silence,
            ..default
        },
        ..Options::default()
    };
    let into = args.output.clone().unwrap_or_else(|| PathBuf::from(&recipe.name));
    let progress = FetchProgress::default();
    let fetched = fetch::fetch(&recipe, &into, &options, &|event| progress.show(&event))?;
    drop(progress);

    let next = next_command(name, &recipe, what, &fetched);
    let note = part.and_then(|part| part.note.as_deref());
    if args.json {
        let result = json!({
            "fetched": fetched,
            "dataset": recipe.dataset.name(),
            "dataset_sequence": recipe.sequence,
            "licence": recipe.licence,
            "citation": recipe.citation,
            "note": note,
            "next": next,
        });
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
        return Ok(Outcome::Done);
    }
    let mut table = text::table(["FILE", "BYTES", "FILES", "SHA-256"], &[1, 2]);
    for file in &fetched.files {
        let unpacked = if file.unpacked == 0 { "-".to_owned() } else { text::count(file.unpacked) };
        let checked = if file.pinned { " as expected" } else { "" };
        table.add_row([
            &file.name,
            &text::count(file.bytes),
            &unpacked,
            &format!("{}{checked}", file.sha256),
        ]);
    }
    writeln!(stdout, "{}\n", text::lines(&table))?;
    for file in fetched.files.iter().filter(|file| file.left_out > 0) {
        writeln!(stdout, "{}: {} links or devices left out", file.name, text::count(file.left_out))?;
    }
    if fetched.files.iter().any(|file| !file.pinned) {
        writeln!(stdout, "The recipe does not know every digest; `bytes` and `sha256` of a file go there.")?;
    }
    if args.keep_archives {
        writeln!(stdout, "Archives: {}", fetch::download_folder(&fetched.into).display())?;
    }
    writeln!(stdout, "{} of {}, {}", recipe.sequence, recipe.dataset.name(), recipe.licence)?;
    writeln!(stdout, "Please cite: {}", recipe.citation)?;
    if let Some(note) = note {
        writeln!(stdout, "Note: {note}")?;
    }
    writeln!(stdout, "{}: {}", fetched.into.display(), text::bytes(storage::size(&fetched.into, &[])))?;
    writeln!(stdout, "next: {}", next.join(" "))?;
    Ok(Outcome::Done)
}

/// The command that makes a sequence of what was fetched, ready for a shell.
fn next_command(name: &str, recipe: &Recipe, what: What, fetched: &Fetched) -> Vec<String> {
    let folder = fetched.folder.to_string_lossy();
    let arguments = match what {
        What::Raw => recipe.arguments(&folder, &format!("{}.mcap", recipe.name), name),
        What::TextRelease => {
            // The release has some sequences twice; then this is a folder of both.
            let output = format!("{}-release", recipe.name);
            ["open-structure", &folder, "-o", &output].map(str::to_owned).to_vec()
        }
    };
    std::iter::once("os-convert".to_owned()).chain(arguments.iter().map(|word| quoted(word))).collect()
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-+=,:@%".contains(&byte);
    if !word.is_empty() && word.bytes().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// The recipe of a name, or in a file.
fn recipe_of(name: &str) -> anyhow::Result<Recipe> {
    let path = Path::new(name);
    if storage::is_folder(path) || (!storage::exists(path) && path.extension().is_none()) {
        if simulate::names().contains(&name) {
            anyhow::bail!(
                "{name} is simulated, there is nothing to download: `os simulate {name} -o {name}.mcap` makes it"
            );
        }
        // A name of ours goes before a folder of that name, such as one that was fetched.
        return Ok(datasets::named(name)?);
    }
    let mut text = String::new();
    let file = File::open(path).with_context(|| name.to_owned())?;
    let bytes = file.take(MAX_RECIPE_BYTES + 1).read_to_string(&mut text).with_context(|| name.to_owned())?;
    if bytes as u64 > MAX_RECIPE_BYTES {
        anyhow::bail!("{name}: expected a recipe of at most {MAX_RECIPE_BYTES} bytes");
    }
    Recipe::from_toml(&text).with_context(|| name.to_owned())
}

fn list(json: bool, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let recipes = datasets::names().into_iter().map(datasets::named).collect::<Result<Vec<_>, _>>()?;
    if json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&recipes)?)?;
        return Ok(Outcome::Done);
    }
    let mut table = text::table(["NAME", "DATASET", "SEQUENCE", "LICENCE", "DESCRIPTION"], &[]);
    for recipe in &recipes {
        table.add_row([
            &recipe.name,
            recipe.dataset.name(),
            &recipe.sequence,
            &recipe.licence,
            recipe.description.as_deref().unwrap_or_default(),
        ]);
    }
    writeln!(stdout, "{}", text::lines(&table))?;
    Ok(Outcome::Done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("a/b-c.mcap"), "a/b-c.mcap");
        assert_eq!(quoted("my images"), "'my images'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
