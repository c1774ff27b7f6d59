//! Deflate, and the checksum of what was packed.

use std::io::{Read, Write};

use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// The CRC-32 of unpacked bytes.
pub(super) fn checksum(bytes: &[u8]) -> u32 {
    let mut sum = Crc::new();
    sum.update(bytes);
    sum.sum()
}

/// Unpacks at most one byte more than `most`; `None` when the data are damaged.
pub(super) fn inflate(data: &[u8], most: u64) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    DeflateDecoder::new(data).take(most.saturating_add(1)).read_to_end(&mut out).ok()?;
    Some(out)
}

/// Packed bytes.
pub(super) fn deflate(content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(content);
    debug_assert!(written.is_ok(), "a Vec takes all that is written to it");
    encoder.finish().unwrap_or_default()
}
