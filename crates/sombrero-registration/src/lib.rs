#![doc = include_str!("../README.md")]

mod error;
mod icp;
mod judge;
mod moments;
mod pairs;
mod register;
mod sample;
mod shape;
mod start;
mod step;

pub use error::{RegistrationError, Side};
pub use icp::{IcpOptions, Reference, align};
pub use register::{Pose, RegisterOptions, Registration, Starts, register};
