//! Where a search starts: poses by moments, by rotations of both surfaces in a common position, and by landmarks that
//! look alike.

pub(crate) mod isotropic;
pub(crate) mod landmarks;
pub(crate) mod looks;
pub(crate) mod matcher;
pub(crate) mod orientation;
pub(crate) mod principal_axes;
pub(crate) mod ranking;
pub(crate) mod rotations;
pub(crate) mod rough;
pub(crate) mod screen;
