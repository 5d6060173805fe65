//! Options of the converter, as a recipe gives them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Error;

/// Options of `os-convert` by name: `max_features = 1000` is `--max-features 1000`.
///
/// Which there are, and what they may be, the converter knows.
pub type ConvertOptions = BTreeMap<String, OptionValue>;

/// The value of an option.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum OptionValue {
    /// A switch; `false` leaves it out.
    Switch(bool),
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A text, such as the range `0..60`.
    Text(String),
}

/// Most options of a recipe.
const MOST: usize = 200;

pub(super) fn check(options: &ConvertOptions) -> Result<(), Error> {
    if options.len() > MOST {
        return Err(Error::value("convert", format!("at most {MOST} options"), options.len()));
    }
    for (name, value) in options {
        let place = format!("convert.{}", name.escape_default().take(80).collect::<String>());
        let letters = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
        if name.len() > 64
            || !name.bytes().all(letters)
            || !name.starts_with(|first: char| first.is_ascii_lowercase())
        {
            return Err(Error::value(
                place,
                "a name of lower-case letters, digits and underscores",
                format!("{name:?}"),
            ));
        }
        match value {
            OptionValue::Number(number) if !number.is_finite() => {
                return Err(Error::value(place, "a finite number", number));
            }
            OptionValue::Text(text) if text.len() > 200 || text.chars().any(char::is_control) => {
                return Err(Error::value(place, "at most 200 printable bytes", format!("{text:?}")));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Options as arguments of a program.
pub(super) fn arguments(options: &ConvertOptions) -> Vec<String> {
    let mut arguments = Vec::new();
    for (name, value) in options {
        let value = match value {
            OptionValue::Switch(false) => continue,
            OptionValue::Switch(true) => None,
            OptionValue::Whole(number) => Some(number.to_string()),
            OptionValue::Number(number) => Some(number.to_string()),
            OptionValue::Text(text) => Some(text.clone()),
        };
        arguments.push(format!("--{}", name.replace('_', "-")));
        arguments.extend(value);
    }
    arguments
}
