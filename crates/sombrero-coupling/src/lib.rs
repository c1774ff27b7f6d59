#![doc = include_str!("../README.md")]

mod clearance;
mod coupling;
mod facing;
mod follow;
mod join;
mod meet;
mod pairs;
mod parts;
mod sites;
mod solve;
mod spread;
#[cfg(test)]
mod tests;
mod thin;

pub use coupling::{Assembly, Coupling, Shown, Weights};
pub use facing::{Facing, facing};
pub use join::{join, reach};
pub use meet::meeting;
/// The crate whose points stand in the signatures here.
pub use nalgebra;
pub use spread::{Link, spread};
pub use thin::across;
