//! A second mark by somebody else (row J): the same scheme with another secret, on the marked mesh.

use nalgebra::Point3;
use rand::{Rng, RngExt};
use sombrero_basis::{Basis, BasisError, BasisOptions};
use sombrero_mesh::{Soup, repair};
use sombrero_progressive::ProgressiveMesh;
use sombrero_watermark::{Identity, Parameters, Preset, Secret, embed, watermark};

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
    let Parameters { basis: options, epsilon } = mark.parameters;
    let secret = Secret(rng.random());
    let basis = basis_of(soup, &options)?;
    let w = watermark(b"", &Identity::default(), &secret, options.coefficients);
    Ok(embed(&soup.points, &basis, &w, epsilon))
}

fn basis_of(soup: &Soup, options: &BasisOptions) -> Result<Basis, BasisError> {
    let made = repair(soup);
    let mut progressive = ProgressiveMesh::new(made.mesh, &made.points);
    let basis = Basis::new(&mut progressive, &made.points, options)?;
    Ok(basis.on_points(&made.source, soup.points.len()))
}
