//! `os report` as a user meets it: what the page holds, what it escapes, what it refuses.

#![expect(clippy::unwrap_used, reason = "tests")]

#[allow(dead_code, reason = "it belongs to another test, which needs more of it")]
#[path = "round_trip/arbitrary.rs"]
mod arbitrary;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use open_structure::format::{self, WriteOptions};
use open_structure::report::{Report, ReportOptions};
use open_structure::structure::{
    FrameId, Iteration, LineMeasurement, PointMeasurement, PoseRow, Sequence, TrajectoryPose,
};
use proptest::prelude::*;
use serde_json::Value;
use sha2::{Digest, Sha256};

fn os(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_os")).current_dir(folder).args(arguments).output().unwrap()
}

#[track_caller]
fn ended(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = os(folder, arguments);
    let words =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "os {}: {words}", arguments.join(" "));
    words
}

/// A folder with forty frames of box1 as `short`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let text = fs::read_to_string(recipe).unwrap();
    let text = text.split("[expected]").next().unwrap();
    let text = text.replace("frames = 447", "frames = 40").replace("name = \"box1\"", "name = \"short\"");
    fs::write(folder.path().join("short.toml"), text).unwrap();
    ended(folder.path(), &["simulate", "short.toml", "-o", "short"], 0);
    folder
}

fn page(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// What stands between two texts, the first time.
fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
    text.split_once(begin).unwrap_or_else(|| panic!("no {begin}")).1.split_once(end).unwrap().0
}

/// The sequence with an estimate beside the truth: moved, and off by a centimetre in every other frame.
fn with_estimate(mut sequence: Sequence, name: &str) -> Sequence {
    for (frame, off) in sequence.frames.iter().zip([0.0, 0.01].into_iter().cycle()) {
        let mut pose = frame.world_from_camera().unwrap();
        pose.translation[0] += 5.0;
        pose.translation[2] += off;
        sequence.trajectories.push(TrajectoryPose::new(name.to_owned(), frame.frame_id, pose));
    }
    for (iteration, cost) in [(0, 100.0), (1, 10.0), (2, 20.0), (3, 5.0)] {
        sequence.iterations.push(Iteration {
            estimate: name.to_owned(),
            iteration,
            cost,
            accepted: iteration != 2,
            ..Iteration::default()
        });
    }
    sequence.sort();
    sequence
}

#[test]
fn a_page_has_every_part_and_asks_for_nothing() {
    let folder = folder();
    let at = folder.path();
    let sequence = with_estimate(format::read(at.join("short")).unwrap(), "mine");
    format::write(&at.join("both.mcap"), &sequence, WriteOptions::default()).unwrap();
    let words = ended(at, &["report", "both.mcap", "-o", "report.html"], 0);
    assert!(words.contains("report.html: "), "{words}");
    let page = page(at, "report.html");
    for part in [
        "<!DOCTYPE html>",
        "<html lang=\"en\">",
        "name=\"viewport\"",
        "Features in each frame",
        "Occupied cells in each frame",
        "Length of tracks",
        "Covisibility",
        "APE along the path",
        "yaw, °",
        "Convergence",
        "Validation",
        "conformant",
        "data:image/svg+xml;base64,",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for outside in ["src=\"http", "href=\"http", "<link", "@import", "url(http"] {
        assert!(!page.contains(outside), "{outside}");
    }
    // Half the frames are off by a centimetre: after alignment every one by half of that, or less.
    let row = between(&page, "</span>mine</th>", "</tr>").replace("<td>", "").replace("</td>", " ");
    let cells: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(&cells[..2], ["40", "0"], "{row}");
    let rmse: f64 = cells[2].parse().unwrap();
    assert!(rmse > 0.3 && rmse <= 0.501, "{row}");
    assert!(page.contains("<td>2.000000e1</td><td>refused</td>"));
}

#[test]
fn the_policy_names_the_code_and_the_style_that_stand_in_the_page() {
    let folder = folder();
    ended(folder.path(), &["report", "short", "-o", "r.html"], 0);
    let page = page(folder.path(), "r.html");
    let policy = between(&page, "Content-Security-Policy\" content=\"", "\">");
    for (kind, begin, end) in [("script", "<script>", "</script>"), ("style", "<style>", "</style>")] {
        let digest = STANDARD.encode(Sha256::digest(between(&page, begin, end)));
        assert!(
            policy.contains(&format!("{kind}-src &#39;sha256-{digest}&#39;"))
                || policy.contains(&format!("{kind}-src 'sha256-{digest}'")),
            "{policy}"
        );
    }
    assert!(policy.starts_with("default-src "), "{policy}");
}

#[test]
fn measurements_come_out_as_they_went_in() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["report", "short", "-o", "r.html"], 0);
    let page = page(at, "r.html");
    let sequence = format::read(at.join("short")).unwrap();
    let description: Value =
        serde_json::from_str(between(&page, "data-description=\"0\">", "</script>")).unwrap();
    let block = STANDARD.decode(between(&page, "data-block=\"0\">", "</script>")).unwrap();
    let column = |column: &Value| -> Vec<f64> {
        let (offset, length) = (column["offset"].as_u64().unwrap(), column["length"].as_u64().unwrap());
        let (offset, length) = (usize::try_from(offset).unwrap(), usize::try_from(length).unwrap());
        let bytes = &block[offset..];
        (0..length)
            .map(|place| match column["kind"].as_str().unwrap() {
                "u8" => f64::from(bytes[place]),
                "u16" => f64::from(u16::from_le_bytes(bytes[2 * place..][..2].try_into().unwrap())),
                "f32" => f64::from(f32::from_le_bytes(bytes[4 * place..][..4].try_into().unwrap())),
                kind => panic!("{kind}"),
            })
            .collect()
    };
    let grid = &description["cameras"][0]["grid"];
    let step = grid["step"].as_f64().unwrap();
    let pixel = |number: f64, axis: usize| grid["from"][axis].as_f64().unwrap() + step * number;
    let near = |found: f64, expected: f64, most: f64| {
        assert!((found - expected).abs() <= most, "{found} instead of {expected}");
    };

    let points = &description["points"];
    let (pixels, depths) = (column(&points["pixels"]), column(&points["depths"]));
    let landmarks = column(&points["landmarks"]);
    let depth_step = points["depth_step"].as_f64().unwrap();
    assert_eq!(landmarks.len(), sequence.point_measurements.len());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    for (row, PointMeasurement { point_id, u, v, depth, .. }) in
        sequence.point_measurements.iter().enumerate()
    {
        assert_eq!(description["scene"]["point_ids"][landmarks[row] as usize], point_id.0);
        near(pixel(pixels[2 * row], 0), *u, 0.5 * step + 1e-9);
        near(pixel(pixels[2 * row + 1], 1), *v, 0.5 * step + 1e-9);
        near(depths[row] * depth_step, depth.unwrap(), 0.5 * depth_step + 1e-9);
    }
    let pixels = column(&description["lines"]["pixels"]);
    for (row, LineMeasurement { start_u, end_v, .. }) in sequence.line_measurements.iter().enumerate() {
        near(pixel(pixels[4 * row], 0), *start_u, 0.5 * step + 1e-9);
        near(pixel(pixels[4 * row + 3], 1), *end_v, 0.5 * step + 1e-9);
    }
    let counts = column(&points["counts"]);
    let shown = |id: FrameId| sequence.point_measurements.iter().filter(|row| row.frame_id == id).count();
    let expected: Vec<f64> = sequence.frames.iter().map(|frame| shown(frame.frame_id) as f64).collect();
    assert_eq!(counts, expected);
    let path = column(&description["scene"]["paths"][0]);
    for (frame, numbers) in sequence.frames.iter().zip(path.chunks(7)) {
        let PoseRow { translation, rotation_xyzw } = frame.world_from_camera().unwrap();
        for axis in 0..3 {
            // Single precision of numbers up to 9 m.
            let centre = description["scene"]["centre"][axis].as_f64().unwrap();
            near(numbers[axis] + centre, translation[axis], 1e-6);
        }
        near(numbers[6], rotation_xyzw[3], 1e-6);
    }
}

#[test]
fn names_from_files_never_become_markup() {
    const HOSTILE: &str = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&--><!--";
    let folder = folder();
    let at = folder.path();
    let mut sequence = with_estimate(format::read(at.join("short")).unwrap(), HOSTILE);
    let manifest = &mut sequence.manifest;
    manifest.name = HOSTILE.to_owned();
    manifest.description = Some(HOSTILE.to_owned());
    manifest.source.dataset = HOSTILE.to_owned();
    manifest.source.citation = Some(HOSTILE.to_owned());
    manifest.source.url = Some(format!("javascript:alert(3)//{HOSTILE}"));
    manifest.generator.tool = HOSTILE.to_owned();
    manifest.generator.parameters.insert(HOSTILE.to_owned(), HOSTILE.to_owned());
    manifest.cameras[0].model = HOSTILE.to_owned();
    manifest.clock.kind = HOSTILE.to_owned();
    manifest.noise.as_mut().unwrap().model = HOSTILE.to_owned();
    sequence.structural_groups[0].kind = HOSTILE.to_owned();
    format::write(&at.join("hostile"), &sequence, WriteOptions::default()).unwrap();
    let results = serde_json::json!([
        { "sequence": HOSTILE, "method": HOSTILE, "ape_rmse_cm": 1.0 },
        { "sequence": HOSTILE, "estimate": HOSTILE, "poses_matched": 0, "why_not": HOSTILE },
        { "graph": HOSTILE, "estimate": HOSTILE, "ending": HOSTILE, "final_cost": 1.0 },
    ]);
    fs::write(at.join("results.json"), results.to_string()).unwrap();
    // Values that no registry knows are findings.
    let output = os(at, &["report", "hostile", "results.json", "-o", "r.html"]);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{output:?}");
    let page = page(at, "r.html");
    for part in ["<img src=x", "<script>alert", "--><!--", "href=\"javascript"] {
        assert!(!page.contains(part), "{part}");
    }
    assert!(page.matches("&lt;/script&gt;&lt;script&gt;alert(1)").count() > 10);
    // One script of code, and two blocks of data.
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script>").count(), 3);
    let description: Value =
        serde_json::from_str(between(&page, "data-description=\"0\">", "</script>")).unwrap();
    assert_eq!(description["paths"][1]["name"], HOSTILE);
}

#[test]
fn the_same_input_gives_the_same_bytes_wherever_it_lies() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("elsewhere")).unwrap();
    ended(at, &["copy", "short", "-o", "elsewhere/short"], 0);
    for (input, output) in [("short", "a.html"), ("short", "b.html"), ("elsewhere/short", "c.html")] {
        ended(at, &["report", input, "-o", output], 0);
    }
    assert_eq!(page(at, "a.html"), page(at, "b.html"));
    assert_eq!(page(at, "a.html"), page(at, "c.html"));
}

#[test]
fn what_stands_there_is_replaced_only_by_force_and_nothing_half_made_is_left() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("r.html"), "mine").unwrap();
    let words = ended(at, &["report", "short", "-o", "r.html"], 1);
    assert!(words.contains("r.html") && words.contains("--force"), "{words}");
    assert_eq!(page(at, "r.html"), "mine");
    ended(at, &["report", "short", "-o", "r.html", "--force"], 0);
    assert!(page(at, "r.html").starts_with("<!DOCTYPE html>"));
    ended(at, &["report", "absent", "-o", "new.html"], 1);
    ended(at, &["report", "short", "-o", "short/r.html"], 1);
    let mut names: Vec<String> = fs::read_dir(at)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["r.html", "short", "short.toml"]);
}

#[test]
fn inputs_that_are_nothing_of_all_this_are_refused_with_what_they_are() {
    let folder = folder();
    let at = folder.path();
    ended(at, &["report", "short"], 2);
    ended(at, &["report", "-o", "r.html"], 2);
    let words = ended(at, &["report", "short", "-o", "r.svg"], 2);
    assert!(words.contains(".html"), "{words}");
    fs::write(at.join("other.json"), "[{\"colour\": 1}]").unwrap();
    let words = ended(at, &["report", "other.json", "-o", "r.html"], 1);
    assert!(words.contains("other.json: object 1") && words.contains("colour"), "{words}");
    fs::write(at.join("cut.json"), "{\"final_cost\": 1.0, ").unwrap();
    let words = ended(at, &["report", "cut.json", "-o", "r.html"], 1);
    assert!(words.contains("cut.json"), "{words}");
    fs::write(at.join("text.mcap"), "no sequence").unwrap();
    let words = ended(at, &["report", "text.mcap", "-o", "r.html"], 1);
    assert!(words.contains("text.mcap"), "{words}");
    fs::create_dir(at.join("empty")).unwrap();
    let words = ended(at, &["report", "empty", "-o", "r.html"], 1);
    assert!(words.contains("sequence.json"), "{words}");
}

#[test]
fn findings_are_in_the_page_and_in_the_exit_code() {
    let folder = folder();
    let at = folder.path();
    let mut sequence = format::read(at.join("short")).unwrap();
    sequence.line_landmarks[0].direction_x += 0.5;
    // Two poses, both at one place, cannot be aligned.
    let pose = PoseRow { translation: [1.0; 3], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    for frame in [0, 1] {
        sequence.trajectories.push(TrajectoryPose::new("still".to_owned(), FrameId(frame), pose));
    }
    format::write(&at.join("broken"), &sequence, WriteOptions::default()).unwrap();
    ended(at, &["report", "broken", "short", "-o", "r.html"], 3);
    let page = page(at, "r.html");
    assert!(page.contains("not conformant, ") && page.contains("class=\"badge error\""));
    assert!(page.contains("<b>still</b>: alignment needs positions"));
    assert!(page.contains("id=\"picker\"") && page.matches("class=\"sequence\"").count() == 2);
}

#[test]
fn results_of_other_commands_are_read_as_they_print_them() {
    let folder = folder();
    let at = folder.path();
    let sequence = with_estimate(format::read(at.join("short")).unwrap(), "mine");
    format::write(&at.join("both"), &sequence, WriteOptions::default()).unwrap();
    // Frames that see too little are predicted, which is a finding.
    ended(at, &["track", "short", "-o", "tracked"], 3);
    ended(at, &["graph", "tracked", "-o", "graph", "--estimate", "map-to-frame"], 0);
    for (arguments, output) in [
        (&["evaluate", "both", "--json"][..], "evaluation.json"),
        (&["adjust", "graph", "-o", "adjusted", "--method", "point", "--json"][..], "adjustment.json"),
        (
            &[
                "benchmark",
                "short",
                "-o",
                "results",
                "--seeds",
                "1",
                "--methods",
                "point-ba",
                "--no-bound",
                "--json",
            ][..],
            "benchmark.json",
        ),
    ] {
        let found = os(at, arguments);
        assert!(matches!(found.status.code(), Some(0 | 3)), "{arguments:?}: {found:?}");
        fs::write(at.join(output), found.stdout).unwrap();
    }
    let inputs = ["evaluation.json", "adjustment.json", "benchmark.json"];
    ended(at, &[&["report"], &inputs[..], &["-o", "r.html"]].concat(), 0);
    let text = page(at, "r.html");
    for part in [
        "Evaluations",
        "Adjustments",
        "Benchmark",
        "SE(3) with truth, over 1 frame",
        "<th scope=\"col\">point-ba</th>",
    ] {
        assert!(text.contains(part), "{part}");
    }
    ended(at, &["report", "results", "adjusted", "-o", "s.html"], 0);
    let text = page(at, "s.html");
    assert!(text.contains("Convergence on short") && text.contains("<h3 id=\"sequence-0-convergence\">"));
    assert!(!text.contains("No optimiser left its steps here."));
}

#[test]
fn a_sequence_without_anything_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let sequence = Sequence::default();
    format::write(&at.join("empty.mcap"), &sequence, WriteOptions::default()).unwrap();
    let output = os(at, &["report", "empty.mcap", "-o", "r.html"]);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{output:?}");
    let page = page(at, "r.html");
    for part in
        ["The sequence has no frame.", "No frame shows a landmark.", "No optimiser left its steps here."]
    {
        assert!(page.contains(part), "{part}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn a_sequence_of_any_content_makes_a_page(sequence in arbitrary::sequences()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("any");
        format::write(&path, &sequence, WriteOptions::default()).unwrap();
        let report = Report::of(&[&path], &ReportOptions::default()).unwrap();
        let page = report.html().unwrap();
        prop_assert_eq!(page.matches("<script").count(), 3);
        for svg in page.split("<svg class=\"chart\"").skip(1) {
            let svg = svg.split("</svg>").next().unwrap();
            prop_assert!(!svg.contains("NaN") && !svg.contains("inf"), "{}", svg);
        }
        prop_assert_eq!(report.html().unwrap(), page);
    }
}
