//! How long an adjustment takes to reach a cost, the graph being in memory: our side of `make bench-peers`.
//!
//! `adjust SEQUENCE METHOD [TARGET [THREADS]]` prints JSON: the seconds until the cost was at most TARGET (null if it never was), those
//! until the end, the steps of both, and the costs. The graph is the sequence's only one or `initial`.

use std::time::Instant;

use open_structure::adjust::{Method, Options, adjust_watched};
use open_structure::format;
use open_structure::structure::FactorGraph;

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with("--"));
    let usage = "adjust SEQUENCE METHOD [TARGET [THREADS]]";
    let path = arguments.next().expect(usage);
    let method = arguments.next().expect(usage);
    let target: f64 = arguments.next().map_or(f64::NEG_INFINITY, |target| target.parse().expect("a cost"));
    let threads: usize = arguments.next().map_or(0, |threads| threads.parse().expect("threads"));
    let method = *Method::ALL.iter().find(|known| known.name() == method).expect("a method of `os adjust`");
    let sequence =
        format::open(std::path::Path::new(&path)).and_then(|reader| reader.read_all()).expect("a sequence");
    let names = FactorGraph::names(&sequence);
    let name = if names.len() == 1 { names.first().unwrap().as_str() } else { "initial" };
    let graph = FactorGraph::of(&sequence, name).expect("a graph");
    let options = Options::of(method);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let (mut steps, mut reached) = (0, None);
    let start = Instant::now();
    let adjusted = pool.install(|| {
        adjust_watched(&graph, &options, &mut |step| {
            steps += 1;
            if reached.is_none() && step.accepted && step.cost <= target {
                reached = Some((start.elapsed().as_secs_f64(), steps));
            }
            true
        })
    });
    let total = start.elapsed().as_secs_f64();
    let summary = adjusted.expect("an estimate").summary;
    let told = serde_json::json!({
        "method": method.name(),
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
