//! Registration without a hint, resampling, and closest points.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Similarity3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::attacks::{Attack, apply_all};
use sombrero::mesh::Soup;
use sombrero::registration::{IcpOptions, Reference, RegisterOptions, align, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::spatial::Surface;
use sombrero_benches::{over_sizes, subjects};
use std::hint::black_box;

fn attacked(soup: &Soup, specs: &[&str]) -> Soup {
    let attacks: Vec<Attack> = specs.iter().filter_map(|spec| spec.parse().ok()).collect();
    let attacked = apply_all(&attacks, soup, &mut ChaCha8Rng::seed_from_u64(1));
    attacked.expect("attacks on a clean surface").soup
}

fn alignment(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("suspects");
    group.sample_size(10);
    for subject in subjects().into_iter().filter(|s| s.soup.points.len() < 50_000) {
        let soup = &subject.soup;
        group.throughput(Throughput::Elements(soup.points.len() as u64));
        let moved = attacked(soup, &["noise:amplitude=0.002", "transform"]);
        group.bench_function(BenchmarkId::new("registration", &subject.name), |b| {
            b.iter(|| {
                let reference = Reference::new(&soup.points, &soup.triangles).ok()?;
                black_box(
                    register(&reference, &moved.points, &moved.triangles, &RegisterOptions::default()).ok(),
                )
            });
        });
        let simplified = attacked(soup, &["simplify:ratio=0.5"]);
        let side = soup.bounding_box().map_or(1.0, |b| b.largest_side());
        // 5 degrees, 5 % of scale and 3 % of the size away.
        let near = Similarity3::new(Vector3::x() * (0.03 * side), Vector3::z() * 0.087, 1.05);
        group.bench_function(BenchmarkId::new("registration from a rough pose", &subject.name), |b| {
            b.iter(|| {
                let reference = Reference::new(&soup.points, &soup.triangles).ok()?;
                let Soup { points, triangles } = &simplified;
                black_box(align(&reference, points, triangles, &near, &IcpOptions::default()).ok())
            });
        });
        group.bench_function(BenchmarkId::new("resampling", &subject.name), |b| {
            let options = ResampleOptions::default();
            b.iter(|| {
                black_box(resample(soup, &simplified, &options, &mut ChaCha8Rng::seed_from_u64(1)).ok())
            });
        });
    }
    group.finish();
}

fn closest_points(criterion: &mut Criterion) {
    let prepare = |soup: &Soup| {
        let queries = attacked(soup, &["noise:amplitude=0.01"]).points;
        (Surface::new(&soup.points, &soup.triangles), queries)
    };
    over_sizes(criterion, "surface", Clone::clone, |soup| {
        black_box(Surface::new(&soup.points, &soup.triangles));
    });
    over_sizes(criterion, "closest point of each vertex", prepare, |(surface, queries)| {
        black_box(surface.closest_many(queries));
    });
}

criterion_group!(benches, alignment, closest_points);
criterion_main!(benches);
