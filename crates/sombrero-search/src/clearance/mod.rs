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

use sombrero_basis::Basis;
use sombrero_coupling::{Assembly, Coupling};
use sombrero_spectral::{Columns, FieldsOptions, Here, Onlooker};
use walls::Walls;

/// How much stronger functions are made at most where no wall limits them.
const GAIN: f64 = 4.0;

/// How often the gain is set anew.
const ROUNDS: usize = 4;

/// A gain that would change by less stays.
const NEAR: f64 = 0.02;

/// The basis of fields with walls and gaps kept at ε.
pub(crate) fn kept_apart(
    basis: Basis,
    assembly: &Assembly<'_>,
    coupling: &Coupling,
    side: f64,
    epsilon: f64,
) -> Basis {
    let functions = basis.functions().len();
    // Both take as much memory as all else together.
    let rows = basis.all_rows();
    drop(basis);
    let at: Vec<&Here> = rows.iter().collect();
    let limits = limits(&at, functions, assembly, coupling, side, epsilon);
    let factor =
        |i: u32, point: u32| limits.as_ref().map_or(1.0, |limits| limits.factor(i as usize, point as usize));
    let columns = Columns::new(&at, functions, factor);
    drop(at);
    drop(rows);
    Basis::of_columns(assembly.points.len(), columns)
}

/// What keeps walls and gaps at ε, given what each of so many functions does at each point; `None` where none of them is in
/// danger.
fn limits(
    at: &[&Here],
    functions: usize,
    assembly: &Assembly<'_>,
    coupling: &Coupling,
    side: f64,
    epsilon: f64,
) -> Option<Limits> {
    let walls = Walls::find(at, functions, assembly, epsilon, GAIN);
    if !walls.bind(1.0) {
        return None;
    }
    let look = || {
        let onlooker = Onlooker::new(assembly.points, assembly.triangles);
        let links = points::links(assembly, coupling, &walls.pairs, &onlooker.planar(side));
        (onlooker, links)
    };
    let uses = || (functions::changes(&walls, at, functions), squares(at, functions, |_| 1.0));
    let ((onlooker, links), (changes, squares)) = rayon::join(look, uses);
    let limits = |gain: f64| {
        let by_point = || {
            let limits = points::limits(at.len(), &walls, &links, gain);
            (left(&limits, at, &squares), limits)
        };
        let by_function = || {
            let limits = functions::limits(changes.as_ref()?, walls.pairs.len(), gain);
            Some((left(&limits, at, &squares), limits))
        };
        let (by_point, by_function) = rayon::join(by_point, by_function);
        by_function.filter(|by_function| by_function.0 >= by_point.0).unwrap_or(by_point).1
    };
    let room = |limits: &Limits| {
        let sight = onlooker.sight(at, |i, point| limits.factor(i as usize, point as usize));
        let room = sight.room(&FieldsOptions::default());
        if room.is_finite() { room } else { 1.0 }
    };
    let (mut gain, mut kept) = (1.0, limits(1.0));
    let mut more = room(&kept);
    for _ in 0..ROUNDS {
        let next = (gain * more).min(GAIN);
        if (next / gain - 1.0).abs() < NEAR {
            break;
        }
        gain = next;
        kept = limits(gain);
        more = room(&kept);
    }
    // Where walls let other functions grow than those that were weakened, more may be seen than was reckoned with.
    Some(kept.times(more.min(1.0)))
}

/// What functions are multiplied by.
enum Limits {
    /// Each function, wherever it is.
    OfFunctions(Vec<f64>),
    /// All functions, at each point.
    OfPoints(Vec<f64>),
}

impl Limits {
    fn factor(&self, function: usize, point: usize) -> f64 {
        match self {
            Self::OfFunctions(factors) => factors[function],
            Self::OfPoints(factors) => factors[point],
        }
    }

    fn times(mut self, by: f64) -> Self {
        let (Self::OfFunctions(factors) | Self::OfPoints(factors)) = &mut self;
        factors.iter_mut().for_each(|factor| *factor *= by);
        self
    }
}

/// Σ_i log(0.01 + the share of function i's squares that is left); `whole` are all of them.
fn left(limits: &Limits, at: &[&Here], whole: &[f64]) -> f64 {
    let shares: Vec<f64> = match limits {
        Limits::OfFunctions(factors) => factors.iter().map(|factor| factor * factor).collect(),
        Limits::OfPoints(factors) => {
            let limited = squares(at, whole.len(), |point| factors[point]);
            limited.iter().zip(whole).map(|(limited, whole)| limited / whole.max(f64::MIN_POSITIVE)).collect()
        }
    };
    shares.into_iter().map(|share| libm::log(0.01 + share)).sum()
}

/// The sum of the squares of each function, whose vectors are multiplied by a factor, given the point.
fn squares(at: &[&Here], functions: usize, factor: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; functions];
    for (point, here) in at.iter().enumerate() {
        let factor = factor(point);
        here.iter().for_each(|(i, d)| sums[*i as usize] += (d * factor).norm_squared());
    }
    sums
}
