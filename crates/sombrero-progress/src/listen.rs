//! What is said during some work, for tests.

use crate::{Listener, TARGET};
use std::sync::{Arc, Mutex, PoisonError};
use tracing::dispatcher::{Dispatch, with_default};

/// The result of `work`, done by two threads, and every `[done, of]` that was said meanwhile.
///
/// # Panics
/// When what is said falls, changes its `of`, does not end at all of it, or when nothing is said.
pub fn heard<T: Send>(work: impl FnOnce() -> T + Send) -> (T, Vec<[u64; 2]>) {
    let said = Arc::new(Mutex::new(Vec::new()));
    let notes = Arc::clone(&said);
    let note = move |_: &str, done, of| {
        notes.lock().unwrap_or_else(PoisonError::into_inner).push([done, of]);
    };
    let dispatch = Dispatch::new(Listener::new(&[TARGET], note));
    // With one listener only, `tracing` would ask no other thread than the first that comes by.
    let _second = Dispatch::new(Listener::new(&[], |_, _, _| ()));
    let result = {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
        // Threads listen each on their own.
        let threads = |thread: rayon::ThreadBuilder| with_default(&dispatch, || thread.run());
        pool.build_scoped(threads, |pool| pool.install(work)).expect("two threads can be had")
    };
    let heard = said.lock().unwrap_or_else(PoisonError::into_inner).clone();
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
