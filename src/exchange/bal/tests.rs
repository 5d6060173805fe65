use super::radial::Radial;
use super::*;
use crate::exchange::ImportNames;
use crate::structure::{FactorGraph, PointMeasurement};
use nalgebra::Point3;
use proptest::prelude::*;

fn names() -> ImportNames {
    ImportNames { sequence: "s".to_owned(), graph: "g".to_owned() }
}

fn written(problem: &BalProblem) -> String {
    let mut bytes = Vec::new();
    write_bal(&mut bytes, problem).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Cameras about the origin that look at points in front of them, and what they see.
fn problem() -> impl Strategy<Value = BalProblem> {
    let small = || prop::array::uniform3(-0.3..0.3_f64);
    let camera = (small(), small(), 200.0..900.0_f64, -0.05..0.05_f64, -0.01..0.01_f64).prop_map(
        |(rotation, translation, focal, k1, k2)| BalCamera { rotation, translation, focal, radial: [k1, k2] },
    );
    let point = (-1.0..1.0_f64, -1.0..1.0_f64, -6.0..-3.0_f64).prop_map(|(x, y, z)| [x, y, z]);
    (prop::collection::vec(camera, 1..4), prop::collection::vec(point, 1..6), any::<bool>()).prop_map(
        |(mut cameras, points, straight)| {
            if straight {
                cameras.iter_mut().for_each(|camera| camera.radial = [0.0; 2]);
            }
            let mut problem = BalProblem { cameras, points, observations: Vec::new() };
            for camera in 0..problem.cameras.len() {
                for point in 0..problem.points.len() {
                    let pixel = problem.cameras[camera].project(problem.points[point]).unwrap();
                    let pixel = [pixel[0] + 0.25, pixel[1] - 0.5];
                    problem.observations.push(BalObservation { camera, point, pixel });
                }
            }
            problem
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read_to_the_last_bit(problem in problem()) {
        let text = written(&problem);
        let found = read_bal(text.as_bytes()).unwrap();
        prop_assert_eq!(&found, &problem);
        prop_assert_eq!(written(&found), text);
    }

    #[test]
    fn any_bytes_get_an_answer(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_bal(bytes.as_slice()).map(|problem| from_bal(&problem, &names()).map(drop));
    }

    #[test]
    fn any_words_get_an_answer(words in prop::collection::vec("[0-3]|-1|1e300|nan|0.5", 0..60)) {
        let _ = read_bal(words.join(" ").as_bytes()).map(|problem| from_bal(&problem, &names()).map(drop));
    }

    #[test]
    fn what_is_imported_is_finite(numbers in prop::array::uniform14("[1-3]|1e-300|1e300|-1e300|0[.]5")) {
        let text = format!("1 1 1\n0 0 {}", numbers.join("\n"));
        let problem = read_bal(text.as_bytes()).unwrap();
        if let Ok(imported) = from_bal(&problem, &names()) {
            for row in &imported.sequence.graph_factors {
                let weights = row.information.as_deref().unwrap_or_default();
                prop_assert!(row.measurement.iter().chain(weights).all(|number| number.is_finite()));
            }
            for row in &imported.sequence.graph_poses {
                prop_assert!(row.world_from_camera().numbers().iter().all(|number| number.is_finite()));
            }
        }
    }

    #[test]
    fn distortion_is_undone_where_it_grows(k1 in -0.3..0.3_f64, k2 in -0.1..0.3_f64, x in -0.8..0.8_f64, y in -0.8..0.8_f64) {
        let radial = Radial([k1, k2]);
        let squared = x * x + y * y;
        // Short of the fold, with a margin at which the inverse is well conditioned.
        let grows = (1..=20).all(|step| {
            let at = squared * f64::from(step) / 20.0;
            1.0 + at * (3.0 * k1 + at * 5.0 * k2) > 0.05
        });
        prop_assume!(grows);
        let [u, v] = radial.undistort(radial.distort([x, y])).unwrap();
        prop_assert!((u - x).abs() + (v - y).abs() < 1e-13, "{u} {v}");
    }

    #[test]
    fn the_derivative_of_the_distortion_is_that_of_differences(k1 in -0.3..0.3_f64, k2 in -0.3..0.3_f64, x in -1.0..1.0_f64, y in -1.0..1.0_f64) {
        let radial = Radial([k1, k2]);
        let [xx, xy, yy] = radial.jacobian([x, y]);
        let step = 1e-6;
        let [[ax, ay], [bx, by]] = [radial.distort([x + step, y]), radial.distort([x - step, y])];
        let [[cx, cy], [dx, dy]] = [radial.distort([x, y + step]), radial.distort([x, y - step])];
        let found = [(ax - bx), (ay - by), (cx - dx), (cy - dy)].map(|difference| difference / (2.0 * step));
        for (found, expected) in found.into_iter().zip([xx, xy, xy, yy]) {
            prop_assert!((found - expected).abs() < 1e-8, "{found} {expected}");
        }
    }

    #[test]
    fn residuals_are_the_same_here_and_there(problem in problem()) {
        let imported = from_bal(&problem, &names()).unwrap();
        prop_assert_eq!(&imported.remarks, &[]);
        let graph = FactorGraph::of(&imported.sequence, "g").unwrap();
        for (factor, observation) in graph.factors.iter().zip(&problem.observations) {
            let camera = &graph.cameras[observation.camera];
            let pose = graph.poses[observation.camera].world_from_camera().pose().unwrap();
            let row = &graph.points[observation.point];
            let seen = camera.projection().project(pose.inverse() * Point3::new(row.x, row.y, row.z)).unwrap();
            // The projected point, given the lens back, is BAL's.
            let of = problem.cameras[observation.camera];
            let flat = [(seen.x - camera.cx) / camera.fx, -(seen.y - camera.cy) / camera.fy];
            let [u, v] = Radial(of.radial).distort(flat).map(|part| of.focal * part);
            let [x, y] = of.project(problem.points[observation.point]).unwrap();
            prop_assert!((u - x).abs() + (v - y).abs() < 1e-10, "{u} {v}, {x} {y} px");
            // And the weighted residual is BAL's, to the first order.
            let (du, dv) = (factor.measurement[0] - seen.x, factor.measurement[1] - seen.y);
            let weights = factor.information.clone().unwrap_or_else(|| vec![1.0, 0.0, 1.0]);
            let ours = weights[0] * du * du + 2.0 * weights[1] * du * dv + weights[2] * dv * dv;
            let [ru, rv] = problem.residual(observation).unwrap();
            prop_assert!((ours - (ru * ru + rv * rv)).abs() < 2e-3, "{ours}");
        }
    }

    #[test]
    fn a_problem_comes_back_from_a_sequence(problem in problem()) {
        let imported = from_bal(&problem, &names()).unwrap();
        let (found, remarks) = to_bal(&FactorGraph::of(&imported.sequence, "g").unwrap()).unwrap();
        prop_assert!(remarks.is_empty(), "{:?}", remarks);
        prop_assert_eq!(&found.points, &problem.points);
        for (found, camera) in found.cameras.iter().zip(&problem.cameras) {
            prop_assert_eq!((found.focal, found.radial), (camera.focal, camera.radial));
            for (found, number) in found.rotation.iter().chain(&found.translation).zip(camera.rotation.iter().chain(&camera.translation)) {
                prop_assert!((found - number).abs() < 1e-14, "{found} {number}");
            }
        }
        for (found, observation) in found.observations.iter().zip(&problem.observations) {
            prop_assert_eq!((found.camera, found.point), (observation.camera, observation.point));
            for (found, number) in found.pixel.iter().zip(observation.pixel) {
                prop_assert!((found - number).abs() < 1e-10, "{found} {number} px");
            }
        }
    }
}

#[test]
fn a_pixel_that_no_ray_of_the_lens_reaches_is_counted() {
    // r(1 − 0.5 r²) is at most 0.544.
    let text = "1 1 2\n0 0 30 0\n0 0 60 0\n0 0 0 0 0 0 100 -0.5 0\n0 0 -5\n";
    let problem = read_bal(text.as_bytes()).unwrap();
    let imported = from_bal(&problem, &names()).unwrap();
    let rows: &Vec<PointMeasurement> = &imported.sequence.point_measurements;
    assert_eq!(rows.len(), 1);
    assert_eq!(imported.remarks.len(), 1);
    assert!(imported.remarks[0].loss && imported.remarks[0].count == 1, "{:?}", imported.remarks);
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let cases = [
        ("", "expected the number of cameras, found the end of the file"),
        ("1 1", "line 1: expected the number of observations, found the end of the file"),
        ("1 1 1\n1 0 0 0", "line 2: expected the place of a camera, a whole number below 1, found 1"),
        ("1 1 1\n0 0 inf 0", "line 2: expected a pixel, a finite number, found inf"),
        ("0 0 0\n5", "line 2: expected the end of the file, found 5"),
        (
            "99999999999 0 0",
            "line 1: expected the number of cameras, a whole number below 50000001, found 99999999999",
        ),
    ];
    for (text, message) in cases {
        let found = read_bal(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(found.trim_start_matches("line 0: "), message);
    }
}
