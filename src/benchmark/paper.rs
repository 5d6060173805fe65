//! The figures that the paper prints, from a data file of their own.

use std::collections::BTreeMap;
use std::sync::LazyLock;

/// One figure of the paper's table.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperCell {
    /// Absolute error of translation: root mean square and median, centimetres.
    pub ape_cm: [f64; 2],
    /// Relative error of rotation: root mean square and median, degrees.
    pub rpe_deg: [f64; 2],
    /// What is to be said of it.
    pub note: Option<String>,
}

/// The paper's methods, by the names of estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PaperMethod(pub &'static str);

/// Columns of the paper's table.
const METHODS: [&str; 4] = ["frame-to-frame", "map-to-frame", "point-ba", "point-line-ba"];

static PAPER: LazyLock<BTreeMap<String, BTreeMap<&'static str, PaperCell>>> = LazyLock::new(|| {
    // The file is part of the program; a test reads it.
    let table: toml::Table = toml::from_str(include_str!("paper.toml")).unwrap_or_default();
    table
        .iter()
        .filter_map(|(sequence, row)| {
            let row = row.as_table()?;
            let cells = METHODS.into_iter().filter_map(|method| {
                let numbers: Vec<f64> =
                    row.get(method)?.as_array()?.iter().filter_map(toml::Value::as_float).collect();
                let [ape, ape_median, rpe, rpe_median] = numbers.try_into().ok()?;
                let note = row.get(&format!("{method}-note")).and_then(toml::Value::as_str);
                let cell = PaperCell {
                    ape_cm: [ape, ape_median],
                    rpe_deg: [rpe, rpe_median],
                    note: note.map(str::to_owned),
                };
                Some((method, cell))
            });
            Some((sequence.clone(), cells.collect()))
        })
        .collect()
});

/// What the paper prints for a sequence and one of its methods; `None` where it prints nothing.
#[must_use]
pub fn paper(sequence: &str, method: PaperMethod) -> Option<&'static PaperCell> {
    PAPER.get(sequence)?.get(method.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_the_paper_is_whole() {
        assert_eq!(PAPER.len(), 12);
        for (sequence, row) in PAPER.iter() {
            assert_eq!(row.len(), METHODS.len(), "{sequence}");
        }
        let cell = paper("corridor1", PaperMethod("point-line-ba")).unwrap();
        assert_eq!((cell.ape_cm, cell.rpe_deg), ([4.1, 3.2], [0.26, 0.09]));
        assert!(paper("livingroom1", PaperMethod("map-to-frame")).unwrap().note.is_some());
        assert!(paper("box1", PaperMethod("structural-ba")).is_none());
    }
}
