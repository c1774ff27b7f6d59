//! Walls and gaps: how near surfaces that face each other come.
//!
//! From each place of the surface a line goes along the normal, outwards for a gap and inwards for a wall, to the nearest face
//! that faces back: its normal n' is opposite to n, n · n' ≤ -cos 30°. Where two smooth surfaces are nearest they are
//! parallel, so that a narrow cone of normals misses no wall, and leaves out creases that no one calls walls. Shapira, Shamir
//! and Cohen-Or (2008) average over a cone of rays, for a robust diameter; here the least counts.
//!
//! Places are the centres of faces and the vertices. What touches already, within a millionth of the diagonal, is in contact,
//! not a gap: such places count neither before nor after.

use crate::Change;
use crate::evenly::evenly;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use sombrero_spatial::Line;

/// Facing surfaces are at most this apart, as a share of the diagonal.
pub const FARTHEST: f64 = 0.2;
/// And at least this before; nearer ones are in contact.
pub const CONTACT: f64 = 1e-6;
/// -cos 30°: normals with at most this product face each other.
const FACING: f64 = -0.866_025_403_784_438_6;
/// Where to look from at most: more places are thinned out evenly.
const MOST_PLACES: usize = 50_000;
/// Places that one task looks at, and the share of all that is tried first, for a good bound.
const CHUNK: usize = 256;
const FIRST: usize = 64;

/// The thinnest wall or gap, in model units.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub struct Thinnest {
    /// Before the change; `None` where no surfaces face each other within a fifth of the diagonal.
    pub before: Option<f64>,
    /// After it, likewise.
    pub after: Option<f64>,
}

/// The thinnest wall or gap between surfaces that face each other, before and after, measured from the same places. A closed
/// surface has walls as every solid has: small parts and necks count too. O(n log n) as a rule; of more than 50,000 faces
/// and vertices as many are looked from.
pub fn thinnest(change: &Change<'_>) -> Thinnest {
    let diagonal = change.bounds.diagonal();
    let [before, after] = [0, 1].map(|side| Facing::new(change, side));
    let places = before.all_places();
    let limits = [CONTACT * diagonal, FARTHEST * diagonal];
    let (before, in_contact) = before.thinnest(&places, limits);
    let places: Vec<u32> = places.into_iter().filter(|p| in_contact.binary_search(p).is_err()).collect();
    let (after, _) = after.thinnest(&places, [-1.0, FARTHEST * diagonal]);
    Thinnest { before, after }
}

/// The surface on one side, looked at along its normals.
struct Facing<'a> {
    change: &'a Change<'a>,
    side: usize,
    /// Normals of the vertices.
    normals: Vec<Vector3<f64>>,
}

impl<'a> Facing<'a> {
    fn new(change: &'a Change<'a>, side: usize) -> Self {
        Self { change, side, normals: change.vertex_normals(side) }
    }

    /// Faces, then vertices, thinned out when there are too many.
    fn all_places(&self) -> Vec<u32> {
        let count = self.change.triangles.len() + self.normals.len();
        evenly(count, MOST_PLACES).map(|place| place as u32).collect()
    }

    /// The least thickness at `places`, between `limits`, and the places in order where it is at most the first of them;
    /// `None` when it is not below the second.
    fn thinnest(&self, places: &[u32], limits: [f64; 2]) -> (Option<f64>, Vec<u32>) {
        let [contact, farthest] = limits;
        let first: Vec<u32> = places.iter().copied().step_by(FIRST).collect();
        let least = |places: &[u32], bound: f64| {
            let chunks = places.par_chunks(CHUNK).map(|chunk| self.least(chunk, contact, bound));
            chunks.collect::<Vec<(f64, Vec<u32>)>>()
        };
        let bound = least(&first, farthest).iter().fold(farthest, |bound, (b, _)| bound.min(*b));
        let chunks = least(places, bound);
        let bound = chunks.iter().fold(bound, |bound, (b, _)| bound.min(*b));
        let in_contact = chunks.into_iter().flat_map(|(_, places)| places).collect();
        (Some(bound).filter(|thickness| *thickness < farthest), in_contact)
    }

    /// The least thickness above `contact` at `places`, or `bound` when that is less, and the places where it is no more
    /// than `contact`. Lines end at the best one so far.
    fn least(&self, places: &[u32], contact: f64, mut bound: f64) -> (f64, Vec<u32>) {
        let mut in_contact = Vec::new();
        for &place in places {
            let (origin, normal) = self.at(place);
            let counts = |face: u32| self.faces_back(face, &normal) && !self.is_at(place, face);
            let line = Line { origin, direction: normal };
            match self.change.surfaces[self.side].nearest_on_line(&line, bound, counts) {
                Some(met) if met.distance.abs() <= contact => in_contact.push(place),
                Some(met) => bound = met.distance.abs(),
                None => {}
            }
        }
        (bound, in_contact)
    }

    /// A place, and the unit normal there.
    fn at(&self, place: u32) -> (Point3<f64>, Vector3<f64>) {
        match self.vertex(place) {
            Some(v) => (self.change.sides()[self.side][v as usize], self.normals[v as usize]),
            None => {
                let [a, b, c] = self.change.corners(self.side, place);
                let centre = Point3::from((a.coords + b.coords + c.coords) / 3.0);
                (centre, self.change.facets[self.side].normals[place as usize])
            }
        }
    }

    /// The vertex that a place is; `None` for a face.
    fn vertex(&self, place: u32) -> Option<u32> {
        place.checked_sub(self.change.triangles.len() as u32)
    }

    fn faces_back(&self, face: u32, normal: &Vector3<f64>) -> bool {
        self.change.facets[self.side].normals[face as usize].dot(normal) <= FACING
    }

    /// Whether a face has the vertex, or a corner of the face, that a place is.
    fn is_at(&self, place: u32, face: u32) -> bool {
        let triangles = &self.change.triangles;
        let corners = triangles[face as usize];
        match self.vertex(place) {
            Some(v) => corners.contains(&v),
            None => triangles[place as usize].iter().any(|v| corners.contains(v)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_shapes as shapes;

    /// Two plates of side 1, the upper one facing down or up at the given height.
    fn plates(height: f64, facing: bool) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let at = |z: f64| [[0., 0., z], [1., 0., z], [1., 1., z], [0., 1., z]].map(Point3::from);
        let upper = if facing { [[4, 6, 5], [4, 7, 6]] } else { [[4, 5, 6], [4, 6, 7]] };
        ([at(0.0), at(height)].concat(), [vec![[0, 1, 2], [0, 2, 3]], upper.to_vec()].concat())
    }

    fn of(before: &[Point3<f64>], after: &[Point3<f64>], triangles: &[[u32; 3]]) -> [Option<f64>; 2] {
        let Thinnest { before, after } = thinnest(&Change::new(before, after, triangles));
        [before, after]
    }

    #[test]
    fn two_plates() {
        let (near, far) = (plates(0.125, true), plates(0.25, true));
        assert_eq!(of(&near.0, &far.0, &near.1), [Some(0.125), Some(0.25)]);
        // The other way round they are a wall.
        let wall: Vec<_> = near.1.iter().map(|&[a, b, c]| [a, c, b]).collect();
        assert_eq!(of(&near.0, &far.0, &wall), [Some(0.125), Some(0.25)]);
        // Plates that look the same way do not face each other, and those far apart do not count.
        assert_eq!(of(&near.0, &far.0, &plates(0.125, false).1), [None, None]);
        assert_eq!(of(&plates(0.6, true).0, &near.0, &near.1), [None, Some(0.125)]);
    }

    #[test]
    fn what_touches_is_in_contact() {
        let (touching, apart) = (plates(0.0, true), plates(0.01, true));
        assert_eq!(of(&touching.0, &apart.0, &apart.1), [None, None]);
    }

    #[test]
    fn the_neck_of_a_torus() {
        // A tube of radius 0.1: the wall is as thick as the tube, seen from every face and vertex.
        let torus = shapes::torus(96, 48, 1.0, 0.1);
        let [before, after] = of(&torus.points, &torus.points, &torus.triangles);
        assert_eq!(before, after);
        assert!((before.unwrap() - 0.2).abs() < 0.002, "{before:?}");
    }

    #[test]
    fn the_whole_surface_is_searched() {
        // One pimple on one of many faces of a thick sheet.
        let sheet = shapes::open_sheet(40, 40);
        let flat = |z: f64| sheet.points.iter().map(move |p| Point3::new(p.x, p.y, z));
        let count = sheet.points.len() as u32;
        let before: Vec<_> = flat(0.0).chain(flat(0.1)).collect();
        let lower = sheet.triangles.iter().copied();
        let triangles: Vec<_> =
            lower.clone().chain(lower.map(|[a, b, c]| [a, c, b].map(|v| v + count))).collect();
        let mut after = before.clone();
        after[817].z = 0.07;
        let [was, is] = of(&before, &after, &triangles);
        assert!((was.unwrap() - 0.1).abs() < 1e-15 && (is.unwrap() - 0.03).abs() < 1e-12, "{was:?} {is:?}");
    }
}
