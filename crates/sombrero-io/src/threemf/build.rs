//! A new ZIP archive.

use super::fields::{CENTRAL, END, LOCAL};
use super::packing::{checksum, deflate};

/// The method of packed entries.
const DEFLATED: u16 = 8;

/// The first day that the format knows, for archives that are the same whenever they are written.
const DAY: u16 = 1 << 5 | 1;

/// A new archive; `None` when it would be too large.
pub(super) fn build(parts: &[(&str, Vec<u8>)]) -> Option<Vec<u8>> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in parts {
        let start = u32::try_from(out.len()).ok()?;
        let packed = deflate(content);
        let header = shared_header(name, content, packed.len())?;
        out.extend_from_slice(LOCAL);
        out.extend_from_slice(&header);
        out.extend_from_slice(name.as_bytes());
        out.extend_from_slice(&packed);
        directory.extend_from_slice(CENTRAL);
        directory.extend_from_slice(&20_u16.to_le_bytes());
        directory.extend_from_slice(&header);
        // No comment, first volume, no attributes.
        directory.extend_from_slice(&[0; 10]);
        directory.extend_from_slice(&start.to_le_bytes());
        directory.extend_from_slice(name.as_bytes());
    }
    let (start, size) = (u32::try_from(out.len()).ok()?, u32::try_from(directory.len()).ok()?);
    let count = u16::try_from(parts.len()).ok()?.to_le_bytes();
    out.extend(directory);
    out.extend_from_slice(END);
    out.extend_from_slice(&[0; 4]);
    out.extend_from_slice(&[count, count].concat());
    out.extend_from_slice(&size.to_le_bytes());
    out.extend_from_slice(&start.to_le_bytes());
    out.extend_from_slice(&[0; 2]);
    Some(out)
}

/// What a local header and one in the directory have in common.
fn shared_header(name: &str, content: &[u8], packed: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    // Version needed, flags, method, time, day.
    for field in [20, 0, DEFLATED, 0, DAY] {
        out.extend_from_slice(&field.to_le_bytes());
    }
    for field in [checksum(content), u32::try_from(packed).ok()?, u32::try_from(content.len()).ok()?] {
        out.extend_from_slice(&field.to_le_bytes());
    }
    out.extend_from_slice(&u16::try_from(name.len()).ok()?.to_le_bytes());
    out.extend_from_slice(&[0; 2]);
    Some(out)
}
