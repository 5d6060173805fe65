//! Defects that only all rows together show.

use std::collections::BTreeSet;

use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::geometry::Segment;
use crate::structure::*;
use crate::validate::validate_sequence;

fn turned(line: &LineLandmark, degrees: f64) -> LineLandmark {
    let segment = line.segment();
    let middle = segment.midpoint();
    let axis = segment.direction().unwrap().cross(&Vector3::z()).normalize();
    let turn = UnitQuaternion::from_scaled_axis(axis * degrees.to_radians());
    let [start, end] = [segment.start, segment.end].map(|end| middle + turn * (end - middle));
    LineLandmark::from_segment(line.line_id, &Segment { start, end }).unwrap()
}

#[test]
fn one_observation_that_is_astray_is_named() {
    let report = breaks_only("point-observations-reproject", |s| s.point_observations[77].u += 3.0);
    assert_eq!((report.findings[0].row, report.findings[0].count), (Some(77), 1));
    assert!(report.findings[0].found.contains("3.000 px away"), "{}", report.findings[0].found);
    breaks_only("point-observations-reproject", |s| {
        s.point_observations[77].depth = s.point_observations[77].depth.map(|depth| depth * 1.05);
    });
    breaks_only("line-observations-reproject", |s| s.line_observations[77].start_u += 3.0);
}

#[test]
fn noise_that_is_not_the_declared_one_is_told_from_wrong_landmarks() {
    for (sigma_px, sigma_depth) in [(0.5, 0.05), (1.5, 0.05), (1.0, 0.08), (1.0, 0.02)] {
        let sequence = good::noisy(sigma_px, sigma_depth);
        let report = validate_sequence(&sequence, &Options::default());
        assert_eq!(names(&report), BTreeSet::from(["noise-agrees"]), "{:#?}", report.findings);
    }
    for (sigma_px, sigma_depth) in [(1.04, 0.05), (0.96, 0.051), (1.0, 0.048)] {
        assert_eq!(broken(&good::noisy(sigma_px, sigma_depth)), BTreeSet::new());
    }
}

#[test]
fn noise_in_one_direction_alone_is_found() {
    let report = breaks_only("noise-agrees", |s| {
        let mut noise = good::Noise::new(5);
        s.point_measurements.iter_mut().for_each(|row| row.v += 1.2 * noise.normal());
        good::refresh(s);
    });
    let finding = &report.findings[0];
    assert!(finding.found.contains("u 0.979 px") && finding.found.contains("v 1.5"), "{}", finding.found);
    assert!(finding.expected.contains("sigma of 1 px"), "{}", finding.expected);
}

#[test]
fn measurements_without_noise_are_mentioned() {
    let mut sequence = good::noisy(0.0, 0.0);
    sequence.manifest.noise = Some(Noise {
        model: registry::NOISE_NONE.to_owned(),
        seed: None,
        parameters: std::collections::BTreeMap::new(),
    });
    let report = validate_sequence(&sequence, &Options::default());
    assert!(report.conformant && report.findings.is_empty(), "{:#?}", report.findings);
    assert_eq!(advised(&report), BTreeSet::from(["measurements-noisy"]));

    let declared = validate_sequence(&good::noisy(0.0, 0.0), &Options::default());
    assert_eq!(names(&declared), BTreeSet::from(["noise-agrees"]));
    assert_eq!(advised(&declared), BTreeSet::from(["measurements-noisy"]));
}

#[test]
fn a_landmark_that_is_not_where_it_claims_to_be_is_found() {
    let report = breaks_only("point-landmarks-triangulate", |s| s.point_landmarks[7].x += 0.02);
    assert_eq!(report.findings.len(), 1);
    assert_eq!(report.findings[0].id.as_deref(), Some("point 21"));
    assert!(report.findings[0].found.contains("about 0.02"), "{}", report.findings[0].found);
    // Noisy rows alone find it too.
    breaks_only("point-landmarks-triangulate", |s| {
        s.point_landmarks[7].x += 0.02;
        s.point_observations.clear();
        good::refresh(s);
    });
    breaks_only("line-landmarks-triangulate", |s| {
        s.structural_groups.clear();
        s.line_landmarks[7] = turned(&s.line_landmarks[7], 3.0);
        good::refresh(s);
    });
}

#[test]
fn when_every_landmark_is_an_estimate_the_noise_is_not_accused() {
    let mut sequence = good::sequence();
    sequence.point_observations.clear();
    let mut noise = good::Noise::new(11);
    for landmark in &mut sequence.point_landmarks {
        landmark.x += 0.03 * noise.normal();
        landmark.y += 0.03 * noise.normal();
        landmark.z += 0.03 * noise.normal();
    }
    good::refresh(&mut sequence);
    let report = validate_sequence(&sequence, &Options::default());
    assert_eq!(names(&report), BTreeSet::from(["point-landmarks-triangulate"]), "{:#?}", report.findings);
    assert!(report.count(Severity::Error) > 50, "{}", report.count(Severity::Error));
}

#[test]
fn a_landmark_behind_its_cameras_is_found() {
    breaks_only("point-landmarks-triangulate", |s| s.point_landmarks[7].z = -20.0);
}

#[test]
fn one_wild_measurement_does_not_speak_against_its_landmark() {
    let mut sequence = good::sequence();
    sequence.point_measurements[7].u = 20.0;
    good::refresh(&mut sequence);
    assert_eq!(broken(&sequence), BTreeSet::new());
}

#[test]
fn few_rows_say_nothing() {
    let mut sequence = good::sequence();
    let frames = [FrameId(0), FrameId(4)];
    sequence.point_measurements.retain(|row| frames.contains(&row.frame_id) && row.point_id.0 < 30);
    sequence.line_measurements.clear();
    sequence.point_observations.clear();
    sequence.line_observations.clear();
    sequence.graph_factors.clear();
    sequence.point_measurements.iter_mut().for_each(|row| row.u += 3.0);
    good::refresh(&mut sequence);
    assert_eq!(broken(&sequence), BTreeSet::new());
}

#[test]
fn without_truth_nothing_is_held_against_it() {
    let mut sequence = good::noisy(5.0, 0.5);
    for frame in &mut sequence.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    assert!(broken(&sequence).contains("frame-statistics-agree"), "the motion is known but not the poses");
    good::refresh(&mut sequence);
    assert!(broken(&sequence).is_subset(&BTreeSet::from(["pixel-in-image", "depth-positive"])));
}
