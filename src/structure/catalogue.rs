//! What a collection says of each of its sequences.

use super::record::record;

record! {
    /// One sequence of a collection: what its manifest says of it, and what is in it.
    pub struct CatalogueEntry in catalogue (Whole, Required, key: [sequence], of: collection) {
        /// Name of the sequence, as in its manifest; its folder is `sequence=NAME`.
        ["1", "-"]
        sequence: String,
        /// Version of the specification that the sequence follows.
        ["1", "-"]
        spec_version: String,
        /// SHA-256 of the bytes of `sequence.json`, which holds the digest of every table.
        ["1", "-"]
        manifest_sha256: String,
        /// What the sequence shows, for people.
        ["1", "-"]
        description: Option<String>,
        /// Dataset from which the sequence was made.
        ["1", "-"]
        dataset: String,
        /// Name of the sequence within that dataset.
        ["1", "-"]
        dataset_sequence: Option<String>,
        /// Licence of the source data.
        ["1", "-"]
        licence: Option<String>,
        /// Tool that made the sequence.
        ["1", "-"]
        generator: String,
        /// Where the time stamps come from: `recorded` or `synthetic`.
        ["1", "-"]
        clock: String,
        /// Noise model of the measurements, where it is declared.
        ["1", "-"]
        noise: Option<String>,
        /// Cameras of the manifest.
        ["1", "-"]
        cameras: i64,
        /// Frames.
        ["1", "-"]
        frames: i64,
        /// Frames with a true pose.
        ["1", "-"]
        frames_with_truth: i64,
        /// Stamp of the first frame; absent without frames.
        ["ns", "-"]
        first_stamp_nanos: Option<i64>,
        /// Stamp of the last frame; absent without frames.
        ["ns", "-"]
        last_stamp_nanos: Option<i64>,
        /// Length of the path of true camera centres, the sum of the distances from each frame with a true pose to the next; absent where none has one.
        ["m", "world"]
        path_length: Option<f64>,
        /// Least x of the true camera centres.
        ["m", "world"]
        min_x: Option<f64>,
        /// Least y of the true camera centres.
        ["m", "world"]
        min_y: Option<f64>,
        /// Least z of the true camera centres.
        ["m", "world"]
        min_z: Option<f64>,
        /// Greatest x of the true camera centres.
        ["m", "world"]
        max_x: Option<f64>,
        /// Greatest y of the true camera centres.
        ["m", "world"]
        max_y: Option<f64>,
        /// Greatest z of the true camera centres.
        ["m", "world"]
        max_z: Option<f64>,
        /// Rows of `point_landmarks`.
        ["1", "-"]
        points: i64,
        /// Rows of `line_landmarks`.
        ["1", "-"]
        lines: i64,
        /// Rows of `structural_groups`.
        ["1", "-"]
        groups: i64,
        /// Rows of `point_observations`.
        ["1", "-"]
        point_observations: i64,
        /// Rows of `line_observations`.
        ["1", "-"]
        line_observations: i64,
        /// Rows of `point_measurements`.
        ["1", "-"]
        point_measurements: i64,
        /// Rows of `line_measurements`.
        ["1", "-"]
        line_measurements: i64,
        /// Rows of all tables of this specification.
        ["1", "-"]
        total_rows: i64,
        /// Tables of this specification that are there, in its order.
        ["1", "-"]
        tables: Vec<String>,
        /// Estimates with a trajectory, by name.
        ["1", "-"]
        estimates: Vec<String>,
        /// Size of the sequence's files: `sequence.json`, `croissant.json` where it is there, and those of the tables.
        ["B", "-"]
        bytes: i64,
    }
}
