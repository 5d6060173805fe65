//! A factor graph into an estimate: bundle adjustment, structural adjustment and pose graphs.

mod adjustment;
mod bal_camera;
mod bal_factor;
mod bal_problem;
mod block_pattern;
mod bound;
mod covariances;
mod elimination;
mod error;
mod estimation;
mod factor;
mod grouping;
mod inverse_depth;
mod iterations;
mod iterative_schur;
mod line_factor;
mod line_form;
mod line_sight;
mod linearisation;
mod loss;
mod minimise;
mod motion;
mod normal_equations;
mod observations;
mod options;
mod panels;
mod parallax_point;
mod parametrisation;
mod parts;
mod plan;
mod planar_pose;
mod point_factor;
mod point_handle;
mod point_sight;
mod pose_factor;
mod problem;
mod reduced_system;
mod refinement;
mod region;
mod relative_pose_factor;
mod relative_poses;
mod scale_gauge;
mod schur;
mod settle;
mod shared_line;
mod small_blocks;
mod subspace;
mod summary;
mod tie_sums;
mod uncertainty;
mod weighing;
mod whitening;

pub use adjustment::{Adjusted, adjust, adjust_watched};
pub use bal_camera::BalCameraSpace;
pub use bal_problem::{BalAdjusted, BalBundle, BalView, adjust_bal};
pub use bound::{Alignment, Bound, bound};
pub use error::Error;
pub use factor::{Factor, MOST_RESIDUALS};
pub use iterations::iterations;
pub use loss::Loss;
pub use minimise::{Ending, Minimum, Optimiser, SolverOptions, Step, minimise, minimise_watched};
pub use options::{LineKind, Method, Options, Parallelism, PointForm, PosePrior};
pub use parametrisation::{
    DirectionSpace, LineSpace, MOST_FREEDOM, Parametrisation, PoseSpace, RotationSpace, VectorSpace,
};
pub use plan::{Choice, Eliminate, Factorisation, Plan};
pub use planar_pose::PlanarPoseSpace;
pub use problem::{Problem, Values, Variable};
pub use summary::{Reason, ReleasedLine, Summary, Tally};

#[cfg(test)]
mod scene;
#[cfg(test)]
mod tests;
