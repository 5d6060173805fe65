//! Lines of numbers, with complaints that say where.

use std::fmt::Display;
use std::str::{FromStr, SplitAsciiWhitespace};

/// One line of a file.
pub struct Line<'a> {
    path: &'a str,
    number: usize,
    words: SplitAsciiWhitespace<'a>,
}

impl<'a> Line<'a> {
    /// The lines of a text that are neither empty nor a remark.
    pub fn all(path: &'a str, text: &'a str) -> impl Iterator<Item = Self> {
        (1..).zip(text.lines()).filter_map(move |(number, line)| {
            let is_told = !line.trim().is_empty() && !line.starts_with('#');
            is_told.then(|| Self { path, number, words: line.split_ascii_whitespace() })
        })
    }

    /// The next word.
    pub fn word(&mut self) -> Result<&'a str, String> {
        self.words.next().ok_or_else(|| self.complaint("expected another word"))
    }

    /// The next number.
    pub fn number<T: FromStr>(&mut self) -> Result<T, String> {
        let word = self.word()?;
        word.parse().map_err(|_| self.complaint(format!("expected a number; found {word}")))
    }

    /// The next numbers.
    pub fn numbers<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }

    /// What a list has at the place that is the next number.
    pub fn of<T: Copy>(&mut self, list: &[T]) -> Result<T, String> {
        let place: usize = self.number()?;
        let found = list.get(place).copied();
        found.ok_or_else(|| self.complaint(format!("expected a place below {}; found {place}", list.len())))
    }

    /// What is wrong, and where.
    pub fn complaint(&self, what: impl Display) -> String {
        format!("{} line {}: {what}", self.path, self.number)
    }
}

/// The text of a file.
pub fn text(path: &str) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|cause| format!("{path}: {cause}"))
}
