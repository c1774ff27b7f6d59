#![doc = include_str!("../README.md")]

mod change;
mod cracks;
mod crossing;
mod curvature;
mod digits;
mod dihedral;
mod evenly;
mod fidelity;
mod flatness;
mod intersections;
mod mrms;
mod msdm2;
mod net;
mod normals;
#[cfg(test)]
mod tests;
mod walls;
mod warnings;

pub use change::Change;
pub use cracks::{Cracks, MEETING, Places, cracks};
pub use digits::digits;
pub use dihedral::{FLAT_EDGE, flat_dihedral};
pub use fidelity::Fidelity;
pub use flatness::flatness;
pub use intersections::new_intersections;
pub use mrms::mrms;
pub use msdm2::msdm2;
/// The crate whose points stand in the signatures here.
pub use nalgebra;
pub use normals::{NormalChange, normal_change, normals};
pub use walls::{CONTACT, FARTHEST, Thinnest, thinnest};
pub use warnings::{BENT, DIFFERENT, OPENED, THINNED, TURNED};
