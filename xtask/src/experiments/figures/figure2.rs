//! Figure 2: where basis functions come from, on the head.
//!
//! | | | |
//! |---|---|---|
//! | (a) the mesh right after a vertex split; red: the new vertex's ring | (b), (c) the ring tracked through later splits |
//! | (d) the full mesh and the boundary of the support | (e) the supports of all 50 functions, coarse to fine | (f) the sombrero on that support, 200 times exaggerated |

use super::{Exhibit, GAP, WHITE, picture, tubes, wireframe};
use nalgebra::Point3;
use sombrero::mesh::{HalfedgeId, Soup, VertexId};
use sombrero::progressive::ProgressiveMesh;
use sombrero::render::{ColorMap, HeatMap, Image, RenderOptions, Shading};
use std::path::Path;

/// As in the paper.
const EXAGGERATION: f64 = 200.0;

pub(super) fn draw(folder: &Path) -> anyhow::Result<Image> {
    let head = Exhibit::read(folder, "head")?;
    let options =
        RenderOptions { width: 380, height: 440, camera: Some(head.camera()), ..RenderOptions::default() };
    let shown = shown_function(&head);
    let mut pictures = levels(&head, shown, &options);
    pictures.push(supports(&head, &options));
    pictures.push(sombrero(&head, shown, &options));
    Ok(Image::grid(&pictures, 3, GAP, WHITE))
}

/// The function of largest support among those inside the surface that face the viewer and are not all over it.
fn shown_function(head: &Exhibit) -> usize {
    let (basis, mesh) = (head.case.detector.basis(), &head.case.detector.model().repaired().mesh);
    let toward_eye = -head.direction.normalize();
    let size = |i: usize| basis.values().col(i).nnz();
    let suits = |&i: &usize| {
        let function = &basis.functions()[i];
        let facing = function.direction.dot(&toward_eye) > 0.6;
        facing && !mesh.is_boundary_vertex(function.centre) && size(i) < basis.vertex_count() / 16
    };
    (0..basis.functions().len()).filter(suits).max_by_key(|&i| size(i)).unwrap_or(0)
}

/// (a) to (d).
fn levels(head: &Exhibit, shown: usize, options: &RenderOptions) -> Vec<Image> {
    let repaired = head.case.detector.model().repaired();
    let mut mesh =
        ProgressiveMesh::new(repaired.mesh.clone(), &repaired.points).expect("repaired points are finite");
    let (first, last) = (head.case.detector.basis().functions()[shown].split + 1, mesh.split_count());
    mesh.go_to(first);
    let centre = mesh.split(first - 1).map_or(VertexId::new(0), |split| split.vertex);
    let mut ring = ring(&mesh, centre);
    // Vertices grow by the same factor from picture to picture.
    let ratio = (last as f64 / first as f64).cbrt();
    let stops = [first, (first as f64 * ratio) as usize, (first as f64 * ratio * ratio) as usize, last];
    let draw = |stop: usize| {
        while mesh.level() < stop && refine(&mut mesh, &mut ring) {}
        let soup = Soup::new(repaired.points.clone(), mesh.mesh().triangles());
        let line: Vec<Point3<f64>> =
            ring.iter().map(|&h| repaired.points[mesh.mesh().tail(h).index()]).collect();
        with_line(soup, &line, head.case.detector.model().largest_side(), options)
    };
    stops.into_iter().map(draw).collect()
}

/// The edges around a vertex, as a closed line.
fn ring(mesh: &ProgressiveMesh, centre: VertexId) -> Vec<HalfedgeId> {
    let mesh = mesh.mesh();
    mesh.outgoing_halfedges(centre).filter(|&h| mesh.face(h).is_some()).map(|h| mesh.next(h)).collect()
}

/// One vertex split; where edges of the line no longer meet, the new edge joins them.
fn refine(mesh: &mut ProgressiveMesh, line: &mut Vec<HalfedgeId>) -> bool {
    let Some(split) = mesh.refine() else { return false };
    let mesh = mesh.mesh();
    let mut mended = Vec::with_capacity(line.len() + 1);
    for (&h, &next) in line.iter().zip(line.iter().cycle().skip(1)) {
        mended.push(h);
        let gap = (mesh.tip(h), mesh.tail(next));
        if gap == (split.vertex, split.parent) {
            mended.push(split.halfedge);
        } else if gap == (split.parent, split.vertex) {
            mended.push(split.halfedge.twin());
        }
    }
    *line = mended;
    true
}

/// A wireframe with a red line on it.
fn with_line(mut soup: Soup, line: &[Point3<f64>], side: f64, options: &RenderOptions) -> Image {
    let clay = soup.points.len();
    tubes::add_loop(&mut soup, line, 0.005 * side);
    let values = (0..soup.points.len()).map(|v| if v < clay { f64::NAN } else { 1.0 }).collect();
    let heat =
        HeatMap { range: Some((0.0, 1.0)), colors: ColorMap::CoolWarm, bar: false, ..HeatMap::new(values) };
    let options = RenderOptions {
        shading: Shading::Flat,
        wireframe: wireframe(),
        heat_map: Some(heat),
        ..options.clone()
    };
    picture(&soup, &options)
}

/// (e): each face in the colour of the finest function that covers it.
fn supports(head: &Exhibit, options: &RenderOptions) -> Image {
    let (basis, original) = (head.case.detector.basis(), head.original());
    let mut order: Vec<usize> = (0..basis.functions().len()).collect();
    order.sort_by_key(|&i| basis.functions()[i].split);
    let mut color = vec![f64::NAN; original.points.len()];
    for i in order {
        // Neighbours in the order are far apart in colour.
        let shade = (0.618_034 * i as f64).fract();
        basis.values().col(i).row_indices().iter().for_each(|&v| color[v] = shade);
    }
    let (mut soup, mut values) = (Soup::new(Vec::new(), Vec::new()), Vec::new());
    for corners in &original.triangles {
        let first = soup.points.len() as u32;
        soup.points.extend(corners.map(|v| original.points[v as usize]));
        soup.triangles.push([first, first + 1, first + 2]);
        values.extend([color[corners[0] as usize]; 3]);
    }
    let heat = HeatMap { range: Some((0.0, 1.0)), bar: false, ..HeatMap::new(values) };
    picture(&soup, &RenderOptions { shading: Shading::Flat, heat_map: Some(heat), ..options.clone() })
}

/// (f).
fn sombrero(head: &Exhibit, shown: usize, options: &RenderOptions) -> Image {
    let basis = head.case.detector.basis();
    let mut w = vec![0.0; basis.functions().len()];
    // Outward, whatever the sign of the height.
    w[shown] = basis.functions()[shown].height.signum();
    let moved = basis.displacements(&w, EXAGGERATION * head.case.parameters.epsilon);
    let points = head.original().points.iter().zip(moved).map(|(p, d)| p + d).collect();
    picture(&Soup::new(points, head.original().triangles.clone()), options)
}
