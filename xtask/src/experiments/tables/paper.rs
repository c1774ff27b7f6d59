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
    /// Fandisk, head, dragon, bunny; 0 where the paper has no figure.
    paper: [f64; 4],
}

/// How the paper looked at a row's suspects.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Steps {
    Neither,
    Registration,
    Resampling,
    Both,
}
use Steps::{Both, Neither, Registration, Resampling};

/// All rows, and K' and O': K and O without the correspondence that the paper knew.
pub(crate) const ROWS: [Row; 20] = [
    row("A", "no attack", "none", Neither, [-38, -38, -38, -38]),
    row("B", "vertex reorder", "reorder", Resampling, [-14, -15, -16, -21]),
    row("C", "noise 0.2 %", "noise:amplitude=0.002", Neither, [-14, -12, -17, -35]),
    row("D", "noise 0.45 %", "noise:amplitude=0.0045", Neither, [-5, -6, -9, -21]),
    row("E", "noise 0.7 %", "noise:amplitude=0.007", Neither, [-3, -5, -5, -15]),
    row("F", "smoothing", "smooth:iterations=10", Neither, [-12, -38, -32, -38]),
    row("G", "transform", "transform", Registration, [-33, -24, -29, -29]),
    row("H", "simplify 1/2", "simplify:ratio=0.5", Resampling, [-12, -9, -7, -17]),
    row("I", "simplify 1/8", "simplify:ratio=0.125", Resampling, [-11, -3, -2, -13]),
    row("J", "2nd watermark", "watermark", Neither, [-8, -7, -17, -6]),
    row("K", "crop, right third", "crop:fraction=0.333", Neither, [-38, -38, -38, -38]),
    row("K'", "K, resampled", "crop:fraction=0.333", Resampling, [0, 0, 0, 0]),
    row("L", "B + C", "reorder noise:amplitude=0.002", Resampling, [-12, -6, -11, -28]),
    row("M", "B + G", "reorder transform", Both, [-12, -12, -15, -20]),
    row("N", "C + G", "noise:amplitude=0.002 transform", Registration, [-11, -12, -15, -24]),
    row("O", "G + K", "transform crop:fraction=0.333", Registration, [-22, -9, -20, -18]),
    row("O'", "O, resampled", "transform crop:fraction=0.333", Both, [0, 0, 0, 0]),
    row("P", "B + C + G", "reorder noise:amplitude=0.002 transform", Both, [-12, -4, -14, -22]),
    row("Q", "B + G + H", "reorder transform simplify:ratio=0.5", Both, [-13, -9, -6, -17]),
    row(
        "R",
        "B + C + F + G + H + J + K",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
        Both,
        [-2, -2, -2, -5],
    ),
];

pub(crate) const fn row(
    letter: &'static str,
    name: &'static str,
    attack: &'static str,
    steps: Steps,
    paper: [i8; 4],
) -> Row {
    let [a, b, c, d] = paper;
    Row {
        letter,
        name,
        attack,
        registration: matches!(steps, Registration | Both),
        resampling: matches!(steps, Resampling | Both),
        paper: [a as f64, b as f64, c as f64, d as f64],
    }
}

impl Row {
    /// Whether the paper has no such row.
    pub(crate) fn is_beyond(&self) -> bool {
        self.paper.iter().all(|p| *p == 0.0) && !self.letter.ends_with('\'')
    }

    /// The paper's figure for a model; rows K' and O' have none.
    pub(crate) fn paper_log10_p(&self, model: &str) -> Option<f64> {
        let column = MODELS.iter().position(|m| m.name == model)?;
        Some(self.paper[column]).filter(|&p| p < 0.0)
    }
}

/// A cell of Table 2.
pub(crate) struct Comparison {
    pub(crate) model: &'static str,
    pub(crate) row: &'static str,
    /// Hat, derby, sombrero.
    paper: [f64; 3],
}

impl Comparison {
    fn value(&self, function: BasisFunction) -> Option<f64> {
        BasisFunction::PROFILES.iter().position(|f| *f == function).map(|i| self.paper[i])
    }
}

pub(crate) const TABLE2: [Comparison; 8] = [
    Comparison { model: "fandisk", row: "C", paper: [-13.0, -15.0, -14.0] },
    Comparison { model: "fandisk", row: "E", paper: [-2.0, -2.0, -3.0] },
    Comparison { model: "fandisk", row: "G", paper: [-17.0, -6.0, -33.0] },
    Comparison { model: "fandisk", row: "H", paper: [-7.0, -5.0, -12.0] },
    Comparison { model: "head", row: "C", paper: [-18.0, -12.0, -12.0] },
    Comparison { model: "head", row: "E", paper: [-5.0, -3.0, -5.0] },
    Comparison { model: "head", row: "G", paper: [-1.0, -3.0, -24.0] },
    Comparison { model: "head", row: "H", paper: [-2.0, -1.0, -9.0] },
];

/// What Table 2 has for a model, a row and a basis.
pub(crate) fn table2(model: &str, row: &str, function: BasisFunction) -> Option<f64> {
    TABLE2.iter().find(|c| c.model == model && c.row == row).and_then(|c| c.value(function))
}
