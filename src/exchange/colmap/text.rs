//! The three files of a COLMAP model as text, to the last digit.

use std::io::{BufRead, Write};

use super::model::{ColmapCamera, ColmapImage, ColmapModel, ColmapPoint, ColmapPoint2};
use crate::exchange::Error;
use crate::exchange::lines::{Fields, Lines, MOST_ELEMENTS, finite};

/// The most parameters that a camera model has; COLMAP's largest have 12.
const MOST_PARAMETERS: usize = 64;

/// Reads a model.
///
/// * `cameras`, `images`, `points` — `cameras.txt`, `images.txt`, `points3D.txt`.
///
/// # Errors
/// [`Error::Content`] with file and line for a number that is none or is not finite, a row that is cut short or goes on,
/// an image without its line of points, a negative id, or more than [`MOST_ELEMENTS`].
pub fn read_colmap(
    cameras: impl BufRead,
    images: impl BufRead,
    points: impl BufRead,
) -> Result<ColmapModel, Error> {
    Ok(ColmapModel {
        cameras: read_cameras(cameras)?,
        images: read_images(images)?,
        points: read_points(points)?,
    })
}

fn read_cameras(input: impl BufRead) -> Result<Vec<ColmapCamera>, Error> {
    let mut lines = Lines::new("cameras.txt", input);
    let mut cameras = Vec::new();
    while let Some(mut fields) = lines.fields()? {
        let id = fields.id("CAMERA_ID")?;
        let model = fields.word("MODEL")?.to_owned();
        let [width, height] = [size(&mut fields, "WIDTH")?, size(&mut fields, "HEIGHT")?];
        let mut parameters = Vec::new();
        while let Some(word) = fields.word_or_end() {
            if parameters.len() == MOST_PARAMETERS {
                return Err(fields.wrong(&format!("at most {MOST_PARAMETERS} parameters"), "more"));
            }
            parameters.push(finite(word).ok_or_else(|| fields.wrong("PARAMS, finite numbers", word))?);
        }
        counted(&cameras, &fields)?;
        cameras.push(ColmapCamera { id, model, width, height, parameters });
    }
    Ok(cameras)
}

fn size(fields: &mut Fields<'_>, what: &str) -> Result<u32, Error> {
    let word = fields.word(what)?;
    let wrong = || fields.wrong(&format!("{what}, a whole number of at least 1"), word);
    word.parse().ok().filter(|size: &u32| *size > 0).ok_or_else(wrong)
}

fn read_images(input: impl BufRead) -> Result<Vec<ColmapImage>, Error> {
    let mut lines = Lines::new("images.txt", input);
    let mut images = Vec::new();
    let mut total = 0;
    while let Some(mut fields) = lines.fields()? {
        let id = fields.id("IMAGE_ID")?;
        let rotation_wxyz = fields.numbers("QW QX QY QZ")?;
        let translation = fields.numbers("TX TY TZ")?;
        let camera = fields.id("CAMERA_ID")?;
        // A file name may have blanks in it.
        let mut name = fields.word("NAME")?.to_owned();
        while let Some(word) = fields.word_or_end() {
            name.push(' ');
            name.push_str(word);
        }
        counted(&images, &fields)?;
        // The line that follows has the points, and is empty where there are none.
        let number = lines.number();
        if lines.any()?.is_none() {
            // A last image without points may end the file.
            images.push(ColmapImage { id, rotation_wxyz, translation, camera, name, points: Vec::new() });
            break;
        }
        let mut fields = lines.fields_here();
        let mut points = Vec::new();
        while let Some(word) = fields.word_or_end() {
            if word.starts_with('#') && points.is_empty() {
                let expected = format!("the points of the image of line {number}");
                return Err(fields.wrong(&expected, "a comment"));
            }
            let u = finite(word).ok_or_else(|| fields.wrong("X, a finite number", word))?;
            let v = fields.number("Y")?;
            let word = fields.word("POINT3D_ID")?;
            // −1 as COLMAP writes it, or as an unsigned number holds it.
            let point = match word {
                "-1" | "18446744073709551615" => None,
                word => {
                    let id = word.parse().ok().filter(|id: &i64| *id >= 0);
                    Some(id.ok_or_else(|| fields.wrong("POINT3D_ID, an integer of at least −1", word))?)
                }
            };
            total += 1;
            if total > MOST_ELEMENTS {
                return Err(fields.wrong(&format!("at most {MOST_ELEMENTS} points in images"), "more"));
            }
            points.push(ColmapPoint2 { pixel: [u, v], point });
        }
        images.push(ColmapImage { id, rotation_wxyz, translation, camera, name, points });
    }
    Ok(images)
}

fn read_points(input: impl BufRead) -> Result<Vec<ColmapPoint>, Error> {
    let mut lines = Lines::new("points3D.txt", input);
    let mut points = Vec::new();
    let mut total = 0;
    while let Some(mut fields) = lines.fields()? {
        let id = fields.id("POINT3D_ID")?;
        let position = fields.numbers("X Y Z")?;
        let mut colour = [0; 3];
        for part in &mut colour {
            let word = fields.word("R G B")?;
            *part = word.parse().map_err(|_| fields.wrong("R G B, whole numbers up to 255", word))?;
        }
        let error = fields.number("ERROR")?;
        let mut track = Vec::new();
        while let Some(word) = fields.word_or_end() {
            let image = word.parse().ok().filter(|image: &i64| *image >= 0);
            let image = image.ok_or_else(|| fields.wrong("IMAGE_ID, an integer of at least 0", word))?;
            let place = fields.id("POINT2D_IDX")?;
            let place = usize::try_from(place).map_err(|_| fields.wrong("POINT2D_IDX", place))?;
            total += 1;
            if total > MOST_ELEMENTS {
                return Err(fields.wrong(&format!("at most {MOST_ELEMENTS} elements of tracks"), "more"));
            }
            track.push((image, place));
        }
        counted(&points, &fields)?;
        points.push(ColmapPoint { id, position, colour, error, track });
    }
    Ok(points)
}

/// Checks that one more may be read.
fn counted<T>(elements: &[T], fields: &Fields<'_>) -> Result<(), Error> {
    if elements.len() == MOST_ELEMENTS {
        return Err(fields.wrong(&format!("at most {MOST_ELEMENTS} rows"), "more"));
    }
    Ok(())
}

/// Writes a model as the three files that [`read_colmap`] reads to the same bits.
///
/// # Errors
/// [`Error::Io`] when an output fails.
pub fn write_colmap(
    cameras: &mut dyn Write,
    images: &mut dyn Write,
    points: &mut dyn Write,
    model: &ColmapModel,
) -> Result<(), Error> {
    writeln!(cameras, "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]")?;
    for camera in &model.cameras {
        write!(cameras, "{} {} {} {}", camera.id, camera.model, camera.width, camera.height)?;
        for number in &camera.parameters {
            write!(cameras, " {number:?}")?;
        }
        writeln!(cameras)?;
    }
    writeln!(images, "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME")?;
    writeln!(images, "# POINTS2D[] as (X, Y, POINT3D_ID)")?;
    for image in &model.images {
        write!(images, "{}", image.id)?;
        for number in image.rotation_wxyz.iter().chain(&image.translation) {
            write!(images, " {number:?}")?;
        }
        writeln!(images, " {} {}", image.camera, image.name)?;
        for (place, ColmapPoint2 { pixel: [u, v], point }) in image.points.iter().enumerate() {
            let blank = if place == 0 { "" } else { " " };
            write!(images, "{blank}{u:?} {v:?} {}", point.unwrap_or(-1))?;
        }
        writeln!(images)?;
    }
    writeln!(points, "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)")?;
    for ColmapPoint { id, position: [x, y, z], colour: [r, g, b], error, track } in &model.points {
        write!(points, "{id} {x:?} {y:?} {z:?} {r} {g} {b} {error:?}")?;
        for (image, place) in track {
            write!(points, " {image} {place}")?;
        }
        writeln!(points)?;
    }
    Ok(())
}
