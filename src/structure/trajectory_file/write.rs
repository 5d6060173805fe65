//! Writing trajectory files.

use std::io::Write;

use super::{TrajectoryFileError, TrajectoryFormat};
use crate::structure::PoseRow;

/// Writes poses as a trajectory file that [`super::read_trajectory`] reads.
///
/// Every number has all its digits: TUM and EuRoC files give back the same bits, KITTI files (which hold matrices)
/// the same rotation to rounding, and lose the stamps.
///
/// * `rows` — stamps, nanoseconds, rising; poses, metres.
///
/// # Errors
/// [`TrajectoryFileError::Content`] with the row's line for a number that is not finite, a quaternion that is no
/// rotation, or a stamp that does not rise; [`TrajectoryFileError::Io`] when the output fails.
pub fn write_trajectory(
    output: &mut impl Write,
    format: TrajectoryFormat,
    rows: impl IntoIterator<Item = (i64, PoseRow)>,
) -> Result<(), TrajectoryFileError> {
    let header = match format {
        TrajectoryFormat::Tum => "# timestamp tx ty tz qx qy qz qw\n",
        TrajectoryFormat::Kitti => "",
        TrajectoryFormat::Euroc => {
            "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
        }
    };
    output.write_all(header.as_bytes())?;
    let first = if header.is_empty() { 1 } else { 2 };
    let mut before: Option<i64> = None;
    for (line, (stamp, pose)) in (first..).zip(rows) {
        if let Some(before) = before.replace(stamp)
            && stamp <= before
        {
            let expected = format!("a stamp after {before} ns");
            return Err(TrajectoryFileError::content(line, &expected, format!("{stamp} ns")));
        }
        let rotation = pose
            .pose()
            .map_err(|error| TrajectoryFileError::content(line, "a pose", error))?
            .rotation_matrix();
        let [x, y, z, qx, qy, qz, qw] = pose.numbers();
        match format {
            TrajectoryFormat::Tum => {
                let sign = if stamp < 0 { "-" } else { "" };
                let nanos = stamp.unsigned_abs();
                let (seconds, part) = (nanos / 1_000_000_000, nanos % 1_000_000_000);
                write!(output, "{sign}{seconds}.{part:09}")?;
                writeln!(output, " {x:?} {y:?} {z:?} {qx:?} {qy:?} {qz:?} {qw:?}")?;
            }
            TrajectoryFormat::Euroc => {
                writeln!(output, "{stamp},{x:?},{y:?},{z:?},{qw:?},{qx:?},{qy:?},{qz:?}")?;
            }
            TrajectoryFormat::Kitti => {
                for row in 0..3 {
                    let [a, b, c] = [0, 1, 2].map(|column| rotation[(row, column)]);
                    let end = if row < 2 { ' ' } else { '\n' };
                    write!(output, "{a:?} {b:?} {c:?} {:?}{end}", pose.translation[row])?;
                }
            }
        }
    }
    Ok(())
}
