//! What follows from other tables: correspondences, statistics, row counts, digests.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use open_structure::structure::{ColumnType, Field, hex};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::document::{Cell, Document, Table};
use super::step;

/// Tables that are computed here; edits of them come after.
pub(crate) const DERIVED: [&str; 3] = ["point_correspondences", "line_correspondences", "frame_statistics"];

/// Fills those of the computed tables that the document has.
pub(crate) fn tables(document: &mut Document) {
    let points = correspondences(document, "point_id", ["point_measurements", "point_observations"]);
    let lines = correspondences(document, "line_id", ["line_measurements", "line_observations"]);
    let statistics = statistics(document);
    for (name, rows) in DERIVED.into_iter().zip([points, lines, statistics]) {
        if let Ok(table) = document.table_mut(name) {
            table.rows = rows;
        }
    }
}

fn correspondences(document: &Document, id: &str, sources: [&str; 2]) -> Vec<Vec<Cell>> {
    let mut rows = Vec::new();
    for source in sources {
        let mut lists: BTreeMap<i64, (Vec<i64>, Vec<i64>)> = BTreeMap::new();
        let Some(table) = document.table(source) else { continue };
        for (number, row) in (0..).zip(0..table.rows.len()) {
            let entry = lists.entry(table.int(row, id)).or_default();
            entry.0.push(table.int(row, "frame_id"));
            entry.1.push(number);
        }
        for (landmark, (frames, numbers)) in lists {
            rows.push(vec![source.into(), landmark.into(), frames.into(), numbers.into()]);
        }
    }
    rows
}

/// The first table that has rows.
fn first<'a>(document: &'a Document, names: [&str; 2]) -> Option<&'a Table> {
    names.iter().filter_map(|name| document.table(name)).find(|table| !table.rows.is_empty())
}

fn statistics(document: &Document) -> Vec<Vec<Cell>> {
    #[derive(Default)]
    struct Tally {
        points: i64,
        lines: BTreeSet<i64>,
        cells: HashSet<(i64, i64)>,
    }
    #[expect(clippy::cast_possible_truncation, reason = "saturates")]
    let cell = |u: f64, v: f64| ((u / 10.0).floor() as i64, (v / 10.0).floor() as i64);
    let mut tallies: BTreeMap<i64, Tally> =
        document.stamps().into_iter().map(|(frame, _)| (frame, Tally::default())).collect();
    if let Some(table) = first(document, ["point_measurements", "point_observations"]) {
        for row in 0..table.rows.len() {
            let Some(tally) = tallies.get_mut(&table.int(row, "frame_id")) else { continue };
            tally.points += 1;
            tally.cells.insert(cell(table.float(row, "u"), table.float(row, "v")));
        }
    }
    if let Some(table) = first(document, ["line_measurements", "line_observations"]) {
        for row in 0..table.rows.len() {
            let Some(tally) = tallies.get_mut(&table.int(row, "frame_id")) else { continue };
            tally.lines.insert(table.int(row, "line_id"));
            tally.cells.insert(cell(table.float(row, "start_u"), table.float(row, "start_v")));
            tally.cells.insert(cell(table.float(row, "end_u"), table.float(row, "end_v")));
        }
    }
    let groups: Vec<BTreeSet<i64>> = document.table("structural_groups").map_or_else(Vec::new, |table| {
        let compound = |row: &usize| match table.cell(*row, "kind") {
            Some(Cell::Text(kind)) => ["manhattan", "atlanta"].contains(&kind.as_str()),
            _ => false,
        };
        let lists = (0..table.rows.len()).filter(|row| !compound(row)).filter_map(|row| {
            match table.cell(row, "line_ids") {
                Some(Cell::Ints(lines)) => Some(lines.iter().flatten().copied().collect()),
                _ => None,
            }
        });
        lists.collect()
    });
    let count = |length: usize| i64::try_from(length).unwrap_or(i64::MAX);
    let frames: Vec<i64> = tallies.keys().copied().collect();
    let counted = [
        first(document, ["point_measurements", "point_observations"]),
        first(document, ["line_measurements", "line_observations"]),
    ];
    tallies
        .into_iter()
        .enumerate()
        .map(|(index, (frame, tally))| {
            let seen = groups.iter().map(|lines| count(lines.intersection(&tally.lines).count()));
            let constraints: i64 = seen.filter(|lines| *lines > 0).map(|lines| lines - 1).sum();
            let mut row = vec![
                frame.into(),
                tally.points.into(),
                count(tally.lines.len()).into(),
                count(tally.cells.len()).into(),
                constraints.into(),
            ];
            row.extend(step::columns(document, counted, &frames, index));
            row
        })
        .collect()
}

/// Row count and digest of every known table.
pub(crate) fn summaries(document: &mut Document) {
    let known = document.tables.iter().filter(|table| table.info.is_some());
    document.summaries = known
        .map(|table| json!({ "table": table.name, "rows": table.rows.len(), "sha256": digest(table) }))
        .collect::<Vec<Value>>();
}

/// SHA-256 over the canonical bytes of a table: the listed columns, in their order, row after row.
fn digest(table: &Table) -> String {
    let mut bytes = Vec::new();
    let fields = table.info.map_or(&[][..], |info| info.fields);
    for row in 0..table.rows.len() {
        for field in fields {
            put(field, table.cell(row, field.name).unwrap_or(&Cell::Null), &mut bytes);
        }
    }
    hex(&Sha256::digest(&bytes))
}

fn put(field: &Field, cell: &Cell, bytes: &mut Vec<u8>) {
    if field.since != "1.0.0" {
        if cell.is_null() {
            return;
        }
        bytes.extend((field.name.len() as u64).to_le_bytes());
        bytes.extend(field.name.as_bytes());
    }
    if field.nullable {
        bytes.push(u8::from(!cell.is_null()));
    }
    let length = |length: usize, bytes: &mut Vec<u8>| bytes.extend((length as u64).to_le_bytes());
    match (field.kind, cell) {
        (ColumnType::Int64, Cell::Int(value)) => bytes.extend(value.to_le_bytes()),
        (ColumnType::Float64, Cell::Float(value)) => bytes.extend(value.to_le_bytes()),
        (ColumnType::Boolean, Cell::Bool(value)) => bytes.push(u8::from(*value)),
        (ColumnType::Utf8, Cell::Text(text)) => {
            length(text.len(), bytes);
            bytes.extend(text.as_bytes());
        }
        (ColumnType::Binary, Cell::Bytes(value)) => {
            length(value.len(), bytes);
            bytes.extend(value);
        }
        (ColumnType::Int64List, Cell::Ints(values)) => {
            length(values.len(), bytes);
            values.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        (ColumnType::Float64List, Cell::Floats(values)) => {
            length(values.len(), bytes);
            values.iter().flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        // Absent, or of a type that has no canonical bytes.
        _ => {}
    }
}
