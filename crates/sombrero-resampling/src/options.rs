//! How a fit is made, and what each weight means.

use crate::error::ResampleError;

/// How [`resample`](crate::resample) fits.
///
/// Lengths are relative to the largest side of the original's bounding box, and all sums of the energy are
/// plain sums over samples, edges and faces, as in the paper (section 5). The paper gives c_d = 1e-3 and
/// c_f = 1e7 but neither the unit of length nor the number of samples:
///
/// - c_d weighs lengths against lengths, so the unit does not matter and the number of samples does. The
///   table has the median log10 p of five watermarks after reordering and after simplification to an eighth
///   of the faces, with eight samples to a vertex; 0.1 and 0.3 are much like 0.2.
///
///   | c_d | μ | rounds | fandisk | head |
///   |---|---|---|---|---|
///   | 1e-3 | 2e-3 | 8 | -15, -9 | -12, -5 |
///   | 1e-2 | 2e-3 | 8 | -19, -11 | -17, -5 |
///   | **0.2** | **2e-3** | **8** | **-20, -12** | **-19, -4** |
///   | 0.2 | 1 | 8 | -15, -9 | -10, -5 |
///   | 0.2 | 1 | 64 | -19, -10 | -11, -4 |
///
/// - c_f weighs a number against squared lengths, so it goes with the square of the unit: the paper's 1e7 is
///   our 3e-3 when its models were some 60,000 units wide. From 1e-1 up the penalty is a wall that conjugate
///   gradient cannot slide along, and the fit stops short; from 1e-4 down single faces turn over.
/// - With only four samples to a vertex some vertices get none by chance. Where the suspect is coarser than
///   the original, and so a little smaller, springs then press such a vertex out of the surface, to where no
///   sample's projection reaches it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ResampleOptions {
    /// Points drawn on the suspect, for each vertex of the original that has a face. Default 8.
    pub samples_per_vertex: f64,
    /// c_d, the weight of the springs, above 0. Default 0.2.
    pub deform_weight: f64,
    /// c_f, the weight of the penalty on turned faces, for lengths in largest sides. Default 3e-3.
    pub flip_weight: f64,
    /// μ, the part of its motion along the surface that a sample resists within a round, from 0 to 1.
    /// Default 2e-3. It changes the way and not the goal; 1 is the plain reading of the paper, which takes many more rounds.
    pub sliding_resistance: f64,
    /// Rounds of projecting the samples and minimising, at most. Default 8.
    pub rounds: usize,
    /// Iterations of conjugate gradient in each round, at most. Default 20.
    pub iterations: usize,
    /// Distance from the original, in largest sides, beyond which samples are left out. Default 0.05.
    pub max_distance: f64,
    /// Distance from the suspect, in largest sides, beyond which a fitted vertex is missing. Default 0.02.
    pub missing_distance: f64,
    /// Largest motion of a vertex in the last round, in largest sides: fitting stops at it. Default 1e-6.
    pub tolerance: f64,
}

impl Default for ResampleOptions {
    fn default() -> Self {
        Self {
            samples_per_vertex: 8.0,
            deform_weight: 0.2,
            flip_weight: 3e-3,
            sliding_resistance: 2e-3,
            rounds: 8,
            iterations: 20,
            max_distance: 0.05,
            missing_distance: 0.02,
            tolerance: 1e-6,
        }
    }
}

/// A range: its test and its words.
type Range = (fn(f64) -> bool, &'static str);

const ABOVE_ZERO: Range = (|x| x > 0.0 && x.is_finite(), "a finite number above 0");
const NOT_NEGATIVE: Range = (|x| x >= 0.0 && x.is_finite(), "a finite number, 0 or more");
const SHARE: Range = (|x| (0.0..=1.0).contains(&x), "from 0 to 1");
/// More would be a mistake, and fill the memory.
const SAMPLES: Range = (|x| x > 0.0 && x <= 1e3, "above 0 and at most 1000");

impl ResampleOptions {
    pub(crate) fn check(&self) -> Result<(), ResampleError> {
        let values = [
            ("samples_per_vertex", self.samples_per_vertex, SAMPLES),
            ("deform_weight", self.deform_weight, ABOVE_ZERO),
            ("flip_weight", self.flip_weight, NOT_NEGATIVE),
            ("sliding_resistance", self.sliding_resistance, SHARE),
            ("max_distance", self.max_distance, ABOVE_ZERO),
            ("missing_distance", self.missing_distance, ABOVE_ZERO),
            ("tolerance", self.tolerance, NOT_NEGATIVE),
        ];
        match values.into_iter().find(|(_, value, (holds, _))| !holds(*value)) {
            Some((name, value, (_, range))) => Err(ResampleError::Option { name, value, range }),
            None => Ok(()),
        }
    }
}
