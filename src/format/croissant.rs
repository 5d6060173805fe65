//! A Croissant description of a Parquet folder: what data catalogues read.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::{Error, names};
use crate::structure::{ColumnType, Manifest, TableInfo, hex, table_info};

/// Croissant 1.1 JSON-LD of the folder's tables, with licence, citation and SHA-256 of each file.
pub(super) fn croissant(folder: &Path, manifest: &Manifest) -> Result<String, Error> {
    let mut distribution = vec![file_object(folder, names::MANIFEST_FILE, "application/json")?];
    let mut record_sets = Vec::new();
    for summary in &manifest.tables {
        if let Some(table) = table_info(&summary.table) {
            distribution.push(file_object(
                folder,
                &format!("{}.parquet", table.name),
                "application/x-parquet",
            )?);
            record_sets.push(record_set(table));
        }
    }
    let source = &manifest.source;
    let mut description = json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": manifest.name,
        "description": manifest.description.clone().unwrap_or_else(|| {
            format!("Open-Structure sequence {}: measurements, landmarks and ground truth for SLAM", manifest.name)
        }),
        "version": manifest.spec_version,
        "distribution": distribution,
        "recordSet": record_sets,
    });
    for (key, value) in [("license", &source.licence), ("citeAs", &source.citation), ("url", &source.url)] {
        if let Some(value) = value {
            description[key] = Value::from(value.as_str());
        }
    }
    // Sorted by key already, unless some crate asks `serde_json` to keep the order of insertion.
    description.sort_all_objects();
    let mut text = serde_json::to_string_pretty(&description).unwrap_or_default();
    text.push('\n');
    Ok(text)
}

fn file_object(folder: &Path, name: &str, format: &str) -> Result<Value, Error> {
    let path = folder.join(name);
    let mut file = File::open(&path).map_err(Error::io(&path))?;
    let (mut hasher, mut buffer, mut bytes) = (Sha256::new(), vec![0; 1 << 16], 0);
    loop {
        match file.read(&mut buffer).map_err(Error::io(&path))? {
            0 => break,
            read => {
                hasher.update(&buffer[..read]);
                bytes += read;
            }
        }
    }
    Ok(json!({
        "@type": "cr:FileObject",
        "@id": name,
        "name": name,
        "contentUrl": name,
        "contentSize": format!("{bytes} B"),
        "encodingFormat": format,
        "sha256": hex(&hasher.finalize()),
    }))
}

fn record_set(table: &TableInfo) -> Value {
    let file = format!("{}.parquet", table.name);
    let fields: Vec<Value> = table
        .fields
        .iter()
        .map(|field| {
            let mut value = json!({
                "@type": "cr:Field",
                "@id": format!("{}/{}", table.name, field.name),
                "name": field.name,
                "description": format!("{} Unit: {}. Space: {}.", field.description(), field.unit, field.space),
                "dataType": data_type(field.kind),
                "source": { "fileObject": { "@id": file }, "extract": { "column": field.name } },
            });
            if matches!(field.kind, ColumnType::Int64List | ColumnType::Float64List | ColumnType::Utf8List) {
                value["isArray"] = Value::from(true);
                value["arrayShape"] = Value::from("-1");
            }
            value
        })
        .collect();
    let key: Vec<Value> =
        table.key.iter().map(|column| json!({ "@id": format!("{}/{column}", table.name) })).collect();
    json!({
        "@type": "cr:RecordSet",
        "@id": table.name,
        "name": table.name,
        "description": table.description(),
        "key": key,
        "field": fields,
    })
}

fn data_type(kind: ColumnType) -> &'static str {
    match kind {
        ColumnType::Int64 | ColumnType::Int64List => "sc:Integer",
        ColumnType::Float64 | ColumnType::Float64List => "sc:Float",
        ColumnType::Boolean => "sc:Boolean",
        ColumnType::Utf8 | ColumnType::Binary | ColumnType::Utf8List => "sc:Text",
    }
}

/// The JSON-LD context that the Croissant 1.1 specification prescribes.
fn context() -> Value {
    json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "arrayShape": "cr:arrayShape",
        "citeAs": "cr:citeAs",
        "column": "cr:column",
        "conformsTo": "dct:conformsTo",
        "cr": "http://mlcommons.org/croissant/",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataBiasDescription": "cr:dataBiasDescription",
        "dataCollection": "cr:dataCollection",
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "dct": "http://purl.org/dc/terms/",
        "examples": { "@id": "cr:examples", "@type": "@json" },
        "extract": "cr:extract",
        "field": "cr:field",
        "fileObject": "cr:fileObject",
        "fileProperty": "cr:fileProperty",
        "fileSet": "cr:fileSet",
        "format": "cr:format",
        "includes": "cr:includes",
        "isArray": "cr:isArray",
        "isLiveDataset": "cr:isLiveDataset",
        "jsonPath": "cr:jsonPath",
        "key": "cr:key",
        "md5": "cr:md5",
        "parentField": "cr:parentField",
        "path": "cr:path",
        "personalSensitiveInformation": "cr:personalSensitiveInformation",
        "recordSet": "cr:recordSet",
        "references": "cr:references",
        "regex": "cr:regex",
        "repeated": "cr:repeated",
        "replace": "cr:replace",
        "sc": "https://schema.org/",
        "separator": "cr:separator",
        "source": "cr:source",
        "subField": "cr:subField",
        "transform": "cr:transform",
    })
}
