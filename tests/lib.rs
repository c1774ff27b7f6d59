//! What the stories share: groups of generated meshes, files in every format that are as full of extras as real
//! ones, and a folder in which the command is run and watched.

#![allow(clippy::unwrap_used, reason = "a story that cannot begin shall fail loudly")]

mod containers;
pub mod hostile;
mod meshes;
mod samples;
mod workshop;

pub use containers::archive;
pub use meshes::{flat_sheet, groups, joined, mapped, ring, shell, tile, wall, wavy};
pub use samples::{Sample, ascii_stl, binary_stl, obj, off, ply, samples, separate_gltf};
pub use workshop::{Ran, Workshop};

use nalgebra::Point3;
use sha2::{Digest, Sha256};
use sombrero::extraction::extract;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use sombrero::stats::{WatermarkTest, WatermarkTestOptions, watermark_test};
use sombrero::watermark::{Preset, Secret, gaussians};
use sombrero::{DetectOptions, Detector, EmbedOptions, Marked, When, embed};

/// A plain file of this format that holds `soup`, read.
pub fn document(format: Format, soup: &Soup) -> Document {
    Document::parse(encode(format, soup).unwrap(), None).unwrap()
}

/// The copy of `original` that carries the mark of this secret by the preset robust.
pub fn marked(original: &Document, secret: u8) -> Marked {
    marked_by(original, secret, Preset::Robust)
}

/// The same by this preset.
pub fn marked_by(original: &Document, secret: u8, preset: Preset) -> Marked {
    let options = EmbedOptions { parameters: preset.parameters(), ..EmbedOptions::default() };
    embed(original, Secret([secret; 32]), &options).unwrap()
}

/// Detection that takes a suspect as it is: vertex i of the suspect is vertex i of the original, where it stands.
pub fn as_it_is() -> DetectOptions {
    DetectOptions { registration: When::Never, resampling: When::Never, ..DetectOptions::default() }
}

/// The extracted coefficients and the paper's test of a suspect whose correspondence is known: `found[j]` is where
/// point j of the original is on the suspect, or `None` when it is missing.
pub fn test_known(key: &Detector, found: &[Option<Point3<f64>>]) -> (Vec<Option<f64>>, WatermarkTest) {
    let epsilon = key.key().parameters.epsilon;
    let extraction = extract(key.basis(), epsilon, &key.model().soup().points, found).unwrap();
    let test =
        watermark_test(&key.key().watermark, &extraction.coefficients, &WatermarkTestOptions::default());
    (extraction.coefficients, test.unwrap())
}

/// The watermark of the recorded tables for this original and secret: the first version's, by SHA-256 alone. Tables take it
/// still, so that figures of different versions are of the same marks; no key that is read has it.
pub fn recorded_watermark(original: &[u8], secret: &Secret, coefficients: usize) -> Vec<f64> {
    let mut seed = Sha256::new();
    for part in [b"sombrero watermark 1".as_slice(), original, b"", b"", &secret.0] {
        seed.update((part.len() as u64).to_le_bytes());
        seed.update(part);
    }
    gaussians(seed.finalize().into(), coefficients)
}
