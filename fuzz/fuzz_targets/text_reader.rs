//! Any bytes as a file of the first text release; the first byte says what lines without a tag are.

#![no_main]

use libfuzzer_sys::fuzz_target;
use open_structure_converters::text_release::{BareLine, FileProblems, parse, parse_parameters};

fuzz_target!(|bytes: &[u8]| {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let bare = match first % 4 {
        0 => None,
        1 => Some(BareLine::Pose),
        2 => Some(BareLine::Point),
        _ => Some(BareLine::Segment),
    };
    let rows = parse(bytes, bare, &mut FileProblems::new("input"));
    for row in &rows.point_observations {
        assert!(row.u.is_finite() && row.v.is_finite());
    }
    let _ = parse_parameters(bytes, &mut FileProblems::new("input"));
});
