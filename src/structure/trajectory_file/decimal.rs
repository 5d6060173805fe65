//! Stamps as decimal text, without a detour through floating point.

/// The most characters a stamp may have.
const LONGEST: usize = 64;

/// A decimal number times `10^shift`, rounded to the nearest integer (halves away from zero).
///
/// Seconds to nanoseconds is a `shift` of 9. An `f64` of today's time in seconds is exact to 240 ns only.
///
/// * `text` — as `-12.5` or `1.31e+09`.
///
/// `None` for text that is no such number, and for one outside `i64`.
pub(super) fn scaled_integer(text: &str, shift: i32) -> Option<i64> {
    if text.len() > LONGEST {
        return None;
    }
    let (number, exponent) = match text.split_once(['e', 'E']) {
        Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (negative, number) = match number.as_bytes().first()? {
        b'-' => (true, &number[1..]),
        b'+' => (false, &number[1..]),
        _ => (false, number),
    };
    let (whole, part) = number.split_once('.').unwrap_or((number, ""));
    if whole.is_empty() && part.is_empty() {
        return None;
    }
    let mut digits: i128 = 0;
    for byte in whole.bytes().chain(part.bytes()) {
        let digit = char::from(byte).to_digit(10)?;
        digits = digits.checked_mul(10)?.checked_add(i128::from(digit))?;
    }
    if digits == 0 {
        return Some(0);
    }
    let places = i32::try_from(part.len()).ok()?;
    let shift = exponent.checked_add(shift)?.checked_sub(places)?;
    let factor = 10_i128.checked_pow(shift.unsigned_abs());
    let rounded = match (shift < 0, factor) {
        (false, factor) => digits.checked_mul(factor?)?,
        (true, Some(factor)) => digits / factor + i128::from(digits % factor >= factor - digits % factor),
        (true, None) => 0,
    };
    i64::try_from(if negative { -rounded } else { rounded }).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn seconds_with_nine_decimals_are_exact(nanos: i64) {
            let sign = if nanos < 0 { "-" } else { "" };
            let (whole, part) = (nanos.unsigned_abs() / 1_000_000_000, nanos.unsigned_abs() % 1_000_000_000);
            prop_assert_eq!(scaled_integer(&format!("{sign}{whole}.{part:09}"), 9), Some(nanos));
            prop_assert_eq!(scaled_integer(&format!("{nanos}"), 0), Some(nanos));
            prop_assert_eq!(scaled_integer(&format!("{nanos}e-9"), 9), Some(nanos));
        }

        #[test]
        fn any_text_gets_an_answer(text in "[-+0-9.eE]{0,70}", shift in -10..10) {
            let _ = scaled_integer(&text, shift);
        }
    }

    #[test]
    fn the_ways_of_writing_a_stamp() {
        for (text, nanos) in [
            ("1305031098.6659", 1_305_031_098_665_900_000),
            ("1.305031098665900000e+09", 1_305_031_098_665_900_000),
            ("0", 0),
            (".5", 500_000_000),
            ("5.", 5_000_000_000),
            ("+1E-3", 1_000_000),
            ("0.0000000005", 1),
            ("-0.0000000005", -1),
            ("0.00000000049", 0),
            ("1e-400", 0),
        ] {
            assert_eq!(scaled_integer(text, 9), Some(nanos), "{text}");
        }
    }

    #[test]
    fn what_is_no_stamp_is_refused() {
        for text in
            ["", "-", ".", "e5", "1e", "nan", "inf", "1_0", "0x1", "1 ", "--1", "1e99999999999", "1e11"]
        {
            assert_eq!(scaled_integer(text, 9), None, "{text}");
        }
    }
}
