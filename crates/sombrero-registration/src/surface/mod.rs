//! Surfaces made ready: a frame of their own, moments, samples, the nearest sample by table.

pub(crate) mod frame;
pub(crate) mod lookup;
pub(crate) mod moments;
pub(crate) mod sample;
pub(crate) mod shape;
