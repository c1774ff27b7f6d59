//! Work on threads of its own, while Python goes on: the interpreter is released, Ctrl-C and a callback that raises end it.

use crate::error::of_kind;
use pyo3::prelude::*;
use sombrero::Stages;
use sombrero::progress::{Listener, TARGET};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use tracing::dispatcher::{Dispatch, with_default};

/// From one look at signals to the next.
const PATIENCE: Duration = Duration::from_millis(50);

/// The course of one call.
#[derive(Default)]
pub(crate) struct Course {
    callback: Option<Py<PyAny>>,
    stopped: AtomicBool,
    /// Why it was stopped.
    raised: Mutex<Option<PyErr>>,
}

/// What unwinds the threads of a call that was stopped.
struct Stopped;

impl Course {
    /// Tells the callback; unwinds if the call was stopped.
    pub(crate) fn tell(&self, stage: &str, done: u64, of: u64) {
        if let Some(callback) = self.callback.as_ref().filter(|_| !self.is_stopped()) {
            let told = Python::attach(|py| callback.call1(py, (stage, done, of)));
            if let Err(error) = told {
                self.stop(error);
            }
        }
        // While a thread unwinds, what it drops may speak; a second panic would end the process.
        if self.is_stopped() && !std::thread::panicking() {
            resume_unwind(Box::new(Stopped));
        }
    }

    fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    fn stop(&self, error: PyErr) {
        self.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.stopped.store(true, Ordering::Relaxed);
    }
}

/// The result of `work`, done on so many threads (all cores by default), with the interpreter released. `callback` is called
/// with a stage's name, how much is done and of how much; 0 of 0 where that is not known.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    callback: Option<Py<PyAny>>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let course = Arc::new(Course { callback, ..Course::default() });
    let dispatch = listener(&course);
    keep_a_second();
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let (end, over) = channel::<()>();
            let worker = scope.spawn(|| {
                let _end = end;
                catch_unwind(AssertUnwindSafe(|| on_threads(threads, &dispatch, work)))
            });
            while over.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                if let Err(error) = Python::attach(|py| py.check_signals()) {
                    course.stop(error);
                }
            }
            worker.join()
        })
    });
    if let Some(error) = course.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(error);
    }
    match done {
        Ok(Ok(Ok(result))) => Ok(result),
        Ok(Ok(Err(error))) => {
            Err(of_kind(py, "usage", &format!("threads={} cannot be had: {error}", threads.unwrap_or(0))))
        }
        Ok(Err(panic)) | Err(panic) => Err(of_kind(py, "internal", &words(&*panic))),
    }
}

/// What tells the callback of a call what its threads say.
fn listener(course: &Arc<Course>) -> Dispatch {
    let course = Arc::clone(course);
    Dispatch::new(Listener::new(&[Stages::TARGET, TARGET], move |stage, done, of| {
        course.tell(stage, done, of)
    }))
}

fn on_threads<T: Send>(
    threads: Option<usize>,
    dispatch: &Dispatch,
    work: impl FnOnce() -> T + Send,
) -> Result<T, rayon::ThreadPoolBuildError> {
    // 0: as many as there are cores, or as RAYON_NUM_THREADS says.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0));
    let listening = |thread: rayon::ThreadBuilder| with_default(dispatch, || thread.run());
    pool.build_scoped(listening, |pool| pool.install(work))
}

/// With one subscriber only, `tracing` would take the answer of whichever thread comes by first for all of them.
fn keep_a_second() {
    static SECOND: OnceLock<Dispatch> = OnceLock::new();
    SECOND.get_or_init(|| listener(&Arc::default()));
}

fn words(panic: &(dyn Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().copied();
    let said =
        said.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("it did not say why");
    format!("sombrero failed where it must not: {said}; please report it with the input")
}
