//! A factor graph into an estimate.

use super::error::Error;
use super::estimation::{Estimation, recover_ends};
use super::grouping::Grouping;
use super::minimise::{Step, minimise_watched};
use super::observations::Observations;
use super::options::{Method, Options, Parallelism};
use super::scale_gauge::ScaleGauge;
use super::summary::{Reason, Summary};
use crate::structure::{Estimate, FactorGraph};

/// An estimate and how it came about.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Adjusted {
    /// Poses, landmarks and the steps that led to them.
    pub estimate: Estimate,
    /// What was used, what was left out, and how it ended.
    pub summary: Summary,
}

/// Rounds after which points are left where they are, though they went behind a camera.
const MOST_ROUNDS: usize = 3;

/// Adjusts a factor graph: moves its vertices to where its factors cost least.
///
/// `min ½ Σ ρ(|W r|²)` over poses and landmarks, with the residuals of the paper (`r_p`, `r_l`), of depths or of relative poses, as
/// [`Options::method`] says. What cannot be used is left out and counted in the summary.
///
/// * `graph` — initial values and factors; poses as `world_from_camera`, metres.
///
/// # Errors
/// [`Error::Nothing`] where nothing can be used, [`Error::Option`] and [`Error::Loss`] for options without meaning,
/// [`Error::UnknownFrame`] for a frame to fix that is not there, [`Error::TooLarge`], [`Error::Start`], and [`Error::Singular`] where
/// covariances are asked for and something is left open.
///
/// # Source
/// Open-Structure (Li et al. 2024), section IV. Where this differs: the paper says nothing on losses, weights and stopping. Pixels alone leave the scale open; here it
/// ends where the cameras' initial centres have it, which changes no residual.
pub fn adjust(graph: &FactorGraph, options: &Options) -> Result<Adjusted, Error> {
    adjust_watched(graph, options, &mut |_| true)
}

/// As [`adjust`], telling each step to a watcher, who ends it by giving `false`.
///
/// # Errors
/// Those of [`adjust`].
pub fn adjust_watched(
    graph: &FactorGraph,
    options: &Options,
    watch: &mut dyn FnMut(&Step) -> bool,
) -> Result<Adjusted, Error> {
    options.check()?;
    let mut summary = Summary::default();
    let mut observations = Observations::of(graph, options, &mut summary)?;
    let asked = options.fix.iter().chain(options.priors.iter().map(|prior| &prior.frame_id));
    for frame in asked {
        if !observations.frames.iter().any(|vertex| vertex.frame_id == *frame) {
            return Err(Error::UnknownFrame { graph: graph.name.clone(), frame: *frame });
        }
    }
    let gauge = ScaleGauge::of(&observations);
    let mut grouping = Grouping::none(&observations);
    let mut estimation = Estimation::new(&observations, &grouping, options, &mut summary)?;
    let is_structural = options.method == Method::Structural;
    if is_structural && options.smooth_motion {
        summary.carried = observations.tie_weak_frames(&estimation);
        if !observations.relatives.is_empty() {
            summary.relative_factors.used = observations.relatives.len();
            estimation = Estimation::new(&observations, &grouping, options, &mut summary)?;
        }
    }
    let mut steps: Vec<Step> = Vec::new();
    for round in 0..MOST_ROUNDS {
        let minimum = minimise_watched(&mut estimation.problem, &options.solver, watch)?;
        if round == 0 {
            summary.initial_cost = minimum.initial_cost;
        }
        // A later round begins where the one before ended, but for what it left out or tied.
        steps.extend(minimum.steps);
        summary.final_cost = minimum.final_cost;
        summary.ending = minimum.ending;
        summary.plan = minimum.plan;
        estimation.read(&mut observations);
        let mut again = observations.drop_behind(&mut summary);
        if round == 0 && is_structural {
            // Lines are weighed anew for where they are now, and tied to groups that they agree with.
            again = true;
            if options.parallelism != Parallelism::Ignored {
                estimation.hold_scale(&observations)?;
                grouping = Grouping::tested(graph, &observations, &estimation, &mut summary);
            }
        }
        if !again || round + 1 == MOST_ROUNDS {
            break;
        }
        estimation = Estimation::new(&observations, &grouping, options, &mut summary)?;
    }
    if is_structural {
        recover_ends(&mut observations);
    }
    // A prior of a pose is a scale too.
    let free = estimation.free_scales(&observations);
    if options.priors.is_empty() && gauge.restore(&mut observations, &free) {
        estimation = Estimation::new(&observations, &grouping, options, &mut summary)?;
    }
    summary.iterations = steps.len().saturating_sub(1);
    let estimate = estimation.estimate(&observations, options, &steps, &mut summary)?;
    Ok(Adjusted { estimate, summary })
}

impl Observations {
    /// Leaves out measurements of points that are behind their camera now; whether there were any.
    fn drop_behind(&mut self, summary: &mut Summary) -> bool {
        let before = self.point_views.len();
        let (frames, points) = (&self.frames, &self.points);
        let mut gone = Vec::new();
        self.point_views.retain(|view| {
            let in_front = (frames[view.frame].camera_from_world * points[view.point].position).z > 0.0;
            if !in_front {
                gone.push(points[view.point].point_id);
                summary.point_factors.exclude(Reason::WentBehindCamera);
            }
            in_front
        });
        gone.sort_unstable();
        gone.dedup();
        summary.behind.extend(gone);
        summary.behind.sort_unstable();
        summary.behind.dedup();
        summary.point_factors.used = self.point_views.len();
        self.point_views.len() < before
    }
}
