//! Files of depth maps.

use std::path::Path;

use npyz::{DType, NpyHeader, Order};
use open_structure::geometry::PinholeCamera;
use opencv::core::{Mat, MatTraitConstManual, Vec4b};

use super::depth_map::Samples;
use super::picture::{self, PngKind};
use super::{DepthFormat, Error};

/// Bytes of the longest header of an array: NumPy writes 128 for one with two dimensions.
const MAX_HEADER: usize = 1024;

/// Depths of a file, row by row, metres; not all are finite or positive.
///
/// # Errors
/// [`Error::Io`]; [`Error::Image`] for what is not of the format or not as large as the camera's image.
pub(super) fn read(path: &Path, format: DepthFormat, camera: &PinholeCamera) -> Result<Samples, Error> {
    let size = [camera.width, camera.height];
    match format {
        DepthFormat::Png { steps_per_metre } => steps(path, size, steps_per_metre).map(Samples::Metres),
        DepthFormat::Npy => array(path, size),
        DepthFormat::FloatPng => float_picture(path, size).map(Samples::Metres),
        DepthFormat::RayText { units_per_metre } => rays(path, camera, units_per_metre).map(Samples::Metres),
    }
}

/// A picture of 16 bits; 0, where there is no depth, stays 0.
fn steps(path: &Path, size: [u32; 2], steps_per_metre: f64) -> Result<Vec<f32>, Error> {
    let kind = PngKind { bits: 16, color: 0 };
    let picture = picture::png(path, size, kind, "a depth map: a PNG picture of 16 bits, grey")?;
    #[expect(clippy::cast_possible_truncation, reason = "24 bits hold 16")]
    let metres = |steps: &u16| (f64::from(*steps) / steps_per_metre) as f32;
    Ok(numbers::<u16>(path, &picture)?.iter().map(metres).collect())
}

/// A picture of four times 8 bits, which are those of a floating point number.
///
/// The dataset's tools write the bytes of each number, the lowest first, as blue, green, red and opacity.
fn float_picture(path: &Path, size: [u32; 2]) -> Result<Vec<f32>, Error> {
    let kind = PngKind { bits: 8, color: 6 };
    let told = "a depth map: a PNG picture of four times 8 bits, which are those of a floating point number";
    let picture = picture::png(path, size, kind, told)?;
    Ok(numbers::<Vec4b>(path, &picture)?.iter().map(|pixel| f32::from_le_bytes(pixel.0)).collect())
}

fn numbers<'a, T: opencv::core::DataType>(path: &Path, picture: &'a Mat) -> Result<&'a [T], Error> {
    picture
        .data_typed::<T>()
        .map_err(|error| Error::image(path, "numbers of the header's kind", error.message))
}

/// A NumPy array of 32-bit floating point numbers, rows then columns.
fn array(path: &Path, [width, height]: [u32; 2]) -> Result<Samples, Error> {
    let expected = format!("a NumPy array of 32-bit floating point numbers (<f4), shape ({height}, {width})");
    let wrong = |found: String| Error::image(path, &expected, found);
    let bytes = picture::bytes(path, [width, height])?;
    let length = header_length(&bytes).ok_or_else(|| wrong("another kind of file".to_owned()))?;
    let (header, data) =
        bytes.split_at_checked(length).ok_or_else(|| wrong("an incomplete file".to_owned()))?;
    let header = NpyHeader::from_reader(header).map_err(|error| wrong(error.to_string()))?;
    let kind = match header.dtype() {
        DType::Plain(kind) => kind.to_string(),
        _ => "records".to_owned(),
    };
    let order = if header.order() == Order::C { "" } else { ", columns first" };
    if kind != "<f4" || header.shape() != [u64::from(height), u64::from(width)] || !order.is_empty() {
        return Err(wrong(format!("{kind}, shape {:?}{order}", header.shape())));
    }
    let pixels = width as usize * height as usize;
    if data.len() != pixels * 4 {
        return Err(wrong(format!("{} B of numbers", data.len())));
    }
    Ok(Samples::LittleEndian { bytes, begin: length })
}

/// Bytes before the numbers of an array; `None` for another kind of file, or more than any array has.
fn header_length(bytes: &[u8]) -> Option<usize> {
    let version = *bytes.strip_prefix(b"\x93NUMPY")?.first()?;
    let length = if version == 1 {
        10 + usize::from(u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?))
    } else {
        12 + usize::try_from(u32::from_le_bytes(bytes.get(8..12)?.try_into().ok()?)).ok()?
    };
    (length <= MAX_HEADER).then_some(length)
}

/// Text: the distance along the ray of each pixel, row by row.
///
/// `z = d / √(x² + y² + 1)`, `x = (u − cx)/fx`, `y = (v − cy)/fy`.
fn rays(path: &Path, camera: &PinholeCamera, units_per_metre: f64) -> Result<Vec<f32>, Error> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let expected = format!("{} distances, one for each pixel", width * height);
    let bytes = picture::bytes(path, [camera.width, camera.height])?;
    let text = std::str::from_utf8(&bytes).map_err(|_| Error::image(path, &expected, "no text"))?;
    let mut depth_m = Vec::with_capacity(width * height);
    let mut words = text.split_ascii_whitespace();
    for row in 0..height {
        let y = (row as f64 - camera.cy) / camera.fy;
        for column in 0..width {
            let x = (column as f64 - camera.cx) / camera.fx;
            let word = words.next().ok_or_else(|| Error::image(path, &expected, depth_m.len()))?;
            let distance: f64 = word.parse().map_err(|_| {
                Error::image(path, &expected, format!("\"{}\"", word.chars().take(40).collect::<String>()))
            })?;
            #[expect(clippy::cast_possible_truncation, reason = "maps have 24 bits")]
            depth_m.push((distance / units_per_metre / (x * x + y * y + 1.0).sqrt()) as f32);
        }
    }
    if words.next().is_some() {
        return Err(Error::image(path, &expected, "more"));
    }
    Ok(depth_m)
}
