#![doc = include_str!("../README.md")]

mod affine;
mod affine_map;
mod affine_step;
mod error;
mod icp;
mod isotropic;
mod judge;
mod landmark;
mod landmarks;
mod lookup;
mod matching;
mod moments;
mod motion;
mod orientation;
mod pairs;
mod procrustes;
mod ranking;
mod reference;
mod register;
mod rotations;
mod rough;
mod sample;
mod search;
mod shape;
mod start;
mod step;
mod symmetry;
mod verdict;

pub use affine::{AffinePose, AffineRegistration, refine_affine, register_affine};
pub use error::{RegistrationError, Side};
pub use icp::{IcpOptions, align};
pub use procrustes::similarity_of_pairs;
pub use reference::Reference;
pub use register::{Pose, RegisterOptions, Registration, Starts, register};
