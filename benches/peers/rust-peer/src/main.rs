//! apex-solver on the graphs of `make bench-peers`; says cost over time as one line of JSON.
//!
//! `rust-peer graph|bal|pose-graph PATH [--solver S] [--threads N] [--iterations N] [--seconds S] [--target COST]` with the
//! solvers `explicit-sparse`, `implicit` (points are eliminated) and `cholesky`. Points and poses only.

mod bal;
mod graph;
mod pose_graph;
mod seen_point;
mod solve;
mod text_file;

use solve::Request;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Request::read(std::env::args().skip(1)).and_then(|request| run(&request)) {
        Ok(told) => {
            println!("{told}");
            ExitCode::SUCCESS
        }
        Err(cause) => {
            eprintln!("rust-peer: {cause}");
            ExitCode::FAILURE
        }
    }
}

fn run(request: &Request) -> Result<String, String> {
    let problem = match request.kind.as_str() {
        "graph" => graph::read(&request.path)?,
        "bal" => bal::read(&request.path)?,
        "pose-graph" => pose_graph::read(&request.path)?,
        kind => return Err(format!("expected graph, bal or pose-graph; found {kind}")),
    };
    solve::solve(problem, request)
}
