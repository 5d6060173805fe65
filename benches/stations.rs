//! Times of the stations of a sequence: importing text, simulating, validating, tracking, evaluating.

#[path = "data/brief.rs"]
mod brief;
#[path = "data/mod.rs"]
#[expect(dead_code, reason = "shared with the figures")]
mod data;
#[path = "data/simulated.rs"]
mod simulated;

use std::path::Path;

use brief::brief;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use open_structure::evaluate::{EvaluateOptions, Reconstruction, evaluate};
use open_structure::format::{self, WriteOptions};
use open_structure::simulate::{self, Simulation};
use open_structure::structure::{
    FrameBundle, LineLandmark, MapLine, MapPoint, MeasuredFrame, PointLandmark, TrajectoryPose,
};
use open_structure::validate::{self, validate};
use open_structure_converters::release;
use open_structure_converters::text_release::{Limits, discover, read};

/// Importing the first text release: reading its files, and making a sequence of them.
#[expect(clippy::unwrap_used, reason = "a benchmark that cannot import has nothing to say")]
fn importing(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("import");
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("sequences/sample");
    let office = data::published_folder().map(|folder| folder.join("office3")).filter(|path| path.is_dir());
    for (name, folder) in [("sample", Some(sample)), ("office3", office)] {
        let Some(folder) = folder else { continue };
        let limits = Limits::default();
        let text = || {
            read(&discover(std::slice::from_ref(&folder), &limits).unwrap().sequences[0], &limits).unwrap()
        };
        group.bench_function(format!("text of {name}"), |bencher| bencher.iter(text));
        let found = text();
        group.bench_function(format!("sequence of {name}"), |bencher| {
            bencher.iter(|| release::convert(&found, &release::Options::default()).unwrap());
        });
    }
    group.finish();
}

/// Sequences of the paper out of their recipes: scene, path, landmarks, what frames see, and every row.
#[expect(clippy::unwrap_used, reason = "a benchmark that cannot simulate has nothing to say")]
fn simulating(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulate");
    for name in ["box1", "corridor1", "sphere1"] {
        let recipe = simulate::named(name).unwrap();
        let make = || simulate::simulate(&recipe, Path::new(""), &|_, _, _| ()).unwrap();
        let rows = |simulation: Simulation| {
            let observations =
                |frame: FrameBundle| frame.point_observations.len() + frame.line_observations.len();
            simulation.bundles().map(observations).sum::<usize>()
        };
        group.throughput(Throughput::Elements(rows(make()) as u64));
        group.bench_function(name, |bencher| bencher.iter(|| rows(make())));
    }
    group.finish();
}

/// What is done with a sequence on disk: two hundred frames of corridor1, tracked.
#[expect(clippy::unwrap_used, reason = "a benchmark that cannot read has nothing to say")]
fn sequences(criterion: &mut Criterion) {
    let mut sequence = simulated::simulated("corridor1", 200).unwrap();
    let frames = MeasuredFrame::of(&sequence);
    simulated::tracked(&sequence, &frames).unwrap().put(&mut sequence);
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();

    let mut group = criterion.benchmark_group("validate");
    let rows = sequence.point_measurements.len() + sequence.line_measurements.len();
    for encoding in ["parquet", "mcap"] {
        let path = folder.path().join(format!("corridor1.{encoding}"));
        format::write(&path, &sequence, WriteOptions::default()).unwrap();
        group.throughput(Throughput::Elements(rows as u64));
        group.bench_function(encoding, |bencher| {
            bencher.iter(|| validate(&path, &validate::Options::default()).unwrap());
        });
    }
    group.finish();

    let path = folder.path().join("corridor1.parquet");
    let mut group = criterion.benchmark_group("track");
    group.throughput(Throughput::Elements(frames.len() as u64));
    group.bench_function("in memory", |bencher| {
        bencher.iter(|| simulated::tracked(&sequence, &frames).unwrap());
    });
    group.bench_function("with reading", |bencher| {
        bencher.iter(|| {
            let sequence = format::read(&path).unwrap();
            simulated::tracked(&sequence, &MeasuredFrame::of(&sequence)).unwrap()
        });
    });
    group.finish();

    let mut group = criterion.benchmark_group("evaluate");
    group.throughput(Throughput::Elements(frames.len() as u64));
    group.bench_function("with reading", |bencher| {
        bencher.iter(|| {
            let reader = format::open(&path).unwrap();
            let (points, lines) =
                (reader.table::<PointLandmark>().unwrap(), reader.table::<LineLandmark>().unwrap());
            let truth = Reconstruction::truth(reader.frame_list().unwrap(), &points, &lines).unwrap();
            let trajectories = reader.table::<TrajectoryPose>().unwrap();
            let (points, lines) = (reader.table::<MapPoint>().unwrap(), reader.table::<MapLine>().unwrap());
            let estimate = Reconstruction::named("tracked", &trajectories, &points, &lines).unwrap();
            evaluate(&truth, &estimate, &EvaluateOptions::default())
        });
    });
    group.finish();
}

criterion_group!(name = benches; config = brief(3); targets = importing, simulating, sequences);
criterion_main!(benches);
