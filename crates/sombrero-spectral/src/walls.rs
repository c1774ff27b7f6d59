//! What a displacement changes of walls, gaps and thin faces: the part of G that looks across.
//!
//! Where two places face each other at a distance D along u and come apart by r(d), linear in the displacements,
//!
//! ```text
//! d'G d += Σ A (ϑ / τ D)² (u · r(d))²,
//! ```
//!
//! with A the area of the vertex that looks: a thickness that changes by the share τ counts as much as normals that turn by
//! ϑ, as far as they are to turn at all. Fields then move both sides of what is thin alike, instead of hardly at all. A thin
//! face's corner faces its longest edge.

use crate::surface::{Rings, Surface};
use crate::visibility::Term;
use nalgebra::Vector3;
use rayon::prelude::*;
use sombrero_coupling::{Assembly, Facing, across, facing};
use sombrero_mesh::BoundingBox;

/// τ: the share that a thickness may change by, root mean square. With it hardly any number of a mark changes one by more than
/// a tenth.
const CHANGE: f64 = 0.02;
/// Where fields are sought, a thin face may change by twice as much as a wall: it is to keep its side, and is too small to
/// be seen turn a little.
const SOUGHT: f64 = 2.0;
/// Where they are carried, it keeps four times as much as a wall: near corners that come apart are what limits a field most,
/// and nothing of a field is lost by keeping them together.
const CARRIED: f64 = 0.25;
/// How many times further than the whole surface a place may move. What nothing that moves so far could change is not looked
/// at.
const LARGEST: f64 = 4.5;
/// Places that are nearer than this share of the largest side are in contact.
const CONTACT: f64 = 1e-6;

/// What is to be kept, and how much.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Keeping {
    /// ϑ, in radians.
    turn: f64,
    /// Places that are further apart than this in model units are not looked at.
    farthest: f64,
    /// Those nearer than this are in contact.
    contact: f64,
}

impl Keeping {
    /// Where normals of the surface are to turn by `turn` radians and points to move by `reach` diagonals of the bounding box,
    /// root mean square.
    pub(crate) fn new(surface: &Surface, turn: f64, reach: f64) -> Self {
        let diagonal = BoundingBox::of(&surface.points).map_or(0.0, |b| b.diagonal());
        Self { turn, farthest: LARGEST * reach * diagonal / CHANGE, contact: CONTACT * surface.side }
    }

    /// What coming apart counts for, seen from a vertex with this area; `None` for what is in contact, or too far.
    fn term(&self, pair: &Facing, distance: f64, area: f64) -> Option<Term> {
        /// Of the places that look, faces' centres have more: what their corners see is enough.
        const MOST: usize = 4;
        let counts = distance > self.contact && distance < self.farthest && pair.terms.len() <= MOST;
        let weight = area.sqrt() * self.turn / (CHANGE * distance);
        counts.then(|| {
            let (mut vertices, mut gradients) = ([0; 4], [Vector3::zeros(); 4]);
            for (k, (v, map)) in pair.terms.iter().enumerate() {
                (vertices[k], gradients[k]) = (*v, map.transpose() * pair.direction * weight);
            }
            Term { vertices, gradients, count: pair.terms.len() }
        })
    }

    /// The walls and gaps of a surface.
    fn walls(&self, surface: &Surface, areas: &[f64]) -> Vec<Term> {
        let Surface { points, triangles, .. } = surface;
        let reach = vec![self.contact; points.len()];
        let assembly = Assembly { points, triangles, reach: &reach, places: &[], draws_loose: false };
        let farthest = vec![self.farthest; points.len()];
        let pairs = facing(&assembly, &farthest, |_| true);
        pairs.iter().filter_map(|p| self.term(p, p.distance, areas[p.terms[0].0 as usize])).collect()
    }

    /// A face between its corner and its longest edge, along its height and along its normal, whose height may change by
    /// `looser` times as much as a wall; none where it is not thin.
    fn thin(&self, surface: &Surface, face: usize, areas: &[f64], looser: f64) -> impl Iterator<Item = Term> {
        let pairs = across(&surface.points, &surface.triangles[face]).into_iter().flatten();
        pairs.filter_map(move |p| self.term(&p, looser * p.distance, areas[p.terms[0].0 as usize]))
    }

    /// The same of a face with carried corners.
    pub(crate) fn carried(
        &self,
        surface: &Surface,
        face: usize,
        areas: &[f64],
    ) -> impl Iterator<Item = Term> {
        self.thin(surface, face, areas, CARRIED)
    }

    /// All that counts where fields are sought.
    pub(crate) fn terms(&self, surface: &Surface, areas: &[f64]) -> Vec<Term> {
        let faces = (0..surface.triangles.len()).into_par_iter();
        let mut terms: Vec<Term> = faces.flat_map_iter(|f| self.thin(surface, f, areas, SOUGHT)).collect();
        terms.extend(self.walls(surface, areas));
        terms
    }
}

/// The surface's rings, with those whose terms join them as neighbours.
pub(crate) fn joined(surface: &Surface, terms: &[Term]) -> Rings {
    let across = terms.iter().flat_map(|term| {
        let [v, a, b, c] = term.vertices;
        [[v, a, b], if term.count > 3 { [v, b, c] } else { [v, a, b] }]
    });
    let triangles: Vec<[u32; 3]> = surface.triangles.iter().copied().chain(across).collect();
    Rings::new(surface.points.len(), &triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::value;
    use nalgebra::Point3;

    /// Two parallel squares of side 2, a hundredth of it apart.
    fn plate() -> Surface {
        const SIDE: u32 = 9;
        let place = |k: u32| 2.0 * f64::from(k) / f64::from(SIDE - 1) - 1.0;
        let point = |k: u32| {
            Point3::new(place(k / SIDE % SIDE), place(k % SIDE), if k < SIDE * SIDE { -0.01 } else { 0.01 })
        };
        let corner = |k: u32| (k / SIDE % SIDE < SIDE - 1 && k % SIDE < SIDE - 1).then_some(k);
        let faces = (0..2 * SIDE * SIDE).filter_map(corner).flat_map(|k| {
            let [a, b, c, d] = [k, k + SIDE, k + SIDE + 1, k + 1];
            if k < SIDE * SIDE { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
        });
        Surface::new((0..2 * SIDE * SIDE).map(point).collect(), faces.collect())
    }

    #[test]
    fn a_thickness_that_changes_by_its_share_counts_as_normals_that_turn() {
        let plate = plate();
        let keeping = Keeping::new(&plate, 0.0038, 0.00038);
        let terms = keeping.walls(&plate, &plate.vertex_areas());
        let thicker: Vec<Vector3<f64>> =
            plate.points.iter().map(|p| Vector3::new(0.0, 0.0, CHANGE * p.z)).collect();
        let seen: f64 = terms.iter().map(|t| value(t, &thicker).powi(2)).sum();
        let flat: f64 = plate.area * keeping.turn * keeping.turn;
        assert!((seen / flat - 1.0).abs() < 0.15, "{seen} {flat}");
        let together: Vec<Vector3<f64>> =
            plate.points.iter().map(|p| Vector3::new(0.0, 0.0, (9.0 * p.x).sin())).collect();
        let seen: f64 = terms.iter().map(|t| value(t, &together).powi(2)).sum();
        assert!(seen < 1e-12 * flat / (CHANGE * CHANGE), "{seen}");
    }

    #[test]
    fn what_faces_each_other_is_neighbours() {
        let plate = plate();
        let keeping = Keeping::new(&plate, 0.0038, 0.00038);
        let rings = joined(&plate, &keeping.walls(&plate, &plate.vertex_areas()));
        let top = (0..).zip(&plate.points).filter(|(_, p)| p.z > 0.0 && p.x.abs() < 0.5 && p.y.abs() < 0.5);
        for (v, p) in top {
            let below = rings.of(v).iter().any(|w| plate.points[*w as usize].z * p.z < 0.0);
            assert!(below, "{p}");
        }
    }

    #[test]
    fn a_thin_face_bends_where_its_corner_leaves_its_edge() {
        let points = [[0.0, 0.0], [4.0, 0.0], [1.0, 0.001]].map(|[x, y]| Point3::new(x, y, 0.0));
        let face = Surface::new(points.to_vec(), vec![[0, 1, 2]]);
        let terms: Vec<Term> =
            Keeping::new(&face, 0.0038, 0.00038).carried(&face, 0, &face.vertex_areas()).collect();
        assert_eq!(terms.len(), 2);
        let sum = |d: [Vector3<f64>; 3]| terms.iter().map(|t| value(t, &d).powi(2)).sum::<f64>();
        // The corner lies a quarter of the way along the edge.
        let (up, along) = (Vector3::z(), Vector3::y());
        assert!(sum([up * 4.0, up * 8.0, up * 5.0]) < 1e-12 * sum([up * 4.0, up * 8.0, up * 6.0]));
        assert!((sum([up * 0.0, up * 0.0, up]) / sum([along * 0.0, along * 0.0, along]) - 1.0).abs() < 1e-9);
    }
}
