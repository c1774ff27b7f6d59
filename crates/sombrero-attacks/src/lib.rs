#![doc = include_str!("../README.md")]

mod attack;
mod crop;
mod noise;
mod reorder;
mod second;
mod simplify;
mod smooth;
mod spec;
mod transform;

pub use attack::{Attack, AttackError, Attacked, apply, apply_all};
pub use crop::crop;
pub use noise::noise;
pub use reorder::reorder;
pub use second::{SecondMark, second_watermark};
pub use simplify::simplify;
pub use smooth::{Smoothing, smooth};
pub use spec::SpecError;
pub use transform::{Transform, random_similarity};
