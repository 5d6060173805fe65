//! Judging landmarks and noise from what the rows of all landmarks say.

use super::finding::{Detail, Findings};
use super::fit::{Evaluation, Fit, LEAST_ROWS, MOST_EXCESS, SIGMA_FLOOR_PX, common_sigma};
use super::noise::{Declared, Found, judge_depth, judge_outliers, judge_pixels, robust_sigma};
use super::point_rows::Seen;
use super::rules::RuleId;

/// Excess over sigma² up to which a landmark's residuals are taken for noise alone: 0.1 % of right landmarks
/// with three or four degrees of freedom have more.
const CLEAN_EXCESS: f64 = 18.5;
/// Sigma under which a landmark is clean whatever its excess, pixels.
const CLEAN_SIGMA_PX: f64 = 0.05;
/// Degrees of freedom from which the sigma that landmarks agree on is trusted.
const LEAST_FREEDOM: f64 = 100.0;

/// What is said of one kind of landmark.
pub(crate) struct Kind<const N: usize> {
    pub(crate) word: &'static str,
    pub(crate) table: &'static str,
    pub(crate) triangulates: RuleId,
    pub(crate) reprojects: RuleId,
    /// How far a step moves a landmark, in words.
    pub(crate) moved: fn(&Evaluation<N>) -> String,
    pub(crate) observations: &'static str,
    pub(crate) measurements: &'static str,
}

/// Judges the landmarks of a kind, and the noise of their measurements.
///
/// * `ids` — of the landmarks, by place.
pub(crate) fn judge<const N: usize>(
    kind: &Kind<N>,
    ids: &[i64],
    observed: &mut Seen<N>,
    measured: &mut Seen<N>,
    declared: &Declared,
    findings: &mut Findings,
) {
    let evaluate = |seen: &Seen<N>| seen.fits.iter().map(Fit::evaluate).collect::<Vec<_>>();
    let (observations, measurements) = (evaluate(observed), evaluate(measured));
    let (observed_sigma, measured_sigma) = (common_sigma(&observations), common_sigma(&measurements));
    let sigma_of_observations = observed_sigma.unwrap_or(0.0).max(SIGMA_FLOOR_PX);
    let sigma_of_measurements =
        measured_sigma.unwrap_or(0.0).max(declared.sigma_px.unwrap_or(0.0)).max(SIGMA_FLOOR_PX);

    let mut wrong = vec![false; ids.len()];
    for (place, id) in ids.iter().enumerate() {
        let judged = [true, !declared.roundings_agree()];
        let found = [
            (&observed.fits, &observations, sigma_of_observations, kind.observations),
            (&measured.fits, &measurements, sigma_of_measurements, kind.measurements),
        ]
        .into_iter()
        .zip(judged)
        .filter_map(|(table, judged)| judged.then_some(table))
        .find_map(|(fits, evaluations, sigma, table)| {
            accusation(kind, fits.get(place)?, evaluations[place].as_ref(), sigma, table)
        });
        if let Some((expected, found)) = found {
            wrong[place] = true;
            findings.add(kind.triangulates, Some(kind.table), || {
                Detail::new(expected, found).id(format!("{} {id}", kind.word))
            });
        }
    }
    unseen(kind, ids, observed, measured, findings);
    astray(kind, ids, observed, &wrong, findings);
    noise(kind, measured, &measurements, measured_sigma, &wrong, declared, findings);
}

/// What speaks against a landmark; `None` when nothing does.
fn accusation<const N: usize>(
    kind: &Kind<N>,
    fit: &Fit<N>,
    evaluation: Option<&Evaluation<N>>,
    sigma_px: f64,
    table: &str,
) -> Option<(String, String)> {
    let rows = fit.rows + fit.behind;
    if rows >= LEAST_ROWS && fit.behind > fit.rows {
        let found = format!("no image in {} of {rows} frames of {table} that show it", fit.behind);
        return Some((format!("a {} in front of the cameras", kind.word), found));
    }
    let evaluation = evaluation.filter(|found| found.chi2(sigma_px) > MOST_EXCESS)?;
    let expected = format!("where its {rows} rows of {table} triangulate, within an excess of 60 sigma²");
    let [here, there] = evaluation.rms_px();
    let found = format!(
        "about {} from there: excess {:.0} sigma² (sigma {sigma_px:.2} px), residuals of {here:.2} px rms, {there:.2} px there",
        (kind.moved)(evaluation),
        evaluation.chi2(sigma_px),
    );
    Some((expected, found))
}

fn unseen<const N: usize>(
    kind: &Kind<N>,
    ids: &[i64],
    observed: &Seen<N>,
    measured: &Seen<N>,
    findings: &mut Findings,
) {
    if observed.outcome.rows + measured.outcome.rows == 0 {
        return;
    }
    let shown = |seen: &Seen<N>, place: usize| seen.shown.get(place).copied().unwrap_or(false);
    for (place, id) in ids.iter().enumerate() {
        if !shown(observed, place) && !shown(measured, place) {
            findings.add(RuleId::LandmarkSeen, Some(kind.table), || {
                Detail::new("a row that shows it", "none").id(format!("{} {id}", kind.word))
            });
        }
    }
}

/// Reports noise-free rows that are not where their landmark is; where the landmark is wrong, that was said.
fn astray<const N: usize>(
    kind: &Kind<N>,
    ids: &[i64],
    observed: &mut Seen<N>,
    wrong: &[bool],
    findings: &mut Findings,
) {
    let mut listed: Vec<_> = observed
        .astray
        .drain()
        .filter(|(place, _)| !wrong.get(*place as usize).copied().unwrap_or(false))
        .collect();
    listed.sort_by_key(|(place, astray)| (astray.row, *place));
    for (place, astray) in listed {
        findings.add_many(kind.reprojects, Some(kind.observations), astray.count, || {
            let id = ids.get(place as usize).map_or_else(String::new, |id| format!("{} {id}", kind.word));
            let more = if astray.count > 1 {
                format!(", the first of {} rows", astray.count)
            } else {
                String::new()
            };
            Detail::new(astray.expected, format!("{}{more}", astray.found)).row(astray.row).id(id)
        });
    }
}

fn noise<const N: usize>(
    kind: &Kind<N>,
    measured: &mut Seen<N>,
    evaluations: &[Option<Evaluation<N>>],
    common: Option<f64>,
    wrong: &[bool],
    declared: &Declared,
    findings: &mut Findings,
) {
    let sigma = common.unwrap_or(0.0).max(CLEAN_SIGMA_PX);
    measured.sample.keep(|place| {
        !wrong[place]
            && evaluations[place].as_ref().is_some_and(|found| {
                declared.roundings_agree() || found.excess <= CLEAN_EXCESS * sigma * sigma
            })
    });
    let sample = &measured.sample;
    // The distances of a segment's two ends are of one kind; u and v of a point may differ.
    let found: Vec<(&str, Found)> = if N == 3 {
        let axis = |name: &'static str, index: usize| {
            robust_sigma(sample.column(|row| row.pixels[index])).map(|found| (name, found))
        };
        axis("u", 0).into_iter().chain(axis("v", 1)).collect()
    } else {
        let ends = [0, 1].into_iter().flat_map(|index| sample.column(|row| row.pixels[index])).collect();
        robust_sigma(ends).map(|found| ("distances", found)).into_iter().collect()
    };
    let freedom: f64 = evaluations.iter().flatten().map(|found| found.freedom).sum();
    if found.is_empty() && N == 3 && freedom >= LEAST_FREEDOM {
        // No point is where it claims to be; what their rows agree on is noise all the same.
        if let Some(sigma) = common {
            let count = evaluations.iter().flatten().map(|found| 2 * found.rows as usize).sum();
            let found = Found { sigma, standard_error: 1.6 * sigma / freedom.sqrt(), count };
            judge_pixels(&[("u and v", found)], declared, kind.measurements, findings);
        }
    }
    judge_pixels(&found, declared, kind.measurements, findings);
    let depths = [0, 1].into_iter().flat_map(|index| sample.column(|row| row.depths[index])).collect();
    judge_depth(depths, declared, kind.measurements, findings);
    let right = measured.fits.iter().zip(wrong).filter(|(_, wrong)| !**wrong);
    let (wild, rows) = right.fold((0, 0), |(wild, rows), (fit, _)| {
        (wild + u64::from(fit.wild), rows + u64::from(fit.wild) + u64::from(fit.rows))
    });
    judge_outliers(wild, rows, declared, kind.measurements, findings);
}
