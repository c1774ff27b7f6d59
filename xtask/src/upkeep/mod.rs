//! What keeps the repository in order.

pub(crate) mod ci;
pub(crate) mod hostile;
pub(crate) mod models;
