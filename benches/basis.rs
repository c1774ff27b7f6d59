//! All 50 basis functions of a progressive mesh: magnitudes, supports, radii, matrix.

use criterion::{Criterion, criterion_group, criterion_main};
use sombrero::basis::{Basis, BasisOptions};
use sombrero::mesh::{Soup, repair};
use sombrero::progressive::ProgressiveMesh;
use sombrero_benches::over_sizes;
use std::hint::black_box;

fn basis(criterion: &mut Criterion) {
    let convert = |soup: &Soup| {
        let made = repair(soup);
        (ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite"), made.points)
    };
    over_sizes(criterion, "50 basis functions", convert, |(progressive, points)| {
        black_box(Basis::new(progressive.clone(), points, &BasisOptions::default()).ok());
    });
}

criterion_group!(benches, basis);
criterion_main!(benches);
