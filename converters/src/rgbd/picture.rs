//! Pictures: PNG and JPEG files.

use std::path::Path;

use opencv::core::{Mat, MatTraitConst};
use opencv::imgcodecs;

use super::{Error, list};

/// Bytes of a file for each pixel that are believed, and those of its other parts: more than any format needs.
const BYTES_PER_PIXEL: u64 = 64;
const OTHER_BYTES: u64 = 1 << 20;
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";

/// What the header of a PNG file says of its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PngKind {
    /// Bits of each number.
    pub(super) bits: u8,
    /// Kind of colour: 0 grey, 6 red, green, blue and opacity.
    pub(super) color: u8,
}

/// Bytes of an image file that can be no larger than an image of a size needs.
///
/// # Errors
/// [`Error::Io`]; [`Error::Image`] where there are more, or none.
pub(super) fn bytes(path: &Path, [width, height]: [u32; 2]) -> Result<Vec<u8>, Error> {
    let most = u64::from(width) * u64::from(height) * BYTES_PER_PIXEL + OTHER_BYTES;
    let bytes = list::bytes(path, most)?;
    let bytes = bytes.ok_or_else(|| Error::image(path, format!("at most {most} B"), "a larger file"))?;
    if bytes.is_empty() {
        return Err(Error::image(path, "an image", "an empty file"));
    }
    Ok(bytes)
}

/// A picture as brightness: 8 bits, one channel.
///
/// Its size is looked at before anything is decoded.
///
/// # Errors
/// [`Error::Io`]; [`Error::Image`] for what is neither PNG nor JPEG, damaged, or of another size.
pub(super) fn grey(path: &Path, size: [u32; 2]) -> Result<Mat, Error> {
    let bytes = bytes(path, size)?;
    let found = if bytes.starts_with(PNG) {
        let header = png_header(&bytes);
        if header.is_some_and(|(_, kind)| kind.bits == 16) {
            return Err(Error::image(path, "a picture of at most 8 bits", "one of 16, as depth maps are"));
        }
        header.map(|(size, _)| size)
    } else if bytes.starts_with(&[0xFF, 0xD8]) {
        // A file that was cut off would be decoded to its end and grey from there.
        jpeg_size(&bytes).filter(|_| bytes.windows(2).rev().any(|pair| pair == [0xFF, 0xD9]))
    } else {
        return Err(Error::image(path, "a PNG or JPEG picture", "another kind of file"));
    };
    same_size(path, found, size)?;
    decode(path, &bytes, imgcodecs::IMREAD_GRAYSCALE | imgcodecs::IMREAD_IGNORE_ORIENTATION, size)
}

/// A PNG picture with its numbers as they stand in the file.
///
/// * `kind` — what numbers are expected; `told` — the same, for people.
///
/// # Errors
/// [`Error::Io`]; [`Error::Image`] for what is no PNG, damaged, of another size or with other numbers.
pub(super) fn png(path: &Path, size: [u32; 2], kind: PngKind, told: &str) -> Result<Mat, Error> {
    let bytes = bytes(path, size)?;
    if !bytes.starts_with(PNG) {
        return Err(Error::image(path, told, "another kind of file"));
    }
    let header = png_header(&bytes);
    same_size(path, header.map(|(size, _)| size), size)?;
    if let Some((_, found)) = header
        && found != kind
    {
        let colour = match found.color {
            0 => "grey",
            2 => "red, green and blue",
            3 => "colours of a palette",
            4 => "grey and opacity",
            _ => "red, green, blue and opacity",
        };
        return Err(Error::image(path, told, format!("a PNG picture of {} bits, {colour}", found.bits)));
    }
    decode(path, &bytes, imgcodecs::IMREAD_UNCHANGED, size)
}

/// Refuses an image of another size than the camera's.
fn same_size(path: &Path, found: Option<[u32; 2]>, [width, height]: [u32; 2]) -> Result<(), Error> {
    match found {
        Some(found) if found == [width, height] => Ok(()),
        Some([w, h]) => {
            Err(Error::image(path, format!("{width} x {height} px, the camera's"), format!("{w} x {h} px")))
        }
        None => Err(Error::image(path, "a whole picture", "a damaged or incomplete file")),
    }
}

fn decode(path: &Path, bytes: &[u8], flags: i32, [width, height]: [u32; 2]) -> Result<Mat, Error> {
    let damaged = |_| Error::image(path, "a whole picture", "a damaged or incomplete file");
    let input = Mat::from_slice(bytes).map_err(damaged)?;
    let found = imgcodecs::imdecode(&input, flags).map_err(damaged)?;
    let size = [found.cols(), found.rows()].map(u32::try_from);
    if size != [Ok(width), Ok(height)] {
        return Err(Error::image(path, "a whole picture", "a damaged or incomplete file"));
    }
    Ok(found)
}

/// Size and numbers of a PNG picture.
fn png_header(bytes: &[u8]) -> Option<([u32; 2], PngKind)> {
    // Signature, length and name of the first chunk, then what it holds.
    let header = bytes.get(8..26)?;
    let number = |at: usize| Some(u32::from_be_bytes(header.get(at..at + 4)?.try_into().ok()?));
    (&header[4..8] == b"IHDR").then_some(())?;
    Some(([number(8)?, number(12)?], PngKind { bits: header[16], color: header[17] }))
}

/// Size of a JPEG picture.
fn jpeg_size(bytes: &[u8]) -> Option<[u32; 2]> {
    let mut at = 2;
    loop {
        if *bytes.get(at)? != 0xFF {
            return None;
        }
        let marker = *bytes.get(at + 1)?;
        match marker {
            // Filling.
            0xFF => at += 1,
            // Marks without anything behind them.
            0x01 | 0xD0..=0xD8 => at += 2,
            _ => {
                let number =
                    |place: usize| Some(u16::from_be_bytes([*bytes.get(place)?, *bytes.get(place + 1)?]));
                // The start of a frame, of any process.
                if matches!(marker, 0xC0..=0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF) {
                    return Some([number(at + 7)?.into(), number(at + 5)?.into()]);
                }
                if marker == 0xD9 || marker == 0xDA {
                    return None;
                }
                at += 2 + usize::from(number(at + 2)?.max(2));
            }
        }
    }
}
