//! How long each stage of a job took. The clock is the one of `std`, and in a browser that of the page.

use serde::{Serialize, Serializer};
use web_time::Instant;

/// Stages in the order in which they ran, with wall-clock seconds. Serializes as one object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stages(pub Vec<(&'static str, f64)>);

impl Stages {
    /// The target of the events that tell of stages.
    pub const TARGET: &'static str = "sombrero::stage";

    /// Runs `work` and adds its time to that of the stage `name`. Who listens to [`Stages::TARGET`] is told when it begins
    /// and, with its seconds, when it is over.
    pub fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        tracing::debug!(target: Stages::TARGET, stage = name);
        let start = Instant::now();
        let result = work();
        let seconds = start.elapsed().as_secs_f64();
        tracing::debug!(target: Stages::TARGET, stage = name, seconds);
        self.add(Self(vec![(name, seconds)]));
        result
    }

    /// Adds the stages of another job, in their order.
    pub fn add(&mut self, other: Self) {
        for (name, seconds) in other.0 {
            match self.0.iter_mut().find(|stage| stage.0 == name) {
                Some(stage) => stage.1 += seconds,
                None => self.0.push((name, seconds)),
            }
        }
    }

    /// All stages together.
    pub fn total(&self) -> f64 {
        self.0.iter().map(|stage| stage.1).sum()
    }
}

impl Serialize for Stages {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};
    use tracing::field::{Field, Visit};
    use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

    /// Notes the fields of all events.
    #[derive(Clone, Default)]
    struct Listener(Arc<Mutex<String>>);

    impl<S: tracing::Subscriber> Layer<S> for Listener {
        fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
            if event.metadata().target() == "sombrero::stage" {
                event.record(&mut Fields(&mut self.0.lock().unwrap()));
            }
        }
    }

    struct Fields<'a>(&'a mut String);

    impl Visit for Fields<'_> {
        fn record_f64(&mut self, field: &Field, value: f64) {
            assert!(value >= 0.0);
            self.0.push_str(&format!("{} ", field.name()));
        }

        fn record_str(&mut self, _: &Field, value: &str) {
            self.0.push_str(&format!("{value} "));
        }

        fn record_debug(&mut self, _: &Field, _: &dyn std::fmt::Debug) {}
    }

    #[test]
    fn stages_say_when_they_begin_and_end() {
        let listener = Listener::default();
        // With one listener only, `tracing` would ask no other thread than the first that comes by.
        let _second = tracing::Dispatch::new(tracing_subscriber::registry());
        let mut stages = Stages::default();
        tracing::subscriber::with_default(tracing_subscriber::registry().with(listener.clone()), || {
            let inner = stages.time("outer", || Stages::default().time("inner", || 7));
            assert_eq!(inner, 7);
        });
        assert_eq!(*listener.0.lock().unwrap(), "outer inner inner seconds outer seconds ");
        assert_eq!(stages.0.len(), 1);
    }
}
