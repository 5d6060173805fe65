//! From the files of one sequence to a [`TextSequence`]: every file to its part, every other one reported.

use super::discover::{Part, SequenceSource, has_ending};
use super::error::Error;
use super::kind::FileKind;
use super::model::{
    Association, Block, NamedMap, NamedTrajectory, PointFile, PoseFile, Row, Rows, SegmentFile, TextSequence,
};
use super::parameters::parse_parameters;
use super::parse::{BareLine, Tag, parse};
use super::place::Role;
use super::problem::{FileProblems, ProblemKind};
use super::source::{Budget, Container, Limits, Source, SourceFile, provenance_of_bytes, provenance_of_file};
use std::collections::BTreeSet;

/// Reads a sequence.
///
/// Files play the part their names give them; one with an unknown name and observations in it is taken for what its
/// folder lacks. Where two files could play one part, the first does, archives before folders.
///
/// # Errors
/// Those of [`Source::open`] and [`Source::read`]: a sequence is read whole or not at all.
pub fn read(source: &SequenceSource, limits: &Limits) -> Result<TextSequence, Error> {
    let mut reader = Reader {
        sequence: TextSequence {
            name: source.name.clone(),
            variant: source.variant.clone(),
            ..TextSequence::default()
        },
        budget: Budget::new(*limits),
        taken: BTreeSet::new(),
    };
    let mut seen = BTreeSet::new();
    let mut unknown = Vec::new();
    for part in &source.parts {
        let mut files = Source::open(&part.container, &part.label, limits)?;
        // Several folders of one archive may be parts of one sequence.
        if seen.insert(&part.container) {
            if let Container::Archive(path) = &part.container {
                reader.sequence.provenance.push(provenance_of_file(path, &part.label)?);
            }
            reader.sequence.problems.append(files.skipped().clone());
        }
        for file in files.files().to_vec().into_iter().filter(|file| file.folder == part.folder) {
            match FileKind::of_name(&file.name) {
                Some(kind) => reader.named(part, &mut files, &file, kind)?,
                // Archives beside the text files are parts of their own.
                None if matches!(part.container, Container::Folder(_)) && has_ending(&file.name, ".zip") => {}
                None => unknown.push((part, file)),
            }
        }
    }
    for (part, file) in unknown {
        let mut files = Source::open(&part.container, &part.label, limits)?;
        reader.unnamed(part, &mut files, &file)?;
    }
    Ok(reader.finish())
}

struct Reader {
    sequence: TextSequence,
    budget: Budget,
    /// The parts played; with the file's name where several files may play one.
    taken: BTreeSet<(FileKind, String)>,
}

impl Reader {
    fn named(
        &mut self,
        part: &Part,
        files: &mut Source,
        file: &SourceFile,
        kind: FileKind,
    ) -> Result<(), Error> {
        let told = files.told(file);
        let several = matches!(kind, FileKind::RepeatedGroundTruth | FileKind::LineLandmarks);
        let role = (kind.clone(), if several { file.name.to_ascii_lowercase() } else { String::new() });
        if self.taken.contains(&role) {
            self.sequence.problems.file(&told, ProblemKind::RepeatedFile, String::new());
            return Ok(());
        }
        let bytes = self.bytes(part, files, file, &told)?;
        let mut problems = FileProblems::new(&told);
        if self.take(kind, &told, &bytes, &mut problems) {
            self.taken.insert(role);
        } else {
            problems.note(None, ProblemKind::NothingUsable, String::new);
        }
        self.sequence.problems.add(problems);
        Ok(())
    }

    /// A file whose name says nothing plays a part if it holds observations and one lacks them.
    fn unnamed(&mut self, part: &Part, files: &mut Source, file: &SourceFile) -> Result<(), Error> {
        let told = files.told(file);
        let mut problems = FileProblems::new(&told);
        let is_text = has_ending(&file.name, ".txt") && !file.name.starts_with('.');
        let bytes = if is_text { files.read(file, &mut self.budget)? } else { Vec::new() };
        let rows = parse(&bytes, None, &mut problems);
        if rows.point_observations.is_empty() && rows.line_observations.is_empty() {
            self.sequence.problems.file(&told, ProblemKind::UnrecognisedFile, String::new());
            return Ok(());
        }
        let (association, graph) = (self.sequence.association.is_none(), self.sequence.graph.is_none());
        let file = Association { file: told.clone(), rows };
        match part.role {
            Role::Observation | Role::Untold if association => self.sequence.association = Some(file),
            Role::Baseline | Role::Untold if graph => self.sequence.graph = Some(file),
            _ => {
                self.sequence.problems.file(&told, ProblemKind::RepeatedFile, String::new());
                return Ok(());
            }
        }
        self.provenance_of(part, &bytes, &told);
        self.sequence.problems.add(problems);
        Ok(())
    }

    fn bytes(
        &mut self,
        part: &Part,
        files: &mut Source,
        file: &SourceFile,
        told: &str,
    ) -> Result<Vec<u8>, Error> {
        let bytes = files.read(file, &mut self.budget)?;
        self.provenance_of(part, &bytes, told);
        Ok(bytes)
    }

    /// An archive is told as a whole, the files of a folder one by one.
    fn provenance_of(&mut self, part: &Part, bytes: &[u8], told: &str) {
        if matches!(part.container, Container::Folder(_)) {
            self.sequence.provenance.push(provenance_of_bytes(bytes, told));
        }
    }

    /// Gives the file its part; whether there was anything to give.
    fn take(&mut self, kind: FileKind, told: &str, bytes: &[u8], problems: &mut FileProblems) -> bool {
        let file = told.to_owned();
        let sequence = &mut self.sequence;
        match kind {
            FileKind::GroundTruth => {
                let poses = poses(bytes, problems);
                let any = !poses.is_empty();
                sequence.ground_truth = any.then_some(PoseFile { file, poses });
                any
            }
            FileKind::RepeatedGroundTruth => {
                let poses = poses(bytes, problems);
                let any = !poses.is_empty();
                sequence.repeated_ground_truth.extend(any.then_some(PoseFile { file, poses }));
                any
            }
            FileKind::Trajectory(estimate) => {
                let poses = poses(bytes, problems);
                let any = !poses.is_empty();
                sequence.trajectories.extend(any.then_some(NamedTrajectory { estimate, file, poses }));
                any
            }
            FileKind::PointLandmarks => {
                let points = points(bytes, problems);
                let any = !points.is_empty();
                sequence.point_landmarks = any.then_some(PointFile { file, points });
                any
            }
            FileKind::LineLandmarks => {
                let segments = segments(bytes, problems);
                let any = !segments.is_empty();
                sequence.line_landmarks.extend(any.then_some(SegmentFile { file, segments }));
                any
            }
            FileKind::MapPoints(estimate) => {
                let points = points(bytes, problems);
                let any = !points.is_empty();
                if any {
                    let map = map_of(&mut sequence.maps, estimate);
                    map.points = points;
                    map.files.push(file);
                }
                any
            }
            FileKind::MapLines(estimate) => {
                let lines = segments(bytes, problems);
                let any = !lines.is_empty();
                if any {
                    let map = map_of(&mut sequence.maps, estimate);
                    map.lines = lines;
                    map.files.push(file);
                }
                any
            }
            FileKind::Association => {
                sequence.association = association(file, bytes, problems);
                sequence.association.is_some()
            }
            FileKind::Graph => {
                sequence.graph = association(file, bytes, problems);
                sequence.graph.is_some()
            }
            FileKind::Parameters => {
                sequence.system_parameter = parse_parameters(bytes, problems);
                !sequence.system_parameter.is_empty()
            }
        }
    }

    fn finish(self) -> TextSequence {
        let mut sequence = self.sequence;
        sequence.repeated_ground_truth.sort_by(|a, b| a.file.cmp(&b.file));
        sequence.line_landmarks.sort_by(|a, b| a.file.cmp(&b.file));
        sequence.trajectories.sort_by(|a, b| a.estimate.cmp(&b.estimate));
        sequence.maps.sort_by(|a, b| a.estimate.cmp(&b.estimate));
        sequence.provenance.sort_by(|a, b| a.name.cmp(&b.name));
        sequence
    }
}

fn association(file: String, bytes: &[u8], problems: &mut FileProblems) -> Option<Association> {
    let rows = parse(bytes, None, problems);
    (!rows.is_empty()).then_some(Association { file, rows })
}

fn map_of(maps: &mut Vec<NamedMap>, estimate: String) -> &mut NamedMap {
    let place = maps.iter().position(|map| map.estimate == estimate).unwrap_or_else(|| {
        maps.push(NamedMap { estimate, ..NamedMap::default() });
        maps.len() - 1
    });
    &mut maps[place]
}

fn poses(bytes: &[u8], problems: &mut FileProblems) -> Vec<super::PoseLine> {
    let mut rows = parse(bytes, Some(BareLine::Pose), problems);
    let poses = flat(std::mem::take(&mut rows.vertices));
    misplaced(&rows, problems);
    poses
}

fn points(bytes: &[u8], problems: &mut FileProblems) -> Vec<super::PointLine> {
    let mut rows = parse(bytes, Some(BareLine::Point), problems);
    let points = flat(std::mem::take(&mut rows.points));
    misplaced(&rows, problems);
    points
}

fn segments(bytes: &[u8], problems: &mut FileProblems) -> Vec<super::SegmentLine> {
    let mut rows = parse(bytes, Some(BareLine::Segment), problems);
    let segments = flat(std::mem::take(&mut rows.lines));
    misplaced(&rows, problems);
    segments
}

fn flat<T>(blocks: Vec<Block<T>>) -> Vec<T> {
    blocks.into_iter().flat_map(|block| block.rows).collect()
}

/// Tells of rows that a file of this kind has no use for.
fn misplaced(rows: &Rows, problems: &mut FileProblems) {
    fn first<T: Row>(blocks: &[Block<T>]) -> (Option<u32>, usize) {
        let row = blocks.first().and_then(|block| block.rows.first()).map(Row::row);
        (row, blocks.iter().map(|block| block.rows.len()).sum())
    }
    let Rows { vertices, points, lines, point_observations, line_observations, groups } = rows;
    for (tag, (row, count)) in [
        (Tag::Vertex, first(vertices)),
        (Tag::Point, first(points)),
        (Tag::Line, first(lines)),
        (Tag::PointObservation, (point_observations.first().map(|row| row.row), point_observations.len())),
        (Tag::LineObservation, (line_observations.first().map(|row| row.row), line_observations.len())),
        (Tag::Group, (groups.first().map(|row| row.row), groups.len())),
    ] {
        if count > 0 {
            let lines = count as u64;
            problems.note_many(row, lines, ProblemKind::MisplacedTag { tag: tag.name(), lines }, String::new);
        }
    }
}

#[cfg(test)]
mod tests;
