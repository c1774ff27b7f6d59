//! The command as people and programs meet it: every answer, and every way of being asked nonsense.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![cfg(unix)]

mod answers;
mod evidence;
mod foreign;
mod keys;
mod meshes;
mod names;
mod outputs;
mod prepared;
mod shared;
mod sizes;
mod streams;
mod usage;
