//! What a dishonest claimant tries, small; `cargo xtask forgery` tries it at length.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Point3;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::BasisOptions;
use sombrero::extraction::{Deformation, Extractor, Nuisance};
use sombrero::io::{Document, Format};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::stats::{WatermarkTestOptions, watermark_test};
use sombrero::watermark::{
    Derivation, Identity, Key, Mismatch, OriginalDigest, Parameters, Preset, Secret, gaussians,
};
use sombrero::{Claim, Convinces, DetectError, DetectOptions, Detection, Detector, Embedder, Model};
use sombrero_tests::document;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A glTF with its positions in two buffers, of which only the first bytes are needed, cut at this byte.
fn cut_at(all: &[u8], at: usize) -> Document {
    let folder = tempfile::tempdir().unwrap();
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],
        "accessors":[{"bufferView":0,"componentType":5125,"count":12,"type":"SCALAR"},
            {"bufferView":1,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[9,9,9]}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":1,"byteLength":48}],
        "buffers":[{"uri":"faces.bin","byteLength":48},{"uri":"points.bin","byteLength":48}]}"#;
    std::fs::write(folder.path().join("model.gltf"), json).unwrap();
    std::fs::write(folder.path().join("faces.bin"), &all[..at]).unwrap();
    std::fs::write(folder.path().join("points.bin"), &all[at..]).unwrap();
    Document::read(&folder.path().join("model.gltf")).unwrap()
}

/// The first version hashed all files one after another: where one buffer ends and the next begins was free, and decides
/// the shape.
#[test]
fn the_same_bytes_cut_into_buffers_in_another_way_are_another_original() {
    let faces = [0_u32, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0];
    let mut all: Vec<u8> = faces.iter().flat_map(|v| v.to_le_bytes()).collect();
    all.extend((0..40).flat_map(|i| ((i * i * 7 % 31) as f32).to_le_bytes()));
    let [one, other] = [48, 60].map(|at| cut_at(&all, at));
    let joined =
        |document: &Document| -> Vec<u8> { document.parts().flat_map(|(_, bytes)| bytes.to_vec()).collect() };
    assert_eq!(joined(&one), joined(&other));
    assert_ne!(one.points(), other.points());
    assert_ne!(OriginalDigest::of(one.parts()).sha256(), OriginalDigest::of(other.parts()).sha256());
}

/// An unmarked suspect, and an original that the claimant makes of it so that w* is what he likes.
struct MadeUp {
    original: Document,
    suspect: Soup,
    parameters: Parameters,
}

impl MadeUp {
    fn new() -> Self {
        let basis = BasisOptions { coefficients: 16, ..BasisOptions::default() };
        let parameters = Parameters { preset: None, basis, epsilon: 0.01 };
        let suspect = shapes::bust(6);
        let w0 = gaussians([3; 32], 16);
        let model = Model::new(&suspect);
        let moved = model.basis(&basis).unwrap().displacements(&w0, parameters.epsilon);
        let points: Vec<Point3<f64>> =
            model.soup().points.iter().zip(moved).map(|(p, moved)| p - moved).collect();
        let original = Soup::new(model.stored_from_points(&points), suspect.triangles.clone());
        let original = document(Format::PlyBinaryLittleEndian, &original);
        Self { original, suspect, parameters }
    }

    fn key(&self, derivation: Derivation, secret: Secret) -> Key {
        let basis = Model::new(self.original.soup()).basis(&self.parameters.basis).unwrap();
        let digest = OriginalDigest::of(self.original.parts());
        Key::new(&digest, Identity::default(), secret, self.parameters, &basis.digest(), derivation)
    }

    fn detection(&self, detector: &Detector) -> Detection {
        let suspect = document(Format::PlyBinaryLittleEndian, &self.suspect);
        detector.detect(&detector.suspect(&suspect), &DetectOptions::default()).unwrap()
    }
}

/// With what is read from the suspect as its watermark a key would be found there, but no secret leads to it: the key is
/// refused. With the w that his secret leads to, there is nothing.
#[test]
fn an_original_that_was_solved_for_a_mark_needs_a_key_that_nobody_can_make() {
    let made_up = MadeUp::new();
    let honest = made_up.key(Derivation::STANDARD, Secret([1; 32]));
    let detector = Detector::new(&made_up.original, honest.clone()).unwrap();
    let nothing = made_up.detection(&detector);
    assert!(nothing.log10_p > -3.0, "{}", nothing.log10_p);

    let suits = nothing.extracted.iter().map(|w| w.unwrap_or(0.0)).collect();
    let forged = Key { watermark: suits, ..honest };
    let refused = Detector::new(&made_up.original, forged.clone()).unwrap_err();
    assert!(matches!(refused, DetectError::Key(Mismatch::Watermark { coefficient: 0 })), "{refused}");
    // What he would have had.
    let believed = Detector::trusting(&made_up.original, forged).unwrap();
    assert!(made_up.detection(&believed).log10_p < -20.0);
}

/// A key with a derivation that costs nothing would make tries free again.
#[test]
fn a_cheap_derivation_is_refused_and_convinces_nobody_else() {
    let made_up = MadeUp::new();
    let cheap = made_up.key(Derivation::stub_for_experiments(), Secret([1; 32]));
    let refused = Detector::new(&made_up.original, cheap.clone()).unwrap_err();
    assert!(matches!(refused, DetectError::Key(Mismatch::Derivation { .. })), "{refused}");
    assert!(Key::from_json(cheap.to_json().as_bytes()).is_err());
    let claim = Claim::new(true, -300.0, &cheap, None, &DetectOptions::default());
    assert_ne!(claim.convinces, Convinces::Anybody);
}

/// Whatever is changed in a key, it is not genuine any more: nothing can be chosen after w is known.
#[test]
fn nothing_that_decides_the_mark_can_be_changed_afterwards() {
    let original = document(Format::PlyBinaryLittleEndian, &shapes::bust(6));
    let embedder = Embedder::new(&original, Preset::Paper.parameters(), true).unwrap();
    let key = embedder.key(Identity { owner: "A".into(), recipient: "B".into() }, Secret([5; 32]));
    assert!(Detector::new(&original, key.clone()).is_ok());
    let edit = |edit: fn(&mut Key)| {
        let mut key = key.clone();
        edit(&mut key);
        Detector::new(&original, key).unwrap_err()
    };
    for refused in [
        edit(|key| key.identity.owner.push('!')),
        edit(|key| key.identity.recipient.clear()),
        edit(|key| key.secret.0[0] ^= 1),
        edit(|key| key.parameters.epsilon *= 1.000_1),
        edit(|key| key.parameters.preset = None),
        edit(|key| key.original_sha256[0] ^= 1),
        edit(|key| key.basis_sha256[0] ^= 1),
        edit(|key| key.watermark[7] += 1e-9),
    ] {
        assert!(matches!(refused, DetectError::Key(_)), "{refused}");
    }
}

/// Ten thousand secrets against one suspect reach what theory says and no more.
#[test]
fn grinding_brings_what_theory_says() {
    const TRIES: u32 = 10_000;
    let made_up = MadeUp::new();
    let model = Model::new(made_up.original.soup());
    let Parameters { basis: options, epsilon, .. } = made_up.parameters;
    let basis = model.basis(&options).unwrap();
    let noisy = parse_list("noise:amplitude=0.002").unwrap();
    let suspect = apply_all(&noisy, model.soup(), &mut ChaCha8Rng::seed_from_u64(9)).unwrap().soup;
    let found: Vec<_> = suspect.points.into_iter().map(Some).collect();
    let nuisance = Nuisance { deformation: Deformation::Similarity, modes: &[] };
    let extractor = Extractor::new(&basis, epsilon, model.soup()).unwrap();
    let known = extractor.estimate_from_vertices(&found, nuisance).unwrap().known();

    let digest = OriginalDigest::of(made_up.original.parts());
    let basis_digest = basis.digest();
    let log10_p = |number: u32| {
        let mut secret = Secret([0; 32]);
        secret.0[..4].copy_from_slice(&number.to_le_bytes());
        let stub = Derivation::stub_for_experiments();
        let key = Key::new(&digest, Identity::default(), secret, made_up.parameters, &basis_digest, stub);
        watermark_test(&key.watermark, &known, &WatermarkTestOptions::default()).unwrap().log10_p()
    };
    let all: Vec<f64> = (0..TRIES).map(log10_p).collect();
    for k in 1..4 {
        let expected = f64::from(TRIES) * 10f64.powi(-k);
        let count = all.iter().filter(|p| **p <= -f64::from(k)).count() as f64;
        // Four standard deviations either way.
        assert!((count - expected).abs() < 4.0 * expected.sqrt(), "{count} at -{k}, {expected} expected");
    }
    let smallest = all.iter().copied().fold(0.0, f64::min);
    assert!((-8.0..-2.5).contains(&smallest), "{smallest}");
}
