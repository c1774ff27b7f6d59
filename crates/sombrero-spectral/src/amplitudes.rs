//! How strong each field is to be.
//!
//! With candidate fields of unit visibility, S_ij = z_iᵀ E z_j and noise of variance s², amplitudes a_i² = p_i that
//! maximise the information log det (1 + P^½ S P^½ / s²) at a given Σ p_i cost_i satisfy
//!
//! ```text
//! p_i cost_i ∝ 1 - s² [M⁻¹]_ii,      M = s² 1 + P^½ S P^½,
//! ```
//!
//! the share of coefficient i that survives the noise. (For independent fields this is the filling with water:
//! p = max(0, ν - s²/μ).) Repeating it converges (Silvey, Titterington and Torsney 1978); what another field tells
//! already dries up.

use crate::carry::Shifts;
use crate::envelope::{Envelope, dot};
use crate::evidence::Evidence;
use nalgebra::Vector3;

/// S, by rows.
pub(crate) fn gram(fields: &[Shifts], evidence: &Evidence, vertices: usize) -> Vec<Vec<f64>> {
    let m = fields.len();
    let explained: Vec<Vec<f64>> =
        fields.iter().map(|f| evidence.explained(f.moves.iter().map(|(v, d)| (*v, d)))).collect();
    let mut at: Vec<Vec<(usize, Vector3<f64>)>> = vec![Vec::new(); vertices];
    for (i, field) in fields.iter().enumerate() {
        field.moves.iter().for_each(|(v, d)| at[*v as usize].push((i, *d)));
    }
    let mut s = vec![vec![0.0; m]; m];
    for (v, here) in (0..).zip(&at) {
        for (k, (i, d)) in here.iter().enumerate() {
            let weighed = evidence.weigh(v, d);
            here[..=k].iter().for_each(|(j, e)| s[*i][*j] += weighed.dot(e));
        }
    }
    for i in 0..m {
        for j in 0..=i {
            s[i][j] -= dot(&explained[i], &explained[j]);
            s[j][i] = s[i][j];
        }
    }
    s
}

/// What fields cost.
pub(crate) struct Costs {
    /// G of each.
    pub(crate) seen: Vec<f64>,
    /// Σ A |dn|² of each, and what their sum is to be.
    pub(crate) turned: Vec<f64>,
    pub(crate) turn: f64,
    /// Σ A (n · d)² of each, and what their sum may be at most.
    pub(crate) moved: Vec<f64>,
    pub(crate) reach: f64,
}

/// p, given S, the costs and s².
pub(crate) fn filled(s: &[Vec<f64>], costs: &Costs, variance: f64) -> Vec<f64> {
    filled_at(s, &costs.seen, costs, variance)
}

/// The same, with displacements made dearer until they are within reach.
pub(crate) fn filled_within_reach(s: &[Vec<f64>], costs: &Costs, variance: f64) -> Vec<f64> {
    const HALVINGS: usize = 5;
    let spent = |p: &[f64]| dot(p, &costs.moved);
    let unit = costs.moved.len() as f64 / costs.moved.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let at = |dearer: f64| {
        let pairs = costs.seen.iter().zip(&costs.moved);
        let price: Vec<f64> = pairs.map(|(seen, moved)| seen + dearer * unit * moved).collect();
        filled_at(s, &price, costs, variance)
    };
    let free = filled(s, costs, variance);
    if spent(&free) <= costs.reach {
        return free;
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut best = at(high);
    while spent(&best) > costs.reach && high < 1e3 {
        (low, high) = (high, 4.0 * high);
        best = at(high);
    }
    for _ in 0..HALVINGS {
        let middle = (low + high) / 2.0;
        let p = at(middle);
        if spent(&p) <= costs.reach {
            (high, best) = (middle, p);
        } else {
            low = middle;
        }
    }
    let factor = (costs.reach / spent(&best)).min(1.0);
    best.into_iter().map(|p| p * factor).collect()
}

fn filled_at(s: &[Vec<f64>], price: &[f64], costs: &Costs, variance: f64) -> Vec<f64> {
    const ROUNDS: usize = 6;
    let m = s.len();
    let normalised = |p: Vec<f64>| {
        let spent = dot(&p, &costs.turned);
        let factor = if spent > 0.0 { costs.turn / spent } else { 0.0 };
        p.into_iter().map(|x| x * factor).collect::<Vec<f64>>()
    };
    let mut p = normalised(price.iter().map(|c| 1.0 / c).collect());
    for _ in 0..ROUNDS {
        let roots: Vec<f64> = p.iter().map(|x| x.sqrt()).collect();
        let mut matrix = Envelope::zeros(vec![0; m]);
        for i in 0..m {
            (0..=i).for_each(|j| matrix.add(i, j, roots[i] * roots[j] * s[i][j] / variance));
            matrix.add(i, i, 1.0);
        }
        let inverse = matrix.factor().inverse_diagonal();
        p = normalised(inverse.iter().zip(price).map(|(x, c)| (1.0 - x).max(0.0) / c).collect());
    }
    p
}
