//! How fast a sequence is checked against every rule.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use nalgebra::Point3;
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{
    Camera, CameraId, Frame, FrameId, Noise, PointId, PointLandmark, PointMeasurement, PoseRow, Sequence,
    registry,
};
use open_structure::validate::{Options, validate};

use crate::data::Draw;
use crate::figure::{Bound, Figures, median_time};

const FRAMES: i64 = 500;
const POINTS: i64 = 2000;
const RUNS: usize = 5;

/// Validates a sequence whose measurements have everything that rules look at: truth, noise, landmarks.
pub(crate) fn measure(figures: &mut Figures) -> Result<()> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let sequence = sequence();
    let rows = sequence.point_measurements.len() as f64;
    for encoding in ["parquet", "mcap"] {
        let path = folder.path().join(format!("sequence.{encoding}"));
        format::write(&path, &sequence, WriteOptions::default())?;
        let options = Options { jobs: Some(1), ..Options::default() };
        let report = validate(&path, &options)?;
        ensure!(report.conformant, "a sequence without defects has findings: {:#?}", report.findings);
        let time = median_time(RUNS, || validate(&path, &options));
        figures.add(
            format!("validating measurements, {encoding}, one core"),
            rows / time.as_secs_f64() / 1e6,
            "million rows/s",
            Bound::AtLeast(3.0),
        );
    }
    Ok(())
}

/// A camera that sways before a cloud of points and sees all of them all the time.
fn sequence() -> Sequence {
    let mut sequence = Sequence::default();
    let mut draw = Draw(7);
    let (fx, fy, cx, cy) = (535.4, 539.2, 320.1, 247.6);
    sequence.manifest.name = "swaying".to_owned();
    sequence.manifest.cameras.push(Camera {
        camera_id: CameraId(0),
        model: registry::PINHOLE.to_owned(),
        width: 640,
        height: 480,
        fx,
        fy,
        cx,
        cy,
        axes: registry::RIGHT_DOWN_FORWARD.to_owned(),
        pixel_origin: registry::PIXEL_CENTER.to_owned(),
        removed_distortion: None,
        depth_min: None,
        depth_max: None,
    });
    let (sigma_px, sigma_depth_m) = (1.0, 0.05);
    sequence.manifest.noise = Some(Noise {
        model: registry::NOISE_GAUSSIAN.to_owned(),
        seed: Some(7),
        parameters: BTreeMap::from([
            ("sigma_px".to_owned(), sigma_px),
            ("sigma_depth_m".to_owned(), sigma_depth_m),
        ]),
    });
    let cloud: Vec<Point3<f64>> = (0..POINTS)
        .map(|_| {
            let (u, v, depth) =
                (80.0 + 480.0 * draw.next(), 80.0 + 320.0 * draw.next(), 4.0 + 6.0 * draw.next());
            Point3::new((u - cx) / fx * depth, (v - cy) / fy * depth, depth)
        })
        .collect();
    sequence.point_landmarks =
        (0..).map(PointId).zip(&cloud).map(|(id, point)| PointLandmark::new(id, *point)).collect();
    for id in 0..FRAMES {
        let angle = id as f64 * 0.05;
        let centre = [0.3 * angle.sin(), 0.3 * angle.cos(), 0.3 * (angle * 0.3).sin()];
        let pose = PoseRow { translation: centre, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
        sequence.frames.push(Frame::new(FrameId(id), id * 33_333_333, CameraId(0), Some(pose)));
        for (point_id, point) in (0..).map(PointId).zip(&cloud) {
            let [x, y, z] = [point.x - centre[0], point.y - centre[1], point.z - centre[2]];
            sequence.point_measurements.push(PointMeasurement {
                frame_id: FrameId(id),
                point_id,
                u: fx * x / z + cx + sigma_px * normal(&mut draw),
                v: fy * y / z + cy + sigma_px * normal(&mut draw),
                depth: Some(z + sigma_depth_m * normal(&mut draw)),
            });
        }
    }
    sequence
}

/// A standard normal number (Box and Muller 1958).
fn normal(draw: &mut Draw) -> f64 {
    let radius = (-2.0 * (1.0 - draw.next()).ln()).sqrt();
    radius * (std::f64::consts::TAU * draw.next()).cos()
}
