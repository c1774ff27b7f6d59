//! What a person sees on stderr while they wait: the stage, how far it is, and the time left.
//!
//! The libraries say where they are as [`tracing`] events: `sombrero::stage` when a stage begins and ends,
//! `sombrero::progress` now and then in a long loop. A [`Listener`] notes them, and the [`Display`] of the outermost
//! [`Progress`] shows what the notes say.

mod display;
mod listener;
mod notes;
mod pace;
mod verbosity;
mod words;

pub(crate) use verbosity::Verbosity;

use display::Display;
use listener::Listener;
use notes::notes;
use std::io::IsTerminal;
use std::time::Instant;
use tracing_subscriber::layer::SubscriberExt;

/// Listens from now on. Several calls in one process are no harm; the last one decides.
pub(crate) fn install(verbosity: Verbosity) {
    verbosity.set();
    if verbosity == Verbosity::Quiet || !(verbosity == Verbosity::Stages || std::io::stderr().is_terminal()) {
        return;
    }
    // An error says that somebody listens already.
    let _ = tracing::subscriber::set_global_default(tracing_subscriber::registry().with(Listener));
}

/// Names a job until it is dropped. The outermost one is shown.
pub(crate) struct Progress {
    job: u64,
    /// Of the outermost.
    _display: Option<Display>,
}

impl Progress {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        let (job, outermost) = notes().begin_job(what.into(), Instant::now());
        let shown = outermost && !Verbosity::Quiet.is_set() && std::io::stderr().is_terminal();
        Self { job, _display: shown.then(Display::new) }
    }

    /// So many parts of this job are done. They are shown instead of the stages. The time left is guessed from what is done
    /// after the first call.
    pub(crate) fn count(&self, done: usize, of: usize) {
        notes().count(self.job, done as u64, of as u64, Instant::now());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        notes().end_job(self.job);
    }
}
