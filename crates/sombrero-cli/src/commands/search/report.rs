//! The pages of a search: a sheet with pictures of all candidates, and the report of the best.

use super::args::Args;
use super::examine::{BUDGET, Examined};
use crate::catalogue::{KeptKey, Originals};
use crate::failure::Failure;
use crate::files;
use crate::timestamp::{self, Stamp};
use sombrero::io::{Access, Document, Output};
use sombrero::{Claim, DetectOptions, Detector};
use sombrero_report::{Evidence, FileHash, Report, Sheet, SheetCandidate, page, sheet};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Where the pages go.
pub(crate) struct Pages {
    sheet: PathBuf,
    detection: PathBuf,
}

/// A suspect and what was found out about it.
pub(super) struct About<'a> {
    pub(super) path: &'a Path,
    pub(super) suspect: &'a Document,
    pub(super) candidates: &'a [Examined],
    pub(super) tests: usize,
}

impl Pages {
    /// The pages that were asked for, if any were; they may not replace an input, or, without `force`, any file.
    pub(crate) fn checked(
        sheet: Option<&Path>,
        inputs: &[&Path],
        force: bool,
    ) -> Result<Option<Self>, Failure> {
        let pages = sheet.map(Self::new).transpose()?;
        if let Some(pages) = &pages {
            files::check_outputs(&pages.paths(), inputs, force)?;
        }
        Ok(pages)
    }

    /// FILE, and FILE-detection beside it.
    fn new(sheet: &Path) -> Result<Self, Failure> {
        if files::is_standard(sheet) {
            return Err(Failure::new(
                "usage",
                "a report is a page for a browser; give it the name of a file",
            ));
        }
        let mut name = OsString::from(sheet.file_stem().unwrap_or_default());
        name.push("-detection");
        let detection = sheet.with_file_name(name).with_added_extension("html");
        Ok(Self { sheet: sheet.to_owned(), detection })
    }

    fn paths(&self) -> [&Path; 2] {
        [&self.sheet, &self.detection]
    }

    /// Writes the sheet, and the report of the best candidate if its keys were tested; gives what was written.
    pub(super) fn write(
        &self,
        about: &About<'_>,
        originals: &Originals,
        args: &Args,
    ) -> Result<Vec<String>, Failure> {
        let internal = |e: sombrero_report::PageError| Failure::new("internal", e.to_string());
        let best = best(about.candidates);
        let detection = match best {
            Some((examined, key)) => Some(detection(about, examined, key, originals)?),
            None => None,
        };
        let link = self.detection.file_name().unwrap_or_default().to_string_lossy();
        let candidates: Vec<SheetCandidate> = about
            .candidates
            .iter()
            .map(|examined| {
                let is_best = best.is_some_and(|(known, _)| std::ptr::eq(known, examined));
                candidate(examined, originals, is_best.then(|| link.to_string()))
            })
            .collect();
        let html = sheet(&Sheet {
            suspect: &about.path.display().to_string(),
            shape: about.suspect.soup(),
            catalogue: &args.catalogue.display().to_string(),
            candidates: &candidates,
            threshold: args.threshold,
            tests: about.tests,
        })
        .map_err(internal)?;
        let mut outputs = vec![Output { path: &self.sheet, bytes: html.as_bytes(), access: Access::Usual }];
        if let Some(html) = &detection {
            outputs.push(Output { path: &self.detection, bytes: html.as_bytes(), access: Access::Usual });
        }
        files::write_all(&outputs, args.force)?;
        Ok(outputs.iter().map(|output| output.path.display().to_string()).collect())
    }
}

/// The candidate and the key of the smallest p.
fn best(candidates: &[Examined]) -> Option<(&Examined, &KeptKey)> {
    let first = |examined: &'_ Examined| {
        examined.tested.as_ref().and_then(|tested| tested.keys.first()).map(|(_, p)| *p)
    };
    let tested = candidates.iter().filter(|examined| first(examined).is_some());
    let best = tested.min_by(|a, b| first(a).unwrap_or(0.0).total_cmp(&first(b).unwrap_or(0.0)))?;
    Some((best, &best.tested.as_ref()?.keys.first()?.0))
}

fn candidate(examined: &Examined, originals: &Originals, report: Option<String>) -> SheetCandidate {
    let entry = &examined.candidate.entry;
    let best = examined.tested.as_ref().and_then(|tested| tested.keys.first());
    SheetCandidate {
        name: entry.name.clone(),
        score: examined.candidate.score,
        log10_p: best.map(|(_, p)| *p),
        named: examined.is_found().then(|| best.map(|(key, _)| key.key.identity.clone())).flatten(),
        // Without the file there is no picture.
        shape: originals.document(entry).ok().map(|document| document.soup().clone()),
        report,
    }
}

/// The report of one key, as `detect` writes it: its p is that of this one test.
fn detection(
    about: &About<'_>,
    examined: &Examined,
    kept: &KeptKey,
    originals: &Originals,
) -> Result<String, Failure> {
    let failed = |e: &dyn std::error::Error| Failure::about("suspect", about.path, e);
    let entry = &examined.candidate.entry;
    let original = originals.document(entry)?;
    let settings = DetectOptions { budget: Some(BUDGET), ..DetectOptions::default() };
    let detector = Detector::new(&original, kept.key.clone()).map_err(|e| failed(&e))?;
    let suspect = detector.suspect(about.suspect);
    let detection = detector.detect(&suspect, &settings).map_err(|e| failed(&e))?;
    let stamp = timestamp::of_key(&kept.path, &kept.key, &timestamp::anchors(None)?)?;
    let commitment = stamp.as_ref().map(Stamp::commitment);
    let claim = Claim::new(detection.detected, detection.log10_p, &kept.key, commitment, &settings);
    let evidence = Evidence::new(
        FileHash::of_mesh(about.path.display().to_string(), about.suspect),
        FileHash::of_mesh(entry.name.clone(), &original),
        FileHash::new(kept.path.display().to_string(), &kept.bytes),
        &kept.key,
        settings,
    );
    let report = Report {
        detection: &detection,
        claim: &claim,
        key: &kept.key,
        original: detector.model(),
        suspect: &suspect.soup,
        prepared: false,
        evidence: &evidence,
    };
    page(&report).map_err(|e| Failure::new("internal", e.to_string()))
}
