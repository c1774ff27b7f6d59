//! Reading keys and secrets, and care with outputs.

use crate::answer::{Answer, Context, Outcome};
use crate::desk::Desk;
use crate::failure::Failure;
use sombrero::PreparedBasis;
use sombrero::io::{
    Document, Format, Limits, Output, Overwrite, ReadError, check_output, read_bytes, write_together,
};
use sombrero::watermark::{Key, Secret};
use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// A key of a million coefficients has about 20 MB.
pub(crate) const LARGEST_KEY: u64 = 64 << 20;

/// Standard input, or standard output.
pub(crate) fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// A mesh from memory, from a file or from standard input.
pub(crate) fn read_mesh(path: &Path, context: &Context) -> Result<Document, Failure> {
    let limits = context.limits;
    let parsed = |bytes, path: &Path| {
        let parsed = Document::parse_within(bytes, None, limits);
        Ok(parsed.map_err(|source| ReadError::Parse { path: path.to_owned(), source })?)
    };
    match context.desk.file(path) {
        Some(content) => parsed(content.to_vec(), path),
        None if is_standard(path) => parsed(read_standard_input(limits)?, Path::new("standard input")),
        None => Ok(Document::read_within(path, limits)?),
    }
}

fn read_standard_input(limits: Limits) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    // One byte over the limit tells.
    let read = std::io::stdin().lock().take(limits.max_bytes.saturating_add(1)).read_to_end(&mut bytes);
    let path = || PathBuf::from("standard input");
    read.map_err(|source| ReadError::Io { path: path(), source })?;
    if bytes.len() as u64 > limits.max_bytes {
        return Err(ReadError::TooLarge { path: path(), limit: limits.max_bytes }.into());
    }
    Ok(bytes)
}

/// Folders below a folder of meshes are looked into this deep.
const DEEPEST: usize = 16;

/// Files with a mesh's extension in a folder and those below it, in the order of their names; not in the folder `without`,
/// nor behind links to folders, which may lead in circles.
pub(crate) fn meshes_in(folder: &Path, without: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    let mut meshes = Vec::new();
    list_meshes(folder, without.and_then(|path| path.canonicalize().ok()).as_deref(), DEEPEST, &mut meshes)?;
    if meshes.is_empty() {
        let message = format!(
            "{}: not a regular file, but a folder without mesh files; give another one",
            folder.display()
        );
        return Err(Failure::new("read", message));
    }
    Ok(meshes)
}

fn list_meshes(
    folder: &Path,
    without: Option<&Path>,
    depth: usize,
    found: &mut Vec<PathBuf>,
) -> Result<(), Failure> {
    let is_mesh = |path: &Path| {
        let extension = path.extension().and_then(OsStr::to_str);
        extension.and_then(Format::from_extension).is_some() && path.is_file()
    };
    for path in entries(folder)? {
        let is_folder = path.symlink_metadata().is_ok_and(|found| found.is_dir());
        if is_folder && depth > 0 {
            if without.is_none() || path.canonicalize().ok().as_deref() != without {
                list_meshes(&path, without, depth - 1, found)?;
            }
        } else if is_mesh(&path) {
            found.push(path);
        }
    }
    Ok(())
}

/// The entries of a folder, in the order of the names.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    if folder.is_file() {
        let message = format!("{}: a file; give the folder that it is in", folder.display());
        return Err(Failure::new("read", message));
    }
    let failed = |source| Failure::from(ReadError::Io { path: folder.to_owned(), source });
    let listed = std::fs::read_dir(folder).map_err(failed)?;
    let mut paths =
        listed.map(|entry| Ok(entry.map_err(failed)?.path())).collect::<Result<Vec<_>, Failure>>()?;
    paths.sort();
    Ok(paths)
}

/// Makes a folder, unless it is there.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    if folder.exists() && !folder.is_dir() {
        let message = format!("{}: not a folder; choose another name", folder.display());
        return Err(Failure::new("write", message));
    }
    std::fs::create_dir_all(folder).map_err(|e| {
        let what = "cannot be made";
        Failure::new("write", format!("{}: {what} ({e}); choose another place for it", folder.display()))
    })
}

/// Makes a folder that only its owner may look into, unless it is there; one that is there is closed to others. Gives whether
/// it had been open to them.
pub(crate) fn make_private_folder(folder: &Path) -> Result<bool, Failure> {
    let is_new = !folder.exists();
    make_folder(folder)?;
    Ok(close(folder)? && !is_new)
}

/// Takes away what group and others may do in a folder; gives whether that was anything.
#[cfg(unix)]
fn close(folder: &Path) -> Result<bool, Failure> {
    use std::os::unix::fs::PermissionsExt;
    const OWNER: u32 = 0o700;
    let mode = |folder: &Path| folder.metadata().map(|found| found.permissions().mode() & 0o777);
    let failed = |e: &dyn std::fmt::Display| {
        let message = format!(
            "{}: others can look into this folder of keys, and it cannot be closed to them ({e}); run `chmod 700` on it as \
             its owner, or choose another folder",
            folder.display()
        );
        Failure::new("write", message)
    };
    if mode(folder).map_err(|e| failed(&e))? & !OWNER == 0 {
        return Ok(false);
    }
    std::fs::set_permissions(folder, std::fs::Permissions::from_mode(OWNER)).map_err(|e| failed(&e))?;
    // Some file systems take it and do not keep it.
    match mode(folder) {
        Ok(mode) if mode & !OWNER == 0 => Ok(true),
        Ok(mode) => Err(failed(&format!("it stays {mode:o}"))),
        Err(e) => Err(failed(&e)),
    }
}

/// Other systems than Unix keep what is in a user's own folders from others.
#[cfg(not(unix))]
fn close(_: &Path) -> Result<bool, Failure> {
    Ok(false)
}

/// Writes all files or none, those that stay in memory last.
pub(crate) fn write_with(outputs: &[Output<'_>], force: bool, desk: &Desk) -> Result<(), Failure> {
    let (kept, written): (Vec<Output<'_>>, Vec<_>) = outputs.iter().partition(|o| desk.takes(o.path));
    write_all(&written, force)?;
    kept.iter().for_each(|output| desk.put(output.path, output.bytes));
    Ok(())
}

/// Writes all files or none; the one to standard output last, when nothing else can fail.
pub(crate) fn write_all(outputs: &[Output<'_>], force: bool) -> Result<(), Failure> {
    let (standard, files): (Vec<Output<'_>>, Vec<_>) = outputs.iter().partition(|o| is_standard(o.path));
    write_together(&files, overwrite(force))?;
    for output in standard {
        let mut out = std::io::stdout().lock();
        let written = out.write_all(output.bytes).and_then(|()| out.flush());
        written.map_err(|e| Failure::new("write", format!("standard output: cannot be written ({e})")))?;
    }
    Ok(())
}

/// Refuses a name that says another format than the content of the file will have.
pub(crate) fn check_format(output: &Path, document: &Document) -> Result<(), Failure> {
    let extension = output.extension().and_then(OsStr::to_str).filter(|_| !is_standard(output));
    let named = extension.and_then(Format::from_extension);
    if named.is_none_or(|named| named.extension() == document.extension()) {
        return Ok(());
    }
    let (format, would_do) = (document.format(), output.with_extension(document.extension()));
    let message = format!(
        "{}: the output will be {format}, as its input is; give it a name such as {}",
        output.display(),
        would_do.display()
    );
    Err(Failure::new("usage", message))
}

/// The answer of a command that wrote to `output`: out of the way if that was standard output.
pub(crate) fn answered(output: &Path, answer: Answer) -> Outcome {
    if is_standard(output) { Outcome::Aside(answer) } else { Outcome::Answer(answer) }
}

/// A mesh and a JSON object cannot share standard output.
pub(crate) fn check_standard_output(output: &Path, context: &Context) -> Result<(), Failure> {
    if is_standard(output) && context.json {
        let message = "--json and the output `-` both want standard output; give the output a name";
        return Err(Failure::new("usage", message));
    }
    Ok(())
}

pub(crate) fn read_key(path: &Path) -> Result<Key, Failure> {
    parse_key(path, &read_key_file(path)?)
}

/// The content of a key file, from memory or from a disk.
pub(crate) fn key_file(path: &Path, desk: &Desk) -> Result<Vec<u8>, Failure> {
    desk.file_or(path, || read_key_file(path))
}

/// The content of a key file.
pub(crate) fn read_key_file(path: &Path) -> Result<Vec<u8>, Failure> {
    read_small(path, LARGEST_KEY, "a key that `embed` wrote")
}

/// A key from what the file holds.
pub(crate) fn parse_key(path: &Path, bytes: &[u8]) -> Result<Key, Failure> {
    Key::from_json(bytes).map_err(|e| Failure::about("key", path, &e))
}

/// The place where `prepare` writes and `detect` looks unless told otherwise: KEY.prepared.
pub(crate) fn beside_key(key: &Path) -> PathBuf {
    let mut name = key.as_os_str().to_owned();
    name.push(".prepared");
    name.into()
}

pub(crate) fn read_prepared(path: &Path, key: &Key, limits: Limits) -> Result<PreparedBasis, Failure> {
    let bytes = read_bytes(path, limits)?;
    PreparedBasis::parse(&bytes, key).map_err(|e| Failure::about("prepared", path, &e))
}

/// The environment variable that may hold a secret.
const SECRET: &str = "SOMBRERO_SECRET";

/// The secret in a file of 64 hexadecimal digits, or in the environment, if one is given.
pub(crate) fn given_secret(path: Option<&Path>, desk: &Desk) -> Result<Option<Secret>, Failure> {
    let (text, place) = match (path, std::env::var_os(SECRET)) {
        (Some(path), _) => {
            let read = || read_small(path, 4096, "a file with 64 hexadecimal digits");
            let content = desk.file_or(path, read)?;
            (String::from_utf8_lossy(&content).into_owned(), path)
        }
        (None, Some(value)) => (value.to_string_lossy().into_owned(), Path::new(SECRET)),
        (None, None) => return Ok(None),
    };
    Secret::from_hex(&text).map(Some).map_err(|e| Failure::about("secret", place, &e))
}

/// A new secret from the operating system.
pub(crate) fn new_secret() -> Result<Secret, Failure> {
    let mut bytes = [0; 32];
    match getrandom::fill(&mut bytes) {
        Ok(()) => Ok(Secret(bytes)),
        Err(e) => {
            let message = format!("the operating system gives no randomness ({e}); use --secret-file");
            Err(Failure::new("secret", message))
        }
    }
}

/// The whole of a regular file, or of standard input, that is no larger than `most` bytes. `what` it should be is said
/// where it is none.
pub(crate) fn read_small(path: &Path, most: u64, what: &str) -> Result<Vec<u8>, Failure> {
    let limits = Limits::default().with_max_bytes(most);
    if is_standard(path) {
        return read_standard_input(limits);
    }
    match read_bytes(path, limits) {
        Err(ReadError::NotAFile { .. }) => {
            let found = if path.is_dir() { "a folder, not a regular file" } else { "not a regular file" };
            Err(Failure::new("read", format!("{}: {found}; give the path of {what}", path.display())))
        }
        read => Ok(read?),
    }
}

pub(crate) fn overwrite(force: bool) -> Overwrite {
    if force { Overwrite::Allow } else { Overwrite::Refuse }
}

/// The place to which a path leads, however it is spelled; for a file that is not there, its folder decides.
fn place(path: &Path) -> Option<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
}

/// Refuses outputs that exist before any work is done, unless they are files and `force`; and always those that are an
/// input or each other. Standard input can be read once, and standard output written once.
pub(crate) fn check_outputs(outputs: &[&Path], inputs: &[&Path], force: bool) -> Result<(), Failure> {
    for (paths, name) in [(outputs, "output"), (inputs, "input")] {
        if paths.iter().filter(|path| is_standard(path)).count() > 1 {
            let message = format!("two files cannot both be standard {name}; give one of them a name");
            return Err(Failure::new("usage", message));
        }
    }
    let same = |a: &Path, b: &Path| a == b || matches!((place(a), place(b)), (Some(a), Some(b)) if a == b);
    for (i, output) in outputs.iter().enumerate().filter(|(_, output)| !is_standard(output)) {
        if inputs.iter().any(|input| same(output, input)) {
            let message =
                format!("{}: the output would replace an input; choose another name", output.display());
            return Err(Failure::new("write", message));
        }
        if outputs[..i].iter().any(|other| same(output, other)) {
            let message = format!("{}: two outputs have the same name; choose another one", output.display());
            return Err(Failure::new("write", message));
        }
        check_output(output, overwrite(force))?;
    }
    Ok(())
}
