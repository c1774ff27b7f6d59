//! How long each stage of a job took.

use serde::{Serialize, Serializer};
use std::time::Instant;

/// Stages in the order in which they ran, with wall-clock seconds. Serializes as one object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stages(pub Vec<(&'static str, f64)>);

impl Stages {
    /// Runs `work` and adds its time to that of the stage `name`.
    pub(crate) fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(Self(vec![(name, start.elapsed().as_secs_f64())]));
        result
    }

    /// Adds the stages of another job, in their order.
    pub(crate) fn add(&mut self, other: Self) {
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
