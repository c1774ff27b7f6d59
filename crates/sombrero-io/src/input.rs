//! Reading a file's bytes, with a limit.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path};

use crate::error::{ParseError, ReadError};

/// What a reader is given.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) bytes: &'a [u8],
    /// Where the files are that this one refers to.
    pub(crate) beside: Beside<'a>,
    pub(crate) limits: Limits,
}

/// The files beside the one that is read.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Beside<'a> {
    /// None: only the content of one file was given.
    Nothing,
    /// Those of a folder.
    Folder(&'a Path),
    /// Those that were given, under their names.
    Files(&'a [(String, Vec<u8>)]),
}

/// Whether a name is a path that leads downwards only, on every system.
pub fn is_plain_path(name: &str) -> bool {
    let harmless = !name.is_empty() && !name.contains(['\\', ':', '\0']) && !name.starts_with('/');
    let downwards = |c: Component<'_>| matches!(c, Component::Normal(_) | Component::CurDir);
    harmless && name.split('/').all(|part| part != "..") && Path::new(name).components().all(downwards)
}

/// How much a reader takes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// The largest file that is read, in bytes. Memory use stays within a small multiple of the file's size.
    pub max_bytes: u64,
    /// The most vertices that a file may store (an STL facet stores three).
    pub max_vertices: usize,
}

impl Default for Limits {
    /// 2 GiB and 200 million vertices: several times the largest scans that people exchange.
    fn default() -> Self {
        Self { max_bytes: 2 << 30, max_vertices: 200_000_000 }
    }
}

impl Limits {
    /// These limits with another largest size.
    pub fn with_max_bytes(self, max_bytes: u64) -> Self {
        Self { max_bytes, ..self }
    }

    /// These limits with another number of vertices.
    pub fn with_max_vertices(self, max_vertices: usize) -> Self {
        Self { max_vertices, ..self }
    }

    /// No limits but those of the formats: for what one wrote oneself.
    pub fn unlimited() -> Self {
        Self { max_bytes: u64::MAX, max_vertices: usize::MAX }
    }

    /// How many bytes a file of this size may unpack to: a hundred times as many, since models pack to a tenth and not to a
    /// hundredth, and a few in any case.
    pub(crate) fn unpacked(self, bytes: usize) -> u64 {
        const ALWAYS: u64 = 64 << 20;
        const TIMES: u64 = 100;
        self.max_bytes.min(ALWAYS.max((bytes as u64).saturating_mul(TIMES)))
    }

    /// Refuses more vertices than are allowed. Corners are 32-bit numbers, so there is always a limit.
    pub(crate) fn check_vertices(self, count: usize) -> Result<(), ParseError> {
        let limit = self.max_vertices.min(u32::MAX as usize - 1);
        if count > limit { Err(ParseError::TooManyVertices { limit }) } else { Ok(()) }
    }
}

/// The bytes of the regular file at `path`: also of files that hold no mesh, such as keys.
///
/// # Errors
///
/// [`ReadError::NotAFile`] for directories, pipes and devices, [`ReadError::TooLarge`] beyond the limit,
/// [`ReadError::Io`] when the operating system refuses.
pub fn read_bytes(path: &Path, limits: Limits) -> Result<Vec<u8>, ReadError> {
    let failed = |source| ReadError::Io { path: path.to_owned(), source };
    let too_large = || ReadError::TooLarge { path: path.to_owned(), limit: limits.max_bytes };
    // Asked before opening, since opening a pipe would wait for its writer.
    if !fs::metadata(path).map_err(failed)?.is_file() {
        return Err(ReadError::NotAFile { path: path.to_owned() });
    }
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    if length > limits.max_bytes {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    // The file may grow while it is read: one byte over the limit tells.
    file.take(limits.max_bytes.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > limits.max_bytes {
        return Err(too_large());
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_directory_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(read_bytes(folder.path(), Limits::default()), Err(ReadError::NotAFile { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_refused() {
        let read = read_bytes(Path::new("/dev/zero"), Limits::default());
        assert!(matches!(read, Err(ReadError::NotAFile { .. })));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = read_bytes(Path::new("nowhere.obj"), Limits::default()).unwrap_err();
        assert!(matches!(error, ReadError::Io { .. }));
        assert!(error.to_string().starts_with("nowhere.obj: cannot be read"));
    }

    #[test]
    fn the_limit_is_exact() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ten");
        fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read_bytes(&path, Limits::default().with_max_bytes(10)).unwrap(), [7; 10]);
        let refused = read_bytes(&path, Limits::default().with_max_bytes(9));
        assert!(matches!(refused, Err(ReadError::TooLarge { limit: 9, .. })));
    }
}
