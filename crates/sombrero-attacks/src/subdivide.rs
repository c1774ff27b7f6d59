//! Subdivision: every face becomes four.
//!
//! Midpoint subdivision keeps the surface: a new vertex stands in the middle of each edge. Loop's scheme
//! (Loop 1987) smooths as it refines. For an edge ab between the faces abc and bad, and an old vertex v with
//! neighbours w_1 to w_n,
//!
//!   new vertex  3/8 (a + b) + 1/8 (c + d),
//!   old vertex  (1 - n β) v + β Σ w_i,   β = (5/8 - (3/8 + cos(2π / n) / 4)²) / n.
//!
//! Where the surface ends the curve of the rim is refined alone (Hoppe, DeRose, Duchamp, Halstead, Jin, McDonald,
//! Schweitzer, Stuetzle 1994): new vertices are midpoints, and a vertex between two rim edges va, vb goes to
//! 3/4 v + 1/8 (a + b). Edges of three and more faces count as rims, and a vertex with one or more than two
//! rim edges stays.

use crate::attacked::Attacked;
use crate::error::{AttackError, MOST_FACES, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use crate::whole::whole_faces;
use nalgebra::{Point3, Vector3, center};
use rand::Rng;
use sombrero_mesh::{Edges, Soup};
use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

/// How a subdivision places vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scheme {
    /// New vertices in the middles of edges; old ones stay.
    Midpoint,
    /// Loop's smooth scheme.
    Loop,
}

impl FromStr for Scheme {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        match name {
            "midpoint" => Ok(Self::Midpoint),
            "loop" => Ok(Self::Loop),
            _ => Err(()),
        }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Midpoint => "midpoint",
            Self::Loop => "loop",
        })
    }
}

/// How to subdivide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subdivision {
    /// Where vertices go.
    pub scheme: Scheme,
    /// How many times, at most 10.
    pub iterations: u32,
}

/// Subdivides. Old vertices keep their numbers; new ones follow.
///
/// Faces that do not have three different vertices as corners are left out.
///
/// # Errors
/// [`AttackError::Parameter`] for more than 10 iterations, [`AttackError::TooManyFaces`] when the result would
/// have too many, and [`AttackError::NothingLeft`] when no face is whole.
pub fn subdivide(soup: &Soup, subdivision: &Subdivision) -> Result<Attacked, AttackError> {
    in_range("iterations", f64::from(subdivision.iterations), (0.0, 10.0), "between 0 and 10")?;
    let mut fine = Soup::new(soup.points.clone(), whole_faces(soup));
    if fine.triangles.is_empty() {
        return Err(AttackError::NothingLeft);
    }
    if fine.triangles.len() << (2 * subdivision.iterations) > MOST_FACES {
        return Err(AttackError::TooManyFaces);
    }
    for _ in 0..subdivision.iterations {
        fine = refined(&fine, subdivision.scheme);
    }
    let source = (0..fine.points.len()).map(|v| (v < soup.points.len()).then_some(v as u32)).collect();
    Ok(Attacked { soup: fine, source })
}

fn refined(soup: &Soup, scheme: Scheme) -> Soup {
    let edges = Edges::new(soup.points.len(), &soup.triangles);
    let (mut points, new) = match scheme {
        Scheme::Midpoint => (soup.points.clone(), midpoints(soup, &edges)),
        Scheme::Loop => (old_vertices(soup, &edges), new_vertices(soup, &edges)),
    };
    let first = points.len() as u32;
    points.extend(new);
    let faces = soup.triangles.iter().zip(edges.of_side.chunks_exact(3));
    let triangles = faces.flat_map(|(&[a, b, c], sides)| {
        let [ab, bc, ca] = [first + sides[0], first + sides[1], first + sides[2]];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    });
    Soup::new(points, triangles.collect())
}

fn midpoints(soup: &Soup, edges: &Edges) -> Vec<Point3<f64>> {
    edges.ends.iter().map(|&[a, b]| center(&soup.points[a as usize], &soup.points[b as usize])).collect()
}

/// Loop's rule for edges.
fn new_vertices(soup: &Soup, edges: &Edges) -> Vec<Point3<f64>> {
    let mut new = midpoints(soup, edges);
    let middles = new.clone();
    for (corners, sides) in soup.triangles.iter().zip(edges.of_side.chunks_exact(3)) {
        for (k, &edge) in sides.iter().enumerate().filter(|(_, edge)| edges.sides[**edge as usize] == 2) {
            // 3/8 (a + b) + 1/8 (c + d) = m + 1/8 (c - m) + 1/8 (d - m) with the midpoint m.
            let apex = soup.points[corners[(k + 2) % 3] as usize];
            new[edge as usize] += (apex - middles[edge as usize]) / 8.0;
        }
    }
    new
}

/// The edges at a vertex: vectors to its neighbours, summed.
#[derive(Clone, Default)]
struct Ring {
    all: (u32, Vector3<f64>),
    rim: (u32, Vector3<f64>),
}

/// Loop's rule for vertices.
fn old_vertices(soup: &Soup, edges: &Edges) -> Vec<Point3<f64>> {
    let mut rings = vec![Ring::default(); soup.points.len()];
    for (&[a, b], &sides) in edges.ends.iter().zip(&edges.sides) {
        let along = soup.points[b as usize] - soup.points[a as usize];
        for (v, vector) in [(a, along), (b, -along)] {
            let Ring { all, rim } = &mut rings[v as usize];
            *all = (all.0 + 1, all.1 + vector);
            if sides != 2 {
                *rim = (rim.0 + 1, rim.1 + vector);
            }
        }
    }
    let moved = |(p, ring): (&Point3<f64>, &Ring)| match (ring.all, ring.rim) {
        ((0, _), _) => *p,
        ((n, sum), (0, _)) => p + sum * beta(n),
        (_, (2, sum)) => p + sum / 8.0,
        _ => *p,
    };
    soup.points.iter().zip(&rings).map(moved).collect()
}

fn beta(n: u32) -> f64 {
    let n = f64::from(n);
    let c = 3.0 / 8.0 + libm::cos(TAU / n) / 4.0;
    (5.0 / 8.0 - c * c) / n
}

impl Operation for Subdivision {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let scheme = given.value("scheme", "midpoint or loop")?;
        Ok(Self {
            scheme: given.needed("scheme", scheme)?,
            iterations: given.whole("iterations")?.unwrap_or(1),
        })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("scheme", self.scheme.to_string()), ("iterations", self.iterations.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, _rng: &mut R) -> Result<Attacked, AttackError> {
        subdivide(soup, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sombrero_mesh::{geometry, repair, topology};
    use sombrero_shapes as shapes;
    use sombrero_spatial::{DistanceOptions, compare};

    fn by(soup: &Soup, scheme: Scheme, iterations: u32) -> Attacked {
        subdivide(soup, &Subdivision { scheme, iterations }).unwrap()
    }

    fn area(soup: &Soup) -> f64 {
        let made = repair(soup);
        geometry::area(&made.mesh, &made.points)
    }

    #[test]
    fn midpoints_keep_the_surface() {
        for soup in [shapes::part(4), shapes::bumpy_sphere(200), shapes::sheet_with_hole(6, 6)] {
            let fine = by(&soup, Scheme::Midpoint, 2);
            assert_eq!(fine.soup.triangles.len(), 16 * soup.triangles.len());
            assert!((area(&fine.soup) / area(&soup) - 1.0).abs() < 1e-12);
            let apart = compare(&soup, &fine.soup, &DistanceOptions { samples: 2000 }).unwrap();
            assert!(apart.hausdorff < 1e-12);
            assert_eq!(
                fine.correspondence(soup.points.len()),
                soup.points.iter().map(|p| Some(*p)).collect::<Vec<_>>()
            );
            assert_eq!(fine.source.iter().flatten().count(), soup.points.len());
        }
    }

    #[test]
    fn loops_scheme_keeps_the_topology() {
        for soup in [shapes::sphere(1), shapes::torus(8, 6, 1.0, 0.4), shapes::open_sheet(5, 4)] {
            let fine = by(&soup, Scheme::Loop, 2).soup;
            assert_eq!(fine.triangles.len(), 16 * soup.triangles.len());
            let (before, after) = (repair(&soup), repair(&fine));
            assert!(after.report.is_clean());
            assert_eq!(topology::genus(&before.mesh), topology::genus(&after.mesh));
            let loops = |mesh| topology::boundary_loops(mesh).len();
            assert_eq!(loops(&before.mesh), loops(&after.mesh));
        }
    }

    #[test]
    fn loops_scheme_tends_to_its_limit() {
        // Steps of a convergent scheme shrink by about 4 each time.
        let mut soup = shapes::icosahedron();
        let mut steps = Vec::new();
        for _ in 0..4 {
            let fine = by(&soup, Scheme::Loop, 1).soup;
            steps.push((fine.points[0] - soup.points[0]).norm());
            soup = fine;
        }
        assert!(steps.windows(2).all(|s| s[1] < 0.45 * s[0]), "{steps:?}");
        let radii: Vec<f64> = soup.points.iter().map(|p| p.coords.norm()).collect();
        let (least, most) = radii.iter().fold((f64::MAX, 0.0f64), |(l, m), &r| (l.min(r), m.max(r)));
        assert!(most / least < 1.1, "round");
    }

    #[test]
    fn a_flat_sheet_stays_flat_and_its_straight_rim_straight() {
        let points = (0..16).map(|i| Point3::new(f64::from(i % 4), f64::from(i / 4), 0.0)).collect();
        let cell = |i: u32| [[i, i + 1, i + 5], [i, i + 5, i + 4]];
        let sheet = Soup::new(points, [0, 1, 2, 4, 5, 6, 8, 9, 10].into_iter().flat_map(cell).collect());
        let fine = by(&sheet, Scheme::Loop, 1).soup;
        assert!(fine.points.iter().all(|p| p.z == 0.0));
        let on_rim = |p: &&Point3<f64>| p.x == 0.0;
        assert_eq!(fine.points.iter().filter(on_rim).count(), 5, "the corners alone are cut");
    }

    #[test]
    fn fins_and_scraps_do_no_harm() {
        // Three faces at an edge, a face with a repeated corner and one with a foreign one.
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.]];
        let triangles = vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 0, 1], [0, 1, 9]];
        let fin = Soup::new(points.map(Point3::from).to_vec(), triangles);
        for scheme in [Scheme::Midpoint, Scheme::Loop] {
            assert_eq!(by(&fin, scheme, 2).soup.triangles.len(), 48);
        }
        let scraps = Soup::new(fin.points, vec![[0, 0, 1]]);
        let once = Subdivision { scheme: Scheme::Loop, iterations: 1 };
        assert_eq!(subdivide(&scraps, &once), Err(AttackError::NothingLeft));
        let often = Subdivision { scheme: Scheme::Loop, iterations: 10 };
        assert_eq!(subdivide(&shapes::sphere(3), &often), Err(AttackError::TooManyFaces));
    }
}
