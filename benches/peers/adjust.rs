//! How long an adjustment takes to reach a cost, the graph being in memory: our side of `make bench-peers`.
//!
//! `adjust PATH METHOD [TARGET [THREADS]]` prints JSON: the seconds until the cost was at most TARGET (null if it never was), where it
//! ends; those until the end, the steps of both, and the costs.
//!
//! | PATH | METHOD |
//! |---|---|
//! | a sequence, whose graph is its only one or `initial` | one of `os adjust --method` |
//! | `FILE.g2o` | one of `os adjust --method`; for relative poses `pose-graph` |
//! | `FILE.txt`, a problem of Bundle Adjustment in the Large | `bal` |
//!
//! Costs are `½ Σ ρ(rᵀ Ω r)`. Relative poses of g2o: with `Z⁻¹ Xᵢ⁻¹ Xⱼ = (t, q)`, `r = [t; 2 vec q]`, and `[x y θ]` in the plane, Ω being the
//! matrix of the file; the first vertex is held. BAL: pixels, predicted less measured, without loss, all nine numbers of every camera free.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Instant;

use open_structure::adjust::{
    BalBundle, BalView, Loss, Method, Options, SolverOptions, Step, Summary, adjust_bal, adjust_watched,
};
use open_structure::exchange::{BalCamera, ImportNames, from_g2o, read_bal, read_g2o};
use open_structure::format;
use open_structure::structure::{FactorGraph, Sequence};

/// What is adjusted, in memory.
enum Input {
    Graph(Box<FactorGraph>, Method),
    Bal(BalBundle),
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let usage = "adjust PATH METHOD [TARGET [THREADS]]";
    let path = arguments.next().expect(usage);
    let method = arguments.next().expect(usage);
    let target: f64 = arguments.next().map_or(f64::NEG_INFINITY, |target| target.parse().expect("a cost"));
    let threads: usize = arguments.next().map_or(0, |threads| threads.parse().expect("threads"));
    let input = read(Path::new(&path), &method);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let (mut steps, mut reached) = (0, None);
    let start = Instant::now();
    let summary = pool.install(|| {
        adjust(&input, &mut |step| {
            steps += 1;
            if reached.is_none() && step.accepted && step.cost <= target {
                reached = Some((start.elapsed().as_secs_f64(), steps));
            }
            reached.is_none()
        })
    });
    let total = start.elapsed().as_secs_f64();
    eprint!("{}", summary.plan);
    let told = serde_json::json!({
        "method": method,
        "threads": pool.current_num_threads(),
        "initial_cost": summary.initial_cost,
        "final_cost": summary.final_cost,
        "steps": summary.iterations,
        "seconds": total,
        "steps_to_target": reached.map(|(_, steps)| steps),
        "seconds_to_target": reached.map(|(seconds, _)| seconds),
        "residuals": summary.residuals,
        "unknowns": summary.unknowns,
    });
    println!("{told}");
}

fn read(path: &Path, method: &str) -> Input {
    let open = || BufReader::new(File::open(path).expect("a file"));
    if method == "bal" {
        let problem = read_bal(open()).expect("a problem of BAL");
        let views = problem.observations.iter();
        return Input::Bal(BalBundle {
            cameras: problem.cameras.iter().map(BalCamera::numbers).collect(),
            points: problem.points,
            views: views
                .map(|seen| BalView { camera: seen.camera, point: seen.point, pixel: seen.pixel })
                .collect(),
        });
    }
    let method =
        *Method::ALL.iter().find(|known| known.name() == method).expect("a method of `os adjust`, or bal");
    let sequence: Sequence = if path.extension().is_some_and(|extension| extension == "g2o") {
        let names = ImportNames { sequence: "g2o".to_owned(), graph: "initial".to_owned() };
        from_g2o(&read_g2o(open()).expect("a graph of g2o"), &names).expect("a graph").sequence
    } else {
        format::open(path).and_then(|reader| reader.read_all()).expect("a sequence")
    };
    let names = FactorGraph::names(&sequence);
    let name = if names.len() == 1 { names.first().unwrap().as_str() } else { "initial" };
    Input::Graph(Box::new(FactorGraph::of(&sequence, name).expect("a graph")), method)
}

fn adjust(input: &Input, watch: &mut dyn FnMut(&Step) -> bool) -> Summary {
    match input {
        Input::Graph(graph, method) => {
            adjust_watched(graph, &Options::of(*method), watch).expect("an estimate").summary
        }
        Input::Bal(bundle) => {
            adjust_bal(bundle, Loss::None, &SolverOptions::default(), watch).expect("an estimate").summary
        }
    }
}
