//! The cells of an image, and which of them features cover.

use super::statistics::CELL_SIZE_PX;

/// Widest and highest image whose cells are counted, pixels: bounds the work for one segment.
const LARGEST_IMAGE_PX: u32 = 16_384;

/// Cells of 10 × 10 pixels of one image, some of them covered by features.
///
/// A cell is half open: `10 c ≤ u < 10 (c + 1)`, `10 r ≤ v < 10 (r + 1)`. The cells of an image are those with
/// `0 ≤ c < ⌈width/10⌉` and `0 ≤ r < ⌈height/10⌉`; what lies beyond covers nothing.
///
/// # Source
/// Open-Structure (Li et al. 2024), section II-B: "if any part of a feature falls within a cell".
#[derive(Clone, Debug)]
pub struct ImageCells {
    columns: u32,
    rows: u32,
    covered: Vec<u64>,
}

impl ImageCells {
    /// The cells of an image, none covered; `None` for an image of over 16 384 pixels a side.
    ///
    /// * `width`, `height` — of the image, pixels.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Option<Self> {
        if width > LARGEST_IMAGE_PX || height > LARGEST_IMAGE_PX {
            return None;
        }
        let (columns, rows) = (width.div_ceil(10), height.div_ceil(10));
        let words = (columns as usize * rows as usize).div_ceil(64);
        Some(Self { columns, rows, covered: vec![0; words] })
    }

    /// Number of cells of the image.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// Whether the image has no cell.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of covered cells.
    #[must_use]
    pub fn covered(&self) -> usize {
        self.covered.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Uncovers every cell.
    pub fn clear(&mut self) {
        self.covered.fill(0);
    }

    /// Covers the cell of a point.
    ///
    /// * `pixel` — u and v, pixels; one outside the image covers nothing.
    #[inline]
    pub fn cover_point(&mut self, [u, v]: [f64; 2]) {
        self.cover(index(u), index(v));
    }

    /// Covers every cell that a segment has a point in, by grid traversal.
    ///
    /// * `start`, `end` — u and v, pixels. The segment is cut to the image first, so that the work is bounded by the
    ///   sum of the image's columns and rows of cells; one that is not finite covers nothing.
    ///
    /// # Source
    /// Amanatides and Woo, *A fast voxel traversal algorithm for ray tracing*, 1987; at a corner of four cells we take
    /// those that own a point of the segment, where the paper leaves it open.
    pub fn cover_segment(&mut self, start: [f64; 2], end: [f64; 2]) {
        let whole = [start, end];
        let Some([start, end]) = self.cut(start, end) else { return };
        let (mut column, mut row) = (index(start[0]), index(start[1]));
        // Borders are met on the whole segment, whose numbers are exact, as long as their products are finite.
        let [from, to] =
            if whole.iter().flatten().all(|x| x.abs() < LARGE_PX) { whole } else { [start, end] };
        let across = Axis::new(from[0], to[0]);
        let down = Axis::new(from[1], to[1]);
        let (mut columns_left, mut rows_left) = (index(end[0]).abs_diff(column), index(end[1]).abs_diff(row));
        self.cover(column, row);
        while columns_left > 0 || rows_left > 0 {
            // Parts of the way at which the next column and the next row begin, both times `across.length · down.length`.
            let next_column = across.to_border(column) * down.length;
            let next_row = down.to_border(row) * across.length;
            let (step_column, step_row) = if rows_left == 0 {
                (true, false)
            } else if columns_left == 0 {
                (false, true)
            } else if next_column == next_row {
                // Through a corner: a border belongs to the cell after it, so it is entered going up and left going down.
                match (across.forward, down.forward) {
                    (true, false) => (true, false),
                    (false, true) => (false, true),
                    _ => (true, true),
                }
            } else {
                (next_column < next_row, next_row < next_column)
            };
            if step_column {
                column += if across.forward { 1 } else { -1 };
                columns_left -= 1;
            }
            if step_row {
                row += if down.forward { 1 } else { -1 };
                rows_left -= 1;
            }
            self.cover(column, row);
        }
    }

    /// Covers a cell; one that is not of the image is passed over.
    #[inline]
    pub(crate) fn cover(&mut self, column: i64, row: i64) {
        let (Ok(column), Ok(row)) = (u32::try_from(column), u32::try_from(row)) else { return };
        if column < self.columns && row < self.rows {
            let place = row as usize * self.columns as usize + column as usize;
            self.covered[place / 64] |= 1 << (place % 64);
        }
    }

    /// The part of a segment within the image's cells, borders included (Liang and Barsky 1984).
    fn cut(&self, start: [f64; 2], end: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        if !(start.iter().chain(&end).all(|coordinate| coordinate.is_finite())) {
            return None;
        }
        let sizes = [self.columns, self.rows].map(|cells| f64::from(cells) * CELL_SIZE_PX);
        let inside = |pixel: &[f64; 2]| pixel.iter().zip(&sizes).all(|(x, size)| (0.0..=*size).contains(x));
        if inside(&start) && inside(&end) {
            return Some([start, end]);
        }
        // Part of the way, and the border that is met there: its coordinate is known without rounding.
        let (mut enter, mut leave) = ((0.0, None), (1.0, None));
        for axis in 0..2 {
            // Halves, because the difference of two finite numbers may not be finite.
            let (from, by) = (0.5 * start[axis], 0.5 * end[axis] - 0.5 * start[axis]);
            if by == 0.0 {
                if !(0.0..=sizes[axis]).contains(&start[axis]) {
                    return None;
                }
                continue;
            }
            let meets = |border: f64| ((0.5 * border - from) / by, Some((axis, border)));
            let (low, high) = (meets(0.0), meets(sizes[axis]));
            let (first, last) = if by > 0.0 { (low, high) } else { (high, low) };
            enter = if first.0 > enter.0 { first } else { enter };
            leave = if last.0 < leave.0 { last } else { leave };
        }
        if enter.0 > leave.0 {
            return None;
        }
        let at = |(part, border): (f64, Option<(usize, f64)>)| {
            let mut pixel = [0.0; 2];
            for axis in 0..2 {
                let between = match border {
                    // Rounded once, at the end: where the border is met at a corner of cells, that is found exactly.
                    Some((other, border)) if start.iter().chain(&end).all(|x| x.abs() < LARGE_PX) => {
                        let (along, by) = (border - start[other], end[other] - start[other]);
                        start[axis] + (end[axis] - start[axis]) * along / by
                    }
                    _ => start[axis] * (1.0 - part) + end[axis] * part,
                };
                pixel[axis] = between.clamp(0.0, sizes[axis]);
            }
            if let Some((axis, border)) = border {
                pixel[axis] = border;
            }
            pixel
        };
        let start = if inside(&start) { start } else { at(enter) };
        Some([start, if inside(&end) { end } else { at(leave) }])
    }
}

/// Numbers below this have finite products.
const LARGE_PX: f64 = 1e100;

/// One coordinate along a segment.
struct Axis {
    from: f64,
    length: f64,
    forward: bool,
}

impl Axis {
    fn new(from: f64, to: f64) -> Self {
        Self { from, length: (to - from).abs(), forward: to >= from }
    }

    /// Distance from the start to where the cell is left, pixels.
    fn to_border(&self, cell: i64) -> f64 {
        let border = if self.forward { cell + 1 } else { cell };
        (border as f64 * CELL_SIZE_PX - self.from).abs()
    }
}

/// Column or row of the cell of a coordinate.
#[expect(clippy::cast_possible_truncation, reason = "a float-to-integer cast saturates, which is right here")]
pub(super) fn index(coordinate: f64) -> i64 {
    (coordinate / CELL_SIZE_PX).floor() as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cells(width: u32, height: u32) -> ImageCells {
        ImageCells::new(width, height).unwrap()
    }

    fn list(cells: &ImageCells) -> Vec<(u32, u32)> {
        let place = |cell: u32| (cell as usize / 64, cell % 64);
        let covered = (0..cells.columns * cells.rows)
            .filter(|cell| cells.covered[place(*cell).0] >> place(*cell).1 & 1 == 1);
        covered.map(|cell| (cell % cells.columns, cell / cells.columns)).collect()
    }

    fn covered(start: [f64; 2], end: [f64; 2]) -> Vec<(u32, u32)> {
        let mut cells = cells(100, 60);
        cells.cover_segment(start, end);
        list(&cells)
    }

    /// Cells with a point of the segment, each asked by itself: where along it both coordinates are in the half-open cell.
    fn asked_one_by_one(start: [f64; 2], end: [f64; 2]) -> Vec<(u32, u32)> {
        let mut found = Vec::new();
        for row in 0..6 {
            for column in 0..10 {
                let (mut low, mut low_open, mut high, mut high_open) = (0.0, false, 1.0, false);
                let mut possible = true;
                for (axis, cell) in [column, row].into_iter().enumerate() {
                    let (from, by) = (start[axis], end[axis] - start[axis]);
                    let (least, most) = (f64::from(cell) * 10.0, f64::from(cell) * 10.0 + 10.0);
                    if by == 0.0 {
                        possible &= from >= least && from < most;
                        continue;
                    }
                    let (a, b) = ((least - from) / by, (most - from) / by);
                    let (first, first_open, last, last_open) =
                        if by > 0.0 { (a, false, b, true) } else { (b, true, a, false) };
                    if first > low {
                        (low, low_open) = (first, first_open);
                    } else if first == low {
                        low_open |= first_open;
                    }
                    if last < high {
                        (high, high_open) = (last, last_open);
                    } else if last == high {
                        high_open |= last_open;
                    }
                }
                if possible && (low < high || (low == high && !low_open && !high_open)) {
                    found.push((column, row));
                }
            }
        }
        found
    }

    proptest! {
        // Quarters of pixels, so that borders and corners are met often and quotients of differences tie exactly.
        #[test]
        fn a_segment_covers_the_cells_that_have_a_point_of_it(
            ends in prop::array::uniform4(0_i32..240),
        ) {
            let [a, b, c, d] = ends.map(|end| f64::from(end) * 0.25);
            let (start, end) = ([a, b], [c, d]);
            prop_assert_eq!(covered(start, end), asked_one_by_one(start, end));
        }

        #[test]
        fn a_segment_that_leaves_the_image_covers_what_is_inside(
            ends in prop::array::uniform4(-300.0..300.0_f64),
        ) {
            let [a, b, c, d] = ends;
            let (start, end) = ([a, b], [c, d]);
            prop_assert_eq!(covered(start, end), asked_one_by_one(start, end));
        }

        #[test]
        fn both_directions_of_a_segment_cover_the_same(ends in prop::array::uniform4(0_i32..400)) {
            let [a, b, c, d] = ends.map(|end| f64::from(end) * 0.25);
            prop_assert_eq!(covered([a, b], [c, d]), covered([c, d], [a, b]));
        }

        #[test]
        fn numbers_of_any_size_end(ends in prop::array::uniform4(any::<f64>())) {
            let [a, b, c, d] = ends;
            prop_assert!(covered([a, b], [c, d]).len() <= 16);
        }
    }

    #[test]
    fn a_segment_that_leaves_the_image_meets_corners_all_the_same() {
        let [a, b, c, d] = [6, 14, 318, 262].map(|end| f64::from(end) * 0.25);
        assert_eq!(covered([a, b], [c, d]), covered([c, d], [a, b]));
    }

    #[test]
    fn corners_belong_to_the_cell_below_and_right() {
        assert_eq!(covered([0.0, 0.0], [20.0, 20.0]), [(0, 0), (1, 1), (2, 2)]);
        assert_eq!(covered([15.0, 15.0], [5.0, 5.0]), [(0, 0), (1, 1)]);
        assert_eq!(covered([5.0, 15.0], [15.0, 5.0]), [(1, 0), (0, 1), (1, 1)]);
    }

    #[test]
    fn the_largest_numbers_cross_the_image_once() {
        assert_eq!(covered([-1e300, 25.0], [1e300, 25.0]).len(), 10);
        assert_eq!(covered([-f64::MAX, 25.0], [f64::MAX, 25.0]).len(), 10);
        assert_eq!(covered([f64::NAN, 25.0], [10.0, 25.0]).len(), 0);
        assert_eq!(covered([f64::INFINITY, 25.0], [10.0, 25.0]).len(), 0);
        assert_eq!(covered([-5.0, -5.0], [-1.0, 1e9]).len(), 0);
    }

    #[test]
    fn a_part_of_a_cell_at_the_border_counts_and_nothing_beyond() {
        let mut cells = cells(95, 51);
        assert_eq!(cells.len(), 60);
        for pixel in [[94.9, 50.9], [99.9, 59.9], [100.0, 50.0], [-0.1, 3.0], [3.0, f64::INFINITY]] {
            cells.cover_point(pixel);
        }
        assert_eq!(list(&cells), [(9, 5)]);
        cells.clear();
        assert_eq!(cells.covered(), 0);
    }

    #[test]
    fn an_image_that_is_too_large_has_no_cells() {
        assert!(ImageCells::new(u32::MAX, 480).is_none());
        assert!(ImageCells::new(640, 16_385).is_none());
        assert_eq!(ImageCells::new(16_384, 16_384).unwrap().len(), 1639 * 1639);
    }
}
