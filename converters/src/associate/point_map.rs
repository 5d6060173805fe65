//! Points of many frames fused into landmarks.

use std::cmp::Ordering;

use nalgebra::{Matrix3, Point3, Vector3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::point_lift::{LiftedPoint, PointLandmarkOptions};
use crate::detect::{Bits, DESCRIPTOR_BYTES, hamming};

/// A place in the index of positions, with the landmark's place in the map.
type Entry = GeomWithData<[f64; 3], u32>;

/// A landmark while points are fused into it.
#[derive(Clone, Debug)]
struct Fused {
    /// Where it was first seen; what follows is measured from there, to lose no digits.
    origin: Point3<f64>,
    information: Matrix3<f64>,
    /// Sum of information times offset from `origin`.
    weighted: Vector3<f64>,
    /// Where it is now.
    position: Point3<f64>,
    /// Largest radius of its points, metres.
    radius_m: f64,
    /// Frames that detected it, ascending.
    frames: Vec<u32>,
    /// Points that were fused, and how often each bit of their descriptors was set.
    points: u32,
    bits: Vec<u32>,
    /// The majority of them.
    descriptor: Bits,
    /// The descriptor that came last.
    latest: Bits,
}

/// A landmark that frames agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCandidate {
    /// Where it is, metres.
    pub position: Point3<f64>,
    /// The majority of the descriptors of its points, bit by bit.
    pub descriptor: Bits,
    /// Frames that detected it.
    pub detections: u64,
}

/// Landmarks of points, and an index of where they are.
///
/// A tree that can be changed, for landmarks move while points are fused into them; the paper's k-d tree is one that is made
/// once.
pub struct PointMap {
    options: PointLandmarkOptions,
    landmarks: Vec<Fused>,
    tree: RTree<Entry>,
}

impl PointMap {
    /// A map without landmarks.
    #[must_use]
    pub fn new(options: PointLandmarkOptions) -> Self {
        Self { options, landmarks: Vec::new(), tree: RTree::new() }
    }

    /// Landmarks so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.landmarks.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.landmarks.is_empty()
    }

    /// Adds the points of the next frame.
    ///
    /// Each point has the landmarks within its radius whose descriptor is alike as candidates, in the map as it was before
    /// the frame. Pairs are taken from the best on, by distance over radius and differing bits over the permitted ones, each
    /// point and each landmark once; points that are left become landmarks. So the order of the points does not matter, but
    /// for names.
    ///
    /// # Source
    /// Open-Structure (Li et al. 2024), section III-A: radius and descriptor distance. That pairs are one to one, and that
    /// landmarks move to the mean weighted by information, is ours.
    pub fn add_frame(&mut self, frame: u32, points: &[LiftedPoint]) {
        let mut pairs: Vec<(f64, usize, u32)> = Vec::new();
        for (index, point) in points.iter().enumerate() {
            let position: [f64; 3] = point.position.coords.into();
            let near = self.tree.locate_within_distance(position, point.radius_m * point.radius_m);
            for entry in near {
                let landmark = &self.landmarks[entry.data as usize];
                let bits = landmark.difference(&point.descriptor);
                if bits <= self.options.max_hamming {
                    let distance = (landmark.position - point.position).norm() / point.radius_m.max(1e-12);
                    let likeness = f64::from(bits) / f64::from(self.options.max_hamming.max(1));
                    pairs.push((distance + likeness, index, entry.data));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)).then(a.1.cmp(&b.1)));
        let mut taken = vec![false; points.len()];
        for (_, index, place) in pairs {
            let landmark = &mut self.landmarks[place as usize];
            if taken[index] || landmark.frames.last() == Some(&frame) {
                continue;
            }
            taken[index] = true;
            let before = landmark.position;
            landmark.fuse(frame, &points[index]);
            move_entry(&mut self.tree, place, before, landmark.position);
        }
        for (point, _) in points.iter().zip(taken).filter(|(_, taken)| !taken) {
            // Names end with what 32 bits can tell apart; the memory does before.
            let Ok(place) = u32::try_from(self.landmarks.len()) else { return };
            self.tree.insert(GeomWithData::new(point.position.coords.into(), place));
            self.landmarks.push(Fused::new(frame, point));
        }
    }

    /// The landmarks that enough frames detected, in the order in which they were first seen.
    ///
    /// Landmarks that came to lie within each other's radius and look alike are fused first, the closest pairs before others.
    #[must_use]
    pub fn finish(mut self) -> Vec<PointCandidate> {
        self.merge();
        let enough =
            |landmark: &Fused| landmark.frames.len() as u64 >= u64::from(self.options.min_detections).max(1);
        self.landmarks
            .into_iter()
            .filter(enough)
            .map(|landmark| PointCandidate {
                position: landmark.position,
                descriptor: landmark.descriptor,
                detections: landmark.frames.len() as u64,
            })
            .collect()
    }

    fn merge(&mut self) {
        let mut pairs: Vec<(f64, u32, u32)> = Vec::new();
        for (place, landmark) in (0..).zip(&self.landmarks) {
            let position: [f64; 3] = landmark.position.coords.into();
            let near = self.tree.locate_within_distance(position, landmark.radius_m * landmark.radius_m);
            for entry in near.filter(|entry| entry.data > place) {
                let other = &self.landmarks[entry.data as usize];
                if other.difference(&landmark.descriptor) <= self.options.max_hamming {
                    pairs.push(((other.position - landmark.position).norm(), place, entry.data));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        // One that was fused is not fused again: chains would grow without end.
        let mut fused = vec![false; self.landmarks.len()];
        for (_, place, other) in pairs {
            if fused[place as usize] || fused[other as usize] {
                continue;
            }
            fused[place as usize] = true;
            fused[other as usize] = true;
            if let Ok([kept, absorbed]) = self.landmarks.get_disjoint_mut([place as usize, other as usize]) {
                kept.absorb(absorbed);
            }
        }
    }
}

fn move_entry(tree: &mut RTree<Entry>, place: u32, before: Point3<f64>, after: Point3<f64>) {
    if before != after && tree.remove(&GeomWithData::new(before.coords.into(), place)).is_some() {
        tree.insert(GeomWithData::new(after.coords.into(), place));
    }
}

impl Fused {
    fn new(frame: u32, point: &LiftedPoint) -> Self {
        let mut landmark = Self {
            origin: point.position,
            information: Matrix3::zeros(),
            weighted: Vector3::zeros(),
            position: point.position,
            radius_m: 0.0,
            frames: Vec::new(),
            points: 0,
            bits: vec![0; 8 * DESCRIPTOR_BYTES],
            descriptor: point.descriptor,
            latest: point.descriptor,
        };
        landmark.fuse(frame, point);
        landmark
    }

    /// Bits in which a descriptor differs from this landmark's: from the majority, or from the latest.
    fn difference(&self, descriptor: &Bits) -> u32 {
        hamming(&self.descriptor, descriptor).min(hamming(&self.latest, descriptor))
    }

    fn fuse(&mut self, frame: u32, point: &LiftedPoint) {
        self.information += point.information;
        self.weighted += point.information * (point.position - self.origin);
        self.radius_m = self.radius_m.max(point.radius_m);
        self.frames.push(frame);
        self.points += 1;
        self.latest = point.descriptor;
        for (bit, count) in self.bits.iter_mut().enumerate() {
            *count += u32::from(point.descriptor[bit / 8] >> (bit % 8) & 1);
        }
        self.settle();
    }

    /// Takes another landmark in, which stays as an empty place that no frame detected.
    fn absorb(&mut self, other: &mut Self) {
        self.information += other.information;
        self.weighted += other.weighted + other.information * (other.origin - self.origin);
        self.radius_m = self.radius_m.max(other.radius_m);
        self.frames.append(&mut other.frames);
        self.frames.sort_unstable();
        self.frames.dedup();
        self.points += other.points;
        for (count, more) in self.bits.iter_mut().zip(&other.bits) {
            *count += more;
        }
        self.settle();
    }

    /// Position and descriptor follow from the sums.
    fn settle(&mut self) {
        if let Some(factors) = self.information.cholesky() {
            self.position = self.origin + factors.solve(&self.weighted);
        }
        for (bit, count) in self.bits.iter().enumerate() {
            let byte = &mut self.descriptor[bit / 8];
            let mask = 1_u8 << (bit % 8);
            // Where as many say one as the other, what was, stays.
            match (2 * count).cmp(&self.points) {
                Ordering::Greater => *byte |= mask,
                Ordering::Less => *byte &= !mask,
                Ordering::Equal => (),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use open_structure::simulate::Random;

    const SIGMA_M: f64 = 0.01;

    /// Points of a lattice, each with a descriptor of its own, as frames see them with noise.
    fn seen(frame: u32, truth: &[(Point3<f64>, Bits)]) -> Vec<LiftedPoint> {
        let mut random = Random::new(3, "point map", frame.into());
        let lifted = truth.iter().map(|(position, descriptor)| {
            let offset = Vector3::new(random.normal(), random.normal(), random.normal()) * SIGMA_M;
            let mut descriptor = *descriptor;
            for _ in 0..10 {
                let bit = random.index(256);
                descriptor[bit / 8] ^= 1 << (bit % 8);
            }
            LiftedPoint {
                position: position + offset,
                information: Matrix3::identity() / (SIGMA_M * SIGMA_M),
                radius_m: 6.0 * SIGMA_M,
                descriptor,
            }
        });
        lifted.collect()
    }

    fn lattice() -> Vec<(Point3<f64>, Bits)> {
        let mut random = Random::new(4, "point map", 0);
        let mut truth = Vec::new();
        for x in 0..6 {
            for y in 0..5 {
                let descriptor = std::array::from_fn(|_| u8::try_from(random.index(256)).unwrap());
                // In one plane, as on a wall.
                truth.push((Point3::new(f64::from(x), f64::from(y), 2.0), descriptor));
            }
        }
        truth
    }

    #[test]
    fn a_landmark_is_the_mean_of_its_points_and_as_good() {
        let truth = lattice();
        let mut map = PointMap::new(PointLandmarkOptions::default());
        let frames = 50;
        for frame in 0..frames {
            map.add_frame(frame, &seen(frame, &truth));
        }
        let found = map.finish();
        assert_eq!(found.len(), truth.len());
        let squares: f64 = found
            .iter()
            .zip(&truth)
            .map(|(landmark, (position, descriptor))| {
                assert_eq!(landmark.detections, u64::from(frames));
                // Of 50 votes on each bit about two are wrong.
                assert_eq!(landmark.descriptor, *descriptor);
                (landmark.position - position).norm_squared()
            })
            .sum();
        // 90 numbers of variance σ²/50: their mean square is within 45 % (three deviations) of that.
        let ratio = squares / 90.0 / (SIGMA_M * SIGMA_M / f64::from(frames));
        assert!((ratio - 1.0).abs() < 0.45, "{ratio}");
    }

    #[test]
    fn the_order_of_points_in_a_frame_changes_names_alone() {
        let truth = lattice();
        let run = |turned: bool| {
            let mut map = PointMap::new(PointLandmarkOptions::default());
            for frame in 0..5 {
                let mut points = seen(frame, &truth);
                if turned {
                    points.reverse();
                }
                map.add_frame(frame, &points);
            }
            map.finish()
        };
        let (straight, mut turned) = (run(false), run(true));
        turned.reverse();
        assert_eq!(straight, turned);
    }

    #[test]
    fn what_looks_different_is_another_landmark_and_what_is_seen_once_is_none() {
        let [mut one, mut other] = [0_u8, 255].map(|byte| {
            let truth = [(Point3::new(0.0, 0.0, 2.0), [byte; DESCRIPTOR_BYTES])];
            seen(0, &truth).remove(0)
        });
        one.position = Point3::new(0.0, 0.0, 2.0);
        other.position = one.position;
        let mut map = PointMap::new(PointLandmarkOptions::default());
        map.add_frame(0, &[one.clone(), other.clone()]);
        map.add_frame(1, &[one.clone()]);
        assert_eq!(map.len(), 2);
        assert_eq!(map.finish().len(), 1);
        // Hundreds of points at one place are one landmark each, and no trouble.
        let mut map =
            PointMap::new(PointLandmarkOptions { max_hamming: 0, ..PointLandmarkOptions::default() });
        for index in 0..300_u32 {
            let mut point = one.clone();
            point.descriptor[..4].copy_from_slice(&index.to_le_bytes());
            map.add_frame(index, &[point]);
        }
        assert_eq!(map.len(), 300);
    }

    #[test]
    fn landmarks_that_came_together_are_one() {
        let truth = [(Point3::new(1e4, -1e4, 2.0), [7; DESCRIPTOR_BYTES])];
        let mut points = [0, 1].map(|frame| seen(frame, &truth).remove(0));
        for (point, x) in points.iter_mut().zip([0.0, 0.05]) {
            point.position = Point3::new(1e4 + x, -1e4, 2.0);
            point.descriptor = [7; DESCRIPTOR_BYTES];
            // Too small to find the other, until it is known how far they may be apart.
            point.radius_m = 0.04;
        }
        let mut map = PointMap::new(PointLandmarkOptions::default());
        map.add_frame(0, &points[..1]);
        map.add_frame(1, &points[1..]);
        assert_eq!(map.len(), 2);
        let mut third = points[0].clone();
        third.position.x = 1e4 + 0.005;
        third.radius_m = 0.06;
        map.add_frame(2, &[third]);
        let found = map.finish();
        assert_eq!((found.len(), found[0].detections), (1, 3));
        assert!((found[0].position.x - 1e4 - 0.055 / 3.0).abs() < 1e-9, "{}", found[0].position);
    }
}
