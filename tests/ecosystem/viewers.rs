//! Viewers' channels in cases that need no other tool.

use std::fs;
use std::path::Path;

use foxglove::Decode;
use foxglove::messages::{FrameTransform, ImageAnnotations, PosesInFrame};
use open_structure::format::{self, FrameRows, SequenceWriter, WriteOptions};
use open_structure::structure::*;

use crate::sample;

const OPTIONS: WriteOptions = WriteOptions { force: false, encoding: None, foxglove: true };

/// Messages of a topic, in order.
fn messages<M: Decode<Error: std::fmt::Debug>>(path: &Path, topic: &str) -> Vec<M> {
    let bytes = fs::read(path).unwrap();
    mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|message| message.channel.topic == topic)
        .map(|message| M::decode(&*message.data).unwrap())
        .collect()
}

#[test]
fn frames_that_a_writer_passes_over_are_shown_too() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, streamed) = (folder.path().join("whole.mcap"), folder.path().join("streamed.mcap"));
    let mut sequence = sample::sequence(sample::CAMERAS);
    sequence.line_observations.clear();
    sequence.line_measurements.clear();
    sequence.point_observations.clear();
    format::write(&whole, &sequence, OPTIONS).unwrap();

    let mut writer =
        SequenceWriter::create(&streamed, &sequence.manifest, &sequence.frames, OPTIONS).unwrap();
    writer.append(&sequence.structural_groups).unwrap();
    for rows in sequence.point_measurements.chunk_by(|left, right| left.frame_id == right.frame_id) {
        let rows = FrameRows { point_measurements: rows, ..FrameRows::default() };
        writer.append_frame(rows.point_measurements[0].frame_id, rows).unwrap();
    }
    writer.finish().unwrap();

    // The frame in the middle that shows nothing and the last one are of the second camera.
    for (camera, blank) in [("camera_0", 0), ("camera_1", 2)] {
        let topic = format!("/foxglove/{camera}/annotations");
        let shown: Vec<ImageAnnotations> = messages(&streamed, &topic);
        assert_eq!(shown, messages::<ImageAnnotations>(&whole, &topic));
        assert_eq!(shown.len(), 4);
        assert_eq!(shown.iter().filter(|message| message.points.is_empty()).count(), blank, "{camera}");
        let topic = format!("/foxglove/{camera}/transform");
        assert_eq!(messages::<FrameTransform>(&streamed, &topic), messages::<FrameTransform>(&whole, &topic));
    }
}

#[test]
fn without_any_truth_the_camera_moves_along_the_first_estimate() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("estimated.mcap");
    let mut sequence = sample::sequence(sample::CAMERAS);
    for frame in &mut sequence.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    format::write(&path, &sequence, OPTIONS).unwrap();
    assert!(messages::<PosesInFrame>(&path, "/foxglove/camera_0/true_trajectory").is_empty());
    let estimated: Vec<PosesInFrame> =
        messages(&path, "/foxglove/camera_0/estimated_trajectory/map-to-frame");
    let transforms: Vec<FrameTransform> = messages(&path, "/foxglove/camera_0/transform");
    assert_eq!(transforms.len(), 4);
    for (pose, transform) in estimated[0].poses.iter().zip(&transforms) {
        assert_eq!((pose.position, pose.orientation), (transform.translation, transform.rotation));
    }
}

#[test]
fn the_layout_asks_for_topics_that_a_file_has() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("show.mcap");
    let mut sequence = sample::sequence(sample::CAMERAS);
    // Every estimate that `os track` and `os adjust` name themselves.
    let usual = ["map-to-frame", "frame-to-frame", "point-ba", "point-line-ba", "structural-ba"];
    let named = |name: &str| name.to_owned();
    let (trajectories, points, lines) =
        (sequence.trajectories.clone(), sequence.map_points.clone(), sequence.map_lines.clone());
    for name in usual {
        let estimate = named(name);
        sequence.trajectories.extend(
            trajectories.iter().cloned().map(|row| TrajectoryPose { estimate: estimate.clone(), ..row }),
        );
        sequence
            .map_points
            .extend(points.iter().cloned().map(|row| MapPoint { estimate: estimate.clone(), ..row }));
        sequence
            .map_lines
            .extend(lines.iter().cloned().map(|row| MapLine { estimate: estimate.clone(), ..row }));
    }
    sequence.sort();
    sequence
        .trajectories
        .dedup_by(|left, right| (&left.estimate, left.frame_id) == (&right.estimate, right.frame_id));
    sequence
        .map_points
        .dedup_by(|left, right| (&left.estimate, left.point_id) == (&right.estimate, right.point_id));
    sequence
        .map_lines
        .dedup_by(|left, right| (&left.estimate, left.line_id) == (&right.estimate, right.line_id));
    format::write(&path, &sequence, OPTIONS).unwrap();
    let bytes = fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let topics: Vec<&str> = summary.channels.values().map(|channel| channel.topic.as_str()).collect();

    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/lichtblick-layout.json");
    let layout: serde_json::Value = serde_json::from_str(&fs::read_to_string(layout).unwrap()).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let scene = panels["3D!scene"]["topics"].as_object().unwrap();
    let image = &panels["Image!measurements"]["imageMode"];
    let mut asked: Vec<&str> = scene.keys().map(String::as_str).collect();
    asked.push(image["calibrationTopic"].as_str().unwrap());
    asked.extend(image["annotations"].as_object().unwrap().keys().map(String::as_str));
    let mut plotted = 0;
    for plot in panels.iter().filter(|(id, _)| id.starts_with("Plot!")).map(|(_, plot)| plot) {
        for series in plot["paths"].as_array().unwrap() {
            // A message path: the topic, then members of its message.
            asked.push(series["value"].as_str().unwrap().split('.').next().unwrap());
            plotted += 1;
        }
    }
    assert_eq!((plotted, scene.len()), (7, 19));
    for topic in asked {
        assert!(topics.contains(&topic), "{topic}: {topics:?}");
    }
    // Every panel that is placed has its settings.
    let placed = layout["layout"].to_string();
    assert!(panels.keys().all(|id| placed.contains(id.as_str())), "{placed}");
}

#[test]
fn rows_that_cannot_be_shown_do_not_hinder_writing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strange.mcap");
    let mut sequence = sample::sequence(sample::CAMERAS);
    sequence.manifest.cameras.truncate(1);
    sequence.frames[0].world_from_camera_qx = Some(f64::NAN);
    sequence.trajectories[0].world_from_camera_tx = f64::INFINITY;
    sequence.point_landmarks[0].x = f64::MAX;
    sequence.frames[7].stamp_nanos = i64::MAX;
    sequence.structural_groups.clear();
    format::write(&path, &sequence, OPTIONS).unwrap();
    assert_eq!(messages::<FrameTransform>(&path, "/foxglove/camera_0/transform").len(), 3);
    assert!(messages::<ImageAnnotations>(&path, "/foxglove/camera_1/annotations").is_empty());
    assert_eq!(format::read(&path).unwrap().point_landmarks, sequence.point_landmarks);
}
