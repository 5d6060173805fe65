//! Writing a sequence whose frames are made twice, so that none has to be kept.
//!
//! Correspondences and statistics stand before the frames in a file, and follow from them. So frames are made
//! once to count, and once more to be written. In between about two bytes are kept for each observation and a
//! bit for its measurement.

use std::path::Path;
use std::sync::mpsc::sync_channel;
use std::thread;

use rayon::prelude::*;

use super::{Error, FrameRows, SequenceWriter, WriteOptions, Written};
use crate::structure::{
    Camera, Frame, FrameBundle, FrameCounter, FrameStatistics, KeptRows, LandmarkRows, LineCorrespondence,
    LineId, LineMeasurement, LineObservation, Manifest, PointCorrespondence, PointId, PointMeasurement,
    PointObservation, Record, StructuralGroup,
};

/// Rows of correspondences that are turned round at once.
const PIECE_ROWS: u64 = 1 << 20;

/// Frames that were made and wait to be taken: more would only cost memory.
const WAITING: usize = 4;

/// The next frames of every output: a list for each.
pub type Chunk = Vec<Vec<FrameBundle>>;

/// What a sequence is known by before its frames are made.
#[derive(Clone, Copy, Debug)]
pub struct Outline<'a> {
    /// The manifest; one that declares noise makes measurements expected, which saves a pass.
    pub manifest: &'a Manifest,
    /// The frames, for the index of the file.
    pub frames: &'a [Frame],
    /// The structural groups, for the statistics; whoever writes the sequence writes them too.
    pub groups: &'a [StructuralGroup],
}

/// Writes a sequence, its frames made twice by `make`: with correspondences, statistics and frames.
///
/// * `options` — as for [`SequenceWriter::create`].
/// * `whole` — writes the other tables of the whole sequence: landmarks, groups, estimates; called once.
/// * `make` — gives the frames in the order of the table `frames`, the same at every call, in a thread of its
///   own. Measured landmarks are among the observed ones, and rows are in key order.
/// * `progress` — told the stage, how many frames are done, and of how many.
///
/// Nothing is left behind where anything fails.
pub fn write_two_pass<E, I>(
    output: &Path,
    outline: Outline<'_>,
    options: WriteOptions,
    whole: impl FnOnce(&mut SequenceWriter) -> Result<(), E>,
    make: impl Fn() -> Result<I, E> + Sync,
    progress: &(dyn Fn(&'static str, u64, u64) + Sync),
) -> Result<Written, E>
where
    E: From<Error> + Send,
    I: Iterator<Item = Result<FrameBundle, E>>,
{
    let Outline { manifest, frames, groups } = outline;
    let mut writer = SequenceWriter::create(output, manifest, frames, options)?;
    whole(&mut writer)?;
    let mut outputs = [Realisation::new(writer, manifest, groups)];
    let make = || Ok(make()?.map(|bundle| bundle.map(|bundle| vec![vec![bundle]])));
    write_realisations(&mut outputs, frames.len(), make, progress)?;
    let [output] = outputs;
    Ok(output.writer.finish()?)
}

/// As [`write_two_pass`], for several outputs with the same observations, of which `make` gives the frames in
/// chunks; what remains is to finish their writers.
pub fn write_realisations<E, I>(
    outputs: &mut [Realisation],
    frame_count: usize,
    make: impl Fn() -> Result<I, E> + Sync,
    progress: &(dyn Fn(&'static str, u64, u64) + Sync),
) -> Result<(), E>
where
    E: From<Error> + Send,
    I: Iterator<Item = Result<Chunk, E>>,
{
    let total = frame_count as u64;
    let observed = loop {
        let (mut observed, mut done) = (Observed::default(), 0);
        for_each_chunk(&make, |chunk| {
            let first = chunk.first().map_or(&[][..], Vec::as_slice);
            first.iter().for_each(|bundle| observed.add(bundle));
            done += first.len() as u64;
            outputs.par_iter_mut().zip(chunk).try_for_each(|(output, bundles)| {
                bundles.into_iter().try_for_each(|bundle| output.tally.add(bundle))
            })?;
            progress("counting", done, total);
            Ok(())
        })?;
        // Statistics of measurements that did not come are made again, of observations.
        if outputs.iter().all(|output| output.tally.is_as_expected(&observed)) {
            break observed;
        }
        outputs.iter_mut().for_each(|output| output.tally.begin_again());
    };
    outputs.par_iter_mut().try_for_each(|output| output.tally.write(&observed, &mut output.writer))?;
    drop(observed);
    let mut done = 0;
    for_each_chunk(&make, |chunk| {
        done += chunk.first().map_or(0, Vec::len) as u64;
        outputs.par_iter_mut().zip(chunk).try_for_each(|(output, bundles)| {
            bundles.iter().try_for_each(|bundle| {
                output.writer.append_frame(bundle.frame.frame_id, FrameRows::from(bundle))
            })
        })?;
        progress("writing", done, total);
        Ok(())
    })
}

/// Takes the chunks that `make` makes, while a thread makes the next ones.
fn for_each_chunk<E, I>(
    make: &(impl Fn() -> Result<I, E> + Sync),
    mut take: impl FnMut(Chunk) -> Result<(), E>,
) -> Result<(), E>
where
    E: Send,
    I: Iterator<Item = Result<Chunk, E>>,
{
    let (sender, receiver) = sync_channel(WAITING);
    thread::scope(|scope| {
        scope.spawn(move || match make() {
            Ok(chunks) => {
                for chunk in chunks {
                    let failed = chunk.is_err();
                    // Nobody takes any more: whoever did has failed.
                    if sender.send(chunk).is_err() || failed {
                        break;
                    }
                }
            }
            Err(error) => drop(sender.send(Err(error))),
        });
        // The receiver is dropped with this closure, which frees the thread where taking fails.
        let receiver = receiver;
        receiver.iter().try_for_each(|chunk| take(chunk?))
    })
}

/// One of several outputs with the same observations.
pub struct Realisation {
    /// Where it is written; the tables of the whole sequence, those made here apart, are there already.
    pub writer: SequenceWriter,
    /// What the first pass learns.
    pub tally: Tally,
}

impl Realisation {
    /// An output; measurements are expected where the manifest declares their noise.
    #[must_use]
    pub fn new(writer: SequenceWriter, manifest: &Manifest, groups: &[StructuralGroup]) -> Self {
        Self { writer, tally: Tally::new(groups, &manifest.cameras, [manifest.noise.is_some(); 2]) }
    }
}

/// Which landmark each observation shows.
#[derive(Debug, Default)]
struct Observed {
    points: LandmarkRows<PointId>,
    lines: LandmarkRows<LineId>,
}

impl Observed {
    /// Adds the observations of the next frame.
    fn add(&mut self, bundle: &FrameBundle) {
        let frame_id = bundle.frame.frame_id;
        self.points.push_frame(frame_id, bundle.point_observations.iter().map(|row| row.point_id));
        self.lines.push_frame(frame_id, bundle.line_observations.iter().map(|row| row.line_id));
    }
}

/// What the first pass learns of one output: which observations were measured, and statistics.
#[derive(Debug)]
pub struct Tally {
    groups: Vec<StructuralGroup>,
    cameras: Vec<Camera>,
    expected: [bool; 2],
    counter: FrameCounter,
    previous: Option<FrameBundle>,
    statistics: Vec<FrameStatistics>,
    points: KeptRows,
    lines: KeptRows,
    lost_depths: u64,
}

impl Tally {
    /// * `expected` — whether measurements are expected: of points, of lines.
    fn new(groups: &[StructuralGroup], cameras: &[Camera], expected: [bool; 2]) -> Self {
        Self {
            groups: groups.to_vec(),
            cameras: cameras.to_vec(),
            expected,
            counter: FrameCounter::new(groups, cameras, expected[0], expected[1]),
            previous: None,
            statistics: Vec::new(),
            points: KeptRows::default(),
            lines: KeptRows::default(),
            lost_depths: 0,
        }
    }

    /// Measurements: of points, of lines.
    #[must_use]
    pub const fn measurements(&self) -> [u64; 2] {
        [self.points.kept(), self.lines.kept()]
    }

    /// Depths of measured observations that have no measurement.
    #[must_use]
    pub const fn lost_depths(&self) -> u64 {
        self.lost_depths
    }

    /// Adds the next frame.
    fn add(&mut self, bundle: FrameBundle) -> Result<(), Error> {
        let frame_id = bundle.frame.frame_id;
        let unobserved = |landmark: String| Error::Unobserved { frame_id, landmark };
        self.lost_depths += keep(
            &mut self.points,
            bundle.point_observations.iter().map(|row| (row.point_id, depths([row.depth]))),
            bundle.point_measurements.iter().map(|row| (row.point_id, depths([row.depth]))),
        )
        .map_err(|id| unobserved(id.to_string()))?;
        self.lost_depths += keep(
            &mut self.lines,
            bundle
                .line_observations
                .iter()
                .map(|row| (row.line_id, depths([row.start_depth, row.end_depth]))),
            bundle
                .line_measurements
                .iter()
                .map(|row| (row.line_id, depths([row.start_depth, row.end_depth]))),
        )
        .map_err(|id| unobserved(id.to_string()))?;
        self.statistics.push(self.counter.count(self.previous.as_ref(), &bundle));
        self.previous = Some(bundle);
        Ok(())
    }

    /// Whether measurements came where they were expected; else statistics have to be made again.
    fn is_as_expected(&self, observed: &Observed) -> bool {
        let seen = [!observed.points.is_empty(), !observed.lines.is_empty()];
        (0..2).all(|kind| !seen[kind] || (self.measurements()[kind] > 0) == self.expected[kind])
    }

    /// Forgets everything but which measurements came: they are expected now.
    fn begin_again(&mut self) {
        let expected = self.measurements().map(|count| count > 0);
        *self = Self::new(&self.groups, &self.cameras, expected);
    }

    /// Writes correspondences and statistics.
    fn write(&self, observed: &Observed, writer: &mut SequenceWriter) -> Result<(), Error> {
        let (measured, seen) = (PointMeasurement::TABLE.name, PointObservation::TABLE.name);
        for piece in observed.points.pieces_of(&self.points, PIECE_ROWS) {
            writer.append(&correspondences(piece, |rows| PointCorrespondence::new(measured, rows)))?;
        }
        for piece in observed.points.pieces(PIECE_ROWS) {
            writer.append(&correspondences(piece, |rows| PointCorrespondence::new(seen, rows)))?;
        }
        let (measured, seen) = (LineMeasurement::TABLE.name, LineObservation::TABLE.name);
        for piece in observed.lines.pieces_of(&self.lines, PIECE_ROWS) {
            writer.append(&correspondences(piece, |rows| LineCorrespondence::new(measured, rows)))?;
        }
        for piece in observed.lines.pieces(PIECE_ROWS) {
            writer.append(&correspondences(piece, |rows| LineCorrespondence::new(seen, rows)))?;
        }
        writer.append(&self.statistics)
    }
}

fn correspondences<T, R>(piece: Vec<T>, row: impl Fn(T) -> R) -> Vec<R> {
    piece.into_iter().map(row).collect()
}

/// How many depths are there.
fn depths<const N: usize>(depths: [Option<f64>; N]) -> u64 {
    depths.iter().flatten().count() as u64
}

/// Marks the observed rows that were measured, and counts depths that the measured ones lost; the error is a
/// landmark that was not observed.
fn keep<Id: PartialEq>(
    kept: &mut KeptRows,
    observed: impl Iterator<Item = (Id, u64)>,
    measured: impl Iterator<Item = (Id, u64)>,
) -> Result<u64, Id> {
    let mut measured = measured.peekable();
    let mut lost = 0;
    for (id, depths) in observed {
        let found = measured.next_if(|(next, _)| *next == id);
        kept.push(found.is_some());
        lost += found.map_or(0, |(_, left)| depths.saturating_sub(left));
    }
    measured.next().map_or(Ok(lost), |(id, _)| Err(id))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format;
    use crate::structure::{
        CameraId, FrameId, Noise, Sequence, frame_statistics, line_correspondences, point_correspondences,
    };

    /// Frames that see points, of which every third is not measured.
    fn sequence(measured: bool) -> Sequence {
        let mut sequence = Sequence::default();
        for id in 0..7 {
            let frame_id = FrameId(id);
            sequence.frames.push(Frame::new(frame_id, id, CameraId(0), None));
            for point in 0..5 {
                let (point_id, u, v) = (PointId(point), 3.0 * point as f64, id as f64);
                sequence.point_observations.push(PointObservation {
                    frame_id,
                    point_id,
                    u,
                    v,
                    depth: Some(1.0),
                });
                if measured && (point + id) % 3 != 0 {
                    let row = PointMeasurement { frame_id, point_id, u: u + 40.0, v, depth: None };
                    sequence.point_measurements.push(row);
                }
            }
        }
        sequence.point_correspondences =
            point_correspondences(&sequence.point_measurements, &sequence.point_observations);
        sequence.line_correspondences = line_correspondences(&[], &[]);
        sequence.frame_statistics = frame_statistics(&sequence);
        sequence
    }

    fn outline(sequence: &Sequence) -> Outline<'_> {
        Outline { manifest: &sequence.manifest, frames: &sequence.frames, groups: &[] }
    }

    fn write(sequence: &Sequence, output: &Path) -> Result<Written, Error> {
        let bundles = || Ok(sequence.bundles().map(Ok));
        let options = WriteOptions::default();
        write_two_pass(output, outline(sequence), options, |_| Ok(()), bundles, &|_, _, _| ())
    }

    #[test]
    fn what_follows_from_the_frames_is_as_from_the_whole_sequence_whatever_was_expected() {
        let folder = tempfile::tempdir().unwrap();
        for (index, (measured, declared)) in
            [(true, true), (true, false), (false, true), (false, false)].into_iter().enumerate()
        {
            let mut sequence = sequence(measured);
            let noise = Noise { model: "gaussian".to_owned(), seed: None, parameters: [].into() };
            sequence.manifest.noise = declared.then_some(noise);
            let output = folder.path().join(index.to_string());
            write(&sequence, &output).unwrap();
            let mut found = format::read(&output).unwrap();
            found.manifest.tables.clear();
            assert_eq!(found, sequence, "{measured} {declared}");
        }
    }

    #[test]
    fn what_is_measured_without_being_observed_is_refused_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let mut sequence = sequence(true);
        sequence.point_observations.retain(|row| (row.frame_id, row.point_id) != (FrameId(3), PointId(4)));
        let error = write(&sequence, &folder.path().join("out")).unwrap_err().to_string();
        assert_eq!(error, "frame 3: point 4 is measured without being observed");
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }

    #[test]
    fn a_maker_that_fails_is_heard() {
        let folder = tempfile::tempdir().unwrap();
        let sequence = sequence(true);
        let failing =
            || Ok(sequence.bundles().take(3).map(Ok).chain([Err(Error::Exists { path: "no more".into() })]));
        let output = folder.path().join("out");
        let options = WriteOptions::default();
        let result = write_two_pass(&output, outline(&sequence), options, |_| Ok(()), failing, &|_, _, _| ());
        assert!(result.unwrap_err().to_string().starts_with("no more"));
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    }
}
