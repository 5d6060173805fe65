use super::*;
use crate::text_release::model::Row;
use crate::text_release::{Block, Problems};
use proptest::prelude::*;

fn read(text: &[u8], bare: Option<BareLine>) -> (Rows, Problems) {
    let mut file = FileProblems::new("f.txt");
    let rows = parse(text, bare, &mut file);
    let mut problems = Problems::default();
    problems.add(file);
    (rows, problems)
}

fn clean(text: &[u8], bare: Option<BareLine>) -> Rows {
    let (rows, problems) = read(text, bare);
    assert!(problems.is_empty(), "{:?}", problems.listed());
    rows
}

/// Each problem as `line kind`.
fn told(problems: &Problems) -> Vec<String> {
    let line = |line: Option<u32>| line.map_or(String::from("-"), |line| line.to_string());
    problems
        .listed()
        .iter()
        .map(|problem| format!("{} {}", line(problem.line), problem.kind.name()))
        .collect()
}

fn ids<T: Row>(blocks: &[Block<T>]) -> Vec<Vec<i64>> {
    blocks.iter().map(|block| block.rows.iter().map(Row::id).collect()).collect()
}

#[test]
fn every_tag_is_read_into_its_row() {
    let rows = clean(
        b"Vertex: 3 1 2 3 0.1 0.2 0.3 0.4\n\
          Mappoint: 5 -1.5 2e-3 +7\n\
          Mapline: 6 1 2 3 4 5 6\n\
          MappointFrameAsso: 5 3 409.791 122.443\n\
          MaplineFrameAsso: 6 3 1 2 3 4 5 6\n\
          ParalineMaplineAsso: 9 2 6 7\n",
        None,
    );
    let pose = rows.vertices[0].rows[0];
    assert_eq!((pose.id, pose.translation, pose.row), (3, [1.0, 2.0, 3.0], 1));
    assert_eq!(pose.rotation_xyzw.map(f64::to_bits), [0.1_f64, 0.2, 0.3, 0.4].map(f64::to_bits));
    assert_eq!(rows.points[0].rows, [PointLine { id: 5, position: [-1.5, 2e-3, 7.0], row: 2 }]);
    let segment = SegmentLine { id: 6, start: [1.0, 2.0, 3.0], end: [4.0, 5.0, 6.0], row: 3 };
    assert_eq!(rows.lines[0].rows, [segment]);
    let seen = PointObservationLine { point: 5, frame: 3, u: 409.791, v: 122.443, row: 4 };
    assert_eq!(rows.point_observations, [seen]);
    let (start, end) = ([1.0, 2.0, 3.0], [4.0, 5.0, 6.0]);
    assert_eq!(rows.line_observations, [LineObservationLine { line: 6, frame: 3, start, end, row: 5 }]);
    assert_eq!(rows.groups, [GroupLine { group: 9, lines: vec![6, 7], row: 6 }]);
}

#[test]
fn layout_makes_no_difference() {
    let plain = clean(b"Mappoint: 1 2 3 4\nMappoint: 2 2.5e0 -0 .5\n", None);
    for text in [
        "Mappoint:1 2 3 4\nMappoint:2 2.5e0 -0 .5\n",
        "Mappoint: 1 2 3 4\r\nMappoint: 2 2.5e0 -0 .5\r\n",
        "Mappoint: 1   2\t3 \t 4 \nMappoint:\t2 2.5e0 -0 .5   ",
        "\u{feff}Mappoint: 1 2 3 4\nMappoint: 2 2.50 -0.0 0.5",
        "  Mappoint : 1 2 3 4\nMappoint 2 2.5 -0 5e-1",
        "mappoint: 1 2 3 4\nMAPPOINT: 2 2.5 -0 5E-1",
        "Mappoint: 1.0e+00 2 3 4\nMappoint: 2.0 2.5 -0 0.5",
    ] {
        assert_eq!(clean(text.as_bytes(), None), plain, "{text:?}");
    }
    let commented = clean(b"# id x y z\n\nMappoint: 1 2 3 4\n   \n  # more\nMappoint: 2 2.5 -0 .5", None);
    assert_eq!(ids(&commented.points), ids(&plain.points));
    assert_eq!(commented.points[0].rows[1].row, 6, "lines are counted with the empty ones");
}

#[test]
fn bare_lines_are_what_the_file_is() {
    let poses =
        clean(b"0 9 0 1.5 0.612372 0.612372 -0.353553 -0.353553 \n7 1 2 3 0 0 0 1", Some(BareLine::Pose));
    assert_eq!(ids(&poses.vertices), [[0, 7]]);
    let segments =
        clean(b"0  3.506572  10.898535  -1.977897   6.419888  10.898934  -1.994237", Some(BareLine::Segment));
    let end = segments.lines[0].rows[0].end;
    assert_eq!(end.map(f64::to_bits), [6.419_888, 10.898_934, -1.994_237_f64].map(f64::to_bits));
    let points =
        clean(b"9223372036854775807 -2.287242e+00  9.490990e-01  6.880000e-04", Some(BareLine::Point));
    assert_eq!(points.points[0].rows[0].id, i64::MAX);
    let position = points.points[0].rows[0].position;
    assert_eq!(position.map(f64::to_bits), [-2.287_242, 0.949_099, 0.000_688_f64].map(f64::to_bits));
    let tagged = clean(b"Mappoint:4 1 2 3\n5 1 2 3", Some(BareLine::Point));
    assert_eq!(ids(&tagged.points), [[4, 5]], "a tagged file of the same rows is as good");
}

#[test]
fn what_cannot_be_used_is_told_with_its_line() {
    let (rows, problems) = read(
        b"MappointFrameAsso: 1 1 2 3\n\
          MappointFrameAsso: 1 2 2\n\
          MappointFrameAsso: 1 3 2 3 4\n\
          MappointFrameAsso: 1 4 nan 3\n\
          MappointFrameAsso: 1 5 2 -inf\n\
          MappointFrameAsso: 1 6 two 3\n\
          MappointFrameAsso: 1.5 7 2 3\n\
          MaplineFrameAsso: 1 1 2 3 4 5\n\
          1 2 3 4\n\
          ParalineMaplineAsso: 1 x\n\
          ParalineMaplineAsso: 1\n\
          MappointFrameAsso: 1 8 1e999 3\n\
          MappointFrameAsso:",
        None,
    );
    assert_eq!(rows.point_observations.len(), 1);
    assert!(rows.line_observations.is_empty() && rows.groups.is_empty());
    assert_eq!(
        told(&problems),
        [
            "2 wrong-field-count",
            "3 wrong-field-count",
            "4 non-finite",
            "5 non-finite",
            "6 malformed-number",
            "7 malformed-number",
            "8 wrong-field-count",
            "9 bare-line",
            "10 malformed-number",
            "11 wrong-field-count",
            "12 non-finite",
            "13 wrong-field-count",
        ]
    );
    assert_eq!(problems.listed()[0].kind, ProblemKind::WrongFieldCount { expected: 4, found: 3 });
    assert_eq!(problems.listed()[1].kind, ProblemKind::WrongFieldCount { expected: 4, found: 5 });
    assert_eq!(problems.listed()[6].kind, ProblemKind::WrongFieldCount { expected: 8, found: 6 });
    assert_eq!(
        problems.listed()[2].to_string(),
        "f.txt:4: number is not finite: MappointFrameAsso: 1 4 nan 3"
    );
    assert_eq!(problems.losses(), 12);
}

#[test]
fn unknown_tags_are_told_once_and_counted() {
    let (rows, problems) = read(b"Plane: 1 2\nMappoint: 1 2 3 4\nPlane: 2 2\nid x y z\nPlane 3", None);
    assert_eq!(ids(&rows.points), [[1]]);
    assert_eq!(told(&problems), ["1 unknown-tag", "4 unknown-tag"]);
    assert_eq!(problems.listed()[0].kind, ProblemKind::UnknownTag { tag: "Plane".into(), lines: 3 });
    assert_eq!(problems.count_of("unknown-tag"), 4);
}

#[test]
fn ever_new_unknown_tags_stay_counted_and_bounded() {
    let text = (0..5000).map(|index| format!("tag{index}: 1")).collect::<Vec<_>>().join("\n");
    let (_, problems) = read(text.as_bytes(), None);
    assert_eq!(problems.count_of("unknown-tag"), 5000);
    assert!(problems.listed().len() <= 101, "{}", problems.listed().len());
}

#[test]
fn groups_are_held_against_themselves_and_each_other() {
    let (rows, problems) = read(
        b"ParalineMaplineAsso: 0 3 1 2\nParalineMaplineAsso: 1 3 3 4 3\nParalineMaplineAsso: 2 2 1 5\nParalineMaplineAsso: 0 1 9\nParalineMaplineAsso: 7 0",
        None,
    );
    assert_eq!(rows.groups.len(), 5, "nothing is lost");
    assert_eq!(
        told(&problems),
        ["1 group-size", "2 repeated-member", "3 line-in-several-groups", "4 duplicate-id"]
    );
    assert_eq!(problems.listed()[0].kind, ProblemKind::GroupSize { declared: 3, listed: 2 });
    assert_eq!(problems.losses(), 0);
}

#[test]
fn a_block_that_comes_again_is_a_block_of_its_own() {
    let (rows, problems) = read(
        b"Vertex: 0 0 0 0 0 0 0 1\nMappoint: 0 1 1 1\nMappoint: 2 1 1 1\nMapline: 0 1 1 1 2 2 2\n\
          Mappoint: 1 2 2 2\nMappoint: 0 2 2 2\nMappoint: 2 2 2 2\nMapline: 0 2 2 2 3 3 3\n",
        None,
    );
    assert_eq!(ids(&rows.points), [vec![0, 2], vec![1, 0, 2]]);
    assert_eq!(ids(&rows.lines), [[0], [0]]);
    assert_eq!(rows.points[1].number, 1);
    assert_eq!(told(&problems), ["5 repeated-block", "8 repeated-block"]);
    assert_eq!(problems.listed()[0].kind, ProblemKind::RepeatedBlock { tag: "Mappoint", rows: 3 });
}

#[test]
fn rows_that_take_turns_are_one_block() {
    let text = b"Mappoint: 0 1 1 1\nMapline: 0 1 1 1 2 2 2\nMappoint: 1 1 1 1\nMapline: 1 1 1 1 2 2 2\n";
    let rows = clean(text, None);
    assert_eq!(ids(&rows.points), [[0, 1]]);
    assert_eq!(ids(&rows.lines), [[0, 1]]);
}

#[test]
fn what_comes_twice_is_kept_and_told() {
    let (rows, problems) = read(b"1 0 0 0\n0 0 0 0\n1 5 5 5\n", Some(BareLine::Point));
    assert_eq!(ids(&rows.points), [[1, 0, 1]]);
    assert_eq!(told(&problems), ["3 duplicate-id"]);

    let (rows, problems) = read(
        b"MappointFrameAsso: 1 7 0 0\nMappointFrameAsso: 0 7 0 0\nMappointFrameAsso: 1 8 0 0\nMappointFrameAsso: 1 7 1 1\n\
          MaplineFrameAsso: 1 7 0 0 1 1 1 1\nMaplineFrameAsso: 1 7 0 0 1 1 1 1\n",
        None,
    );
    assert_eq!((rows.point_observations.len(), rows.line_observations.len()), (4, 2));
    assert_eq!(told(&problems), ["4 duplicate-observation", "6 duplicate-observation"]);
    assert_eq!(problems.listed()[0].detail, "point 1 in frame 7");
}

#[test]
fn what_is_no_text_is_not_read() {
    for bytes in [b"\xff\xfeM\0a\0".as_slice(), b"\xfe\xff\0M", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"] {
        let (rows, problems) = read(bytes, None);
        assert!(rows.is_empty());
        assert_eq!(told(&problems), ["- not-text"]);
    }
    assert!(clean(b"", None).is_empty());
    assert!(clean(b"\xef\xbb\xbf", None).is_empty());
}

/// Pieces from which texts near the real ones are made.
fn near_real() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        Just("Vertex:"),
        Just("Mappoint:"),
        Just("Mapline:"),
        Just("MappointFrameAsso:"),
        Just("MaplineFrameAsso:"),
        Just("ParalineMaplineAsso:"),
        Just("\n"),
        Just("\r\n"),
        Just(" "),
        Just("\t"),
        Just("0"),
        Just("17"),
        Just("-1.5e-3"),
        Just("9223372036854775807"),
        Just("nan"),
        Just("#"),
        Just(":"),
        Just("\u{feff}"),
        Just("1 2 3 4"),
    ];
    prop::collection::vec(piece, 0..200).prop_map(|pieces| pieces.concat().into_bytes())
}

/// Every line is a row, empty, a comment, or counted as a loss.
fn all_lines_are_accounted_for(text: &[u8], bare: Option<BareLine>) {
    let (rows, problems) = read(text, bare);
    if problems.count_of("not-text") > 0 {
        return;
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let meant = text
        .split(|&byte| byte == b'\n')
        .filter(|line| line.iter().find(|&&byte| !is_blank(byte)).is_some_and(|&byte| byte != b'#'));
    let blocks = ids(&rows.vertices).concat().len()
        + ids(&rows.points).concat().len()
        + ids(&rows.lines).concat().len();
    let read = blocks + rows.point_observations.len() + rows.line_observations.len() + rows.groups.len();
    assert_eq!(read as u64 + problems.losses(), meant.count() as u64);
}

proptest! {
    #[test]
    fn random_bytes_never_panic_and_no_line_is_dropped_silently(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        for bare in [None, Some(BareLine::Pose), Some(BareLine::Point), Some(BareLine::Segment)] {
            all_lines_are_accounted_for(&bytes, bare);
        }
    }

    #[test]
    fn nearly_real_text_never_panics_and_no_line_is_dropped_silently(text in near_real()) {
        for bare in [None, Some(BareLine::Pose), Some(BareLine::Point), Some(BareLine::Segment)] {
            all_lines_are_accounted_for(&text, bare);
        }
    }

    #[test]
    fn numbers_come_out_as_they_went_in(point: i64, frame: i64, u in -1e300..1e300_f64, v in -1e-300..1e-300_f64) {
        let text = format!("MappointFrameAsso: {point} {frame} {u} {v:e}\n");
        let rows = clean(text.as_bytes(), None);
        let row = rows.point_observations[0];
        prop_assert_eq!((row.point, row.frame, row.u.to_bits(), row.v.to_bits()), (point, frame, u.to_bits(), v.to_bits()));
    }
}
