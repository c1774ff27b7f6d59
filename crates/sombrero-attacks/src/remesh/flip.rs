//! Flips of edges, to even out numbers of neighbours.
//!
//! ```text
//!        c                 c
//!       / \               /|\         sides of f = abc:  s: a → b,  b → c,  c → a
//!      / f \             / | \        sides of g = bad:  t: b → a,  a → d,  d → b
//!     a ─s─ b    flip   a g|f b       after:  f = dbc,  g = cad
//!      \ g /    ─────→   \ | /
//!       \ /               \|/
//!        d                 d
//! ```
//!
//! With n_v neighbours of v, and 6 or at a rim 4 wanted, the edge ab is flipped when that makes
//! Σ (n_v - wanted)² over a, b, c and d smaller.

use super::creases::Creases;
use super::{facing, turns};
use sombrero_mesh::{Edges, Soup};

/// No side, beyond a rim.
const NONE: u32 = u32::MAX;

/// Flips edges that are no creases, once through.
pub(super) fn flip(soup: &mut Soup) {
    let mut run = Run::new(soup);
    for side in 0..3 * soup.triangles.len() as u32 {
        let mate = run.sides[side as usize].mate;
        // Each edge once; a flipped one may come again under another number, but then has nothing to gain.
        if mate != NONE && side < mate && run.gains(soup, side) && run.keeps_shape(soup, side) {
            run.flip(soup, side);
        }
    }
}

/// The side `3 f + k` runs from corner k of face f to the next.
#[derive(Clone, Copy)]
struct Side {
    /// The same edge in the face beyond it.
    mate: u32,
    sharp: bool,
}

struct Run {
    sides: Vec<Side>,
    /// By vertex: neighbours less the wanted number.
    excess: Vec<i32>,
}

impl Run {
    fn new(soup: &Soup) -> Self {
        let edges = Edges::new(soup.points.len(), &soup.triangles);
        let creases = Creases::of(&soup.points, &soup.triangles, &edges);
        let mut excess = vec![-6; soup.points.len()];
        for (ends, count) in edges.ends.iter().zip(&edges.sides) {
            // Two edges at a rim vertex have one side each: together they make the wanted 6 a 4.
            for v in ends {
                excess[*v as usize] += if *count == 1 { 2 } else { 1 };
            }
        }
        let mut first = vec![NONE; edges.len()];
        let mut sides: Vec<Side> = Vec::with_capacity(edges.of_side.len());
        for (side, &edge) in (0..).zip(&edges.of_side) {
            let mate = std::mem::replace(&mut first[edge as usize], side);
            if mate != NONE {
                sides[mate as usize].mate = side;
            }
            sides.push(Side { mate, sharp: creases.sharp[edge as usize] });
        }
        Self { sides, excess }
    }

    fn mate(&self, side: u32) -> u32 {
        self.sides[side as usize].mate
    }

    /// The corners a, b, c, d around a side with a face beyond it.
    fn corners(&self, soup: &Soup, side: u32) -> [u32; 4] {
        let mate = self.mate(side);
        [tail(soup, side), tail(soup, mate), tail(soup, before(side)), tail(soup, before(mate))]
    }

    fn gains(&self, soup: &Soup, side: u32) -> bool {
        let excess = self.corners(soup, side).map(|v| self.excess[v as usize]);
        let sum = |change: i32| {
            let after = [excess[0] - change, excess[1] - change, excess[2] + change, excess[3] + change];
            after.iter().map(|x| x * x).sum::<i32>()
        };
        sum(1) < sum(0)
    }

    /// Whether the new edge is new, and the new faces look where the old ones did.
    fn keeps_shape(&self, soup: &Soup, side: u32) -> bool {
        let [a, b, c, d] = self.corners(soup, side);
        if self.sides[side as usize].sharp || c == d || self.are_joined(soup, before(side), d) {
            return false;
        }
        let facing = |corners| facing(&soup.points, corners);
        let old = facing([a, b, c]) + facing([b, a, d]);
        let new = [facing([d, b, c]), facing([c, a, d])];
        !new.iter().any(|new| turns(&old, new))
    }

    /// Whether the vertex where `side` starts has the neighbour `other`.
    fn are_joined(&self, soup: &Soup, side: u32, other: u32) -> bool {
        let meets = |side: u32| tail(soup, after(side)) == other || tail(soup, before(side)) == other;
        let mut at = side;
        while at != NONE {
            if meets(at) {
                return true;
            }
            at = self.mate(before(at));
            if at == side {
                return false;
            }
        }
        // The fan has ended at a rim: the other way.
        let mut beyond = self.mate(side);
        while beyond != NONE {
            let at = after(beyond);
            if meets(at) {
                return true;
            }
            beyond = self.mate(at);
        }
        false
    }

    fn flip(&mut self, soup: &mut Soup, s: u32) {
        let t = self.mate(s);
        let [a, b, c, d] = self.corners(soup, s);
        let outer = [before(t), after(s), before(s), after(t)].map(|side| self.sides[side as usize]);
        let (f, g) = (s / 3, t / 3);
        soup.triangles[f as usize] = [d, b, c];
        soup.triangles[g as usize] = [c, a, d];
        let places = [3 * f, 3 * f + 1, 3 * g, 3 * g + 1];
        for (place, side) in places.into_iter().zip(outer) {
            self.sides[place as usize] = side;
            if side.mate != NONE {
                self.sides[side.mate as usize].mate = place;
            }
        }
        self.sides[3 * f as usize + 2] = Side { mate: 3 * g + 2, sharp: false };
        self.sides[3 * g as usize + 2] = Side { mate: 3 * f + 2, sharp: false };
        for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
            self.excess[v as usize] += change;
        }
    }
}

/// The vertex where a side starts.
fn tail(soup: &Soup, side: u32) -> u32 {
    soup.triangles[side as usize / 3][side as usize % 3]
}

/// The following side of the same face.
fn after(side: u32) -> u32 {
    if side % 3 == 2 { side - 2 } else { side + 1 }
}

/// The preceding side of the same face.
fn before(side: u32) -> u32 {
    if side.is_multiple_of(3) { side + 2 } else { side - 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use sombrero_mesh::{repair, topology};
    use sombrero_shapes as shapes;

    #[test]
    fn a_long_diagonal_of_a_crowded_vertex_is_flipped() {
        // A flat wheel of eight spokes with a second ring: the hub has two neighbours too many.
        let ring = |radius: f64, turn: f64| {
            (0..8).map(move |i| {
                let angle = (f64::from(i) + turn) * std::f64::consts::TAU / 8.0;
                Point3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            })
        };
        let points = [Point3::origin()].into_iter().chain(ring(1.0, 0.0)).chain(ring(1.2, 0.5)).collect();
        let (inner, outer) = (|i: u32| 1 + i % 8, |i: u32| 9 + i % 8);
        let cell = |i: u32| {
            [
                [0, inner(i), inner(i + 1)],
                [inner(i), outer(i), inner(i + 1)],
                [inner(i + 1), outer(i), outer(i + 1)],
            ]
        };
        let mut wheel = Soup::new(points, (0..8).flat_map(cell).collect());
        let hub = |soup: &Soup| soup.triangles.iter().filter(|t| t.contains(&0)).count();
        flip(&mut wheel);
        assert!(hub(&wheel) < 8);
        assert!(repair(&wheel).report.is_clean());
    }

    #[test]
    fn flips_keep_the_topology() {
        for soup in [
            shapes::bumpy_sphere(400),
            shapes::genus(3, 2),
            shapes::sheet_with_hole(9, 9),
            shapes::tetrahedron(),
        ] {
            let mut flipped = soup.clone();
            for _ in 0..4 {
                flip(&mut flipped);
            }
            let (before, after) = (repair(&soup), repair(&flipped));
            assert!(after.report.is_clean());
            assert_eq!(topology::genus(&before.mesh), topology::genus(&after.mesh));
            assert_eq!(before.mesh.edge_count(), after.mesh.edge_count());
        }
    }
}
