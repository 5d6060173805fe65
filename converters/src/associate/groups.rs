//! Lines of one direction, made parallel.

use nalgebra::{Matrix3, Vector3};
use open_structure::geometry::Segment;
use open_structure::structure::registry;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::orthogonal::make_orthogonal;
use super::scatter::Scatter;

/// Steps after which a direction that does not settle is taken as it is.
const STEPS: usize = 50;

/// What counts as a group of lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GroupOptions {
    /// Greatest angle between a line and the direction of its group, degrees.
    pub angle_deg: f64,
    /// Farthest that an end of a line may move when the line is made parallel to its group, metres.
    pub shift_m: f64,
    /// Fewest lines of a group.
    pub least: usize,
    /// Directions of groups this near to a right angle are made orthogonal, degrees; 0 leaves them as they are.
    pub orthogonal_deg: f64,
}

impl Default for GroupOptions {
    fn default() -> Self {
        // Of a hundred lines, two are parallel to within three degrees by chance.
        Self { angle_deg: 3.0, shift_m: 0.03, least: 3, orthogonal_deg: 1.0 }
    }
}

/// Lines tied by structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Kind, a value of the registry: `parallel`, `manhattan` or `atlanta`.
    pub kind: &'static str,
    /// Direction of the lines of a parallel group; of the others, that of the parallel group to which all others of it are
    /// perpendicular. A unit vector, world.
    pub direction: Vector3<f64>,
    /// Indices of the lines, ascending.
    pub members: Vec<usize>,
}

/// A line as grouping sees it.
#[derive(Clone, Copy)]
struct Axis {
    line: usize,
    direction: Vector3<f64>,
    /// Least cosine of the angle to a direction along which the line may be laid.
    cosine: f64,
    /// Length, micrometres: whole numbers, whose sums do not depend on their order.
    weight: u64,
}

impl Axis {
    fn suits(&self, direction: &Vector3<f64>) -> bool {
        self.direction.dot(direction).abs() >= self.cosine
    }
}

/// A parallel group before it is named.
pub(super) struct Bundle {
    /// Its direction, a unit vector.
    pub(super) direction: Vector3<f64>,
    /// Its lines, ascending.
    pub(super) members: Vec<usize>,
    /// Length of all lines together, micrometres.
    pub(super) weight: u64,
}

/// Finds the groups of lines and makes their lines exactly parallel.
///
/// Again and again, among the lines that are left, the one is taken around whose direction lies the greatest length of lines; the
/// direction settles on the principal direction, weighted by length, of the lines that suit it, and these are a group. A line
/// suits a direction if it is at a small angle to it and its ends would not move far. Directions of groups that are nearly
/// orthogonal are made orthogonal: three of them make a `manhattan` group, one with several perpendicular to it an `atlanta`
/// group. Then every line of a group is turned about its midpoint; it keeps its length, and runs along the direction.
///
/// Nothing depends on the order of the lines nor of their ends.
///
/// Returns parallel groups, the one with the greatest length of lines first, then what is made of them.
///
/// # Source
/// Open-Structure (Li et al. 2024), section III-A: lines classified by angle, directions unified and averaged. The clustering, the
/// limit on how far ends move and orthogonal groups are ours.
pub fn group_lines(lines: &mut [Segment], options: &GroupOptions) -> Vec<Group> {
    let mut bundles = bundles(lines, options);
    let structures = make_orthogonal(&mut bundles, options.orthogonal_deg);
    for bundle in &bundles {
        for member in &bundle.members {
            lay(&mut lines[*member], bundle.direction);
        }
    }
    let whole = |kind, parts: &[usize]| {
        let mut members: Vec<usize> = parts.iter().flat_map(|part| bundles[*part].members.clone()).collect();
        members.sort_unstable();
        Group { kind, direction: bundles[parts[0]].direction, members }
    };
    let mut groups: Vec<Group> = (0..bundles.len()).map(|part| whole(registry::PARALLEL, &[part])).collect();
    groups.extend(structures.iter().map(|(kind, parts)| whole(kind, parts)));
    groups
}

/// Turns a line about its midpoint.
fn lay(line: &mut Segment, direction: Vector3<f64>) {
    let half = direction * (line.length() / 2.0);
    let middle = line.midpoint();
    *line = Segment { start: middle - half, end: middle + half };
}

fn bundles(lines: &[Segment], options: &GroupOptions) -> Vec<Bundle> {
    let mut left: Vec<Axis> = axes(lines, options);
    let mut densities: Vec<u64> = left
        .iter()
        .map(|axis| left.iter().filter(|other| other.suits(&axis.direction)).map(|other| other.weight).sum())
        .collect();
    let mut bundles = Vec::new();
    while let Some(densest) = (0..left.len()).reduce(|a, b| if densities[b] > densities[a] { b } else { a }) {
        let (direction, mut members) = settle(&left, left[densest].direction);
        if members.len() >= options.least.max(2) {
            let weight = members.iter().map(|member| left[*member].weight).sum();
            let mut lines: Vec<usize> = members.iter().map(|member| left[*member].line).collect();
            lines.sort_unstable();
            bundles.push(Bundle { direction, members: lines, weight });
        } else {
            members = vec![densest];
        }
        for member in members.iter().rev() {
            let gone = left.remove(*member);
            densities.remove(*member);
            for (axis, density) in left.iter().zip(&mut densities) {
                if gone.suits(&axis.direction) {
                    *density -= gone.weight;
                }
            }
        }
    }
    // Stable: of equal lengths, the one found first.
    bundles.sort_by_key(|bundle| std::cmp::Reverse(bundle.weight));
    bundles
}

/// The directions of lines, in an order that their places and directions alone decide.
fn axes(lines: &[Segment], options: &GroupOptions) -> Vec<Axis> {
    let angle = options.angle_deg.clamp(0.0, 45.0).to_radians();
    let mut keyed: Vec<([f64; 7], Axis)> = Vec::with_capacity(lines.len());
    for (line, segment) in lines.iter().enumerate() {
        let (length, middle) = (segment.length(), segment.midpoint());
        let Some(direction) = segment.direction().filter(|_| middle.iter().all(|c| c.is_finite())) else {
            continue;
        };
        let direction = signed(direction);
        // An end moves by half the length times twice the sine of half the angle.
        let turn = 2.0 * libm::asin((options.shift_m.max(0.0) / length).clamp(0.0, 1.0));
        let cosine = libm::cos(angle.min(turn));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped; far below 2^64 even summed up"
        )]
        let weight = (length * 1e6).clamp(1.0, 1e12) as u64;
        let key = [length, middle.x, middle.y, middle.z, direction.x, direction.y, direction.z];
        keyed.push((key, Axis { line, direction, cosine, weight }));
    }
    keyed.sort_by(|(a, _), (b, _)| {
        let mut orders = a.iter().zip(b).map(|(a, b)| b.total_cmp(a));
        orders.find(|order| order.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    keyed.into_iter().map(|(_, axis)| axis).collect()
}

/// The direction with the sign that makes its greatest part positive.
fn signed(direction: Vector3<f64>) -> Vector3<f64> {
    if direction[direction.iamax()] < 0.0 { -direction } else { direction }
}

/// The principal direction of the lines that suit it, starting from a direction, and these lines.
fn settle(axes: &[Axis], start: Vector3<f64>) -> (Vector3<f64>, Vec<usize>) {
    let suiting = |direction: &Vector3<f64>| -> Vec<usize> {
        (0..axes.len()).filter(|index| axes[*index].suits(direction)).collect()
    };
    let mut direction = start;
    let mut members = suiting(&direction);
    for _ in 0..STEPS {
        let mut sum = Matrix3::zeros();
        for member in &members {
            let Axis { direction, weight, .. } = axes[*member];
            sum += direction * direction.transpose() * (weight as f64);
        }
        let Some(principal) = Scatter::principal(&sum) else { break };
        let next = signed(principal);
        let suiting = suiting(&next);
        // A direction whose lines are fewer than two is a line of its own.
        if suiting.is_empty() {
            break;
        }
        direction = next;
        if suiting == members {
            break;
        }
        members = suiting;
    }
    (direction, members)
}
