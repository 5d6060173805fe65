//! TUM RGB-D: lists with time stamps, a Kinect's images, poses of a motion capture system.

use std::path::{Path, PathBuf};

use open_structure::structure::{Clock, FrameId, registry};

use super::ascending::ascending;
use super::associate::associate;
use super::calibration::{self, Kind, Published};
use super::layout::{self, Dataset};
use super::list::List;
use super::raw_sequence::{no_frame, source};
use super::true_poses::TruePoses;
use super::{DepthFormat, DepthNoise, Error, Kinect, Ledger, OpenOptions, RawFrame, RawSequence, stamp};
use crate::family::{Family, TUM_FR1, TUM_FR2, TUM_FR3};

/// What a folder has.
const EXPECTED: &str = "rgb.txt, depth.txt and groundtruth.txt of TUM RGB-D";
/// Steps of a depth map in a metre, for each of the three cameras: the published maps are scaled already.
const STEPS_PER_METRE: f64 = 5000.0;
/// Depths that are believed, metres: a Kinect has none below 0.4 m, and beyond 5 m its steps are wider than 7 cm.
///
/// # Source
/// Khoshelham and Elberink 2012, Accuracy and Resolution of Kinect Depth Data: a random error of about 4 cm at 5 m, the end
/// of the sensor's range, and steps of 7 cm there.
const DEPTH_M: [f64; 2] = [0.4, 5.0];
/// Noise of a Kinect: `σ(z) = 1.425e-3 z²`, with z in metres, and a millimetre for what is not the sensor's.
///
/// The millimetre was measured on nine frames of fr1/desk: what neighbours say of a surface differs by `√2 σ` with
/// `σ` = 1.9, 3.3 and 5.1 mm at 0.75, 1.25 and 1.75 m, where this says 1.8, 3.2 and 5.4 mm.
///
/// # Source
/// Khoshelham and Elberink 2012: `σ_Z = 2.85e-5 Z² σ_d` in centimetres, with half a unit of disparity for `σ_d`.
const NOISE: DepthNoise = DepthNoise { constant_m: 1e-3, ..KINECT_NOISE };
/// Noise of a Kinect without anything else but the steps of the file.
pub(super) const KINECT_NOISE: DepthNoise =
    DepthNoise { constant_m: 0.5 / STEPS_PER_METRE, linear: 0.0, quadratic_per_m: 1.425e-3 };

/// Standard deviation of a true position, metres: motion capture, its calibration to the camera, and the camera's shutter.
///
/// # Source
/// Sturm et al. 2012, section V: the true poses are within 1 cm of the camera's.
const POSE_SIGMA_M: f64 = 0.01;

/// Opens a sequence of TUM RGB-D.
///
/// Colour images and depth maps are paired by their stamps, the closest first, within
/// [`max_stamp_difference_nanos`](OpenOptions::max_stamp_difference_nanos); stamp and true pose of a frame are those of
/// its colour image, the pose made between its neighbours, not farther apart than
/// [`longest_gap_nanos`](OpenOptions::longest_gap_nanos). A frame's id is its place among all pairs that the lists make,
/// whether their files are there or not: so it does not depend on what was downloaded.
///
/// The camera is told by the folder's name (`freiburg1`, `fr1`, ...), then by the recording that the lists name, unless
/// it is given or `calibration.txt` says it.
///
/// * `folder` — the sequence, or a folder with nothing else in it.
///
/// # Errors
/// [`Error::Layout`] for another folder, an unknown camera or no frame at all; [`Error::Line`] for a line that cannot be
/// used and stamps that do not ascend, unless lines may be left out; [`Error::Io`].
///
/// # Source
/// Sturm et al. 2012, A Benchmark for the Evaluation of RGB-D SLAM Systems; the benchmark's page on file formats.
pub fn open(folder: &Path, options: &OpenOptions) -> Result<RawSequence, Error> {
    let (root, _) = layout::find(folder, &[Dataset::Tum], EXPECTED)?;
    let mut ledger = Ledger::new(options.keep_going);
    let [colours, depths, truth] =
        ["rgb.txt", "depth.txt", "groundtruth.txt"].map(|name| List::read(root.join(name)));
    let (colours, depths, truth) = (colours?, depths?, truth?);
    let name = layout::name(&root);
    let kinect =
        options.kinect.or_else(|| Kinect::named(&name)).or_else(|| Kinect::named(&layout::name(folder)));
    let kinect = kinect.or_else(|| colours.remarks().find_map(Kinect::named));
    let family = kinect.map(family);
    let kind = Kind { pixel_origin: registry::PIXEL_CENTER, depth_m: DEPTH_M };
    let (camera, lens, calibration) = calibration::camera(&root, options, kind, || {
        let family = family.ok_or_else(|| {
            let expected = "a name that tells the camera (freiburg1, freiburg2 or freiburg3; fr1, fr2 or fr3), a \
                            calibration.txt, or the camera as an option";
            Error::layout(&root, expected, format!("the name \"{}\"", layout::name(&root)))
        })?;
        Ok(Published { pinhole: family.camera(), distortion: family.distortion })
    })?;

    let poses = TruePoses::read(&truth, &mut ledger)?;
    let listed = [images(&colours, &mut ledger)?, images(&depths, &mut ledger)?];
    let [colour_stamps, depth_stamps] =
        [0, 1].map(|which: usize| listed[which].iter().map(|image| image.0).collect::<Vec<i64>>());
    let pairs = associate(&colour_stamps, &depth_stamps, options.max_stamp_difference_nanos);
    let mut frames = Vec::new();
    let (mut missing, mut lost) = ([0, 0], 0);
    for (id, (colour, depth)) in (0..).zip(&pairs) {
        if !options.wants(id) {
            continue;
        }
        let (stamp_nanos, colour) = &listed[0][*colour];
        let files = [root.join(colour), root.join(&listed[1][*depth].1)];
        let absent = [0, 1].map(|which: usize| !files[which].is_file());
        missing[0] += u64::from(absent[0]);
        missing[1] += u64::from(absent[1]);
        if absent.contains(&true) {
            continue;
        }
        let Some(world_from_camera) = poses.at(*stamp_nanos, options.longest_gap_nanos) else {
            lost += 1;
            continue;
        };
        let [colour, depth] = files;
        let frame_id = FrameId(id.cast_signed());
        frames.push(RawFrame { frame_id, stamp_nanos: *stamp_nanos, world_from_camera, colour, depth });
    }
    let alone = (listed[0].len() - pairs.len()) as u64;
    ledger.count(&colours.path, "images without a depth map at about the same time", alone, None);
    ledger.count(&colours.path, "images that are not there", missing[0], None);
    ledger.count(&depths.path, "depth maps that are not there", missing[1], None);
    ledger.count(&truth.path, "images without a true pose around their time", lost, None);
    let excluded = ledger.finish();
    if frames.is_empty() {
        return Err(no_frame(&root, &excluded));
    }
    let mut source = source(family.unwrap_or(&TUM_FR3), &name);
    source.files = [colours.source, depths.source, truth.source].into_iter().chain(calibration).collect();
    Ok(RawSequence {
        name,
        description: None,
        source,
        clock: Clock { kind: registry::RECORDED.to_owned(), rate_hz: None },
        camera,
        lens,
        depth_format: DepthFormat::Png { steps_per_metre: STEPS_PER_METRE },
        depth_noise: NOISE,
        pose_sigma_m: POSE_SIGMA_M,
        frames,
        excluded,
    })
}

fn family(kinect: Kinect) -> &'static Family {
    match kinect {
        Kinect::Fr1 => &TUM_FR1,
        Kinect::Fr2 => &TUM_FR2,
        Kinect::Fr3 => &TUM_FR3,
    }
}

/// Stamps and file names of a list, ascending.
fn images(list: &List, ledger: &mut Ledger) -> Result<Vec<(i64, PathBuf)>, Error> {
    let mut rows = Vec::new();
    for line in list.lines() {
        let stamp = line.fields.first().and_then(|field| stamp::nanos(field));
        match stamp.zip(line.file(1).map(PathBuf::from)) {
            Some((stamp, file)) => rows.push((stamp, line.number, file)),
            None => ledger.refuse(line.wrong("timestamp filename, a file below this folder"))?,
        }
    }
    ascending(list, rows, "stamp", ledger)
}
