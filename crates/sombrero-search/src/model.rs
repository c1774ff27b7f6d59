//! A mesh file as the method sees it: one point a position, and a manifold mesh over the points.

use crate::clearance::kept_apart;
use crate::coupled::coupled;
use nalgebra::Point3;
use sombrero_basis::{Basis, BasisError, BasisFunction, BasisOptions};
use sombrero_coupling::{Assembly, Coupling, Shown, join, reach};
use sombrero_mesh::repair::Repaired;
use sombrero_mesh::{BoundingBox, Place, Scene, Soup, Weld, repair, topology};
use sombrero_progressive::ProgressiveMesh;
use std::sync::OnceLock;

/// Stored vertices, joined to points, made a manifold mesh.
///
/// Three kinds of vertices appear, and this type is where they meet: *stored* vertices are those of the
/// file; *points* are stored vertices of equal position but for rounding, joined; *mesh* vertices are points, some of them
/// copied so that the surface is a manifold, those without a face left out. Watermarks move points, so
/// whatever was joined in the file stays joined; points that meet elsewhere move as the [`Coupling`] says.
#[derive(Debug, Clone)]
pub struct Model {
    /// The point of each stored vertex.
    point_of: Vec<u32>,
    /// Stored vertices that stand beside their point, by rounding, and where.
    beside: Vec<(u32, Point3<f64>)>,
    soup: Soup,
    /// How far each point reaches for others that it meets.
    reach: Vec<f64>,
    /// Where the scene shows points besides.
    places: Vec<Shown>,
    /// Whether points without a face are drawn.
    draws_loose: bool,
    /// Made when first asked for: suspects need none.
    repaired: OnceLock<Repaired>,
    bounds: OnceLock<Option<BoundingBox>>,
    coupling: OnceLock<Coupling>,
}

impl Model {
    /// The model of a bare mesh. Never fails; a soup without a usable face gives a model without faces.
    pub fn new(stored: &Soup) -> Self {
        Self::of_scene(stored, &Scene::default())
    }

    /// The model of a mesh whose vertices a scene shows at further places, or that are stored on a coarse grid. Places
    /// of vertices that are not there count for nothing.
    pub fn of_scene(stored: &Soup, scene: &Scene) -> Self {
        let mut weld = Weld::new(&stored.points);
        let in_range = |corners: &&[u32; 3]| corners.iter().all(|&v| (v as usize) < stored.points.len());
        let kept: Vec<[u32; 3]> = stored.triangles.iter().filter(in_range).copied().collect();
        let mut triangles = weld.triangles(&kept);
        let steps = coarsest(&weld, &scene.steps);
        let mut reach_of = reach(&weld.points, &triangles, &steps);
        if let Some(leaders) = join(&weld.points, &triangles, &reach_of) {
            weld = rejoined(&weld, &leaders);
            triangles = weld.triangles(&kept);
            reach_of = reach(&weld.points, &triangles, &coarsest(&weld, &scene.steps));
        }
        let beside = beside(&weld, &stored.points);
        let places = scene.places.iter().map(|place| shown(place, &weld)).collect();
        let Weld { points, point_of } = weld;
        let soup = Soup::new(points, triangles);
        Self {
            point_of,
            beside,
            soup,
            draws_loose: scene.draws_loose,
            reach: reach_of,
            places,
            repaired: OnceLock::new(),
            bounds: OnceLock::new(),
            coupling: OnceLock::new(),
        }
    }

    /// Points and triangles over points.
    pub fn soup(&self) -> &Soup {
        &self.soup
    }

    /// The manifold mesh and what was done to get it: repaired when first asked for, which never fails.
    pub fn repaired(&self) -> &Repaired {
        self.repaired.get_or_init(|| repair(&self.soup))
    }

    /// Lets go of the manifold mesh, which is as large as all else, until it is asked for again.
    pub(crate) fn forget_repaired(&mut self) {
        self.bounding_box();
        self.repaired.take();
    }

    /// The points alone, for those who need no more.
    pub(crate) fn into_soup(self) -> Soup {
        self.soup
    }

    /// The point of each stored vertex.
    pub fn point_of_stored(&self) -> &[u32] {
        &self.point_of
    }

    /// The bounding box of the vertices that have a face; `None` without a face.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        *self.bounds.get_or_init(|| BoundingBox::of(&self.repaired().points))
    }

    /// The largest side of the bounding box, the unit of relative lengths; 0 without a face.
    pub fn largest_side(&self) -> f64 {
        self.bounding_box().map_or(0.0, |b| b.largest_side())
    }

    /// For each point the largest side of the box of its part, which hangs together by edges: the unit of what is small
    /// there, whatever else is on the plate. 0 without a face.
    pub fn part_sides(&self) -> Vec<f64> {
        let Repaired { mesh, points, source, .. } = self.repaired();
        let (part, count) = topology::components(mesh);
        let mut boxes: Vec<Option<BoundingBox>> = vec![None; count];
        for (p, &part) in points.iter().zip(&part) {
            let around = boxes[part as usize].map_or([*p, *p], |b| [b.min.inf(p), b.max.sup(p)]);
            boxes[part as usize] = BoundingBox::of(&around);
        }
        let mut sides = vec![0.0_f64; self.soup.points.len()];
        for (&point, &part) in source.iter().zip(&part) {
            let side = boxes[part as usize].map_or(0.0, |b| b.largest_side());
            sides[point as usize] = sides[point as usize].max(side);
        }
        sides
    }

    /// The progressive mesh that the basis comes from.
    pub fn progressive(&self) -> ProgressiveMesh {
        let Repaired { mesh, points, .. } = self.repaired();
        ProgressiveMesh::new(mesh.clone(), points).expect("repaired points are finite")
    }

    /// [`progressive`](Self::progressive), which takes one thread, while another finds the coupling.
    pub fn converted(&self) -> ProgressiveMesh {
        rayon::join(|| self.progressive(), || self.coupling()).0
    }

    /// The basis over points.
    ///
    /// # Errors
    /// [`BasisError`] when the mesh cannot carry that many coefficients.
    pub fn basis(&self, options: &BasisOptions) -> Result<Basis, BasisError> {
        self.basis_of(self.progressive(), options)
    }

    /// [`basis`](Self::basis), given the model's progressive mesh.
    ///
    /// # Errors
    /// As [`basis`](Self::basis).
    ///
    /// # Panics
    /// When `progressive` is that of a larger model.
    pub fn basis_of(
        &self,
        progressive: ProgressiveMesh,
        options: &BasisOptions,
    ) -> Result<Basis, BasisError> {
        let Repaired { points, source, .. } = self.repaired();
        let basis = Basis::new(progressive, points, options)?.on_points(source, self.soup.points.len());
        Ok(coupled(basis, self.coupling()))
    }

    /// [`basis_of`](Self::basis_of) as marks of strength ε use it: fields are scaled down where they would change walls
    /// and gaps by more than a tenth. The paper's functions stay what they are.
    ///
    /// # Errors
    /// As [`basis`](Self::basis).
    ///
    /// # Panics
    /// As [`basis_of`](Self::basis_of).
    pub fn basis_for(
        &self,
        progressive: ProgressiveMesh,
        options: &BasisOptions,
        epsilon: f64,
    ) -> Result<Basis, BasisError> {
        let basis = self.basis_of(progressive, options)?;
        Ok(self.kept_apart(basis, options, epsilon))
    }

    /// What [`basis_for`](Self::basis_for) makes of a basis over points.
    pub fn kept_apart(&self, basis: Basis, options: &BasisOptions, epsilon: f64) -> Basis {
        if options.function != BasisFunction::Field {
            return basis;
        }
        kept_apart(basis, &self.assembly(), self.coupling(), self.largest_side(), epsilon)
    }

    /// What keeps points together that meet at any of their places, or lie on something.
    pub fn coupling(&self) -> &Coupling {
        self.coupling.get_or_init(|| Coupling::new(&self.assembly()))
    }

    fn assembly(&self) -> Assembly<'_> {
        let Self { soup: Soup { points, triangles }, reach, places, draws_loose, .. } = self;
        Assembly { points, triangles, reach, places, draws_loose: *draws_loose }
    }

    /// Positions of stored vertices from positions of points. A vertex beside its point stays beside it.
    ///
    /// # Panics
    /// When `points` is shorter than the model's points.
    pub fn stored_from_points(&self, points: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut stored: Vec<Point3<f64>> = self.point_of.iter().map(|&p| points[p as usize]).collect();
        for (vertex, position) in &self.beside {
            let point = self.point_of[*vertex as usize] as usize;
            stored[*vertex as usize] = position + (points[point] - self.soup.points[point]);
        }
        stored
    }

    /// Positions of points from those of stored vertices of a file with the same connectivity: the mean of
    /// the vertices that are one point here.
    ///
    /// # Panics
    /// When `stored` is shorter than the model's stored vertices.
    pub fn points_from_stored(&self, stored: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut sums = vec![(nalgebra::Vector3::zeros(), 0.0); self.soup.points.len()];
        for (&point, position) in self.point_of.iter().zip(stored) {
            let (sum, count) = &mut sums[point as usize];
            *sum += position.coords;
            *count += 1.0;
        }
        for (vertex, position) in &self.beside {
            let point = self.point_of[*vertex as usize] as usize;
            sums[point].0 -= position - self.soup.points[point];
        }
        sums.into_iter().map(|(sum, count)| Point3::from(sum / count)).collect()
    }
}

/// The coarsest step of each point's stored vertices.
fn coarsest(weld: &Weld, steps: &[f32]) -> Vec<f32> {
    let mut coarsest = vec![0.0_f32; if steps.is_empty() { 0 } else { weld.points.len() }];
    for (&point, step) in weld.point_of.iter().zip(steps) {
        coarsest[point as usize] = coarsest[point as usize].max(*step);
    }
    coarsest
}

/// The weld whose points are joined once more: for each the first of those that it is one with.
fn rejoined(weld: &Weld, leaders: &[u32]) -> Weld {
    let mut number = vec![0; leaders.len()];
    let mut points = Vec::new();
    for (point, &leader) in leaders.iter().enumerate() {
        if leader as usize == point {
            number[point] = points.len() as u32;
            points.push(weld.points[point]);
        } else {
            // The first of a group comes before all others of it.
            number[point] = number[leader as usize];
        }
    }
    let point_of = weld.point_of.iter().map(|&point| number[point as usize]).collect();
    Weld { points, point_of }
}

/// The stored vertices that do not stand where their point does.
fn beside(weld: &Weld, stored: &[Point3<f64>]) -> Vec<(u32, Point3<f64>)> {
    let beside = |(vertex, position): (u32, &Point3<f64>)| {
        let point = weld.points[weld.point_of[vertex as usize] as usize];
        // One that is not a number is alone.
        (point != *position && position.iter().all(|x| !x.is_nan())).then_some((vertex, *position))
    };
    (0..).zip(stored).filter_map(beside).collect()
}

/// A place of stored vertices as one of points.
fn shown(place: &Place, weld: &Weld) -> Shown {
    let range = place.vertices.start as usize..place.vertices.end as usize;
    let stored = weld.point_of.get(range).unwrap_or_default();
    let mut points = stored.to_vec();
    points.sort_unstable();
    points.dedup();
    Shown { points, linear: place.linear, shift: place.shift }
}
