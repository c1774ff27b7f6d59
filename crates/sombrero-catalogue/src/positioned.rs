//! Reading where bytes lie, without moving anything that another thread could see.

use std::fs::File;
use std::io;

/// Fills `buffer` with what stands at `offset`.
#[cfg(unix)]
pub(crate) fn read(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, buffer, offset)
}

/// Fills `buffer` with what stands at `offset`.
#[cfg(windows)]
pub(crate) fn read(file: &File, buffer: &mut [u8], offset: u64) -> io::Result<()> {
    let mut done = 0;
    while done < buffer.len() {
        match std::os::windows::fs::FileExt::seek_read(file, &mut buffer[done..], offset + done as u64)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            count => done += count,
        }
    }
    Ok(())
}
