//! An extraction says how far it is, and is the same when nobody listens.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use sombrero_basis::{Basis, BasisOptions};
use sombrero_extraction::{Deformation, Extractor, Modes, Nuisance};
use sombrero_mesh::{Soup, repair};
use sombrero_progress::heard;
use sombrero_progressive::ProgressiveMesh;
use sombrero_shapes as shapes;

#[test]
fn an_extraction_says_how_far_it_is() {
    let made = repair(&shapes::bust(16));
    let soup = Soup::new(made.points.clone(), made.mesh.triangles());
    let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
    let basis = Basis::new(progressive, &made.points, &BasisOptions::default()).unwrap();
    let extractor = Extractor::new(&basis, 0.01, &soup).unwrap();
    let nuisance = Nuisance { deformation: Deformation::Affine, modes: &[Modes::Smoothing] };
    let found: Vec<_> = soup.points.iter().copied().map(Some).collect();
    let vertices = || extractor.estimate_from_vertices(&found, nuisance).unwrap().coefficients;
    let surface = || extractor.estimate_from_surface(&soup, nuisance).unwrap().coefficients;
    let (result, said) = heard(vertices);
    assert_eq!((result, said.len()), (vertices(), 4), "and finds the same when nobody listens");
    let (result, said) = heard(surface);
    assert_eq!(result, surface());
    assert!((4..40).contains(&said.len()), "{said:?}");
}
