//! Everything that an evaluation shows of one sequence in one picture.

use nalgebra::Vector3;

use super::chart::Area;
use super::curves_figure::{
    ErrorCurve, NamedNumbers, chart_area, chart_height, draw_errors, draw_histogram, legend,
};
use super::error::Error;
use super::svg::Svg;
use super::trajectory_figure::{ComparedPath, draw_maps, maps_height};
use super::{INK, PAPER};

const WIDTH: f64 = 1200.0;
const MARGIN: f64 = 40.0;
const HEAD: f64 = 66.0;

/// What is shown of one estimate.
#[derive(Clone, Copy, Debug)]
pub struct EvaluatedEstimate<'a> {
    /// Its path and its reference.
    pub path: ComparedPath<'a>,
    /// Seconds since the begin of each of its poses.
    pub seconds: &'a [f64],
    /// Relative errors, in the unit that the figure is told; empty where there are none.
    pub relative: &'a [f64],
}

/// Paths from above coloured by their errors, errors over time, and a histogram of relative errors.
///
/// Returns SVG text.
///
/// * `quantity` — what the relative errors are, with their unit, such as `RPE of rotation over 1 frame, deg`.
/// * `upward` — a unit vector along the axis of `world` that points up; see [`super::upward`].
///
/// # Errors
/// [`Error::Nothing`] when no estimate has a place with finite coordinates.
pub fn evaluation_figure(
    title: &str,
    estimates: &[EvaluatedEstimate<'_>],
    quantity: &str,
    upward: Vector3<f64>,
) -> Result<String, Error> {
    let names = || estimates.iter().map(|estimate| estimate.path.name);
    let (maps, chart) = (maps_height(estimates.len()), chart_height(names()));
    let mut svg =
        Svg::new(WIDTH, HEAD + maps + 2.0 * chart, PAPER, &format!("Errors of the trajectories of {title}"));
    svg.words([MARGIN, 36.0], 22.0, "start", INK, title);
    let words = "estimates from above, coloured by their absolute error, from ●; the reference in grey";
    svg.words([MARGIN, 58.0], 14.0, "start", INK, words);
    let paths: Vec<ComparedPath<'_>> = estimates.iter().map(|estimate| estimate.path).collect();
    let area = Area { left: MARGIN, top: HEAD, width: WIDTH - 2.0 * MARGIN, height: maps };
    if !draw_maps(&mut svg, area, &paths, upward)? {
        return Err(Error::Nothing { name: title.to_owned() });
    }
    let curves: Vec<ErrorCurve<'_>> = estimates
        .iter()
        .map(|estimate| ErrorCurve {
            name: estimate.path.name,
            seconds: estimate.seconds,
            error_m: estimate.path.error_m,
        })
        .collect();
    let top = HEAD + maps;
    legend(&mut svg, top, names());
    draw_errors(&mut svg, chart_area(top, names()), &curves);
    let numbers: Vec<NamedNumbers<'_>> = estimates
        .iter()
        .map(|estimate| NamedNumbers { name: estimate.path.name, numbers: estimate.relative })
        .collect();
    let top = top + chart;
    legend(&mut svg, top, names());
    draw_histogram(&mut svg, chart_area(top, names()), quantity, &numbers);
    Ok(svg.finish())
}

#[cfg(test)]
mod tests {
    use super::super::{convergence_figure, error_figure, histogram_figure, trajectory_figure};
    use super::*;
    use proptest::prelude::*;

    /// Every picture that can be made of some numbers.
    fn pictures(places: &[[f64; 3]], numbers: &[f64]) -> Vec<String> {
        let path = ComparedPath { name: "<a> & b", reference: places, estimate: places, error_m: numbers };
        let estimate = EvaluatedEstimate { path, seconds: numbers, relative: numbers };
        let curve = ErrorCurve { name: path.name, seconds: numbers, error_m: numbers };
        let named = NamedNumbers { name: path.name, numbers };
        let mut all = vec![
            error_figure("t", &[curve, curve]),
            histogram_figure("t", "q", &[named, named]),
            convergence_figure("t", &[named, named]),
        ];
        all.extend(trajectory_figure("t", &[path, path], Vector3::z()));
        all.extend(evaluation_figure("t", &[estimate; 14], "q", Vector3::y()));
        all
    }

    proptest! {
        #[test]
        fn numbers_of_any_size_make_pictures_of_numbers(
            places in prop::collection::vec(prop::array::uniform3(any::<f64>()), 0..6),
            numbers in prop::collection::vec(any::<f64>(), 0..6),
        ) {
            for picture in pictures(&places, &numbers) {
                prop_assert!(!picture.contains("NaN") && !picture.contains("inf"), "{picture}");
                prop_assert!(picture.contains("&lt;a&gt; &amp; b") && !picture.contains("<a>"));
            }
        }
    }

    #[test]
    fn a_picture_of_many_poses_is_small() {
        let places: Vec<[f64; 3]> =
            (0..50_000).map(|n| [f64::from(n).sin(), f64::from(n) * 1e-3, 0.0]).collect();
        let numbers: Vec<f64> = (0..50_000).map(f64::from).collect();
        let all = pictures(&places, &numbers);
        assert_eq!(all.len(), 5);
        assert!(all.iter().all(|picture| picture.len() < 3_000_000));
    }

    #[test]
    fn without_a_place_there_is_no_path() {
        let path = ComparedPath { name: "e", reference: &[], estimate: &[], error_m: &[] };
        assert!(matches!(trajectory_figure("t", &[path], Vector3::z()), Err(Error::Nothing { .. })));
        assert!(matches!(trajectory_figure("t", &[], Vector3::z()), Err(Error::Nothing { .. })));
    }
}
