//! A case as a collection: the scene under several names, and their catalogue.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};
use sha2::{Digest, Sha256};

use super::document::{Document, Table};
use super::edit::Edit;
use super::{Result, bytes, parquet_files};

/// What the sequences are called, and their folders.
const SEQUENCES: [(&str, &str); 3] =
    [("a", "sequence=a"), ("b 2=c", "sequence=b%202%3Dc"), ("größe", "sequence=größe")];
/// The table of a collection, and its file.
const CATALOGUE: &str = "catalogue";
const CATALOGUE_FILE: &str = "catalogue.parquet";

impl Edit {
    /// Whether an edit is of the collection, not of its sequences.
    pub(crate) fn is_of_collection(&self) -> bool {
        self.table() == Some(CATALOGUE)
            || matches!(self, Self::RenameFolder { .. } | Self::DropFolder { .. } | Self::NameSequence { .. })
    }
}

/// Stores a case's document as a collection.
pub(crate) fn store(document: &Document, edits: &[Edit], path: &Path) -> Result<()> {
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let mut root: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let mut catalogue = Table::known(CATALOGUE)?;
    for (name, folder) in SEQUENCES {
        let mut document = document.clone();
        document.manifest["name"] = name.into();
        let files = parquet_files::encode(&document, &[])?;
        let row = row(&document, &files)?;
        catalogue.rows.push(catalogue.row(&row)?);
        // What is said of a sequence beside the catalogue's back.
        for edit in edits {
            if let Edit::NameSequence { sequence, name: other } = edit
                && sequence == name
            {
                document.manifest["name"] = other.as_str().into();
            }
        }
        let files = parquet_files::encode(&document, &[])?;
        fs::create_dir_all(path.join(folder)).map_err(failed)?;
        for (file, bytes) in files {
            fs::write(path.join(folder).join(file), bytes).map_err(failed)?;
        }
    }
    let mut whole = Document { tables: vec![catalogue], ..document.clone() };
    for edit in edits.iter().filter(|edit| edit.table() == Some(CATALOGUE)) {
        edit.apply(&mut whole)?;
    }
    let options = parquet_files::options(edits);
    let version = document.manifest["spec_version"].as_str().unwrap_or_default();
    let file = parquet_files::file(whole.table_mut(CATALOGUE)?, version, &options)?;
    root.insert(CATALOGUE_FILE.to_owned(), file);
    parquet_files::edit_files(&mut root, edits)?;
    for (name, bytes) in &mut root {
        bytes::edit(bytes, Some(name), edits)?;
        fs::write(path.join(name), bytes).map_err(failed)?;
    }
    for edit in edits {
        match edit {
            Edit::RenameFolder { from, to } => fs::rename(path.join(from), path.join(to)).map_err(failed)?,
            Edit::DropFolder { name } => fs::remove_dir_all(path.join(name)).map_err(failed)?,
            _ => {}
        }
    }
    Ok(())
}

/// What the catalogue has to say of a sequence, by the words of the specification.
fn row(document: &Document, files: &BTreeMap<String, Vec<u8>>) -> Result<Map<String, Value>> {
    let manifest = &document.manifest;
    let text = files.get("sequence.json").ok_or("no manifest")?;
    let count = |table: &str| document.table(table).map_or(0, |table| table.rows.len());
    let frames = document.table("frames").ok_or("no frames")?;
    let pose = |row: usize| -> Option<[f64; 3]> {
        let number = |name: &str| frames.cell(row, &format!("world_from_camera_{name}"))?.float();
        for turn in ["qx", "qy", "qz", "qw"] {
            number(turn)?;
        }
        Some([number("tx")?, number("ty")?, number("tz")?])
    };
    let poses: Vec<[f64; 3]> = (0..frames.rows.len()).filter_map(pose).collect();
    let mut length = 0.0_f64;
    for pair in poses.windows(2) {
        let squares = (0..3).map(|axis| (pair[1][axis] - pair[0][axis]).powi(2));
        length += squares.sum::<f64>().sqrt();
    }
    let mut estimates: Vec<String> = Vec::new();
    if let Some(table) = document.table("trajectories") {
        let column = table.column("estimate")?;
        estimates.extend(table.rows.iter().filter_map(|row| row[column].text().map(str::to_owned)));
        estimates.sort();
        estimates.dedup();
    }
    let stamps = [frames.int(0, "stamp_nanos"), frames.int(frames.rows.len() - 1, "stamp_nanos")];
    let digest: String = Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect();
    let mut row = json!({
        "sequence": manifest["name"],
        "spec_version": manifest["spec_version"],
        "manifest_sha256": digest,
        "description": manifest["description"],
        "dataset": manifest["source"]["dataset"],
        "dataset_sequence": manifest["source"]["sequence"],
        "licence": manifest["source"]["licence"],
        "generator": manifest["generator"]["tool"],
        "clock": manifest["clock"]["kind"],
        "noise": manifest["noise"]["model"],
        "cameras": manifest["cameras"].as_array().map_or(0, Vec::len),
        "frames": count("frames"),
        "frames_with_truth": poses.len(),
        "first_stamp_nanos": stamps[0],
        "last_stamp_nanos": stamps[1],
        "path_length": length,
        "points": count("point_landmarks"),
        "lines": count("line_landmarks"),
        "groups": count("structural_groups"),
        "total_rows": document.tables.iter().map(|table| table.rows.len()).sum::<usize>(),
        "tables": document.tables.iter().map(|table| table.name.as_str()).collect::<Vec<_>>(),
        "estimates": estimates,
        "bytes": files.values().map(Vec::len).sum::<usize>(),
    });
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let numbers = || poses.iter().map(|pose| pose[axis]);
        row[format!("min_{name}")] = numbers().fold(f64::INFINITY, f64::min).into();
        row[format!("max_{name}")] = numbers().fold(f64::NEG_INFINITY, f64::max).into();
    }
    for table in ["point_observations", "line_observations", "point_measurements", "line_measurements"] {
        row[table] = count(table).into();
    }
    match row {
        Value::Object(row) => Ok(row),
        _ => Err("not an object".to_owned()),
    }
}
