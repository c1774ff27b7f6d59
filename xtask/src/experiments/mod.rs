//! What measures the method: each verb recomputes a document. They share [`case`]: a model, its marks, and suspects
//! made of these.

pub(crate) mod alignment;
pub(crate) mod benchmark;
pub(crate) mod calibrate;
mod case;
pub(crate) mod catalogue;
pub(crate) mod collusion;
pub(crate) mod figures;
pub(crate) mod forgery;
pub(crate) mod ordeal;
pub(crate) mod peers;
mod plot;
pub(crate) mod presets;
mod program;
pub(crate) mod readings;
pub(crate) mod removal;
pub(crate) mod roc;
pub(crate) mod scaling;
pub(crate) mod suspects;
pub(crate) mod tables;
pub(crate) mod visibility;
