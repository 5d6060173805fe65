//! Cases: text files that say what differs from the base, and which findings follow.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Map, Value};

use super::edit::{Edit, set};
use super::{Result, corpus_folder};

/// One of the two encodings, or a collection of sequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stored {
    Mcap,
    Parquet,
    Collection,
}

impl Stored {
    /// Those that every case is stored as unless it says otherwise.
    pub(crate) const USUAL: [Self; 2] = [Self::Mcap, Self::Parquet];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Mcap => "mcap",
            Self::Parquet => "parquet",
            Self::Collection => "collection",
        }
    }

    /// Name of the file or folder that holds a case.
    pub(crate) const fn file_name(self) -> &'static str {
        match self {
            Self::Mcap => "sequence.mcap",
            Self::Parquet => "sequence",
            Self::Collection => "collection",
        }
    }
}

/// A finding that follows from the defect.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Expected {
    pub(crate) rule: String,
    /// `error`, `warning` or `advice`.
    pub(crate) severity: String,
    /// The table concerned, where there is one.
    pub(crate) table: Option<String>,
    /// The encodings in which it follows; all by default.
    #[serde(default)]
    encodings: Vec<Stored>,
    /// Whether a validator may leave it out.
    #[serde(default)]
    pub(crate) optional: bool,
}

impl Expected {
    pub(crate) fn follows_in(&self, stored: Stored) -> bool {
        self.encodings.is_empty() || self.encodings.contains(&stored)
    }
}

/// One case, ready to be built.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    /// Path below the corpus, such as `invalid/quaternion-unit/too-long`.
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) encodings: Vec<Stored>,
    pub(crate) scene: Value,
    pub(crate) edits: Vec<Edit>,
    pub(crate) findings: Vec<Expected>,
}

impl Case {
    /// The rule that an invalid case is about.
    pub(crate) fn rule(&self) -> Option<&str> {
        self.name.strip_prefix("invalid/")?.split('/').next()
    }
}

/// The text of a case.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseText {
    title: String,
    #[serde(default)]
    encodings: Vec<Stored>,
    /// Changes of the base scene, by JSON pointer; `null` removes.
    #[serde(default)]
    scene: Map<String, Value>,
    #[serde(default)]
    edits: Vec<Edit>,
    #[serde(default)]
    findings: Vec<Expected>,
}

/// Every case of the corpus, by name.
pub(crate) fn cases() -> Result<Vec<Case>> {
    let folder = corpus_folder();
    let base = json(&folder.join("base.json"))?;
    let mut cases = Vec::new();
    for kind in ["valid", "invalid"] {
        for group in entries(&folder.join(kind))? {
            for file in entries(&group)? {
                let stem = |path: &Path| {
                    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
                };
                let name = format!("{kind}/{}/{}", stem(&group), stem(&file));
                read(&file, &name, &base, &mut cases).map_err(|error| format!("{name}: {error}"))?;
            }
        }
    }
    Ok(cases)
}

fn json(path: &Path) -> Result<Value> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let found = fs::read_dir(folder).map_err(failed)?;
    let mut paths: Vec<PathBuf> =
        found.map(|entry| entry.map(|entry| entry.path())).collect::<std::io::Result<_>>().map_err(failed)?;
    paths.sort();
    Ok(paths)
}

/// One text makes one case, or one for each entry of `each`, whose keys stand in the text as `$KEY`;
/// `names` says how they are called.
fn read(file: &Path, name: &str, base: &Value, cases: &mut Vec<Case>) -> Result<()> {
    let mut text = json(file)?;
    let map = text.as_object_mut().ok_or("not an object")?;
    let (Some(each), Some(names)) = (map.remove("each"), map.remove("names")) else {
        cases.push(case(name.to_owned(), text, base)?);
        return Ok(());
    };
    for values in each.as_array().ok_or("`each` is not a list")? {
        let values = values.as_object().ok_or("an entry of `each` is not an object")?;
        let (mut filled, mut suffix) = (text.clone(), names.clone());
        fill(&mut filled, values);
        fill(&mut suffix, values);
        let suffix = suffix.as_str().ok_or("`names` is not text")?;
        let suffix = suffix.replace(|letter: char| !letter.is_alphanumeric() && !"-_.".contains(letter), "");
        cases.push(case(format!("{name}-{suffix}"), filled, base)?);
    }
    Ok(())
}

fn case(name: String, text: Value, base: &Value) -> Result<Case> {
    let text: CaseText = serde_json::from_value(text).map_err(|error| format!("{name}: {error}"))?;
    let mut scene = base.clone();
    for (pointer, value) in &text.scene {
        set(&mut scene, pointer, Some(value).filter(|value| !value.is_null()))?;
    }
    let encodings = if text.encodings.is_empty() { Stored::USUAL.to_vec() } else { text.encodings };
    Ok(Case { name, title: text.title, encodings, scene, edits: text.edits, findings: text.findings })
}

/// Puts values in the place of their names: the whole value where a text is nothing but a name.
fn fill(text: &mut Value, values: &Map<String, Value>) {
    match text {
        Value::String(string) => match values.iter().find(|(name, _)| string.strip_prefix('$') == Some(name))
        {
            Some((_, value)) => *text = value.clone(),
            None => *string = filled(string, values),
        },
        Value::Array(list) => list.iter_mut().for_each(|entry| fill(entry, values)),
        Value::Object(map) => {
            map.values_mut().for_each(|entry| fill(entry, values));
            *map =
                std::mem::take(map).into_iter().map(|(key, value)| (filled(&key, values), value)).collect();
        }
        _ => {}
    }
}

/// A text with the values in the place of their names.
fn filled(text: &str, values: &Map<String, Value>) -> String {
    values.iter().fold(text.to_owned(), |text, (name, value)| {
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        text.replace(&format!("${name}"), &value)
    })
}
