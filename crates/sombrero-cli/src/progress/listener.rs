//! Notes what the libraries say.

use super::display::say;
use super::notes::notes;
use super::verbosity::Verbosity;
use sombrero::Stages;
use std::fmt::Debug;
use std::time::Instant;
use tracing::field::{Field, Visit};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::Context;

/// A layer that takes down stages and progress.
pub(super) struct Listener;

/// The fields of an event.
#[derive(Default)]
struct Fields {
    stage: String,
    seconds: Option<f64>,
    done: Option<u64>,
    of: Option<u64>,
}

impl Visit for Fields {
    fn record_f64(&mut self, field: &Field, value: f64) {
        if field.name() == "seconds" {
            self.seconds = Some(value);
        }
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        match field.name() {
            "done" => self.done = Some(value),
            "of" => self.of = Some(value),
            _ => (),
        }
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "stage" {
            value.clone_into(&mut self.stage);
        }
    }

    fn record_debug(&mut self, _: &Field, _: &dyn Debug) {}
}

const STAGE: &str = Stages::TARGET;
const PROGRESS: &str = sombrero::progress::TARGET;

impl<S: Subscriber> Layer<S> for Listener {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        // What other libraries say costs nothing then.
        if [STAGE, PROGRESS].contains(&metadata.target()) { Interest::always() } else { Interest::never() }
    }

    fn enabled(&self, metadata: &Metadata<'_>, _: Context<'_, S>) -> bool {
        [STAGE, PROGRESS].contains(&metadata.target())
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::from_level(Level::TRACE))
    }

    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut fields = Fields::default();
        event.record(&mut fields);
        let Fields { stage, seconds, done, of } = fields;
        match (event.metadata().target(), seconds, done.zip(of)) {
            (STAGE, None, _) => notes().begin_stage(stage),
            (STAGE, Some(seconds), _) => {
                notes().end_stage(&stage);
                if Verbosity::Stages.is_set() {
                    say(&format!("{stage} {seconds:.2} s\n"));
                }
            }
            (PROGRESS, _, Some((done, of))) => notes().advance(stage, done, of, Instant::now()),
            _ => (),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing_subscriber::layer::SubscriberExt;

    #[test]
    fn events_of_any_thread_are_noted() {
        let listener = tracing_subscriber::registry().with(Listener);
        tracing::subscriber::with_default(listener, || {
            let (job, _) = notes().begin_job("a test".to_owned(), Instant::now());
            let current = tracing::dispatcher::get_default(Clone::clone);
            tracing::debug!(target: STAGE, stage = "made up");
            let worker = || tracing::trace!(target: PROGRESS, stage = "made up", done = 1_u64, of = 2_u64);
            std::thread::scope(|scope| {
                scope.spawn(|| tracing::dispatcher::with_default(&current, worker));
            });
            assert_eq!(notes().heard(), Some(("made up".to_owned(), 1, 2)));
            tracing::debug!(target: STAGE, stage = "made up", seconds = 0.5);
            notes().end_job(job);
            assert!(notes().heard().is_none());
        });
    }
}
