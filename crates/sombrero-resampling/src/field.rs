//! The variables of the minimisation as argmin sees them: one long vector.
//!
//! argmin-math has these operations for `Vec<f64>`, but only together with a random generator that asks the operating
//! system for a seed, which nothing here needs and a browser has not.

use argmin_math::{ArgminAdd, ArgminDot, ArgminL2Norm, ArgminMul, ArgminSub};

/// Numbers, three a vertex: positions, directions or gradients.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Field(pub(crate) Vec<f64>);

impl Field {
    fn with(&self, other: &Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| operation(*a, *b)).collect())
    }
}

impl ArgminAdd<Self, Self> for Field {
    fn add(&self, other: &Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl ArgminSub<Self, Self> for Field {
    fn sub(&self, other: &Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl ArgminMul<f64, Self> for Field {
    fn mul(&self, factor: &f64) -> Self {
        Self(self.0.iter().map(|a| a * factor).collect())
    }
}

impl ArgminMul<Field, Field> for f64 {
    fn mul(&self, field: &Field) -> Field {
        field.mul(self)
    }
}

impl ArgminDot<Self, f64> for Field {
    fn dot(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| a * b).sum()
    }
}

impl ArgminL2Norm<f64> for Field {
    fn l2_norm(&self) -> f64 {
        self.0.iter().map(|a| a * a).sum::<f64>().sqrt()
    }
}
