//! A point cloud as a surface: a small triangle about each point, in the plane of its neighbours, all with the same side out.
//!
//! The plane at p is that of least squares through its k nearest neighbours: its normal is the eigenvector of the smallest
//! eigenvalue of their covariance. Neighbours lie in a disk of radius r, the distance of the k-th, so that p stands for the area
//! π r² / k, and so large is its triangle.
//!
//! Which side is out spreads along a spanning tree of neighbours whose planes differ least, by Prim's method, from the point
//! that lies highest in each piece (Hoppe, DeRose, Duchamp, McDonald and Stuetzle 1992, section 3.3): edges weigh
//! 1 - |n_i · n_j|.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Matrix3, Point3, SymmetricEigen, Vector3};
use rayon::prelude::*;
use sombrero_mesh::Soup;

use crate::limits::usable;
use crate::nearest::first_of_each_position;
use crate::robust::median;

/// k, the point itself left out.
const NEIGHBOURS: usize = 20;
/// A point whose neighbours are further away than this many medians belongs to nothing.
const FAR: f64 = 5.0;
/// Points that are used at most; of more, evenly many.
const MOST: usize = 250_000;
/// The least number of points that is a cloud.
const LEAST: usize = 100;

/// The triangles that stand for the surface which the points were taken from: triangle i about its own point, with three vertices of
/// its own. `None` of fewer than 100 different points, or of points without an extent.
///
/// Points that are not finite, repetitions and stray points are left out; of very many points some hundred thousand are kept.
pub fn splats(points: &[Point3<f64>]) -> Option<Soup> {
    let kept = first_of_each_position(points);
    let stride = kept.len().div_ceil(MOST).max(1);
    let points: Vec<Point3<f64>> = kept.iter().step_by(stride).map(|&i| points[i as usize]).collect();
    if points.len() < LEAST || !points.iter().all(usable) {
        return None;
    }
    let neighbours = neighbours(&points)?;
    let reach: Vec<f64> = neighbours.iter().zip(&points).map(|(near, p)| radius(&points, near, p)).collect();
    let limit = FAR * median(reach.clone());
    if !(limit > 0.0 && limit.is_finite()) {
        return None;
    }
    let normals: Vec<Vector3<f64>> = neighbours.par_iter().map(|near| normal(&points, near)).collect();
    let normals = oriented(&points, &neighbours, normals);
    let mut soup = Soup::default();
    for ((p, normal), reach) in points.iter().zip(normals).zip(reach).filter(|(_, reach)| *reach <= limit) {
        let first = soup.points.len() as u32;
        soup.points.extend(corners(p, &normal, reach));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    (soup.triangles.len() >= LEAST).then_some(soup)
}

/// For each point those nearest to it, itself among them.
fn neighbours(points: &[Point3<f64>]) -> Option<Vec<Vec<u32>>> {
    let positions: Vec<[f64; 3]> = points.iter().map(|p| p.coords.into()).collect();
    let tree: ImmutableKdTree<f64, 3> = ImmutableKdTree::new_from_slice(&positions).ok()?;
    let count = NonZero::new(NEIGHBOURS + 1)?;
    let near = |position: &[f64; 3]| {
        let found = tree.query(position).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        let mut near: Vec<u32> = found.into_iter().map(|found| found.item).collect();
        // Sums are to be the same whatever the order in which the tree is walked.
        near.sort_unstable();
        near
    };
    Some(positions.par_iter().map(near).collect())
}

/// The distance of the furthest neighbour.
fn radius(points: &[Point3<f64>], near: &[u32], p: &Point3<f64>) -> f64 {
    near.iter().map(|&i| (points[i as usize] - p).norm_squared()).fold(0.0, f64::max).sqrt()
}

/// Across the plane of least squares, either way.
fn normal(points: &[Point3<f64>], near: &[u32]) -> Vector3<f64> {
    let places = || near.iter().map(|&i| points[i as usize].coords);
    let mean = places().sum::<Vector3<f64>>() / near.len().max(1) as f64;
    let covariance: Matrix3<f64> = places().map(|p| (p - mean) * (p - mean).transpose()).sum();
    let largest = covariance.amax();
    if !(largest > 0.0 && largest.is_finite()) {
        return Vector3::z();
    }
    let eigen = SymmetricEigen::new(covariance / largest);
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned()
}

/// The normals with the same side out. All pieces are begun at their highest point, whose normal looks up.
fn oriented(
    points: &[Point3<f64>],
    neighbours: &[Vec<u32>],
    mut normals: Vec<Vector3<f64>>,
) -> Vec<Vector3<f64>> {
    let both = both_ways(neighbours);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by(|&a, &b| points[b as usize].z.total_cmp(&points[a as usize].z).then(a.cmp(&b)));
    let mut known = vec![false; points.len()];
    // Weights are not negative, so their bits are in their order.
    let mut open: BinaryHeap<Reverse<(u64, u32, u32)>> = BinaryHeap::new();
    for highest in order {
        if known[highest as usize] {
            continue;
        }
        if normals[highest as usize].z < 0.0 {
            normals[highest as usize].neg_mut();
        }
        open.push(Reverse((0, highest, highest)));
        while let Some(Reverse((_, from, to))) = open.pop() {
            if std::mem::replace(&mut known[to as usize], true) {
                continue;
            }
            if normals[from as usize].dot(&normals[to as usize]) < 0.0 {
                normals[to as usize].neg_mut();
            }
            for &next in both[to as usize].iter().filter(|&&next| !known[next as usize]) {
                let weight = (1.0 - normals[to as usize].dot(&normals[next as usize]).abs()).max(0.0);
                open.push(Reverse((weight.to_bits(), to, next)));
            }
        }
    }
    normals
}

/// Who is a neighbour of whom, seen from either.
fn both_ways(neighbours: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut both = neighbours.to_vec();
    for (i, near) in (0..).zip(neighbours) {
        near.iter().for_each(|&j| both[j as usize].push(i));
    }
    for near in &mut both {
        near.sort_unstable();
        near.dedup();
    }
    both
}

/// The corners of an even triangle about p, counter-clockwise seen from outside, of the area of π r² / k.
fn corners(p: &Point3<f64>, normal: &Vector3<f64>, reach: f64) -> [Point3<f64>; 3] {
    let area = std::f64::consts::PI * reach * reach / NEIGHBOURS as f64;
    // An even triangle with the circumradius R has the area 3 √3 / 4 R².
    let radius = (area * 4.0 / (3.0 * 3.0_f64.sqrt())).sqrt();
    let across = Vector3::ith(normal.iamin(), 1.0).cross(normal);
    let x = across.try_normalize(0.0).unwrap_or_else(Vector3::x) * radius;
    let y = normal.cross(&x);
    let half = 0.75_f64.sqrt();
    [p + x, p - x * 0.5 + y * half, p - x * 0.5 - y * half]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{sample_ball, spread_samples};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    fn cloud(soup: &Soup, count: usize, noise: f64) -> Vec<Point3<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let samples = spread_samples(&soup.points, &soup.triangles, count);
        let place = |s: &crate::SurfaceSample| s.point(&soup.points, &soup.triangles).unwrap();
        samples.iter().map(|s| place(s) + sample_ball(&mut rng) * noise).collect()
    }

    fn normal_of(soup: &Soup, face: usize) -> Vector3<f64> {
        let [a, b, c] = soup.triangles[face].map(|v| soup.points[v as usize]);
        (b - a).cross(&(c - a))
    }

    #[test]
    fn a_ball_faces_outwards_and_has_its_area() {
        for noise in [0.0, 0.004] {
            let soup = splats(&cloud(&shapes::sphere(5), 8000, noise)).unwrap();
            let area: f64 = (0..soup.triangles.len()).map(|f| 0.5 * normal_of(&soup, f).norm()).sum();
            assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.08, "{area}");
            for (face, corners) in soup.triangles.iter().enumerate() {
                let centre =
                    corners.iter().map(|&v| soup.points[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
                let cosine = normal_of(&soup, face).normalize().dot(&centre.normalize());
                assert!(cosine > 0.9, "{cosine} at noise {noise}");
            }
        }
    }

    #[test]
    fn every_piece_faces_outwards() {
        let mut points = cloud(&shapes::torus(60, 30, 1.0, 0.4), 6000, 0.001);
        points.extend(cloud(&shapes::sphere(4), 4000, 0.001).iter().map(|p| p + Vector3::new(5.0, 0.0, 0.5)));
        let soup = splats(&points).unwrap();
        let outwards = |(face, corners): (usize, &[u32; 3])| {
            let p = soup.points[corners[0] as usize];
            let middle = if p.x > 3.0 {
                Point3::new(5.0, 0.0, 0.5)
            } else {
                let ring = Vector3::new(p.x, p.y, 0.0).normalize();
                Point3::from(ring)
            };
            normal_of(&soup, face).dot(&(p - middle)) > 0.0
        };
        assert!(soup.triangles.iter().enumerate().all(outwards));
    }

    #[test]
    fn stray_points_and_nonsense_are_left_out() {
        let mut points = cloud(&shapes::sphere(4), 2000, 0.0);
        points.push(Point3::new(50.0, 0.0, 0.0));
        points.push(Point3::new(f64::NAN, 0.0, 0.0));
        points.push(points[0]);
        assert_eq!(splats(&points).unwrap().triangles.len(), 2000);
        assert_eq!(splats(&[]), None);
        assert_eq!(splats(&vec![Point3::new(1.0, 2.0, 3.0); 500]), None);
        assert_eq!(splats(&points[..99]), None);
    }

    #[test]
    fn flat_and_straight_clouds_are_no_trouble() {
        let flat: Vec<_> = (0..400).map(|i| Point3::new(f64::from(i % 20), f64::from(i / 20), 0.0)).collect();
        let soup = splats(&flat).unwrap();
        assert!((0..soup.triangles.len()).all(|f| normal_of(&soup, f).z > 0.0));
        let line: Vec<_> = (0..400).map(|i| Point3::new(f64::from(i), 0.0, 0.0)).collect();
        assert!(splats(&line).unwrap().points.iter().all(|p| p.iter().all(|x| x.is_finite())));
    }
}
