//! What holds for every model, and for the options over them.

mod moments;

use super::{NoiseModel, NoiseRecipe};
use crate::geometry::PinholeCamera;
use crate::structure::{
    Camera, CameraId, FrameId, LineId, LineObservation, PointId, PointMeasurement, PointObservation, registry,
};
use rayon::prelude::*;

/// The camera of the release's simulator.
fn camera() -> Camera {
    let pinhole = PinholeCamera { fx: 535.4, fy: 539.2, cx: 320.1, cy: 247.6, width: 640, height: 480 };
    Camera::pinhole(CameraId(0), &pinhole, registry::PIXEL_CENTER)
}

/// Points all over the image, from 1 m to 3 m away.
fn points(frame: i64, count: u32) -> Vec<PointObservation> {
    (0..count)
        .map(|id| {
            let part = f64::from(id) / f64::from(count);
            PointObservation {
                frame_id: FrameId(frame),
                point_id: PointId(i64::from(id)),
                u: 630.0 * part,
                v: 470.0 * (7.0 * part).fract(),
                depth: Some(1.0 + 2.0 * (3.0 * part).fract()),
            }
        })
        .collect()
}

/// Segments that go away from the camera.
fn lines(frame: i64, count: u32) -> Vec<LineObservation> {
    (0..count)
        .map(|id| {
            let part = f64::from(id) / f64::from(count);
            LineObservation {
                frame_id: FrameId(frame),
                line_id: LineId(i64::from(id)),
                start_u: 100.0 + 200.0 * part,
                start_v: 100.0,
                start_depth: Some(1.5),
                end_u: 180.0 + 200.0 * part,
                end_v: 160.0,
                end_depth: Some(2.5),
            }
        })
        .collect()
}

fn recipe(model: NoiseModel, parameters: &[(&str, f64)]) -> NoiseRecipe {
    let mut recipe = NoiseRecipe::new(model);
    for (name, value) in parameters {
        recipe.set(name, *value).unwrap();
    }
    recipe
}

fn measured(recipe: &NoiseRecipe, points: &[PointObservation]) -> Vec<PointMeasurement> {
    recipe.measure(&camera(), FrameId(0), points, &[], 1).0
}

/// Every option at once.
const OPTIONS: [(&str, f64); 4] =
    [("outlier_fraction", 0.2), ("missed_fraction", 0.3), ("quantisation_px", 0.25), ("drop_outside", 1.0)];

#[test]
fn frames_are_measured_the_same_in_any_order_and_by_any_number_of_threads() {
    for model in NoiseModel::ALL {
        let recipe = recipe(model, &OPTIONS);
        let measure =
            |frame: i64| recipe.measure(&camera(), FrameId(frame), &points(frame, 50), &lines(frame, 20), 7);
        let forward: Vec<_> = (0..40).map(measure).collect();
        let mut backward: Vec<_> = (0..40).rev().map(measure).collect();
        backward.reverse();
        assert_eq!(forward, backward);
        for threads in [1, 2, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found: Vec<_> = pool.install(|| (0..40_i64).into_par_iter().map(measure).collect());
            assert_eq!(found, forward, "{threads} threads");
        }
        assert_ne!(forward[0].0.len(), 50, "some are missed");
    }
}

#[test]
fn seeds_and_frames_draw_different_noise() {
    let recipe = NoiseRecipe::new(NoiseModel::Gaussian);
    let first = |frame, seed| recipe.measure(&camera(), FrameId(frame), &points(frame, 1), &[], seed).0[0].u;
    assert!((first(0, 1) - first(1, 1)).abs() > 0.0 && (first(0, 1) - first(0, 2)).abs() > 0.0);
}

#[test]
fn without_noise_measurements_equal_observations_bit_by_bit() {
    let recipe = NoiseRecipe::new(NoiseModel::None);
    let (seen, lines) = (points(0, 100), lines(0, 30));
    let (found, found_lines) = recipe.measure(&camera(), FrameId(0), &seen, &lines, 1);
    assert_eq!((found.len(), found_lines.len()), (100, 30));
    for (row, seen) in found.iter().zip(&seen) {
        assert_eq!((row.point_id, row.u, row.v, row.depth), (seen.point_id, seen.u, seen.v, seen.depth));
    }
    for (row, seen) in found_lines.iter().zip(&lines) {
        assert_eq!((row.start_u, row.start_depth), (seen.start_u, seen.start_depth));
        assert_eq!((row.end_v, row.end_depth), (seen.end_v, seen.end_depth));
    }
}

#[test]
fn the_papers_formula_is_taken_literally_in_centimetres() {
    let exact = recipe(NoiseModel::Paper, &[("sigma_d", 0.0)]);
    for row in measured(&exact, &points(0, 50)).iter().zip(points(0, 50)) {
        let (found, truth) = (row.0.depth.unwrap(), row.1.depth.unwrap());
        let expected = 35130.0 / (35130.0 / (100.0 * truth) + 0.5) / 100.0;
        // Metres; rounding alone.
        assert!((found - expected).abs() < 1e-14 * truth);
        // Too small by 0.5 d²/m: to first order, which is off by a part of 0.5 d/m, 0.4 % at 3 m.
        let bias = truth - found;
        assert!((bias / (0.5 * 100.0 * truth * truth / 35130.0) - 1.0).abs() < 0.005, "{bias}");
    }
}

#[test]
fn kinect_depths_are_whole_steps_of_disparity() {
    let recipe = NoiseRecipe::new(NoiseModel::KinectDisparity);
    for row in measured(&recipe, &points(0, 200)) {
        let steps = 351.3 / row.depth.unwrap();
        assert!((steps - steps.round()).abs() < 1e-9 * steps, "{steps}");
    }
}

#[test]
fn a_disparity_of_less_than_a_step_is_no_depth() {
    let recipe = recipe(NoiseModel::KinectDisparity, &[("sigma_disparity", 0.0)]);
    let mut seen = points(0, 5);
    // m/d is 0.6, 0.4 and tiny; then no number at all, and behind the camera.
    let depths = [351.3 / 0.6, 351.3 / 0.4, 1e300, f64::INFINITY, -1.0];
    seen.iter_mut().zip(depths).for_each(|(row, depth)| row.depth = Some(depth));
    let found: Vec<bool> = measured(&recipe, &seen).iter().map(|row| row.depth.is_some()).collect();
    assert_eq!(found, [true, false, false, false, false]);
}

#[test]
fn depths_that_noise_makes_negative_are_absent() {
    let seen: Vec<_> =
        points(0, 1000).into_iter().map(|row| PointObservation { depth: Some(0.05), ..row }).collect();
    let found = measured(&NoiseRecipe::new(NoiseModel::Gaussian), &seen);
    let absent = found.iter().filter(|row| row.depth.is_none()).count();
    assert!(found.iter().all(|row| row.depth.is_none_or(|depth| depth > 0.0)));
    // 15.9 % lie one sigma below; five standard deviations of a binomial count are 58.
    assert!(absent.abs_diff(159) < 58, "{absent}");
}

#[test]
fn an_absent_depth_stays_absent_and_changes_no_other_row() {
    for model in NoiseModel::ALL {
        let recipe = NoiseRecipe::new(model);
        let whole = measured(&recipe, &points(0, 10));
        let mut seen = points(0, 10);
        seen[3].depth = None;
        let mut found = measured(&recipe, &seen);
        assert_eq!(found[3].depth, None);
        found[3].depth = whole[3].depth;
        assert_eq!(found, whole);
    }
}

#[test]
fn missing_some_rows_leaves_the_noise_of_the_others_as_it_was() {
    for model in NoiseModel::ALL {
        let all = measured(&NoiseRecipe::new(model), &points(0, 1000));
        let some = measured(&recipe(model, &[("missed_fraction", 0.3)]), &points(0, 1000));
        assert!(some.iter().all(|row| all.contains(row)));
        // Five standard deviations of a binomial count are 73.
        assert!(some.len().abs_diff(700) < 73, "{}", some.len());
    }
}

#[test]
fn an_outlier_has_the_place_and_the_depth_of_another_landmark() {
    let seen = points(0, 1000);
    let outliers = recipe(NoiseModel::None, &[("outlier_fraction", 0.1)]);
    let mut count = 0;
    for row in measured(&outliers, &seen) {
        let owner = seen.iter().find(|seen| (seen.u, seen.v, seen.depth) == (row.u, row.v, row.depth));
        count += u32::from(owner.unwrap().point_id != row.point_id);
    }
    // Five standard deviations of a binomial count are 47; an outlier is never the landmark itself.
    assert!(count.abs_diff(100) < 48, "{count}");
    let noisy = measured(&NoiseRecipe::new(NoiseModel::Gaussian), &seen);
    let mixed = measured(&recipe(NoiseModel::Gaussian, &[("outlier_fraction", 0.1)]), &seen);
    let same = noisy.iter().zip(&mixed).filter(|(one, other)| one == other).count();
    assert_eq!(same, 1000 - count as usize, "the others are as they were");
}

#[test]
fn the_only_landmark_of_a_frame_is_taken_for_anything_in_the_image() {
    let outliers = recipe(NoiseModel::None, &[("outlier_fraction", 1.0)]);
    let mut sum = [0.0; 2];
    for frame in 0..2000 {
        let seen = points(frame, 1);
        let found = outliers.measure(&camera(), FrameId(frame), &seen, &lines(frame, 1), 1);
        let row = &found.0[0];
        assert!((-0.5..=639.5).contains(&row.u) && (-0.5..=479.5).contains(&row.v));
        assert_eq!(row.depth, seen[0].depth);
        assert!((found.1[0].start_u - found.1[0].end_u).abs() > 0.0);
        sum = [sum[0] + row.u, sum[1] + row.v];
    }
    // A uniform number has the sigma size/√12; five standard errors.
    let tolerance = |size: f64| 5.0 * size / 12.0_f64.sqrt() / 2000.0_f64.sqrt();
    assert!((sum[0] / 2000.0 - 319.5).abs() < tolerance(640.0), "{sum:?}");
    assert!((sum[1] / 2000.0 - 239.5).abs() < tolerance(480.0), "{sum:?}");
}

#[test]
fn quantised_positions_lie_on_a_grid_through_the_middle_of_the_first_pixel() {
    let recipe = recipe(NoiseModel::Gaussian, &[("quantisation_px", 0.5)]);
    let mut corner = camera();
    registry::PIXEL_CORNER.clone_into(&mut corner.pixel_origin);
    for (camera, middle) in [(camera(), 0.0), (corner, 0.5)] {
        let (points, lines) = recipe.measure(&camera, FrameId(0), &points(0, 100), &lines(0, 100), 1);
        let of_lines = lines.iter().flat_map(|row| [row.start_u, row.start_v, row.end_u, row.end_v]);
        for coordinate in points.iter().flat_map(|row| [row.u, row.v]).chain(of_lines) {
            let steps = (coordinate - middle) / 0.5;
            assert!((steps - steps.round()).abs() < 1e-12, "{coordinate}");
        }
    }
}

#[test]
fn a_segment_that_rounding_makes_a_point_is_not_measured() {
    let mut seen = lines(0, 1);
    (seen[0].end_u, seen[0].end_v) = (seen[0].start_u + 0.2, seen[0].start_v);
    let count = |quantisation| {
        let recipe = recipe(NoiseModel::None, &[("quantisation_px", quantisation)]);
        recipe.measure(&camera(), FrameId(0), &[], &seen, 1).1.len()
    };
    assert_eq!((count(0.0), count(0.1), count(10.0)), (1, 1, 0));
}

#[test]
fn measurements_outside_the_image_are_kept_unless_told_otherwise() {
    let seen: Vec<_> = points(0, 1000).into_iter().map(|row| PointObservation { u: 639.5, ..row }).collect();
    assert_eq!(measured(&NoiseRecipe::new(NoiseModel::Gaussian), &seen).len(), 1000);
    let inside = measured(&recipe(NoiseModel::Gaussian, &[("drop_outside", 1.0)]), &seen);
    assert!(inside.iter().all(|row| row.u <= 639.5 && (-0.5..=479.5).contains(&row.v)));
    // On the very edge half of them go; five standard deviations, and a few that leave by v.
    assert!(inside.len().abs_diff(500) < 90, "{}", inside.len());
}

#[test]
fn depths_outside_the_cameras_range_are_absent_unless_told_otherwise() {
    let mut camera = camera();
    (camera.depth_min, camera.depth_max) = (Some(1.5), Some(2.5));
    let recipe = NoiseRecipe::new(NoiseModel::Gaussian);
    let cut = |recipe: &NoiseRecipe| recipe.measure(&camera, FrameId(0), &points(0, 300), &[], 1).0;
    let (found, kept) = (cut(&recipe), cut(&NoiseRecipe { keep_depth: true, ..recipe.clone() }));
    for (row, kept) in found.iter().zip(&kept) {
        assert_eq!(row.depth, kept.depth.filter(|depth| (1.5..=2.5).contains(depth)));
    }
    assert!(kept.iter().all(|row| row.depth.is_some()));
}

#[test]
fn a_manifest_declares_every_parameter_of_the_model_and_the_options_in_use() {
    let mut recipe = recipe(NoiseModel::KinectDisparity, &[("sigma_px", 0.5), ("outlier_fraction", 0.1)]);
    recipe.drop_outside = true;
    recipe.missed_fraction = Some(0.0);
    let noise = recipe.declared(9);
    assert_eq!((noise.model.as_str(), noise.seed), ("kinect-disparity", Some(9)));
    let names: Vec<&str> = noise.parameters.keys().map(String::as_str).collect();
    let expected =
        ["drop_outside", "m", "outlier_fraction", "sigma_disparity", "sigma_lateral_px", "sigma_px"];
    assert_eq!(names, expected);
    assert_eq!((noise.parameters["sigma_px"], noise.parameters["m"]), (0.5, 35130.0));
    assert!(NoiseRecipe::new(NoiseModel::None).declared(0).parameters.is_empty());
}

#[test]
fn the_models_are_those_of_the_registry() {
    let known = registry::family("noise model").unwrap().values;
    assert_eq!(known.len(), NoiseModel::ALL.len());
    for model in NoiseModel::ALL {
        assert!(known.iter().any(|(name, _)| *name == model.name()));
        assert_eq!(NoiseModel::of_name(model.name()), Some(model));
        assert_eq!(serde_json::to_value(model).unwrap(), model.name());
    }
    assert_eq!(NoiseModel::of_name("unheard"), None);
}

#[test]
fn a_recipe_says_what_is_wrong_with_it() {
    let wrong = [
        ("model = 'gaussian'\nsigma_d = 1.0", "noise.sigma_d: expected a parameter of the model gaussian"),
        ("model = 'none'\nsigma_px = 1.0", "noise.sigma_px: expected a parameter of the model none"),
        (
            "model = 'gaussian'\nsigma_px = -1.0",
            "noise.sigma_px: expected a number from 0 to 1000000, found -1",
        ),
        ("model = 'gaussian'\nsigma_px = nan", "noise.sigma_px: expected a number from 0"),
        ("model = 'gaussian'\nsigma_depth_m = inf", "noise.sigma_depth_m: expected a number from 0"),
        ("model = 'paper'\nm = 0.0", "noise.m: expected a number from 0.000001"),
        ("model = 'paper'\noutlier_fraction = 1.5", "noise.outlier_fraction: expected a number from 0 to 1"),
        ("model = 'paper'\nmissed_fraction = nan", "noise.missed_fraction: expected a number from 0 to 1"),
    ];
    for (text, expected) in wrong {
        let recipe: NoiseRecipe = toml::from_str(text).unwrap();
        let error = recipe.check().unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    assert!(toml::from_str::<NoiseRecipe>("model = 'gaussian'\nsigma = 1.0").is_err());
    assert!(toml::from_str::<NoiseRecipe>("model = 'unheard'").is_err());
    let fine: NoiseRecipe = toml::from_str("model = 'paper'\nsigma_d = 0.5\nkeep_depth = true").unwrap();
    fine.check().unwrap();
    assert!(NoiseRecipe::default().set("drop_outside", 0.5).is_err());
    assert!(NoiseRecipe::default().set("unheard", 0.5).is_err());
}
