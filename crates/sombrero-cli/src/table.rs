//! The lines of an answer: what came of it, then rows of a name and a value.

use crate::terminal::visible;
use std::fmt::{self, Display, Formatter};

/// Room for the name of a row.
const NAME: usize = 14;

/// Lines for people. Each is one line, whatever its text holds: see [`visible`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Table(Vec<String>);

impl Table {
    /// A table that begins with this line.
    pub(crate) fn new(head: impl Display) -> Self {
        Self::default().line(head)
    }

    /// A line that is no row.
    pub(crate) fn line(mut self, text: impl Display) -> Self {
        self.0.push(visible(&text.to_string()));
        self
    }

    /// A name and its value.
    pub(crate) fn row(self, name: &str, value: impl Display) -> Self {
        self.line(format!("  {name:<NAME$}{value}"))
    }

    /// A row of this name for each value; none or one for an `Option`.
    pub(crate) fn rows<T: Display>(self, name: &str, values: impl IntoIterator<Item = T>) -> Self {
        values.into_iter().fold(self, |table, value| table.row(name, value))
    }

    /// The rows of another table behind those of this one.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// Whether there is nothing to say.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_below_each_other() {
        let table = Table::new("marked a → b")
            .row("key", "k")
            .rows("note", ["one", "two"])
            .rows("report", None::<&str>);
        assert_eq!(
            table.to_string(),
            "marked a → b\n  key           k\n  note          one\n  note          two"
        );
        assert!(Table::default().is_empty() && Table::default().to_string().is_empty());
    }

    #[test]
    fn no_value_makes_a_line_of_its_own() {
        let table =
            Table::new("a\nFOUND: the mark").row("owner", "x\n  genuine").and(Table::new("\u{1b}[1A"));
        assert_eq!(table.to_string().lines().count(), 3);
    }
}
