#![doc = include_str!("../README.md")]

mod amplitudes;
mod candidates;
mod carry;
mod envelope;
mod evidence;
mod fields;
mod jacobi;
mod lanczos;
mod patches;
mod piece;
mod planes;
mod settle;
mod sight;
mod surface;
#[cfg(test)]
mod tests;
mod turning;
mod visibility;
mod walls;

pub use fields::{Field, Fields, FieldsError, FieldsOptions};
pub use sight::{Onlooker, Sight};
