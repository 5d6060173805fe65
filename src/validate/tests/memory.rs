//! One defect in memory, one rule.

use std::collections::BTreeSet;

use super::*;
use crate::structure::*;
use crate::validate::validate_sequence;

#[test]
fn a_good_sequence_breaks_no_rule() {
    let report = validate_sequence(&good::sequence(), &Options::default());
    assert!(report.conformant);
    assert_eq!(report.rules, [], "{:#?} {:#?}", report.findings, report.advice);
    assert!(report.rows_checked() > 5000);
    assert_eq!(report.rows["point_measurements"], 40 * 60);
}

#[test]
fn the_rules_of_the_manifest_are_told_apart() {
    breaks_only("manifest-version", |s| s.manifest.spec_version = "1.0".to_owned());
    breaks_only("manifest-name", |s| s.manifest.name = "a/b".to_owned());
    breaks_only("manifest-name", |s| s.manifest.name.clear());
    breaks_only("manifest-name", |s| s.manifest.name = "a\u{7}".to_owned());
    breaks_only("manifest-conventions", |s| s.manifest.conventions.pose = "camera_from_world".to_owned());
    breaks_only("cameras-valid", |s| s.manifest.cameras[0].fx = -1.0);
    breaks_only("cameras-valid", |s| s.manifest.cameras[0].width = 0);
    breaks_only("cameras-valid", |s| {
        (s.manifest.cameras[0].depth_min, s.manifest.cameras[0].depth_max) = (Some(3.0), Some(2.0));
    });
    breaks_only("cameras-valid", |s| s.manifest.cameras.push(s.manifest.cameras[0].clone()));
    breaks_only("camera-axes", |s| s.manifest.cameras[0].axes = registry::RIGHT_UP_FORWARD.to_owned());
    breaks_only("registry-closed", |s| s.manifest.cameras[0].axes = "ned".to_owned());
    breaks_only("registry-closed", |s| s.manifest.cameras[0].model = "fisheye".to_owned());
    breaks_only("registry-closed", |s| s.manifest.clock.kind = "gps".to_owned());
    breaks_only("noise-declared", |s| s.manifest.noise = None);
}

#[test]
fn another_major_version_is_not_judged() {
    let mut sequence = good::sequence();
    sequence.manifest.spec_version = "2.0.0".to_owned();
    sequence.frames.clear();
    assert_eq!(broken(&sequence), BTreeSet::from(["manifest-version"]));
}

#[test]
fn the_rules_of_all_tables_are_told_apart() {
    breaks_only("rows-ordered", |s| s.graph_points.swap(3, 4));
    breaks_only("keys-unique", |s| s.graph_points.insert(4, s.graph_points[3].clone()));
    breaks_only("ids-not-negative", |s| s.graph_factors[0].factor_id = -1);
    breaks_only("values-finite", |s| s.trajectories[7].world_from_camera_tx = f64::NAN);
    breaks_only("values-finite", |s| s.graph_factors[2].measurement[0] = f64::INFINITY);
    breaks_only("values-finite", |s| s.point_measurements[2].depth = Some(f64::NEG_INFINITY.abs()));
}

#[test]
fn a_key_that_comes_twice_is_found_in_a_table_out_of_order_too() {
    let mut sequence = good::sequence();
    let repeated = sequence.graph_points[3].clone();
    sequence.graph_points.push(repeated);
    assert_eq!(broken(&sequence), BTreeSet::from(["rows-ordered", "keys-unique"]));
}

#[test]
fn the_rules_of_frames_and_poses_are_told_apart() {
    breaks_only("stamps-ordered", |s| s.frames[3].stamp_nanos = 1);
    breaks_only("stamps-ordered", |s| s.frames[0].stamp_nanos = -1);
    breaks_only("camera-known", |s| s.frames[0].camera_id = CameraId(9));
    breaks_only("pose-whole", |s| s.frames[3].world_from_camera_qx = None);
    breaks_only("quaternion-unit", |s| s.trajectories[3].world_from_camera_qw *= 1.01);
    breaks_only("quaternion-unit", |s| s.graph_poses[3].world_from_camera_qw *= 1.01);
    breaks_only("quaternion-unit", |s| {
        let frame = &mut s.frames[3];
        for part in [
            &mut frame.world_from_camera_qx,
            &mut frame.world_from_camera_qy,
            &mut frame.world_from_camera_qz,
            &mut frame.world_from_camera_qw,
        ] {
            *part = part.map(|part| part * 1.002);
        }
    });
}

#[test]
fn four_decimals_of_a_quaternion_are_enough() {
    let mut sequence = good::sequence();
    for pose in &mut sequence.trajectories {
        pose.world_from_camera_qw = (pose.world_from_camera_qw * 1e4).round() / 1e4;
        pose.world_from_camera_qy = (pose.world_from_camera_qy * 1e4).round() / 1e4;
    }
    assert_eq!(broken(&sequence), BTreeSet::new());
}

#[test]
fn the_rules_of_references_are_told_apart() {
    breaks_only("frame-known", |s| s.trajectories[39].frame_id = FrameId(1000));
    breaks_only("frame-known", |s| {
        s.graph_poses.push(GraphPose::new(
            "x".to_owned(),
            FrameId(99),
            true,
            s.frames[0].world_from_camera().unwrap(),
        ));
    });
    let report = breaks_only("landmark-known", |s| {
        s.point_landmarks.retain(|row| row.point_id != PointId(30));
    });
    assert_eq!(report.count(Severity::Warning), 80, "40 observations and 40 measurements");
    assert_eq!(report.findings.len(), 2, "one for each table");
    assert_eq!(report.findings[0].id.as_deref(), Some("point 30"));
    breaks_only("correspondences-agree", |s| s.point_correspondences[5].rows[2] += 1);
    breaks_only("correspondences-agree", |s| {
        s.line_correspondences[5].rows.pop();
    });
    breaks_only("correspondences-agree", |s| {
        s.line_correspondences.remove(5);
    });
    breaks_only("correspondences-agree", |s| {
        let entry = &mut s.point_correspondences[7];
        entry.table = "point_measurement".to_owned();
        s.sort();
    });
    let mut sequence = good::sequence();
    sequence.line_correspondences.retain(|row| row.table == "line_measurements");
    assert_eq!(broken(&sequence), BTreeSet::new(), "a table that is not named is not held against anything");
}

#[test]
fn advice_has_no_part_in_conformance() {
    let mut sequence = good::sequence();
    let copy: Vec<TrajectoryPose> = sequence
        .trajectories
        .iter()
        .filter(|pose| pose.estimate == registry::POINT_BA)
        .map(|pose| TrajectoryPose { estimate: "another".to_owned(), ..pose.clone() })
        .collect();
    sequence.trajectories.extend(copy);
    sequence
        .point_landmarks
        .push(PointLandmark { point_id: PointId(5000), ..sequence.point_landmarks[0].clone() });
    sequence.manifest.source.licence = None;
    sequence.sort();
    let report = validate_sequence(&sequence, &Options::default());
    assert!(report.conformant && report.findings.is_empty(), "{:#?}", report.findings);
    let expected = ["estimates-distinct", "landmark-seen", "source-documented", "registry-open"];
    assert_eq!(advised(&report), BTreeSet::from(expected));
}

#[test]
fn the_rules_of_measurements_are_told_apart() {
    breaks_only("pixel-in-image", |s| {
        // Of a frame without true pose, so that only its place in the image speaks.
        s.frames[0] = Frame::new(FrameId(0), 0, CameraId(0), None);
        s.point_measurements[5].u = 646.0;
        good::refresh(s);
    });
    breaks_only("depth-positive", |s| s.point_measurements[5].depth = Some(0.0));
    breaks_only("depth-positive", |s| s.line_observations[5].end_depth = Some(-1.0));
    breaks_only("segment-pixels-distinct", |s| {
        let row = &mut s.line_measurements[5];
        (row.end_u, row.end_v) = (row.start_u, row.start_v);
        good::refresh(s);
    });
}

#[test]
fn the_rules_of_lines_and_groups_are_told_apart() {
    breaks_only("line-forms-agree", |s| s.line_landmarks[3].varphi += 1e-6);
    breaks_only("line-forms-agree", |s| s.line_landmarks[3].phi_x += 1e-6);
    breaks_only("line-forms-agree", |s| s.line_landmarks[3].varphi = -1.0);
    breaks_only("line-forms-agree", |s| {
        let other = s.line_landmarks[5].clone();
        let line = &mut s.line_landmarks[3];
        (line.moment_x, line.moment_y, line.moment_z) = (other.moment_x, other.moment_y, other.moment_z);
    });
    breaks_only("plucker-constraint", |s| {
        let line = &mut s.line_landmarks[3];
        line.moment_x += 1e-3 * line.direction_x;
        line.moment_y += 1e-3 * line.direction_y;
        line.moment_z += 1e-3 * line.direction_z;
    });
    breaks_only("segment-length", |s| {
        let line = &mut s.line_landmarks[3];
        (line.end_x, line.end_y, line.end_z) = (line.start_x, line.start_y, line.start_z);
    });
    breaks_only("group-lines-known", |s| {
        s.structural_groups[0].line_ids.push(LineId(100));
        good::refresh(s);
    });
    breaks_only("group-lines-unique", |s| {
        s.structural_groups[0].line_ids.swap(1, 2);
    });
    breaks_only("group-lines-unique", |s| {
        s.structural_groups.push(StructuralGroup {
            group_id: GroupId(7),
            kind: "parallel".to_owned(),
            ..StructuralGroup::default()
        });
    });
    breaks_only("group-lines-unique", |s| {
        let again = StructuralGroup { group_id: GroupId(7), ..s.structural_groups[0].clone() };
        s.structural_groups.push(again);
        good::refresh(s);
    });
    breaks_only("group-lines-parallel", |s| {
        s.structural_groups[1].line_ids = vec![LineId(1), LineId(3)];
        s.structural_groups[0].line_ids = vec![LineId(0), LineId(2), LineId(5)];
        good::refresh(s);
    });
    breaks_only("group-direction", |s| s.structural_groups[0].direction_y = None);
    breaks_only("group-direction", |s| {
        let group = &mut s.structural_groups[0];
        (group.direction_x, group.direction_y, group.direction_z) = (None, None, None);
    });
    breaks_only("group-direction", |s| {
        let group = &mut s.structural_groups[0];
        for part in [&mut group.direction_x, &mut group.direction_y, &mut group.direction_z] {
            *part = part.map(|part| part * 1.001);
        }
    });
}

#[test]
fn a_group_directed_the_other_way_is_parallel_all_the_same() {
    let mut sequence = good::sequence();
    let group = &mut sequence.structural_groups[0];
    for part in [&mut group.direction_x, &mut group.direction_y, &mut group.direction_z] {
        *part = part.map(|part| -part);
    }
    assert_eq!(broken(&sequence), BTreeSet::new());
}

#[test]
fn the_rules_of_graphs_are_told_apart() {
    breaks_only("graph-vertices-known", |s| {
        s.graph_points.remove(2);
    });
    breaks_only("graph-vertices-known", |s| {
        if let Some(factor) = s.graph_factors.last_mut() {
            factor.graph = "other".to_owned();
        }
    });
    breaks_only("graph-factor-shape", |s| {
        s.graph_factors[5].measurement.pop();
    });
    breaks_only("graph-factor-shape", |s| s.graph_factors[5].line_id = Some(LineId(1)));
    breaks_only("graph-factor-shape", |s| s.graph_factors[5].information = Some(vec![1.0, 1.0]));
    breaks_only("graph-information-positive", |s| s.graph_factors[5].information = Some(vec![1.0, 2.0, 1.0]));
}

#[test]
fn frame_statistics_are_held_against_what_frames_show() {
    breaks_only("frame-statistics-agree", |s| s.frame_statistics[3].occupied_cells += 1);
    breaks_only("frame-statistics-agree", |s| {
        s.frame_statistics[3].covered_cells = s.frame_statistics[3].covered_cells.map(|cells| cells + 1);
    });
    breaks_only("frame-statistics-agree", |s| {
        let angle = &mut s.frame_statistics[3].median_parallax_to_previous;
        *angle = angle.map(|angle| angle + 1e-5);
    });
    breaks_only("frame-statistics-agree", |s| s.frame_statistics[0].translation_since_previous = Some(0.0));
    breaks_only("frame-statistics-agree", |s| s.frame_statistics[3].structural_constraints -= 1);
    breaks_only("frame-statistics-agree", |s| {
        s.frame_statistics.remove(3);
    });
    let mut observed = good::sequence();
    observed.point_measurements.clear();
    good::refresh(&mut observed);
    assert_eq!(
        broken(&observed),
        BTreeSet::new(),
        "points counted where they are observed, lines where measured"
    );
}

#[test]
fn findings_are_listed_as_many_as_asked_for_and_counted_in_full() {
    let mut sequence = good::sequence();
    sequence.point_measurements.iter_mut().for_each(|row| row.depth = Some(-1.0));
    let report = validate_sequence(&sequence, &Options { listed: 3, ..Options::default() });
    let rule = report.rules.iter().find(|rule| rule.rule == "depth-positive").unwrap();
    assert_eq!((rule.count, rule.listed), (2400, 3));
    let rows: Vec<_> = report.findings.iter().filter(|f| f.rule == "depth-positive").map(|f| f.row).collect();
    assert_eq!(rows, [Some(0), Some(1), Some(2)]);
}

#[test]
fn the_number_of_threads_does_not_change_the_report() {
    let mut sequence = good::sequence();
    sequence.point_measurements.iter_mut().step_by(7).for_each(|row| row.u += 4.0);
    sequence.line_landmarks[3].varphi += 1e-6;
    let one = validate_sequence(&sequence, &Options { jobs: Some(1), ..Options::default() });
    let many = validate_sequence(&sequence, &Options { jobs: Some(5), ..Options::default() });
    assert!(!one.conformant);
    assert_eq!(one, many);
}
