#![doc = include_str!("../README.md")]

mod ball;
mod cloud;
mod limits;
mod line;
mod morton;
mod nearest;
mod overlap;
mod refit;
mod rim;
mod sample;
mod search;
mod spread;
mod surface;
mod tree;
mod triangle;

pub mod distance;
pub mod robust;

pub use ball::sample_ball;
pub use cloud::splats;
pub use distance::{DistanceOptions, Distances, OneSided, compare};
pub use line::{Crossing, Line};
/// The crate whose points stand in the signatures here.
pub use nalgebra;
pub use nearest::NearestVertex;
pub use rim::Rim;
pub use sample::{SurfaceSample, sample_surface};
pub use spread::{Spread, spread_samples};
pub use surface::{Closest, Surface};
