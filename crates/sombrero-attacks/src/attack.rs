//! The battery: every attack by name, alone or one after the other.

use crate::affine::affine;
use crate::crop::{crop, crop_vertices};
use crate::ffd::{FreeForm, free_form};
use crate::isosurface::isosurface;
use crate::laplacian::{Laplacian, laplacian};
use crate::noise::{coordinate_noise, noise};
use crate::projective::projective;
use crate::quantize::quantize;
use crate::remesh::{Remeshing, remesh};
use crate::reorder::reorder;
use crate::second::{SecondMark, second_watermark};
use crate::simplify::simplify;
use crate::smooth::{Smoothing, smooth};
use crate::subdivide::{Subdivision, subdivide};
use crate::transform::{Transform, random_similarity};
use rand::Rng;
use sombrero_basis::BasisError;
use sombrero_mesh::Soup;
use thiserror::Error;

/// One attack with its parameters. As text it is a spec such as `noise:amplitude=0.002`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Attack {
    /// Nothing.
    None,
    /// Vertices, faces and the corners of faces in random order.
    Reorder,
    /// A random vector for each vertex, no longer than `amplitude` times the largest bounding-box side.
    Noise {
        /// Fraction of the largest side.
        amplitude: f64,
    },
    /// Each coordinate by at most `amplitude` times the mean distance of the vertices from their centre.
    CoordinateNoise {
        /// Fraction of the mean distance.
        amplitude: f64,
    },
    /// Taubin's filter.
    Smooth(Smoothing),
    /// Plain Laplacian smoothing, which shrinks.
    Laplacian(Laplacian),
    /// Coordinates rounded to the nearest of 2^`bits` levels along the largest bounding-box side.
    Quantize {
        /// Bits of a coordinate.
        bits: u32,
    },
    /// A similarity transform.
    Transform(Transform),
    /// A linear map of condition number 1 + `strength` about the centroid.
    Affine {
        /// Condition number less one.
        strength: f64,
    },
    /// A projective map.
    Projective {
        /// By how much sizes differ across the box, roughly; below 1.
        strength: f64,
    },
    /// A free-form deformation.
    FreeForm(FreeForm),
    /// Full edge collapse to `ratio` times the number of faces.
    Simplify {
        /// Fraction of the faces that stays.
        ratio: f64,
    },
    /// Each face becomes four.
    Subdivide(Subdivision),
    /// Isotropic remeshing.
    Remesh(Remeshing),
    /// Marching cubes of the signed distance.
    Isosurface {
        /// Cells along the largest bounding-box side.
        resolution: u32,
    },
    /// A second mark by somebody else.
    Watermark(SecondMark),
    /// Drops the vertices in the right `fraction` of the bounding box.
    Crop {
        /// Fraction of the box's x side.
        fraction: f64,
    },
    /// Drops the `share` of the vertices that lie furthest to the right.
    CropVertices {
        /// Fraction of the vertices.
        share: f64,
    },
}

/// What is left after an attack.
#[derive(Debug, Clone, PartialEq)]
pub struct Attacked {
    /// The mesh.
    pub soup: Soup,
    /// For each of its vertices the vertex of the attacked mesh that it is; `None` for a new one.
    pub source: Vec<Option<u32>>,
}

impl Attacked {
    /// The same vertices, moved or not.
    pub(crate) fn in_place(soup: Soup) -> Self {
        let source = (0..soup.points.len() as u32).map(Some).collect();
        Self { soup, source }
    }

    /// Where each of `vertices` vertices of the attacked mesh is now; `None` for those that are gone.
    /// Undoes reordering and cropping: the known correspondence of the paper's rows K and O.
    pub fn correspondence(&self, vertices: usize) -> Vec<Option<nalgebra::Point3<f64>>> {
        let mut found = vec![None; vertices];
        for (&source, &point) in self.source.iter().zip(&self.soup.points) {
            if let Some(slot) = source.and_then(|v| found.get_mut(v as usize)) {
                *slot = Some(point);
            }
        }
        found
    }
}

/// Why an attack cannot be made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum AttackError {
    /// A parameter is out of its range.
    #[error("the attack's parameter {name}={value} is not usable; it must be {range}")]
    Parameter {
        /// Its name in the spec.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What it may be, in words.
        range: &'static str,
    },
    /// No face is left, or there was none.
    #[error("the attack leaves no face of the mesh; use a weaker one or a mesh with faces")]
    NothingLeft,
    /// The result would be too large to work with.
    #[error("the attack makes more than {MOST_FACES} faces or cells; use fewer iterations or a coarser one")]
    TooManyFaces,
    /// All vertices are at one place, or too far apart for numbers, so there is no length to measure others by.
    #[error("the mesh has no size that the attack could measure lengths by")]
    NoExtent,
    /// The mesh cannot carry the second mark.
    #[error("a second mark does not fit: {0}")]
    SecondMark(#[from] BasisError),
}

/// Most faces that an attack makes. More would not fit into the memory of an ordinary machine.
pub(crate) const MOST_FACES: usize = 20_000_000;

/// Applies one attack.
///
/// # Errors
/// [`AttackError`] when a parameter is out of range or nothing would be left.
pub fn apply<R: Rng + ?Sized>(attack: &Attack, soup: &Soup, rng: &mut R) -> Result<Attacked, AttackError> {
    if soup.triangles.is_empty() {
        return Err(AttackError::NothingLeft);
    }
    let moved = |points| Attacked::in_place(Soup::new(points, soup.triangles.clone()));
    match attack {
        Attack::None => Ok(Attacked::in_place(soup.clone())),
        Attack::Reorder => Ok(reorder(soup, rng)),
        Attack::Noise { amplitude } => {
            in_range("amplitude", *amplitude, (0.0, 10.0), "between 0 and 10")?;
            let side = soup.bounding_box().map_or(0.0, |b| b.largest_side());
            Ok(moved(noise(&soup.points, amplitude * side, rng)))
        }
        Attack::CoordinateNoise { amplitude } => {
            in_range("amplitude", *amplitude, (0.0, 10.0), "between 0 and 10")?;
            Ok(moved(coordinate_noise(&soup.points, &soup.used(), *amplitude, rng)))
        }
        Attack::Smooth(smoothing) => {
            in_range("lambda", smoothing.lambda, (0.0, 1.0), "between 0 and 1")?;
            in_range("mu", smoothing.mu, (-2.0, 0.0), "between -2 and 0")?;
            Ok(moved(smooth(soup, smoothing)))
        }
        Attack::Laplacian(smoothing) => Ok(moved(laplacian(soup, smoothing)?)),
        Attack::Quantize { bits } => Ok(moved(quantize(soup, *bits)?)),
        Attack::Transform(transform) => {
            let similarity = random_similarity(transform, soup, rng)?;
            Ok(moved(soup.points.iter().map(|p| similarity * p).collect()))
        }
        Attack::Affine { strength } => Ok(moved(affine(soup, *strength, rng)?)),
        Attack::Projective { strength } => Ok(moved(projective(soup, *strength, rng)?)),
        Attack::FreeForm(form) => Ok(moved(free_form(soup, form, rng)?)),
        Attack::Simplify { ratio } => {
            in_range("ratio", *ratio, (0.0, 1.0), "between 0 and 1")?;
            let simplified = simplify(soup, *ratio);
            if simplified.soup.triangles.is_empty() { Err(AttackError::NothingLeft) } else { Ok(simplified) }
        }
        Attack::Subdivide(subdivision) => subdivide(soup, subdivision),
        Attack::Remesh(remeshing) => remesh(soup, remeshing),
        Attack::Isosurface { resolution } => isosurface(soup, *resolution),
        Attack::Watermark(mark) => {
            let sombrero_watermark::Parameters { basis, epsilon } = mark.parameters;
            in_range("epsilon", epsilon, (f64::MIN_POSITIVE, 1.0), "above 0 and at most 1")?;
            in_range("coefficients", basis.coefficients as f64, (4.0, f64::MAX), "at least 4")?;
            Ok(moved(second_watermark(soup, mark, rng)?))
        }
        Attack::Crop { fraction } => {
            in_range("fraction", *fraction, (0.0, 1.0), "between 0 and 1")?;
            crop(soup, *fraction)
        }
        Attack::CropVertices { share } => {
            in_range("vertices", *share, (0.0, 1.0), "between 0 and 1")?;
            crop_vertices(soup, *share)
        }
    }
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

pub(crate) fn in_range(
    name: &'static str,
    value: f64,
    (least, most): (f64, f64),
    range: &'static str,
) -> Result<(), AttackError> {
    if value >= least && value <= most { Ok(()) } else { Err(AttackError::Parameter { name, value, range }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use sombrero_mesh::repair;
    use sombrero_shapes as shapes;

    fn battery() -> Vec<Attack> {
        let specs = "none reorder noise:amplitude=0.01 smooth transform simplify:ratio=0.5 watermark crop:fraction=0.333 \
            laplacian quantize:bits=8 affine:strength=0.5 projective:strength=0.5 ffd:strength=0.1 \
            subdivide:scheme=midpoint subdivide:scheme=loop remesh:length=1.5 isosurface:resolution=16 \
            coordinate-noise:amplitude=0.01 crop:vertices=0.3";
        specs.split_whitespace().map(|s| s.parse().unwrap()).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn every_sequence_leaves_a_mesh_with_known_sources(order in prop::collection::vec(0usize..19, 1..5), seed in any::<u64>()) {
            let soup = shapes::bumpy_sphere(700);
            let attacks: Vec<Attack> = order.iter().map(|&i| battery()[i]).collect();
            let run = || apply_all(&attacks, &soup, &mut ChaCha8Rng::seed_from_u64(seed));
            let attacked = match run() {
                // Repeated cropping and simplifying may leave too little for a second mark.
                Err(AttackError::SecondMark(_)) => return Ok(()),
                other => other.unwrap(),
            };
            prop_assert_eq!(&attacked, &run().unwrap(), "same seed, same mesh");
            prop_assert_eq!(attacked.source.len(), attacked.soup.points.len());
            prop_assert!(!attacked.soup.triangles.is_empty());
            prop_assert!(repair(&attacked.soup).report.is_clean());
            let mut sources: Vec<u32> = attacked.source.iter().flatten().copied().collect();
            let count = sources.len();
            sources.sort_unstable();
            sources.dedup();
            prop_assert_eq!(sources.len(), count, "no two vertices from one");
        }
    }

    #[test]
    fn in_place_attacks_move_and_nothing_else() {
        let soup = shapes::bumpy_sphere(300);
        for spec in [
            "laplacian",
            "quantize:bits=6",
            "affine:strength=0.2",
            "projective:strength=0.2",
            "ffd:strength=0.05",
        ] {
            let draw =
                |seed| apply(&spec.parse().unwrap(), &soup, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let attacked = draw(1);
            assert_eq!(attacked.soup.triangles, soup.triangles);
            assert!(attacked.source.iter().enumerate().all(|(v, s)| *s == Some(v as u32)));
            assert_ne!(attacked.soup.points, soup.points);
            let chance = spec.contains("strength");
            assert_eq!(attacked.soup.points != draw(2).soup.points, chance, "{spec}");
        }
    }

    #[test]
    fn cropping_and_reordering_are_undone_by_the_correspondence() {
        let soup = shapes::bumpy_sphere(700);
        let attacks = ["reorder", "crop:fraction=0.5"].map(|s| s.parse().unwrap());
        let attacked = apply_all(&attacks, &soup, &mut ChaCha8Rng::seed_from_u64(3)).unwrap();
        let found = attacked.correspondence(soup.points.len());
        assert!(found.iter().zip(&soup.points).all(|(f, p)| f.is_none_or(|f| f == *p)));
        assert_eq!(found.iter().flatten().count(), attacked.soup.points.len());
    }

    #[test]
    fn meshes_of_any_size_are_attacked_or_refused() {
        for scale in [1e-320, 1e-200, 1e-100, 1.0, 1e60, 1e150, 1e300] {
            let mut soup = shapes::bumpy_sphere(200);
            soup.points.iter_mut().for_each(|p| *p *= scale);
            for attack in battery().iter().filter(|attack| !matches!(attack, Attack::Watermark(_))) {
                let attacked = apply(attack, &soup, &mut ChaCha8Rng::seed_from_u64(4));
                if scale <= 1e60 && scale > 1e-300 {
                    let bounds = attacked.unwrap().soup.bounding_box().unwrap();
                    let sides = bounds.largest_side() / scale;
                    assert!((0.1..20.0).contains(&sides), "{attack} at {scale}: {sides}");
                }
            }
        }
    }

    #[test]
    fn senseless_parameters_are_refused() {
        let soup = shapes::sphere(1);
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for attack in [
            Attack::Noise { amplitude: -1.0 },
            Attack::Noise { amplitude: f64::NAN },
            Attack::Simplify { ratio: 1.5 },
            Attack::Smooth(Smoothing { mu: 0.5, ..Smoothing::default() }),
            Attack::Transform(Transform { scale: Some(0.0), ..Transform::default() }),
            Attack::Laplacian(Laplacian { iterations: 1, lambda: -0.1 }),
            Attack::Quantize { bits: 0 },
            Attack::Quantize { bits: 25 },
            Attack::Affine { strength: -0.1 },
            Attack::Projective { strength: 1.0 },
            Attack::FreeForm(FreeForm { strength: 2.0, lattice: 4 }),
            Attack::FreeForm(FreeForm { strength: 0.1, lattice: 1 }),
            Attack::Isosurface { resolution: 1025 },
            "watermark:epsilon=2".parse().unwrap(),
            "subdivide:scheme=loop,iterations=11".parse().unwrap(),
            "remesh:length=0".parse().unwrap(),
            "remesh:length=1,iterations=1000".parse().unwrap(),
        ] {
            assert!(
                matches!(apply(&attack, &soup, &mut rng), Err(AttackError::Parameter { .. })),
                "{attack:?}"
            );
        }
        assert_eq!(apply(&Attack::Crop { fraction: 1.0 }, &soup, &mut rng), Err(AttackError::NothingLeft));
        assert_eq!(apply(&Attack::None, &Soup::default(), &mut rng), Err(AttackError::NothingLeft));
        let degenerate = Soup::new(soup.points.clone(), vec![[1, 1, 2]; 3]);
        assert_eq!(
            apply(&Attack::Simplify { ratio: 0.5 }, &degenerate, &mut rng),
            Err(AttackError::NothingLeft)
        );
    }
}
