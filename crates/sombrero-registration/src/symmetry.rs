//! Rotations that take the original to itself.
//!
//! If S brings the suspect onto the original and G takes the original to itself, then G S is as good as S, and
//! no fit can tell which of them is right. Symmetries of a surface keep its centroid where it is, so they are
//! found by a look at all rotations about it, each refined by ICP of the surface with itself.

use nalgebra::Similarity3;

use crate::candidate::comparable;
use crate::options::RegisterOptions;
use crate::search::Search;
use crate::starts::rotations;
use crate::surface::lookup::Lookup;
use crate::surface::sample::scattered;
use crate::surface::shape::Shape;
use sombrero_progress::Progress;

/// Samples by which rotations are tried.
const SAMPLES: usize = 256;
/// Share of them that a symmetry has to put back onto the surface, when refined roughly.
const LEAST: f64 = 0.7;
/// Symmetries that are looked for; a sphere has more.
const MOST: usize = 70;

/// Rotations of the cube and of the icosahedron. No shape has more, and none that is no body of revolution a number between.
pub(crate) const CUBE: usize = 24;
pub(crate) const ICOSAHEDRON: usize = 60;

/// The symmetries in the unit frame, without the identity.
pub(crate) fn symmetries(shape: &Shape, lookup: &Lookup) -> Vec<Similarity3<f64>> {
    let samples = scattered(shape, SAMPLES, 1.0);
    let mut starts = vec![Similarity3::identity()];
    starts.extend(rotations::poses(lookup, &samples, &shape.moments.centroid, LEAST, MOST));
    let options = RegisterOptions::default();
    // The search that needs the symmetries says how far it is.
    let search = Search::new(shape, shape, &options, Progress::silent());
    let found = comparable(search.sorted(search.settled(starts, ICOSAHEDRON)));
    let is_other = |pose: &Similarity3<f64>| search.is_other(pose, &Similarity3::identity());
    found.into_iter().map(|c| c.run.pose).filter(is_other).collect()
}

#[cfg(test)]
mod tests {
    use crate::reference::Reference;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    fn count(soup: &Soup) -> usize {
        Reference::new(&soup.points, &soup.triangles).unwrap().symmetries().len() + 1
    }

    #[test]
    fn the_rotation_groups_of_the_solids() {
        assert_eq!(count(&shapes::tetrahedron()), 12);
        assert_eq!(count(&shapes::cube()), 24);
        assert_eq!(count(&shapes::octahedron()), 24);
        assert_eq!(count(&shapes::icosahedron()), 60);
    }

    #[test]
    fn most_shapes_have_none() {
        for soup in [shapes::part(3), shapes::bust(12), shapes::bumpy_sphere(1500)] {
            assert_eq!(count(&soup), 1);
        }
    }

    #[test]
    fn a_torus_has_many() {
        assert!(count(&shapes::torus(24, 12, 2.0, 0.7)) > 20);
    }
}
