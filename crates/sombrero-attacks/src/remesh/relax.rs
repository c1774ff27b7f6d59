//! Tangential relaxation. With the mean m of the neighbours of v and the normal n at v, a free vertex goes to
//!
//!   m + n (n · (v - m))
//!
//! and from there to the closest point of the original surface; a vertex on a crease goes to the mean of its two
//! neighbours there, and from there to the closest point of the original creases. One after the other, and only
//! where no face turns too far, no vertex goes further than the wanted length, and none is held.

use super::creases::{Creases, Hold};
use super::{facing, turns};
use nalgebra::{Point3, Vector3, center};
use sombrero_mesh::{Edges, Soup, Umbrella};
use sombrero_spatial::Surface;

/// What is remeshed.
pub(super) struct Original {
    surface: Surface,
    creases: Surface,
}

impl Original {
    pub(super) fn new(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let edges = Edges::new(points.len(), triangles);
        let sharp = Creases::of(points, triangles, &edges).sharp;
        // A face with a corner twice is as good as the segment between the others.
        let segments: Vec<[u32; 3]> =
            edges.ends.iter().zip(sharp).filter(|(_, sharp)| *sharp).map(|(&[a, b], _)| [a, b, b]).collect();
        Self { surface: Surface::new(points, triangles), creases: Surface::new(points, &segments) }
    }
}

/// Moves vertices once, none further than `reach`.
pub(super) fn relax(soup: &mut Soup, original: &Original, reach: f64) {
    let wanted = places(soup, original);
    let fans = Fans::new(soup);
    for (v, wanted) in wanted.into_iter().enumerate() {
        if let Some(place) = wanted.filter(|p| (p - soup.points[v]).norm() <= reach) {
            try_move(soup, fans.of(v), v, place);
        }
    }
}

/// Where vertices would go; `None` for corners.
fn places(soup: &Soup, original: &Original) -> Vec<Option<Point3<f64>>> {
    let edges = Edges::new(soup.points.len(), &soup.triangles);
    let holds = Creases::of(&soup.points, &soup.triangles, &edges).holds;
    let mut normals = vec![Vector3::zeros(); soup.points.len()];
    for corners in &soup.triangles {
        let facing = facing(&soup.points, *corners);
        corners.iter().for_each(|&v| normals[v as usize] += facing);
    }
    let means = Umbrella::new(soup).step(&soup.points, 1.0);
    let along = |v: usize| match holds[v] {
        Hold::Crease([a, b]) => center(&soup.points[a as usize], &soup.points[b as usize]),
        _ => {
            let n = normals[v].try_normalize(0.0).unwrap_or_default();
            means[v] + n * n.dot(&(soup.points[v] - means[v]))
        }
    };
    let relaxed: Vec<Point3<f64>> = (0..soup.points.len()).map(along).collect();
    let on_surface = original.surface.closest_many(&relaxed);
    let place = |v: usize| match holds[v] {
        Hold::Free => on_surface[v].map(|c| c.point),
        Hold::Crease(_) => original.creases.closest(&relaxed[v]).map(|c| c.point),
        Hold::Corner => None,
    };
    (0..soup.points.len()).map(place).collect()
}

/// Moves a vertex unless a face of its fan turns too far.
fn try_move(soup: &mut Soup, fan: &[u32], v: usize, place: Point3<f64>) {
    let areas = |soup: &Soup| -> Vec<Vector3<f64>> {
        fan.iter().map(|&f| facing(&soup.points, soup.triangles[f as usize])).collect()
    };
    let before = areas(soup);
    let old = std::mem::replace(&mut soup.points[v], place);
    if before.iter().zip(areas(soup)).any(|(before, after)| turns(before, &after)) {
        soup.points[v] = old;
    }
}

/// The faces around each vertex, one after the other.
struct Fans {
    starts: Vec<usize>,
    faces: Vec<u32>,
}

impl Fans {
    fn new(soup: &Soup) -> Self {
        let mut corners: Vec<(u32, u32)> =
            soup.triangles.iter().zip(0..).flat_map(|(corners, f)| corners.map(|v| (v, f))).collect();
        corners.sort_unstable();
        let mut starts = vec![0; soup.points.len() + 1];
        corners.iter().for_each(|&(v, _)| starts[v as usize + 1] += 1);
        (0..soup.points.len()).for_each(|v| starts[v + 1] += starts[v]);
        Self { starts, faces: corners.into_iter().map(|(_, f)| f).collect() }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.faces[self.starts[v]..self.starts[v + 1]]
    }
}
