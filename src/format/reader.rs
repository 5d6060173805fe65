//! Reading a sequence from either encoding: whole tables, frame after frame, or one frame by id or time.

use std::collections::{BTreeMap, VecDeque};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::batches::{BatchSource, Batches};
use super::collection::{Collection, sequence_name};
use super::encoding::Encoding;
use super::frames::{Cursors, FrameSource, Frames, frame_topics, take_into};
use super::mcap_reader::McapReader;
use super::mcap_survey::McapSurvey;
use super::parquet_reader::{ParquetTableReader, check_rows};
use super::record_batches::RecordBatches;
use super::stored_table::StoredTable;
use super::{Error, names};
use crate::storage::{self, Found};
use crate::structure::{
    Frame, FrameBundle, FrameId, LineMeasurement, LineObservation, Manifest, PointMeasurement,
    PointObservation, Record, Sequence, TABLES, TableInfo, for_each_frame_table, for_each_table, table_info,
};

/// Most rows that are held in memory at once; longer tables are read in batches.
pub(super) const MAX_ROWS_IN_MEMORY: u64 = 1 << 29;
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

/// Bytes of a sequence as it is stored; 0 where there is none.
#[must_use]
pub fn stored_bytes(path: &Path) -> u64 {
    let tables = table_files();
    let mut known: Vec<&str> = tables.iter().map(String::as_str).collect();
    known.extend([names::MANIFEST_FILE, names::CROISSANT_FILE]);
    storage::size(path, &known)
}

/// Names of the files that the tables of a Parquet folder have.
fn table_files() -> Vec<String> {
    TABLES.iter().map(|table| format!("{}.parquet", table.name)).collect()
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
        let found = storage::find(path).map_err(Error::io(path))?;
        let (manifest, backend, passed_over) = if found == Found::Folder {
            let manifest = parse_manifest(path)?;
            let (tables, passed_over, mut damaged) = open_tables(path, &bytes_read)?;
            if !damaged.is_empty() {
                return Err(damaged.swap_remove(0).1);
            }
            (manifest, Backend::Parquet(tables), passed_over)
        } else if path.file_name().is_some_and(|name| name == names::MANIFEST_FILE) {
            return Self::open(
                path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new(".")),
            );
        } else {
            let (reader, mut damaged) = McapReader::open(path, Arc::clone(&bytes_read), true)?;
            if !damaged.is_empty() {
                return Err(damaged.swap_remove(0).1);
            }
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

    /// Opens what can be opened, for the validator: tables that cannot are listed instead, and the
    /// manifest is not looked at ([`manifest`](Self::manifest) gives the default one).
    ///
    /// # Errors
    /// [`Error::Container`] and the like when the container gives access to nothing.
    pub(crate) fn open_lenient(path: &Path) -> Result<(Self, Damaged), Error> {
        let bytes_read = Arc::new(AtomicU64::new(0));
        let (backend, passed_over, damaged) = if storage::is_folder(path) {
            let (tables, passed_over, damaged) = open_tables(path, &bytes_read)?;
            (Backend::Parquet(tables), passed_over, damaged)
        } else {
            // Wrong checksums are findings of the validator.
            let (reader, damaged) = McapReader::open(path, Arc::clone(&bytes_read), false)?;
            let passed_over = reader.unknown_topics();
            (Backend::Mcap(Box::new(reader)), passed_over, damaged)
        };
        let reader = Self {
            path: path.to_owned(),
            manifest: Manifest::default(),
            backend,
            frames: OnceLock::new(),
            passed_over,
            bytes_read,
        };
        Ok((reader, damaged))
    }

    /// The bytes of the manifest as they are.
    pub(crate) fn manifest_text(&self) -> Result<Vec<u8>, Error> {
        match &self.backend {
            Backend::Mcap(reader) => reader.manifest_text(),
            Backend::Parquet(_) => read_manifest(&self.path),
        }
    }

    /// The bytes of the table summaries, which an MCAP file has as messages of their own.
    pub(crate) fn summary_texts(&self) -> Result<Vec<Vec<u8>>, Error> {
        match &self.backend {
            Backend::Mcap(reader) => reader.summary_texts(),
            Backend::Parquet(_) => Ok(Vec::new()),
        }
    }

    /// What the container of an MCAP file says of itself, read from its first byte to its last.
    pub(crate) fn survey(&self) -> Option<McapSurvey> {
        match &self.backend {
            Backend::Mcap(reader) => Some(reader.survey()),
            Backend::Parquet(_) => None,
        }
    }

    /// Where the sequence lies.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the file is called without its ending, or the folder, in a collection without `sequence=`: tells apart what was
    /// made of one sequence.
    #[must_use]
    pub fn file_name(&self) -> String {
        let place = storage::without_query(&self.path);
        let name = match self.encoding() {
            Encoding::Mcap => place.file_stem(),
            Encoding::Parquet => place.file_name(),
        };
        let Some(name) = name else { return self.path.display().to_string() };
        let name = name.to_string_lossy().into_owned();
        sequence_name(&name).unwrap_or(name)
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

    /// Whether a table has a row, whatever is claimed of it.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn has_rows<R: Record>(&self) -> Result<bool, Error> {
        if !self.has::<R>() {
            return Ok(false);
        }
        for batch in self.batches::<R>()? {
            if !batch?.is_empty() {
                return Ok(true);
            }
        }
        Ok(false)
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
        if let Backend::Parquet(tables) = &self.backend {
            return match tables.get(R::TABLE.name) {
                Some(table) => table.rows(MAX_ROWS_IN_MEMORY),
                None => Ok(Vec::new()),
            };
        }
        let mut rows = Vec::new();
        let mut batches = self.batches::<R>()?;
        while let Some(batch) = batches.next_into(&mut rows) {
            batch?;
            check_rows(&self.path, R::TABLE, rows.len(), MAX_ROWS_IN_MEMORY)?;
        }
        Ok(rows)
    }

    /// Columns of a table in stored order, a batch at a time, for whoever has no use for rows.
    ///
    /// Those of this version of the specification alone, by their names; an optional one may not be there.
    ///
    /// ```no_run
    /// use open_structure::structure::PointMeasurement;
    ///
    /// let sequence = open_structure::format::open("box1")?;
    /// for batch in sequence.record_batches::<PointMeasurement>()? {
    ///     println!("{} rows", batch?.num_rows());
    /// }
    /// # Ok::<(), open_structure::format::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Container`]; each batch may bring its own. Types and nulls are not looked at.
    pub fn record_batches<R: Record>(&self) -> Result<RecordBatches<'_>, Error> {
        Ok(RecordBatches::new(self.source::<R>()?, R::TABLE))
    }

    /// Rows of a table in stored order, a batch at a time.
    ///
    /// # Errors
    /// As [`table`](Self::table); each batch may bring its own.
    pub fn batches<R: Record>(&self) -> Result<Batches<'_, R>, Error> {
        Ok(Batches::new(self.source::<R>()?))
    }

    fn source<R: Record>(&self) -> Result<BatchSource<'_>, Error> {
        Ok(match &self.backend {
            Backend::Mcap(reader) => {
                BatchSource::Mcap(reader, Box::new(reader.messages([R::TABLE.topic()], None)?))
            }
            Backend::Parquet(tables) => match tables.get(R::TABLE.name) {
                Some(table) => BatchSource::Parquet(Box::new(table.batches::<R>()?)),
                None => BatchSource::Empty,
            },
        })
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
        self.frame_of(frame_id, &|_| true)
    }

    /// One frame with its rows in some tables; those of the others are neither read nor there.
    ///
    /// * `wanted` — whether a table of that name is.
    ///
    /// # Errors
    /// As [`table`](Self::table).
    pub fn frame_of(
        &self,
        frame_id: FrameId,
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Option<FrameBundle>, Error> {
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
                for message in reader.messages(frame_topics(wanted), Some((stamp, stamp)))? {
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
                            let name = stringify!($name);
                            if let Some(table) = tables.get(name).filter(|_| wanted(name)) {
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
                let messages = reader.messages(
                    frame_topics(&|_| true),
                    Some((bound(*stamps.start()), bound(*stamps.end()))),
                )?;
                FrameSource::Mcap {
                    reader,
                    messages: Box::new(messages),
                    ahead: None,
                    ready: BTreeMap::new(),
                }
            }
            Backend::Parquet(tables) => FrameSource::Parquet(Box::new(Cursors::new(tables)?)),
        };
        Ok(Frames::new(frames, source))
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

/// Known tables that are there but cannot be opened.
pub(crate) type Damaged = Vec<(&'static TableInfo, Error)>;

type OpenedTables = (BTreeMap<&'static str, ParquetTableReader>, Vec<String>, Damaged);

/// The bytes of a folder's manifest.
fn read_manifest(path: &Path) -> Result<Vec<u8>, Error> {
    let manifest_path = path.join(names::MANIFEST_FILE);
    let bytes = match storage::find(&manifest_path) {
        Ok(Found::File(bytes)) => bytes,
        Ok(_) => {
            return Err(Error::NotASequence {
                path: path.to_owned(),
                found: format!("a folder whose {} is not a file", names::MANIFEST_FILE),
            });
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let found = match Collection::at(path) {
                Ok(Some(_)) => "a collection of sequences".to_owned(),
                _ => format!("a folder without {}", names::MANIFEST_FILE),
            };
            return Err(Error::NotASequence { path: path.to_owned(), found });
        }
        Err(error) => return Err(Error::io(&manifest_path)(error)),
    };
    if bytes > MAX_MANIFEST_BYTES {
        return Err(Error::TooLarge {
            path: manifest_path,
            what: "manifest size".to_owned(),
            found: bytes,
            limit: MAX_MANIFEST_BYTES,
        });
    }
    storage::read(&manifest_path).map_err(Error::io(&manifest_path))
}

fn parse_manifest(path: &Path) -> Result<Manifest, Error> {
    serde_json::from_slice(&read_manifest(path)?)
        .map_err(|error| Error::Manifest { path: path.join(names::MANIFEST_FILE), detail: error.to_string() })
}

fn open_tables(path: &Path, bytes_read: &Arc<AtomicU64>) -> Result<OpenedTables, Error> {
    let (mut tables, mut passed_over, mut damaged) = (BTreeMap::new(), Vec::new(), Vec::new());
    let tables_known = table_files();
    let known: Vec<&str> = tables_known.iter().map(String::as_str).collect();
    for entry in storage::list(path, &known).map_err(Error::io(path))? {
        let name = entry.name.to_string_lossy();
        let file = path.join(&entry.name);
        match name.strip_suffix(".parquet").and_then(table_info) {
            Some(table) if !matches!(entry.found, Found::File(_)) => {
                let detail = "not a regular file".to_owned();
                let error = Error::Container { path: file, container: "Parquet", detail };
                damaged.push((table, error));
            }
            Some(table) => match ParquetTableReader::open(&file, table, Arc::clone(bytes_read)) {
                Ok(reader) => {
                    tables.insert(table.name, reader);
                }
                Err(error) => damaged.push((table, error)),
            },
            None if name == names::MANIFEST_FILE || name == names::CROISSANT_FILE => {}
            None => passed_over.push(name.into_owned()),
        }
    }
    passed_over.sort();
    damaged.sort_by_key(|(table, _)| table.name);
    Ok((tables, passed_over, damaged))
}
