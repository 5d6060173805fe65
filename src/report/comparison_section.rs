//! Estimates against the truth: errors, coordinates and angles over time, error along the path, convergence.

use maud::{Markup, html};

use super::SequenceReport;
use super::charts::{self, Entry, Figure, Table, named};
use super::comparison::{ComparedEstimate, Comparison, coordinates_and_angles};
use super::convergence::Run;
use super::numbers::{NONE, count, maybe, short, thinned};
use crate::evaluate::{Absolute, Relative, Statistics};
use crate::plot::{PageCurve, Upward, page_chart};
use crate::structure::FrameId;
use std::collections::BTreeMap;

/// Most rows of a table of poses.
const MOST_ROWS: usize = 40;
/// Errors whose medians differ more than so many times are drawn over powers of ten.
const FAR_APART: f64 = 15.0;

pub(super) fn section(report: &SequenceReport) -> Markup {
    let comparison = &report.comparison;
    if comparison.estimates.is_empty() {
        return html! {
            p.nothing {
                "The sequence holds no estimated trajectory; " code { "os track" } " and " code { "os adjust" } " add some."
            }
        };
    }
    html! {
        @if let Some(why_not) = &comparison.why_not {
            p.nothing { "Nothing is compared: " (why_not) "." }
        } @else {
            (errors(comparison))
        }
        (problems(comparison))
        (Paths::of(report).markup())
    }
}

fn problems(comparison: &Comparison) -> Markup {
    let with =
        || comparison.estimates.iter().filter_map(|found| Some((&found.name, found.problem.as_ref()?)));
    html! {
        @if with().next().is_some() {
            ul.problems { @for (name, problem) in with() { li { b { (named(name)) } ": " (problem) } } }
        }
    }
}

/// `rmse`, `median` and `max` in another unit.
fn three(found: Option<Statistics>, scale: f64) -> [String; 3] {
    found.map_or_else(
        || [NONE, NONE, NONE].map(str::to_owned),
        |found| [found.rmse, found.median, found.max].map(|number| short(number * scale)),
    )
}

fn errors(comparison: &Comparison) -> Markup {
    let absolute = |found: &ComparedEstimate| -> Option<Absolute<FrameId>> {
        found.evaluation.as_ref()?.absolute.as_ref().ok().cloned()
    };
    let relative = |found: &ComparedEstimate| -> Option<Relative<FrameId>> {
        found.evaluation.as_ref()?.relative.as_ref().ok().cloned()
    };
    let degrees = 1.0_f64.to_degrees();
    html! {
        p.note {
            "APE of translation after SE(3) alignment, centimetres; RPE of rotation from frame to frame, degrees; of points and lines the "
            "distance from where they should be, centimetres. Definitions are those of evo."
        }
        div.wide tabindex="0" role="group" aria-label="Errors of the estimates" {
            table {
                thead {
                    tr {
                        th rowspan="2" scope="col" { "estimate" }
                        th rowspan="2" scope="col" { "frames" }
                        th rowspan="2" scope="col" { "missing" }
                        th colspan="3" scope="colgroup" { "APE, cm" }
                        th colspan="3" scope="colgroup" { "RPE, °" }
                        th colspan="2" scope="colgroup" { "map, cm rmse" }
                    }
                    tr {
                        @for _ in 0..2 { th scope="col" { "rmse" } th scope="col" { "median" } th scope="col" { "max" } }
                        th scope="col" { "points" } th scope="col" { "lines" }
                    }
                }
                tbody {
                    @for (place, found) in comparison.estimates.iter().enumerate() {
                        tr {
                            th scope="row" {
                                span class=(format!("swatch {}", charts::series(place))) {} (named(&found.name))
                            }
                            @match &found.evaluation {
                                Some(evaluation) => {
                                    td { (evaluation.matched) } td { (evaluation.missing) }
                                    @for cell in three(absolute(found).map(|errors| errors.translation.statistics()), 100.0) { td { (cell) } }
                                    @for cell in three(relative(found).map(|errors| errors.rotation.statistics()), degrees) { td { (cell) } }
                                    td { (maybe(evaluation.points.as_ref().and_then(|points| Some(points.statistics()?.rmse * 100.0)))) }
                                    td { (maybe(evaluation.lines.as_ref().and_then(|lines| Some(Statistics::of(&lines.distance_m)?.rmse * 100.0)))) }
                                }
                                None => { @for _ in 0..10 { td { (NONE) } } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A path as numbers: coordinates in metres, angles in degrees.
struct Numbered<'a> {
    name: &'a str,
    class: String,
    rows: Vec<(FrameId, [f64; 6])>,
}

/// Paths as numbers over time.
struct Paths<'a> {
    report: &'a SequenceReport,
    /// The true one first.
    all: Vec<Numbered<'a>>,
    /// Where each frame stands on the axis to the right.
    across: BTreeMap<FrameId, f64>,
    /// Whether that is in seconds; else by frame.
    timed: bool,
}

impl<'a> Paths<'a> {
    fn of(report: &'a SequenceReport) -> Self {
        let comparison = &report.comparison;
        let truth = coordinates_and_angles(&comparison.truth, None);
        let mut all = Vec::new();
        for (place, estimate) in comparison.estimates.iter().enumerate() {
            let rows = coordinates_and_angles(&estimate.poses, Some(&truth));
            all.push(Numbered { name: &estimate.name, class: charts::series(place), rows });
        }
        if !truth.is_empty() {
            all.insert(0, Numbered { name: "ground truth", class: "truth".to_owned(), rows: truth });
        }
        let timed = report.analysed.sequence.duration_seconds > 0.0;
        let first = report.frames.first().map_or(0, |frame| frame.stamp_nanos);
        let seconds = |stamp: i64| (i128::from(stamp) - i128::from(first)) as f64 * 1e-9;
        let across = report.frames.iter().map(|frame| {
            let number = if timed { seconds(frame.stamp_nanos) } else { frame.frame_id.0 as f64 };
            (frame.frame_id, number)
        });
        Self { report, all, across: across.collect(), timed }
    }

    fn axis(&self) -> (&'static str, &'static str) {
        if self.timed { ("time, s", "seconds") } else { ("frame", "frame") }
    }

    fn markup(&self) -> Markup {
        let laid = self.report.comparison.estimates.iter().any(|estimate| estimate.aligned);
        let how = if laid { "laid on the true path" } else { "as stored" };
        let legend: Vec<Entry<'_>> =
            self.all.iter().map(|path| Entry { class: &path.class, name: path.name }).collect();
        html! {
            h4 { "Coordinates and angles over time" }
            p.note { "Estimates " (how) ". Metres and degrees; R = R" sub { "z" } "(yaw) R" sub { "y" } "(pitch) R" sub { "x" } "(roll)." }
            (charts::legend(&legend))
            div.charts.six {
                @for (place, name) in ["x, m", "y, m", "z, m", "roll, °", "pitch, °", "yaw, °"].into_iter().enumerate() {
                    (self.coordinate(place, name))
                }
            }
            (self.table().details("Poses as a table"))
            div.charts { (self.along()) (self.over_time()) }
        }
    }

    fn coordinate(&self, place: usize, name: &str) -> Markup {
        let numbers: Vec<Vec<[f64; 2]>> = self
            .all
            .iter()
            .map(|path| {
                let at = |id: &FrameId| self.across.get(id).copied().unwrap_or(f64::NAN);
                path.rows.iter().map(|(id, six)| [at(id), six[place]]).collect()
            })
            .collect();
        let curves: Vec<PageCurve<'_>> = self
            .all
            .iter()
            .zip(&numbers)
            .map(|(path, places)| PageCurve { class: &path.class, places })
            .collect();
        let (x_name, cursor) = self.axis();
        let svg = page_chart(&format!("{name} over time"), x_name, Upward::Linear, &curves);
        Figure { title: name, note: "", cursor: Some(cursor), svg, legend: &[], table: None }.markup()
    }

    fn table(&self) -> Table {
        let frames = &self.report.frames;
        let kept = thinned(frames.len(), MOST_ROWS);
        let rows: Vec<BTreeMap<FrameId, [f64; 6]>> =
            self.all.iter().map(|path| path.rows.iter().copied().collect()).collect();
        let header = std::iter::once("frame".to_owned()).chain(self.all.iter().flat_map(|path| {
            let name = path.name;
            ["x", "y", "z", "roll", "pitch", "yaw"].map(|part| format!("{name}: {part}"))
        }));
        let row = |place: usize| {
            let id = frames[place].frame_id;
            let cells = rows.iter().flat_map(|rows| match rows.get(&id) {
                Some(six) => six.map(short),
                None => [NONE; 6].map(str::to_owned),
            });
            std::iter::once(id.0.to_string()).chain(cells).collect()
        };
        let note = (kept.len() < frames.len())
            .then(|| format!("{} of {} frames.", kept.len(), count(frames.len() as u64)));
        Table { header: header.collect(), rows: kept.into_iter().map(row).collect(), note }
    }

    /// Estimates that have absolute errors, with the place of each.
    fn compared(&self) -> Vec<(usize, &'a ComparedEstimate, &'a Absolute<FrameId>)> {
        let estimates = self.report.comparison.estimates.iter().enumerate();
        let absolute = |(place, found): (usize, &'a ComparedEstimate)| {
            Some((place, found, found.evaluation.as_ref()?.absolute.as_ref().ok()?))
        };
        estimates.filter_map(absolute).collect()
    }

    fn along(&self) -> Markup {
        let x = |found: &Absolute<FrameId>| found.path_m.clone();
        self.errors("APE along the path", "distance along the true path, m", None, x)
    }

    fn over_time(&self) -> Markup {
        let (x_name, cursor) = self.axis();
        let x = |found: &Absolute<FrameId>| {
            found.ids.iter().map(|id| self.across.get(id).copied().unwrap_or(f64::NAN)).collect()
        };
        self.errors("APE over time", x_name, Some(cursor), x)
    }

    fn errors(
        &self,
        title: &str,
        x_name: &str,
        cursor: Option<&'static str>,
        x: impl Fn(&Absolute<FrameId>) -> Vec<f64>,
    ) -> Markup {
        let compared = self.compared();
        if compared.is_empty() {
            return html! {};
        }
        let numbers: Vec<Vec<[f64; 2]>> = compared
            .iter()
            .map(|(_, _, found)| {
                let centimetres = found.translation.values().iter().map(|error| error * 100.0);
                x(found).into_iter().zip(centimetres).map(|(x, error)| [x, error]).collect()
            })
            .collect();
        let medians = || compared.iter().map(|(_, _, found)| found.translation.median());
        let [least, most] = [medians().fold(f64::INFINITY, f64::min), medians().fold(0.0, f64::max)];
        let upward =
            if least > 0.0 && most > FAR_APART * least { Upward::Logarithmic } else { Upward::FromZero };
        let classes: Vec<String> = compared.iter().map(|(place, _, _)| charts::series(*place)).collect();
        let curves: Vec<PageCurve<'_>> =
            classes.iter().zip(&numbers).map(|(class, places)| PageCurve { class, places }).collect();
        let legend: Vec<Entry<'_>> = classes
            .iter()
            .zip(&compared)
            .map(|(class, (_, found, _))| Entry { class, name: &found.name })
            .collect();
        Figure {
            title,
            note: "Distance from the true position, cm.",
            cursor,
            svg: page_chart(title, x_name, upward, &curves),
            legend: &legend,
            table: Some(error_table(&compared, &numbers, x_name)),
        }
        .markup()
    }
}

fn error_table(
    compared: &[(usize, &ComparedEstimate, &Absolute<FrameId>)],
    numbers: &[Vec<[f64; 2]>],
    x_name: &str,
) -> Table {
    let mut rows = Vec::new();
    let most = MOST_ROWS / compared.len().max(1);
    for ((_, found, absolute), numbers) in compared.iter().zip(numbers) {
        for place in thinned(numbers.len(), most.max(5)) {
            let [x, error] = numbers[place];
            rows.push(vec![found.name.clone(), absolute.ids[place].0.to_string(), short(x), short(error)]);
        }
    }
    let left_out = rows.len() < numbers.iter().map(Vec::len).sum();
    Table {
        header: ["estimate", "frame", x_name, "error, cm"].map(str::to_owned).to_vec(),
        rows,
        note: left_out.then(|| "Some frames; os evaluate --per-frame has all.".to_owned()),
    }
}

/// Costs over the steps of optimisers.
pub(super) fn convergence(runs: &[Run], title: &str) -> Markup {
    let with_numbers: Vec<(usize, &Run)> =
        runs.iter().enumerate().filter(|(_, run)| !run.accepted().is_empty()).collect();
    if with_numbers.is_empty() {
        return html! { p.nothing { "No optimiser left its steps here." } };
    }
    let classes: Vec<String> = with_numbers.iter().map(|(place, _)| charts::series(*place)).collect();
    let legend: Vec<Entry<'_>> =
        classes.iter().zip(&with_numbers).map(|(class, (_, run))| Entry { class, name: &run.name }).collect();
    let svg = |title: &str, lowered: bool| {
        let numbers: Vec<Vec<[f64; 2]>> = with_numbers
            .iter()
            .map(|(_, run)| {
                let costs = run.accepted();
                let end = costs.last().copied().unwrap_or_default();
                // The end itself has no place over powers of ten.
                let number = |cost: f64| if lowered { cost - end } else { cost };
                (0..).map(f64::from).zip(costs).map(|(step, cost)| [step, number(cost)]).collect()
            })
            .collect();
        let curves: Vec<PageCurve<'_>> =
            classes.iter().zip(&numbers).map(|(class, places)| PageCurve { class, places }).collect();
        page_chart(title, "step", Upward::Logarithmic, &curves)
    };
    let rows = with_numbers.iter().flat_map(|(_, run)| {
        thinned(run.steps.len(), MOST_ROWS).into_iter().map(|step| {
            let (cost, accepted) = run.steps[step];
            let taken = if accepted { "taken" } else { "refused" };
            vec![
                run.name.clone(),
                step.to_string(),
                cost.map_or_else(|| NONE.to_owned(), |cost| format!("{cost:.6e}")),
                taken.to_owned(),
            ]
        })
    });
    let table = Table {
        header: ["optimiser", "step", "cost", "step was"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
        note: None,
    };
    let above = "Above the cost at the end";
    let figures = [
        Figure {
            title,
            note: "Half the sum of robust squared whitened residuals after each step that was taken.",
            cursor: None,
            svg: svg(title, false),
            legend: &legend,
            table: Some(table),
        },
        Figure {
            title: above,
            note: "The cost less that with which the same optimiser ended: how fast each comes to its end. Where a cost rises, the optimiser has changed the problem, such as by what it takes for a mismatch, and begins anew; costs of before that lie below the end have no place here.",
            cursor: None,
            svg: svg(above, true),
            legend: &legend,
            table: None,
        },
    ];
    html! { div.charts { @for figure in &figures { (figure.markup()) } } }
}
