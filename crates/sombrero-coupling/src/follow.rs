//! Points that lie on something, and move as the place does that they lie on.
//!
//! - On an edge between its ends (a T-junction): d = (1 - t) d_a + t d_b.
//! - Near a larger part, as clothes are near a body, or lines near the surface that they are drawn on: as its closest
//!   point, d = Σ w_k d_k with the weights of that in its triangle. It fades: from a hundredth of the model away to two
//!   the point takes back its own displacement. So moves a layer, which has a rim or lies near with more than half of its
//!   area, and what touches or cuts the larger part. A solid that stands beside it with clearance is free: its near side would go
//!   along and its far side would not, which bends it.

use crate::Assembly;
use crate::clearance::clear;
use crate::parts::Parts;
use crate::sites::{Sites, same};
use nalgebra::Matrix3;
use sombrero_mesh::{Edges, geometry};
use sombrero_spatial::Surface;
use std::collections::BTreeMap;

/// So near, in sides of the largest part, a layer moves as what it lies on.
const NEAR: f64 = 0.01;

/// And here it no longer does.
const FAR: f64 = 2.0 * NEAR;

/// And so near a solid touches it.
const TOUCHING: f64 = 0.1 * NEAR;

/// An end of an edge is at least this many reaches away from a point on it.
const ENDS: f64 = 2.0;

/// What a point follows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Follow {
    /// How much of its own displacement is left, 0 to 1.
    pub(crate) own: f64,
    /// Points and the maps of their displacements.
    pub(crate) terms: Vec<(u32, Matrix3<f64>)>,
}

/// What points follow, and which of them cannot follow all that they would have to.
#[derive(Debug, Default)]
pub(crate) struct Following {
    pub(crate) rows: BTreeMap<u32, Follow>,
    pub(crate) held: Vec<u32>,
}

impl Following {
    /// Another thing that a point lies on: the same as before, or too much.
    fn add(&mut self, point: u32, follow: Follow) {
        match self.rows.get(&point) {
            None => {
                self.rows.insert(point, follow);
            }
            Some(known) if known.is(&follow) => {}
            Some(known) => {
                let on = known.terms.iter().chain(&follow.terms);
                self.held
                    .extend(on.filter(|_| follow.own == 0.0 && known.own == 0.0).map(|(point, _)| *point));
                self.held.push(point);
            }
        }
    }
}

impl Follow {
    fn is(&self, other: &Self) -> bool {
        self.own == other.own
            && self.terms.len() == other.terms.len()
            && self.terms.iter().zip(&other.terms).all(|((a, m), (b, n))| a == b && same(m, n))
    }
}

/// Everything that follows.
pub(crate) fn following(assembly: &Assembly<'_>, sites: &Sites, edges: &Edges, parts: &Parts) -> Following {
    let mut found = Following::default();
    on_edges(assembly, sites, edges, parts, &mut found);
    let mut near = Following::default();
    on_larger_parts(assembly, sites, edges, parts, &mut near);
    near.held.retain(|point| !found.rows.contains_key(point));
    found.held.extend(near.held);
    for (point, follow) in near.rows {
        found.rows.entry(point).or_insert(follow);
    }
    found.held.sort_unstable();
    found.held.dedup();
    found
}

/// Points in the middle of the edges of other parts, or of open edges of their own.
fn on_edges(assembly: &Assembly<'_>, sites: &Sites, edges: &Edges, parts: &Parts, found: &mut Following) {
    let open: Vec<bool> = edges.sides.iter().map(|sides| *sides == 1).collect();
    let all = parts.count > 1;
    let mut at_rim = vec![false; assembly.points.len()];
    for (ends, _) in edges.ends.iter().zip(&open).filter(|(_, open)| **open) {
        ends.iter().for_each(|&v| at_rim[v as usize] = true);
    }
    let mut part_of = vec![u32::MAX; edges.len()];
    let mut opposite = vec![u32::MAX; edges.len()];
    for (side, &edge) in edges.of_side.iter().enumerate() {
        part_of[edge as usize] = parts.of_triangle[side / 3];
        opposite[edge as usize] = assembly.triangles[side / 3][(side + 2) % 3];
    }
    // An edge is a triangle of no area: from one end to the other, and back.
    let candidates: Vec<usize> =
        (0..sites.segments.len()).filter(|&s| all || open[sites.edge[s] as usize]).collect();
    let ends: Vec<[u32; 3]> = candidates.iter().map(|&s| sites.segments[s]).map(|[a, b]| [a, b, b]).collect();
    if ends.is_empty() {
        return;
    }
    let surface = Surface::new(&sites.at, &ends);
    for (site, (p, &point)) in (0..).zip(sites.at.iter().zip(&sites.point)) {
        let (rim, part) = (at_rim[point as usize], parts.of_point[point as usize]);
        if !(all || rim) {
            continue;
        }
        let reach = assembly.reach[point as usize];
        let accept = |face: u32| {
            let (segment, edge) = (ends[face as usize], sites.edge[candidates[face as usize]] as usize);
            let own = part_of[edge] == part;
            let its = |site: u32| sites.point[site as usize] == point;
            let far = |site: u32| (sites.at[site as usize] - p).norm() > ENDS * reach;
            (!own || (rim && open[edge]))
                && !(its(segment[0]) || its(segment[1]))
                && (opposite[edge] != point || sites.place[segment[0] as usize] != sites.place[site as usize])
                && far(segment[0])
                && far(segment[1])
        };
        if let Some(closest) = surface.closest_where(p, reach, accept) {
            let [a, b, _] = ends[closest.face as usize];
            let [s, t, u] = closest.barycentric;
            found.add(point, follow(sites, site, 0.0, &[(a, s), (b, t + u)]));
        }
    }
}

/// Points near parts that are larger than theirs, and points without a triangle near any.
fn on_larger_parts(
    assembly: &Assembly<'_>,
    sites: &Sites,
    edges: &Edges,
    parts: &Parts,
    found: &mut Following,
) {
    let smaller = |point: u32| parts.of_point[point as usize] > 0;
    if parts.count == 0 || !sites.point.iter().any(|&point| smaller(point)) {
        return;
    }
    let surface = Surface::new(&sites.at, &sites.triangles);
    let mut near = Vec::new();
    for (site, (p, &point)) in (0..).zip(sites.at.iter().zip(&sites.point)) {
        let part = parts.of_point[point as usize];
        let accept = |face: u32| parts.of_triangle[sites.face[face as usize] as usize] < part;
        let closest = if smaller(point) { surface.closest_where(p, FAR * parts.side, accept) } else { None };
        near.extend(closest.map(|closest| (site, own_share(closest.distance() / parts.side), closest)));
    }
    let mut along = vec![0.0_f64; assembly.points.len()];
    for (site, own, _) in &near {
        let along = &mut along[sites.point[*site as usize] as usize];
        *along = along.max(1.0 - own);
    }
    let solids = solids(assembly, edges, parts, &along);
    let free = clear(sites, &surface, parts, &solids, TOUCHING * parts.side);
    for (site, own, closest) in near {
        let point = sites.point[site as usize];
        if !free.get(parts.of_point[point as usize] as usize).is_some_and(|free| *free) {
            let corners = sites.triangles[closest.face as usize];
            let weights = [0, 1, 2].map(|k| (corners[k], closest.barycentric[k]));
            found.add(point, follow(sites, site, own, &weights));
        }
    }
}

/// Which parts with points that would go along with a larger one, as far as `along` says, are no layers: they have no rim, and more
/// than half of their area would stay.
fn solids(assembly: &Assembly<'_>, edges: &Edges, parts: &Parts, along: &[f64]) -> Vec<bool> {
    let mut solid = vec![false; parts.count];
    let mut more_than_half = vec![0.0; parts.count];
    for (corners, &part) in assembly.triangles.iter().zip(&parts.of_triangle) {
        let [a, b, c] = corners.map(|v| &assembly.points[v as usize]);
        let share: f64 = corners.iter().map(|&v| along[v as usize] / 3.0).sum();
        solid[part as usize] |= share > 0.0;
        more_than_half[part as usize] += geometry::area_vector(a, b, c).norm() * (share - 0.5);
    }
    for (side, &edge) in edges.of_side.iter().enumerate() {
        solid[parts.of_triangle[side / 3] as usize] &= edges.sides[edge as usize] != 1;
    }
    solid.iter().zip(more_than_half).map(|(solid, more)| *solid && more <= 0.0).collect()
}

/// 0 near, 1 far, and smooth between.
fn own_share(distance: f64) -> f64 {
    let x = ((distance - NEAR) / (FAR - NEAR)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The point at `site` follows these sites with these weights.
fn follow(sites: &Sites, site: u32, own: f64, weights: &[(u32, f64)]) -> Follow {
    let terms = weights.iter().filter(|(_, weight)| *weight > 0.0);
    let term = |&(from, weight): &(u32, f64)| {
        (sites.point[from as usize], sites.carried(from, site) * ((1.0 - own) * weight))
    };
    Follow { own, terms: terms.map(term).collect() }
}
