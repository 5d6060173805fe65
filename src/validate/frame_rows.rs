//! What holds for every per-frame table: known frames, one message a frame, and what each frame shows.

use super::finding::{Detail, Findings};
use super::frames::{FrameEntry, FrameIndex};
use super::ids::Unknown;
use super::mix::{Mix, mix, shown};
use super::rules::RuleId;
use super::world::World;
use crate::structure::{CELL_SIZE_PX, Record, angle, median, ray, shared};

/// What one frame shows of one table.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameCount {
    /// Rows.
    pub(crate) rows: u64,
    /// Cells of the image with a point or an end of a segment, ascending.
    pub(crate) cells: Vec<u32>,
    /// Lines beyond the first of each group.
    pub(crate) constraints: i64,
    /// Ends of segments, pixels.
    pub(crate) segments: Vec<[[f64; 2]; 2]>,
    /// Landmarks that the frame before shows too.
    pub(crate) shared: u64,
    /// Median angle between the rays to the points that the frame before shows too, radians.
    pub(crate) parallax: Option<f64>,
}

/// What a row shows of its landmark.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Pixels {
    Point([f64; 2]),
    Segment([[f64; 2]; 2]),
}

/// Keeps the books of a per-frame table while its rows go by.
pub(crate) struct FrameRows<'a> {
    frames: &'a FrameIndex,
    table: &'static str,
    hint: usize,
    unknown: Unknown,
    with_message: Vec<bool>,
    /// Hash and number of all rows, where correspondences ask for it.
    hash: Option<(Mix, u64)>,
    counts: Option<Counts<'a>>,
}

/// Where a frame shows a point; `None` for a line.
type Pixel = Option<[f64; 2]>;

struct Counts<'a> {
    world: &'a World<'a>,
    frames: Vec<FrameCount>,
    current: usize,
    rows: u64,
    cells: Vec<u32>,
    segments: Vec<[[f64; 2]; 2]>,
    grouped: Vec<i64>,
    /// Landmarks of the current frame with their pixels, where they are points.
    landmarks: Vec<(i64, Pixel)>,
    /// Those of a frame before it.
    before: (usize, Vec<(i64, Pixel)>),
}

/// What the books say in the end.
pub(crate) struct Books {
    pub(crate) hash: Option<(Mix, u64)>,
    pub(crate) counts: Option<Vec<FrameCount>>,
}

impl<'a> FrameRows<'a> {
    /// * `hashed` — whether correspondences will be held against the rows.
    /// * `counted` — whether what each frame shows is to be counted.
    pub(crate) fn new<R: Record>(world: &'a World<'a>, hashed: bool, counted: bool) -> Self {
        let frames = world.frames;
        let counts = counted.then(|| Counts {
            world,
            frames: vec![FrameCount::default(); frames.len()],
            current: usize::MAX,
            rows: 0,
            cells: Vec::new(),
            segments: Vec::new(),
            grouped: Vec::new(),
            landmarks: Vec::new(),
            before: (usize::MAX, Vec::new()),
        });
        Self {
            frames,
            table: R::TABLE.name,
            hint: 0,
            unknown: Unknown::default(),
            with_message: Vec::new(),
            hash: hashed.then(Default::default),
            counts,
        }
    }

    /// The frame of a row, with its place.
    #[inline]
    pub(crate) fn frame(
        &mut self,
        frame_id: i64,
        landmark: i64,
        row: u64,
    ) -> Option<(usize, &'a FrameEntry)> {
        if let Some((sum, count)) = &mut self.hash {
            sum.add(shown(row.cast_signed(), landmark, frame_id));
            *count += 1;
        }
        let place = self.frames.find(frame_id, &mut self.hint);
        if place.is_none() {
            self.unknown.add(frame_id, row);
        }
        place.map(|place| (place, self.frames.entry(place)))
    }

    /// Counts a row of a frame: its landmark and where it shows it.
    #[inline]
    pub(crate) fn count(&mut self, place: usize, landmark: i64, pixels: Pixels) {
        let Some(counts) = &mut self.counts else { return };
        if counts.current != place {
            counts.flush();
            counts.current = place;
        }
        counts.rows += 1;
        match pixels {
            Pixels::Point(pixel) => {
                counts.cells.push(cell(&pixel));
                counts.landmarks.push((landmark, Some(pixel)));
            }
            Pixels::Segment(ends) => {
                counts.cells.extend(ends.iter().map(cell));
                counts.segments.push(ends);
                counts.landmarks.push((landmark, None));
                if let Some(groups) = counts.world.groups.get(&landmark) {
                    counts.grouped.extend_from_slice(groups);
                }
            }
        }
    }

    /// Checks the message of an MCAP file that held some rows.
    pub(crate) fn message(
        &mut self,
        rows: impl Iterator<Item = i64>,
        first_row: u64,
        log_time: Option<u64>,
        findings: &mut Findings,
    ) {
        let (Some(log_time), table) = (log_time, Some(self.table)) else { return };
        let mut rows = rows.peekable();
        let Some(frame) = rows.peek().copied() else { return };
        if let Some(other) = rows.find(|other| *other != frame) {
            findings.add(RuleId::McapOneMessagePerFrame, table, || {
                let found = format!("rows of frame {other} beside those of frame {frame}, at {log_time} ns");
                Detail::new("rows of one frame in a message", found)
                    .row(first_row)
                    .id(format!("frame {frame}"))
            });
        }
        let Some(place) = self.frames.find(frame, &mut self.hint) else { return };
        self.with_message.resize(self.frames.len(), false);
        if std::mem::replace(&mut self.with_message[place], true) {
            findings.add(RuleId::McapOneMessagePerFrame, table, || {
                let found = format!("another one at {log_time} ns");
                Detail::new("one message of the frame", found).row(first_row).id(format!("frame {frame}"))
            });
        }
        let stamp = self.frames.entry(place).stamp;
        if u64::try_from(stamp) != Ok(log_time) {
            findings.add(RuleId::McapMessageTimes, table, || {
                let expected = format!("a message at the frame's stamp, {stamp} ns");
                Detail::new(expected, format!("{log_time} ns")).row(first_row).id(format!("frame {frame}"))
            });
        }
    }

    /// Reports what is left to report.
    pub(crate) fn finish(self, findings: &mut Findings) -> Books {
        self.unknown.report(RuleId::FrameKnown, self.table, "frame", "frames", findings);
        let counts = self.counts.map(|mut counts| {
            counts.flush();
            counts.frames
        });
        Books { hash: self.hash, counts }
    }
}

impl Counts<'_> {
    /// Puts what was gathered into its frame.
    fn flush(&mut self) {
        let landmarks = std::mem::take(&mut self.landmarks);
        let (before, others) = std::mem::replace(&mut self.before, (self.current, landmarks.clone()));
        let both =
            if self.current.checked_sub(1) == Some(before) { shared(others, landmarks) } else { Vec::new() };
        let parallax = both.first().and_then(|_| self.parallax(before, &both));
        if let Some(frame) = self.frames.get_mut(self.current) {
            frame.rows += self.rows;
            frame.cells.append(&mut self.cells);
            frame.cells.sort_unstable();
            frame.cells.dedup();
            frame.cells.shrink_to_fit();
            let lines = i64::try_from(self.grouped.len()).unwrap_or(i64::MAX);
            self.grouped.sort_unstable();
            self.grouped.dedup();
            frame.segments.append(&mut self.segments);
            frame.shared = both.len() as u64;
            frame.parallax = parallax;
            frame.constraints += lines - i64::try_from(self.grouped.len()).unwrap_or(i64::MAX);
        }
        self.rows = 0;
        self.cells.clear();
        self.segments.clear();
        self.grouped.clear();
    }

    /// Median angle between the rays to the points of the current frame and one before it.
    fn parallax(&self, before: usize, both: &[(Pixel, Pixel)]) -> Option<f64> {
        let sight = |place: usize| {
            let entry = self.world.frames.entry(place);
            Some((self.world.views[entry.camera?].as_ref()?.pinhole, entry.pose?.rotation))
        };
        let ((from_camera, from), (to_camera, to)) = (sight(before)?, sight(self.current)?);
        let angles = both.iter().filter_map(|(one, other)| {
            let one = from.tr_mul(&ray(&from_camera, (*one)?));
            Some(angle(&one, &to.tr_mul(&ray(&to_camera, (*other)?))))
        });
        median(&mut angles.collect())
    }
}

/// The cell of a pixel; those far outside any image are told apart by a hash.
#[expect(clippy::cast_possible_truncation, reason = "a float-to-integer cast saturates, which is right here")]
fn cell(pixel: &[f64; 2]) -> u32 {
    let [column, row] = pixel.map(|coordinate| (coordinate / CELL_SIZE_PX).floor() as i64);
    match (i16::try_from(column), i16::try_from(row)) {
        (Ok(column), Ok(row)) => u32::from(column.cast_unsigned()) << 16 | u32::from(row.cast_unsigned()),
        _ => mix(mix(column.cast_unsigned()) ^ row.cast_unsigned()) as u32,
    }
}
