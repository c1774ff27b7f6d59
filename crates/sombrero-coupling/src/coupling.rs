//! What is left of a field of displacements when nothing may come apart.

use crate::follow::{Follow, Following, following};
use crate::meet::{Group, groups, meeting};
use crate::parts::Parts;
use crate::sites::Sites;
use crate::solve::{Equation, Terms, eliminate};
use nalgebra::{Matrix3, Point3, Vector3};
use sombrero_mesh::Edges;
use std::collections::{BTreeMap, BTreeSet};

/// Points as they are shown, over which displacements are to be coupled.
#[derive(Debug, Clone, Copy)]
pub struct Assembly<'a> {
    /// Where each point stands first, in model units. Those that were to be [joined](crate::join()) are one.
    pub points: &'a [Point3<f64>],
    /// Corners of triangles.
    pub triangles: &'a [[u32; 3]],
    /// How far each point [reaches](crate::reach()) for others that it meets, in model units.
    pub reach: &'a [f64],
    /// Where points are shown besides.
    pub places: &'a [Shown],
    /// Whether points without a triangle are drawn. Otherwise they are nowhere, and meet nothing.
    pub draws_loose: bool,
}

/// A further place of some points: an affine map of where they stand first.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The points, ascending.
    pub points: Vec<u32>,
    /// What becomes of directions.
    pub linear: Matrix3<f64>,
    /// Where the origin goes, in model units.
    pub shift: Vector3<f64>,
}

impl Shown {
    pub(crate) fn at(&self, position: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.linear * position.coords + self.shift)
    }
}

/// Points and their weights.
pub type Weights = Vec<(u32, f64)>;

/// A linear map of displacements d to those that keep together what meets: d'_v = Σ_k W_vk d_k.
///
/// It follows from the geometry alone. Points without a row move as they would without it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coupling {
    rows: BTreeMap<u32, Vec<(u32, Matrix3<f64>)>>,
}

impl Coupling {
    /// The coupling of an assembly, in O(n log n) for n points at all places.
    ///
    /// # Panics
    /// When a corner or a point of a place is not below the number of points, or `reach` is shorter.
    pub fn new(assembly: &Assembly<'_>) -> Self {
        let edges = Edges::new(assembly.points.len(), assembly.triangles);
        let parts = Parts::new(assembly.points, assembly.triangles, &edges);
        let shown = |part: &u32| *part != u32::MAX || assembly.draws_loose;
        let loose = parts.of_point.iter().filter(|part| shown(part)).any(|part| *part != 0);
        let one_and_closed =
            assembly.places.is_empty() && !loose && edges.sides.iter().all(|sides| *sides > 1);
        if one_and_closed && meeting(assembly.points, assembly.reach).is_empty() {
            return Self::default();
        }
        let sites = Sites::new(assembly, &edges);
        let groups = groups(&sites, assembly.reach);
        let following = match one_and_closed {
            true => Following::default(),
            false => following(assembly, &sites, &edges, &parts),
        };
        if groups.is_empty() && following.rows.is_empty() {
            return Self::default();
        }
        Solver::new(groups, following.rows, &following.held).coupling()
    }

    /// Whether every point moves as it would alone.
    pub fn is_free(&self) -> bool {
        self.rows.is_empty()
    }

    /// The points that are not free, ascending, each with k and W_vk, ascending.
    pub fn rows(&self) -> impl Iterator<Item = (u32, &[(u32, Matrix3<f64>)])> {
        self.rows.iter().map(|(v, row)| (*v, row.as_slice()))
    }

    /// W_vk as numbers where all of them are multiples of the identity.
    pub fn weights(&self) -> Option<Vec<(u32, Weights)>> {
        let weight = |map: &Matrix3<f64>| (*map == Matrix3::identity() * map.m11).then_some(map.m11);
        let row = |(v, row): (u32, &[(u32, Matrix3<f64>)])| {
            Some((v, row.iter().map(|(k, map)| Some((*k, weight(map)?))).collect::<Option<_>>()?))
        };
        self.rows().map(row).collect()
    }

    /// d' for d, one displacement a point.
    ///
    /// # Panics
    /// When there are fewer displacements than points.
    pub fn apply(&self, displacements: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut moved = displacements.to_vec();
        for (v, row) in self.rows() {
            moved[v as usize] = row.iter().map(|(k, map)| map * displacements[*k as usize]).sum();
        }
        moved
    }
}

/// Groups and followers, put together.
struct Solver {
    groups: Vec<Group>,
    /// The group of each point that meets another, and its G.
    member: BTreeMap<u32, (usize, Matrix3<f64>)>,
    follow: BTreeMap<u32, Follow>,
    /// Variables that stand still.
    held: BTreeSet<u32>,
}

impl Solver {
    fn new(groups: Vec<Group>, follow: BTreeMap<u32, Follow>, held: &[u32]) -> Self {
        let mut member = BTreeMap::new();
        for (number, group) in groups.iter().enumerate() {
            member.extend(group.members.iter().map(|(point, map)| (*point, (number, *map))));
        }
        let mut solver = Self { groups, member, follow, held: BTreeSet::new() };
        solver.held = held.iter().map(|&point| solver.variable(point).0).collect();
        solver
    }

    /// What a point's displacement is a multiple of, and by which map: of that of the first of its group, or its own.
    fn variable(&self, point: u32) -> (u32, Matrix3<f64>) {
        match self.member.get(&point) {
            Some((group, map)) => (self.groups[*group].members[0].0, *map),
            None => (point, Matrix3::identity()),
        }
    }

    /// P, of a variable.
    fn free(&self, variable: u32) -> Matrix3<f64> {
        self.member.get(&variable).map_or_else(Matrix3::identity, |(group, _)| self.groups[*group].free)
    }

    /// The variables that follow, each with the first thing that a point of it follows. One that would have to follow
    /// two, or is not free to follow in every direction, stands still.
    fn leaders(&mut self) -> BTreeMap<u32, (Matrix3<f64>, Follow)> {
        let mut leaders: BTreeMap<u32, (Matrix3<f64>, Follow)> = BTreeMap::new();
        for (point, follow) in std::mem::take(&mut self.follow) {
            let (variable, map) = self.variable(point);
            let bound = self.free(variable) != Matrix3::identity() || leaders.contains_key(&variable);
            if !bound {
                leaders.insert(variable, (map, follow));
            } else if follow.own == 0.0 {
                let on: Vec<u32> = follow.terms.iter().map(|(k, _)| self.variable(*k).0).collect();
                self.held.extend(on);
                self.held.insert(variable);
            }
        }
        leaders
    }

    /// z_f = G_f⁻¹ (o_f G_f y_f + Σ W_k G_k z_k)
    fn equations(&mut self) -> BTreeMap<u32, Equation> {
        let leaders = self.leaders();
        let held = |variable: &u32| self.held.contains(variable);
        let mut equations = BTreeMap::new();
        for (&f, (map, follow)) in leaders.iter().filter(|(f, _)| !held(f)) {
            let mut equation = Equation::default();
            if follow.own > 0.0 {
                equation.alone.insert(f, Matrix3::identity() * follow.own);
            }
            // The map of a group's member can be undone: it is made of maps that can.
            let back = map.try_inverse().unwrap_or_default();
            for (point, weight) in &follow.terms {
                let (k, to) = self.variable(*point);
                if held(&k) {
                    continue;
                }
                let terms =
                    if leaders.contains_key(&k) { &mut equation.followers } else { &mut equation.alone };
                *terms.entry(k).or_insert_with(Matrix3::zeros) += back * weight * to;
            }
            equations.insert(f, equation);
        }
        equations
    }

    /// y of a variable, in displacements of points: P times the mean of its group's.
    fn alone(&self, variable: u32) -> Vec<(u32, Matrix3<f64>)> {
        let Some((group, _)) = self.member.get(&variable) else {
            return vec![(variable, Matrix3::identity())];
        };
        let Group { members, free } = &self.groups[*group];
        let share = |(point, map): &(u32, Matrix3<f64>)| {
            (*point, free * map.try_inverse().unwrap_or_default() / members.len() as f64)
        };
        members.iter().map(share).collect()
    }

    fn coupling(mut self) -> Coupling {
        let solved = eliminate(self.equations());
        let mut points: BTreeSet<u32> = self.member.keys().copied().collect();
        points.extend(solved.keys().chain(&self.held));
        let row = |point: u32| {
            let (variable, map) = self.variable(point);
            let mut row = Terms::new();
            if !self.held.contains(&variable) {
                let alone = [(variable, Matrix3::identity())].into();
                for (&k, outer) in solved.get(&variable).unwrap_or(&alone) {
                    for (point, inner) in self.alone(k) {
                        *row.entry(point).or_insert_with(Matrix3::zeros) += map * outer * inner;
                    }
                }
            }
            (point, row.into_iter().filter(|(_, map)| map.amax() > 0.0).collect())
        };
        Coupling { rows: points.into_iter().map(row).collect() }
    }
}
