//! All figures of one change.

use crate::{Change, Places};
use crate::{cracks, flat_dihedral, flatness, mrms, msdm2, new_intersections, normals, thinnest};
use nalgebra::Point3;

/// What a change of positions does to a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Fidelity {
    /// Root mean square distance between the surfaces, the larger of both ways, as a share of the diagonal ([`mrms()`]).
    pub mrms: f64,
    /// The angle by which face normals turned, root mean square by area, in degrees ([`normals()`]).
    pub normals_rms: f64,
    /// The angle that 99 % of the area do not exceed, in degrees.
    pub normals_p99: f64,
    /// Perceptual difference, from 0 to 1 ([`msdm2()`]).
    pub msdm2: f64,
    /// Change of the dihedral angle of flat edges, root mean square by length, in degrees; `None` without flat edges
    /// ([`flat_dihedral`]).
    pub flat_dihedral: Option<f64>,
    /// What planar regions are bent by, the worst, as a share of the largest side; `None` without planar regions
    /// ([`flatness()`]).
    pub flatness: Option<f64>,
    /// Pairs of faces that cross and did not ([`new_intersections`]).
    pub new_intersections: usize,
    /// The thinnest wall or gap before, in model units; `None` without facing surfaces ([`thinnest`]).
    pub thinnest_before: Option<f64>,
    /// The thinnest wall or gap after.
    pub thinnest_after: Option<f64>,
    /// The widest crack between points that meet, before, in model units ([`cracks()`]).
    pub widest_crack_before: f64,
    /// The widest crack between the same points after.
    pub widest_crack_after: f64,
    /// The diagonal of the bounding box, which tells what is much.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) diagonal: f64,
}

impl Fidelity {
    /// Measures what became of `triangles` whose vertices stood at `before` and stand at `after`. `places` are the points in
    /// the world that may come apart; without them the vertices are.
    ///
    /// Any input is measured: triangles without usable corners are left out ([`Change`]). In parallel, with the same bits for any
    /// number of threads, in O(n log n): half a million vertices take a few seconds.
    pub fn between(
        before: &[Point3<f64>],
        after: &[Point3<f64>],
        triangles: &[[u32; 3]],
        places: Option<Places<'_>>,
    ) -> Self {
        let change = Change::new(before, after, triangles);
        let places = places.unwrap_or_else(|| Places::new(before, after));
        // What runs in one thread stands beside what runs in many.
        let alone = || (flat_dihedral(&change), flatness(&change), normals(&change), cracks(&places));
        let beside = || (mrms(&change), thinnest(&change), new_intersections(&change));
        let ((flat_dihedral, flatness, normals, cracks), (msdm2, (mrms, thinnest, new_intersections))) =
            rayon::join(alone, || (msdm2(&change), beside()));
        Self {
            mrms,
            normals_rms: normals.rms,
            normals_p99: normals.p99,
            msdm2,
            flat_dihedral,
            flatness,
            new_intersections,
            thinnest_before: thinnest.before,
            thinnest_after: thinnest.after,
            widest_crack_before: cracks.before,
            widest_crack_after: cracks.after,
            diagonal: change.bounds.diagonal(),
        }
    }
}
