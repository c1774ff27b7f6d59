//! What a command says when it ran well, and how that is printed.

use crate::desk::Desk;
use crate::failure::Failure;
use crate::table::Table;
use crate::terminal::say;
use serde::Serialize;
use serde_json::Value;
use sombrero::io::Limits;
use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// The answer of a command that ran well.
pub(crate) struct Answer {
    /// For people.
    pub(crate) text: Table,
    /// For programs.
    pub(crate) json: Value,
    /// The exit status.
    pub(crate) status: u8,
}

/// The exit status of a command that ran well and found no watermark, or that a report does not hold.
const NOT_FOUND: u8 = 1;

impl Answer {
    /// An answer with status 0.
    pub(crate) fn new(text: Table, json: &impl Serialize) -> Result<Self, Failure> {
        let json = serde_json::to_value(json).map_err(|e| Failure::new("internal", e.to_string()))?;
        Ok(Self { text, json, status: 0 })
    }

    /// This answer, with status 1 unless `found`.
    pub(crate) fn found_if(self, found: bool) -> Self {
        Self { status: if found { 0 } else { NOT_FOUND }, ..self }
    }
}

/// The settings that every command has beside its own arguments.
#[derive(Clone, Copy)]
pub(crate) struct Context<'a> {
    /// Limits of what is read of a mesh file.
    pub(crate) limits: Limits,
    /// Whether answers are for programs.
    pub(crate) json: bool,
    /// Whether people want nothing but errors.
    pub(crate) quiet: bool,
    /// What is in memory.
    pub(crate) desk: &'a Desk,
    /// Where answers go instead of being printed.
    pub(crate) collected: Option<&'a Mutex<Vec<Value>>>,
}

impl Context<'_> {
    /// Prints an answer, or a failure where an answer was expected, and gives its exit status. `aside`: standard output
    /// belongs to a file.
    pub(crate) fn print(&self, answer: &Answer, aside: bool) -> Result<u8, Failure> {
        if self.collect(|| answer.json.clone()) {
            return Ok(answer.status);
        }
        let shown = if self.json { answer.json.to_string() } else { answer.text.to_string() };
        let silent = !self.json && (self.quiet || answer.text.is_empty());
        let said = match (silent, aside) {
            (true, _) => Ok(()),
            (false, false) => say(&shown),
            (false, true) => writeln!(std::io::stderr(), "{shown}"),
        };
        said.map(|()| answer.status).map_err(|e| {
            Failure::new("write", format!("the answer cannot be printed ({e}); free some space"))
        })
    }
}

impl Context<'_> {
    /// Tells of a failure as one of several answers: in JSON the object also names the input by its role.
    pub(crate) fn report(&self, failure: &Failure, role: &str, input: &Path) {
        let object = || serde_json::json!({ role: input.display().to_string(), "error": failure });
        if !self.collect(object) {
            failure.print(&object(), self.json);
        }
    }

    /// Keeps an answer for the program that called, if one did.
    fn collect(&self, answer: impl FnOnce() -> Value) -> bool {
        if let Some(collected) = self.collected {
            collected.lock().unwrap_or_else(PoisonError::into_inner).push(answer());
        }
        self.collected.is_some()
    }
}

/// The end of a command: one answer, or lines that were printed as they came and the worst of their statuses.
pub(crate) enum Outcome {
    /// To be printed.
    Answer(Answer),
    /// To be printed where it is out of the way: standard output was a file.
    Aside(Answer),
    /// All was said.
    Printed(u8),
}
