//! How far walls and gaps let a mark move them.
//!
//! Where two places face each other at a distance D along u, a mark changes D by ε Σ_i (u · r_i) w_i, where r_i is what
//! function i moves the two apart by. With w standard Gaussian this is Gaussian, and hardly ever more than 4.5 deviations. So
//! that D keeps nine tenths,
//!
//! ```text
//! 4.5 ε √(Σ_i (u · r_i)²) ≤ 0.08 D
//! ```
//!
//! must hold for all such pairs. A face is such a pair too: a corner and the longest edge that it faces, so that one that is
//! thinner than a mark moves does not fold ([`thin`]). Two ways lead there: whole functions are made weaker ([`functions`]), or
//! all functions are where it is narrow ([`points`]). The first keeps functions what they are, the second what is far from a
//! narrow place; the one that leaves more of the functions is taken. What normals then turn less in all is made up by all
//! functions alike, as far as walls let it and nothing is seen of it. All of it follows from B and ε, before there is a
//! watermark.

mod functions;
mod points;
mod thin;
mod walls;

use nalgebra::Vector3;
use sombrero_basis::Basis;
use sombrero_coupling::{Assembly, Coupling};
use sombrero_spectral::Onlooker;
use walls::Walls;

/// How much stronger functions are made at most where no wall limits them.
const GAIN: f64 = 4.0;

/// How often the gain is set anew.
const ROUNDS: usize = 4;

/// A gain that would change by less stays.
const NEAR: f64 = 0.02;

/// The basis of fields with walls and gaps kept at ε; `None` where none of them is in danger.
pub(crate) fn kept_apart(
    basis: &Basis,
    assembly: &Assembly<'_>,
    coupling: &Coupling,
    side: f64,
    epsilon: f64,
) -> Option<Basis> {
    let displacements = displacements(basis);
    let walls = Walls::find(basis, &displacements, assembly, epsilon, GAIN);
    if !walls.bind(1.0) {
        return None;
    }
    let links = points::links(assembly, coupling, &walls.pairs, side);
    let changes = functions::changes(basis, &walls);
    let limited = |gain: f64| {
        let by_point = points::limited(basis, &walls, &links, gain);
        let Some(changes) = &changes else { return by_point };
        let by_function = functions::limited(basis, changes, walls.pairs.len(), gain);
        if left(&by_function, basis) >= left(&by_point, basis) { by_function } else { by_point }
    };
    let onlooker = Onlooker::new(assembly.points, assembly.triangles);
    let (mut gain, mut kept) = (1.0, limited(1.0));
    for _ in 0..ROUNDS {
        let next = (gain * room(&onlooker, &kept)).min(GAIN);
        if (next / gain - 1.0).abs() < NEAR {
            break;
        }
        gain = next;
        kept = limited(gain);
    }
    // Where walls let other functions grow than those that were weakened, more may be seen than was reckoned with.
    let room = room(&onlooker, &kept).min(1.0);
    if room < 1.0 {
        kept = scaled(&kept, |_, _| room);
    }
    Some(kept)
}

/// What each function does at a point, in order of functions.
type Displacements = Vec<(u32, Vector3<f64>)>;

/// Those of all points.
fn displacements(basis: &Basis) -> Vec<Displacements> {
    let mut at = vec![Vec::new(); basis.vertex_count()];
    for i in 0..basis.functions().len() {
        crate::coupled::each(basis, i, |row, d| at[row].push((i as u32, d)));
    }
    at
}

/// How much stronger all may become until as much is seen as may be.
fn room(onlooker: &Onlooker, basis: &Basis) -> f64 {
    let room = onlooker.sight(&displacements(basis)).room();
    if room.is_finite() { room } else { 1.0 }
}

/// Σ_i log(0.01 + the share of function i's squares that is left).
fn left(limited: &Basis, basis: &Basis) -> f64 {
    let squares = |basis: &Basis, i| {
        let mut sum = 0.0;
        crate::coupled::each(basis, i, |_, d: Vector3<f64>| sum += d.norm_squared());
        sum
    };
    let share = |i| squares(limited, i) / squares(basis, i).max(f64::MIN_POSITIVE);
    (0..basis.functions().len()).map(|i| libm::log(0.01 + share(i))).sum()
}

/// The basis with each vector times a factor, given its function and its point.
fn scaled(basis: &Basis, factor: impl Fn(usize, usize) -> f64) -> Basis {
    let (mut lengths, mut rows, mut values) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..basis.functions().len() {
        let before = rows.len();
        crate::coupled::each(basis, i, |row, d| {
            rows.push(row);
            values.push(d * factor(i, row));
        });
        lengths.push(rows.len() - before);
    }
    Basis::from_vectors(basis.vertex_count(), &lengths, rows, values)
        .expect("the entries are where they were, and finite")
}
