//! Figure 1: a mark from end to end, on the bunny.
//!
//! | | | |
//! |---|---|---|
//! | (a) original | (b) marked | (c) how far the mark moves the surface, along its normal |
//! | (d) attacked: simplified and moved | (e) after registration | (f) after resampling |

use super::{Exhibit, GAP, WHITE, picture, present, rng, wireframe};
use nalgebra::{Point3, Vector3};
use sombrero::mesh::Soup;
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::render::{ColorMap, HeatMap, Image, RenderOptions, Shading};
use sombrero::resampling::{ResampleOptions, resample};
use std::path::Path;

const ATTACK: &str = "simplify:ratio=0.1 transform:rotation=50";

pub(super) fn draw(folder: &Path) -> anyhow::Result<Image> {
    let bunny = Exhibit::read(folder, "bunny")?;
    let usual =
        RenderOptions { width: 400, height: 380, camera: Some(bunny.camera()), ..RenderOptions::default() };
    let marked = bunny.marked();
    let heat = RenderOptions { heat_map: Some(heat(bunny.original(), marked)), ..usual.clone() };

    let attacked = bunny.attacked(ATTACK)?;
    let registered = registered(bunny.original(), &attacked)?;
    let found = resample(bunny.original(), &registered, &ResampleOptions::default(), &mut rng())?.positions;
    let resampled = present(&found, &bunny.original().triangles);
    let facets = RenderOptions { shading: Shading::Flat, wireframe: wireframe(), ..usual.clone() };
    let elsewhere = RenderOptions { camera: Some(bunny.framing(&attacked)), ..facets.clone() };

    let pictures = [
        picture(bunny.original(), &usual),
        picture(marked, &usual),
        picture(bunny.original(), &heat),
        picture(&attacked, &elsewhere),
        picture(&registered, &facets),
        picture(&resampled, &usual),
    ];
    Ok(Image::grid(&pictures, 3, GAP, WHITE))
}

/// Outward red, inward blue.
fn heat(original: &Soup, marked: &Soup) -> HeatMap {
    let pairs = original.points.iter().zip(&marked.points).zip(normals(original));
    let values: Vec<f64> = pairs.map(|((before, after), normal)| normal.dot(&(after - before))).collect();
    // The few largest displacements do not leave the others pale.
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let most = sizes[sizes.len() * 99 / 100];
    HeatMap { range: Some((-most, most)), colors: ColorMap::CoolWarm, bar: false, ..HeatMap::new(values) }
}

/// Unit normals of points; zero where there is no face.
fn normals(soup: &Soup) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); soup.points.len()];
    for corners in &soup.triangles {
        let [a, b, c] = corners.map(|v| soup.points[v as usize]);
        let area = (b - a).cross(&(c - a));
        corners.iter().for_each(|&v| sums[v as usize] += area);
    }
    sums.into_iter().map(|sum| sum.try_normalize(0.0).unwrap_or_default()).collect()
}

fn registered(original: &Soup, suspect: &Soup) -> anyhow::Result<Soup> {
    let reference = Reference::new(&original.points, &original.triangles)?;
    let found = register(&reference, &suspect.points, &suspect.triangles, &RegisterOptions::default())?;
    let moved = |p: &Point3<f64>| found.best.reference_from_suspect * p;
    Ok(Soup::new(suspect.points.iter().map(moved).collect(), suspect.triangles.clone()))
}
