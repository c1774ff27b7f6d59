//! The CPU time that a search may take.
//!
//! What was looked at before it ran out does not depend on w, but on the machine: so a search without a budget is the one that
//! comes out the same everywhere.

/// The end of a budget, on the clock of this process's CPU time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    end: Option<f64>,
}

impl Budget {
    /// So many CPU seconds from now; `None` is all the time there is.
    pub(crate) fn new(seconds: Option<f64>) -> Self {
        Self { end: seconds.map(|seconds| clock::seconds() + seconds) }
    }

    pub(crate) fn is_spent(self) -> bool {
        self.end.is_some_and(|end| clock::seconds() >= end)
    }
}

#[cfg(unix)]
mod clock {
    use rustix::time::{ClockId, clock_gettime};

    /// CPU time of this process, all threads together.
    pub(super) fn seconds() -> f64 {
        let now = clock_gettime(ClockId::ProcessCPUTime);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
}

#[cfg(not(unix))]
mod clock {
    use std::sync::OnceLock;
    use web_time::Instant;

    /// No more than this CPU time can have been taken: that of all threads since the first call.
    pub(super) fn seconds() -> f64 {
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64() * rayon::current_num_threads() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_spent_at_once_and_all_is_never_spent() {
        assert!(Budget::new(Some(0.0)).is_spent() && Budget::new(Some(-1.0)).is_spent());
        assert!(!Budget::new(None).is_spent() && !Budget::new(Some(1e9)).is_spent());
    }
}
