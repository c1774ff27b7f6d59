//! What keeps the repository in order.

pub(crate) mod ci;
pub(crate) mod hostile;
pub(crate) mod models;
pub(crate) mod package;
pub(crate) mod tidy;
