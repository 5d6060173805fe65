//! Time stamps, exactly.

/// Decimal places of a nanosecond.
const PLACES: i64 = 9;
/// More digits than any stamp has.
const MAX_DIGITS: usize = 30;

/// A stamp in seconds as nanoseconds; a half of a nanosecond goes up.
///
/// Digits are counted, not turned into a floating point number: that has 53 bits, of which a stamp of today in
/// nanoseconds needs 61. Exponents (`1.3e9`) are understood.
///
/// `None` for what is no number, or no 64-bit count of nanoseconds.
pub(super) fn nanos(text: &str) -> Option<i64> {
    let (negative, text) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i16>().ok()?),
        None => (text, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = || whole.bytes().chain(fraction.bytes());
    if digits().next().is_none() || digits().count() > MAX_DIGITS || !digits().all(|d| d.is_ascii_digit()) {
        return None;
    }
    let number = digits().fold(0_i128, |sum, digit| sum * 10 + i128::from(digit - b'0'));
    let shift = i64::from(exponent) + PLACES - i64::try_from(fraction.len()).ok()?;
    let nanos = if number == 0 {
        0
    } else if shift >= 0 {
        number.checked_mul(10_i128.checked_pow(u32::try_from(shift).ok()?)?)?
    } else {
        // Thirty digits are nothing after 31 places.
        let divisor = 10_i128.pow(u32::try_from(-shift).ok()?.min(31));
        let signed = if negative { -number } else { number };
        let rounded = (2 * signed + divisor).div_euclid(2 * divisor);
        return i64::try_from(rounded).ok();
    };
    i64::try_from(if negative { -nanos } else { nanos }).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn stamps_are_exact() {
        for (text, expected) in [
            ("1305031452.791720", Some(1_305_031_452_791_720_000)),
            ("1341841278.8427", Some(1_341_841_278_842_700_000)),
            ("0", Some(0)),
            ("17", Some(17_000_000_000)),
            ("-0.5", Some(-500_000_000)),
            (".25", Some(250_000_000)),
            ("1.", Some(1_000_000_000)),
            ("1.305031452791720000e+09", Some(1_305_031_452_791_720_000)),
            ("0.0000000005", Some(1)),
            ("-0.0000000005", Some(0)),
            ("0.0000000004", Some(0)),
            ("0e99", Some(0)),
            ("1e-300", Some(0)),
            ("9223372036.854775807", Some(i64::MAX)),
            ("9223372036.854775808", None),
            ("1e99", None),
            ("1e99999", None),
            ("", None),
            (".", None),
            ("-", None),
            ("--1", None),
            ("1.2.3", None),
            ("nan", None),
            ("inf", None),
            ("0x10", None),
            ("1e", None),
            ("1111111111111111111111111111111", None),
        ] {
            assert_eq!(nanos(text), expected, "{text}");
        }
    }

    proptest! {
        #[test]
        fn every_count_of_nanoseconds_comes_back(stamp: i64) {
            let sign = if stamp < 0 { "-" } else { "" };
            let (seconds, rest) = (stamp.unsigned_abs() / 1_000_000_000, stamp.unsigned_abs() % 1_000_000_000);
            prop_assert_eq!(nanos(&format!("{sign}{seconds}.{rest:09}")), Some(stamp));
        }

        #[test]
        fn no_text_panics(text in "[-+0-9.eE]{0,40}") {
            let _ = nanos(&text);
        }
    }
}
