//! One face laid on another decides where all faces around it go: the two meshes are walked side by side.

use super::connectivity::{Connectivity, NONE, turned};

/// A flood is given up when it meets more contradictions than this and one to sixteen faces: a handful of
/// edges that somebody flipped are walked around, other meshes are left after a few dozen steps.
const TOLERATED: usize = 32;
const FACES_PER_CONTRADICTION: usize = 16;

/// Faces and vertices of `b` that have their place in `a`.
#[derive(Clone)]
pub(super) struct Assignment {
    /// For each vertex of `b` its vertex of `a`, or `NONE`.
    pub(super) of_b: Vec<u32>,
    /// For each vertex of `a` the first vertex of `b` that came to it, or `NONE`.
    of_a: Vec<u32>,
    /// For each face of `b` the side of `a` that its first side lies on, or `NONE`.
    image: Vec<u32>,
    /// Whether each face of `a` is taken.
    taken: Vec<bool>,
    /// How many faces have their place.
    pub(super) faces: usize,
}

/// Where one flood went.
#[derive(Default)]
pub(super) struct Placement {
    /// Faces of `b`, with the side of `a` that the first side of each lies on.
    pub(super) faces: Vec<(u32, u32)>,
    /// Pairs of vertices, of `b` and of `a`, that were not known before.
    pub(super) vertices: Vec<(u32, u32)>,
    /// Neighbours in both meshes that do not fit on each other.
    contradictions: usize,
    /// Sides with a neighbour in one mesh alone.
    uneven: usize,
}

impl Placement {
    /// Whether a component of `b` is the same as a component of `a`, up to the last edge.
    pub(super) fn is_isomorphism(&self) -> bool {
        self.contradictions == 0 && self.uneven == 0
    }

    fn is_hopeless(&self, strict: bool) -> bool {
        match strict {
            true => !self.is_isomorphism(),
            false => self.contradictions > TOLERATED + self.faces.len() / FACES_PER_CONTRADICTION,
        }
    }
}

impl Assignment {
    pub(super) fn new(a: &Connectivity, b: &Connectivity) -> Self {
        Self {
            of_b: vec![NONE; b.valence.len()],
            of_a: vec![NONE; a.valence.len()],
            image: vec![NONE; b.face_count()],
            taken: vec![false; a.face_count()],
            faces: 0,
        }
    }

    /// Lays the first side of a face of `b` on a side of `a`, and spreads out from there. Takes nothing yet.
    ///
    /// `strict` gives up at the first difference. The second value is the number of steps that this took.
    pub(super) fn flood(
        &mut self,
        a: &Connectivity,
        b: &Connectivity,
        seed: (u32, u32),
        strict: bool,
    ) -> (Option<Placement>, usize) {
        let mut placement = Placement::default();
        if !self.lay(a, b, seed, &mut placement) {
            return (None, 1);
        }
        let mut done = 0;
        while done < placement.faces.len() && !placement.is_hopeless(strict) {
            let pair = placement.faces[done];
            self.spread(a, b, pair, &mut placement);
            done += 1;
        }
        self.lift(&placement);
        ((!placement.is_hopeless(strict)).then_some(placement), done)
    }

    /// Lays the neighbours of a pair of faces on each other.
    fn spread(&mut self, a: &Connectivity, b: &Connectivity, pair: (u32, u32), placement: &mut Placement) {
        let (face, image) = pair;
        for k in 0..3 {
            let mates = (b.mate[(3 * face + k) as usize], a.mate[turned(image, k) as usize]);
            match mates {
                (NONE, NONE) => {}
                (NONE, _) | (_, NONE) => placement.uneven += 1,
                (in_b, in_a) => {
                    let next = (in_b / 3, turned(in_a, 3 - in_b % 3));
                    if self.image[next.0 as usize] != next.1 && !self.lay(a, b, next, placement) {
                        placement.contradictions += 1;
                    }
                }
            }
        }
    }

    /// Lays a face of `b` on a face of `a`, if both are free and all corners fit.
    fn lay(
        &mut self,
        a: &Connectivity,
        b: &Connectivity,
        pair: (u32, u32),
        placement: &mut Placement,
    ) -> bool {
        let (face, side) = pair;
        if self.image[face as usize] != NONE || self.taken[side as usize / 3] {
            return false;
        }
        let corners = [0, 1, 2].map(|k| (b.tail(3 * face + k), a.tail(turned(side, k))));
        if !corners.iter().all(|&(in_b, in_a)| self.fits(a, b, in_b, in_a)) {
            return false;
        }
        for (in_b, in_a) in corners {
            if self.of_b[in_b as usize] == NONE {
                self.join(in_b, in_a);
                placement.vertices.push((in_b, in_a));
            }
        }
        self.image[face as usize] = side;
        self.taken[side as usize / 3] = true;
        placement.faces.push(pair);
        true
    }

    /// Whether two vertices can be the same one.
    fn fits(&self, a: &Connectivity, b: &Connectivity, in_b: u32, in_a: u32) -> bool {
        let (known, other) = (self.of_b[in_b as usize], self.of_a[in_a as usize]);
        if known != NONE {
            return known == in_a;
        }
        // A vertex on a cut may have become several, one for each piece that holds on to it.
        if other != NONE && (b.interior[in_b as usize] || b.interior[other as usize]) {
            return false;
        }
        let (faces_b, faces_a) = (b.valence[in_b as usize], a.valence[in_a as usize]);
        match (b.interior[in_b as usize], a.interior[in_a as usize]) {
            (true, true) => faces_b == faces_a,
            (false, true) => faces_b <= faces_a,
            (true, false) => faces_b >= faces_a,
            (false, false) => true,
        }
    }

    fn join(&mut self, in_b: u32, in_a: u32) {
        self.of_b[in_b as usize] = in_a;
        let first = &mut self.of_a[in_a as usize];
        *first = if *first == NONE { in_b } else { *first };
    }

    /// Takes back what a flood laid down.
    fn lift(&mut self, placement: &Placement) {
        for &(in_b, in_a) in &placement.vertices {
            self.of_b[in_b as usize] = NONE;
            if self.of_a[in_a as usize] == in_b {
                self.of_a[in_a as usize] = NONE;
            }
        }
        for &(face, side) in &placement.faces {
            self.image[face as usize] = NONE;
            self.taken[side as usize / 3] = false;
        }
    }

    /// The assignment with a placement that was found with it.
    pub(super) fn with(mut self, placement: &Placement) -> Self {
        for &(in_b, in_a) in &placement.vertices {
            self.join(in_b, in_a);
        }
        for &(face, side) in &placement.faces {
            self.image[face as usize] = side;
            self.taken[side as usize / 3] = true;
        }
        self.faces += placement.faces.len();
        self
    }

    /// Whether a face of `a` is still free.
    pub(super) fn is_free(&self, face: u32) -> bool {
        !self.taken[face as usize]
    }
}
