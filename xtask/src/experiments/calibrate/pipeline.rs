//! The whole detection on unmarked suspects: it picks the best of its variants and has to correct p for that.

use super::suspects::KINDS;
use super::{Rate, bar, rng};
use crate::experiments::case::{Case, random_secret};
use crate::experiments::tables::Method;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::DetectOptions;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::Preset;

/// What the whole detection made of suspects without a mark.
#[derive(Serialize)]
pub(super) struct Pipeline {
    suspects: u64,
    shapes: Vec<&'static str>,
    attacks: &'static [&'static str],
    /// Suspects that could not be compared at all; they count as not found.
    failed: usize,
    /// The corrected p.
    rates: Vec<Rate>,
}

/// Of these one to three are drawn.
const BATTERY: [&str; 10] = [
    "none",
    "reorder",
    "noise:amplitude=0.002",
    "noise:amplitude=0.007",
    "smooth:iterations=10",
    "transform",
    "simplify:ratio=0.5",
    "simplify:ratio=0.25",
    "watermark",
    "crop:fraction=0.333",
];

impl Pipeline {
    pub(super) fn run(method: Method, suspects: u64) -> anyhow::Result<Self> {
        let shapes = [
            ("bumpy sphere", shapes::bumpy_sphere(600)),
            ("bust", shapes::bust(8)),
            ("part", shapes::part(1)),
        ];
        let originals =
            shapes.iter().map(|(_, soup)| case(soup, method.preset())).collect::<Result<Vec<_>, _>>()?;
        let bar = bar(suspects, "suspects")?;
        let p = (0..suspects).into_par_iter().map(|i| {
            let case = &originals[i as usize % originals.len()];
            let p = detection(case, method, &mut rng(KINDS.len() as u64 + 1, i), i);
            bar.inc(1);
            p
        });
        let p = p.collect::<anyhow::Result<Vec<Option<f64>>>>()?;
        bar.finish_and_clear();
        let compared: Vec<f64> = p.iter().flatten().copied().collect();
        let (failed, rates) = (p.len() - compared.len(), Rate::all(&[0.1, 0.01], &compared, p.len())?);
        let shapes = shapes.iter().map(|(name, _)| *name).collect();
        let pipeline = Self { suspects, shapes, attacks: &BATTERY, failed, rates };
        pipeline.print();
        Ok(pipeline)
    }

    pub(super) fn print(&self) {
        println!("the whole detection, {} suspects, {} not comparable", self.suspects, self.failed);
        self.rates.iter().for_each(Rate::print);
    }
}

pub(super) fn document(soup: &Soup) -> anyhow::Result<Document> {
    Ok(Document::parse(encode(Format::PlyBinaryLittleEndian, soup)?, Some("ply"))?)
}

/// With as many coefficients as a small shape carries.
pub(super) fn case(soup: &Soup, preset: Preset) -> anyhow::Result<Case> {
    let document = document(soup)?;
    let mut parameters = preset.parameters();
    let capacity = sombrero::info(&document).capacity;
    parameters.basis.coefficients = parameters.basis.coefficients.min(capacity);
    Case::new(document, parameters)
}

/// log10 of the corrected p for a fresh key and an unmarked suspect; `None` when nothing could be compared.
fn detection(case: &Case, method: Method, rng: &mut ChaCha8Rng, seed: u64) -> anyhow::Result<Option<f64>> {
    let detector = case.detector(random_secret(rng))?;
    let suspect = detector.suspect(&document(&attacked(case.soup(), rng))?);
    let options = DetectOptions { method: method.into(), seed, ..DetectOptions::default() };
    Ok(detector.detect(&suspect, &options).ok().map(|detection| detection.log10_p))
}

/// The surface after one to three attacks of the battery; combinations that leave too little are drawn again.
pub(super) fn attacked(soup: &Soup, rng: &mut ChaCha8Rng) -> Soup {
    loop {
        let count = rng.random_range(1..=3);
        let specs: Vec<&str> = (0..count).map(|_| BATTERY[rng.random_range(0..BATTERY.len())]).collect();
        let made = parse_list(&specs.join(" "))
            .map_err(Into::into)
            .and_then(|attacks| anyhow::Ok(apply_all(&attacks, soup, rng)?));
        if let Ok(attacked) = made {
            return attacked.soup;
        }
    }
}
