//! What the paper printed: log10 of the median false-positive probability. "0" in print is written -38, the
//! smallest single-precision number.

use sombrero::basis::BasisFunction;

pub(crate) struct Model {
    pub(crate) name: &'static str,
    pub(crate) file: &'static str,
}

pub(crate) const MODELS: [Model; 4] = [
    Model { name: "fandisk", file: "fandisk.obj" },
    Model { name: "head", file: "head.obj" },
    Model { name: "dragon", file: "dragon.obj" },
    Model { name: "bunny", file: "bunny.ply" },
];

/// A row of Table 1.
pub(crate) struct Row {
    pub(crate) letter: &'static str,
    pub(crate) name: &'static str,
    /// The attacks in order, separated by spaces.
    pub(crate) attack: &'static str,
    /// Whether the paper registered the suspect.
    pub(crate) registration: bool,
    /// Whether the paper resampled it.
    pub(crate) resampling: bool,
    /// Fandisk, head, dragon, bunny.
    pub(crate) paper: [f64; 4],
}

/// The rows whose suspects keep the connectivity and the position of the original, or whose correspondence
/// is known.
pub(crate) const ROWS: [Row; 7] = [
    row("A", "no attack", "none", [-38.0, -38.0, -38.0, -38.0]),
    row("C", "noise 0.2 %", "noise:amplitude=0.002", [-14.0, -12.0, -17.0, -35.0]),
    row("D", "noise 0.45 %", "noise:amplitude=0.0045", [-5.0, -6.0, -9.0, -21.0]),
    row("E", "noise 0.7 %", "noise:amplitude=0.007", [-3.0, -5.0, -5.0, -15.0]),
    row("F", "smoothing", "smooth:iterations=10", [-12.0, -38.0, -32.0, -38.0]),
    row("J", "2nd watermark", "watermark", [-8.0, -7.0, -17.0, -6.0]),
    row("K", "crop, right third", "crop:fraction=0.333", [-38.0, -38.0, -38.0, -38.0]),
];

const fn row(letter: &'static str, name: &'static str, attack: &'static str, paper: [f64; 4]) -> Row {
    Row { letter, name, attack, registration: false, resampling: false, paper }
}

/// A cell of Table 2.
pub(crate) struct Comparison {
    pub(crate) model: &'static str,
    pub(crate) row: &'static str,
    /// Hat, derby, sombrero.
    paper: [f64; 3],
}

impl Comparison {
    pub(crate) fn value(&self, function: BasisFunction) -> Option<f64> {
        BasisFunction::ALL.iter().position(|f| *f == function).map(|i| self.paper[i])
    }
}

pub(crate) const TABLE2: [Comparison; 4] = [
    Comparison { model: "fandisk", row: "C", paper: [-13.0, -15.0, -14.0] },
    Comparison { model: "fandisk", row: "E", paper: [-2.0, -2.0, -3.0] },
    Comparison { model: "head", row: "C", paper: [-18.0, -12.0, -12.0] },
    Comparison { model: "head", row: "E", paper: [-5.0, -3.0, -5.0] },
];
