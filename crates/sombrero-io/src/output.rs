//! Writing a file whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::WriteError;

/// Whether an output that exists may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// An existing output is an error.
    #[default]
    Refuse,
    /// An existing regular file is replaced.
    Allow,
}

/// Who may read an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Access {
    /// Whoever the system's settings allow, or those who could read the file that is replaced.
    #[default]
    Usual,
    /// The owner alone: for keys.
    Private,
}

/// A file to be written.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Where.
    pub path: &'a Path,
    /// What.
    pub bytes: &'a [u8],
    /// Who may read it.
    pub access: Access,
}

/// Writes `bytes` to a temporary file beside `path`, then gives it that name.
///
/// Nobody ever sees a half-written file under `path`: on any failure what was there before is still there, and
/// the temporary file is gone. The rename is atomic, but nothing is flushed to the disk.
///
/// # Errors
///
/// [`WriteError::Exists`] unless overwriting is allowed, [`WriteError::NotAFile`] rather than replace a
/// directory or a device, [`WriteError::Io`] when the operating system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8], overwrite: Overwrite) -> Result<(), WriteError> {
    write_together(&[Output { path, bytes, access: Access::Usual }], overwrite)
}

/// Like [`write_atomically`] for several files that belong together: all are written before the first gets its
/// name, so that a full disk or a missing folder leaves none of them.
///
/// # Errors
///
/// As [`write_atomically`], for the first file that fails. Files that had been named by then and are new are
/// removed again.
pub fn write_together(outputs: &[Output<'_>], overwrite: Overwrite) -> Result<(), WriteError> {
    let staged =
        outputs.iter().map(|output| Staged::new(output, overwrite)).collect::<Result<Vec<_>, _>>()?;
    let mut named = Vec::new();
    for file in staged {
        let (path, is_new) = (file.target.clone(), !file.target.exists());
        if let Err(error) = file.name(overwrite) {
            for path in &named {
                // Nothing more can be done when even this fails; the first error tells more.
                let _ = fs::remove_file(path);
            }
            return Err(error);
        }
        if is_new {
            named.push(path);
        }
    }
    Ok(())
}

/// A file that is written but does not have its name yet.
struct Staged<'a> {
    file: NamedTempFile,
    path: &'a Path,
    target: PathBuf,
}

impl<'a> Staged<'a> {
    fn new(output: &Output<'a>, overwrite: Overwrite) -> Result<Self, WriteError> {
        let path = output.path;
        let failed = |source| WriteError::Io { path: path.to_owned(), source };
        let target = target(path, overwrite)?;
        let folder = match target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        // The temporary file's own name would only confuse; what went wrong with its folder is enough.
        let made = temporary(folder, output.access).map_err(|e| io::Error::from(e.kind()));
        let mut file = made.map_err(failed)?;
        if let Ok(replaced) = fs::metadata(&target)
            && output.access == Access::Usual
        {
            // What was private stays private.
            file.as_file().set_permissions(replaced.permissions()).map_err(failed)?;
        }
        file.write_all(output.bytes).map_err(failed)?;
        Ok(Self { file, path, target })
    }

    fn name(self, overwrite: Overwrite) -> Result<(), WriteError> {
        let Self { file, path, target } = self;
        match overwrite {
            Overwrite::Refuse => file.persist_noclobber(&target),
            Overwrite::Allow => file.persist(&target),
        }
        .map(drop)
        .map_err(|e| match e.error.kind() {
            io::ErrorKind::AlreadyExists => WriteError::Exists { path: path.to_owned() },
            _ => WriteError::Io { path: path.to_owned(), source: e.error },
        })
    }
}

/// The file to be named: `path`, or what it links to when that may be replaced.
fn target(path: &Path, overwrite: Overwrite) -> Result<PathBuf, WriteError> {
    let failed = |source| WriteError::Io { path: path.to_owned(), source };
    if fs::symlink_metadata(path).is_err() {
        // Not there, or not to be seen: then making the temporary file fails as well, and says why.
        return Ok(path.to_owned());
    }
    if overwrite == Overwrite::Refuse {
        return Err(WriteError::Exists { path: path.to_owned() });
    }
    let target = fs::canonicalize(path).map_err(failed)?;
    if !fs::metadata(&target).map_err(failed)?.is_file() {
        return Err(WriteError::NotAFile { path: path.to_owned() });
    }
    Ok(target)
}

/// A temporary file with the permissions that the output shall have; on its own it would be the owner's alone.
fn temporary(folder: &Path, access: Access) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".sombrero-");
    #[cfg(unix)]
    if access == Access::Usual {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_new_file_is_written_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.obj");
        write_atomically(&path, b"v 0 0 0\n", Overwrite::Refuse).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"v 0 0 0\n");
        assert_eq!(names(folder.path()), ["new.obj"]);
    }

    #[test]
    fn an_existing_file_is_replaced_only_when_allowed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("old.obj");
        fs::write(&path, "old").unwrap();
        let refused = write_atomically(&path, b"new", Overwrite::Refuse);
        assert!(matches!(refused, Err(WriteError::Exists { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        write_atomically(&path, b"new", Overwrite::Allow).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["old.obj"]);
    }

    #[test]
    fn files_that_belong_together_are_written_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let (mesh, key, nowhere) = (path("a.obj"), path("a.key"), path("missing/b.key"));
        fn output(path: &Path) -> Output<'_> {
            Output { path, bytes: b"x", access: Access::Private }
        }
        assert!(write_together(&[output(&mesh), output(&nowhere)], Overwrite::Refuse).is_err());
        assert!(names(folder.path()).is_empty());
        // The second name is taken only when the files are named: twice the same path.
        assert!(write_together(&[output(&mesh), output(&mesh)], Overwrite::Refuse).is_err());
        assert!(names(folder.path()).is_empty());
        write_together(&[output(&mesh), output(&key)], Overwrite::Refuse).unwrap();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            assert_eq!(fs::metadata(&key).unwrap().permissions().mode() & 0o777, 0o600);
        }
    }

    #[test]
    fn a_directory_is_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let refused = write_atomically(folder.path(), b"x", Overwrite::Allow);
        assert!(matches!(refused, Err(WriteError::NotAFile { .. })));
    }

    #[test]
    fn a_missing_folder_is_an_error_that_names_the_output() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("missing/out.obj");
        let error = write_atomically(&path, b"x", Overwrite::Refuse).unwrap_err();
        assert!(matches!(error, WriteError::Io { .. }));
        assert!(error.to_string().contains("out.obj"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_its_target_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, b"new", Overwrite::Allow).unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_a_new_file_or_of_the_replaced_one() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_atomically(&ours, b"x", Overwrite::Refuse).unwrap();
        fs::write(&plain, "x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o600)).unwrap();
        write_atomically(&ours, b"y", Overwrite::Allow).unwrap();
        assert_eq!(mode(&ours) & 0o777, 0o600);
    }
}
