//! What a SLAM system is given, as comma-separated values: for programs in any language, without a library of ours.

use std::fmt::Write;

use serde::Serialize;

use super::Error;
use super::text_file::{TextFile, check_finite};
use crate::structure::{Camera, Conventions, Noise, Sequence};

/// What `cameras.json` holds.
#[derive(Serialize)]
struct Given<'a> {
    sequence: &'a str,
    conventions: &'a Conventions,
    cameras: &'a [Camera],
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<&'a Noise>,
}

/// The measurements of a sequence as CSV files with a header, and its cameras and noise as `cameras.json`.
///
/// `frames.csv`, `point_measurements.csv`, `line_measurements.csv` and `structural_groups.csv` have the columns of the
/// tables; an absent depth is an empty field, and the lines of a group are apart by blanks. No file holds truth, and
/// groups have no direction, unless `with_truth`: then there are `true_poses.csv` (`world_from_camera`),
/// `point_landmarks.csv` and `line_landmarks.csv` as well, where the sequence has them. Numbers have all their digits.
///
/// # Errors
/// [`Error::Unfit`] for a number that is not finite.
pub fn to_csv(sequence: &Sequence, with_truth: bool) -> Result<Vec<TextFile>, Error> {
    let manifest = &sequence.manifest;
    let given = Given {
        sequence: &manifest.name,
        conventions: &manifest.conventions,
        cameras: &manifest.cameras,
        noise: manifest.noise.as_ref(),
    };
    let json = serde_json::to_string_pretty(&given)
        .map_err(|error| Error::unfit("cameras", "what JSON can say", error))?;
    let mut files = vec![TextFile::new("cameras.json", json + "\n")];
    let mut frames = "frame_id,stamp_nanos,camera_id\n".to_owned();
    for row in &sequence.frames {
        push(&mut frames, &[&row.frame_id.0, &row.stamp_nanos, &row.camera_id.0], &[])?;
    }
    files.push(TextFile::new("frames.csv", frames));
    let mut points = "frame_id,point_id,u,v,depth\n".to_owned();
    for row in &sequence.point_measurements {
        push(&mut points, &[&row.frame_id.0, &row.point_id.0], &[Some(row.u), Some(row.v), row.depth])?;
    }
    files.push(TextFile::new("point_measurements.csv", points));
    let mut lines = "frame_id,line_id,start_u,start_v,start_depth,end_u,end_v,end_depth\n".to_owned();
    for row in &sequence.line_measurements {
        let [start, end] = [
            [Some(row.start_u), Some(row.start_v), row.start_depth],
            [Some(row.end_u), Some(row.end_v), row.end_depth],
        ];
        push(&mut lines, &[&row.frame_id.0, &row.line_id.0], &[start, end].concat())?;
    }
    files.push(TextFile::new("line_measurements.csv", lines));
    let direction = if with_truth { ",direction_x,direction_y,direction_z" } else { "" };
    let mut groups = format!("group_id,kind,line_ids{direction}\n");
    for row in &sequence.structural_groups {
        let ids: Vec<String> = row.line_ids.iter().map(|id| id.0.to_string()).collect();
        // A kind is any text in an open registry.
        let kind = format!("\"{}\"", row.kind.replace('"', "\"\""));
        let direction = [row.direction_x, row.direction_y, row.direction_z];
        push(
            &mut groups,
            &[&row.group_id.0, &kind, &ids.join(" ")],
            if with_truth { &direction } else { &[] },
        )?;
    }
    files.push(TextFile::new("structural_groups.csv", groups));
    if with_truth {
        truth(sequence, &mut files)?;
    }
    Ok(files)
}

fn truth(sequence: &Sequence, files: &mut Vec<TextFile>) -> Result<(), Error> {
    let mut poses = "frame_id,tx,ty,tz,qx,qy,qz,qw\n".to_owned();
    for row in &sequence.frames {
        if let Some(pose) = row.world_from_camera() {
            push(&mut poses, &[&row.frame_id.0], &pose.numbers().map(Some))?;
        }
    }
    files.push(TextFile::new("true_poses.csv", poses));
    let mut points = "point_id,x,y,z\n".to_owned();
    for row in &sequence.point_landmarks {
        push(&mut points, &[&row.point_id.0], &[row.x, row.y, row.z].map(Some))?;
    }
    files.push(TextFile::new("point_landmarks.csv", points));
    let mut lines = "line_id,start_x,start_y,start_z,end_x,end_y,end_z\n".to_owned();
    for row in &sequence.line_landmarks {
        let ends = [row.start_x, row.start_y, row.start_z, row.end_x, row.end_y, row.end_z];
        push(&mut lines, &[&row.line_id.0], &ends.map(Some))?;
    }
    files.push(TextFile::new("line_landmarks.csv", lines));
    Ok(())
}

/// Appends a row: names first, then numbers.
fn push(text: &mut String, names: &[&dyn std::fmt::Display], numbers: &[Option<f64>]) -> Result<(), Error> {
    let begin = text.len();
    for name in names {
        let comma = if text.len() == begin { "" } else { "," };
        // Writing to a string does not fail.
        let _ = write!(text, "{comma}{name}");
    }
    for number in numbers {
        text.push(',');
        if let Some(number) = number {
            let row = || text.get(begin..).unwrap_or_default().to_owned();
            check_finite(row, &[*number])?;
            let _ = write!(text, "{number:?}");
        }
    }
    text.push('\n');
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{
        CameraId, Frame, FrameId, GroupId, LineId, LineMeasurement, PointId, PointMeasurement, PoseRow,
        StructuralGroup,
    };

    fn sample() -> Sequence {
        let pose = PoseRow { translation: [1.0, 2.0, 3.0], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        Sequence {
            frames: vec![Frame::new(FrameId(4), 1_500_000_000, CameraId(0), Some(pose))],
            point_measurements: vec![PointMeasurement {
                frame_id: FrameId(4),
                point_id: PointId(9),
                u: 0.1,
                v: -2.5,
                depth: None,
            }],
            line_measurements: vec![LineMeasurement {
                frame_id: FrameId(4),
                line_id: LineId(2),
                start_u: 1.0,
                start_v: 2.0,
                start_depth: Some(3.0),
                end_u: 4.0,
                end_v: 5.0,
                end_depth: None,
            }],
            structural_groups: vec![StructuralGroup {
                group_id: GroupId(1),
                kind: "a \"kind\"".to_owned(),
                direction_x: Some(1.0),
                direction_y: Some(0.0),
                direction_z: Some(0.0),
                line_ids: vec![LineId(2), LineId(7)],
            }],
            ..Sequence::default()
        }
    }

    fn text(files: &[TextFile], name: &str) -> Option<String> {
        files.iter().find(|file| file.name == name).map(|file| file.text.clone())
    }

    #[test]
    fn absent_depths_are_empty_and_there_is_no_truth() {
        let files = to_csv(&sample(), false).unwrap();
        let told = |name| text(&files, name).unwrap();
        assert_eq!(told("frames.csv"), "frame_id,stamp_nanos,camera_id\n4,1500000000,0\n");
        assert_eq!(told("point_measurements.csv"), "frame_id,point_id,u,v,depth\n4,9,0.1,-2.5,\n");
        assert!(told("line_measurements.csv").ends_with("\n4,2,1.0,2.0,3.0,4.0,5.0,\n"));
        assert_eq!(told("structural_groups.csv"), "group_id,kind,line_ids\n1,\"a \"\"kind\"\"\",2 7\n");
        assert_eq!(text(&files, "true_poses.csv"), None);
        assert!(files.iter().all(|file| !file.text.contains("direction")));
    }

    #[test]
    fn truth_comes_when_it_is_asked_for() {
        let files = to_csv(&sample(), true).unwrap();
        let poses = text(&files, "true_poses.csv").unwrap();
        assert_eq!(poses, "frame_id,tx,ty,tz,qx,qy,qz,qw\n4,1.0,2.0,3.0,0.0,0.0,0.0,1.0\n");
        assert!(text(&files, "structural_groups.csv").unwrap().ends_with(",2 7,1.0,0.0,0.0\n"));
    }

    #[test]
    fn a_number_that_is_none_is_refused_with_its_row() {
        let mut sequence = sample();
        sequence.point_measurements[0].v = f64::NAN;
        let message = to_csv(&sequence, false).unwrap_err().to_string();
        assert_eq!(message, "4,9,0.1,: expected finite numbers, found NaN");
    }
}
