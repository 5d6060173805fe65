//! Points and lines on the surfaces of a scene.

use nalgebra::{Point3, Vector3};

use super::scene::{Face, Scene};
use super::{Error, LinesRecipe, Random};
use crate::geometry::Segment;

/// Attempts at a line before it is said that the scene has no room for it.
const ATTEMPTS: usize = 2000;

/// Things chosen with a probability proportional to their weight.
struct Weighted {
    sums: Vec<f64>,
}

impl Weighted {
    fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        Self {
            sums: weights
                .map(|weight| {
                    sum += weight;
                    sum
                })
                .collect(),
        }
    }

    fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    fn draw(&self, random: &mut Random) -> usize {
        let at = random.uniform() * self.total();
        self.sums.partition_point(|sum| *sum <= at).min(self.sums.len().saturating_sub(1))
    }
}

/// Draws points uniformly on the surfaces of a scene.
pub(super) struct PointSource<'a> {
    scene: &'a Scene,
    faces: Weighted,
    seed: u64,
}

impl<'a> PointSource<'a> {
    pub(super) fn new(scene: &'a Scene, seed: u64) -> Self {
        Self { scene, faces: Weighted::new(scene.faces.iter().map(Face::area)), seed }
    }

    /// The point of an index: the same whichever others are drawn.
    pub(super) fn point(&self, index: u64) -> Point3<f64> {
        let mut random = Random::new(self.seed, "point landmarks", index);
        point_on(&self.scene.faces[self.faces.draw(&mut random)], &mut random)
    }
}

/// A point uniform on a face.
fn point_on(face: &Face, random: &mut Random) -> Point3<f64> {
    let (first, second) = face.triangles();
    let area =
        |corners: &[Point3<f64>; 3]| (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).norm();
    let chosen = match second {
        Some(second) if random.uniform() * (area(&first) + area(&second)) >= area(&first) => second,
        _ => first,
    };
    let (mut a, mut b) = (random.uniform(), random.uniform());
    if a + b > 1.0 {
        (a, b) = (1.0 - a, 1.0 - b);
    }
    chosen[0] + (chosen[1] - chosen[0]) * a + (chosen[2] - chosen[0]) * b
}

/// A direction that lines share, without sign.
#[derive(Clone, Debug)]
struct Family {
    direction: Vector3<f64>,
}

/// A line, and the family of directions to which it belongs, if to any.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DrawnLine {
    pub(super) segment: Segment,
    pub(super) family: Option<u32>,
}

/// Draws lines on the edges and faces of a scene.
pub(super) struct LineSource<'a> {
    scene: &'a Scene,
    recipe: &'a LinesRecipe,
    seed: u64,
    families: Vec<Family>,
    edges: Vec<(usize, u32)>,
    edge_weights: Weighted,
    face_weights: Weighted,
    /// Families that run in each face: along its sides, and obliquely.
    along_sides: Vec<Vec<u32>>,
    oblique: Vec<Vec<u32>>,
}

/// Two directions closer than this (radians) are one.
const SAME_DIRECTION: f64 = 1e-7;

impl<'a> LineSource<'a> {
    pub(super) fn new(scene: &'a Scene, recipe: &'a LinesRecipe, seed: u64) -> Self {
        let mut families = Families::default();
        let mut edges = Vec::new();
        for (index, edge) in scene.edges.iter().enumerate() {
            if edge.length() >= recipe.min_length_m
                && let Some(direction) = (edge.end - edge.start).try_normalize(1e-12)
            {
                edges.push((index, families.of(direction)));
            }
        }
        let edge_weights = Weighted::new(edges.iter().map(|(index, _)| scene.edges[*index].length()));
        let sides = |face: &Face| {
            let corners = face.corners().to_vec();
            (0..corners.len())
                .filter_map(|index| {
                    (corners[(index + 1) % corners.len()] - corners[index]).try_normalize(1e-12)
                })
                .collect::<Vec<_>>()
        };
        let mut along_sides = Vec::with_capacity(scene.faces.len());
        for face in &scene.faces {
            let mut own: Vec<u32> = sides(face).into_iter().map(|direction| families.of(direction)).collect();
            own.sort_unstable();
            own.dedup();
            along_sides.push(own);
        }
        // Oblique families: for each class of parallel faces the same few directions, drawn by the seed.
        let mut classes = Families::default();
        let mut oblique_of_class: Vec<Vec<u32>> = Vec::new();
        let mut oblique = Vec::with_capacity(scene.faces.len());
        for (face, own) in scene.faces.iter().zip(&along_sides) {
            let Some((normal, first)) = face.normal().zip(own.first()) else {
                oblique.push(Vec::new());
                continue;
            };
            let class = classes.of(normal) as usize;
            if class == oblique_of_class.len() {
                let mut random = Random::new(seed, "oblique directions", class as u64);
                let across = normal.cross(&families.list[*first as usize].direction);
                let along = across.cross(&normal).normalize();
                let mut list = Vec::new();
                for _ in 0..recipe.oblique_directions {
                    // From 15 to 75 degrees, on either side, so that it is not taken for a side's.
                    let turn = random.between(15.0, 75.0).to_radians();
                    let (sine, cosine) = libm::sincos(turn);
                    let side = if random.chance(0.5) { 1.0 } else { -1.0 };
                    list.push(families.of(along * cosine + across.normalize() * (side * sine)));
                }
                oblique_of_class.push(list);
            }
            oblique.push(oblique_of_class[class].clone());
        }
        let face_weights = Weighted::new(scene.faces.iter().map(Face::area));
        Self {
            scene,
            recipe,
            seed,
            families: families.list,
            edges,
            edge_weights,
            face_weights,
            along_sides,
            oblique,
        }
    }

    /// The line of an index: the same whichever others are drawn.
    ///
    /// # Errors
    /// [`Error::Value`] when the scene has no room for a line of the least length.
    pub(super) fn line(&self, index: u64) -> Result<DrawnLine, Error> {
        let mut random = Random::new(self.seed, "line landmarks", index);
        for _ in 0..ATTEMPTS {
            let found = if random.chance(self.recipe.on_edges) {
                self.on_edge(&mut random)
            } else {
                self.on_face(&mut random)
            };
            if let Some(line) = found {
                return Ok(line);
            }
        }
        let expected = format!("a length for which the scene has room ({ATTEMPTS} attempts)");
        Err(Error::value("lines.min_length_m", expected, self.recipe.min_length_m))
    }

    fn on_edge(&self, random: &mut Random) -> Option<DrawnLine> {
        if self.edges.is_empty() {
            return None;
        }
        let (edge, family) = self.edges[self.edge_weights.draw(random)];
        let edge = &self.scene.edges[edge];
        // Whole edges where they are not too long: that is what a detector finds.
        let length = edge.length();
        let piece = length.min(self.recipe.max_length_m);
        let from = random.uniform() * (length - piece);
        Some(self.line_along(edge.start, family, [from, from + piece], edge.end - edge.start))
    }

    /// A line of a family, with the family's very direction, so that groups are exactly parallel.
    fn line_along(
        &self,
        origin: Point3<f64>,
        family: u32,
        [from, to]: [f64; 2],
        toward: Vector3<f64>,
    ) -> DrawnLine {
        let direction = self.families[family as usize].direction;
        let direction = if direction.dot(&toward) < 0.0 { -direction } else { direction };
        let segment = Segment { start: origin + direction * from, end: origin + direction * to };
        DrawnLine { segment, family: Some(family) }
    }

    fn on_face(&self, random: &mut Random) -> Option<DrawnLine> {
        let recipe = self.recipe;
        let kind = random.uniform();
        let face_index = self.face_weights.draw(random);
        let face = &self.scene.faces[face_index];
        let through = point_on(face, random);
        let family = if kind < recipe.oblique {
            let list = &self.oblique[face_index];
            Some(*list.get(random.index(list.len()))?)
        } else if kind < recipe.oblique + recipe.free {
            None
        } else {
            let list = &self.along_sides[face_index];
            Some(*list.get(random.index(list.len()))?)
        };
        let normal = face.normal()?;
        let direction = match family {
            Some(family) => self.families[family as usize].direction,
            None => (random.direction().cross(&normal)).try_normalize(1e-6)?,
        };
        // A face keeps its lines a little inside, so that none is taken for an edge.
        let [low, high] = face.interval_along(through, direction)?;
        let room = 0.98 * (high - low);
        if room < recipe.min_length_m {
            return None;
        }
        let length = random.between(recipe.min_length_m, room.min(recipe.max_length_m));
        let from = low + 0.01 * (high - low) + random.uniform() * (room - length);
        let along = [from, from + length];
        Some(match family {
            Some(family) => self.line_along(through, family, along, direction),
            None => DrawnLine {
                segment: Segment {
                    start: through + direction * along[0],
                    end: through + direction * along[1],
                },
                family: None,
            },
        })
    }
}

/// A cell of a grid and the 26 that touch it.
pub(super) fn cells_about([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27_i64).map(move |step| [x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1])
}

/// Directions without sign, each once.
#[derive(Default)]
struct Families {
    list: Vec<Family>,
    /// Families by their rounded direction; neighbours are looked up too.
    buckets: std::collections::HashMap<[i64; 3], Vec<u32>>,
}

impl Families {
    /// The family of a direction, a new one if there is none yet.
    fn of(&mut self, direction: Vector3<f64>) -> u32 {
        const STEPS: f64 = 1e4;
        #[expect(clippy::cast_possible_truncation, reason = "components of a unit vector")]
        let bucket = |direction: &Vector3<f64>| -> [i64; 3] {
            std::array::from_fn(|axis| (direction[axis] * STEPS).round() as i64)
        };
        for signed in [direction, -direction] {
            for near in cells_about(bucket(&signed)) {
                for family in self.buckets.get(&near).into_iter().flatten() {
                    if self.list[*family as usize].direction.cross(&direction).norm() < SAME_DIRECTION {
                        return *family;
                    }
                }
            }
        }
        let family = u32::try_from(self.list.len()).unwrap_or(u32::MAX);
        self.list.push(Family { direction });
        self.buckets.entry(bucket(&direction)).or_default().push(family);
        family
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Object;
    use proptest::prelude::*;
    use std::path::Path;

    fn scene() -> Scene {
        let objects = [
            "kind = 'box'\nsize_m = [1.0, 2.0, 3.0]\nroll_pitch_yaw_deg = [10, 20, 30]",
            "kind = 'room'\nsize_m = [8.0, 6.0, 4.0]",
            "kind = 'staircase'\nsteps = 4\nposition_m = [1, 1, -2]",
            "kind = 'ring-corridor'\nposition_m = [0, 0, 9]",
        ];
        let objects = objects.map(|text| toml::from_str::<Object>(text).unwrap());
        Scene::build(&objects, Path::new("")).unwrap()
    }

    /// Metres; coordinates reach 12 m, directions of one family agree to 1e-7.
    const ON_SURFACE_M: f64 = 1e-6;

    fn lies_on(face: &Face, point: &Point3<f64>) -> bool {
        let (normal, corners) = (face.normal().unwrap(), face.corners());
        let inside = (0..corners.len()).all(|index| {
            let side = corners[(index + 1) % corners.len()] - corners[index];
            normal.cross(&side.normalize()).dot(&(point - corners[index])) > -ON_SURFACE_M
        });
        normal.dot(&(point - corners[0])).abs() < ON_SURFACE_M && inside
    }

    #[test]
    fn points_fall_on_faces_in_proportion_to_their_areas() {
        let scene = scene();
        let source = PointSource::new(&scene, 11);
        let count = 20_000_u32;
        let points: Vec<_> = (0..u64::from(count)).map(|index| source.point(index)).collect();
        for face in &scene.faces {
            let share = face.area() / scene.area();
            // Of the points in a half of the face, too; no two faces of the scene lie in each other.
            let found = points.iter().filter(|point| lies_on(face, point)).count() as f64 / f64::from(count);
            let sigma = (share * (1.0 - share) / f64::from(count)).sqrt();
            assert!((found - share).abs() < 5.0 * sigma + 1e-9, "{found} {share}");
        }
        // Uniform in the largest face: the mean of points of a floor is its middle.
        let floor = &scene
            .faces
            .iter()
            .filter(|face| face.object == 1)
            .max_by(|a, b| a.area().total_cmp(&b.area()))
            .unwrap();
        let on: Vec<_> = points.iter().filter(|point| lies_on(floor, point)).collect();
        let mean = on.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords) / on.len() as f64;
        let middle = floor.corners().iter().fold(Vector3::zeros(), |sum, corner| sum + corner.coords) / 4.0;
        // Half of 8 m over the square root of 3, for the longer side.
        assert!((mean - middle).norm() < 5.0 * 2.0 * 4.0 / 3.0_f64.sqrt() / (on.len() as f64).sqrt());
    }

    proptest! {
        #[test]
        fn lines_lie_on_edges_or_faces_and_families_are_exactly_parallel(
            seed in any::<u64>(), on_edges in 0.0..1.0_f64, oblique in 0.0..0.5_f64, free in 0.0..0.5_f64,
        ) {
            let scene = scene();
            let recipe = LinesRecipe {
                on_edges, oblique, free, min_length_m: 0.1, max_length_m: 2.5, oblique_directions: 2,
                ..LinesRecipe::default()
            };
            let source = LineSource::new(&scene, &recipe, seed);
            let mut families: std::collections::BTreeMap<u32, Vector3<f64>> = Default::default();
            for index in 0..40 {
                let DrawnLine { segment: Segment { start, end }, family } = source.line(index).unwrap();
                let along = end - start;
                prop_assert!((0.1 - 1e-9..2.5 + 1e-9).contains(&along.norm()));
                prop_assert!(scene.faces.iter().any(|face| lies_on(face, &start) && lies_on(face, &end)));
                if let Some(family) = family {
                    let first = families.entry(family).or_insert(along);
                    // Radians: rounding of two ends 12 m away over 0.1 m.
                    prop_assert!(first.cross(&along).norm() / first.norm() / along.norm() < 1e-12);
                }
            }
        }
    }
}
