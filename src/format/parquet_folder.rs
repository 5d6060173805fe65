//! A sequence as a folder: the manifest and one Parquet file per table.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use arrow::array::RecordBatch;

use super::arrow_schema::{TABLE_KEY, VERSION_KEY};
use super::croissant::croissant;
use super::parquet_writer::ParquetTableWriter;
use super::partial::Partial;
use super::{Error, names};
use crate::structure::{Manifest, TableInfo, table_info};

/// Writes the tables of a sequence side by side.
pub(super) struct ParquetFolderWriter {
    partial: Partial,
    tables: BTreeMap<&'static str, ParquetTableWriter>,
    pairs: Vec<(String, String)>,
}

impl ParquetFolderWriter {
    /// Begins a folder.
    pub(super) fn create(path: &Path, manifest: &Manifest, force: bool) -> Result<Self, Error> {
        let is_member = |name: &str| {
            let table = name.strip_suffix(".parquet");
            [names::MANIFEST_FILE, names::CROISSANT_FILE].contains(&name)
                || table.is_some_and(|name| table_info(name).is_some())
        };
        let partial = Partial::folder(path, force, is_member)?;
        partial.create_folder()?;
        let json = |value: serde_json::Result<String>| {
            value.map_err(|error| Error::Manifest { path: path.to_owned(), detail: error.to_string() })
        };
        // What a reader of a single file needs to understand its numbers.
        let pairs = vec![
            (VERSION_KEY.to_owned(), manifest.spec_version.clone()),
            ("open-structure.sequence".to_owned(), manifest.name.clone()),
            ("open-structure.conventions".to_owned(), json(serde_json::to_string(&manifest.conventions))?),
            ("open-structure.cameras".to_owned(), json(serde_json::to_string(&manifest.cameras))?),
        ];
        Ok(Self { partial, tables: BTreeMap::new(), pairs })
    }

    /// Makes the file of a table, so that it is there even without rows.
    pub(super) fn declare(&mut self, table: &'static TableInfo) -> Result<(), Error> {
        if !self.tables.contains_key(table.name) {
            let path = self.partial.path().join(format!("{}.parquet", table.name));
            let mut pairs = self.pairs.clone();
            pairs.push((TABLE_KEY.to_owned(), table.name.to_owned()));
            self.tables.insert(table.name, ParquetTableWriter::create(&path, table, &pairs)?);
        }
        Ok(())
    }

    /// Adds rows to a declared table.
    pub(super) fn write_batch(&mut self, table: &'static TableInfo, batch: RecordBatch) -> Result<(), Error> {
        self.declare(table)?;
        match self.tables.get_mut(table.name) {
            Some(writer) => writer.write(batch),
            None => Ok(()),
        }
    }

    /// Writes what is left, the manifest and its Croissant description, and gives the folder its name.
    pub(super) fn finish(self, manifest: &Manifest) -> Result<(), Error> {
        for writer in self.tables.into_values() {
            writer.finish()?;
        }
        let folder = self.partial.path();
        let manifest_path = folder.join(names::MANIFEST_FILE);
        let mut text = serde_json::to_string_pretty(manifest)
            .map_err(|error| Error::Manifest { path: manifest_path.clone(), detail: error.to_string() })?;
        text.push('\n');
        fs::write(&manifest_path, text).map_err(Error::io(&manifest_path))?;
        let description = croissant(folder, manifest)?;
        let croissant_path = folder.join(names::CROISSANT_FILE);
        fs::write(&croissant_path, description).map_err(Error::io(&croissant_path))?;
        self.partial.finish()
    }
}
