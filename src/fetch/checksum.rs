//! Digests of files.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sha2::{Digest, Sha256};

use super::Error;
use crate::structure::hex;

/// Bytes that are read at a time.
pub(super) const CHUNK: usize = 1 << 18;

/// Adds what follows in a file to a digest; gives the number of bytes.
pub(super) fn add(mut from: impl Read, digest: &mut Sha256) -> io::Result<u64> {
    let mut buffer = vec![0; CHUNK];
    let mut bytes = 0;
    loop {
        match from.read(&mut buffer) {
            Ok(0) => return Ok(bytes),
            Ok(length) => {
                digest.update(&buffer[..length]);
                bytes += length as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Length and SHA-256 of a file.
pub(super) fn of_file(path: &Path) -> Result<(u64, String), Error> {
    let file = File::open(path).map_err(Error::io(path))?;
    let mut digest = Sha256::new();
    let bytes = add(file, &mut digest).map_err(Error::io(path))?;
    Ok((bytes, hex(&digest.finalize())))
}
