//! Whether edges are on the whole where they should be.

use nalgebra::{Matrix2, Vector2};
use open_structure_converters::generate::Generated;

use super::furnished::Room;
use super::view::views;

/// The shift of all observed lines from the edges and painted lines that they are: that of least squares, pixels.
pub(crate) fn bias_px(room: &Room, sequence: &Generated) -> Vector2<f64> {
    let known = room.lines();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for view in views(room, sequence) {
        for (_, part) in view.lines() {
            let Some(line) = view.known(&part, &known) else { continue };
            let across = view.image(line).xy();
            let off = view.off_line_px(&part.midpoint(), line);
            normal += across * across.transpose();
            right += across * off;
        }
    }
    normal.cholesky().unwrap().solve(&right)
}
