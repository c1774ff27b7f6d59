//! The best fields of every piece of the surface.

use crate::FieldsOptions;
use crate::carry::Shifts;
use crate::evidence::Evidence;
use crate::patches::Graph;
use crate::piece::{Whole, best};
use crate::planes::Planes;
use crate::surface::Surface;
use crate::visibility::{Term, face_terms, hinge_term};
use crate::walls::{Keeping, joined};
use rayon::prelude::*;

/// Per-vertex weight of |d|²: no length of the model is left to it, it only makes G definite. (L = 1 in largest sides.)
const LENGTH: f64 = 1.0;
/// Against rounding.
const RIDGE: f64 = 1e-9;
/// What area in planes counts for when a piece's share is measured: it carries next to nothing.
const PLANAR: f64 = 0.1;
/// Applications of the operator on each piece for as many fields as are wanted: enough for mixtures as good as the
/// eigenvectors.
const STEPS: usize = 40;

/// The best fields of every piece of a level, whose vertices have these `names` in the full mesh; what is narrow counts where
/// there is something to keep.
pub(crate) fn candidates(
    level: &Surface,
    planes: &Planes,
    names: &[u32],
    evidence: &Evidence,
    keeping: Option<&Keeping>,
    options: &FieldsOptions,
) -> Vec<Shifts> {
    let areas = level.vertex_areas();
    let narrow = keeping.map_or_else(Vec::new, |keeping| keeping.terms(level, &areas));
    let rings = joined(level, &narrow);
    let (terms, terms_of) = terms(level, narrow);
    let length = LENGTH * level.side;
    let ridge = RIDGE * level.area / (level.side * level.side);
    let mass: Vec<f64> = areas.iter().map(|a| a / (length * length) + ridge).collect();
    let whole = Whole {
        rings: &rings,
        planes,
        full: names,
        terms: &terms,
        terms_of: &terms_of,
        mass: &mass,
        evidence,
    };
    let graph = Graph::new(level, &rings, planes, names);
    let seeds = graph.seeds(options.pieces);
    let weigh = |(&area, &v): (&f64, &u32)| if planes.regions(v).is_empty() { area } else { PLANAR * area };
    let weights: Vec<f64> = areas.iter().zip(names).map(weigh).collect();
    let weight = options.share * weights.iter().sum::<f64>();
    let of_seeds = |seeds: &Vec<u32>| {
        let members = graph.piece(seeds, &weights, weight);
        best(&whole, &members, options.of_each, STEPS)
    };
    let found: Vec<Vec<Shifts>> = seeds.par_iter().map(of_seeds).collect();
    found.into_iter().flatten().collect()
}

/// All terms of G, those of what is `narrow` among them, and which of them each vertex takes part in.
fn terms(level: &Surface, narrow: Vec<Term>) -> (Vec<Term>, Vec<Vec<u32>>) {
    let mut terms = narrow;
    terms.extend((0..level.triangles.len()).flat_map(|f| face_terms(level, f)));
    terms.extend(level.hinges.iter().filter_map(|h| hinge_term(level, h)));
    let mut terms_of = vec![Vec::new(); level.points.len()];
    for (number, term) in (0_u32..).zip(&terms) {
        term.vertices[..term.count].iter().for_each(|&v| terms_of[v as usize].push(number));
    }
    (terms, terms_of)
}
