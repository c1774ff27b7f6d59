//! One cell: a model, a basis, an attack, some seeds.

use super::paper::{Model, Row};
use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use sombrero::attacks::{Attack, apply_all};
use sombrero::basis::{Basis, BasisFunction, BasisOptions};
use sombrero::extraction::extract;
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::stats::{WatermarkTestOptions, median, watermark_test};
use sombrero::watermark::{Distortion, Identity, Secret, embed, watermark};
use std::path::Path;
use std::time::Instant;

const EPSILON: f64 = 0.01;
const COEFFICIENTS: usize = 50;

/// An original with its basis.
pub(crate) struct Subject {
    name: &'static str,
    function: BasisFunction,
    document: Document,
    model: sombrero::Model,
    basis: Basis,
}

/// What was measured.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Cell {
    pub(crate) model: String,
    pub(crate) row: String,
    pub(crate) attack: String,
    pub(crate) basis: String,
    pub(crate) registration: bool,
    pub(crate) resampling: bool,
    /// One for each seed.
    pub(crate) log10_p: Vec<f64>,
    pub(crate) median_log10_p: f64,
    pub(crate) paper_log10_p: Option<f64>,
    /// Medians of the mark's displacement, relative to the largest side.
    pub(crate) relative_max: f64,
    pub(crate) relative_rms: f64,
    pub(crate) seconds: f64,
}

impl Subject {
    pub(crate) fn read(folder: &Path, model: &Model, function: BasisFunction) -> anyhow::Result<Self> {
        let document = Document::read(&folder.join(model.file))?;
        let surface = sombrero::Model::new(&document.soup());
        let basis = surface.basis(&BasisOptions { coefficients: COEFFICIENTS, function })?;
        Ok(Self { name: model.name, function, document, model: surface, basis })
    }

    pub(crate) fn title(&self) -> String {
        format!("{} {}", self.name, self.function)
    }
}

/// The result of one seed.
struct Trial {
    log10_p: f64,
    relative_max: f64,
    relative_rms: f64,
}

impl Cell {
    pub(crate) fn compute(
        subject: &Subject,
        row: &Row,
        paper: Option<f64>,
        runs: u64,
    ) -> anyhow::Result<Self> {
        let start = Instant::now();
        let attacks: Vec<Attack> = row.attack.split(' ').map(str::parse).collect::<Result<_, _>>()?;
        let trials =
            (0..runs).map(|seed| trial(subject, &attacks, seed)).collect::<anyhow::Result<Vec<_>>>()?;
        let of = |value: fn(&Trial) -> f64| -> Vec<f64> { trials.iter().map(value).collect() };
        let middle = |values: &[f64]| median(values).context("at least one seed is needed");
        let log10_p = of(|t| t.log10_p);
        Ok(Self {
            model: subject.name.into(),
            row: row.letter.into(),
            attack: row.attack.into(),
            basis: subject.function.to_string(),
            registration: row.registration,
            resampling: row.resampling,
            median_log10_p: middle(&log10_p)?,
            log10_p,
            paper_log10_p: paper,
            relative_max: middle(&of(|t| t.relative_max))?,
            relative_rms: middle(&of(|t| t.relative_rms))?,
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}

fn trial(subject: &Subject, attacks: &[Attack], seed: u64) -> anyhow::Result<Trial> {
    let Subject { document, model, basis, .. } = subject;
    let secret = Secret([u8::try_from(seed).context("at most 256 seeds")?; 32]);
    let w = watermark(document.bytes(), &Identity::default(), &secret, COEFFICIENTS);
    let Soup { points, triangles } = model.soup();
    let marked = embed(points, basis, &w, EPSILON);
    let distortion = Distortion::between(points, &marked);
    let marked = Soup::new(marked, triangles.clone());
    let attacked = apply_all(attacks, &marked, &mut ChaCha8Rng::seed_from_u64(seed))?;
    let extraction = extract(basis, EPSILON, points, &attacked.correspondence(points.len()))?;
    let test = watermark_test(&w, &extraction.coefficients, &WatermarkTestOptions::default())?;
    let side = model.largest_side();
    Ok(Trial {
        log10_p: test.log10_p(),
        relative_max: distortion.max / side,
        relative_rms: distortion.rms / side,
    })
}
