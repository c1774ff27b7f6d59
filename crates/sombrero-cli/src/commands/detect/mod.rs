//! `sombrero detect`: one suspect, or several against one original.

pub(crate) mod args;
mod looker;

use crate::answer::{Answer, Context, Outcome};
use crate::batch::{self, Words};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use args::{Args, Plan, Prepared};
use looker::Looker;
use sombrero::io::{Access, Document, Limits, Output};
use sombrero::watermark::Key;
use sombrero::{
    Claim, Commitment, DetectError, Detection, Detector, FirstLook, Glancer, PreparedBasis, SearchError,
};
use sombrero_report::{Evidence, FileHash, MEASURED, Remark, Report, page, record};
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError, RwLock, RwLockReadGuard};
use std::time::Instant;

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    let plan = Plan::new(args)?;
    let progress = Progress::new(format!("reading {}", plan.original.display()));
    let job = Job::new(plan, context)?;
    drop(progress);
    let plan = &job.plan;
    if let Some(folder) = &plan.folder {
        files::make_folder(folder)?;
    }
    match plan.suspects.as_slice() {
        [(suspect, page)] if plan.one => {
            Ok(Outcome::Answer(job.look(suspect, page.clone()?.as_deref(), context)?))
        }
        suspects => batch::each(suspects, &WORDS, context, |suspect, page| {
            let page = page.clone()?;
            // A suspect of a subfolder has its page in one.
            if let Some(folder) = page.as_deref().and_then(Path::parent) {
                files::make_folder(folder)?;
            }
            job.look(suspect, page.as_deref(), context)
        }),
    }
}

/// What became of several suspects.
const WORDS: Words =
    Words { role: "suspect", outcomes: [Some("found"), None, Some("not found")], failed: "refused" };

/// An original and a key that any number of suspects are held against, several at once where a program asks for that.
pub(crate) struct Job {
    plan: Plan,
    /// What the key's file holds.
    mark: Key,
    looker: RwLock<Looker>,
    /// Whether the basis came from a prepared file, and what is to be said of it.
    from_file: bool,
    note: Option<String>,
    /// Whether the basis was derived anew, which the first mark that is found asks for.
    confirmed: OnceLock<()>,
    original: FileHash,
    key: FileHash,
    /// The key's timestamp, verified.
    commitment: Option<Commitment>,
    /// Seconds.
    preparation: Mutex<f64>,
}

impl Job {
    /// The job of what was typed.
    pub(crate) fn of(args: &Args, context: &Context) -> Result<Self, Failure> {
        Self::new(Plan::new(args)?, context)
    }

    fn new(plan: Plan, context: &Context) -> Result<Self, Failure> {
        let bytes = files::key_file(&plan.key, context.desk)?;
        let key = files::parse_key(&plan.key, &bytes)?;
        let original = files::read_mesh(&plan.original, context)?;
        let (stored, note) = stored(&plan.prepared, &key, context.limits)?;
        let from_file = stored.is_some();
        let start = Instant::now();
        let mark = key.clone();
        let glancer = Glancer::new(&original, key).map_err(|e| failure(&plan, &plan.original, &e))?;
        // The key was made for a file with this hash, and that was checked.
        let original_sha256 = hex::encode(mark.original_sha256);
        let anchors = timestamp::anchors(plan.ca.as_deref())?;
        let stamp = timestamp::of_key(&plan.key, &mark, &anchors)?;
        Ok(Self {
            original: FileHash { path: plan.original.display().to_string(), sha256: original_sha256 },
            key: FileHash::new(plan.key.display().to_string(), &bytes),
            plan,
            mark,
            looker: RwLock::new(Looker::Glancer(Box::new(glancer), stored)),
            from_file,
            note,
            confirmed: OnceLock::new(),
            commitment: stamp.as_ref().map(Stamp::commitment),
            preparation: Mutex::new(start.elapsed().as_secs_f64()),
        })
    }

    /// Looks at one suspect, and writes its page to `report_path`.
    pub(crate) fn look(
        &self,
        path: &Path,
        report_path: Option<&Path>,
        context: &Context,
    ) -> Result<Answer, Failure> {
        let plan = &self.plan;
        let _progress = Progress::new(format!("looking at {}", path.display()));
        let file = files::read_mesh(path, context)?;
        let evidence = self.evidence(path, &file);
        let suspect = self.looker().suspect(&file).ok_or_else(|| self.unusable())?;
        // Detection needs the memory.
        drop(file);
        let settings = &evidence.settings;
        let first = self.looker().look(&suspect, settings);
        let detection = match first {
            Ok(FirstLook::AnotherShape(answer)) => Ok(*answer),
            Ok(FirstLook::Open(glance)) => self.detector()?.detect_after(glance, &suspect, settings),
            Err(error) => Err(error),
        };
        let mut detection = detection.map_err(|e| failure(plan, path, &e))?;
        detection.seconds.0.insert(0, ("preparation", self.preparation()));
        let mut remark = self.note.as_ref().map(|_| Remark::Unused);
        if detection.detected && self.from_file {
            remark = self.vouch()?;
        }
        detection.warnings.extend(remark.map(|remark| remark.sentence().to_owned()));
        let looker = self.looker();
        let original = looker.model().ok_or_else(|| self.unusable())?;
        let claim = Claim::new(
            detection.detected,
            detection.log10_p,
            &self.mark,
            self.commitment.clone(),
            &evidence.settings,
        );
        let report = Report {
            detection: &detection,
            claim: &claim,
            key: &self.mark,
            original,
            suspect: &suspect.soup,
            prepared: self.from_file,
            evidence: &evidence,
        };
        let (mut text, mut json) = (text(path, &detection, &claim), record(&report));
        if let Some(note) = &self.note {
            text = text.row("note", note);
            json["prepared_note"] = note.as_str().into();
        }
        if let Some(path) = report_path {
            let html = page(&report).map_err(|e| Failure::new("internal", e.to_string()))?;
            let output = Output { path, bytes: html.as_bytes(), access: Access::Usual };
            files::write_all(&[output], plan.force)?;
            let path = path.display().to_string();
            text = text.row("report", &path);
            json["report"] = path.into();
        } else if let Some(json) = json.as_object_mut() {
            // Long, and asked for with the report.
            MEASURED.iter().for_each(|field| {
                json.remove(*field);
            });
        }
        Ok(Answer::new(text, &json)?.found_if(detection.detected))
    }

    /// Refuses a page that is there already, unless the plan has `force`, or that would replace what is read.
    pub(crate) fn check_page(&self, page: Option<&Path>, suspect: &Path) -> Result<(), Failure> {
        let Plan { original, key, prepared, force, .. } = &self.plan;
        files::check_outputs(page.as_slice(), &[suspect, original, key, &prepared.path], *force)
    }

    fn evidence(&self, path: &Path, suspect: &Document) -> Evidence {
        let suspect = FileHash::of_mesh(path.display().to_string(), suspect);
        let (original, key) = (self.original.clone(), self.key.clone());
        Evidence::new(suspect, original, key, &self.mark, self.plan.settings)
    }

    /// Whoever is there. Once one panicked there may be nobody.
    fn looker(&self) -> RwLockReadGuard<'_, Looker> {
        self.looker.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn preparation(&self) -> f64 {
        *self.preparation.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The detector, made when the first suspect asks for it; others who ask wait for it.
    fn detector(&self) -> Result<Detector, Failure> {
        if let Looker::Detector(made) = &*self.looker() {
            return Ok(made.clone());
        }
        let mut looker = self.looker.write().unwrap_or_else(PoisonError::into_inner);
        let made = match std::mem::replace(&mut *looker, Looker::Nobody) {
            Looker::Detector(made) => made,
            Looker::Nobody => return Err(self.unusable()),
            Looker::Glancer(glancer, stored) => {
                let start = Instant::now();
                let made = glancer.detector(stored);
                let made = made.map_err(|e| failure(&self.plan, &self.plan.original, &e))?;
                *self.preparation.lock().unwrap_or_else(PoisonError::into_inner) +=
                    start.elapsed().as_secs_f64();
                made
            }
        };
        *looker = Looker::Detector(made.clone());
        Ok(made)
    }

    /// Key and prepared file may have been made up together, and then any suspect has the mark. So what was found with
    /// a file that happens to lie beside the key is confirmed without it; with one that the user vouches for, the
    /// answer says so.
    fn vouch(&self) -> Result<Option<Remark>, Failure> {
        if self.plan.prepared.named {
            return Ok(Some(Remark::Unconfirmed));
        }
        if self.confirmed.get().is_none() {
            self.detector()?.confirm().map_err(|e| failure(&self.plan, &self.plan.original, &e))?;
        }
        self.confirmed.get_or_init(|| ());
        Ok(None)
    }

    /// Of a basis that could not be made for an earlier suspect, which said why.
    fn unusable(&self) -> Failure {
        let key = self.plan.key.display();
        Failure::new("key", format!("{key}: it does not fit the original, as was said of an earlier suspect"))
    }
}

/// The stored basis where there is one to be used, or a sentence that says why the one beside the key is not.
fn stored(
    Prepared { path, named }: &Prepared,
    key: &Key,
    limits: Limits,
) -> Result<(Option<PreparedBasis>, Option<String>), Failure> {
    if !named && path.symlink_metadata().is_err() {
        return Ok((None, None));
    }
    match files::read_prepared(path, key, limits) {
        Ok(stored) => Ok((Some(stored), None)),
        Err(failure) if *named => Err(failure),
        Err(failure) => Ok((None, Some(failure.message().to_owned()))),
    }
}

/// Names the file that the error is about.
fn failure(plan: &Plan, suspect: &Path, error: &DetectError) -> Failure {
    match error {
        DetectError::Key(_) | DetectError::Basis(_) => Failure::about("key", &plan.key, error),
        DetectError::NoFaces { which: "original" } => Failure::about("mesh", &plan.original, error),
        DetectError::Search(SearchError::NeedsResampling) => {
            Failure::about("needs_resampling", suspect, error)
        }
        DetectError::Threshold { .. } => Failure::new("usage", error.to_string()),
        _ => Failure::about("suspect", suspect, error),
    }
}

fn text(suspect: &Path, d: &Detection, claim: &Claim) -> Table {
    let verdict = if d.detected { "FOUND: the mark is in" } else { "NOT FOUND: the mark was not found in" };
    let log10_p = format!(
        "{:.1} (threshold {:.1}): the chance that an unmarked mesh matches as well",
        d.log10_p,
        d.threshold.log10()
    );
    Table::new(format!("{verdict} {}", suspect.display()))
        .row("log10 p", log10_p)
        .row("convinces", claim.sentence())
        .row("correlation", format!("{:.4} over {} coefficients", d.correlation, d.coefficients_used))
        .row("coverage", format!("{:.1} % of the original's area", 100.0 * d.coverage))
        .rows("mirrored", mirrored(d))
        .rows("parts", parts(d))
        .row("method", how(d))
        .row("seconds", format!("{:.2}", d.seconds.total()))
        .rows("note", &d.warnings)
}

/// What is said of a mirror image.
fn mirrored(d: &Detection) -> Option<&'static str> {
    let whole = d.registration.is_some_and(|registration| registration.mirrored);
    let parts = d.parts.iter().filter(|part| part.mirrored).count();
    match (whole, parts) {
        (true, _) => Some("the suspect was compared as a mirror image"),
        (false, 0) => None,
        (false, n) if n == d.parts.len() => Some("all parts were compared as mirror images"),
        (false, _) => Some("some parts were compared as mirror images"),
    }
}

/// Parts that were placed one by one, the surest first.
fn parts(d: &Detection) -> Option<String> {
    const NAMED: usize = 4;
    let mut parts: Vec<_> = d.parts.iter().collect();
    parts.sort_by(|a, b| a.log10_p.total_cmp(&b.log10_p));
    let surest = parts.first()?;
    let more = parts.len().saturating_sub(NAMED);
    let named: Vec<String> =
        parts.iter().take(NAMED).map(|part| format!("{} ({:.1})", part.component, part.log10_p)).collect();
    let and = if more > 0 { format!(" and {more} more") } else { String::new() };
    Some(match parts.len() {
        1 => format!("one of the original's parts, number {}, was found by itself", surest.component),
        n => format!("{n} placed one by one; number (log10 p by itself): {}{and}", named.join(", ")),
    })
}

/// The variant that won, in words.
fn how(d: &Detection) -> String {
    let Some(v) = &d.variant else {
        return format!("{}; the shapes alone say that the suspect shows something else", d.method.name());
    };
    let step = |yes: bool, name: &str| format!("{} {name}", if yes { "with" } else { "without" });
    let registration = step(v.registration, "registration");
    match d.method {
        sombrero::Method::Paper => format!("paper, {registration}, {}", step(v.resampling, "resampling")),
        _ => {
            let compared = if v.resampling { "surfaces" } else { "vertices" };
            format!(
                "robust, {registration}, {compared} compared{}; solved for: {}; best of {} variants",
                if v.look == "parts" { " part by part" } else { "" },
                v.nuisance,
                d.variants_counted
            )
        }
    }
}
