//! How far an extraction is, for those who listen.

/// `done` of the observations that are solved for at most are dealt with.
pub(crate) fn say(done: usize, of: usize) {
    tracing::trace!(target: "sombrero::progress", stage = "extraction", done = done as u64, of = of as u64);
}

#[cfg(test)]
mod tests {
    use crate::{Deformation, Extractor, Nuisance};
    use sombrero_basis::{Basis, BasisOptions};
    use sombrero_mesh::{Soup, repair, shapes};
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
    fn an_extraction_says_how_far_it_is() {
        let made = repair(&shapes::bust(16));
        let soup = Soup::new(made.points.clone(), made.mesh.triangles());
        let mut progressive = ProgressiveMesh::new(made.mesh, &made.points);
        let basis = Basis::new(&mut progressive, &made.points, &BasisOptions::default()).unwrap();
        let extractor = Extractor::new(&basis, 0.01, &soup).unwrap();
        let nuisance = Nuisance { deformation: Deformation::Affine, smoothing: true };
        let found: Vec<_> = soup.points.iter().copied().map(Some).collect();
        let vertices = || extractor.from_vertices(&found, nuisance).unwrap().coefficients;
        let surface = || extractor.from_surface(&soup, nuisance).unwrap().coefficients;
        let (result, said) = heard(vertices);
        assert_eq!((result, said.len()), (vertices(), 4), "and finds the same when nobody listens");
        let (result, said) = heard(surface);
        assert_eq!(result, surface());
        assert!((4..40).contains(&said.len()), "{said:?}");
    }
}
