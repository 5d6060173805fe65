//! A painted wall before a camera that moves along it, in the layout of TUM RGB-D, in milliseconds.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use opencv::core::{CV_8UC1, CV_16UC1, Mat, Scalar, Vector};
use opencv::imgcodecs;
use tempfile::TempDir;

/// Frames of the wall.
pub(crate) const FRAMES: usize = 10;
/// Columns and rows of its images, pixels.
pub(crate) const SIZE: [i32; 2] = [120, 100];

/// A folder with the wall's images in `raw`.
pub(crate) struct Wall {
    folder: TempDir,
}

impl Wall {
    /// Ten images, a tenth of a second, two centimetres and, at 2 m, one pixel apart.
    pub(crate) fn new() -> Self {
        let wall = Self { folder: tempfile::tempdir().unwrap() };
        for name in ["rgb", "depth"] {
            fs::create_dir_all(wall.raw(name)).unwrap();
        }
        fs::write(wall.raw("calibration.txt"), "120 100 100.0 100.0 59.5 49.5\n").unwrap();
        let mut truth = String::new();
        for frame in 0..FRAMES {
            let pixels: Vec<u8> = (0..100).flat_map(|v| (0..120).map(move |u| tone(u + frame, v))).collect();
            save(
                &wall.raw(&format!("rgb/{frame}.png")),
                &Mat::new_rows_cols_with_data(100, 120, &pixels).unwrap(),
            );
            write_png(&wall.raw(&format!("depth/{frame}.png")), SIZE, 16);
            writeln!(truth, "0.{frame} 0.{:02} 0 0 0 0 0 1", 2 * frame).unwrap();
        }
        fs::write(wall.raw("groundtruth.txt"), truth).unwrap();
        wall.repeat(1);
        wall
    }

    /// Lists every image so often.
    pub(crate) fn repeat(&self, times: usize) {
        for kind in ["rgb", "depth"] {
            let mut list = String::new();
            for time in 0..times {
                for frame in 0..FRAMES {
                    // Repeated stamps are nanoseconds apart.
                    let digits = if times == 1 { String::new() } else { format!("{time:08}") };
                    writeln!(list, "0.{frame}{digits} {kind}/{frame}.png").unwrap();
                }
            }
            if times > 1 {
                let mut lines: Vec<&str> = list.lines().collect();
                lines.sort_unstable();
                list = lines.join("\n");
            }
            fs::write(self.raw(&format!("{kind}.txt")), list).unwrap();
        }
    }

    /// The folder in which `raw` is.
    pub(crate) fn place(&self) -> &Path {
        self.folder.path()
    }

    /// A file of `raw`.
    pub(crate) fn raw(&self, name: &str) -> PathBuf {
        self.folder.path().join("raw").join(name)
    }

    /// Changes a list.
    pub(crate) fn edit(&self, name: &str, change: impl FnOnce(String) -> String) {
        let text = fs::read_to_string(self.raw(name)).unwrap();
        let changed = change(text.clone());
        assert_ne!(text, changed);
        fs::write(self.raw(name), changed).unwrap();
    }

    /// Removes an output.
    pub(crate) fn remove(&self, name: &str) {
        let path = self.place().join(name);
        if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
    }

    /// Packs `raw`.
    pub(crate) fn zip(&self, name: &str) {
        let mut archive = zip::ZipWriter::new(fs::File::create(self.place().join(name)).unwrap());
        let options = zip::write::SimpleFileOptions::default();
        for folder in ["", "rgb", "depth"] {
            for entry in names(&self.raw(folder)) {
                let path = self.raw(folder).join(&entry);
                if path.is_file() {
                    archive.start_file(format!("raw/{folder}/{entry}").replace("//", "/"), options).unwrap();
                    archive.write_all(&fs::read(path).unwrap()).unwrap();
                }
            }
        }
        archive.finish().unwrap();
    }
}

/// The wall's paint: frames in frames, the innermost filled with squares.
fn tone(u: usize, v: usize) -> u8 {
    match (u, v) {
        (34..96, 24..76) => {
            let hash = (u / 6).wrapping_mul(0x9E37_79B9).wrapping_add((v / 6).wrapping_mul(0x85EB_CA6B));
            [20, 60, 110, 160, 200, 250][(hash >> 13) % 6]
        }
        (24..106, 14..86) => 230,
        (16..114, 6..94) => 60,
        _ => 150,
    }
}

/// Names of what is in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Writes a grey PNG: of 8 bits, or a depth of two metres.
pub(crate) fn write_png(path: &Path, [width, height]: [i32; 2], bits: u8) {
    let (kind, value) = if bits == 8 { (CV_8UC1, 90.0) } else { (CV_16UC1, 10_000.0) };
    save(path, &Mat::new_rows_cols_with_default(height, width, kind, Scalar::all(value)).unwrap());
}

fn save(path: &Path, picture: &impl opencv::core::ToInputArray) {
    assert!(imgcodecs::imwrite(path.to_str().unwrap(), picture, &Vector::new()).unwrap());
}
