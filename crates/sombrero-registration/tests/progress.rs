//! A registration says how far it is, and is the same when nobody listens.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use sombrero_progress::heard;
use sombrero_registration::{
    IcpOptions, Reference, RegisterOptions, align, refine_affine, register, register_affine,
};
use sombrero_shapes as shapes;

#[test]
fn a_search_says_how_far_it_is() {
    let (soup, other) = (shapes::part(3), shapes::torus(24, 12, 2.0, 0.7));
    let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
    let options = RegisterOptions::default();
    for suspect in [&soup, &other] {
        let similar = || register(&reference, &suspect.points, &suspect.triangles, &options).unwrap();
        let (result, heard_of) = heard(similar);
        assert!((4..200).contains(&heard_of.len()), "{}", heard_of.len());
        assert_eq!(result, similar(), "and finds the same when nobody listens");
    }
    let stretched = || register_affine(&reference, &soup.points, &soup.triangles, &options).unwrap();
    assert_eq!(heard(stretched).0, stretched());
}

#[test]
fn a_refinement_says_how_far_it_is() {
    let soup = shapes::part(3);
    let reference = Reference::new(&soup.points, &soup.triangles).unwrap();
    let (start, options) = (nalgebra::Similarity3::identity(), IcpOptions::default());
    let aligned = || align(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
    let refined = || refine_affine(&reference, &soup.points, &soup.triangles, &start, &options).unwrap();
    assert_eq!(heard(aligned), (aligned(), vec![[1, 2], [2, 2]]));
    assert_eq!(heard(refined), (refined(), vec![[1, 2], [2, 2]]));
}
