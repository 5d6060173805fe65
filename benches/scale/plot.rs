//! The picture of `make bench-scale`: seconds of an iteration and resident memory over observations.
//!
//! `plot RESULTS.json OUT.svg TITLE` prints the powers with which both grow as JSON.

use std::fs;

use open_structure::plot::{Growth, growth_figure};
use serde::Deserialize;

/// What was measured of one size; the file knows more.
#[derive(Deserialize)]
struct Run {
    observations: f64,
    iteration_seconds: f64,
    peak_gib: f64,
}

#[derive(Deserialize)]
struct Results {
    runs: Vec<Run>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [results, output, title] = &arguments[..] else { panic!("plot RESULTS.json OUT.svg TITLE") };
    let results: Results =
        serde_json::from_slice(&fs::read(results).expect("results")).expect("results of benches/scale/run");
    let over = |quantity: fn(&Run) -> f64| -> Vec<[f64; 2]> {
        results.runs.iter().map(|run| [run.observations, quantity(run)]).collect()
    };
    let (seconds, memory) = (over(|run| run.iteration_seconds), over(|run| run.peak_gib));
    let size = "observations";
    let growths = [
        Growth { quantity: "time of an iteration, s", size, places: &seconds },
        Growth { quantity: "greatest resident memory, GiB", size, places: &memory },
    ];
    let partial = format!("{output}.partial");
    fs::write(&partial, growth_figure(title, &growths)).expect("a picture");
    fs::rename(&partial, output).expect("a picture");
    let [seconds, memory] = growths.map(|growth| growth.exponent());
    println!("{}", serde_json::json!({ "iteration_seconds": seconds, "peak_gib": memory }));
}
