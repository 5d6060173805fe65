//! Faces that hide what is behind them, in a bounding volume hierarchy.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use nalgebra::{Point3, Vector3};

use crate::simulate::scene::Scene;

/// A surface hides nothing that lies in its own plane, up to this (metres per metre of coordinates).
const IN_PLANE: f64 = 1e-6;
/// How far behind a surface something has to be to be hidden, as a part of its distance.
const BEHIND: f64 = 1e-9;

#[derive(Clone, Debug)]
struct Triangle {
    corner: Point3<f64>,
    /// From the first corner to the two others.
    sides: [Vector3<f64>; 2],
    /// Unit normal.
    normal: Vector3<f64>,
    face: u32,
    node: usize,
}

impl Triangle {
    fn corners(&self) -> [Point3<f64>; 3] {
        [self.corner, self.corner + self.sides[0], self.corner + self.sides[1]]
    }

    /// Whether a point lies in the plane of the triangle.
    fn holds(&self, point: &Point3<f64>) -> bool {
        self.normal.dot(&(point - self.corner)).abs() <= IN_PLANE * (1.0 + point.coords.amax())
    }

    /// Where a ray meets the triangle, in lengths of its direction (Möller and Trumbore 1997).
    fn meet(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let [first, second] = &self.sides;
        let across = direction.cross(second);
        let volume = first.dot(&across);
        if volume == 0.0 {
            return None;
        }
        let scale = 1.0 / volume;
        let from_corner = origin - self.corner;
        // A little over the edge, so that no ray slips between two triangles.
        let slack = 1e-12;
        let u = from_corner.dot(&across) * scale;
        if !(-slack..=1.0 + slack).contains(&u) {
            return None;
        }
        let along = from_corner.cross(first);
        let v = direction.dot(&along) * scale;
        (v >= -slack && u + v <= 1.0 + slack).then(|| second.dot(&along) * scale)
    }

    /// Whether the triangle stands between an eye and a point, which lies a direction from it.
    fn hides(&self, eye: &Point3<f64>, direction: &Vector3<f64>, point: &Point3<f64>) -> bool {
        self.meet(eye, direction).is_some_and(|along| along > 0.0 && along < 1.0 - BEHIND)
            && !self.holds(point)
    }
}

impl Bounded<f64, 3> for Triangle {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.corners().iter().fold(Aabb::empty(), |aabb, corner| aabb.grow(corner))
    }
}

impl BHShape<f64, 3> for Triangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }
    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// A node of the flattened hierarchy: where to go on if its box is missed, and its triangle if it is a leaf.
#[derive(Clone, Debug)]
struct Node {
    low: Point3<f64>,
    high: Point3<f64>,
    exit: u32,
    triangle: u32,
}

const NO_TRIANGLE: u32 = u32::MAX;

/// The first surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction.
    pub along: f64,
    /// The face, by its place in the scene.
    pub face: u32,
    /// Unit normal of the face, on either side.
    pub normal: Vector3<f64>,
}

/// Faces of a scene, searchable by rays; every face hides from both sides.
#[derive(Clone, Debug)]
pub struct Occluders {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

impl Occluders {
    /// The faces of a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut triangles = Vec::with_capacity(scene.faces.len());
        for (face, of) in (0_u32..).zip(&scene.faces) {
            let (first, second) = of.triangles();
            for [a, b, c] in std::iter::once(first).chain(second) {
                let sides = [b - a, c - a];
                if let Some(normal) = sides[0].cross(&sides[1]).try_normalize(1e-18) {
                    triangles.push(Triangle { corner: a, sides, normal, face, node: 0 });
                }
            }
        }
        let nodes = if triangles.is_empty() {
            Vec::new()
        } else {
            let bvh = Bvh::build(&mut triangles);
            bvh.flatten_custom(&|aabb: &Aabb<f64, 3>, entry, exit, triangle| Node {
                low: aabb.min,
                high: aabb.max,
                exit,
                triangle: if entry == u32::MAX { triangle } else { NO_TRIANGLE },
            })
        };
        Self { triangles, nodes }
    }

    /// Calls a function with every triangle whose box passes a test.
    fn search<'a>(
        &'a self,
        mut passes: impl FnMut(&Point3<f64>, &Point3<f64>) -> bool,
        mut found: impl FnMut(u32, &'a Triangle) -> bool,
    ) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if node.triangle != NO_TRIANGLE {
                if found(node.triangle, &self.triangles[node.triangle as usize]) {
                    return;
                }
                at = node.exit as usize;
            } else if passes(&node.low, &node.high) {
                at += 1;
            } else {
                at = node.exit as usize;
            }
        }
    }

    /// Whether some surface stands between an eye and a point; surfaces in whose plane the point lies do not.
    #[must_use]
    pub fn hides(&self, eye: &Point3<f64>, point: &Point3<f64>) -> bool {
        let direction = point - eye;
        let slabs = Slabs::new(eye, &direction);
        let mut hidden = false;
        self.search(
            |low, high| slabs.meet(low, high, 1.0),
            |_, triangle| {
                hidden = triangle.hides(eye, &direction, point);
                hidden
            },
        );
        hidden
    }

    /// Whether a face, named by its first triangle, stands between an eye and a point.
    pub(super) fn face_hides(&self, first: u32, eye: &Point3<f64>, point: &Point3<f64>) -> bool {
        let direction = point - eye;
        self.triangles_of(first).iter().any(|triangle| triangle.hides(eye, &direction, point))
    }

    /// The triangles of a face, named by its first one.
    fn triangles_of(&self, first: u32) -> &[Triangle] {
        let first = first as usize;
        let face = self.triangles[first].face;
        let two = self.triangles.get(first + 1).is_some_and(|next| next.face == face);
        &self.triangles[first..=first + usize::from(two)]
    }

    /// The corners of a face in order round it, and their number; the face is named by its first triangle.
    pub(super) fn outline(&self, first: u32) -> ([Point3<f64>; 4], usize) {
        let triangles = self.triangles_of(first);
        let [a, b, c] = triangles[0].corners();
        // Two triangles of a face share its first corner and its diagonal.
        triangles.get(1).map_or(([a, b, c, c], 3), |second| ([a, b, c, second.corners()[2]], 4))
    }

    /// Faces, named by their first triangles, that may stand between an eye and a box; `None` when they are
    /// more than `most`.
    pub(super) fn faces_between(
        &self,
        eye: &Point3<f64>,
        center: &Point3<f64>,
        half: &Vector3<f64>,
        most: usize,
    ) -> Option<Vec<u32>> {
        // Lines of sight stay in the box about eye and target, and within the target's radius of the axis.
        let (low, high) = (eye.inf(&(center - half)), eye.sup(&(center + half)));
        let (axis, radius) = (center - eye, half.norm());
        // A target about the eye has no axis.
        let scale = Some(axis.norm_squared().recip()).filter(|scale| scale.is_finite()).unwrap_or(0.0);
        let slack = 1e-9 * (1.0 + low.coords.amax().max(high.coords.amax()));
        let near = |box_low: &Point3<f64>, box_high: &Point3<f64>| {
            if (0..3).any(|axis| box_low[axis] > high[axis] + slack || box_high[axis] < low[axis] - slack) {
                return false;
            }
            let reach = 0.5 * (box_high - box_low).norm() + radius + slack;
            let from_eye = nalgebra::center(box_low, box_high) - eye;
            let part = (from_eye.dot(&axis) * scale).clamp(0.0, 1.0);
            (from_eye - axis * part).norm_squared() <= reach * reach
        };
        let mut faces: Vec<u32> = Vec::new();
        self.search(near, |index, triangle| {
            let corners = triangle.corners();
            let (low, high) =
                (corners[0].inf(&corners[1].inf(&corners[2])), corners[0].sup(&corners[1].sup(&corners[2])));
            if near(&low, &high) {
                let before = index
                    .checked_sub(1)
                    .filter(|before| self.triangles[*before as usize].face == triangle.face);
                let first = before.unwrap_or(index);
                if !faces.contains(&first) {
                    faces.push(first);
                }
            }
            faces.len() > most
        });
        (faces.len() <= most).then_some(faces)
    }

    /// The first surface that a ray meets, nearer than `reach` lengths of its direction.
    #[must_use]
    pub fn first_hit(&self, origin: &Point3<f64>, direction: &Vector3<f64>, reach: f64) -> Option<Hit> {
        let slabs = Slabs::new(origin, direction);
        let nearest = std::cell::Cell::new(reach);
        let mut hit = None;
        self.search(
            |low, high| slabs.meet(low, high, nearest.get()),
            |_, triangle| {
                if let Some(along) =
                    triangle.meet(origin, direction).filter(|along| *along > 0.0 && *along < nearest.get())
                {
                    nearest.set(along);
                    hit = Some(Hit { along, face: triangle.face, normal: triangle.normal });
                }
                false
            },
        );
        hit
    }

    /// The parts of a segment that are hidden from an eye, as ascending, disjoint intervals of
    /// `start + t (end − start)`.
    ///
    /// Exact: each triangle is cut with the plane of eye and segment, and its shadow on the segment follows
    /// from the cut. Surfaces in whose plane the segment lies hide nothing of it.
    #[must_use]
    pub fn hidden_parts(&self, eye: &Point3<f64>, start: &Point3<f64>, end: &Point3<f64>) -> Vec<[f64; 2]> {
        let fan = Fan::new(eye, start, end);
        let mut parts = Vec::new();
        if let Some(fan) = &fan {
            let low = eye.inf(&start.inf(end));
            let high = eye.sup(&start.sup(end));
            self.search(
                |box_low, box_high| fan.may_meet(box_low, box_high, &low, &high),
                |_, triangle| {
                    if !(triangle.holds(start) && triangle.holds(end)) {
                        parts.extend(fan.shadow(triangle.corners()));
                    }
                    false
                },
            );
        }
        parts.sort_by(|left: &[f64; 2], right| left[0].total_cmp(&right[0]));
        let mut merged: Vec<[f64; 2]> = Vec::new();
        for [low, high] in parts {
            match merged.last_mut() {
                // Neighbouring triangles of one surface leave no gap but rounding.
                Some(last) if low <= last[1] + 1e-9 => last[1] = last[1].max(high),
                _ => merged.push([low, high]),
            }
        }
        merged
    }
}

/// A ray prepared for boxes.
struct Slabs {
    origin: Point3<f64>,
    inverse: Vector3<f64>,
}

impl Slabs {
    fn new(origin: &Point3<f64>, direction: &Vector3<f64>) -> Self {
        Self { origin: *origin, inverse: direction.map(|number| 1.0 / number) }
    }

    /// Whether the ray meets a box before `reach`; a ray in the plane of a side counts as meeting it.
    fn meet(&self, low: &Point3<f64>, high: &Point3<f64>, reach: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, reach);
        for axis in 0..3 {
            let one = (low[axis] - self.origin[axis]) * self.inverse[axis];
            let other = (high[axis] - self.origin[axis]) * self.inverse[axis];
            // `min` and `max` pass over the NaN of a ray that runs in the plane of a side.
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        // The quotients are rounded.
        enter <= leave * (1.0 + 1e-12) + 1e-12
    }
}

/// The triangle of an eye and a segment: all lines of sight to the segment.
struct Fan {
    eye: Point3<f64>,
    normal: Vector3<f64>,
    /// Dual vectors: `x = eye + α (start − eye) + β (end − eye)` has `α = duals[0] · (x − eye)`, `β = duals[1] · (x − eye)`.
    duals: [Vector3<f64>; 2],
}

impl Fan {
    /// `None` where the eye lies on the segment's line: nothing is in view then.
    fn new(eye: &Point3<f64>, start: &Point3<f64>, end: &Point3<f64>) -> Option<Self> {
        let (a, b) = (start - eye, end - eye);
        let cross = a.cross(&b);
        let squared = cross.norm_squared();
        if squared <= 1e-24 * a.norm_squared() * b.norm_squared() {
            return None;
        }
        let duals = [b.cross(&cross) / squared, cross.cross(&a) / squared];
        Some(Self { eye: *eye, normal: cross / squared.sqrt(), duals })
    }

    fn may_meet(
        &self,
        low: &Point3<f64>,
        high: &Point3<f64>,
        fan_low: &Point3<f64>,
        fan_high: &Point3<f64>,
    ) -> bool {
        let apart = (0..3).any(|axis| low[axis] > fan_high[axis] || high[axis] < fan_low[axis]);
        if apart {
            return false;
        }
        let center = nalgebra::center(low, high);
        let reach = self.normal.abs().dot(&(0.5 * (high - low)));
        self.normal.dot(&(center - self.eye)).abs() <= reach * (1.0 + 1e-9) + 1e-12
    }

    /// The interval of the segment that a triangle hides.
    fn shadow(&self, corners: [Point3<f64>; 3]) -> Option<[f64; 2]> {
        // The cut of the triangle with the plane of the fan: a segment, in (α, β).
        let heights = corners.map(|corner| self.normal.dot(&(corner - self.eye)));
        let flat = corners.map(|corner| self.duals.map(|dual| dual.dot(&(corner - self.eye))));
        let mut cut: Vec<[f64; 2]> = Vec::with_capacity(4);
        for corner in 0..3 {
            let next = (corner + 1) % 3;
            if heights[corner] == 0.0 {
                cut.push(flat[corner]);
            }
            if heights[corner] * heights[next] < 0.0 {
                let part = heights[corner] / (heights[corner] - heights[next]);
                cut.push(
                    [0, 1].map(|axis| flat[corner][axis] + part * (flat[next][axis] - flat[corner][axis])),
                );
            }
        }
        let (first, last) = (*cut.first()?, *cut.last()?);
        // What hides lies in front: α, β ≥ 0 and α + β < 1. Clipped like any segment.
        let conditions =
            |[alpha, beta]: [f64; 2]| [alpha, beta, 1.0 - BEHIND - alpha - beta, alpha + beta - 1e-12];
        let (from, to) = (conditions(first), conditions(last));
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for (at_first, at_last) in from.into_iter().zip(to) {
            if at_first < 0.0 && at_last < 0.0 {
                return None;
            }
            if at_first < 0.0 {
                low = low.max(at_first / (at_first - at_last));
            } else if at_last < 0.0 {
                high = high.min(at_first / (at_first - at_last));
            }
        }
        if low >= high {
            return None;
        }
        // The line of sight through (α, β) ends at β/(α + β) of the segment.
        let end = |part: f64| {
            let [alpha, beta] = [0, 1].map(|axis| first[axis] + part * (last[axis] - first[axis]));
            (beta / (alpha + beta)).clamp(0.0, 1.0)
        };
        let (one, other) = (end(low), end(high));
        Some([one.min(other), one.max(other)])
    }
}

#[cfg(test)]
mod tests {
    use super::super::view::tests::point;
    use super::*;
    use crate::simulate::scene::Face;
    use proptest::prelude::*;

    /// A scene of loose triangles.
    fn triangles() -> impl Strategy<Value = Scene> {
        prop::collection::vec(prop::array::uniform3(point(3.0)), 1..30).prop_map(|corners| Scene {
            faces: corners.into_iter().map(|corners| Face::triangle(corners, 0)).collect(),
            edges: Vec::new(),
        })
    }

    proptest! {
        #[test]
        fn the_hierarchy_finds_what_trying_every_triangle_finds(
            scene in triangles(), eye in point(4.0), target in point(4.0),
        ) {
            let occluders = Occluders::new(&scene);
            let direction = target - eye;
            let nearest = occluders
                .triangles
                .iter()
                .filter_map(|triangle| triangle.meet(&eye, &direction))
                .filter(|along| *along > 0.0)
                .min_by(f64::total_cmp);
            prop_assert_eq!(occluders.first_hit(&eye, &direction, f64::INFINITY).map(|hit| hit.along), nearest);
            prop_assert_eq!(occluders.hides(&eye, &target), nearest.is_some_and(|along| along < 1.0 - BEHIND));
        }

        #[test]
        fn hidden_parts_are_where_points_of_the_segment_are_hidden(
            scene in triangles(), eye in point(4.0), start in point(4.0), end in point(4.0),
        ) {
            let occluders = Occluders::new(&scene);
            let parts = occluders.hidden_parts(&eye, &start, &end);
            for step in 0..=100 {
                let t = f64::from(step) / 100.0;
                let on_border = parts.iter().flatten().any(|border| (border - t).abs() < 1e-6);
                if !on_border {
                    let within = parts.iter().any(|[low, high]| (*low..=*high).contains(&t));
                    prop_assert_eq!(occluders.hides(&eye, &(start + (end - start) * t)), within, "{}", t);
                }
            }
        }
    }

    #[test]
    fn a_face_does_not_hide_what_lies_on_it() {
        let corner = |x, y| Point3::new(x, y, 2.0);
        let wall =
            Face::quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], 0);
        let occluders = Occluders::new(&Scene { faces: vec![wall], edges: Vec::new() });
        let eye = Point3::origin();
        assert!(!occluders.hides(&eye, &corner(0.3, 0.4)));
        assert!(occluders.hides(&eye, &Point3::new(0.3, 0.4, 2.001)));
        assert_eq!(
            occluders.hidden_parts(&eye, &corner(-1.0, 0.2), &corner(1.0, 0.2)),
            Vec::<[f64; 2]>::new()
        );
        // Twice as far away, the wall covers from −2 to 2 of a segment from −4 to 4.
        let parts = occluders.hidden_parts(&eye, &Point3::new(-4.0, 0.1, 4.0), &Point3::new(4.0, 0.1, 4.0));
        assert!(parts.len() == 1 && (parts[0][0] - 0.25).abs() < 1e-8 && (parts[0][1] - 0.75).abs() < 1e-8);
    }

    #[test]
    fn nothing_hides_in_an_empty_scene() {
        let occluders = Occluders::new(&Scene::default());
        assert!(!occluders.hides(&Point3::origin(), &Point3::new(1.0, 2.0, 3.0)));
    }
}
