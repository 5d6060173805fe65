//! Throughput of reading and writing, by encoding and kind of numbers, for comparison over time.

#[path = "data/brief.rs"]
mod brief;
#[path = "data/mod.rs"]
#[expect(dead_code, reason = "shared with the figures")]
mod data;

use brief::brief;
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use open_structure::format::{self, WriteOptions};
use open_structure::structure::{FrameId, PointMeasurement, Sequence};

/// A quarter of a million noisy rows, and the same with four decimals.
fn samples() -> [(&'static str, Sequence); 2] {
    let noisy = data::synthetic(50, 5000);
    let mut decimal = noisy.clone();
    for row in &mut decimal.point_measurements {
        let round = |value: f64| (value * 1e4).round() / 1e4;
        (row.u, row.v, row.depth) = (round(row.u), round(row.v), row.depth.map(round));
    }
    [("noisy", noisy), ("decimal", decimal)]
}

#[expect(clippy::unwrap_used, reason = "a benchmark that cannot write has nothing to say")]
fn tables(criterion: &mut Criterion) {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    for (name, sequence) in samples() {
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(sequence.point_measurements.len() as u64));
        for encoding in ["parquet", "mcap"] {
            let path = folder.path().join(format!("{name}.{encoding}"));
            let options = || WriteOptions { force: true, ..WriteOptions::default() };
            // Reading may be asked for alone.
            format::write(&path, &sequence, options()).unwrap();
            group.bench_function(format!("write {encoding}"), |bencher| {
                bencher.iter(|| format::write(&path, &sequence, options()).unwrap());
            });
            group.bench_function(format!("read {encoding}"), |bencher| {
                bencher.iter_batched(
                    || format::open(&path).unwrap(),
                    |reader| reader.table::<PointMeasurement>().unwrap(),
                    BatchSize::PerIteration,
                );
            });
            group.bench_function(format!("frames of {encoding}"), |bencher| {
                let reader = format::open(&path).unwrap();
                bencher.iter(|| {
                    reader
                        .frames()
                        .unwrap()
                        .map(|frame| frame.unwrap().point_measurements.len())
                        .sum::<usize>()
                });
            });
            group.throughput(Throughput::Elements(5000));
            group.bench_function(format!("one frame of {encoding}"), |bencher| {
                bencher.iter(|| format::open(&path).unwrap().frame(FrameId(25)).unwrap());
            });
            group.throughput(Throughput::Elements(sequence.point_measurements.len() as u64));
        }
        group.finish();
    }
}

criterion_group!(name = benches; config = brief(2); targets = tables);
criterion_main!(benches);
