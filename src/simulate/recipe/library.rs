//! The recipes that travel with the program: the simulated sequences of the paper.

use super::Recipe;
use crate::simulate::Error;

macro_rules! recipes {
    ($($name:literal),+ $(,)?) => {
        /// Names and texts.
        const RECIPES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../../sequences/", $name, ".toml")))),+];
    };
}
recipes!("box1", "box2", "corridor1", "corridor2", "sphere1", "sphere2");

/// Names of the recipes that travel with the program.
#[must_use]
pub fn names() -> Vec<&'static str> {
    RECIPES.iter().map(|(name, _)| *name).collect()
}

/// The recipe of a name.
///
/// # Errors
/// [`Error::Value`] when there is none of that name.
pub fn named(name: &str) -> Result<Recipe, Error> {
    match RECIPES.iter().find(|(known, _)| *known == name) {
        Some((_, text)) => Recipe::from_toml(text),
        None => Err(Error::value("recipe", format!("a file, or one of {}", names().join(", ")), name)),
    }
}
