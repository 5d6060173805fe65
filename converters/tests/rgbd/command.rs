//! The commands that make sequences of RGB-D images: what they say, refuse and leave behind.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::wall::{FRAMES, SIZE, Wall, names, write_png};
use open_structure::format;
use open_structure::structure::Sequence;
use open_structure::validate::{self, Severity, validate};
use open_structure_converters::generate::Options;
use serde_json::Value;

/// Runs `os-convert` in a folder and gives exit code, stdout and stderr, but for what the PNG library itself writes there.
fn os_convert(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output =
        assert_cmd::Command::cargo_bin("os-convert").unwrap().current_dir(folder).args(arguments).output();
    let output = output.unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let ours =
        text(output.stderr).split_inclusive('\n').filter(|line| !line.starts_with("libpng ")).collect();
    (output.status.code().unwrap(), text(output.stdout), ours)
}

/// Frames and rows of observations of a sequence.
fn counts(path: &Path) -> [usize; 3] {
    let sequence = format::read(path).unwrap();
    [sequence.frames.len(), sequence.point_observations.len(), sequence.line_observations.len()]
}

#[test]
fn a_folder_becomes_a_sequence_without_findings_in_both_encodings() {
    let wall = Wall::new();
    for output in ["a.mcap", "a"] {
        let (code, out, err) = os_convert(wall.place(), &["tum", "raw", "-o", output, "--name", "wall"]);
        assert_eq!((code, err.as_str()), (0, ""), "{out}");
        assert!(out.starts_with(&format!("{output}: {FRAMES} frames, ")), "{out}");
        let report = validate(&wall.place().join(output), &validate::Options::default()).unwrap();
        assert!(report.findings.is_empty(), "{:?}", report.findings);
    }
    assert_eq!(names(wall.place()), ["a", "a.mcap", "raw"]);
    let [first, second] = ["a.mcap", "a"].map(|name| format::read(wall.place().join(name)).unwrap());
    assert_eq!(first, second);
    assert_eq!(first.manifest.name, "wall");
    let [frames, points, lines] = counts(&wall.place().join("a"));
    assert!(frames == FRAMES && points > 10 * FRAMES && lines >= 4 * FRAMES, "{points} {lines}");
}

#[test]
fn the_report_is_json_on_request_and_nothing_else_is_printed() {
    let wall = Wall::new();
    let (code, out, err) = os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap", "--json"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (report["frames"].as_u64(), report["encoding"].as_str()),
        (Some(FRAMES as u64), Some("MCAP file"))
    );
    assert_eq!(report["output"], "a.mcap");
    assert!(report["became"]["points_detected"].as_u64().unwrap() > 0);
}

/// What is done to a folder.
type Defect<'a> = &'a dyn Fn(&Wall);

#[test]
fn what_is_wrong_is_told_with_its_file_and_the_rest_is_kept_on_request() {
    let rgb = |name: &'static str| move |wall: &Wall| fs::write(wall.raw(name), "GIF89a").unwrap();
    let [width, height] = SIZE;
    // What is wrong; what is said; frames that are left where one may be left out.
    let cases: [(Defect<'_>, &str, usize); 10] = [
        (&rgb("rgb/2.png"), "raw/rgb/2.png: expected a PNG or JPEG picture", FRAMES - 1),
        (&rgb("depth/0.png"), "raw/depth/0.png: expected a depth map", FRAMES - 1),
        (&|wall| cut_off(&wall.raw("rgb/7.png")), "raw/rgb/7.png: expected a whole picture", FRAMES - 1),
        (
            &|wall| write_png(&wall.raw("depth/3.png"), SIZE, 8),
            "raw/depth/3.png: expected a depth map: a PNG picture of 16 bits, grey, found a PNG picture of 8 bits",
            FRAMES - 1,
        ),
        (
            &|wall| write_png(&wall.raw("depth/3.png"), [width, height - 1], 16),
            "raw/depth/3.png: expected 120 x 100 px, the camera's, found 120 x 99 px",
            FRAMES - 1,
        ),
        (
            &|wall| write_png(&wall.raw("rgb/3.png"), [width + 1, height], 8),
            "raw/rgb/3.png: expected 120 x 100 px, the camera's, found 121 x 100 px",
            FRAMES - 1,
        ),
        (
            &|wall| wall.edit("groundtruth.txt", |text| text.replace("\n0.3 0.06", "\n0.3 nan")),
            "raw/groundtruth.txt:4: expected timestamp tx ty tz",
            // The poses around it are too far apart to make one between them.
            FRAMES - 1,
        ),
        (
            &|wall| wall.edit("rgb.txt", |text| text.replace("\n0.5 ", "\n0.4 ")),
            "raw/rgb.txt:6: expected a stamp after the one before it",
            FRAMES - 1,
        ),
        (
            &|wall| wall.edit("depth.txt", |text| text.replace("\n0.5 ", "\n0.05 ")),
            "raw/depth.txt:6: expected a stamp after the one before it",
            FRAMES - 1,
        ),
        (
            &|wall| wall.edit("rgb.txt", |text| text.replace("rgb/4.png", "../rgb/4.png")),
            "raw/rgb.txt:5: expected timestamp filename, a file below this folder",
            FRAMES - 1,
        ),
    ];
    for (defect, expected, left) in cases {
        let wall = Wall::new();
        defect(&wall);
        for output in ["a.mcap", "a"] {
            let (code, out, err) = os_convert(wall.place(), &["tum", "raw", "-o", output]);
            assert_eq!((code, out.as_str()), (1, ""), "{expected}");
            assert!(err.starts_with(&format!("error: {expected}")) && err.lines().count() == 1, "{err}");
            assert_eq!(names(wall.place()), ["raw"]);
            let (code, out, err) = os_convert(wall.place(), &["tum", "raw", "-o", output, "--keep-going"]);
            assert_eq!((code, err.as_str()), (3, ""), "{expected}");
            assert!(out.contains("\n  excluded: 1 x "), "{out}");
            let report = validate(&wall.place().join(output), &validate::Options::default()).unwrap();
            assert_eq!(report.count(Severity::Error), 0, "{expected}");
            assert_eq!(counts(&wall.place().join(output))[0], left, "{expected}");
            wall.remove(output);
        }
    }
}

/// Leaves the first half of a file.
fn cut_off(path: &Path) {
    let bytes = fs::read(path).unwrap();
    fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
}

#[test]
fn files_that_are_not_there_are_counted_and_passed_over() {
    let wall = Wall::new();
    fs::remove_file(wall.raw("rgb/1.png")).unwrap();
    fs::remove_file(wall.raw("depth/6.png")).unwrap();
    let (code, out, err) = os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("excluded: 1 x rgb.txt: images that are not there"), "{out}");
    assert!(out.contains("excluded: 1 x depth.txt: depth maps that are not there"), "{out}");
    assert_eq!(counts(&wall.place().join("a.mcap"))[0], FRAMES - 2);
}

#[test]
fn a_wrong_input_is_told_with_what_was_expected_there() {
    let wall = Wall::new();
    fs::create_dir(wall.place().join("empty")).unwrap();
    fs::write(wall.place().join("file.png"), "GIF89a").unwrap();
    fs::write(wall.place().join("cut.tgz"), [0x1f, 0x8b, 8, 0, 0]).unwrap();
    let before = names(wall.place());
    let tum = "expected rgb.txt, depth.txt and groundtruth.txt of TUM RGB-D, found";
    for (command, input, expected) in [
        ("tum", "empty", format!("empty: {tum} an empty folder")),
        ("tum", "missing", "missing: No such file".to_owned()),
        ("tum", "file.png", "file.png: ".to_owned()),
        ("tum", "cut.tgz", "cut.tgz: ".to_owned()),
        ("icl", "raw", "raw: expected rgb/, depth/ and a .gt.freiburg".to_owned()),
        ("tartanair", "raw", "found what TUM RGB-D has (os-convert tum)".to_owned()),
    ] {
        let (code, out, err) = os_convert(wall.place(), &[command, input, "-o", "a.mcap"]);
        assert_eq!((code, out.as_str()), (1, ""), "{command} {input}");
        assert!(err.starts_with("error: ") && err.contains(&expected), "{err}");
        assert_eq!(names(wall.place()), before);
    }
}

#[test]
fn what_stands_at_the_output_is_replaced_only_by_force_and_only_when_its_successor_is_whole() {
    let wall = Wall::new();
    let path = wall.place().join("a.mcap");
    fs::write(&path, "years").unwrap();
    let (code, _, err) = os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap"]);
    assert!(code == 1 && err.contains("a.mcap") && err.contains("--force"), "{err}");
    let picture = fs::read(wall.raw("rgb/9.png")).unwrap();
    fs::write(wall.raw("rgb/9.png"), "GIF89a").unwrap();
    assert_eq!(os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap", "--force"]).0, 1);
    assert_eq!(fs::read_to_string(&path).unwrap(), "years");
    fs::write(wall.raw("rgb/9.png"), picture).unwrap();
    assert_eq!(os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap", "--force"]).0, 0);
    assert_eq!(counts(&path)[0], FRAMES);
    assert_eq!(names(wall.place()), ["a.mcap", "raw"]);
}

#[test]
fn the_images_are_never_replaced_by_what_is_made_of_them() {
    let wall = Wall::new();
    let before = names(&wall.place().join("raw"));
    for (input, output) in [("raw", "raw"), ("raw", "."), ("raw/../raw", "raw"), ("raw", "../outer")] {
        let outer = wall.place().join("../outer");
        let (code, _, err) = if output == "../outer" {
            // Through a link, from outside.
            std::os::unix::fs::symlink(wall.place(), wall.place().join("link")).unwrap();
            let found = os_convert(wall.place(), &["tum", "link/raw", "-o", "raw", "--force"]);
            fs::remove_file(wall.place().join("link")).unwrap();
            assert!(!outer.exists());
            found
        } else {
            os_convert(wall.place(), &["tum", input, "-o", output, "--force"])
        };
        assert!(code == 2 && err.contains("would replace the images"), "{code} {err}");
        assert_eq!(names(&wall.place().join("raw")), before);
    }
    // Beside them in their folder there is room.
    assert_eq!(os_convert(wall.place(), &["tum", "raw", "-o", "raw/sequence"]).0, 0);
    assert_eq!(counts(&wall.raw("sequence"))[0], FRAMES);
    assert_eq!(os_convert(wall.place(), &["tum", "raw", "-o", "raw/sequence", "--force"]).0, 0);
}

#[test]
fn archives_give_the_same_sequence_and_go_again() {
    let wall = Wall::new();
    let tar = Command::new("tar").current_dir(wall.place()).args(["-czf", "raw.tgz", "raw"]).status();
    assert!(tar.unwrap().success());
    wall.zip("raw.zip");
    let convert = |input: &str, output: &str| {
        let (code, out, err) = os_convert(wall.place(), &["tum", input, "-o", output]);
        assert_eq!(code, 0, "{out}{err}");
        fs::read(wall.place().join(output)).unwrap()
    };
    let folder = convert("raw", "folder.mcap");
    assert!(folder == convert("raw.tgz", "tgz.mcap"));
    assert!(folder == convert("raw.zip", "zip.mcap"));
    let expected = ["folder.mcap", "raw", "raw.tgz", "raw.zip", "tgz.mcap", "zip.mcap"];
    assert_eq!(names(wall.place()), expected);
    // One that cannot be used leaves nothing either.
    wall.edit("rgb.txt", |text| text.replace("\n0.5 ", "\n0.4 "));
    wall.zip("bad.zip");
    assert_eq!(os_convert(wall.place(), &["tum", "bad.zip", "-o", "bad.mcap"]).0, 1);
    assert_eq!(names(wall.place())[1..], expected[..]);
}

#[test]
fn a_configuration_is_read_held_against_its_ranges_and_printed_again() {
    let wall = Wall::new();
    let config = |text: &str| fs::write(wall.place().join("a.toml"), text).unwrap();
    let convert = || os_convert(wall.place(), &["tum", "raw", "-o", "a.mcap", "--config", "a.toml"]);
    for (text, expected) in [
        ("points = 3", "a.toml: configuration: expected TOML"),
        ("[points]\nmax_featrues = 3", "unknown field `max_featrues`"),
        (
            "[points]\nmax_features = 1000000",
            "points.max_features: expected a number from 0 to 100000, found 1000000",
        ),
        ("[lines]\nlength_m = nan", "lines.length_m: expected a number"),
        ("[noise]\nmodel = \"loud\"", "a.toml"),
    ] {
        config(text);
        let (code, out, err) = convert();
        assert!(code == 1 && out.is_empty() && err.contains(expected), "{err}\n{expected}");
    }
    fs::remove_file(wall.place().join("a.toml")).unwrap();
    assert!(convert().2.contains("a.toml: No such file"));
    assert_eq!(names(wall.place()), ["raw"]);

    config("seed = 7\n[points]\nmax_features = 12\n");
    assert_eq!(convert().0, 0);
    let read = format::read(wall.place().join("a.mcap")).unwrap();
    assert_eq!(read.manifest.generator.seed, Some(7));
    let arguments = ["icl", "--print-config", "--config", "a.toml"];
    let (code, printed, err) = os_convert(wall.place(), &arguments);
    assert_eq!((code, err.as_str()), (0, ""));
    let options = Options::from_toml(&printed).unwrap();
    assert_eq!((options.seed, options.points.max_features), (7, 12));
    config(&printed);
    assert_eq!(os_convert(wall.place(), &arguments).1, printed);
}

#[test]
fn frames_stride_and_features_choose() {
    let wall = Wall::new();
    let convert = |more: &[&str]| {
        let arguments = ["tum", "raw", "-o", "a.mcap", "--force"];
        let (code, _, err) = os_convert(wall.place(), &[&arguments[..], more].concat());
        assert_eq!(code, 0, "{err}");
        format::read(wall.place().join("a.mcap")).unwrap()
    };
    let ids =
        |sequence: &Sequence| -> Vec<i64> { sequence.frames.iter().map(|frame| frame.frame_id.0).collect() };
    let all = convert(&[]);
    assert_eq!(ids(&convert(&["--frames", "2..9"])), [2, 3, 4, 5, 6, 7, 8]);
    assert_eq!(ids(&convert(&["--frames", "1..", "--stride", "2"])), [1, 3, 5, 7, 9]);
    let few = convert(&["--max-features", "4"]);
    assert!(!few.point_landmarks.is_empty() && few.point_landmarks.len() < all.point_landmarks.len());
    assert_eq!(few.line_landmarks, all.line_landmarks);
    assert!(convert(&["--max-features", "0"]).point_landmarks.is_empty());
    let misused: [&[&str]; 5] = [
        &["--frames", "9..2"],
        &["--stride", "0"],
        &["--threads", "0"],
        &["--picture-count", "3"],
        &["--max-difference", "-1"],
    ];
    for more in misused {
        let arguments = [&["tum", "raw", "-o", "b.mcap"], more].concat();
        assert_eq!(os_convert(wall.place(), &arguments).0, 2, "{more:?}");
    }
    let (code, _, err) = os_convert(wall.place(), &["tum", "raw", "-o", "b.mcap", "--frames", "90..95"]);
    assert!(code == 1 && err.contains("expected at least one frame"), "{err}");
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let wall = Wall::new();
    let bytes = ["1", "2", "5"].map(|threads| {
        let name = format!("{threads}.mcap");
        let arguments = ["tum", "raw", "-o", &name, "--name", "wall", "--threads", threads];
        assert_eq!(os_convert(wall.place(), &arguments).0, 0);
        fs::read(wall.place().join(name)).unwrap()
    });
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn pictures_are_drawn_where_they_are_wanted() {
    let wall = Wall::new();
    let arguments = ["tum", "raw", "-o", "a.mcap", "--pictures", "drawn", "--picture-count", "3"];
    assert_eq!(os_convert(wall.place(), &arguments).0, 0);
    assert_eq!(names(&wall.place().join("drawn")), ["000000.png", "000003.png", "000006.png"]);
    assert!(fs::read(wall.place().join("drawn/000003.png")).unwrap().starts_with(b"\x89PNG"));
}

/// Runs a line of a shell, `$0` being `os-convert`.
fn shell(folder: &Path, line: &str) -> (i32, String) {
    let program = assert_cmd::cargo::cargo_bin("os-convert");
    let output = Command::new("bash").current_dir(folder).args(["-c", line]).arg(program).output().unwrap();
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

#[test]
fn a_full_disk_is_told_and_leaves_nothing() {
    let wall = Wall::new();
    for output in ["a.mcap", "a"] {
        // No file of more than 4 KiB.
        let line = format!("trap '' XFSZ; ulimit -f 4; exec \"$0\" tum raw -o {output}");
        let (code, err) = shell(wall.place(), &line);
        assert!(code == 1 && err.contains("File too large") && err.contains(output), "{code} {err}");
        assert_eq!(names(wall.place()), ["raw"]);
    }
}

#[test]
fn who_has_read_enough_is_no_error() {
    let wall = Wall::new();
    for line in ["\"$0\" tum raw -o a.mcap --json", "\"$0\" tum --print-config", "\"$0\" tum raw -o b.mcap"] {
        // The reader ends before anything is written.
        let (code, err) = shell(wall.place(), &format!("set -o pipefail; {line} | sleep 0"));
        assert_eq!((code, err.as_str()), (0, ""), "{line}");
    }
    assert_eq!(counts(&wall.place().join("a.mcap"))[0], FRAMES);
    let (code, err) = shell(wall.place(), "\"$0\" tum --print-config > /dev/full");
    assert!(code == 1 && err.contains("No space left"), "{code} {err}");
}

#[test]
fn an_interrupted_conversion_leaves_nothing() {
    let wall = Wall::new();
    // More frames than will ever be read, of an archive that is unpacked beside the output.
    wall.repeat(5_000);
    wall.zip("raw.zip");
    let before = names(wall.place());
    for (input, output) in [("raw.zip", "a.mcap"), ("raw.zip", "a")] {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin("os-convert"))
            .current_dir(wall.place())
            .args(["tum", input, "-o", output])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        let under_way = || names(wall.place()).iter().any(|name| name.contains(".unpacked"));
        while !under_way() {
            assert!(child.try_wait().unwrap().is_none(), "ended by itself");
            assert!(start.elapsed() < Duration::from_secs(60), "unpacks nothing");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(300));
        assert!(child.try_wait().unwrap().is_none(), "ended by itself");
        let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(interrupt.unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert_eq!(names(wall.place()), before);
    }
}
