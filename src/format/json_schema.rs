//! JSON Schemas (2020-12) of the manifest and of every row, made from the Rust types.

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde::{Serialize, Serializer, ser::SerializeMap as _};
use serde_json::Value;

use super::member_names::{Members, member_names};
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{
    Camera, CatalogueEntry, Clock, Conventions, Distortion, Exclusion, Generator, Manifest, Noise, Recovery,
    Source, SourceFile, TableSummary, for_each_table,
};

/// Where the schemas of this specification version are named.
const BASE: &str = "https://open-structure.github.io/spec/";

/// The schema of a type, as pretty JSON with a final newline: the very bytes of `spec/schemas`.
///
/// Sub-schemas are inlined and absent values are left out rather than null, because viewers of MCAP
/// files understand neither references nor unions. Members stand in the order of the Rust fields, whatever
/// the maps of `serde_json` do, so that the bytes are the same in every build.
fn schema_text<T: JsonSchema + for<'de> serde::Deserialize<'de>>(name: &str) -> String {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    RecursiveTransform(without_null).transform(&mut schema);
    schema
        .insert("$id".to_owned(), Value::String(format!("{BASE}{SPEC_VERSION}/schemas/{name}.schema.json")));
    let orders = orders::<T>();
    let ordered = Ordered { value: schema.as_value(), orders: &orders, members: None };
    let mut text = serde_json::to_string_pretty(&ordered).unwrap_or_default();
    text.push('\n');
    text
}

/// Keywords that come first in a schema; the others follow by name.
const KEYWORDS: Members = &["$schema", "$id", "title", "description", "type", "properties"];

/// Members of the structs that a schema of `T` may show.
fn orders<T: for<'de> serde::Deserialize<'de>>() -> Vec<Members> {
    vec![
        member_names::<T>(),
        member_names::<Source>(),
        member_names::<SourceFile>(),
        member_names::<Generator>(),
        member_names::<Conventions>(),
        member_names::<Clock>(),
        member_names::<Camera>(),
        member_names::<Distortion>(),
        member_names::<Noise>(),
        member_names::<Recovery>(),
        member_names::<Exclusion>(),
        member_names::<TableSummary>(),
    ]
}

/// A schema whose objects are written in a fixed order.
struct Ordered<'a> {
    value: &'a Value,
    orders: &'a [Members],
    /// The members' order, where the value is the `properties` of a struct.
    members: Option<Members>,
}

impl Ordered<'_> {
    /// The order of the struct that has exactly these members.
    fn order_of(&self, properties: &Value) -> Option<Members> {
        let object = properties.as_object()?;
        self.orders
            .iter()
            .copied()
            .find(|order| order.len() == object.len() && order.iter().all(|name| object.contains_key(*name)))
    }
}

impl Serialize for Ordered<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let below = |value, members| Ordered { value, orders: self.orders, members };
        match self.value {
            Value::Array(values) => serializer.collect_seq(values.iter().map(|value| below(value, None))),
            Value::Object(object) => {
                let order = self.members.unwrap_or(KEYWORDS);
                let rank = |key: &str| order.iter().position(|name| *name == key).unwrap_or(order.len());
                let mut entries: Vec<_> = object.iter().collect();
                entries.sort_by_key(|(key, _)| (rank(key), key.as_str()));
                let mut map = serializer.serialize_map(Some(entries.len()))?;
                for (key, value) in entries {
                    let members = (self.members.is_none() && key == "properties")
                        .then(|| self.order_of(value))
                        .flatten();
                    map.serialize_entry(key, &below(value, members))?;
                }
                map.end()
            }
            other => other.serialize(serializer),
        }
    }
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
        /// The JSON Schema of `manifest`, `table_summaries` or the rows of a table, be it of sequences or of collections, as it stands in `spec/schemas`.
        #[must_use]
        pub fn json_schema(name: &str) -> Option<String> {
            match name {
                "manifest" => Some(schema_text::<Manifest>(name)),
                "table_summaries" => Some(schema_text::<TableSummary>(name)),
                "catalogue" => Some(schema_text::<CatalogueEntry>(name)),
                $(stringify!($name) => Some(schema_text::<crate::structure::$row>(name)),)+
                _ => None,
            }
        }
    };
}
for_each_table!(by_name);
