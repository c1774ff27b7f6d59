//! Building a manifold mesh of triangles.

use criterion::{Criterion, criterion_group, criterion_main};
use sombrero::mesh::{Mesh, Soup, Weld, repair};
use sombrero_benches::over_sizes;
use std::hint::black_box;

fn build(criterion: &mut Criterion) {
    let clean = |soup: &Soup| {
        let made = repair(soup);
        (made.points.len(), made.mesh.triangles())
    };
    over_sizes(criterion, "halfedges from clean triangles", clean, |(vertices, triangles)| {
        black_box(Mesh::from_triangles(*vertices, triangles).ok());
    });
    over_sizes(criterion, "repair", Clone::clone, |soup| {
        black_box(repair(soup));
    });
    over_sizes(criterion, "weld", Clone::clone, |soup| {
        black_box(Weld::new(&soup.points));
    });
}

criterion_group!(benches, build);
criterion_main!(benches);
