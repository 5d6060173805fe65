//! What a catalogue says of a sequence: taken from its manifest, its footers, its frames and the names of its estimates.

use std::collections::BTreeSet;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::super::{Error, SequenceReader, names};
use super::Member;
use crate::storage::{self, Found};
use crate::structure::{
    CatalogueEntry, Frame, LineLandmark, LineMeasurement, LineObservation, PointLandmark, PointMeasurement,
    PointObservation, Record, StructuralGroup, TrajectoryPose, hex,
};

/// The row of a sequence in the catalogue of its collection.
///
/// # Errors
/// Those of opening and of reading `frames` and `trajectories`; [`Error::Misnamed`] when the manifest has another name than the
/// folder.
pub fn catalogue_entry(member: &Member) -> Result<CatalogueEntry, Error> {
    let reader = super::super::open(&member.path)?;
    let manifest = reader.manifest();
    if manifest.name != member.name || !member.is_well_named() {
        return Err(Error::Misnamed {
            path: member.path.clone(),
            name: manifest.name.clone(),
            expected: super::folder_name(&manifest.name),
        });
    }
    if !reader.has::<Frame>() {
        let detail = "expected frames.parquet, without which it is no sequence; found none".to_owned();
        return Err(Error::Container { path: member.path.clone(), container: "Parquet", detail });
    }
    let frames = reader.frame_list()?;
    let centres: Vec<[f64; 3]> = frames.iter().filter_map(centre).collect();
    let extreme =
        |axis: usize, choose: fn(f64, f64) -> f64| centres.iter().map(|centre| centre[axis]).reduce(choose);
    let stored = reader.tables();
    let rows = |table: &str| {
        let found = stored.iter().find(|stored| stored.table.name == table);
        whole(found.and_then(|stored| stored.rows).unwrap_or(0))
    };
    let source = &manifest.source;
    Ok(CatalogueEntry {
        sequence: manifest.name.clone(),
        spec_version: manifest.spec_version.clone(),
        manifest_sha256: hex(&Sha256::digest(reader.manifest_text()?)),
        description: manifest.description.clone(),
        dataset: source.dataset.clone(),
        dataset_sequence: source.sequence.clone(),
        licence: source.licence.clone(),
        generator: manifest.generator.tool.clone(),
        clock: manifest.clock.kind.clone(),
        noise: manifest.noise.as_ref().map(|noise| noise.model.clone()),
        cameras: whole(manifest.cameras.len() as u64),
        frames: whole(frames.len() as u64),
        frames_with_truth: whole(
            frames.iter().filter(|frame| frame.world_from_camera().is_some()).count() as u64
        ),
        first_stamp_nanos: frames.first().map(|frame| frame.stamp_nanos),
        last_stamp_nanos: frames.last().map(|frame| frame.stamp_nanos),
        path_length: path_length(&centres),
        min_x: extreme(0, f64::min),
        min_y: extreme(1, f64::min),
        min_z: extreme(2, f64::min),
        max_x: extreme(0, f64::max),
        max_y: extreme(1, f64::max),
        max_z: extreme(2, f64::max),
        points: rows(PointLandmark::TABLE.name),
        lines: rows(LineLandmark::TABLE.name),
        groups: rows(StructuralGroup::TABLE.name),
        point_observations: rows(PointObservation::TABLE.name),
        line_observations: rows(LineObservation::TABLE.name),
        point_measurements: rows(PointMeasurement::TABLE.name),
        line_measurements: rows(LineMeasurement::TABLE.name),
        total_rows: whole(stored.iter().filter_map(|stored| stored.rows).fold(0, u64::saturating_add)),
        tables: stored.iter().map(|stored| stored.table.name.to_owned()).collect(),
        estimates: estimates(&reader)?,
        bytes: whole(bytes(&member.path, stored.iter().map(|stored| stored.table.name))?),
    })
}

fn whole(number: u64) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// The true centre of the camera; one that is not finite is none.
fn centre(frame: &Frame) -> Option<[f64; 3]> {
    let centre = frame.world_from_camera()?.translation;
    centre.iter().all(|number| number.is_finite()).then_some(centre)
}

fn path_length(centres: &[[f64; 3]]) -> Option<f64> {
    let step = |pair: &[[f64; 3]]| {
        let [x, y, z] = [0, 1, 2].map(|axis| pair[1][axis] - pair[0][axis]);
        (x * x + y * y + z * z).sqrt()
    };
    let length = centres.windows(2).map(step).sum::<f64>();
    // Zero, not the sum's own minus zero, for a camera that never moved.
    (!centres.is_empty() && length.is_finite()).then_some(length + 0.0)
}

fn estimates(reader: &SequenceReader) -> Result<Vec<String>, Error> {
    let mut found: BTreeSet<String> = BTreeSet::new();
    for batch in reader.batches::<TrajectoryPose>()? {
        for row in batch? {
            if !found.contains(&row.estimate) {
                found.insert(row.estimate);
            }
        }
    }
    Ok(found.into_iter().collect())
}

/// Size of the manifest, its description and the files of tables.
fn bytes<'a>(folder: &Path, tables: impl Iterator<Item = &'a str>) -> Result<u64, Error> {
    let names: Vec<String> = tables
        .map(|table| format!("{table}.parquet"))
        .chain([names::MANIFEST_FILE, names::CROISSANT_FILE].map(str::to_owned))
        .collect();
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    let entries = storage::list(folder, &known).map_err(Error::io(folder))?;
    let counted = entries.iter().filter(|entry| known.iter().any(|name| entry.name == *name));
    Ok(counted.map(|entry| if let Found::File(bytes) = entry.found { bytes } else { 0 }).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_as_long_as_its_steps() {
        assert_eq!(path_length(&[]), None);
        assert_eq!(path_length(&[[1.0, 2.0, 3.0]]).map(f64::to_bits), Some(0.0_f64.to_bits()));
        assert_eq!(path_length(&[[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 4.0, 2.0]]), Some(7.0));
        assert_eq!(path_length(&[[-1e308; 3], [1e308; 3]]), None);
    }
}
