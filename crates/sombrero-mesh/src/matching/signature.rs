//! What a face looks like from where it stands: a hash of the valences around it.
//!
//! Signatures depend on the connectivity near a face alone, so renumbering and noise leave them as they are.
//! Cropping changes those near the cut only; the rest are marked as complete.

use super::connectivity::{Connectivity, NONE};

/// How many edges a signature looks across, one number a level. Far sight tells similar places apart, near
/// sight is what small and narrow pieces have.
pub(super) const REACHES: [usize; 3] = [1, 3, 7];

/// The signatures of all faces at one reach.
pub(super) struct Level {
    /// For each face a hash that does not depend on which of its corners comes first.
    key: Vec<u64>,
    /// Whether all vertices that the hash depends on have all their faces.
    pub(super) complete: Vec<bool>,
}

/// The signatures at each of [`REACHES`]. Time is O(n).
pub(super) fn levels(mesh: &Connectivity) -> Vec<Level> {
    let mut labels: Vec<u64> = mesh.triangles.iter().flatten().map(|&v| vertex_label(mesh, v)).collect();
    let mut complete: Vec<bool> =
        mesh.triangles.iter().map(|corners| corners.iter().all(|&v| mesh.interior[v as usize])).collect();
    let mut levels = Vec::with_capacity(REACHES.len());
    for reach in 1..=REACHES[REACHES.len() - 1] {
        labels = relabelled(mesh, &labels);
        complete = (0..mesh.face_count()).map(|f| all_complete(mesh, &complete, f)).collect();
        if REACHES.contains(&reach) {
            let key = labels.chunks_exact(3).map(|l| l[0].min(l[1]).min(l[2])).collect();
            levels.push(Level { key, complete: complete.clone() });
        }
    }
    levels
}

fn vertex_label(mesh: &Connectivity, v: u32) -> u64 {
    mix(u64::from(mesh.valence[v as usize]), u64::from(mesh.interior[v as usize]))
}

/// Labels of sides that see one edge further: each takes in what is beyond the three edges of its face.
fn relabelled(mesh: &Connectivity, labels: &[u64]) -> Vec<u64> {
    let beyond = |side: usize| match mesh.mate[side] {
        NONE => mix(labels[side], 1),
        mate => mix(labels[side], labels[mate as usize]),
    };
    let around = |face: usize| {
        let [x, y, z] = [0, 1, 2].map(|k| beyond(3 * face + k));
        [mix(mix(x, y), z), mix(mix(y, z), x), mix(mix(z, x), y)]
    };
    (0..mesh.face_count()).flat_map(around).collect()
}

fn all_complete(mesh: &Connectivity, complete: &[bool], face: usize) -> bool {
    let neighbour = |&mate: &u32| mate != NONE && complete[mate as usize / 3];
    complete[face] && mesh.mate[3 * face..3 * face + 3].iter().all(neighbour)
}

fn mix(a: u64, b: u64) -> u64 {
    let product =
        (a.rotate_left(26) ^ b).wrapping_add(0x632b_e59b_d9b4_e019).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    product ^ product >> 32
}

/// For each face of one mesh the faces of another that look the same.
pub(super) struct Lookalikes {
    /// Faces of the other mesh, ordered by their signatures.
    faces: Vec<(u64, u32)>,
    /// For each face of the one mesh where its own signature is in that order: begin and length.
    ranges: Vec<(u32, u32)>,
}

impl Lookalikes {
    /// Looks for each face of `b` in `a`. Time is O(n log n).
    pub(super) fn new(a: &Level, b: &Level) -> Self {
        let faces = by_key(a);
        let mut ranges = vec![(0, 0); b.key.len()];
        let (mut begin, mut end) = (0, 0);
        for (key, face) in by_key(b) {
            while begin < faces.len() && faces[begin].0 < key {
                begin += 1;
            }
            end = end.max(begin);
            while end < faces.len() && faces[end].0 == key {
                end += 1;
            }
            ranges[face as usize] = (begin as u32, (end - begin) as u32);
        }
        Self { faces, ranges }
    }

    /// How many faces look like `face`.
    pub(super) fn count(&self, face: u32) -> u32 {
        self.ranges[face as usize].1
    }

    /// The faces that look like `face`, in order.
    pub(super) fn of(&self, face: u32) -> impl Iterator<Item = u32> + '_ {
        let (begin, count) = self.ranges[face as usize];
        self.faces[begin as usize..][..count as usize].iter().map(|&(_, face)| face)
    }
}

fn by_key(level: &Level) -> Vec<(u64, u32)> {
    let mut faces: Vec<(u64, u32)> = level.key.iter().copied().zip(0..).collect();
    faces.sort_unstable();
    faces
}
