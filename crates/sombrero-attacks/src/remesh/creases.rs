//! Edges at which the surface turns sharply or ends, and what that means for their vertices.

use super::facing;
use nalgebra::{Point3, Vector3};
use sombrero_mesh::Edges;

/// Cosine of the turn (53 degrees) beyond which an edge is a crease, and a bend of a crease a corner.
const SHARP: f64 = 0.6;

/// What holds a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hold {
    /// It may move anywhere on the surface. A single crease that ends at it does not hold it.
    Free,
    /// It may move along a crease, between these neighbours.
    Crease([u32; 2]),
    /// Creases meet or bend: it stays.
    Corner,
}

pub(super) struct Creases {
    /// By edge.
    pub(super) sharp: Vec<bool>,
    /// By vertex.
    pub(super) holds: Vec<Hold>,
}

impl Creases {
    pub(super) fn of(points: &[Point3<f64>], triangles: &[[u32; 3]], edges: &Edges) -> Self {
        let sharp = sharp_edges(points, triangles, edges);
        let mut at: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
        for ([a, b], _) in edges.ends.iter().zip(&sharp).filter(|(_, sharp)| **sharp) {
            at[*a as usize].push(*b);
            at[*b as usize].push(*a);
        }
        let hold = |(p, others): (&Point3<f64>, &Vec<u32>)| match others[..] {
            [] | [_] => Hold::Free,
            [a, b] if is_straight(p, &points[a as usize], &points[b as usize]) => Hold::Crease([a, b]),
            _ => Hold::Corner,
        };
        Self { holds: points.iter().zip(&at).map(hold).collect(), sharp }
    }
}

fn sharp_edges(points: &[Point3<f64>], triangles: &[[u32; 3]], edges: &Edges) -> Vec<bool> {
    let mut beside: Vec<[Vector3<f64>; 2]> = vec![Default::default(); edges.len()];
    let mut seen = vec![0usize; edges.len()];
    for (corners, sides) in triangles.iter().zip(edges.of_side.chunks_exact(3)) {
        let normal = facing(points, *corners).try_normalize(0.0).unwrap_or_default();
        for &edge in sides {
            beside[edge as usize][seen[edge as usize].min(1)] = normal;
            seen[edge as usize] += 1;
        }
    }
    // Beside a face without an area nothing turns.
    let turns = |[m, n]: &[Vector3<f64>; 2]| m.dot(n) < SHARP * m.norm() * n.norm();
    beside.iter().zip(seen).map(|(normals, seen)| seen != 2 || turns(normals)).collect()
}

fn is_straight(p: &Point3<f64>, a: &Point3<f64>, b: &Point3<f64>) -> bool {
    let (into, out) = (p - a, b - p);
    into.dot(&out) >= SHARP * into.norm() * out.norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::Soup;
    use sombrero_shapes as shapes;

    fn creases(soup: &Soup) -> Creases {
        Creases::of(&soup.points, &soup.triangles, &Edges::new(soup.points.len(), &soup.triangles))
    }

    #[test]
    fn cubes_have_twelve_and_spheres_none() {
        let cube = creases(&shapes::cube());
        assert_eq!(cube.sharp.iter().filter(|sharp| **sharp).count(), 12);
        assert!(cube.holds.iter().all(|hold| *hold == Hold::Corner));
        let sphere = creases(&shapes::sphere(2));
        assert!(!sphere.sharp.contains(&true) && sphere.holds.iter().all(|hold| *hold == Hold::Free));
    }

    #[test]
    fn the_rim_of_a_sheet_is_a_crease_with_four_corners() {
        let sheet = creases(&shapes::open_sheet(8, 8));
        let count = |wanted: fn(&Hold) -> bool| sheet.holds.iter().filter(|hold| wanted(hold)).count();
        assert_eq!(count(|hold| *hold == Hold::Corner), 4);
        assert_eq!(count(|hold| matches!(hold, Hold::Crease(_))), 28);
        assert_eq!(count(|hold| *hold == Hold::Free), 49);
    }
}
