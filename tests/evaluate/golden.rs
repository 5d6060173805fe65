//! The same figures as evo 1.38.1.

use std::path::Path;

use serde_json::Value;

use super::{data, os, stderr, stdout};

/// What evo printed: its arguments after the two files, and the statistics.
struct Golden {
    metric: String,
    files: [String; 2],
    arguments: Vec<String>,
    statistics: Vec<(String, f64)>,
}

/// Reads pairs of lines `## evo_ape tum REFERENCE ESTIMATE arguments` and `max 0.1 mean 0.2 …`.
fn goldens(text: &str) -> Vec<Golden> {
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    lines
        .chunks_exact(2)
        .map(|pair| {
            let words: Vec<String> =
                pair[0].trim_start_matches("## ").split_whitespace().map(str::to_owned).collect();
            let numbers: Vec<&str> = pair[1].split_whitespace().collect();
            Golden {
                metric: words[0].trim_start_matches("evo_").to_owned(),
                files: [words[2].clone(), words[3].clone()],
                arguments: words[4..].to_vec(),
                statistics: numbers
                    .chunks_exact(2)
                    .map(|pair| (pair[0].to_owned(), pair[1].parse().unwrap()))
                    .collect(),
            }
        })
        .collect()
}

impl Golden {
    /// The statistics that `os evaluate` finds with the same arguments, in the same order.
    fn ours(&self, folder: &Path) -> Vec<f64> {
        let files = self.files.each_ref().map(|file| folder.join(file).display().to_string());
        let mut arguments = vec!["evaluate", "--json", "--files", &files[0], &files[1]];
        for argument in &self.arguments {
            match argument.as_str() {
                "--align_origin" => arguments.extend(["--align", "origin"]),
                argument => arguments.push(argument),
            }
        }
        if !self.arguments.iter().any(|argument| argument == "-r") {
            arguments.extend(["-r", "trans_part"]);
        }
        let output = os(&arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        let row: Value = serde_json::from_str(&stdout(&output)).unwrap();
        let found = |name: &String| {
            let mut columns = row.as_object().unwrap().iter().filter(|(column, _)| {
                column.starts_with(&format!("{}_", self.metric)) && column.split('_').any(|word| word == name)
            });
            let (_, value) = columns.next().unwrap();
            assert!(columns.next().is_none());
            value.as_f64().unwrap()
        };
        self.statistics.iter().map(|(name, _)| found(name)).collect()
    }

    fn words(&self) -> String {
        format!("evo_{} {} {}", self.metric, self.files[1], self.arguments.join(" "))
    }
}

/// Relative difference of two figures: rounding of sums over sixty poses, angles up to half a turn among them.
const ROUNDING: f64 = 1e-11;

#[test]
fn all_relations_alignments_and_pairs_are_those_of_evo() {
    let goldens = goldens(include_str!("evo.txt"));
    assert!(goldens.len() > 30);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/evaluate");
    for golden in goldens {
        for ((name, expected), found) in golden.statistics.iter().zip(golden.ours(&folder)) {
            let off = (found - expected).abs() / expected.abs().max(1.0);
            assert!(off < ROUNDING, "{}: {name} {found}, evo has {expected}", golden.words());
        }
    }
}

#[test]
fn the_figures_of_the_tum_benchmark_agree_in_every_printed_digit() {
    let folder = data().join("trajectories");
    let Ok(reference) = std::fs::read_to_string(folder.join("evo_reference.txt")) else {
        println!("SKIPPED: trajectories/evo_reference.txt is not here (see OPEN_STRUCTURE_DATA)");
        return;
    };
    let goldens = goldens(&reference);
    assert_eq!(goldens.len(), 7);
    for golden in goldens.into_iter().chain(self::goldens(include_str!("evo_tum.txt"))) {
        for ((name, expected), found) in golden.statistics.iter().zip(golden.ours(&folder)) {
            assert_eq!(format!("{found:.6}"), format!("{expected:.6}"), "{}: {name}", golden.words());
        }
    }
}
