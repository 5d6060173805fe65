//! JSON Schemas (2020-12) of the manifest and of every row, made from the Rust types.

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::Value;

use crate::structure::{Manifest, TableSummary, for_each_table};

/// Where the schemas of this specification version are named.
const BASE: &str = "https://open-structure.github.io/spec/1.0.0/schemas/";

/// The schema of a type, as pretty JSON with a final newline: the very bytes of `spec/schemas`.
///
/// Sub-schemas are inlined and absent values are left out rather than null, because viewers of MCAP
/// files understand neither references nor unions.
fn schema_text<T: JsonSchema>(name: &str) -> String {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    RecursiveTransform(without_null).transform(&mut schema);
    schema.insert("$id".to_owned(), Value::String(format!("{BASE}{name}.schema.json")));
    let mut text = serde_json::to_string_pretty(schema.as_value()).unwrap_or_default();
    text.push('\n');
    text
}

/// An absent value is left out, so `null` is never there.
fn without_null(schema: &mut Schema) {
    if let Some(Value::Array(types)) = schema.get_mut("type") {
        types.retain(|entry| entry != "null");
        if let [single] = types.as_slice() {
            let single = single.clone();
            schema.insert("type".to_owned(), single);
        }
    }
    if let Some(Value::Array(alternatives)) = schema.get("anyOf") {
        let others: Vec<Value> = alternatives
            .iter()
            .filter(|entry| entry.get("type") != Some(&Value::from("null")))
            .cloned()
            .collect();
        if let (true, [Value::Object(single)]) = (others.len() < alternatives.len(), others.as_slice()) {
            let single = single.clone();
            schema.remove("anyOf");
            for (key, value) in single {
                if schema.get(&key).is_none() {
                    schema.insert(key, value);
                }
            }
        }
    }
    if schema.get("default") == Some(&Value::Null) {
        schema.remove("default");
    }
}

macro_rules! by_name {
    ($($name:ident: $row:ident,)+) => {
        /// The JSON Schema of `manifest`, `table_summaries` or a table's rows, as it stands in `spec/schemas`.
        #[must_use]
        pub fn json_schema(name: &str) -> Option<String> {
            match name {
                "manifest" => Some(schema_text::<Manifest>(name)),
                "table_summaries" => Some(schema_text::<TableSummary>(name)),
                $(stringify!($name) => Some(schema_text::<crate::structure::$row>(name)),)+
                _ => None,
            }
        }
    };
}
for_each_table!(by_name);
