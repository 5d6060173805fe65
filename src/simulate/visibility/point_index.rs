//! Points in cells, so that whole cells outside a frustum are passed over.

use nalgebra::{Point3, Vector3};

use super::View;

/// Points that a cell holds on average where they are spread evenly on a surface.
const POINTS_PER_CELL: f64 = 16.0;

/// A cell: its points from `begin` to `end` of the index, and the box about them.
#[derive(Clone, Debug)]
struct Cell {
    low: Point3<f64>,
    high: Point3<f64>,
    begin: usize,
    end: usize,
}

/// Points sorted into the cells of a grid, and the cells into blocks.
#[derive(Clone, Debug, Default)]
pub struct PointIndex {
    points: Vec<Point3<f64>>,
    ids: Vec<u32>,
    cells: Vec<Cell>,
    blocks: Vec<Cell>,
}

impl PointIndex {
    /// An index of points, named by their places.
    #[must_use]
    pub fn new(points: &[Point3<f64>]) -> Self {
        let Some(first) = points.first() else { return Self::default() };
        let (low, high) =
            points.iter().fold((*first, *first), |(low, high), point| (low.inf(point), high.sup(point)));
        let extent = high - low;
        // On surfaces the number of cells that hold anything grows with the square of their number along a side.
        let sides = (points.len() as f64 / POINTS_PER_CELL).sqrt().clamp(1.0, 256.0);
        let size = (extent.amax() / sides).max(f64::MIN_POSITIVE);
        let cell_of = |point: &Point3<f64>| (point - low).map(|number| clamp_to_u16(number / size));
        let mut order: Vec<(u64, u32)> =
            (0_u32..).zip(points).map(|(id, point)| (interleave(cell_of(point)), id)).collect();
        order.sort_unstable();
        let sorted: Vec<Point3<f64>> = order.iter().map(|(_, id)| points[*id as usize]).collect();
        let bounded = |begin: usize, end: usize| {
            let start = (sorted[begin], sorted[begin]);
            let (low, high) =
                sorted[begin..end].iter().fold(start, |(low, high), point| (low.inf(point), high.sup(point)));
            Cell { low, high, begin, end }
        };
        let ends_of_runs = |shift: u32| {
            let mut cells = Vec::new();
            let mut begin = 0;
            for run in order.chunk_by(|left, right| left.0 >> shift == right.0 >> shift) {
                cells.push((begin, begin + run.len()));
                begin += run.len();
            }
            cells
        };
        let cells: Vec<Cell> = ends_of_runs(0).into_iter().map(|(begin, end)| bounded(begin, end)).collect();
        // A block is 4 × 4 × 4 cells, which stand together in the order of interleaved bits; here its
        // `begin` and `end` are cells.
        let mut first_cell = 0;
        let blocks = ends_of_runs(6)
            .into_iter()
            .map(|(begin, end)| {
                let block = bounded(begin, end);
                let last = first_cell + cells[first_cell..].partition_point(|cell| cell.begin < end);
                let block = Cell { begin: first_cell, end: last, ..block };
                first_cell = last;
                block
            })
            .collect();
        Self { points: sorted, ids: order.into_iter().map(|(_, id)| id).collect(), cells, blocks }
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Names of the points in the frustum of a view that pass a further test, ascending.
    pub fn in_view(&self, view: &View, mut passes: impl FnMut(&Point3<f64>) -> bool) -> Vec<u32> {
        let mut found = Vec::new();
        for block in &self.blocks {
            let Some(inside) = view.classify(&block.low, &block.high) else { continue };
            for cell in &self.cells[block.begin..block.end] {
                let inside = inside
                    || match view.classify(&cell.low, &cell.high) {
                        Some(inside) => inside,
                        None => continue,
                    };
                for index in cell.begin..cell.end {
                    let point = &self.points[index];
                    if (inside || view.project(point).is_some()) && passes(point) {
                        found.push(self.ids[index]);
                    }
                }
            }
        }
        found.sort_unstable();
        found
    }
}

/// A cell's number along an axis.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to what fits")]
fn clamp_to_u16(number: f64) -> u16 {
    number.clamp(0.0, f64::from(u16::MAX)) as u16
}

/// Bits of three numbers, one of each in turn: near cells come near each other.
fn interleave(cell: Vector3<u16>) -> u64 {
    let spread =
        |number: u16| (0..16).fold(0_u64, |bits, bit| bits | (u64::from(number >> bit & 1) << (3 * bit)));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::{point, view};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_index_finds_the_points_that_are_in_view(
            view in view(), mut points in prop::collection::vec(point(6.0), 0..400),
        ) {
            // Some points at one place, and a plane.
            let repeated: Vec<_> = points.iter().take(3).copied().collect();
            points.extend(repeated);
            points.iter_mut().skip(100).for_each(|point| point.z = 1.0);
            let expected: Vec<u32> = (0_u32..)
                .zip(&points)
                .filter(|(id, point)| id % 3 != 0 && view.project(point).is_some())
                .map(|(id, _)| id)
                .collect();
            let index = PointIndex::new(&points);
            let by_place = |point: &Point3<f64>| points.iter().position(|other| other == point).unwrap();
            let found = index.in_view(&view, |_| true);
            prop_assert_eq!(found.into_iter().filter(|id| id % 3 != 0).collect::<Vec<_>>(), expected);
            let none = index.in_view(&view, |point| by_place(point) > points.len());
            prop_assert!(none.is_empty());
        }
    }
}
