//! A spinner on stderr for work that lasts over a second, when a person is looking.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Shown from one second after it was made until it is dropped.
pub(crate) struct Progress {
    done: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Progress {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        if !std::io::stderr().is_terminal() {
            return Self { done: None, thread: None };
        }
        let (done, wait) = channel::<()>();
        let what = what.into();
        let show = move || {
            // An error other than a time-out means that the work is over.
            if wait.recv_timeout(Duration::from_secs(1)) != Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                return;
            }
            let bar = ProgressBar::new_spinner().with_message(what);
            let template = if std::env::var_os("NO_COLOR").is_some() {
                "{spinner} {msg} ({elapsed})"
            } else {
                "{spinner:.cyan} {msg} {elapsed:.dim}"
            };
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            // Ends when the sender is dropped.
            let _ = wait.recv();
            bar.finish_and_clear();
        };
        Self { done: Some(done), thread: Some(std::thread::spawn(show)) }
    }
}

impl Progress {
    pub(crate) fn count(&self, _done: usize, _of: usize) {}
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.done.take();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
