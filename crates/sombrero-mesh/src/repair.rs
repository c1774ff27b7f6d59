//! Makes a manifold mesh of any triangle soup, and says exactly what it did.
//!
//! Nothing is moved and no usable face is lost. In order:
//!
//! 1. Faces with a corner out of range, without a finite position, or twice, are left out; of faces with
//!    the same three corners the first is kept. (Faces of zero area with three corners stay: without them
//!    the surface would fall apart.)
//! 2. Two faces at an edge are glued. Where more meet, faces of the same sheet (joined elsewhere through
//!    ordinary edges) and of opposite direction are paired in face order; the rest stay unglued.
//! 3. Orientation is spread over glued edges; the majority of a sheet turns the others. Where this
//!    contradicts itself (a Möbius band) the edge is unglued.
//! 4. Each fan of glued faces around a vertex becomes a vertex of its own: a copy.
//! 5. If two edges still join the same two copies, a face beside the later one is unglued all around,
//!    until none do. Every step unglues a face, and single triangles are a manifold, so it ends.

use crate::sides::{Sides, ends};
use crate::{Mesh, Soup};
use nalgebra::Point3;

/// A manifold mesh made of a soup.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Repaired {
    /// The connectivity. Vertices keep the order of the input; copies of one vertex follow each other.
    pub mesh: Mesh,
    /// Positions of the mesh's vertices.
    pub points: Vec<Point3<f64>>,
    /// For each mesh vertex the input vertex that it is a copy of; never decreasing.
    pub source: Vec<u32>,
    /// For each mesh face the input face that it is; increasing.
    pub face_source: Vec<u32>,
    /// What was done.
    pub report: Report,
}

impl Repaired {
    /// The mesh vertices that are copies of input vertex `v`: a range of indices, empty when `v` is unused.
    pub fn copies(&self, v: u32) -> std::ops::Range<usize> {
        self.source.partition_point(|&s| s < v)..self.source.partition_point(|&s| s <= v)
    }
}

/// What [`repair`] found and did; all zero for a clean mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Report {
    /// Faces left out because a corner index is out of range.
    pub out_of_range_faces: usize,
    /// Faces left out because a corner's position is not finite.
    pub non_finite_faces: usize,
    /// Faces left out because they have a corner twice.
    pub degenerate_faces: usize,
    /// Faces left out because an earlier face has the same three corners.
    pub doubled_faces: usize,
    /// Faces of zero area that were kept.
    pub zero_area_faces: usize,
    /// Faces turned around to agree with the rest of their sheet.
    pub flipped_faces: usize,
    /// Edges where more than two faces met.
    pub nonmanifold_edges: usize,
    /// Edges cut open because no orientation agrees across them.
    pub unorientable_edges: usize,
    /// Vertices that became more than one.
    pub nonmanifold_vertices: usize,
    /// How many vertices that added.
    pub added_vertices: usize,
    /// Input vertices that no kept face uses.
    pub unused_vertices: usize,
    /// Faces cut loose all around, because two edges would have joined the same vertices.
    pub detached_faces: usize,
}

impl Report {
    /// Whether the input was a manifold already: nothing left out, turned, cut or copied.
    /// Unused vertices and faces of zero area do not count.
    pub fn is_clean(&self) -> bool {
        Self { unused_vertices: 0, zero_area_faces: 0, ..*self } == Self::default()
    }
}

/// Makes a manifold mesh of `soup`. Never fails; a soup without a usable face gives a mesh without faces.
///
/// Time is O(n log n).
pub fn repair(soup: &Soup) -> Repaired {
    let mut report = Report::default();
    let (mut triangles, face_source) = usable_faces(soup, &mut report);
    let sides = Sides::group(soup.points.len(), &triangles);
    let mut gluing = Gluing::new(&triangles, &sides, &mut report);
    gluing.orient(&mut triangles, &mut report);
    let copy_of_corner = gluing.separate(&triangles, &sides, &mut report);

    let (source, corners) = number_copies(soup.points.len(), &triangles, &copy_of_corner, &mut report);
    let points: Vec<_> = source.iter().map(|&v| soup.points[v as usize]).collect();
    let mesh = Mesh::from_triangles(points.len(), &corners)
        .expect("faces glued in pairs, oriented and without repeated edges are a manifold");
    Repaired { mesh, points, source, face_source, report }
}

/// Step 1: the faces that can be used, and which input faces they are.
fn usable_faces(soup: &Soup, report: &mut Report) -> (Vec<[u32; 3]>, Vec<u32>) {
    let (mut triangles, mut face_source) = (Vec::new(), Vec::new());
    for (f, &corners) in soup.triangles.iter().enumerate() {
        let [a, b, c] = corners;
        let points = corners.map(|v| soup.points.get(v as usize));
        let [Some(p), Some(q), Some(r)] = points else {
            report.out_of_range_faces += 1;
            continue;
        };
        if [p, q, r].iter().any(|p| p.coords.iter().any(|x| !x.is_finite())) {
            report.non_finite_faces += 1;
        } else if a == b || b == c || c == a {
            report.degenerate_faces += 1;
        } else {
            report.zero_area_faces += usize::from(crate::geometry::area_vector(p, q, r).norm() == 0.0);
            triangles.push(corners);
            face_source.push(f as u32);
        }
    }
    let doubled = Sides::group(soup.points.len(), &triangles).doubled_faces(&triangles);
    report.doubled_faces = doubled.iter().filter(|&&d| d).count();
    if report.doubled_faces > 0 {
        let mut keep = doubled.iter().map(|d| !d);
        triangles.retain(|_| keep.next().unwrap_or(true));
        let mut keep = doubled.iter().map(|d| !d);
        face_source.retain(|_| keep.next().unwrap_or(true));
    }
    (triangles, face_source)
}

const LOOSE: u32 = u32::MAX;

/// Which side is glued to which.
struct Gluing {
    /// For each side its partner, or `LOOSE`.
    mate: Vec<u32>,
}

impl Gluing {
    /// Step 2.
    fn new(triangles: &[[u32; 3]], sides: &Sides, report: &mut Report) -> Self {
        let mut gluing = Self { mate: vec![LOOSE; 3 * triangles.len()] };
        for group in sides.groups() {
            if let &[a, b] = group {
                gluing.glue(a, b);
            }
        }
        report.nonmanifold_edges = sides.groups().filter(|g| g.len() > 2).count();
        if report.nonmanifold_edges > 0 {
            let mut sheets = Sets::new(triangles.len());
            for (side, &mate) in gluing.mate.iter().enumerate().filter(|(_, mate)| **mate != LOOSE) {
                sheets.unite(side / 3, mate as usize / 3);
            }
            for group in sides.groups().filter(|g| g.len() > 2) {
                gluing.pair_within_sheets(triangles, group, &mut sheets);
            }
        }
        gluing
    }

    fn pair_within_sheets(&mut self, triangles: &[[u32; 3]], group: &[u32], sheets: &mut Sets) {
        // Sides that a partner could come from, by sheet and direction: earlier ones wait for later ones.
        let mut waiting: Vec<(usize, bool, u32)> = Vec::new();
        for &side in group {
            let (tail, tip) = ends(triangles, side as usize);
            let (sheet, forward) = (sheets.root(side as usize / 3), tail < tip);
            match waiting.iter().position(|w| w.0 == sheet && w.1 != forward) {
                Some(i) => {
                    let partner = waiting.remove(i).2;
                    self.glue(partner, side);
                }
                None => waiting.push((sheet, forward, side)),
            }
        }
    }

    fn glue(&mut self, a: u32, b: u32) {
        self.mate[a as usize] = b;
        self.mate[b as usize] = a;
    }

    fn unglue(&mut self, side: usize) -> bool {
        let mate = std::mem::replace(&mut self.mate[side], LOOSE);
        if mate != LOOSE {
            self.mate[mate as usize] = LOOSE;
        }
        mate != LOOSE
    }

    /// Step 3: turns faces so that glued sides run in opposite directions.
    ///
    /// Side numbers stay those of the given triangles until the end, when corners of turned faces swap.
    fn orient(&mut self, triangles: &mut [[u32; 3]], report: &mut Report) {
        let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
        let mut sheet = Vec::new();
        for seed in 0..triangles.len() {
            if turned[seed].is_some() {
                continue;
            }
            turned[seed] = Some(false);
            sheet.clear();
            sheet.push(seed);
            let mut done = 0;
            while done < sheet.len() {
                let face = sheet[done];
                done += 1;
                for side in 3 * face..3 * face + 3 {
                    let mate = self.mate[side];
                    if mate == LOOSE {
                        continue;
                    }
                    let other = mate as usize / 3;
                    let same_way = ends(triangles, side) == ends(triangles, mate as usize);
                    let wanted = turned[face].map(|t| t != same_way);
                    if turned[other].is_none() {
                        turned[other] = wanted;
                        sheet.push(other);
                    } else if turned[other] != wanted {
                        self.unglue(side);
                        report.unorientable_edges += 1;
                    }
                }
            }
            let count = sheet.iter().filter(|&&f| turned[f] == Some(true)).count();
            if 2 * count > sheet.len() {
                for &f in &sheet {
                    turned[f] = turned[f].map(|t| !t);
                }
            }
        }
        let turned: Vec<bool> = turned.into_iter().map(|t| t == Some(true)).collect();
        report.flipped_faces = turned.iter().filter(|&&t| t).count();
        if report.flipped_faces > 0 {
            self.turn(triangles, &turned);
        }
    }

    /// Swaps the last two corners of turned faces, and renames their sides: 0, 1, 2 become 2, 1, 0.
    fn turn(&mut self, triangles: &mut [[u32; 3]], turned: &[bool]) {
        let renamed = |side: usize| if turned[side / 3] { 3 * (side / 3) + 2 - side % 3 } else { side };
        let mut mate = vec![LOOSE; self.mate.len()];
        for (side, &other) in self.mate.iter().enumerate().filter(|(_, other)| **other != LOOSE) {
            mate[renamed(side)] = renamed(other as usize) as u32;
        }
        self.mate = mate;
        for (corners, _) in triangles.iter_mut().zip(turned).filter(|(_, turned)| **turned) {
            corners.swap(1, 2);
        }
    }

    /// Steps 4 and 5: for each corner (numbered like sides) the corner that stands for its fan.
    fn separate(&mut self, triangles: &[[u32; 3]], old: &Sides, report: &mut Report) -> Vec<u32> {
        // Turning renamed sides, so edges with loose sides are grouped anew; clean meshes have few.
        let regrouped = (report.flipped_faces > 0).then(|| {
            let vertices = triangles.iter().flatten().max().map_or(0, |&v| v as usize + 1);
            Sides::group(vertices, triangles)
        });
        let sides = regrouped.as_ref().unwrap_or(old);
        loop {
            let fans = self.fans(triangles);
            let crowded = self.faces_beside_repeated_edges(triangles, sides, &fans);
            if crowded.is_empty() {
                return fans;
            }
            report.detached_faces += crowded.len();
            for side in crowded.into_iter().flat_map(|face| 3 * face..3 * face + 3) {
                self.unglue(side);
            }
        }
    }

    fn fans(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let mut corners = Sets::new(3 * triangles.len());
        for (side, &mate) in self.mate.iter().enumerate().filter(|(_, mate)| **mate != LOOSE) {
            // The corner at the start of a side meets the corner at the end of its partner.
            corners.unite(side, after(mate as usize));
        }
        (0..3 * triangles.len()).map(|corner| corners.root(corner) as u32).collect()
    }

    /// One face for each edge that joins the same two copies as an edge before it.
    fn faces_beside_repeated_edges(&self, triangles: &[[u32; 3]], sides: &Sides, fans: &[u32]) -> Vec<usize> {
        let mut crowded = Vec::new();
        let mut edges: Vec<([u32; 2], u32)> = Vec::new();
        for group in sides.groups() {
            let glued_pair = group.len() == 2 && self.mate[group[0] as usize] == group[1];
            if group.len() == 1 || glued_pair {
                continue;
            }
            edges.clear();
            // Each edge once: loose sides, and of a glued pair the smaller side.
            for &side in group.iter().filter(|&&side| side < self.mate[side as usize]) {
                let (tail, tip) = ends(triangles, side as usize);
                let copies = [fans[side as usize], fans[after(side as usize)]];
                edges.push((if tail < tip { copies } else { [copies[1], copies[0]] }, side));
            }
            edges.sort_unstable();
            crowded.extend(edges.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1 as usize / 3));
        }
        crowded.sort_unstable();
        crowded.dedup();
        crowded
    }
}

/// The side, or corner, that follows in the same face.
fn after(side: usize) -> usize {
    3 * (side / 3) + (side + 1) % 3
}

/// Numbers the copies: input vertices in order, the copies of each in the order of their first corner.
/// Gives the input vertex of each copy, and the triangles over copies.
fn number_copies(
    vertex_count: usize,
    triangles: &[[u32; 3]],
    fan_of_corner: &[u32],
    report: &mut Report,
) -> (Vec<u32>, Vec<[u32; 3]>) {
    let corner_vertex = |corner: usize| triangles[corner / 3][corner % 3];
    let mut fans: Vec<(u32, u32)> = (0..fan_of_corner.len())
        .filter(|&corner| fan_of_corner[corner] as usize == corner)
        .map(|corner| (corner_vertex(corner), corner as u32))
        .collect();
    fans.sort_unstable();
    let mut number = vec![0u32; fan_of_corner.len()];
    for (i, &(_, corner)) in fans.iter().enumerate() {
        number[corner as usize] = i as u32;
    }
    let source: Vec<u32> = fans.iter().map(|&(v, _)| v).collect();
    let copies_beyond_first = source.windows(2).filter(|w| w[0] == w[1]).count();
    report.added_vertices = copies_beyond_first;
    report.nonmanifold_vertices = source.chunk_by(|a, b| a == b).filter(|copies| copies.len() > 1).count();
    report.unused_vertices = vertex_count - (source.len() - copies_beyond_first);
    let corners = fan_of_corner.chunks_exact(3).map(|c| [c[0], c[1], c[2]].map(|fan| number[fan as usize]));
    (source, corners.collect())
}

/// Disjoint sets; the smallest member stands for its set, so results do not depend on the order of unions.
struct Sets {
    parent: Vec<u32>,
}

impl Sets {
    fn new(len: usize) -> Self {
        Self { parent: (0..len as u32).collect() }
    }

    fn root(&mut self, mut x: usize) -> usize {
        while self.parent[x] as usize != x {
            self.parent[x] = self.parent[self.parent[x] as usize];
            x = self.parent[x] as usize;
        }
        x
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b) as u32;
    }
}
