//! A file of text by its name, where a format has several.

use super::Error;

/// A file that is to be written: its name within a folder, with `/`, and what it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextFile {
    /// Name within the folder, such as `baseline/venom_sequence.txt`.
    pub name: String,
    /// What it holds.
    pub text: String,
}

impl TextFile {
    pub(super) fn new(name: &str, text: String) -> Self {
        Self { name: name.to_owned(), text }
    }
}

/// Refuses a number that is not finite: text formats have no place for one.
pub(super) fn check_finite(what: impl Fn() -> String, numbers: &[f64]) -> Result<(), Error> {
    match numbers.iter().find(|number| !number.is_finite()) {
        None => Ok(()),
        Some(number) => Err(Error::unfit(what(), "finite numbers", format!("{number:?}"))),
    }
}
