//! Making a small zip archive.

use std::io::{self, Cursor, Write as _};

use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// A zip archive with these members in this order; the same members give the same bytes.
///
/// # Errors
/// When a name comes twice, or a member is too large for the format.
pub fn zipped<'a>(members: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> io::Result<Vec<u8>> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in members {
        writer.start_file(name, options)?;
        writer.write_all(bytes)?;
    }
    Ok(writer.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read as _;

    #[test]
    fn members_come_back_and_bytes_do_not_change() {
        let members = [("a.json", &b"{}"[..]), ("b.npy", &[7; 5000][..])];
        let bytes = zipped(members).unwrap();
        assert_eq!(zipped(members).unwrap(), bytes);
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        for (name, expected) in members {
            let mut found = Vec::new();
            archive.by_name(name).unwrap().read_to_end(&mut found).unwrap();
            assert_eq!(found, expected);
        }
        assert!(zipped([("a", &[][..]), ("a", &[])]).is_err());
    }
}
