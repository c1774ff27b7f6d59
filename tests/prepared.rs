//! What was prepared changes how long detection takes and nothing else.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::parse_list;
use sombrero::io::{Document, Format};
use sombrero::shapes;
use sombrero::{DetectOptions, Detection, Detector, Method, PreparedBasis, Stages, attack};
use sombrero_tests::{document, groups, marked};

/// All but the time it took. Numbers are equal to the bit where their shortest decimal forms are.
fn said(mut detection: Detection) -> String {
    detection.seconds = Stages::default();
    format!("{detection:?}")
}

#[test]
fn verdicts_are_the_same_to_the_bit() {
    let original = document(Format::PlyBinaryLittleEndian, &shapes::bust(14));
    let mark = marked(&original, 1);
    let copy = Document::parse(mark.bytes, None).unwrap();
    let new = Detector::new(&original, mark.key.clone()).unwrap();
    let stored = PreparedBasis::parse(&new.prepared_basis(), &mark.key).unwrap();
    let stored = Detector::with_prepared_basis(&original, mark.key, stored).unwrap();
    let look = |source: &Document, specs: &str, method: Method| {
        let attacks = parse_list(specs).unwrap();
        let bytes = attack(source, &attacks, &mut ChaCha8Rng::seed_from_u64(5)).unwrap().bytes;
        let suspect = Document::parse(bytes, None).unwrap();
        let options = DetectOptions { method, ..DetectOptions::default() };
        let [one, two] = [&new, &stored].map(|p| p.detect(&p.suspect(&suspect), &options).unwrap());
        let detected = one.detected;
        assert_eq!(said(one), said(two), "{specs}, {method:?}");
        detected
    };
    for specs in [
        "noise:amplitude=0.002",
        "simplify:ratio=0.5 transform",
        "crop:fraction=0.333 reorder transform",
        "affine:strength=0.3 simplify:ratio=0.6",
    ] {
        assert!(look(&copy, specs, Method::Robust), "{specs}");
    }
    assert!(look(&copy, "noise:amplitude=0.002 transform", Method::Paper));
    assert!(!look(&original, "noise:amplitude=0.002", Method::Robust));
    assert!(!look(&original, "simplify:ratio=0.5 transform", Method::Robust));
    stored.confirm().unwrap();
}

#[test]
fn every_kind_of_mesh_can_be_prepared() {
    for (name, soup) in groups() {
        let original = document(Format::Obj, &soup);
        let key = marked(&original, 6).key;
        let new = Detector::new(&original, key.clone()).unwrap();
        let stored = PreparedBasis::parse(&new.prepared_basis(), &key).unwrap();
        let stored = Detector::with_prepared_basis(&original, key, stored).unwrap();
        assert_eq!(stored.basis(), new.basis(), "{name}");
        assert!(stored.prepared_basis() == new.prepared_basis(), "{name}");
        stored.confirm().unwrap();
    }
}
