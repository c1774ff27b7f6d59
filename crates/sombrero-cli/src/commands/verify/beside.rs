//! The files of a report: where the user says, else beside the report.
//!
//! Anybody can write a report, and its reader should not open with it what its writer chose. So a name in a report is
//! taken without its folders, whichever system wrote them, and only a file of that name beside the report is read: nothing
//! elsewhere, no device, no share of a network, not standard input.

use crate::failure::Failure;
use std::path::{Path, PathBuf};

/// A file that a report names.
pub(super) struct Named<'a> {
    /// What it is.
    pub role: &'static str,
    /// The option that gives it.
    pub option: &'static str,
    /// What the user gave.
    pub given: Option<&'a Path>,
    /// The path in the report.
    pub path: &'a str,
}

impl Named<'_> {
    /// The file to read.
    pub(super) fn find(&self, report: &Path) -> Result<PathBuf, Failure> {
        let Self { role, option, given, path } = *self;
        if let Some(given) = given {
            return Ok(given.to_owned());
        }
        let Some(name) = file_name(path) else {
            let message =
                format!("{}: it names no file as its {role}; give it with {option} FILE", report.display());
            return Err(Failure::new("read", message));
        };
        let beside = report.with_file_name(name);
        if !beside.is_file() {
            let message = format!(
                "{}: its {role} {name} is not beside it; put it there or give it with {option} FILE",
                report.display()
            );
            return Err(Failure::new("read", message));
        }
        Ok(beside)
    }

    /// A sentence where the user gave a file of another name than that in the report.
    pub(super) fn renamed(&self) -> Option<String> {
        let given = self.given?.file_name()?.to_string_lossy();
        let name = file_name(self.path).unwrap_or(self.path);
        (given != name).then(|| format!("the report calls the {} {name}", self.role))
    }
}

/// The last part of a path of any system; `None` when that is no name of a file.
fn file_name(path: &str) -> Option<&str> {
    let name = path.rsplit(['/', '\\']).next()?;
    // A drive or a stream, and what Windows takes for a device in every folder.
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_lowercase();
    let port = stem.strip_prefix("com").or_else(|| stem.strip_prefix("lpt"));
    let device = matches!(stem.as_str(), "con" | "prn" | "aux" | "nul" | "conin$" | "conout$")
        || port.is_some_and(|port| port.chars().count() == 1);
    let refused = cfg!(windows) && (device || name.contains(':'));
    (!matches!(name, "" | "." | ".." | "-") && !name.contains('\0') && !refused).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_name_of_a_path_is_taken() {
        for path in [
            "a.obj",
            "/home/ann/a.obj",
            "../../a.obj",
            r"C:\scans\a.obj",
            r"\\server\share\a.obj",
            "//server/a.obj",
        ] {
            assert_eq!(file_name(path), Some("a.obj"), "{path}");
        }
        for path in ["", "-", ".", "..", "/", "/etc/", r"\\", "x/..", "a\0"] {
            assert_eq!(file_name(path), None, "{path:?}");
        }
    }
}
