//! The text of one file as rows: tolerant of how it is laid out, exact about every number in it.

use super::blocks::Collector;
use super::fields::{Defect, Fields, is_blank};
use super::model::{
    GroupLine, LineObservationLine, PointLine, PointObservationLine, PoseLine, Rows, SegmentLine,
};
use super::problem::{FileProblems, ProblemKind, excerpt};
use std::collections::HashMap;

/// At most this many different unknown tags are told apart in one file.
const UNKNOWN_TAGS: usize = 100;

/// A line that begins with a word longer than this is no line of the release.
const LONGEST_TAG: usize = 64;

/// What the lines without a tag are in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BareLine {
    /// `id tx ty tz qx qy qz qw`, as after `Vertex:`.
    Pose,
    /// `id x y z`, as after `Mappoint:`.
    Point,
    /// `id sx sy sz ex ey ez`, as after `Mapline:`.
    Segment,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tag {
    Vertex,
    Point,
    Line,
    PointObservation,
    LineObservation,
    Group,
}

impl Tag {
    const ALL: [Self; 6] =
        [Self::PointObservation, Self::LineObservation, Self::Vertex, Self::Point, Self::Line, Self::Group];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Vertex => "Vertex",
            Self::Point => "Mappoint",
            Self::Line => "Mapline",
            Self::PointObservation => "MappointFrameAsso",
            Self::LineObservation => "MaplineFrameAsso",
            Self::Group => "ParalineMaplineAsso",
        }
    }

    fn of(word: &[u8]) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|tag| word == tag.name().as_bytes())
            .or_else(|| Self::ALL.into_iter().find(|tag| word.eq_ignore_ascii_case(tag.name().as_bytes())))
    }
}

/// Reads the text of one file.
///
/// Lines end with LF or CRLF, the last one may lack its end; a byte order mark, empty lines and lines beginning with
/// `#` are passed over; blanks may stand anywhere but within a field, and none is needed after a tag's colon. Lines
/// may come in any order.
///
/// * `bytes` — the file as it is.
/// * `bare` — what lines without a tag are; with none they are reported.
/// * `problems` — takes what cannot be used.
#[must_use]
pub fn parse(bytes: &[u8], bare: Option<BareLine>, problems: &mut FileProblems) -> Rows {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if !is_text(bytes) {
        problems.note(None, ProblemKind::NotText, String::new);
        return Rows::default();
    }
    let mut parser = Parser { bare, rows: Collector::default(), unknown: HashMap::new(), problems };
    let mut row = 0_u32;
    for line in bytes.split(|&byte| byte == b'\n') {
        row = row.saturating_add(1);
        parser.line(line, row);
    }
    parser.finish()
}

/// Whether the bytes are those of an 8-bit text: the two marks of 16-bit text and a zero byte early on tell others.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(4096)];
    !head.starts_with(b"\xff\xfe") && !head.starts_with(b"\xfe\xff") && !head.contains(&0)
}

struct Parser<'p> {
    bare: Option<BareLine>,
    rows: Collector,
    /// First line and number of lines by tag.
    unknown: HashMap<Vec<u8>, (u32, u64)>,
    problems: &'p mut FileProblems,
}

impl Parser<'_> {
    fn line(&mut self, line: &[u8], row: u32) {
        let Some(start) = line.iter().position(|&byte| !is_blank(byte)) else { return };
        let text = &line[start..];
        let parsed = match text[0] {
            b'#' => return,
            b'0'..=b'9' | b'-' | b'+' | b'.' => match self.bare {
                Some(BareLine::Pose) => self.read(Tag::Vertex, text, row),
                Some(BareLine::Point) => self.read(Tag::Point, text, row),
                Some(BareLine::Segment) => self.read(Tag::Line, text, row),
                None => return self.problems.note(Some(row), ProblemKind::BareLine, || excerpt(text)),
            },
            _ => {
                let (word, rest) = split_tag(text);
                match Tag::of(word) {
                    Some(tag) => self.read(tag, rest, row),
                    None => return self.unknown_tag(word, row),
                }
            }
        };
        if let Err((defect, expected, fields)) = parsed {
            self.unusable(defect, expected, fields, text, row);
        }
    }

    /// Reads the fields after the tag; gives the defect, the expected count and the fields where they cannot be used.
    #[inline]
    fn read<'a>(&mut self, tag: Tag, fields: &'a [u8], row: u32) -> Result<(), (Defect, usize, &'a [u8])> {
        let list = Fields::new(fields);
        let rows = &mut self.rows;
        match tag {
            Tag::PointObservation => {
                let ([point, frame], [u, v]) = list.ids_and_numbers().map_err(|d| (d, 4, fields))?;
                rows.point_observation(PointObservationLine { point, frame, u, v, row });
            }
            Tag::LineObservation => {
                let ([line, frame], [a, b, c, d, e, f]) =
                    list.ids_and_numbers().map_err(|d| (d, 8, fields))?;
                let (start, end) = ([a, b, c], [d, e, f]);
                rows.line_observation(LineObservationLine { line, frame, start, end, row });
            }
            Tag::Vertex => {
                let ([id], [x, y, z, qx, qy, qz, qw]) = list.ids_and_numbers().map_err(|d| (d, 8, fields))?;
                let (translation, rotation_xyzw) = ([x, y, z], [qx, qy, qz, qw]);
                rows.vertex(PoseLine { id, translation, rotation_xyzw, row });
            }
            Tag::Point => {
                let ([id], position) = list.ids_and_numbers().map_err(|d| (d, 4, fields))?;
                rows.point(PointLine { id, position, row });
            }
            Tag::Line => {
                let ([id], [a, b, c, d, e, f]) = list.ids_and_numbers().map_err(|d| (d, 7, fields))?;
                rows.line(SegmentLine { id, start: [a, b, c], end: [d, e, f], row });
            }
            Tag::Group => self.group(list, row).map_err(|d| (d, 2, fields))?,
        }
        Ok(())
    }

    fn group(&mut self, mut fields: Fields<'_>, row: u32) -> Result<(), Defect> {
        let group = fields.id()?;
        let declared = fields.id()?;
        let mut lines = Vec::new();
        loop {
            match fields.id() {
                Ok(line) => lines.push(line),
                Err(Defect::Count) => break,
                Err(defect) => return Err(defect),
            }
        }
        if i64::try_from(lines.len()) != Ok(declared) {
            let kind = ProblemKind::GroupSize { declared, listed: lines.len() };
            self.problems.note(Some(row), kind, || format!("group {group}"));
        }
        self.rows.group(GroupLine { group, lines, row });
        Ok(())
    }

    #[cold]
    fn unusable(&mut self, defect: Defect, expected: usize, fields: &[u8], text: &[u8], row: u32) {
        let found = Fields::new(fields).count();
        let kind = match defect {
            // Where the count is wrong too, the count is the reason.
            _ if found < expected || defect == Defect::Count => {
                ProblemKind::WrongFieldCount { expected, found }
            }
            Defect::NonFinite => ProblemKind::NonFinite,
            Defect::Malformed | Defect::Count => ProblemKind::MalformedNumber,
        };
        self.problems.note(Some(row), kind, || excerpt(text));
    }

    #[cold]
    fn unknown_tag(&mut self, word: &[u8], row: u32) {
        let word = &word[..word.len().min(LONGEST_TAG)];
        if let Some((_, lines)) = self.unknown.get_mut(word) {
            *lines += 1;
            return;
        }
        // What comes after so many is told as one.
        let word = if self.unknown.len() < UNKNOWN_TAGS { word } else { "…".as_bytes() };
        self.unknown.entry(word.to_vec()).or_insert((row, 0)).1 += 1;
    }

    fn finish(self) -> Rows {
        let mut unknown: Vec<_> = self.unknown.into_iter().collect();
        unknown.sort_unstable_by_key(|&(_, (row, _))| row);
        for (tag, (row, lines)) in unknown {
            let kind = ProblemKind::UnknownTag { tag: excerpt(&tag), lines };
            self.problems.note_many(Some(row), lines, kind, String::new);
        }
        self.rows.finish(self.problems)
    }
}

/// The first word of a line without its colon, and what follows: `Tag: 1`, `Tag:1`, `Tag : 1` and `Tag 1` are alike.
fn split_tag(text: &[u8]) -> (&[u8], &[u8]) {
    let length = text.iter().position(|&byte| byte == b':' || is_blank(byte)).unwrap_or(text.len());
    let (word, rest) = text.split_at(length);
    let after = rest.iter().position(|&byte| !is_blank(byte)).unwrap_or(rest.len());
    (word, rest[after..].strip_prefix(b":").unwrap_or(rest))
}

#[cfg(test)]
mod tests;
