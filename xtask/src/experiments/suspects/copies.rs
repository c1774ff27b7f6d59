//! Copies of the paper's models that were mirrored, scanned as points, or printed and scanned.

use super::owner::{Mark, Owner};
use super::{Line, Suspects};
use crate::experiments::tables::paper::MODELS;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::{BoundingBox, Soup};
use sombrero::watermark::Preset;
use std::path::Path;

/// Name, attack, and the standard deviation of noise along each axis afterwards, in largest sides.
const COPIES: [(&str, &str, f64); 7] = [
    ("mirrored", "mirror transform", 0.0),
    ("mirrored, half of the faces", "mirror simplify:ratio=0.5 transform", 0.0),
    ("mirrored, a third cropped", "mirror crop:fraction=0.333 transform", 0.0),
    ("20,000 points, noise 0.1 %", "transform points:count=20000", 0.001),
    ("200,000 points, noise 0.1 %", "transform points:count=200000", 0.001),
    ("200,000 points, a third missing", "crop:fraction=0.333 transform points:count=200000", 0.001),
    ("printed at 100 mm and scanned, simulated", "print:size=100 transform", 0.0),
];

pub(super) fn lines(args: &Suspects, folder: &Path, preset: Preset) -> anyhow::Result<Vec<Line>> {
    let owner = Owner::new()?;
    let mut lines = Vec::new();
    for model in MODELS.iter().filter(|model| args.asks_for(model.name)) {
        let mut made =
            COPIES.map(|(suspect, ..)| Line::new("Mirrored, scanned, printed", model.name, preset, suspect));
        for seed in 0..args.runs {
            let mark = owner.mark(&folder.join(model.file), preset, seed)?;
            for (line, (_, specs, deviation)) in made.iter_mut().zip(COPIES) {
                line.answers.push(mark.look(&suspect(&mark, specs, deviation, seed)?)?);
            }
        }
        lines.extend(made.map(Line::print));
    }
    Ok(lines)
}

fn suspect(mark: &Mark<'_>, specs: &str, deviation: f64, seed: u64) -> anyhow::Result<Soup> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut soup = apply_all(&parse_list(specs)?, &mark.copy, &mut rng)?.soup;
    if deviation > 0.0 {
        let side = BoundingBox::of(&soup.points).map_or(0.0, |around| around.largest_side());
        let mut normal = |_, _| rng.sample::<f64, _>(StandardNormal);
        soup.points.iter_mut().for_each(|p| *p += Vector3::from_fn(&mut normal) * (deviation * side));
    }
    Ok(soup)
}
