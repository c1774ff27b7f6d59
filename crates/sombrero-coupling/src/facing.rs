//! Walls and gaps: places that face each other, and how far apart they are.
//!
//! From the centre of every face and from every vertex a ray goes along the normal, outwards for a gap and inwards for a
//! wall, to the first face that is nearly parallel: its normal n' has |n · n'| at least cos 30°. Faces of walls look away from
//! each other, those of a layer above a body look the same way.

use crate::Assembly;
use crate::sites::Sites;
use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use sombrero_mesh::{Edges, geometry};
use sombrero_spatial::{Crossing, Line, Surface};

/// cos 30°: where two smooth surfaces are nearest they are parallel, and creases that are wider are no walls.
const PARALLEL: f64 = 0.866_025_403_784_438_6;

/// Places that one task looks from.
const CHUNK: usize = 256;

/// Two places of the surface that face each other.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Facing {
    /// How far apart they are, in model units.
    pub distance: f64,
    /// The unit vector from one to the other, seen where the first of the points stands first.
    pub direction: Vector3<f64>,
    /// Points, and maps of their displacements whose sum is what the two come apart by.
    pub terms: Vec<(u32, Matrix3<f64>)>,
}

/// What every place of a surface looks at, however far away. It follows from the shape alone, and takes most of the time.
#[derive(Debug, Clone)]
pub struct Views {
    of_faces: Vec<View>,
    of_vertices: Vec<View>,
}

/// A face that a place looks at.
#[derive(Debug, Clone, Copy)]
struct View {
    /// The place: a face or a site.
    from: u32,
    face: u32,
    /// How far along the normal it is, negative inwards.
    distance: f64,
}

impl Views {
    /// What is within [`reach`](crate::reach()) is in contact and not looked at. O(n log n) as a rule; the same for any number
    /// of threads.
    ///
    /// # Panics
    /// When a corner or a point of a place is not below the number of points.
    pub fn new(assembly: &Assembly<'_>) -> Self {
        let places = Places::new(assembly);
        let surface = Surface::new(&places.sites.at, &places.sites.triangles);
        let (faces, vertices) = (places.sites.triangles.len() as u32, places.sites.at.len() as u32);
        let all = |count: u32, place: PlaceOf<'_>| -> Vec<View> {
            let look = |from: u32| place(from).map(|place| places.views(&surface, from, &place));
            let views = (0..count).into_par_iter().with_min_len(CHUNK).filter_map(look);
            views.flat_map_iter(|views| views.into_iter().flatten()).collect()
        };
        Self {
            of_faces: all(faces, &|face| places.of_face(face)),
            of_vertices: all(vertices, &|site| places.of_vertex(site)),
        }
    }

    /// Pairs of places that face each other at `farthest` at most, as far as a place can come near, and that `count`:
    /// `farthest` is told for each point, and a face has that of its farthest-reaching corner. `assembly` is the one that
    /// was looked at.
    ///
    /// # Panics
    /// When `assembly` is another one, or `farthest` is shorter than its points.
    pub fn facing(
        &self,
        assembly: &Assembly<'_>,
        farthest: &[f64],
        counts: impl Fn(&Facing) -> bool + Sync,
    ) -> Vec<Facing> {
        let places = Places::new(assembly);
        let all = |views: &[View], place: PlaceOf<'_>| -> Vec<Facing> {
            let facing = |view: &View| {
                let place = place(view.from)?;
                let is_near = place.own().any(|site| view.distance.abs() <= farthest[places.point(site)]);
                is_near.then(|| places.facing(&place, view)).filter(&counts)
            };
            views.par_iter().with_min_len(CHUNK).filter_map(facing).collect()
        };
        let mut facing = all(&self.of_faces, &|face| places.of_face(face));
        facing.extend(all(&self.of_vertices, &|site| places.of_vertex(site)));
        facing
    }
}

/// Twice the area times the normal.
fn normal(points: &[Point3<f64>], corners: &[u32; 3]) -> Vector3<f64> {
    let [a, b, c] = corners.map(|v| &points[v as usize]);
    geometry::area_vector(a, b, c)
}

/// The place of a face, or of a site; `None` where it has no normal.
type PlaceOf<'a> = &'a (dyn Fn(u32) -> Option<Place> + Sync);

/// A place that looks along its normal.
struct Place {
    origin: Point3<f64>,
    normal: Vector3<f64>,
    /// The sites that it consists of, some of them more than once.
    sites: [u32; 3],
    /// How many there are.
    count: usize,
}

impl Place {
    fn own(&self) -> impl Iterator<Item = u32> {
        self.sites[..self.count].iter().copied()
    }
}

/// All places.
struct Places<'a> {
    sites: Sites,
    normals: Vec<Vector3<f64>>,
    /// The sum of the normals around each site, by area.
    around: Vec<Vector3<f64>>,
    assembly: &'a Assembly<'a>,
}

impl<'a> Places<'a> {
    fn new(assembly: &'a Assembly<'a>) -> Self {
        // Edges face nothing.
        let sites = Sites::new(assembly, &Edges::new(0, &[]));
        let normals: Vec<Vector3<f64>> =
            sites.triangles.iter().map(|corners| normal(&sites.at, corners)).collect();
        let mut around = vec![Vector3::zeros(); sites.at.len()];
        for (corners, normal) in sites.triangles.iter().zip(&normals) {
            corners.iter().for_each(|&v| around[v as usize] += normal);
        }
        Self { sites, normals, around, assembly }
    }

    /// The centre of a face.
    fn of_face(&self, face: u32) -> Option<Place> {
        let sites = self.sites.triangles[face as usize];
        let centre = sites.iter().map(|&v| self.sites.at[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
        let normal = self.normals[face as usize].try_normalize(0.0)?;
        Some(Place { origin: Point3::from(centre), normal, sites, count: 3 })
    }

    fn of_vertex(&self, site: u32) -> Option<Place> {
        let normal = self.around[site as usize].try_normalize(0.0)?;
        Some(Place { origin: self.sites.at[site as usize], normal, sites: [site; 3], count: 1 })
    }

    fn point(&self, site: u32) -> usize {
        self.sites.point[site as usize] as usize
    }

    /// What is seen outwards and inwards.
    fn views(&self, surface: &Surface, from: u32, place: &Place) -> [Option<View>; 2] {
        let contact = place.own().map(|site| self.assembly.reach[self.point(site)]).fold(0.0, f64::max);
        let counts = |face: u32| {
            let back = self.normals[face as usize];
            let its = self.sites.triangles[face as usize];
            back.norm_squared() > 0.0
                && back.dot(&place.normal).abs() >= PARALLEL * back.norm()
                && !place.own().any(|site| its.contains(&site))
        };
        let line = Line { origin: place.origin, direction: place.normal };
        let [behind, ahead] = surface.nearest_each_way(&line, f64::INFINITY, counts);
        let view = |hit: Crossing| View { from, face: hit.face, distance: hit.distance };
        [ahead, behind].map(|hit| hit.filter(|hit| hit.distance.abs() > contact).map(view))
    }

    fn facing(&self, place: &Place, view: &View) -> Facing {
        let distance = view.distance.abs();
        let direction = if view.distance < 0.0 { -place.normal } else { place.normal };
        Facing {
            distance,
            direction: self.sites.linear(place.sites[0]).transpose() * direction,
            terms: self.terms(place, view.face, &(place.origin + direction * distance)),
        }
    }

    /// The displacement of a place, less that of the point `at` of a face, seen where the first of its sites is.
    fn terms(&self, place: &Place, face: u32, at: &Point3<f64>) -> Vec<(u32, Matrix3<f64>)> {
        let corners = self.sites.triangles[face as usize];
        let [a, b, c] = corners.map(|v| self.sites.at[v as usize]);
        let whole = self.normals[face as usize];
        let part = |p: &Point3<f64>, q: &Point3<f64>| {
            (geometry::area_vector(p, q, at).dot(&whole) / whole.norm_squared()).clamp(0.0, 1.0)
        };
        let shares = [part(&b, &c), part(&c, &a), part(&a, &b)];
        let sum: f64 = shares.iter().sum();
        let near = place.own().map(|site| (site, 1.0 / place.count as f64));
        let far = corners.into_iter().zip(shares).map(|(site, share)| (site, -share / sum));
        let term = |(site, weight): (u32, f64)| {
            (self.sites.point[site as usize], self.sites.carried(site, place.sites[0]) * weight)
        };
        near.chain(far).filter(|(_, weight)| *weight != 0.0).map(term).collect()
    }
}
