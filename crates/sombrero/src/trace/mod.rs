//! Whose copy is it? One search, every key.
//!
//! The estimates of the robust method do not depend on a key, so a thousand keys cost one extraction. Each key is
//! tested as `detect` would, and once more beside the keys that the others show ([`sombrero_stats::accuse`]): copies that were averaged
//! carry all of their marks weakly, and each is noise to the rest until it is accounted for. Every test of every key
//! counts: the chance to name anyone who had no part is at most p.

mod many_keys;
mod tracer;
mod verdict;

pub use tracer::Tracer;
pub use verdict::{Named, Rejected, Trace};
