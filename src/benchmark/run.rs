//! Makes the cells of a plan, on both cores, and keeps each when it is done.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;

use super::bound::bounds;
use super::content::Content;
use super::measured::given;
use super::{Cell, CellKey, CurvePoint, Error, Method, Outcome, Plan, Store, load};
use crate::adjust;
use crate::covisibility::{GraphOptions, reprojection_graph};
use crate::evaluate::{Alignment, Step, absolute, relative};
use crate::geometry::Pose;
use crate::storage;
use crate::structure::{Estimate, FrameId, MeasuredFrame, MeasurementNoise, Sequence, registry};
use crate::track::{self, TrackOptions};

/// What is told while a benchmark runs.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress<'a> {
    /// A sequence cannot be benchmarked and is left out.
    LeftOut {
        /// Its name.
        sequence: &'a str,
        /// Why.
        reason: &'a str,
    },
    /// Estimates of a sequence were made of its own measurements, and methods are given others.
    OtherMeasurements {
        /// Name of the sequence.
        sequence: &'a str,
    },
    /// A sequence is not the one that stored cells were made of: they are made anew.
    Changed {
        /// Its name.
        sequence: &'a str,
    },
    /// The bound of a method on a sequence cannot be computed.
    NoBound {
        /// Name of the sequence.
        sequence: &'a str,
        /// Name of the method.
        method: &'a str,
        /// Why.
        reason: &'a str,
    },
    /// So many of so many units, each one sequence with one seed, are done.
    Done {
        /// Units done.
        done: u64,
        /// Units in all.
        total: u64,
    },
}

/// What all cells of a sequence share.
struct Case {
    sequence: Sequence,
    truth: Vec<(FrameId, Pose)>,
}

/// Makes the cells of a plan that a store does not have yet.
///
/// * `names` — sequences as [`load`] takes them.
/// * `tell` — told of what is done, from any thread.
///
/// Units of one sequence and one seed run side by side; their figures do not depend on how many do. A sequence without true
/// poses is left out and told. Gives the names of the sequences in the order given: those in their manifests, or where several
/// are called the same, such as one with several noises, those of their files.
///
/// # Errors
/// Those of [`load`] and of the store, [`Error::SameName`]; the first of them ends the run, and what is done is kept.
pub fn run(
    names: &[String],
    plan: &Plan,
    store: &Store,
    tell: &(dyn Fn(&Progress<'_>) + Sync),
) -> Result<Vec<String>, Error> {
    let mut cases = Vec::new();
    let mut kept = Vec::new();
    for sequence in loaded(names)? {
        let title = sequence.manifest.name.clone();
        let truth: Vec<(FrameId, Pose)> = sequence
            .frames
            .iter()
            .filter_map(|frame| Some((frame.frame_id, frame.world_from_camera()?.pose().ok()?)))
            .collect();
        let rows = sequence.point_observations.len() + sequence.point_measurements.len();
        let reason = match (truth.len(), rows) {
            (0..=2, _) => "no true poses to compare with",
            (_, 0) => "no points",
            _ => {
                if store.expect(&title, &Content::of(&sequence, &plan.estimates))? {
                    tell(&Progress::Changed { sequence: &title });
                }
                let has_own =
                    !sequence.point_measurements.is_empty() || !sequence.line_measurements.is_empty();
                let draws = !sequence.point_observations.is_empty() || !sequence.line_observations.is_empty();
                if has_own && draws && !plan.estimates.is_empty() && !plan.as_measured {
                    tell(&Progress::OtherMeasurements { sequence: &title });
                }
                kept.push(title);
                cases.push(Case { sequence, truth });
                continue;
            }
        };
        tell(&Progress::LeftOut { sequence: &title, reason });
    }
    let bound = plan.bound;
    let units: Vec<(&Case, Option<u64>)> = cases
        .iter()
        .flat_map(|case| {
            let seeds = plan.seeds.iter().map(|seed| Some(*seed));
            bound.then_some(None).into_iter().chain(seeds).map(move |unit| (case, unit))
        })
        .collect();
    let done = std::sync::atomic::AtomicU64::new(0);
    let total = units.len() as u64;
    tell(&Progress::Done { done: 0, total });
    // One at a time from the front, so that a run that is cut off has whole sequences.
    units.par_iter().with_max_len(1).try_for_each(|(case, unit)| {
        match unit {
            Some(seed) => seeded(case, plan, *seed, store)?,
            None => bounds(&case.sequence, plan, store, tell)?,
        }
        let done = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        tell(&Progress::Done { done, total });
        Ok::<(), Error>(())
    })?;
    store.ran(plan, &kept)?;
    Ok(kept)
}

/// The sequences of some names, each with a name of its own.
fn loaded(names: &[String]) -> Result<Vec<Sequence>, Error> {
    let mut sequences = names.iter().map(|name| load(name)).collect::<Result<Vec<_>, _>>()?;
    let titles: Vec<String> = sequences.iter().map(|sequence| sequence.manifest.name.clone()).collect();
    let mut known = BTreeSet::new();
    for ((sequence, title), name) in sequences.iter_mut().zip(&titles).zip(names) {
        if titles.iter().filter(|other| *other == title).count() > 1 {
            let place = storage::without_query(Path::new(name));
            let stem = if storage::is_folder(place) { place.file_name() } else { place.file_stem() };
            sequence.manifest.name =
                stem.map_or_else(|| title.clone(), |stem| stem.to_string_lossy().into_owned());
        }
        if !known.insert(sequence.manifest.name.clone()) {
            return Err(Error::SameName { name: sequence.manifest.name.clone() });
        }
    }
    Ok(sequences)
}

/// All methods of a plan on one sequence with one seed.
fn seeded(case: &Case, plan: &Plan, seed: u64, store: &Store) -> Result<(), Error> {
    let title = &case.sequence.manifest.name;
    let key = |method: &str| CellKey { sequence: title.clone(), method: method.to_owned(), seed };
    let mut wanted = Vec::new();
    for method in &plan.methods {
        if store.cell(&key(method.name()))?.is_none() {
            wanted.push(*method);
        }
    }
    for name in &plan.estimates {
        // An estimate has no seed: it stands once.
        let key = CellKey { seed: 0, ..key(name) };
        if Some(seed) == plan.seeds.first().copied() && store.cell(&key)?.is_none() {
            let outcome = match Estimate::of(&case.sequence, name) {
                Some(estimate) => judged(&case.truth, &estimate),
                None => failed("the sequence has no such estimate"),
            };
            store.keep(&Cell { key, outcome, seconds: 0.0, curve: Vec::new() })?;
        }
    }
    if wanted.is_empty() {
        return Ok(());
    }
    let sequence = given(&case.sequence, plan, seed);
    let given = Given {
        frames: MeasuredFrame::of(&sequence),
        noise: MeasurementNoise::declared(&sequence.manifest),
        sequence: &sequence,
        truth: &case.truth,
        seed,
    };
    let mut initial: Option<Result<Estimate, String>> = None;
    for method in wanted {
        if method.is_adjustment() && initial.is_none() {
            initial = Some(given.tracked(Method::MapToFrame));
        }
        let begun = Instant::now();
        let (estimate, ending) = match (&initial, method.is_adjustment()) {
            (Some(Ok(initial)), true) => match given.adjusted(method, initial) {
                Ok((estimate, ending)) => (Ok(estimate), Some(ending)),
                Err(reason) => (Err(reason), None),
            },
            (Some(Err(reason)), true) => (Err(reason.clone()), None),
            _ => (given.tracked(method), None),
        };
        let seconds = begun.elapsed().as_secs_f64();
        let mut curve = Vec::new();
        let mut outcome = match &estimate {
            Ok(estimate) => {
                curve.extend(estimate.iterations.iter().map(|row| CurvePoint {
                    iteration: row.iteration,
                    cost: row.cost,
                    accepted: row.accepted,
                }));
                judged(&case.truth, estimate)
            }
            Err(reason) => failed(reason),
        };
        if let Outcome::Estimated { ending: of, .. } = &mut outcome {
            *of = ending;
        }
        store.keep(&Cell { key: key(method.name()), outcome, seconds, curve })?;
        if method == Method::MapToFrame {
            initial.get_or_insert(estimate);
        }
    }
    Ok(())
}

/// What a method is given: measurements, and of the truth the first pose alone.
struct Given<'a> {
    frames: Vec<MeasuredFrame>,
    noise: MeasurementNoise,
    sequence: &'a Sequence,
    truth: &'a [(FrameId, Pose)],
    seed: u64,
}

impl Given<'_> {
    fn tracked(&self, method: Method) -> Result<Estimate, String> {
        let kind = match method {
            Method::FrameToFrame | Method::FrameToFrameClassic => track::Method::FrameToFrame,
            _ => track::Method::MapToFrame,
        };
        let classic = matches!(method, Method::FrameToFrameClassic | Method::MapToFrameClassic);
        let options = TrackOptions { method: kind, classic, seed: self.seed, ..TrackOptions::default() };
        let first = self.frames.first().map(|frame| frame.frame_id);
        let gauge = self.truth.iter().find(|(frame, _)| Some(*frame) == first).map(|(_, pose)| *pose);
        let mut tracker = options
            .tracker(&self.sequence.manifest.cameras, self.noise, gauge.unwrap_or_default())
            .map_err(|cause| cause.to_string())?;
        track::track(&self.frames, method.name(), tracker.as_mut(), &|_, _| {})
            .map_err(|cause| cause.to_string())
    }

    fn adjusted(&self, method: Method, initial: &Estimate) -> Result<(Estimate, String), String> {
        let options = GraphOptions::default();
        let (cameras, groups) = (&self.sequence.manifest.cameras, &self.sequence.structural_groups);
        let (graph, _) = reprojection_graph(&self.frames, initial, cameras, self.noise, groups, &options)
            .map_err(|cause| cause.to_string())?;
        let options = adjust::Options { name: Some(method.name().to_owned()), ..adjust_options(method) };
        let found = adjust::adjust(&graph, &options).map_err(|cause| cause.to_string())?;
        Ok((found.estimate, format!("{:?}", found.summary.ending)))
    }
}

/// Part of the cost by which a step has to lower it: what Ceres takes by default.
const FUNCTION_TOLERANCE: f64 = 1e-6;

/// The usual options of a method.
pub(super) fn adjust_options(method: Method) -> adjust::Options {
    let mut options = adjust::Options::of(match method {
        Method::PointBa => adjust::Method::Point,
        Method::PointLineBa => adjust::Method::PointLine,
        _ => adjust::Method::Structural,
    });
    options.solver.function_tolerance = FUNCTION_TOLERANCE;
    options
}

fn failed(reason: &str) -> Outcome {
    Outcome::Failed { reason: reason.to_owned() }
}

/// Errors of an estimate.
fn judged(truth: &[(FrameId, Pose)], estimate: &Estimate) -> Outcome {
    let poses: Result<Vec<(FrameId, Pose)>, _> =
        estimate.trajectory.iter().map(|row| Ok((row.frame_id, row.world_from_camera().pose()?))).collect();
    let poses = match poses {
        Ok(poses) => poses,
        Err(cause) => {
            let cause: crate::geometry::Error = cause;
            return failed(&cause.to_string());
        }
    };
    let errors = || {
        let rigid = absolute(truth, &poses, Alignment::SE3)?;
        let scaled = absolute(truth, &poses, Alignment::SIM3)?;
        let turned = relative(truth, &poses, Alignment::NONE, Step::FRAME)?;
        Ok((rigid, scaled, turned))
    };
    let (rigid, scaled, turned) = match errors() {
        Ok(found) => found,
        Err(cause) => {
            let cause: crate::evaluate::Error = cause;
            return failed(&cause.to_string());
        }
    };
    let unsupported = [registry::PREDICTED, registry::LOST];
    let last = estimate.iterations.iter().rfind(|row| row.accepted).or(estimate.iterations.last());
    Outcome::Estimated {
        ape_rmse_m: rigid.translation.rmse(),
        ape_median_m: rigid.translation.median(),
        ape_sim3_rmse_m: scaled.translation.rmse(),
        rpe_rotation_rmse_deg: turned.rotation.rmse().to_degrees(),
        rpe_rotation_median_deg: turned.rotation.median().to_degrees(),
        frames: poses.len(),
        predicted: estimate.tracking.iter().filter(|row| unsupported.contains(&row.state.as_str())).count(),
        iterations: last.map(|_| estimate.iterations.len().saturating_sub(1)),
        cost: last.map(|row| row.cost),
        ending: None,
    }
}
