//! Multi-scale relief from sums of sines.

use nalgebra::{Point3, Vector3};

/// A sum of plane waves in octaves: each octave is finer and lower than the one before.
pub(super) struct Waves {
    terms: Vec<Term>,
}

struct Term {
    /// Direction of the wave times its angular frequency.
    frequency: Vector3<f64>,
    phase: f64,
    amplitude: f64,
}

impl Waves {
    /// `octaves` of seven waves each. The first has angular frequency `frequency` (radians per unit) and
    /// `amplitude`; each following one has `finer` times the frequency and `lower` times the amplitude.
    pub(super) fn new(octaves: usize, frequency: f64, amplitude: f64, finer: f64, lower: f64) -> Self {
        let mut terms = Vec::with_capacity(7 * octaves);
        let (mut frequency, mut amplitude) = (frequency, amplitude);
        for _ in 0..octaves {
            for _ in 0..7 {
                let number = terms.len() as f64;
                // Turning by the golden angle while hopping through heights by the golden ratio spreads
                // the directions without repeats.
                let height = (number * 1.236_067_977_499_79) % 2.0 - 1.0;
                let around = (1.0 - height * height).max(0.0).sqrt();
                let (sin, cos) = libm::sincos(2.399_963_229_728_653 * number);
                let direction = Vector3::new(around * cos, around * sin, height);
                terms.push(Term { frequency: direction * frequency, phase: 1.7 * number, amplitude });
            }
            frequency *= finer;
            amplitude *= lower;
        }
        Self { terms }
    }

    /// The height of the relief at a point in space.
    pub(super) fn at(&self, p: &Point3<f64>) -> f64 {
        let height = |t: &Term| t.amplitude * libm::sin(t.frequency.dot(&p.coords) + t.phase);
        self.terms.iter().map(height).sum()
    }
}
