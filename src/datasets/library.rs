//! The recipes that travel with the program: the sequences of the paper that come from images.

use super::{Error, Recipe};

macro_rules! recipes {
    ($($name:literal),+ $(,)?) => {
        /// Names and texts.
        const RECIPES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../sequences/", $name, ".toml")))),+];
    };
}
recipes!(
    "livingroom0",
    "livingroom1",
    "livingroom2",
    "livingroom3",
    "office0",
    "office1",
    "office2",
    "office3",
    "structure_texture_near",
    "structure_texture_far",
    "structure_notexture_near",
    "structure_notexture_far",
    "nostructure_texture_far",
    "nostructure_texture_near_withloop",
    "carwelding",
    "hospital",
    "japanesealley",
    "office",
);

/// Names of the recipes that travel with the program.
#[must_use]
pub fn names() -> Vec<&'static str> {
    RECIPES.iter().map(|(name, _)| *name).collect()
}

/// The recipe of a name.
///
/// # Errors
/// [`Error::Unknown`] when there is none of that name.
pub fn named(name: &str) -> Result<Recipe, Error> {
    match RECIPES.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => Recipe::from_toml(text),
        None => {
            Err(Error::Unknown { name: name.escape_default().take(200).collect(), known: names().join(", ") })
        }
    }
}
