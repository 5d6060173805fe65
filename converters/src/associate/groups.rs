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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Rotation3};
    use open_structure::geometry::angle_between;
    use proptest::prelude::*;

    /// Options by which two lines are a group.
    fn of_two() -> GroupOptions {
        GroupOptions { least: 2, ..GroupOptions::default() }
    }

    /// Lines around some directions: which direction, the error of theirs, midpoint, length.
    type Made = Vec<(usize, [f64; 3], [f64; 3], f64)>;

    fn made(directions: usize) -> impl Strategy<Value = Made> {
        let three = |range: f64| prop::array::uniform3(-range..range);
        prop::collection::vec((0..directions, three(0.015), three(5.0), 0.1..3.0), 2..40)
    }

    fn build(made: &Made, directions: &[Vector3<f64>]) -> Vec<Segment> {
        let line = |(which, error, middle, length): &(usize, [f64; 3], [f64; 3], f64)| {
            let half = (directions[*which] + Vector3::from(*error)).normalize() * (length / 2.0);
            let middle = Point3::from(*middle);
            Segment { start: middle - half, end: middle + half }
        };
        made.iter().map(line).collect()
    }

    fn turned(angles: [f64; 3]) -> Rotation3<f64> {
        Rotation3::from_euler_angles(angles[0], angles[1], angles[2])
    }

    fn undirected(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
        let angle = angle_between(a, b);
        angle.min(std::f64::consts::PI - angle)
    }

    proptest! {
        #[test]
        fn order_and_ends_of_the_lines_do_not_matter(
            made in made(5), angles in prop::array::uniform3(-3.0..3.0), keys in prop::collection::vec(any::<u32>(), 40),
            flips in prop::collection::vec(any::<bool>(), 40),
        ) {
            let rotation = turned(angles);
            let places = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.7, 0.7, 0.0], [0.05, 1.0, 0.0]];
            let lines = build(&made, &places.map(|place| rotation * Vector3::from(place)));
            let options = of_two();
            let mut first = lines.clone();
            let groups = group_lines(&mut first, &options);
            let mut order: Vec<usize> = (0..lines.len()).collect();
            order.sort_by_key(|line| keys[*line]);
            let flip = |line: usize| {
                let Segment { start, end } = lines[line];
                if flips[line] { Segment { start: end, end: start } } else { lines[line] }
            };
            let mut second: Vec<Segment> = order.iter().map(|line| flip(*line)).collect();
            let mut again = group_lines(&mut second, &options);
            for group in &mut again {
                group.members = group.members.iter().map(|place| order[*place]).collect();
                group.members.sort_unstable();
            }
            prop_assert_eq!(&groups, &again);
            for group in &groups {
                for (place, line) in order.iter().enumerate() {
                    if group.members.contains(line) {
                        prop_assert_eq!(first[*line], second[place]);
                    }
                }
            }
        }

        #[test]
        fn lines_of_a_group_are_parallel_and_were_hardly_moved(
            made in made(5), angles in prop::array::uniform3(-3.0..3.0),
        ) {
            let rotation = turned(angles);
            let places = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.7, 0.7, 0.0], [0.05, 1.0, 0.0]];
            let lines = build(&made, &places.map(|place| rotation * Vector3::from(place)));
            let options = of_two();
            let mut after = lines.clone();
            let groups = group_lines(&mut after, &options);
            let parallel: Vec<&Group> = groups.iter().filter(|group| group.kind == registry::PARALLEL).collect();
            let mut times = vec![0; lines.len()];
            for group in &parallel {
                prop_assert!(group.members.len() >= 2 && group.members.is_sorted());
                for member in &group.members {
                    times[*member] += 1;
                    let (old, new) = (&lines[*member], &after[*member]);
                    // Radians: a rounding of coordinates of a few metres over at least 0.1 m.
                    prop_assert!(angle_between(&new.direction().unwrap(), &group.direction) < 1e-13);
                    prop_assert!((old.length() - new.length()).abs() < 1e-13);
                    prop_assert!((old.midpoint() - new.midpoint()).norm() < 1e-13);
                    // Making directions orthogonal turns them by less than the tolerance on top of what a group allows.
                    let turn = options.angle_deg.min(2.0 * (options.shift_m / old.length()).asin().to_degrees());
                    let limit = turn + options.orthogonal_deg;
                    let angle = undirected(&old.direction().unwrap(), &group.direction).to_degrees();
                    prop_assert!(angle <= limit + 1e-9, "{angle} {limit}");
                }
            }
            for (line, times) in times.into_iter().enumerate() {
                prop_assert!(times <= 1);
                if times == 0 {
                    prop_assert_eq!(lines[line], after[line]);
                }
            }
        }

        #[test]
        fn a_manhattan_world_becomes_exact(made in made(3), angles in prop::array::uniform3(-3.0..3.0), off in prop::array::uniform3(-0.004..0.004)) {
            let rotation = turned(angles);
            let axes = [0, 1, 2].map(|axis| Vector3::ith_axis(axis).into_inner());
            let bent = [0, 1, 2].map(|axis| rotation * (axes[axis] + axes[(axis + 1) % 3] * off[axis]));
            // Two exact lines of each direction, so that each is a group.
            let mut lines = build(&made, &bent);
            for (place, direction) in bent.iter().enumerate().flat_map(|pair| [pair, pair]) {
                let start = Point3::new(20.0, place as f64, 0.0);
                lines.push(Segment { start, end: start + direction * 30.0 });
            }
            // Metres: room for lines of 30 m to be turned.
            let options = GroupOptions { shift_m: 1.0, ..of_two() };
            let groups = group_lines(&mut lines, &options);
            let manhattan: Vec<&Group> = groups.iter().filter(|group| group.kind == registry::MANHATTAN).collect();
            prop_assert_eq!(manhattan.len(), 1);
            let parts: Vec<&Group> = groups
                .iter()
                .filter(|group| group.kind == registry::PARALLEL && group.members.iter().any(|m| manhattan[0].members.contains(m)))
                .collect();
            prop_assert_eq!(parts.len(), 3);
            prop_assert_eq!(parts.iter().map(|part| part.members.len()).sum::<usize>(), manhattan[0].members.len());
            for (index, part) in parts.iter().enumerate() {
                prop_assert!(part.members.iter().all(|member| manhattan[0].members.contains(member)));
                for other in &parts[index + 1..] {
                    // Rounding.
                    prop_assert!(part.direction.dot(&other.direction).abs() < 1e-14);
                }
            }
            prop_assert!(parts.iter().any(|part| part.direction == manhattan[0].direction));
        }
    }

    /// Lines of given directions, two of each.
    fn pairs(directions: &[[f64; 3]]) -> Vec<Segment> {
        let pair = |(place, direction): (usize, &[f64; 3])| {
            [0.0, 1.0].map(|side| {
                let start = Point3::new(place as f64, side, 0.0);
                Segment {
                    start,
                    end: start + Vector3::from(*direction).normalize() * (2.0 - 0.1 * place as f64),
                }
            })
        };
        directions.iter().enumerate().flat_map(pair).collect()
    }

    #[test]
    fn an_upright_and_several_level_directions_are_an_atlanta() {
        let kinds = |directions: &[[f64; 3]]| {
            let groups = group_lines(&mut pairs(directions), &of_two());
            groups.into_iter().filter(|group| group.kind != registry::PARALLEL).collect::<Vec<_>>()
        };
        let upright = [0.001, 0.0, 1.0];
        let both = kinds(&[upright, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.005]]);
        assert_eq!(
            both.iter().map(|g| (g.kind, g.members.len())).collect::<Vec<_>>(),
            [("manhattan", 6), ("atlanta", 8)]
        );
        assert_eq!(both[0].direction, both[1].direction);
        assert!(undirected(&both[1].direction, &Vector3::z()) < 0.01);
        let alone = kinds(&[upright, [1.0, 0.0, 0.0], [1.0, 0.5, 0.005]]);
        assert_eq!(alone.iter().map(|g| (g.kind, g.members.len())).collect::<Vec<_>>(), [("atlanta", 6)]);
        assert!(kinds(&[upright, [1.0, 0.0, 0.0]]).is_empty());
        assert!(kinds(&[[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).is_empty());
    }

    #[test]
    fn a_long_line_that_would_move_far_stays_out_of_the_group() {
        let options = of_two();
        let mut lines = pairs(&[[1.0, 0.0, 0.0]]);
        // Two degrees off: 0.1 m moves by 1.7 mm, 10 m by 17 cm.
        let beside = |length: f64, slope: f64| {
            let start = Point3::new(0.0, 3.0, 0.0);
            Segment { start, end: start + Vector3::new(1.0, slope, 0.0).normalize() * length }
        };
        lines.extend([beside(0.1, 0.0349), beside(10.0, -0.0349)]);
        let groups = group_lines(&mut lines, &options);
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].members, [0, 1, 2]);
    }

    #[test]
    fn lines_without_a_direction_are_in_no_group() {
        let here = Point3::new(1.0, 2.0, 3.0);
        let nowhere = Point3::new(f64::NAN, 0.0, f64::INFINITY);
        let mut lines = vec![Segment { start: here, end: here }; 2];
        lines.extend([Segment { start: nowhere, end: here }; 2]);
        lines.extend(pairs(&[[1.0, 0.0, 0.0]]));
        let groups = group_lines(&mut lines, &of_two());
        assert_eq!(groups.iter().map(|group| group.members.clone()).collect::<Vec<_>>(), [[4, 5]]);
        assert!(group_lines(&mut [], &of_two()).is_empty());
    }
}
