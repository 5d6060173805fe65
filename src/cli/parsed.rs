//! Values on the command line that have to lie in a range: what is wrong is said before any work.

/// Most threads that may be asked for; more only cost memory.
const MOST_THREADS: usize = 1024;

/// A number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    let threads = at_least_one(text)?;
    if threads > MOST_THREADS { Err(format!("expected at most {MOST_THREADS} threads")) } else { Ok(threads) }
}

/// A whole number over zero.
pub(super) fn at_least_one(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|number| *number > 0)
        .ok_or_else(|| "expected a whole number over zero".to_owned())
}

/// A finite number over zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|n| *n > 0.0 && n.is_finite()).ok_or_else(|| "expected a number over zero".to_owned())
}

/// A finite number that is not below zero.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|n| *n >= 0.0 && n.is_finite()).ok_or_else(|| "expected a number not below zero".to_owned())
}
