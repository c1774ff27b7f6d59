//! The stories, a file each: `cargo test --workspace --test all digits` runs one of them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod assemblies;
mod catalogues;
mod clearances;
mod cli;
mod determinism;
mod digits;
mod false_positives;
mod files;
mod forgery;
mod formats;
mod independent;
mod laws;
mod models;
mod mutants;
mod prepared;
mod robust;
mod stories;
mod suspects;
mod tracing;
mod web;
