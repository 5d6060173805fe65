//! Numbers as people read them.

/// What stands for a number that is not there.
pub(super) const NONE: &str = "–";

/// A count in groups of three digits: `1 234 567`, with narrow blanks that do not break.
pub(super) fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::with_capacity(2 * digits.len());
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// About three digits; very small and very large ones with a power of ten.
pub(super) fn short(number: f64) -> String {
    if !number.is_finite() {
        return NONE.to_owned();
    }
    let size = number.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e7).contains(&size) {
        return format!("{number:.2e}");
    }
    let decimals = match size {
        size if size >= 100.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        size if size >= 0.1 => 3,
        _ => 4,
    };
    // Counts, and medians of them, are whole or halves.
    if number.fract() == 0.0 { format!("{number:.0}") } else { format!("{number:.decimals$}") }
}

/// As [`short`], of a number that may be absent.
pub(super) fn maybe(number: Option<f64>) -> String {
    number.map_or_else(|| NONE.to_owned(), short)
}

/// A size in bytes.
pub(super) fn bytes(number: u64) -> String {
    let mut size = number as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        if size < 1000.0 {
            return format!("{} {unit}", short(size));
        }
        size /= 1000.0;
    }
    format!("{} TB", short(size))
}

/// Every n-th place of a list of some length, so that at most `most` are left; the last one always.
pub(super) fn thinned(length: usize, most: usize) -> Vec<usize> {
    let step = length.div_ceil(most.max(1)).max(1);
    let mut places: Vec<usize> = (0..length).step_by(step).collect();
    if length > 0 && places.last() != Some(&(length - 1)) {
        places.push(length - 1);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_about_three_digits() {
        let found = [0.0, 0.012_34, 0.5, 12.345, 1234.5, 90.0, 1e9, -3e-7].map(short);
        assert_eq!(found, ["0", "0.0123", "0.500", "12.3", "1234", "90", "1.00e9", "-3.00e-7"]);
        assert_eq!((short(f64::NAN), maybe(None)), (NONE.to_owned(), NONE.to_owned()));
        assert_eq!((count(1_234_567), count(12)), ("1\u{202f}234\u{202f}567".to_owned(), "12".to_owned()));
        assert_eq!((bytes(999), bytes(1_500_000)), ("999 B".to_owned(), "1.50 MB".to_owned()));
    }

    #[test]
    fn first_and_last_are_kept() {
        assert_eq!(thinned(0, 5), [0_usize; 0]);
        assert_eq!(thinned(3, 5), [0, 1, 2]);
        assert_eq!(thinned(11, 5), [0, 3, 6, 9, 10]);
    }
}
