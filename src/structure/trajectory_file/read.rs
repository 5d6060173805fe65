//! Reading trajectory files.

use std::io::BufRead;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector4};

use super::decimal::scaled_integer;
use super::lines::Lines;
use super::{TrajectoryFileError, TrajectoryFormat, TrajectoryRow};
use crate::structure::PoseRow;

/// The most poses that are read from a file.
pub const MOST_TRAJECTORY_ROWS: usize = 10_000_000;

/// How far the norm of a quaternion may be from 1; the four decimals of TUM's leave 1e-4.
const NORM_TOLERANCE: f64 = 0.01;

/// How far the rows of a rotation matrix may be from orthonormal; six digits leave 2e-6.
const MATRIX_TOLERANCE: f64 = 0.001;

/// The poses of a trajectory file, in the file's order.
///
/// Empty lines, lines that begin with `#`, blanks at the ends of a line, a byte order mark and either kind of line end
/// are passed over. Stamps must rise from line to line. Quaternions keep their digits.
///
/// * `format` — guessed from the first row when `None`: commas are EuRoC's, eight numbers TUM's, twelve KITTI's.
///
/// # Errors
/// [`TrajectoryFileError::Content`] with the line for a row that has too few or too many numbers, a number that is none or
/// is not finite, a quaternion or matrix that is no rotation, or a stamp that does not rise; for a file without a pose,
/// with more than [`MOST_TRAJECTORY_ROWS`], or larger than [`super::LARGEST_TRAJECTORY_FILE_BYTES`].
pub fn read_trajectory(
    input: impl BufRead,
    format: Option<TrajectoryFormat>,
) -> Result<Vec<TrajectoryRow>, TrajectoryFileError> {
    let mut lines = Lines::new(input);
    let mut format = format;
    let mut rows: Vec<TrajectoryRow> = Vec::new();
    let mut header_seen = false;
    while let Some((line, text)) = lines.next()? {
        if rows.is_empty()
            && !header_seen
            && is_header(text)
            && format.is_none_or(|f| f == TrajectoryFormat::Euroc)
        {
            header_seen = true;
            format = Some(TrajectoryFormat::Euroc);
            continue;
        }
        let known = match format {
            Some(format) => format,
            None => guess(line, text)?,
        };
        format = Some(known);
        let row = parse(known, line, text)?;
        if let Some((before, stamp)) = rows.last().and_then(|row| row.stamp_nanos).zip(row.stamp_nanos)
            && stamp <= before
        {
            let expected = format!("a stamp after {before} ns");
            return Err(TrajectoryFileError::content(line, &expected, format!("{stamp} ns")));
        }
        if rows.len() == MOST_TRAJECTORY_ROWS {
            return Err(TrajectoryFileError::content(
                line,
                &format!("at most {MOST_TRAJECTORY_ROWS} poses"),
                "more",
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(TrajectoryFileError::content(None, "a pose", "none"));
    }
    Ok(rows)
}

/// Whether a line names columns separated by commas.
fn is_header(text: &str) -> bool {
    text.contains(',') && text.starts_with(|first: char| first.is_ascii_alphabetic())
}

fn guess(line: usize, text: &str) -> Result<TrajectoryFormat, TrajectoryFileError> {
    if text.contains(',') {
        return Ok(TrajectoryFormat::Euroc);
    }
    match text.split_ascii_whitespace().count() {
        8 => Ok(TrajectoryFormat::Tum),
        12 => Ok(TrajectoryFormat::Kitti),
        count => {
            let expected = "8 numbers (TUM), 12 numbers (KITTI) or 8 columns with commas (EuRoC)";
            Err(TrajectoryFileError::content(line, expected, format!("{count} fields")))
        }
    }
}

fn parse(format: TrajectoryFormat, line: usize, text: &str) -> Result<TrajectoryRow, TrajectoryFileError> {
    let (stamp_nanos, pose) = match format {
        TrajectoryFormat::Tum => {
            let [stamp, numbers @ ..]: [&str; 8] = fields(line, text.split_ascii_whitespace(), true)?;
            (
                Some(stamp_of(line, stamp, 9, "a stamp in seconds")?),
                quaternion_row(line, numbers, [3, 4, 5, 6])?,
            )
        }
        TrajectoryFormat::Euroc => {
            let [stamp, numbers @ ..]: [&str; 8] = fields(line, text.split(',').map(str::trim), false)?;
            let expected = "a whole stamp in nanoseconds (EuRoC; files of TUM have seconds, and spaces in place of commas)";
            if has_fraction(stamp) {
                return Err(TrajectoryFileError::content(line, expected, format!("`{stamp}`")));
            }
            (Some(stamp_of(line, stamp, 0, expected)?), quaternion_row(line, numbers, [4, 5, 6, 3])?)
        }
        TrajectoryFormat::Kitti => {
            (None, matrix_row(line, fields(line, text.split_ascii_whitespace(), true)?)?)
        }
    };
    Ok(TrajectoryRow { line, stamp_nanos, pose })
}

/// The first `N` fields of a line.
fn fields<'a, const N: usize>(
    line: usize,
    mut found: impl Iterator<Item = &'a str>,
    no_more: bool,
) -> Result<[&'a str; N], TrajectoryFileError> {
    let mut fields = [""; N];
    for (count, field) in fields.iter_mut().enumerate() {
        *field = found
            .next()
            .ok_or_else(|| TrajectoryFileError::content(line, &format!("{N} numbers"), format!("{count}")))?;
    }
    if no_more && found.next().is_some() {
        return Err(TrajectoryFileError::content(line, &format!("{N} numbers"), "more"));
    }
    Ok(fields)
}

fn stamp_of(line: usize, text: &str, shift: i32, expected: &str) -> Result<i64, TrajectoryFileError> {
    scaled_integer(text, shift)
        .ok_or_else(|| TrajectoryFileError::content(line, expected, format!("`{text}`")))
}

/// Whether a number is written with digits behind the point that are not all zero.
fn has_fraction(text: &str) -> bool {
    let fraction = text.split_once('.').map_or("", |(_, fraction)| fraction);
    !fraction.contains(['e', 'E']) && fraction.contains(|digit: char| ('1'..='9').contains(&digit))
}

fn numbers<const N: usize>(line: usize, texts: [&str; N]) -> Result<[f64; N], TrajectoryFileError> {
    let mut numbers = [0.0; N];
    for (number, text) in numbers.iter_mut().zip(texts) {
        *number = text
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| TrajectoryFileError::content(line, "a finite number", format!("`{text}`")))?;
    }
    Ok(numbers)
}

/// A pose of seven numbers; `xyzw` says where among them the quaternion's stand.
fn quaternion_row(line: usize, texts: [&str; 7], xyzw: [usize; 4]) -> Result<PoseRow, TrajectoryFileError> {
    let found = numbers(line, texts)?;
    let rotation_xyzw = xyzw.map(|at| found[at]);
    let norm = Vector4::from(rotation_xyzw).norm();
    // Infinite for numbers whose squares overflow.
    if (norm - 1.0).abs() > NORM_TOLERANCE {
        return Err(TrajectoryFileError::content(line, "a quaternion of norm 1", format!("norm {norm}")));
    }
    Ok(PoseRow { translation: [found[0], found[1], found[2]], rotation_xyzw })
}

fn matrix_row(line: usize, texts: [&str; 12]) -> Result<PoseRow, TrajectoryFileError> {
    let [a, b, c, x, d, e, f, y, g, h, i, z] = numbers(line, texts)?;
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    let defect = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    // Written so that a NaN, made of numbers whose squares overflow, is refused.
    let rotates = defect <= MATRIX_TOLERANCE && matrix.determinant() > 0.0;
    if !rotates {
        return Err(TrajectoryFileError::content(line, "a rotation matrix", matrix_words(&matrix, defect)));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let quaternion = rotation.coords.normalize();
    Ok(PoseRow { translation: [x, y, z], rotation_xyzw: quaternion.into() })
}

fn matrix_words(matrix: &Matrix3<f64>, defect: f64) -> String {
    if defect <= MATRIX_TOLERANCE {
        format!("a reflection, determinant {}", matrix.determinant())
    } else {
        format!("rows that are {defect} from orthonormal")
    }
}
