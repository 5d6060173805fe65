//! Names that stand in files: topics, encodings, metadata keys, file names.

/// Name of the MCAP Metadata record that says what the file is.
pub(super) const IDENTITY: &str = "open-structure";
/// MCAP topic of the manifest.
pub(super) const MANIFEST_TOPIC: &str = "/manifest";
/// MCAP topic of the table summaries.
pub(super) const SUMMARY_TOPIC: &str = "/table_summaries";
/// MCAP message and schema encoding of tables: the Arrow encoding proposed for MCAP
/// (foxglove/mcap pull request 1748).
pub(super) const ARROW_ENCODING: &str = "arrow";
/// MCAP message encoding of small records.
pub(super) const JSON_ENCODING: &str = "json";
/// MCAP schema encoding of small records.
pub(super) const JSON_SCHEMA_ENCODING: &str = "jsonschema";
/// Prefix of MCAP schema names.
pub(super) const SCHEMA_PREFIX: &str = "open_structure.";
/// Prefix of the MCAP topics that are for viewers alone.
pub(super) const FOXGLOVE_PREFIX: &str = "/foxglove/";
/// Manifest of a Parquet folder.
pub(super) const MANIFEST_FILE: &str = "sequence.json";
/// Croissant description of a Parquet folder.
pub(super) const CROISSANT_FILE: &str = "croissant.json";
/// Catalogue of a collection.
pub(super) const CATALOGUE_FILE: &str = "catalogue.parquet";
