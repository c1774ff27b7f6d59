//! How well a pose fits, and whether it can be trusted.

pub(crate) mod fit;
pub(crate) mod trust;
