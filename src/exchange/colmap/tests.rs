use super::*;
use crate::exchange::ImportNames;
use crate::geometry::{PinholeCamera, Pose};
use crate::structure::{
    Camera, CameraId, FactorGraph, FrameId, GraphFactor, GraphPoint, GraphPose, PointId, PoseRow, registry,
};
use nalgebra::{Point3, Vector6};
use proptest::prelude::*;

fn names() -> ImportNames {
    ImportNames { sequence: "s".to_owned(), graph: "g".to_owned() }
}

fn written(model: &ColmapModel) -> [Vec<u8>; 3] {
    let [mut cameras, mut images, mut points] = [const { Vec::new() }; 3];
    write_colmap(&mut cameras, &mut images, &mut points, model).unwrap();
    [cameras, images, points]
}

fn read([cameras, images, points]: &[Vec<u8>; 3]) -> Result<ColmapModel, crate::exchange::Error> {
    read_colmap(cameras.as_slice(), images.as_slice(), points.as_slice())
}

/// A graph in which every frame sees every point, half a pixel or so beside its image.
fn graph() -> impl Strategy<Value = FactorGraph> {
    let pose = prop::array::uniform6(-0.3..0.3_f64).prop_map(|numbers| Pose::exp(&Vector6::from(numbers)));
    let point = (-1.0..1.0_f64, -1.0..1.0_f64, 3.0..6.0_f64);
    let fy = prop_oneof![Just(-480.0), Just(539.2)];
    let origin = prop_oneof![Just(registry::PIXEL_CENTER), Just(registry::PIXEL_CORNER)];
    (prop::collection::vec(pose, 1..4), prop::collection::vec(point, 1..5), fy, origin).prop_map(
        |(poses, points, fy, origin)| {
            let pinhole = PinholeCamera { fx: 481.2, fy, cx: 319.5, cy: 239.5, width: 640, height: 480 };
            let mut graph = FactorGraph {
                name: "g".to_owned(),
                cameras: vec![Camera::pinhole(CameraId(2), &pinhole, origin)],
                ..FactorGraph::default()
            };
            for (id, (x, y, z)) in (0..).zip(points) {
                let point_id = PointId(3 * id);
                graph.points.push(GraphPoint { graph: "g".to_owned(), point_id, x, y, z });
            }
            for (id, pose) in (0..).zip(poses) {
                let frame_id = FrameId(5 * id);
                graph.camera_of_frame.insert(frame_id, CameraId(2));
                graph.poses.push(GraphPose::new("g".to_owned(), frame_id, false, PoseRow::from(&pose)));
                for row in graph.points.clone() {
                    let seen = pinhole.project(pose.inverse() * Point3::new(row.x, row.y, row.z)).unwrap();
                    graph.factors.push(GraphFactor {
                        graph: "g".to_owned(),
                        factor_id: i64::try_from(graph.factors.len()).unwrap(),
                        kind: registry::POINT_REPROJECTION.to_owned(),
                        frame_id: Some(frame_id),
                        other_frame_id: None,
                        point_id: Some(row.point_id),
                        line_id: None,
                        group_id: None,
                        measurement: vec![seen.x + 0.5, seen.y - 0.25],
                        information: None,
                    });
                }
            }
            graph
        },
    )
}

/// What COLMAP itself would find between a point's image and where it was seen, pixels.
fn residuals(model: &ColmapModel) -> Vec<[f64; 2]> {
    let mut residuals = Vec::new();
    for image in &model.images {
        let camera = model.cameras.iter().find(|camera| camera.id == image.camera).unwrap();
        let [fx, fy, cx, cy] = camera.parameters[..] else { panic!("a pinhole") };
        assert!(fx > 0.0 && fy > 0.0);
        let [w, x, y, z] = image.rotation_wxyz;
        let pose = Pose::from_components(image.translation, [x, y, z, w]).unwrap();
        for seen in &image.points {
            let point = model.points.iter().find(|point| Some(point.id) == seen.point).unwrap();
            let at = pose * Point3::from(point.position);
            residuals.push([fx * at.x / at.z + cx - seen.pixel[0], fy * at.y / at.z + cy - seen.pixel[1]]);
        }
    }
    residuals
}

proptest! {
    #[test]
    fn what_is_written_is_read_to_the_last_bit(graph in graph()) {
        let (model, _) = to_colmap(&graph).unwrap();
        let files = written(&model);
        let found = read(&files).unwrap();
        prop_assert_eq!(&found, &model);
        prop_assert_eq!(written(&found), files);
    }

    #[test]
    fn residuals_are_the_same_by_the_conventions_of_the_model(graph in graph()) {
        let (model, remarks) = to_colmap(&graph).unwrap();
        prop_assert_eq!(remarks.len(), usize::from(graph.cameras[0].fy < 0.0), "{:?}", remarks);
        for [u, v] in residuals(&model) {
            // Rounding of pixels of a few hundred.
            prop_assert!((u + 0.5).abs() < 1e-10 && (v - 0.25).abs() < 1e-10, "{u} {v} px");
        }
        for point in &model.points {
            prop_assert!((point.error - 0.3125_f64.sqrt()).abs() < 1e-10, "{}", point.error);
        }
    }

    #[test]
    fn a_graph_comes_back_from_its_model(graph in graph()) {
        let (model, _) = to_colmap(&graph).unwrap();
        let imported = from_colmap(&read(&written(&model)).unwrap(), &names()).unwrap();
        prop_assert_eq!(&imported.remarks, &[]);
        let found = FactorGraph::of(&imported.sequence, "g").unwrap();
        prop_assert_eq!(found.factors.len(), graph.factors.len());
        prop_assert_eq!(&found.cameras[0].pixel_origin, registry::PIXEL_CORNER);
        let mirror = graph.cameras[0].fy < 0.0;
        for (found, point) in found.points.iter().zip(&graph.points) {
            let y = if mirror { -point.y } else { point.y };
            prop_assert_eq!((found.point_id, found.x, found.y, found.z), (point.point_id, point.x, y, point.z));
        }
        let (again, remarks) = to_colmap(&found).unwrap();
        prop_assert_eq!(&remarks, &[]);
        prop_assert_eq!(again.cameras, model.cameras);
        prop_assert_eq!(again.images.len(), model.images.len());
        for (again, image) in again.images.iter().zip(&model.images) {
            prop_assert_eq!((&again.points, again.id, &again.name), (&image.points, image.id, &image.name));
            for (again, number) in again.translation.iter().zip(&image.translation) {
                prop_assert!((again - number).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn any_bytes_get_an_answer(
        cameras in prop::collection::vec(any::<u8>(), 0..100), images in prop::collection::vec(any::<u8>(), 0..100),
        points in prop::collection::vec(any::<u8>(), 0..100),
    ) {
        let _ = read(&[cameras, images, points]);
    }

    #[test]
    fn any_words_get_an_answer(
        camera in prop::collection::vec("[0-2]|PINHOLE|0.5|-1|\n", 0..20),
        image in prop::collection::vec("[0-2]|a|0.5|-1|\n", 0..40),
        point in prop::collection::vec("[0-2]|0.5|-1|\n", 0..30),
    ) {
        let files = [camera, image, point].map(|words| words.join(" ").into_bytes());
        let _ = read(&files).map(|model| from_colmap(&model, &names()).map(drop));
    }
}

const CAMERAS: &str = "# a comment\r\n1 SIMPLE_PINHOLE 640 480 500 320 240  \r\n";
const IMAGES: &str =
    "1 1 0 0 0 0 0 0 1 a b.png\n10 20 7 30 40 -1\n2 1 0 0 0 0.5 0 0 1 c.png\n\n\n3 1 0 0 0 1 0 0 1 d.png";
const POINTS: &str = "7 0 0 5 10 20 30 0.25 1 0\n";

#[test]
fn a_small_model_is_read() {
    let model = read_colmap(CAMERAS.as_bytes(), IMAGES.as_bytes(), POINTS.as_bytes()).unwrap();
    let names_found: Vec<_> = model.images.iter().map(|image| image.name.as_str()).collect();
    assert_eq!(names_found, ["a b.png", "c.png", "d.png"]);
    let imported = from_colmap(&model, &names()).unwrap();
    assert_eq!(imported.remarks.len(), 1, "{:?}", imported.remarks);
    let sequence = &imported.sequence;
    assert_eq!(sequence.frames.len(), 3);
    assert_eq!((sequence.point_measurements[0].u, sequence.point_measurements[0].v), (10.0, 20.0));
    // The second camera stands at x = −0.5, where its translation puts the world.
    assert_eq!(sequence.graph_poses[1].world_from_camera().translation, [-0.5, 0.0, 0.0]);
}

#[test]
fn what_is_wrong_is_told_with_file_and_line() {
    let told = |cameras: &str, images: &str, points: &str| {
        let model = read_colmap(cameras.as_bytes(), images.as_bytes(), points.as_bytes());
        model.and_then(|model| from_colmap(&model, &names())).unwrap_err().to_string()
    };
    let cases = [
        (
            told("1 PINHOLE 640 0 1 1 1 1", "", ""),
            "cameras.txt line 1: expected HEIGHT, a whole number of at least 1, found 0",
        ),
        (
            told("1 RADIAL 640 480 500 320 240 0.1 0", "", ""),
            "cameras.txt: camera 1: expected PINHOLE or SIMPLE_PINHOLE, such as `colmap image_undistorter` makes, found RADIAL",
        ),
        (
            told(CAMERAS, "1 1 0 0 0 0 0 0 1 a.png\n10 20 7 30", POINTS),
            "images.txt line 2: expected Y, found the end of the line",
        ),
        (
            told(CAMERAS, "1 1 0 0 0 0 0 0 9 a.png\n", POINTS),
            "images.txt: image 1: expected camera 9, found none",
        ),
        (
            told(CAMERAS, IMAGES, "7 0 0 5 10 20 30 0.25 2 0"),
            "points3D.txt: point 7: expected itself in image 2 at place 0, found another",
        ),
        (told(CAMERAS, IMAGES, ""), "images.txt: image 1: expected point 7 in points3D.txt, found none"),
        (
            told(CAMERAS, IMAGES, "7 0 nan 5 10 20 30 0.25"),
            "points3D.txt line 1: expected X Y Z, a finite number, found nan",
        ),
    ];
    for (found, expected) in cases {
        assert_eq!(found, expected);
    }
}

#[test]
fn cameras_of_both_signs_are_refused() {
    let mut graph = FactorGraph { name: "g".to_owned(), ..FactorGraph::default() };
    for (id, fy) in [(0, 480.0), (1, -480.0)] {
        let pinhole = PinholeCamera { fx: 480.0, fy, cx: 319.5, cy: 239.5, width: 640, height: 480 };
        graph.cameras.push(Camera::pinhole(CameraId(id), &pinhole, registry::PIXEL_CENTER));
        graph.camera_of_frame.insert(FrameId(id), CameraId(id));
        let pose = PoseRow::from(&Pose::identity());
        graph.poses.push(GraphPose::new("g".to_owned(), FrameId(id), false, pose));
    }
    let message = to_colmap(&graph).unwrap_err().to_string();
    assert!(message.contains("mirrored as a whole, found 1 below 0 of 2"), "{message}");
}
