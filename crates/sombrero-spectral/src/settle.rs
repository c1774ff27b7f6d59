//! Carried vertices settle where they are seen least.
//!
//! What the vertex splits carry is a mean of what is around, which triangles as thin as those of machined parts show as edges.
//! So on such parts every field minimises what is seen of it, d'G d, over the vertices that the level does not have, while
//! those of the level and all planes stay where they are. One vertex at a time (Gauss and Seidel),
//!
//! ```text
//! d_v = p_v + T y,      (Tᵀ K_vv T) y = -Tᵀ (K_vv p_v + Σ_w K_vw d_w),      K = Σ_terms g gᵀ,
//! ```
//!
//! with p_v what the planes ask for and T what they leave free.

use crate::Field;
use crate::planes::Planes;
use crate::surface::Surface;
use crate::together::add_up;
use crate::visibility::{Term, face_terms, hinge_term};
use crate::walls::Keeping;
use nalgebra::{Matrix3, Matrix3xX, Vector3};
use rayon::prelude::*;

/// Rounds over all vertices. What is carried is rough over a few edges, and so many rounds smooth that.
const ROUNDS: usize = 24;
/// Against rounding, in K_vv.
const RIDGE: f64 = 1e-9;

/// The fields, settled. `stays` says which vertices do.
pub(crate) fn settled(
    surface: &Surface,
    planes: &Planes,
    keeping: &Keeping,
    stays: &[bool],
    mut fields: Vec<Field>,
) -> Vec<Field> {
    let rows = Stiffness::new(surface, planes, keeping, stays).rows(planes);
    let settle = |values: &mut Vec<Vector3<f64>>, field: &mut Field| {
        field.iter().for_each(|(v, d)| values[*v as usize] = *d);
        let moving: Vec<(u32, &Row)> =
            field.iter().filter_map(|(v, _)| Some((*v, rows[*v as usize].as_ref()?))).collect();
        for _ in 0..ROUNDS {
            moving.iter().for_each(|(v, row)| values[*v as usize] = row.settled(*v, values));
        }
        field.iter_mut().for_each(|(v, d)| *d = std::mem::take(&mut values[*v as usize]));
    };
    fields.par_iter_mut().for_each_init(|| vec![Vector3::zeros(); stays.len()], settle);
    fields
}

/// What a vertex's displacement follows from.
struct Row {
    /// (1 - T (TᵀK_vvT)⁻¹ Tᵀ K_vv) (1 - T Tᵀ), on its own: what the planes ask for, and what follows of it.
    own: Matrix3<f64>,
    /// -T (TᵀK_vvT)⁻¹ Tᵀ K_vw.
    others: Vec<(u32, Matrix3<f64>)>,
}

impl Row {
    /// `blocks` are K_vw of all w, v among them. `None` where nothing is free.
    fn new(v: u32, mut blocks: Vec<(u32, Matrix3<f64>)>, tangents: &[Vector3<f64>]) -> Option<Self> {
        let place = blocks.iter().position(|(w, _)| *w == v)?;
        let (_, diagonal) = blocks.remove(place);
        let free = Matrix3xX::from_columns(tangents);
        let mut stiffness = free.transpose() * diagonal * &free;
        let ridge = RIDGE * stiffness.trace();
        (0..tangents.len()).for_each(|k| stiffness[(k, k)] += ridge);
        let inverse = stiffness.cholesky()?.inverse();
        let answer: Matrix3<f64> = (&free * inverse * free.transpose()).fixed_columns::<3>(0).into_owned();
        let along: Matrix3<f64> = (&free * free.transpose()).fixed_columns::<3>(0).into_owned();
        let own = (Matrix3::identity() - answer * diagonal) * (Matrix3::identity() - along);
        Some(Self { own, others: blocks.into_iter().map(|(w, block)| (w, -answer * block)).collect() })
    }

    fn settled(&self, v: u32, values: &[Vector3<f64>]) -> Vector3<f64> {
        let own = self.own * values[v as usize];
        self.others.iter().fold(own, |sum, (w, map)| sum + map * values[*w as usize])
    }
}

/// K of a surface, made vertex by vertex: all terms at once would take more memory than the fields.
struct Stiffness<'a> {
    surface: &'a Surface,
    keeping: &'a Keeping,
    areas: Vec<f64>,
    /// Faces and hinges of each vertex that moves.
    faces: Vec<Vec<u32>>,
    hinges: Vec<Vec<u32>>,
}

impl<'a> Stiffness<'a> {
    fn new(surface: &'a Surface, planes: &Planes, keeping: &'a Keeping, stays: &[bool]) -> Self {
        // A vertex with planes alone around it shows nothing by where it is in them.
        let mut moves = vec![false; stays.len()];
        for (corners, region) in surface.triangles.iter().zip(planes.of_face()) {
            if region.is_none() {
                corners.iter().for_each(|&v| moves[v as usize] = !stays[v as usize]);
            }
        }
        let [mut faces, mut hinges] = [(); 2].map(|()| vec![Vec::new(); stays.len()]);
        let add = |to: &mut Vec<Vec<u32>>, number: u32, vertices: &[u32]| {
            vertices.iter().filter(|v| moves[**v as usize]).for_each(|&v| to[v as usize].push(number));
        };
        (0..).zip(&surface.triangles).for_each(|(f, corners)| add(&mut faces, f, corners));
        for (number, hinge) in (0..).zip(&surface.hinges) {
            add(&mut hinges, number, &hinge.ends);
            add(&mut hinges, number, &hinge.opposite);
        }
        Self { surface, keeping, areas: surface.vertex_areas(), faces, hinges }
    }

    fn rows(&self, planes: &Planes) -> Vec<Option<Row>> {
        let vertices = (0..self.faces.len() as u32).into_par_iter();
        let row = |v: u32| Row::new(v, self.blocks(v), planes.tangents(v));
        vertices.map(|v| (!self.faces[v as usize].is_empty()).then(|| row(v)).flatten()).collect()
    }

    /// K_vw of all w, by w.
    fn blocks(&self, v: u32) -> Vec<(u32, Matrix3<f64>)> {
        let mut blocks: Vec<(u32, Matrix3<f64>)> = Vec::new();
        let mut add = |term: Term| {
            let all = || term.vertices.iter().zip(&term.gradients).take(term.count);
            let own: Vector3<f64> = all().filter(|(w, _)| **w == v).map(|(_, g)| g).sum();
            blocks.extend(all().map(|(w, g)| (*w, own * g.transpose())));
        };
        for &face in &self.faces[v as usize] {
            face_terms(self.surface, face as usize).into_iter().for_each(&mut add);
            self.keeping.carried(self.surface, face as usize, &self.areas).for_each(&mut add);
        }
        let hinges = self.hinges[v as usize].iter().map(|&h| &self.surface.hinges[h as usize]);
        hinges.filter_map(|hinge| hinge_term(self.surface, hinge)).for_each(add);
        // Stable, so that what is added up stays in order.
        blocks.sort_by_key(|block| block.0);
        add_up(&mut blocks);
        blocks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::value;
    use nalgebra::Point3;
    use sombrero_shapes as shapes;

    /// A round bar of two rings, whose facets each are two triangles.
    fn bar(sides: u32) -> Surface {
        let ring = |z: f64| {
            (0..sides).map(move |k| {
                let (sine, cosine) = (std::f64::consts::TAU * f64::from(k) / f64::from(sides)).sin_cos();
                Point3::new(cosine, sine, z)
            })
        };
        let next = |k: u32| (k + 1) % sides;
        let facet = |k| [[k, next(k), sides + k], [next(k), sides + next(k), sides + k]];
        Surface::new(ring(0.0).chain(ring(3.0)).collect(), (0..sides).flat_map(facet).collect())
    }

    #[test]
    fn a_vertex_that_was_left_behind_comes_along_and_facets_stay_flat() {
        // Facets below a hundredth of the area are no planar regions.
        let bar = bar(120);
        let planes = Planes::find(&bar);
        let along = |v: usize| Vector3::new(0.01 * (1.0 + 0.3 * bar.points[v].x), 0.0, 0.0);
        let stays: Vec<bool> = (0..bar.points.len()).map(|v| v % 3 != 0).collect();
        let late = |v: usize| if stays[v] { 1.0 } else { 0.7 };
        let before: Field = (0..bar.points.len()).map(|v| (v as u32, along(v) * late(v))).collect();
        let bent = |field: &Field| {
            let d: Vec<Vector3<f64>> = field.iter().map(|(_, d)| *d).collect();
            let terms = bar.hinges.iter().filter_map(|hinge| hinge_term(&bar, hinge));
            terms.map(|term| value(&term, &d).powi(2)).sum::<f64>()
        };
        let keeping = Keeping::new(&bar, 0.0038, 0.00038);
        let after = settled(&bar, &planes, &keeping, &stays, vec![before.clone()]).remove(0);
        assert!(bent(&after) < 0.01 * bent(&before), "{} of {}", bent(&after), bent(&before));
        for (v, (after, before)) in after.iter().zip(&before).enumerate() {
            assert!(!stays[v] || after == before);
        }
    }

    #[test]
    fn planes_stay_planes() {
        let part = shapes::part(3);
        let part = Surface::new(part.points, part.triangles);
        let planes = Planes::find(&part);
        let rough = |v: u32| Vector3::new(f64::from(v).sin(), f64::from(7 * v).cos(), 0.3);
        let free = |v: u32| planes.tangents(v).iter().map(|t| t * t.dot(&rough(v)) * 0.01).sum();
        let field: Field = (0..part.points.len() as u32).map(|v| (v, free(v))).collect();
        let stays = vec![false; field.len()];
        let keeping = Keeping::new(&part, 0.0038, 0.00038);
        let settled = settled(&part, &planes, &keeping, &stays, vec![field]).remove(0);
        let moved: Vec<Point3<f64>> = part.points.iter().zip(&settled).map(|(p, (_, d))| p + d).collect();
        assert!(planes.bent(&part, &moved) < 1e-12);
    }
}
