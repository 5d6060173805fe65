//! A curve of a chart, and what it is drawn with.

use super::sheet::{Mark, Stroke};
use super::theme::Colours;

/// Most places of one curve that are drawn: more than a printer tells apart along a column.
const MOST_PLACES: usize = 1600;

/// A step of more than so many usual ones is a gap.
const GAP: f64 = 10.0;

/// What a curve stands for, which decides its colour, its dashes and its marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The truth: wide and grey, under the others.
    Truth,
    /// The n-th of several that are compared.
    Series(usize),
    /// Points.
    Points,
    /// Lines.
    Lines,
}

/// How the places of a curve are drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Drawn {
    /// As a stroke over the axis to the right.
    Line,
    /// As a stroke with a mark at every place.
    Marked,
    /// As the outline of steps of a width that stand on zero: each place is the left end of a step and its height.
    Steps(f64),
    /// As a path in a plane.
    Path,
    /// As a path in a plane, coloured by a number for each place.
    Heat(Vec<f64>),
}

/// A curve of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name for the legend.
    pub name: String,
    /// What it stands for.
    pub role: Role,
    /// Numbers to the right and upward; one that is not finite is a gap.
    pub places: Vec<[f64; 2]>,
    /// How it is drawn.
    pub drawn: Drawn,
}

/// What a curve is drawn with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pen {
    pub(super) stroke: Stroke<'static>,
    /// What marks it where colours and dashes do not.
    pub(super) mark: Option<Mark>,
}

impl Role {
    /// The pen of a role: no two of the first 25 series share colour and dashes.
    pub(super) fn pen(self, colours: &Colours) -> Pen {
        const DASHES: [&str; 5] = ["", "4 1.6", "1.3 1.3", "6 1.5 1.3 1.5", "8 2.5"];
        const MARKS: [Mark; 5] = [Mark::Circle, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Wedge];
        match self {
            Self::Truth => Pen { stroke: Stroke::new(colours.quiet, 2.2), mark: None },
            Self::Points => Pen { stroke: Stroke::new(colours.points, 1.0), mark: None },
            Self::Lines => {
                Pen { stroke: Stroke { dashes: DASHES[1], ..Stroke::new(colours.lines, 1.0) }, mark: None }
            }
            Self::Series(place) => {
                let colour = colours.series[place % colours.series.len()];
                let dashes = DASHES[(place + place / colours.series.len()) % DASHES.len()];
                Pen {
                    stroke: Stroke { dashes, ..Stroke::new(colour, 1.0) },
                    mark: Some(MARKS[place % MARKS.len()]),
                }
            }
        }
    }
}

impl Curve {
    /// The places that are drawn: of many, the lowest and the highest of each run of neighbours, or of a path every n-th.
    pub(super) fn thinned(&self) -> Vec<[f64; 2]> {
        if self.places.len() <= MOST_PLACES {
            return self.places.clone();
        }
        match self.drawn {
            Drawn::Path | Drawn::Heat(_) => self.places.iter().step_by(self.every()).copied().collect(),
            Drawn::Line | Drawn::Marked | Drawn::Steps(_) => {
                let run = self.places.len().div_ceil(MOST_PLACES / 2);
                self.places.chunks(run).flat_map(ends_of_run).collect()
            }
        }
    }

    /// Every which place of a path is drawn.
    pub(super) fn every(&self) -> usize {
        self.places.len().div_ceil(MOST_PLACES).max(1)
    }
}

/// The lowest and the highest place of a run in their order; a gap where there is one.
fn ends_of_run(run: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let finite = || run.iter().enumerate().filter(|(_, place)| place.iter().all(|number| number.is_finite()));
    let upward = |left: &(usize, &[f64; 2]), right: &(usize, &[f64; 2])| left.1[1].total_cmp(&right.1[1]);
    let (Some(low), Some(high)) = (finite().min_by(upward), finite().max_by(upward)) else {
        return vec![[f64::NAN; 2]];
    };
    let mut kept = if low.0 <= high.0 { vec![*low.1, *high.1] } else { vec![*high.1, *low.1] };
    if finite().count() < run.len() {
        kept.push([f64::NAN; 2]);
    }
    kept
}

/// Places over time with a gap where a step is far longer than usual.
#[must_use]
pub fn with_gaps(places: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut steps: Vec<f64> =
        places.windows(2).map(|pair| pair[1][0] - pair[0][0]).filter(|step| step.is_finite()).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let longest = steps.get(steps.len() / 2).map_or(f64::MAX, |usual| GAP * usual);
    let mut with = Vec::with_capacity(places.len());
    let mut before: Option<f64> = None;
    for place in places {
        if before.replace(place[0]).is_some_and(|before| place[0] - before > longest) {
            with.push([f64::NAN; 2]);
        }
        with.push(place);
    }
    with
}

#[cfg(test)]
mod tests {
    use super::super::Theme;
    use super::*;

    #[test]
    fn a_spike_among_many_places_is_kept() {
        let mut places: Vec<[f64; 2]> = (0..50_000).map(f64::from).map(|x| [x, (x * 0.01).sin()]).collect();
        places[31_234][1] = 40.0;
        let curve = Curve { name: String::new(), role: Role::Points, places, drawn: Drawn::Line };
        let thinned = curve.thinned();
        assert!(thinned.len() <= MOST_PLACES && thinned.contains(&[31_234.0, 40.0]));
        assert!(thinned.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
    }

    #[test]
    fn series_are_told_apart_without_colours() {
        for theme in [Theme::Light, Theme::Dark] {
            let pens: Vec<Pen> = (0..25).map(|place| Role::Series(place).pen(theme.colours())).collect();
            for (place, pen) in pens.iter().enumerate() {
                assert!(!pens[..place].contains(pen), "{place}");
            }
            let first: Vec<_> = pens[..5].iter().map(|pen| (pen.stroke.dashes, pen.mark)).collect();
            assert!((1..5).all(|place| {
                !first[..place].iter().any(|pen| pen.0 == first[place].0 || pen.1 == first[place].1)
            }));
        }
    }

    #[test]
    fn a_long_step_is_a_gap() {
        let places: Vec<[f64; 2]> = [0.0, 0.1, 0.2, 0.3, 5.0, 5.1].map(|x| [x, 1.0]).into();
        let with = with_gaps(places);
        assert_eq!(with.len(), 7);
        assert!(with[4][0].is_nan() && with[5] == [5.0, 1.0]);
    }
}
