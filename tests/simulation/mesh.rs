//! A sequence in a scene from a file.

use std::fs;

use open_structure::format;
use open_structure::structure::{LineLandmark, StructuralGroup};

use super::{done, text};

/// A cube of two metres, in triangles.
const CUBE: &str = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
element face 6\nproperty list uchar int vertex_indices\nend_header\n\
-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n\
4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

#[test]
fn landmarks_lie_on_the_mesh_and_its_back_is_hidden() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("models")).unwrap();
    fs::write(folder.path().join("models/cube.ply"), CUBE).unwrap();
    let recipe = folder.path().join("cube.toml");
    fs::write(
        &recipe,
        "name = 'cube'\n[trajectory]\nkind = 'wave'\nframes = 30\nradius_m = 5.0\namplitude_m = 0.5\npitch_deg = 0.0\n\
         [[scene]]\nkind = 'mesh'\nfile = 'models/cube.ply'\n\
         [points]\ncount = 200\n[lines]\ncount = 12\non_edges = 1.0\n[noise]\nmodel = 'paper'\n",
    )
    .unwrap();
    let output = folder.path().join("cube");
    done(&["simulate", text(&recipe), "-o", text(&output)]);
    done(&["validate", "--deny", "warnings", text(&output)]);
    let sequence = format::read(&output).unwrap();
    let files = &sequence.manifest.source.files;
    assert!(files.len() == 1 && files[0].name == "models/cube.ply" && files[0].bytes == CUBE.len() as u64);
    for point in &sequence.point_landmarks {
        let coordinates = [point.x, point.y, point.z].map(f64::abs);
        let largest = coordinates.into_iter().fold(0.0, f64::max);
        assert!((largest - 1.0).abs() < 1e-12, "{point:?}");
    }
    let lines: &[LineLandmark] = &sequence.line_landmarks;
    // All twelve edges of the cube, each once and whole.
    assert!(
        lines.len() == 12
            && lines.iter().all(|line| (line.segment().end - line.segment().start).norm() > 1.999)
    );
    let groups: &[StructuralGroup] = &sequence.structural_groups;
    assert_eq!(groups.iter().map(|group| group.line_ids.len()).collect::<Vec<_>>(), [4, 4, 4]);
    // Of a point that faces the camera every other camera round the cube does not see it.
    for row in &sequence.point_observations {
        let frame = sequence.frames.iter().find(|frame| frame.frame_id == row.frame_id).unwrap();
        let eye = frame.world_from_camera().unwrap().translation;
        let point = sequence.point_landmarks.iter().find(|point| point.point_id == row.point_id).unwrap();
        let at = [point.x, point.y, point.z];
        let outward: f64 = (0..3)
            .filter(|axis| (at[*axis].abs() - 1.0).abs() < 1e-12)
            .map(|axis| (eye[axis] - at[axis]) * at[axis])
            .fold(f64::MIN, f64::max);
        assert!(outward > 0.0, "{row:?} {point:?} from {eye:?}");
    }
}
