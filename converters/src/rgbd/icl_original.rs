//! ICL-NUIM as its ray tracer wrote it: a camera for each frame, in the ray tracer's words.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use open_structure::geometry::Pose;
use open_structure::structure::FrameId;

use super::icl::{Opened, RATE_HZ};
use super::layout;
use super::list::List;
use super::raw_sequence::tick;
use super::{DepthFormat, DepthNoise, Error, Ledger, OpenOptions, RawFrame};

/// Text has six digits, of metres or of centimetres.
const DIGITS: DepthNoise = DepthNoise { constant_m: 1e-5, linear: 1e-6, quadratic_per_m: 0.0 };
/// What is shorter has no direction.
const SHORTEST: f64 = 1e-6;
/// Farther from the origin no camera is, units.
const FARTHEST: f64 = 1e9;

/// Frames of a folder.
pub(super) fn frames(root: &Path, options: &OpenOptions, ledger: &mut Ledger) -> Result<Opened, Error> {
    let mut numbers: BTreeMap<i64, String> = BTreeMap::new();
    let mut units_per_metre = None;
    for name in layout::names(root)? {
        let Some(stem) = name.strip_suffix(".txt") else { continue };
        let Some((number, units)) = numbered(stem) else { continue };
        if let Some((before, _)) = numbers.first_key_value().filter(|_| units_per_metre != Some(units)) {
            let expected = format!("names of one kind, as that of number {before}");
            return Err(Error::layout(root.join(&name), expected, "another kind"));
        }
        units_per_metre = Some(units);
        numbers.insert(number, stem.to_owned());
    }
    let units_per_metre = units_per_metre.unwrap_or(1.0);
    let mut frames = Vec::new();
    let mut missing = [0, 0];
    for (number, stem) in numbers {
        if !options.wants(number.cast_unsigned()) {
            continue;
        }
        let [colour, depth, camera] =
            ["png", "depth", "txt"].map(|ending| root.join(format!("{stem}.{ending}")));
        let absent = [&colour, &depth].map(|file| !file.is_file());
        missing[0] += u64::from(absent[0]);
        missing[1] += u64::from(absent[1]);
        if absent.contains(&true) {
            continue;
        }
        let list = List::read(camera)?;
        match pose(&list, units_per_metre) {
            Ok(world_from_camera) => {
                let stamp_nanos = tick(number, RATE_HZ);
                frames.push(RawFrame {
                    frame_id: FrameId(number),
                    stamp_nanos,
                    world_from_camera,
                    colour,
                    depth,
                });
            }
            Err(error) => ledger.refuse(error)?,
        }
    }
    ledger.count(root, "pictures that are not there", missing[0], None);
    ledger.count(root, "depth files that are not there", missing[1], None);
    Ok(Opened {
        frames,
        depth_format: DepthFormat::RayText { units_per_metre },
        depth_noise: DIGITS,
        // Cameras come with each image, and there are as many: they are no lists.
        files: Vec::new(),
    })
}

/// Number of a name, and units in a metre: `scene_00_0000` in metres, `scene_000` in centimetres.
fn numbered(stem: &str) -> Option<(i64, f64)> {
    let rest = stem.strip_prefix("scene_")?;
    let (digits, units) = rest.split_once('_').map_or((rest, 100.0), |(_, digits)| (digits, 1.0));
    if !digits.bytes().all(|c| c.is_ascii_digit()) {
        return None;
    }
    Some((digits.parse().ok()?, units))
}

/// The pose that the ray tracer's words say.
///
/// `z = dir / |dir|`, `x = up × z / |up × z|`, `y = z × x`: x right, y up in the image, z forward, right-handed.
///
/// # Source
/// The dataset's page, on how R and T are computed from its camera files.
fn pose(list: &List, units_per_metre: f64) -> Result<Pose, Error> {
    let mut found: [Option<Vector3<f64>>; 3] = [None; 3];
    for line in list.lines() {
        let words = ["cam_pos", "cam_dir", "cam_up"];
        let Some(which) = words.iter().position(|word| line.fields.first() == Some(word)) else { continue };
        let vector = vector(&line.fields).filter(|vector| vector.amax() <= FARTHEST);
        found[which] = Some(vector.ok_or_else(|| line.wrong(format!("{} = [x, y, z]'", words[which])))?);
    }
    let [Some(position), Some(direction), Some(up)] = found else {
        return Err(Error::line(
            &list.path,
            1,
            "cam_pos, cam_dir and cam_up = [x, y, z]'",
            "not all of them",
        ));
    };
    let axes = direction.try_normalize(SHORTEST).and_then(|z| {
        let x = up.cross(&z).try_normalize(SHORTEST)?;
        Some(Matrix3::from_columns(&[x, z.cross(&x), z]))
    });
    let axes =
        axes.ok_or_else(|| Error::line(&list.path, 1, "cam_dir and cam_up that span a plane", "one line"))?;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Ok(Pose::new(rotation, position / units_per_metre))
}

/// The vector of `word = [x, y, z]';`, of which the fields are parts.
fn vector(fields: &[&str]) -> Option<Vector3<f64>> {
    let all = fields.join(" ");
    let inside = all.split_once('[')?.1.split_once(']')?.0;
    let numbers: Vec<f64> = inside.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
    match numbers.as_slice() {
        [x, y, z] if numbers.iter().all(|number| number.is_finite()) => Some(Vector3::new(*x, *y, *z)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_tell_their_unit_by_their_names() {
        assert_eq!(numbered("scene_00_0017"), Some((17, 1.0)));
        assert_eq!(numbered("scene_017"), Some((17, 100.0)));
        for other in ["scene_", "scene_00_", "scene_00_a", "scenes_000", "scene_00_1_2", "scene_-1"] {
            assert_eq!(numbered(other), None, "{other}");
        }
    }
}
