#![doc = include_str!("../README.md")]

#[cfg(feature = "listen")]
mod listen;
mod listener;

#[cfg(feature = "listen")]
pub use listen::heard;
pub use listener::Listener;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// The target of all events.
pub const TARGET: &str = "sombrero::progress";

/// How often it is said at most, but for the end.
const NEWS: u64 = 100;

/// Counts steps in any thread. What it says never falls, and ends at all of them when it is dropped.
#[derive(Debug)]
pub struct Progress {
    stage: &'static str,
    of: u64,
    done: AtomicU64,
    said: Mutex<u64>,
}

impl Progress {
    /// A counter of `of` steps at most; those that were not needed count as done in the end. `stage` names the work.
    pub fn new(stage: &'static str, of: usize) -> Self {
        Self { stage, of: of as u64, done: AtomicU64::new(0), said: Mutex::new(0) }
    }

    /// A counter that says nothing.
    pub fn silent() -> Self {
        Self::new("", 0)
    }

    /// Adds `steps` to what is done.
    pub fn advance(&self, steps: usize) {
        let before = self.done.fetch_add(steps as u64, Ordering::Relaxed);
        self.say_if_news(before, before.saturating_add(steps as u64));
    }

    /// Raises what is done to `done` steps; fewer than before change nothing.
    pub fn reach(&self, done: usize) {
        let before = self.done.fetch_max(done as u64, Ordering::Relaxed);
        self.say_if_news(before, done as u64);
    }

    /// Raises what is done so far that `steps` are left at most: the others were not needed.
    pub fn at_most_left(&self, steps: usize) {
        self.reach(usize::try_from(self.of).unwrap_or(usize::MAX).saturating_sub(steps));
    }

    fn say_if_news(&self, before: u64, after: u64) {
        let part = |done: u64| done.saturating_mul(NEWS) / self.of.max(1);
        if part(before) < part(after) {
            self.say();
        }
    }

    fn say(&self) {
        // One thread at a time, or an older number could be said after a newer one.
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, of) = (self.done.load(Ordering::Relaxed).min(self.of), self.of);
        if done > *said {
            *said = done;
            tracing::trace!(target: TARGET, stage = self.stage, done, of);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        *self.done.get_mut() = self.of;
        self.say();
    }
}
