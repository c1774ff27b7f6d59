//! A second mark by somebody else (row J): the same scheme with another secret, on the marked mesh.

use crate::attacked::Attacked;
use crate::error::{AttackError, SpecError, in_range};
use crate::operation::Operation;
use crate::spec::Given;
use nalgebra::Point3;
use rand::{Rng, RngExt};
use sombrero_basis::{Amplitudes, Basis, BasisError, BasisOptions};
use sombrero_mesh::{Soup, repair};
use sombrero_progressive::ProgressiveMesh;
use sombrero_watermark::{Parameters, Preset, embed, gaussians};

/// How strong the second mark is; the default is the paper's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondMark {
    /// Coefficients, basis and ε.
    pub parameters: Parameters,
}

impl Default for SecondMark {
    fn default() -> Self {
        Self { parameters: Preset::Paper.parameters() }
    }
}

/// The positions after marking `soup` with a secret drawn from `rng`.
///
/// # Errors
/// [`BasisError`] when the mesh cannot carry that many coefficients.
pub fn second_watermark<R: Rng + ?Sized>(
    soup: &Soup,
    mark: &SecondMark,
    rng: &mut R,
) -> Result<Vec<Point3<f64>>, BasisError> {
    let Parameters { basis: options, epsilon, .. } = mark.parameters;
    let seed = rng.random();
    let basis = basis_of(soup, &options)?;
    let w = gaussians(seed, basis.functions().len());
    Ok(embed(&soup.points, &basis, &w, epsilon))
}

fn basis_of(soup: &Soup, options: &BasisOptions) -> Result<Basis, BasisError> {
    let made = repair(soup);
    let progressive = ProgressiveMesh::new(made.mesh, &made.points).expect("repaired points are finite");
    let basis = Basis::new(progressive, &made.points, options)?;
    Ok(basis.on_points(&made.source, soup.points.len()))
}

impl Operation for SecondMark {
    fn read(given: &mut Given<'_>) -> Result<Self, SpecError> {
        let preset = given.value("preset", "paper, robust or faithful")?.unwrap_or(Preset::Paper);
        let mut parameters = preset.parameters();
        if let Some(epsilon) = given.number("epsilon")? {
            parameters.epsilon = epsilon;
        }
        if let Some(coefficients) = given.whole("coefficients")? {
            parameters.basis.coefficients = coefficients;
        }
        if let Some(function) = given.value("basis", "sombrero, derby or hat; or preset=faithful")? {
            parameters.basis.function = function;
            if !parameters.basis.amplitudes.suit(function) {
                parameters.basis.amplitudes = Amplitudes::default();
            }
        }
        Ok(Self { parameters })
    }

    fn parameters(&self) -> Vec<(&'static str, String)> {
        let Parameters { basis, epsilon, .. } = self.parameters;
        let same = |preset: &&Preset| preset.parameters().basis.amplitudes == basis.amplitudes;
        let preset = Preset::ALL.iter().find(same).copied().unwrap_or_default();
        vec![
            ("preset", preset.to_string()),
            ("epsilon", epsilon.to_string()),
            ("coefficients", basis.coefficients.to_string()),
            ("basis", basis.function.to_string()),
        ]
    }

    fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
        let Parameters { basis, epsilon, .. } = self.parameters;
        in_range("epsilon", epsilon, (f64::MIN_POSITIVE, 1.0), "above 0 and at most 1")?;
        in_range("coefficients", basis.coefficients as f64, (4.0, f64::MAX), "at least 4")?;
        Ok(Attacked::moved(soup, second_watermark(soup, self, rng)?))
    }
}
