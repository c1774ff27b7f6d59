//! Kinds of suspects, none of which carries the mark that is looked for.

use super::key_tests::{Extracted, KeyTest, key_tests};
use super::{STREAMS, rng};
use crate::experiments::case::{Case, random_secret};
use crate::experiments::tables::Method;
use nalgebra::{Point3, Similarity3};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::extraction::{Deformation, Modes, Nuisance};
use sombrero::mesh::Soup;
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::shapes;

/// A kind of suspect.
pub(super) struct Kind {
    pub(super) name: &'static str,
    /// Whether somebody else's mark is in it.
    marked: bool,
    registration: bool,
    /// Whether surfaces are compared (the robust method only) rather than vertices.
    pub(super) surface: bool,
    /// One suspect each, of every model.
    attacks: &'static [&'static str],
}

pub(super) const KINDS: [Kind; 8] = [
    Kind {
        name: "untouched original",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["none"],
    },
    Kind {
        name: "original, noise",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["noise:amplitude=0.002", "noise:amplitude=0.0045", "noise:amplitude=0.007"],
    },
    Kind {
        name: "original, smoothed",
        marked: false,
        registration: false,
        surface: false,
        attacks: &["smooth:iterations=5", "smooth:iterations=10", "smooth:iterations=20"],
    },
    Kind {
        name: "original, moved and registered",
        marked: false,
        registration: true,
        surface: false,
        attacks: &["transform", "noise:amplitude=0.002 transform", "smooth:iterations=10 transform"],
    },
    Kind {
        name: "marked by others",
        marked: true,
        registration: false,
        surface: false,
        attacks: &["none", "noise:amplitude=0.002", "smooth:iterations=10", "watermark"],
    },
    Kind {
        name: "original, simplified or remeshed",
        marked: false,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5",
            "simplify:ratio=0.05",
            "isosurface:resolution=64",
            "remesh:length=1",
        ],
    },
    Kind {
        name: "original, deformed or cropped",
        marked: false,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5 affine:strength=0.2",
            "simplify:ratio=0.5 ffd:strength=0.02",
            "simplify:ratio=0.5 crop:fraction=0.333",
        ],
    },
    Kind {
        name: "marked by others, simplified",
        marked: true,
        registration: true,
        surface: true,
        attacks: &[
            "simplify:ratio=0.5",
            "noise:amplitude=0.002 smooth:iterations=10 simplify:ratio=0.5 watermark",
        ],
    },
];
pub(super) const OTHER_MODEL: &str = "another model, registered and resampled";

impl Kind {
    pub(super) fn suspects(
        &self,
        method: Method,
        cases: &[(&str, Case)],
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<Extracted>> {
        let mut suspects = Vec::new();
        for (model, case) in cases {
            for specs in self.attacks {
                suspects.extend(self.extracted(method, case, &format!("{model} {specs}"), specs, rng)?);
            }
        }
        Ok(suspects)
    }

    fn extracted(
        &self,
        method: Method,
        case: &Case,
        name: &str,
        specs: &str,
        rng: &mut ChaCha8Rng,
    ) -> anyhow::Result<Vec<Extracted>> {
        let soup = match self.marked {
            true => case.marked(random_secret(rng))?.copy,
            false => case.soup().clone(),
        };
        let attacked = apply_all(&parse_list(specs)?, &soup, rng)?;
        let similarity = match self.registration {
            true => registered(case, &attacked.soup)?,
            false => Similarity3::identity(),
        };
        if self.surface {
            return surface(case, name, &moved(&attacked.soup, &similarity));
        }
        let known = attacked.correspondence(soup.points.len());
        let found: Vec<Option<Point3<f64>>> = known.iter().map(|p| p.map(|p| similarity * p)).collect();
        match method {
            Method::Paper => {
                let test = KeyTest::Correlation(case.extract(&found)?);
                Ok(vec![Extracted { name: name.into(), test }])
            }
            Method::Robust | Method::Faithful => {
                key_tests(name, &case.extractor()?.estimate_from_vertices(&found, NUISANCE)?)
            }
        }
    }
}

/// What is solved for beside the coefficients.
const NUISANCE: Nuisance = Nuisance { deformation: Deformation::Affine, modes: &[Modes::Smoothing] };

fn surface(case: &Case, name: &str, suspect: &Soup) -> anyhow::Result<Vec<Extracted>> {
    key_tests(name, &case.extractor()?.estimate_from_surface(suspect, NUISANCE)?)
}

fn moved(soup: &Soup, similarity: &Similarity3<f64>) -> Soup {
    Soup::new(soup.points.iter().map(|p| similarity * p).collect(), soup.triangles.clone())
}

fn registered(case: &Case, suspect: &Soup) -> anyhow::Result<Similarity3<f64>> {
    let original = case.soup();
    let reference = Reference::new(&original.points, &original.triangles)?;
    let options = RegisterOptions::default();
    Ok(register(&reference, &suspect.points, &suspect.triangles, &options)?.best.reference_from_suspect)
}

/// Surfaces that have nothing to do with the original, as far as they can be laid over it.
pub(super) fn other_models(
    method: Method,
    cases: &[(&str, Case)],
    which: u64,
) -> anyhow::Result<Vec<Extracted>> {
    let others: Vec<(&str, Soup)> = cases
        .iter()
        .map(|(name, case)| (*name, case.soup().clone()))
        .chain([("bumpy sphere", shapes::bumpy_sphere(4000)), ("torus", shapes::torus(80, 50, 1.0, 0.4))])
        .collect();
    let pairs: Vec<(u64, _, _)> = cases
        .iter()
        .flat_map(|case| others.iter().map(move |other| (case, other)))
        .filter(|(case, other)| case.0 != other.0)
        .zip(1..)
        .map(|((case, other), number)| (number, case, other))
        .collect();
    let extracted = pairs.into_par_iter().map(|(number, (model, case), (name, other))| {
        let similarity = registered(case, other)?;
        let moved = moved(other, &similarity);
        let name = format!("{model} against {name}");
        if method == Method::Robust {
            return surface(case, &name, &moved);
        }
        let mut rng = rng(which, STREAMS - number);
        let found = resample(case.soup(), &moved, &ResampleOptions::default(), &mut rng)?.positions;
        Ok(vec![Extracted { name, test: KeyTest::Correlation(case.extract(&found)?) }])
    });
    Ok(extracted.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect())
}
