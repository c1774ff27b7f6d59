//! What is known of the work, and what of it there is to be seen.

use super::pace::Pace;
use super::words::{duration, left, short, words};
use crate::terminal::visible;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

static NOTES: Mutex<Notes> = Mutex::new(Notes::new());

/// The notes of this process. The lock is held to read or write a few numbers, never while something is drawn or waited for.
pub(super) fn notes() -> MutexGuard<'static, Notes> {
    // Whoever panicked, the notes are for looking at only.
    NOTES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The state of the work, as far as it is known.
pub(super) struct Notes {
    jobs: Vec<Job>,
    next_job: u64,
    /// Stages that have begun and are not over, innermost last.
    stages: Vec<String>,
    /// The loop that said last how far it is, unless it is over.
    last_loop: Option<(String, Pace)>,
}

struct Job {
    number: u64,
    what: String,
    since: Instant,
    parts: Option<Pace>,
}

/// The state as it is to be seen.
#[derive(Debug, PartialEq)]
pub(super) struct Shown {
    text: String,
    /// Done of all, where that is known.
    part: Option<(u64, u64)>,
    /// Percentage and time left, or the time that has gone by.
    numbers: String,
}

impl Notes {
    pub(super) const fn new() -> Self {
        Self { jobs: Vec::new(), next_job: 0, stages: Vec::new(), last_loop: None }
    }

    /// Its number, and whether it is the outermost.
    pub(super) fn begin_job(&mut self, what: String, now: Instant) -> (u64, bool) {
        let (number, outermost) = (self.next_job, self.jobs.is_empty());
        self.next_job += 1;
        self.jobs.push(Job { number, what: visible(&what), since: now, parts: None });
        (number, outermost)
    }

    pub(super) fn end_job(&mut self, number: u64) {
        self.jobs.retain(|job| job.number != number);
        if self.jobs.is_empty() {
            // A stage that panicked never said that it was over.
            self.stages.clear();
            self.last_loop = None;
        }
    }

    pub(super) fn count(&mut self, number: u64, done: u64, of: u64, now: Instant) {
        if let Some(job) = self.jobs.iter_mut().find(|job| job.number == number) {
            job.parts = Some(Pace::new(job.parts, done, of, now));
        }
    }

    pub(super) fn begin_stage(&mut self, name: String) {
        self.stages.push(name);
        self.last_loop = None;
    }

    pub(super) fn end_stage(&mut self, name: &str) {
        if let Some(i) = self.stages.iter().rposition(|stage| stage == name) {
            self.stages.remove(i);
        }
        self.last_loop = None;
    }

    pub(super) fn advance(&mut self, stage: String, done: u64, of: u64, now: Instant) {
        let known = self.last_loop.take().filter(|(name, pace)| {
            // Otherwise it is another one of the same name.
            *name == stage && pace.of == of && pace.last.1 <= done
        });
        if done < of {
            let pace = Pace::new(known.map(|(_, pace)| pace), done, of, now);
            self.last_loop = Some((stage, pace));
        }
    }

    /// The parts of the outermost job that counts them; else the innermost stage, with the loop that runs there.
    pub(super) fn shown(&self, now: Instant) -> Shown {
        if let Some((job, parts)) = self.jobs.iter().find_map(|job| Some((job, job.parts?))) {
            let text = format!("{}: {} of {}", short(&job.what), parts.last.1, parts.of);
            let numbers = parts.left(now).map_or_else(String::new, left);
            return Shown { text, part: Some((parts.last.1, parts.of)), numbers };
        }
        let stage = self.last_loop.as_ref().map(|(name, _)| name).or(self.stages.last());
        let job = self.jobs.last();
        let text = [job.map(|job| short(&job.what)), stage.map(|name| words(name).to_owned())];
        let text = text.into_iter().flatten().collect::<Vec<_>>().join(": ");
        let Some((_, pace)) = &self.last_loop else {
            let since = self.jobs.first().map_or(now, |job| job.since);
            return Shown { text, part: None, numbers: duration(now.saturating_duration_since(since)) };
        };
        let Pace { last: (_, done), of, .. } = *pace;
        let percent = format!("{:2} %", done.saturating_mul(100) / of.max(1));
        let numbers = match pace.left(now) {
            Some(time) => format!("{percent}  {}", left(time)),
            None => percent,
        };
        Shown { text, part: Some((done, of)), numbers }
    }
}

#[cfg(test)]
impl Notes {
    /// The loop that said last how far it is: its name, how much is done, and of how much.
    pub(super) fn heard(&self) -> Option<(String, u64, u64)> {
        self.last_loop.as_ref().map(|(name, pace)| (name.clone(), pace.last.1, pace.of))
    }
}

impl Shown {
    /// One line for a terminal.
    pub(super) fn line(&self, coloured: bool) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

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
}
