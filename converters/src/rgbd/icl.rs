//! ICL-NUIM: rendered rooms, a camera whose y points up in the image.

use std::path::{Path, PathBuf};

use open_structure::structure::{Clock, FrameId, registry};

use super::ascending::ascending;
use super::calibration::{self, Kind, Published};
use super::layout::{self, Dataset};
use super::list::List;
use super::raw_sequence::{no_frame, source, tick};
use super::true_poses::TruePoses;
use super::tum::KINECT_NOISE;
use super::{
    DepthFormat, DepthNoise, Error, Ledger, OpenOptions, RawFrame, RawSequence, icl_original, stamp,
};
use crate::family::ICL;

/// What a folder has.
const EXPECTED: &str = "rgb/, depth/ and a .gt.freiburg of ICL-NUIM, or its scene_NNNN.png, .depth and .txt";
/// Frames in a second, of the cameras' paths.
pub(super) const RATE_HZ: i64 = 30;
/// Nanoseconds that stand for one frame where numbers are read as stamps.
const NUMBER: i64 = 1_000_000_000;
/// Steps of a depth map in a metre.
const STEPS_PER_METRE: f64 = 5000.0;
/// Depths that are believed, metres: all that the PNG version's 16 bits can say, down to 10 cm.
const DEPTH_M: [f64; 2] = [0.1, 65535.0 / STEPS_PER_METRE];
/// Maps without noise: half a step of the file's numbers.
const STEPS: DepthNoise = DepthNoise { constant_m: 0.5 / STEPS_PER_METRE, linear: 0.0, quadratic_per_m: 0.0 };

/// What both versions have in common.
pub(super) struct Opened {
    pub(super) frames: Vec<RawFrame>,
    pub(super) depth_format: DepthFormat,
    pub(super) depth_noise: DepthNoise,
    pub(super) files: Vec<open_structure::structure::SourceFile>,
}

/// Opens a sequence of ICL-NUIM, the version with PNG pictures or that of the ray tracer.
///
/// *PNG:* `rgb/N.png` and `depth/N.png`, as `associations.txt` names them or, without it, as they are numbered, and true
/// poses in the only file of the folder that ends in `.gt.freiburg`. Images and poses belong together by number: the
/// published images of a sequence begin with 0 and its poses with 1 and both end elsewhere (1510 images and 1508 poses
/// of `lr kt0`), so the first and last image have no pose and are left out.
///
/// *Ray tracer:* `scene_00_NNNN` (living room, metres) or `scene_NNN` (office, centimetres) with `.png`, `.depth` and
/// `.txt`; every frame has its own camera, in the ray tracer's words.
///
/// The frame's id is the number. The camera has a negative `fy`: its y points up in the image, and poses are
/// `world_from_camera` with it, for both versions.
///
/// * `folder` — the sequence, or a folder with nothing else in it.
///
/// # Errors
/// [`Error::Layout`] for another folder, none or several trajectories, or no frame at all; [`Error::Line`] for a line
/// that cannot be used and numbers that do not ascend, unless lines may be left out; [`Error::Io`].
///
/// # Source
/// Handa et al. 2014, A Benchmark for RGB-D Visual Odometry, 3D Reconstruction and SLAM; the dataset's page.
pub fn open(folder: &Path, options: &OpenOptions) -> Result<RawSequence, Error> {
    let (root, dataset) = layout::find(folder, &[Dataset::Icl, Dataset::IclOriginal], EXPECTED)?;
    let mut ledger = Ledger::new(options.keep_going);
    let name = layout::name(&root);
    let kind = Kind { pixel_origin: registry::PIXEL_CENTER, depth_m: DEPTH_M };
    let (camera, lens, calibration) = calibration::camera(&root, options, kind, || {
        Ok(Published { pinhole: ICL.camera(), distortion: ICL.distortion })
    })?;
    let opened = if dataset == Dataset::IclOriginal {
        icl_original::frames(&root, options, &mut ledger)?
    } else {
        pictures(&root, &name, options, &mut ledger)?
    };
    let excluded = ledger.finish();
    if opened.frames.is_empty() {
        return Err(no_frame(&root, &excluded));
    }
    let mut source = source(&ICL, &name);
    source.files = opened.files.into_iter().chain(calibration).collect();
    Ok(RawSequence {
        name,
        description: None,
        source,
        clock: Clock { kind: registry::SYNTHETIC.to_owned(), rate_hz: Some(RATE_HZ as f64) },
        camera,
        lens,
        depth_format: opened.depth_format,
        depth_noise: opened.depth_noise,
        pose_sigma_m: 0.0,
        frames: opened.frames,
        excluded,
    })
}

/// Frames of the version with PNG pictures.
fn pictures(root: &Path, name: &str, options: &OpenOptions, ledger: &mut Ledger) -> Result<Opened, Error> {
    let truth = List::read(trajectory(root)?)?;
    let poses = TruePoses::read(&truth, ledger)?;
    let associations = root.join("associations.txt");
    let mut files = vec![truth.source.clone()];
    let images = if associations.is_file() {
        let list = List::read(associations.clone())?;
        files.insert(0, list.source.clone());
        associated(&list, ledger)?
    } else {
        numbered(root)?
    };
    let (mut missing, mut lost) = (0, 0);
    let mut frames = Vec::new();
    for Numbered { number, colour, depth } in images {
        if !options.wants(number.cast_unsigned()) {
            continue;
        }
        let (colour, depth) = (root.join(colour), root.join(depth));
        if !colour.is_file() || !depth.is_file() {
            missing += 1;
            continue;
        }
        let pose = number.checked_mul(NUMBER).and_then(|stamp| poses.at(stamp, 0));
        let Some(world_from_camera) = pose else {
            lost += 1;
            continue;
        };
        let stamp_nanos = tick(number, RATE_HZ);
        frames.push(RawFrame { frame_id: FrameId(number), stamp_nanos, world_from_camera, colour, depth });
    }
    ledger.count(&associations, "images or depth maps that are not there", missing, None);
    ledger.count(&truth.path, "images without a true pose of their number", lost, None);
    Ok(Opened {
        frames,
        depth_format: DepthFormat::Png { steps_per_metre: STEPS_PER_METRE },
        // The published folders say it with an n behind the number: living_room_traj0n_frei_png.
        depth_noise: if name.contains("n_frei_png") { KINECT_NOISE } else { STEPS },
        files,
    })
}

/// The only trajectory of a folder.
fn trajectory(root: &Path) -> Result<PathBuf, Error> {
    let expected = "one trajectory, such as livingRoom0.gt.freiburg or traj0.gt.freiburg";
    let mut found: Vec<String> =
        layout::names(root)?.into_iter().filter(|name| name.ends_with(".gt.freiburg")).collect();
    if found.is_empty() && root.join("groundtruth.txt").is_file() {
        found.push("groundtruth.txt".to_owned());
    }
    match found.as_slice() {
        [only] => Ok(root.join(only)),
        [] => Err(Error::layout(root, expected, "none; the dataset's page has it apart from the images")),
        several => Err(Error::layout(root, expected, several.join(", "))),
    }
}

/// A number, and the files that have it.
struct Numbered {
    number: i64,
    colour: PathBuf,
    depth: PathBuf,
}

/// The number that a field says, with or without decimal places.
fn number(text: &str) -> Option<i64> {
    let stamp = stamp::nanos(text)?;
    (stamp >= 0 && stamp % NUMBER == 0).then_some(stamp / NUMBER)
}

/// What a list names: number and file of the depth map, number and file of the picture, or the other way round.
fn associated(list: &List, ledger: &mut Ledger) -> Result<Vec<Numbered>, Error> {
    let mut rows = Vec::new();
    for line in list.lines() {
        let numbers = [0, 2].map(|field: usize| line.fields.get(field).and_then(|text| number(text)));
        let files = line.file(1).zip(line.file(3));
        let (&[Some(first), Some(second)], Some(files)) = (&numbers, files) else {
            ledger.refuse(line.wrong("N depth/N.png N rgb/N.png, files below this folder"))?;
            continue;
        };
        let swapped = files.0.trim_start_matches("./").starts_with("rgb");
        let (number, colour, depth) =
            if swapped { (first, files.0, files.1) } else { (second, files.1, files.0) };
        let image = Numbered { number, colour: colour.into(), depth: depth.into() };
        rows.push((number, line.number, image));
    }
    Ok(ascending(list, rows, "number", ledger)?.into_iter().map(|(_, image)| image).collect())
}

/// What the folders hold, by number.
fn numbered(root: &Path) -> Result<Vec<Numbered>, Error> {
    let mut images: Vec<Numbered> = Vec::new();
    for name in layout::names(&root.join("rgb"))? {
        let Some((digits, _)) = name.rsplit_once('.').filter(|(_, ending)| ["png", "jpg"].contains(ending))
        else {
            continue;
        };
        if let Some(number) = digits.parse().ok().filter(|number: &i64| *number >= 0) {
            let depth = Path::new("depth").join(format!("{digits}.png"));
            images.push(Numbered { number, colour: Path::new("rgb").join(&name), depth });
        }
    }
    images.sort_by(|a, b| (a.number, &a.colour).cmp(&(b.number, &b.colour)));
    images.dedup_by_key(|image| image.number);
    Ok(images)
}
