//! How fast something goes, and how long the rest will take.

use std::time::{Duration, Instant};

/// The progress of something, and since when it has been going on.
#[derive(Clone, Copy)]
pub(super) struct Pace {
    /// When it was first heard of, and how much was done then.
    pub(super) first: (Instant, u64),
    pub(super) last: (Instant, u64),
    pub(super) of: u64,
}

impl Pace {
    /// `done` of so many now, and the same first moment if it has been heard of before.
    pub(super) fn new(before: Option<Self>, done: u64, of: u64, now: Instant) -> Self {
        Self { first: before.map_or((now, done), |pace| pace.first), last: (now, done), of }
    }

    /// The time that the rest takes if it goes on as it went so far; `None` before there is a twentieth to judge by, and
    /// when it should be over by now.
    pub(super) fn left(&self, now: Instant) -> Option<Duration> {
        let gained = self.last.1.saturating_sub(self.first.1);
        if gained == 0 || gained < self.of / 20 {
            return None;
        }
        let took = self.last.0.saturating_duration_since(self.first.0);
        let rest = took.as_secs_f64() * (self.of.saturating_sub(self.last.1) as f64 / gained as f64);
        let rest = rest - now.saturating_duration_since(self.last.0).as_secs_f64();
        Duration::try_from_secs_f64(rest).ok().filter(|rest| !rest.is_zero())
    }
}
