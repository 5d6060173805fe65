//! The file of a catalogue.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use super::super::arrow_batch::to_batch;
use super::super::arrow_schema::{TABLE_KEY, VERSION_KEY, arrow_schema};
use super::super::parquet_reader::ParquetTableReader;
use super::super::parquet_writer::{ParquetTableWriter, ROW_GROUP_ROWS};
use super::super::partial::Partial;
use super::super::stored_table::StoredTable;
use super::super::{Error, names};
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{CATALOGUE, CatalogueEntry, Record};

/// Most sequences of a catalogue that is read.
const MOST_SEQUENCES: u64 = 1 << 18;

/// A catalogue that is open for reading, right or wrong.
pub(crate) struct StoredCatalogue {
    reader: ParquetTableReader,
}

impl StoredCatalogue {
    /// Opens the catalogue in the folder of a collection.
    pub(crate) fn open(collection: &Path) -> Result<Self, Error> {
        let path = collection.join(names::CATALOGUE_FILE);
        let reader = ParquetTableReader::open(&path, CATALOGUE, Arc::new(AtomicU64::new(0)))?;
        Ok(Self { reader })
    }

    /// Its columns, as far as they are known.
    pub(crate) fn stored(&self) -> &StoredTable {
        self.reader.stored()
    }

    /// Version of the specification that it declares.
    pub(crate) fn spec_version(&self) -> Option<String> {
        let pairs = self.reader.footer().file_metadata().key_value_metadata()?;
        pairs.iter().find(|pair| pair.key == VERSION_KEY)?.value.clone()
    }

    /// Its rows.
    pub(crate) fn rows(&self) -> Result<Vec<CatalogueEntry>, Error> {
        self.reader.rows(MOST_SEQUENCES)
    }
}

/// The rows of the catalogue in the folder of a collection, as they stand there.
///
/// # Errors
/// [`Error::Io`] when there is none, [`Error::Container`], [`Error::MissingColumn`], [`Error::ColumnType`], [`Error::Null`].
pub fn read_catalogue(collection: &Path) -> Result<Vec<CatalogueEntry>, Error> {
    StoredCatalogue::open(collection)?.rows()
}

/// Writes the catalogue of a collection into its folder.
///
/// * `entries` — of all its sequences, in any order.
/// * `force` — whether a catalogue that is there is replaced.
///
/// # Errors
/// [`Error::Exists`], [`Error::Order`] when two rows have one name, [`Error::Container`], [`Error::Io`].
pub fn write_catalogue(collection: &Path, entries: &[CatalogueEntry], force: bool) -> Result<(), Error> {
    let path = collection.join(names::CATALOGUE_FILE);
    let partial = Partial::file(&path, force)?;
    let mut rows: Vec<CatalogueEntry> = entries.to_vec();
    rows.sort_by(Record::compare_key);
    if let Some(row) = (1..rows.len()).find(|row| rows[*row].compare_key(&rows[row - 1]).is_eq()) {
        let [previous, key] = [row - 1, row].map(|row| rows[row].key_text());
        return Err(Error::Order { table: CATALOGUE.name, row: row as u64, key, previous });
    }
    let pairs = [
        (VERSION_KEY.to_owned(), SPEC_VERSION.to_owned()),
        (TABLE_KEY.to_owned(), CATALOGUE.name.to_owned()),
    ];
    let schema = arrow_schema(CATALOGUE);
    let mut writer = ParquetTableWriter::create(partial.path(), CATALOGUE, &pairs)?;
    for rows in rows.chunks(ROW_GROUP_ROWS) {
        let batch =
            to_batch(rows, &schema).map_err(|cause| Error::container(&path, "Parquet")(cause.into()))?;
        writer.write(batch)?;
    }
    writer.finish()?;
    partial.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(sequence: &str) -> CatalogueEntry {
        CatalogueEntry {
            sequence: sequence.to_owned(),
            licence: (sequence == "b").then(|| "CC0-1.0".to_owned()),
            tables: vec!["frames".to_owned(), String::new(), "Größe".to_owned()],
            estimates: if sequence == "a" { Vec::new() } else { vec!["point-ba".to_owned()] },
            path_length: Some(0.1),
            ..CatalogueEntry::default()
        }
    }

    #[test]
    fn a_catalogue_is_read_as_it_was_written_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let rows = ["c", "a", "b"].map(entry);
        write_catalogue(folder.path(), &rows, false).unwrap();
        assert_eq!(read_catalogue(folder.path()).unwrap(), ["a", "b", "c"].map(entry));
        let bytes = std::fs::read(folder.path().join("catalogue.parquet")).unwrap();
        assert!(matches!(write_catalogue(folder.path(), &rows, false), Err(Error::Exists { .. })));
        write_catalogue(folder.path(), &rows, true).unwrap();
        assert_eq!(std::fs::read(folder.path().join("catalogue.parquet")).unwrap(), bytes);
        let twice = [entry("a"), entry("b"), entry("a")];
        assert!(matches!(write_catalogue(folder.path(), &twice, true), Err(Error::Order { row: 1, .. })));
        assert_eq!(read_catalogue(folder.path()).unwrap().len(), 3);
        assert_eq!(
            StoredCatalogue::open(folder.path()).unwrap().spec_version().as_deref(),
            Some(SPEC_VERSION)
        );
    }

    #[test]
    fn a_collection_without_sequences_has_a_catalogue_without_rows() {
        let folder = tempfile::tempdir().unwrap();
        write_catalogue(folder.path(), &[], false).unwrap();
        assert_eq!(read_catalogue(folder.path()).unwrap(), []);
    }
}
