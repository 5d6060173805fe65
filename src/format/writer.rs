//! Writing a sequence, streaming, to either encoding.

use std::any::Any;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Error;
use super::arrow_batch::to_batch;
use super::arrow_schema::arrow_schema;
use super::encoding::Encoding;
use super::foxglove::FoxgloveChannels;
use super::mcap_writer::McapWriter;
use super::parquet_folder::ParquetFolderWriter;
use crate::structure::{
    ContentDigest, Frame, FrameBundle, FrameId, LineMeasurement, LineObservation, Manifest, PointMeasurement,
    PointObservation, Record, Sequence, Storage, TableSummary, for_each_frame_table, for_each_table,
};

/// Rows that wait before they are encoded: one message of a whole-sequence table.
const PENDING_ROWS: usize = 1 << 14;
/// Bytes of them, for rows that hold long lists.
const PENDING_BYTES: usize = 1 << 22;

/// How a sequence is written.
#[derive(Clone, Debug, Default)]
pub struct WriteOptions {
    /// Replace what stands under the output's name.
    pub force: bool,
    /// Encoding; by default the output's name decides, see [`Encoding::of_output`].
    pub encoding: Option<Encoding>,
    /// Add channels with Foxglove's schemas, for viewers; MCAP only. The map and the trajectories are then
    /// held in memory until the first frame comes.
    pub foxglove: bool,
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Row count and digest of each table, in specification order.
    pub tables: Vec<TableSummary>,
}

macro_rules! frame_rows {
    ($($name:ident: $row:ident,)+) => {
        /// The rows of one frame, of every per-frame table.
        #[derive(Clone, Copy, Debug, Default)]
        pub struct FrameRows<'a> {
            $(
                #[doc = concat!("Rows of the table `", stringify!($name), "`.")]
                pub $name: &'a [$row],
            )+
        }

        impl<'a> From<&'a FrameBundle> for FrameRows<'a> {
            fn from(bundle: &'a FrameBundle) -> Self {
                Self { $($name: &bundle.$name),+ }
            }
        }
    };
}
for_each_frame_table!(frame_rows);

enum Backend {
    Mcap(Box<McapWriter>),
    Parquet(ParquetFolderWriter),
}

struct TableState<R> {
    pending: Vec<R>,
    /// Bytes of the rows that wait, of a table of the whole sequence.
    pending_bytes: usize,
    last: Option<R>,
    digest: ContentDigest,
}

impl<R> Default for TableState<R> {
    fn default() -> Self {
        Self { pending: Vec::new(), pending_bytes: 0, last: None, digest: ContentDigest::default() }
    }
}

impl<R: Record> TableState<R> {
    /// How many of the rows may wait with those that do, and whether it is time to write then. What is
    /// written at once depends on the rows alone, not on how they were handed over.
    fn room(&mut self, rows: &[R]) -> (usize, bool) {
        let mut bytes = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            bytes.clear();
            row.digest(&mut bytes);
            self.pending_bytes += bytes.len();
            if self.pending_bytes >= PENDING_BYTES || self.pending.len() + index + 1 >= PENDING_ROWS {
                self.pending_bytes = 0;
                return (index + 1, true);
            }
        }
        (rows.len(), false)
    }
}

/// Writes a sequence piece by piece; memory stays bounded by one chunk or row group per table.
///
/// First the tables of the whole sequence ([`append`](Self::append)), then frame after frame
/// ([`append_frame`](Self::append_frame)), then [`finish`](Self::finish). Until then the output has a
/// temporary name; a writer that is dropped leaves nothing behind.
///
/// ```
/// use open_structure::format::{SequenceWriter, WriteOptions, FrameRows};
/// use open_structure::structure::{CameraId, Frame, FrameId, Manifest, PointId, PointMeasurement};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let folder = tempfile::tempdir()?;
/// let manifest = Manifest { name: "tiny".to_owned(), ..Manifest::default() };
/// let frames = [Frame::new(FrameId(0), 0, CameraId(0), None)];
/// let mut writer = SequenceWriter::create(&folder.path().join("tiny.mcap"), &manifest, &frames, WriteOptions::default())?;
/// let row = PointMeasurement { frame_id: FrameId(0), point_id: PointId(7), u: 12.5, v: 80.25, depth: Some(2.0) };
/// writer.append_frame(FrameId(0), FrameRows { point_measurements: &[row], ..FrameRows::default() })?;
/// let written = writer.finish()?;
/// assert_eq!(written.tables[1].rows, 1);
/// # Ok(())
/// # }
/// ```
pub struct SequenceWriter {
    path: PathBuf,
    manifest: Manifest,
    backend: Backend,
    foxglove: Option<FoxgloveChannels>,
    frames: Vec<Frame>,
    next_frame: usize,
    tables: BTreeMap<&'static str, Box<dyn Any + Send>>,
}

impl SequenceWriter {
    /// Begins a sequence with its manifest and its frames.
    ///
    /// # Errors
    /// [`Error::Exists`] unless `force`; [`Error::Order`] when frames are not strictly ascending by id
    /// or their stamps fall; [`Error::NegativeStamp`]; those of the file system.
    pub fn create(
        path: &Path,
        manifest: &Manifest,
        frames: &[Frame],
        options: WriteOptions,
    ) -> Result<Self, Error> {
        check_stamps(frames)?;
        let first_stamp = frames.first().map_or(0, |frame| stamp(frame.stamp_nanos));
        let encoding = options.encoding.unwrap_or_else(|| Encoding::of_output(path));
        let (backend, foxglove) = match encoding {
            Encoding::Mcap => {
                let writer = McapWriter::create(path, manifest, first_stamp, options.force)?;
                let foxglove = options.foxglove.then(|| FoxgloveChannels::new(manifest));
                (Backend::Mcap(Box::new(writer)), foxglove)
            }
            Encoding::Parquet => {
                (Backend::Parquet(ParquetFolderWriter::create(path, manifest, options.force)?), None)
            }
        };
        let mut writer = Self {
            path: path.to_owned(),
            manifest: manifest.clone(),
            backend,
            foxglove,
            frames: frames.to_vec(),
            next_frame: 0,
            tables: BTreeMap::new(),
        };
        writer.append(frames)?;
        Ok(writer)
    }

    /// Makes a table be there, even if no row follows.
    ///
    /// # Errors
    /// Those of the file system and the encoders.
    pub fn declare<R: Record>(&mut self) -> Result<(), Error> {
        if !self.tables.contains_key(R::TABLE.name) {
            match &mut self.backend {
                Backend::Mcap(writer) => writer.declare(R::TABLE)?,
                Backend::Parquet(writer) => writer.declare(R::TABLE)?,
            }
            self.tables.insert(R::TABLE.name, Box::new(TableState::<R>::default()));
        }
        Ok(())
    }

    /// Appends rows of a table of the whole sequence, in key order; may be called again for more.
    ///
    /// # Errors
    /// [`Error::Sequence`] for a per-frame table, or after the first frame; [`Error::Order`] when a key
    /// does not ascend.
    pub fn append<R: Record>(&mut self, rows: &[R]) -> Result<(), Error> {
        let table = R::TABLE.name;
        if R::TABLE.storage == Storage::PerFrame {
            return Err(Error::Sequence {
                table,
                detail: "rows of a per-frame table are written frame by frame",
            });
        }
        if self.next_frame > 0 {
            return Err(Error::Sequence {
                table,
                detail: "tables of the whole sequence are written before the first frame",
            });
        }
        self.declare::<R>()?;
        if let Some(foxglove) = &mut self.foxglove {
            foxglove.remember(rows);
        }
        let mut rest = rows;
        while !rest.is_empty() {
            let (count, full) = self.state::<R>().room(rest);
            let (run, later) = rest.split_at(count);
            self.enqueue(run)?;
            if full {
                self.flush::<R>()?;
            }
            rest = later;
        }
        Ok(())
    }

    /// Writes the rows of the next frame that has any. Frames come in the order of the table `frames`;
    /// those without rows may be passed over.
    ///
    /// # Errors
    /// [`Error::UnknownFrame`], [`Error::Sequence`] when the frame comes too late, [`Error::Order`].
    pub fn append_frame(&mut self, frame_id: FrameId, rows: FrameRows<'_>) -> Result<(), Error> {
        if self.next_frame == 0 {
            self.finish_whole_tables()?;
        }
        let table = PointMeasurement::TABLE.name;
        let Some(offset) = self.frames[self.next_frame..].iter().position(|frame| frame.frame_id == frame_id)
        else {
            return Err(if self.frames.iter().any(|frame| frame.frame_id == frame_id) {
                Error::Sequence {
                    table,
                    detail: "frames are written in the order of the table frames, each once",
                }
            } else {
                Error::UnknownFrame { table, row: 0, frame: frame_id.0 }
            });
        };
        self.show_frames_without_rows(self.next_frame + offset)?;
        let frame = self.frames[self.next_frame].clone();
        self.next_frame += 1;

        macro_rules! each {
            ($($name:ident: $row:ident,)+) => { $(self.append_frame_table::<$row>(&frame, rows.$name)?;)+ };
        }
        for_each_frame_table!(each);
        if let (Some(foxglove), Backend::Mcap(writer)) = (&self.foxglove, &mut self.backend) {
            foxglove.write_frame(writer, &frame, rows)?;
        }
        Ok(())
    }

    /// Shows viewers the frames up to an index that were passed over: the camera moves through them too.
    fn show_frames_without_rows(&mut self, end: usize) -> Result<(), Error> {
        let passed = &self.frames[self.next_frame..end];
        if let (Some(foxglove), Backend::Mcap(writer)) = (&self.foxglove, &mut self.backend) {
            for frame in passed {
                foxglove.write_frame(writer, frame, FrameRows::default())?;
            }
        }
        self.next_frame = end;
        Ok(())
    }

    fn append_frame_table<R: Record>(&mut self, frame: &Frame, rows: &[R]) -> Result<(), Error> {
        if rows.is_empty() {
            return Ok(());
        }
        self.declare::<R>()?;
        let first = self.state::<R>().digest.rows();
        if let Some(index) = rows.iter().position(|row| row.frame() != Some(frame.frame_id)) {
            let found = rows[index].frame().map_or(0, |frame| frame.0);
            return Err(Error::UnknownFrame {
                table: R::TABLE.name,
                row: first + index as u64,
                frame: found,
            });
        }
        self.enqueue(rows)?;
        let waiting = self.state::<R>().pending.len();
        match self.backend {
            Backend::Mcap(_) => self.flush_at::<R>(stamp(frame.stamp_nanos)),
            Backend::Parquet(_) if waiting >= PENDING_ROWS => self.flush::<R>(),
            Backend::Parquet(_) => Ok(()),
        }
    }

    /// Checks the order of rows and puts them into their table's queue.
    fn enqueue<R: Record>(&mut self, rows: &[R]) -> Result<(), Error> {
        let state = self.state::<R>();
        let first = state.digest.rows();
        let mut before = state.last.as_ref();
        for (index, row) in rows.iter().enumerate() {
            if let Some(before) = before.filter(|before| before.compare_key(row).is_ge()) {
                return Err(Error::Order {
                    table: R::TABLE.name,
                    row: first + index as u64,
                    key: row.key_text(),
                    previous: before.key_text(),
                });
            }
            before = Some(row);
        }
        state.digest.update(rows);
        if let Some(last) = rows.last() {
            state.last = Some(last.clone());
        }
        state.pending.extend_from_slice(rows);
        Ok(())
    }

    /// The state of a declared table.
    #[expect(clippy::expect_used, reason = "declared right before, and a name has one row type")]
    fn state<R: Record>(&mut self) -> &mut TableState<R> {
        self.tables
            .get_mut(R::TABLE.name)
            .and_then(|state| state.downcast_mut())
            .expect("a table is declared before it is used")
    }

    fn flush<R: Record>(&mut self) -> Result<(), Error> {
        let first_stamp = self.frames.first().map_or(0, |frame| stamp(frame.stamp_nanos));
        self.flush_at::<R>(first_stamp)
    }

    fn flush_at<R: Record>(&mut self, stamp: u64) -> Result<(), Error> {
        let mut rows = std::mem::take(&mut self.state::<R>().pending);
        if !rows.is_empty() {
            let batch = to_batch(&rows, &arrow_schema(R::TABLE))
                .map_err(|error| Error::container(&self.path, "Arrow")(error.into()))?;
            match &mut self.backend {
                Backend::Mcap(writer) => writer.write_batch(R::TABLE, stamp, &batch)?,
                Backend::Parquet(writer) => writer.write_batch(R::TABLE, batch)?,
            }
            rows.clear();
            self.state::<R>().pending = rows;
        }
        Ok(())
    }

    /// Writes what waits of the tables of the whole sequence; after this come frames.
    fn finish_whole_tables(&mut self) -> Result<(), Error> {
        macro_rules! each {
            ($($name:ident: $row:ident,)+) => {
                $(
                    if crate::structure::$row::TABLE.storage == Storage::Whole && self.tables.contains_key(stringify!($name)) {
                        self.flush::<crate::structure::$row>()?;
                    }
                )+
            };
        }
        for_each_table!(each);
        if let (Some(foxglove), Backend::Mcap(writer)) = (&mut self.foxglove, &mut self.backend) {
            let first_stamp = self.frames.first().map_or(0, |frame| stamp(frame.stamp_nanos));
            foxglove.write_scene(writer, first_stamp)?;
        }
        Ok(())
    }

    /// Writes what waits, the summaries and the index, and gives the output its name.
    ///
    /// # Errors
    /// Those of the file system and the encoders; [`Error::Exists`] when something took the name meanwhile.
    pub fn finish(mut self) -> Result<Written, Error> {
        if self.next_frame == 0 {
            self.finish_whole_tables()?;
        }
        self.show_frames_without_rows(self.frames.len())?;
        let mut summaries = Vec::new();
        macro_rules! each {
            ($($name:ident: $row:ident,)+) => {
                $(
                    if self.tables.contains_key(stringify!($name)) {
                        self.flush::<crate::structure::$row>()?;
                        let digest = std::mem::take(&mut self.state::<crate::structure::$row>().digest);
                        summaries.push(TableSummary {
                            table: stringify!($name).to_owned(),
                            rows: digest.rows(),
                            sha256: digest.finish(),
                        });
                    }
                )+
            };
        }
        for_each_table!(each);
        let last_stamp = self.frames.last().map_or(0, |frame| stamp(frame.stamp_nanos));
        match self.backend {
            Backend::Mcap(writer) => writer.finish(&summaries, last_stamp)?,
            Backend::Parquet(writer) => {
                self.manifest.tables.clone_from(&summaries);
                let manifest = self.manifest;
                writer.finish(&manifest)?;
            }
        }
        Ok(Written { tables: summaries })
    }
}

/// Writes a whole sequence; tables without rows are left out, `frames` apart.
///
/// # Errors
/// Those of [`SequenceWriter`]. Rows have to be in key order, see [`Sequence::sort`].
pub fn write(path: &Path, sequence: &Sequence, options: WriteOptions) -> Result<Written, Error> {
    let mut writer = SequenceWriter::create(path, &sequence.manifest, &sequence.frames, options)?;
    macro_rules! whole {
        ($($name:ident: $row:ident,)+) => {
            $(
                if stringify!($name) != Frame::TABLE.name && !sequence.$name.is_empty() {
                    // All at once, as a copy does, so that the same sequence gives the same bytes.
                    writer.declare::<crate::structure::$row>()?;
                    if crate::structure::$row::TABLE.storage == Storage::Whole {
                        writer.append(&sequence.$name)?;
                    }
                }
            )+
        };
    }
    for_each_table!(whole);
    let mut rest = FrameRows::default();
    macro_rules! begin {
        ($($name:ident: $row:ident,)+) => { $(rest.$name = &sequence.$name;)+ };
    }
    for_each_frame_table!(begin);
    for frame in &sequence.frames {
        let mut rows = FrameRows::default();
        macro_rules! split {
            ($($name:ident: $row:ident,)+) => {
                $((rows.$name, rest.$name) = split_frame(rest.$name, frame.frame_id);)+
            };
        }
        for_each_frame_table!(split);
        writer.append_frame(frame.frame_id, rows)?;
    }
    macro_rules! left {
        ($($name:ident: $row:ident,)+) => {
            $(
                if let Some(row) = rest.$name.first() {
                    return Err(Error::UnknownFrame {
                        table: stringify!($name),
                        row: (sequence.$name.len() - rest.$name.len()) as u64,
                        frame: row.frame_id.0,
                    });
                }
            )+
        };
    }
    for_each_frame_table!(left);
    writer.finish()
}

/// The rows of a frame at the head of a table, and the rest.
fn split_frame<R: Record>(rows: &[R], frame_id: FrameId) -> (&[R], &[R]) {
    let count = rows.iter().take_while(|row| row.frame() == Some(frame_id)).count();
    rows.split_at(count)
}

fn stamp(nanos: i64) -> u64 {
    u64::try_from(nanos).unwrap_or(0)
}

fn check_stamps(frames: &[Frame]) -> Result<(), Error> {
    for (row, frame) in frames.iter().enumerate() {
        if frame.stamp_nanos < 0 {
            return Err(Error::NegativeStamp { row: row as u64, stamp: frame.stamp_nanos });
        }
    }
    for (row, pair) in frames.windows(2).enumerate() {
        if pair[1].stamp_nanos < pair[0].stamp_nanos {
            return Err(Error::Order {
                table: Frame::TABLE.name,
                row: row as u64 + 1,
                key: format!("stamp {} ns", pair[1].stamp_nanos),
                previous: format!("stamp {} ns", pair[0].stamp_nanos),
            });
        }
    }
    Ok(())
}
