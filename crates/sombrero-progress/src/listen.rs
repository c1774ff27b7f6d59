//! What is said during some work, for tests.

use crate::TARGET;
use std::sync::{Arc, Mutex, PoisonError};
use tracing::dispatcher::{Dispatch, with_default};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// Notes `done` and `of`.
#[derive(Clone, Default)]
struct Listener(Arc<Mutex<Vec<[u64; 2]>>>);

impl Subscriber for Listener {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target() == TARGET
    }

    fn event(&self, event: &Event<'_>) {
        let mut fields = Fields([0; 2]);
        event.record(&mut fields);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(fields.0);
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

struct Fields([u64; 2]);

impl Visit for Fields {
    fn record_u64(&mut self, field: &Field, value: u64) {
        self.0[usize::from(field.name() == "of")] = value;
    }

    fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
}

/// The result of `work`, done by two threads, and every `[done, of]` that was said meanwhile.
///
/// # Panics
/// When what is said falls, changes its `of`, does not end at all of it, or when nothing is said.
pub fn heard<T: Send>(work: impl FnOnce() -> T + Send) -> (T, Vec<[u64; 2]>) {
    let listener = Listener::default();
    let dispatch = Dispatch::new(listener.clone());
    // With one listener only, `tracing` would ask no other thread than the first that comes by.
    let _second = Dispatch::new(Listener::default());
    let result = {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
        // Threads listen each on their own.
        let threads = |thread: rayon::ThreadBuilder| with_default(&dispatch, || thread.run());
        pool.build_scoped(threads, |pool| pool.install(work)).expect("two threads can be had")
    };
    let heard = listener.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
    assert!(heard.is_sorted_by(|a, b| a[0] <= b[0] && a[1] == b[1]), "{heard:?}");
    assert!(heard.last().is_some_and(|[done, of]| done == of), "{heard:?}");
    (result, heard)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Progress;
    use rayon::prelude::*;

    #[test]
    fn steps_of_any_thread_are_told_about_a_hundred_times() {
        let (_, said) = heard(|| {
            let progress = Progress::new("work", 5000);
            (0..5000).into_par_iter().for_each(|_| progress.advance(1));
        });
        assert!((50..=101).contains(&said.len()), "{}", said.len());
    }

    #[test]
    fn what_was_not_needed_counts_as_done() {
        let (_, said) = heard(|| {
            let progress = Progress::new("work", 10);
            progress.advance(2);
            progress.at_most_left(3);
            progress.reach(4);
            progress.advance(100);
        });
        assert_eq!(said, [[2, 10], [7, 10], [10, 10]]);
    }

    #[test]
    fn nothing_is_said_of_what_nobody_needs_to_hear() {
        let (_, said) = heard(|| {
            Progress::silent().advance(7);
            drop(Progress::new("work", 1));
        });
        assert_eq!(said, [[1, 1]]);
    }
}
