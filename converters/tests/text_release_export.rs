//! What `os export --to text-release` writes is read back to the same rows, where the published sequences are at hand.
//!
//! They are looked for in `../shared/data` beside the workspace, or where `OPEN_STRUCTURE_DATA` says.
#![expect(clippy::unwrap_used, clippy::print_stderr, reason = "tests")]

use std::path::{Path, PathBuf};

use open_structure::exchange::{Remark, to_text_release};
use open_structure::structure::{ContentDigest, Record, Sequence};
use open_structure_converters::release::{Options, convert};
use open_structure_converters::text_release::{Limits, discover, read};

fn dataset() -> Option<PathBuf> {
    let data = std::env::var_os("OPEN_STRUCTURE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let found = [data.join("open-structure"), data].into_iter().find(|path| path.join("box1").is_dir());
    if found.is_none() {
        eprintln!("SKIPPED: the published text release is not here; set OPEN_STRUCTURE_DATA to read it");
    }
    found
}

/// The sequences below a folder, converted.
fn converted(folder: &Path) -> Vec<Sequence> {
    let limits = Limits::default();
    let found = discover(&[folder.to_owned()], &limits).unwrap();
    assert!(found.passed_over.is_empty(), "{:?}", found.passed_over);
    let sources = found.sequences.iter();
    sources
        .map(|source| convert(&read(source, &limits).unwrap(), &Options::default()).unwrap().sequence)
        .collect()
}

/// The sequence that its export in text is converted to.
fn through_text(sequence: &Sequence) -> (Sequence, Vec<Remark>) {
    let (files, remarks) = to_text_release(sequence, None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    // The camera of the release is told by the name of a sequence, too.
    let home = folder.path().join(&sequence.manifest.name);
    for file in files {
        let path = home.join(&file.name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, file.text).unwrap();
    }
    let mut found = converted(&home);
    assert_eq!(found.len(), 1);
    (found.remove(0), remarks)
}

fn digest<R: Record>(sequence: &Sequence) -> (&'static str, usize, String) {
    let mut digest = ContentDigest::default();
    digest.update(R::rows(sequence));
    (R::TABLE.name, R::rows(sequence).len(), digest.finish())
}

/// Rows and digests of every table.
fn digests(sequence: &Sequence) -> Vec<(&'static str, usize, String)> {
    use open_structure::structure::*;
    macro_rules! each {
        ($($row:ident),+) => { vec![$(digest::<$row>(sequence)),+] };
    }
    each!(
        Frame,
        TrajectoryPose,
        PointLandmark,
        LineLandmark,
        StructuralGroup,
        MapPoint,
        MapLine,
        PointCorrespondence,
        LineCorrespondence,
        GraphPose,
        GraphPoint,
        GraphLine,
        GraphFactor,
        FrameStatistics,
        PointObservation,
        LineObservation,
        PointMeasurement,
        LineMeasurement
    )
}

#[test]
fn published_sequences_go_through_text_with_every_digit() {
    let Some(dataset) = dataset() else { return };
    // Noisy and noise-free observations, recovered lines, turned lines, TUM's rounded poses, embedded estimates.
    for name in ["box1", "carwelding", "nostructure_texture_far", "structure_notexture_near", "hospital"] {
        for before in converted(&dataset.join(name)) {
            let (after, remarks) = through_text(&before);
            assert_eq!(digests(&after), digests(&before), "{name}");
            assert_eq!(after.manifest.cameras, before.manifest.cameras, "{name}");
            assert_eq!(after.manifest.noise, before.manifest.noise, "{name}");
            assert_eq!(after.manifest.recovered, before.manifest.recovered, "{name}");
            assert!(remarks.iter().all(|remark| !remark.loss), "{name}: {remarks:?}");
        }
    }
}
