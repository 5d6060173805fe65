//! Groups of lines at right angles to each other.

use nalgebra::{Matrix3, Vector3};
use open_structure::structure::registry;

use super::groups::Bundle;

/// Makes directions exactly orthogonal that nearly are.
///
/// The three groups of the greatest length that are pairwise nearly orthogonal become the nearest three orthogonal directions,
/// weighted by length: a `manhattan`. Groups nearly perpendicular to one of its directions, or, without a manhattan, to the one
/// that has the greatest length together with them, become exactly perpendicular to it: an `atlanta`. There is at most one of each.
///
/// * `tolerance_deg` — how far from a right angle counts as nearly, degrees.
///
/// Returns what was found, as kind and places of the groups, that one first to which the others are perpendicular.
pub(super) fn make_orthogonal(bundles: &mut [Bundle], tolerance_deg: f64) -> Vec<(&'static str, Vec<usize>)> {
    let sine = libm::sin(tolerance_deg.clamp(0.0, 45.0).to_radians());
    if sine <= 0.0 {
        return Vec::new();
    }
    let right = |bundles: &[Bundle], a: usize, b: usize| {
        a != b && bundles[a].direction.dot(&bundles[b].direction).abs() <= sine
    };
    let weight = |parts: &[usize]| parts.iter().map(|part| bundles[*part].weight).sum::<u64>();
    let count = bundles.len();
    let mut best: Option<[usize; 3]> = None;
    for a in 0..count {
        for b in (a + 1..count).filter(|b| right(bundles, a, *b)) {
            // Groups stand in descending order of length, so the first third is the longest.
            let Some(c) = (b + 1..count).find(|c| right(bundles, a, *c) && right(bundles, b, *c)) else {
                continue;
            };
            if best.is_none_or(|best| weight(&[a, b, c]) > weight(&best)) {
                best = Some([a, b, c]);
            }
        }
    }
    let across = |upright: usize, bundles: &[Bundle]| -> Vec<usize> {
        (0..count).filter(|other| right(bundles, upright, *other)).collect()
    };
    let candidates: Vec<usize> = best.map_or_else(|| (0..count).collect(), Vec::from);
    let mut upright: Option<(usize, Vec<usize>)> = None;
    for candidate in candidates {
        let others = across(candidate, bundles);
        let total = |upright: usize, others: &[usize]| weight(others) + bundles[upright].weight;
        if others.len() >= 2
            && upright.as_ref().is_none_or(|(best, all)| total(candidate, &others) > total(*best, all))
        {
            upright = Some((candidate, others));
        }
    }
    let Some((upright, others)) = upright else { return Vec::new() };
    let mut found = Vec::new();
    if let Some(mut parts) = best {
        square(bundles, parts);
        parts.sort_by_key(|part| *part != upright);
        found.push((registry::MANHATTAN, parts.to_vec()));
    }
    let axis = bundles[upright].direction;
    let is_extra = |other: &usize| best.is_none_or(|parts| !parts.contains(other));
    let extra: Vec<usize> = others.iter().copied().filter(is_extra).collect();
    for other in &extra {
        bundles[*other].direction = flat(bundles[*other].direction, axis);
    }
    if !extra.is_empty() {
        found.push((registry::ATLANTA, std::iter::once(upright).chain(others).collect()));
    }
    found
}

/// Turns three nearly orthogonal directions into the nearest orthogonal ones, weighted by length.
fn square(bundles: &mut [Bundle], parts: [usize; 3]) {
    let columns = parts.map(|part| bundles[part].direction * bundles[part].weight as f64);
    let svd = Matrix3::from_columns(&columns).svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return };
    let rotation = u * v_t;
    for (column, part) in parts.into_iter().enumerate() {
        bundles[part].direction = rotation.column(column).normalize();
    }
}

/// The direction without what it has along an axis; twice, for the first leaves rounding.
fn flat(direction: Vector3<f64>, axis: Vector3<f64>) -> Vector3<f64> {
    let once = (direction - axis * axis.dot(&direction)).normalize();
    (once - axis * axis.dot(&once)).normalize()
}
