//! What the benches share: named surfaces of known sizes.
//!
//! `cargo bench -p sombrero-benches --bench progressive` runs one file. With `SOMBRERO_MODELS` set to the
//! folder of the paper's models the bunny is measured too. These machines are noisy: compare ratios within
//! one run.

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput};
use sombrero::Model;
use sombrero::io::Document;
use sombrero::mesh::Soup;
use sombrero::shapes;
use std::path::Path;
use std::time::Duration;

/// A named surface.
pub struct Subject {
    /// Its name in the report.
    pub name: String,
    /// Its points and triangles.
    pub soup: Soup,
}

/// Generated surfaces of about 1k, 10k, 100k and 500k vertices, and the bunny where it is to be had.
pub fn subjects() -> Vec<Subject> {
    let generated = [1_000, 10_000, 100_000, 500_000]
        .map(|n| Subject { name: format!("bumpy sphere {}k", n / 1000), soup: shapes::bumpy_sphere(n) });
    let bunny = std::env::var_os("SOMBRERO_MODELS").and_then(|folder| {
        let document = Document::read(&Path::new(&folder).join("bunny.ply")).ok()?;
        Some(Subject { name: "bunny".to_owned(), soup: Model::new(document.soup()).soup().clone() })
    });
    generated.into_iter().chain(bunny).collect()
}

/// Runs `work` on what `setup` makes of each subject, counting vertices.
pub fn over_sizes<T>(
    criterion: &mut Criterion,
    group: &str,
    setup: impl Fn(&Soup) -> T,
    mut work: impl FnMut(&T),
) {
    let mut group: BenchmarkGroup<'_, WallTime> = criterion.benchmark_group(group);
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for subject in subjects() {
        let input = setup(&subject.soup);
        group.throughput(Throughput::Elements(subject.soup.points.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(&subject.name), |b| b.iter(|| work(&input)));
    }
    group.finish();
}
