use std::fs;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use proptest::prelude::*;
use tempfile::TempDir;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use super::*;

/// An entry of a tar archive as it stands on the disk: `kind` is the letter of its type.
fn tar_entry(name: &str, kind: u8, content: &[u8], link: &str) -> Vec<u8> {
    let mut header = [0; 512];
    header[..name.len()].copy_from_slice(name.as_bytes());
    header[100..108].copy_from_slice(b"0000644\0");
    header[124..136].copy_from_slice(format!("{:011o}\0", content.len()).as_bytes());
    header[136..148].copy_from_slice(b"00000000000\0");
    header[156] = kind;
    header[157..157 + link.len()].copy_from_slice(link.as_bytes());
    header[257..265].copy_from_slice(b"ustar\x0000");
    header[148..156].copy_from_slice(b"        ");
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    let mut bytes = header.to_vec();
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(512), 0);
    bytes
}

fn file(name: &str, content: &[u8]) -> Vec<u8> {
    tar_entry(name, b'0', content, "")
}

fn tar(entries: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = entries.concat();
    bytes.resize(bytes.len() + 1024, 0);
    bytes
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zip(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in entries {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
        writer.start_file(*name, options).unwrap();
        writer.write_all(content).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

/// A folder with an archive in it, and where to unpack that to.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new(bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        // The name says nothing.
        fs::write(folder.path().join("archive.bin"), bytes).unwrap();
        Self { folder }
    }

    fn archive(&self) -> PathBuf {
        self.folder.path().join("archive.bin")
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn unpack_within(&self, limits: &Limits) -> Result<Unpacked, Error> {
        unpack(&self.archive(), &self.out(), limits, &|_, _| {})
    }

    /// Unpacks what must not be: nothing may be left of it, here or elsewhere.
    #[track_caller]
    fn refused_within(&self, limits: &Limits) -> Error {
        let error = self.unpack_within(limits).unwrap_err();
        let left: Vec<_> =
            fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["archive.bin"], "{error}");
        assert!(error.to_string().contains("archive.bin"), "{error}");
        error
    }
}

#[track_caller]
fn refused(bytes: &[u8]) -> Error {
    Place::new(bytes).refused_within(&Limits::default())
}

/// Every file below a folder, with its content.
fn files_of(folder: &Path) -> Vec<(String, Vec<u8>)> {
    fn walk(root: &Path, folder: &Path, found: &mut Vec<(String, Vec<u8>)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(root, &path, found);
            } else {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                found.push((name, fs::read(&path).unwrap()));
            }
        }
    }
    let mut found = Vec::new();
    walk(folder, folder, &mut found);
    found.sort();
    found
}

const NOISE: &[u8] = &[7, 1, 250, 3, 0, 0, 9];

/// One set of files in every kind of archive.
fn good() -> Vec<(Kind, Vec<u8>)> {
    let folders = [tar_entry("./", b'5', b"", ""), tar_entry("./rgb/", b'5', b"", "")];
    let entries = [file("./rgb/1.png", NOISE), file("rgb.txt", b"# colour\n"), file("empty", b"")];
    let tar = tar(&[folders.as_slice(), &entries].concat());
    let zip = zip(&[("rgb/1.png", NOISE), ("rgb.txt", b"# colour\n"), ("empty", b"")]);
    vec![(Kind::TarGz, gzip(&tar)), (Kind::Tar, tar), (Kind::Zip, zip)]
}

#[test]
fn every_kind_unpacks_to_the_same_files_whatever_it_is_called() {
    for (kind, bytes) in good() {
        let place = Place::new(&bytes);
        assert_eq!(Kind::of(&place.archive()).unwrap(), kind);
        let told = std::cell::Cell::new((0, 0));
        let unpacked = unpack(&place.archive(), &place.out(), &Limits::default(), &|done, all| {
            assert!(told.get().0 <= done && done <= all);
            told.set((done, all));
        });
        assert_eq!(unpacked.unwrap(), Unpacked { files: 3, bytes: 16, left_out: 0 });
        assert_eq!(told.get().1, bytes.len() as u64);
        let found = files_of(&place.out());
        let expected = [("empty", &b""[..]), ("rgb.txt", b"# colour\n"), ("rgb/1.png", NOISE)];
        assert_eq!(found, expected.map(|(name, content)| (name.to_owned(), content.to_vec())), "{kind:?}");
    }
}

#[test]
fn what_stands_there_is_not_touched() {
    let place = Place::new(&good()[0].1);
    fs::create_dir(place.out()).unwrap();
    fs::write(place.out().join("mine"), "x").unwrap();
    assert!(matches!(place.unpack_within(&Limits::default()), Err(Error::Exists { .. })));
    assert_eq!(files_of(&place.out()).len(), 1);
}

#[test]
fn a_part_comes_with_its_folders_and_beside_what_is_there() {
    let bytes = zip(&[("sea/P000/1.png", b"1"), ("sea/P000x/3.png", b"3"), ("sea/P001/2.png", b"2")]);
    let place = Place::new(&bytes);
    fs::create_dir(place.out()).unwrap();
    let part = |folder: &str| {
        let selection = Selection::Below(folder.into());
        extract(&place.archive(), &place.out(), &selection, &Limits::default(), &|_, _| {})
    };
    part("sea/P000").unwrap();
    part("sea/P001").unwrap();
    let names: Vec<_> = files_of(&place.out()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["sea/P000/1.png", "sea/P001/2.png"]);
    assert!(matches!(part("sea/P000"), Err(Error::Twice { .. })));
    let Err(Error::Nothing { expected, entries: 3, .. }) = part("sea/P002") else { panic!() };
    assert_eq!(expected, "files in sea/P002");
}

#[test]
fn names_that_lead_elsewhere_are_refused() {
    for name in ["../x", "a/../../x", "/x", "a/b/../c", "..", "a\\..\\x", "a\u{7}b"] {
        let archives = [tar(&[file(name, b"x")]), gzip(&tar(&[file(name, b"x")])), zip(&[(name, b"x")])];
        for bytes in archives {
            let error = refused(&bytes);
            assert!(matches!(error, Error::Name { .. }), "{name}: {error}");
        }
    }
}

#[test]
fn a_name_is_refused_by_each_way_in_which_a_tar_archive_can_say_it() {
    let pax = |record: &str| {
        // The length counts itself, of two digits.
        let length = record.len() + 4;
        assert!((10..100).contains(&length));
        tar_entry("pax", b'x', format!("{length} {record}\n").as_bytes(), "")
    };
    for long in [tar_entry("././@LongLink", b'L', b"../../x\0", ""), pax("path=../../x")] {
        let error = refused(&tar(&[long, file("good", b"x")]));
        assert!(matches!(error, Error::Name { .. }), "{error}");
    }
    // And a good one is taken.
    let place = Place::new(&tar(&[pax("path=other/x"), file("good", b"x")]));
    place.unwrap_files(&["other/x"]);
    let long = "d/".repeat(80) + "x";
    let entry = tar_entry("././@LongLink", b'L', format!("{long}\0").as_bytes(), "");
    Place::new(&tar(&[entry, file("good", b"x")])).unwrap_files(&[&long]);
    // What would make the next entry end elsewhere is not.
    for record in ["size=0000003", "GNU.sparse.realsize=999999999999"] {
        let error = refused(&tar(&[pax(record), file("good", b"x")]));
        assert!(matches!(error, Error::Damaged { .. }), "{error}");
    }
}

impl Place {
    #[track_caller]
    fn unwrap_files(&self, names: &[&str]) {
        self.unpack_within(&Limits::default()).unwrap();
        let found = files_of(&self.out());
        assert_eq!(found.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
    }
}

#[test]
fn links_and_devices_are_left_out_and_nothing_is_written_through_them() {
    let elsewhere = tempfile::tempdir().unwrap();
    let target = elsewhere.path().to_str().unwrap();
    let entries = [
        tar_entry("link", b'2', b"", target),
        tar_entry("hard", b'1', b"", "/etc/passwd"),
        tar_entry("pipe", b'6', b"", ""),
        tar_entry("device", b'3', b"", ""),
        file("link/x", b"inside"),
    ];
    let place = Place::new(&tar(&entries));
    let unpacked = place.unpack_within(&Limits::default()).unwrap();
    assert_eq!(unpacked, Unpacked { files: 1, bytes: 6, left_out: 4 });
    assert_eq!(files_of(&place.out()), [("link/x".to_owned(), b"inside".to_vec())]);
    assert!(files_of(elsewhere.path()).is_empty());

    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    writer.add_symlink("link", target, SimpleFileOptions::default()).unwrap();
    writer.start_file("link/x", SimpleFileOptions::default()).unwrap();
    writer.write_all(b"inside").unwrap();
    let place = Place::new(&writer.finish().unwrap().into_inner());
    assert_eq!(place.unpack_within(&Limits::default()).unwrap().left_out, 1);
    assert_eq!(files_of(&place.out()), [("link/x".to_owned(), b"inside".to_vec())]);
    assert!(files_of(elsewhere.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn a_link_that_stands_in_the_folder_is_not_followed() {
    let elsewhere = tempfile::tempdir().unwrap();
    let place = Place::new(&tar(&[file("link/x", b"x")]));
    fs::create_dir(place.out()).unwrap();
    std::os::unix::fs::symlink(elsewhere.path(), place.out().join("link")).unwrap();
    let error =
        extract(&place.archive(), &place.out(), &Selection::Everything, &Limits::default(), &|_, _| {});
    assert!(matches!(error, Err(Error::Twice { .. })));
    assert!(files_of(elsewhere.path()).is_empty());
}

#[test]
fn one_name_for_two_things_is_refused() {
    let twice = [
        tar(&[file("a", b"1"), file("./a", b"2")]),
        tar(&[file("a", b"1"), file("a/b", b"2")]),
        tar(&[file("a/b", b"1"), file("a", b"2")]),
        zip(&[("a/b", b"1"), ("./a//b", b"2")]),
    ];
    for bytes in twice {
        let error = refused(&bytes);
        assert!(matches!(error, Error::Twice { .. }), "{error}");
    }
    // The writer of the library makes no such archive; the second name is changed by hand.
    let mut bytes = zip(&[("aa", b"1"), ("ab", b"2")]);
    for at in 0..bytes.len() - 1 {
        if &bytes[at..at + 2] == b"ab" {
            bytes[at + 1] = b'a';
        }
    }
    let error = refused(&bytes);
    assert!(matches!(error, Error::Twice { .. } | Error::Damaged { .. }), "{error}");
}

#[test]
fn a_small_archive_does_not_become_a_large_folder() {
    let zeros = vec![0; 64 << 20];
    for bytes in [gzip(&tar(&[file("zeros", &zeros)])), zip(&[("zeros", &zeros)])] {
        assert!(bytes.len() < 100_000, "{}", bytes.len());
        let error = refused(&bytes);
        assert!(matches!(error, Error::TooMuch { what: "bytes", .. }), "{error}");
    }
    // Skipped entries cost time: they are counted too.
    let skipped = gzip(&tar(&[tar_entry("skipped", b'2', &zeros, "x"), file("x", b"x")]));
    assert!(matches!(refused(&skipped), Error::TooMuch { what: "bytes", .. }));
    // So is what a header pretends to be about.
    let long = gzip(&tar(&[tar_entry("long", b'L', &zeros, ""), file("x", b"x")]));
    let error = refused(&long);
    assert!(error.to_string().contains("64 KiB"), "{error}");
}

#[test]
fn each_limit_holds_to_the_last() {
    for (kind, bytes) in good() {
        let place = Place::new(&bytes);
        // A tar archive is counted with its headers.
        let whole = if kind == Kind::Zip { 16 } else { 5 * 512 + 2 * 512 + 1024 };
        let (entries, name_bytes) = if kind == Kind::Zip { (3, 9) } else { (5, 11) };
        let exact = Limits { bytes: whole, entries, name_bytes, ratio: u64::MAX };
        for limits in [
            Limits { bytes: whole - 1, ..exact },
            Limits { entries: entries - 1, ..exact },
            Limits { name_bytes: name_bytes - 1, ..exact },
        ] {
            let error = place.refused_within(&limits);
            assert!(matches!(error, Error::TooMuch { .. } | Error::Name { .. }), "{kind:?}: {error}");
        }
        assert_eq!(place.unpack_within(&exact).unwrap().files, 3, "{kind:?}");
    }
}

#[test]
fn an_archive_that_is_cut_short_leaves_nothing() {
    let content: Vec<u8> =
        (0..3000_u32).map(|number| (number.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let tar = tar(&[file("a", &content), file("b", &content)]);
    for bytes in [gzip(&tar), zip(&[("a", &content), ("b", &content)])] {
        for length in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
            refused(&bytes[..length]);
        }
    }
    // One of the two blocks of zeros at its end is enough.
    for length in (0..=tar.len() - 1024).step_by(512).chain([tar.len() - 1024 + 511]) {
        refused(&tar[..length]);
    }
    // The sum at the end of gzip is looked at.
    let mut bytes = gzip(&tar);
    let end = bytes.len() - 6;
    bytes[end] ^= 1;
    let error = refused(&bytes);
    assert!(matches!(error, Error::Damaged { .. }), "{error}");
}

#[test]
fn what_is_no_archive_is_called_by_its_name() {
    for (bytes, found) in [
        (&b""[..], "an empty file"),
        (b"  <!DOCTYPE html><html><body>Sign in", "an HTML page"),
        (b"BZh91AY&SY", "bzip2"),
        (b"version https://git-lfs.github.com/spec/v1\n", "a Git LFS pointer"),
        (b"404: Not Found", "a text"),
        (b"\xff\x00\x01", "other bytes"),
    ] {
        let Error::Kind { found: told, .. } = refused(bytes) else { panic!("{found}") };
        assert_eq!(told, found);
    }
    let error = refused(&gzip(b"not a tar archive"));
    assert!(matches!(error, Error::Damaged { .. }), "{error}");
    assert!(matches!(refused(&tar(&[tar_entry("d", b'5', b"", "")])), Error::Nothing { entries: 1, .. }));
}

#[test]
fn an_unknown_method_and_encryption_are_named() {
    // Method and flags stand in the local header and in the directory.
    let patched = |at_local: usize, at_directory: usize, value: u8| {
        let mut bytes = zip(&[("a", b"content")]);
        let directory = bytes.windows(4).position(|window| window == b"PK\x01\x02").unwrap();
        bytes[at_local] = value;
        bytes[directory + at_directory] = value;
        refused(&bytes)
    };
    let Error::Method { name, .. } = patched(8, 10, 12) else { panic!() };
    assert_eq!(name, "a");
    let Error::Method { found, .. } = patched(6, 8, 1) else { panic!() };
    assert_eq!(found, "an encrypted one");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever stands in an archive, nothing but the new folder changes, and there is no panic.
    #[test]
    fn changed_bytes_are_an_error_or_other_files(
        which in 0_usize..3,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = good()[which].1.clone();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let place = Place::new(&bytes);
        match place.unpack_within(&Limits::default()) {
            Ok(unpacked) => prop_assert_eq!(unpacked.files, files_of(&place.out()).len() as u64),
            Err(_) => prop_assert_eq!(fs::read_dir(place.folder.path()).unwrap().count(), 1),
        }
    }
}
