//! A basis says how far it is, and is the same when nobody listens.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use sombrero_basis::{Basis, BasisOptions};
use sombrero_mesh::repair;
use sombrero_progress::heard;
use sombrero_progressive::ProgressiveMesh;
use sombrero_shapes as shapes;

#[test]
fn a_basis_says_how_far_it_is() {
    let made = repair(&shapes::bumpy_sphere(3000));
    let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
    for coefficients in [7, 50, 200] {
        let options = BasisOptions { coefficients, ..BasisOptions::default() };
        let basis = || Basis::new(progressive.clone(), &made.points, &options).unwrap();
        let (result, heard) = heard(basis);
        assert!((50..=101).contains(&heard.len()), "{}", heard.len());
        assert_eq!(result, basis(), "and is the same when nobody listens");
    }
}
