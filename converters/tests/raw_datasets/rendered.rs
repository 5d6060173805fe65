//! Rendered sequences: what is read is what was simulated.

use std::fs;

use nalgebra::Point2;
use open_structure::geometry::Pose;
use open_structure::simulate::render::Layout;
use open_structure::structure::{FrameId, registry};
use open_structure_converters::rgbd::{GivenCamera, OpenOptions, icl, tartanair, tum};
use opencv::core::{Mat, Vec4b, Vector};
use opencv::imgcodecs;
use opencv::prelude::*;

use super::room::{LAYOUTS, distance, edit, open, rendered};

/// From the world of a layout to that of the scene: TartanAir's is north-east-down, half a turn about x.
fn scene_from_world(layout: Layout) -> Pose {
    let rotation_xyzw = if layout == Layout::TartanAir { [1.0, 0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.0, 1.0] };
    Pose::from_components([0.0; 3], rotation_xyzw).unwrap()
}

#[test]
fn poses_and_camera_are_those_of_the_simulation() {
    for layout in LAYOUTS {
        let (simulation, folder) = rendered(layout);
        let sequence = open(layout, folder.path(), &OpenOptions::default()).unwrap();
        assert_eq!((sequence.frames.len(), sequence.excluded.len()), (5, 0), "{layout:?}");
        let expected = &simulation.manifest().cameras[0];
        assert_eq!(sequence.camera.projection(), expected.projection(), "{layout:?}");
        assert_eq!(sequence.camera.axes, expected.axes);
        assert!(sequence.lens.is_none());
        for (frame, expected) in sequence.frames.iter().zip(simulation.frames()) {
            let pose = scene_from_world(layout) * frame.world_from_camera;
            let difference = expected.world_from_camera().unwrap().pose().unwrap().inverse() * pose;
            // All digits are written; the ray tracer's words and the turns round a few times.
            let (turn, shift) = (difference.rotation_angle(), difference.translation().norm());
            assert!(turn < 1e-7 && shift < 1e-12, "{layout:?} {}: {turn} rad, {shift} m", frame.frame_id);
        }
        let ids: Vec<FrameId> = sequence.frames.iter().map(|frame| frame.frame_id).collect();
        assert_eq!(ids, (0..5).map(FrameId).collect::<Vec<_>>());
        let recorded = layout == Layout::Tum;
        assert_eq!(sequence.clock.kind, if recorded { registry::RECORDED } else { registry::SYNTHETIC });
        assert!(sequence.frames.windows(2).all(|pair| pair[0].stamp_nanos < pair[1].stamp_nanos));
    }
}

#[test]
fn depth_maps_lie_on_the_scene() {
    for layout in LAYOUTS {
        let (_, folder) = rendered(layout);
        let sequence = open(layout, folder.path(), &OpenOptions::default()).unwrap();
        let raster = sequence.raster();
        for frame in &sequence.frames {
            let images = sequence.images(frame).unwrap();
            assert_eq!(
                (images.grey.cols(), images.grey.rows(), images.grey.typ()),
                (80, 60, opencv::core::CV_8UC1)
            );
            let scene_from_camera = scene_from_world(layout) * frame.world_from_camera;
            let mut seen = 0;
            for (row, column) in (0..60_i64).flat_map(|row| (0..80_i64).map(move |column| (row, column))) {
                let Some(depth_m) = images.depth.at(column, row) else { continue };
                let pixel = Point2::new(column as f64, row as f64);
                let point = scene_from_camera * raster.back_project(pixel, depth_m).unwrap();
                // Half a step of the file, along a ray that is longer than its depth.
                let tolerance = match layout {
                    Layout::Tum | Layout::Icl => 1e-4 * 1.5 + 1e-9,
                    Layout::IclOriginal | Layout::TartanAir => 2e-6,
                };
                assert!(distance(point) < tolerance, "{layout:?} {column} {row}: {} m", distance(point));
                seen += 1;
            }
            // A Kinect does not see beyond 5 m, across the room.
            let least = if layout == Layout::Tum { 0.4 } else { 1.0 };
            assert!(f64::from(seen) >= least * 4800.0, "{layout:?}: {seen}");
        }
    }
}

#[test]
fn frames_and_stride_choose_by_id() {
    for layout in LAYOUTS {
        let (_, folder) = rendered(layout);
        let options = OpenOptions { frames: 1..5, stride: 2, ..OpenOptions::default() };
        let sequence = open(layout, folder.path(), &options).unwrap();
        let ids: Vec<i64> = sequence.frames.iter().map(|frame| frame.frame_id.0).collect();
        assert_eq!(ids, [1, 3], "{layout:?}");
        let options = OpenOptions { frames: 9..12, ..OpenOptions::default() };
        let error = open(layout, folder.path(), &options).unwrap_err().to_string();
        assert!(error.contains("expected at least one frame"), "{error}");
    }
}

#[test]
fn a_missing_file_changes_no_other_frame() {
    for (layout, name) in [
        (Layout::Tum, "rgb/0.066667.png"),
        (Layout::Tum, "depth/0.066667.png"),
        (Layout::Icl, "rgb/2.png"),
        (Layout::IclOriginal, "scene_00_0002.depth"),
        (Layout::TartanAir, "depth_left/000002_left_depth.npy"),
    ] {
        let (_, folder) = rendered(layout);
        let whole = open(layout, folder.path(), &OpenOptions::default()).unwrap();
        fs::remove_file(folder.path().join(name)).unwrap();
        let part = open(layout, folder.path(), &OpenOptions::default()).unwrap();
        let expected: Vec<_> = whole.frames.iter().filter(|frame| frame.frame_id.0 != 2).cloned().collect();
        assert_eq!(part.frames, expected, "{name}");
        assert_eq!(part.excluded.iter().map(|found| found.count).collect::<Vec<_>>(), [1], "{name}");
    }
}

#[test]
fn the_given_camera_goes_before_the_files() {
    let (_, folder) = rendered(Layout::Tum);
    let given = GivenCamera { fx: 70.0, fy: 71.0, cx: 40.0, cy: 31.0, size: Some([80, 60]) };
    let options = OpenOptions { camera: Some(given), ..OpenOptions::default() };
    let sequence = tum::open(folder.path(), &options).unwrap();
    assert_eq!((sequence.camera.fx, sequence.camera.cy, sequence.camera.width), (70.0, 31.0, 80));
    let options = OpenOptions { camera: Some(GivenCamera { fx: -1.0, ..given }), ..OpenOptions::default() };
    let error = tum::open(folder.path(), &options).unwrap_err().to_string();
    assert!(error.starts_with("camera: expected"), "{error}");
}

#[test]
fn a_folder_with_nothing_else_in_it_is_gone_down() {
    for layout in LAYOUTS {
        let (_, folder) = rendered(layout);
        let above = tempfile::tempdir().unwrap();
        let below = above.path().join("one/two");
        fs::create_dir_all(below.parent().unwrap()).unwrap();
        fs::rename(folder.path(), &below).unwrap();
        let sequence = open(layout, above.path(), &OpenOptions::default()).unwrap();
        assert_eq!((sequence.name.as_str(), sequence.frames.len()), ("two", 5));
    }
}

#[test]
fn poses_between_those_that_are_listed_are_interpolated() {
    let (simulation, folder) = rendered(Layout::Tum);
    // The second of five is gone, 67 ms between its neighbours.
    edit(&folder.path().join("groundtruth.txt"), |text| {
        text.lines().filter(|line| !line.starts_with("0.033333")).map(|line| format!("{line}\n")).collect()
    });
    let sequence = tum::open(folder.path(), &OpenOptions::default()).unwrap();
    assert_eq!(sequence.frames.len(), 5);
    let poses =
        [0, 1, 2].map(|index| simulation.frames()[index].world_from_camera().unwrap().pose().unwrap());
    let found = sequence.frames[1].world_from_camera;
    let expected = poses[0].interpolate(&poses[2], 33_333.0 / 66_667.0);
    assert_eq!(found, expected);
    // A smooth path is nearly straight over a fifteenth of a second.
    assert!((found.translation() - poses[1].translation()).norm() < 0.02);
    let short = OpenOptions { longest_gap_nanos: 60_000_000, ..OpenOptions::default() };
    let sequence = tum::open(folder.path(), &short).unwrap();
    assert_eq!(sequence.frames.len(), 4);
    assert_eq!(sequence.excluded[0].reason, "images without a true pose around their time");
}

#[test]
fn stamps_are_paired_within_the_tolerance() {
    let (_, folder) = rendered(Layout::Tum);
    let later = |by: &str| {
        let list = "depth.txt";
        edit(&folder.path().join(list), |text| text.replace("\n0.066667 ", &format!("\n{by} ")));
    };
    later("0.086667");
    assert_eq!(tum::open(folder.path(), &OpenOptions::default()).unwrap().frames.len(), 5);
    let strict = OpenOptions { max_stamp_difference_nanos: 19_999_999, ..OpenOptions::default() };
    let sequence = tum::open(folder.path(), &strict).unwrap();
    assert_eq!(sequence.frames.len(), 4);
    assert_eq!(sequence.excluded[0].reason, "images without a depth map at about the same time");
}

#[test]
fn icl_without_a_list_goes_by_numbers() {
    let (_, folder) = rendered(Layout::Icl);
    let listed = icl::open(folder.path(), &OpenOptions::default()).unwrap();
    fs::remove_file(folder.path().join("associations.txt")).unwrap();
    assert_eq!(icl::open(folder.path(), &OpenOptions::default()).unwrap().frames, listed.frames);
    // As published: images from 0 on, poses from 1 on to the last but one.
    edit(&folder.path().join("room.gt.freiburg"), |text| {
        text.lines()
            .filter(|line| !line.starts_with('0') && !line.starts_with('4'))
            .map(|line| format!("{line}\n"))
            .collect()
    });
    let sequence = icl::open(folder.path(), &OpenOptions::default()).unwrap();
    assert_eq!(sequence.frames, listed.frames[1..4]);
    assert_eq!(sequence.excluded[0].count, 2);
}

#[test]
fn icl_lists_may_name_the_picture_first() {
    let (_, folder) = rendered(Layout::Icl);
    let expected = icl::open(folder.path(), &OpenOptions::default()).unwrap();
    edit(&folder.path().join("associations.txt"), |text| {
        let swap = |line: &str| {
            let fields: Vec<&str> = line.split(' ').collect();
            format!("{}.000000 {} {}.000000 {}\r\n", fields[2], fields[3], fields[0], fields[1])
        };
        text.lines().map(swap).collect()
    });
    assert_eq!(icl::open(folder.path(), &OpenOptions::default()).unwrap().frames, expected.frames);
}

#[test]
fn the_office_of_icl_is_in_centimetres() {
    let (_, folder) = rendered(Layout::IclOriginal);
    let metres = icl::open(folder.path(), &OpenOptions::default()).unwrap();
    let office = tempfile::tempdir().unwrap();
    for number in 0..5 {
        let (from, to) = (format!("scene_00_{number:04}"), format!("scene_{number:03}"));
        let copy = |ending: &str| {
            let (from, to) = (format!("{from}.{ending}"), format!("{to}.{ending}"));
            fs::copy(folder.path().join(from), office.path().join(&to)).unwrap();
            office.path().join(to)
        };
        copy("png");
        edit(&copy("depth"), |text| {
            let hundredfold = |word: &str| format!("{:.4} ", word.parse::<f64>().unwrap() * 100.0);
            text.split_whitespace().map(hundredfold).collect()
        });
        edit(&copy("txt"), |text| {
            let hundredfold = |line: &str| {
                let Some(list) =
                    line.strip_prefix("cam_pos      = [").and_then(|rest| rest.strip_suffix("]';"))
                else {
                    return format!("{line}\n");
                };
                let numbers =
                    list.split(", ").map(|number| (number.parse::<f64>().unwrap() * 100.0).to_string());
                format!("cam_pos      = [{}]';\n", numbers.collect::<Vec<_>>().join(", "))
            };
            text.lines().map(hundredfold).collect()
        });
    }
    fs::copy(folder.path().join("calibration.txt"), office.path().join("calibration.txt")).unwrap();
    let sequence = icl::open(office.path(), &OpenOptions::default()).unwrap();
    for (found, expected) in sequence.frames.iter().zip(&metres.frames) {
        let shift = found.world_from_camera.translation() - expected.world_from_camera.translation();
        assert!(shift.norm() < 1e-12, "{shift}");
        let (found, expected) = (sequence.depth(found).unwrap(), metres.depth(expected).unwrap());
        for (column, row) in [(0, 0), (40, 30), (79, 59)] {
            let difference = found.at(column, row).unwrap() - expected.at(column, row).unwrap();
            // Digits of the text, and of 32-bit numbers.
            assert!(difference.abs() < 3e-6, "{difference}");
        }
    }
}

#[test]
fn tartanair_v2_has_the_same_frames_in_other_files() {
    let (_, folder) = rendered(Layout::TartanAir);
    let first = tartanair::open(folder.path(), &OpenOptions::default()).unwrap();
    let second = tempfile::tempdir().unwrap();
    for name in ["image_lcam_front", "depth_lcam_front"] {
        fs::create_dir(second.path().join(name)).unwrap();
    }
    fs::copy(folder.path().join("pose_left.txt"), second.path().join("pose_lcam_front.txt")).unwrap();
    fs::copy(folder.path().join("calibration.txt"), second.path().join("calibration.txt")).unwrap();
    for (number, frame) in first.frames.iter().enumerate() {
        fs::copy(&frame.colour, second.path().join(format!("image_lcam_front/{number:06}_lcam_front.png")))
            .unwrap();
        let array = fs::read(&frame.depth).unwrap();
        let pixels: Vec<Vec4b> =
            array[128..].chunks_exact(4).map(|bytes| Vec4b::from_array(bytes.try_into().unwrap())).collect();
        let picture = Mat::new_rows_cols_with_data(60, 80, &pixels).unwrap();
        let path = second.path().join(format!("depth_lcam_front/{number:06}_lcam_front_depth.png"));
        assert!(imgcodecs::imwrite(path.to_str().unwrap(), &picture, &Vector::new()).unwrap());
    }
    let sequence = tartanair::open(second.path(), &OpenOptions::default()).unwrap();
    for (found, expected) in sequence.frames.iter().zip(&first.frames) {
        assert_eq!(found.world_from_camera, expected.world_from_camera);
        let (found, expected) = (sequence.depth(found).unwrap(), first.depth(expected).unwrap());
        let all = (0..60).flat_map(|row| (0..80).map(move |column| (column, row)));
        assert!(all.clone().all(|(column, row)| found.at(column, row) == expected.at(column, row)));
        assert!(found.coverage() > 0.99);
    }
    // Without a calibration the camera is that of the version.
    fs::remove_file(second.path().join("calibration.txt")).unwrap();
    let camera = tartanair::open(second.path(), &OpenOptions::default()).unwrap().camera;
    assert_eq!(
        (camera.width, camera.height, camera.fx, camera.cx, camera.cy),
        (640, 640, 320.0, 320.0, 320.0)
    );
}

#[test]
fn what_is_farther_than_is_believed_has_no_depth() {
    let (_, folder) = rendered(Layout::TartanAir);
    let path = folder.path().join("depth_left/000000_left_depth.npy");
    let mut bytes = fs::read(&path).unwrap();
    for (pixel, depth) in
        [65504.0_f32, 51.0, 49.0, 0.05, f32::NAN, f32::INFINITY, -1.0].into_iter().enumerate()
    {
        bytes[128 + 4 * pixel..132 + 4 * pixel].copy_from_slice(&depth.to_le_bytes());
    }
    fs::write(path, bytes).unwrap();
    let sequence = tartanair::open(folder.path(), &OpenOptions::default()).unwrap();
    let map = sequence.depth(&sequence.frames[0]).unwrap();
    let found: Vec<Option<f64>> = (0..7).map(|column| map.at(column, 0)).collect();
    assert_eq!(found, [None, None, Some(49.0), None, None, None, None]);
}
