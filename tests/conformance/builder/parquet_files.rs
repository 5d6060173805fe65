//! A document as a Parquet folder.

use std::collections::BTreeMap;

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterVersion};
use serde::Deserialize;

use super::document::{Document, Table};
use super::edit::Edit;
use super::{Result, arrays};

/// How the files are written.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::struct_excessive_bools, reason = "each is a switch of its own")]
pub(crate) struct Options {
    /// `none` (the default), `snappy`, `lz4` or `zstd`.
    compression: Option<String>,
    row_group_rows: Option<usize>,
    page_rows: Option<usize>,
    #[serde(default)]
    no_statistics: bool,
    #[serde(default)]
    no_dictionary: bool,
    #[serde(default)]
    version_2: bool,
    /// Leaves the embedded Arrow schema out.
    #[serde(default)]
    no_arrow_schema: bool,
}

/// The files of the folder, by name.
pub(crate) fn encode(document: &Document, edits: &[Edit]) -> Result<BTreeMap<String, Vec<u8>>> {
    let options = options(edits);
    let mut files = BTreeMap::new();
    let version = document.manifest["spec_version"].as_str().unwrap_or("1.0.0");
    for table in &document.tables {
        let bytes = file(table, version, &options).map_err(|error| format!("{}: {error}", table.name))?;
        files.insert(format!("{}.parquet", table.name), bytes);
    }
    let mut manifest = document.manifest.clone();
    if let Some(map) = manifest.as_object_mut() {
        map.insert("tables".to_owned(), document.summaries.clone().into());
    }
    let text = serde_json::to_string_pretty(&manifest).map_err(|error| error.to_string())?;
    files.insert("sequence.json".to_owned(), document.manifest_text.clone().unwrap_or(text).into_bytes());
    edit_files(&mut files, edits)?;
    Ok(files)
}

/// The last choice of how files are written.
pub(crate) fn options(edits: &[Edit]) -> Options {
    let chosen = edits.iter().rev().find_map(|edit| match edit {
        Edit::Parquet(chosen) => Some(chosen.clone()),
        _ => None,
    });
    chosen.unwrap_or_default()
}

/// Adds files to a folder, and takes files out.
pub(crate) fn edit_files(files: &mut BTreeMap<String, Vec<u8>>, edits: &[Edit]) -> Result<()> {
    for edit in edits {
        match edit {
            Edit::File { name, text } => {
                files.insert(name.clone(), text.clone().into_bytes());
            }
            Edit::DropFile { name } => {
                files.remove(name).ok_or_else(|| format!("no file {name}"))?;
            }
            _ => {}
        }
    }
    Ok(())
}

/// The file of a table.
pub(crate) fn file(table: &Table, version: &str, options: &Options) -> Result<Vec<u8>> {
    let compression = match options.compression.as_deref() {
        None | Some("none") => Compression::UNCOMPRESSED,
        Some("snappy") => Compression::SNAPPY,
        Some("lz4") => Compression::LZ4_RAW,
        Some("zstd") => Compression::ZSTD(ZstdLevel::default()),
        Some(other) => return Err(format!("no compression is called {other}")),
    };
    let statistics = if options.no_statistics { EnabledStatistics::None } else { EnabledStatistics::Page };
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .set_statistics_enabled(statistics)
        .set_dictionary_enabled(!options.no_dictionary)
        .set_writer_version(if options.version_2 {
            WriterVersion::PARQUET_2_0
        } else {
            WriterVersion::PARQUET_1_0
        })
        .set_max_row_group_row_count(Some(options.row_group_rows.unwrap_or(1 << 18)))
        .set_data_page_row_count_limit(options.page_rows.unwrap_or(1 << 13))
        .set_write_batch_size(options.page_rows.unwrap_or(1 << 10))
        .build();
    let schema = arrays::schema(table, version);
    let settings = parquet::arrow::arrow_writer::ArrowWriterOptions::new()
        .with_properties(properties)
        .with_skip_arrow_metadata(options.no_arrow_schema);
    let mut writer = ArrowWriter::try_new_with_options(Vec::new(), std::sync::Arc::clone(&schema), settings)
        .map_err(|error| error.to_string())?;
    writer.write(&arrays::batch(table, &schema, &table.rows)?).map_err(|error| error.to_string())?;
    writer.into_inner().map_err(|error| error.to_string())
}
