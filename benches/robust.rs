//! The robust method's stages: matching, the two fits, the ellipsoid test, and whole detections.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::extraction::{Deformation, Extractor, Modes, Nuisance};
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::{Soup, match_connectivity};
use sombrero::stats::Ellipsoid;
use sombrero::watermark::Secret;
use sombrero::{DetectOptions, Detector, EmbedOptions, PreparedBasis, embed};
use sombrero_benches::subjects;
use std::hint::black_box;

fn attacked(soup: &Soup, specs: &str) -> Soup {
    let attacks = parse_list(specs).expect("specs of attacks");
    apply_all(&attacks, soup, &mut ChaCha8Rng::seed_from_u64(1)).expect("attacks on a clean surface").soup
}

/// A surface with its mark: what detection has, and the marked copy.
fn marked(soup: &Soup) -> (Detector, Soup) {
    let file = encode(Format::PlyBinaryLittleEndian, soup).expect("a clean surface can be stored");
    let original = Document::parse(file, Some("ply")).expect("what was just written");
    let marked = embed(&original, Secret([1; 32]), &EmbedOptions::default()).expect("a mark fits");
    let copy = Document::parse(marked.bytes, Some("ply")).expect("what was just written").soup().clone();
    (Detector::new(&original, marked.key).expect("its own key"), copy)
}

const NUISANCES: [(&str, Deformation); 3] = [
    ("similarity", Deformation::Similarity),
    ("affine", Deformation::Affine),
    ("free form", Deformation::Lattice),
];

fn stages(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("robust stages");
    group.sample_size(10);
    for subject in subjects().into_iter().filter(|s| (5_000..50_000).contains(&s.soup.points.len())) {
        let (detector, copy) = marked(&subject.soup);
        let original = detector.model().soup();
        group.throughput(Throughput::Elements(original.points.len() as u64));
        let renumbered = attacked(&copy, "reorder");
        group.bench_function(BenchmarkId::new("matching", &subject.name), |b| {
            let n = original.points.len();
            b.iter(|| black_box(match_connectivity(&original.triangles, n, &renumbered.triangles, n)));
        });
        let extractor = Extractor::new(detector.basis(), detector.key().parameters.epsilon, original)
            .expect("a basis of this surface");
        let found: Vec<_> = copy.points.iter().copied().map(Some).collect();
        let simplified = attacked(&copy, "simplify:ratio=0.5");
        for (name, deformation) in NUISANCES {
            let nuisance = Nuisance { deformation, modes: &[Modes::Smoothing] };
            group.bench_function(BenchmarkId::new(format!("vertices, {name}"), &subject.name), |b| {
                b.iter(|| black_box(extractor.estimate_from_vertices(&found, nuisance).ok()));
            });
            group.bench_function(BenchmarkId::new(format!("surface, {name}"), &subject.name), |b| {
                b.iter(|| black_box(extractor.estimate_from_surface(&simplified, nuisance).ok()));
            });
        }
        let nuisance = Nuisance { deformation: Deformation::Similarity, modes: &[] };
        let estimate = extractor.estimate_from_surface(&simplified, nuisance).expect("its own copy");
        group.bench_function(BenchmarkId::new("ellipsoid", &subject.name), |b| {
            b.iter(|| black_box(Ellipsoid::new(&estimate.coefficients, &estimate.precision).ok()));
        });
        let ellipsoid = Ellipsoid::new(&estimate.coefficients, &estimate.precision).expect("finite numbers");
        group.bench_function(BenchmarkId::new("ellipsoid test", &subject.name), |b| {
            b.iter(|| black_box(ellipsoid.test(&detector.key().watermark).ok()));
        });
    }
    group.finish();
}

/// The original made ready, with its basis computed and with it read from a prepared file.
fn preparation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("preparation");
    group.sample_size(10);
    for subject in subjects().into_iter().filter(|s| (5_000..50_000).contains(&s.soup.points.len())) {
        let file =
            encode(Format::PlyBinaryLittleEndian, &subject.soup).expect("a clean surface can be stored");
        let original = Document::parse(file, Some("ply")).expect("what was just written");
        let (detector, _) = marked(&subject.soup);
        let (key, stored) = (detector.key(), detector.prepared_basis());
        group.throughput(Throughput::Elements(subject.soup.points.len() as u64));
        group.bench_function(BenchmarkId::new("computed", &subject.name), |b| {
            b.iter(|| black_box(Detector::new(&original, key.clone()).ok()));
        });
        group.bench_function(BenchmarkId::new("from a file", &subject.name), |b| {
            b.iter(|| {
                let stored = PreparedBasis::parse(&stored, key).ok()?;
                black_box(Detector::with_prepared_basis(&original, key.clone(), stored).ok())
            });
        });
    }
    group.finish();
}

/// Registration included; the original is prepared.
fn detections(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("robust detection");
    group.sample_size(10);
    for subject in subjects().into_iter().filter(|s| (5_000..50_000).contains(&s.soup.points.len())) {
        let (detector, copy) = marked(&subject.soup);
        group.throughput(Throughput::Elements(copy.points.len() as u64));
        for (name, specs) in [
            ("renumbered and moved", "reorder transform"),
            ("simplified and moved", "simplify:ratio=0.5 transform"),
            ("cropped, simplified and moved", "crop:fraction=0.333 simplify:ratio=0.5 transform"),
        ] {
            let file =
                encode(Format::PlyBinaryLittleEndian, &attacked(&copy, specs)).expect("a clean surface");
            let suspect =
                detector.suspect(&Document::parse(file, Some("ply")).expect("what was just written"));
            group.bench_function(BenchmarkId::new(name, &subject.name), |b| {
                b.iter(|| black_box(detector.detect(&suspect, &DetectOptions::default()).ok()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, preparation, stages, detections);
criterion_main!(benches);
