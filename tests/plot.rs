//! `os plot` as a user meets it: figures hold what the data says, at the size that was asked for, and say what keeps them from being made.

#![expect(clippy::unwrap_used, reason = "tests")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use open_structure::format::{self, WriteOptions};
use open_structure::structure::{Frame, Iteration, Sequence, TrajectoryPose};
use resvg::usvg::roxmltree::{Document, Node};

const FIGURES: [&str; 14] = [
    "scene",
    "features",
    "cells",
    "statistics",
    "tracks",
    "covisibility",
    "trajectories",
    "xyz",
    "rpy",
    "ape",
    "ape-map",
    "rpe",
    "convergence",
    "measurements",
];

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

/// The sequence with an estimate beside the truth: moved, off by a centimetre in every other frame, with the steps of an optimiser.
fn with_estimate(mut sequence: Sequence, name: &str, off_m: f64) -> Sequence {
    for (frame, off) in sequence.frames.iter().zip([0.0, off_m].into_iter().cycle()) {
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

/// A folder with forty frames of box1 as `short`, and the same with two estimates as `both.mcap`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let recipe = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("sequences/box1.toml");
    let text = fs::read_to_string(recipe).unwrap();
    let text = text.split("[expected]").next().unwrap();
    let text = text.replace("frames = 447", "frames = 40").replace("name = \"box1\"", "name = \"short\"");
    fs::write(folder.path().join("short.toml"), text).unwrap();
    ended(folder.path(), &["simulate", "short.toml", "-o", "short"], 0);
    let sequence = format::read(folder.path().join("short")).unwrap();
    let sequence = with_estimate(with_estimate(sequence, "mine", 0.01), "theirs", 0.03);
    format::write(&folder.path().join("both.mcap"), &sequence, WriteOptions::default()).unwrap();
    folder
}

/// Draws a figure as SVG and gives its text.
#[track_caller]
fn svg(folder: &Path, arguments: &[&str]) -> String {
    let mut all = vec!["plot"];
    all.extend(arguments);
    all.extend(["-o", "figure.svg", "--force"]);
    ended(folder, &all, 0);
    fs::read_to_string(folder.join("figure.svg")).unwrap()
}

/// Elements of a class, in a panel if one is named.
fn of_class<'a>(document: &'a Document<'a>, class: &str, panel: Option<usize>) -> Vec<Node<'a, 'a>> {
    let id = panel.map(|panel| format!("panel{panel}"));
    let inside = |node: &Node<'_, '_>| {
        id.is_none() || node.ancestors().any(|above| above.attribute("id") == id.as_deref())
    };
    document.descendants().filter(|node| node.attribute("class") == Some(class) && inside(node)).collect()
}

/// Places of a path of straight strokes, by stroke.
fn strokes(path: &Node<'_, '_>) -> Vec<Vec<[f64; 2]>> {
    let text = path.attribute("d").unwrap();
    let place = |text: &str| -> [f64; 2] {
        let numbers: Vec<f64> = text.split(' ').map(|number| number.parse().unwrap()).collect();
        [numbers[0], numbers[1]]
    };
    text.split('M').skip(1).map(|stroke| stroke.split('L').map(place).collect()).collect()
}

fn words(document: &Document<'_>) -> Vec<String> {
    document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .filter_map(|node| node.text().map(str::to_owned))
        .collect()
}

/// Factor and offset of `y = factor * x + offset` through the least and the largest x.
fn line_through(numbers: &[[f64; 2]]) -> [f64; 2] {
    let least = numbers.iter().min_by(|one, other| one[0].total_cmp(&other[0])).unwrap();
    let most = numbers.iter().max_by(|one, other| one[0].total_cmp(&other[0])).unwrap();
    let factor = (most[1] - least[1]) / (most[0] - least[0]);
    [factor, least[1] - factor * least[0]]
}

#[test]
fn every_figure_is_there_in_every_format_at_its_size_and_the_same_every_time() {
    let folder = folder();
    let at = folder.path();
    for figure in FIGURES {
        let drawn = svg(at, &[figure, "both.mcap"]);
        let document = Document::parse(&drawn).unwrap();
        assert_eq!(document.root_element().attribute("width"), Some("88.90mm"), "{figure}");
        let width: f64 =
            document.root_element().attribute("viewBox").unwrap().split(' ').nth(2).unwrap().parse().unwrap();
        assert!((width - 252.0).abs() < 1e-3, "{figure}: {width} points");
        assert_eq!(drawn, svg(at, &[figure, "both.mcap"]), "{figure}");
        assert!(!drawn.contains("opacity"), "{figure}: journals flatten what shines through");

        let height_mm: f64 =
            document.root_element().attribute("height").unwrap().trim_end_matches("mm").parse().unwrap();
        ended(at, &["plot", figure, "both.mcap", "-o", "figure.png", "--dpi", "254", "--force"], 0);
        let reader =
            png::Decoder::new(std::io::BufReader::new(fs::File::open(at.join("figure.png")).unwrap()))
                .read_info()
                .unwrap();
        // Ten pixels for a millimetre.
        assert_eq!((reader.info().width, reader.info().pixel_dims.unwrap().xppu), (889, 10_000), "{figure}");
        assert!((f64::from(reader.info().height) - 10.0 * height_mm).abs() <= 1.0, "{figure}");

        ended(at, &["plot", figure, "both.mcap", "-o", "figure.pdf", "--force"], 0);
        let pdf = fs::read(at.join("figure.pdf")).unwrap();
        ended(at, &["plot", figure, "both.mcap", "-o", "again.pdf", "--force"], 0);
        assert!(pdf.starts_with(b"%PDF-") && pdf == fs::read(at.join("again.pdf")).unwrap(), "{figure}");
        let text = String::from_utf8_lossy(&pdf);
        let page: Vec<f64> = text
            .split("/MediaBox [")
            .nth(1)
            .unwrap()
            .split(']')
            .next()
            .unwrap()
            .split_whitespace()
            .map(|number| number.parse().unwrap())
            .collect();
        // Hundredths of millimetres, and single precision.
        assert!(
            (page[2] - 252.0).abs() < 0.02 && (page[3] - height_mm * 72.0 / 25.4).abs() < 0.02,
            "{figure}: {page:?}"
        );
        assert!(!text.contains("CreationDate"), "{figure}");
    }
}

#[test]
fn text_of_a_pdf_is_text_in_a_font_that_is_in_it() {
    let there = ["pdftotext", "pdffonts"].iter().all(|tool| Command::new(tool).arg("-v").output().is_ok());
    if !there {
        eprintln!("SKIPPED: text of a PDF: pdftotext and pdffonts (poppler-utils) are not installed");
        return;
    }
    let folder = folder();
    ended(folder.path(), &["plot", "ape", "both.mcap", "-o", "ape.pdf"], 0);
    let told = |tool: &str, arguments: &[&str]| {
        let output = Command::new(tool).current_dir(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{tool}");
        String::from_utf8(output.stdout).unwrap()
    };
    let text = told("pdftotext", &["ape.pdf", "-"]);
    for part in ["Distance along the path (m)", "APE (cm)", "mine", "theirs"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let fonts = told("pdffonts", &["ape.pdf"]);
    let font = fonts.lines().nth(2).unwrap();
    // Embedded, a subset, with a map to Unicode; and there is no other.
    assert!(font.contains("Arimo") && font.contains("yes yes yes"), "{fonts}");
    assert_eq!(fonts.lines().count(), 3, "{fonts}");
}

#[test]
fn curves_of_features_are_the_counts_of_the_frames() {
    let folder = folder();
    let at = folder.path();
    let drawn = svg(at, &["features", "short"]);
    let document = Document::parse(&drawn).unwrap();
    let table = ended(at, &["stats", "short", "--frames", "--csv"], 0);
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 40);
    let curves = of_class(&document, "curve", None);
    assert_eq!(curves.len(), 2);
    let mut all = Vec::new();
    for (curve, column) in curves.iter().zip(["point_count", "line_count"]) {
        let column = header.iter().position(|name| *name == column).unwrap();
        let counts = rows.iter().map(|row| row[column].parse::<f64>().unwrap());
        let places = strokes(curve);
        assert_eq!((places.len(), places[0].len()), (1, 40), "{column}");
        all.extend(counts.zip(places[0].iter().map(|place| place[1])).map(|(count, y)| [count, y]));
    }
    // Both curves are drawn to the same scale; places are written to a hundredth of a point.
    let [factor, offset] = line_through(&all);
    assert!(factor < 0.0);
    for [count, y] in all {
        assert!((factor * count + offset - y).abs() < 0.02, "{count} at {y}");
    }
}

#[test]
fn a_measurement_image_has_every_point_and_segment_of_its_frame_in_the_shape_of_the_camera() {
    let folder = folder();
    let at = folder.path();
    let sequence = format::read(at.join("short")).unwrap();
    let drawn = svg(at, &["measurements", "short", "--frames", "3,10..12"]);
    let document = Document::parse(&drawn).unwrap();
    assert!(words(&document).iter().any(|words| words == "(c) frame 11"), "{:?}", words(&document));
    // One legend for all frames, with every group of lines.
    for group in sequence.structural_groups.iter().filter(|group| !group.line_ids.is_empty()) {
        let named = words(&document).into_iter().filter(|words| *words == group.group_id.to_string());
        assert_eq!(named.count(), 1, "{}", group.group_id);
    }
    let bundles: Vec<_> = sequence.bundles().collect();
    for (panel, frame) in [3, 10, 11].into_iter().enumerate() {
        let bundle = &bundles[frame];
        let (points, lines): (Vec<[f64; 2]>, usize) =
            if bundle.point_measurements.is_empty() && bundle.line_measurements.is_empty() {
                (
                    bundle.point_observations.iter().map(|row| [row.u, row.v]).collect(),
                    bundle.line_observations.len(),
                )
            } else {
                (
                    bundle.point_measurements.iter().map(|row| [row.u, row.v]).collect(),
                    bundle.line_measurements.len(),
                )
            };
        let dots = of_class(&document, "points", Some(panel));
        assert_eq!(dots[0].attribute("d").unwrap().matches('M').count(), points.len(), "frame {frame}");
        assert_eq!(dots[0].attribute("fill"), Some("#009e73"));
        let segments = of_class(&document, "segments", Some(panel));
        assert_eq!(segments.iter().map(|path| strokes(path).len()).sum::<usize>(), lines, "frame {frame}");
        let border = &strokes(&of_class(&document, "border", Some(panel))[0])[0];
        let size = [border[2][0] - border[0][0], border[2][1] - border[0][1]];
        let camera = &sequence.manifest.cameras[0];
        let aspect = f64::from(camera.height) / f64::from(camera.width);
        assert!((size[1] / size[0] - aspect).abs() < 1e-3, "{size:?}");
        // A point is where its pixel is in the border; pixels count from the centre of the first one.
        let first: Vec<f64> = dots[0].attribute("d").unwrap()[1..]
            .split('a')
            .next()
            .unwrap()
            .split(' ')
            .map(|number| number.parse().unwrap())
            .collect();
        let scale = size[0] / f64::from(camera.width);
        let x = border[0][0] + scale * (points[0][0] + 0.5);
        // The path of a dot begins at its left end, 0.9 points from its middle.
        assert!((first[0] + 0.9 - x).abs() < 0.02, "{} {x}", first[0]);
    }
}

#[test]
fn errors_and_costs_are_drawn_where_they_are() {
    let folder = folder();
    let at = folder.path();
    // Off by 1 and by 3 centimetres in every other frame: after alignment both errors are near half of that.
    let drawn = svg(at, &["ape", "both.mcap", "--over", "time"]);
    let document = Document::parse(&drawn).unwrap();
    let curves = of_class(&document, "curve", None);
    assert_eq!(curves.len(), 2);
    assert!(curves.iter().all(|curve| strokes(curve)[0].len() == 40));
    let axis = &strokes(&of_class(&document, "axis", None)[0])[0];
    let height = |curve: usize| {
        let places = &strokes(&curves[curve])[0];
        places.iter().map(|place| axis[1][1] - place[1]).sum::<f64>() / places.len() as f64
    };
    assert!((height(1) / height(0) - 3.0).abs() < 0.05, "{} {}", height(0), height(1));
    let all = words(&document);
    assert!(
        ["Time (s)", "APE (cm)", "mine", "theirs"].iter().all(|name| all.iter().any(|found| found == name)),
        "{all:?}"
    );

    // Of four steps one was refused; costs 100, 10 and 5 over powers of ten.
    let drawn = svg(at, &["convergence", "both.mcap", "--estimate", "mine"]);
    let document = Document::parse(&drawn).unwrap();
    let places = &strokes(&of_class(&document, "curve", None)[0])[0];
    assert_eq!(places.len(), 3);
    let drops = [places[1][1] - places[0][1], places[2][1] - places[1][1]];
    assert!((drops[1] / drops[0] - 2.0_f64.log10()).abs() < 1e-2, "{drops:?}");
    assert!((places[2][0] - places[1][0] - (places[1][0] - places[0][0])).abs() < 0.02);

    // Every pair is in a bin: the outline's area is all of them.
    let drawn = svg(at, &["rpe", "both.mcap", "--estimate", "mine"]);
    let document = Document::parse(&drawn).unwrap();
    assert_eq!(
        document
            .descendants()
            .filter(|node| node.attribute("id").is_some_and(|id| id.starts_with("panel")))
            .count(),
        2
    );
}

#[test]
fn paths_have_the_same_scale_both_ways_and_colours_for_every_step() {
    let folder = folder();
    let at = folder.path();
    let sequence = format::read(at.join("short")).unwrap();
    for size in [&["--width", "single"][..], &["--width", "double", "--height", "60"]] {
        let mut arguments = vec!["trajectories", "both.mcap"];
        arguments.extend(size);
        let drawn = svg(at, &arguments);
        let document = Document::parse(&drawn).unwrap();
        let truth = &strokes(&of_class(&document, "curve", None)[0])[0];
        assert_eq!(truth.len(), 40);
        let axes = words(&document);
        let along = |axis: usize| -> Vec<[f64; 2]> {
            let name = axes.iter().find(|words| {
                words.ends_with(" (m)") && {
                    let place = axes.iter().position(|found| found == *words).unwrap();
                    let last = axes.iter().rposition(|found| found.ends_with(" (m)")).unwrap();
                    (place == last) == (axis == 1)
                }
            });
            let name = name.unwrap();
            let sign = if name.starts_with('−') { -1.0 } else { 1.0 };
            let coordinate = ["x", "y", "z"].iter().position(|letter| name.contains(letter)).unwrap();
            let places = sequence
                .frames
                .iter()
                .map(|frame| sign * frame.world_from_camera().unwrap().translation[coordinate]);
            places.zip(truth).map(|(metres, place)| [metres, place[axis]]).collect()
        };
        let [right, _] = line_through(&along(0));
        let [up, _] = line_through(&along(1));
        // A path of some metres, written to a hundredth of a point.
        assert!((right / -up - 1.0).abs() < 1e-2, "{right} {up}");
    }
    let drawn = svg(at, &["ape-map", "both.mcap", "--estimate", "theirs"]);
    let document = Document::parse(&drawn).unwrap();
    let steps: usize = of_class(&document, "heat", None).iter().map(|path| strokes(path).len()).sum();
    assert_eq!(steps, 39);
}

#[test]
fn several_sequences_make_panels_with_letters() {
    let folder = folder();
    let at = folder.path();
    let drawn = svg(at, &["xyz", "both.mcap", "both.mcap", "--width", "double"]);
    let document = Document::parse(&drawn).unwrap();
    let all = words(&document);
    assert!(
        all.iter().any(|words| words == "(a) both") && all.iter().any(|words| words == "(b) both"),
        "{all:?}"
    );
    assert_eq!(all.iter().filter(|words| *words == "Time (s)").count(), 2);
    assert_eq!(all.iter().filter(|words| *words == "ground truth").count(), 1, "one legend for both");
    let scenes = svg(at, &["short", "both.mcap", "--columns", "2"]);
    assert!(scenes.contains("id=\"panel1\"") && scenes.contains(">(b) both<"));
}

#[test]
fn a_figure_can_be_named_in_two_ways_and_a_sequence_may_be_called_like_one() {
    let folder = folder();
    let at = folder.path();
    assert_eq!(svg(at, &["features", "short"]), svg(at, &["short", "--figure", "features"]));
    assert_eq!(svg(at, &["scene", "short"]), svg(at, &["short"]));
    fs::rename(at.join("short"), at.join("scene")).unwrap();
    assert!(svg(at, &["scene"]).contains("<title>Scene and trajectory of scene</title>"));
    assert!(ended(at, &["plot", "features", "-o", "a.svg"], 2).contains("expected a sequence after"));
}

#[test]
fn what_keeps_a_figure_from_being_made_is_said_and_leaves_nothing_behind() {
    let folder = folder();
    let at = folder.path();
    let mut without_truth = format::read(at.join("both.mcap")).unwrap();
    for frame in &mut without_truth.frames {
        *frame = Frame::new(frame.frame_id, frame.stamp_nanos, frame.camera_id, None);
    }
    format::write(&at.join("blind.mcap"), &without_truth, WriteOptions::default()).unwrap();
    fs::write(at.join("broken.mcap"), &fs::read(at.join("both.mcap")).unwrap()[..2000]).unwrap();
    let before: Vec<_> = fs::read_dir(at).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    for (arguments, code, said) in [
        (&["ape", "both.mcap", "-o", "a.eps"][..], 2, "expected a name that ends in .svg, .pdf or .png"),
        (&["ape", "both.mcap", "-o", "a.pdf", "--width", "5"], 2, "expected millimetres from 20 to 1000"),
        (&["ape", "both.mcap", "-o", "a.pdf", "--dpi", "0"], 2, "dots per inch"),
        (&["measurements", "both.mcap", "-o", "a.pdf", "--frames", "4..2"], 2, "ranges A..B with A below B"),
        (&["rpe", "both.mcap", "-o", "a.pdf", "--height", "21"], 1, "height: expected at least"),
        (&["ape", "short", "-o", "a.pdf"], 1, "short: expected an estimated trajectory, found none"),
        (&["ape", "blind.mcap", "-o", "a.pdf"], 1, "blind.mcap: expected true poses to compare with"),
        (&["scene", "nowhere", "-o", "a.pdf"], 1, "nowhere"),
        (
            &["apes", "both.mcap", "-o", "a.pdf"],
            2,
            "apes: neither a figure nor a sequence; figures are scene, ",
        ),
        (
            &["ape", "both.mcap", "-o", "a.pdf", "--estimate", "ours"],
            1,
            "expected an estimate ours, found mine, theirs",
        ),
        (
            &["convergence", "short", "-o", "a.pdf"],
            1,
            "expected costs over the steps of an optimiser, found none",
        ),
        (
            &["measurements", "both.mcap", "-o", "a.pdf", "--frames", "7,70"],
            1,
            "expected frame 70, found frames from 0 to 39",
        ),
        (
            &["xyz", "both.mcap", "-o", "a.pdf", "--columns", "2"],
            2,
            "--columns does not go with the figure xyz",
        ),
        (
            &["ape", "both.mcap", "-o", "a.pdf", "--frames", "3"],
            2,
            "--frames does not go with the figure ape",
        ),
        (&["scene", "both.mcap", "-o", "a.pdf", "--over", "time"], 2, "--over does not go with"),
        (&["tracks", "short", "-o", "a.pdf", "--estimate", "mine"], 2, "--estimate does not go with"),
        (&["rpe", "both.mcap", "-o", "a.pdf", "--view", "top"], 2, "Usage: os plot"),
        (
            &["scene", "both.mcap", "-o", "a.svg", "--dpi", "50"],
            2,
            "--dpi goes with a file that ends in .png",
        ),
        (&["features", "broken.mcap", "-o", "a.pdf"], 1, "broken.mcap"),
        (&["scene", "both.mcap", "-o", "both.mcap.svg/../both.mcap"], 2, "expected a name"),
    ] {
        let mut all = vec!["plot"];
        all.extend(arguments);
        let words = ended(at, &all, code);
        assert!(words.contains(said), "{arguments:?}: {words}");
    }
    let after: Vec<_> = fs::read_dir(at).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(before.len(), after.len(), "{after:?}");

    // Paths and coordinates need no truth.
    assert!(svg(at, &["trajectories", "blind.mcap"]).contains(">theirs<"));
    fs::write(at.join("there.svg"), "mine").unwrap();
    ended(at, &["plot", "short", "-o", "there.svg"], 1);
    assert_eq!(fs::read_to_string(at.join("there.svg")).unwrap(), "mine");
}

#[test]
fn names_of_any_letters_are_escaped_and_cut() {
    let folder = folder();
    let at = folder.path();
    let name =
        "<a> & \"b\" — a name that is far too long for the legend of a figure in a column of a journal 字";
    let sequence = with_estimate(format::read(at.join("short")).unwrap(), name, 0.01);
    format::write(&at.join("odd.mcap"), &sequence, WriteOptions::default()).unwrap();
    let drawn = svg(at, &["trajectories", "odd.mcap"]);
    let document = Document::parse(&drawn).unwrap();
    assert!(
        words(&document)
            .iter()
            .any(|words| words.starts_with("<a> & \"b\" — a name") && words.ends_with('…'))
    );
    ended(at, &["plot", "ape-map", "odd.mcap", "-o", "odd.pdf"], 0);
}
