//! What is wrong with folders and files, and how it is told.

use std::fs;
use std::path::Path;

use open_structure::simulate::render::Layout;
use open_structure_converters::rgbd::{OpenOptions, RawSequence, icl, tum};
use proptest::prelude::*;

use super::room::{LAYOUTS, edit, open, rendered, write_png};

const KEEP_GOING: OpenOptions = OpenOptions {
    frames: 0..u64::MAX,
    stride: 1,
    keep_going: true,
    max_stamp_difference_nanos: 20_000_000,
    longest_gap_nanos: 10_000_000,
    camera: None,
    kinect: None,
};

/// The error of opening a folder with a defect, and what is left where lines may be left out.
fn opened(layout: Layout, defect: impl FnOnce(&Path)) -> (String, Option<RawSequence>) {
    let (_, folder) = rendered(layout);
    defect(folder.path());
    let error = open(layout, folder.path(), &OpenOptions::default()).unwrap_err();
    let error = error.to_string().replace(folder.path().to_str().unwrap(), "");
    (error, open(layout, folder.path(), &KEEP_GOING).ok())
}

/// The error of reading the images of the second frame.
fn decoded(layout: Layout, defect: impl FnOnce(&Path)) -> String {
    let (_, folder) = rendered(layout);
    defect(folder.path());
    let sequence = open(layout, folder.path(), &OpenOptions::default()).unwrap();
    assert!(sequence.images(&sequence.frames[0]).is_ok());
    let error = sequence.images(&sequence.frames[1]).unwrap_err();
    error.to_string().replace(folder.path().to_str().unwrap(), "")
}

#[test]
fn a_bad_line_is_told_by_its_number_or_left_out_and_counted() {
    let twice = |text: String| text.replace("0.066667", "0.033333");
    let turned = |text: String| text.replace("0.066667", "0.000001");
    let nan = |text: String| {
        let line = text.lines().nth(4).unwrap();
        text.replace(line, "0.033333 nan 0 0 0 0 0 1")
    };
    let pose = "timestamp tx ty tz qx qy qz qw, all numbers, the rotation not zero";
    let after = "a stamp after the one before it";
    type Change<'a> = &'a dyn Fn(String) -> String;
    let cases: [(Layout, &str, Change<'_>, String, usize); 15] = [
        (Layout::Tum, "rgb.txt", &twice, format!("/rgb.txt:6: expected {after}, found \"0.033333 rgb/0.033333.png\""), 4),
        (Layout::Tum, "depth.txt", &turned, format!("/depth.txt:6: expected {after}, found"), 4),
        (Layout::Tum, "groundtruth.txt", &twice, format!("/groundtruth.txt:6: expected {after}, found \"0.033333"), 4),
        (Layout::Tum, "groundtruth.txt", &nan, format!("/groundtruth.txt:5: expected {pose}, found \"0.033333 nan"), 4),
        (
            Layout::Tum,
            "groundtruth.txt",
            &|text| text.replace("0.033333 ", "0.033333 1e300 "),
            format!("/groundtruth.txt:5: expected {pose}"),
            4,
        ),
        (
            Layout::Tum,
            "rgb.txt",
            &|text| text.replace("rgb/0.033333", "../rgb/0.033333"),
            "/rgb.txt:5: expected timestamp filename, a file below this folder, found".to_owned(),
            4,
        ),
        (
            Layout::Tum,
            "rgb.txt",
            &|text| text.replace("rgb/0.033333", "/etc/0.033333"),
            "/rgb.txt:5: expected timestamp filename, a file below this folder".to_owned(),
            4,
        ),
        (
            Layout::Tum,
            "depth.txt",
            &|text| text.replace("0.033333 ", "yesterday "),
            "/depth.txt:5: expected timestamp filename".to_owned(),
            4,
        ),
        (
            Layout::Icl,
            "associations.txt",
            &|text| text.replace("2 depth/2.png 2 ", "1 depth/2.png 1 "),
            "/associations.txt:3: expected a number after the one before it, found \"1 depth/2.png 1 rgb/2.png\"".to_owned(),
            4,
        ),
        (
            Layout::Icl,
            "associations.txt",
            &|text| text.replace("2 depth/2.png 2 ", "2.5 depth/2.png 2.5 "),
            "/associations.txt:3: expected N depth/N.png N rgb/N.png".to_owned(),
            4,
        ),
        (
            Layout::Icl,
            "room.gt.freiburg",
            &|text| text.replace("\n1 ", "\n1 inf "),
            format!("/room.gt.freiburg:2: expected {pose}"),
            4,
        ),
        (
            Layout::IclOriginal,
            "scene_00_0001.txt",
            &|text| text.replace("cam_up", "cam_down"),
            "/scene_00_0001.txt:1: expected cam_pos, cam_dir and cam_up = [x, y, z]', found not all of them".to_owned(),
            4,
        ),
        (
            Layout::IclOriginal,
            "scene_00_0001.txt",
            &|text| text.replace("cam_dir      = [", "cam_dir      = [nan, "),
            "/scene_00_0001.txt:2: expected cam_dir = [x, y, z]'".to_owned(),
            4,
        ),
        (
            Layout::TartanAir,
            "pose_left.txt",
            &|text| text.lines().enumerate().map(|(k, line)| if k == 1 { "1 2 3 0 0 0 0\n".to_owned() } else { format!("{line}\n") }).collect(),
            "/pose_left.txt:2: expected tx ty tz qx qy qz qw, all numbers, the rotation not zero, found \"1 2 3 0 0 0 0\"".to_owned(),
            4,
        ),
        (
            Layout::TartanAir,
            "pose_left.txt",
            &|text| text.replacen('\n', " 1\n", 1),
            "/pose_left.txt:1: expected tx ty tz qx qy qz qw".to_owned(),
            4,
        ),
    ];
    for (layout, file, change, expected, left) in cases {
        let (error, rest) = opened(layout, |folder| edit(&folder.join(file), change));
        assert!(error.starts_with(&expected), "{error}\n{expected}");
        let rest = rest.unwrap();
        assert_eq!(rest.frames.len(), left, "{expected}: {:?}", rest.excluded);
        assert!(!rest.excluded.is_empty());
        let mut told = rest.excluded.iter().filter(|found| found.first_line.is_some());
        assert!(told.all(|found| found.file == file && found.count == 1), "{:?}", rest.excluded);
    }
}

#[test]
fn unsorted_lists_are_sorted_where_lines_may_be_left_out() {
    let (error, rest) = opened(Layout::Tum, |folder| {
        edit(&folder.join("rgb.txt"), |text| {
            let mut lines: Vec<&str> = text.lines().collect();
            lines.swap(4, 6);
            lines.iter().map(|line| format!("{line}\n")).collect()
        });
    });
    assert!(error.starts_with("/rgb.txt:6: expected a stamp after the one before it"), "{error}");
    assert_eq!(rest.unwrap().frames.len(), 5);
}

#[test]
fn a_wrong_folder_is_told_with_what_would_read_it() {
    for layout in LAYOUTS {
        let (_, folder) = rendered(layout);
        for other in LAYOUTS {
            let is_icl = |layout| matches!(layout, Layout::Icl | Layout::IclOriginal);
            if other == layout || (is_icl(layout) && is_icl(other)) {
                continue;
            }
            let error = open(other, folder.path(), &OpenOptions::default()).unwrap_err().to_string();
            let (expected, command) = (
                match other {
                    Layout::Tum => "expected rgb.txt, depth.txt and groundtruth.txt",
                    Layout::Icl | Layout::IclOriginal => "expected rgb/, depth/ and a .gt.freiburg",
                    Layout::TartanAir => "expected image_left/, depth_left/ and pose_left.txt",
                },
                match layout {
                    Layout::Tum => "(os-convert tum)",
                    Layout::Icl | Layout::IclOriginal => "(os-convert icl)",
                    Layout::TartanAir => "(os-convert tartanair)",
                },
            );
            assert!(error.contains(expected) && error.contains(command), "{error}");
        }
    }
}

#[test]
fn a_folder_of_nothing_is_told_with_what_it_holds() {
    let folder = tempfile::tempdir().unwrap();
    let error = |path: &Path| tum::open(path, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error(folder.path()).ends_with("found an empty folder"));
    for name in ["a", "b", "c", "d", "e", "f", "g"] {
        fs::write(folder.path().join(name), "").unwrap();
    }
    let found = error(folder.path());
    assert!(found.ends_with("found a, b, c, d, e and 2 more"), "{found}");
    assert!(error(&folder.path().join("a")).ends_with("found a file"));
    assert!(error(&folder.path().join("z")).contains("No such file"));
    let (_, one) = rendered(Layout::Icl);
    for name in ["x", "y"] {
        fs::create_dir_all(folder.path().join(name).join("rgb")).unwrap();
        fs::create_dir_all(folder.path().join(name).join("depth")).unwrap();
    }
    let found = icl::open(folder.path(), &OpenOptions::default()).unwrap_err().to_string();
    assert!(found.contains("2 sequences below"), "{found}");
    drop(one);
}

#[test]
fn what_a_layout_lacks_is_told() {
    let remove = |name: &'static str| {
        move |folder: &Path| {
            let path = folder.join(name);
            if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
        }
    };
    for (layout, name, expected) in [
        (Layout::Tum, "groundtruth.txt", "/groundtruth.txt: No such file"),
        (
            Layout::Tum,
            "calibration.txt",
            ": expected a name that tells the camera (freiburg1, freiburg2 or freiburg3;",
        ),
        (Layout::Tum, "rgb", "rgb.txt: 5 images that are not there"),
        (Layout::Icl, "room.gt.freiburg", ": expected one trajectory, such as livingRoom0.gt.freiburg"),
        (Layout::TartanAir, "depth_left", "found no depth_left"),
        (Layout::TartanAir, "pose_left.txt", "found no pose_left.txt"),
    ] {
        let (error, _) = opened(layout, remove(name));
        assert!(error.contains(expected), "{error}");
    }
    let (error, _) = opened(Layout::Icl, |folder| fs::write(folder.join("b.gt.freiburg"), "").unwrap());
    assert!(error.ends_with("found b.gt.freiburg, room.gt.freiburg"), "{error}");
    for wrong in [
        "80 60 66 67 39",
        "80 60 0 67 39 30",
        "80 60 nan 67 39 30",
        "0 60 66 67 39 30",
        "-80 60 66 67 39 30",
        "90000 90000 1 1 1 1",
    ] {
        let (error, _) =
            opened(Layout::Tum, |folder| fs::write(folder.join("calibration.txt"), wrong).unwrap());
        assert!(error.starts_with("/calibration.txt:1: expected width height fx fy cx cy"), "{error}");
    }
}

#[test]
fn pictures_that_cannot_be_used_are_named() {
    let name = "rgb/0.033333.png";
    for (defect, expected) in [
        (
            &(|path: &Path| fs::write(path, "").unwrap()) as &dyn Fn(&Path),
            "expected an image, found an empty file",
        ),
        (
            &|path| fs::write(path, "GIF89a").unwrap(),
            "expected a PNG or JPEG picture, found another kind of file",
        ),
        (&|path| write_png(path, [40, 60], 8), "expected 80 x 60 px, the camera's, found 40 x 60 px"),
        (&cut_off, "expected a whole picture, found a damaged or incomplete file"),
        (&bomb, "expected 80 x 60 px, the camera's, found 80000 x 60 px"),
        (
            &|path| fs::write(path, b"\xFF\xD8\xFF\xE0\x00\x10JFIF").unwrap(),
            "expected a whole picture, found a damaged",
        ),
        (
            &|path| fs::write(path, vec![0; 4 << 20]).unwrap(),
            "expected at most 1355776 B, found a larger file",
        ),
    ] {
        let error = decoded(Layout::Tum, |folder| defect(&folder.join(name)));
        assert!(error.starts_with(&format!("/{name}: {expected}")), "{error}");
    }
}

/// Leaves the first three quarters of a file.
fn cut_off(path: &Path) {
    let bytes = fs::read(path).unwrap();
    fs::write(path, &bytes[..bytes.len() * 3 / 4]).unwrap();
}

/// Makes the header of a PNG file say that it is a thousand times as wide.
fn bomb(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    bytes[16..20].copy_from_slice(&80_000_u32.to_be_bytes());
    fs::write(path, bytes).unwrap();
}

#[test]
fn depth_pictures_that_cannot_be_used_are_named() {
    let name = "depth/0.033333.png";
    for (defect, expected) in [
        (
            &(|path: &Path| write_png(path, [80, 60], 8)) as &dyn Fn(&Path),
            "expected a depth map: a PNG picture of 16 bits, grey, found a PNG picture of 8 bits, grey",
        ),
        (&|path| write_png(path, [40, 60], 16), "expected 80 x 60 px, the camera's, found 40 x 60 px"),
        (&cut_off, "expected a whole picture, found a damaged or incomplete file"),
        (&bomb, "expected 80 x 60 px, the camera's, found 80000 x 60 px"),
        (
            &|path| fs::write(path, b"\xFF\xD8\xFF\xD9").unwrap(),
            "expected a depth map: a PNG picture of 16 bits",
        ),
    ] {
        let error = decoded(Layout::Tum, |folder| defect(&folder.join(name)));
        assert!(error.starts_with(&format!("/{name}: {expected}")), "{error}");
    }
}

#[test]
fn a_file_that_goes_away_is_told_by_the_system() {
    let (_, folder) = rendered(Layout::Icl);
    let sequence = icl::open(folder.path(), &OpenOptions::default()).unwrap();
    fs::remove_file(&sequence.frames[1].depth).unwrap();
    let error = sequence.images(&sequence.frames[1]).unwrap_err().to_string();
    assert!(error.contains("depth/1.png: No such file"), "{error}");
}

#[test]
fn arrays_that_cannot_be_used_are_named() {
    let name = "depth_left/000001_left_depth.npy";
    let replace = |from: &'static str, to: &'static str| {
        move |path: &Path| {
            let bytes = fs::read(path).unwrap();
            let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
            fs::write(path, [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()).unwrap();
        }
    };
    let long = |path: &Path| {
        fs::write(path, [b"\x93NUMPY\x02\x00".as_slice(), &u32::MAX.to_le_bytes()].concat()).unwrap()
    };
    for (defect, expected) in [
        (&replace("(60, 80)", "(80, 60)") as &dyn Fn(&Path), "found <f4, shape [80, 60]"),
        (&replace("<f4", "<f8"), "found <f8, shape [60, 80]"),
        (&replace("<f4", ">f4"), "found >f4, shape [60, 80]"),
        (&replace("False", "True "), "found <f4, shape [60, 80], columns first"),
        (&replace("'descr'", "'descx'"), "found "),
        (&replace("\u{1}\0", "\u{9}\0"), "found "),
        (&replace("NUMPY", "NUMPI"), "found another kind of file"),
        (&cut_off, "found 14368 B of numbers"),
        (&long, "found another kind of file"),
    ] {
        let error = decoded(Layout::TartanAir, |folder| defect(&folder.join(name)));
        let start = format!(
            "/{name}: expected a NumPy array of 32-bit floating point numbers (<f4), shape (60, 80), "
        );
        assert!(error.starts_with(&start) && error[start.len()..].starts_with(expected), "{error}");
    }
}

#[test]
fn distances_that_cannot_be_used_are_named() {
    let name = "scene_00_0001.depth";
    for (change, expected) in [
        (&(|text: String| text.replacen(' ', " far ", 1)) as &dyn Fn(String) -> String, "found \"far\""),
        (&|text| text + " 1.0", "found more"),
        (&|text| text.trim_end().rsplit_once(' ').unwrap().0.to_owned(), "found 4799"),
        (&|_| "\u{e9}\u{e9}".to_owned(), "found \"\u{e9}\u{e9}\""),
    ] {
        let error = decoded(Layout::IclOriginal, |folder| edit(&folder.join(name), change));
        assert_eq!(error, format!("/{name}: expected 4800 distances, one for each pixel, {expected}"));
    }
}

#[test]
fn images_without_poses_are_counted() {
    let (_, folder) = rendered(Layout::TartanAir);
    edit(&folder.path().join("pose_left.txt"), |text| {
        text.lines().take(3).map(|line| format!("{line}\n")).collect()
    });
    let sequence = open(Layout::TartanAir, folder.path(), &OpenOptions::default()).unwrap();
    assert_eq!(sequence.frames.len(), 3);
    assert_eq!(
        (sequence.excluded[0].reason.as_str(), sequence.excluded[0].count),
        ("images without a true pose", 2)
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn no_bytes_make_a_reader_panic(
        layout in 0..4_usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 1..40),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        let layout = LAYOUTS[layout];
        let (_, folder) = rendered(layout);
        let whole = open(layout, folder.path(), &OpenOptions::default()).unwrap();
        let frame = &whole.frames[0];
        let mut files = vec![frame.colour.clone(), frame.depth.clone(), frame.depth.with_extension("txt")];
        let lists = ["rgb.txt", "depth.txt", "groundtruth.txt", "associations.txt", "room.gt.freiburg", "pose_left.txt", "calibration.txt"];
        files.extend(lists.map(|name| folder.path().join(name)));
        files.retain(|path| path.is_file());
        for (file, at, byte) in changes {
            let path = file.get(&files);
            let mut bytes = fs::read(path).unwrap();
            if !bytes.is_empty() {
                // Most changes where most is decided.
                let place = at.index(bytes.len().min(200));
                bytes[place] = byte;
            }
            fs::write(path, bytes).unwrap();
        }
        if let Some(cut) = cut {
            let path = cut.get(&files);
            let bytes = fs::read(path).unwrap();
            fs::write(path, &bytes[..cut.index(bytes.len().max(1))]).unwrap();
        }
        for options in [OpenOptions::default(), KEEP_GOING] {
            if let Ok(sequence) = open(layout, folder.path(), &options) {
                prop_assert!(sequence.frames.windows(2).all(|pair| pair[0].frame_id < pair[1].frame_id));
                for frame in &sequence.frames {
                    if let Ok(images) = sequence.images(frame) {
                        let size = [sequence.camera.width as usize, sequence.camera.height as usize];
                        prop_assert_eq!(images.depth.size(), size);
                    }
                }
            }
        }
    }
}
