//! A base mesh and the vertex splits that lead back to the full mesh (the paper, section 3; Hoppe 1996).

use crate::build::{Collapses, collapse_all};
use nalgebra::Point3;
use sombrero_mesh::{Collapse, HalfedgeId, Mesh, Soup, VertexId};
use thiserror::Error;

/// A mesh at any of its levels of detail, between the base (level 0) and the full mesh.
///
/// Every vertex of a coarser level is a vertex of the full mesh, at the same place and with the same
/// index: edges are only ever collapsed into one of their ends. Vertex, halfedge and face indices are
/// those of the full mesh at every level.
#[derive(Debug, Clone)]
pub struct ProgressiveMesh {
    mesh: Mesh,
    /// The full mesh's, in order.
    triangles: Vec<[u32; 3]>,
    /// In the order in which they led to the base; the last `level()` of them are undone at present.
    collapses: Vec<Collapse>,
    /// For each collapse how far the removed vertex stood out.
    heights: Vec<f64>,
    level: usize,
    shape_level: usize,
}

/// A refinement step: it introduces `vertex` as a neighbour of `parent`.
///
/// ```text
///          a                 a
///          |               / | \
///      ..parent..    →   vertex─parent      halfedge: vertex → parent
///          |               \ | /
///          b                 b
/// ```
///
/// On a boundary a or b may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct VertexSplit {
    /// The vertex that the split introduces.
    pub vertex: VertexId,
    /// The vertex that is split; it keeps its place.
    pub parent: VertexId,
    /// From `vertex` to `parent`; part of the mesh at every level above this split.
    pub halfedge: HalfedgeId,
}

impl ProgressiveMesh {
    /// Simplifies `mesh`, whose vertices stand at `points`, down to its base, and stays there (level 0).
    ///
    /// The base is the smallest mesh that restricted edge collapses reach without changing the topology:
    /// for instance four vertices for a sphere, three for a disc. The result depends on the input alone.
    ///
    /// # Errors
    /// [`PointsError`] when a vertex has no point, or one that is not finite. What
    /// [`repair`](sombrero_mesh::repair()) makes has neither fault.
    pub fn new(mut mesh: Mesh, points: &[Point3<f64>]) -> Result<Self, PointsError> {
        check(&mesh, points)?;
        let triangles = mesh.triangles();
        let Collapses { all, heights, faithful } = collapse_all(&mut mesh, points);
        let shape_level = all.len() - faithful;
        Ok(Self { mesh, triangles, collapses: all, heights, level: 0, shape_level })
    }

    /// The connectivity at the present level; indices are those of the full mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The triangles of the full mesh, whatever the present level.
    pub fn full_triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many splits have been applied: 0 at the base, [`split_count`](Self::split_count) at the full mesh.
    pub fn level(&self) -> usize {
        self.level
    }

    /// The coarsest level that still has the shape of the full mesh: on the way down to it no collapse
    /// turned a face by more than 45 degrees. Below it the topology is right but the surface may be
    /// anything, down to a flat double triangle for a sphere.
    pub fn shape_level(&self) -> usize {
        self.shape_level
    }

    /// The same levels, all of them taken for ones that have the shape, as the paper's words have it.
    pub fn faithful_at_every_level(self) -> Self {
        Self { shape_level: 0, ..self }
    }

    /// How many vertex splits lead from the base to the full mesh.
    pub fn split_count(&self) -> usize {
        self.collapses.len()
    }

    /// The `i`-th split in order of refinement; it leads from level `i` to level `i + 1`.
    pub fn split(&self, i: usize) -> Option<VertexSplit> {
        let last = self.collapses.len().checked_sub(1)?;
        let collapse = self.collapses.get(last.checked_sub(i)?)?;
        Some(VertexSplit { vertex: collapse.removed, parent: collapse.kept, halfedge: collapse.halfedge })
    }

    /// How far the vertex of the `i`-th split stands out from its neighbours when it is introduced, in the units of the points:
    /// the height of its [`Magnitude`](crate::Magnitude).
    pub fn height(&self, i: usize) -> Option<f64> {
        let last = self.heights.len().checked_sub(1)?;
        self.heights.get(last.checked_sub(i)?).copied()
    }

    /// Applies the next split; `None` at the full mesh.
    pub fn refine(&mut self) -> Option<VertexSplit> {
        let split = self.split(self.level)?;
        let index = self.collapses.len() - 1 - self.level;
        self.mesh.undo_collapse(&self.collapses[index]);
        self.level += 1;
        Some(split)
    }

    /// Takes back the latest split; `None` at the base.
    pub fn coarsen(&mut self) -> Option<VertexSplit> {
        let level = self.level.checked_sub(1)?;
        let index = self.collapses.len() - 1 - level;
        let halfedge = self.collapses[index].halfedge;
        // What was undone can be done again.
        self.collapses[index] = self.mesh.collapse_allowed(halfedge);
        self.level = level;
        self.split(level)
    }

    /// Refines or coarsens to `level`, or to the full mesh when there are fewer levels.
    pub fn go_to(&mut self, level: usize) {
        while self.level > level {
            self.coarsen();
        }
        while self.level < level && self.refine().is_some() {}
    }

    /// Refines or coarsens to the finest level of at most `faces` faces, or to the base when that has more.
    pub fn go_to_faces(&mut self, faces: usize) {
        while self.mesh.face_count() <= faces && self.refine().is_some() {}
        while self.mesh.face_count() > faces && self.coarsen().is_some() {}
    }

    /// The present level as a mesh without gaps in its numbering.
    pub fn compact(&self) -> CompactMesh {
        let source: Vec<VertexId> = self.mesh.vertices().collect();
        let mut place = vec![0u32; self.mesh.vertex_bound()];
        for (i, v) in (0u32..).zip(&source) {
            place[v.index()] = i;
        }
        let corners = |f| self.mesh.vertices_of_face(f).map(|v| place[v.index()]);
        CompactMesh { triangles: self.mesh.faces().map(corners).collect(), source }
    }

    /// The vertices of the base mesh, in index order, whatever the present level.
    pub fn base_vertices(&self) -> Vec<VertexId> {
        let mut introduced = vec![false; self.mesh.vertex_bound()];
        for collapse in &self.collapses {
            introduced[collapse.removed.index()] = true;
        }
        (0..introduced.len()).filter(|&v| !introduced[v]).map(VertexId::new).collect()
    }
}

/// A level of detail as plain data: its vertices are numbered from 0 without gaps.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct CompactMesh {
    /// Corners of each face as indices into `source`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex the vertex of the full mesh that it is; increasing.
    pub source: Vec<VertexId>,
}

impl CompactMesh {
    /// The level's vertices and faces; `points` are those of the full mesh.
    ///
    /// # Panics
    /// When `points` is shorter than the full mesh's vertices are many.
    pub fn soup(&self, points: &[Point3<f64>]) -> Soup {
        Soup::new(self.source.iter().map(|v| points[v.index()]).collect(), self.triangles.clone())
    }
}

/// Why points are not those of a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PointsError {
    /// A vertex has no point.
    #[error("there are {points} points, but the mesh has vertices up to {}; give a point for each", vertices - 1)]
    TooFew {
        /// How many points there are.
        points: usize,
        /// How many are needed.
        vertices: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("{vertex:?} has a coordinate that is not finite; leave out its faces, as `repair` does")]
    NotFinite {
        /// The vertex.
        vertex: VertexId,
    },
}

/// A finite point for each vertex.
fn check(mesh: &Mesh, points: &[Point3<f64>]) -> Result<(), PointsError> {
    let vertices = mesh.vertex_bound();
    if points.len() < vertices {
        return Err(PointsError::TooFew { points: points.len(), vertices });
    }
    let finite = |p: &Point3<f64>| p.iter().all(|c| c.is_finite());
    match points[..vertices].iter().position(|p| !finite(p)) {
        Some(v) => Err(PointsError::NotFinite { vertex: VertexId::new(v) }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sombrero_mesh::{repair, topology};
    use sombrero_shapes as shapes;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn any_way_through_the_levels_ends_at_the_same_mesh(
            which in 0usize..4, way in prop::collection::vec(0usize..200, 1..8)
        ) {
            let soup = [shapes::sphere(2), shapes::torus(12, 8, 1.0, 0.4), shapes::genus(2, 1), shapes::open_sheet(8, 8)]
                [which].clone();
            let made = repair(&soup);
            let mut progressive = ProgressiveMesh::new(made.mesh.clone(), &made.points).unwrap();
            let base = progressive.mesh().clone();
            for level in way {
                progressive.go_to(level);
                prop_assert_eq!(progressive.mesh().validate(), Ok(()));
                prop_assert_eq!(progressive.mesh().vertex_count(), base.vertex_count() + progressive.level());
                prop_assert_eq!(topology::genus(progressive.mesh()), topology::genus(&made.mesh));
            }
            progressive.go_to(usize::MAX);
            prop_assert_eq!(progressive.mesh(), &made.mesh, "all splits give the mesh back");
            progressive.go_to(0);
            prop_assert_eq!(progressive.mesh(), &base, "and all collapses the base");
        }
    }

    #[test]
    fn heights_are_those_of_the_levels() {
        for soup in [shapes::bumpy_sphere(300), shapes::open_sheet(8, 8)] {
            let made = repair(&soup);
            let mut progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
            while let Some(split) = progressive.refine() {
                let height = progressive.height(progressive.level() - 1).unwrap();
                let expected = crate::magnitude(progressive.mesh(), &made.points, split.vertex).height;
                assert_eq!(height.to_bits(), expected.to_bits());
            }
            assert_eq!(progressive.height(progressive.split_count()), None);
        }
    }

    #[test]
    fn a_sphere_ends_as_a_tetrahedron_and_a_disc_as_a_triangle() {
        for (soup, smallest) in [(shapes::sphere(2), 4), (shapes::open_sheet(8, 8), 3)] {
            let made = repair(&soup);
            let progressive = ProgressiveMesh::new(made.mesh, &made.points).unwrap();
            assert_eq!(progressive.base_vertices().len(), smallest);
            assert_eq!(progressive.split_count() + smallest, made.points.len());
        }
    }

    #[test]
    fn a_number_of_faces_is_a_level_and_a_mesh_by_itself() {
        for soup in [shapes::sphere(3), shapes::open_sheet(20, 20)] {
            let made = repair(&soup);
            let mut progressive = ProgressiveMesh::new(made.mesh.clone(), &made.points).unwrap();
            for wanted in [500, 100, 499, 0, usize::MAX] {
                progressive.go_to_faces(wanted);
                let count = progressive.mesh().face_count();
                let next = progressive.refine().map(|_| progressive.mesh().face_count());
                if next.is_some() {
                    progressive.coarsen();
                }
                assert!(count <= wanted || progressive.level() == 0);
                assert!(next.is_none_or(|next| next > wanted), "the finest");
                let compact = progressive.compact();
                let level = repair(&compact.soup(&made.points));
                assert!(level.report.is_clean() && level.report.unused_vertices == 0);
                assert_eq!(level.mesh.face_count(), count);
                assert_eq!(topology::genus(&level.mesh), topology::genus(&made.mesh));
                assert!(compact.source.is_sorted());
            }
        }
    }

    #[test]
    fn points_that_are_missing_or_not_finite_are_refused() {
        let made = repair(&shapes::sphere(1));
        let mut points = made.points.clone();
        points[7].y = f64::NAN;
        let refused = |points: &[Point3<f64>]| ProgressiveMesh::new(made.mesh.clone(), points).unwrap_err();
        assert_eq!(refused(&points), PointsError::NotFinite { vertex: VertexId::new(7) });
        let few = PointsError::TooFew { points: 41, vertices: 42 };
        assert_eq!(refused(&made.points[..41]), few);
    }

    #[test]
    fn thousands_of_neighbours_are_no_trouble() {
        // A disc capped by fans, as programs for mechanical parts write it: cubic time would take half a minute here.
        let rim = 4000_u32;
        let mut points: Vec<Point3<f64>> = (0..rim)
            .map(|i| (f64::from(i) / f64::from(rim) * std::f64::consts::TAU).sin_cos())
            .map(|(y, x)| Point3::new(x, y, 0.0))
            .collect();
        points.extend([Point3::new(0.0, 0.0, 0.2), Point3::new(0.0, 0.0, -0.2)]);
        let fans = (0..rim).flat_map(|i| [[i, (i + 1) % rim, rim], [(i + 1) % rim, i, rim + 1]]);
        let mesh = Mesh::from_triangles(points.len(), &fans.collect::<Vec<_>>()).unwrap();
        let progressive = ProgressiveMesh::new(mesh, &points).unwrap();
        assert_eq!(progressive.split_count(), points.len() - 4);
    }
}
