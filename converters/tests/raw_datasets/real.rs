//! Real frames.
//!
//! They are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.

use std::path::{Path, PathBuf};

use nalgebra::Point2;
use open_structure::geometry::Pose;
use open_structure::structure::registry;
use open_structure_converters::rgbd::{OpenOptions, RawFrame, RawSequence, icl, tartanair, tum};
use open_structure_converters::text_release::{Limits, discover, read};
use opencv::prelude::*;

fn data(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let folder = data.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("SKIPPED: {name} is not here (see OPEN_STRUCTURE_DATA)");
    None
}

/// What a depth map of a frame says of the surfaces that another frame sees: the median distance, in standard deviations
/// of both maps, and the share of pixels that lie in both images.
fn disagreement(sequence: &RawSequence, from: &RawFrame, to: &RawFrame) -> (f64, f64) {
    let (raster, [first, second]) =
        (sequence.raster(), [from, to].map(|frame| sequence.depth(frame).unwrap()));
    let to_from_from = to.world_from_camera.inverse() * from.world_from_camera;
    let [width, height] = first.size();
    let mut distances = Vec::new();
    let mut known = 0;
    for (row, column) in
        (0..height).step_by(3).flat_map(|row| (0..width).step_by(3).map(move |column| (row, column)))
    {
        let Some(depth_m) = first.at(column as i64, row as i64) else { continue };
        known += 1;
        let Some(point) = raster.back_project(Point2::new(column as f64, row as f64), depth_m) else {
            continue;
        };
        let point = to_from_from * point;
        let Some((_, seen)) = raster.project(point) else { continue };
        let Some(surface) = second.surface(seen, sequence.camera.fx, &sequence.depth_noise) else { continue };
        let sigma_m = sequence.depth_noise.sigma_m(point.z) * std::f64::consts::SQRT_2;
        distances.push((surface.depth_m - point.z).abs() / sigma_m);
    }
    distances.sort_by(f64::total_cmp);
    (distances[distances.len() / 2], distances.len() as f64 / f64::from(known))
}

#[test]
fn the_desk_has_nine_of_its_frames() {
    let Some(folder) = data("rgbd/rgbd_dataset_freiburg1_desk_9") else { return };
    let sequence = tum::open(&folder, &OpenOptions::default()).unwrap();
    let ids: Vec<i64> = sequence.frames.iter().map(|frame| frame.frame_id.0).collect();
    // Depth begins 19 images after colour, with the first of these.
    assert_eq!(ids, (0..9).collect::<Vec<_>>());
    assert_eq!(sequence.frames[0].stamp_nanos, 1_305_031_453_359_684_000);
    assert!(sequence.frames[0].depth.ends_with("depth/1305031453.374112.png"));
    assert_eq!((sequence.camera.fx, sequence.lens.unwrap().radial[0]), (517.3, 0.2624));
    assert_eq!(sequence.source.files.len(), 3);
    let counts: Vec<(&str, u64)> =
        sequence.excluded.iter().map(|found| (found.file.as_str(), found.count)).collect();
    // 613 colour images and 595 depth maps are listed; 573 pairs, of which 9 are there.
    assert_eq!(counts, [("depth.txt", 564), ("rgb.txt", 564), ("rgb.txt", 40)]);
    for frame in &sequence.frames {
        let images = sequence.images(frame).unwrap();
        assert_eq!(
            (images.grey.cols(), images.grey.rows(), images.grey.typ()),
            (640, 480, opencv::core::CV_8UC1)
        );
        // A sixth has no depth.
        assert!((0.8..0.85).contains(&images.depth.coverage()));
    }
    // Camera, lens, depth, poses and stamps have to be right together. The median of a normal distribution is 0.67 of
    // its standard deviation.
    for pair in sequence.frames.windows(2) {
        let (median, share) = disagreement(&sequence, &pair[0], &pair[1]);
        println!("{}: median {median:.2} sigma over {share:.2} of the depths", pair[0].frame_id);
        assert!(median < 1.0 && share > 0.9, "{median} {share}");
    }
    // Poses of a motion capture system wander by some millimetres. With those of 14 ms later, when the depth maps are
    // said to have been taken, this is twice as much.
    let (far, _) = disagreement(&sequence, &sequence.frames[0], &sequence.frames[4]);
    assert!(far < 1.2, "{far}");
}

#[test]
fn the_cabinet_has_jpeg_pictures_and_a_camera_without_distortion() {
    let Some(folder) = data("rgbd/rgbd_dataset_freiburg3_cabinet_58") else { return };
    let sequence = tum::open(&folder, &OpenOptions::default()).unwrap();
    assert_eq!((sequence.frames.len(), sequence.excluded.len()), (58, 0));
    assert!(sequence.lens.is_none() && sequence.camera.removed_distortion.is_none());
    for frame in &sequence.frames {
        assert_eq!(sequence.images(frame).unwrap().grey.cols(), 640);
    }
    let mut medians: Vec<f64> =
        sequence.frames.windows(2).map(|pair| disagreement(&sequence, &pair[0], &pair[1]).0).collect();
    medians.sort_by(f64::total_cmp);
    println!("medians {medians:.2?} sigma");
    // The frames are 0.7 s and up to 0.2 m apart, and so poses matter more than the sensor: 9 mm at 1.25 m.
    assert!(medians[29] < 3.0, "{}", medians[29]);
}

#[test]
fn hospital_is_where_its_published_poses_are() {
    let Some(folder) = data("rgbd/tartanair_hospital_60") else { return };
    let sequence = tartanair::open(&folder, &OpenOptions::default()).unwrap();
    assert_eq!((sequence.frames.len(), sequence.excluded.len()), (60, 0));
    assert_eq!(sequence.camera.pixel_origin, registry::PIXEL_CORNER);
    let start = std::time::Instant::now();
    for frame in &sequence.frames {
        assert!(sequence.images(frame).unwrap().depth.coverage() > 0.95);
    }
    println!("{:.1?} a frame to read both images", start.elapsed() / 60);
    for pair in sequence.frames.windows(2).step_by(7) {
        let (median, share) = disagreement(&sequence, &pair[0], &pair[1]);
        println!("{}: median {median:.2} sigma over {share:.2} of the depths", pair[0].frame_id);
        assert!(median < 1.0 && share > 0.8, "{median} {share}");
    }
    assert!(icl::open(&folder, &OpenOptions::default()).is_err());

    let Some(published) = data("open-structure/hospital") else { return };
    let found = discover(&[published], &Limits::default()).unwrap();
    let truth = read(&found.sequences[0], &Limits::default()).unwrap().ground_truth.unwrap();
    for frame in &sequence.frames {
        let row = truth.poses.iter().find(|row| row.id == frame.frame_id.0).unwrap();
        let expected = Pose::from_components(row.translation, row.rotation_xyzw).unwrap();
        let difference = expected.inverse() * frame.world_from_camera;
        // Both have six or seven digits.
        let (shift, turn) = (difference.translation().norm(), difference.rotation_angle().to_degrees());
        assert!(shift < 1e-6 && turn < 1e-3, "{}: {shift} m, {turn} degrees", frame.frame_id);
    }
}
