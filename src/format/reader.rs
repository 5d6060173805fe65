//! Reading a sequence from either encoding: whole tables, frame after frame, or one frame by id or time.

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::encoding::Encoding;
use super::mcap_reader::{McapReader, Message, Messages};
use super::parquet_reader::{ParquetBatches, ParquetTableReader};
use super::stored_table::StoredTable;
use super::{Error, names};
use crate::structure::{
    Frame, FrameBundle, FrameId, LineMeasurement, LineObservation, Manifest, PointMeasurement,
    PointObservation, Record, Sequence, TABLES, for_each_frame_table, for_each_table, table_info,
};

/// Most rows that are held in memory at once; longer tables are read in batches.
const MAX_ROWS_IN_MEMORY: u64 = 1 << 29;
/// Largest manifest that is read.
const MAX_MANIFEST_BYTES: u64 = 1 << 28;

enum Backend {
    Mcap(Box<McapReader>),
    Parquet(BTreeMap<&'static str, ParquetTableReader>),
}

/// A sequence that is open for reading.
///
/// Unknown columns, tables and messages are passed over; [`passed_over`](Self::passed_over) names them.
pub struct SequenceReader {
    path: PathBuf,
    manifest: Manifest,
    backend: Backend,
    frames: OnceLock<Vec<Frame>>,
    passed_over: Vec<String>,
    bytes_read: Arc<AtomicU64>,
}

/// Opens a sequence, an MCAP file or a Parquet folder.
///
/// ```no_run
/// let sequence = open_structure::format::open("box1.mcap")?;
/// for frame in sequence.frames()? {
///     let frame = frame?;
///     println!("{}: {} points", frame.frame.frame_id, frame.point_measurements.len());
/// }
/// # Ok::<(), open_structure::format::Error>(())
/// ```
///
/// # Errors
/// [`Error::NotASequence`], [`Error::Version`], [`Error::Manifest`], [`Error::Container`] and those of the
/// file system.
pub fn open(path: impl AsRef<Path>) -> Result<SequenceReader, Error> {
    SequenceReader::open(path.as_ref())
}

/// Reads a whole sequence into memory.
///
/// # Errors
/// Those of [`open`] and of [`SequenceReader::table`].
pub fn read(path: impl AsRef<Path>) -> Result<Sequence, Error> {
    open(path)?.read_all()
}

impl SequenceReader {
    fn open(path: &Path) -> Result<Self, Error> {
        let bytes_read = Arc::new(AtomicU64::new(0));
        let found = fs::metadata(path).map_err(Error::io(path))?;
        let (manifest, backend, passed_over) = if found.is_dir() {
            open_folder(path, &bytes_read)?
        } else if path.file_name().is_some_and(|name| name == names::MANIFEST_FILE) {
            return Self::open(
                path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new(".")),
            );
        } else {
            let reader = McapReader::open(path, Arc::clone(&bytes_read))?;
            let passed_over = reader.passed_over().to_vec();
            (reader.manifest()?, Backend::Mcap(Box::new(reader)), passed_over)
        };
        let major = manifest.spec_version.split('.').next().unwrap_or_default();
        if major != "1" {
            return Err(Error::Version { path: path.to_owned(), found: manifest.spec_version });
        }
        Ok(Self {
            path: path.to_owned(),
            manifest,
            backend,
            frames: OnceLock::new(),
            passed_over,
            bytes_read,
        })
    }

    /// Where the sequence lies.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How the sequence is stored.
    #[must_use]
    pub const fn encoding(&self) -> Encoding {
        match self.backend {
            Backend::Mcap(_) => Encoding::Mcap,
            Backend::Parquet(_) => Encoding::Parquet,
        }
    }

    /// The manifest.
    #[must_use]
    pub const fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The known tables that are there, in specification order.
    #[must_use]
    pub fn tables(&self) -> Vec<StoredTable> {
        let mut stored: Vec<StoredTable> = match &self.backend {
            Backend::Mcap(reader) => reader.stored().to_vec(),
            Backend::Parquet(tables) => tables.values().map(|table| table.stored().clone()).collect(),
        };
        stored.sort_by_key(|stored| TABLES.iter().position(|table| table.name == stored.table.name));
        stored
    }

    /// Whether a table is there, if only without rows.
    #[must_use]
    pub fn has<R: Record>(&self) -> bool {
        match &self.backend {
            Backend::Mcap(reader) => reader.stored().iter().any(|stored| stored.table.name == R::TABLE.name),
            Backend::Parquet(tables) => tables.contains_key(R::TABLE.name),
        }
    }

    /// Files or topics that are not of this version of the specification.
    #[must_use]
    pub fn passed_over(&self) -> &[String] {
        &self.passed_over
    }

    /// Bytes that were read from files so far.
    #[must_use]
    pub fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    /// All rows of a table; none when it is not there.
    ///
    /// # Errors
    /// [`Error::MissingColumn`], [`Error::ColumnType`], [`Error::Null`], [`Error::Container`];
    /// [`Error::TooLarge`] when the rows do not fit into memory.
    pub fn table<R: Record>(&self) -> Result<Vec<R>, Error> {
        // What a footer claims may be false, so room is made for what is plausible.
        let claimed = match &self.backend {
            Backend::Mcap(_) => None,
            Backend::Parquet(tables) => tables.get(R::TABLE.name).map(ParquetTableReader::plausible_rows),
        };
        let mut rows = Vec::with_capacity(claimed.unwrap_or(0));
        let mut batches = self.batches::<R>()?;
        while let Some(batch) = batches.next_into(&mut rows) {
            batch?;
            if rows.len() as u64 > MAX_ROWS_IN_MEMORY {
                return Err(Error::TooLarge {
                    path: self.path.clone(),
                    what: format!("row count of {}", R::TABLE.name),
                    found: rows.len() as u64,
                    limit: MAX_ROWS_IN_MEMORY,
                });
            }
        }
        Ok(rows)
    }

    /// Rows of a table in stored order, a batch at a time.
    ///
    /// # Errors
    /// As [`table`](Self::table); each batch may bring its own.
    pub fn batches<R: Record>(&self) -> Result<Batches<'_, R>, Error> {
        let source = match &self.backend {
            Backend::Mcap(reader) => {
                BatchSource::Mcap(reader, Box::new(reader.messages([R::TABLE.topic()], None)?))
            }
            Backend::Parquet(tables) => match tables.get(R::TABLE.name) {
                Some(table) => BatchSource::Parquet(Box::new(table.batches::<R>()?)),
                None => BatchSource::Empty,
            },
        };
        Ok(Batches { source, row: 0, row_type: std::marker::PhantomData })
    }

    /// Every table.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn read_all(&self) -> Result<Sequence, Error> {
        let mut sequence = Sequence { manifest: self.manifest.clone(), ..Sequence::default() };
        macro_rules! each {
            ($($name:ident: $row:ident,)+) => { $(sequence.$name = self.table()?;)+ };
        }
        for_each_table!(each);
        Ok(sequence)
    }

    /// The rows of the table `frames`, read once.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn frame_list(&self) -> Result<&[Frame], Error> {
        if let Some(frames) = self.frames.get() {
            return Ok(frames);
        }
        let frames = self.table::<Frame>()?;
        Ok(self.frames.get_or_init(|| frames))
    }

    /// One frame with its rows, by id; `None` when there is no such frame.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn frame(&self, frame_id: FrameId) -> Result<Option<FrameBundle>, Error> {
        let frames = self.frame_list()?;
        // Ascending in a conforming file; another one is searched through.
        let found = match frames.binary_search_by_key(&frame_id, |frame| frame.frame_id) {
            Ok(index) => Some(index),
            Err(_) => frames.iter().position(|frame| frame.frame_id == frame_id),
        };
        let Some(frame) = found.map(|index| frames[index].clone()) else { return Ok(None) };
        let mut bundle = FrameBundle { frame, ..FrameBundle::default() };
        match &self.backend {
            Backend::Mcap(reader) => {
                let stamp = u64::try_from(bundle.frame.stamp_nanos).unwrap_or(0);
                let mut ready = BTreeMap::new();
                for message in reader.messages(frame_topics(), Some((stamp, stamp)))? {
                    take_into(reader, message?, &mut ready)?;
                }
                if let Some(rows) = ready.remove(&frame_id) {
                    bundle = FrameBundle { frame: bundle.frame, ..rows };
                }
            }
            Backend::Parquet(tables) => {
                macro_rules! each {
                    ($($name:ident: $row:ident,)+) => {
                        $(
                            if let Some(table) = tables.get(stringify!($name)) {
                                let mut batches = table.batches_of_frame::<$row>(frame_id)?;
                                while let Some(rows) = batches.next_rows::<$row>() {
                                    bundle.$name.extend(rows?.into_iter().filter(|row| row.frame_id == frame_id));
                                }
                            }
                        )+
                    };
                }
                for_each_frame_table!(each);
            }
        }
        Ok(Some(bundle))
    }

    /// The frame whose stamp is nearest to a time, with its rows; the earlier one of two as near.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn frame_at(&self, stamp_nanos: i64) -> Result<Option<FrameBundle>, Error> {
        let nearest = self
            .frame_list()?
            .iter()
            .min_by_key(|frame| (frame.stamp_nanos.abs_diff(stamp_nanos), frame.stamp_nanos));
        match nearest.map(|frame| frame.frame_id) {
            Some(frame_id) => self.frame(frame_id),
            None => Ok(None),
        }
    }

    /// Every frame in order, with its rows; frames without rows included.
    ///
    /// # Errors
    /// As [`table`](Self::table); each frame may bring its own.
    pub fn frames(&self) -> Result<Frames<'_>, Error> {
        self.frames_between(i64::MIN..=i64::MAX)
    }

    /// The frames of a range of stamps in order, with their rows.
    ///
    /// # Errors
    /// As [`frames`](Self::frames).
    pub fn frames_between(&self, stamps: RangeInclusive<i64>) -> Result<Frames<'_>, Error> {
        let frames: VecDeque<&Frame> =
            self.frame_list()?.iter().filter(|frame| stamps.contains(&frame.stamp_nanos)).collect();
        let source = match &self.backend {
            Backend::Mcap(reader) => {
                let bound = |stamp: i64| u64::try_from(stamp).unwrap_or(0);
                let messages =
                    reader.messages(frame_topics(), Some((bound(*stamps.start()), bound(*stamps.end()))))?;
                FrameSource::Mcap {
                    reader,
                    messages: Box::new(messages),
                    ahead: None,
                    ready: BTreeMap::new(),
                }
            }
            Backend::Parquet(tables) => FrameSource::Parquet(Box::new(Cursors::new(tables)?)),
        };
        Ok(Frames { frames, source, failed: false })
    }

    /// Reads the container through and checks its checksums; Parquet folders have theirs in the manifest.
    ///
    /// # Errors
    /// [`Error::Container`] when a checksum is wrong.
    pub fn verify_container(&self) -> Result<(), Error> {
        match &self.backend {
            Backend::Mcap(reader) => reader.verify(),
            Backend::Parquet(_) => Ok(()),
        }
    }
}

type Opened = (Manifest, Backend, Vec<String>);

fn open_folder(path: &Path, bytes_read: &Arc<AtomicU64>) -> Result<Opened, Error> {
    let manifest_path = path.join(names::MANIFEST_FILE);
    let length = match fs::metadata(&manifest_path) {
        Ok(found) => found.len(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(Error::NotASequence {
                path: path.to_owned(),
                found: format!("a folder without {}", names::MANIFEST_FILE),
            });
        }
        Err(error) => return Err(Error::io(&manifest_path)(error)),
    };
    if length > MAX_MANIFEST_BYTES {
        return Err(Error::TooLarge {
            path: manifest_path,
            what: "manifest size".to_owned(),
            found: length,
            limit: MAX_MANIFEST_BYTES,
        });
    }
    let text = fs::read(&manifest_path).map_err(Error::io(&manifest_path))?;
    let manifest: Manifest = serde_json::from_slice(&text)
        .map_err(|error| Error::Manifest { path: manifest_path.clone(), detail: error.to_string() })?;
    let (mut tables, mut passed_over) = (BTreeMap::new(), Vec::new());
    for entry in fs::read_dir(path).map_err(Error::io(path))? {
        let entry = entry.map_err(Error::io(path))?;
        let file_name = entry.file_name();
        let name = file_name.to_string_lossy();
        match name.strip_suffix(".parquet").and_then(table_info) {
            Some(table) => {
                let reader = ParquetTableReader::open(&entry.path(), table, Arc::clone(bytes_read))?;
                tables.insert(table.name, reader);
            }
            None if name == names::MANIFEST_FILE || name == names::CROISSANT_FILE => {}
            None => passed_over.push(name.into_owned()),
        }
    }
    passed_over.sort();
    Ok((manifest, Backend::Parquet(tables), passed_over))
}

/// Topics of the per-frame tables.
fn frame_topics() -> Vec<String> {
    let mut topics = Vec::new();
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => { $(topics.push($row::TABLE.topic());)+ };
    }
    for_each_frame_table!(each);
    topics
}

enum BatchSource<'a> {
    Empty,
    Mcap(&'a McapReader, Box<Messages>),
    Parquet(Box<ParquetBatches>),
}

/// Rows of a table, a batch at a time.
pub struct Batches<'a, R> {
    source: BatchSource<'a>,
    row: u64,
    row_type: std::marker::PhantomData<fn() -> R>,
}

impl<R: Record> Batches<'_, R> {
    /// Appends the next batch to rows; `None` at the end.
    fn next_into(&mut self, rows: &mut Vec<R>) -> Option<Result<(), Error>> {
        let before = rows.len();
        let result = match &mut self.source {
            BatchSource::Empty => None,
            BatchSource::Parquet(batches) => batches.next_into(rows),
            BatchSource::Mcap(reader, messages) => loop {
                match messages.next()?.and_then(|message| reader.rows_into(message, self.row, rows)) {
                    Ok(false) => {}
                    Ok(true) => break Some(Ok(())),
                    Err(error) => break Some(Err(error)),
                }
            },
        };
        match &result {
            Some(Ok(())) => self.row += (rows.len() - before) as u64,
            Some(Err(_)) => self.source = BatchSource::Empty,
            None => {}
        }
        result
    }
}

impl<R: Record> Iterator for Batches<'_, R> {
    type Item = Result<Vec<R>, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut rows = Vec::new();
        Some(self.next_into(&mut rows)?.map(|()| rows))
    }
}

/// Rows of one table that wait for their frame.
struct TableCursor<R> {
    batches: Option<ParquetBatches>,
    ahead: VecDeque<R>,
}

impl<R: Record> TableCursor<R> {
    fn new(tables: &BTreeMap<&'static str, ParquetTableReader>) -> Result<Self, Error> {
        let batches = tables.get(R::TABLE.name).map(ParquetTableReader::batches::<R>).transpose()?;
        Ok(Self { batches, ahead: VecDeque::new() })
    }

    /// Rows of a frame; rows of earlier frames, which are not in the list, are passed over.
    fn take(&mut self, frame_id: FrameId) -> Result<Vec<R>, Error> {
        let mut rows = Vec::new();
        loop {
            while let Some(row) = self.ahead.front() {
                match row.frame().cmp(&Some(frame_id)) {
                    std::cmp::Ordering::Greater => return Ok(rows),
                    std::cmp::Ordering::Equal => rows.extend(self.ahead.pop_front()),
                    std::cmp::Ordering::Less => drop(self.ahead.pop_front()),
                }
            }
            match self.batches.as_mut().and_then(ParquetBatches::next_rows::<R>) {
                Some(batch) => self.ahead = batch?.into(),
                None => return Ok(rows),
            }
        }
    }
}

macro_rules! cursors {
    ($($name:ident: $row:ident,)+) => {
        /// A cursor for every per-frame table.
        struct Cursors {
            $($name: TableCursor<$row>,)+
        }

        impl Cursors {
            fn new(tables: &BTreeMap<&'static str, ParquetTableReader>) -> Result<Self, Error> {
                Ok(Self { $($name: TableCursor::new(tables)?),+ })
            }

            fn take(&mut self, frame: &Frame) -> Result<FrameBundle, Error> {
                Ok(FrameBundle { frame: frame.clone(), $($name: self.$name.take(frame.frame_id)?),+ })
            }
        }
    };
}
for_each_frame_table!(cursors);

enum FrameSource<'a> {
    Mcap {
        reader: &'a McapReader,
        messages: Box<Messages>,
        ahead: Option<Message>,
        ready: BTreeMap<FrameId, FrameBundle>,
    },
    Parquet(Box<Cursors>),
}

/// Frames in order, each with its rows.
pub struct Frames<'a> {
    frames: VecDeque<&'a Frame>,
    source: FrameSource<'a>,
    failed: bool,
}

impl Frames<'_> {
    fn bundle(&mut self, frame: &Frame) -> Result<FrameBundle, Error> {
        match &mut self.source {
            FrameSource::Parquet(cursors) => cursors.take(frame),
            FrameSource::Mcap { reader, messages, ahead, ready } => {
                let stamp = u64::try_from(frame.stamp_nanos).unwrap_or(0);
                // Frames of several cameras may share a stamp, so all messages up to it are taken first.
                loop {
                    let message = match ahead.take() {
                        Some(message) => message,
                        None => match messages.next() {
                            Some(message) => message?,
                            None => break,
                        },
                    };
                    if message.log_time > stamp {
                        *ahead = Some(message);
                        break;
                    }
                    take_into(reader, message, ready)?;
                }
                let mut bundle = ready.remove(&frame.frame_id).unwrap_or_default();
                bundle.frame = frame.clone();
                // What is left of earlier frames belongs to none in the list.
                ready.retain(|frame_id, _| *frame_id > frame.frame_id);
                Ok(bundle)
            }
        }
    }
}

/// Puts the rows of a per-frame message among those that wait for their frame.
fn take_into(
    reader: &McapReader,
    message: Message,
    ready: &mut BTreeMap<FrameId, FrameBundle>,
) -> Result<(), Error> {
    macro_rules! each {
        ($($name:ident: $row:ident,)+) => {
            match reader.table_of(&message) {
                $(
                    Some(stringify!($name)) => {
                        let mut rows: Vec<$row> = Vec::new();
                        reader.rows_into(message, 0, &mut rows)?;
                        match rows.first().map(|row| row.frame_id) {
                            None => {}
                            // As it should be: the rows of one frame, which has none yet.
                            Some(frame_id) if rows.iter().all(|row| row.frame_id == frame_id) => {
                                let waiting = &mut ready.entry(frame_id).or_default().$name;
                                if waiting.is_empty() {
                                    *waiting = rows;
                                } else {
                                    waiting.append(&mut rows);
                                }
                            }
                            Some(_) => {
                                for row in rows {
                                    ready.entry(row.frame_id).or_default().$name.push(row);
                                }
                            }
                        }
                    }
                )+
                _ => {}
            }
        };
    }
    for_each_frame_table!(each);
    Ok(())
}

impl Iterator for Frames<'_> {
    type Item = Result<FrameBundle, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let frame = self.frames.pop_front()?;
        let result = self.bundle(frame);
        self.failed = result.is_err();
        Some(result)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.frames.len(), Some(self.frames.len()))
    }
}
