//! What converting costs beside what its detectors cost, and its memory: figures, measured in one run.
//!
//! `cargo bench --bench converting`. Ends with exit code 1 when a bound does not hold. The sixty frames of TartanAir's hospital
//! are looked for in `../shared/data` beside the workspace, or under `OPEN_STRUCTURE_DATA`.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program that prints a table")]

#[path = "../../benches/figures/figure.rs"]
#[expect(dead_code, reason = "bounds that other figures have")]
mod figure;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::thread;

use anyhow::{Context as _, Result, ensure};
use figure::{Bound, Figures, median_ratio, median_time};
use open_structure::format::WriteOptions;
use open_structure_converters::generate::{Options, generate};
use open_structure_converters::ordered::ordered;
use open_structure_converters::rgbd::{OpenOptions, tartanair};
use opencv::core::{KeyPoint, Mat, Vec4f, Vector, no_array};
use opencv::features2d::{Feature2DTrait as _, ORB, ORB_ScoreType};
use opencv::imgcodecs::{IMREAD_GRAYSCALE, imread};
use opencv::ximgproc::{FastLineDetectorTrait as _, create_fast_line_detector};

fn main() -> Result<ExitCode> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let folder = data.join("rgbd/tartanair_hospital_60");
    if let Some(folder) = std::env::var_os(CHILD) {
        make_as_child(Path::new(&folder))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut figures = Figures::default();
    if folder.is_dir() {
        let scratch = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
        time(&folder, scratch.path(), &mut figures)?;
        memory(&folder, scratch.path(), &mut figures)?;
    } else {
        eprintln!("SKIPPED: the hospital frames are not here; set OPEN_STRUCTURE_DATA to convert them");
    }
    print!("{figures}");
    Ok(if figures.hold() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The whole conversion over the detectors' own loop, on the same files, cores and options.
fn time(folder: &Path, scratch: &Path, figures: &mut Figures) -> Result<()> {
    let threads = thread::available_parallelism().map_or(1, std::num::NonZero::get);
    opencv::core::set_num_threads(1)?;
    let options = Options::default();
    let output = scratch.join("hospital.mcap");
    let convert = || -> Result<()> {
        let raw = tartanair::open(folder, &OpenOptions::default())?;
        let generated = generate(&raw, "hospital", &options, threads, false, &|_, _, _| ())?;
        let write = WriteOptions { force: true, ..WriteOptions::default() };
        generated.write(&output, write, &|_, _, _| ())?;
        Ok(())
    };
    let bare = || -> Result<()> {
        ordered(60, threads, 2 * threads, |index| detectors(folder, index), |_, found| found.map(drop))
    };
    convert()?;
    bare()?;
    let seconds = median_time(3, || bare().is_ok()).as_secs_f64();
    figures.add("decoding, ORB and FLD alone, 60 frames", 60.0 / seconds, "frames/s", Bound::None);
    let ratio = median_ratio(3, || convert().is_ok(), || bare().is_ok());
    figures.add("converting 60 frames over decoding, ORB and FLD alone", ratio, "times", Bound::AtMost(1.3));
    let raw = tartanair::open(folder, &OpenOptions::default())?;
    let made = generate(&raw, "hospital", &options, threads, false, &|_, _, _| ())?;
    let write = || {
        made.write(&output, WriteOptions { force: true, ..WriteOptions::default() }, &|_, _, _| ()).is_ok()
    };
    figures.add(
        "of that, writing the sequence",
        median_ratio(3, write, || bare().is_ok()),
        "times",
        Bound::None,
    );
    // As a script would have it: OpenCV's own threads, one frame after the other.
    opencv::core::set_num_threads(i32::try_from(threads)?)?;
    let script = || -> Result<()> { (0..60).try_for_each(|index| detectors(folder, index).map(drop)) };
    let seconds = median_time(3, || script().is_ok()).as_secs_f64();
    figures.add(
        "the same one after the other, OpenCV's own threads",
        60.0 / seconds,
        "frames/s",
        Bound::None,
    );
    opencv::core::set_num_threads(1)?;
    Ok(())
}

/// What any front-end does with a frame: both images decoded, points with descriptors, segments.
fn detectors(folder: &Path, index: usize) -> Result<usize> {
    let image = folder.join(format!("image_left/{index:06}_left.png"));
    let grey = imread(&image, IMREAD_GRAYSCALE)?;
    let bytes = fs::read(folder.join(format!("depth_left/{index:06}_left_depth.npy")))?;
    let depth: Vec<f32> = npyz::NpyFile::new(&bytes[..])?.into_vec()?;
    let mut orb = ORB::create(1000, 1.2, 8, 31, 0, 2, ORB_ScoreType::HARRIS_SCORE, 31, 20)?;
    let (mut points, mut descriptors) = (Vector::<KeyPoint>::new(), Mat::default());
    orb.detect_and_compute_def(&grey, &no_array(), &mut points, &mut descriptors)?;
    let mut fld = create_fast_line_detector(10, std::f32::consts::SQRT_2, 50.0, 50.0, 3, false)?;
    let mut segments = Vector::<Vec4f>::new();
    fld.detect(&grey, &mut segments)?;
    Ok(points.len() + segments.len() + depth.len())
}

/// Set for the child process that makes a sequence and writes nothing: of which folder.
const CHILD: &str = "OPEN_STRUCTURE_BENCH_CONVERT";

/// Makes a sequence, and prints the process's greatest resident memory in KiB.
fn make_as_child(folder: &Path) -> Result<()> {
    opencv::core::set_num_threads(1)?;
    let raw = tartanair::open(folder, &OpenOptions::default())?;
    let made = generate(&raw, "hospital", &Options::default(), 2, false, &|_, _, _| ())?;
    let status = fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).context("no VmHWM")?;
    println!("{}", peak.trim().trim_end_matches(" kB"));
    drop(made);
    Ok(())
}

/// Resident memory of making a sequence of sixty frames, and of as many again and again; what writing takes has its own bound.
fn memory(folder: &Path, scratch: &Path, figures: &mut Figures) -> Result<()> {
    let mut peaks = Vec::new();
    for times in [1, 8] {
        let copy = scratch.join(format!("hospital-{times}"));
        repeated(folder, &copy, times)?;
        let output = Command::new(std::env::current_exe()?).env(CHILD, &copy).output()?;
        ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let kib: f64 = String::from_utf8_lossy(&output.stdout).trim().parse()?;
        peaks.push(kib / 1024.0);
    }
    figures.add("resident memory while 60 frames are converted", peaks[0], "MiB", Bound::None);
    let ratio = peaks[1] / peaks[0];
    figures.add("480 frames of the same landmarks over that", ratio, "times", Bound::AtMost(1.2));
    Ok(())
}

/// The frames there and back and there again, so that neighbours stay neighbours.
fn repeated(folder: &Path, copy: &Path, times: usize) -> Result<()> {
    let poses = fs::read_to_string(folder.join("pose_left.txt"))?;
    let poses: Vec<&str> = poses.lines().collect();
    let mut lines = String::new();
    for name in ["image_left", "depth_left"] {
        fs::create_dir_all(copy.join(name))?;
    }
    for number in 0..60 * times {
        let (lap, place) = (number / 60, number % 60);
        let from = if lap % 2 == 0 { place } else { 59 - place };
        for (kind, ending) in [("image_left", "left.png"), ("depth_left", "left_depth.npy")] {
            let source = folder.join(format!("{kind}/{from:06}_{ending}")).canonicalize()?;
            symlink(source, copy.join(format!("{kind}/{number:06}_{ending}")))?;
        }
        lines.push_str(poses.get(from).context("a pose for each frame")?);
        lines.push('\n');
    }
    Ok(fs::write(copy.join("pose_left.txt"), lines)?)
}
