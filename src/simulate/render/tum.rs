//! TUM RGB-D: lists with time stamps, and the files they name.

use std::fmt::Write;
use std::path::PathBuf;

use super::{Dataset, Posed, Shot, files};
use crate::simulate::Error;
use crate::structure::{Camera, PoseRow};

/// Steps of a depth map in a metre.
pub(super) const DEPTH_PER_METRE: f64 = 5000.0;

/// The layout of TUM RGB-D (Sturm et al. 2012).
///
/// Stamps have six decimals in names and lists, as in the benchmark; they are those of the sequence, rounded to
/// microseconds. `groundtruth.txt` has every frame of the sequence, with all digits.
pub(super) struct Tum {
    folder: PathBuf,
    /// What the second line of each list says.
    bag: String,
    lists: [String; 2],
}

impl Tum {
    pub(super) fn new(folder: PathBuf, name: &str) -> Self {
        Self { folder, bag: format!("# file: '{name}.bag'"), lists: [String::new(), String::new()] }
    }
}

impl Dataset for Tum {
    fn begin(&mut self, camera: &Camera, all: &[Posed<'_>]) -> Result<(), Error> {
        image_down(camera, "TUM RGB-D")?;
        for pair in all.windows(2) {
            let [before, after] = [pair[0], pair[1]].map(|posed| micros(posed.frame.stamp_nanos));
            if before >= after {
                return Err(Error::value("stamps", "frames at least a microsecond apart", seconds(after)));
            }
        }
        for name in ["rgb", "depth"] {
            files::folder(&self.folder.join(name))?;
        }
        Ok(())
    }

    fn frame(&mut self, posed: &Posed<'_>, shot: &Shot) -> Result<(), Error> {
        let stamp = seconds(micros(posed.frame.stamp_nanos));
        let names = ["rgb", "depth"].map(|kind| format!("{kind}/{stamp}.png"));
        let (picture, depth) = rayon::join(
            || files::picture(&self.folder.join(&names[0]), shot),
            || files::depth_picture(&self.folder.join(&names[1]), shot, DEPTH_PER_METRE),
        );
        picture.and(depth)?;
        for (list, name) in self.lists.iter_mut().zip(names) {
            let _ = writeln!(list, "{stamp} {name}");
        }
        Ok(())
    }

    fn finish(&mut self, all: &[Posed<'_>]) -> Result<(), Error> {
        let bag = &self.bag;
        let [rgb, depth] = &self.lists;
        files::text(
            &self.folder.join("rgb.txt"),
            &format!("# color images\n{bag}\n# timestamp filename\n{rgb}"),
        )?;
        files::text(
            &self.folder.join("depth.txt"),
            &format!("# depth maps\n{bag}\n# timestamp filename\n{depth}"),
        )?;
        let mut truth = format!("# ground truth trajectory\n{bag}\n# timestamp tx ty tz qx qy qz qw\n");
        for posed in all {
            let _ = writeln!(truth, "{} {}", seconds(micros(posed.frame.stamp_nanos)), numbers(&posed.pose));
        }
        files::text(&self.folder.join("groundtruth.txt"), &truth)
    }
}

/// Refuses a camera whose y points up in the image, which the layout does not know.
pub(super) fn image_down(camera: &Camera, layout: &str) -> Result<(), Error> {
    if camera.fy < 0.0 {
        let expected = format!("a positive focal length, for y of {layout}'s cameras points down");
        return Err(Error::value("camera.fy", expected, camera.fy));
    }
    Ok(())
}

/// A pose as seven numbers, with all their digits.
pub(super) fn numbers(pose: &PoseRow) -> String {
    pose.numbers().map(|number| format!("{number:?}")).join(" ")
}

fn micros(stamp_nanos: i64) -> i64 {
    // Halves up, without overflow.
    stamp_nanos.div_euclid(1000) + i64::from(stamp_nanos.rem_euclid(1000) >= 500)
}

fn seconds(micros: i64) -> String {
    let sign = if micros < 0 { "-" } else { "" };
    let micros = micros.unsigned_abs();
    format!("{sign}{}.{:06}", micros / 1_000_000, micros % 1_000_000)
}
