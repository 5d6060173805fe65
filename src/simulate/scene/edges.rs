//! Edges of a triangle mesh.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::Edge;
use crate::geometry::angle_between;

/// Sides of triangles that no other triangle shares, or that two share at an angle.
///
/// Sides that continue each other are joined, so that an edge of a finely cut surface is one edge.
///
/// * `points` — vertices, `world`, metres; `triangles` — indices of vertices, none without area.
/// * `crease` — angle between normals from which a shared side is an edge, radians.
pub(super) fn creases(
    points: &[Point3<f64>],
    triangles: &[[usize; 3]],
    crease: f64,
    object: u32,
) -> Vec<Edge> {
    let mut sharers: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let (a, b) = (triangle[corner], triangle[(corner + 1) % 3]);
            sharers.entry([a.min(b), a.max(b)]).or_default().push(index);
        }
    }
    let normal = |index: usize| {
        let [a, b, c] = triangles[index].map(|corner| points[corner]);
        (b - a).cross(&(c - a))
    };
    let is_edge = |sharers: &[usize]| match sharers {
        // Whichever way the two triangles are wound, flat is flat.
        [one, other] => {
            let angle = angle_between(&normal(*one), &normal(*other));
            angle.min(std::f64::consts::PI - angle) >= crease
        }
        _ => true,
    };
    let sides = sharers.iter().filter(|(_, sharers)| is_edge(sharers)).map(|(side, _)| *side);
    joined(points, sides.collect())
        .into_iter()
        .map(|[start, end]| Edge { start: points[start], end: points[end], object })
        .collect()
}

/// Sides, those that continue each other straight on made one.
fn joined(points: &[Point3<f64>], sides: Vec<[usize; 2]>) -> Vec<[usize; 2]> {
    let mut sides_at: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, side) in sides.iter().enumerate() {
        side.iter().for_each(|end| sides_at.entry(*end).or_default().push(index));
    }
    let other_end =
        |side: usize, end: usize| if sides[side][0] == end { sides[side][1] } else { sides[side][0] };
    // The side that goes straight on from an end where no third side meets.
    let next = |side: usize, end: usize| -> Option<usize> {
        let [a, b] = sides_at.get(&end)?.as_slice() else { return None };
        let onward = if *a == side { *b } else { *a };
        let here = points[end] - points[other_end(side, end)];
        let there = points[other_end(onward, end)] - points[end];
        (onward != side && angle_between(&here, &there) < 1e-6).then_some(onward)
    };
    let mut used = vec![false; sides.len()];
    let mut found = Vec::new();
    for side in 0..sides.len() {
        if used[side] {
            continue;
        }
        used[side] = true;
        let ends = sides[side].map(|first| {
            let (mut at, mut end) = (side, first);
            while let Some(onward) = next(at, end).filter(|onward| !used[*onward]) {
                used[onward] = true;
                end = other_end(onward, end);
                at = onward;
            }
            end
        });
        found.push(ends);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_that_go_straight_on_are_one_edge() {
        // A strip of three squares, cut into triangles; its long sides are three sides each.
        let points: Vec<_> = (0..4)
            .flat_map(|x| [Point3::new(f64::from(x), 0.0, 0.0), Point3::new(f64::from(x), 1.0, 0.0)])
            .collect();
        let triangles: Vec<[usize; 3]> =
            (0..3).flat_map(|x| [[2 * x, 2 * x + 2, 2 * x + 1], [2 * x + 1, 2 * x + 2, 2 * x + 3]]).collect();
        let mut lengths: Vec<f64> = creases(&points, &triangles, 0.1, 0).iter().map(Edge::length).collect();
        lengths.sort_by(f64::total_cmp);
        assert_eq!(lengths, [1.0, 1.0, 3.0, 3.0]);
    }

    #[test]
    fn a_fold_is_an_edge_from_its_angle_on() {
        let fold = |angle: f64| {
            let points = [
                Point3::new(0.0, 0.0, 0.0),
                Point3::new(1.0, 0.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
                Point3::new(0.5, -angle.cos(), angle.sin()),
            ];
            creases(&points, &[[0, 1, 2], [0, 3, 1]], 0.3, 0).len()
        };
        // The four outer sides, and the fold.
        assert_eq!(fold(0.29), 4);
        assert_eq!(fold(0.31), 5);
    }
}
