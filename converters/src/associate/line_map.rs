//! The lines of the world, put together from what single frames show of them.

use nalgebra::{Point3, Vector3};
use open_structure::geometry::Segment;
use rstar::{AABB, RTree, RTreeObject};

use super::line_lift::LiftedLine;
use super::line_options::LineOptions;
use super::scatter::Scatter;
use crate::agglomerate::agglomerate;

/// Sightings from which on an end needs two of them.
const ENOUGH: u32 = 3;

/// What became of a lifted line: the place of its landmark in the map as it stood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Became {
    /// A landmark of its own.
    New(usize),
    /// Part of a landmark that was there.
    Part(usize),
    /// Nothing: it has no length, or is not finite.
    Nothing,
}

/// A line of the world and what it was made of.
#[derive(Clone, Debug, PartialEq)]
pub struct LineCandidate {
    /// Its ends, world, metres.
    pub segment: Segment,
    /// Indices of the frames in which it was detected, ascending.
    pub frames: Vec<u32>,
    /// Lifted lines that became it.
    pub detections: u32,
    /// Weighted root mean square distance of all places from it, metres.
    pub rms_m: f64,
    /// How far a place of it may be from the truth in the nearest view, metres.
    pub tolerance_m: f64,
    /// Mean part of its places that lay on a rim.
    pub rim_part: f64,
}

/// Lines of the world that grow frame by frame.
#[derive(Debug)]
pub struct LineMap {
    options: LineOptions,
    /// Of the greatest angle.
    least_cosine: f64,
    landmarks: Vec<Landmark>,
    /// Where landmarks are; one that outgrows its box has another, and is found in both.
    boxes: RTree<Place>,
}

impl LineMap {
    /// An empty map.
    #[must_use]
    pub fn new(options: &LineOptions) -> Self {
        let least_cosine = libm::cos(options.fuse_angle_deg.clamp(0.0, 90.0).to_radians());
        Self { options: options.clone(), least_cosine, landmarks: Vec::new(), boxes: RTree::new() }
    }

    /// Landmarks so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.landmarks.len()
    }

    /// Whether there is no landmark yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.landmarks.is_empty()
    }

    /// Takes the lines of a frame, one after the other.
    ///
    /// A line becomes part of the landmark that it fits best: at a small angle, with the ends of the shorter near the line of the
    /// longer, and overlapping it or at a small gap. Where it fits none, it is a landmark of its own.
    ///
    /// * `frame` — index of the frame; frames come in ascending order.
    ///
    /// Returns what each became.
    ///
    /// # Source
    /// Open-Structure (Li et al. 2024), section III-A: angles and distances of lines, positions updated incrementally.
    pub fn add(&mut self, frame: u32, lines: &[LiftedLine]) -> Vec<Became> {
        let take = |line| Landmark::new(frame, line).map_or(Became::Nothing, |landmark| self.take(landmark));
        lines.iter().map(take).collect()
    }

    fn take(&mut self, new: Landmark) -> Became {
        let reach = new.reach(&self.options);
        let mut near: Vec<usize> = self
            .boxes
            .locate_in_envelope_intersecting(new.envelope(reach))
            .map(|place| place.landmark)
            .collect();
        near.sort_unstable();
        near.dedup();
        let cost = |index: usize| {
            self.landmarks[index].cost(&new, &self.options, self.least_cosine).map(|cost| (cost, index))
        };
        let best = near.into_iter().filter_map(cost).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (became, index) = if let Some((_, index)) = best {
            self.landmarks[index] = self.landmarks[index].join(&new);
            (Became::Part(index), index)
        } else {
            self.landmarks.push(new);
            (Became::New(self.landmarks.len() - 1), self.landmarks.len() - 1)
        };
        let landmark = &mut self.landmarks[index];
        let envelope = landmark.envelope(0.0);
        if !landmark.held.is_some_and(|held| rstar::Envelope::contains_envelope(&held, &envelope)) {
            // Room to grow, so that a landmark has few boxes.
            let room = landmark.envelope(0.25 * landmark.length + reach);
            landmark.held = Some(room);
            self.boxes.insert(Place { landmark: index, envelope: room });
        }
        became
    }

    /// The landmarks, after those that turned out to be one are joined, the best pair first.
    ///
    /// In the order in which they were first seen.
    #[must_use]
    pub fn finish(self) -> Vec<LineCandidate> {
        let Self { options, least_cosine, landmarks, .. } = self;
        let cost = |a: &Landmark, b: &Landmark| a.cost(b, &options, least_cosine);
        let mut landmarks = agglomerate(landmarks, cost, Landmark::join);
        landmarks.sort_by(|a, b| {
            let key = |landmark: &Landmark| landmark.ends.map(|end| [end.x, end.y, end.z]);
            let (first, second) = (key(a), key(b));
            let mut pairs = first.iter().flatten().zip(second.iter().flatten());
            let frames = a.frames.first().cmp(&b.frames.first());
            frames.then_with(|| {
                pairs.find_map(|(a, b)| Some(a.total_cmp(b)).filter(|order| order.is_ne())).unwrap_or(frames)
            })
        });
        landmarks.into_iter().map(Landmark::candidate).collect()
    }
}

/// The box of a landmark.
#[derive(Clone, Copy, Debug)]
struct Place {
    landmark: usize,
    envelope: AABB<[f64; 3]>,
}

impl RTreeObject for Place {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.envelope
    }
}

/// A line on its way to be a landmark.
#[derive(Clone, Debug)]
struct Landmark {
    /// On the line, in its direction.
    ends: [Point3<f64>; 2],
    direction: Vector3<f64>,
    length: f64,
    scatter: Scatter,
    /// The two outermost ends of detections on either side, the outermost first; twice the same where there is one.
    outermost: [[Point3<f64>; 2]; 2],
    frames: Vec<u32>,
    detections: u32,
    rms_m: f64,
    tolerance_m: f64,
    rim_sum: f64,
    held: Option<AABB<[f64; 3]>>,
}

impl Landmark {
    fn new(frame: u32, line: &LiftedLine) -> Option<Self> {
        let ends = [line.segment.start, line.segment.end];
        let finite = ends.iter().all(|end| end.iter().all(|c| c.is_finite()));
        let direction = line.segment.direction().filter(|_| finite)?;
        let (_, rms_m) = line.scatter.line(&direction)?;
        Some(Self {
            ends,
            direction,
            length: line.segment.length(),
            scatter: line.scatter,
            outermost: ends.map(|end| [end; 2]),
            frames: vec![frame],
            detections: 1,
            rms_m,
            tolerance_m: line.tolerance_m,
            rim_sum: line.rim_part,
            held: None,
        })
    }

    /// How far another may be that is the same, at least by its own tolerance, metres.
    fn reach(&self, options: &LineOptions) -> f64 {
        options.fuse_gap_m + options.fuse_distance_m + 4.0 * options.fuse_widths * self.tolerance_m
    }

    fn envelope(&self, room: f64) -> AABB<[f64; 3]> {
        let corner = |pick: fn(f64, f64) -> f64, room: f64| {
            [0, 1, 2].map(|axis| pick(self.ends[0][axis], self.ends[1][axis]) + room)
        };
        AABB::from_corners(corner(f64::min, -room), corner(f64::max, room))
    }

    /// How badly two fit one line; `None` where they are two lines.
    fn cost(&self, other: &Self, options: &LineOptions, least_cosine: f64) -> Option<f64> {
        if self.direction.dot(&other.direction).abs() < least_cosine {
            return None;
        }
        let (long, short) = if self.length >= other.length { (self, other) } else { (other, self) };
        let offsets = short.ends.map(|end| end - long.ends[0]);
        let along = offsets.map(|offset| long.direction.dot(&offset));
        let gap = (along[0].min(along[1]) - long.length).max(-along[0].max(along[1])).max(0.0);
        if gap > options.fuse_gap_m {
            return None;
        }
        let threshold =
            options.fuse_distance_m + options.fuse_widths * (self.tolerance_m + other.tolerance_m);
        let across = offsets.map(|offset| long.direction.cross(&offset).norm());
        let worst = across[0].max(across[1]);
        (worst <= threshold).then(|| worst / threshold + gap / options.fuse_gap_m.max(f64::MIN_POSITIVE))
    }

    /// Both as one.
    fn join(&self, other: &Self) -> Self {
        let scatter = self.scatter.joined(&other.scatter);
        let towards = if self.length >= other.length { self.direction } else { other.direction };
        let towards = if towards.dot(&self.direction) < 0.0 { -towards } else { towards };
        let (direction, rms_m) = scatter.line(&towards).unwrap_or((towards, self.rms_m));
        let place = |point: &Point3<f64>| direction.dot(&(point - scatter.mean()));
        let swapped = other.direction.dot(&direction) < 0.0;
        let others = if swapped { [other.outermost[1], other.outermost[0]] } else { other.outermost };
        let detections = self.detections.saturating_add(other.detections);
        let outermost = [0, 1].map(|side| {
            let known = |landmark: &Self| if landmark.detections == 1 { 1 } else { 2 };
            let mut all = self.outermost[side][..known(self)].to_vec();
            all.extend(&others[side][..known(other)]);
            // From outside inwards: ascending at the start, descending at the end.
            all.sort_by(|a, b| {
                let order = place(a).total_cmp(&place(b));
                if side == 0 { order } else { order.reverse() }
            });
            [all[0], all[1]]
        });
        let rank = usize::from(detections >= ENOUGH);
        let extent = |rank: usize| [place(&outermost[0][rank]), place(&outermost[1][rank])];
        let [mut from, mut to] = extent(rank);
        if from >= to {
            [from, to] = extent(0);
        }
        let mut frames = [self.frames.as_slice(), &other.frames].concat();
        frames.sort_unstable();
        frames.dedup();
        Self {
            ends: [scatter.mean() + direction * from, scatter.mean() + direction * to],
            direction,
            length: to - from,
            scatter,
            outermost,
            frames,
            detections,
            rms_m,
            tolerance_m: self.tolerance_m.min(other.tolerance_m),
            rim_sum: self.rim_sum + other.rim_sum,
            held: self.held,
        }
    }

    fn candidate(self) -> LineCandidate {
        LineCandidate {
            segment: Segment { start: self.ends[0], end: self.ends[1] },
            frames: self.frames,
            detections: self.detections,
            rms_m: self.rms_m,
            tolerance_m: self.tolerance_m,
            rim_part: self.rim_sum / f64::from(self.detections),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Unit, Vector2};
    use proptest::prelude::*;

    const TOLERANCE_M: f64 = 0.005;

    /// A line as if lifted: places evenly between two points.
    fn lifted(start: Point3<f64>, end: Point3<f64>) -> LiftedLine {
        let places = (0..=20).map(|step| (start + (end - start) * (f64::from(step) / 20.0), 1.0));
        LiftedLine {
            segment: Segment { start, end },
            scatter: Scatter::of(places).unwrap(),
            tolerance_m: TOLERANCE_M,
            rim_part: 0.0,
            places: 21,
        }
    }

    fn finished(views: &[LiftedLine]) -> Vec<LineCandidate> {
        let mut map = LineMap::new(&LineOptions::default());
        for (frame, view) in (0..).zip(views) {
            map.add(frame, std::slice::from_ref(view));
        }
        map.finish()
    }

    /// A sighting: of which line, which part of it, how far either end is off, and whether it runs backwards.
    type Sighting = (usize, f64, f64, [f64; 6], bool);

    fn sightings() -> impl Strategy<Value = Vec<Sighting>> {
        let error = prop::array::uniform6(-0.002..0.002);
        prop::collection::vec((0..6_usize, 0.0..0.35, 0.65..1.0, error, any::<bool>()), 30..80)
    }

    /// Six lines of 2 m, at least 0.4 m apart or at an angle.
    fn truth(which: usize) -> Segment {
        let place = which as f64;
        let start = Point3::new(0.4 * place, 30.0 + 0.3 * place, -20.0);
        let direction =
            Unit::new_normalize(Vector3::new(0.3, if which < 3 { 1.0 } else { -1.0 }, 0.2 * place));
        Segment { start, end: start + direction.into_inner() * 2.0 }
    }

    fn view((which, from, to, error, backwards): &Sighting) -> LiftedLine {
        let line = truth(*which);
        let along = line.end - line.start;
        let start = line.start + along * *from + Vector3::new(error[0], error[1], error[2]);
        let end = line.start + along * *to + Vector3::new(error[3], error[4], error[5]);
        if *backwards { lifted(end, start) } else { lifted(start, end) }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn sightings_of_some_lines_become_these_lines(sightings in sightings()) {
            let views: Vec<_> = sightings.iter().map(view).collect();
            let found = finished(&views);
            let mut seen: Vec<usize> = sightings.iter().map(|sighting| sighting.0).collect();
            seen.sort_unstable();
            seen.dedup();
            prop_assert_eq!(found.len(), seen.len());
            prop_assert_eq!(found.iter().map(|line| line.detections as usize).sum::<usize>(), views.len());
            for line in &found {
                let near = |which: &usize| {
                    let truth = truth(*which).plucker().unwrap();
                    truth.distance_to_point(line.segment.start).max(truth.distance_to_point(line.segment.end))
                };
                let which = *seen.iter().min_by(|a, b| near(a).total_cmp(&near(b))).unwrap();
                // Metres: errors of 2 mm along each axis at an end, at worst carried on over half the length again.
                prop_assert!(near(&which) < 0.006, "{}", near(&which));
                let own: Vec<&Sighting> = sightings.iter().filter(|sighting| sighting.0 == which).collect();
                prop_assert_eq!(own.len(), line.detections as usize);
                // The extent: the second of either side's ends, where there are three.
                let mut starts: Vec<f64> = own.iter().map(|sighting| sighting.1 * 2.0).collect();
                let mut ends: Vec<f64> = own.iter().map(|sighting| sighting.2 * 2.0).collect();
                starts.sort_by(f64::total_cmp);
                ends.sort_by(|a, b| b.total_cmp(a));
                let rank = usize::from(own.len() >= 3);
                let along = truth(which).direction().unwrap();
                let places = [line.segment.start, line.segment.end].map(|end| along.dot(&(end - truth(which).start)));
                prop_assert!((places[0].min(places[1]) - starts[rank]).abs() < 0.005);
                prop_assert!((places[0].max(places[1]) - ends[rank]).abs() < 0.005);
                prop_assert!(line.rms_m < 0.004 && line.frames.is_sorted());
            }
        }

        #[test]
        fn the_order_of_sightings_changes_no_landmark(sightings in sightings(), shift in any::<prop::sample::Index>()) {
            let mut views: Vec<_> = sightings.iter().map(view).collect();
            let first = finished(&views);
            let turned = shift.index(views.len());
            views.rotate_left(turned);
            views.reverse();
            let mut second = finished(&views);
            for line in &first {
                let apart = |other: &LineCandidate| {
                    let (a, b) = (line.segment, other.segment);
                    let same = (a.start - b.start).norm().max((a.end - b.end).norm());
                    same.min((a.start - b.end).norm().max((a.end - b.start).norm()))
                };
                let best = (0..second.len()).min_by(|a, b| apart(&second[*a]).total_cmp(&apart(&second[*b]))).unwrap();
                // Metres: rounding of sums about 40 m from the origin.
                prop_assert!(apart(&second[best]) < 1e-9, "{}", apart(&second[best]));
                prop_assert_eq!(second.remove(best).detections, line.detections);
            }
            prop_assert!(second.is_empty());
        }
    }

    #[test]
    fn neighbours_and_crossing_lines_stay_apart_and_a_bridge_joins() {
        let line = |from: f64, to: f64, aside: Vector2<f64>| {
            lifted(Point3::new(from, aside.x, aside.y), Point3::new(to, aside.x, aside.y))
        };
        let here = Vector2::zeros();
        let beside = Vector2::new(0.1, 0.0);
        assert_eq!(finished(&[line(0.0, 1.0, here), line(0.0, 1.0, beside)]).len(), 2);
        let across = lifted(Point3::new(0.5, -0.5, 0.0), Point3::new(0.5, 0.5, 0.0));
        assert_eq!(finished(&[line(0.0, 1.0, here), across]).len(), 2);
        let parts = [line(0.0, 1.0, here), line(2.0, 3.0, here)];
        assert_eq!(finished(&parts).len(), 2);
        let bridged = finished(&[parts.as_slice(), &[line(0.9, 2.1, here)]].concat());
        assert_eq!(bridged.len(), 1);
        assert_eq!((bridged[0].detections, bridged[0].frames.clone()), (3, vec![0, 1, 2]));
    }

    #[test]
    fn what_each_line_became_is_told() {
        let line = |at: f64| lifted(Point3::new(at, 0.0, 0.0), Point3::new(at, 1.0, 0.0));
        let mut map = LineMap::new(&LineOptions::default());
        assert!(map.is_empty());
        assert_eq!(map.add(0, &[line(0.0), line(1.0)]), [Became::New(0), Became::New(1)]);
        assert_eq!(map.add(1, &[line(1.001), line(2.0)]), [Became::Part(1), Became::New(2)]);
        let odd =
            LiftedLine { segment: Segment { start: Point3::origin(), end: Point3::origin() }, ..line(3.0) };
        assert_eq!(map.add(2, &[odd]), [Became::Nothing]);
        assert_eq!(map.len(), 3);
    }
}
