//! Random order of vertices, faces and corners (row B). The shape stays as it is to the bit.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError};
use crate::operation::Operation;
use crate::spec::Given;
use rand::seq::SliceRandom;
use rand::{Rng, RngExt};
use sombrero_mesh::Soup;

/// Shuffles vertices and faces, and starts each face at a random corner.
pub fn reorder<R: Rng + ?Sized>(soup: &Soup, rng: &mut R) -> Attacked {
    let mut order: Vec<u32> = (0..soup.points.len() as u32).collect();
    order.shuffle(rng);
    let mut place = vec![0u32; order.len()];
    for (new, &old) in (0u32..).zip(&order) {
        place[old as usize] = new;
    }
    let mut triangles: Vec<[u32; 3]> = soup
        .triangles
        .iter()
        .map(|corners| {
            let mut corners = corners.map(|v| place.get(v as usize).copied().unwrap_or(v));
            corners.rotate_left(rng.random_range(0..3u32) as usize);
            corners
        })
        .collect();
    triangles.shuffle(rng);
    let points = order.iter().map(|&v| soup.points[v as usize]).collect();
    Attacked::picked(Soup::new(points, triangles), order)
}

/// A random order of vertices, faces and corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reordering;

impl Operation for Reordering {
    fn read(_given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self)
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        Vec::new()
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(reorder(soup, rng))
    }
}
