//! A segment of an image lifted to where it is in the world.

use nalgebra::{Point2, Point3, Vector3};
use open_structure::geometry::{Pose, Segment};
use open_structure::simulate::Random;

use super::line_options::{LineOptions, focal_px, tolerance_m};
use super::rims::Rims;
use super::scatter::Scatter;
use crate::rgbd::{DepthMap, DepthNoise, Raster};

/// Fewest places that make a line.
const FEWEST: usize = 4;
/// Most places along a segment, whatever the options say.
const MOST: usize = 10_000;

/// A segment of an image where it is in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct LiftedLine {
    /// Its ends, world, metres.
    pub segment: Segment,
    /// Its places, each weighted by the inverse square of `tolerance_m` at its depth.
    pub scatter: Scatter,
    /// How far a place of it may be from the truth: a standard deviation of the depth and the width of a pixel, metres.
    pub tolerance_m: f64,
    /// Part of its places that lie on a rim.
    pub rim_part: f64,
    /// Places that lie on it.
    pub places: usize,
}

/// Why a segment was not lifted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rejected {
    /// Too few of its places have a depth.
    TooFewDepths,
    /// Too many of its places lie on a rim.
    OnRim,
    /// Too few of its places lie on a straight line in space.
    NotStraight,
    /// The line is too short, in metres.
    TooShort,
}

impl Rejected {
    /// Every reason.
    pub const ALL: [Self; 4] = [Self::TooFewDepths, Self::OnRim, Self::NotStraight, Self::TooShort];

    /// The reason in words.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::TooFewDepths => "segment with too few depths",
            Self::OnRim => "segment on a rim",
            Self::NotStraight => "segment that is not straight in space",
            Self::TooShort => "segment that is too short in space",
        }
    }
}

/// A place of a segment in the camera.
#[derive(Clone, Copy)]
struct Place {
    point: Point3<f64>,
    /// How far the line may be, metres.
    reach: f64,
    weight: f64,
    rim: bool,
}

/// The line in the world that a segment of an image shows.
///
/// Places along the segment are back-projected with the depth that the map has there (at a rim, that of the nearer surface).
/// The line on which most of them lie is found by trying pairs of places, then fitted to all that lie on it by weighted total
/// least squares, twice. Its ends are the outermost of these places, projected onto it.
///
/// * `segment` — raster positions.
/// * `random` — draws the pairs; the same state gives the same line.
///
/// # Errors
/// [`Rejected`], the reason why there is no line.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III-A: pixels along the segment, back-projected, RANSAC. Thresholds are ours.
pub fn lift(
    raster: &Raster,
    depth: &DepthMap,
    world_from_camera: &Pose,
    segment: [Point2<f64>; 2],
    noise: &DepthNoise,
    options: &LineOptions,
    random: &mut Random,
) -> Result<LiftedLine, Rejected> {
    let (places, asked) = places(raster, depth, segment, noise, options);
    if places.len() < FEWEST || (places.len() as f64) < options.depth_part * asked as f64 {
        return Err(Rejected::TooFewDepths);
    }
    let share =
        |places: &[Place]| places.iter().filter(|place| place.rim).count() as f64 / places.len() as f64;
    if options.rims == Rims::Reject && share(&places) > options.rim_part {
        return Err(Rejected::OnRim);
    }
    let mut on_line = consensus(&places, options.trials, random);
    let mut line = None;
    for _ in 0..2 {
        let scatter = Scatter::of(on_line.iter().map(|place| (place.point, place.weight)));
        let Some((first, last, scatter)) =
            on_line.first().zip(on_line.last()).zip(scatter).map(|((a, b), c)| (a, b, c))
        else {
            return Err(Rejected::NotStraight);
        };
        let (direction, _) = scatter.line(&(last.point - first.point)).ok_or(Rejected::NotStraight)?;
        on_line = near(&places, scatter.mean(), direction);
        line = Some((scatter.mean(), direction));
    }
    let enough = (options.straight_part * places.len() as f64).max(FEWEST as f64);
    let Some((mean, direction)) = line.filter(|_| on_line.len() as f64 >= enough) else {
        return Err(Rejected::NotStraight);
    };
    let along = |place: &Place| direction.dot(&(place.point - mean));
    let from = on_line.iter().map(along).fold(f64::INFINITY, f64::min);
    let to = on_line.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    if !(to - from >= options.length_m && to > from) {
        return Err(Rejected::TooShort);
    }
    let in_camera = Segment { start: mean + direction * from, end: mean + direction * to };
    let in_world = on_line.iter().map(|place| (world_from_camera * place.point, place.weight));
    let depth_m = mean.z.max(f64::MIN_POSITIVE);
    Ok(LiftedLine {
        segment: in_camera.transformed(world_from_camera),
        scatter: Scatter::of(in_world).ok_or(Rejected::NotStraight)?,
        tolerance_m: tolerance_m(raster, noise, depth_m),
        rim_part: share(&on_line),
        places: on_line.len(),
    })
}

/// The places of a segment that have a depth, in the camera, and how many were asked.
fn places(
    raster: &Raster,
    depth: &DepthMap,
    [start, end]: [Point2<f64>; 2],
    noise: &DepthNoise,
    options: &LineOptions,
) -> (Vec<Place>, usize) {
    let length = (end - start).norm();
    let most = options.most_places.clamp(FEWEST, MOST) as f64;
    // A length that is not a number asks at the fewest places, none of which has a depth.
    let steps = (length / options.step_px.max(0.1)).ceil().max(FEWEST as f64).min(most);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between FEWEST and MOST")]
    let steps = steps as usize;
    let focal_px = focal_px(raster);
    let place = |step: usize| {
        let position = start + (end - start) * (step as f64 / steps as f64);
        let surface = depth.surface(position, focal_px, noise)?;
        let point = raster.back_project(position, surface.depth_m)?;
        let reach = options.straight_sigmas * noise.sigma_m(surface.depth_m)
            + options.straight_px * surface.depth_m / focal_px;
        let tolerance = tolerance_m(raster, noise, surface.depth_m);
        Some(Place { point, reach, weight: 1.0 / (tolerance * tolerance), rim: surface.jump })
    };
    ((0..=steps).filter_map(place).collect(), steps + 1)
}

/// The places near the line of that pair of places near which most lie; of equal ones, the first that was tried.
fn consensus(places: &[Place], trials: usize, random: &mut Random) -> Vec<Place> {
    let count = places.len();
    let mut best = Vec::new();
    // The outermost pair is the answer wherever nothing is wrong, and needs no luck.
    let mut pair = (0, count - 1);
    for _ in 0..=trials {
        let (a, b) = (&places[pair.0], &places[pair.1]);
        if let Some(direction) = (b.point - a.point).try_normalize(f64::MIN_POSITIVE) {
            let found = near(places, a.point, direction);
            if found.len() > best.len() {
                best = found;
            }
            if best.len() == count {
                break;
            }
        }
        // Pairs a quarter of the segment apart at least, for near ones say little of a direction.
        let apart = (count / 4).max(1);
        let first = random.index(count - apart);
        pair = (first, first + apart + random.index(count - apart - first));
    }
    best
}

/// The places that lie on a line.
fn near(places: &[Place], through: Point3<f64>, direction: Vector3<f64>) -> Vec<Place> {
    let on_line = |place: &&Place| direction.cross(&(place.point - through)).norm() <= place.reach;
    places.iter().filter(on_line).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rgbd::BrownConrady;
    use nalgebra::Vector2;
    use open_structure::geometry::PinholeCamera;
    use open_structure::structure::{Camera, CameraId, registry};
    use proptest::prelude::*;

    const NOISE: DepthNoise = DepthNoise { constant_m: 1e-3, linear: 0.0, quadratic_per_m: 0.0 };

    fn raster(lens: bool) -> Raster {
        let pinhole = PinholeCamera { fx: 130.0, fy: 135.0, cx: 80.0, cy: 60.0, width: 160, height: 120 };
        let lens = lens.then(|| BrownConrady::new([0.2312, -0.7849, -0.0033, -0.0001, 0.9172]));
        Raster::new(&Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CORNER), lens)
    }

    /// The depth map of a function of raster positions.
    fn map(depth: impl Fn(Point2<f64>) -> f64) -> DepthMap {
        let cells = (0..160 * 120)
            .map(|cell| depth(Point2::new(f64::from(cell % 160), f64::from(cell / 160))) as f32);
        DepthMap::new(160, 120, cells.collect()).unwrap()
    }

    /// A plane whose normal, divided by its distance, is this: `n · p = 1`.
    fn plane(raster: &Raster, normal: Vector3<f64>, at: Point2<f64>) -> f64 {
        raster.back_project(at, 1.0).map_or(f64::NAN, |ray| 1.0 / normal.dot(&ray.coords))
    }

    fn pose() -> impl Strategy<Value = Pose> {
        (prop::array::uniform3(-5.0..5.0), prop::array::uniform4(0.1..1.0))
            .prop_map(|(t, q)| Pose::from_components(t, q).unwrap())
    }

    fn lifted(
        raster: &Raster,
        depth: &DepthMap,
        segment: [Point2<f64>; 2],
        options: &LineOptions,
    ) -> Result<LiftedLine, Rejected> {
        lift(raster, depth, &Pose::identity(), segment, &NOISE, options, &mut Random::new(1, "lines", 0))
    }

    fn between(from: [f64; 2], to: [f64; 2]) -> [Point2<f64>; 2] {
        [Point2::from(from), Point2::from(to)]
    }

    proptest! {
        #[test]
        fn a_segment_on_a_plane_is_lifted_onto_it(
            world_from_camera in pose(), lens in any::<bool>(), slope in prop::array::uniform2(-0.15..0.15),
            from in (10.0..70.0, 10.0..110.0), to in (90.0..150.0, 10.0..110.0), hidden in 0.2..0.8_f64,
        ) {
            let raster = raster(lens);
            let normal = Vector3::new(slope[0], slope[1], 0.4);
            let (from, to) = (Point2::from(<[f64; 2]>::from(from)), Point2::from(<[f64; 2]>::from(to)));
            // Something stands in front of a tenth of the segment, about a place.
            let place: Point2<f64> = from + (to - from) * hidden;
            let reach = 0.05 * (to - from).norm();
            let depth = map(|at: Point2<f64>| if (at - place).norm() < reach { 0.9 } else { plane(&raster, normal, at) });
            let random = || Random::new(4, "lines", 2);
            let options = LineOptions::default();
            // Through the lens, the image of a line is bent by up to a pixel or two.
            let options = LineOptions { straight_px: if lens { 4.0 } else { 1.0 }, ..options };
            let line = lift(&raster, &depth, &world_from_camera, [from, to], &NOISE, &options, &mut random()).unwrap();
            let again = lift(&raster, &depth, &world_from_camera, [from, to], &NOISE, &options, &mut random()).unwrap();
            prop_assert_eq!(&line, &again);
            let ends = [from, to].map(|at| world_from_camera * raster.back_project(at, plane(&raster, normal, at)).unwrap());
            // Metres: within the thresholds of the fit; without a lens nothing but the file's 24 digits and rims is left.
            let limit = if lens { 0.08 } else { 0.02 };
            prop_assert!((line.segment.start - ends[0]).norm() < limit, "{line:?} {ends:?}");
            prop_assert!((line.segment.end - ends[1]).norm() < limit, "{line:?} {ends:?}");
            prop_assert!(line.places >= FEWEST && line.rim_part <= 0.5);
        }
    }

    #[test]
    fn at_a_rim_the_nearer_surface_has_the_line() {
        let raster = raster(false);
        let depth = map(|at| if at.x < 79.5 { 1.0 } else { 3.0 });
        // The middle of the edge, and half a pixel to either side.
        for x in [79.1, 79.5, 79.9] {
            let edge = between([x, 10.0], [x, 100.0]);
            let line = lifted(&raster, &depth, edge, &LineOptions::default()).unwrap();
            assert!((line.segment.start.z - 1.0).abs() < 1e-6 && (line.segment.end.z - 1.0).abs() < 1e-6);
            assert!(line.rim_part > 0.99, "{line:?}");
            let options = LineOptions { rims: Rims::Reject, ..LineOptions::default() };
            assert_eq!(lifted(&raster, &depth, edge, &options), Err(Rejected::OnRim));
            let inside = edge.map(|end| end - Vector2::new(5.0, 0.0));
            assert!(lifted(&raster, &depth, inside, &options).unwrap().rim_part < 0.01);
        }
    }

    #[test]
    fn each_reason_to_reject_a_segment_is_told() {
        let raster = raster(false);
        let options = LineOptions::default();
        let segment = between([20.0, 30.0], [120.0, 40.0]);
        let rejected = |depth: &DepthMap| lifted(&raster, depth, segment, &options).unwrap_err();
        assert_eq!(rejected(&map(|at| if at.x < 80.0 { f64::NAN } else { 2.0 })), Rejected::TooFewDepths);
        assert_eq!(rejected(&map(|at| 2.0 + 0.3 * (at.x * 0.1).sin())), Rejected::NotStraight);
        let near = map(|_| 2.0);
        let options = LineOptions { length_m: 1.6, ..options };
        assert_eq!(lifted(&raster, &near, segment, &options), Err(Rejected::TooShort));
        assert!(lifted(&raster, &near, segment, &LineOptions::default()).is_ok());
    }

    #[test]
    fn odd_segments_and_options_are_refused_without_harm() {
        let raster = raster(false);
        let depth = map(|_| 2.0);
        let odd = [f64::NAN, f64::INFINITY, -1e300, -40.0, 1e9];
        for x in odd {
            for y in odd {
                let segment = between([x, y], [50.0, 50.0]);
                assert!(lifted(&raster, &depth, segment, &LineOptions::default()).is_err(), "{segment:?}");
            }
        }
        let segment = between([20.0, 30.0], [120.0, 40.0]);
        for number in odd {
            let options = LineOptions {
                step_px: number,
                straight_sigmas: number,
                most_places: 0,
                ..LineOptions::default()
            };
            let _ = lifted(&raster, &depth, segment, &options);
            let options = LineOptions {
                depth_part: number,
                straight_part: number,
                length_m: number,
                ..LineOptions::default()
            };
            let _ = lifted(&raster, &depth, segment, &options);
        }
        let point = between([20.0, 30.0], [20.0, 30.0]);
        assert!(
            lifted(&raster, &depth, point, &LineOptions { length_m: 0.0, ..LineOptions::default() }).is_err()
        );
    }
}
