//! Points that meet somewhere: their displacements follow from one.
//!
//! Where the point p at a place with linear part A meets the point q at one with B, A d_p = B d_q. Along a tree of such
//! meetings every point of a group moves by d_p = G_p z with one z; every further meeting asks something of z, and what
//! is left for it is a subspace: all of space, the plane of a mirror, or nothing. Of what the points would do alone, z is
//! the mean, projected:
//!
//! ```text
//! z = P mean over p of G_p⁻¹ d_p
//! ```

use crate::pairs::close_pairs;
use crate::sites::{Sites, same, tidied};
use nalgebra::{Matrix3, Point3, RowVector3, Vector3};
use sombrero_mesh::connected;
use std::collections::{BTreeMap, BTreeSet};

/// A map that moves z by less than this has not been asked for.
const ASKED: f64 = 1e-7;

/// Groups of more points stand still: their displacement would be a mean of nearly everything.
const LARGEST: usize = 64;

/// Points that meet.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    /// Each with G_p; the first, of the smallest number, has the identity.
    pub(crate) members: Vec<(u32, Matrix3<f64>)>,
    /// P.
    pub(crate) free: Matrix3<f64>,
}

/// Points of one surface that meet, whatever connects them: groups of two at least, in order of their first points. O(n log n).
///
/// # Panics
/// When `reach` is shorter than `points`.
pub fn meeting(points: &[Point3<f64>], reach: &[f64]) -> Vec<Vec<u32>> {
    let pairs = close_pairs(points, reach);
    let leaders = connected(points.len(), pairs.iter().map(|pair| pair.ends));
    let mut groups: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for &v in pairs.iter().flat_map(|pair| &pair.ends) {
        groups.entry(leaders[v as usize]).or_default().insert(v);
    }
    groups.into_values().map(|group| group.into_iter().collect()).collect()
}

/// d_q = map · d_p for a meeting of two.
struct Meeting {
    to: u32,
    map: Matrix3<f64>,
}

/// All groups, by first member.
pub(crate) fn groups(sites: &Sites, reach: &[f64]) -> Vec<Group> {
    let reaches: Vec<f64> = sites.point.iter().map(|&v| reach[v as usize]).collect();
    let mut meetings: BTreeMap<u32, Vec<Meeting>> = BTreeMap::new();
    for pair in close_pairs(&sites.at, &reaches) {
        let [a, b] = pair.ends;
        for (from, to) in [(a, b), (b, a)] {
            let meeting = Meeting { to: sites.point[to as usize], map: sites.carried(from, to) };
            meetings.entry(sites.point[from as usize]).or_default().push(meeting);
        }
    }
    let mut maps: BTreeMap<u32, Matrix3<f64>> = BTreeMap::new();
    let mut found = Vec::new();
    for &first in meetings.keys() {
        if !maps.contains_key(&first) {
            let group = group(first, &meetings, &mut maps);
            // One that meets nothing but itself where it may is free.
            if group.members.len() > 1 || group.free != Matrix3::identity() {
                found.push(group);
            }
        }
    }
    found
}

fn group(
    first: u32,
    meetings: &BTreeMap<u32, Vec<Meeting>>,
    maps: &mut BTreeMap<u32, Matrix3<f64>>,
) -> Group {
    maps.insert(first, Matrix3::identity());
    let (mut members, mut asked) = (vec![(first, Matrix3::identity())], Asked::default());
    let mut next = 0;
    while let Some(&(point, map)) = members.get(next) {
        next += 1;
        for Meeting { to, map: step } in meetings.get(&point).into_iter().flatten() {
            let reached = tidied(step * map);
            match maps.get(to) {
                None => {
                    maps.insert(*to, reached);
                    members.push((*to, reached));
                }
                Some(known) if same(known, &reached) => {}
                Some(known) => (reached - known).row_iter().for_each(|row| asked.add(row.into_owned())),
            }
        }
    }
    let free = if members.len() > LARGEST { Matrix3::zeros() } else { asked.free() };
    Group { members, free }
}

/// Directions in which z must be 0, at right angles to each other.
#[derive(Default)]
struct Asked(Vec<Vector3<f64>>);

impl Asked {
    /// Asks for row · z = 0.
    fn add(&mut self, row: RowVector3<f64>) {
        let whole = row.norm();
        // Twice, so that what is left is at right angles to rounding.
        let rest = (0..2)
            .fold(row.transpose(), |rest, _| self.0.iter().fold(rest, |rest, u| rest - u * u.dot(&rest)));
        if rest.norm() > ASKED * (1.0 + whole) {
            self.0.push(rest / rest.norm());
        }
    }

    /// The projection to what is not asked to be 0.
    fn free(&self) -> Matrix3<f64> {
        if self.0.len() > 2 {
            return Matrix3::zeros();
        }
        self.0.iter().fold(Matrix3::identity(), |free, u| free - u * u.transpose())
    }
}
