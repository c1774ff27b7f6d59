#![doc = include_str!("../README.md")]

mod amplitude;
mod basis;
mod columns;
mod error;
mod function;
mod magnitude;
mod radius;
mod rows;
mod support;

pub use nalgebra;
pub use nalgebra_sparse;

pub use amplitude::{Amplitudes, UnknownAmplitudes};
pub use basis::{Basis, BasisOptions, Function};
pub use error::{BasisError, PartsError};
pub use function::{BasisFunction, UnknownFunction};
pub use rows::Rows;
