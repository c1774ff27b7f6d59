//! Hears what is said, for a program that shows it.

use std::fmt::{self, Debug, Formatter};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// Tells a function how far the work of its thread is: a stage's name, how much is done and of how much, which is 0 of 0 where
/// a stage begins and nothing is counted yet. It hears events of these targets that have the fields of ours, or a `stage` alone;
/// those that tell how long a stage took are passed over.
pub struct Listener<F> {
    targets: &'static [&'static str],
    tell: F,
}

impl<F: Fn(&str, u64, u64) + Send + Sync + 'static> Listener<F> {
    /// A subscriber of events with these targets, [`TARGET`](crate::TARGET) and others.
    pub fn new(targets: &'static [&'static str], tell: F) -> Self {
        Self { targets, tell }
    }
}

impl<F> Debug for Listener<F> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("Listener").field("targets", &self.targets).finish_non_exhaustive()
    }
}

/// The fields of an event.
#[derive(Default)]
struct Fields {
    stage: String,
    is_over: bool,
    done: u64,
    of: u64,
}

impl Visit for Fields {
    fn record_f64(&mut self, field: &Field, _: f64) {
        self.is_over |= field.name() == "seconds";
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        match field.name() {
            "done" => self.done = value,
            "of" => self.of = value,
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

impl<F: Fn(&str, u64, u64) + Send + Sync + 'static> Subscriber for Listener<F> {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        self.targets.contains(&metadata.target())
    }

    fn event(&self, event: &Event<'_>) {
        let mut fields = Fields::default();
        event.record(&mut fields);
        if !fields.is_over {
            (self.tell)(&fields.stage, fields.done, fields.of);
        }
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Progress, TARGET};
    use std::sync::{Arc, Mutex};

    #[test]
    fn steps_and_beginnings_are_heard_and_ends_are_not() {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let notes = Arc::clone(&heard);
        let listener = Listener::new(&[TARGET, "stages"], move |stage, done, of| {
            notes.lock().expect("no panic").push((stage.to_owned(), done, of));
        });
        // With one subscriber only, the first thread that comes by would be asked for all.
        let _second = tracing::Dispatch::new(Listener::new(&[], |_, _, _| ()));
        tracing::subscriber::with_default(listener, || {
            tracing::trace!(target: "stages", stage = "basis");
            Progress::new("basis", 2).advance(1);
            tracing::trace!(target: "stages", stage = "basis", seconds = 1.5);
            tracing::trace!(target: "others", stage = "lunch");
        });
        let expected = [("basis", 0, 0), ("basis", 1, 2), ("basis", 2, 2)];
        assert_eq!(*heard.lock().expect("no panic"), expected.map(|(s, done, of)| (s.to_owned(), done, of)));
    }
}
