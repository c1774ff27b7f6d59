//! Files in memory, for a program that calls the command instead of starting it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Files in memory, under names that stand in the arguments as paths do and come before files on disk: meshes, keys and folders
/// of keys to read, and copies and keys to be written. Everything else is read and written as the command does.
#[derive(Debug, Default)]
pub struct Desk {
    files: BTreeMap<PathBuf, Vec<u8>>,
    outputs: BTreeSet<PathBuf>,
    written: Mutex<BTreeMap<PathBuf, Vec<u8>>>,
}

impl Desk {
    /// A file to read; `a/b` is one in the folder `a`.
    #[must_use]
    pub fn with_file(mut self, name: impl Into<PathBuf>, content: Vec<u8>) -> Self {
        self.files.insert(name.into(), content);
        self
    }

    /// A name under which what is written stays here.
    #[must_use]
    pub fn with_output(mut self, name: impl Into<PathBuf>) -> Self {
        self.outputs.insert(name.into());
        self
    }

    /// What was written under this name, once.
    pub fn take(&self, name: impl AsRef<Path>) -> Option<Vec<u8>> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner).remove(name.as_ref())
    }

    pub(crate) fn file(&self, path: &Path) -> Option<&[u8]> {
        self.files.get(path).map(Vec::as_slice)
    }

    /// The content of a file that is here, or else what `read` gives.
    pub(crate) fn file_or<E>(
        &self,
        path: &Path,
        read: impl FnOnce() -> Result<Vec<u8>, E>,
    ) -> Result<Vec<u8>, E> {
        self.file(path).map_or_else(read, |content| Ok(content.to_vec()))
    }

    /// The files in a folder that is here, in the order of their names; `None` when there is no such folder.
    pub(crate) fn folder(&self, folder: &Path) -> Option<Vec<PathBuf>> {
        let found: Vec<PathBuf> =
            self.files.keys().filter(|name| name.parent() == Some(folder)).cloned().collect();
        (!found.is_empty()).then_some(found)
    }

    /// Whether what is written to `path` stays here.
    pub(crate) fn takes(&self, path: &Path) -> bool {
        self.outputs.contains(path)
    }

    /// Takes what was written to `path`.
    pub(crate) fn put(&self, path: &Path, content: &[u8]) {
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        written.insert(path.to_owned(), content.to_vec());
    }

    /// Those of these outputs that go to a disk.
    pub(crate) fn on_disk<'a>(&self, outputs: &[&'a Path]) -> Vec<&'a Path> {
        outputs.iter().copied().filter(|path| !self.takes(path)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_hold_what_is_directly_in_them() {
        let desk = Desk::default()
            .with_file("keys/b", vec![2])
            .with_file("keys/a", vec![1])
            .with_file("mesh", vec![3]);
        assert_eq!(desk.folder(Path::new("keys")), Some(vec!["keys/a".into(), "keys/b".into()]));
        assert_eq!(desk.folder(Path::new("mesh")), None);
        assert_eq!(desk.file(Path::new("mesh")), Some([3].as_slice()));
    }

    #[test]
    fn what_was_written_is_taken_once() {
        let desk = Desk::default().with_output("copy");
        let (copy, page) = (Path::new("copy"), Path::new("page.html"));
        assert_eq!(desk.on_disk(&[copy, page]), [page]);
        desk.put(copy, b"mesh");
        assert_eq!(desk.take("copy").as_deref(), Some(b"mesh".as_slice()));
        assert_eq!(desk.take("copy"), None);
    }
}
