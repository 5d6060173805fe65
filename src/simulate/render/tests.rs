//! Rendered data against the geometry it shows.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufReader;

use super::*;
use crate::geometry::Pose;
use crate::simulate::{Recipe, simulate};
use crate::structure::{TrajectoryFormat, TrajectoryRow, read_trajectory};

/// A room with two boxes in it, seen by a small camera, a tenth of each dataset's.
const ROOM: &str = r#"
name = "room"
seed = 5
[trajectory]
kind = "waypoints"
frames = 5
look = { target_m = [0.6, 2.2, 0.8] }
waypoints = [{ position_m = [-2.2, -2.5, 1.5] }, { position_m = [0.0, -3.0, 1.7] }]
[[scene]]
kind = "room"
size_m = [7.0, 8.0, 3.0]
position_m = [0.0, 0.0, 1.5]
[[scene]]
kind = "box"
size_m = [0.8, 2.0, 2.0]
position_m = [1.6, 1.0, 1.0]
[[scene]]
kind = "box"
size_m = [1.6, 0.8, 0.75]
position_m = [-0.6, 1.2, 0.375]
roll_pitch_yaw_deg = [0.0, 0.0, 8.0]
[points]
count = 150
[lines]
count = 40
min_length_m = 0.5
"#;

const TUM: &str = "fx = 66.9\nfy = 67.4\ncx = 39.6\ncy = 30.5\nwidth = 80\nheight = 60";
const ICL: &str =
    "preset = \"icl-nuim\"\nfx = 60.15\nfy = -60.0\ncx = 39.5\ncy = 29.5\nwidth = 80\nheight = 60";
const TARTANAIR: &str =
    "preset = \"tartanair\"\nfx = 40.0\nfy = 40.0\ncx = 40.0\ncy = 30.0\nwidth = 80\nheight = 60";

fn simulation(text: &str, camera: &str) -> Simulation {
    let recipe = Recipe::from_toml(&format!("{text}\n[camera]\n{camera}")).unwrap();
    simulate(&recipe, Path::new(""), &|_, _, _| {}).unwrap()
}

fn rendered(simulation: &Simulation, layout: Layout) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = RenderOptions { frames: 1..4, stride: 2, ..RenderOptions::new(layout) };
    let found = render(simulation, &options, folder.path(), &|_, _| {}).unwrap();
    assert_eq!(found, Rendered { frames: 2, width: 80, height: 60 });
    folder
}

/// Every file of a folder, by its path from there.
fn files_of(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            found
                .extend(files_of(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            found.insert(name, fs::read(&path).unwrap());
        }
    }
    found
}

fn names(folder: &Path) -> Vec<String> {
    files_of(folder).into_keys().collect()
}

fn poses(path: &Path) -> Vec<TrajectoryRow> {
    let file = BufReader::new(File::open(path).unwrap());
    read_trajectory(file, Some(TrajectoryFormat::Tum)).unwrap()
}

fn depths(path: &Path) -> (png::OutputInfo, Vec<u16>) {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info, bytes.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect())
}

/// The eyes, what they look at, and the paint of a simulation, with the eye's column of an image position 0.
fn looking(simulation: &Simulation) -> (Vec<Eye>, Occluders, f64) {
    let manifest = simulation.manifest();
    let camera = &manifest.cameras[0];
    let eyes = simulation
        .frames()
        .iter()
        .map(|frame| Eye::new(camera, &frame.world_from_camera().unwrap()).unwrap())
        .collect();
    let origin_px = if camera.pixel_origin == "pixel-corner" { 0.5 } else { 0.0 };
    (eyes, Occluders::new(simulation.scene()), origin_px)
}

#[test]
fn depth_of_a_wall_is_its_z_and_not_its_range() {
    let wall = r#"
name = "wall"
[trajectory]
kind = "waypoints"
frames = 4
look = "waypoint"
waypoints = [
    { position_m = [0.0, 0.0, 0.0], yaw_deg = 0.0, pitch_deg = 0.0 },
    { position_m = [0.5, 0.0, 0.0], yaw_deg = 20.0, pitch_deg = 10.0 },
]
[[scene]]
kind = "box"
size_m = [16.0, 1.0, 16.0]
position_m = [0.0, 3.5, 0.0]
[points]
count = 3
[lines]
count = 0
"#;
    let simulation = simulation(wall, TUM);
    let folder = tempfile::tempdir().unwrap();
    render(&simulation, &RenderOptions::new(Layout::Tum), folder.path(), &|_, _| {}).unwrap();
    let (info, found) = depths(&folder.path().join("depth/0.000000.png"));
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Sixteen));
    // Straight ahead, the wall is 3 m away in every pixel.
    assert_eq!(found, vec![15_000; 80 * 60]);
    let (_, found) = depths(&folder.path().join("depth/0.100000.png"));
    let pose = simulation.frames()[3].world_from_camera().unwrap().pose().unwrap();
    for (index, steps) in found.iter().enumerate() {
        let (u, v) = ((index % 80) as f64, (index / 80) as f64);
        let ray = pose.transform_vector(&nalgebra::Vector3::new((u - 39.6) / 66.9, (v - 30.5) / 67.4, 1.0));
        let z = (3.0 - pose.translation().y) / ray.y;
        // Half a step, and rounding.
        assert!((f64::from(*steps) / 5000.0 - z).abs() < 0.000_1 + 1e-9, "{u} {v}: {steps} and {z} m");
    }
}

#[test]
fn depth_maps_agree_with_the_observations() {
    for camera in [TUM, ICL, TARTANAIR] {
        let simulation = simulation(ROOM, camera);
        let (eyes, occluders, origin_px) = looking(&simulation);
        let paint = Paint::new(&simulation, &occluders, &eyes, true).unwrap();
        let (mut agree, mut all) = (0, 0);
        for index in [0, 3] {
            let shot = Shot::take(&eyes[index], &occluders, &paint);
            for seen in simulation.frame(index).unwrap().point_observations {
                let (column, row) = ((seen.u - origin_px).round(), (seen.v - origin_px).round());
                if !(1.0..79.0).contains(&column) || !(1.0..59.0).contains(&row) {
                    continue;
                }
                let at =
                    |right: f64, down: f64| shot.depth_m[((row + down) * 80.0 + column + right) as usize];
                let middle = at(0.0, 0.0);
                // On a plane, depth half a pixel away differs by less than that of the neighbours.
                let steps = [-1.0, 0.0, 1.0];
                let slope = steps
                    .iter()
                    .flat_map(|right| steps.map(|down| (at(*right, down) - middle).abs()))
                    .fold(1e-9, f64::max);
                all += 1;
                // What is steeper is a step from one surface to another.
                if slope < 0.2 * middle {
                    let depth = seen.depth.unwrap();
                    assert!(
                        (depth - middle).abs() <= slope,
                        "{camera}: {depth} and {middle} m, slope {slope}"
                    );
                    agree += 1;
                }
            }
        }
        assert!(all > 80 && agree * 10 > all * 8, "{camera}: {agree} of {all}");
    }
}

#[test]
fn points_are_painted_where_they_are_observed() {
    for camera in [TUM, ICL, TARTANAIR] {
        let simulation = simulation(ROOM, camera);
        let (eyes, occluders, origin_px) = looking(&simulation);
        let paint = Paint::new(&simulation, &occluders, &eyes, true).unwrap();
        let mut count = 0;
        for (index, eye) in eyes.iter().enumerate() {
            for seen in simulation.frame(index).unwrap().point_observations {
                // The middle of a disc is all dark or all bright, in any light.
                let [red, green, blue] = paint.seen(eye, &occluders, seen.u - origin_px, seen.v - origin_px);
                let tone = if seen.point_id.0 % 2 == 0 { red < 0.03 } else { red > 0.5 };
                let grey = (red - green).abs() + (green - blue).abs() < 1e-12;
                assert!(tone && grey, "{camera}: {seen:?} {red} {green} {blue}");
                count += 1;
            }
        }
        assert!(count > 100, "{camera}: {count}");
    }
}

#[test]
fn lines_are_painted_between_dark_and_bright() {
    // So few that they seldom cross in small pictures.
    let few = ROOM.replace("count = 150", "count = 1").replace("count = 40", "count = 8");
    for camera in [TUM, ICL, TARTANAIR] {
        let simulation = simulation(&few, camera);
        let (eyes, occluders, origin_px) = looking(&simulation);
        let paint = Paint::new(&simulation, &occluders, &eyes, true).unwrap();
        let (mut flips, mut count) = (0, 0);
        for (index, eye) in eyes.iter().enumerate() {
            for seen in simulation.frame(index).unwrap().line_observations {
                let along = [seen.end_u - seen.start_u, seen.end_v - seen.start_v];
                let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
                for t in [0.25, 0.5, 0.75] {
                    let [one, other] = [0.3, -0.3].map(|aside| {
                        let u = seen.start_u + t * along[0] - along[1] / length * aside;
                        let v = seen.start_v + t * along[1] + along[0] / length * aside;
                        let color = paint.seen(eye, &occluders, u - origin_px, v - origin_px);
                        color.iter().sum::<f64>() / 3.0
                    });
                    flips += usize::from((one - other).abs() > 0.25);
                    count += 1;
                }
            }
        }
        // Some lie on the outline of a box, with another surface behind.
        assert!(count > 30 && flips * 10 > count * 7, "{camera}: {flips} of {count}");
    }
}

#[test]
fn tum_lists_name_the_files_and_the_truth() {
    let simulation = simulation(ROOM, TUM);
    let folder = rendered(&simulation, Layout::Tum);
    let expected = [
        "calibration.txt",
        "depth.txt",
        "depth/0.033333.png",
        "depth/0.100000.png",
        "groundtruth.txt",
        "rgb.txt",
        "rgb/0.033333.png",
        "rgb/0.100000.png",
    ];
    assert_eq!(names(folder.path()), expected);
    let list = fs::read_to_string(folder.path().join("rgb.txt")).unwrap();
    let expected = "# color images\n# file: 'room.bag'\n# timestamp filename\n\
                    0.033333 rgb/0.033333.png\n0.100000 rgb/0.100000.png\n";
    assert_eq!(list, expected);
    let list = fs::read_to_string(folder.path().join("depth.txt")).unwrap();
    assert!(
        list.starts_with("# depth maps\n") && list.ends_with("\n0.100000 depth/0.100000.png\n"),
        "{list}"
    );
    let calibration = fs::read_to_string(folder.path().join("calibration.txt")).unwrap();
    assert!(calibration.ends_with("\n80 60 66.9 67.4 39.6 30.5\n"), "{calibration}");
    let truth = poses(&folder.path().join("groundtruth.txt"));
    let truth: Vec<_> = truth.iter().map(|row| (row.stamp_nanos.unwrap(), row.pose)).collect();
    let expected: Vec<_> = simulation
        .frames()
        .iter()
        .map(|frame| ((frame.stamp_nanos + 500) / 1000 * 1000, frame.world_from_camera().unwrap()))
        .collect();
    assert_eq!(truth, expected);
}

#[test]
fn icl_files_name_pictures_and_poses_by_frame() {
    let simulation = simulation(ROOM, ICL);
    let folder = rendered(&simulation, Layout::Icl);
    let expected = [
        "associations.txt",
        "calibration.txt",
        "depth/1.png",
        "depth/3.png",
        "rgb/1.png",
        "rgb/3.png",
        "room.gt.freiburg",
    ];
    assert_eq!(names(folder.path()), expected);
    let list = fs::read_to_string(folder.path().join("associations.txt")).unwrap();
    assert_eq!(list, "1 depth/1.png 1 rgb/1.png\n3 depth/3.png 3 rgb/3.png\n");
    let truth = poses(&folder.path().join("room.gt.freiburg"));
    let truth: Vec<_> =
        truth.iter().map(|row| (row.stamp_nanos.unwrap() / 1_000_000_000, row.pose)).collect();
    let expected: Vec<_> = simulation
        .frames()
        .iter()
        .map(|frame| (frame.frame_id.0, frame.world_from_camera().unwrap()))
        .collect();
    assert_eq!(truth, expected);
}

#[test]
fn the_words_of_icls_ray_tracer_say_camera_and_pose() {
    let simulation = simulation(ROOM, ICL);
    let folder = rendered(&simulation, Layout::IclOriginal);
    let text = fs::read_to_string(folder.path().join("scene_00_0003.txt")).unwrap();
    let vector = |name: &str| -> nalgebra::Vector3<f64> {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap();
        let list = line.split(['[', ']']).nth(1).unwrap();
        let numbers: Vec<f64> = list.split(", ").map(|number| number.parse().unwrap()).collect();
        nalgebra::Vector3::new(numbers[0], numbers[1], numbers[2])
    };
    let (direction, up, right) = (vector("cam_dir"), vector("cam_up"), vector("cam_right"));
    // As the dataset's own scripts reckon: from the size of the picture at the length of the direction.
    let focal = [80.0 * direction.norm() / right.norm(), -60.0 * direction.norm() / up.norm()];
    assert!((focal[0] - 60.15).abs() < 1e-9 && (focal[1] + 60.0).abs() < 1e-9, "{focal:?}");
    let z = direction.normalize();
    let x = up.cross(&z).normalize();
    let y = z.cross(&x);
    let pose = simulation.frames()[3].world_from_camera().unwrap().pose().unwrap();
    let expected = pose.rotation_matrix();
    assert!((nalgebra::Matrix3::from_columns(&[x, y, z]) - expected).norm() < 1e-12);
    assert!((vector("cam_pos") - pose.translation()).norm() < 1e-12);

    let text = fs::read_to_string(folder.path().join("scene_00_0003.depth")).unwrap();
    let ranges: Vec<f64> = text.split_whitespace().map(|number| number.parse().unwrap()).collect();
    let (eyes, occluders, _) = looking(&simulation);
    assert_eq!(ranges.len(), 80 * 60);
    for (index, range) in ranges.iter().enumerate().step_by(7) {
        let direction = eyes[3].direction((index % 80) as f64, (index / 80) as f64);
        let hit = occluders.first_hit(&eyes[3].center(), &direction.normalize(), 1e3).unwrap();
        // Six decimals.
        assert!((hit.along - range).abs() < 1e-6, "{index}: {range} and {} m", hit.along);
    }
}

#[test]
fn tartanair_files_hold_arrays_and_poses_north_east_down() {
    let simulation = simulation(ROOM, TARTANAIR);
    let folder = rendered(&simulation, Layout::TartanAir);
    let expected = [
        "calibration.txt",
        "depth_left/000000_left_depth.npy",
        "depth_left/000001_left_depth.npy",
        "image_left/000000_left.png",
        "image_left/000001_left.png",
        "pose_left.txt",
    ];
    assert_eq!(names(folder.path()), expected);

    let bytes = fs::read(folder.path().join("depth_left/000001_left_depth.npy")).unwrap();
    let header = "\u{1}\0v\0{'descr': '<f4', 'fortran_order': False, 'shape': (60, 80), }";
    assert_eq!(&bytes[6..6 + header.len()], header.as_bytes());
    let array = npyz::NpyFile::new(bytes.as_slice()).unwrap();
    assert_eq!(array.shape(), [60, 80]);
    assert_eq!(array.order(), npyz::Order::C);
    let found: Vec<f32> = array.into_vec().unwrap();
    let (eyes, occluders, _) = looking(&simulation);
    let paint = Paint::new(&simulation, &occluders, &eyes, true).unwrap();
    let expected: Vec<f32> =
        Shot::take(&eyes[3], &occluders, &paint).depth_m.iter().map(|z| *z as f32).collect();
    assert_eq!(found, expected);

    let text = fs::read_to_string(folder.path().join("pose_left.txt")).unwrap();
    let quarter = [0.5, 0.5, 0.5, 0.5];
    let turn = |rotation_xyzw| Pose::from_components([0.0; 3], rotation_xyzw).unwrap();
    assert_eq!(text.lines().count(), 2);
    for (line, frame) in text.lines().zip([1, 3]) {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        let ned_from_body = PoseRow::from_numbers(numbers.try_into().unwrap()).pose().unwrap();
        // Back: half a turn about x, and the axes of the camera one further.
        let world_from_camera = turn([1.0, 0.0, 0.0, 0.0]) * ned_from_body * turn(quarter);
        let expected = simulation.frames()[frame].world_from_camera().unwrap().pose().unwrap();
        let difference = world_from_camera.inverse() * expected;
        assert!(
            difference.rotation_angle() < 1e-7 && difference.translation().norm() < 1e-12,
            "{difference:?}"
        );
        // x of the dataset's camera looks where ours does, and z of its world points down.
        let ahead = ned_from_body.transform_vector(&nalgebra::Vector3::x());
        let ours = expected.transform_vector(&nalgebra::Vector3::z());
        assert!((ahead - nalgebra::Vector3::new(ours.x, -ours.y, -ours.z)).norm() < 1e-12);
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let simulation = simulation(ROOM, TUM);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        files_of(pool.install(|| rendered(&simulation, Layout::Tum)).path())
    };
    assert!(on(1) == on(3));
}

#[test]
fn the_datasets_own_camera_needs_no_calibration_where_it_has_one() {
    for (preset, layout) in
        [("icl-nuim", Layout::Icl), ("icl-nuim", Layout::IclOriginal), ("tartanair", Layout::TartanAir)]
    {
        let recipe = format!("{ROOM}\n[camera]\npreset = {preset:?}");
        let camera = Recipe::from_toml(&recipe).unwrap().camera.camera("camera").unwrap();
        let folder = tempfile::tempdir().unwrap();
        calibration::write(folder.path(), layout, &camera).unwrap();
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }
    // TUM RGB-D has three; the folder's name need not tell which.
    let recipe = format!("{ROOM}\n[camera]\npreset = \"tum-fr3\"");
    let camera = Recipe::from_toml(&recipe).unwrap().camera.camera("camera").unwrap();
    let folder = tempfile::tempdir().unwrap();
    calibration::write(folder.path(), Layout::Tum, &camera).unwrap();
    let text = fs::read_to_string(folder.path().join("calibration.txt")).unwrap();
    assert!(text.ends_with("\n640 480 535.4 539.2 320.1 247.6\n"), "{text}");
    // The middle of the pixel in column 0 has the position 0 in one convention, 0.5 in the other.
    let camera =
        Recipe::from_toml(&format!("{ROOM}\n[camera]\n{TUM}")).unwrap().camera.camera("camera").unwrap();
    let folder = tempfile::tempdir().unwrap();
    calibration::write(folder.path(), Layout::TartanAir, &camera).unwrap();
    let text = fs::read_to_string(folder.path().join("calibration.txt")).unwrap();
    assert!(text.ends_with("\n80 60 66.9 67.4 40.1 31.0\n"), "{text}");
}

#[test]
fn what_a_layout_cannot_hold_is_refused() {
    let refused = |camera: &str, options: RenderOptions, place: &str| {
        let folder = tempfile::tempdir().unwrap();
        let error = render(&simulation(ROOM, camera), &options, folder.path(), &|_, _| {}).unwrap_err();
        assert!(error.to_string().starts_with(place), "{error}");
        assert_eq!(names(folder.path()), Vec::<String>::new());
    };
    refused(TUM, RenderOptions::new(Layout::Icl), "camera.fy: expected a negative");
    refused(TUM, RenderOptions::new(Layout::IclOriginal), "camera.fy: expected a negative");
    refused(ICL, RenderOptions::new(Layout::Tum), "camera.fy: expected a positive");
    refused(ICL, RenderOptions::new(Layout::TartanAir), "camera.fy: expected a positive");
    let aside = ICL.replace("39.5", "38.0");
    refused(&aside, RenderOptions::new(Layout::IclOriginal), "camera.cx, camera.cy: expected the middle");
    let none = RenderOptions { frames: 5..9, ..RenderOptions::new(Layout::Tum) };
    refused(TUM, none, "frames to render: expected at least one");
    let large = TUM.replace("width = 80", "width = 100000").replace("height = 60", "height = 1000");
    refused(&large, RenderOptions::new(Layout::Tum), "camera: expected at most 67108864 px");
}
