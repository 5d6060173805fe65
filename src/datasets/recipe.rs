//! A recipe: one sequence, its images, their camera, and how it is converted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::convert_options::{self, ConvertOptions};
use super::remote_file::check_url;
use super::{CameraOfDataset, Error, Part};
use crate::structure::registry;

/// Largest recipe that is read, bytes.
pub const MAX_RECIPE_BYTES: u64 = 1 << 20;

/// A dataset whose layout the converter reads; its name is the converter's command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Dataset {
    /// TUM RGB-D.
    Tum,
    /// ICL-NUIM.
    Icl,
    /// TartanAir.
    Tartanair,
}

impl Dataset {
    /// The command of `os-convert` that reads it.
    #[must_use]
    pub const fn command(self) -> &'static str {
        match self {
            Self::Tum => "tum",
            Self::Icl => "icl",
            Self::Tartanair => "tartanair",
        }
    }

    /// Name of the dataset, as it stands in the manifest of a converted sequence.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tum => registry::TUM_RGBD,
            Self::Icl => registry::ICL_NUIM,
            Self::Tartanair => registry::TARTANAIR,
        }
    }
}

/// One sequence of the paper that comes from images: where those are published, and what is made of them.
///
/// A length or digest that nobody has told is absent, never invented.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Name of the sequence.
    pub name: String,
    /// What the sequence shows, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// The dataset that the images belong to.
    pub dataset: Dataset,
    /// Name of the sequence in its dataset.
    pub sequence: String,
    /// Where the dataset is published.
    pub url: String,
    /// Licence of the images, as an SPDX expression.
    pub licence: String,
    /// How to cite the dataset.
    pub citation: String,
    /// The camera that took the images.
    pub camera: CameraOfDataset,
    /// Options of the converter that differ from its own.
    #[serde(default, skip_serializing_if = "ConvertOptions::is_empty")]
    pub convert: ConvertOptions,
    /// The images.
    pub raw: Part,
    /// What the first text release has of the sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub text_release: Option<Part>,
}

impl Recipe {
    /// Reads a recipe from the text of a TOML file.
    ///
    /// # Errors
    /// [`Error::Value`] with the place in the text where it is not a recipe, and those of [`check`](Self::check).
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let recipe: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            let place = line.map_or_else(|| "recipe".to_owned(), |line| format!("recipe, line {line}"));
            Error::value(place, "a recipe of a dataset", error.message())
        })?;
        recipe.check()?;
        Ok(recipe)
    }

    /// The JSON Schema (2020-12) of a recipe; TOML has the same shape.
    #[must_use]
    pub fn json_schema() -> String {
        let settings = schemars::generate::SchemaSettings::draft2020_12()
            .with(|settings| settings.inline_subschemas = true);
        let mut schema = settings.into_generator().into_root_schema_for::<Self>();
        schema.insert("$id".to_owned(), "https://open-structure.github.io/dataset.schema.json".into());
        let mut text = serde_json::to_string_pretty(schema.as_value()).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Arguments of `os-convert` that make the sequence of a folder with its images.
    ///
    /// * `recipe` — what this recipe is known by to `os-convert`: its name, or its file.
    #[must_use]
    pub fn arguments(&self, folder: &str, output: &str, recipe: &str) -> Vec<String> {
        let words = [self.dataset.command(), folder, "-o", output, "--recipe", recipe];
        let mut arguments = words.map(str::to_owned).to_vec();
        arguments.extend(convert_options::arguments(&self.convert));
        arguments
    }

    /// Looks at every value.
    ///
    /// # Errors
    /// [`Error::Value`] with the place, what is expected and what was found.
    pub fn check(&self) -> Result<(), Error> {
        let letters = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-';
        if self.name.is_empty()
            || self.name.len() > 100
            || !self.name.bytes().all(letters)
            || self.name.starts_with('-')
        {
            return Err(Error::value(
                "name",
                "1 to 100 letters, digits, underscores and hyphens",
                format!("{:?}", self.name),
            ));
        }
        for (place, text) in
            [("sequence", &self.sequence), ("licence", &self.licence), ("citation", &self.citation)]
        {
            if text.trim().is_empty() || text.len() > 1000 || text.chars().any(char::is_control) {
                return Err(Error::value(place, "1 to 1000 printable bytes", format!("{text:?}")));
            }
        }
        check_url(&self.url, "url")?;
        self.camera.check()?;
        convert_options::check(&self.convert)?;
        self.raw.check("raw")?;
        self.text_release.as_ref().map_or(Ok(()), |part| part.check("text_release"))
    }
}
