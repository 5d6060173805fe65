//! A figure: what was measured, and the bound it has to keep.

use std::fmt;
use std::time::{Duration, Instant};

/// What a figure has to keep.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bound {
    /// At least so much.
    AtLeast(f64),
    /// At most so much.
    AtMost(f64),
    /// Nothing; told for comparison.
    None,
}

/// One line of the table.
struct Figure {
    name: String,
    value: f64,
    unit: &'static str,
    bound: Bound,
}

impl Figure {
    fn holds(&self) -> bool {
        match self.bound {
            Bound::AtLeast(least) => self.value >= least,
            Bound::AtMost(most) => self.value <= most,
            Bound::None => true,
        }
    }
}

/// What was measured in this run.
#[derive(Default)]
pub(crate) struct Figures {
    figures: Vec<Figure>,
}

impl Figures {
    /// Adds a figure.
    pub(crate) fn add(&mut self, name: impl Into<String>, value: f64, unit: &'static str, bound: Bound) {
        let figure = Figure { name: name.into(), value, unit, bound };
        eprintln!("{}: {} {}", figure.name, digits(value), unit);
        self.figures.push(figure);
    }

    /// Whether every bound holds.
    pub(crate) fn hold(&self) -> bool {
        self.figures.iter().all(Figure::holds)
    }
}

/// Three or four significant digits.
fn digits(value: f64) -> String {
    match value.abs() {
        large if large >= 1000.0 => format!("{value:.0}"),
        large if large >= 10.0 => format!("{value:.1}"),
        large if large >= 0.1 => format!("{value:.2}"),
        _ => format!("{value:.5}"),
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| figure | measured | bound | holds |")?;
        writeln!(f, "|---|--:|--:|---|")?;
        for figure in &self.figures {
            let (bound, holds) = match figure.bound {
                Bound::AtLeast(least) => (format!("≥ {}", digits(least)), figure.holds()),
                Bound::AtMost(most) => (format!("≤ {}", digits(most)), figure.holds()),
                Bound::None => {
                    writeln!(f, "| {} | {} {} | | |", figure.name, digits(figure.value), figure.unit)?;
                    continue;
                }
            };
            let holds = if holds { "yes" } else { "NO" };
            writeln!(
                f,
                "| {} | {} {} | {bound} | {holds} |",
                figure.name,
                digits(figure.value),
                figure.unit
            )?;
        }
        Ok(())
    }
}

/// The median time of some runs, after one that warms up.
pub(crate) fn median_time<T>(runs: usize, mut run: impl FnMut() -> T) -> Duration {
    let mut times: Vec<Duration> = (0..=runs).map(|_| time_of(&mut run)).skip(1).collect();
    median(&mut times)
}

/// How many times longer the first takes than the second: the median ratio of `blocks` blocks. In each,
/// both run a few times in a row, the first run of either uncounted, so that both meet the same machine
/// and neither finds the other's memory in its way.
pub(crate) fn median_ratio<T, U>(
    blocks: usize,
    mut first: impl FnMut() -> T,
    mut second: impl FnMut() -> U,
) -> f64 {
    const IN_A_ROW: usize = 5;
    let mut ratios: Vec<f64> = (0..blocks)
        .map(|_| {
            let first = median_time(IN_A_ROW, &mut first);
            first.as_secs_f64() / median_time(IN_A_ROW, &mut second).as_secs_f64()
        })
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    ratios[ratios.len() / 2]
}

fn median(times: &mut [Duration]) -> Duration {
    times.sort_unstable();
    times[times.len() / 2]
}

fn time_of<T>(run: &mut impl FnMut() -> T) -> Duration {
    let start = Instant::now();
    let result = run();
    let time = start.elapsed();
    drop(result);
    time
}
