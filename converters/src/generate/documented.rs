//! A configuration with every option, its meaning, and its default.

use std::fmt::Write as _;

use serde_json::Value;

use super::Options;

/// A configuration in TOML with every option as it is, and above each what it means.
#[must_use]
pub fn documented(options: &Options) -> String {
    let mut settings = schemars::generate::SchemaSettings::draft2020_12();
    settings.inline_subschemas = true;
    let schema = settings.into_generator().into_root_schema_for::<Options>().to_value();
    let values = serde_json::to_value(options).unwrap_or_default();
    let mut text = String::from(
        "# Configuration of os-convert: every option with its default. Leave out what may stay.\n",
    );
    table(&mut text, "", &schema, &values);
    text
}

/// The options of a table, then its tables.
fn table(text: &mut String, path: &str, schema: &Value, values: &Value) {
    let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
    let mut tables = Vec::new();
    for (name, property) in properties {
        let value = &values[name];
        let shape = inner(property);
        if shape.get("properties").is_some() {
            tables.push((name, property, shape, value));
            continue;
        }
        text.push('\n');
        describe(text, property);
        if let Some(choices) = choices(shape) {
            let _ = writeln!(text, "# One of {choices}.");
        }
        let _ = match value {
            Value::Null => writeln!(text, "# {name} ="),
            value => writeln!(text, "{name} = {value}"),
        };
    }
    for (name, property, shape, value) in tables {
        let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        text.push('\n');
        describe(text, property);
        // One that is left out is commented out with all that is in it.
        let mut own = String::new();
        let _ = writeln!(own, "[{path}]");
        table(&mut own, &path, shape, value);
        if value.is_null() {
            own = own
                .lines()
                .map(|line| {
                    if line.is_empty() || line.starts_with('#') {
                        format!("{line}\n")
                    } else {
                        format!("# {line}\n")
                    }
                })
                .collect();
        }
        text.push_str(&own);
    }
}

/// What an optional property is when it is there.
fn inner(property: &Value) -> &Value {
    let one_of = property.get("anyOf").or_else(|| property.get("oneOf")).and_then(Value::as_array);
    let table = one_of.and_then(|shapes| shapes.iter().find(|shape| shape.get("properties").is_some()));
    table.unwrap_or(property)
}

/// The values of a property that has a few.
fn choices(property: &Value) -> Option<String> {
    let words = |value: &Value| value.as_str().map(|word| format!("\"{word}\""));
    let list: Option<Vec<String>> = if let Some(values) = property.get("enum").and_then(Value::as_array) {
        values.iter().map(words).collect()
    } else {
        let shapes = property.get("oneOf")?.as_array()?;
        shapes.iter().map(|shape| shape.get("const").and_then(words)).collect()
    };
    Some(list?.join(", "))
}

fn describe(text: &mut String, property: &Value) {
    let description = property.get("description").and_then(Value::as_str).unwrap_or_default();
    for line in description.lines() {
        let _ = writeln!(text, "# {line}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_printed_is_read_and_changes_nothing() {
        let text = documented(&Options::default());
        assert_eq!(Options::from_toml(&text).unwrap(), Options::default(), "{text}");
        let mut options = Options { seed: 7, ..Options::default() };
        options.points.max_features = 50;
        options.depth.farthest_m = Some(3.5);
        assert_eq!(Options::from_toml(&documented(&options)).unwrap(), options);
    }

    #[test]
    fn every_option_is_explained() {
        let text = documented(&Options::default());
        let mut before = "";
        for line in text.lines() {
            if line.contains(" =") && !line.starts_with("# ") {
                assert!(before.starts_with("# "), "{line}");
            }
            before = line;
        }
        assert!(text.matches(" = ").count() > 40, "{text}");
    }

    #[test]
    fn the_ends_of_a_range_are_in_it() {
        for text in ["[points]\nscale_factor = 1.01", "[points]\nscale_factor = 4.0"] {
            assert!(Options::from_toml(text).is_ok(), "{text}");
        }
    }

    #[test]
    fn wrong_options_are_named() {
        for (text, place) in [
            ("points.max_features = 1e9", "configuration"),
            ("[points]\nmax_features = 1000000", "points.max_features"),
            ("[lines]\nsight_part = -0.5", "lines.sight_part"),
            ("[lines]\nno_such = 1", "no_such"),
            ("[noise]\nmodel = \"paper\"\nsigma_depth_m = 1.0", "noise"),
            ("[segments]\ncanny = [50.0, 0.0]", "segments.canny[1]"),
            ("[depth]\nnearest_m = 5.0\nfarthest_m = 1.0", "depth.farthest_m"),
            ("seed = ", "configuration"),
        ] {
            let error = Options::from_toml(text).unwrap_err().to_string();
            assert!(error.contains(place), "{text}: {error}");
        }
    }
}
