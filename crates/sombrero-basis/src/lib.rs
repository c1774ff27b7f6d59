#![doc = include_str!("../README.md")]

mod amplitude;
mod basis;
mod function;

pub mod magnitude;
pub mod radius;
pub mod support;

pub use amplitude::{Amplitudes, UnknownAmplitudes};
pub use basis::{Basis, BasisError, BasisOptions, Function, PartsError};
pub use function::{BasisFunction, UnknownFunction};
