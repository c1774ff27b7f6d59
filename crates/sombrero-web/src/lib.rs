#![doc = include_str!("../README.md")]

#[cfg(target_arch = "wasm32")]
#[allow(unreachable_pub, reason = "what a worker calls has to be public")]
mod door;
mod file;
mod look;
mod mark;
mod refusal;
mod view;

pub use file::{File, LARGEST_FILE, MOST_TRIANGLES};
pub use look::{Verdict, look};
pub use mark::{MarkedCopy, mark};
pub use refusal::Refusal;
pub use view::view;
