#![doc = include_str!("../README.md")]

mod least_squares;

pub use least_squares::{ExtractError, Extraction, extract};
