//! A segment drawn to the middle of its edge.

use nalgebra::{Matrix2, Point2, Vector2};

/// Passes: the second looks at an edge that the first has brought near the middle of its window.
const PASSES: usize = 2;
/// Half width of the window across the edge, pixels.
const REACH: i32 = 2;
/// Most places along a segment at which its edge is looked at.
const PLACES: f64 = 20.0;
/// A segment is moved by no more than this at an end, pixels: what is farther is another edge.
const FARTHEST_PX: f64 = 1.5;

/// A grey image between its pixels.
pub(super) struct Grey<'a> {
    pixels: &'a [u8],
    width: usize,
    height: usize,
}

impl<'a> Grey<'a> {
    /// An image of rows without gaps.
    pub(super) fn new(pixels: &'a [u8], width: i32, height: i32) -> Self {
        let size = |side: i32| usize::try_from(side).unwrap_or(0);
        Self { pixels, width: size(width), height: size(height) }
    }

    /// The grey value at a raster position; `None` outside the middles of the outer pixels.
    fn at(&self, place: Point2<f64>) -> Option<f64> {
        let inside = |value: f64, size: usize| value >= 0.0 && value < size as f64 - 1.0;
        if !(inside(place.x, self.width) && inside(place.y, self.height)) {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the image")]
        let (column, row) = (place.x as usize, place.y as usize);
        let (x, y) = (place.x - column as f64, place.y - row as f64);
        let pixel = |row: usize, column: usize| f64::from(self.pixels[row * self.width + column]);
        let above = pixel(row, column) * (1.0 - x) + pixel(row, column + 1) * x;
        let below = pixel(row + 1, column) * (1.0 - x) + pixel(row + 1, column + 1) * x;
        Some(above * (1.0 - y) + below * y)
    }
}

/// The segment in the middle of the gradient across it.
///
/// At places along the segment, the middle of the change of grey across it, weighted by the change and with one sign for the
/// whole edge; through these middles the straight line of least weighted squares. `None` for a segment without length;
/// where nothing better is found, it comes back as it was.
pub(super) fn refine(grey: &Grey<'_>, segment: [Point2<f64>; 2]) -> Option<[Point2<f64>; 2]> {
    let mut current = segment;
    for _ in 0..PASSES {
        let along = current[1] - current[0];
        let length = along.norm();
        let direction = along.try_normalize(f64::MIN_POSITIVE)?;
        let across = Vector2::new(-direction.y, direction.x);
        let Some([at_start, at_end]) = offsets(grey, current, across, length) else { return Some(segment) };
        let moved = [current[0] + across * at_start, current[1] + across * at_end];
        let far = |index: usize| across.dot(&(moved[index] - segment[index])).abs() > FARTHEST_PX;
        if far(0) || far(1) {
            return Some(segment);
        }
        current = moved;
        // The window was over the middle already.
        if at_start.abs().max(at_end.abs()) < 0.25 {
            break;
        }
    }
    Some(current)
}

/// How far the edge is from the segment at its start and at its end, pixels.
fn offsets(
    grey: &Grey<'_>,
    [start, end]: [Point2<f64>; 2],
    across: Vector2<f64>,
    length: f64,
) -> Option<[f64; 2]> {
    let places = length.clamp(2.0, PLACES).floor();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most PLACES")]
    let profiles = (0..=places as usize).filter_map(|place| {
        let part = place as f64 / places;
        let middle = start + (end - start) * part;
        let mut before = grey.at(middle - across * f64::from(REACH))?;
        let mut changes = [0.0; 2 * REACH as usize];
        for (step, change) in (1 - REACH..).zip(&mut changes) {
            let next = grey.at(middle + across * f64::from(step))?;
            *change = next - before;
            before = next;
        }
        Some((part, changes))
    });
    let profiles: Vec<_> = profiles.collect();
    let sign = profiles.iter().flat_map(|(_, changes)| changes).sum::<f64>().signum();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (part, changes) in &profiles {
        let (mut weight, mut sum) = (0.0, 0.0);
        for (step, change) in (-REACH..).zip(changes) {
            let change = (change * sign).max(0.0);
            weight += change;
            sum += change * (f64::from(step) + 0.5);
        }
        if weight > 0.0 {
            let row = Vector2::new(1.0 - part, *part);
            normal += row * row.transpose() * weight;
            right += row * sum;
        }
    }
    let solution = normal.cholesky()?.solve(&right);
    solution.iter().all(|offset| offset.is_finite()).then_some([solution.x, solution.y])
}
