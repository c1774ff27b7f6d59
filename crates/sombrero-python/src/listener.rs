//! What the libraries say of their progress, told to a function of Python's.

use crate::work::Course;
use sombrero::Stages;
use std::fmt::Debug;
use std::sync::Arc;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Metadata, Subscriber};

/// Hears stages and progress of one call: its threads, and no others, have it as their subscriber.
pub(crate) struct Listener(pub(crate) Arc<Course>);

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

impl Subscriber for Listener {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        [Stages::TARGET, sombrero::progress::TARGET].contains(&metadata.target())
    }

    fn event(&self, event: &Event<'_>) {
        let mut fields = Fields::default();
        event.record(&mut fields);
        if !fields.is_over {
            self.0.tell(&fields.stage, fields.done, fields.of);
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
