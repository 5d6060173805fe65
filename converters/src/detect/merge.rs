//! Pieces of one edge that a detector has broken, put together.

use nalgebra::{Matrix2, Point2, Vector2};

use super::SegmentOptions;
use crate::agglomerate::agglomerate;

/// A segment with what its next join needs.
#[derive(Clone, Copy)]
struct Piece {
    ends: [Point2<f64>; 2],
    direction: Vector2<f64>,
    length: f64,
    /// Length of edge within the segment, less than its own by the gaps.
    mass: f64,
    mean: Point2<f64>,
    /// Second moments about the mean, per unit of mass.
    spread: Matrix2<f64>,
}

impl Piece {
    /// A piece as detected: an edge all along.
    fn new(ends: [Point2<f64>; 2]) -> Option<Self> {
        let along = ends[1] - ends[0];
        let direction = along.try_normalize(f64::MIN_POSITIVE)?;
        let length = along.norm();
        let spread = direction * direction.transpose() * (length * length / 12.0);
        Some(Self {
            ends,
            direction,
            length,
            mass: length,
            mean: nalgebra::center(&ends[0], &ends[1]),
            spread,
        })
    }

    /// The straight line nearest to the edges of both, as long as both together.
    fn join(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let (own, others) = (self.mass / mass, other.mass / mass);
        let apart = other.mean - self.mean;
        let mean = self.mean + apart * others;
        let spread = self.spread * own + other.spread * others + apart * apart.transpose() * (own * others);
        let direction = principal(&spread, &self.direction);
        let place = |end: &Point2<f64>| direction.dot(&(end - mean));
        let places = [self.ends[0], self.ends[1], other.ends[0], other.ends[1]].map(|end| place(&end));
        let from = places.into_iter().fold(f64::INFINITY, f64::min);
        let to = places.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let ends = [mean + direction * from, mean + direction * to];
        Self { ends, direction, length: to - from, mass, mean, spread }
    }

    /// How badly two fit one edge; `None` where they are two.
    fn cost(&self, other: &Self, options: &SegmentOptions, sine: f64) -> Option<f64> {
        if self.direction.perp(&other.direction).abs() > sine {
            return None;
        }
        let (long, short) = if self.length >= other.length { (self, other) } else { (other, self) };
        let offsets = short.ends.map(|end| end - long.ends[0]);
        let places = offsets.map(|offset| long.direction.dot(&offset));
        let from = places[0].min(places[1]);
        let to = places[0].max(places[1]);
        let gap = (from - long.length).max(-to);
        if gap > options.merge_gap_px {
            return None;
        }
        let across = offsets.map(|offset| long.direction.perp(&offset).abs());
        let worst = across[0].max(across[1]);
        (worst <= options.merge_distance_px).then(|| worst + 0.1 * gap.max(0.0))
    }
}

/// The longer axis of second moments, on the side of `towards`.
fn principal(spread: &Matrix2<f64>, towards: &Vector2<f64>) -> Vector2<f64> {
    let (half, cross) = ((spread.m11 - spread.m22) / 2.0, spread.m12);
    let radius = (half * half + cross * cross).sqrt();
    // Of the two forms of the eigenvector, the one whose numbers do not cancel.
    let axis =
        if half >= 0.0 { Vector2::new(half + radius, cross) } else { Vector2::new(cross, radius - half) };
    let axis = axis.try_normalize(f64::MIN_POSITIVE).unwrap_or(*towards);
    if axis.dot(towards) < 0.0 { -axis } else { axis }
}

/// Segments of whole edges: pieces that lie on one line with no more than a gap between them are joined, the best
/// pair first.
pub(super) fn merge(pieces: Vec<[Point2<f64>; 2]>, options: &SegmentOptions) -> Vec<[Point2<f64>; 2]> {
    let sine = libm::sin(options.merge_angle_deg.clamp(0.0, 90.0).to_radians());
    let pieces = pieces.into_iter().filter_map(Piece::new).collect();
    let cost = |a: &Piece, b: &Piece| a.cost(b, options, sine);
    agglomerate(pieces, cost, Piece::join).into_iter().map(|piece| piece.ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_broken_line_becomes_whole_in_any_order(
            turn in 0.0..std::f64::consts::PI,
            cuts in prop::collection::vec((5.0..40.0, 0.5..9.5), 2..8),
            order in any::<prop::sample::Index>(),
        ) {
            let options = SegmentOptions::default();
            let direction = Vector2::new(libm::cos(turn), libm::sin(turn));
            let start = Point2::new(300.0, 200.0);
            let mut pieces = Vec::new();
            let mut at = 0.0;
            for (length, gap) in &cuts {
                pieces.push([start + direction * at, start + direction * (at + length)]);
                at += length + gap;
            }
            let end = pieces[pieces.len() - 1][1];
            let turned = order.index(pieces.len());
            pieces.rotate_left(turned);
            // A neighbour that runs alongside.
            let beside = Vector2::new(-direction.y, direction.x) * 4.0;
            pieces.push([start + beside, end + beside]);
            let mut found = merge(pieces, &options);
            prop_assert_eq!(found.len(), 2);
            found.retain(|segment| (segment[0] - start).norm().min((segment[1] - start).norm()) < 1.0);
            prop_assert_eq!(found.len(), 1);
            let [a, b] = found[0];
            // Pixels: rounding of sums of some hundred pixels.
            let same = (a - start).norm().max((b - end).norm()).min((a - end).norm().max((b - start).norm()));
            prop_assert!(same < 1e-9, "{same}");
        }
    }

    #[test]
    fn a_corner_stays_a_corner_and_far_pieces_stay_apart() {
        let options = SegmentOptions::default();
        let p = Point2::new;
        let corner = vec![[p(0.0, 0.0), p(50.0, 0.0)], [p(50.0, 0.0), p(50.0, 50.0)]];
        assert_eq!(merge(corner, &options).len(), 2);
        let far = |gap: f64| vec![[p(0.0, 0.0), p(50.0, 0.0)], [p(50.0 + gap, 0.0), p(90.0, 0.0)]];
        assert_eq!(merge(far(options.merge_gap_px + 0.1), &options).len(), 2);
        assert_eq!(merge(far(options.merge_gap_px - 0.1), &options).len(), 1);
        assert!(merge(vec![[p(3.0, 3.0); 2]], &options).is_empty());
    }
}
