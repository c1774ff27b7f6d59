//! Free-form deformation (Sederberg, Parry 1986): the bounding box is a block of jelly with L × L × L control
//! points, and moving these bends everything inside. A vertex at (u, v, w) in the box, each from 0 to 1, moves by
//!
//!   δ(u, v, w) = σ Σ_ijk B_i(u) B_j(v) B_k(w) d_ijk,   B_i(t) = C(L - 1, i) tⁱ (1 - t)^(L-1-i).
//!
//! The d are even draws from the unit ball. σ makes the largest displacement of a vertex S times the largest
//! side; without it the mean of many draws would make little of a strong field.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::{Point3, Vector3};
use rand::Rng;
use sombrero_mesh::{BoundingBox, Soup};
use sombrero_spatial::sample_ball;

/// How to bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeForm {
    /// Length of the largest displacement as a fraction of the largest side, between 0 and 1.
    pub strength: f64,
    /// Control points along each side, between 2 and 16. Default 4.
    pub lattice: u32,
}

/// Draws the field and applies it.
///
/// # Errors
/// [`AttackError::Parameter`] when a parameter is out of range.
pub fn free_form<R: Rng + ?Sized>(
    soup: &Soup,
    form: &FreeForm,
    rng: &mut R,
) -> Result<Vec<Point3<f64>>, AttackError> {
    in_range("strength", form.strength, (0.0, 1.0), "between 0 and 1")?;
    in_range("lattice", f64::from(form.lattice), (2.0, 16.0), "between 2 and 16")?;
    let bounds = soup.bounding_box().ok_or(AttackError::NothingLeft)?;
    let lattice = Lattice::random(form.lattice as usize, bounds, rng);
    let field: Vec<Vector3<f64>> = soup.points.iter().map(|p| lattice.displacement(p)).collect();
    let used = soup.used();
    let largest =
        field.iter().zip(used).filter(|(_, used)| *used).fold(0.0, |m: f64, (d, _)| m.max(d.norm()));
    let factor = if largest > 0.0 { form.strength * bounds.largest_side() / largest } else { 0.0 };
    Ok(soup.points.iter().zip(field).map(|(p, d)| p + d * factor).collect())
}

struct Lattice {
    bounds: BoundingBox,
    size: usize,
    /// By i, then j, then k.
    control: Vec<Vector3<f64>>,
}

impl Lattice {
    fn random<R: Rng + ?Sized>(size: usize, bounds: BoundingBox, rng: &mut R) -> Self {
        Self { bounds, size, control: (0..size * size * size).map(|_| sample_ball(rng)).collect() }
    }

    /// δ / σ. Vertices outside the box, which no face uses, move like the nearest one inside.
    fn displacement(&self, p: &Point3<f64>) -> Vector3<f64> {
        let (from_corner, sides) = (p - self.bounds.min, self.bounds.sides());
        let [u, v, w] = std::array::from_fn(|k| {
            let t = if sides[k] > 0.0 { (from_corner[k] / sides[k]).clamp(0.0, 1.0) } else { 0.0 };
            bernstein(self.size - 1, t)
        });
        let weighted = |line: &[Vector3<f64>]| line.iter().zip(&w).map(|(d, b)| d * *b).sum::<Vector3<f64>>();
        let lines = self.control.chunks_exact(self.size);
        let weights = u.iter().flat_map(|a| v.iter().map(move |b| a * b));
        lines.zip(weights).map(|(line, b)| weighted(line) * b).sum()
    }
}

/// All Bernstein polynomials of a degree at t, by de Casteljau's recurrence.
fn bernstein(degree: usize, t: f64) -> Vec<f64> {
    let mut values = vec![1.0];
    for _ in 0..degree {
        let before = std::mem::take(&mut values);
        let (left, right) = (before.iter().chain([&0.0]), [&0.0].into_iter().chain(&before));
        values = left.zip(right).map(|(same, less)| (1.0 - t) * same + t * less).collect();
    }
    values
}

impl Operation for FreeForm {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        Ok(Self { strength: given.needed_number("strength")?, lattice: given.whole("lattice")?.unwrap_or(4) })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        vec![("strength", self.strength.to_string()), ("lattice", self.lattice.to_string())]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        Ok(Attacked::moved(soup, free_form(soup, self, rng)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_shapes as shapes;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn the_largest_displacement_is_the_strength(strength in 0.001..1.0, lattice in 2u32..9, seed in any::<u64>()) {
            let soup = shapes::bumpy_sphere(300);
            let form = FreeForm { strength, lattice };
            let moved = free_form(&soup, &form, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let largest = moved.iter().zip(&soup.points).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
            let wanted = strength * soup.bounding_box().unwrap().largest_side();
            prop_assert!((largest / wanted - 1.0).abs() < 1e-9);
        }

        #[test]
        fn weights_are_a_partition(degree in 0usize..16, t in 0.0..=1.0) {
            let values = bernstein(degree, t);
            prop_assert_eq!(values.len(), degree + 1);
            prop_assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(values.iter().all(|v| *v >= 0.0));
            let mean: f64 = values.iter().zip(0u32..).map(|(v, i)| v * f64::from(i)).sum();
            prop_assert!((mean - degree as f64 * t).abs() < 1e-10, "mean of a binomial");
        }
    }

    #[test]
    fn flat_and_vanishing_meshes_are_no_trouble() {
        let form = FreeForm { strength: 0.1, lattice: 4 };
        let flat = Soup::new(
            vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)],
            vec![[0, 1, 2]],
        );
        let point = Soup::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]);
        for soup in [flat, point] {
            let moved = free_form(&soup, &form, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
            assert!(moved.iter().all(|p| p.iter().all(|x| x.is_finite())));
        }
    }
}
