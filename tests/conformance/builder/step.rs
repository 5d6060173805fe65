//! Statistics of a frame that need its camera or the frame before it: covered cells, motion, what both show.

use std::collections::BTreeMap;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

use super::document::{Cell, Document, Table};

type Pixels = BTreeMap<i64, [f64; 4]>;

/// What is needed of one frame.
struct Seen {
    camera: Option<Value>,
    pose: Option<(Vector3<f64>, UnitQuaternion<f64>)>,
    points: Pixels,
    lines: Pixels,
    segments: Vec<[f64; 4]>,
    dots: Vec<[f64; 2]>,
}

impl Seen {
    fn new(document: &Document, tables: [Option<&Table>; 2], frame: i64) -> Self {
        let frames = document.table("frames");
        let row = frames.and_then(|frames| {
            (0..frames.rows.len()).find(|row| frames.int(*row, "frame_id") == frame).map(|row| (frames, row))
        });
        let cameras = document.manifest["cameras"].as_array();
        let camera = row.and_then(|(frames, row)| {
            let id = frames.int(row, "camera_id");
            cameras?.iter().find(|camera| camera["camera_id"].as_i64() == Some(id)).cloned()
        });
        let pose = row.and_then(|(frames, row)| {
            let number = |name: &str| frames.cell(row, &format!("world_from_camera_{name}"))?.float();
            let turn = Quaternion::new(number("qw")?, number("qx")?, number("qy")?, number("qz")?);
            let place = Vector3::new(number("tx")?, number("ty")?, number("tz")?);
            let usable = turn.norm() > 1e-6 && turn.norm().is_finite() && place.norm().is_finite();
            usable.then(|| (place, UnitQuaternion::from_quaternion(turn)))
        });
        let (mut points, mut lines) = (Pixels::new(), Pixels::new());
        let (mut segments, mut dots) = (Vec::new(), Vec::new());
        let [point_table, line_table] = tables;
        for (table, row) in rows_of(point_table, frame) {
            let [u, v] = ["u", "v"].map(|name| table.float(row, name));
            dots.push([u, v]);
            points.entry(table.int(row, "point_id")).or_insert([u, v, 0.0, 0.0]);
        }
        for (table, row) in rows_of(line_table, frame) {
            let ends = ["start_u", "start_v", "end_u", "end_v"].map(|name| table.float(row, name));
            segments.push(ends);
            lines.entry(table.int(row, "line_id")).or_insert(ends);
        }
        Self { camera, pose, points, lines, segments, dots }
    }

    /// Direction in `world` in which a pixel looks.
    fn ray(&self, [u, v, ..]: [f64; 4]) -> Option<Vector3<f64>> {
        let camera = self.camera.as_ref()?;
        let number = |name: &str| camera[name].as_f64();
        let in_camera =
            Vector3::new((u - number("cx")?) / number("fx")?, (v - number("cy")?) / number("fy")?, 1.0);
        Some(self.pose?.1 * in_camera)
    }

    /// Cells of the image with a point, or any part of a segment; each cell is asked by itself.
    fn covered(&self) -> Option<i64> {
        let camera = self.camera.as_ref()?;
        let cells = |name: &str| Some(camera[name].as_u64()?.div_ceil(10)).filter(|cells| *cells < 1000);
        let mut count = 0;
        for row in 0..cells("height")? {
            for column in 0..cells("width")? {
                let least = [column as f64 * 10.0, row as f64 * 10.0];
                let within = |pixel: &[f64; 2]| {
                    pixel.iter().zip(least).all(|(x, least)| (least..least + 10.0).contains(x))
                };
                let meets = |ends: &[f64; 4]| crosses(*ends, least);
                count += i64::from(self.dots.iter().any(within) || self.segments.iter().any(meets));
            }
        }
        Some(count)
    }
}

fn rows_of(table: Option<&Table>, frame: i64) -> impl Iterator<Item = (&Table, usize)> {
    table.into_iter().flat_map(move |table| {
        (0..table.rows.len())
            .filter(move |row| table.int(*row, "frame_id") == frame)
            .map(move |row| (table, row))
    })
}

/// Whether a segment has a point in the half-open cell that begins at `least`.
fn crosses([u0, v0, u1, v1]: [f64; 4], least: [f64; 2]) -> bool {
    // Parts of the way in the cell; an end of the interval that is not in it is open.
    let (mut low, mut high) = ((0.0, false), (1.0, false));
    for (from, to, least) in [(u0, u1, least[0]), (v0, v1, least[1])] {
        let by = to - from;
        if by == 0.0 {
            if !(least..least + 10.0).contains(&from) {
                return false;
            }
            continue;
        }
        let (first, last) = ((least - from) / by, (least + 10.0 - from) / by);
        let (first, last) =
            if by > 0.0 { ((first, false), (last, true)) } else { ((last, true), (first, false)) };
        low = if first.0 > low.0 || (first.0 == low.0 && first.1) { first } else { low };
        high = if last.0 < high.0 || (last.0 == high.0 && last.1) { last } else { high };
    }
    low.0 < high.0 || (low.0 == high.0 && !low.1 && !high.1)
}

/// The columns after the structural constraints, for the frame at a place among all frames.
pub(crate) fn columns(
    document: &Document,
    tables: [Option<&Table>; 2],
    frames: &[i64],
    place: usize,
) -> Vec<Cell> {
    let here = Seen::new(document, tables, frames[place]);
    let covered = here.covered().map_or(Cell::Null, Cell::Int);
    let Some(before) = place.checked_sub(1).map(|place| Seen::new(document, tables, frames[place])) else {
        return vec![covered, Cell::Null, Cell::Null, Cell::Null, Cell::Null, Cell::Null];
    };
    let poses = before.pose.zip(here.pose);
    let rotation = poses.map(|(before, here)| before.1.angle_to(&here.1));
    let translation = poses.map(|(before, here)| (here.0 - before.0).norm());
    let both = |one: &Pixels, other: &Pixels| {
        one.iter().filter_map(|(id, from)| Some((*from, *other.get(id)?))).collect::<Vec<_>>()
    };
    let points = both(&before.points, &here.points);
    let lines = both(&before.lines, &here.lines);
    let angles = points.iter().filter_map(|(from, to)| Some(before.ray(*from)?.angle(&here.ray(*to)?)));
    let mut angles: Vec<f64> = angles.filter(|angle| angle.is_finite()).collect();
    angles.sort_by(f64::total_cmp);
    let middle = angles.len() / 2;
    let parallax = match angles.len() {
        0 => None,
        even if even % 2 == 0 => Some((angles[middle - 1] + angles[middle]) / 2.0),
        _ => Some(angles[middle]),
    };
    let count = |length: usize| Cell::Int(i64::try_from(length).unwrap_or(i64::MAX));
    vec![
        covered,
        rotation.into(),
        translation.into(),
        count(points.len()),
        count(lines.len()),
        parallax.into(),
    ]
}
