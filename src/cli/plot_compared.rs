//! Figures of estimates beside the truth: paths, coordinates, errors.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::plot::{self, Wanted};
use super::plot_options::{Figure, Over, View};
use crate::evaluate::{Absolute, Relation};
use crate::format;
use crate::geometry::Pose;
use crate::plot::paper::{
    Chart, ColourBar, Content, Curve, Drawn, Panel, PaperFigure, Role, Scale, histogram, with_gaps,
};
use crate::plot::{LengthUnit, Plane, upward};
use crate::report::{ComparedEstimate, Comparison, coordinates_and_angles};
use crate::structure::FrameId;

/// Errors whose medians differ more than so many times are drawn over powers of ten.
const FAR_APART: f64 = 15.0;
/// Paths whose largest errors differ less than so many times have the same colours.
const SAME_COLOURS: f64 = 4.0;

/// A sequence whose estimates are drawn.
struct Compared {
    name: String,
    comparison: Comparison,
    /// Where each frame stands over time.
    across: BTreeMap<FrameId, f64>,
    /// Whether that is in seconds; else by frame.
    timed: bool,
    upward: Vector3<f64>,
}

/// A figure of estimates.
///
/// * `problems` — gets what could not be compared.
pub(super) fn figure(wanted: &Wanted<'_>, problems: &mut Vec<String>) -> anyhow::Result<PaperFigure> {
    let all: Vec<Compared> = wanted
        .inputs
        .iter()
        .map(|path| Compared::read(path, wanted, problems))
        .collect::<anyhow::Result<_>>()?;
    let (what, panels, columns) = match wanted.figure {
        Figure::Xyz => {
            let (panels, columns) = stacked(wanted, &all, ["x (m)", "y (m)", "z (m)"], 0);
            ("Coordinates over time", panels, columns)
        }
        Figure::Rpy => {
            let (panels, columns) = stacked(wanted, &all, ["Roll (°)", "Pitch (°)", "Yaw (°)"], 3);
            ("Angles over time", panels, columns)
        }
        Figure::Ape => {
            let panels = absolute_errors(wanted, &all)?;
            let columns = wanted.columns(panels.len(), 1, 2);
            ("Absolute errors", panels, columns)
        }
        Figure::ApeMap => {
            let panels = ape_maps(wanted, &all)?;
            // More than two over each other would be higher than a page.
            let columns = wanted.columns(panels.len(), if panels.len() > 2 { 2 } else { 1 }, 2);
            ("Paths and their absolute errors", panels, columns)
        }
        Figure::Rpe => {
            let pairs =
                all.iter().map(|compared| compared.rpe(all.len() > 1)).collect::<anyhow::Result<Vec<_>>>()?;
            let panels: Vec<Panel> = pairs.into_iter().flatten().collect();
            let columns = wanted.columns(panels.len(), 1, 2);
            ("Relative errors", panels, columns)
        }
        _ => {
            let panels =
                all.iter().map(|compared| compared.paths(wanted)).collect::<anyhow::Result<Vec<_>>>()?;
            let columns = wanted.columns(panels.len(), 1, 2);
            ("Trajectories", panels, columns)
        }
    };
    let names: Vec<&str> = all.iter().map(|compared| compared.name.as_str()).collect();
    Ok(PaperFigure { title: format!("{what} of {}", names.join(", ")), panels, columns })
}

/// Three charts over each other for each sequence, the sequences side by side where there is room.
fn stacked(wanted: &Wanted<'_>, all: &[Compared], names: [&str; 3], first: usize) -> (Vec<Panel>, usize) {
    let columns = match all.len() {
        2 | 3 if wanted.wide => all.len(),
        count if wanted.wide && count % 2 == 0 => 2,
        _ => 1,
    };
    let mut panels = Vec::new();
    for side_by_side in all.chunks(columns) {
        let numbered: Vec<Vec<Curve>> =
            side_by_side.iter().map(|compared| compared.numbered(first)).collect();
        for (place, name) in names.iter().enumerate() {
            for (compared, curves) in side_by_side.iter().zip(&numbered) {
                let last = place + 1 == names.len();
                let content = Content::Chart(Chart {
                    x_name: last.then(|| compared.time_name().to_owned()),
                    y_name: (*name).to_owned(),
                    x: if compared.timed { Scale::Linear } else { Scale::Whole },
                    y: Scale::Linear,
                    same_scale: false,
                    aspect: 0.2,
                    colour_bar: None,
                    curves: curves.iter().skip(place).step_by(3).cloned().collect(),
                });
                panels
                    .push(Panel { caption: (last && all.len() > 1).then(|| compared.name.clone()), content });
            }
        }
    }
    (panels, columns)
}

/// Absolute errors of each sequence, all in one unit and on one kind of scale.
fn absolute_errors(wanted: &Wanted<'_>, all: &[Compared]) -> anyhow::Result<Vec<Panel>> {
    let found: Vec<_> = all.iter().map(Compared::absolute).collect::<anyhow::Result<_>>()?;
    let each = || found.iter().flatten().map(|(_, absolute)| *absolute);
    let unit = LengthUnit::of(each().map(largest).fold(0.0, f64::max));
    let medians = || each().map(|absolute| absolute.translation.median() * unit.per_metre);
    let [least, most] = [medians().fold(f64::INFINITY, f64::min), medians().fold(0.0, f64::max)];
    // Errors far under the usual ones would take the room of the others.
    let y = if least > 0.0 && most > FAR_APART * least {
        Scale::LogarithmicFrom(0.1 * least)
    } else {
        Scale::FromZero
    };
    Ok(all.iter().zip(&found).map(|(compared, found)| compared.ape(wanted, found, &unit, y)).collect())
}

/// A path for each estimate, coloured by its errors.
fn ape_maps(wanted: &Wanted<'_>, all: &[Compared]) -> anyhow::Result<Vec<Panel>> {
    let with_errors = |compared| -> anyhow::Result<_> { Ok((compared, Compared::absolute(compared)?)) };
    let found: Vec<_> = all.iter().map(with_errors).collect::<anyhow::Result<_>>()?;
    let largest: Vec<f64> = found
        .iter()
        .flat_map(|(_, estimates)| estimates.iter().map(|(_, absolute)| largest(absolute)))
        .collect();
    let [least, most] =
        [largest.iter().copied().fold(f64::INFINITY, f64::min), largest.iter().copied().fold(0.0, f64::max)];
    let same = most <= SAME_COLOURS * least;
    let mut panels = Vec::new();
    for (compared, estimates) in found {
        let plane = Plane::new(wanted.view(View::Top), compared.upward)?;
        let flat = |poses: &[Pose]| -> Vec<[f64; 2]> {
            poses.iter().map(|pose| plane.place(pose.translation()).unwrap_or([f64::NAN; 2])).collect()
        };
        for (estimate, absolute) in estimates {
            let highest = if same { most } else { self::largest(absolute) };
            let unit = LengthUnit::of(highest);
            let values = absolute.translation.values().iter().map(|error| error * unit.per_metre).collect();
            let truth = Curve {
                name: "ground truth".to_owned(),
                role: Role::Truth,
                places: flat(&absolute.aligned.reference),
                drawn: Drawn::Path,
            };
            // The caption has its name.
            let path = Curve {
                name: "estimate".to_owned(),
                role: Role::Series(0),
                places: flat(&absolute.aligned.estimate),
                drawn: Drawn::Heat(values),
            };
            let bar = ColourBar { name: format!("APE ({})", unit.name), highest: highest * unit.per_metre };
            let caption = if all.len() > 1 {
                format!("{}, {}", compared.name, estimate.name)
            } else {
                estimate.name.clone()
            };
            panels.push(Panel { caption: Some(caption), content: map(&plane, vec![truth, path], Some(bar)) });
        }
    }
    Ok(panels)
}

fn largest(absolute: &Absolute<FrameId>) -> f64 {
    absolute.translation.values().iter().copied().filter(|error| error.is_finite()).fold(0.0, f64::max)
}

/// Curves in a plane of the world.
fn map(plane: &Plane, curves: Vec<Curve>, colour_bar: Option<ColourBar>) -> Content {
    let [right, up] = plane.names();
    Content::Chart(Chart {
        x_name: Some(format!("{right} (m)")),
        y_name: format!("{up} (m)"),
        x: Scale::Linear,
        y: Scale::Linear,
        same_scale: true,
        aspect: 1.0,
        colour_bar,
        curves,
    })
}

impl Compared {
    fn read(path: &std::path::Path, wanted: &Wanted<'_>, problems: &mut Vec<String>) -> anyhow::Result<Self> {
        let shown = path.display();
        let reader = format::open(path)?;
        let frames = reader.frame_list()?;
        let mut comparison = Comparison::read(&reader, &wanted.align.options())?;
        if !wanted.estimates.is_empty() {
            let there: Vec<&str> =
                comparison.estimates.iter().map(|estimate| estimate.name.as_str()).collect();
            let there = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
            for name in wanted.estimates {
                if !comparison.estimates.iter().any(|estimate| estimate.name == *name) {
                    anyhow::bail!("{shown}: expected an estimate {name}, found {there}");
                }
            }
            comparison.estimates.retain(|estimate| wanted.estimates.contains(&estimate.name));
        }
        let errors = matches!(wanted.figure, Figure::Ape | Figure::ApeMap | Figure::Rpe);
        if comparison.estimates.is_empty() && (errors || comparison.truth.is_empty()) {
            anyhow::bail!(
                "{shown}: expected an estimated trajectory, found none; os track and os adjust add some"
            );
        }
        if errors && comparison.truth.is_empty() {
            let why = comparison.why_not.as_deref().unwrap_or("no frame has a true pose");
            anyhow::bail!("{shown}: expected true poses to compare with: {why}");
        }
        for estimate in &comparison.estimates {
            if let Some(problem) = &estimate.problem {
                problems.push(format!("{shown}, {}: {problem}", estimate.name));
            }
        }
        let first = frames.first().map_or(0, |frame| frame.stamp_nanos);
        let timed = frames.iter().any(|frame| frame.stamp_nanos != first);
        let across = frames.iter().map(|frame| {
            let seconds = (i128::from(frame.stamp_nanos) - i128::from(first)) as f64 * 1e-9;
            (frame.frame_id, if timed { seconds } else { frame.frame_id.0 as f64 })
        });
        Ok(Self {
            name: plot::caption(path),
            across: across.collect(),
            timed,
            upward: upward(&reader.manifest().cameras, frames),
            comparison,
        })
    }

    fn time_name(&self) -> &'static str {
        if self.timed { "Time (s)" } else { "Frame" }
    }

    fn at(&self, id: FrameId) -> f64 {
        self.across.get(&id).copied().unwrap_or(f64::NAN)
    }

    /// Three curves for each path, the truth first: its coordinates, or its angles from the fourth number on.
    fn numbered(&self, first: usize) -> Vec<Curve> {
        let truth = coordinates_and_angles(&self.comparison.truth, None);
        let mut curves = Vec::new();
        let mut add = |name: &str, role: Role, rows: &[(FrameId, [f64; 6])]| {
            for place in first..first + 3 {
                let places = rows.iter().map(|(id, numbers)| [self.at(*id), numbers[place]]).collect();
                curves.push(Curve {
                    name: name.to_owned(),
                    role,
                    places: with_gaps(places),
                    drawn: Drawn::Line,
                });
            }
        };
        if !truth.is_empty() {
            add("ground truth", Role::Truth, &truth);
        }
        for (place, estimate) in self.comparison.estimates.iter().enumerate() {
            add(&estimate.name, Role::Series(place), &coordinates_and_angles(&estimate.poses, Some(&truth)));
        }
        curves
    }

    /// Paths of the truth and the estimates in a plane.
    fn paths(&self, wanted: &Wanted<'_>) -> anyhow::Result<Panel> {
        let plane = Plane::new(wanted.view(View::Top), self.upward)?;
        let curve = |name: &str, role: Role, poses: &[(FrameId, Pose)]| Curve {
            name: name.to_owned(),
            role,
            places: poses
                .iter()
                .map(|(_, pose)| plane.place(pose.translation()).unwrap_or([f64::NAN; 2]))
                .collect(),
            drawn: Drawn::Path,
        };
        let truth = &self.comparison.truth;
        let mut curves = Vec::new();
        if !truth.is_empty() {
            curves.push(curve("ground truth", Role::Truth, truth));
        }
        let estimates = self.comparison.estimates.iter().enumerate();
        curves.extend(
            estimates.map(|(place, estimate)| curve(&estimate.name, Role::Series(place), &estimate.poses)),
        );
        Ok(Panel { caption: Some(self.name.clone()), content: map(&plane, curves, None) })
    }

    /// Estimates that have absolute errors.
    fn absolute(&self) -> anyhow::Result<Vec<(&ComparedEstimate, &Absolute<FrameId>)>> {
        let estimates = self.comparison.estimates.iter();
        let found: Vec<_> = estimates
            .filter_map(|estimate| Some((estimate, estimate.evaluation.as_ref()?.absolute.as_ref().ok()?)))
            .collect();
        if found.is_empty() {
            anyhow::bail!(
                "{}: none of {} estimates could be compared with the truth",
                self.name,
                self.comparison.estimates.len()
            );
        }
        Ok(found)
    }

    /// Where an estimate stands among those of its sequence, so that it has the same pen in every figure.
    fn role(&self, estimate: &ComparedEstimate) -> Role {
        Role::Series(self.comparison.estimates.iter().position(|one| one.name == estimate.name).unwrap_or(0))
    }

    /// Absolute errors along the path or over time.
    fn ape(
        &self,
        wanted: &Wanted<'_>,
        found: &[(&ComparedEstimate, &Absolute<FrameId>)],
        unit: &LengthUnit,
        y: Scale,
    ) -> Panel {
        let along = wanted.over == Over::Path;
        let curve = |(estimate, absolute): &(&ComparedEstimate, &Absolute<FrameId>)| {
            let errors = absolute.translation.values().iter().map(|error| error * unit.per_metre);
            let x: Vec<f64> = if along {
                absolute.path_m.clone()
            } else {
                absolute.ids.iter().map(|id| self.at(*id)).collect()
            };
            let places: Vec<[f64; 2]> = x.into_iter().zip(errors).map(|(x, error)| [x, error]).collect();
            let places = if along { places } else { with_gaps(places) };
            Curve { name: estimate.name.clone(), role: self.role(estimate), places, drawn: Drawn::Line }
        };
        let content = Content::Chart(Chart {
            x_name: Some(if along { "Distance along the path (m)" } else { self.time_name() }.to_owned()),
            y_name: format!("APE ({})", unit.name),
            x: if along || self.timed { Scale::Linear } else { Scale::Whole },
            y,
            same_scale: false,
            aspect: 0.42,
            colour_bar: None,
            curves: found.iter().map(curve).collect(),
        });
        Panel { caption: Some(self.name.clone()), content }
    }

    /// Histograms of relative errors of translation and of rotation.
    fn rpe(&self, several: bool) -> anyhow::Result<[Panel; 2]> {
        let estimates = self.comparison.estimates.iter();
        let found: Vec<_> = estimates
            .filter_map(|estimate| Some((estimate, estimate.evaluation.as_ref()?.relative.as_ref().ok()?)))
            .collect();
        if found.is_empty() {
            anyhow::bail!(
                "{}: none of {} estimates has relative errors",
                self.name,
                self.comparison.estimates.len()
            );
        }
        let median = found.iter().map(|(_, relative)| relative.translation.median()).fold(0.0, f64::max);
        let unit = LengthUnit::of(median);
        let mut translations = Vec::new();
        let mut rotations = Vec::new();
        for (estimate, relative) in &found {
            let metres = relative.translation.values().iter().map(|error| error * unit.per_metre).collect();
            translations.push((estimate.name.as_str(), metres));
            rotations.push((estimate.name.as_str(), relative.errors(Relation::AngleDeg)?.values().to_vec()));
        }
        let panel = |quantity: &str, unit: &str, named: &[(&str, Vec<f64>)]| {
            let drawn = histogram(named);
            let mut curves = drawn.curves;
            for (curve, (estimate, _)) in curves.iter_mut().zip(&found) {
                curve.role = self.role(estimate);
            }
            let beyond = if drawn.last_from.is_some() { "; last bin: all beyond" } else { "" };
            let content = Content::Chart(Chart {
                x_name: Some(format!("RPE of {quantity} over a frame ({unit}){beyond}")),
                y_name: "Pairs (%)".to_owned(),
                x: Scale::FromZero,
                y: Scale::FromZero,
                same_scale: false,
                aspect: 0.38,
                colour_bar: None,
                curves,
            });
            Panel { caption: several.then(|| self.name.clone()), content }
        };
        Ok([panel("translation", unit.name, &translations), panel("rotation", "°", &rotations)])
    }
}
