//! The fields of a line: ids and numbers between blanks.

/// Why a line's fields cannot be used. What exactly is wrong is found out where it is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Defect {
    Count,
    Malformed,
    NonFinite,
}

/// The fields of one line, one by one.
#[derive(Debug)]
pub(super) struct Fields<'a> {
    rest: &'a [u8],
}

/// Blanks between fields; a carriage return is one, so that both line ends read alike.
pub(super) const fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | b'\r' | 0x0b | 0x0c)
}

impl<'a> Fields<'a> {
    pub(super) const fn new(rest: &'a [u8]) -> Self {
        Self { rest }
    }

    /// Ids, then numbers, then nothing more.
    pub(super) fn ids_and_numbers<const I: usize, const F: usize>(
        mut self,
    ) -> Result<([i64; I], [f64; F]), Defect> {
        let mut ids = [0; I];
        let mut numbers = [0.0; F];
        for id in &mut ids {
            *id = self.id()?;
        }
        for number in &mut numbers {
            *number = self.number()?;
        }
        if self.next().is_some() { Err(Defect::Count) } else { Ok((ids, numbers)) }
    }

    /// A whole number; also one written as a float, as some array writers do, where that is exact.
    pub(super) fn id(&mut self) -> Result<i64, Defect> {
        let field = self.next().ok_or(Defect::Count)?;
        short_id(field).or_else(|| long_id(field)).ok_or(Defect::Malformed)
    }

    fn number(&mut self) -> Result<f64, Defect> {
        let field = self.next().ok_or(Defect::Count)?;
        let value = number(field).ok_or(Defect::Malformed)?;
        if value.is_finite() { Ok(value) } else { Err(Defect::NonFinite) }
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|&byte| !is_blank(byte))?;
        let rest = &self.rest[start..];
        let length = rest.iter().position(|&byte| is_blank(byte)).unwrap_or(rest.len());
        let (field, rest) = rest.split_at(length);
        self.rest = rest;
        Some(field)
    }
}

/// Up to 18 digits, which cannot overflow.
fn short_id(field: &[u8]) -> Option<i64> {
    if field.is_empty() || field.len() > 18 {
        return None;
    }
    field.iter().try_fold(0, |id, &byte| byte.is_ascii_digit().then(|| id * 10 + i64::from(byte - b'0')))
}

#[cold]
fn long_id(field: &[u8]) -> Option<i64> {
    const EXACT: f64 = 9_007_199_254_740_992.0;
    let text = std::str::from_utf8(field).ok()?;
    if let Ok(id) = text.parse() {
        return Some(id);
    }
    // Digits too many for an i64 are no id, whatever float they round to.
    let float: f64 = text.parse().ok()?;
    #[expect(clippy::cast_possible_truncation, reason = "whole and below 2^53")]
    (text.contains(['.', 'e', 'E']) && float.fract() == 0.0 && float.abs() < EXACT).then_some(float as i64)
}

/// The f64 nearest to the decimal; infinite or nan where the text says so or is out of range.
fn number(field: &[u8]) -> Option<f64> {
    match short_number(field) {
        Some(value) => Some(value),
        None => std::str::from_utf8(field).ok()?.parse().ok(),
    }
}

/// Powers of ten that an f64 holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// A plain decimal of at most 15 digits: its digits and the power of ten are exact in f64, so that the one division
/// rounds once and correctly (Clinger 1990, "How to read floating point numbers accurately"). Others give none.
fn short_number(field: &[u8]) -> Option<f64> {
    let (negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, field),
    };
    if digits.len() > 16 {
        return None;
    }
    let mut mantissa = 0_u64;
    let mut count = 0;
    let mut point = None;
    for (place, &byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa * 10 + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(place),
            _ => return None,
        }
    }
    if count == 0 || count > 15 {
        return None;
    }
    let decimals = point.map_or(0, |place| digits.len() - place - 1);
    let value = mantissa as f64 / EXACT_POWERS[decimals];
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fields(line: &str) -> Vec<String> {
        Fields::new(line.as_bytes()).map(|field| String::from_utf8_lossy(field).into_owned()).collect()
    }

    #[test]
    fn runs_of_blanks_and_line_ends_separate_fields() {
        assert_eq!(fields("  1 \t  2  3\r"), ["1", "2", "3"]);
        assert!(fields(" \t \r").is_empty());
    }

    #[test]
    fn ids_reach_to_both_ends_of_an_i64_and_may_be_written_as_exact_floats() {
        let id = |text: &str| Fields::new(text.as_bytes()).id();
        assert_eq!(id("9223372036854775807"), Ok(i64::MAX));
        assert_eq!(id("-9223372036854775808"), Ok(i64::MIN));
        assert_eq!(id("0007"), Ok(7));
        assert_eq!(id("1.000000000000000000e+03"), Ok(1000));
        for no_id in ["9223372036854775808", "1.5", "1e300", "nan", "inf", "0x10", "", "-", "7a"] {
            assert!(id(no_id).is_err(), "{no_id}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_told_from_text_that_is_no_number() {
        let numbers = |text: &str| Fields::new(text.as_bytes()).ids_and_numbers::<0, 1>();
        for text in ["nan", "-nan", "NaN", "inf", "-inf", "Infinity", "1e999"] {
            assert_eq!(numbers(text), Err(Defect::NonFinite), "{text}");
        }
        for text in ["-", ".", "1.2.3", "1,5", "0x1p3", "1e", "--1", "1_0", "\u{ff11}"] {
            assert_eq!(numbers(text), Err(Defect::Malformed), "{text}");
        }
        assert_eq!(numbers("1 2"), Err(Defect::Count));
        assert_eq!(numbers(""), Err(Defect::Count));
        assert_eq!(numbers("-0").map(|(_, [zero])| zero.to_bits()), Ok((-0.0_f64).to_bits()));
    }

    proptest! {
        #[test]
        fn the_short_way_reads_what_the_standard_library_reads(text in r"[-+]?[0-9]{0,12}\.?[0-9]{0,12}(e-?[0-9]{1,3})?") {
            let expected = text.parse::<f64>().ok().map(f64::to_bits);
            prop_assert_eq!(number(text.as_bytes()).map(f64::to_bits), expected);
        }

        /// About where the digits stop to fit into an f64.
        #[test]
        fn the_short_way_stops_where_it_would_round_twice(text in r"9[0-9]{6}\.[0-9]{6,12}") {
            let expected = text.parse::<f64>().ok().map(f64::to_bits);
            prop_assert_eq!(number(text.as_bytes()).map(f64::to_bits), expected);
        }

        #[test]
        fn every_finite_number_comes_back(bits: u64) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            for text in [format!("{value}"), format!("{value:e}"), format!("{value:.17e}")] {
                prop_assert_eq!(number(text.as_bytes()).map(f64::to_bits), Some(bits));
            }
        }
    }
}
