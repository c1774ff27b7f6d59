#![doc = include_str!("../README.md")]

mod amplitudes;
mod candidates;
mod carry;
mod columns;
mod envelope;
mod evidence;
mod fields;
mod jacobi;
mod lanczos;
mod lists;
mod patches;
mod piece;
mod planes;
mod settle;
mod sight;
mod surface;
#[cfg(test)]
mod tests;
mod together;
mod turning;
mod visibility;
mod walls;

pub use columns::Columns;
pub use fields::{Field, Fields, FieldsError, FieldsOptions};
pub use sight::{Onlooker, Sight};
pub use together::{Here, next_field};
