//! Arguments that are more than a word.

use crate::rgbd::GivenCamera;
use open_structure::geometry::PinholeCamera;
use std::ops::Range;

/// `A..B`, either of which may be left out.
pub(super) fn frame_range(text: &str) -> Result<Range<u64>, String> {
    let wrong = || "expected A..B, such as 100..200, 100.. or ..200".to_owned();
    let (begin, end) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str, default: u64| {
        if text.is_empty() { Ok(default) } else { text.parse().map_err(|_| wrong()) }
    };
    let (begin, end) = (number(begin, 0)?, number(end, u64::MAX)?);
    if begin < end {
        Ok(begin..end)
    } else {
        Err(format!("{text}: there is no frame in it, for B is not included"))
    }
}

/// Name of a sequence, as the specification has it.
pub(super) fn sequence_name(text: &str) -> Result<String, String> {
    if text.is_empty() || text.contains(|c: char| c == '/' || c == '\\' || c.is_control()) {
        return Err("expected a name without `/`, `\\` and control characters".to_owned());
    }
    Ok(text.to_owned())
}

/// `NAME=VALUE`.
pub(super) fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as sigma_px=0.5")?;
    let value = value.parse().map_err(|_| format!("expected a number after {name}="))?;
    Ok((name.to_owned(), value))
}

/// A camera of four numbers, or six with the image's size.
pub(super) fn given_camera(text: &str) -> Result<GivenCamera, String> {
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    let number = |text: &str| text.parse::<f64>().map_err(|error| format!("{text}: {error}"));
    let count = |text: &str| text.parse::<u32>().map_err(|error| format!("{text}: {error}"));
    let (four, size) = match fields.as_slice() {
        [fx, fy, cx, cy] => ([fx, fy, cx, cy], None),
        [fx, fy, cx, cy, width, height] => ([fx, fy, cx, cy], Some([count(width)?, count(height)?])),
        other => {
            return Err(format!("expected four or six numbers with commas between, found {}", other.len()));
        }
    };
    let [fx, fy, cx, cy] = four.map(|text| number(text));
    let (fx, fy, cx, cy) = (fx?, fy?, cx?, cy?);
    if fx <= 0.0 {
        return Err(format!("expected a positive fx, found {fx}"));
    }
    let [width, height] = size.unwrap_or([1, 1]);
    PinholeCamera::new(fx, fy, cx, cy, width, height).map_err(|error| error.to_string())?;
    Ok(GivenCamera { fx, fy, cx, cy, size })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_empty_ones_refused() {
        assert_eq!(frame_range("3..5"), Ok(3..5));
        assert_eq!(frame_range("..5"), Ok(0..5));
        assert_eq!(frame_range("3.."), Ok(3..u64::MAX));
        for wrong in ["", "3", "5..3", "3..3", "a..b", "-1..3", "1...3", "1..=3"] {
            assert!(frame_range(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn names_are_those_of_the_specification() {
        assert_eq!(sequence_name("my desk, ü"), Ok("my desk, ü".to_owned()));
        for wrong in ["", "a/b", "a\\b", "a\nb"] {
            assert!(sequence_name(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn cameras_have_four_numbers_or_six() {
        let camera = given_camera("481.2,-480,319.5,239.5").unwrap();
        assert_eq!((camera.fy, camera.size), (-480.0, None));
        assert_eq!(given_camera("1,2,3,4,5,6").unwrap().size, Some([5, 6]));
        for wrong in ["", "1,2,3", "1,2,3,4,5", "1,2,3,4,0,6", "-1,2,3,4", "1,0,3,4", "1,2,3,nan", "x,2,3,4"]
        {
            assert!(given_camera(wrong).is_err(), "{wrong}");
        }
    }
}
