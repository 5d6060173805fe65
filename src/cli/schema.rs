//! `os schema`: the schemas of the format.

use std::io::Write;

use anyhow::Context;

use super::{Outcome, text};
use crate::datasets;
use crate::format;
use crate::simulate::Recipe;
use crate::structure::{CATALOGUE, TABLES, any_table_info};
use crate::validate;

/// Print a schema of the format: JSON Schema, or the columns of a table.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  os schema                              names of all schemas
  os schema point_measurements           JSON Schema of a row
  os schema point_measurements --columns types, units and spaces of the columns")]
pub(super) struct Args {
    /// Table name, `manifest`, `table_summaries`, `recipe`, `dataset-recipe` or `validation_report`; without it, all names are listed.
    name: Option<String>,
    /// List the columns with type, unit, space and meaning.
    #[arg(long, requires = "name")]
    columns: bool,
}

pub(super) fn run(args: &Args, stdout: &mut dyn Write) -> anyhow::Result<Outcome> {
    let Some(name) = &args.name else {
        let mut table = text::table(["NAME", "ONE ROW IS"], &[]);
        table.add_row(["manifest", "What is said about the sequence as a whole."]);
        table.add_row(["table_summaries", "Row count and digest of one table."]);
        for info in TABLES.iter().copied().chain([CATALOGUE]) {
            let description = info.description();
            let sentence = description.split_inclusive(". ").next().unwrap_or_default().trim();
            table.add_row([info.name, sentence]);
        }
        table.add_row(["recipe", "What `os simulate` makes a sequence of."]);
        table.add_row(["dataset-recipe", "What `os fetch` gets the images of a sequence by."]);
        table.add_row(["validation_report", "What `os validate --json` prints."]);
        writeln!(stdout, "{}", text::lines(&table))?;
        return Ok(Outcome::Done);
    };
    if args.columns {
        let info =
            any_table_info(name).with_context(|| format!("there is no table `{name}`; try `os schema`"))?;
        let mut table = text::table(["NAME", "TYPE", "UNIT", "SPACE", "MEANING"], &[]);
        for field in info.fields {
            let kind = format!("{}{}", field.kind.name(), if field.nullable { "?" } else { "" });
            table.add_row([field.name, &kind, field.unit, field.space, &field.description()]);
        }
        writeln!(
            stdout,
            "{}\n\nkey: {}\n\n{}",
            info.description(),
            info.key.join(", "),
            text::lines(&table)
        )?;
        return Ok(Outcome::Done);
    }
    let schema = match name.as_str() {
        "validation_report" => Some(validate::report_schema()),
        "recipe" => Some(Recipe::json_schema()),
        "dataset-recipe" => Some(datasets::Recipe::json_schema()),
        name => format::json_schema(name),
    };
    let schema = schema.with_context(|| format!("there is no schema `{name}`; try `os schema`"))?;
    write!(stdout, "{schema}")?;
    Ok(Outcome::Done)
}
