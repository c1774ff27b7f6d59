//! Table 3: seconds by stage, one run each, nothing else running.

use super::paper::Model;
use anyhow::Context;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use sombrero::attacks::apply_all;
use sombrero::basis::{Basis, BasisOptions};
use sombrero::extraction::extract;
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::progressive::ProgressiveMesh;
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::watermark::{Preset, embed, gaussians};
use std::path::Path;
use std::time::Instant;

/// The stages in order, with the paper's minutes where they survived the printing.
pub(crate) const STAGES: [&str; 6] = [
    "conversion to a progressive mesh",
    "basis functions",
    "insertion",
    "registration",
    "resampling",
    "extraction",
];

/// One model's times, in the order of [`STAGES`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Times {
    pub(crate) model: String,
    pub(crate) vertices: usize,
    pub(crate) seconds: Vec<f64>,
}

pub(crate) fn measure(folder: &Path, model: &Model) -> anyhow::Result<Times> {
    let document = Document::read(&folder.join(model.file)).context("run `cargo xtask models` first")?;
    let surface = sombrero::Model::new(document.soup());
    let made = surface.repaired();
    let Soup { points, triangles } = surface.soup();
    let mut seconds = Vec::new();
    let mut clock = Instant::now();
    let mut lap = |clock: &mut Instant| {
        seconds.push(clock.elapsed().as_secs_f64());
        *clock = Instant::now();
    };
    let progressive = ProgressiveMesh::new(made.mesh.clone(), &made.points)?;
    lap(&mut clock);
    let basis = Basis::new(progressive, &made.points, &BasisOptions::default())?;
    let basis = basis.on_points(&made.source, points.len());
    lap(&mut clock);
    let epsilon = Preset::Paper.parameters().epsilon;
    let w = gaussians([0; 32], basis.functions().len());
    let marked = embed(points, &basis, &w, epsilon);
    lap(&mut clock);
    let marked = Soup::new(marked, triangles.clone());
    let attacks = ["reorder".parse()?, "transform".parse()?];
    let suspect = apply_all(&attacks, &marked, &mut ChaCha8Rng::seed_from_u64(0))?.soup;
    clock = Instant::now();
    let reference = Reference::new(points, triangles)?;
    let found = register(&reference, &suspect.points, &suspect.triangles, &RegisterOptions::default())?;
    lap(&mut clock);
    let aligned = suspect.points.iter().map(|p| found.best.reference_from_suspect * p).collect();
    let aligned = Soup::new(aligned, suspect.triangles);
    clock = Instant::now();
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let resampled = resample(surface.soup(), &aligned, &ResampleOptions::default(), &mut rng)?;
    lap(&mut clock);
    extract(&basis, epsilon, points, &resampled.positions).context("extraction")?;
    lap(&mut clock);
    Ok(Times { model: model.name.into(), vertices: points.len(), seconds })
}
