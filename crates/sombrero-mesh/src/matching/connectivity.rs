//! Who is next to whom in any list of triangles, as far as it is a manifold.

use crate::sides::{Sides, ends};

/// No side, face or vertex.
pub(super) const NONE: u32 = u32::MAX;

/// Usable triangles, glued where exactly two meet at an edge in opposite directions.
///
/// Side `3 f + k` runs from corner `k` of face `f` to its next corner.
pub(super) struct Connectivity {
    /// Faces with three different corners in range, each set of three corners once.
    pub(super) triangles: Vec<[u32; 3]>,
    /// For each side the side that it is glued to, or `NONE`.
    pub(super) mate: Vec<u32>,
    /// How many faces each vertex has.
    pub(super) valence: Vec<u32>,
    /// Whether the faces of each vertex are one closed fan.
    pub(super) interior: Vec<bool>,
}

impl Connectivity {
    pub(super) fn new(triangles: &[[u32; 3]], vertex_count: usize) -> Self {
        let (triangles, sides) = usable(triangles, vertex_count);
        let mut mate = vec![NONE; 3 * triangles.len()];
        for group in sides.groups() {
            if let &[s, t] = group {
                let (tail, tip) = ends(&triangles, s as usize);
                // Faces that disagree about the orientation stay apart.
                if ends(&triangles, t as usize) == (tip, tail) {
                    mate[s as usize] = t;
                    mate[t as usize] = s;
                }
            }
        }
        let mut valence = vec![0; vertex_count];
        for &v in triangles.iter().flatten() {
            valence[v as usize] += 1;
        }
        let interior = interior(&triangles, &mate, &valence);
        Self { triangles, mate, valence, interior }
    }

    /// This surface seen from its other side. Faces and vertices keep their numbers.
    pub(super) fn mirrored(&self) -> Self {
        // Swapping the last two corners renames the sides of a face from 0, 1, 2 to 2, 1, 0.
        let renamed = |side: usize| 3 * (side / 3) + 2 - side % 3;
        let mut mate = vec![NONE; self.mate.len()];
        for (side, &other) in self.mate.iter().enumerate().filter(|(_, other)| **other != NONE) {
            mate[renamed(side)] = renamed(other as usize) as u32;
        }
        Self {
            triangles: self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
            mate,
            valence: self.valence.clone(),
            interior: self.interior.clone(),
        }
    }

    pub(super) fn face_count(&self) -> usize {
        self.triangles.len()
    }

    /// The vertex that a side runs from.
    #[inline]
    pub(super) fn tail(&self, side: u32) -> u32 {
        self.triangles[side as usize / 3][side as usize % 3]
    }

    /// The faces of each part that is connected through glued sides; the largest part first.
    pub(super) fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.face_count()];
        let mut components = Vec::new();
        for seed in 0..self.face_count() {
            if std::mem::replace(&mut seen[seed], true) {
                continue;
            }
            let mut faces = vec![seed as u32];
            let mut done = 0;
            while done < faces.len() {
                let face = faces[done] as usize;
                done += 1;
                for &mate in self.mate[3 * face..3 * face + 3].iter().filter(|mate| **mate != NONE) {
                    if !std::mem::replace(&mut seen[mate as usize / 3], true) {
                        faces.push(mate / 3);
                    }
                }
            }
            components.push(faces);
        }
        components.sort_by_key(|faces| std::cmp::Reverse(faces.len()));
        components
    }
}

/// The side `steps` after `side` in its face.
#[inline]
pub(super) fn turned(side: u32, steps: u32) -> u32 {
    side - side % 3 + (side + steps) % 3
}

/// The triangles that can be used, and their sides by edge.
fn usable(triangles: &[[u32; 3]], vertex_count: usize) -> (Vec<[u32; 3]>, Sides) {
    let in_range = |corners: &[u32; 3]| corners.iter().all(|&v| (v as usize) < vertex_count);
    let mut kept: Vec<[u32; 3]> = triangles
        .iter()
        .copied()
        .filter(|corners @ &[a, b, c]| in_range(corners) && a != b && b != c && c != a)
        .collect();
    let mut sides = Sides::group(vertex_count, &kept);
    let doubled = sides.doubled_faces(&kept);
    if doubled.contains(&true) {
        let mut doubled = doubled.into_iter();
        kept.retain(|_| doubled.next() != Some(true));
        sides = Sides::group(vertex_count, &kept);
    }
    (kept, sides)
}

/// Whether turning around a vertex from any of its sides leads through all of its faces and back.
fn interior(triangles: &[[u32; 3]], mate: &[u32], valence: &[u32]) -> Vec<bool> {
    let mut outgoing = vec![NONE; valence.len()];
    for side in 0..3 * triangles.len() {
        outgoing[ends(triangles, side).0 as usize] = side as u32;
    }
    let closed_fan = |(&start, &valence): (&u32, &u32)| {
        let (mut side, mut faces) = (start, 0);
        // Turning is one-to-one where it is possible, so it stops or comes back to its start.
        while side != NONE {
            faces += 1;
            side = mate[turned(side, 2) as usize];
            if side == start {
                return faces == valence;
            }
        }
        false
    };
    outgoing.iter().zip(valence).map(closed_fan).collect()
}
