//! Writing a file whole or not at all.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use tempfile::{NamedTempFile, TempPath};

use crate::error::WriteError;
use crate::lock::{self, folder_of};

/// Whether an output that exists may be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// An existing output is an error.
    #[default]
    Refuse,
    /// An existing regular file is replaced, and nothing else: no link, no device, no folder.
    Allow,
}

/// Who may read an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Access {
    /// Those whom the system's settings allow, or who could read the file that is replaced.
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
/// There is never a half-written file under `path`: on any failure what was there before is still there, and
/// the temporary file is gone. The rename is atomic, but nothing is flushed to the disk. A link at `path` is
/// neither followed nor replaced: whoever laid it there cannot choose another file to be overwritten, and `/dev/stdout`,
/// which is a link too, stays one.
///
/// # Errors
///
/// Those of [`check_output`], and [`WriteError::Io`] when the operating system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8], overwrite: Overwrite) -> Result<(), WriteError> {
    write_together(&[Output { path, bytes, access: Access::Usual }], overwrite)
}

/// Writes several files that belong together, each as [`write_atomically`] does: all are written before the first
/// gets its name, so that a full disk or a missing folder leaves none of them. Runs that write the same names at the same
/// moment take turns: what is there in the end is all of one run.
///
/// At every moment, also when the process is killed, those of the names that are there belong together. Files are named
/// in their order, and where they replace others, all but the first are taken away before: the first one (a key, say) is
/// never missing where it was, and never beside what belongs to another. So the first is what a later run can go on from.
///
/// # Errors
///
/// As [`write_atomically`], for the first file that fails. Files that had been named by then and are new are
/// removed again, and those that were taken away come back; a first one that was replaced stays replaced.
pub fn write_together(outputs: &[Output<'_>], overwrite: Overwrite) -> Result<(), WriteError> {
    let staged = staged(outputs, overwrite)?;
    let _turn = lock::folders(staged.iter().map(|file| file.path));
    let mut taken = Taken(Vec::new());
    if overwrite == Overwrite::Allow {
        staged.iter().skip(1).try_for_each(|other| taken.take_away(other.path))?;
    }
    let mut named = Vec::new();
    for file in staged {
        let (path, is_new) = (file.path, !is_there(file.path));
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
    taken.forget();
    Ok(())
}

/// Replaces several files, or makes them, of which each is good on its own: all are written before the first gets its
/// name, and none is ever missing.
///
/// # Errors
///
/// As [`write_atomically`], for the first file that fails. Those before it may be replaced by then.
pub fn replace_each(outputs: &[Output<'_>]) -> Result<(), WriteError> {
    let staged = staged(outputs, Overwrite::Allow)?;
    staged.into_iter().try_for_each(|file| file.name(Overwrite::Allow))
}

fn staged<'a>(outputs: &[Output<'a>], overwrite: Overwrite) -> Result<Vec<Staged<'a>>, WriteError> {
    outputs.iter().map(|output| Staged::new(output, overwrite)).collect()
}

fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Files that new ones are to replace, under temporary names beside them. They come back when dropped, and go for good
/// when forgotten.
struct Taken<'a>(Vec<(&'a Path, TempPath)>);

impl<'a> Taken<'a> {
    fn take_away(&mut self, path: &'a Path) -> Result<(), WriteError> {
        if !is_there(path) {
            return Ok(());
        }
        let aside = tempfile::Builder::new()
            .prefix(".sombrero-")
            .make_in(folder_of(path), |aside| fs::rename(path, aside))
            .map_err(|source| WriteError::Io { path: path.to_owned(), source })?;
        self.0.push((path, aside.into_temp_path()));
        Ok(())
    }

    fn forget(mut self) {
        self.0.clear();
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        for (path, aside) in self.0.drain(..) {
            if let Err(error) = aside.persist_noclobber(path) {
                // Rather under a strange name than lost.
                let _ = error.path.keep();
            }
        }
    }
}

/// A file that is written but does not have its name yet.
struct Staged<'a> {
    file: NamedTempFile,
    path: &'a Path,
}

impl<'a> Staged<'a> {
    fn new(output: &Output<'a>, overwrite: Overwrite) -> Result<Self, WriteError> {
        let path = output.path;
        let failed = |source| WriteError::Io { path: path.to_owned(), source };
        let replaced = replaced(path, overwrite)?;
        let folder = folder_of(path);
        // The temporary file's own name would only confuse; what went wrong is enough.
        let failed_there = |e: io::Error| failed(io::Error::from(e.kind()));
        let mut file = temporary(folder, output.access).map_err(failed_there)?;
        if let Some(replaced) = replaced
            && output.access == Access::Usual
        {
            // What was private stays private.
            file.as_file().set_permissions(replaced.permissions()).map_err(failed)?;
        }
        file.write_all(output.bytes).map_err(failed_there)?;
        Ok(Self { file, path })
    }

    fn name(self, overwrite: Overwrite) -> Result<(), WriteError> {
        let Self { file, path } = self;
        match overwrite {
            Overwrite::Refuse => file.persist_noclobber(path),
            Overwrite::Allow => file.persist(path),
        }
        .map(drop)
        .map_err(|e| match e.error.kind() {
            io::ErrorKind::AlreadyExists => WriteError::Exists { path: path.to_owned() },
            _ => WriteError::Io { path: path.to_owned(), source: e.error },
        })
    }
}

/// Whether a file may be written at `path`, told before there is anything to write.
///
/// # Errors
///
/// [`WriteError::Exists`] where something is and overwriting is not allowed, [`WriteError::Link`] and
/// [`WriteError::NotAFile`] (a directory, a device, a pipe, a socket) where it is, [`WriteError::Reserved`] on Windows.
pub fn check_output(path: &Path, overwrite: Overwrite) -> Result<(), WriteError> {
    replaced(path, overwrite).map(drop)
}

/// The regular file that `path` names and that is replaced; `None` for a new file.
fn replaced(path: &Path, overwrite: Overwrite) -> Result<Option<fs::Metadata>, WriteError> {
    if cfg!(windows) {
        check_file_name(path)?;
    }
    let owned = || path.to_owned();
    match fs::symlink_metadata(path) {
        // Not there, or not to be seen: then making the temporary file fails as well, and says why.
        Err(_) => Ok(None),
        Ok(_) if overwrite == Overwrite::Refuse => Err(WriteError::Exists { path: owned() }),
        Ok(found) if found.is_symlink() => Err(WriteError::Link { path: owned() }),
        Ok(found) if !found.is_file() => Err(WriteError::NotAFile { path: owned() }),
        Ok(found) => Ok(Some(found)),
    }
}

/// Refuses names of files that Windows takes for devices (`CON`, `nul.obj`, `COM1.tar.gz`, in any case) or cannot
/// keep as they are (with a dot or a space at the end), so that a file that is written here can be copied there.
///
/// Only the last part of `path` counts. On Windows all outputs are checked so; elsewhere whoever makes names from
/// foreign text does it.
///
/// # Errors
///
/// [`WriteError::Reserved`].
pub fn check_file_name(path: &Path) -> Result<(), WriteError> {
    let Some(name) = path.file_name() else { return Ok(()) };
    let name = name.to_string_lossy();
    if is_device(&name) || name.ends_with(['.', ' ']) {
        return Err(WriteError::Reserved { path: path.to_owned() });
    }
    Ok(())
}

/// Whether a name means a device: a device's name up to the first dot or colon, spaces behind it not counted
/// (Microsoft, "Naming Files, Paths, and Namespaces").
fn is_device(name: &str) -> bool {
    const DEVICES: [&str; 6] = ["CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"];
    let stem = name.split(['.', ':']).next().unwrap_or_default().trim_end_matches(' ').to_uppercase();
    let numbered = ["COM", "LPT"].iter().filter_map(|port| stem.strip_prefix(port)).any(|number| {
        let mut digits = number.chars();
        matches!((digits.next(), digits.next()), (Some('1'..='9' | '¹' | '²' | '³'), None))
    });
    numbered || DEVICES.contains(&stem.as_str())
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
    #[cfg(not(unix))]
    let _ = access;
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
    fn files_of_several_runs_never_mix() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("keys")).unwrap();
        let (copy, key) = (folder.path().join("a.obj"), folder.path().join("keys/a.key"));
        let write = &|run: u32, overwrite| {
            let bytes = run.to_le_bytes();
            let output = |path| Output { path, bytes: &bytes, access: Access::Usual };
            // Some name them the other way round.
            let mut outputs = [output(&copy), output(&key)];
            outputs.rotate_left(run as usize % 2);
            write_together(&outputs, overwrite)
        };
        for round in 0..200 {
            std::thread::scope(|scope| {
                let runs = (0..3).map(|run| scope.spawn(move || write(3 * round + run, Overwrite::Allow)));
                runs.collect::<Vec<_>>().into_iter().for_each(|run| run.join().unwrap().unwrap());
            });
            assert_eq!(fs::read(&copy).unwrap(), fs::read(&key).unwrap(), "round {round}");
        }
        for round in 0..50 {
            fs::remove_file(&copy).unwrap();
            fs::remove_file(&key).unwrap();
            let written = std::thread::scope(|scope| {
                let runs = (0..3).map(|run| scope.spawn(move || write(3 * round + run, Overwrite::Refuse)));
                let runs = runs.collect::<Vec<_>>().into_iter();
                runs.map(|run| run.join().unwrap()).filter(Result::is_ok).count()
            });
            assert_eq!(written, 1, "round {round}");
            assert_eq!(fs::read(&copy).unwrap(), fs::read(&key).unwrap(), "round {round}");
        }
    }

    #[test]
    fn what_is_replaced_together_comes_back_when_one_name_cannot_be_had() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let (mesh, key, missing) = (path("a.obj"), path("a.key"), path("nothing there"));
        let output = |path| Output { path, bytes: b"new", access: Access::Usual };
        fs::write(&mesh, "old").unwrap();
        fs::write(&key, "old").unwrap();
        write_together(&[output(&mesh), output(&key)], Overwrite::Allow).unwrap();
        assert_eq!((fs::read(&mesh).unwrap(), fs::read(&key).unwrap()), (b"new".to_vec(), b"new".to_vec()));
        assert_eq!(names(folder.path()).len(), 2);

        let mut taken = Taken(Vec::new());
        taken.take_away(&mesh).unwrap();
        taken.take_away(&missing).unwrap();
        assert!(!mesh.exists() && key.exists());
        drop(taken);
        assert_eq!(fs::read(&mesh).unwrap(), b"new");
        assert_eq!(names(folder.path()).len(), 2);
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
        assert!(
            error
                .to_string()
                .ends_with("out.obj: cannot be written (its folder is not there); make the folder first")
        );
    }

    /// Whether it leads to a file, to nothing, to a device (as `/dev/stdout` may) or to a folder.
    #[cfg(unix)]
    #[test]
    fn a_link_is_neither_replaced_nor_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (file, missing) = (folder.path().join("file"), folder.path().join("missing"));
        fs::write(&file, "old").unwrap();
        let ends = [&file, &missing, Path::new("/dev/null"), folder.path()];
        for (number, end) in ends.into_iter().enumerate() {
            let link = folder.path().join(number.to_string());
            std::os::unix::fs::symlink(end, &link).unwrap();
            let write = |overwrite| write_atomically(&link, b"new", overwrite);
            assert!(matches!(write(Overwrite::Refuse), Err(WriteError::Exists { .. })), "{}", end.display());
            assert!(matches!(write(Overwrite::Allow), Err(WriteError::Link { .. })), "{}", end.display());
            assert_eq!(fs::read_link(&link).unwrap(), end);
        }
        assert_eq!(fs::read(&file).unwrap(), b"old");
        assert!(!missing.exists());
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_never_replaced() {
        let refused = write_atomically(Path::new("/dev/null"), b"x", Overwrite::Allow);
        assert!(matches!(refused, Err(WriteError::NotAFile { .. })));
    }

    #[test]
    fn names_that_windows_keeps_for_itself_are_refused() {
        for name in [
            "CON",
            "con",
            "Nul.obj",
            "aux.tar.gz",
            "PRN ",
            "prn .ply",
            "COM1",
            "com9.key",
            "LPT3.x",
            "COM².ply",
            "CONIN$",
            "NUL:",
            "model.",
            "model.obj ",
            "COM1..",
        ] {
            let refused = check_file_name(&Path::new("some folder").join(name));
            assert!(matches!(refused, Err(WriteError::Reserved { .. })), "{name}");
        }
        for name in
            ["CONSOLE", "com0", "COM10.ply", "COMA", "LPT", "nulls.obj", "a.con", ".obj", "my aux.obj"]
        {
            assert!(check_file_name(Path::new(name)).is_ok(), "{name}");
        }
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
