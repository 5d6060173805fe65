//! How a problem is solved, and what is told of it: cost over time.

use apex_solver::LinearSolverType;
use apex_solver::core::VarKey;
use apex_solver::core::problem::Problem;
use apex_solver::core::variable::ManifoldVariable;
use apex_solver::observers::OptObserver;
use apex_solver::optimizer::OptimizationStatus;
use apex_solver::optimizer::levenberg_marquardt::{LevenbergMarquardt, LevenbergMarquardtConfig};
use slotmap::SlotMap;
use std::fmt::Write as _;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The version of apex-solver, from the lock file.
fn version() -> &'static str {
    let lock = include_str!("../Cargo.lock");
    let after = lock.split_once("name = \"apex-solver\"\nversion = \"").map(|(_, after)| after);
    after.and_then(|after| after.split_once('"')).map_or("unknown", |(version, _)| version)
}

/// A problem, and whether there are points to eliminate.
pub struct Posed {
    pub problem: Problem,
    pub has_points: bool,
}

/// What a run is asked for.
pub struct Request {
    pub kind: String,
    pub path: String,
    solver: Option<String>,
    threads: usize,
    iterations: usize,
    seconds: f64,
    target: f64,
}

impl Request {
    /// Reads the command line.
    pub fn read(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let usage = "usage: rust-peer graph|bal|pose-graph PATH [--solver S] [--threads N] [--iterations N] [--seconds S] [--target COST]";
        let (Some(kind), Some(path)) = (arguments.next(), arguments.next()) else {
            return Err(usage.to_owned());
        };
        let (seconds, target) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut request = Self { kind, path, solver: None, threads: 1, iterations: 100, seconds, target };
        while let Some(option) = arguments.next() {
            let value = arguments.next().ok_or(usage)?;
            let wrong = |_| format!("{option}: expected a number; found {value}");
            match option.as_str() {
                "--solver" => request.solver = Some(value),
                "--threads" => {
                    request.threads = value.parse().map_err(|_| format!("{option}: found {value}"))?
                }
                "--iterations" => {
                    request.iterations = value.parse().map_err(|_| format!("{option}: found {value}"))?
                }
                "--seconds" => request.seconds = value.parse().map_err(wrong)?,
                "--target" => request.target = value.parse().map_err(wrong)?,
                _ => return Err(format!("no option {option}")),
            }
        }
        Ok(request)
    }
}

/// Keeps cost over time.
struct Watch {
    start: Instant,
    costs: Arc<Mutex<Vec<(f64, f64)>>>,
}

impl OptObserver for Watch {
    fn on_step(&self, _: &SlotMap<VarKey, Box<dyn ManifoldVariable>>, _: usize) {}

    fn set_iteration_metrics(&self, cost: f64, _: f64, _: Option<f64>, _: f64, _: Option<f64>) {
        if let Ok(mut costs) = self.costs.lock() {
            costs.push((self.start.elapsed().as_secs_f64(), cost));
        }
    }
}

/// Solves a problem; gives one line of JSON.
pub fn solve(posed: Posed, request: &Request) -> Result<String, String> {
    let usual = if posed.has_points { "explicit-sparse" } else { "cholesky" };
    let solver = match request.solver.as_deref().unwrap_or(usual) {
        "explicit-sparse" => LinearSolverType::ExplicitSparseSchur,
        "implicit" => LinearSolverType::ImplicitSparseSchur,
        "cholesky" => LinearSolverType::SparseCholesky,
        name => return Err(format!("no solver {name}")),
    };
    let mut config = LevenbergMarquardtConfig::new()
        .with_linear_solver_type(solver)
        .with_max_iterations(request.iterations)
        .with_cost_tolerance(1e-12)
        .with_parameter_tolerance(1e-14)
        .with_gradient_tolerance(1e-14);
    if request.target.is_finite() {
        config = config.with_min_cost_threshold(request.target.next_up());
    }
    if request.seconds.is_finite() {
        config = config.with_timeout(Duration::from_secs_f64(request.seconds));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(request.threads).build();
    let pool = pool.map_err(|cause| cause.to_string())?;
    let costs = Arc::new(Mutex::new(Vec::new()));
    let mut problem = posed.problem;
    let (result, seconds) = pool.install(|| {
        let mut solver = LevenbergMarquardt::with_config(config);
        let start = Instant::now();
        solver.add_observer(Watch { start, costs: Arc::clone(&costs) });
        let result = solver.optimize(&mut problem);
        (result, start.elapsed().as_secs_f64())
    });
    let result = result.map_err(|cause| format!("{}: apex-solver: {cause}", request.path))?;
    let ending = match result.status {
        OptimizationStatus::MinCostThresholdReached => "target",
        OptimizationStatus::Timeout => "time",
        OptimizationStatus::MaxIterationsReached => "iterations",
        OptimizationStatus::NumericalFailure | OptimizationStatus::Failed(_) => "failed",
        _ => "converged",
    };
    let (initial, last) = (result.initial_cost, result.final_cost);
    let mut told = format!(
        "{{\"peer\": \"apex-solver\", \"version\": \"{}\", \"initial_cost\": {initial:?}, \"final_cost\": {last:?}, \
         \"seconds\": {seconds:?}, \"ending\": \"{ending}\", \"iterations\": [[0.0, {initial:?}]",
        version()
    );
    let mut least = initial;
    for (seconds, cost) in costs.lock().map_err(|cause| cause.to_string())?.iter() {
        if *cost < least {
            least = *cost;
            let _ = write!(told, ", [{seconds:?}, {cost:?}]");
        }
    }
    told.push_str("]}");
    Ok(told)
}
