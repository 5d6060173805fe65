//! The kinds of files that datasets consist of.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::Shot;
use crate::simulate::Error;

fn failed(path: &Path) -> impl Fn(io::Error) -> Error + '_ {
    move |source| Error::Io { path: path.to_owned(), source }
}

/// Makes a folder.
pub(super) fn folder(path: &Path) -> Result<(), Error> {
    fs::create_dir(path).map_err(failed(path))
}

/// Writes a text file.
pub(super) fn text(path: &Path, text: &str) -> Result<(), Error> {
    fs::write(path, text).map_err(failed(path))
}

/// Writes the picture as an 8-bit RGB PNG.
pub(super) fn picture(path: &Path, shot: &Shot) -> Result<(), Error> {
    png(path, shot, png::ColorType::Rgb, png::BitDepth::Eight, &shot.rgb)
}

/// Writes the depth map as a 16-bit grey PNG.
///
/// * `per_metre` — steps in a metre; what is nearer than half a step, farther than 65535 steps or nowhere is 0.
pub(super) fn depth_picture(path: &Path, shot: &Shot, per_metre: f64) -> Result<(), Error> {
    let bytes: Vec<u8> =
        shot.depth_m.iter().flat_map(|depth| steps(*depth, per_metre).to_be_bytes()).collect();
    png(path, shot, png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes)
}

/// A depth in whole steps; 0 where it cannot be said.
pub(super) fn steps(depth_m: f64, per_metre: f64) -> u16 {
    let steps = (depth_m * per_metre).round();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "looked at")]
    if (1.0..=65535.0).contains(&steps) { steps as u16 } else { 0 }
}

fn png(
    path: &Path,
    shot: &Shot,
    color: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
) -> Result<(), Error> {
    let file = File::create(path).map_err(failed(path))?;
    let mut output = BufWriter::new(file);
    let mut encoded = || -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(&mut output, shot.width, shot.height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(bytes)?;
        writer.finish()
    };
    encoded().map_err(|error| failed(path)(error.into()))?;
    output.flush().map_err(failed(path))
}

/// Writes the depth map as a NumPy array: `(rows, columns)`, 32-bit floating point, little-endian, C order, metres.
///
/// * `nowhere_m` — what stands where there is no surface.
pub(super) fn depth_array(path: &Path, shot: &Shot, nowhere_m: f32) -> Result<(), Error> {
    let file = File::create(path).map_err(failed(path))?;
    let mut output = BufWriter::new(file);
    let mut encoded = || -> io::Result<()> {
        output.write_all(&array_header(shot.height, shot.width))?;
        for depth in &shot.depth_m {
            #[expect(clippy::cast_possible_truncation, reason = "the array has 32 bits")]
            let depth = *depth as f32;
            output.write_all(&if depth.is_finite() { depth } else { nowhere_m }.to_le_bytes())?;
        }
        output.flush()
    };
    encoded().map_err(failed(path))
}

/// What stands before the numbers, as NumPy writes it: filled with blanks to a multiple of 64 bytes.
fn array_header(rows: u32, columns: u32) -> Vec<u8> {
    let mut words = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // Magic, version and the length of what follows are ten bytes, the line's end is one.
    let length = (words.len() + 11).next_multiple_of(64) - 10;
    words.extend(std::iter::repeat_n(' ', length - 1 - words.len()));
    words.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    #[expect(clippy::cast_possible_truncation, reason = "128 bytes for any size")]
    header.extend((length as u16).to_le_bytes());
    header.extend(words.into_bytes());
    header
}
