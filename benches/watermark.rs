//! Insertion and extraction with a basis that is there.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::Point3;
use sombrero::Model;
use sombrero::basis::{Basis, BasisOptions};
use sombrero::extraction::extract;
use sombrero::mesh::Soup;
use sombrero::watermark::{embed, gaussians};
use sombrero_benches::over_sizes;
use std::hint::black_box;

struct Case {
    points: Vec<Point3<f64>>,
    basis: Basis,
    w: Vec<f64>,
    marked: Vec<Option<Point3<f64>>>,
}

fn case(soup: &Soup) -> Case {
    let basis = Model::new(soup).basis(&BasisOptions::default()).expect("large enough for 50 coefficients");
    let w = gaussians([0; 32], 50);
    let marked = embed(&soup.points, &basis, &w, 0.01).into_iter().map(Some).collect();
    Case { points: soup.points.clone(), basis, w, marked }
}

fn insertion_and_extraction(criterion: &mut Criterion) {
    over_sizes(criterion, "insertion", case, |case| {
        black_box(embed(&case.points, &case.basis, &case.w, 0.01));
    });
    over_sizes(criterion, "extraction", case, |case| {
        black_box(extract(&case.basis, 0.01, &case.points, &case.marked).ok());
    });
}

criterion_group!(benches, insertion_and_extraction);
criterion_main!(benches);
