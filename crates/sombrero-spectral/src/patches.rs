//! Overlapping pieces of a surface, each the vertices nearest to a centre along edges.
//!
//! Functions that live on a piece survive where the piece does, and cost memory and time in proportion to it. A planar
//! region moves as a whole or not at all, so each has a piece that grows around it, beside those that grow around
//! points of the curved surface and leave planes in their place.

use crate::planes::Planes;
use crate::surface::{Rings, Surface};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A surface as a graph.
pub(crate) struct Graph<'a> {
    surface: &'a Surface,
    rings: &'a Rings,
    /// The vertices of each set of planar regions whose offsets hang together.
    bodies: Vec<Vec<u32>>,
    /// The bodies that each vertex belongs to.
    body_of: Vec<Vec<u32>>,
}

/// A length that can be compared.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Length(f64);

impl Eq for Length {}

impl PartialOrd for Length {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Length {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl<'a> Graph<'a> {
    pub(crate) fn new(surface: &'a Surface, rings: &'a Rings, planes: &Planes, vertex: &[u32]) -> Self {
        let moved = planes.moved_by();
        let mut body = vec![u32::MAX; planes.count()];
        for regions in &moved {
            // Regions that depend on one offset, and all bodies that they are in already, become one.
            let known: Vec<u32> =
                regions.iter().map(|&r| body[r as usize]).filter(|&b| b != u32::MAX).collect();
            let name = known.iter().copied().min().unwrap_or(regions[0]);
            body.iter_mut().filter(|b| known.contains(b)).for_each(|b| *b = name);
            regions.iter().for_each(|&r| body[r as usize] = name);
        }
        let mut bodies = vec![Vec::new(); planes.count()];
        let mut body_of = vec![Vec::new(); vertex.len()];
        for (v, &full) in (0..).zip(vertex) {
            // Regions that other planes hold in their place move with nothing.
            let moving = planes.regions(full).iter().map(|&r| body[r as usize]).filter(|&b| b != u32::MAX);
            let mut names: Vec<u32> = moving.collect();
            names.sort_unstable();
            names.dedup();
            names.iter().for_each(|&b| bodies[b as usize].push(v));
            body_of[v as usize] = names;
        }
        Self { surface, rings, bodies, body_of }
    }

    /// Vertices by distance from the nearest of `seeds`, until `enough` says so.
    fn walk(&self, seeds: &[u32], mut enough: impl FnMut(u32, f64) -> bool) {
        let mut distance = vec![f64::INFINITY; self.surface.points.len()];
        let mut done = vec![false; distance.len()];
        let mut queue = BinaryHeap::new();
        for &seed in seeds {
            distance[seed as usize] = 0.0;
            queue.push(Reverse((Length(0.0), seed)));
        }
        while let Some(Reverse((Length(length), v))) = queue.pop() {
            if std::mem::replace(&mut done[v as usize], true) {
                continue;
            }
            if enough(v, length) {
                return;
            }
            let from = self.surface.points[v as usize];
            for &w in self.rings.of(v) {
                let length = length + (self.surface.points[w as usize] - from).norm();
                if length < distance[w as usize] {
                    distance[w as usize] = length;
                    queue.push(Reverse((Length(length), w)));
                }
            }
        }
    }

    /// The bodies that lie in planes, and `count` points of the curved surface, each as far as possible from those
    /// before it.
    pub(crate) fn seeds(&self, count: usize) -> Vec<Vec<u32>> {
        let mut seeds: Vec<Vec<u32>> = self.bodies.iter().filter(|b| !b.is_empty()).cloned().collect();
        let curved: Vec<bool> = self.body_of.iter().map(Vec::is_empty).collect();
        let mut nearest = vec![f64::INFINITY; curved.len()];
        let Some(first) = curved.iter().position(|c| *c) else { return seeds };
        let mut next = first as u32;
        for _ in 0..count {
            seeds.push(vec![next]);
            self.walk(&[next], |v, length| {
                let known = &mut nearest[v as usize];
                *known = known.min(length);
                false
            });
            let open = nearest.iter().enumerate().filter(|(v, _)| curved[*v]);
            let (furthest, length) =
                open.fold((0, -1.0), |best, (v, &length)| if length > best.1 { (v, length) } else { best });
            if length <= 0.0 {
                break;
            }
            next = furthest as u32;
        }
        seeds
    }

    /// The vertices nearest to `seeds`, nearest first, that hold `weight` of all weights, with each vertex's own. Seeds
    /// do not count.
    pub(crate) fn piece(&self, seeds: &[u32], weights: &[f64], weight: f64) -> Vec<u32> {
        let mut members = Vec::new();
        let mut sum = 0.0;
        self.walk(seeds, |v, length| {
            if sum >= weight {
                return true;
            }
            members.push(v);
            sum += if length > 0.0 { weights[v as usize] } else { 0.0 };
            false
        });
        members
    }
}
