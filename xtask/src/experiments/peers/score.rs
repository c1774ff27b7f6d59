//! How well the base meshes of stage a keep the shape: the distance of the original's vertices from them.

use super::cases::{diagonal, read_mesh};
use super::measure::Row;
use sombrero::mesh::Soup;
use sombrero::spatial::Surface;
use std::path::Path;

/// Vertices that are looked at.
const SAMPLES: usize = 20_000;

/// Replaces the name of the mesh that a peer left by its faces and its distance.
pub(crate) fn fill_in(cases: &Path, folder: &Path, rows: &mut [Row]) -> anyhow::Result<()> {
    for row in rows {
        let Some(tag) = row.acc.remove("score") else { continue };
        let tag = tag.as_str().unwrap_or_default();
        let (original, base) = (read_mesh(cases, &row.model)?, read_mesh(&folder.join("scratch"), tag)?);
        row.acc.insert("faces".into(), base.triangles.len().into());
        row.acc.insert("rms".into(), distance(&original, &base).into());
    }
    Ok(())
}

/// Root mean square distance from the original's vertices to the base mesh, in diagonals.
fn distance(original: &Soup, base: &Soup) -> f64 {
    let surface = Surface::new(&base.points, &base.triangles);
    let step = original.points.len().div_ceil(SAMPLES).max(1);
    let found: Vec<f64> = original
        .points
        .iter()
        .step_by(step)
        .filter_map(|p| surface.closest(p))
        .map(|c| c.squared_distance)
        .collect();
    (found.iter().sum::<f64>() / found.len() as f64).sqrt() / diagonal(original)
}
