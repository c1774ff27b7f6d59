//! "p" means what it says: of keys that have nothing to do with a suspect, a share p matches it as well as p.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sombrero::Detector;
use sombrero::attacks::apply_all;
use sombrero::extraction::{Deformation, Extractor, Modes, Nuisance};
use sombrero::io::{Document, Format};
use sombrero::shapes;
use sombrero::stats::{Ellipsoid, WatermarkTestOptions, watermark_test, wilson_interval};
use sombrero::watermark::{Preset, gaussians};
use sombrero_tests::{document, marked_by, test_known};

const KEYS: usize = 10_000;

/// What is extracted from the copy of somebody else after these attacks.
fn extracted(specs: &[&str]) -> Vec<Option<f64>> {
    let original = document(Format::PlyBinaryLittleEndian, &shapes::bumpy_sphere(700));
    let somebody_else = marked_by(&original, 0xee, Preset::Paper);
    let copy = Document::parse(somebody_else.bytes, None).unwrap();
    let key = Detector::new(&original, somebody_else.key).unwrap();
    let attacks: Vec<_> = specs.iter().map(|s| s.parse().unwrap()).collect();
    let suspect = apply_all(&attacks, copy.soup(), &mut ChaCha8Rng::seed_from_u64(1999)).unwrap();
    let (extracted, test) = test_known(&key, &suspect.correspondence(copy.points().len()));
    assert!(test.log10_p() < -6.0, "{specs:?}: a trivial suspect");
    extracted
}

fn assert_calibrated(specs: &[&str]) {
    let extracted = extracted(specs);
    let p: Vec<f64> = (0..KEYS)
        .map(|i| {
            let mut seed = [0; 32];
            seed[..8].copy_from_slice(&(i as u64).to_le_bytes());
            watermark_test(&gaussians(seed, 50), &extracted, &WatermarkTestOptions::default()).unwrap().p.p()
        })
        .collect();
    for nominal in [0.1, 0.01, 0.001] {
        let hits = p.iter().filter(|p| **p <= nominal).count();
        let interval = wilson_interval(hits, KEYS, 0.999).unwrap();
        assert!(interval.contains(nominal), "{specs:?}: {hits} of {KEYS} at {nominal}: {interval:?}");
    }
    // None of ten thousand comes near the usual threshold.
    let best = p.iter().copied().fold(1.0, f64::min);
    assert!(best > 1e-6, "{specs:?}: {best}");
}

/// The robust tests promise no less: of strange keys at most a share p is as near to what was found as p tells.
#[test]
fn of_strange_keys_at_most_a_share_p_is_in_the_ellipsoid() {
    let original = document(Format::PlyBinaryLittleEndian, &shapes::bumpy_sphere(900));
    let somebody_else = marked_by(&original, 0xee, Preset::Paper);
    let copy = Document::parse(somebody_else.bytes, None).unwrap();
    let key = Detector::new(&original, somebody_else.key).unwrap();
    let extractor = Extractor::new(key.basis(), key.key().parameters.epsilon, key.model().soup()).unwrap();
    let nuisance = Nuisance { deformation: Deformation::Affine, modes: &[Modes::Smoothing] };
    let attacks = ["simplify:ratio=0.5", "crop:fraction=0.333"].map(|s| s.parse().unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let suspect = apply_all(&attacks, copy.soup(), &mut rng).unwrap().soup;
    let estimate = extractor.estimate_from_surface(&suspect, nuisance).unwrap();
    let ellipsoid = Ellipsoid::new(&estimate.coefficients, &estimate.precision).unwrap();
    assert!(ellipsoid.test(&key.key().watermark).unwrap().bound.log10() < -6.0, "a trivial suspect");
    for floor in [0.0, 0.3] {
        let ellipsoid = ellipsoid.with_floor(floor).unwrap();
        let mut hits = [0; 3];
        for _ in 0..KEYS {
            let w: Vec<f64> = StandardNormal.sample_iter(&mut rng).take(50).collect();
            let p = ellipsoid.test(&w).unwrap().bound.p();
            for (hits, nominal) in hits.iter_mut().zip([0.1, 0.01, 0.001]) {
                *hits += usize::from(p <= nominal);
            }
        }
        for (hits, nominal) in hits.into_iter().zip([0.1, 0.01, 0.001]) {
            let interval = wilson_interval(hits, KEYS, 0.999).unwrap();
            assert!(interval.low <= nominal, "floor {floor}: {hits} of {KEYS} at {nominal}");
        }
        assert!(hits[0] > KEYS / 1000, "a bound that is never reached tests nothing: {hits:?}");
    }
}

#[test]
fn of_strange_keys_a_share_p_matches_a_noisy_copy_as_well_as_p() {
    assert_calibrated(&["noise:amplitude=0.002"]);
}

#[test]
fn of_strange_keys_a_share_p_matches_what_is_left_of_a_copy_as_well_as_p() {
    assert_calibrated(&["noise:amplitude=0.001", "watermark:epsilon=0.002", "crop:fraction=0.333"]);
}
