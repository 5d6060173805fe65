use super::TrajectoryFormat::{Euroc, Kitti, Tum};
use super::*;
use proptest::prelude::*;

const FORMATS: [TrajectoryFormat; 3] = [Tum, Kitti, Euroc];

fn read(text: &str) -> Result<Vec<TrajectoryRow>, TrajectoryFileError> {
    read_trajectory(text.as_bytes(), None)
}

/// The line and the words of a refusal.
fn refusal(text: &str) -> (Option<usize>, String, String) {
    match read(text) {
        Err(TrajectoryFileError::Content { line, expected, found }) => (line, expected, found),
        other => panic!("{text:?}: {other:?}"),
    }
}

fn rows() -> impl Strategy<Value = Vec<(i64, PoseRow)>> {
    let quaternion = prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a direction", |q| q.iter().map(|c| c * c).sum::<f64>() > 0.01)
        .prop_map(|q| q.map(|c| c / q.iter().map(|c| c * c).sum::<f64>().sqrt()));
    let pose = (prop::array::uniform3(-1e6..1e6_f64), quaternion)
        .prop_map(|(translation, rotation_xyzw)| PoseRow { translation, rotation_xyzw });
    (any::<i32>(), prop::collection::vec((1..i64::from(u32::MAX), pose), 1..20)).prop_map(|(start, rows)| {
        let mut stamp = i64::from(start) * 1_000_000_007;
        rows.into_iter()
            .map(|(step, pose)| {
                stamp += step;
                (stamp, pose)
            })
            .collect()
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read(rows in rows()) {
        for format in FORMATS {
            let mut bytes = Vec::new();
            write_trajectory(&mut bytes, format, rows.iter().copied()).unwrap();
            let found = read_trajectory(bytes.as_slice(), None).unwrap();
            prop_assert_eq!(found.len(), rows.len());
            for (found, (stamp, pose)) in found.iter().zip(&rows) {
                if format == Kitti {
                    prop_assert_eq!(found.stamp_nanos, None);
                    prop_assert_eq!(found.pose.translation, pose.translation);
                    let turn = found.pose.pose().unwrap().inverse() * pose.pose().unwrap();
                    // Rounding of a matrix of a quaternion and back, radians.
                    prop_assert!(turn.rotation_angle() < 1e-14, "{}", turn.rotation_angle());
                } else {
                    prop_assert_eq!((found.stamp_nanos, found.pose), (Some(*stamp), *pose));
                }
            }
        }
    }

    #[test]
    fn any_bytes_get_an_answer(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for format in [None, Some(Tum), Some(Kitti), Some(Euroc)] {
            let _ = read_trajectory(bytes.as_slice(), format);
        }
    }

    #[test]
    fn any_numbers_get_an_answer(text in "([-0-9.e, #\r\n]|nan|1 |0,){0,120}") {
        for format in [None, Some(Tum), Some(Kitti), Some(Euroc)] {
            let _ = read_trajectory(text.as_bytes(), format);
        }
    }
}

#[test]
fn each_format_has_its_order_of_numbers() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let quarter_turn_about_z = |row: &TrajectoryRow| {
        assert_eq!(row.pose.translation, [1.0, 2.0, 3.0]);
        let [x, y, z, w] = row.pose.rotation_xyzw;
        assert!(x.abs() + y.abs() + (z - half).abs() + (w - half).abs() < 1e-15, "{row:?}");
    };
    let tum =
        read(&format!("# stamp tx ty tz qx qy qz qw\n\n1305031098.6659 1 2 3 0 0 {half} {half}")).unwrap();
    quarter_turn_about_z(&tum[0]);
    assert_eq!((tum[0].line, tum[0].stamp_nanos), (3, Some(1_305_031_098_665_900_000)));
    let kitti = read("0 -1 0 1 1 0 0 2 0 0 1 3\n").unwrap();
    quarter_turn_about_z(&kitti[0]);
    let euroc =
        read(&format!("#timestamp,x\n1403636580838555648,1,2,3,{half},0,0,{half},9,nonsense\n")).unwrap();
    quarter_turn_about_z(&euroc[0]);
    assert_eq!((euroc[0].line, euroc[0].stamp_nanos), (2, Some(1_403_636_580_838_555_648)));
    let zeros = read("1403636580838555648.000,1,2,3,1,0,0,0\n").unwrap();
    assert_eq!(zeros[0].stamp_nanos, euroc[0].stamp_nanos);
    // Seconds with commas would all be at 0 ns.
    let error = read("0.033,1,2,3,0,0,0,1\n").unwrap_err().to_string();
    assert!(error.contains("files of TUM have seconds") && error.contains("`0.033`"), "{error}");
}

#[test]
fn blanks_line_ends_and_headers_do_not_matter() {
    let plain = read("0.5 1 2 3 0 0 0 1\n1.5 1 2 3 0 0 0 1\n").unwrap();
    let poses = |text: &str| -> Vec<_> {
        read(text).unwrap().iter().map(|row| (row.stamp_nanos, row.pose)).collect()
    };
    let expected: Vec<_> = plain.iter().map(|row| (row.stamp_nanos, row.pose)).collect();
    for text in [
        "0.5 1 2 3 0 0 0 1\r\n1.5 1 2 3 0 0 0 1\r\n",
        "\u{feff}# x\n0.5\t1   2 3 0 0 0 1  \n\n1.5 1 2 3 0 0 0 1",
        "500000000, 1, 2, 3, 1, 0, 0, 0\n1500000000,1,2,3,1,0,0,0,",
        "timestamp,x,y,z,qw,qx,qy,qz\r\n500000000,1,2,3,1,0,0,0\r\n1500000000,1,2,3,1,0,0,0\r\n",
    ] {
        assert_eq!(poses(text), expected, "{text:?}");
    }
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    for (text, line, expected, found) in [
        ("", None, "a pose", "none"),
        ("# nothing\n\n", None, "a pose", "none"),
        ("1 2 3\n", Some(1), "8 numbers", "3 fields"),
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n", Some(2), "8 numbers", "7"),
        ("0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1 5\n", Some(2), "8 numbers", "more"),
        ("0 1 2 nan 0 0 0 1\n", Some(1), "a finite number", "`nan`"),
        ("0 1 2 1e999 0 0 0 1\n", Some(1), "a finite number", "`1e999`"),
        ("nan 1 2 3 0 0 0 1\n", Some(1), "a stamp in seconds", "`nan`"),
        ("0 1 2 3 0 0 0 0\n", Some(1), "norm 1", "norm 0"),
        ("0 1 2 3 1e200 1e200 0 0\n", Some(1), "norm 1", "norm inf"),
        ("2 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n", Some(2), "after 2000000000 ns", "1000000000 ns"),
        ("2 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1\n", Some(2), "after 2000000000 ns", "2000000000 ns"),
        ("0.5,1,2,3,1,0,0\n", Some(1), "8 numbers", "7"),
        ("zero,1,2,3,1,0,0,0\none,1,2,3,1,0,0,0\n", Some(2), "a whole stamp in nanoseconds", "`one`"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n", Some(1), "a rotation matrix", "reflection"),
        ("2 0 0 0 0 1 0 0 0 0 1 0\n", Some(1), "a rotation matrix", "orthonormal"),
        ("1e300 0 0 0 0 1e300 0 0 0 0 1 0\n", Some(1), "a rotation matrix", "inf"),
        ("1 0 0 0 0 1 0 0 0 0 1 x\n", Some(1), "a finite number", "`x`"),
    ] {
        let refused = refusal(text);
        assert_eq!(refused.0, line, "{text:?}");
        assert!(refused.1.contains(expected), "{text:?}: {refused:?}");
        assert!(refused.2.contains(found), "{text:?}: {refused:?}");
    }
}

#[test]
fn a_line_without_end_is_refused_before_it_is_held() {
    let endless = std::io::BufReader::new(std::io::repeat(b'1'));
    let error = read_trajectory(endless, None).unwrap_err();
    assert!(error.to_string().contains("bytes"), "{error}");
}

#[test]
fn a_file_too_large_is_refused() {
    // Comments, so that nothing but the count of bytes can refuse it.
    let line = [&b"#"[..], &[b'x'; 60_000], b"\n"].concat();
    let lines = usize::try_from(LARGEST_TRAJECTORY_FILE_BYTES).unwrap() / line.len() + 1;
    let file = Repeated { line: &line, left: lines, at: 0 };
    let error = read_trajectory(std::io::BufReader::with_capacity(1 << 16, file), None).unwrap_err();
    assert!(error.to_string().contains("a file of at most 536870912 bytes"), "{error}");
}

/// A line, many times over.
struct Repeated<'a> {
    line: &'a [u8],
    left: usize,
    at: usize,
}

impl std::io::Read for Repeated<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.left == 0 {
            return Ok(0);
        }
        let rest = &self.line[self.at..];
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.at += count;
        if self.at == self.line.len() {
            (self.at, self.left) = (0, self.left - 1);
        }
        Ok(count)
    }
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let pose = PoseRow { translation: [0.0; 3], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let lost = PoseRow { translation: [f64::NAN, 0.0, 0.0], ..pose };
    for rows in [vec![(0, lost)], vec![(1, pose), (1, pose)]] {
        for format in FORMATS {
            let written = write_trajectory(&mut Vec::new(), format, rows.iter().copied());
            assert!(matches!(written, Err(TrajectoryFileError::Content { .. })), "{written:?}");
        }
    }
}

/// Looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.
#[test]
fn trajectories_of_the_tum_benchmark_are_read() {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    for name in [
        "trajectories/freiburg1_xyz-groundtruth.txt",
        "trajectories/freiburg1_xyz-ORB_kf_mono.txt",
        "trajectories/freiburg1_xyz-rgbdslam.txt",
        "rgbd/rgbd_dataset_freiburg1_desk_9/groundtruth.txt",
    ] {
        let Ok(text) = std::fs::read_to_string(data.join(name)) else {
            eprintln!("SKIPPED: {name} is not here (see OPEN_STRUCTURE_DATA)");
            continue;
        };
        let rows = read(&text).unwrap();
        let written = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
        assert_eq!(rows.len(), written.clone().count(), "{name}");
        for (row, line) in rows.iter().zip(written) {
            let numbers: Vec<f64> =
                line.split_ascii_whitespace().map(|number| number.parse().unwrap()).collect();
            assert_eq!(row.pose.numbers().as_slice(), &numbers[1..], "{name} line {}", row.line);
            // An f64 of seconds is exact to 240 ns.
            assert!((row.stamp_nanos.unwrap() as f64 * 1e-9 - numbers[0]).abs() < 1e-6);
        }
    }
}
