#![doc = include_str!("../README.md")]

mod ladder;
mod landmark;
mod surface;

pub use ladder::ladder;
pub use landmark::{Cloud, Features, Frame, Landmark, NUMBERS, RUNG, SPAN, View};
/// The crate whose points and matrices stand in the signatures here.
pub use nalgebra;
pub use surface::{SurfacePoint, area, surface_points};
