//! Landmarks: where they claim to be, and whether the three forms of a line say the same.

use nalgebra::{Point3, Vector3};

use super::finding::{Detail, Findings};
use super::ids::IdIndex;
use super::rules::RuleId;
use super::tables::{Outcome, Shared, check};
use crate::geometry::{OrthonormalLine, PluckerLine, Segment};
use crate::structure::{LineLandmark, PointLandmark};

/// Largest angle between the forms of a line, radians.
const FORM_ANGLE: f64 = 1e-9;
/// Largest distance between the forms of a line, metres, times its distance from the origin where that is over 1 m.
const FORM_DISTANCE: f64 = 1e-9;
/// Largest deviation of a direction's length from one, and of moment · direction from zero (over |moment| or 1 m).
const PLUCKER_TOLERANCE: f64 = 1e-9;

/// Landmarks by id.
#[derive(Clone, Debug)]
pub(crate) struct Landmarks<T> {
    pub(crate) index: IdIndex,
    pub(crate) places: Vec<T>,
}

impl<T> Landmarks<T> {
    fn new(mut rows: Vec<(i64, T)>) -> Self {
        rows.sort_by_key(|(id, _)| *id);
        rows.dedup_by_key(|(id, _)| *id);
        let (ids, places) = rows.into_iter().unzip();
        Self { index: IdIndex::new(ids), places }
    }
}

/// A line landmark, as the other checks need it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LineEntry {
    /// Middle of the segment, metres in `world`.
    pub(crate) middle: Point3<f64>,
    /// Unit direction; `None` when the ends coincide.
    pub(crate) direction: Option<Vector3<f64>>,
    /// Half the distance of the ends, metres.
    pub(crate) half_length: f64,
}

/// Reads the table `point_landmarks`.
pub(crate) fn points(shared: &Shared<'_>, findings: &mut Findings) -> (Landmarks<Point3<f64>>, Outcome) {
    let mut rows = Vec::new();
    let outcome = check::<PointLandmark>(shared, findings, |batch, _, _, _| {
        rows.extend(batch.iter().map(|row| (row.point_id.0, row.position())));
    });
    (Landmarks::new(rows), outcome)
}

/// Reads the table `line_landmarks` and holds the forms of each line against each other.
pub(crate) fn lines(shared: &Shared<'_>, findings: &mut Findings) -> (Landmarks<LineEntry>, Outcome) {
    let mut rows = Vec::new();
    let outcome = check::<LineLandmark>(shared, findings, |batch, first_row, _, findings| {
        for (row, line) in (first_row..).zip(batch) {
            forms(line, row, findings);
            let segment = line.segment();
            let entry = LineEntry {
                middle: segment.midpoint(),
                direction: segment.direction(),
                half_length: 0.5 * segment.length(),
            };
            rows.push((line.line_id.0, entry));
        }
    });
    (Landmarks::new(rows), outcome)
}

fn forms(line: &LineLandmark, row: u64, findings: &mut Findings) {
    const TABLE: Option<&str> = Some("line_landmarks");
    let (segment, plucker, orthonormal) = (line.segment(), line.plucker(), line.orthonormal());
    let numbers =
        [segment.start.coords, segment.end.coords, plucker.moment, plucker.direction, orthonormal.phi];
    if !(numbers.iter().all(|vector| vector.iter().all(|number| number.is_finite()))
        && orthonormal.varphi.is_finite())
    {
        return;
    }
    let length = plucker.direction.norm();
    let along = plucker.moment.dot(&plucker.direction);
    if (length - 1.0).abs() > PLUCKER_TOLERANCE {
        findings.add(RuleId::PluckerConstraint, TABLE, || {
            let expected = "a direction of length 1 within 1e-9";
            Detail::new(expected, format!("length {length:.12}")).row(row).id(line.line_id)
        });
    } else if along.abs() > PLUCKER_TOLERANCE * plucker.moment.norm().max(1.0) {
        findings.add(RuleId::PluckerConstraint, TABLE, || {
            let expected = "moment · direction = 0 m within 1e-9";
            Detail::new(expected, format!("{along:e} m")).row(row).id(line.line_id)
        });
    }
    let Ok(drawn) = segment.plucker() else {
        findings.add(RuleId::SegmentLength, TABLE, || {
            let start = segment.start;
            let found = format!("both at ({}, {}, {}) m", start.x, start.y, start.z);
            Detail::new("two different ends", found).row(row).id(line.line_id)
        });
        return;
    };
    if length < 0.5 {
        return;
    }
    // What breaks the constraint was said above; here both are made lines.
    let direction = plucker.direction / length;
    let moment = plucker.moment / length;
    let stored = PluckerLine { moment: moment - direction * direction.dot(&moment), direction };
    disagreement("Plücker", &drawn, &stored, &segment, line, row, findings);
    match OrthonormalLine::new(orthonormal.phi, orthonormal.varphi) {
        Ok(form) => disagreement("orthonormal", &drawn, &form.plucker(), &segment, line, row, findings),
        Err(error) => findings.add(RuleId::LineFormsAgree, TABLE, || {
            Detail::new("an orthonormal form in its range", error.to_string()).row(row).id(line.line_id)
        }),
    }
}

fn disagreement(
    name: &str,
    drawn: &PluckerLine,
    other: &PluckerLine,
    segment: &Segment,
    line: &LineLandmark,
    row: u64,
    findings: &mut Findings,
) {
    let angle = drawn.angle_to(other);
    let distance = other.distance_to_point(segment.midpoint());
    let scale = drawn.moment.norm().max(1.0);
    // A moment of many metres turns a rounded direction into a distance: the angle tells of that already.
    if angle > FORM_ANGLE || distance > FORM_DISTANCE * scale {
        findings.add(RuleId::LineFormsAgree, Some("line_landmarks"), || {
            let expected =
                format!("the {name} form of the line through its ends, within 1e-9 rad and 1e-9 m");
            let found = format!("{angle:.3e} rad and {distance:.3e} m from it");
            Detail::new(expected, found).row(row).id(line.line_id)
        });
    }
}
