//! A thousand buyers, and one or several of them leak: who is named, and that nobody else is.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Point3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::io::{Document, Format, Rewrite};
use sombrero::mesh::Soup;
use sombrero::shapes;
use sombrero::watermark::{Derivation, Identity, Key, Mismatch, Preset, Secret};
use sombrero::{DetectOptions, Detector, Embedder, Trace, Tracer};
use sombrero_tests::document;

const BUYERS: usize = 1000;

struct Shop {
    original: Document,
    tracer: Tracer,
    keys: Vec<Key>,
}

fn buyer(i: usize) -> (Identity, Secret) {
    let mut secret = [7; 32];
    secret[..8].copy_from_slice(&i.to_le_bytes());
    (Identity { owner: "A. Shop".into(), recipient: format!("buyer {i}") }, Secret(secret))
}

/// Marks with keys that cost nothing: there are thousands of them here.
fn cheap(original: &Document) -> Embedder<'_> {
    let embedder = Embedder::new(original, Preset::Robust.parameters(), false).unwrap();
    embedder.with_derivation(Derivation::stub_for_experiments())
}

impl Shop {
    fn new() -> Self {
        let original = document(Format::PlyBinaryLittleEndian, &shapes::bust(20));
        let keys: Vec<Key> = {
            let marker = cheap(&original);
            (0..BUYERS).map(buyer).map(|(identity, secret)| marker.key(identity, secret)).collect()
        };
        let (tracer, rejected) = Tracer::trusting(&original, keys.clone()).unwrap();
        assert!(rejected.is_empty() && tracer.len() == BUYERS);
        Self { original, tracer, keys }
    }

    /// The mean of these buyers' copies, as files store them.
    fn averaged(&self, leakers: &[usize]) -> Soup {
        let marker = cheap(&self.original);
        let copy = |&i: &usize| {
            let (identity, secret) = buyer(i);
            marker.mark(identity, secret, &Rewrite::default()).unwrap().points
        };
        let copies: Vec<Vec<Point3<f64>>> = leakers.iter().map(copy).collect();
        let mean = |j: usize| {
            Point3::from(
                copies.iter().map(|c| c[j].coords).sum::<nalgebra::Vector3<f64>>() / copies.len() as f64,
            )
        };
        Soup::new((0..copies[0].len()).map(mean).collect(), self.original.triangles().to_vec())
    }

    fn trace(&self, suspect: &Soup) -> Trace {
        let suspect = document(Format::PlyBinaryLittleEndian, suspect);
        self.tracer.trace(&suspect, &DetectOptions::default()).unwrap()
    }
}

fn named(trace: &Trace) -> Vec<usize> {
    let mut named: Vec<usize> = trace.recipients.iter().filter(|r| r.named).map(|r| r.index).collect();
    named.sort_unstable();
    named
}

#[test]
fn leakers_who_average_their_copies_are_all_named_and_nobody_else() {
    let shop = Shop::new();
    for count in [1, 2, 3, 5, 10] {
        let leakers: Vec<usize> = (0..count).map(|i| 83 * i + 11).collect();
        let trace = shop.trace(&shop.averaged(&leakers));
        assert!(trace.found && named(&trace) == leakers, "{count}: {:?}", named(&trace));
        assert!(trace.recipients.iter().all(|r| r.log10_p.is_finite()));
        assert!(trace.recipients.is_sorted_by(|a, b| a.log10_p <= b.log10_p));
    }
}

#[test]
fn two_leakers_are_named_after_noise_simplification_and_a_crop() {
    let shop = Shop::new();
    let attacks =
        parse_list("reorder transform noise:amplitude=0.001 simplify:ratio=0.6 crop:fraction=0.2").unwrap();
    let suspect = apply_all(&attacks, &shop.averaged(&[5, 600]), &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
    assert_eq!(named(&shop.trace(&suspect.soup)), [5, 600]);
}

/// One leaker's score is that of `detect`, but for the number of keys.
#[test]
fn a_trace_pays_for_every_key_and_an_unmarked_mesh_names_nobody() {
    let shop = Shop::new();
    let copy = document(Format::PlyBinaryLittleEndian, &shop.averaged(&[41]));
    let alone = Detector::trusting(&shop.original, shop.keys[41].clone()).unwrap();
    let detection = alone.detect(&alone.suspect(&copy), &DetectOptions::default()).unwrap();
    let trace = shop.tracer.trace(&copy, &DetectOptions::default()).unwrap();
    assert_eq!(trace.recipients[0].index, 41);
    let paid = (trace.variants_counted as f64 / detection.variants_counted as f64).log10();
    let best = detection.variants.iter().map(|v| v.log10_p).fold(0.0, f64::min);
    let (first, alone) = (&trace.recipients[0], best + (trace.variants_counted as f64).log10());
    // Beside the others is one test more, and may tell more.
    let as_alone = (first.log10_p - alone).abs() < 1e-9;
    assert!(if first.beside_others { first.log10_p < alone } else { as_alone }, "{first:?}, alone {alone}");
    assert!(paid >= 3.0, "{paid}");

    let nobody = shop.trace(shop.original.soup());
    assert!(!nobody.found && nobody.recipients.len() == BUYERS && nobody.recipients[0].log10_p > -3.0);
}

#[test]
fn keys_that_do_not_belong_are_given_back_with_the_reason() {
    let original = document(Format::Obj, &shapes::bumpy_sphere(800));
    let other = document(Format::Obj, &shapes::bumpy_sphere(2000));
    let key = |file: &Document, preset: Preset, i: usize| {
        let (identity, secret) = buyer(i);
        Embedder::new(file, preset.parameters(), true).unwrap().key(identity, secret)
    };
    let mut stronger = key(&original, Preset::Robust, 2);
    stronger.basis_sha256 = [0; 32];
    let keys = vec![
        key(&original, Preset::Robust, 3),
        key(&other, Preset::Robust, 4),
        stronger,
        key(&original, Preset::Paper, 5),
    ];
    let (tracer, rejected) = Tracer::new(&original, keys).unwrap();
    assert_eq!(tracer.len(), 2);
    let reasons: Vec<(usize, bool, bool)> = rejected
        .iter()
        .map(|r| {
            let is = |f: fn(&Mismatch) -> bool| f(&r.reason);
            (r.index, is(|m| matches!(m, Mismatch::Original { .. })), is(|m| matches!(m, Mismatch::Basis)))
        })
        .collect();
    assert_eq!(reasons, [(1, true, false), (2, false, true)]);

    // Both presets' keys are found by the same call.
    for (index, preset, i) in [(0, Preset::Robust, 3), (3, Preset::Paper, 5)] {
        let marker = Embedder::new(&original, preset.parameters(), true).unwrap();
        let (identity, secret) = buyer(i);
        let copy = marker.mark(identity, secret, &Rewrite::default()).unwrap();
        let suspect = Document::parse(copy.bytes, None).unwrap();
        let trace = tracer.trace(&suspect, &DetectOptions::default()).unwrap();
        assert_eq!(named(&trace), [index]);
    }
    let (none, rejected) = Tracer::new(&original, vec![]).unwrap();
    assert!(none.is_empty() && rejected.is_empty());
    assert!(!none.trace(&other, &DetectOptions::default()).unwrap().found);
}

/// A forged key with the watermark of somebody else fits as well as his, and ends the search; still only he is named.
#[test]
fn a_key_that_is_not_genuine_is_dropped_before_it_is_named() {
    let original = document(Format::Obj, &shapes::bumpy_sphere(800));
    let marker = Embedder::new(&original, Preset::Paper.parameters(), false).unwrap();
    let [one, two] = [1, 2].map(|i| {
        let (identity, secret) = buyer(i);
        marker.mark(identity, secret, &Rewrite::default()).unwrap()
    });
    let mut forged = one.key.clone();
    forged.identity.recipient = "an innocent".into();
    let unused = Key { watermark: two.key.watermark.iter().map(|w| w + 0.1).collect(), ..two.key.clone() };
    let keys = vec![forged, one.key.clone(), two.key, unused];
    let (tracer, rejected) = Tracer::new(&original, keys).unwrap();
    assert!(rejected.is_empty() && tracer.len() == 4);
    let suspect = Document::parse(one.bytes, None).unwrap();
    let trace = tracer.trace(&suspect, &DetectOptions::default()).unwrap();
    assert_eq!(named(&trace), [1]);
    assert_eq!(trace.recipients.iter().map(|r| r.index).collect::<Vec<_>>(), [1, 2]);
    let dropped: Vec<usize> = trace.rejected.iter().map(|r| r.index).collect();
    assert_eq!(dropped, [0, 3]);
    assert!(trace.rejected.iter().all(|r| matches!(r.reason, Mismatch::Watermark { .. })));

    // The tests of the forged keys stay counted.
    let (honest, _) = Tracer::new(&original, vec![one.key]).unwrap();
    let alone = honest.trace(&suspect, &DetectOptions::default()).unwrap();
    assert!(trace.variants_counted >= 6 * alone.variants_counted);

    // A key that cost nothing is not genuine either.
    let cheap = Embedder::new(&original, Preset::Paper.parameters(), false).unwrap();
    let cheap = cheap.with_derivation(Derivation::stub_for_experiments());
    let (identity, secret) = buyer(3);
    let copy = cheap.mark(identity, secret, &Rewrite::default()).unwrap();
    assert!(Detector::new(&original, copy.key.clone()).is_err());
    let (tracer, _) = Tracer::new(&original, vec![copy.key]).unwrap();
    let suspect = Document::parse(copy.bytes, None).unwrap();
    let trace = tracer.trace(&suspect, &DetectOptions::default()).unwrap();
    assert!(!trace.found && trace.rejected.len() == 1);
}
