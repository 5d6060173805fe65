//! Landmarks on painted surfaces, found by place.

use nalgebra::{Point3, Vector3};

use crate::geometry::Segment;

/// Most cells along an axis.
const MOST_CELLS: f64 = 64.0;

/// What a place on a surface shows of the landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark {
    /// So far from a point, in radii of its disc, less than 2.
    Point {
        /// The point, by its place in the list.
        index: u32,
        /// Distance, radii.
        radii: f64,
    },
    /// So far from a line, in widths of its stripe, from −1 to 1; the sign tells the side.
    Line(f64),
}

/// Points and lines in a grid of cells.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    points: Vec<Point3<f64>>,
    lines: Vec<Segment>,
    /// Radius of a point's disc, metres.
    radius_m: f64,
    /// Reach of a stripe to either side of its line, metres.
    width_m: f64,
    low: Point3<f64>,
    cell_m: f64,
    counts: [usize; 3],
    /// Where the entries of each cell begin.
    begins: Vec<u32>,
    /// Points by their places, then lines by theirs plus the number of points.
    entries: Vec<u32>,
}

impl Marks {
    /// * `radius_m` — of a point's disc; `width_m` — of a line's stripe, to either side; metres.
    pub(super) fn new(points: Vec<Point3<f64>>, lines: Vec<Segment>, radius_m: f64, width_m: f64) -> Self {
        let reach = (2.0 * radius_m).max(width_m);
        let ends = lines.iter().flat_map(|line| [line.start, line.end]);
        let corners = points.iter().copied().chain(ends).fold(None, |corners, point| {
            let (low, high) = corners.unwrap_or((point, point));
            Some((low.inf(&point), high.sup(&point)))
        });
        let (low, high) = corners.unwrap_or((Point3::origin(), Point3::origin()));
        let margin = Vector3::repeat(reach * 1.001);
        let (low, high): (Point3<f64>, Point3<f64>) = (low - margin, high + margin);
        let extent = high - low;
        let cell_m = (4.0 * reach).max(extent.amax() / MOST_CELLS);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 65")]
        let counts: [usize; 3] = std::array::from_fn(|axis| (extent[axis] / cell_m) as usize + 1);
        let mut marks = Self {
            points,
            lines,
            radius_m,
            width_m,
            low,
            cell_m,
            counts,
            begins: Vec::new(),
            entries: Vec::new(),
        };
        let mut cells = marks.occupied();
        cells.sort_unstable();
        cells.dedup();
        marks.begins = vec![0; counts.iter().product::<usize>() + 1];
        for (cell, _) in &cells {
            marks.begins[cell + 1] += 1;
        }
        for cell in 1..marks.begins.len() {
            marks.begins[cell] += marks.begins[cell - 1];
        }
        marks.entries = cells.into_iter().map(|(_, entry)| entry).collect();
        marks
    }

    /// Cells with what reaches into them.
    fn occupied(&self) -> Vec<(usize, u32)> {
        let mut found = Vec::new();
        for (entry, point) in (0_u32..).zip(&self.points) {
            self.cells_near(point, 2.0 * self.radius_m, |cell| found.push((cell, entry)));
        }
        let first = u32::try_from(self.points.len()).unwrap_or(u32::MAX);
        for (entry, line) in (first..).zip(&self.lines) {
            let along = line.end - line.start;
            // Boxes about places along the line, each reaching half of the way to the next.
            let steps = (along.norm() / self.cell_m).ceil().max(1.0);
            let reach = self.width_m + 0.5 * along.norm() / steps;
            let mut step = 0.5;
            while step < steps {
                let place = line.start + along * (step / steps);
                self.cells_near(&place, reach, |cell| found.push((cell, entry)));
                step += 1.0;
            }
        }
        found
    }

    fn cells_near(&self, point: &Point3<f64>, reach: f64, mut each: impl FnMut(usize)) {
        let bound = |axis: usize, shift: f64| {
            let cell = ((point[axis] + shift - self.low[axis]) / self.cell_m).max(0.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped below")]
            let cell = cell as usize;
            cell.min(self.counts[axis] - 1)
        };
        let [x, y, z] = [0, 1, 2].map(|axis| bound(axis, -reach)..=bound(axis, reach));
        for z in z {
            for y in y.clone() {
                for x in x.clone() {
                    each((z * self.counts[1] + y) * self.counts[0] + x);
                }
            }
        }
    }

    /// What a place on a surface shows: the nearest point that reaches it, else the nearest line.
    ///
    /// * `normal` — of the surface, on the side from which it is seen.
    pub(super) fn at(&self, place: &Point3<f64>, normal: &Vector3<f64>) -> Option<Mark> {
        let mut cell = [0; 3];
        for axis in 0..3 {
            let at = (place[axis] - self.low[axis]) / self.cell_m;
            if !(at >= 0.0 && at < self.counts[axis] as f64) {
                return None;
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "looked at")]
            let at = at as usize;
            cell[axis] = at;
        }
        let cell = (cell[2] * self.counts[1] + cell[1]) * self.counts[0] + cell[0];
        let range = self.begins[cell] as usize..self.begins[cell + 1] as usize;
        let mut point_mark: Option<(f64, u32)> = None;
        let mut line_mark: Option<f64> = None;
        for entry in &self.entries[range] {
            let index = *entry as usize;
            if let Some(point) = self.points.get(index) {
                let radii = (place - point).norm() / self.radius_m;
                if radii < 2.0 && point_mark.is_none_or(|(nearest, _)| radii < nearest) {
                    point_mark = Some((radii, *entry));
                }
            } else if let Some(line) = self.lines.get(index - self.points.len())
                && let Some(widths) = self.aside(line, place, normal)
                && line_mark.is_none_or(|nearest| widths.abs() < nearest.abs())
            {
                line_mark = Some(widths);
            }
        }
        point_mark.map(|(radii, index)| Mark::Point { index, radii }).or(line_mark.map(Mark::Line))
    }

    /// Distance from a line in widths of its stripe, with the sign of the side.
    fn aside(&self, line: &Segment, place: &Point3<f64>, normal: &Vector3<f64>) -> Option<f64> {
        let along = line.end - line.start;
        let from_start = place - line.start;
        let t = from_start.dot(&along) / along.norm_squared();
        if !(0.0..=1.0).contains(&t) {
            return None;
        }
        let aside = from_start - along * t;
        let widths = aside.norm() / self.width_m;
        let side = if along.cross(normal).dot(&aside) < 0.0 { -1.0 } else { 1.0 };
        (widths <= 1.0).then_some(widths * side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Random;

    #[test]
    fn the_grid_finds_what_a_search_of_everything_finds() {
        let mut random = Random::new(1, "test", 0);
        let mut place = |size: f64| Point3::from([(); 3].map(|()| size * (random.uniform() - 0.5)));
        let points: Vec<_> = (0..60).map(|_| place(10.0)).collect();
        let lines: Vec<_> = (0..40).map(|_| Segment { start: place(10.0), end: place(10.0) }).collect();
        let marks = Marks::new(points.clone(), lines.clone(), 0.2, 0.3);
        let alone = Marks { counts: [1; 3], cell_m: 1e3, ..marks.clone() };
        let everything: Vec<u32> = (0..100).collect();
        let alone = Marks { begins: vec![0, 100], entries: everything, ..alone };
        let normal = Vector3::z();
        let mut found = 0;
        for _ in 0..20_000 {
            let place = place(11.0);
            let mark = marks.at(&place, &normal);
            assert_eq!(mark, alone.at(&place, &normal), "{place}");
            found += usize::from(mark.is_some());
        }
        assert!(found > 1000, "{found}");
    }
}
