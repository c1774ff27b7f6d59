//! What ends a command with status 2: one sentence, and a word for programs.

use crate::terminal::{complain, say};
use serde::Serialize;
use sombrero::io::{ParseError, ReadError};
use std::error::Error;
use std::fmt::{self, Display, Formatter};
use std::path::Path;

/// A failure. Serializes as the object under `error`.
#[derive(Debug, Clone, Serialize)]
pub struct Failure {
    /// One word for programs: usage, read, write, mesh, key, keys, secret, recipients, prepared, suspect,
    /// needs_resampling, attack, report, timestamp, catalogue, vault, passphrase, internal.
    kind: &'static str,
    /// One sentence: what and where it is, and what to do about it.
    message: String,
}

impl Failure {
    pub(crate) fn new(kind: &'static str, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// For errors that do not name their file themselves.
    pub(crate) fn about(kind: &'static str, path: &Path, error: &dyn std::error::Error) -> Self {
        Self::new(kind, format!("{}: {error}", path.display()))
    }

    /// The sentence, without an end.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The word for programs.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// Prints it and gives the exit status.
    pub(crate) fn report(&self, json: bool) -> u8 {
        self.print(&serde_json::json!({ "error": self }), json);
        2
    }

    /// Prints it, or for programs this object.
    pub(crate) fn print(&self, object: &serde_json::Value, json: bool) {
        if json {
            // When nobody listens the status still tells.
            let _ = say(&object.to_string());
        } else {
            complain(&self.message);
        }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Failure {}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        // The library does not know what its limits are called here.
        let option = match &error {
            ReadError::TooLarge { .. } => "--max-bytes",
            ReadError::Parse { source: ParseError::TooManyVertices { .. }, .. } => "--max-vertices",
            _ => "the limit",
        };
        Self::new("read", error.to_string().replace("raise the limit", &format!("raise {option}")))
    }
}

impl From<sombrero::io::WriteError> for Failure {
    fn from(error: sombrero::io::WriteError) -> Self {
        // The library does not know how it is allowed here.
        Self::new("write", error.to_string().replace("allow overwriting", "give --force"))
    }
}
