//! The members of a result archive as evo reads it (`evo_res`).

use serde_json::json;

use super::association::path_m;
use super::{Absolute, Error, Errors, Relation, Relative};

/// A member of an archive: its name and its bytes.
pub type Member = (String, Vec<u8>);

/// What a result archive says about its origin.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultNames {
    /// Name of the reference.
    pub reference: String,
    /// Name of the estimate.
    pub estimate: String,
    /// The alignment in words.
    pub alignment: String,
    /// The distance between the poses of a pair in words; of relative errors alone.
    pub step: String,
}

/// The members of evo's archive of absolute errors of a relation: `info.json`, `stats.json` and one `.npy` for each array.
///
/// * `stamps_nanos` — of the matched poses, nanoseconds.
///
/// # Errors
/// Those of [`Absolute::errors`].
pub fn absolute_members<I: Copy>(
    absolute: &Absolute<I>,
    relation: Relation,
    names: &ResultNames,
    stamps_nanos: &[i64],
) -> Result<Vec<Member>, Error> {
    let errors = absolute.errors(relation)?;
    let title =
        format!("APE w.r.t. {} ({})\n({} alignment)", relation.name(), unit(relation), names.alignment);
    let places: Vec<usize> = (0..absolute.ids.len()).collect();
    Ok(members("APE", &title, &errors, names, absolute, &places, stamps_nanos))
}

/// The members of evo's archive of relative errors of a relation; an error stands with the pose at which its pair ends.
///
/// * `absolute` — of the same poses with the same alignment.
/// * `stamps_nanos` — of the matched poses, nanoseconds.
///
/// # Errors
/// Those of [`Relative::errors`].
pub fn relative_members<I: Copy>(
    relative: &Relative<I>,
    absolute: &Absolute<I>,
    relation: Relation,
    names: &ResultNames,
    stamps_nanos: &[i64],
) -> Result<Vec<Member>, Error> {
    let errors = relative.errors(relation)?;
    let title = format!(
        "RPE w.r.t. {} ({})\nfor delta = {}\n({} alignment)",
        relation.name(),
        unit(relation),
        names.step,
        names.alignment
    );
    // Of a ratio, pairs without motion are left out, and so the places would not be those of the errors.
    let ends = if errors.values().len() == relative.ends.len() { relative.ends.as_slice() } else { &[] };
    Ok(members("RPE", &title, &errors, names, absolute, ends, stamps_nanos))
}

fn unit(relation: Relation) -> &'static str {
    match relation.unit() {
        "1" => "unit-less",
        unit => unit,
    }
}

fn members<I>(
    metric: &str,
    title: &str,
    errors: &Errors,
    names: &ResultNames,
    absolute: &Absolute<I>,
    places: &[usize],
    stamps_nanos: &[i64],
) -> Vec<Member> {
    let info = json!({
        "title": title,
        "ref_name": names.reference,
        "est_name": names.estimate,
        "label": format!("{metric} ({})", unit(errors.relation())),
    });
    let named = errors.statistics().named().map(|(name, value)| (name.to_owned(), json!(value)));
    let stats = serde_json::Value::Object(named.into_iter().collect());
    let mut members = vec![
        ("info.json".to_owned(), info.to_string().into_bytes()),
        ("stats.json".to_owned(), stats.to_string().into_bytes()),
        ("error_array.npy".to_owned(), npy(errors.values(), None)),
    ];
    let mut add = |name: &str, of_poses: &[f64]| {
        let picked: Vec<f64> = places.iter().filter_map(|place| of_poses.get(*place)).copied().collect();
        if picked.len() == errors.values().len() {
            members.push((format!("{name}.npy"), npy(&picked, None)));
        }
    };
    let first = stamps_nanos.first().copied().unwrap_or(0);
    let since: Vec<f64> =
        stamps_nanos.iter().map(|stamp| (i128::from(*stamp) - i128::from(first)) as f64 * 1e-9).collect();
    add("seconds_from_start", &since);
    add("timestamps", &stamps_nanos.iter().map(|stamp| seconds(*stamp)).collect::<Vec<_>>());
    add("distances_from_start", &absolute.path_m);
    add("distances", &path_m(&absolute.aligned.estimate));
    let moved = &absolute.reference_from_estimate;
    let (rotation, translation) = (moved.pose.rotation_matrix() * moved.scale, moved.pose.translation());
    let row = |row: usize| [rotation[(row, 0)], rotation[(row, 1)], rotation[(row, 2)], translation[row]];
    let matrix = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat();
    members.push(("alignment_transformation_sim3.npy".to_owned(), npy(&matrix, Some((4, 4)))));
    members
}

/// Nanoseconds as seconds, with one rounding for stamps up to some thousand years.
fn seconds(stamp_nanos: i64) -> f64 {
    let (whole, rest) = (stamp_nanos.div_euclid(1_000_000_000), stamp_nanos.rem_euclid(1_000_000_000));
    whole as f64 + rest as f64 * 1e-9
}

/// Numbers as `NumPy` stores them, version 1.0 of its format.
fn npy(numbers: &[f64], shape: Option<(usize, usize)>) -> Vec<u8> {
    /// The header ends where data is aligned to so many bytes.
    const ALIGNMENT: usize = 64;
    let shape = match shape {
        Some((rows, columns)) => format!("({rows}, {columns})"),
        None => format!("({},)", numbers.len()),
    };
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let begun = b"\x93NUMPY\x01\x00".len() + 2;
    let padding = ALIGNMENT - (begun + header.len() + 1) % ALIGNMENT;
    header.extend(std::iter::repeat_n(' ', padding % ALIGNMENT));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // A header of a shape of two numbers is far shorter than 65 536 bytes.
    bytes.extend(u16::try_from(header.len()).unwrap_or(u16::MAX).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_begin_at_a_multiple_of_64_bytes() {
        for count in [0, 1, 9, 99_999] {
            let bytes = npy(&vec![1.5; count], None);
            let start = bytes.len() - 8 * count;
            assert_eq!((start % 64, bytes[start - 1]), (0, b'\n'));
            assert_eq!(start - 10, usize::from(bytes[8]) + 256 * usize::from(bytes[9]));
        }
    }
}
