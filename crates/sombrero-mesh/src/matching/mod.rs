//! Which vertex is which, from the connectivity alone, after vertices, faces and corners were renumbered.
//!
//! Two connected surfaces that agree are laid on each other by a single pair of matching faces: the neighbours
//! of the one lie on the neighbours of the other, and so on (`flood`). The pair is found by what the
//! surroundings of a face look like (`signature`), rare looks first. Positions are not used, so noise, deformation and
//! motion do not matter; simplification, subdivision and remeshing leave nothing to match.

mod connectivity;
mod flood;
mod isomorphism;
mod places;
mod signature;

use connectivity::{Connectivity, NONE, turned};
use flood::{Assignment, Placement};
use places::Places;
use signature::{Level, Lookalikes};

pub use isomorphism::isomorphisms;
pub use places::Misfit;

/// Most matchings that [`match_connectivity`] returns.
const MAX_MATCHINGS: usize = 8;

/// Where the best are asked for, and a place is known, a search for others ends after so many more steps.
const STEPS_TO_OTHERS: usize = 1 << 25;

/// A component that is no isomorphic copy must find a place for this part of its faces.
const SHARE: f64 = 0.9;

/// By how many bits the valences of such a component must exceed what chance explains.
const MARGIN_BITS: f64 = 32.0;

/// How many faces of a component are looked for, of any kind and again of those far from every cut.
const SEEDS: usize = 6;

/// A search for one component ends after this many walks over it (and a little more for small ones), and all of
/// them together after this many over both meshes.
const MAX_WALKS: usize = 12;
const FREE_STEPS: usize = 1 << 12;
const TOTAL_WALKS: usize = 48;

/// A component is minor when so many times as many faces have their place already.
const MINOR: usize = 10;

/// One way in which two meshes correspond.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct VertexMatching {
    /// For each vertex of the first mesh the vertex of the second that it is, or `None`. If it is several
    /// vertices there, because a cut goes through it, the one with the smallest index.
    pub of_first: Vec<Option<u32>>,
    /// For each vertex of the second mesh the vertex of the first that it is, or `None`.
    pub of_second: Vec<Option<u32>>,
    /// How many faces of the second mesh lie on a face of the first.
    pub faces: usize,
    /// How many of these lie on it upside down.
    pub mirrored_faces: usize,
}

/// What [`match_connectivity`] found.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Matchings {
    /// Different matchings with equally many faces, at most as many as were asked for; none when the meshes do not
    /// correspond. More than one if the connectivity cannot tell them apart, as with a regular grid.
    pub found: Vec<VertexMatching>,
    /// Whether there may be more that are as good: one too many was dropped, or the search for others cut short.
    pub truncated: bool,
}

/// Finds the vertices of the first mesh among those of the second, its renumbered and perhaps cropped copy.
///
/// Faces are corner indices below the vertex counts. Each component of `second` (faces connected through
/// edges) is matched on its own, and its part stays `None` unless
///
/// - it is isomorphic to a component of `first`, or
/// - at least 90 % of its faces find their place, starting from a face whose surroundings are complete, and the
///   valences of the interior vertices that agree carry log₂(3 f g) + 32 bits, where f and g are the numbers of
///   faces. A vertex carries -log₂ of the frequency of its valence in `first`. Regular grids carry none, and
///   small scraps too little, because they would fit in many places.
///
/// In both cases no vertex has two places, and interior vertices have as many neighbours as where they lie.
/// Faces that contradict this (at flipped edges or joined vertices) are left out and walked around, as long as
/// they are few. So is whatever is no manifold: edges are crossed only where exactly two faces meet in opposite
/// directions; faces with a corner twice or out of range, and repetitions of a face, are ignored. When less than
/// 90 % of `second` is found, the rest is tried with its faces turned over.
///
/// Symmetric connectivity has several equally good matchings, of which the first eight are returned
/// ([`best_matchings`] returns the best). But a component
/// with several places stays `None` when more than ten times as many faces are matched already: eight ways to
/// number a bolt are not worth eight matchings. A component that is cut from a nearly regular surface may have
/// so many places to try that it is given up. The result depends on the arguments alone.
///
/// Time is O(n log n) for sorting signatures and O(n) for everything else, with a bounded number of walks over
/// each component; memory is O(n).
///
/// ```
/// use sombrero_mesh::match_connectivity;
/// use sombrero_shapes as shapes;
///
/// let part = shapes::part(8);
/// let vertices = part.points.len();
/// // Vertices backwards, faces backwards, corners shifted.
/// let renumbered: Vec<_> =
///     part.triangles.iter().rev().map(|&[a, b, c]| [b, c, a].map(|v| vertices as u32 - 1 - v)).collect();
/// let matchings = match_connectivity(&part.triangles, vertices, &renumbered, vertices);
/// assert_eq!(matchings.found[0].faces, part.triangles.len());
/// assert!(matchings.found.iter().any(|m| m.of_first[0] == Some(vertices as u32 - 1)));
/// ```
pub fn match_connectivity(
    first: &[[u32; 3]],
    first_vertices: usize,
    second: &[[u32; 3]],
    second_vertices: usize,
) -> Matchings {
    let [first, second] = [(first, first_vertices), (second, second_vertices)];
    matchings(first, second, &Wanted { most: MAX_MATCHINGS, misfit: None })
}

/// [`match_connectivity`] that, of matchings with equally many faces, returns those whose misfit, summed over the
/// components, is smallest, smallest first: at most `most`.
///
/// A body of revolution goes onto itself in as many ways as it has vertices around its axis; where they lie says which of them
/// is right. All are looked at, until 33 million faces were laid on others. If there may be more then,
/// [`Matchings::truncated`] says so, and the right one may not be among those that are returned.
///
/// ```
/// use sombrero_mesh::best_matchings;
/// use sombrero_shapes as shapes;
///
/// // A torus whose connectivity goes onto itself in more than a thousand ways.
/// let torus = shapes::torus(24, 24, 1.0, 0.4);
/// let n = torus.points.len();
/// let misfit = |pairs: &[(u32, u32)]| pairs.iter().filter(|(second, first)| second != first).count() as f64;
/// let best = best_matchings(&torus.triangles, n, &torus.triangles, n, 1, &misfit);
/// assert_eq!(best.found[0].of_first[7], Some(7));
/// ```
pub fn best_matchings(
    first: &[[u32; 3]],
    first_vertices: usize,
    second: &[[u32; 3]],
    second_vertices: usize,
    most: usize,
    misfit: &Misfit<'_>,
) -> Matchings {
    matchings((first, first_vertices), (second, second_vertices), &Wanted { most, misfit: Some(misfit) })
}

/// Which of the matchings with equally many faces are returned.
struct Wanted<'m> {
    most: usize,
    /// The best ones by this; the first ones without.
    misfit: Option<&'m Misfit<'m>>,
}

fn matchings(first: (&[[u32; 3]], usize), second: (&[[u32; 3]], usize), wanted: &Wanted<'_>) -> Matchings {
    let a = Connectivity::new(first.0, first.1);
    let b = Connectivity::new(second.0, second.1);
    let mut search = Search::new(&a, &b, wanted);
    search.match_all(&b);
    search.finish()
}

/// A component of the second mesh.
struct Component {
    faces: Vec<u32>,
    /// Whether so many places look alike that it was given up.
    given_up: bool,
}

/// Assignments that are equally good so far.
struct Search<'m> {
    a: &'m Connectivity,
    wanted: &'m Wanted<'m>,
    assignments: Vec<Assignment>,
    /// The misfit of each.
    misfits: Vec<f64>,
    /// -log₂ of the frequency of each valence among interior vertices of `a`.
    bits: Vec<f64>,
    needed_bits: f64,
    steps_left: usize,
    steps_to_others: usize,
    /// How many of the faces that have their place lie upside down.
    mirrored_faces: usize,
    truncated: bool,
}

impl<'m> Search<'m> {
    fn new(a: &'m Connectivity, b: &Connectivity, wanted: &'m Wanted<'m>) -> Self {
        let places = 3.0 * a.face_count() as f64 * b.face_count() as f64;
        Self {
            a,
            wanted,
            assignments: vec![Assignment::new(a, b)],
            misfits: vec![0.0],
            bits: bits_of_valences(a),
            needed_bits: libm::log2(places.max(1.0)) + MARGIN_BITS,
            steps_left: TOTAL_WALKS * (a.face_count() + b.face_count()) + FREE_STEPS,
            steps_to_others: STEPS_TO_OTHERS,
            mirrored_faces: 0,
            truncated: false,
        }
    }

    /// Faces that have their place; as many in each assignment.
    fn faces(&self) -> usize {
        self.assignments.first().map_or(0, |assignment| assignment.faces)
    }

    /// Looks for all components of `b`. What looks alike from afar comes first: it is more likely the same.
    fn match_all(&mut self, b: &Connectivity) {
        let unknown = |faces| Component { faces, given_up: false };
        let mut components: Vec<Component> = b.components().into_iter().map(unknown).collect();
        let (in_a, in_b) = (signature::levels(self.a), signature::levels(b));
        let mut turned_over = None;
        for reach in (0..in_a.len()).rev() {
            components.retain(|component| !component.given_up);
            self.match_components(b, &in_a[reach], &in_b[reach], &mut components);
            if (self.faces() as f64) < SHARE * b.face_count() as f64 {
                let (mirrored, levels) = turned_over.get_or_insert_with(|| {
                    let mirrored = b.mirrored();
                    let levels = signature::levels(&mirrored);
                    (mirrored, levels)
                });
                let upright = self.faces();
                self.match_components(mirrored, &in_a[reach], &levels[reach], &mut components);
                self.mirrored_faces += self.faces() - upright;
            }
        }
    }

    /// Looks for each component at one reach, and takes those that are found out of `components`.
    fn match_components(
        &mut self,
        b: &Connectivity,
        in_a: &Level,
        in_b: &Level,
        components: &mut Vec<Component>,
    ) {
        if components.is_empty() {
            return;
        }
        let lookalikes = Lookalikes::new(in_a, in_b);
        components.retain_mut(|component| {
            let can_be_part = self.possible_evidence(b, &component.faces) >= self.needed_bits;
            let is_inner = |face: u32| can_be_part && in_b.complete[face as usize];
            let seeds = seeds(&component.faces, &lookalikes, is_inner);
            !self.match_component(b, component, &seeds, &lookalikes)
        });
    }

    /// Extends each assignment by the best places of one component. Says whether it did.
    fn match_component(
        &mut self,
        b: &Connectivity,
        component: &mut Component,
        seeds: &[Seed],
        lookalikes: &Lookalikes,
    ) -> bool {
        let size = component.faces.len();
        let minor = MINOR * size < self.faces();
        let mut ways: Vec<Way> = Vec::new();
        let (mut ambiguous, mut cut_short) = (false, false);
        let mut assignments = std::mem::take(&mut self.assignments);
        for (source, assignment) in assignments.iter_mut().enumerate() {
            // One more than fits, to know whether there are more.
            let room = (self.wanted.most + 1).saturating_sub(ways.len()).max(1);
            let (wanted, misfit) = match self.wanted.misfit {
                _ if minor => (2, None),
                Some(misfit) => (self.wanted.most, Some(misfit)),
                None => (room, None),
            };
            let mut hunt = Hunt { b, size, lookalikes, wanted, misfit, cut_short: false };
            let placements = self.placements(assignment, seeds, &mut hunt);
            ambiguous |= placements.len() > 1;
            cut_short |= hunt.cut_short;
            let before = self.misfits[source];
            ways.extend(placements.into_iter().enumerate().map(|(rank, (misfit, placement))| Way {
                source,
                rank,
                misfit: before + misfit,
                placement,
            }));
            if self.wanted.misfit.is_some() {
                // Many assignments with many places each would fill the memory.
                keep_best(&mut ways);
                ways.truncate(self.wanted.most.max(1));
            }
        }
        if ways.is_empty() || (minor && (ambiguous || cut_short)) {
            self.assignments = assignments;
            component.given_up |= cut_short;
            return false;
        }
        keep_best(&mut ways);
        let most = self.wanted.most.max(1);
        self.truncated |= cut_short || (self.wanted.misfit.is_none() && ways.len() > most);
        ways.truncate(most);
        self.misfits = ways.iter().map(|way| way.misfit).collect();
        self.assignments = extended(assignments, &ways);
        true
    }

    /// The best places for one component that an assignment leaves free, all with as many faces, and the misfit of each.
    fn placements(
        &mut self,
        assignment: &mut Assignment,
        seeds: &[Seed],
        hunt: &mut Hunt,
    ) -> Vec<(f64, Placement)> {
        let mut found = Places::new(hunt.wanted, hunt.misfit);
        let mut walked = 0;
        for seed in seeds {
            let candidates = hunt.lookalikes.of(seed.face);
            for side in candidates.flat_map(|face| [0, 1, 2].map(|k| turned(3 * face, k))) {
                if found.are_enough() {
                    break;
                }
                let many = walked >= MAX_WALKS * hunt.size + FREE_STEPS || walked >= self.steps_left;
                if many || (self.steps_to_others == 0 && !found.best.is_empty()) {
                    hunt.cut_short = true;
                    break;
                }
                let (placement, steps) = match assignment.is_free(side / 3) {
                    true => assignment.flood(self.a, hunt.b, (seed.face, side), !seed.inner),
                    false => (None, 1),
                };
                let accepted = placement.filter(|p| self.accepts(hunt, p, seed.inner));
                accepted.into_iter().for_each(|placement| found.add(placement));
                // Where the best are asked for, others are looked for as soon as there is one.
                match hunt.misfit.is_some() && !found.best.is_empty() {
                    true => self.steps_to_others = self.steps_to_others.saturating_sub(steps),
                    false => walked += steps,
                }
            }
            if !found.best.is_empty() || hunt.cut_short {
                break;
            }
        }
        self.steps_left = self.steps_left.saturating_sub(walked);
        found.best
    }

    /// The criterion of [`match_connectivity`].
    fn accepts(&self, hunt: &Hunt, placement: &Placement, inner: bool) -> bool {
        let large = || placement.faces.len() as f64 >= SHARE * hunt.size as f64;
        let certain = || self.evidence(hunt.b, placement) >= self.needed_bits;
        placement.is_isomorphism() || (inner && large() && certain())
    }

    /// The bits that the valences of agreeing interior vertices carry.
    fn evidence(&self, b: &Connectivity, placement: &Placement) -> f64 {
        let interior =
            |&&(in_b, in_a): &&(u32, u32)| b.interior[in_b as usize] && self.a.interior[in_a as usize];
        let bits = |&(_, in_a): &(u32, u32)| self.bits[self.a.valence[in_a as usize] as usize];
        placement.vertices.iter().filter(interior).map(bits).sum()
    }

    /// No less than the evidence for any place of these faces.
    fn possible_evidence(&self, b: &Connectivity, faces: &[u32]) -> f64 {
        let corners = faces.iter().flat_map(|&face| b.triangles[face as usize]).map(|v| v as usize);
        let share = |v: usize| {
            let valence = b.valence[v];
            self.bits.get(valence as usize).map_or(0.0, |bits| bits / f64::from(valence))
        };
        corners.filter(|&v| b.interior[v]).map(share).sum()
    }

    fn finish(self) -> Matchings {
        let mirrored_faces = self.mirrored_faces;
        let first_vertices = self.a.valence.len();
        let matching = |assignment: Assignment| {
            let some = |v: u32| (v != NONE).then_some(v);
            let of_second: Vec<_> = assignment.of_b.into_iter().map(some).collect();
            let of_first = inverse(&of_second, first_vertices);
            VertexMatching { of_first, of_second, faces: assignment.faces, mirrored_faces }
        };
        let found =
            self.assignments.into_iter().filter(|assignment| assignment.faces > 0).map(matching).collect();
        Matchings { found, truncated: self.truncated }
    }
}

/// What is looked for, and how far.
struct Hunt<'h> {
    b: &'h Connectivity,
    /// Faces of the component.
    size: usize,
    lookalikes: &'h Lookalikes,
    /// How many places are enough: the best ones by the misfit, the first ones without.
    wanted: usize,
    misfit: Option<&'h Misfit<'h>>,
    /// Whether the search ended before all places had been seen.
    cut_short: bool,
}

/// One way to go on from an assignment.
struct Way {
    /// The assignment.
    source: usize,
    /// How many ways to go on from the same one were found before.
    rank: usize,
    /// Of all components that have their place then.
    misfit: f64,
    placement: Placement,
}

/// A face of the second mesh that is looked for in the first.
struct Seed {
    face: u32,
    /// Whether it looks the same in a mesh of which the second is only a part. If not, only an isomorphism
    /// counts.
    inner: bool,
}

/// The faces of a component with the fewest lookalikes: a few of all of them, which settle it if nothing was
/// cut off, then a few of those that are far from every cut.
fn seeds(faces: &[u32], lookalikes: &Lookalikes, is_inner: impl Fn(u32) -> bool) -> Vec<Seed> {
    let rarest = |faces: &mut dyn Iterator<Item = u32>| {
        // Among equally rare ones any, but not neighbours: all might be near the same edited place.
        let scattered = |face: u32| face.wrapping_mul(0x9e37_79b1);
        let mut rarest: Vec<(u32, u32, u32)> = Vec::with_capacity(SEEDS + 1);
        for face in faces.filter(|&face| lookalikes.count(face) > 0) {
            let entry = (lookalikes.count(face), scattered(face), face);
            if rarest.len() < SEEDS || rarest.last().is_some_and(|last| entry < *last) {
                rarest.insert(rarest.partition_point(|other| *other < entry), entry);
                rarest.truncate(SEEDS);
            }
        }
        rarest.into_iter().map(|(_, _, face)| Seed { face, inner: is_inner(face) })
    };
    let all = rarest(&mut faces.iter().copied());
    let inner = rarest(&mut faces.iter().copied().filter(|&face| is_inner(face)));
    all.chain(inner).collect()
}

/// Keeps those with the most faces, in order of misfit.
fn keep_best(ways: &mut Vec<Way>) {
    let most = ways.iter().map(|way| way.placement.faces.len()).max();
    ways.retain(|way| Some(way.placement.faces.len()) == most);
    ways.sort_by(|x, y| x.misfit.total_cmp(&y.misfit).then((x.rank, x.source).cmp(&(y.rank, y.source))));
}

/// One assignment for each way.
fn extended(assignments: Vec<Assignment>, ways: &[Way]) -> Vec<Assignment> {
    let mut sources: Vec<Option<Assignment>> = assignments.into_iter().map(Some).collect();
    let mut extended = Vec::with_capacity(ways.len());
    for (w, way) in ways.iter().enumerate() {
        let source = &mut sources[way.source];
        // Copied only if a later way starts from it too.
        let needed = ways[w + 1..].iter().any(|later| later.source == way.source);
        let assignment = if needed { source.clone() } else { source.take() };
        extended.extend(assignment.map(|assignment| assignment.with(&way.placement)));
    }
    extended
}

fn bits_of_valences(mesh: &Connectivity) -> Vec<f64> {
    let largest = mesh.valence.iter().max().map_or(0, |&v| v as usize);
    let mut counts = vec![0usize; largest + 1];
    for (&valence, _) in mesh.valence.iter().zip(&mesh.interior).filter(|(_, interior)| **interior) {
        counts[valence as usize] += 1;
    }
    let total: usize = counts.iter().sum();
    counts.into_iter().map(|count| libm::log2(total.max(1) as f64 / count.max(1) as f64)).collect()
}

fn inverse(of_second: &[Option<u32>], first_vertices: usize) -> Vec<Option<u32>> {
    let mut of_first = vec![None; first_vertices];
    for (v, in_first) in (0..).zip(of_second) {
        if let Some(w) = in_first {
            of_first[*w as usize].get_or_insert(v);
        }
    }
    of_first
}
