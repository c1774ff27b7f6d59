//! The functions of a mark: what was asked for, as far as the mesh can carry it.

use sombrero_basis::{Basis, BasisError, BasisFunction, BasisOptions};
use sombrero_progressive::ProgressiveMesh;
use sombrero_search::Model;
use sombrero_watermark::{COEFFICIENTS, Parameters, Preset};

/// The paper's number. With fewer a mark is easily lost.
pub(super) const FEW: usize = 50;

/// A basis and the parameters that made it.
pub(super) struct Choice {
    pub(super) basis: Basis,
    /// With as many coefficients as the basis has.
    pub(super) parameters: Parameters,
    /// The number of coefficients that the mesh is small without.
    pub(super) expected: usize,
    /// What is to be said when another preset had to be taken.
    pub(super) note: Option<String>,
}

impl Choice {
    /// The basis of these parameters; where the mesh cannot carry it and `make_do` says so, one with fewer coefficients,
    /// or of the preset robust where nothing of the mesh moves unseen.
    pub(super) fn new(
        model: &Model,
        progressive: ProgressiveMesh,
        parameters: Parameters,
        make_do: bool,
    ) -> Result<Self, BasisError> {
        match with(model, progressive, parameters, make_do) {
            Err(BasisError::TooFewFields { .. })
                if make_do && parameters.preset == Some(Preset::Faithful) =>
            {
                let robust = with(model, model.progressive(), Preset::Robust.parameters(), true)?;
                Ok(Self { note: Some(SEEN.to_owned()), ..robust })
            }
            choice => choice,
        }
    }
}

const SEEN: &str = "Nothing of this mesh moves without being seen (it has few vertices, or large flats of few triangles), so \
                    the mark is one of the preset robust, which may be seen; a finer mesh bears one that is not.";

fn with(
    model: &Model,
    progressive: ProgressiveMesh,
    parameters: Parameters,
    make_do: bool,
) -> Result<Choice, BasisError> {
    let wanted = parameters.basis;
    let basis = match model.basis_of(progressive, &wanted) {
        Err(BasisError::TooFewSplits { available, .. }) if make_do => {
            let fewer = BasisOptions { coefficients: available.max(*COEFFICIENTS.start()), ..wanted };
            // So small a mesh is converted again sooner than a large one's levels are kept.
            model.basis_of(model.progressive(), &fewer)?
        }
        basis => basis?,
    };
    let coefficients = basis.functions().len();
    if coefficients < *COEFFICIENTS.start() {
        return Err(BasisError::TooFewFields { available: coefficients });
    }
    let was_chosen = parameters.preset.is_none();
    if was_chosen && !make_do && coefficients < wanted.coefficients {
        return Err(BasisError::TooFewSplits { wanted: wanted.coefficients, available: coefficients });
    }
    // Of fields most meshes have fewer than the preset's most.
    let is_field = wanted.function == BasisFunction::Field;
    let expected = if is_field { FEW.min(wanted.coefficients) } else { wanted.coefficients };
    let parameters = Parameters { basis: BasisOptions { coefficients, ..wanted }, ..parameters };
    Ok(Choice { basis, parameters, expected, note: None })
}
