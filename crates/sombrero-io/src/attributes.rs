//! The names of what a file holds beside positions and faces, and other words to be said once.

use std::collections::HashSet;

/// Names in the order they were met, each once.
#[derive(Debug, Default)]
pub(crate) struct Attributes {
    names: Vec<String>,
    // A hostile header can name a hundred thousand properties: looking through `names` would be quadratic.
    seen: HashSet<String>,
}

impl Attributes {
    /// Whether `name` is there.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.seen.contains(name)
    }

    /// Adds `name` unless it is there already.
    pub(crate) fn note(&mut self, name: &str) {
        if !self.seen.contains(name) {
            self.seen.insert(name.to_owned());
            self.names.push(name.to_owned());
        }
    }

    /// The names, first met first.
    pub(crate) fn into_names(self) -> Vec<String> {
        self.names
    }
}
