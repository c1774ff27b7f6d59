//! What a change of positions does to a mesh: each dear measure, and all together.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use sombrero::fidelity::{Change, Fidelity, mrms, msdm2, new_intersections, thinnest};
use sombrero::mesh::Soup;
use sombrero_benches::over_sizes;
use std::hint::black_box;

/// A mesh and its points moved by a ten-thousandth, this way and that.
fn moved(soup: &Soup) -> (Soup, Vec<Point3<f64>>) {
    let wobble = |k: usize, step: f64| (k as f64 * step).fract() - 0.5;
    let shift = |k| Vector3::new(wobble(k, 0.754_87), wobble(k, 0.569_84), wobble(k, 0.430_16)) * 2e-4;
    (soup.clone(), soup.points.iter().enumerate().map(|(k, p)| p + shift(k)).collect())
}

/// One measure alone.
type Measure = fn(&Change<'_>) -> f64;

fn measures(criterion: &mut Criterion) {
    over_sizes(criterion, "fidelity", moved, |(soup, after)| {
        black_box(Fidelity::between(&soup.points, after, &soup.triangles, None));
    });
    let single: [(&str, Measure); 4] = [
        ("fidelity: mrms", mrms),
        ("fidelity: msdm2", msdm2),
        ("fidelity: new intersections", |change| new_intersections(change) as f64),
        ("fidelity: walls and gaps", |change| thinnest(change).after.unwrap_or(0.0)),
    ];
    for (name, measure) in single {
        over_sizes(criterion, name, moved, |(soup, after)| {
            black_box(measure(&Change::new(&soup.points, after, &soup.triangles)));
        });
    }
}

criterion_group!(benches, measures);
criterion_main!(benches);
