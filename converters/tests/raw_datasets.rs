//! Raw RGB-D datasets: real ones, rendered ones, and what is wrong with folders.
//!
//! The real ones are looked for in `../shared/data/rgbd` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.

use std::path::{Path, PathBuf};

use open_structure::structure::registry;
use open_structure_converters::rgbd::{OpenOptions, icl, tartanair, tum};
use opencv::prelude::*;

/// A folder of real frames; `None`, and a word about it, where it is not here.
fn real(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let folder = data.join("rgbd").join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("SKIPPED: {name} is not here (see OPEN_STRUCTURE_DATA)");
    None
}

#[test]
fn tum_desk_has_the_frames_whose_files_are_there() {
    let Some(folder) = real("rgbd_dataset_freiburg1_desk_9") else { return };
    let sequence = tum::open(&folder, &OpenOptions::default()).unwrap();
    println!("{:?}", sequence.excluded);
    assert_eq!(sequence.frames.len(), 9);
    assert_eq!(sequence.lens.map(|lens| lens.radial[0]), Some(0.2624));
    for frame in &sequence.frames {
        let images = sequence.images(frame).unwrap();
        println!(
            "{} {} {:?} {}",
            frame.frame_id,
            frame.stamp_nanos,
            frame.world_from_camera.translation(),
            images.depth.coverage()
        );
        assert_eq!((images.grey.cols(), images.grey.rows(), images.grey.channels()), (640, 480, 1));
    }
}

#[test]
fn tum_cabinet_has_jpeg_pictures() {
    let Some(folder) = real("rgbd_dataset_freiburg3_cabinet_58") else { return };
    let sequence = tum::open(&folder, &OpenOptions::default()).unwrap();
    println!("{:?}", sequence.excluded);
    assert_eq!(sequence.frames.len(), 58);
    assert!(sequence.lens.is_none());
    for frame in &sequence.frames {
        sequence.images(frame).unwrap();
    }
}

#[test]
fn tartanair_hospital_reads() {
    let Some(folder) = real("tartanair_hospital_60") else { return };
    let sequence = tartanair::open(&folder, &OpenOptions::default()).unwrap();
    assert_eq!((sequence.frames.len(), sequence.excluded.len()), (60, 0));
    assert_eq!(sequence.camera.pixel_origin, registry::PIXEL_CORNER);
    let start = std::time::Instant::now();
    for frame in &sequence.frames {
        let images = sequence.images(frame).unwrap();
        assert!(images.depth.coverage() > 0.9);
    }
    println!("{:?} per frame", start.elapsed() / 60);
    assert!(icl::open(&folder, &OpenOptions::default()).is_err());
}
