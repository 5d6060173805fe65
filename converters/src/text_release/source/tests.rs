use super::*;
use proptest::prelude::*;
use std::io::Write;
use zip::write::{SimpleFileOptions, ZipWriter};

fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in files {
        writer.start_file(*name, options).unwrap();
        writer.write_all(bytes).unwrap();
    }
    writer.finish().unwrap().into_inner()
}

fn open(bytes: Vec<u8>, limits: &Limits) -> Result<Source, Error> {
    Source::from_archive_bytes(bytes, "a.zip", limits)
}

fn limits() -> Limits {
    Limits { file_bytes: 1000, sequence_bytes: 1500, entries: 5 }
}

/// Sets a field in the central and in the local header of every entry.
fn patch(mut bytes: Vec<u8>, in_central: usize, in_local: usize, value: u16) -> Vec<u8> {
    for (mark, offset) in [(b"PK\x01\x02", in_central), (b"PK\x03\x04", in_local)] {
        let places: Vec<_> =
            bytes.windows(4).enumerate().filter(|(_, w)| w == mark).map(|(at, _)| at).collect();
        assert!(!places.is_empty());
        for at in places {
            bytes[at + offset..at + offset + 2].copy_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

#[test]
fn files_are_listed_by_folder_and_read() {
    let bytes = archive(&[("observation/b.txt", b"2"), ("./a.txt", b"1"), ("observation\\c.txt", b"3")]);
    let mut source = open(bytes, &limits()).unwrap();
    let files = source.files().to_vec();
    let names: Vec<_> = files.iter().map(|file| (file.folder.as_str(), file.name.as_str())).collect();
    assert_eq!(names, [("", "a.txt"), ("observation", "b.txt"), ("observation", "c.txt")]);
    assert_eq!(source.told(&files[1]), "a.zip/observation/b.txt");
    let mut budget = Budget::new(limits());
    let read: Vec<_> = files.iter().map(|file| source.read(file, &mut budget).unwrap()).collect();
    assert_eq!(read, [b"1", b"2", b"3"]);
}

#[test]
fn names_that_climb_out_are_told_and_not_read() {
    let names = ["../evil.txt", "/etc/evil.txt", "a/../../evil.txt", "C:\\evil.txt", "good.txt"];
    let files: Vec<(&str, &[u8])> = names.iter().map(|name| (*name, b"x".as_slice())).collect();
    let source = open(archive(&files), &limits()).unwrap();
    let left: Vec<_> = source.files().iter().map(|file| file.name.as_str()).collect();
    assert_eq!(left, ["good.txt"]);
    assert_eq!(source.skipped().count_of("unsafe-name"), 4);
}

#[test]
fn a_bomb_stops_at_the_limit_whatever_sizes_it_declares() {
    let bomb = archive(&[("association.txt", &vec![b'0'; 1_000_000])]);
    assert!(bomb.len() < 5000);
    // Once as it is, once with a central directory that declares one byte.
    let mut lying = bomb.clone();
    let central = lying.windows(4).position(|window| window == b"PK\x01\x02").unwrap();
    lying[central + 24..central + 28].copy_from_slice(&1_u32.to_le_bytes());
    for bytes in [bomb, lying] {
        let mut source = open(bytes, &limits()).unwrap();
        let file = source.files()[0].clone();
        let error = source.read(&file, &mut Budget::new(limits())).unwrap_err();
        let over = matches!(error, Error::FileTooLarge { limit: 1000, .. });
        assert!(over || matches!(error, Error::Damaged { .. }), "{error}");
    }
}

#[test]
fn many_middling_files_stop_at_the_limit_of_the_sequence() {
    let bytes = archive(&[("a.txt", &[b'0'; 800]), ("b.txt", &[b'0'; 800])]);
    let mut source = open(bytes, &limits()).unwrap();
    let files = source.files().to_vec();
    let mut budget = Budget::new(limits());
    assert_eq!(source.read(&files[0], &mut budget).unwrap().len(), 800);
    let error = source.read(&files[1], &mut budget).unwrap_err();
    assert!(matches!(error, Error::SequenceTooLarge { limit: 1500, .. }), "{error}");
    assert_eq!(
        error.to_string(),
        "a.zip/b.txt: expected at most 1500 bytes in all files of the sequence, found more"
    );
}

#[test]
fn a_file_of_just_the_limit_is_read() {
    let mut source = open(archive(&[("a.txt", &[b'0'; 1000])]), &limits()).unwrap();
    let file = source.files()[0].clone();
    assert_eq!(source.read(&file, &mut Budget::new(limits())).unwrap().len(), 1000);
}

#[test]
fn too_many_entries_are_refused() {
    let names: Vec<_> = (0..6).map(|index| format!("{index}.txt")).collect();
    let files: Vec<(&str, &[u8])> = names.iter().map(|name| (name.as_str(), b"".as_slice())).collect();
    let error = open(archive(&files), &limits()).unwrap_err();
    assert!(matches!(error, Error::TooManyEntries { limit: 5, found: 6, .. }), "{error}");

    let folder = tempfile::tempdir().unwrap();
    for name in &names {
        fs::write(folder.path().join(name), "").unwrap();
    }
    let error = Source::open(&Container::Folder(folder.path().into()), "", &limits()).unwrap_err();
    assert!(matches!(error, Error::TooManyEntries { limit: 5, .. }), "{error}");
}

#[test]
fn what_needs_a_password_or_another_method_is_refused_by_name() {
    let read = |bytes| {
        let mut source = open(bytes, &limits()).unwrap();
        let file = source.files()[0].clone();
        source.read(&file, &mut Budget::new(limits())).unwrap_err().to_string()
    };
    let bytes = archive(&[("association.txt", b"Mappoint: 1 2 3 4")]);
    let encrypted = read(patch(bytes.clone(), 8, 6, 1));
    assert_eq!(encrypted, "a.zip/association.txt: encrypted; expected a file that opens without a password");
    let lzma = read(patch(bytes, 10, 8, 14));
    assert_eq!(lzma, "a.zip/association.txt: expected a stored or deflated file, found compression Lzma");
}

#[test]
fn a_broken_archive_is_an_error_wherever_it_breaks() {
    let text: Vec<u8> =
        (0..200).flat_map(|index| format!("Mappoint: {index} 1 2 3\n").into_bytes()).collect();
    let whole = archive(&[("association.txt", &text)]);
    let limits = Limits::default();
    for length in 0..whole.len() {
        assert!(open(whole[..length].to_vec(), &limits).is_err(), "cut at {length}");
    }
    let mut wrong = 0;
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x40;
        let Ok(mut source) = open(bytes, &limits) else { continue };
        let Some(file) = source.files().first().cloned() else { continue };
        if source.read(&file, &mut Budget::new(limits)).is_ok_and(|read| read != text) {
            wrong += 1;
        }
    }
    assert_eq!(wrong, 0, "the checksum tells");
}

#[test]
fn only_regular_files_of_a_folder_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("a.txt"), "1").unwrap();
    fs::create_dir(folder.path().join("b.txt")).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("/nowhere/at/all", folder.path().join("c.txt")).unwrap();
    let source = Source::open(&Container::Folder(folder.path().into()), "observation", &limits()).unwrap();
    let told: Vec<_> = source.files().iter().map(|file| source.told(file)).collect();
    assert_eq!(told, ["observation/a.txt"]);
    #[cfg(unix)]
    assert_eq!(source.skipped().count_of("unsafe-name"), 1);
}

#[test]
fn digests_are_those_of_the_standard() {
    let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(provenance_of_bytes(b"abc", "x").sha256, expected);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    fs::write(&path, "abc").unwrap();
    assert_eq!(provenance_of_file(&path, "x").unwrap(), provenance_of_bytes(b"abc", "x"));
}

proptest! {
    #[test]
    fn random_bytes_after_a_header_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), tail: bool) {
        let mut all = b"PK\x03\x04".to_vec();
        all.extend(&bytes);
        if tail {
            // An end of central directory makes more of it be believed.
            all.extend(b"PK\x05\x06");
            all.extend(bytes.iter().take(18));
        }
        if let Ok(mut source) = open(all, &limits()) {
            for file in source.files().to_vec() {
                let _ = source.read(&file, &mut Budget::new(limits()));
            }
        }
    }
}
