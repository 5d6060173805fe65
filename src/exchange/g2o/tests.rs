use super::element::LAYOUTS;
use super::information::{from_plane, from_space, symmetric, to_plane, to_space, upper};
use super::*;
use crate::exchange::{Error, ImportNames};
use crate::geometry::Pose;
use crate::structure::{FactorGraph, FrameId, PoseRow, registry};
use nalgebra::{Vector3, Vector6};
use proptest::prelude::*;

fn names() -> ImportNames {
    ImportNames { sequence: "s".to_owned(), graph: "g".to_owned() }
}

fn read(text: &str) -> Result<G2oGraph, Error> {
    read_g2o(text.as_bytes())
}

fn written(graph: &G2oGraph) -> String {
    let mut bytes = Vec::new();
    write_g2o(&mut bytes, graph).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |number| number.is_finite())
}

fn element() -> impl Strategy<Value = G2oElement> {
    (0..LAYOUTS.len()).prop_flat_map(|place| {
        let layout = &LAYOUTS[place];
        let ids = prop::collection::vec(0..i64::MAX, layout.ids.map_or(1..5, |count| count..count + 1));
        let numbers = prop::collection::vec(number(), layout.numbers);
        (ids, numbers).prop_map(move |(ids, numbers)| G2oElement::new(LAYOUTS[place].kind, &ids, numbers))
    })
}

fn pose() -> impl Strategy<Value = Pose> {
    prop::array::uniform6(-2.0..2.0_f64).prop_map(|numbers| Pose::exp(&Vector6::from(numbers)))
}

/// A positive definite matrix of condition up to about a thousand, by its upper triangle.
fn information<const N: usize>() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0_f64, N * N).prop_map(|numbers| {
        let root = nalgebra::SMatrix::<f64, N, N>::from_iterator(numbers);
        let matrix = root.transpose() * root + nalgebra::SMatrix::<f64, N, N>::identity() * 0.01;
        upper(&matrix)
    })
}

/// The error of an edge in space: translation and twice the vector part of the quaternion of `Z⁻¹ T`.
fn error_in_space(measured: &Pose, found: &Pose) -> Vector6<f64> {
    let (t, [x, y, z, w]) = (measured.inverse() * *found).components();
    let twice = if w < 0.0 { -2.0 } else { 2.0 };
    Vector6::new(t[0], t[1], t[2], twice * x, twice * y, twice * z)
}

proptest! {
    #[test]
    fn what_is_written_is_read_to_the_last_bit(
        elements in prop::collection::vec(element(), 1..20), point_offset in 0..i64::MAX,
    ) {
        let graph = G2oGraph { elements, point_offset, passed_over: Default::default() };
        let text = written(&graph);
        let found = read(&text).unwrap();
        prop_assert_eq!(&found, &graph);
        prop_assert_eq!(written(&found), text);
    }

    #[test]
    fn any_bytes_get_an_answer(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_g2o(bytes.as_slice()).map(|graph| from_g2o(&graph, &names()).map(drop));
    }

    #[test]
    fn any_elements_get_an_answer(elements in prop::collection::vec(element(), 1..6), small in any::<bool>()) {
        let mut graph = G2oGraph { elements, ..G2oGraph::default() };
        if small {
            // So that edges find vertices now and then.
            graph.elements.iter_mut().flat_map(|element| &mut element.ids).for_each(|id| *id %= 3);
        }
        let _ = from_g2o(&graph, &names()).map(|imported| {
            let finite = |numbers: &[f64]| assert!(numbers.iter().all(|number| number.is_finite()), "{numbers:?}");
            imported.sequence.graph_poses.iter().for_each(|row| finite(&row.world_from_camera().numbers()));
            imported.sequence.graph_factors.iter().for_each(|row| finite(row.information.as_deref().unwrap_or_default()));
            let graph = FactorGraph::of(&imported.sequence, "g");
            graph.map(|graph| to_g2o(&graph, G2oForm::AsItIs).map(drop))
        });
    }

    #[test]
    fn information_in_space_weighs_small_errors_as_the_file_does(
        measured in pose(), weights in information::<6>(), small in prop::array::uniform6(-1.0..1.0_f64),
    ) {
        let tangent = Vector6::from(small) * 1e-6;
        let found = Pose::exp(&tangent) * measured;
        let error = error_in_space(&measured, &found);
        let theirs = (error.transpose() * symmetric::<6>(&weights) * error)[0];
        let ours = (tangent.transpose() * symmetric::<6>(&from_space(&measured, &weights)) * tangent)[0];
        // The error is linear to the second order, 1e-6 of itself, which conditioning of 1e3 may enlarge.
        prop_assert!((theirs - ours).abs() <= 1e-3 * theirs.abs().max(ours.abs()), "{theirs} {ours}");
    }

    #[test]
    fn information_goes_to_our_tangent_and_back(measured in pose(), weights in information::<6>()) {
        let back = to_space(&measured, &from_space(&measured, &weights));
        for (back, number) in back.iter().zip(&weights) {
            // Products of numbers up to about a hundred.
            prop_assert!((back - number).abs() < 1e-11, "{back} {number}");
        }
    }

    #[test]
    fn information_in_the_plane_weighs_small_errors_as_the_file_does_and_says_nothing_else(
        [x, y, angle] in prop::array::uniform3(-2.0..2.0_f64), weights in information::<3>(),
        small in prop::array::uniform6(-1.0..1.0_f64),
    ) {
        let measured = Pose::exp(&Vector6::new(0.0, 0.0, angle, 0.0, 0.0, 0.0));
        let measured = Pose::new(measured.rotation(), Vector3::new(x, y, 0.0));
        let ours = from_plane(&measured, &weights);
        let back = to_plane(&measured, &ours);
        for (back, number) in back.iter().zip(&weights) {
            prop_assert!((back - number).abs() < 1e-12, "{back} {number}");
        }
        let matrix = symmetric::<6>(&ours);
        for outside in [0, 1, 5] {
            prop_assert!(matrix.row(outside).iter().all(|number| *number == 0.0), "{matrix}");
        }
        let tangent = Vector6::new(0.0, 0.0, small[2], small[3], small[4], 0.0) * 1e-6;
        let (t, [.., qz, qw]) = (measured.inverse() * (Pose::exp(&tangent) * measured)).components();
        let error = Vector3::new(t[0], t[1], 2.0 * qz.atan2(qw));
        let theirs = (error.transpose() * symmetric::<3>(&weights) * error)[0];
        let ours = (tangent.transpose() * matrix * tangent)[0];
        prop_assert!((theirs - ours).abs() <= 1e-3 * theirs.abs().max(ours.abs()), "{theirs} {ours}");
    }

    #[test]
    fn a_graph_comes_back_from_its_export(
        poses in prop::collection::vec(pose(), 2..5), weights in information::<6>(), depth in any::<bool>(),
        ties in any::<bool>(), up in any::<bool>(),
    ) {
        let graph = sample(&poses, &weights, depth, ties, if up { -480.0 } else { 480.0 });
        let (model, remarks) = to_g2o(&graph, G2oForm::AsItIs).unwrap();
        prop_assert_eq!(remarks.len(), 1, "points share ids with frames: {:?}", &remarks);
        let imported = from_g2o(&read(&written(&model)).unwrap(), &names()).unwrap();
        prop_assert_eq!(&imported.remarks, &[]);
        let found = FactorGraph::of(&imported.sequence, "g").unwrap();
        prop_assert_eq!(&found.poses, &graph.poses);
        prop_assert_eq!(&found.points, &graph.points);
        prop_assert_eq!(found.factors.len(), graph.factors.len());
        for (found, factor) in found.factors.iter().zip(&graph.factors) {
            prop_assert_eq!(&found.measurement, &factor.measurement);
            let (found, factor) = (found.information.as_ref().unwrap(), factor.information.as_ref().unwrap());
            for (found, number) in found.iter().zip(factor) {
                prop_assert!((found - number).abs() < 1e-11, "{found} {number}");
            }
        }
    }
}

/// A graph of some poses, a point that each of them sees and, where `ties`, relative poses.
fn sample(poses: &[Pose], weights: &[f64], depth: bool, ties: bool, fy: f64) -> FactorGraph {
    use crate::geometry::PinholeCamera;
    use crate::structure::{Camera, CameraId, GraphFactor, GraphPoint, GraphPose, PointId};
    let pinhole = PinholeCamera { fx: 481.2, fy, cx: 319.5, cy: 239.5, width: 640, height: 480 };
    let mut graph = FactorGraph {
        name: "g".to_owned(),
        cameras: vec![Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER)],
        points: vec![GraphPoint { graph: "g".to_owned(), point_id: PointId(1), x: 0.1, y: 0.2, z: 5.0 }],
        ..FactorGraph::default()
    };
    let factor = |id: usize, kind: &str| GraphFactor {
        graph: "g".to_owned(),
        factor_id: i64::try_from(id).unwrap(),
        kind: kind.to_owned(),
        frame_id: None,
        other_frame_id: None,
        point_id: None,
        line_id: None,
        group_id: None,
        measurement: Vec::new(),
        information: None,
    };
    for (place, pose) in (0..).zip(poses) {
        graph.camera_of_frame.insert(FrameId(place), CameraId(0));
        graph.poses.push(GraphPose::new("g".to_owned(), FrameId(place), place == 0, PoseRow::from(pose)));
        let (measurement, information) = if depth {
            (vec![1.5, -2.5, 0.75], vec![2.0, 0.5, 0.25, 3.0, 0.125, 4.0])
        } else {
            (vec![1.5, -2.5], vec![2.0, 0.5, 3.0])
        };
        graph.factors.push(GraphFactor {
            frame_id: Some(FrameId(place)),
            point_id: Some(PointId(1)),
            measurement,
            information: Some(information),
            ..factor(graph.factors.len(), registry::POINT_REPROJECTION)
        });
    }
    if ties {
        let measured = PoseRow::from(&(poses[0].inverse() * poses[1]));
        graph.factors.push(GraphFactor {
            frame_id: Some(FrameId(0)),
            other_frame_id: Some(FrameId(1)),
            measurement: measured.numbers().to_vec(),
            information: Some(weights.to_vec()),
            ..factor(graph.factors.len(), registry::RELATIVE_POSE)
        });
    }
    graph
}

#[test]
fn a_plane_goes_to_space_and_back() {
    let text = "VERTEX_SE2 3 1 2 0.5\nVERTEX_SE2 7 0 -1 -3.1\nFIX 3\nEDGE_SE2 3 7 1 0.25 -2 4 1 0 5 0.5 6\n";
    let imported = from_g2o(&read(text).unwrap(), &names()).unwrap();
    assert_eq!(imported.remarks.len(), 1, "{:?}", imported.remarks);
    let graph = FactorGraph::of(&imported.sequence, "g").unwrap();
    assert!(graph.poses[0].fixed && !graph.poses[1].fixed);
    assert_eq!(graph.factors[0].frame_id, Some(FrameId(3)));
    let (model, remarks) = to_g2o(&graph, G2oForm::AsItIs).unwrap();
    assert!(remarks.is_empty(), "{remarks:?}");
    let expected = read(text).unwrap();
    for (found, element) in model.elements.iter().zip(&expected.elements) {
        assert_eq!((found.kind, &found.ids), (element.kind, &element.ids));
        for (found, number) in found.numbers.iter().zip(&element.numbers) {
            assert!((found - number).abs() < 1e-14, "{found} {number}");
        }
    }
    let (space, _) = to_g2o(&graph, G2oForm::Space).unwrap();
    assert_eq!(space.elements[0].kind, G2oKind::VertexSe3);
}

#[test]
fn one_focal_length_and_its_parameters_are_read() {
    let text = "PARAMS_CAMERAPARAMETERS 0 500 320 240 0.1\nVERTEX_SE3:EXPMAP 0 1 2 3 0 0 0 1\n\
                VERTEX_XYZ 9 1 2 8\nEDGE_PROJECT_XYZ2UV:EXPMAP 9 0 0 320 240 1 0 1\n";
    let imported = from_g2o(&read(text).unwrap(), &names()).unwrap();
    let camera = &imported.sequence.manifest.cameras[0];
    assert_eq!([camera.fx, camera.fy, camera.cx, camera.cy], [500.0, 500.0, 320.0, 240.0]);
    let graph = FactorGraph::of(&imported.sequence, "g").unwrap();
    // The pose is world_from_camera, so the point lies 5 m ahead on the axis, where it was measured.
    assert_eq!(graph.poses[0].world_from_camera().translation, [1.0, 2.0, 3.0]);
    assert_eq!(graph.factors[0].measurement, [320.0, 240.0]);
    assert_eq!(imported.sequence.point_measurements.len(), 1);
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let cases = [
        ("VERTEX_SE2 0 1 2\n", "line 1: expected number 3 of 3 of VERTEX_SE2, found the end of the line"),
        (
            "\nVERTEX_SE2 0 1 2 nan\n",
            "line 2: expected number 3 of 3 of VERTEX_SE2, a finite number, found nan",
        ),
        ("VERTEX_SE2 0 1 2 3 4", "line 1: expected the end of the line, found 4"),
        ("VERTEX_SE2 -1 1 2 3", "line 1: expected an id, an integer of at least 0, found -1"),
        ("# nothing\n", "expected vertices and edges of g2o, found none"),
        ("hello world", "expected vertices and edges of g2o, found none, but lines that begin with `hello`"),
    ];
    for (text, message) in cases {
        assert_eq!(read(text).unwrap_err().to_string(), message);
    }
    let cases = [
        ("VERTEX_SE2 0 1 2 3\nVERTEX_SE2 0 1 2 3", "vertex 0: expected one of this id, found two"),
        (
            "VERTEX_SE2 0 1 2 3\nEDGE_SE2 0 1 1 2 3 1 0 0 1 0 1",
            "an EdgeSe2 of [0, 1]: vertex 1: expected a VertexSe2, found none",
        ),
        (
            "VERTEX_CAM 0 0 0 0 0 0 0 1 -5 5 0 0 0",
            "camera of frame 0: expected focal lengths fx above 0 and fy not 0, found -5.0 and 5.0",
        ),
    ];
    for (text, message) in cases {
        assert_eq!(from_g2o(&read(text).unwrap(), &names()).unwrap_err().to_string(), message);
    }
}
