#![doc = include_str!("../README.md")]

mod affine;
mod attack;
mod crop;
mod edges;
mod ffd;
mod isosurface;
mod laplacian;
mod noise;
mod projective;
mod quantize;
mod remesh;
mod reorder;
mod second;
mod simplify;
mod smooth;
mod spec;
mod subdivide;
mod transform;

pub use affine::affine;
pub use attack::{Attack, AttackError, Attacked, apply, apply_all};
pub use crop::{crop, crop_vertices};
pub use ffd::{FreeForm, free_form};
pub use isosurface::isosurface;
pub use laplacian::{Laplacian, laplacian};
pub use noise::{coordinate_noise, noise};
pub use projective::projective;
pub use quantize::quantize;
pub use remesh::{Remeshing, remesh};
pub use reorder::reorder;
pub use second::{SecondMark, second_watermark};
pub use simplify::simplify;
pub use smooth::{Smoothing, smooth};
pub use spec::SpecError;
pub use subdivide::{Scheme, Subdivision, subdivide};
pub use transform::{Transform, random_similarity};
