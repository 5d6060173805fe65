//! Sequences of any content: every table, every column, every number that a column can hold.

use std::convert::Infallible;

use open_structure::structure::*;
use proptest::prelude::*;

/// Draws values, odd ones as often as usual ones: splitmix64.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[(self.next() % values.len() as u64) as usize]
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    pub(crate) fn float(&mut self) -> f64 {
        const ODD: &[f64] = &[
            0.0,
            -0.0,
            5e-324,
            -5e-324,
            2.225_073_858_507_201e-308,
            f64::MIN_POSITIVE,
            f64::MAX,
            f64::MIN,
            f64::EPSILON,
            0.1,
            1.0 / 3.0,
            1e22,
            9_007_199_254_740_993.0,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        match self.below(4) {
            0 => self.pick(ODD),
            1 => f64::from_bits(self.next()),
            2 => (self.below(6_400_000) as f64) / 1e4,
            _ => (self.below(1 << 53) as f64) * 1e-13,
        }
    }

    fn integer(&mut self) -> i64 {
        match self.below(4) {
            0 => self.pick(&[0, 1, -1, i64::MAX, i64::MAX - 1, i64::MIN, 1 << 53, -(1 << 53) - 1]),
            1 => self.next().cast_signed(),
            _ => self.below(40).cast_signed(),
        }
    }

    fn text(&mut self) -> String {
        let short = ["", "a", "b", "Größe", "日本語", "🦀", "e\u{301}", "nul\0nul", "two\nlines", "\"'\\,"];
        match self.below(8) {
            0 => "long ".repeat(200),
            _ => self.pick(&short).to_owned(),
        }
    }
}

/// The values of one column, as [`ColumnSource`] lends them.
#[derive(Default)]
struct Column {
    integers: Vec<i64>,
    floats: Vec<f64>,
    bytes: Vec<u8>,
    offsets: Vec<i32>,
    /// Where each text of a list of them ends in `bytes`, from 0.
    texts: Vec<i32>,
    /// One bit a row, the first row at bit `BIT_OFFSET`.
    bits: Vec<u8>,
}

const BIT_OFFSET: usize = 3;

impl Column {
    fn new(kind: ColumnType, rows: usize, random: &mut Random) -> Self {
        let mut column = Self { offsets: vec![0], texts: vec![0], ..Self::default() };
        column.bits = (0..(rows + BIT_OFFSET).div_ceil(8)).map(|_| random.next() as u8).collect();
        for _ in 0..rows {
            let length = random.below(5);
            match kind {
                ColumnType::Int64 => column.integers.push(random.integer()),
                ColumnType::Float64 => column.floats.push(random.float()),
                ColumnType::Boolean => {}
                ColumnType::Utf8 => column.bytes.extend_from_slice(random.text().as_bytes()),
                ColumnType::Binary => column.bytes.extend((0..length).map(|_| random.next() as u8)),
                ColumnType::Int64List => column.integers.extend((0..length).map(|_| random.integer())),
                ColumnType::Float64List => column.floats.extend((0..length).map(|_| random.float())),
                ColumnType::Utf8List => {
                    for _ in 0..length {
                        column.bytes.extend_from_slice(random.text().as_bytes());
                        column.texts.push(i32::try_from(column.bytes.len()).unwrap());
                    }
                }
            }
            let end = match kind {
                ColumnType::Int64List => column.integers.len(),
                ColumnType::Float64List => column.floats.len(),
                ColumnType::Utf8List => column.texts.len() - 1,
                _ => column.bytes.len(),
            };
            column.offsets.push(i32::try_from(end).unwrap());
        }
        column
    }

    fn validity(&self) -> Bitmap<'_> {
        Bitmap { bytes: &self.bits, offset: BIT_OFFSET }
    }

    fn lists<'a, T>(&'a self, values: &'a [T], nullable: bool) -> Lists<'a, T> {
        Lists { offsets: &self.offsets, values, validity: nullable.then(|| self.validity()) }
    }
}

/// Rows of a table that were never in a file.
struct Columns {
    columns: Vec<Column>,
    rows: usize,
}

impl ColumnSource for Columns {
    type Error = Infallible;

    fn len(&self) -> usize {
        self.rows
    }
    fn int64(&self, field: usize) -> Result<&[i64], Infallible> {
        Ok(&self.columns[field].integers)
    }
    fn optional_int64(&self, field: usize) -> Result<Nullable<'_, i64>, Infallible> {
        let column = &self.columns[field];
        Ok(Nullable { values: &column.integers, validity: Some(column.validity()) })
    }
    fn float64(&self, field: usize) -> Result<&[f64], Infallible> {
        Ok(&self.columns[field].floats)
    }
    fn optional_float64(&self, field: usize) -> Result<Nullable<'_, f64>, Infallible> {
        let column = &self.columns[field];
        Ok(Nullable { values: &column.floats, validity: Some(column.validity()) })
    }
    fn boolean(&self, field: usize) -> Result<Bitmap<'_>, Infallible> {
        Ok(self.columns[field].validity())
    }
    fn utf8(&self, field: usize) -> Result<Lists<'_, u8>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].bytes, false))
    }
    fn optional_utf8(&self, field: usize) -> Result<Lists<'_, u8>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].bytes, true))
    }
    fn utf8_list(&self, field: usize) -> Result<TextLists<'_>, Infallible> {
        let Column { offsets, texts, bytes, .. } = &self.columns[field];
        Ok(TextLists { offsets, texts: Lists { offsets: texts, values: bytes, validity: None } })
    }
    fn optional_binary(&self, field: usize) -> Result<Lists<'_, u8>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].bytes, true))
    }
    fn int64_list(&self, field: usize) -> Result<Lists<'_, i64>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].integers, false))
    }
    fn float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].floats, false))
    }
    fn optional_float64_list(&self, field: usize) -> Result<Lists<'_, f64>, Infallible> {
        Ok(self.columns[field].lists(&self.columns[field].floats, true))
    }
}

/// Some rows, sorted, each key once.
fn table<R: Record>(rows: usize, random: &mut Random, change: impl Fn(&mut R, &mut Random)) -> Vec<R> {
    let columns = R::TABLE.fields.iter().map(|field| Column::new(field.kind, rows, random)).collect();
    let mut made = Vec::new();
    let Ok(()) = R::take(&Columns { columns, rows }, &mut made);
    made.iter_mut().for_each(|row| change(row, random));
    made.sort_by(R::compare_key);
    made.dedup_by(|left, right| left.compare_key(right).is_eq());
    made
}

/// A sequence with so many rows in each table, in the order of [`TABLES`]; fewer where keys would repeat.
fn sequence(seed: u64, rows: &[usize]) -> Sequence {
    let mut random = Random::new(seed);
    let mut sequence = Sequence::default();
    let mut sizes = rows.iter().copied();
    sequence.frames = table(sizes.next().unwrap_or(0), &mut random, |_, _| {});
    // Stamps never fall; several frames may share one.
    let mut stamps: Vec<i64> =
        sequence.frames.iter().map(|_| (random.integer() >> random.below(60)).max(0)).collect();
    stamps.sort_unstable();
    for (frame, stamp) in sequence.frames.iter_mut().zip(stamps) {
        frame.stamp_nanos = stamp;
    }
    let frames: Vec<FrameId> = sequence.frames.iter().map(|frame| frame.frame_id).collect();
    macro_rules! whole {
        ($($name:ident),+) => {
            $(sequence.$name = table(sizes.next().unwrap_or(0), &mut random, |_, _| {});)+
        };
    }
    macro_rules! per_frame {
        ($($name:ident: $row:ident),+) => {
            $(
                let rows = sizes.next().unwrap_or(0);
                if !frames.is_empty() {
                    sequence.$name = table(rows, &mut random, |row: &mut $row, random| row.frame_id = random.pick(&frames));
                }
            )+
        };
    }
    whole!(
        trajectories,
        point_landmarks,
        line_landmarks,
        structural_groups,
        map_points,
        map_lines,
        tracking,
        iterations,
        point_correspondences,
        line_correspondences,
        graph_poses,
        graph_points,
        graph_lines,
        graph_factors,
        frame_statistics
    );
    per_frame!(
        point_observations: PointObservation,
        line_observations: LineObservation,
        point_measurements: PointMeasurement,
        line_measurements: LineMeasurement
    );
    sequence.manifest.name = random.text();
    sequence.manifest.description = Some(random.text());
    sequence.manifest.clock.rate_hz = Some(random.float()).filter(|rate| rate.is_finite());
    sequence
}

/// Any sequence; shrinks by leaving out rows, table by table.
pub(crate) fn sequences() -> impl Strategy<Value = Sequence> {
    (any::<u64>(), proptest::collection::vec(0_usize..40, TABLES.len()))
        .prop_map(|(seed, rows)| sequence(seed, &rows))
}

/// Any catalogue.
pub(crate) fn catalogues() -> impl Strategy<Value = Vec<CatalogueEntry>> {
    (any::<u64>(), 0_usize..40).prop_map(|(seed, rows)| table(rows, &mut Random::new(seed), |_, _| {}))
}

/// The canonical bytes of some rows.
pub(crate) fn bytes_of_rows<R: Record>(rows: &[R]) -> Vec<Vec<u8>> {
    let bytes = |row: &R| {
        let mut bytes = Vec::new();
        row.digest(&mut bytes);
        bytes
    };
    rows.iter().map(bytes).collect()
}

/// The canonical bytes of every row of every table: equal where every bit is, `NaN` and `-0.0` included.
pub(crate) fn bytes_of(sequence: &Sequence) -> Vec<(&'static str, Vec<Vec<u8>>)> {
    fn rows<R: Record>(sequence: &Sequence) -> (&'static str, Vec<Vec<u8>>) {
        (R::TABLE.name, bytes_of_rows(R::rows(sequence)))
    }
    vec![
        rows::<Frame>(sequence),
        rows::<TrajectoryPose>(sequence),
        rows::<PointLandmark>(sequence),
        rows::<LineLandmark>(sequence),
        rows::<StructuralGroup>(sequence),
        rows::<MapPoint>(sequence),
        rows::<MapLine>(sequence),
        rows::<TrackedFrame>(sequence),
        rows::<Iteration>(sequence),
        rows::<PointCorrespondence>(sequence),
        rows::<LineCorrespondence>(sequence),
        rows::<GraphPose>(sequence),
        rows::<GraphPoint>(sequence),
        rows::<GraphLine>(sequence),
        rows::<GraphFactor>(sequence),
        rows::<FrameStatistics>(sequence),
        rows::<PointObservation>(sequence),
        rows::<LineObservation>(sequence),
        rows::<PointMeasurement>(sequence),
        rows::<LineMeasurement>(sequence),
    ]
}
