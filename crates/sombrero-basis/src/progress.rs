//! How far a basis is, for those who listen.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// How often it is said at most.
const NEWS: u64 = 100;

/// Counts steps in any thread. What it says never falls, and ends at all of them when it is dropped.
pub(crate) struct Progress {
    of: u64,
    done: AtomicU64,
    said: Mutex<u64>,
}

impl Progress {
    pub(crate) fn new(of: usize) -> Self {
        Self { of: of as u64, done: AtomicU64::new(0), said: Mutex::new(0) }
    }

    /// For work that nobody needs to hear of.
    pub(crate) fn silent() -> Self {
        Self::new(0)
    }

    /// So many more steps are done.
    pub(crate) fn advance(&self, steps: usize) {
        let before = self.done.fetch_add(steps as u64, Ordering::Relaxed);
        let part = |done: u64| done.saturating_mul(NEWS) / self.of.max(1);
        if part(before) != part(before + steps as u64) {
            self.say();
        }
    }

    fn say(&self) {
        // One thread at a time, or an older number could be said after a newer one.
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, of) = (self.done.load(Ordering::Relaxed).min(self.of), self.of);
        if done > *said {
            *said = done;
            tracing::trace!(target: "sombrero::progress", stage = "basis", done, of);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        *self.done.get_mut() = self.of;
        self.say();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Basis, BasisOptions};
    use sombrero_mesh::{repair, shapes};
    use sombrero_progressive::ProgressiveMesh;
    use std::sync::Arc;
    use tracing::dispatcher::{Dispatch, with_default};
    use tracing::field::{Field, Visit};
    use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

    /// Notes `done` and `of`.
    #[derive(Clone, Default)]
    struct Listener(Arc<std::sync::Mutex<Vec<[u64; 2]>>>);

    impl<S: tracing::Subscriber> Layer<S> for Listener {
        fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
            if event.metadata().target() == "sombrero::progress" {
                let mut fields = Fields([0; 2]);
                event.record(&mut fields);
                self.0.lock().unwrap().push(fields.0);
            }
        }
    }

    struct Fields([u64; 2]);

    impl Visit for Fields {
        fn record_u64(&mut self, field: &Field, value: u64) {
            self.0[usize::from(field.name() == "of")] = value;
        }

        fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
    }

    /// The result of `work`, and what was said meanwhile: it never falls, and ends at all of it.
    fn heard<T: Send>(work: impl FnOnce() -> T + Send) -> (T, Vec<[u64; 2]>) {
        let listener = Listener::default();
        let dispatch = Dispatch::new(tracing_subscriber::registry().with(listener.clone()));
        // With one listener only, `tracing` would ask no other thread than the first that comes by.
        let _second = Dispatch::new(tracing_subscriber::registry());
        let result = {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
            // Threads listen each on their own.
            let threads = |thread: rayon::ThreadBuilder| with_default(&dispatch, || thread.run());
            pool.build_scoped(threads, |pool| pool.install(work)).unwrap()
        };
        let heard = listener.0.lock().unwrap().clone();
        assert!(heard.is_sorted_by(|a, b| a[0] <= b[0] && a[1] == b[1]), "{heard:?}");
        assert!(heard.last().is_some_and(|[done, of]| done == of), "{heard:?}");
        (result, heard)
    }

    #[test]
    fn a_basis_says_how_far_it_is() {
        let made = repair(&shapes::bumpy_sphere(3000));
        let progressive = ProgressiveMesh::new(made.mesh, &made.points);
        for coefficients in [7, 50, 200] {
            let options = BasisOptions { coefficients, ..BasisOptions::default() };
            let basis = || Basis::new(&mut progressive.clone(), &made.points, &options).unwrap();
            let (result, heard) = heard(basis);
            assert!((50..=101).contains(&heard.len()), "{}", heard.len());
            assert_eq!(result, basis(), "and is the same when nobody listens");
        }
    }

    #[test]
    fn threads_say_nothing_old() {
        let (_, heard) = heard(|| {
            let progress = Progress::new(10_000);
            rayon::scope(|scope| {
                (0..4).for_each(|_| scope.spawn(|_| (0..2600).for_each(|_| progress.advance(1))))
            });
        });
        assert!((50..=101).contains(&heard.len()), "{}", heard.len());
    }
}
