//! BAL files as text, to the last digit.

use std::io::{BufRead, Write};
use std::str::FromStr;

use super::problem::{BalCamera, BalObservation, BalProblem};
use crate::exchange::Error;
use crate::exchange::lines::{Lines, MOST_ELEMENTS, finite};

/// The words of a file one after the other: where a line ends does not matter.
struct Words<R> {
    lines: Lines<R>,
    /// Words of the current line that are still to come, the last one first.
    waiting: Vec<String>,
}

impl<R: BufRead> Words<R> {
    fn next(&mut self, what: &str) -> Result<String, Error> {
        match self.next_or_end()? {
            Some(word) => Ok(word),
            None => Err(Error::content("", self.lines.number(), what, "the end of the file")),
        }
    }

    fn next_or_end(&mut self) -> Result<Option<String>, Error> {
        while self.waiting.is_empty() {
            let Some(mut fields) = self.lines.fields()? else { return Ok(None) };
            while let Some(word) = fields.word_or_end() {
                self.waiting.push(word.to_owned());
            }
            self.waiting.reverse();
        }
        Ok(self.waiting.pop())
    }

    fn wrong(&self, expected: String, found: &str) -> Error {
        Error::content("", self.lines.number(), expected, found)
    }

    fn whole<T: FromStr + PartialOrd + ToString>(&mut self, what: &str, below: T) -> Result<T, Error> {
        let word = self.next(what)?;
        let number = word.parse().ok().filter(|number: &T| *number < below);
        number.ok_or_else(|| self.wrong(format!("{what}, a whole number below {}", below.to_string()), &word))
    }

    fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let word = self.next(what)?;
            *number = finite(&word).ok_or_else(|| self.wrong(format!("{what}, a finite number"), &word))?;
        }
        Ok(numbers)
    }
}

/// A problem of BAL, of the uncompressed text form.
///
/// # Errors
/// [`Error::Content`] with the line for a number that is none or is not finite, a count of over [`MOST_ELEMENTS`], an
/// observation of a camera or point that is not there, a file that ends early or goes on.
pub fn read_bal(input: impl BufRead) -> Result<BalProblem, Error> {
    let mut words = Words { lines: Lines::new("", input), waiting: Vec::new() };
    let most = MOST_ELEMENTS + 1;
    let [cameras, points, observations] = [
        words.whole("the number of cameras", most)?,
        words.whole("the number of points", most)?,
        words.whole("the number of observations", most)?,
    ];
    let mut problem = BalProblem::default();
    for _ in 0..observations {
        let camera = words.whole("the place of a camera", cameras)?;
        let point = words.whole("the place of a point", points)?;
        problem.observations.push(BalObservation { camera, point, pixel: words.numbers("a pixel")? });
    }
    for _ in 0..cameras {
        problem.cameras.push(BalCamera::from_numbers(words.numbers("a camera")?));
    }
    for _ in 0..points {
        problem.points.push(words.numbers("a point")?);
    }
    match words.next_or_end()? {
        None => Ok(problem),
        Some(word) => Err(words.wrong("the end of the file".to_owned(), &word)),
    }
}

/// Writes a problem that [`read_bal`] reads to the same bits.
///
/// # Errors
/// [`Error::Io`] when the output fails.
pub fn write_bal(output: &mut dyn Write, problem: &BalProblem) -> Result<(), Error> {
    let BalProblem { cameras, points, observations } = problem;
    writeln!(output, "{} {} {}", cameras.len(), points.len(), observations.len())?;
    for BalObservation { camera, point, pixel: [u, v] } in observations {
        writeln!(output, "{camera} {point} {u:?} {v:?}")?;
    }
    for camera in cameras {
        for number in camera.numbers() {
            writeln!(output, "{number:?}")?;
        }
    }
    for number in points.iter().flatten() {
        writeln!(output, "{number:?}")?;
    }
    Ok(())
}
