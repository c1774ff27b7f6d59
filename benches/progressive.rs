//! Conversion to a progressive mesh, and travel between its levels.

use criterion::{Criterion, criterion_group, criterion_main};
use sombrero::mesh::{Soup, repair};
use sombrero::progressive::ProgressiveMesh;
use sombrero_benches::over_sizes;
use std::hint::black_box;

fn conversion(criterion: &mut Criterion) {
    over_sizes(criterion, "progressive mesh", repair, |made| {
        black_box(ProgressiveMesh::new(made.mesh.clone(), &made.points).expect("repaired points are finite"));
    });
}

fn travel(criterion: &mut Criterion) {
    let convert = |soup: &Soup| {
        let made = repair(soup);
        ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite")
    };
    over_sizes(criterion, "copy, refine all and coarsen all", convert, |progressive| {
        let mut progressive = progressive.clone();
        progressive.go_to(usize::MAX);
        progressive.go_to(0);
        black_box(progressive);
    });
}

criterion_group!(benches, conversion, travel);
criterion_main!(benches);
