//! `sombrero detect`: one suspect, or several against one original.

use crate::args::Detect;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::{Answer, Context, Outcome, batch, files};
use sombrero::io::{Access, Document, Limits, Output};
use sombrero::watermark::Key;
use sombrero::{DetectError, DetectOptions, Detection, Detector, PreparedBasis, SearchError};
use sombrero_report::{Evidence, FileHash, Report, page, record};
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

pub(crate) fn run(args: &Detect, context: &Context) -> Result<Outcome, Failure> {
    let beside = files::beside_key(&args.key);
    let prepared_path = args.prepared.as_deref().unwrap_or(&beside);
    let suspects = batch::expand(&args.suspects)?;
    let mut inputs: Vec<&Path> = suspects.iter().map(PathBuf::as_path).collect();
    inputs.extend([args.original.as_path(), args.key.as_path(), prepared_path]);
    let one = batch::is_one(&args.suspects);
    let outputs: Vec<&Path> = args.report.iter().filter(|_| one).map(PathBuf::as_path).collect();
    files::check_outputs(&outputs, &inputs, args.force)?;
    if outputs.iter().any(|output| files::is_standard(output)) {
        return Err(Failure::new("usage", "a report is a page for a browser; give it the name of a file"));
    }

    let progress = Progress::new(format!("reading {}", args.original.display()));
    let job = Job::new(args, prepared_path, context.limits)?;
    drop(progress);
    match (suspects.as_slice(), &args.report) {
        ([suspect], report) if one => Ok(Outcome::Answer(job.look(suspect, report.as_deref())?)),
        (_, None) => batch::each(&suspects, "suspect", context, |suspect| job.look(suspect, None)),
        (_, Some(folder)) => {
            files::make_folder(folder)?;
            let mut taken = BTreeSet::new();
            batch::each(&suspects, "suspect", context, |suspect| {
                let name = suspect.file_name().unwrap_or(suspect.as_os_str());
                let page = folder.join(name).with_added_extension("html");
                if !taken.insert(page.clone()) {
                    let message = format!(
                        "{}: two suspects have this name; put their reports into different folders",
                        page.display()
                    );
                    return Err(Failure::new("write", message));
                }
                files::check_outputs(&[&page], &inputs, args.force)?;
                job.look(suspect, Some(&page))
            })
        }
    }
}

/// An original and a key that any number of suspects are held against.
struct Job<'a> {
    args: &'a Detect,
    limits: Limits,
    detector: Detector,
    /// Whether the basis came from a prepared file, and what is to be said of it.
    from_file: bool,
    note: Option<String>,
    /// Whether the basis was derived anew, which the first mark that is found asks for.
    confirmed: OnceCell<()>,
    original: FileHash,
    key: FileHash,
    preparation: f64,
}

impl<'a> Job<'a> {
    fn new(args: &'a Detect, prepared_path: &Path, limits: Limits) -> Result<Self, Failure> {
        let bytes = files::read_small(&args.key, files::LARGEST_KEY)?;
        let key = files::parse_key(&args.key, &bytes)?;
        let original = files::read_mesh(&args.original, limits)?;
        let (stored, note) = stored(args, prepared_path, &key, limits)?;
        let from_file = stored.is_some();
        let start = Instant::now();
        let detector = match stored {
            Some(stored) => Detector::with_prepared_basis(&original, key, stored),
            None => Detector::new(&original, key),
        };
        let detector = detector.map_err(|e| failure(args, &args.original, &e))?;
        // The key was made for a file with this hash, and that was checked.
        let original_sha256 = hex::encode(detector.key().original_sha256);
        Ok(Self {
            args,
            limits,
            detector,
            from_file,
            note,
            confirmed: OnceCell::new(),
            original: FileHash { path: args.original.display().to_string(), sha256: original_sha256 },
            key: FileHash::new(args.key.display().to_string(), &bytes),
            preparation: start.elapsed().as_secs_f64(),
        })
    }

    /// Looks at one suspect, and writes its page to `report_path`.
    fn look(&self, path: &Path, report_path: Option<&Path>) -> Result<Answer, Failure> {
        let Self { args, detector, .. } = self;
        let _progress = Progress::new(format!("looking at {}", path.display()));
        let file = files::read_mesh(path, self.limits)?;
        let evidence = self.evidence(path, &file);
        let suspect = detector.suspect(&file);
        // Detection needs the memory.
        drop(file);
        let mut detection =
            detector.detect(&suspect, &evidence.settings).map_err(|e| failure(args, path, &e))?;
        detection.seconds.0.insert(0, ("preparation", self.preparation));
        detection.warnings.extend(self.note.clone());
        if detection.detected && self.from_file {
            detection.warnings.extend(self.vouch()?);
        }
        let report = Report {
            detection: &detection,
            key: detector.key(),
            original: detector.model(),
            suspect: &suspect.soup,
            prepared: self.from_file,
            evidence: &evidence,
        };
        let (mut text, mut json) = (text(path, &detection), record(&report));
        if let Some(path) = report_path {
            let html = page(&report).map_err(|e| Failure::new("internal", e.to_string()))?;
            let output = Output { path, bytes: html.as_bytes(), access: Access::Usual };
            files::write_all(&[output], args.force)?;
            let path = path.display().to_string();
            text += &format!("\n  report        {path}");
            json["report"] = path.into();
        }
        Ok(Answer::new(text, &json)?.found_if(detection.detected))
    }

    fn evidence(&self, path: &Path, suspect: &Document) -> Evidence {
        let Detect { method, registration, resampling, threshold, seed, .. } = *self.args;
        let settings = DetectOptions {
            method: method.into(),
            registration: registration.into(),
            resampling: resampling.into(),
            threshold,
            seed,
        };
        let suspect = FileHash::new(path.display().to_string(), &suspect.content());
        Evidence::new(suspect, self.original.clone(), self.key.clone(), self.detector.key(), settings)
    }

    /// Key and prepared file may have been made up together, and then any suspect has the mark. So what was found with
    /// a file that happens to lie beside the key is confirmed without it; with one that the user vouches for, the
    /// answer says so.
    fn vouch(&self) -> Result<Option<String>, Failure> {
        let Some(path) = &self.args.prepared else {
            if self.confirmed.get().is_none() {
                self.detector.confirm().map_err(|e| failure(self.args, &self.args.original, &e))?;
            }
            self.confirmed.get_or_init(|| ());
            return Ok(None);
        };
        Ok(Some(format!(
            "The basis was taken from {} and not derived anew, which `sombrero verify` does.",
            path.display()
        )))
    }
}

/// The stored basis where there is one to be used, or a sentence that says why the one beside the key is not.
fn stored(
    args: &Detect,
    path: &Path,
    key: &Key,
    limits: Limits,
) -> Result<(Option<PreparedBasis>, Option<String>), Failure> {
    let asked = args.prepared.is_some();
    if !asked && path.symlink_metadata().is_err() {
        return Ok((None, None));
    }
    match files::read_prepared(path, key, limits) {
        Ok(stored) => Ok((Some(stored), None)),
        Err(failure) if asked => Err(failure),
        Err(failure) => Ok((None, Some(format!("The prepared file was not used: {}.", failure.message())))),
    }
}

/// Names the file that the error is about.
fn failure(args: &Detect, suspect: &Path, error: &DetectError) -> Failure {
    match error {
        DetectError::Key(_) | DetectError::Basis(_) => Failure::about("key", &args.key, error),
        DetectError::NoFaces { which: "original" } => Failure::about("mesh", &args.original, error),
        DetectError::Search(SearchError::NeedsResampling) => {
            Failure::about("needs_resampling", suspect, error)
        }
        DetectError::Threshold { .. } => Failure::new("usage", error.to_string()),
        _ => Failure::about("suspect", suspect, error),
    }
}

fn text(suspect: &Path, d: &Detection) -> String {
    let verdict = if d.detected { "FOUND: the mark is in" } else { "NOT FOUND: the mark was not found in" };
    let mut lines = vec![
        format!("{verdict} {}", suspect.display()),
        format!(
            "  log10 p       {:.1} (threshold {:.1}): the chance that an unmarked mesh matches as well",
            d.log10_p,
            d.threshold.log10()
        ),
        format!("  correlation   {:.4} over {} coefficients", d.correlation, d.coefficients_used),
        format!("  coverage      {:.1} % of the original's area", 100.0 * d.coverage),
        format!("  method        {}", how(d)),
        format!("  seconds       {:.2}", d.seconds.total()),
    ];
    lines.extend(d.warnings.iter().map(|w| format!("  note          {w}")));
    lines.join("\n")
}

/// The variant that won, in words.
fn how(d: &Detection) -> String {
    let v = &d.variant;
    let step = |yes: bool, name: &str| format!("{} {name}", if yes { "with" } else { "without" });
    let registration = step(v.registration, "registration");
    match d.method {
        sombrero::Method::Paper => format!("paper, {registration}, {}", step(v.resampling, "resampling")),
        _ => {
            let compared = if v.resampling { "surfaces" } else { "vertices" };
            format!(
                "robust, {registration}, {compared} compared; solved for: {}; best of {} variants",
                v.nuisance, d.variants_counted
            )
        }
    }
}
