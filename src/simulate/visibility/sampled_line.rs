//! The part of a segment that the first release says is seen.

use nalgebra::Point3;

use super::View;

/// Places along a segment that are tried.
const PLACES: u32 = 100;
/// So many of them in view are too few.
const TOO_FEW: usize = 5;

/// The visible part of a segment by sampling, as an interval of `start + t (end − start)`.
///
/// Of 100 places more than 5 have to be in view; the first and the last of them are the ends, whatever is
/// between. Nothing hides anything.
///
/// * `min_length_px` — a part shorter than this in the image is not seen.
///
/// # Source
/// The simulator of the first release of Open-Structure (Li et al. 2024), by its results.
#[must_use]
pub fn sampled_part(
    view: &View,
    start: &Point3<f64>,
    end: &Point3<f64>,
    min_length_px: f64,
) -> Option<[f64; 2]> {
    let at = |t: f64| start + (end - start) * t;
    let seen: Vec<f64> = (1..=PLACES)
        .map(|place| f64::from(place) / f64::from(PLACES))
        .filter(|t| view.project(&at(*t)).is_some())
        .collect();
    let (low, high) = (*seen.first()?, *seen.last()?);
    let length = (view.project(&at(high))?.0 - view.project(&at(low))?.0).norm();
    (seen.len() > TOO_FEW && length >= min_length_px).then_some([low, high])
}
