//! A generated model with its mark, and what is done to the copy.

use crate::failure::Failure;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sombrero::attacks::{apply_all, noise, parse_list};
use sombrero::io::{Access, Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::watermark::{Identity, Secret};
use sombrero::{Claim, DetectOptions, Detection, Detector, EmbedOptions, Marked, Stages, embed};
use sombrero_report::{Evidence, FileHash, Report, page};

/// The attacks of the table.
const BATTERY: [(&str, &str); 12] = [
    ("none", "none"),
    ("noise 0.2 %", "noise:amplitude=0.002"),
    ("noise 0.45 %", "noise:amplitude=0.0045"),
    ("noise 0.7 %", "noise:amplitude=0.007"),
    ("smoothing", "smooth:iterations=10"),
    ("second watermark", "watermark"),
    ("crop, right third", "crop:fraction=0.333"),
    ("turned, moved, scaled", "transform"),
    ("simplified to a half", "reorder simplify:ratio=0.5"),
    ("bent by 2 %, simplified", "simplify:ratio=0.5 ffd:strength=0.02"),
    ("marching cubes", "isosurface:resolution=96 transform"),
    (
        "all of the paper's",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
    ),
];

/// The row that is reported of each model.
fn reported(model: &str) -> &'static str {
    if model == "bust" { "all of the paper's" } else { "turned, moved, scaled" }
}

/// A file to be written, by its name in the folder.
pub(super) struct File {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
    pub(super) access: Access,
}

/// A model with its mark.
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) original: Document,
    pub(super) marked: Marked,
    detector: Detector,
}

/// A suspect, as the file has it that is written, and what was found in it.
pub(super) struct Tried {
    pub(super) name: &'static str,
    pub(super) marked: bool,
    pub(super) file: String,
    pub(super) document: Document,
    pub(super) detection: Detection,
}

impl Case {
    /// The number of suspects of a model.
    pub(super) const SUSPECTS: usize = BATTERY.len() + 1;

    pub(super) fn new(
        name: &'static str,
        format: Format,
        soup: &Soup,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, Failure> {
        let failed = |e: &dyn std::error::Error| failed(name, e);
        let original = Document::parse(encode(format, soup)?, None).map_err(|e| failed(&e))?;
        let identity = Identity { owner: "the demo".into(), recipient: "nobody".into() };
        let options = EmbedOptions { identity, ..EmbedOptions::default() };
        let marked = embed(&original, Secret(rng.random()), &options).map_err(|e| failed(&e))?;
        let detector = Detector::new(&original, marked.key.clone()).map_err(|e| failed(&e))?;
        Ok(Self { name, original, marked, detector })
    }

    /// The copy after each attack of the battery, and the original with noise.
    pub(super) fn tried(&self, seed: u64, count: &(impl Fn() + Sync)) -> Result<Vec<Tried>, Failure> {
        let copy =
            Document::parse(self.marked.bytes.clone(), None).map_err(|e| self.failed(&e))?.soup().clone();
        let attacked = BATTERY.par_iter().map(|(name, spec)| {
            let attacks = parse_list(spec);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let attacked = apply_all(&attacks.map_err(|e| self.failed(&e))?, &copy, &mut rng);
            let tried = self.look(name, true, &attacked.map_err(|e| self.failed(&e))?.soup);
            count();
            tried
        });
        let mut tried: Vec<Tried> = attacked.collect::<Result<_, _>>()?;
        let amplitude = 0.002 * self.detector.model().largest_side();
        let noisy = noise(self.original.points(), amplitude, &mut ChaCha8Rng::seed_from_u64(1));
        let unmarked = Soup::new(noisy, self.original.triangles().to_vec());
        tried.push(self.look("not marked, noise 0.2 %", false, &unmarked)?);
        count();
        Ok(tried)
    }

    fn look(&self, name: &'static str, marked: bool, soup: &Soup) -> Result<Tried, Failure> {
        let words: String = name.chars().filter(|c| c.is_alphanumeric() || *c == '.').collect();
        let words = if name == "none" { "marked" } else { &words };
        let file = format!("{}-{words}.{}", self.name, self.original.extension());
        let document =
            Document::parse(encode(self.original.format(), soup)?, None).map_err(|e| self.failed(&e))?;
        let mut detection = self
            .detector
            .detect(&self.detector.suspect(&document), &DetectOptions::default())
            .map_err(|e| self.failed(&e))?;
        // One seed, one demo: times would differ from run to run.
        detection.seconds = Stages::default();
        Ok(Tried { name, marked, file, document, detection })
    }

    /// Original, key, every suspect, and a report.
    pub(super) fn files(&self, tried: &[Tried]) -> Result<Vec<File>, Failure> {
        let usual = |name, bytes| File { name, bytes, access: Access::Usual };
        let original = format!("{}.{}", self.name, self.original.extension());
        let key_name = format!("{}.key", self.name);
        let key = self.marked.key.to_json().into_bytes();
        let mut files = vec![usual(original.clone(), self.original.bytes().to_vec())];
        for tried in tried {
            files.push(usual(tried.file.clone(), tried.document.bytes().to_vec()));
            if tried.name == reported(self.name) {
                let evidence = Evidence::new(
                    FileHash::new(&*tried.file, tried.document.bytes()),
                    FileHash::new(&*original, self.original.bytes()),
                    FileHash::new(&*key_name, &key),
                    &self.marked.key,
                    DetectOptions::default(),
                );
                let claim = Claim::new(
                    tried.detection.detected,
                    tried.detection.log10_p,
                    &self.marked.key,
                    None,
                    &DetectOptions::default(),
                );
                let report = Report {
                    detection: &tried.detection,
                    claim: &claim,
                    key: &self.marked.key,
                    original: self.detector.model(),
                    suspect: &self.detector.suspect(&tried.document).soup,
                    prepared: false,
                    evidence: &evidence,
                };
                let page = page(&report).map_err(|e| self.failed(&e))?;
                files.push(usual(format!("{}-report.html", self.name), page.into_bytes()));
            }
        }
        files.push(File { name: key_name, bytes: key, access: Access::Private });
        Ok(files)
    }

    fn failed(&self, error: &dyn std::error::Error) -> Failure {
        failed(self.name, error)
    }
}

fn failed(model: &str, error: &dyn std::error::Error) -> Failure {
    Failure::new("internal", format!("the {model}: {error}"))
}
