//! What to adjust, and how.

use super::error::Error;
use super::loss::Loss;
use super::minimise::SolverOptions;
use crate::structure::{FrameId, PoseRow};

/// What is adjusted with what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// Poses and points by pixels: the paper's Point-BA.
    Point,
    /// Poses, points and lines by pixels: the paper's PointLine-BA.
    #[default]
    PointLine,
    /// Poses, points and lines by pixels, depths and the lines' structure, whitened by the declared noise.
    Structural,
    /// Poses by relative poses.
    PoseGraph,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Point, Self::PointLine, Self::Structural, Self::PoseGraph];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::PointLine => "point-line",
            Self::Structural => "structural",
            Self::PoseGraph => "pose-graph",
        }
    }

    /// The usual name of its estimate.
    #[must_use]
    pub fn estimate(self) -> &'static str {
        match self {
            Self::Point => "point-ba",
            Self::PointLine => "point-line-ba",
            Self::Structural => "structural-ba",
            Self::PoseGraph => "pose-graph",
        }
    }
}

/// How points are kept while they are adjusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PointForm {
    /// By x, y, z in the world.
    #[default]
    Xyz,
    /// By direction and inverse depth in the first frame that sees the point.
    InverseDepth,
    /// By direction from one frame and the parallax to another (Zhao et al. 2015, `ParallaxBA`).
    Parallax,
}

/// How lines are kept while they are adjusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum LineKind {
    /// By the orthonormal form of the paper.
    #[default]
    Orthonormal,
    /// By two points that move across the line.
    Endpoints,
    /// By frame and distance, with Cayley's map.
    PluckerCayley,
}

/// How parallel lines are kept parallel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Parallelism {
    /// The lines of a group share one direction.
    #[default]
    Exact,
    /// Every line has its own direction, which is drawn to that of its group.
    Soft {
        /// Standard deviation of a line's direction from its group's, radians.
        sigma_rad: f64,
    },
    /// Groups are not used.
    Ignored,
}

/// What is known of a pose beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct PosePrior {
    /// Whose pose.
    pub frame_id: FrameId,
    /// `world_from_camera`.
    pub pose: PoseRow,
    /// Standard deviation of the tangent's rotation, applied on the left of `camera_from_world`, radians.
    pub sigma_rotation_rad: f64,
    /// Standard deviation of its translation, metres.
    pub sigma_translation_m: f64,
}

/// What to adjust, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What is adjusted with what.
    pub method: Method,
    /// Name of the estimate; that of the method where absent.
    pub name: Option<String>,
    /// How points are kept.
    pub points: PointForm,
    /// How lines are kept.
    pub lines: LineKind,
    /// How parallel lines are kept parallel; `structural` only.
    pub parallelism: Parallelism,
    /// Robust loss, in units of sigma.
    pub loss: Loss,
    /// Standard deviation of pixel coordinates, in place of the declared one.
    pub sigma_px: Option<f64>,
    /// Landmarks seen in fewer frames are left out.
    pub min_views: usize,
    /// Frames to hold beside those that the graph holds; the first of a part of the graph is held where there is none.
    pub fix: Vec<FrameId>,
    /// What is known of poses beforehand.
    pub priors: Vec<PosePrior>,
    /// Whether frames whose own measurements hardly say where they are move as they did at the start; `structural` only.
    pub smooth_motion: bool,
    /// Whether covariances of poses and landmarks are wanted.
    pub covariance: bool,
    /// When to stop, and how to step.
    pub solver: SolverOptions,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::default(),
            name: None,
            points: PointForm::default(),
            lines: LineKind::default(),
            parallelism: Parallelism::default(),
            loss: Loss::default(),
            sigma_px: None,
            min_views: 3,
            fix: Vec::new(),
            priors: Vec::new(),
            smooth_motion: true,
            covariance: false,
            solver: SolverOptions::default(),
        }
    }
}

impl Options {
    /// The usual options of a method: least squares for pose graphs, Cauchy's loss for measurements, 1 sigma as the paper's references.
    #[must_use]
    pub fn of(method: Method) -> Self {
        let loss = match method {
            Method::Point | Method::PointLine => Loss::Cauchy(1.0),
            Method::Structural => Loss::Huber(3.0),
            Method::PoseGraph => Loss::None,
        };
        let mut solver = SolverOptions::default();
        if method == Method::PoseGraph {
            // Relative poses are all but linear near a start of odometry: undamped steps are the best, and damping comes where one fails.
            solver.damping = 1e-9;
        }
        Self { method, loss, solver, ..Self::default() }
    }

    /// The name of the estimate.
    #[must_use]
    pub fn estimate_name(&self) -> &str {
        self.name.as_deref().unwrap_or(self.method.estimate())
    }

    /// Refuses what has no meaning.
    pub(super) fn check(&self) -> Result<(), Error> {
        let positive = |option: &'static str, found: f64| {
            if found > 0.0 && found.is_finite() {
                Ok(())
            } else {
                Err(Error::Option { option, expected: "a number over zero", found })
            }
        };
        if !self.loss.is_valid() {
            return Err(Error::Loss { loss: self.loss });
        }
        if let Some(sigma_px) = self.sigma_px {
            positive("sigma_px", sigma_px)?;
        }
        if let Parallelism::Soft { sigma_rad } = self.parallelism {
            positive("sigma_rad", sigma_rad)?;
        }
        for prior in &self.priors {
            positive("sigma_rotation_rad", prior.sigma_rotation_rad)?;
            positive("sigma_translation_m", prior.sigma_translation_m)?;
        }
        Ok(())
    }
}
