//! Normals that a file stores, turned as the surface around them turns.
//!
//! A stored normal need not be the surface's: creases, smoothing groups and hand-made shading are in it. So it is
//! not computed anew but turned by what takes the area vector of its faces before to that after,
//!
//! ```text
//! a = Σ (p₁ - p₀) × (p₂ - p₀),   R a/|a| = b/|b|,   R x = c x + v × x + v (v · x) / (1 + c),   v = a × b,  c = a · b
//! ```
//!
//! with the unit vectors a and b in the last equations. The faces of a normal are those that use it, together with
//! those that use an equal normal at a point of theirs: copies along a texture seam turn alike, the two sides of
//! a crease each for themselves.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};
use petgraph::unionfind::UnionFind;
use sombrero_mesh::Soup;

/// The cosine of the largest angle between normals that have to do with each other.
const LARGEST: f64 = 0.5;

/// The share of its faces' area that their sum as vectors must have to be a direction: around a closed surface it is
/// nothing but rounding.
const LEAST: f64 = 1e-6;
/// No normal at this corner.
pub(crate) const NONE: u32 = u32::MAX;

/// The normals of a file.
#[derive(Debug)]
pub(crate) struct Stored {
    pub(crate) values: Vec<Vector3<f64>>,
    /// For each triangle which normal each of its corners has, or [`NONE`].
    pub(crate) corners: Vec<[u32; 3]>,
    /// For text that is searched by lines: the byte where each normal's numbers begin.
    pub(crate) slots: Vec<usize>,
    /// Whether they are text, whose readers expect a few decimals.
    pub(crate) text: bool,
}

impl Stored {
    /// The normals before and after the points of a mesh went to `points`.
    pub(crate) fn turned(&self, mesh: &Soup, points: &[Point3<f64>]) -> (Vec<Point3<f64>>, Vec<Point3<f64>>) {
        let round = |n: Vector3<f64>| if self.text { n.map(|c| (c * 1e6).round() / 1e6) } else { n };
        let turns = turns(self, &mesh.triangles, &mesh.points, points);
        let turned = |(n, turn): (&Vector3<f64>, &Turn)| {
            Point3::from(if turn.is_none() { *n } else { round(turn.of(n)) })
        };
        let before = self.values.iter().map(|n| Point3::from(*n)).collect();
        (before, self.values.iter().zip(&turns).map(turned).collect())
    }
}

/// A turn without twist.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    /// The sine times the axis.
    axis: Vector3<f64>,
    cosine: f64,
}

impl Turn {
    const NONE: Self = Self { axis: Vector3::new(0.0, 0.0, 0.0), cosine: 1.0 };

    /// The shortest turn from `a` to `b`; none when one of them is zero, or beyond 60 degrees: only faces that are
    /// hardly more than a line turn as far, and they say nothing about shading.
    fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> Self {
        let (Some(a), Some(b)) = (a.try_normalize(0.0), b.try_normalize(0.0)) else {
            return Self::NONE;
        };
        let turn = Self { axis: a.cross(&b), cosine: a.dot(&b) };
        if turn.cosine > LARGEST { turn } else { Self::NONE }
    }

    fn is_none(&self) -> bool {
        self.axis == Vector3::zeros()
    }

    /// The vector turned; to the bit the same if there is no turn.
    pub(crate) fn of(&self, x: &Vector3<f64>) -> Vector3<f64> {
        if self.is_none() {
            return *x;
        }
        let Self { axis, cosine } = self;
        x * *cosine + axis.cross(x) + axis * (axis.dot(x) / (1.0 + cosine))
    }
}

/// How each normal turns when the points of `triangles` go from `old` to `new`.
pub(crate) fn turns(
    normals: &Stored,
    triangles: &[[u32; 3]],
    old: &[Point3<f64>],
    new: &[Point3<f64>],
) -> Vec<Turn> {
    let mut groups = UnionFind::<u32>::new(normals.values.len());
    let mut seen = HashMap::new();
    let corners = || triangles.iter().zip(&normals.corners).flat_map(|(t, n)| t.iter().zip(n));
    for (&vertex, &normal) in corners().filter(|(_, n)| **n != NONE) {
        let bits = |v: &Vector3<f64>| [v.x, v.y, v.z].map(f64::to_bits);
        let key = (bits(&old[vertex as usize].coords), bits(&normals.values[normal as usize]));
        let first = *seen.entry(key).or_insert(normal);
        groups.union(first, normal);
    }
    let mut areas = vec![[Vector3::zeros(); 2]; normals.values.len()];
    let mut total = vec![0.0; normals.values.len()];
    for (triangle, corners) in triangles.iter().zip(&normals.corners) {
        let [before, after] = [old, new].map(|points| {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            (b - a).cross(&(c - a))
        });
        for &normal in corners.iter().filter(|n| **n != NONE) {
            let group = groups.find_mut(normal) as usize;
            let [a, b] = &mut areas[group];
            *a += before;
            *b += after;
            total[group] += before.norm();
        }
    }
    (0..normals.values.len() as u32)
        .map(|n| {
            let group = groups.find_mut(n) as usize;
            let [a, b] = &areas[group];
            let is_direction = a.norm() > LEAST * total[group];
            // A normal far from its faces' (of either side) is not theirs.
            let normal = &normals.values[n as usize];
            let theirs = normal.dot(a).abs() > LARGEST * normal.norm() * a.norm();
            if a == b || !theirs || !is_direction { Turn::NONE } else { Turn::between(a, b) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{lifted, read};
    use crate::{Document, Rewrite};

    /// A roof: two slopes that meet in a ridge.
    const ROOF: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [1.0, 0.0, 1.0],
        [1.0, 2.0, 1.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
    ];

    fn renewed(document: &Document, points: &[Point3<f64>]) -> String {
        let how = Rewrite::default().with_renewed_normals(true);
        String::from_utf8(document.rewrite(points, &how).unwrap().bytes).unwrap()
    }

    #[test]
    fn a_turn_is_the_shortest() {
        let (a, b) = (Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 3.0, 3.0));
        let turn = Turn::between(&a, &b);
        assert!((turn.of(&a) - b.normalize() * 2.0).norm() < 1e-15);
        assert!((turn.of(&Vector3::x()) - Vector3::x()).norm() < 1e-15);
        assert_eq!(Turn::between(&a, &-a).of(&b), b);
        assert_eq!(Turn::between(&a, &Vector3::x()).of(&b), b);
        assert_eq!(Turn::between(&a, &Vector3::zeros()).of(&b), b);
    }

    #[test]
    fn both_sides_of_a_crease_turn_for_themselves_in_obj() {
        let mut text = String::new();
        for [x, y, z] in ROOF {
            text += &format!("v {x} {y} {z}\n");
        }
        text += "vn -0.7071 0 0.7071\nvn 0.7071 0 0.7071\nf 1//1 3//1 4//1 2//1\nf 3//2 5//2 6//2 4//2\n";
        let document = read(&text, "obj");
        // The ridge moves over the right eaves: the left slope is at 1 : 2, the right one stands upright.
        let points: Vec<_> = document
            .points()
            .iter()
            .map(|p| if p.z == 1.0 { Point3::new(2.0, p.y, 1.0) } else { *p })
            .collect();
        let out = renewed(&document, &points);
        let normal = |line: &str| -> Vector3<f64> {
            Vector3::from_iterator(line.split(' ').skip(1).map(|w| w.parse::<f64>().unwrap()))
        };
        let found: Vec<_> = out.lines().filter(|l| l.starts_with("vn")).map(normal).collect();
        assert!((found[0] - Vector3::new(-1.0, 0.0, 2.0).normalize()).norm() < 1e-4, "{found:?}");
        assert!((found[1] - Vector3::x()).norm() < 1e-4, "{found:?}");
        // Without being asked for, normals stay.
        let kept = String::from_utf8(document.with_points(&points).unwrap()).unwrap();
        assert!(kept.contains("vn -0.7071 0 0.7071\nvn 0.7071 0 0.7071\n"));
    }

    #[test]
    fn copies_along_a_seam_turn_alike_and_unmoved_ones_stay() {
        // Two triangles side by side with the edge between them doubled, as a texture seam doubles it.
        let rows = "0 0 0 0 0 1 .5\n1 0 0 0 0 1 .5\n0 1 0 0 0 1 .5\n1 0 0 0 0 1 .5\n1 1 0 0 0 1 .5\n0 1 0 0 0 1 .5\n\
                    5 5 5 0 0.60 0.8 1\n6 5 5 0 0.60 0.8 1\n5 6 5 0 0.60 0.8 1\n";
        let header = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n\
                      property float nx\nproperty float ny\nproperty float nz\nproperty float q\n\
                      element face 3\nproperty list uchar int vertex_indices\nend_header\n";
        let document = read(format!("{header}{rows}3 0 1 2\n3 3 4 5\n3 6 7 8\n"), "ply");
        let mut points = document.points().to_vec();
        points[4].z = 0.5;
        let out = renewed(&document, &points);
        let lines: Vec<Vec<&str>> = out.lines().skip(13).map(|l| l.split(' ').collect()).collect();
        assert_eq!(lines[1][3..6], lines[3][3..6]);
        assert_eq!(lines[2][3..6], lines[5][3..6]);
        assert_ne!(lines[1][3..6], ["0", "0", "1"]);
        // A corner of the first triangle alone, which did not move.
        assert_eq!(lines[0][3..6], ["0", "0", "1"]);
        assert_eq!(lines[6][3..6], ["0", "0.60", "0.8"]);
        assert!(lines[..6].iter().all(|l| l[6] == ".5"));
    }

    #[test]
    fn normals_of_off_turn_and_colours_stay() {
        let text =
            "CNOFF\n3 1 0\n0 0 0 0 0 1 .1 .2 .3 1\n1 0 0 0 0 1 .1 .2 .3 1\n0 1 0 0 0 1 .1 .2 .3 1\n3 0 1 2\n";
        let document = read(text, "off");
        let out = renewed(&document, &lifted(&document, |p| Point3::new(p.x, p.y, p.x)));
        assert!(out.contains("\n1 0 1.0 -0.707107 0 0.707107 .1 .2 .3 1\n"), "{out}");
    }

    #[test]
    fn a_normal_that_is_not_its_faces_stays() {
        // A sliver that stands upright on the surface that the normal belongs to.
        let text = "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0.5 1e-9 1e-6 0 0 1\n3 0 1 2\n";
        let document = read(text, "off");
        let out = renewed(&document, &lifted(&document, |p| p + Vector3::new(0.0, 1e-7 * p.x, -1e-6 * p.x)));
        assert_eq!(out.matches(" 0 0 1\n").count(), 3, "{out}");
    }

    #[test]
    fn a_file_without_a_keyword_or_normals_is_written_as_ever() {
        let document = read("3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "off");
        let points = lifted(&document, |p| p + Vector3::z());
        assert_eq!(renewed(&document, &points).as_bytes(), document.with_points(&points).unwrap());
    }
}
