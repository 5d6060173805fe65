//! Flat pieces of surfaces, and the edges between them.

use nalgebra::{Point3, Vector3};

/// A flat convex face of three or four corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    corners: [Point3<f64>; 4],
    count: u8,
    /// The object to which the face belongs, by its place in the recipe.
    pub object: u32,
}

/// A straight edge of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// One end, `world`, metres.
    pub start: Point3<f64>,
    /// The other end, `world`, metres.
    pub end: Point3<f64>,
    /// The object to which the edge belongs, by its place in the recipe.
    pub object: u32,
}

impl Face {
    /// A triangle.
    #[must_use]
    pub const fn triangle(corners: [Point3<f64>; 3], object: u32) -> Self {
        let [a, b, c] = corners;
        Self { corners: [a, b, c, c], count: 3, object }
    }

    /// A flat convex quadrangle, corners in order round it.
    #[must_use]
    pub const fn quad(corners: [Point3<f64>; 4], object: u32) -> Self {
        Self { corners, count: 4, object }
    }

    /// The corners, in order round the face, `world`, metres.
    #[must_use]
    pub fn corners(&self) -> &[Point3<f64>] {
        &self.corners[..usize::from(self.count)]
    }

    /// One or two triangles that cover the face.
    #[must_use]
    pub fn triangles(&self) -> ([Point3<f64>; 3], Option<[Point3<f64>; 3]>) {
        let [a, b, c, d] = self.corners;
        ([a, b, c], (self.count == 4).then_some([a, c, d]))
    }

    /// Twice the area, along the normal.
    fn doubled(&self) -> Vector3<f64> {
        let [a, b, c, d] = self.corners;
        // Half the cross product of the diagonals; for a triangle `c` and `d` coincide.
        if self.count == 4 { (c - a).cross(&(d - b)) } else { (b - a).cross(&(c - a)) }
    }

    /// Area, square metres.
    #[must_use]
    pub fn area(&self) -> f64 {
        0.5 * self.doubled().norm()
    }

    /// Unit normal by the right-hand rule; `None` for a face without area.
    #[must_use]
    pub fn normal(&self) -> Option<Vector3<f64>> {
        self.doubled().try_normalize(1e-18)
    }

    /// The part of the line `through + s · direction` that lies in the face, as an interval of s.
    ///
    /// * `through` — a point of the face's plane; `direction` — a unit vector in that plane.
    #[must_use]
    pub fn interval_along(&self, through: Point3<f64>, direction: Vector3<f64>) -> Option<[f64; 2]> {
        let normal = self.normal()?;
        let corners = self.corners();
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for (index, corner) in corners.iter().enumerate() {
            let next = corners[(index + 1) % corners.len()];
            // Points inward from the side that begins at the corner.
            let inward = normal.cross(&(next - corner));
            let (at, along) = (inward.dot(&(through - corner)), inward.dot(&direction));
            if along > 0.0 {
                low = low.max(-at / along);
            } else if along < 0.0 {
                high = high.min(-at / along);
            } else if at < 0.0 {
                return None;
            }
        }
        (low < high && low.is_finite() && high.is_finite()).then_some([low, high])
    }
}

impl Edge {
    /// Length, metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        (self.end - self.start).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Face {
        let corner = |x, y| Point3::new(x, y, 1.0);
        Face::quad([corner(0.0, 0.0), corner(2.0, 0.0), corner(2.0, 3.0), corner(0.0, 3.0)], 0)
    }

    #[test]
    fn a_quadrangle_has_the_area_of_its_triangles() {
        let face = square();
        let (first, second) = face.triangles();
        let halves = Face::triangle(first, 0).area() + Face::triangle(second.unwrap(), 0).area();
        assert!((face.area() - 6.0).abs() < 1e-12 && (halves - 6.0).abs() < 1e-12);
        assert_eq!(face.normal(), Some(Vector3::z()));
    }

    #[test]
    fn a_line_is_cut_at_the_sides_of_the_face() {
        let through = Point3::new(0.5, 1.0, 1.0);
        let [low, high] = square().interval_along(through, Vector3::x()).unwrap();
        assert!((low + 0.5).abs() < 1e-12 && (high - 1.5).abs() < 1e-12);
        let diagonal = Vector3::new(0.6, 0.8, 0.0);
        let [low, high] = square().interval_along(through, diagonal).unwrap();
        // Leaves at x = 0 and at x = 2, where y is 3 as well.
        assert!((low + 0.5 / 0.6).abs() < 1e-12 && (high - 2.5).abs() < 1e-12, "{low} {high}");
        assert_eq!(square().interval_along(Point3::new(5.0, 1.0, 1.0), Vector3::y()), None);
    }

    #[test]
    fn a_face_without_area_has_no_normal() {
        let corner = |x| Point3::new(x, 0.0, 0.0);
        assert_eq!(Face::triangle([corner(0.0), corner(1.0), corner(2.0)], 0).normal(), None);
    }
}
