//! The demo's picture: a strip for each model.

use super::case::{Case, Tried};
use crate::failure::Failure;
use nalgebra::Vector3;
use sombrero::mesh::Soup;
use sombrero::render::{Camera, HeatMap, Image, RenderOptions, render, used_points};

const SIZE: u32 = 360;
const GAP: u32 = 8;
const BACKGROUND: [u8; 4] = [255; 4];

/// Original, marked, displacement as a heat map, strong noise, smoothed, cropped; from one camera.
pub(super) fn strip(case: &Case, tried: &[Tried]) -> Image {
    let soup = case.original.soup();
    let bust = case.name == "bust";
    let direction = if bust { Vector3::new(-0.5, -0.15, -1.0) } else { Vector3::new(-0.7, 1.0, -0.6) };
    let up = if bust { Vector3::y() } else { Vector3::z() };
    let options = RenderOptions {
        width: SIZE,
        height: SIZE,
        camera: Some(Camera::framing(&used_points(&soup.points, &soup.triangles), direction, up)),
        background: BACKGROUND,
        ..RenderOptions::default()
    };
    let shaded = |soup: &Soup| render(&soup.points, &soup.triangles, &options);
    let of = |name: &str| tried.iter().find(|t| t.name == name).map(|t| t.document.soup());
    let nothing = Soup::default();
    let marked = of("none").unwrap_or(&nothing);
    let moved = soup.points.iter().zip(&marked.points).map(|(p, q)| (q - p).norm()).collect();
    let heat = RenderOptions { heat_map: Some(HeatMap::new(moved)), ..options.clone() };
    let mut pictures = vec![shaded(soup), shaded(marked), render(&marked.points, &marked.triangles, &heat)];
    let attacked = ["noise 0.7 %", "smoothing", "crop, right third"];
    pictures.extend(attacked.iter().filter_map(|name| of(name)).map(shaded));
    Image::beside(&pictures, GAP, BACKGROUND)
}

pub(super) fn stacked(strips: &[Image]) -> Result<Vec<u8>, Failure> {
    let picture = Image::stacked(strips, GAP, BACKGROUND);
    picture.to_png().map_err(|e| Failure::new("internal", e.to_string()))
}
