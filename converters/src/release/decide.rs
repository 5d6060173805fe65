//! Truth or measurement: told by residuals, never by the name of a file.

use super::line_fit::Fits;
use super::poses::Poses;
use super::residual::{Spread, line_distances, line_views, point_misses, point_noise};
use nalgebra::Point3;
use open_structure::geometry::{PinholeCamera, PluckerLine};
use open_structure::structure::{LineId, LineMeasurement, PointId, PointMeasurement};
use std::collections::BTreeMap;

/// Rows with a robust sigma below this are without noise, pixels: the release's noise has 1 px, rounding at most 0.02 px.
pub const NOISE_FREE_PX: f64 = 0.2;

/// What rows are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Re-projections, without noise.
    NoiseFree,
    /// Measurements.
    Noisy,
    /// No row could be held against anything.
    Unknown,
}

/// What the rows of one kind in one file are, and by which figures.
#[derive(Clone, Copy, Debug)]
pub struct Judgement {
    /// What they are.
    pub verdict: Verdict,
    /// Rows.
    pub rows: usize,
    /// Residuals against what the rows themselves triangulate to through the true poses, pixels.
    pub own: Option<Spread>,
    /// Residuals against the published landmarks through the true poses, pixels.
    pub landmarks: Option<Spread>,
}

impl Judgement {
    fn new(rows: usize, own: Option<Spread>, landmarks: Option<Spread>) -> Self {
        // Landmarks may be wrong, or turned after they were observed; what the rows say together cannot.
        let verdict = match own.or(landmarks) {
            None => Verdict::Unknown,
            Some(spread) if spread.sigma < NOISE_FREE_PX => Verdict::NoiseFree,
            Some(_) => Verdict::Noisy,
        };
        Self { verdict, rows, own, landmarks }
    }

    /// In words, for the manifest.
    pub(super) fn told(&self) -> String {
        let verdict = match self.verdict {
            Verdict::NoiseFree => "noise-free",
            Verdict::Noisy => "noisy",
            Verdict::Unknown => "not decidable",
        };
        let figure = |spread: Option<Spread>, against: &str| {
            spread.map_or_else(String::new, |spread| {
                format!("; sigma {:.2e} px against {against}", spread.sigma)
            })
        };
        format!(
            "{verdict}: {} rows{}{}",
            self.rows,
            figure(self.own, "their own triangulation"),
            figure(self.landmarks, "the published landmarks")
        )
    }
}

/// Judges point rows.
pub(super) fn judge_points(
    rows: &[PointMeasurement],
    poses: &Poses,
    camera: &PinholeCamera,
    landmarks: &BTreeMap<PointId, Point3<f64>>,
) -> Judgement {
    Judgement::new(rows.len(), point_noise(rows, poses, camera), point_misses(rows, poses, camera, landmarks))
}

/// Judges line rows by the lines that were fitted to them: published lines were turned after they were observed.
pub(super) fn judge_lines(
    tracks: &BTreeMap<LineId, Vec<&LineMeasurement>>,
    fits: &Fits,
    poses: &Poses,
    camera: &PinholeCamera,
    landmarks: &BTreeMap<LineId, PluckerLine>,
) -> Judgement {
    let own = fits.values().flatten().flat_map(|fit| fit.distances_px.iter().copied()).collect();
    let misses = tracks
        .iter()
        .filter_map(|(id, track)| Some(line_distances(&line_views(track, poses, camera), landmarks.get(id)?)))
        .flatten()
        .collect();
    Judgement::new(tracks.values().map(Vec::len).sum(), Spread::of(own), Spread::of(misses))
}

/// Where rows came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    Association,
    Graph,
}

/// Which file's rows become observations, and which become measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Assignment {
    pub(super) observations: Option<Origin>,
    pub(super) measurements: Option<Origin>,
    /// The graph's rows are neither, and stand in its factors alone.
    pub(super) graph_apart: bool,
}

/// Assigns the rows of one kind.
///
/// * `association`, `graph` — what each file's rows are; `None` where it has none.
/// * `same` — both files have the very same rows.
///
/// The graph's rows are what the release's graph was built on, so that they are the measurements even where they carry
/// no noise. Where the association is noisy itself, its rows are the measurements, for it is the complete list; the
/// graph's rows are then either the same ones or those of its factors alone.
pub(super) fn assign(association: Option<Verdict>, graph: Option<Verdict>, same: bool) -> Assignment {
    use Origin::{Association, Graph};
    let assignment =
        |observations, measurements, graph_apart| Assignment { observations, measurements, graph_apart };
    match (association, graph) {
        (None, None) => assignment(None, None, false),
        (Some(Verdict::NoiseFree), None) => assignment(Some(Association), None, false),
        (Some(Verdict::NoiseFree), Some(_)) => assignment(Some(Association), Some(Graph), false),
        (Some(_), Some(Verdict::NoiseFree)) if !same => assignment(Some(Graph), Some(Association), false),
        (Some(_), graph) => assignment(None, Some(Association), graph.is_some() && !same),
        (None, Some(Verdict::NoiseFree)) => assignment(Some(Graph), Some(Graph), false),
        (None, Some(_)) => assignment(None, Some(Graph), false),
    }
}

#[cfg(test)]
mod tests {
    use super::Origin::{Association, Graph};
    use super::Verdict::{NoiseFree, Noisy, Unknown};
    use super::*;

    #[test]
    fn every_pair_of_verdicts_has_its_tables() {
        let cases = [
            // (association, graph, same) → observations, measurements, graph apart
            ((Some(NoiseFree), Some(Noisy), false), (Some(Association), Some(Graph), false)),
            ((Some(NoiseFree), Some(NoiseFree), true), (Some(Association), Some(Graph), false)),
            ((Some(NoiseFree), None, false), (Some(Association), None, false)),
            ((Some(Noisy), Some(Noisy), true), (None, Some(Association), false)),
            ((Some(Noisy), Some(Noisy), false), (None, Some(Association), true)),
            ((Some(Noisy), Some(NoiseFree), false), (Some(Graph), Some(Association), false)),
            ((Some(Noisy), None, false), (None, Some(Association), false)),
            ((Some(Unknown), None, false), (None, Some(Association), false)),
            ((None, Some(Noisy), false), (None, Some(Graph), false)),
            ((None, Some(NoiseFree), false), (Some(Graph), Some(Graph), false)),
            ((None, None, true), (None, None, false)),
        ];
        for ((association, graph, same), (observations, measurements, graph_apart)) in cases {
            let expected = Assignment { observations, measurements, graph_apart };
            assert_eq!(assign(association, graph, same), expected, "{association:?} {graph:?} {same}");
        }
    }

    #[test]
    fn own_triangulation_outweighs_wrong_landmarks() {
        let spread = |sigma| Some(Spread { sigma, count: 100 });
        assert_eq!(Judgement::new(9, spread(0.001), spread(3.0)).verdict, NoiseFree);
        assert_eq!(Judgement::new(9, spread(1.0), spread(0.001)).verdict, Noisy);
        assert_eq!(Judgement::new(9, None, spread(0.001)).verdict, NoiseFree);
        assert_eq!(Judgement::new(9, None, None).verdict, Unknown);
    }
}
