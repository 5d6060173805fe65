//! What `os evaluate`, `os adjust` and `os benchmark` print with `--json`, read again.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use super::convergence::Run;
use super::error::Error;
use crate::structure::ResultTable;

/// What other commands found, in the order of the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Results {
    /// Of `os evaluate`.
    pub evaluations: Vec<EvaluationRow>,
    /// Of `os adjust`.
    pub adjustments: Vec<AdjustmentRow>,
    /// Of `os benchmark`.
    pub benchmarks: Vec<BenchmarkRow>,
    /// Costs over the steps of optimisers, by sequence; of a folder of `os benchmark`.
    pub runs: BTreeMap<String, Vec<Run>>,
}

/// One estimate that was compared with its reference; what is absent was not asked for or not found.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct EvaluationRow {
    /// Name of the sequence.
    pub sequence: String,
    /// Name of the estimate.
    pub estimate: String,
    /// What it is compared with.
    pub reference: String,
    /// What was moved before.
    pub alignment: String,
    /// How far the poses of a pair of a relative error are apart.
    pub rpe_delta: String,
    /// Poses that are in both.
    pub poses_matched: Option<u64>,
    /// Poses that only the reference has.
    pub poses_missing: Option<u64>,
    /// Absolute error of translation, RMSE, metres.
    pub ape_translation_rmse_m: Option<f64>,
    /// The same, median, metres.
    pub ape_translation_median_m: Option<f64>,
    /// Relative error of rotation, RMSE, radians.
    pub rpe_rotation_rmse_rad: Option<f64>,
    /// The same, median, radians.
    pub rpe_rotation_median_rad: Option<f64>,
    /// How far points are off, RMSE, metres.
    pub point_distance_rmse_m: Option<f64>,
    /// How far lines are off, RMSE, metres.
    pub line_distance_rmse_m: Option<f64>,
    /// Why there are no errors.
    pub why_not: Option<String>,
}

/// How an adjustment went.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct AdjustmentRow {
    /// Name of the graph.
    pub graph: String,
    /// Name of the estimate.
    pub estimate: String,
    /// Why it ended.
    pub ending: String,
    /// Whether it converged.
    pub converged: bool,
    /// Steps tried.
    pub iterations: u64,
    /// Cost at the start, `½ Σ ρ`.
    pub initial_cost: Option<f64>,
    /// Cost at the end.
    pub final_cost: Option<f64>,
    /// Root mean square of the whitened residuals, in sigma.
    pub residual_rms_sigma: Option<f64>,
    /// Numbers of all residuals.
    pub residuals: u64,
    /// Degrees of freedom of all variables.
    pub unknowns: u64,
}

/// One method on one sequence: medians over seeds.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct BenchmarkRow {
    /// Name of the sequence.
    pub sequence: String,
    /// Method, or estimate of the sequence.
    pub method: String,
    /// Seeds with an estimate.
    pub seeds: Option<u64>,
    /// Seeds without one.
    pub failed: Option<u64>,
    /// Absolute error of translation after SE(3) alignment, RMSE; median over seeds, centimetres.
    pub ape_rmse_cm: Option<f64>,
    /// The same, lower quartile over seeds.
    pub ape_rmse_cm_lower: Option<f64>,
    /// The same, upper quartile over seeds.
    pub ape_rmse_cm_upper: Option<f64>,
    /// Relative error of rotation, delta 1 frame, RMSE; median over seeds, degrees.
    pub rpe_rotation_rmse_deg: Option<f64>,
    /// Wall time; median over seeds, seconds.
    pub seconds: Option<f64>,
    /// Median error over the bound that the measurements allow.
    pub over_bound: Option<f64>,
    /// What the paper prints, centimetres.
    pub paper_ape_rmse_cm: Option<f64>,
}

/// A point of a curve of `os benchmark`.
#[derive(Deserialize)]
struct CurvePoint {
    sequence: String,
    method: String,
    seed: i64,
    cost: Option<f64>,
    accepted: i64,
}

impl Results {
    /// Results of the bytes of a file: any number of JSON values, one after the other.
    pub(super) fn of_json(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let json = |cause| Error::Json { path: path.to_owned(), cause };
        let mut results = Self::default();
        let mut object = 0;
        for value in serde_json::Deserializer::from_slice(bytes).into_iter::<Value>() {
            let values = match value.map_err(json)? {
                Value::Array(values) => values,
                value => vec![value],
            };
            for value in values {
                object += 1;
                results.add(value).map_err(|problem| match problem {
                    Some(cause) => json(cause),
                    None => unknown(path, object, bytes),
                })?;
            }
        }
        Ok(results)
    }

    /// Results of the tables of a folder of `os benchmark`.
    pub(super) fn of_tables(
        path: &Path,
        summary: &ResultTable,
        curves: Option<&ResultTable>,
    ) -> Result<Self, Error> {
        let json = |cause| Error::Json { path: path.to_owned(), cause };
        let benchmarks = serde_json::from_value(without_nulls(summary.to_json())).map_err(json)?;
        let mut results = Self { benchmarks, ..Self::default() };
        let points: Vec<CurvePoint> = match curves {
            Some(curves) => serde_json::from_value(curves.to_json()).map_err(json)?,
            None => Vec::new(),
        };
        let mut seeds: BTreeMap<(&str, &str), i64> = BTreeMap::new();
        for point in &points {
            // The first seed of a method stands for all.
            if *seeds.entry((&point.sequence, &point.method)).or_insert(point.seed) != point.seed {
                continue;
            }
            let runs = results.runs.entry(point.sequence.clone()).or_default();
            let place = runs.iter().position(|run| run.name == point.method).unwrap_or_else(|| {
                runs.push(Run { name: point.method.clone(), ..Run::default() });
                runs.len() - 1
            });
            runs[place].push(point.cost, point.accepted != 0);
        }
        Ok(results)
    }

    /// Adds one object; `Err(None)` when no command prints such.
    fn add(&mut self, value: Value) -> Result<(), Option<serde_json::Error>> {
        let has = |name: &str| value.get(name).is_some();
        let kinds = [has("final_cost"), has("method"), has("poses_matched")];
        let value = without_nulls(value);
        match kinds {
            [true, _, _] => self.adjustments.push(serde_json::from_value(value)?),
            [_, true, _] => self.benchmarks.push(serde_json::from_value(value)?),
            [_, _, true] => self.evaluations.push(serde_json::from_value(value)?),
            _ => return Err(None),
        }
        Ok(())
    }

    /// Adds other results behind these.
    pub(super) fn extend(&mut self, other: Self) {
        self.evaluations.extend(other.evaluations);
        self.adjustments.extend(other.adjustments);
        self.benchmarks.extend(other.benchmarks);
        for (sequence, runs) in other.runs {
            self.runs.entry(sequence).or_default().extend(runs);
        }
    }
}

/// The value without members that are null, which stand for what is absent.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(members) => {
            Value::Object(members.into_iter().filter(|(_, value)| !value.is_null()).collect())
        }
        Value::Array(values) => Value::Array(values.into_iter().map(without_nulls).collect()),
        value => value,
    }
}

/// The error about an object that no command prints, with its first members.
fn unknown(path: &Path, object: usize, bytes: &[u8]) -> Error {
    let values = serde_json::Deserializer::from_slice(bytes).into_iter::<Value>().filter_map(Result::ok);
    let flat = values.flat_map(|value| match value {
        Value::Array(values) => values,
        value => vec![value],
    });
    let found = match flat.into_iter().nth(object - 1) {
        Some(Value::Object(members)) if members.is_empty() => "no members".to_owned(),
        Some(Value::Object(members)) => {
            members.keys().take(6).map(String::as_str).collect::<Vec<_>>().join(", ")
        }
        _ => "no object".to_owned(),
    };
    Error::UnknownJson { path: path.to_owned(), object, found }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Results, Error> {
        Results::of_json(Path::new("x.json"), text.as_bytes())
    }

    #[test]
    fn lines_of_evaluations_and_lists_of_benchmarks_are_told_apart() {
        let text = r#"{"sequence":"a","estimate":"e","poses_matched":3,"ape_translation_rmse_m":0.5,"why_not":null}
            {"sequence":"a","estimate":"f","poses_matched":0,"ape_translation_rmse_m":null,"why_not":"none"}
            [{"sequence":"a","method":"point-ba","ape_rmse_cm":1.5,"seeds":null}]
            {"graph":"initial","estimate":"point-ba","final_cost":1.0,"converged":true}"#;
        let found = read(text).unwrap();
        assert_eq!(found.evaluations[0].ape_translation_rmse_m, Some(0.5));
        assert_eq!(found.evaluations[1].why_not.as_deref(), Some("none"));
        assert_eq!(found.benchmarks[0].ape_rmse_cm, Some(1.5));
        assert!(found.adjustments[0].converged);
    }

    #[test]
    fn json_of_another_kind_is_an_error_that_says_what_it_is() {
        let error = read(r#"[{"method":"a"},{"colour":1,"size":2}]"#).unwrap_err().to_string();
        assert!(error.contains("object 2") && error.contains("colour, size"), "{error}");
        assert!(matches!(read("{\"final_cost\": tru"), Err(Error::Json { .. })));
        assert!(matches!(read("{\"final_cost\": 1, \"graph\": 7}"), Err(Error::Json { .. })));
    }

    #[test]
    fn curves_are_those_of_the_first_seed() {
        let table = ResultTable::new("curves")
            .text("sequence", "", ["a", "a", "a", "a"].map(Some))
            .text("method", "", ["m", "m", "m", "n"].map(Some))
            .integer("seed", "1", "", [4, 4, 5, 5].map(Some))
            .number("cost", "1", "", [9.0, 3.0, 8.0, 7.0].map(Some))
            .integer("accepted", "1", "", [1, 1, 1, 1].map(Some));
        let summary =
            ResultTable::new("summary").text("sequence", "", [Some("a")]).text("method", "", [Some("m")]);
        let found = Results::of_tables(Path::new("r"), &summary, Some(&table)).unwrap();
        let costs: Vec<Vec<f64>> = found.runs["a"].iter().map(Run::accepted).collect();
        assert_eq!(costs, [vec![9.0, 3.0], vec![7.0]]);
        assert_eq!(found.benchmarks.len(), 1);
    }
}
