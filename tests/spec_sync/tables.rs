//! The generated tables of the specification: columns, manifest members, the overview.

use std::fmt::Write as _;

use open_structure::format::json_schema;
use open_structure::structure::{Field, Need, Storage, TABLES, TableInfo, any_table_info};

use crate::ordered::Ordered;

/// Text for a cell of a Markdown table.
pub(crate) fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn key(table: &TableInfo) -> String {
    table.key.iter().map(|column| format!("`{column}`")).collect::<Vec<_>>().join(", ")
}

/// Every table in one line each.
pub(crate) fn overview() -> String {
    let mut text = "| table | row | key | stored | needed |\n|---|---|---|---|---|\n".to_owned();
    for table in TABLES {
        let stored = match table.storage {
            Storage::PerFrame => "per frame",
            Storage::Whole => "whole",
        };
        let need = match table.need {
            Need::Required => "yes",
            Need::Optional => "no",
        };
        let _ =
            writeln!(text, "| `{}` | `{}` | {} | {stored} | {need} |", table.name, table.record, key(table));
    }
    text
}

/// The columns of a table, after what is said of its rows.
pub(crate) fn columns(name: &str) -> Option<String> {
    let table = any_table_info(name)?;
    let mut text = format!("{}\n\nKey: {}.\n\n", table.description(), key(table));
    text.push_str("| name | type | unit | space | meaning |\n|---|---|---|---|---|\n");
    for Field { name, kind, nullable, unit, space, since, .. } in table.fields {
        let description = table.fields.iter().find(|field| field.name == *name)?.description();
        let nullable = if *nullable { ", nullable" } else { "" };
        let since = if *since == "1.0.0" { String::new() } else { format!(", since {since}") };
        // Without the bar `<int64>` would be markup.
        let kind = kind.name().replace('<', r"\<");
        let _ = writeln!(
            text,
            "| `{name}` | {kind}{nullable}{since} | {unit} | {space} | {} |",
            cell(&description)
        );
    }
    Some(text)
}

/// The members of an object of the manifest; `path` is empty, `source`, `source.files[]` and so on.
pub(crate) fn manifest(path: &str) -> Option<String> {
    let whole = Ordered::parse(&json_schema("manifest")?);
    let mut schema = &whole;
    for step in path.split('.').filter(|step| !step.is_empty()) {
        let (name, list) = step.strip_suffix("[]").map_or((step, false), |name| (name, true));
        schema = schema.get("properties")?.get(name)?;
        if list {
            schema = schema.get("items")?;
        }
    }
    let required = schema.get("required").map(Ordered::texts).unwrap_or_default();
    let mut text = "| name | type | unit | meaning |\n|---|---|---|---|\n".to_owned();
    for (name, member) in schema.get("properties")?.members() {
        let optional = if required.contains(&name.as_str()) { "" } else { ", optional" };
        let unit = Some(member.text_of("x-unit")).filter(|unit| !unit.is_empty()).unwrap_or("-");
        let meaning = cell(&member.text_of("description").replace('\n', " "));
        let _ = writeln!(text, "| `{name}` | {}{optional} | {unit} | {meaning} |", kind(member));
    }
    Some(text)
}

/// Type of a JSON member in words.
fn kind(member: &Ordered) -> String {
    match member.text_of("type") {
        "array" => format!("list of {}", member.get("items").map(kind).unwrap_or_default()),
        "object" => match member.get("additionalProperties") {
            Some(values) => format!("object of {}", kind(values)),
            None => "object".to_owned(),
        },
        other => other.to_owned(),
    }
}
