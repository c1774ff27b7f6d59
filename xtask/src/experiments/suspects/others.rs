//! Suspects that show something else, and those that go onto themselves in endless many ways: how long the answer takes.

use super::owner::Owner;
use super::{Line, Suspects};
use crate::experiments::case::read;
use crate::experiments::catalogue::families;
use crate::experiments::tables::paper::MODELS;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::Preset;
use std::path::Path;

/// Generated shapes beside the models.
const GENERATED: u64 = 20;

pub(super) fn lines(args: &Suspects, folder: &Path, preset: Preset) -> anyhow::Result<Vec<Line>> {
    let owner = Owner::new()?;
    let mut lines = Vec::new();
    for (at, model) in MODELS.iter().enumerate().filter(|(_, model)| args.asks_for(model.name)) {
        let mark = owner.mark(&folder.join(model.file), preset, 0)?;
        for (name, suspect) in unrelated(folder, at)? {
            let mut line = Line::new("Something else", model.name, preset, &name);
            line.answers.push(mark.look(&suspect)?);
            lines.push(line.print());
        }
    }
    for (name, shape) in [("torus", shapes::torus(112, 40, 1.0, 0.4)), ("ball", shapes::sphere(5))] {
        if args.asks_for(name) {
            let mut line = Line::new("Endless poses", name, preset, "half of the faces, moved");
            for seed in 0..args.runs {
                let mark = owner.mark(&owner.keep("original", &shape)?, preset, seed)?;
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let attacks = parse_list("simplify:ratio=0.5 transform")?;
                line.answers.push(mark.look(&apply_all(&attacks, &mark.copy, &mut rng)?.soup)?);
            }
            lines.push(line.print());
        }
    }
    Ok(lines)
}

/// The other models, and the generated shapes whose turn it is.
fn unrelated(folder: &Path, own: usize) -> anyhow::Result<Vec<(String, Soup)>> {
    let mut suspects = Vec::new();
    for (_, model) in MODELS.iter().enumerate().filter(|(at, _)| *at != own) {
        suspects.push((model.name.to_owned(), read(folder, model.file)?.soup().clone()));
    }
    let turn = (0..GENERATED).filter(|number| *number as usize % MODELS.len() == own);
    suspects.extend(
        turn.map(|number| (format!("generated {number}"), families::original(number * families::MEMBERS))),
    );
    Ok(suspects)
}
