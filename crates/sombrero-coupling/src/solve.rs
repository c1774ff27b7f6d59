//! Followers of followers, solved for what moves by itself.
//!
//! Each follower f has an equation z_f = o_f y_f + Σ W_fk z_k, where y is what a variable would do alone. They are
//! eliminated one after the other, as Gauss does; where points follow each other in a circle, what is left over of the
//! circle divides:
//!
//! ```text
//! z_f = (I - W_ff)⁻¹ (…)
//! ```

use nalgebra::Matrix3;
use std::collections::{BTreeMap, BTreeSet};

/// A circle that leaves less than this to move by itself stands still.
const SINGULAR: f64 = 1e-6;

/// Variables with maps.
pub(crate) type Terms = BTreeMap<u32, Matrix3<f64>>;

/// An equation: what is taken of variables that follow nothing, and of followers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Equation {
    pub(crate) alone: Terms,
    pub(crate) followers: Terms,
}

fn add(terms: &mut Terms, variable: u32, map: Matrix3<f64>) {
    *terms.entry(variable).or_insert_with(Matrix3::zeros) += map;
}

/// The equations without followers on their right sides.
pub(crate) fn eliminate(mut equations: BTreeMap<u32, Equation>) -> BTreeMap<u32, Terms> {
    // Who follows whom.
    let mut users: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for (&f, equation) in &equations {
        equation.followers.keys().for_each(|&k| {
            users.entry(k).or_default().insert(f);
        });
    }
    let order: Vec<u32> = equations.keys().copied().collect();
    for f in order {
        let Some(mut solved) = equations.remove(&f) else { continue };
        if let Some(itself) = solved.followers.remove(&f) {
            solved = divided(solved, itself);
        }
        for g in users.remove(&f).unwrap_or_default() {
            let Some(user) = equations.get_mut(&g) else { continue };
            let Some(map) = user.followers.remove(&f) else { continue };
            solved.alone.iter().for_each(|(&k, inner)| add(&mut user.alone, k, map * inner));
            for (&k, inner) in &solved.followers {
                add(&mut user.followers, k, map * inner);
                users.entry(k).or_default().insert(g);
            }
        }
        equations.insert(f, solved);
    }
    equations.into_iter().map(|(f, equation)| (f, equation.alone)).collect()
}

/// The equation with z_f brought to the left; nothing where nothing would be left of it.
fn divided(equation: Equation, itself: Matrix3<f64>) -> Equation {
    let rest = Matrix3::identity() - itself;
    let Some(inverse) = rest.try_inverse().filter(|inverse| inverse.amax() < 1.0 / SINGULAR) else {
        return Equation::default();
    };
    let scaled = |terms: Terms| terms.into_iter().map(|(k, map)| (k, inverse * map)).collect();
    Equation { alone: scaled(equation.alone), followers: scaled(equation.followers) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(entries: &[(u32, f64)]) -> Terms {
        entries.iter().map(|&(k, w)| (k, Matrix3::identity() * w)).collect()
    }

    #[test]
    fn two_edges_on_one_line_that_overlap() {
        // Ends at 0 and 3, 1 and 4: 1 is a third of the way from 0 to 3, 3 two thirds from 1 to 4.
        let one = Equation { alone: terms(&[(0, 2.0 / 3.0)]), followers: terms(&[(3, 1.0 / 3.0)]) };
        let three = Equation { alone: terms(&[(4, 2.0 / 3.0)]), followers: terms(&[(1, 1.0 / 3.0)]) };
        let solved = eliminate([(1, one), (3, three)].into());
        // What is linear stays so: 0 at 0 and 4 at 4 bring 1 to 1 and 3 to 3.
        for (point, expected) in [(1, [0.75, 0.25]), (3, [0.25, 0.75])] {
            let row = &solved[&point];
            assert_eq!(row.keys().copied().collect::<Vec<_>>(), [0, 4]);
            for (map, expected) in row.values().zip(expected) {
                assert!((map - Matrix3::identity() * expected).amax() < 1e-15);
            }
        }
    }

    #[test]
    fn a_circle_that_nothing_moves_stands_still() {
        let equation = |k| Equation { alone: Terms::new(), followers: terms(&[(k, 1.0)]) };
        let solved = eliminate([(0, equation(1)), (1, equation(2)), (2, equation(0))].into());
        assert!(solved.values().all(|row| row.values().all(|map| map.amax() == 0.0)));
    }

    #[test]
    fn chains_end_where_something_moves_by_itself() {
        let link = |k| Equation { alone: Terms::new(), followers: terms(&[(k, 1.0)]) };
        let last = Equation { alone: terms(&[(9, 0.5)]), followers: Terms::new() };
        let solved = eliminate([(0, link(1)), (1, link(2)), (2, last)].into());
        assert!(solved.values().all(|row| *row == terms(&[(9, 0.5)])));
    }
}
