//! Writes the graph of a sequence as text for other solvers: exactly the vertices and factors that an adjustment of ours uses.
//!
//! `export SEQUENCE METHOD OUT` with METHOD `point` or `point-line`; the graph is the sequence's only one or `initial`.
//! One thing a line, its kind first; vertices and cameras are named by their place among those of their kind, from 0:
//!
//! | line | numbers |
//! |---|---|
//! | `loss cauchy S` | Cauchy's loss with scale S, sigma; `½ Σ S² ln(1 + \|r\|²/S²)` over the views, `r` in sigma |
//! | `sigma S` | standard deviation of pixel coordinates, pixels |
//! | `cost C` | what the graph costs where it begins, by our own reckoning |
//! | `camera FX FY CX CY` | `u = fx x/z + cx`, `v = fy y/z + cy`, pixels |
//! | `pose CAMERA free\|held TX TY TZ QX QY QZ QW` | where a pose begins, `world_from_camera`, metres |
//! | `prior POSE SR ST` | half the squared length of `Log(camera_from_world · world_from_camera₀)` over SR radians and ST metres, without loss, about where the pose begins |
//! | `point X Y Z` | where a point begins, metres |
//! | `line X Y Z X Y Z` | two points of where a line begins, metres |
//! | `point-view POSE POINT U V` | a measured point, pixels |
//! | `line-view POSE LINE U V U V` | the measured ends of a line, whose distances to its image are the residual, pixels |

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use open_structure::adjust::{Loss, Method, Options, adjust};
use open_structure::format;
use open_structure::geometry::PinholeCamera;
use open_structure::structure::{FactorGraph, GraphFactor, PoseRow, registry};

/// The prior that `adjust` gives to frames whose pixels leave their pose open: radians, metres; as `estimation.rs` has it.
const WEAK_PRIOR: [f64; 2] = [1.0, 100.0];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let usage = "export SEQUENCE point|point-line OUT";
    let [path, method, out] = [(); 3].map(|()| arguments.next().expect(usage));
    let methods = [Method::Point, Method::PointLine];
    let method = methods.into_iter().find(|known| known.name() == method).expect(usage);
    let sequence =
        format::open(std::path::Path::new(&path)).and_then(|reader| reader.read_all()).expect("a sequence");
    let names = FactorGraph::names(&sequence);
    let name = if names.len() == 1 { names.first().unwrap().as_str() } else { "initial" };
    let graph = FactorGraph::of(&sequence, name).expect("a graph");
    std::fs::write(out, text(&graph, method)).expect("a file that can be written");
}

/// The graph as text.
fn text(graph: &FactorGraph, method: Method) -> String {
    let mut options = Options::of(method);
    // Nothing moves: what is left is what is used, what is held, and what it costs.
    options.solver.max_iterations = 0;
    let adjusted = adjust(graph, &options).expect("a graph that can be adjusted");
    let (estimate, summary) = (&adjusted.estimate, &adjusted.summary);
    let Loss::Cauchy(scale) = options.loss else {
        panic!("expected Cauchy's loss, found {:?}", options.loss)
    };

    let mut text = String::from("# Written by peer_export, whose source says what the lines mean.\n");
    let _ = writeln!(
        text,
        "loss cauchy {scale:?}\nsigma {:?}\ncost {:?}",
        graph.noise.sigma_px, summary.initial_cost
    );
    for camera in &graph.cameras {
        let PinholeCamera { fx, fy, cx, cy, .. } = camera.projection();
        let _ = writeln!(text, "camera {fx:?} {fy:?} {cx:?} {cy:?}");
    }
    let camera_place: BTreeMap<_, _> = places(graph.cameras.iter().map(|camera| camera.camera_id));
    let used: BTreeSet<_> = estimate.trajectory.iter().map(|row| row.frame_id).collect();
    let poses: Vec<_> = graph.poses.iter().filter(|row| used.contains(&row.frame_id)).collect();
    let pose_place = places(poses.iter().map(|row| row.frame_id));
    for row in &poses {
        let still = summary.held.contains(&row.frame_id) || summary.unconstrained.contains(&row.frame_id);
        let camera = camera_place[&graph.camera_of_frame[&row.frame_id]];
        let [tx, ty, tz, qx, qy, qz, qw] = PoseRow::from(&row.world_from_camera().pose().unwrap()).numbers();
        let state = if still { "held" } else { "free" };
        let _ = writeln!(text, "pose {camera} {state} {tx:?} {ty:?} {tz:?} {qx:?} {qy:?} {qz:?} {qw:?}");
    }
    for frame in &summary.weak {
        let [turn, shift] = WEAK_PRIOR;
        let _ = writeln!(text, "prior {} {turn:?} {shift:?}", pose_place[frame]);
    }
    let used: BTreeSet<_> = estimate.points.iter().map(|row| row.point_id).collect();
    let points: Vec<_> = graph.points.iter().filter(|row| used.contains(&row.point_id)).collect();
    let point_place = places(points.iter().map(|row| row.point_id));
    points.iter().for_each(|row| _ = writeln!(text, "point {:?} {:?} {:?}", row.x, row.y, row.z));
    let used: BTreeSet<_> = estimate.lines.iter().map(|row| row.line_id).collect();
    let lines: Vec<_> = graph.lines.iter().filter(|row| used.contains(&row.line_id)).collect();
    let line_place = places(lines.iter().map(|row| row.line_id));
    for row in &lines {
        let (a, b) = (row.segment().start, row.segment().end);
        let _ = writeln!(text, "line {:?} {:?} {:?} {:?} {:?} {:?}", a.x, a.y, a.z, b.x, b.y, b.z);
    }

    let (mut point_views, mut line_views) = (0, 0);
    for factor in &graph.factors {
        let Some(pose) = factor.frame_id.and_then(|frame| pose_place.get(&frame)) else { continue };
        let numbers = &factor.measurement[..];
        match factor.kind.as_str() {
            registry::POINT_REPROJECTION => {
                let Some(point) = factor.point_id.and_then(|id| point_place.get(&id)) else { continue };
                let row = points[*point];
                let camera_from_world = poses[*pose].world_from_camera().pose().unwrap().inverse();
                let seen = camera_from_world * nalgebra::Point3::new(row.x, row.y, row.z);
                // What an adjustment takes for a point behind its camera.
                if seen.z <= 1e-6 {
                    continue;
                }
                refuse_information(factor);
                let _ = writeln!(text, "point-view {pose} {point} {:?} {:?}", numbers[0], numbers[1]);
                point_views += 1;
            }
            registry::LINE_REPROJECTION => {
                let Some(line) = factor.line_id.and_then(|id| line_place.get(&id)) else { continue };
                let [a, b, c, d] = match *numbers {
                    [a, b, c, d] | [a, b, _, c, d, _] => [a, b, c, d],
                    _ => continue,
                };
                if (c - a).hypot(d - b) <= 1e-9 {
                    continue;
                }
                refuse_information(factor);
                let _ = writeln!(text, "line-view {pose} {line} {a:?} {b:?} {c:?} {d:?}");
                line_views += 1;
            }
            _ => {}
        }
    }
    assert_eq!(
        [point_views, line_views],
        [summary.point_factors.used, summary.line_factors.used],
        "views of points and of lines that are written, and that an adjustment uses"
    );
    text
}

/// The text has one standard deviation for all.
fn refuse_information(factor: &GraphFactor) {
    assert!(factor.information.is_none(), "factor {:?}: expected no information matrix", factor.factor_id);
}

/// The place of each id in a list.
fn places<T: Ord>(ids: impl Iterator<Item = T>) -> BTreeMap<T, usize> {
    ids.zip(0..).collect()
}
