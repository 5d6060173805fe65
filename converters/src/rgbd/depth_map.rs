//! Depth of every pixel of an image.

use nalgebra::{Matrix3, Point2, Vector2, Vector3};

use super::DepthNoise;

/// Standard deviations between a depth and a surface that is still the same.
const SIGMAS: f64 = 3.0;
/// How far a smooth surface may be from a plane within a pixel, in widths of a pixel at its depth.
const BEND: f64 = 0.5;
/// A step in depth between neighbouring pixels that no surface has which is seen as such, in widths of a pixel.
const JUMP: f64 = 3.0;
/// How far a surface may be from where its landmark lies, in widths of a pixel.
const NEAR: f64 = 1.0;

/// Depths row by row, metres, as a file has them: of most pixels nobody ever asks.
#[derive(Clone, Debug)]
pub(super) enum Samples {
    /// Numbers.
    Metres(Vec<f32>),
    /// 32-bit floating point numbers, the lowest byte first, that follow some other bytes.
    LittleEndian {
        /// The whole file.
        bytes: Vec<u8>,
        /// Where the numbers begin.
        begin: usize,
    },
}

impl Samples {
    fn len(&self) -> usize {
        match self {
            Self::Metres(depths) => depths.len(),
            Self::LittleEndian { bytes, begin } => bytes.len().saturating_sub(*begin) / 4,
        }
    }

    fn at(&self, index: usize) -> f32 {
        match self {
            Self::Metres(depths) => depths[index],
            Self::LittleEndian { bytes, begin } => {
                let number = &bytes[begin + 4 * index..][..4];
                f32::from_le_bytes([number[0], number[1], number[2], number[3]])
            }
        }
    }
}

/// Depth along the optical axis of every pixel of an image, metres.
#[derive(Clone, Debug)]
pub struct DepthMap {
    width: usize,
    height: usize,
    /// As the file has them; those outside `range_m` are none.
    samples: Samples,
    /// Depths that count, all of them finite and positive.
    range_m: [f32; 2],
}

/// What a depth map says about a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Depth of the nearest surface, metres.
    pub depth_m: f64,
    /// Whether another surface begins behind it within a pixel.
    pub jump: bool,
    /// The plane that it is around the place; `None` at rims and creases.
    pub plane: Option<Plane>,
}

/// A plane, as a depth map shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Change of depth from a pixel to the next one right, and to the next one below, metres.
    pub slope_m: Vector2<f64>,
    /// Greatest distance of the depths around from it, metres.
    pub bend_m: f64,
}

/// Whether a depth map shows a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// The surface is where the point is.
    Seen,
    /// The surface is nearer.
    Hidden,
    /// The surface is farther: nothing is where the point should be.
    Absent,
    /// There is no depth.
    Unknown,
}

impl DepthMap {
    /// A depth map; depths that are not finite and positive count as absent.
    ///
    /// * `depth_m` — row by row, metres.
    ///
    /// `None` where the numbers do not fill the image.
    #[must_use]
    pub fn new(width: u32, height: u32, depth_m: Vec<f32>) -> Option<Self> {
        Self::of(width, height, Samples::Metres(depth_m))
    }

    /// As [`new`](Self::new), of the numbers of a file.
    pub(super) fn of(width: u32, height: u32, samples: Samples) -> Option<Self> {
        let (width, height) = (width as usize, height as usize);
        if width == 0 || height == 0 || width.checked_mul(height)? != samples.len() {
            return None;
        }
        Some(Self { width, height, samples, range_m: [f32::from_bits(1), f32::MAX] })
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Depth of a pixel, metres; `None` where there is none, or outside.
    #[must_use]
    pub fn at(&self, column: i64, row: i64) -> Option<f64> {
        let column = usize::try_from(column).ok().filter(|column| *column < self.width)?;
        let row = usize::try_from(row).ok().filter(|row| *row < self.height)?;
        let depth = self.samples.at(row * self.width + column);
        self.counts(depth).then(|| f64::from(depth))
    }

    /// Takes away depths outside a range, metres.
    pub fn limit(&mut self, nearest_m: f64, farthest_m: f64) {
        let [least, most] = &mut self.range_m;
        // The nearest numbers of 32 bits within the range.
        #[expect(clippy::cast_possible_truncation, reason = "rounded, and looked at")]
        let (low, high) = (nearest_m as f32, farthest_m as f32);
        let low = if f64::from(low) < nearest_m { low.next_up() } else { low };
        let high = if f64::from(high) > farthest_m { high.next_down() } else { high };
        *least = least.max(low);
        *most = most.min(high);
    }

    /// Whether a number of the file is a depth.
    fn counts(&self, depth_m: f32) -> bool {
        let [least, most] = self.range_m;
        (least..=most).contains(&depth_m)
    }

    /// Part of the pixels that have a depth.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        (0..self.samples.len()).filter(|index| self.counts(self.samples.at(*index))).count() as f64
            / self.samples.len() as f64
    }

    /// The nearest surface at a place between pixels.
    ///
    /// A plane has an inverse depth that is linear in the image, so a plane is fitted to the inverse depths of the nine
    /// pixels around. Where they do not lie on one, they are parted at the widest gap between their depths, and the nearer
    /// part counts: at the rim of an object a feature belongs to the object. Narrow gaps are creases, not rims.
    ///
    /// * `raster` — raster position.
    /// * `focal_px` — focal length, pixels: says how wide a pixel is at a depth.
    ///
    /// `None` without a depth at the nearest pixel, with fewer than six around, or outside the image.
    #[must_use]
    pub fn surface(&self, raster: Point2<f64>, focal_px: f64, noise: &DepthNoise) -> Option<Surface> {
        let (column, row) = nearest(raster)?;
        let middle = self.at(column, row)?;
        let tolerance =
            |depth_m: f64, widths: f64| SIGMAS * noise.sigma_m(depth_m) + widths * depth_m / focal_px;
        let smooth = |(inverse, gradient, worst): (f64, Vector2<f64>, f64)| {
            let (depth_m, bend_m) = (1.0 / inverse, worst * middle * middle);
            let plane = Plane { slope_m: gradient * (-depth_m * depth_m), bend_m };
            (bend_m <= tolerance(middle, BEND)).then_some(Surface {
                depth_m,
                jump: false,
                plane: Some(plane),
            })
        };
        if let Some(square) = self.square(column, row) {
            let offset = Vector2::new(raster.x - column as f64, raster.y - row as f64);
            if let Some(surface) = square_plane(&square, offset).and_then(smooth) {
                return Some(surface);
            }
        }
        let mut near: Vec<(f64, [f64; 2])> = Vec::with_capacity(9);
        for neighbour_row in row - 1..=row + 1 {
            for neighbour_column in column - 1..=column + 1 {
                if let Some(depth) = self.at(neighbour_column, neighbour_row) {
                    let offset = [neighbour_column as f64 - raster.x, neighbour_row as f64 - raster.y];
                    near.push((depth, offset));
                }
            }
        }
        if near.len() < 6 {
            return None;
        }
        if near.len() < 9
            && let Some(surface) = plane(&near).and_then(smooth)
        {
            return Some(surface);
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let gaps = near.windows(2).map(|pair| pair[1].0 - pair[0].0);
        let (before, gap) = (1..).zip(gaps).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let jump = gap > tolerance(near[before - 1].0, JUMP);
        let part = if jump { &near[..before] } else { &near[..] };
        if part.len() < 3 {
            return None;
        }
        // The nearer surface goes on to its rim, which is up to a pixel away from what shows it. Five pixels are not on one line.
        if jump
            && part.len() >= 5
            && let Some((inverse, _, worst)) = plane(part)
            && worst * middle * middle <= tolerance(middle, BEND)
        {
            return Some(Surface { depth_m: 1.0 / inverse, jump, plane: None });
        }
        // Near pixels count most; the one at the place itself all but alone.
        let (mut sum, mut weights) = (0.0, 0.0);
        for (depth, [x, y]) in part {
            let weight = 1.0 / (x * x + y * y + 1e-3);
            sum += weight / depth;
            weights += weight;
        }
        Some(Surface { depth_m: weights / sum, jump, plane: None })
    }

    /// Inverse depths of a pixel and the eight around it, row by row, where all have one.
    fn square(&self, column: i64, row: i64) -> Option<[f64; 9]> {
        let mut square = [0.0; 9];
        for (place, inverse) in (0..).zip(&mut square) {
            *inverse = 1.0 / self.at(column + place % 3 - 1, row + place / 3 - 1)?;
        }
        Some(square)
    }

    /// Whether the map shows a point.
    ///
    /// * `raster` — where the point appears; `depth_m` — its depth, metres.
    /// * `reach` — how many pixels around are asked: 1 asks the four around the place, more a square of that half width.
    #[must_use]
    pub fn sight(
        &self,
        raster: Point2<f64>,
        depth_m: f64,
        focal_px: f64,
        noise: &DepthNoise,
        reach: i64,
    ) -> Sight {
        let tolerance = SIGMAS * noise.sigma_m(depth_m) + NEAR * depth_m / focal_px;
        let (columns, rows) = if reach <= 1 {
            let (column, row) = (floor(raster.x), floor(raster.y));
            (column..=column + 1, row..=row + 1)
        } else {
            let Some((column, row)) = nearest(raster) else { return Sight::Unknown };
            (column - reach + 1..=column + reach - 1, row - reach + 1..=row + reach - 1)
        };
        let (mut known, mut nearer) = (0, 0);
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for row in rows {
            for column in columns.clone() {
                let Some(found) = self.at(column, row) else { continue };
                if (found - depth_m).abs() <= tolerance {
                    return Sight::Seen;
                }
                known += 1;
                nearer += i32::from(found < depth_m);
                least = least.min(found);
                most = most.max(found);
            }
        }
        if known == 0 {
            return Sight::Unknown;
        }
        // Between depths of a steep surface, which a rim does not have.
        if known >= 4 && least < depth_m && depth_m < most {
            if let Some(surface) = self.surface(raster, focal_px, noise)
                && (surface.depth_m - depth_m).abs() <= tolerance
            {
                return Sight::Seen;
            }
            return Sight::Hidden;
        }
        if nearer > 0 { Sight::Hidden } else { Sight::Absent }
    }
}

/// The pixel that a place lies on.
fn nearest(raster: Point2<f64>) -> Option<(i64, i64)> {
    let finite = raster.x.is_finite() && raster.y.is_finite();
    finite.then(|| (floor(raster.x + 0.5), floor(raster.y + 0.5)))
}

#[expect(clippy::cast_possible_truncation, reason = "what is far outside saturates, and is outside as well")]
fn floor(value: f64) -> i64 {
    // Half of the range leaves room for neighbours.
    (value.floor() as i64).clamp(i64::MIN / 2, i64::MAX / 2)
}

/// Least-squares plane through the nine inverse depths of a square: its value at an offset from the middle, its gradient, and
/// the largest distance from it. The square's symmetry leaves three sums.
fn square_plane(square: &[f64; 9], offset: Vector2<f64>) -> Option<(f64, Vector2<f64>, f64)> {
    let [a, b, c, d, e, f, g, h, i] = *square;
    let mean = (a + b + c + d + e + f + g + h + i) / 9.0;
    let gradient = Vector2::new((c + f + i) - (a + d + g), (g + h + i) - (a + b + c)) / 6.0;
    let mut worst = 0.0_f64;
    for (row, values) in square.chunks_exact(3).enumerate() {
        for (column, value) in values.iter().enumerate() {
            let plane = mean + gradient.x * (column as f64 - 1.0) + gradient.y * (row as f64 - 1.0);
            worst = worst.max((plane - value).abs());
        }
    }
    let inverse = mean + gradient.dot(&offset);
    (inverse > 0.0).then_some((inverse, gradient, worst))
}

/// Least-squares plane through inverse depths: its value at the origin, its gradient, and the largest distance from it.
fn plane(near: &[(f64, [f64; 2])]) -> Option<(f64, Vector2<f64>, f64)> {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for (depth, [x, y]) in near {
        let row = Vector3::new(1.0, *x, *y);
        normal += row * row.transpose();
        right += row / *depth;
    }
    let solution = normal.cholesky()?.solve(&right);
    let worst = near
        .iter()
        .map(|(depth, [x, y])| (solution.dot(&Vector3::new(1.0, *x, *y)) - 1.0 / depth).abs())
        .fold(0.0, f64::max);
    (solution.x > 0.0).then_some((solution.x, Vector2::new(solution.y, solution.z), worst))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOCAL_PX: f64 = 100.0;
    const EXACT: DepthNoise = DepthNoise { constant_m: 1e-4, linear: 0.0, quadratic_per_m: 0.0 };

    /// A map of a function of column and row.
    fn map(depth: impl Fn(f64, f64) -> f64) -> DepthMap {
        let cells = (0..400).map(|cell| depth(f64::from(cell % 20), f64::from(cell / 20)) as f32);
        DepthMap::new(20, 20, cells.collect()).unwrap()
    }

    #[test]
    fn a_slanted_plane_is_met_between_pixels() {
        let inverse = |u: f64, v: f64| 0.3 + 0.01 * u - 0.004 * v;
        let map = map(|u, v| 1.0 / inverse(u, v));
        for (u, v) in [(5.0, 5.0), (5.49, 5.51), (10.3, 7.8), (3.5, 12.5)] {
            let surface = map.surface(Point2::new(u, v), FOCAL_PX, &EXACT).unwrap();
            assert!(!surface.jump);
            // The map's numbers have 24 binary digits.
            assert!((surface.depth_m * inverse(u, v) - 1.0).abs() < 1e-6, "{surface:?}");
            let plane = surface.plane.unwrap();
            let slope = Vector2::new(-0.01, 0.004) * surface.depth_m.powi(2);
            assert!((plane.slope_m - slope).norm() < 1e-6 && plane.bend_m < 1e-6, "{plane:?}");
            let sight = |depth| map.sight(Point2::new(u, v), depth, FOCAL_PX, &EXACT, 1);
            assert_eq!(sight(surface.depth_m), Sight::Seen);
            assert_eq!(sight(surface.depth_m * 1.3), Sight::Hidden);
            assert_eq!(sight(surface.depth_m * 0.7), Sight::Absent);
        }
    }

    #[test]
    fn at_a_rim_the_nearer_surface_counts_and_both_are_seen() {
        let rim = map(|u, _| if u < 10.0 { 1.0 } else { 4.0 });
        for u in [9.2, 9.4, 9.6, 10.4] {
            let raster = Point2::new(u, 8.0);
            let surface = rim.surface(raster, FOCAL_PX, &EXACT).unwrap();
            assert!(surface.jump && (surface.depth_m - 1.0).abs() < 1e-9, "{u} {surface:?}");
            assert_eq!(surface.plane, None);
        }
        // A nearer surface that slants goes on to the rim.
        let inverse = |u: f64| 0.8 - 0.03 * u;
        let slanted = map(|u, _| if u < 9.5 { 1.0 / inverse(u) } else { 8.0 });
        let surface = slanted.surface(Point2::new(9.4, 8.0), FOCAL_PX, &EXACT).unwrap();
        assert!(surface.jump && (surface.depth_m * inverse(9.4) - 1.0).abs() < 1e-6, "{surface:?}");
        let raster = Point2::new(9.5, 8.0);
        let sight = |depth| rim.sight(raster, depth, FOCAL_PX, &EXACT, 1);
        assert_eq!(
            [sight(1.0), sight(4.0), sight(2.0), sight(5.0), sight(0.5)],
            [Sight::Seen, Sight::Seen, Sight::Hidden, Sight::Hidden, Sight::Absent]
        );
        assert_eq!(rim.sight(Point2::new(5.0, 8.0), 4.0, FOCAL_PX, &EXACT, 1), Sight::Hidden);
        assert!(!rim.surface(Point2::new(5.0, 8.0), FOCAL_PX, &EXACT).unwrap().jump);
    }

    #[test]
    fn a_crease_is_no_rim() {
        // Two walls at 45 degrees that meet.
        let map = map(|u, _| 2.0 - 0.02 * (u - 10.0).abs());
        let surface = map.surface(Point2::new(10.0, 8.0), FOCAL_PX, &EXACT).unwrap();
        assert!(!surface.jump);
        assert!((surface.depth_m - 2.0).abs() < 0.02, "{surface:?}");
    }

    #[test]
    fn holes_and_what_is_outside_are_unknown() {
        let map = map(|u, v| if (u - 10.0).abs() < 2.0 && (v - 10.0).abs() < 2.0 { 0.0 } else { 2.0 });
        assert_eq!(map.surface(Point2::new(10.0, 10.0), FOCAL_PX, &EXACT), None);
        for raster in [[10.0, 10.0], [-3.0, 5.0], [1e300, 5.0], [f64::NAN, 5.0], [f64::INFINITY, 0.0]] {
            let raster = Point2::from(raster);
            assert_eq!(map.surface(raster, FOCAL_PX, &EXACT), None);
            assert_eq!(map.sight(raster, 2.0, FOCAL_PX, &EXACT, 2), Sight::Unknown);
        }
        assert!((map.coverage() - (1.0 - 9.0 / 400.0)).abs() < 1e-12);
    }

    #[test]
    fn the_plane_of_a_square_is_that_of_any_nine_places() {
        let mut random = open_structure::simulate::Random::new(1, "square", 0);
        for _ in 0..100 {
            let square: [f64; 9] = std::array::from_fn(|_| random.between(0.2, 2.0));
            let offset = Vector2::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5));
            let places = square.iter().enumerate().map(|(place, inverse)| {
                let (x, y) = ((place % 3) as f64 - 1.0, (place / 3) as f64 - 1.0);
                (1.0 / inverse, [x - offset.x, y - offset.y])
            });
            let (value, gradient, worst) = plane(&places.collect::<Vec<_>>()).unwrap();
            let found = square_plane(&square, offset).unwrap();
            assert!((found.0 - value).abs() < 1e-12 && (found.1 - gradient).amax() < 1e-12);
            assert!((found.2 - worst).abs() < 1e-12);
        }
    }

    #[test]
    fn a_range_includes_its_ends_and_is_only_narrowed() {
        let depths = [0.1, 0.1_f32.next_down(), 50.0, 50.0_f32.next_up(), 1.0];
        let mut map = DepthMap::new(5, 1, depths.to_vec()).unwrap();
        let there = |map: &DepthMap| [0, 1, 2, 3, 4].map(|column| map.at(column, 0).is_some());
        assert_eq!(there(&map), [true; 5]);
        map.limit(f64::from(0.1_f32), 50.0);
        assert_eq!(there(&map), [true, false, true, false, true]);
        map.limit(0.0, f64::INFINITY);
        assert_eq!(there(&map), [true, false, true, false, true]);
        map.limit(2.0, 1.0);
        assert_eq!(there(&map), [false; 5]);
    }

    #[test]
    fn numbers_are_the_same_as_bytes_of_a_file() {
        let depths: Vec<f32> = (1..=6_u8).map(|depth| f32::from(depth) * 0.3).collect();
        let bytes =
            [7, 7, 7].into_iter().chain(depths.iter().flat_map(|depth| depth.to_le_bytes())).collect();
        let map = DepthMap::of(3, 2, Samples::LittleEndian { bytes, begin: 3 }).unwrap();
        let numbers = DepthMap::new(3, 2, depths).unwrap();
        for (column, row) in [(0, 0), (2, 0), (0, 1), (2, 1)] {
            assert!(map.at(column, row).is_some());
            assert_eq!(map.at(column, row), numbers.at(column, row));
        }
        assert!(DepthMap::of(3, 2, Samples::LittleEndian { bytes: vec![0; 26], begin: 3 }).is_none());
    }

    #[test]
    fn numbers_that_do_not_fill_the_image_are_refused() {
        assert!(DepthMap::new(3, 2, vec![1.0; 5]).is_none());
        assert!(DepthMap::new(0, 0, vec![]).is_none());
        let map = DepthMap::new(2, 1, vec![f32::INFINITY, -1.0]).unwrap();
        assert_eq!([map.at(0, 0), map.at(1, 0)], [None; 2]);
    }
}
