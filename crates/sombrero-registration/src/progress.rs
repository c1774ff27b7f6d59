//! How far a registration is, for those who listen.
//!
//! How much a search will have to try is not known beforehand. So there is room for all that it may try, and what was not
//! needed counts as done. A step is about the time of one trial.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

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
        self.done.fetch_add(steps as u64, Ordering::Relaxed);
        self.say();
    }

    /// No more than so many steps are left: some were not needed.
    pub(crate) fn at_most_left(&self, steps: usize) {
        self.done.fetch_max(self.of.saturating_sub(steps as u64), Ordering::Relaxed);
        self.say();
    }

    fn say(&self) {
        // One thread at a time, or an older number could be said after a newer one.
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, of) = (self.done.load(Ordering::Relaxed).min(self.of), self.of);
        if done > *said {
            *said = done;
            tracing::trace!(target: "sombrero::progress", stage = "registration", done, of);
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
    use crate::{IcpOptions, Reference, RegisterOptions, align, refine_affine, register, register_affine};
    use sombrero_mesh::shapes;
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
    fn a_search_says_how_far_it_is() {
        let (soup, other) = (shapes::part(3), shapes::torus(24, 12, 2.0, 0.7));
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let options = RegisterOptions::default();
        for suspect in [&soup, &other] {
            let similar = || register(&reference, &suspect.points, &suspect.triangles, &options).unwrap();
            let (result, heard_of) = heard(similar);
            assert!((5..200).contains(&heard_of.len()), "{}", heard_of.len());
            assert_eq!(result, similar(), "and finds the same when nobody listens");
        }
        let stretched = || register_affine(&reference, &soup.points, &soup.triangles, &options).unwrap();
        assert_eq!(heard(stretched).0, stretched());
    }

    #[test]
    fn a_refinement_says_how_far_it_is() {
        let soup = shapes::part(3);
        let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
        let (start, options) = (nalgebra::Similarity3::identity(), IcpOptions::default());
        let aligned = || align(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
        let refined = || refine_affine(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
        assert_eq!(heard(aligned), (aligned(), vec![[1, 3], [2, 3], [3, 3]]));
        assert_eq!(heard(refined), (refined(), vec![[1, 3], [2, 3], [3, 3]]));
    }
}
