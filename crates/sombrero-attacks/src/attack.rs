//! Every attack by name, alone or one after the other.

use crate::affine::Affine;
use crate::attacked::Attacked;
use crate::coordinate_noise::CoordinateNoise;
use crate::crop::Crop;
use crate::error::{AttackError, SpecError};
use crate::ffd::FreeForm;
use crate::isosurface::Isosurface;
use crate::laplacian::Laplacian;
use crate::mirror::Mirroring;
use crate::noise::Noise;
use crate::nothing::Nothing;
use crate::operation::Operation;
use crate::points::PointCloud;
use crate::print::Print;
use crate::projective::Projective;
use crate::quantize::Quantization;
use crate::remesh::Remeshing;
use crate::reorder::Reordering;
use crate::second::SecondMark;
use crate::simplify::Simplification;
use crate::smooth::Smoothing;
use crate::spec::{Given, spec};
use crate::subdivide::Subdivision;
use crate::transform::Transform;
use rand::Rng;
use sombrero_mesh::Soup;
use std::fmt;
use std::str::FromStr;

/// Makes [`Attack`] of the table: a variant a row, and what is done with each.
macro_rules! attacks {
    ($($name:literal => $operation:ident, $example:literal, $help:literal;)*) => {
        /// An attack with its parameters. As text it is a spec such as `noise:amplitude=0.002`.
        ///
        /// | for example | what it does |
        /// |---|---|
        $(#[doc = concat!("| `", $example, "` | ", $help, " |")])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        pub enum Attack {
            $(#[doc = concat!("`", $name, "`: ", $help, ".")] $operation($operation),)*
        }

        impl Attack {
            /// A spec of each attack that there is, with all its parameters at values that make sense.
            pub const EXAMPLES: &'static [&'static str] = &[$($example),*];

            const NAMES: &'static [&'static str] = &[$($name),*];

            fn read(name: &str, rest: &str) -> Result<Self, SpecError> {
                match name {
                    $($name => {
                        let mut given = Given::new(name, rest, $example);
                        let operation = $operation::read(&mut given)?;
                        given.nothing_left()?;
                        Ok(Self::$operation(operation))
                    })*
                    _ => Err(SpecError::Name { name: name.to_owned(), known: in_words(Self::NAMES) }),
                }
            }

            fn spec(&self) -> String {
                match self {
                    $(Self::$operation(operation) => spec($name, &operation.parameters()),)*
                }
            }

            fn apply<R: Rng + ?Sized>(&self, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
                match self {
                    $(Self::$operation(operation) => operation.apply(soup, rng),)*
                }
            }
        }

        $(impl From<$operation> for Attack {
            fn from(operation: $operation) -> Self {
                Self::$operation(operation)
            }
        })*
    };
}

// The attacks there are, by name, with an example that gives all parameters, and what they do. Letters are the rows of
// the paper's table 1.
//
// To add one:
//
// 1. A file beside this one, and its `mod` line in `lib.rs`: what it computes as an equation, a struct of its parameters,
//    and `impl Operation` for the struct. `projective.rs` is a short one to begin with.
// 2. A row here. It makes the spec that the command and all experiments understand, the variant of `Attack`, its place
//    in the documentation and in the list that a wrong name is answered with; the tests below try its example.
attacks! {
    "none" => Nothing, "none", "nothing (A)";
    "reorder" => Reordering, "reorder", "vertices, faces and the first corners of faces in random order (B)";
    "noise" => Noise, "noise:amplitude=0.002", "each vertex by a random vector from a ball of this radius (C, D, E)";
    "coordinate-noise" => CoordinateNoise, "coordinate-noise:amplitude=0.001", "each coordinate by at most this multiple of the mean distance of the vertices from their centre";
    "smooth" => Smoothing, "smooth:iterations=10,lambda=0.33,mu=-0.34", "Taubin's filter; the values shown are the defaults (F)";
    "laplacian" => Laplacian, "laplacian:iterations=10,lambda=0.1", "plain Laplacian smoothing, which shrinks; the values shown are the defaults";
    "quantize" => Quantization, "quantize:bits=10", "each coordinate to the nearest of 2^bits levels, 1 to 24 bits";
    "transform" => Transform, "transform:rotation=30,translation=0.5,scale=2", "a similarity, the angle in degrees; whatever is left out is drawn at random (G)";
    "affine" => Affine, "affine:strength=0.1", "a random linear map about the centroid that keeps volumes, of condition number 1 + strength";
    "projective" => Projective, "projective:strength=0.1", "a random projective map: x - c is divided by 1 + strength a · (x - c) / side";
    "ffd" => FreeForm, "ffd:strength=0.02,lattice=4", "a random free-form deformation that moves the vertex it moves furthest by strength";
    "simplify" => Simplification, "simplify:ratio=0.5", "edge collapses with optimal placement, down to this fraction of the faces (H, I)";
    "subdivide" => Subdivision, "subdivide:scheme=loop,iterations=1", "each face becomes four, by `loop` or `midpoint`";
    "remesh" => Remeshing, "remesh:length=1,iterations=5", "isotropic remeshing with edges about this multiple of the mean edge length";
    "isosurface" => Isosurface, "isosurface:resolution=128", "marching cubes of the signed distance, 2 to 1024 cells along the largest side";
    "watermark" => SecondMark, "watermark:preset=paper,epsilon=0.02,coefficients=50,basis=sombrero", "a second mark with another secret; what is left out is the preset's (J)";
    "mirror" => Mirroring, "mirror", "the mirror image, the same side out";
    "print" => Print, "print:size=100", "printed with this largest side in millimetres and scanned, by a simulation";
    "points" => PointCloud, "points:count=20000", "so many points of the surface, and no faces: a point cloud";
    "crop" => Crop, "crop:fraction=0.333", "the right (large x) fraction of the bounding box goes, or with `vertices` of the vertices (K)";
}

impl FromStr for Attack {
    type Err = SpecError;

    fn from_str(spec: &str) -> Result<Self, SpecError> {
        let (name, rest) = spec.split_once(':').unwrap_or((spec, ""));
        Self::read(name, rest)
    }
}

impl fmt::Display for Attack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.spec())
    }
}

/// `a, b and c`.
fn in_words(names: &[&str]) -> String {
    match names {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => names.concat(),
    }
}

/// The attacks of a list of specs, separated by spaces: `reorder noise:amplitude=0.002`.
///
/// # Errors
/// [`SpecError`] for the first spec that cannot be read.
pub fn parse_list(specs: &str) -> Result<Vec<Attack>, SpecError> {
    specs.split_whitespace().map(str::parse).collect()
}

/// Applies one attack.
///
/// # Errors
/// [`AttackError`] when a parameter is out of range or nothing would be left.
pub fn apply<R: Rng + ?Sized>(attack: &Attack, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
    if soup.triangles.is_empty() {
        return Err(AttackError::NothingLeft);
    }
    attack.apply(soup, rng)
}

/// Applies attacks in order; `source` of the result leads back to the first mesh.
///
/// # Errors
/// As [`apply`].
pub fn apply_all<R: Rng + ?Sized>(
    attacks: &[Attack],
    soup: &Soup,
    rng: &mut R,
) -> Result<Attacked, AttackError> {
    attacks.iter().try_fold(Attacked::in_place(soup.clone()), |before, attack| {
        let after = apply(attack, &before.soup, rng)?;
        let source = after.source.iter().map(|s| s.and_then(|v| before.source[v as usize])).collect();
        Ok(Attacked { soup: after.soup, source })
    })
}

#[cfg(test)]
mod tests;
