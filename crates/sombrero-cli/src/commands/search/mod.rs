//! `sombrero search`: which original of a catalogue a suspect was made from, and whose copy it is.

pub(crate) mod args;
mod examine;
mod report;

use crate::answer::{Answer, Context, Outcome};
use crate::batch::{self, Inputs, Words};
use crate::catalogue::{self, Originals};
use crate::failure::Failure;
use crate::files;
use crate::key_folder::KeyFolder;
use crate::progress::Progress;
use crate::table::Table;
pub(crate) use report::Pages;

use args::Args;
use examine::{Examination, Examined, examine};
use serde::Serialize;
use sombrero::Stages;
use sombrero_catalogue::{Catalogue, Question, SearchOptions};
use std::path::{Path, PathBuf};

/// What became of several suspects.
const WORDS: Words =
    Words { role: "suspect", outcomes: [Some("found"), None, Some("not found")], failed: "refused" };

pub(crate) fn run(args: &Args, context: &Context) -> Result<Outcome, Failure> {
    check_threshold(args)?;
    let Inputs { files: suspects, one } = args.shard.of(Inputs::new(&args.suspects, None)?);
    if args.report.is_some() && !one {
        return Err(Failure::new("usage", "--report is for one suspect; give one file"));
    }
    let suspects: Vec<(PathBuf, ())> = suspects.into_iter().map(|file| (file.path, ())).collect();
    let inputs: Vec<&Path> = suspects.iter().map(|(path, ())| path.as_path()).collect();
    let pages = Pages::checked(args.report.as_deref(), &inputs, args.force)?;
    let search = Search::new(args, context)?;
    match suspects.as_slice() {
        [(suspect, ())] if one => Ok(Outcome::Answer(search.ask(suspect, pages.as_ref(), args, context)?)),
        suspects => {
            batch::each(suspects, &WORDS, context, |suspect, ()| search.ask(suspect, None, args, context))
        }
    }
}

fn check_threshold(args: &Args) -> Result<(), Failure> {
    if args.threshold > 0.0 && args.threshold <= 1.0 {
        return Ok(());
    }
    let message =
        format!("--threshold {}: give a number above 0 and at most 1, such as 1e-6", args.threshold);
    Err(Failure::new("usage", message))
}

/// A catalogue that any number of suspects are held against.
pub(crate) struct Search {
    catalogue: Catalogue,
    originals: Originals,
    /// Whether there are keys to test.
    keyed: bool,
}

/// For programs.
#[derive(Serialize)]
struct Report {
    suspect: String,
    candidates: Vec<Listed>,
    /// Whether a mark was found, or without keys whether there is a candidate.
    found: bool,
    /// Whether there were keys to test.
    tested: bool,
    threshold: f64,
    /// The number of tests that p was corrected for, each of all keys of an original.
    tests: usize,
    seconds: Stages,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    reports: Vec<String>,
}

#[derive(Serialize)]
struct Listed {
    original: String,
    score: f64,
    /// Corrected for all tests of this search; `None` when no key was tested.
    log10_p: Option<f64>,
    key: Option<String>,
    recipient: Option<String>,
    owner: Option<String>,
    found: bool,
    /// The part of the suspect that it fits, from 0, the largest first; `None` for the whole.
    part: Option<usize>,
    mirrored: bool,
    /// Others whose mark shows too.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    others: Vec<Other>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Other {
    key: String,
    recipient: String,
    log10_p: f64,
}

impl Search {
    /// The catalogue and the keys that were asked for.
    pub(crate) fn new(args: &Args, context: &Context) -> Result<Self, Failure> {
        check_threshold(args)?;
        let catalogue = catalogue::open(&args.catalogue)?;
        let folder = args.keys.as_deref().map(|keys| KeyFolder::read(keys, context.desk)).transpose()?;
        let vault = catalogue::vault(&args.catalogue)?.filter(|_| !args.rank_only);
        // Kept keys ask for the passphrase; with keys at hand it is only used where it is.
        let needed = |vault: &sombrero_vault::Vault| match folder {
            Some(_) => args.unlock.is_given(),
            None => vault.has_keys(),
        };
        let opened = vault.filter(needed).map(|vault| args.unlock.unlock(&vault)).transpose()?;
        let keyed = folder.is_some() || opened.is_some();
        let originals = Originals::new(&args.catalogue, opened, folder, context)?;
        Ok(Self { catalogue, originals, keyed })
    }

    /// Looks at one suspect, and writes its pages.
    pub(crate) fn ask(
        &self,
        path: &Path,
        pages: Option<&Pages>,
        args: &Args,
        context: &Context,
    ) -> Result<Answer, Failure> {
        let _progress = Progress::new(format!("looking for {}", path.display()));
        let mut seconds = Stages::default();
        let suspect = files::read_mesh(path, context)?;
        let wrong = |e: &dyn std::error::Error| Failure::about("suspect", path, e);
        let question = seconds
            .time("landmarks", || Question::of(suspect.points(), suspect.triangles()))
            .map_err(|e| wrong(&e))?;
        let options = SearchOptions::default().top(args.top);
        let candidates = seconds.time("catalogue", || self.catalogue.search(&question, &options))?;
        let Examination { candidates, tests } = seconds
            .time("keys", || examine(&suspect, &question, candidates, &self.originals, args.threshold))?;
        let found = match self.keyed {
            true => candidates.iter().any(Examined::is_found),
            false => !candidates.is_empty(),
        };
        let reports = match pages {
            Some(pages) => {
                let about = report::About { path, suspect: &suspect, candidates: &candidates, tests };
                pages.write(&about, &self.originals, args)?
            }
            None => Vec::new(),
        };
        let report = Report {
            suspect: path.display().to_string(),
            candidates: candidates.iter().map(Listed::new).collect(),
            found,
            tested: self.keyed,
            threshold: args.threshold,
            tests,
            seconds,
            reports,
        };
        Ok(Answer::new(text(&report, &args.catalogue), &report)?.found_if(found))
    }
}

impl Listed {
    fn new(examined: &Examined) -> Self {
        let Examined { candidate, tested, notes } = examined;
        let best = tested.as_ref().and_then(|tested| tested.keys.first());
        let others = tested.iter().flat_map(|tested| tested.keys.iter().take(tested.named).skip(1));
        let place = |key: &catalogue::KeptKey| key.path.display().to_string();
        Self {
            original: candidate.entry.name.clone(),
            score: candidate.score,
            log10_p: best.map(|(_, p)| *p),
            key: best.map(|(key, _)| place(key)),
            // A name at the level of chance would only be held against somebody.
            recipient: best
                .filter(|_| examined.is_found())
                .map(|(key, _)| key.key.identity.recipient.clone()),
            owner: best.map(|(key, _)| key.key.identity.owner.clone()),
            found: examined.is_found(),
            part: candidate.part,
            mirrored: candidate.mirrored,
            others: others
                .map(|(key, log10_p)| Other {
                    key: place(key),
                    recipient: key.key.identity.recipient.clone(),
                    log10_p: *log10_p,
                })
                .collect(),
            notes: notes.clone(),
        }
    }

    /// One line for people.
    fn line(&self) -> String {
        let part = self.part.map_or_else(String::new, |part| format!(", part {part} of the suspect"));
        let mirrored = if self.mirrored { ", mirrored" } else { "" };
        let p = self.log10_p.map_or_else(String::new, |p| format!(", log10 p {p:.1}"));
        format!("{} (score {:.3}{p}{part}{mirrored})", self.original, self.score)
    }

    /// What was found, for people.
    fn names(&self) -> String {
        let or = |text: &Option<String>, none: &str| match text.as_deref() {
            None | Some("") => none.to_owned(),
            Some(text) => text.to_owned(),
        };
        let recipient = or(&self.recipient, "(no recipient's text)");
        let more: String = self.others.iter().map(|other| format!(" and {}", other.recipient)).collect();
        format!("{recipient}{more}, by a key of {}", or(&self.owner, "(no owner's text)"))
    }
}

fn text(report: &Report, catalogue: &Path) -> Table {
    let Report { suspect, candidates, tested, tests, threshold, .. } = report;
    let found: Vec<&Listed> = candidates.iter().filter(|listed| listed.found).collect();
    let originals: Vec<&str> = found.iter().map(|listed| listed.original.as_str()).collect();
    let head = match (found.is_empty(), tested, candidates.is_empty()) {
        (false, ..) => format!("FOUND: {suspect} carries a mark of {}", originals.join(" and of ")),
        (true, true, _) => {
            format!("NOT FOUND: no mark of an original of {} was found in {suspect}", catalogue.display())
        }
        (true, false, false) => format!("RANKED: what {suspect} may have been made from; no key was tested"),
        (true, false, true) => {
            format!("NOTHING LIKE IT: no original of {} has the shape of {suspect}", catalogue.display())
        }
    };
    let chance = tested.then(|| {
        let threshold = threshold.log10();
        format!("the chance that any test of this search matches as well by accident, {tests} in all; threshold {threshold:.1}")
    });
    Table::new(head)
        .rows("copy", found.iter().map(|listed| listed.names()))
        .rows("key", found.iter().filter_map(|listed| listed.key.as_ref()))
        .rows("candidate", candidates.iter().map(Listed::line))
        .rows("log10 p", chance)
        .row("seconds", format!("{:.2}", report.seconds.total()))
        .rows("report", &report.reports)
        .rows("note", candidates.iter().flat_map(|listed| &listed.notes))
}
