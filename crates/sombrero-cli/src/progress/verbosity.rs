//! How much is said on stderr.

use std::sync::atomic::{AtomicU8, Ordering};

/// The amount that is said on stderr while the work goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verbosity {
    /// Nothing.
    Quiet,
    /// How far the work is, to a person at a terminal.
    Usual,
    /// That, and a line for each stage that is over, whoever reads it.
    Stages,
}

/// The present one; here and not in the listener, which is installed once and for all.
static PRESENT: AtomicU8 = AtomicU8::new(Verbosity::Usual as u8);

impl Verbosity {
    /// From now on.
    pub(crate) fn set(self) {
        PRESENT.store(self as u8, Ordering::Relaxed);
    }

    /// Whether this is the present one.
    pub(super) fn is_set(self) -> bool {
        PRESENT.load(Ordering::Relaxed) == self as u8
    }
}
