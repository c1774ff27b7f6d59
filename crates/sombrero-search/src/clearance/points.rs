//! All functions are made weaker where it is narrow.
//!
//! ```text
//! s = min(1, 0.08 D / (4.5 ε σ)),      σ² = Σ_i (u · r_i)²,
//! ```
//!
//! and s changes slowly along the surface: by 0.02 over a way that is as long as the longest displacement, so that the two
//! places are scaled nearly alike and nothing is bent that anybody sees. A planar region is scaled as a whole.

use super::Limits;
use super::walls::Walls;
use sombrero_coupling::{Assembly, Coupling, Facing, Link, spread};
use sombrero_mesh::{Edges, PlanarRegions};

/// What a distance may change by because its places are not scaled alike. And how much a factor changes over the longest
/// displacement.
const SLOPE: f64 = 0.02;

/// What the functions of each point are multiplied by at this gain; it spreads along `links`.
pub(super) fn limits(points: usize, walls: &Walls, links: &[Link], gain: f64) -> Limits {
    let mut factor = vec![1.0_f64; points];
    for (pair, share) in walls.pairs.iter().zip(&walls.shares) {
        if gain * share > 1.0 {
            let least = 1.0 / (gain * share);
            pair.terms.iter().for_each(|(v, _)| factor[*v as usize] = factor[*v as usize].min(least));
        }
    }
    let unit = gain * walls.longest / SLOPE;
    let links: Vec<Link> = links.iter().map(|link| Link { length: link.length / unit, ..*link }).collect();
    Limits::OfPoints(spread(&factor, &links).into_iter().map(|factor| gain * factor).collect())
}

/// Along edges and between places that face each other, in model units; without length where all is scaled alike.
pub(super) fn links(
    assembly: &Assembly<'_>,
    coupling: &Coupling,
    pairs: &[Facing],
    regions: &PlanarRegions,
) -> Vec<Link> {
    let Assembly { points, triangles, .. } = *assembly;
    let edges = Edges::new(points.len(), triangles);
    let mut planar = vec![false; edges.len()];
    for (edge, face) in edges.of_side.iter().zip((0..triangles.len()).flat_map(|face| [face; 3])) {
        planar[*edge as usize] |= regions.of_face[face].is_some();
    }
    let length = |[a, b]: [u32; 2]| (points[a as usize] - points[b as usize]).norm();
    let along = edges.ends.iter().zip(planar);
    let along =
        along.map(|(ends, planar)| Link { ends: *ends, length: if planar { 0.0 } else { length(*ends) } });
    let across = pairs.iter().flat_map(|pair| {
        let first = pair.terms[0].0;
        pair.terms[1..].iter().map(move |(v, _)| Link { ends: [first, *v], length: pair.distance })
    });
    let coupled = coupling
        .rows()
        .flat_map(|(v, row)| row.iter().map(move |(k, _)| Link { ends: [v, *k], length: 0.0 }));
    along.chain(across).chain(coupled).collect()
}
