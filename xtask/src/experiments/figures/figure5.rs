//! Figure 5: the marked fandisk under the noise of rows C, D and E: 0.2 %, 0.45 % and 0.7 % of its largest side.

use super::{Exhibit, GAP, WHITE, picture};
use crate::experiments::roc::AMPLITUDES;
use sombrero::render::{Image, RenderOptions, Shading};
use std::path::Path;

pub(super) fn draw(folder: &Path) -> anyhow::Result<Image> {
    let fandisk = Exhibit::read(folder, "fandisk")?;
    let camera = Some(fandisk.camera());
    let options = RenderOptions { width: 440, height: 420, camera, ..RenderOptions::default() };
    let options = RenderOptions { shading: Shading::Flat, ..options };
    let noisy = |(_, amplitude)| {
        let soup = fandisk.attacked(&format!("noise:amplitude={amplitude}"))?;
        Ok(picture(&soup, &options))
    };
    let pictures = AMPLITUDES.into_iter().map(noisy).collect::<anyhow::Result<Vec<Image>>>()?;
    Ok(Image::beside(&pictures, GAP, WHITE))
}
