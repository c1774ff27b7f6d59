#![doc = include_str!("../README.md")]
//!
//! Nothing is used beyond the correctly rounded `+ - * / sqrt` and the software functions of `libm`. Arguments out of
//! range never panic; they are moved to the nearest value in range, and each function says what its range is.
//!
//! | shape | vertices | Euler characteristic |
//! |---|---|---|
//! | [`tetrahedron`], [`octahedron`], [`cube`], [`icosahedron`] | 4, 6, 8, 12 | 2 |
//! | [`sphere`]`(s)` | 10 4^s + 2 | 2 |
//! | [`torus`]`(m, n, ..)` | m n | 0 |
//! | [`genus`]`(g, r)` | (18 g + 14) r² + 2 - 2 g | 2 - 2 g |
//! | [`open_sheet`]`(nx, ny)` | (nx + 1) (ny + 1) | 1 |
//! | [`sheet_with_hole`]`(nx, ny)` | about 8/9 of the open sheet | 0 |
//! | [`part`]`(r)` | about 60 r² | -2 |
//! | [`bust`]`(r)` | 10 r² + 2 | 2 |
//! | [`bumpy_sphere`]`(v)` | about v | 2 |
//! | [`vase`]`(m, n)` | m n + 2 | 2 |

mod blocks;
mod bumpy;
mod bust;
mod genus;
mod geodesic;
mod part;
mod sheet;
mod solids;
mod torus;
mod vase;
mod waves;

#[cfg(test)]
mod tests;

pub use bumpy::bumpy_sphere;
pub use bust::{BUST_RESOLUTION, bust};
pub use genus::genus;
pub use geodesic::sphere;
pub use part::{PART_RESOLUTION, part};
pub use sheet::{open_sheet, sheet_with_hole};
pub use solids::{cube, icosahedron, octahedron, tetrahedron};
pub use torus::torus;
pub use vase::vase;
