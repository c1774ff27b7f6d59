//! The line that moves on a terminal: indicatif draws it ten times a second from the notes, so that nothing is drawn by the
//! threads that work.

use super::notes::notes;
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::io::Write as _;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Nothing is shown of what is over before.
const DELAY: Duration = Duration::from_secs(1);
/// From one look at the notes to the next.
const FRAME: Duration = Duration::from_millis(100);

/// What is on the terminal.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

fn bar() -> MutexGuard<'static, Option<ProgressBar>> {
    BAR.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line that is shown from a second after it was made until it is dropped.
pub(super) struct Display(Option<(Sender<()>, JoinHandle<()>)>);

impl Display {
    pub(super) fn new() -> Self {
        let (end, over) = channel();
        Self(Some((end, std::thread::spawn(move || show(&over)))))
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        if let Some((end, thread)) = self.0.take() {
            drop(end);
            let _ = thread.join();
        }
    }
}

/// Shows the line until the other end of `over` is dropped.
fn show(over: &Receiver<()>) {
    if over.recv_timeout(DELAY) != Err(RecvTimeoutError::Timeout) {
        return;
    }
    let shown = ProgressBar::new_spinner().with_style(style());
    shown.enable_steady_tick(FRAME);
    *bar() = Some(shown.clone());
    let _ = over.recv();
    *bar() = None;
    shown.finish_and_clear();
}

/// The spinner is indicatif's, the rest is read from the notes whenever it draws.
fn style() -> ProgressStyle {
    let coloured = is_coloured();
    let line = move |_: &ProgressState, line: &mut dyn std::fmt::Write| {
        let _ = write!(line, "{}", notes().shown(Instant::now()).line(coloured));
    };
    let style = ProgressStyle::with_template("{spinner} {line}");
    style.unwrap_or_else(|_| ProgressStyle::default_spinner()).with_key("line", line)
}

/// See <https://no-color.org>.
fn is_coloured() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// A line on stderr, above what moves there.
pub(super) fn say(line: &str) {
    let bar = bar().clone();
    // Nobody there to read it is no reason to stop.
    let write = || drop(std::io::stderr().write_all(line.as_bytes()));
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}
