//! What must hold for any bytes whatever: the bodies of the fuzz targets in `fuzz/`, of the property tests in
//! `mutants.rs` and of `cargo xtask hostile`.
//!
//! A body takes bytes and panics when the library does, or when a file that was read does not keep Law 2: written
//! with other positions it must read back with these, and with the same faces and attributes.

mod compressed;
mod mutate;
mod seeds;

pub use mutate::mutated;
pub use seeds::seeds;

use crate::containers;
use nalgebra::Point3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::info;
use sombrero::io::{Document, Format, Limits, Rewrite};
use sombrero::watermark::Key;
use std::sync::LazyLock;

/// What is fed with hostile bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// The reader of OBJ.
    Obj,
    /// The reader of PLY.
    Ply,
    /// The reader of OFF.
    Off,
    /// The reader of STL.
    Stl,
    /// The reader of glTF as JSON.
    Gltf,
    /// The reader of GLB.
    Glb,
    /// The reader of 3MF.
    ThreeMf,
    /// The reader of keys.
    Key,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::Obj, Self::Ply, Self::Off, Self::Stl, Self::Gltf, Self::Glb, Self::ThreeMf, Self::Key];

    /// How its files' names end, and what the fuzz target is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Off => "off",
            Self::Stl => "stl",
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::ThreeMf => "3mf",
            Self::Key => "key",
        }
    }

    /// Feeds it; whether it took the bytes for a file.
    ///
    /// # Panics
    /// When the library does, or breaks what it promises.
    pub fn feed(self, bytes: &[u8]) -> bool {
        match self {
            Self::Key => key(bytes),
            _ => mesh(bytes, self.name()),
        }
    }
}

/// Limits that a service might set.
fn limits() -> Limits {
    Limits::default().with_max_bytes(64 << 20).with_max_vertices(1_000_000)
}

fn mesh(bytes: &[u8], extension: &str) -> bool {
    let Ok(document) = Document::parse_within(bytes.to_vec(), Some(extension), limits()) else {
        return false;
    };
    assert!(document.points().iter().all(|p| p.iter().all(|c| c.is_finite())), "a coordinate is not finite");
    let count = document.points().len();
    let in_range = |t: &[u32; 3]| t.iter().all(|&v| (v as usize) < count);
    assert!(document.triangles().iter().all(in_range), "a triangle refers to no vertex");
    let same = document.with_points(document.points());
    assert_eq!(same.as_deref().ok(), Some(bytes), "nothing moved, yet the file changed");
    if count < 500 {
        let _ = info(&document);
    }
    for renew in [false, true] {
        rewritten(&document, &Rewrite::default().with_renewed_normals(renew));
    }
    true
}

fn rewritten(document: &Document, how: &Rewrite) {
    // By amounts that every number type can hold, so that what is read back can be compared.
    let moved: Vec<Point3<f64>> =
        document.points().iter().map(|p| p.map(|c| f64::from(c as f32) + 0.5)).collect();
    let Ok(written) = document.rewrite(&moved, how) else { return };
    let again = Document::parse_within(written.bytes, Some(document.extension()), Limits::unlimited());
    let again = again.unwrap_or_else(|e| panic!("what was written does not read back: {e}"));
    assert_eq!(again.soup_like(document.triangles()).triangles, document.triangles(), "faces changed");
    assert_eq!(again.attributes(), document.attributes(), "attributes changed");
    assert_eq!(again.points().len(), moved.len(), "vertices came or went");
    // In a scene, what is stored is what a placement leaves of it, and that can be anything for wild placements.
    if !matches!(document.format(), Format::Gltf | Format::Glb | Format::ThreeMf) {
        let near =
            |(a, b): (&Point3<f64>, &Point3<f64>)| (0..3).all(|i| (a[i] - b[i]).abs() <= 1e-6 * b[i].abs());
        assert!(again.points().iter().zip(&moved).all(near), "other positions were written");
    }
}

fn key(bytes: &[u8]) -> bool {
    let Ok(key) = Key::from_json(bytes) else { return false };
    assert_eq!(Key::from_json(key.to_json().as_bytes()).ok(), Some(key), "a key does not read back");
    true
}

/// Input number `index` of a target: one of its [`seeds`] changed at random, the same on every call.
///
/// Checksums and lengths keep most changes of an archive or a GLB from the reader of what is in it, so the content
/// is changed more often than the container.
pub fn input(target: Target, seeds: &[Vec<u8>], index: u64) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(index);
    match (target, rng.random_range(0..4_u32)) {
        (Target::ThreeMf, 1..) => {
            let [valid, other] = two(seeds::MODELS, &mut rng).map(|model| model.as_bytes());
            seeds::archive(&mutated(valid, other, &mut rng))
        }
        (Target::Glb, 1..) => {
            static SCENES: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(seeds::scenes);
            let [(json, bin), (other, more)] = two(&SCENES, &mut rng);
            let json = if rng.random() {
                json.clone().into_bytes()
            } else {
                mutated(json.as_bytes(), other.as_bytes(), &mut rng)
            };
            let bin = if rng.random() { bin.clone() } else { mutated(bin, more, &mut rng) };
            containers::glb(&json, &bin)
        }
        _ => {
            let [valid, other] = two(seeds, &mut rng);
            mutated(valid, other, &mut rng)
        }
    }
}

/// A 3MF with these bytes for its model.
pub fn archived(model: &[u8]) -> Vec<u8> {
    seeds::archive(model)
}

fn two<'a, T>(all: &'a [T], rng: &mut ChaCha8Rng) -> [&'a T; 2] {
    std::array::from_fn(|_| &all[rng.random_range(0..all.len())])
}
