//! Things in space in a tree of boxes, so that whole boxes outside a frustum are passed over.

use nalgebra::{Point3, Vector3};

/// Things that a leaf holds, where they do not all lie at one place.
const LEAF: usize = 16;
/// Bits of a cell's number along an axis.
const BITS: u32 = 16;

/// A box of the tree with what lies in it: things from `begin` to `end` of the order.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub(super) center: Point3<f64>,
    /// Half the size.
    pub(super) half: Vector3<f64>,
    pub(super) begin: usize,
    pub(super) end: usize,
    /// The first node after this one that is not within it; the next for a leaf.
    pub(super) exit: usize,
}

/// Nodes in the order in which they are gone through: each before those within it.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// Places of the things, those of a box next to each other.
    pub(super) order: Vec<u32>,
}

impl Tree {
    /// A tree of boxes given by their least and greatest corners; they are sorted by their middles.
    pub(super) fn new(boxes: &[[Point3<f64>; 2]]) -> Self {
        let middle = |[low, high]: &[Point3<f64>; 2]| nalgebra::center(low, high);
        let Some(first) = boxes.first().map(middle) else { return Self::default() };
        let (low, high) = boxes
            .iter()
            .map(middle)
            .fold((first, first), |(low, high), point| (low.inf(&point), high.sup(&point)));
        let size = ((high - low).amax() / f64::from(u16::MAX)).max(f64::MIN_POSITIVE);
        let cell_of = |point: Point3<f64>| (point - low).map(|number| clamp_to_u16(number / size));
        let mut order: Vec<(u64, u32)> =
            (0_u32..).zip(boxes).map(|(id, bounds)| (interleave(cell_of(middle(bounds))), id)).collect();
        order.sort_unstable();
        let mut tree = Self { nodes: Vec::new(), order: order.iter().map(|(_, id)| *id).collect() };
        tree.grow(boxes, &order, 0, 3 * BITS);
        tree
    }

    /// Adds the node of a run of the order, which begins at `begin`, and those within it.
    fn grow(&mut self, boxes: &[[Point3<f64>; 2]], run: &[(u64, u32)], begin: usize, mut shift: u32) {
        let Some((_, first)) = run.first() else { return };
        let (low, high) = run
            .iter()
            .fold((boxes[*first as usize][0], boxes[*first as usize][1]), |(low, high), (_, id)| {
                (low.inf(&boxes[*id as usize][0]), high.sup(&boxes[*id as usize][1]))
            });
        let at = self.nodes.len();
        let (center, half) = (nalgebra::center(&low, &high), 0.5 * (high - low));
        self.nodes.push(Node { center, half, begin, end: begin + run.len(), exit: 0 });
        if run.len() > LEAF {
            // Down to where the run parts; the codes are sorted, so its ends say so.
            while shift > 0 && run[0].0 >> (shift - 3) == run[run.len() - 1].0 >> (shift - 3) {
                shift -= 3;
            }
            if shift > 0 {
                let mut next = begin;
                for part in run.chunk_by(|left, right| left.0 >> (shift - 3) == right.0 >> (shift - 3)) {
                    self.grow(boxes, part, next, shift - 3);
                    next += part.len();
                }
            }
        }
        self.nodes[at].exit = self.nodes.len();
    }
}

/// A cell's number along an axis.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to what fits")]
fn clamp_to_u16(number: f64) -> u16 {
    number.clamp(0.0, f64::from(u16::MAX)) as u16
}

/// Bits of three numbers, one of each in turn: near cells come near each other.
fn interleave(cell: Vector3<u16>) -> u64 {
    let spread =
        |number: u16| (0..16).fold(0_u64, |bits, bit| bits | (u64::from(number >> bit & 1) << (3 * bit)));
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}
