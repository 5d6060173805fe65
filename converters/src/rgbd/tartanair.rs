//! TartanAir: a game engine's images, numbered, with poses north-east-down.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::structure::{Clock, FrameId, registry};

use super::calibration::{self, Kind, Published};
use super::layout::{self, Dataset};
use super::list::List;
use super::raw_sequence::{no_frame, source, tick};
use super::{DepthFormat, DepthNoise, Error, Ledger, OpenOptions, RawFrame, RawSequence, true_poses};
use crate::family::TARTANAIR_V1;

/// What a folder has.
const EXPECTED: &str = "image_left/, depth_left/ and pose_left.txt of TartanAir (version 2: image_lcam_front/, \
                        depth_lcam_front/ and pose_lcam_front.txt)";
/// Frames in a second: the dataset has no stamps, and its simulated inertial sensor runs at 100 Hz with ten samples from
/// an image to the next.
const RATE_HZ: i64 = 10;
/// Depths that are believed, metres. The engine draws nothing nearer than 10 cm and writes 16-bit floating point numbers: beyond 50 m their steps are 3 cm and
/// pixels 16 cm wide; the sky is at 10000 m and more. No landmark that the first release has of the first 60 frames
/// of `hospital` is farther than 46 m.
const DEPTH_M: [f64; 2] = [0.1, 50.0];
/// Half a step of a 16-bit floating point number, which has 11 binary digits, and what a renderer's sampling adds.
const NOISE: DepthNoise = DepthNoise { constant_m: 1e-4, linear: 1.0 / 2048.0, quadratic_per_m: 0.0 };

/// Names of files of a version.
struct Names {
    images: &'static str,
    image_ending: &'static str,
    depths: &'static str,
    depth_ending: &'static str,
    poses: &'static str,
    size: [u32; 2],
    depth_format: DepthFormat,
}

const V1: Names = Names {
    images: "image_left",
    image_ending: "_left.png",
    depths: "depth_left",
    depth_ending: "_left_depth.npy",
    poses: "pose_left.txt",
    size: [640, 480],
    depth_format: DepthFormat::Npy,
};

const V2: Names = Names {
    images: "image_lcam_front",
    image_ending: "_lcam_front.png",
    depths: "depth_lcam_front",
    depth_ending: "_lcam_front_depth.png",
    poses: "pose_lcam_front.txt",
    size: [640, 640],
    depth_format: DepthFormat::FloatPng,
};

/// Opens a sequence of TartanAir, first or second version; the left camera, of the second version the one in front.
///
/// Line k of the poses, counted from 0 and without remarks, belongs to the files with number k, and k is the frame's id.
/// The world is the dataset's, north-east-down: x north, y east, z down. Its camera looks along x with y right and z
/// down, so `world_from_camera = NED · C`, where `C = [0 0 1; 1 0 0; 0 1 0]` takes x right, y down, z forward to that.
/// Pixels are counted from the outer corner of the first: the published principal point is half the image's size.
///
/// * `folder` — the trajectory (`P000`), or a folder with nothing else in it.
///
/// # Errors
/// [`Error::Layout`] for another folder or no frame at all; [`Error::Line`] for a line that is no pose, unless lines may
/// be left out; [`Error::Io`].
///
/// # Source
/// Wang et al. 2020, TartanAir; the dataset's page on its coordinate frames and depth files.
pub fn open(folder: &Path, options: &OpenOptions) -> Result<RawSequence, Error> {
    let (root, dataset) = layout::find(folder, &[Dataset::TartanAir, Dataset::TartanAirV2], EXPECTED)?;
    let names = if dataset == Dataset::TartanAirV2 { &V2 } else { &V1 };
    for (name, there) in [
        (names.images, root.join(names.images).is_dir()),
        (names.depths, root.join(names.depths).is_dir()),
        (names.poses, root.join(names.poses).is_file()),
    ] {
        if !there {
            return Err(Error::layout(&root, EXPECTED, format!("no {name}")));
        }
    }
    let mut ledger = Ledger::new(options.keep_going);
    let truth = List::read(root.join(names.poses))?;
    let poses = true_poses::by_line(&truth, &mut ledger)?;
    let kind = Kind { pixel_origin: registry::PIXEL_CORNER, depth_m: DEPTH_M };
    let (camera, lens, calibration) = calibration::camera(&root, options, kind, || {
        let ([fx, fy, ..], [width, height]) = (TARTANAIR_V1.intrinsics, names.size);
        let [cx, cy] = names.size.map(|size| f64::from(size) / 2.0);
        Ok(Published { pinhole: PinholeCamera { fx, fy, cx, cy, width, height }, distortion: None })
    })?;
    let mut frames = Vec::new();
    let mut missing = [0, 0];
    for (id, pose) in (0_u64..).zip(&poses) {
        let Some(pose) = pose.filter(|_| options.wants(id)) else { continue };
        let colour = root.join(names.images).join(format!("{id:06}{}", names.image_ending));
        let depth = root.join(names.depths).join(format!("{id:06}{}", names.depth_ending));
        let absent = [&colour, &depth].map(|file| !file.is_file());
        missing[0] += u64::from(absent[0]);
        missing[1] += u64::from(absent[1]);
        if absent.contains(&true) {
            continue;
        }
        let id = id.cast_signed();
        frames.push(RawFrame {
            frame_id: FrameId(id),
            stamp_nanos: tick(id, RATE_HZ),
            world_from_camera: world_from_camera(&pose),
            colour,
            depth,
        });
    }
    let number =
        |name: &String| name.strip_suffix(names.image_ending).and_then(|digits| digits.parse::<u64>().ok());
    let images = layout::names(&root.join(names.images))?;
    let unposed = images.iter().filter_map(number).filter(|id| *id >= poses.len() as u64).count() as u64;
    ledger.count(&root.join(names.images), "images that are not there", missing[0], None);
    ledger.count(&root.join(names.depths), "depth maps that are not there", missing[1], None);
    ledger.count(&truth.path, "images without a true pose", unposed, None);
    let excluded = ledger.finish();
    if frames.is_empty() {
        return Err(no_frame(&root, &excluded));
    }
    let name = name(&root);
    let mut source = source(&TARTANAIR_V1, &name);
    source.files = std::iter::once(truth.source).chain(calibration).collect();
    Ok(RawSequence {
        name,
        description: None,
        source,
        clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(RATE_HZ as f64) },
        camera,
        lens,
        depth_format: names.depth_format,
        depth_noise: NOISE,
        pose_sigma_m: 0.0,
        frames,
        excluded,
    })
}

/// The pose of the camera, from the pose as the dataset says it.
fn world_from_camera(world_from_body: &Pose) -> Pose {
    // C takes x to y, y to z and z to x: a third of a turn about (1, 1, 1).
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(0.5, 0.5, 0.5, 0.5));
    *world_from_body * Pose::new(turn, Vector3::zeros())
}

/// Name of a trajectory: with those of the folders it is published in, `hospital_Easy_P000`.
fn name(root: &Path) -> String {
    let own = layout::name(root);
    let full = root.canonicalize().unwrap_or_else(|_| root.to_owned());
    let above: Vec<String> = full.ancestors().skip(1).take(2).map(layout::name).collect();
    let numbered = own
        .strip_prefix('P')
        .is_some_and(|rest| (3..=4).contains(&rest.len()) && rest.bytes().all(|c| c.is_ascii_digit()));
    match above.as_slice() {
        [level, environment] if numbered && is_level(level) => format!("{environment}_{level}_{own}"),
        _ => own,
    }
}

fn is_level(name: &str) -> bool {
    ["easy", "hard", "data_easy", "data_hard"].contains(&name.to_ascii_lowercase().as_str())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn the_camera_looks_north_with_east_to_its_right() {
        let pose = world_from_camera(&Pose::identity());
        for (camera, world) in [
            ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
        ] {
            assert!((pose * Point3::from(camera) - Point3::from(world)).norm() < 1e-15);
        }
    }
}
