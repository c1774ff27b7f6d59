//! A suspect, an original and a key in, a verdict and a report out.

use crate::file::File;
use crate::refusal::Refusal;
use serde_json::Value;
use sombrero::watermark::Key;
use sombrero::{Claim, DetectError, DetectOptions, Detector, Stages};
use sombrero_report::{Evidence, FileHash, MEASURED, Report, page, record};

/// CPU seconds after which the search ends with what it has, as the command's.
const BUDGET: f64 = 60.0;

const UNVERIFIED: &str = "The key holds a timestamp, which this page does not check: it trusts no authority. `sombrero verify` and \
                          `sombrero detect --ca` do, and others may then be convinced by less.";

/// The answer to whether a suspect carries a mark.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Verdict {
    /// Whether it does.
    pub detected: bool,
    /// Whom that convinces, in one sentence.
    pub claim: String,
    /// What else is to be known, in sentences.
    pub notes: Vec<String>,
    /// The figures: the record of the report, without the longest ones.
    pub figures: Value,
    /// The report as a page that `sombrero verify` takes. It holds nearly all of the key.
    pub report: File,
}

/// Looks for the mark of a key as `sombrero detect --report` does without other options.
///
/// # Errors
/// [`Refusal`] when a file cannot be read, or the three do not belong together.
pub fn look(suspect: File, original: File, key: &File) -> Result<Verdict, Refusal> {
    let mark =
        Key::from_json(&key.bytes).map_err(|source| Refusal::Key { name: key.name.clone(), source })?;
    let stamped = mark.timestamp.is_some();
    let (suspect_name, original_name) = (suspect.name.clone(), original.name.clone());
    let refused = |source| {
        let name = match &source {
            DetectError::Key(_) | DetectError::Basis(_) => &key.name,
            DetectError::NoFaces { which: "original" } => &original_name,
            _ => &suspect_name,
        };
        Refusal::Look { name: name.clone(), source }
    };
    let [original, suspect] = [original.model()?, suspect.model()?];
    let mut seconds = Stages::default();
    let detector = seconds.time("preparation", || Detector::new(&original, mark)).map_err(refused)?;
    let settings = DetectOptions { budget: Some(BUDGET), ..DetectOptions::default() };
    let evidence = Evidence::new(
        FileHash::of_mesh(&suspect_name, &suspect),
        FileHash::of_mesh(&original_name, &original),
        FileHash::new(&key.name, &key.bytes),
        detector.key(),
        settings,
    );
    let shape = detector.suspect(&suspect);
    // Detection needs the memory.
    drop((suspect, original));
    let mut detection = detector.detect(&shape, &settings).map_err(refused)?;
    seconds.add(std::mem::take(&mut detection.seconds));
    detection.seconds = seconds;
    let claim = Claim::new(detection.detected, detection.log10_p, detector.key(), None, &settings);
    let report = Report {
        detection: &detection,
        claim: &claim,
        key: detector.key(),
        original: detector.model(),
        suspect: &shape.soup,
        prepared: false,
        evidence: &evidence,
    };
    let html = page(&report)?;
    let mut figures = record(&report);
    if let Some(figures) = figures.as_object_mut() {
        MEASURED.iter().for_each(|field| {
            figures.remove(*field);
        });
    }
    let mut notes = detection.warnings.clone();
    notes.extend(stamped.then(|| UNVERIFIED.to_owned()));
    let report = File { name: format!("{suspect_name}.html"), bytes: html.into_bytes() };
    Ok(Verdict { detected: detection.detected, claim: claim.sentence(), notes, figures, report })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mark::mark;
    use sombrero::io::{Format, encode};
    use sombrero::shapes;
    use sombrero::watermark::Identity;

    fn model(vertices: usize) -> File {
        File { name: "vase.off".into(), bytes: encode(Format::Off, &shapes::bumpy_sphere(vertices)).unwrap() }
    }

    #[test]
    fn a_copy_is_found_and_its_original_is_not() {
        let marked = mark(model(600), Identity::default(), &[1; 32], |_| ()).unwrap();
        let found = look(marked.copy, model(600), &marked.key).unwrap();
        assert!(found.detected && found.claim.contains("convinces anybody"), "{}", found.claim);
        assert_eq!(found.report.name, "vase-marked.off.html");
        assert_eq!(found.figures["detected"], true);
        assert!(found.figures["precision"].is_null());
        let plain = look(model(600), model(600), &marked.key).unwrap();
        assert!(!plain.detected);
    }

    #[test]
    fn files_that_do_not_belong_together_are_refused_by_name() {
        let marked = mark(model(600), Identity::default(), &[1; 32], |_| ()).unwrap();
        let refusal = look(marked.copy.clone(), model(2000), &marked.key).unwrap_err();
        assert!(refusal.to_string().starts_with("vase.key: "), "{refusal}");
        let refusal = look(model(600), model(600), &marked.copy).unwrap_err();
        assert!(matches!(&refusal, Refusal::Key { name, .. } if name == "vase-marked.off"), "{refusal}");
    }
}
