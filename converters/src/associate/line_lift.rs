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
