//! Cells summed up: one row for each sequence and method.

use std::collections::BTreeMap;

use super::{
    Bound, Cell, CellKey, Error, Method, Outcome, PaperCell, PaperMethod, Plan, Spread, Store, paper,
};

/// A method on a sequence, over seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the sequence.
    pub sequence: String,
    /// Name of the method or the estimate.
    pub method: String,
    /// Cells without an estimate, with the reason of the first.
    pub failed: Option<(usize, String)>,
    /// Root mean square of the absolute error of translation, centimetres.
    pub ape_rmse_cm: Option<Spread>,
    /// Its median over frames, centimetres.
    pub ape_median_cm: Option<Spread>,
    /// Root mean square after Sim(3) alignment, centimetres.
    pub ape_sim3_rmse_cm: Option<Spread>,
    /// Root mean square of the relative error of rotation, degrees.
    pub rpe_rotation_rmse_deg: Option<Spread>,
    /// Its median over frames, degrees.
    pub rpe_rotation_median_deg: Option<Spread>,
    /// Most frames without support in a cell.
    pub predicted: usize,
    /// Seconds of the method.
    pub seconds: Option<Spread>,
    /// The bound that measurements set to the method: root mean square of absolute errors of translation, centimetres.
    pub bound_cm: Option<f64>,
    /// Whether the bound is one after Sim(3) alignment.
    pub bound_is_scaled: bool,
    /// What the paper prints.
    pub paper: Option<PaperCell>,
}

impl Row {
    /// How many times the bound the median of the errors is, both with the bound's alignment.
    #[must_use]
    pub fn over_bound(&self) -> Option<f64> {
        let errors = if self.bound_is_scaled { self.ape_sim3_rmse_cm? } else { self.ape_rmse_cm? };
        Some(errors.median / self.bound_cm.filter(|bound| *bound > 0.0)?)
    }

    /// How many times the paper's error the median of the errors is.
    #[must_use]
    pub fn over_paper(&self) -> Option<f64> {
        Some(self.ape_rmse_cm?.median / self.paper.as_ref()?.ape_cm[0])
    }
}

/// Everything that a benchmark found.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    /// All cells, by sequence, method and seed as in the plan.
    pub cells: Vec<Cell>,
    /// Bounds by sequence and method.
    pub bounds: BTreeMap<String, BTreeMap<String, Bound>>,
    /// One row for each sequence and method.
    pub rows: Vec<Row>,
}

impl Results {
    /// What a store holds of a plan.
    ///
    /// # Errors
    /// Those of the store.
    pub fn of(sequences: &[String], plan: &Plan, store: &Store) -> Result<Self, Error> {
        let (mut cells, mut rows, mut all_bounds) = (Vec::new(), Vec::new(), BTreeMap::new());
        for sequence in sequences {
            let bounds = store.bound(sequence)?.unwrap_or_default();
            let methods = plan.methods.iter().map(|method| method.name().to_owned());
            for method in methods.chain(plan.estimates.iter().cloned()) {
                let mut found = Vec::new();
                let seeds: &[u64] = if Method::of_name(&method).is_some() { &plan.seeds } else { &[0] };
                for seed in seeds {
                    let key = CellKey { sequence: sequence.clone(), method: method.clone(), seed: *seed };
                    found.extend(store.cell(&key)?);
                }
                // Estimates from elsewhere may have used everything.
                let bound = bounds.get(&method).or_else(|| bounds.get(Method::StructuralBa.name()));
                rows.push(row(sequence, &method, &found, bound));
                cells.extend(found);
            }
            all_bounds.insert(sequence.clone(), bounds);
        }
        Ok(Self { cells, bounds: all_bounds, rows })
    }

    /// The row of a sequence and a method.
    #[must_use]
    pub fn row(&self, sequence: &str, method: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.sequence == sequence && row.method == method)
    }

    /// Sequences in their order.
    #[must_use]
    pub fn sequences(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for row in &self.rows {
            if names.last() != Some(&row.sequence.as_str()) {
                names.push(&row.sequence);
            }
        }
        names
    }

    /// Geometric mean over sequences of a number of each row of a method, and of how many.
    #[must_use]
    pub fn geometric_mean(&self, method: &str, number: impl Fn(&Row) -> Option<f64>) -> Option<(f64, usize)> {
        let rows = self.rows.iter().filter(|row| row.method == method);
        let logs: Vec<f64> = rows.filter_map(number).filter(|number| *number > 0.0).map(libm::log).collect();
        let count = logs.len();
        (count > 0).then(|| (libm::exp(logs.iter().sum::<f64>() / count as f64), count))
    }
}

fn row(sequence: &str, method: &str, cells: &[Cell], bound: Option<&Bound>) -> Row {
    let spread = |number: &dyn Fn(&Outcome) -> Option<f64>| {
        Spread::of(cells.iter().filter_map(|cell| number(&cell.outcome)))
    };
    macro_rules! spread_of {
        ($field:ident, $scale:expr) => {
            spread(&|outcome| match outcome {
                Outcome::Estimated { $field, .. } => Some($field * $scale),
                Outcome::Failed { .. } => None,
            })
        };
    }
    let mut reasons = cells.iter().filter_map(|cell| match &cell.outcome {
        Outcome::Failed { reason } => Some(reason),
        Outcome::Estimated { .. } => None,
    });
    let first = reasons.next();
    let in_paper = Method::of_name(method).map(Method::in_paper);
    Row {
        sequence: sequence.to_owned(),
        method: method.to_owned(),
        failed: first.map(|reason| (1 + reasons.count(), reason.clone())),
        ape_rmse_cm: spread_of!(ape_rmse_m, 100.0),
        ape_median_cm: spread_of!(ape_median_m, 100.0),
        ape_sim3_rmse_cm: spread_of!(ape_sim3_rmse_m, 100.0),
        rpe_rotation_rmse_deg: spread_of!(rpe_rotation_rmse_deg, 1.0),
        rpe_rotation_median_deg: spread_of!(rpe_rotation_median_deg, 1.0),
        predicted: cells
            .iter()
            .map(|cell| match &cell.outcome {
                Outcome::Estimated { predicted, .. } => *predicted,
                Outcome::Failed { .. } => 0,
            })
            .max()
            .unwrap_or(0),
        // What came with a sequence took its time elsewhere.
        seconds: Method::of_name(method).and_then(|_| Spread::of(cells.iter().map(|cell| cell.seconds))),
        bound_cm: bound.map(|bound| bound.translation_rms_m * 100.0),
        bound_is_scaled: bound.is_some_and(|bound| bound.is_scaled),
        paper: in_paper.and_then(|name| paper(sequence, PaperMethod(name))).cloned(),
    }
}
