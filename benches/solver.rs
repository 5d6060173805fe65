//! Times of the solver on simulated sequences: the first steps of each method from a tracked start.

#[path = "data/brief.rs"]
mod brief;
#[path = "data/simulated.rs"]
mod simulated;

use brief::brief;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use open_structure::adjust::{Method, Options, SolverOptions, adjust};
use open_structure::covisibility::{GraphOptions, pose_graph, reprojection_graph};
use open_structure::structure::{FactorGraph, MeasuredFrame, MeasurementNoise};

/// Steps that are timed: few, so that no method ends before.
const STEPS: usize = 5;

/// The reprojection graph and the pose graph about what the tracker says of a simulated sequence.
#[expect(clippy::unwrap_used, reason = "a benchmark without a graph has nothing to say")]
fn graphs(name: &str, frames: usize) -> [FactorGraph; 2] {
    let sequence = simulated::simulated(name, frames).unwrap();
    let frames = MeasuredFrame::of(&sequence);
    let estimate = simulated::tracked(&sequence, &frames).unwrap();
    let (cameras, noise) = (&sequence.manifest.cameras, MeasurementNoise::declared(&sequence.manifest));
    let options = GraphOptions::default();
    let groups = &sequence.structural_groups;
    let (graph, _) = reprojection_graph(&frames, &estimate, cameras, noise, groups, &options).unwrap();
    let (poses, _) = pose_graph(&frames, &estimate, cameras, noise, &options, 0).unwrap();
    [graph, poses]
}

#[expect(clippy::unwrap_used, reason = "a benchmark that cannot solve has nothing to say")]
fn solving(criterion: &mut Criterion) {
    for (name, frames) in [("corridor1", 200), ("sphere1", 200)] {
        let [graph, poses] = graphs(name, frames);
        let mut group = criterion.benchmark_group(format!("adjust {name}"));
        for method in Method::ALL {
            let graph = if method == Method::PoseGraph { &poses } else { &graph };
            let solver = SolverOptions { max_iterations: STEPS, ..SolverOptions::default() };
            let options = Options { solver, ..Options::of(method) };
            group.throughput(Throughput::Elements(STEPS as u64));
            group.bench_function(method.name(), |bencher| bencher.iter(|| adjust(graph, &options).unwrap()));
        }
        group.finish();
    }
}

criterion_group!(name = benches; config = brief(3); targets = solving);
criterion_main!(benches);
