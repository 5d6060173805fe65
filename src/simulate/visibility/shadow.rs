//! What the faces of a scene hide from one eye: whole boxes at once where that can be said.

use nalgebra::{Point3, Vector3};

use super::Occluders;

/// Most faces that are carried from a box to those within it.
const MOST: usize = 48;
/// Points within this distance behind a plane are sure to lie in it, see [`Occluders::hides`], metres.
const SURELY_IN_PLANE: f64 = 5e-7;
/// Beyond this distance behind a plane (metres per metre of coordinates) they are sure not to.
const SURELY_BEHIND: f64 = 2e-6;
/// Nearer than this to the edge of a shadow (metres per metre of coordinates) each point is looked at alone.
const AT_EDGE: f64 = 1e-7;

/// Faces, by their places in [`Shadows`].
#[derive(Clone, Debug)]
pub(super) struct Few {
    shadows: [u16; MOST],
    len: usize,
}

impl Default for Few {
    fn default() -> Self {
        Self { shadows: [0; MOST], len: 0 }
    }
}

impl Few {
    pub(super) const fn is_empty(&self) -> bool {
        self.len == 0
    }

    fn places(&self) -> &[u16] {
        &self.shadows[..self.len]
    }

    fn push(&mut self, place: u16) {
        self.shadows[self.len] = place;
        self.len += 1;
    }
}

/// What stands between the eye and a box.
pub(super) enum Between {
    /// A face that hides all of it.
    Hidden,
    /// No other faces than these.
    Few(Few),
    /// More faces than are worth a list.
    Many,
}

/// The faces of a scene from one eye.
pub(super) struct Shadows<'a> {
    occluders: &'a Occluders,
    eye: Point3<f64>,
    scale: f64,
    list: Vec<Shadow>,
}

impl<'a> Shadows<'a> {
    /// * `reach` — greatest coordinate of what may be hidden, metres.
    pub(super) fn new(occluders: &'a Occluders, eye: Point3<f64>, reach: f64) -> Self {
        Self { occluders, eye, scale: 1.0 + eye.coords.amax() + reach, list: Vec::new() }
    }

    /// Up to where shadows are known.
    pub(super) const fn mark(&self) -> usize {
        self.list.len()
    }

    /// Forgets the shadows that came after a mark.
    pub(super) fn forget(&mut self, mark: usize) {
        self.list.truncate(mark);
    }

    /// What stands between the eye and a box, given by its middle and half its size.
    ///
    /// * `known` — the answer for a box about it.
    pub(super) fn between(
        &mut self,
        center: &Point3<f64>,
        half: &Vector3<f64>,
        known: Option<&Few>,
    ) -> Between {
        let middle = center - self.eye;
        let mut few = Few::default();
        if let Some(known) = known {
            for place in known.places() {
                match self.list[usize::from(*place)].on_box(&middle, half) {
                    Cast::Misses => {}
                    Cast::Covers => return Between::Hidden,
                    Cast::Partly => few.push(*place),
                }
            }
            return Between::Few(few);
        }
        let Some(faces) = self.occluders.faces_between(&self.eye, center, half, MOST) else {
            return Between::Many;
        };
        for face in faces {
            let shadow = Shadow::new(self.occluders.outline(face), &self.eye, self.scale, face);
            match shadow.on_box(&middle, half) {
                Cast::Misses => continue,
                Cast::Covers => return Between::Hidden,
                Cast::Partly => {}
            }
            let Ok(place) = u16::try_from(self.list.len()) else { return Between::Many };
            self.list.push(shadow);
            few.push(place);
        }
        Between::Few(few)
    }

    /// Whether faces hide a point of a box; `few` is what is between the eye and that box.
    pub(super) fn hide(&self, point: &Point3<f64>, few: Option<&Few>) -> bool {
        let Some(few) = few else { return self.occluders.hides(&self.eye, point) };
        let at = point - self.eye;
        few.places().iter().any(|place| {
            let shadow = &self.list[usize::from(*place)];
            match shadow.on_box(&at, &Vector3::zeros()) {
                Cast::Misses => false,
                Cast::Covers => true,
                Cast::Partly => self.occluders.face_hides(shadow.face, &self.eye, point),
            }
        })
    }
}

/// Where a shadow falls.
enum Cast {
    Misses,
    Covers,
    Partly,
}

/// What a face hides: behind its plane, and within the planes of the eye and its sides.
struct Shadow {
    face: u32,
    /// Whether the planes say anything; not where the eye is near the plane of the face.
    sharp: bool,
    /// Unit normal, towards the eye, and the distance of the eye.
    normal: Vector3<f64>,
    distance: f64,
    /// How far behind the plane everything is hidden.
    behind: f64,
    /// Normals of the planes through the eye, inwards, with what rounding may do.
    sides: [(Vector3<f64>, f64); 4],
    count: usize,
}

impl Shadow {
    fn new((corners, count): ([Point3<f64>; 4], usize), eye: &Point3<f64>, scale: f64, face: u32) -> Self {
        let from_eye = corners.map(|corner| corner - eye);
        let corners = &from_eye[..count];
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
        let normal = if normal.dot(&corners[0]) > 0.0 { -normal } else { normal };
        let distance = -normal.dot(&corners[0]);
        let size = corners.iter().map(|corner| (corner - corners[0]).norm()).fold(0.0, f64::max);
        let mut shadow = Self {
            face,
            sharp: distance > 1e-4 * (1.0 + size),
            normal,
            distance,
            behind: SURELY_BEHIND * (scale + distance + size),
            sides: [(Vector3::zeros(), 0.0); 4],
            count,
        };
        for index in 0..count {
            let side = corners[index].cross(&corners[(index + 1) % count]);
            let side = if side.dot(&corners[(index + 2) % count]) < 0.0 { -side } else { side };
            let slack = AT_EDGE * (scale + size) * side.abs().sum();
            shadow.sides[index] = (side, slack);
            // Flat and convex, or it is looked at triangle by triangle.
            shadow.sharp &= corners.iter().all(|corner| {
                side.dot(corner) >= -slack && (normal.dot(corner) + distance).abs() <= 1e-9 * (scale + size)
            });
        }
        shadow
    }

    /// Where the shadow falls on a box.
    ///
    /// * `middle` — of the box, from the eye; `half` — half its size.
    fn on_box(&self, middle: &Vector3<f64>, half: &Vector3<f64>) -> Cast {
        if !self.sharp {
            return Cast::Partly;
        }
        let (height, reach) = (self.normal.dot(middle) + self.distance, self.normal.abs().dot(half));
        if height - reach >= -SURELY_IN_PLANE {
            return Cast::Misses;
        }
        let mut covers = height + reach < -self.behind;
        for (side, slack) in &self.sides[..self.count] {
            let (height, reach) = (side.dot(middle), side.abs().dot(half));
            if height + reach < -slack {
                return Cast::Misses;
            }
            covers &= height - reach > *slack;
        }
        if covers { Cast::Covers } else { Cast::Partly }
    }
}
