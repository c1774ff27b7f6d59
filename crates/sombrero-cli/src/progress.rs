//! What a person sees on stderr while they wait: the stage, how far it is, and the time left.
//!
//! The libraries say where they are as [`tracing`] events: `sombrero::stage` when a stage begins and ends,
//! `sombrero::progress` now and then in a long loop. A [`Layer`] notes them. One thread, begun by the outermost
//! [`Progress`], looks at the notes ten times a second and draws; so nothing is drawn by the threads that work.

use indicatif::{ProgressBar, ProgressStyle};
use sombrero::Stages;
use std::fmt::Debug;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::{Context, SubscriberExt};

/// Nothing is shown of what is over before.
const DELAY: Duration = Duration::from_secs(1);
/// From one look at the notes to the next.
const FRAME: Duration = Duration::from_millis(100);

/// How much is said on stderr while the work goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verbosity {
    /// Nothing.
    Quiet,
    /// How far the work is, to a person at a terminal.
    Usual,
    /// That, and a line for each stage that is over, whoever reads it.
    Stages,
}

/// The present [`Verbosity`]; here and not in the layer, which is installed once and for all.
static VERBOSITY: AtomicU8 = AtomicU8::new(Verbosity::Usual as u8);
static NOTES: Mutex<Notes> = Mutex::new(Notes::new());

/// Listens from now on. Several calls in one process are no harm; the last one decides.
pub(crate) fn install(verbosity: Verbosity) {
    VERBOSITY.store(verbosity as u8, Ordering::Relaxed);
    if is(Verbosity::Quiet) || !(is(Verbosity::Stages) || std::io::stderr().is_terminal()) {
        return;
    }
    // An error says that somebody listens already.
    let _ = tracing::subscriber::set_global_default(tracing_subscriber::registry().with(Listener));
}

fn is(verbosity: Verbosity) -> bool {
    VERBOSITY.load(Ordering::Relaxed) == verbosity as u8
}

/// The lock is held to read or write a few numbers, never while something is drawn or waited for.
fn notes() -> MutexGuard<'static, Notes> {
    // Whoever panicked, the notes are for looking at only.
    NOTES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Names a job until it is dropped. The outermost one is shown, from a second after it was made.
pub(crate) struct Progress {
    job: u64,
    /// Of the outermost.
    display: Option<(Sender<()>, JoinHandle<()>)>,
}

impl Progress {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        let (job, outermost) = notes().begin_job(what.into(), Instant::now());
        if !outermost || is(Verbosity::Quiet) || !std::io::stderr().is_terminal() {
            return Self { job, display: None };
        }
        let (end, over) = channel();
        Self { job, display: Some((end, std::thread::spawn(move || display(&over)))) }
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
        if let Some((end, thread)) = self.display.take() {
            drop(end);
            let _ = thread.join();
        }
    }
}

/// Draws until the other end of `over` is dropped.
fn display(over: &Receiver<()>) {
    let mut wait = DELAY;
    let mut bar = None;
    while over.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
        wait = FRAME;
        let shown = notes().shown(Instant::now());
        let bar = bar.get_or_insert_with(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
                bar.set_style(style);
            }
            notes().bar = Some(bar.clone());
            bar
        });
        draw(bar, &shown, is_coloured());
    }
    notes().bar = None;
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
}

/// All in one message: what is set one by one may be drawn half old and half new.
fn draw(bar: &ProgressBar, shown: &Shown, coloured: bool) {
    bar.set_message(shown.line(coloured));
    bar.tick();
}

/// See <https://no-color.org>.
fn is_coloured() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// What is known of the work.
struct Notes {
    jobs: Vec<Job>,
    next_job: u64,
    /// Stages that have begun and are not over, innermost last.
    stages: Vec<String>,
    /// The loop that said last how far it is, unless it is over.
    last_loop: Option<(String, Course)>,
    /// What is on the terminal.
    bar: Option<ProgressBar>,
}

struct Job {
    number: u64,
    what: String,
    since: Instant,
    parts: Option<Course>,
}

/// How far something is, and since when it has been going on.
#[derive(Clone, Copy)]
struct Course {
    /// When it was first heard of, and how much was done then.
    first: (Instant, u64),
    last: (Instant, u64),
    of: u64,
}

/// What there is to be seen.
#[derive(Debug, PartialEq)]
struct Shown {
    text: String,
    /// Done of all, where that is known.
    part: Option<(u64, u64)>,
    /// Percentage and time left, or the time that has gone by.
    numbers: String,
}

impl Notes {
    const fn new() -> Self {
        Self { jobs: Vec::new(), next_job: 0, stages: Vec::new(), last_loop: None, bar: None }
    }

    /// Its number, and whether it is the outermost.
    fn begin_job(&mut self, what: String, now: Instant) -> (u64, bool) {
        let (number, outermost) = (self.next_job, self.jobs.is_empty());
        self.next_job += 1;
        self.jobs.push(Job { number, what, since: now, parts: None });
        (number, outermost)
    }

    fn end_job(&mut self, number: u64) {
        self.jobs.retain(|job| job.number != number);
        if self.jobs.is_empty() {
            // A stage that panicked never said that it was over.
            self.stages.clear();
            self.last_loop = None;
        }
    }

    fn count(&mut self, number: u64, done: u64, of: u64, now: Instant) {
        if let Some(job) = self.jobs.iter_mut().find(|job| job.number == number) {
            let first = job.parts.map_or((now, done), |parts| parts.first);
            job.parts = Some(Course { first, last: (now, done), of });
        }
    }

    fn begin_stage(&mut self, name: String) {
        self.stages.push(name);
        self.last_loop = None;
    }

    fn end_stage(&mut self, name: &str) {
        if let Some(i) = self.stages.iter().rposition(|stage| stage == name) {
            self.stages.remove(i);
        }
        self.last_loop = None;
    }

    fn advance(&mut self, stage: String, done: u64, of: u64, now: Instant) {
        let known = self.last_loop.take().filter(|(name, course)| {
            // Otherwise it is another one of the same name.
            *name == stage && course.of == of && course.last.1 <= done
        });
        if done < of {
            let first = known.map_or((now, done), |(_, course)| course.first);
            self.last_loop = Some((stage, Course { first, last: (now, done), of }));
        }
    }

    /// The parts of the outermost job that counts them; else the innermost stage, with the loop that runs there.
    fn shown(&self, now: Instant) -> Shown {
        if let Some((job, parts)) = self.jobs.iter().find_map(|job| Some((job, job.parts?))) {
            let text = format!("{}: {} of {}", short(&job.what), parts.last.1, parts.of);
            let numbers = parts.left(now).map_or_else(String::new, left);
            return Shown { text, part: Some((parts.last.1, parts.of)), numbers };
        }
        let stage = self.last_loop.as_ref().map(|(name, _)| name).or(self.stages.last());
        let job = self.jobs.last();
        let text = [job.map(|job| short(&job.what)), stage.map(|name| words(name).to_owned())];
        let text = text.into_iter().flatten().collect::<Vec<_>>().join(": ");
        let Some((_, course)) = &self.last_loop else {
            let since = self.jobs.first().map_or(now, |job| job.since);
            return Shown { text, part: None, numbers: duration(now.saturating_duration_since(since)) };
        };
        let Course { last: (_, done), of, .. } = *course;
        let percent = format!("{:2} %", done.saturating_mul(100) / of.max(1));
        let numbers = match course.left(now) {
            Some(time) => format!("{percent}  {}", left(time)),
            None => percent,
        };
        Shown { text, part: Some((done, of)), numbers }
    }
}

impl Shown {
    fn line(&self, coloured: bool) -> String {
        const WIDTH: u64 = 16;
        let Self { text, part, numbers } = self;
        let Some((done, of)) = *part else { return format!("{text}  {numbers}") };
        let full = usize::try_from(done.saturating_mul(WIDTH) / of.max(1)).unwrap_or(0).min(WIDTH as usize);
        let (full, rest) = ("█".repeat(full), "░".repeat(WIDTH as usize - full));
        // The bar comes last: it may be cut off where the terminal is narrow.
        if coloured {
            format!("{text}  {numbers}  \x1b[36m{full}\x1b[0m{rest}")
        } else {
            format!("{text}  {numbers}  {full}{rest}")
        }
    }
}

impl Course {
    /// The time that the rest takes if it goes on as it went so far; `None` before there is a twentieth to judge by, and
    /// when it should be over by now.
    fn left(&self, now: Instant) -> Option<Duration> {
        let gained = self.last.1.saturating_sub(self.first.1);
        if gained == 0 || gained < self.of / 20 {
            return None;
        }
        let took = self.last.0.saturating_duration_since(self.first.0);
        let rest = took.as_secs_f64() * (self.of.saturating_sub(self.last.1) as f64 / gained as f64);
        let rest = rest - now.saturating_duration_since(self.last.0).as_secs_f64();
        Duration::try_from_secs_f64(rest).ok().filter(|rest| !rest.is_zero())
    }
}

fn left(time: Duration) -> String {
    format!("{} left", duration(time))
}

/// As precise as somebody who waits wants it.
fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        _ if seconds < 9.95 => format!("{seconds:.1} s"),
        _ if seconds < 99.5 => format!("{seconds:.0} s"),
        _ if seconds < 5970.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.0} h {:.0} min", (seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor()),
    }
}

/// Without the middle, if the numbers would not fit into 80 columns any more.
fn short(what: &str) -> String {
    let letters: Vec<char> = what.chars().collect();
    match letters.len() {
        0..=28 => what.to_owned(),
        count => letters[..12].iter().chain(&['…']).chain(&letters[count - 15..]).collect(),
    }
}

/// A stage in words that say something to whoever has not read the paper.
fn words(stage: &str) -> &str {
    match stage {
        "weld" => "joining vertices",
        "repair" => "repairing the mesh",
        "conversion" => "building the progressive mesh",
        "basis" => "computing the basis",
        "insert" => "moving vertices",
        "read back" => "reading the copy back",
        "test" => "testing the mark",
        "preparation" => "preparing the original",
        "matching" => "matching the connectivity",
        "registration" => "aligning",
        "extraction" => "reading the mark",
        "resampling" => "resampling",
        "tests" => "testing",
        other => other,
    }
}

/// Notes what the libraries say.
struct Listener;

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
                if is(Verbosity::Stages) {
                    say(&format!("{stage} {seconds:.2} s\n"));
                }
            }
            (PROGRESS, _, Some((done, of))) => notes().advance(stage, done, of, Instant::now()),
            _ => (),
        }
    }
}

/// A line on stderr, above what moves there.
fn say(line: &str) {
    let bar = notes().bar.clone();
    // Nobody there to read it is no reason to stop.
    let write = || drop(std::io::stderr().write_all(line.as_bytes()));
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Notes of a job that began now, and moments after it.
    fn begun() -> (Notes, impl Fn(f64) -> Instant) {
        let (mut notes, start) = (Notes::new(), Instant::now());
        notes.begin_job("marking vase.obj".to_owned(), start);
        (notes, move |seconds| start + Duration::from_secs_f64(seconds))
    }

    fn shown(notes: &Notes, now: Instant) -> (String, Option<(u64, u64)>, String) {
        let Shown { text, part, numbers } = notes.shown(now);
        (text, part, numbers)
    }

    #[test]
    fn a_job_and_its_stages() {
        let (mut notes, at) = begun();
        assert_eq!(shown(&notes, at(1.0)), ("marking vase.obj".into(), None, "1.0 s".into()));
        notes.begin_stage("preparation".into());
        assert_eq!(notes.shown(at(12.0)).text, "marking vase.obj: preparing the original");
        notes.begin_stage("something new".into());
        assert_eq!(
            shown(&notes, at(12.3)),
            ("marking vase.obj: something new".into(), None, "12 s".into()),
            "the innermost, and unknown names as they are"
        );
        notes.end_stage("something new");
        assert_eq!(notes.shown(at(13.0)).text, "marking vase.obj: preparing the original");
        notes.end_stage("preparation");
        assert_eq!(notes.shown(at(14.0)).text, "marking vase.obj");
    }

    #[test]
    fn a_loop_has_a_percentage_and_a_time_left() {
        let (mut notes, at) = begun();
        notes.begin_stage("preparation".into());
        notes.advance("conversion".into(), 10, 100, at(1.0));
        let text = || "marking vase.obj: building the progressive mesh".to_owned();
        assert_eq!(shown(&notes, at(1.0)), (text(), Some((10, 100)), "10 %".into()));
        notes.advance("conversion".into(), 40, 100, at(4.0));
        assert_eq!(shown(&notes, at(4.5)), (text(), Some((40, 100)), "40 %  5.5 s left".into()));
        assert_eq!(notes.shown(at(60.0)).numbers, "40 %", "overdue");
        notes.advance("conversion".into(), 100, 100, at(12.0));
        assert_eq!(shown(&notes, at(13.0)).1, None, "over");
        assert_eq!(notes.shown(at(13.0)).text, "marking vase.obj: preparing the original");
        notes.advance("basis".into(), 1, 9, at(14.0));
        notes.end_stage("preparation");
        assert_eq!(shown(&notes, at(15.0)), ("marking vase.obj".into(), None, "15 s".into()));
    }

    #[test]
    fn another_loop_of_the_same_name_starts_afresh() {
        let (mut notes, at) = begun();
        notes.advance("extraction".into(), 1, 4, at(1.0));
        notes.advance("extraction".into(), 3, 4, at(3.0));
        notes.advance("extraction".into(), 1, 4, at(9.0));
        assert_eq!(shown(&notes, at(9.0)).2, "25 %");
        notes.advance("extraction".into(), 1, 0, at(9.0));
        assert_eq!(shown(&notes, at(9.0)).1, None, "more than all is all");
    }

    #[test]
    fn parts_of_a_job_come_before_stages() {
        let (mut notes, at) = begun();
        let (inner, outermost) = notes.begin_job("copy 38".into(), at(0.5));
        assert!(!outermost);
        notes.begin_stage("insert".into());
        assert_eq!(notes.shown(at(1.0)).text, "copy 38: moving vertices");
        notes.count(0, 0, 1000, at(2.0));
        assert_eq!(shown(&notes, at(3.0)).2, "", "nothing to go by");
        notes.count(0, 250, 1000, at(6.0));
        let text = "marking vase.obj: 250 of 1000".to_owned();
        assert_eq!(shown(&notes, at(6.0)), (text, Some((250, 1000)), "12 s left".into()));
        notes.end_job(inner);
        notes.end_job(0);
        assert_eq!(shown(&notes, at(5.0)), (String::new(), None, "0.0 s".into()), "all is forgotten");
        notes.count(0, 1, 2, at(6.0));
    }

    #[test]
    fn a_line_has_a_bar_where_the_part_is_known() {
        let line = |part, coloured| {
            Shown { text: "aligning".to_owned(), part, numbers: "25 %".to_owned() }.line(coloured)
        };
        assert_eq!(line(None, true), "aligning  25 %");
        assert_eq!(line(Some((1, 4)), false), "aligning  25 %  ████░░░░░░░░░░░░");
        assert_eq!(line(Some((9, 4)), true), "aligning  25 %  \x1b[36m████████████████\x1b[0m");
        assert_eq!(line(Some((0, 0)), false), "aligning  25 %  ░░░░░░░░░░░░░░░░");
    }

    #[test]
    fn a_guess_needs_a_twentieth() {
        let (mut notes, at) = begun();
        notes.advance("registration".into(), 1, 256, at(1.0));
        notes.advance("registration".into(), 3, 256, at(2.0));
        assert_eq!(notes.shown(at(2.0)).numbers, " 1 %");
    }

    #[test]
    fn long_names_lose_their_middle() {
        assert_eq!(short("marking vase.obj"), "marking vase.obj");
        assert_eq!(short("looking at /home/müller/scans/2026/june/vase.obj"), "looking at /…6/june/vase.obj");
    }

    #[test]
    fn durations_are_rounded() {
        let shown = |seconds| duration(Duration::from_secs_f64(seconds));
        assert_eq!([0.04, 9.94, 9.96, 99.4, 99.6].map(shown), ["0.0 s", "9.9 s", "10 s", "99 s", "2 min"]);
        assert_eq!([3600.0, 7260.0].map(shown), ["60 min", "2 h 1 min"]);
    }

    #[test]
    fn events_of_any_thread_are_noted() {
        let listener = tracing_subscriber::registry().with(Listener);
        tracing::subscriber::with_default(listener, || {
            let _job = Progress::new("a test");
            let current = tracing::dispatcher::get_default(Clone::clone);
            tracing::debug!(target: STAGE, stage = "made up");
            let worker = || tracing::trace!(target: PROGRESS, stage = "made up", done = 1_u64, of = 2_u64);
            std::thread::scope(|scope| {
                scope.spawn(|| tracing::dispatcher::with_default(&current, worker));
            });
            let heard =
                notes().last_loop.as_ref().map(|(name, course)| (name.clone(), course.last.1, course.of));
            assert_eq!(heard, Some(("made up".to_owned(), 1, 2)));
            tracing::debug!(target: STAGE, stage = "made up", seconds = 0.5);
            assert!(notes().last_loop.is_none());
        });
    }
}
