//! Damaged and malicious files give an error or other rows: never a panic, a hang or unbounded memory.

mod sample;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use open_structure::format::{self, Error};
use open_structure::structure::{CatalogueEntry, MapPoint};
use open_structure::validate::{Options, validate};
use sample::{Parts, folder_parts, mcap_bytes};

/// No file here is larger than 100 kB, so this much memory is never honestly needed.
const MEMORY_BOUND: u64 = 1 << 30;
/// Longest that any one file of this size may take, in a build without optimisation on a busy machine.
const TIME_BOUND: Duration = Duration::from_secs(20);

/// What came of reading files.
#[derive(Debug, Default)]
struct Tally {
    read: usize,
    refused: usize,
    /// Panics of a decoder that the wall around it turned into errors.
    decoder_panics: BTreeSet<String>,
    slowest: Duration,
}

impl Tally {
    /// Uses everything that a reader offers.
    fn read(&mut self, path: &Path) {
        let start = Instant::now();
        match use_all(path) {
            Ok(()) => self.read += 1,
            Err(error) => {
                self.refused += 1;
                if let Error::Decoder { detail, .. } = &error {
                    self.decoder_panics.insert(detail.clone());
                }
                assert!(!error.to_string().is_empty());
            }
        }
        self.slowest = self.slowest.max(start.elapsed());
        assert!(self.slowest < TIME_BOUND, "{}: {:?}", path.display(), self.slowest);
    }

    fn tell(&self, what: &str) {
        eprintln!("{what}: {self:?}, peak memory {} MiB", peak_memory() >> 20);
        assert!(peak_memory() < MEMORY_BOUND, "{what}: {} bytes", peak_memory());
    }
}

/// Greatest resident memory of this process, bytes; 0 where the system does not say.
fn peak_memory() -> u64 {
    fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|status| {
            let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:").map(str::to_owned))?;
            line.trim().trim_end_matches(" kB").parse::<u64>().ok()
        })
        .unwrap_or(0)
        * 1024
}

/// Every way of reading; an error in one must not keep the others from being tried.
fn use_all(path: &Path) -> Result<(), Error> {
    let reader = format::open(path)?;
    let whole = reader.read_all().map(drop);
    let frames = reader.frames().and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let alone = match reader.frame_list() {
        Ok(list) => {
            let ids: Vec<_> = list.iter().step_by(2).take(3).map(|frame| frame.frame_id).collect();
            ids.into_iter().try_for_each(|id| reader.frame(id).map(drop))
        }
        Err(_) => Ok(()),
    };
    let nearest = reader.frame_at(1_000_000).map(drop);
    let checked = reader.verify_container();
    let _ = (reader.tables(), reader.passed_over(), reader.bytes_read());
    whole.and(frames.map(drop)).and(alone).and(nearest).and(checked)
}

/// Places spread over a file: all of its beginning and end, where the structure is, and every `step` between.
fn places(length: usize, step: usize) -> Vec<usize> {
    const DENSE: usize = 48;
    (0..length).filter(|place| place % step == 0 || *place < DENSE || length - place <= DENSE).collect()
}

#[test]
fn a_truncated_mcap_file_is_refused() {
    let whole = mcap_bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let mut tally = Tally::default();
    for length in places(whole.len(), 61) {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(format::open(&path).is_err(), "{length} of {} bytes open", whole.len());
        tally.read(&path);
    }
    assert_eq!(tally.read, 0);
    tally.tell("truncated MCAP");
}

#[test]
fn bits_of_an_mcap_file_flip() {
    let whole = mcap_bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flipped.mcap");
    let mut tally = Tally::default();
    for place in places(whole.len(), 23) {
        let mut bytes = whole.clone();
        bytes[place] ^= 1 << (place % 8);
        fs::write(&path, &bytes).unwrap();
        tally.read(&path);
    }
    assert_eq!(tally.read, 0, "a checksum covers every byte");
    tally.tell("flipped bits in MCAP");
}

/// Lengths and counts of records, chunks, indexes and the footer are eight or four bytes somewhere.
#[test]
fn numbers_of_an_mcap_file_become_huge() {
    let whole = mcap_bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.mcap");
    let mut tally = Tally::default();
    for (turn, place) in places(whole.len() - 8, 37).into_iter().enumerate() {
        let mut bytes = whole.clone();
        let huge = [u64::MAX, 1 << 60, i64::MAX.cast_unsigned(), 1 << 31][turn % 4];
        bytes[place..place + 8].copy_from_slice(&huge.to_le_bytes());
        fs::write(&path, &bytes).unwrap();
        tally.read(&path);
    }
    tally.tell("huge numbers in MCAP");
}

#[test]
fn an_mcap_chunk_that_claims_to_be_huge_is_refused() {
    let whole = mcap_bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bomb.mcap");
    let mut tally = Tally::default();
    // The sizes of the first chunk, in its own record and in the index.
    let summary = mcap::Summary::read(&whole).unwrap().unwrap();
    let size = summary.chunk_indexes[0].uncompressed_size.to_le_bytes();
    let sizes: Vec<usize> = (0..whole.len() - 8).filter(|place| whole[*place..place + 8] == size).collect();
    assert!(sizes.len() >= 2, "{sizes:?}");
    for claimed in [1 << 27, 1 << 30, 1 << 40, u64::MAX] {
        let mut bytes = whole.clone();
        for place in &sizes {
            bytes[*place..place + 8].copy_from_slice(&u64::to_le_bytes(claimed));
        }
        fs::write(&path, &bytes).unwrap();
        assert!(matches!(format::open(&path), Err(Error::TooLarge { .. })), "{claimed}");
        tally.read(&path);
    }
    tally.tell("huge chunks in MCAP");
}

/// The messages of a file in chunks that are compressed otherwise.
fn recompressed(whole: &[u8], compression: Option<mcap::Compression>) -> Vec<u8> {
    let options = mcap::WriteOptions::new().compression(compression).chunk_size(Some(1 << 12));
    let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
    for message in mcap::MessageStream::new(whole).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn no_row_changes_when_a_bit_of_a_chunk_flips() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flipped.mcap");
    for compression in [Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4), None] {
        let whole = recompressed(&mcap_bytes(), compression);
        fs::write(&path, &whole).unwrap();
        let expected = format::read(&path).unwrap();
        let (mut read, mut refused) = (0, 0);
        for chunk in mcap::Summary::read(&whole).unwrap().unwrap().chunk_indexes {
            let [begin, length] =
                [chunk.chunk_start_offset, chunk.chunk_length].map(|number| usize::try_from(number).unwrap());
            for place in (begin..begin + length).step_by(41) {
                let mut bytes = whole.clone();
                bytes[place] ^= 1 << (place % 8);
                fs::write(&path, &bytes).unwrap();
                match format::read(&path) {
                    // Headers of chunks say again what the index says.
                    Ok(found) => {
                        assert!(found == expected, "{compression:?}, byte {place}");
                        read += 1;
                    }
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 5 * read, "{compression:?}: {read} read, {refused} refused");
    }
}

/// Megabytes of zeros that compress to almost nothing, in a chunk whose sizes are honest.
#[test]
fn an_mcap_chunk_of_zeros_stays_within_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("zeros.mcap");
    let mut writer = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .chunk_size(Some(1 << 30))
        .create(std::io::BufWriter::new(fs::File::create(&path).unwrap()))
        .unwrap();
    let schema = writer.add_schema("x", "", b"").unwrap();
    for topic in ["/sequence", "/point_measurements", "/frames"] {
        let channel = writer.add_channel(schema, topic, "arrow", &std::collections::BTreeMap::new()).unwrap();
        let header =
            mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, &vec![0; 100 << 20]).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    assert!(fs::metadata(&path).unwrap().len() < 100_000);
    let mut tally = Tally::default();
    tally.read(&path);
    assert_eq!(tally.refused, 1);
    tally.tell("zeros in MCAP");
}

/// One table's file is damaged, the others are whole.
fn with_damage(parts: &Parts, mut damage: impl FnMut(&[u8], &mut dyn FnMut(&[u8]))) -> Tally {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in parts {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let mut tally = Tally::default();
    for table in ["point_measurements.parquet", "graph_factors.parquet", "frames.parquet"] {
        let path = folder.path().join(table);
        damage(&parts[table], &mut |bytes| {
            fs::write(&path, bytes).unwrap();
            tally.read(folder.path());
        });
        fs::write(&path, &parts[table]).unwrap();
    }
    tally
}

#[test]
fn a_truncated_parquet_file_is_refused() {
    let tally = with_damage(&folder_parts(), |whole, read| {
        for length in places(whole.len(), 97) {
            read(&whole[..length]);
        }
    });
    assert_eq!(tally.read, 0);
    tally.tell("truncated Parquet");
}

#[test]
fn bits_of_a_parquet_file_flip() {
    let tally = with_damage(&folder_parts(), |whole, read| {
        for place in places(whole.len(), 19) {
            let mut bytes = whole.to_vec();
            bytes[place] ^= 1 << (place % 8);
            read(&bytes);
        }
    });
    assert!(tally.refused > 0);
    tally.tell("flipped bits in Parquet");
}

/// Thrift writes numbers in seven-bit groups: nine bytes of `0xff` and a last one make any of them huge.
#[test]
fn numbers_of_a_parquet_file_become_huge() {
    let tally = with_damage(&folder_parts(), |whole, read| {
        for place in places(whole.len() - 10, 41) {
            let mut bytes = whole.to_vec();
            bytes[place..place + 9].fill(0xff);
            bytes[place + 9] = 0x01;
            read(&bytes);
        }
    });
    assert!(tally.refused > 0);
    tally.tell("huge numbers in Parquet");
}

#[test]
fn a_parquet_footer_that_claims_2_to_the_60_rows_is_refused() {
    let parts = folder_parts();
    let whole = &parts["point_measurements.parquet"];
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in &parts {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    for rows in [1_i64 << 60, i64::MAX, -1, i64::MIN, 1 << 33] {
        let claimed = sample::with_row_count(whole, rows);
        fs::write(folder.path().join("point_measurements.parquet"), claimed).unwrap();
        let error = format::open(folder.path()).err().expect("so many rows are refused");
        assert!(matches!(error, Error::TooLarge { .. } | Error::Container { .. }), "{rows}: {error}");
        let mut tally = Tally::default();
        tally.read(folder.path());
        tally.tell("Parquet with many rows");
    }
}

/// A dictionary of one long value, to which run lengths of a few bytes refer again and again.
#[test]
fn a_parquet_dictionary_bomb_stays_within_bounds() {
    let parts = folder_parts();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sequence.json"), &parts["sequence.json"]).unwrap();
    let bomb = sample::dictionary_bomb();
    assert!(bomb.len() < 200_000, "{} bytes", bomb.len());
    fs::write(folder.path().join("map_points.parquet"), bomb).unwrap();
    let reader = format::open(folder.path()).unwrap();
    let error = reader.table::<MapPoint>().expect_err("so much is refused");
    assert!(matches!(error, Error::TooLarge { .. }), "{error}");
    Tally::default().tell("dictionary bomb");
}

/// The catalogue of a collection is read, and held against what is there, whatever it says.
#[test]
fn bits_and_numbers_of_a_catalogue_change() {
    let folder = tempfile::tempdir().unwrap();
    let rows: Vec<CatalogueEntry> = (0..40)
        .map(|number| CatalogueEntry {
            sequence: format!("sequence {number:02}"),
            licence: (number % 3 == 0).then(|| "CC0-1.0".to_owned()),
            path_length: Some(f64::from(number) / 3.0),
            tables: vec!["frames".to_owned(); number as usize % 5],
            ..CatalogueEntry::default()
        })
        .collect();
    format::write_catalogue(folder.path(), &rows, false).unwrap();
    let path = folder.path().join("catalogue.parquet");
    let whole = fs::read(&path).unwrap();
    let (mut read, mut refused) = (0, 0);
    let mut look = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        match format::read_catalogue(folder.path()) {
            Ok(_) => read += 1,
            Err(_) => refused += 1,
        }
        let report = validate(folder.path(), &Options::default()).unwrap();
        assert!(!report.conformant, "none of its sequences is there");
    };
    for place in places(whole.len() - 10, 67) {
        look(&whole[..place]);
        let mut bytes = whole.clone();
        bytes[place] ^= 1 << (place % 8);
        look(&bytes);
        bytes[place..place + 9].fill(0xff);
        bytes[place + 9] = 0x01;
        look(&bytes);
    }
    assert!(read > 0 && refused > read, "{read} read, {refused} refused");
    assert!(peak_memory() < MEMORY_BOUND);
}

#[test]
fn other_files_and_folders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut tally = Tally::default();
    let cases: [(&str, &[u8]); 6] = [
        ("empty.mcap", b""),
        ("magic.mcap", b"\x89MCAP0\r\n"),
        ("twice.mcap", b"\x89MCAP0\r\n\x89MCAP0\r\n"),
        ("text.mcap", b"frame_id,point_id,u,v\n"),
        ("zip.mcap", b"PK\x03\x04"),
        ("parquet.mcap", b"PAR1PAR1"),
    ];
    for (name, bytes) in cases {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        tally.read(&path);
    }
    for (name, manifest) in [
        ("none", None),
        ("empty", Some("")),
        ("deep", Some("[".repeat(100_000).leak() as &str)),
        ("other", Some("{\"spec_version\": 1}")),
        ("null", Some("null")),
    ] {
        let path = folder.path().join(name);
        fs::create_dir(&path).unwrap();
        if let Some(manifest) = manifest {
            fs::write(path.join("sequence.json"), manifest).unwrap();
        }
        tally.read(&path);
    }
    tally.read(&folder.path().join("absent"));
    assert_eq!(tally.read, 0);
    tally.tell("other files");
}
