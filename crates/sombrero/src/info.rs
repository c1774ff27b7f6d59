//! An account of a mesh file, and whether it can be marked.

use serde::Serialize;
use sombrero_basis::{Basis, BasisOptions};
use sombrero_io::Document;
use sombrero_mesh::repair::{Repaired, Report};
use sombrero_mesh::{PlanarRegions, geometry, topology};
use sombrero_progressive::ProgressiveMesh;
use sombrero_search::Model;
use sombrero_watermark::{COEFFICIENTS, Preset};

/// Counts, topology, size and attributes of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Info {
    /// The file format.
    pub format: String,
    /// Vertices as stored.
    pub vertices: usize,
    /// Distinct positions: what the method counts as points.
    pub points: usize,
    /// Triangles, polygons split and instances expanded.
    pub triangles: usize,
    /// Connected components, non-manifold places cut.
    pub components: usize,
    /// Boundary loops.
    pub boundary_loops: usize,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Edges with more than two faces.
    pub nonmanifold_edges: usize,
    /// Points whose faces are not a single fan.
    pub nonmanifold_vertices: usize,
    /// Faces with a corner twice, or without area.
    pub degenerate_faces: usize,
    /// Faces that repeat the corners of another one.
    pub doubled_faces: usize,
    /// Faces oriented against their neighbours.
    pub flipped_faces: usize,
    /// Stored vertices that no face uses.
    pub unused_vertices: usize,
    /// Genus of a closed, manifold mesh of one component; else `None`.
    pub genus: Option<usize>,
    /// The box around the vertices that have a face; `None` without a face.
    pub bounding_box: Option<Corners>,
    /// The unit of lengths, where the file has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Surface area in squared model units; `None` when it is too large for a number.
    pub area: Option<f64>,
    /// Enclosed volume in cubed model units, negative when the faces look inwards; `None` for an open mesh
    /// or beyond all numbers.
    pub volume: Option<f64>,
    /// Names of what the file holds beside positions and faces.
    pub attributes: Vec<String>,
    /// Whether the mesh can carry the usual number of coefficients.
    pub markable: bool,
    /// The largest number of coefficients that it can carry.
    pub capacity: usize,
    /// Planar regions: flats of a machined part, which the preset faithful keeps planar.
    pub planar_regions: usize,
    /// The share of the area that is planar.
    pub planar_share: f64,
    /// What is unusual, in sentences.
    pub warnings: Vec<String>,
}

/// An axis-aligned box, in model units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Corners {
    /// Smallest x, y, z.
    pub min: [f64; 3],
    /// Largest x, y, z.
    pub max: [f64; 3],
}

/// Looks at a file; never fails.
pub fn info(document: &Document) -> Info {
    let soup = document.soup();
    let model = Model::new(soup);
    let Repaired { mesh, points, report, .. } = model.repaired();
    let (_, components) = topology::components(mesh);
    let boundary_edges = mesh.edges().filter(|&e| mesh.is_boundary_edge(e)).count();
    let closed = boundary_edges == 0 && mesh.face_count() > 0;
    let capacity = capacity(model.repaired());
    let usual = BasisOptions::default().coefficients;
    let mut warnings = document.notes().to_vec();
    warnings.extend(repair_notes(report));
    if mesh.face_count() == 0 {
        warnings
            .push("The mesh cannot be marked: it has no usable face, and a mark needs a surface.".to_owned());
    } else if capacity < usual {
        warnings.push(too_small(capacity, usual));
    } else if points.len() <= SMALL && !moves_unseen(&model) {
        let note = "Nothing of this mesh moves without being seen: it has few vertices, or large flats of few triangles. \
                    A mark needs a finer mesh, or `--preset robust`, which is seen.";
        warnings.push(note.to_owned());
    }
    warnings.extend(document.fixed().map(str::to_owned));
    let volume = closed.then(|| geometry::volume(mesh, points)).filter(|v| v.is_finite());
    let area = Some(geometry::area(mesh, points)).filter(|a| a.is_finite());
    if area.is_none_or(|a| a < f64::MIN_POSITIVE && mesh.face_count() > 0) {
        warnings.push(
            "The coordinates are too large or too small to compute with; bring the model to ordinary units."
                .to_owned(),
        );
    }
    if volume.is_some_and(|v| v < 0.0) {
        warnings.push("The faces look inwards. This does not matter to a mark.".to_owned());
    }
    let planar = PlanarRegions::find(points, &mesh.triangles(), model.largest_side());
    let corners = |b: sombrero_mesh::BoundingBox| Corners { min: b.min.into(), max: b.max.into() };
    Info {
        format: document.format().to_string(),
        vertices: soup.points.len(),
        points: model.soup().points.len(),
        triangles: usize::try_from(document.triangles_with_instances()).unwrap_or(usize::MAX),
        components,
        boundary_loops: topology::boundary_loops(mesh).len(),
        boundary_edges,
        nonmanifold_edges: report.nonmanifold_edges,
        nonmanifold_vertices: report.nonmanifold_vertices,
        degenerate_faces: report.degenerate_faces + report.zero_area_faces,
        doubled_faces: report.doubled_faces,
        flipped_faces: report.flipped_faces,
        unused_vertices: soup.used().iter().filter(|used| !**used).count(),
        genus: if closed && report.is_clean() { topology::genus(mesh) } else { None },
        bounding_box: model.bounding_box().map(corners),
        unit: document.unit().map(str::to_owned),
        area,
        volume,
        attributes: document.attributes().to_vec(),
        markable: capacity >= *COEFFICIENTS.start() && document.fixed().is_none(),
        capacity,
        planar_regions: planar.normals.len(),
        planar_share: planar.share,
        warnings,
    }
}

/// Meshes with more vertices have displacements that are not seen.
const SMALL: usize = 2000;

/// Whether the preset faithful finds enough to mark.
fn moves_unseen(model: &Model) -> bool {
    let found = model.basis(&Preset::Faithful.parameters().basis);
    found.is_ok_and(|basis| basis.functions().len() >= *COEFFICIENTS.start())
}

fn capacity(repaired: &Repaired) -> usize {
    let progressive =
        ProgressiveMesh::new(repaired.mesh.clone(), &repaired.points).expect("repaired points are finite");
    Basis::capacity(&progressive, &repaired.points)
}

fn too_small(capacity: usize, usual: usize) -> String {
    let least = COEFFICIENTS.start();
    if capacity < *least {
        return format!(
            "The mesh cannot be marked: it can carry {capacity} coefficients, and {least} are the least that prove \
             something. It has too few vertices or no relief."
        );
    }
    format!(
        "The mesh is small: it can carry {capacity} coefficients, which `embed` takes; fewer than {usual} prove \
         little after an attack."
    )
}

/// The mends that gave a manifold, one sentence each. The file itself keeps all of it.
pub(crate) fn repair_notes(report: &Report) -> Vec<String> {
    let notes = [
        (report.out_of_range_faces, "faces with a corner that does not exist are passed over"),
        (report.non_finite_faces, "faces with a corner that is not finite are passed over"),
        (report.degenerate_faces, "faces that have a corner twice are passed over"),
        (report.doubled_faces, "faces that repeat another one are passed over"),
        (report.zero_area_faces, "faces have no area"),
        (report.flipped_faces, "faces are oriented against their neighbours and are turned for the method"),
        (report.nonmanifold_edges, "edges have more than two faces; the surface is cut there for the method"),
        (report.unorientable_edges, "edges lie on a one-sided surface, which is cut there for the method"),
        (
            report.nonmanifold_vertices,
            "vertices join several fans of faces, which are told apart for the method",
        ),
    ];
    notes.iter().filter(|(count, _)| *count > 0).map(|(count, note)| format!("{count} {note}.")).collect()
}
