//! A file that somebody chose, and what is too large for a browser.

use crate::refusal::Refusal;
use sombrero::io::{Document, Limits};
use std::ffi::OsStr;
use std::path::Path;

/// Bytes of the largest file that is read. The page refuses a larger one before it reads it.
pub const LARGEST_FILE: u64 = 64 << 20;

/// The most triangles that a model may have, instances counted: detection then takes about a gigabyte, and browsers on
/// telephones give a page no more.
pub const MOST_TRIANGLES: u64 = 1_000_000;

/// The most vertices that a file may store: three a facet of an STL.
const MOST_VERTICES: usize = 3_000_000;

/// A file that somebody chose.
#[derive(Debug, Clone)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl File {
    /// The model in it. Its bytes are kept in the model.
    pub(crate) fn model(self) -> Result<Document, Refusal> {
        let Self { name, bytes } = self;
        let limits = Limits::default().with_max_bytes(LARGEST_FILE).with_max_vertices(MOST_VERTICES);
        if bytes.len() as u64 > LARGEST_FILE {
            return Err(Refusal::TooLarge { name });
        }
        let extension = Path::new(&name).extension().and_then(OsStr::to_str).map(str::to_owned);
        let parsed = Document::parse_within(bytes, extension.as_deref(), limits);
        let model = parsed.map_err(|source| Refusal::Model { name: name.clone(), source })?;
        match model.triangles_with_instances() {
            triangles if triangles > MOST_TRIANGLES => Err(Refusal::TooMany { name, triangles }),
            _ => Ok(model),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_for_a_browser_is_refused_by_name() {
        let bytes = vec![0; LARGEST_FILE as usize + 1];
        let refusal = File { name: "scan.stl".into(), bytes }.model().unwrap_err();
        assert!(matches!(&refusal, Refusal::TooLarge { name } if name == "scan.stl"), "{refusal}");

        // Every triangle uses the same corners.
        let mut off = format!("OFF\n3 {} 0\n0 0 0\n1 0 0\n0 1 0\n", MOST_TRIANGLES + 1);
        off += &"3 0 1 2\n".repeat(MOST_TRIANGLES as usize + 1);
        let refusal = File { name: "dense.off".into(), bytes: off.into_bytes() }.model().unwrap_err();
        assert!(matches!(refusal, Refusal::TooMany { triangles: 1_000_001, .. }), "{refusal}");
    }

    #[test]
    fn a_file_that_is_no_model_is_refused_by_name() {
        let refusal = File { name: "notes.obj".into(), bytes: b"f 1 2 3\n".to_vec() }.model().unwrap_err();
        assert!(refusal.to_string().starts_with("notes.obj: "), "{refusal}");
    }
}
