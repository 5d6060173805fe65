//! Writing a sequence whose frames are made twice, so that none has to be kept.
//!
//! Correspondences and statistics stand before the frames in a file, and follow from them. So frames are made
//! once to count, and once more to be written. In between four bytes are kept for each observation and a bit
//! for its measurement.

use std::path::Path;

use super::progress::Progress;
use crate::format::{FrameRows, SequenceWriter, WriteOptions, Written};
use crate::structure::{
    Camera, Frame, FrameBundle, FrameCounter, FrameStatistics, KeptRows, LandmarkRows, LineCorrespondence,
    LineId, LineMeasurement, LineObservation, Manifest, PointCorrespondence, PointId, PointMeasurement,
    PointObservation, Record, StructuralGroup,
};

/// Rows of correspondences that are turned round at once; each such piece costs a pass over all rows.
const PIECE_ROWS: u64 = 1 << 22;

/// Writes a sequence, its frames made twice by `make`: with correspondences, statistics and frames.
///
/// * `manifest`, `frames`, `options` — as for [`SequenceWriter::create`]; a manifest that declares noise makes
///   measurements expected, which saves a pass.
/// * `groups` — the structural groups, for the statistics; `whole` writes them.
/// * `whole` — writes the other tables of the whole sequence: landmarks, groups, estimates; called once.
/// * `make` — gives the frames in the order of the table `frames`, the same at every call. Measured
///   landmarks are among the observed ones, and rows are in key order.
///
/// Nothing is left behind where anything fails.
pub(super) fn write_two_pass<I>(
    output: &Path,
    manifest: &Manifest,
    frames: &[Frame],
    options: WriteOptions,
    groups: &[StructuralGroup],
    whole: impl FnOnce(&mut SequenceWriter) -> anyhow::Result<()>,
    make: impl Fn() -> anyhow::Result<I>,
) -> anyhow::Result<Written>
where
    I: Iterator<Item = anyhow::Result<FrameBundle>>,
{
    let mut writer = SequenceWriter::create(output, manifest, frames, options)?;
    whole(&mut writer)?;
    let total = frames.len() as u64;
    let mut expected = [manifest.noise.is_some(); 2];
    let (observed, tally) = loop {
        let progress = Progress::new("counting", "frames");
        let (mut observed, mut tally) =
            (Observed::default(), Tally::new(groups, &manifest.cameras, expected));
        for (done, bundle) in (1..).zip(make()?) {
            let bundle = bundle?;
            observed.add(&bundle);
            tally.add(bundle)?;
            progress.update(done, total);
        }
        match tally.unexpected(&observed) {
            Some(found) => expected = found,
            None => break (observed, tally),
        }
    };
    tally.write(&observed, &mut writer)?;
    drop((observed, tally));
    let progress = Progress::new("writing", "frames");
    for (done, bundle) in (1..).zip(make()?) {
        let bundle = bundle?;
        writer.append_frame(bundle.frame.frame_id, FrameRows::from(&bundle))?;
        progress.update(done, total);
    }
    Ok(writer.finish()?)
}

/// Which landmark each observation shows; several realisations of the noise share it.
#[derive(Debug, Default)]
pub(super) struct Observed {
    points: LandmarkRows<PointId>,
    lines: LandmarkRows<LineId>,
}

impl Observed {
    /// Adds the observations of the next frame.
    pub(super) fn add(&mut self, bundle: &FrameBundle) {
        let frame_id = bundle.frame.frame_id;
        self.points.push_frame(frame_id, bundle.point_observations.iter().map(|row| row.point_id));
        self.lines.push_frame(frame_id, bundle.line_observations.iter().map(|row| row.line_id));
    }
}

/// What the first pass learns of one realisation: which observations were measured, and statistics.
#[derive(Debug)]
pub(super) struct Tally {
    counter: FrameCounter,
    expected: [bool; 2],
    previous: Option<FrameBundle>,
    statistics: Vec<FrameStatistics>,
    points: KeptRows,
    lines: KeptRows,
}

impl Tally {
    /// * `expected` — whether measurements are expected: of points, of lines.
    pub(super) fn new(groups: &[StructuralGroup], cameras: &[Camera], expected: [bool; 2]) -> Self {
        Self {
            counter: FrameCounter::new(groups, cameras, expected[0], expected[1]),
            expected,
            previous: None,
            statistics: Vec::new(),
            points: KeptRows::default(),
            lines: KeptRows::default(),
        }
    }

    /// Adds the next frame.
    pub(super) fn add(&mut self, bundle: FrameBundle) -> anyhow::Result<()> {
        let frame_id = bundle.frame.frame_id;
        let unobserved =
            |landmark: String| anyhow::anyhow!("{frame_id}: {landmark} is measured without being observed");
        keep(
            &mut self.points,
            bundle.point_observations.iter().map(|row| row.point_id),
            bundle.point_measurements.iter().map(|row| row.point_id),
        )
        .map_err(|id| unobserved(id.to_string()))?;
        keep(
            &mut self.lines,
            bundle.line_observations.iter().map(|row| row.line_id),
            bundle.line_measurements.iter().map(|row| row.line_id),
        )
        .map_err(|id| unobserved(id.to_string()))?;
        self.statistics.push(self.counter.count(self.previous.as_ref(), &bundle));
        self.previous = Some(bundle);
        Ok(())
    }

    /// What should have been expected, where it was something else: statistics then have to be made again.
    pub(super) fn unexpected(&self, observed: &Observed) -> Option<[bool; 2]> {
        let found = [self.points.kept() > 0, self.lines.kept() > 0];
        let seen = [!observed.points.is_empty(), !observed.lines.is_empty()];
        (0..2).any(|kind| seen[kind] && found[kind] != self.expected[kind]).then_some(found)
    }

    /// Writes correspondences and statistics.
    pub(super) fn write(&self, observed: &Observed, writer: &mut SequenceWriter) -> anyhow::Result<()> {
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
        Ok(writer.append(&self.statistics)?)
    }
}

fn correspondences<T, R>(piece: Vec<T>, row: impl Fn(T) -> R) -> Vec<R> {
    piece.into_iter().map(row).collect()
}

/// Marks the observed rows that were measured; the error is a landmark that was not observed.
fn keep<Id: PartialEq>(
    kept: &mut KeptRows,
    observed: impl Iterator<Item = Id>,
    measured: impl Iterator<Item = Id>,
) -> Result<(), Id> {
    let mut measured = measured.peekable();
    for id in observed {
        kept.push(measured.next_if(|next| *next == id).is_some());
    }
    measured.next().map_or(Ok(()), Err)
}
