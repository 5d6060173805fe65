//! The schemas of `spec/schemas`: compared with the code, with each other, with rows, and with what files carry.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::Arc;

use arrow::datatypes::Schema;
use open_structure::format::{self, WriteOptions, arrow_schema, json_schema};
use open_structure::structure::*;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::document::{read_spec, sync};
use crate::ordered::Ordered;
use crate::sample::{every_table, sample};

/// Names of the JSON Schemas of what is in a sequence.
fn names_in_sequences() -> Vec<&'static str> {
    ["manifest", "table_summaries"].into_iter().chain(TABLES.iter().map(|table| table.name)).collect()
}

/// Names of all JSON Schemas.
fn names() -> Vec<&'static str> {
    names_in_sequences().into_iter().chain([CATALOGUE.name]).collect()
}

/// Every table, that of collections last.
fn tables() -> impl Iterator<Item = &'static TableInfo> {
    TABLES.iter().copied().chain([CATALOGUE])
}

fn file(name: &str) -> String {
    format!("schemas/{name}.schema.json")
}

#[test]
fn json_schemas_are_those_of_the_code() {
    for name in names() {
        sync(&file(name), &json_schema(name).unwrap());
    }
}

#[test]
fn the_report_of_the_validator_has_its_schema() {
    sync(&file("validation_report"), &open_structure::validate::report_schema());
}

#[test]
fn no_other_schema_lies_there() {
    if std::env::var_os("UPDATE_SPEC").is_some() {
        // Other tests are writing them.
        return;
    }
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/spec/schemas");
    let found: BTreeSet<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let expected = names()
        .into_iter()
        .map(|name| format!("{name}.schema.json"))
        .chain(["arrow.json".to_owned(), file("validation_report").replace("schemas/", "")]);
    assert_eq!(found, expected.collect());
}

#[test]
fn the_listing_of_arrow_schemas_is_that_of_the_code() {
    let tables: Vec<Value> = tables()
        .map(|table| {
            let schema = arrow_schema(table);
            let fields: Vec<Value> = schema
                .fields()
                .iter()
                .map(|field| {
                    let metadata: BTreeMap<_, _> = field.metadata().iter().collect();
                    json!({
                        "metadata": metadata,
                        "name": field.name(),
                        "nullable": field.is_nullable(),
                        "type": field.data_type().to_string(),
                    })
                })
                .collect();
            let metadata: BTreeMap<_, _> = schema.metadata().iter().collect();
            json!({ "fields": fields, "metadata": metadata, "table": table.name })
        })
        .collect();
    let mut listing = json!({ "spec_version": registry::SPEC_VERSION, "tables": tables });
    listing.sort_all_objects();
    sync("schemas/arrow.json", &format!("{}\n", serde_json::to_string_pretty(&listing).unwrap()));
}

#[test]
fn viewers_understand_the_schemas() {
    fn look(name: &str, value: &Value) {
        match value {
            Value::Object(object) => {
                assert!(!object.contains_key("$ref"), "{name}: $ref");
                assert!(!object.contains_key("$defs"), "{name}: $defs");
                let kind = object.get("type");
                let is_keyword = kind.is_none_or(|kind| kind.is_string() || kind.is_object());
                assert!(is_keyword, "{name}: type {kind:?}");
                assert_ne!(kind, Some(&Value::from("null")), "{name}: null");
                object.values().for_each(|value| look(name, value));
            }
            Value::Array(values) => values.iter().for_each(|value| look(name, value)),
            Value::Null => panic!("{name}: null"),
            _ => {}
        }
    }
    for name in names() {
        look(name, &serde_json::from_str(&json_schema(name).unwrap()).unwrap());
    }
}

#[test]
fn every_member_of_a_schema_is_described() {
    fn look(path: &str, schema: &Ordered) {
        for (name, member) in schema.get("properties").map(Ordered::members).unwrap_or_default() {
            let path = format!("{path}.{name}");
            assert!(!member.text_of("description").is_empty(), "{path} has no description");
            look(&path, member);
            if let Some(items) = member.get("items") {
                look(&path, items);
            }
        }
    }
    for name in names() {
        let schema = Ordered::parse(&json_schema(name).unwrap());
        assert_eq!(schema.text_of("$schema"), "https://json-schema.org/draft/2020-12/schema");
        assert!(schema.text_of("$id").ends_with(&file(name)), "{name}: $id");
        look(name, &schema);
    }
}

#[test]
fn arrow_schema_and_json_schema_have_the_same_columns_in_the_same_order() {
    for table in tables() {
        let arrow = arrow_schema(table);
        let schema = Ordered::parse(&json_schema(table.name).unwrap());
        let properties = schema.get("properties").unwrap().members();
        let columns: Vec<_> = arrow.fields().iter().map(|field| field.name().as_str()).collect();
        assert_eq!(
            properties.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
            columns,
            "{}",
            table.name
        );

        let needed: Vec<_> = arrow
            .fields()
            .iter()
            .filter(|field| !field.is_nullable())
            .map(|field| field.name().as_str())
            .collect();
        assert_eq!(schema.get("required").unwrap().texts(), needed, "{}", table.name);

        for (field, (name, member)) in arrow.fields().iter().zip(properties) {
            let place = format!("{}.{name}", table.name);
            assert_eq!(member.text_of("x-unit"), field.metadata()["unit"], "{place}");
            assert_eq!(member.text_of("x-space"), field.metadata()["space"], "{place}");
            // The doc comment's line breaks are blanks in Arrow's metadata.
            assert_eq!(
                member.text_of("description").replace('\n', " "),
                field.metadata()["description"],
                "{place}"
            );
            assert_eq!(json_type(member), field.data_type().to_string(), "{place}");
        }
        assert_eq!(schema.text_of("x-table"), table.name);
    }
}

/// The Arrow type that a JSON Schema's member stands for.
fn json_type(member: &Ordered) -> String {
    match (member.text_of("type"), member.text_of("contentEncoding")) {
        ("integer", _) => "Int64".to_owned(),
        ("number", _) => "Float64".to_owned(),
        ("boolean", _) => "Boolean".to_owned(),
        ("string", "base16") => "Binary".to_owned(),
        ("string", _) => "Utf8".to_owned(),
        ("array", _) => {
            let element = member.get("items").map(json_type).unwrap_or_default();
            format!("List(non-null {element}, field: 'element')")
        }
        (other, _) => other.to_owned(),
    }
}

/// Holds rows against their schema; then changes each in ways that the schema must refuse.
fn rows_satisfy<R: Serialize>(name: &str, rows: &[R]) {
    let schema: Value = serde_json::from_str(&json_schema(name).unwrap()).unwrap();
    let required: Vec<String> =
        schema["required"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect();
    let validator = jsonschema::draft202012::new(&schema).unwrap();
    for row in rows {
        let value = serde_json::to_value(row).unwrap();
        if let Err(error) = validator.validate(&value) {
            panic!("{name}: {value}: {error}");
        }
        for member in &required {
            let mut without = value.clone();
            without.as_object_mut().unwrap().remove(member);
            assert!(!validator.is_valid(&without), "{name}: a row without {member} satisfies the schema");
        }
        for member in value.as_object().unwrap().keys() {
            let mut changed: Map<String, Value> = value.as_object().unwrap().clone();
            changed.insert(member.clone(), Value::Null);
            assert!(
                !validator.is_valid(&Value::from(changed)),
                "{name}: a null {member} satisfies the schema"
            );
        }
    }
}

#[test]
fn rows_as_json_satisfy_their_schema() {
    let sequence = sample();
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => { $(rows_satisfy(stringify!($name), &sequence.$name);)+ };
    }
    every_table!(each);
    rows_satisfy("manifest", &[&sequence.manifest]);
    let summary = TableSummary { table: "frames".to_owned(), rows: 1, sha256: "0".repeat(64) };
    rows_satisfy("table_summaries", &[summary]);
    let full = CatalogueEntry {
        description: Some("a".to_owned()),
        dataset_sequence: Some("b".to_owned()),
        licence: Some("c".to_owned()),
        noise: Some("d".to_owned()),
        first_stamp_nanos: Some(1),
        last_stamp_nanos: Some(2),
        path_length: Some(0.5),
        min_x: Some(-1.0),
        max_z: Some(1.0),
        tables: vec!["frames".to_owned()],
        estimates: vec!["point-ba".to_owned(), "mine".to_owned()],
        ..CatalogueEntry::default()
    };
    rows_satisfy(CATALOGUE.name, &[full, CatalogueEntry::default()]);
}

#[test]
fn members_that_a_schema_does_not_know_are_permitted() {
    let mut value = serde_json::to_value(&sample().manifest).unwrap();
    value["later"] = json!({ "version": 2 });
    let schema: Value = serde_json::from_str(&json_schema("manifest").unwrap()).unwrap();
    jsonschema::draft202012::new(&schema).unwrap().validate(&value).unwrap();
    assert_eq!(serde_json::from_value::<Manifest>(value).unwrap(), sample().manifest);
}

#[test]
fn an_mcap_file_carries_the_very_same_schemas() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.mcap");
    format::write(&path, &sample(), WriteOptions::default()).unwrap();
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut topics = BTreeSet::new();
    for channel in summary.channels.values() {
        let schema = channel.schema.as_ref().unwrap();
        let name = channel.topic.strip_prefix('/').unwrap();
        topics.insert(name.to_owned());
        if let Some(table) = table_info(name) {
            assert_eq!((channel.message_encoding.as_str(), schema.encoding.as_str()), ("arrow", "arrow"));
            assert_eq!(schema.name, format!("open_structure.{}", table.record));
            let found = arrow::ipc::convert::try_schema_from_ipc_buffer(&schema.data).unwrap();
            assert_eq!(Arc::new(found), arrow_schema(table));
        } else {
            assert_eq!((channel.message_encoding.as_str(), schema.encoding.as_str()), ("json", "jsonschema"));
            assert_eq!(schema.name, format!("open_structure.{name}"));
            assert_eq!(String::from_utf8(schema.data.to_vec()).unwrap(), read_spec(&file(name)), "{name}");
        }
    }
    assert_eq!(topics, names_in_sequences().into_iter().map(str::to_owned).collect());
}

#[test]
fn parquet_files_carry_the_arrow_schemas() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample");
    format::write(&path, &sample(), WriteOptions::default()).unwrap();
    for table in TABLES {
        let file = fs::File::open(path.join(format!("{}.parquet", table.name))).unwrap();
        let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::default()).unwrap();
        let fields = |schema: &Schema| schema.fields().clone();
        assert_eq!(fields(metadata.schema()), fields(&arrow_schema(table)), "{}", table.name);
    }
}
