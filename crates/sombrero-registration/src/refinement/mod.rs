//! From a rough pose to the best one near it: point-to-plane ICP, in the four parts that such a solver has.
//!
//! | part | here | what it decides |
//! |---|---|---|
//! | correspondences | `pairs` | which point of the reference belongs to which sample |
//! | rejector | `rejector` | which pairs count, and how much |
//! | reduction | `reduction`, `similarity_step`, `affine_step` | the step that the weighted pairs ask for |
//! | criteria | `criteria` | when a step is small enough to be the last |
//! | optimizer | `optimizer` | the loop, as an argmin `Solver` |
//!
//! `icp` calls it in rounds, on few samples first. `motion` says what a family of maps has to offer for all of this:
//! similarities and affine maps take the same way.

pub(crate) mod affine_map;
pub(crate) mod affine_step;
pub(crate) mod criteria;
pub(crate) mod icp;
pub(crate) mod motion;
pub(crate) mod optimizer;
pub(crate) mod pairs;
pub(crate) mod reduction;
pub(crate) mod rejector;
pub(crate) mod similarity_step;
