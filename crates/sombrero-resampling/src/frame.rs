//! The original as the energy sees it: faces, springs and who is next to whom.

use nalgebra::{Point3, Vector3};
use sombrero_mesh::{BoundingBox, Soup};

use crate::error::ResampleError;

/// Coordinates larger than this are refused: products of four of them must not overflow.
const LARGEST: f64 = 1e70;

/// The unmoved original, in units of its largest side and with its centre at the origin.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    centre: Point3<f64>,
    side: f64,
    /// Positions; those without a face are at the origin.
    pub(crate) points: Vec<Vector3<f64>>,
    /// Usable faces.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Unit normal over twice the area; zero for a face without area.
    pub(crate) normals: Vec<Vector3<f64>>,
    /// `corners[v]`: 3 × face + place, for each corner of a face that v is.
    pub(crate) corners: Lists<u32>,
    /// `springs[v]`: other end and rest length.
    pub(crate) springs: Lists<(u32, f64)>,
}

/// Lists of different lengths in one block of memory.
#[derive(Debug, Clone)]
pub(crate) struct Lists<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Lists<T> {
    /// Groups `items` by key below `count`; the order within a list is kept.
    pub(crate) fn new(count: usize, items: &[(u32, T)]) -> Self {
        let mut starts = vec![0u32; count + 1];
        for (key, _) in items {
            starts[*key as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut order = vec![0u32; items.len()];
        for (i, (key, _)) in (0..).zip(items) {
            let place = &mut next[*key as usize];
            order[*place as usize] = i;
            *place += 1;
        }
        Self { starts, items: order.into_iter().map(|i| items[i as usize].1).collect() }
    }

    #[inline]
    pub(crate) fn of(&self, key: usize) -> &[T] {
        &self.items[self.starts[key] as usize..self.starts[key + 1] as usize]
    }
}

impl Frame {
    pub(crate) fn new(original: &Soup) -> Result<Self, ResampleError> {
        let faces = usable_faces(original, "original")?;
        let used = used(original.points.len(), &faces);
        let bounds = BoundingBox::of(original.points.iter().zip(&used).filter(|(_, u)| **u).map(|(p, _)| p));
        let no_faces = ResampleError::NoFaces { which: "original" };
        let bounds = bounds.filter(|b| b.largest_side() > 0.0).ok_or(no_faces.clone())?;
        let centre = nalgebra::center(&bounds.min, &bounds.max);
        let side = bounds.largest_side();
        let relative = |(p, &used): (&Point3<f64>, &bool)| {
            if used { (p - centre) / side } else { Vector3::zeros() }
        };
        let points: Vec<Vector3<f64>> = original.points.iter().zip(&used).map(relative).collect();
        let normals: Vec<Vector3<f64>> =
            faces.iter().map(|f| over_area(f.map(|v| points[v as usize]))).collect();
        if normals.iter().all(|n| n.norm_squared() == 0.0) {
            return Err(no_faces);
        }
        let corners = corners(points.len(), &faces);
        let springs = springs(&points, &faces);
        Ok(Self { centre, side, points, faces, normals, corners, springs })
    }

    /// Into units of the largest side.
    pub(crate) fn relative(&self, p: &Point3<f64>) -> Vector3<f64> {
        (p - self.centre) / self.side
    }

    /// Back into model units.
    pub(crate) fn absolute(&self, p: &Vector3<f64>) -> Point3<f64> {
        self.centre + p * self.side
    }

    /// The largest side, in model units.
    pub(crate) fn side(&self) -> f64 {
        self.side
    }

    /// Area of a face, in squared largest sides; zero for a sliver.
    pub(crate) fn area(&self, face: usize) -> f64 {
        let over_twice = self.normals[face].norm();
        if over_twice > 0.0 { 0.5 / over_twice } else { 0.0 }
    }

    /// Whether a face has this vertex.
    pub(crate) fn is_used(&self, vertex: usize) -> bool {
        !self.corners.of(vertex).is_empty()
    }
}

/// Faces whose corners exist and differ.
pub(crate) fn usable_faces(soup: &Soup, which: &'static str) -> Result<Vec<[u32; 3]>, ResampleError> {
    let usable = |[a, b, c]: &[u32; 3]| {
        let exist = [a, b, c].iter().all(|&&v| (v as usize) < soup.points.len());
        exist && a != b && b != c && c != a
    };
    let faces: Vec<[u32; 3]> = soup.triangles.iter().filter(|f| usable(f)).copied().collect();
    if faces.is_empty() {
        return Err(ResampleError::NoFaces { which });
    }
    let finite = |v: u32| soup.points[v as usize].iter().all(|x| x.abs() <= LARGEST);
    match faces.iter().flatten().find(|&&v| !finite(v)) {
        Some(&v) => Err(ResampleError::NotFinite { which, vertex: v as usize }),
        None => Ok(faces),
    }
}

fn used(count: usize, faces: &[[u32; 3]]) -> Vec<bool> {
    let mut used = vec![false; count];
    for &v in faces.iter().flatten() {
        used[v as usize] = true;
    }
    used
}

/// N / |N|² for the area vector N: the unit normal over twice the area; zero for a sliver, whose normal is
/// noise.
fn over_area([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    let area = (b - a).cross(&(c - a));
    let over = area / area.norm_squared();
    let longest = (b - a).norm_squared().max((c - a).norm_squared());
    let flat = area.norm() <= 1e-9 * longest;
    if flat || !over.iter().all(|x| x.is_finite()) { Vector3::zeros() } else { over }
}

fn corners(count: usize, faces: &[[u32; 3]]) -> Lists<u32> {
    let items: Vec<(u32, u32)> = faces.iter().flatten().copied().zip(0..).collect();
    Lists::new(count, &items)
}

/// Each edge once from each end.
fn springs(points: &[Vector3<f64>], faces: &[[u32; 3]]) -> Lists<(u32, f64)> {
    let both = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)];
    let mut ends: Vec<(u32, u32)> = faces.iter().flat_map(both).collect();
    ends.sort_unstable();
    ends.dedup();
    let spring = |&(a, b): &(u32, u32)| (a, (b, (points[a as usize] - points[b as usize]).norm()));
    Lists::new(points.len(), &ends.iter().map(spring).collect::<Vec<_>>())
}
