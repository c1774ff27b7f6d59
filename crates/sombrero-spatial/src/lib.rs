#![doc = include_str!("../README.md")]

mod limits;
mod morton;
mod nearest;
mod refit;
mod sample;
mod search;
mod spread;
mod surface;
mod tree;
mod triangle;

pub mod distance;

pub use distance::{DistanceOptions, Distances, OneSided, compare};
pub use nearest::NearestVertex;
pub use sample::{SurfaceSample, sample_surface};
pub use spread::spread_samples;
pub use surface::{Closest, Surface};
