//! Runs that give names in the same folders take turns.

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

/// Locks the folders of these files until the result is dropped. The folders are taken in one order, so that two runs never
/// wait for each other. A file system that knows no locks is passed over.
pub(crate) fn folders<'a>(files: impl IntoIterator<Item = &'a Path>) -> Vec<File> {
    let folders: BTreeSet<PathBuf> =
        files.into_iter().filter_map(|file| folder_of(file).canonicalize().ok()).collect();
    let locked = |folder: &PathBuf| {
        let handle = handle(folder)?;
        handle.lock().map(|()| handle)
    };
    folders.iter().filter_map(|folder| locked(folder).ok()).collect()
}

/// The folder that a file is in, as its path has it.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// What stands for a folder when it is locked: the folder itself, so that nothing is left behind.
#[cfg(unix)]
fn handle(folder: &Path) -> io::Result<File> {
    File::open(folder)
}

/// What stands for a folder when it is locked: a file of the user's own, since folders cannot be opened.
#[cfg(not(unix))]
fn handle(folder: &Path) -> io::Result<File> {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    folder.hash(&mut hasher);
    let name = format!("sombrero-{:016x}.lock", hasher.finish());
    File::options().create(true).append(true).open(std::env::temp_dir().join(name))
}
