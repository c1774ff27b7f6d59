//! Our side of each stage: what the peers do, by the crate that does it.

use super::Stage;
use super::cases::{TRIALS, diagonal, marked, read_matrix, read_mesh, read_points, write_mesh};
use super::measure::{Row, Subject, measure as timed};
use anyhow::anyhow;
use nalgebra::{Isometry3, Matrix3, Matrix4, Point3, Rotation3, Similarity3, UnitQuaternion};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use sombrero::basis::{Basis, BasisOptions};
use sombrero::extraction::{Deformation, Extractor, Nuisance, extract};
use sombrero::io::Document;
use sombrero::mesh::{Soup, repair};
use sombrero::progressive::ProgressiveMesh;
use sombrero::registration::{IcpOptions, Reference, RegisterOptions, align, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::spatial::Surface;
use sombrero::stats::Correlation;
use sombrero::watermark::Preset;
use std::collections::BTreeMap;
use std::path::Path;

/// Vertices: beyond that the paper's resampling takes minutes, and the peers that it is compared with are left out too.
const LARGEST_RESAMPLED: usize = 100_000;

type Accuracy = BTreeMap<String, Value>;

/// What the other functions here share.
struct Bench<'a> {
    cases: &'a Path,
    model: &'a str,
    repeats: usize,
}

pub(crate) fn measure(stage: Stage, cases: &Path, model: &str, repeats: usize) -> anyhow::Result<Vec<Row>> {
    let bench = Bench { cases, model, repeats };
    match stage {
        Stage::A => bench.conversion(),
        Stage::B => bench.closest_points(),
        Stage::C => bench.registration(),
        Stage::D => bench.least_squares(),
        Stage::E => bench.fitting(),
        Stage::F => bench.files(),
        Stage::Limit | Stage::G => Ok(Vec::new()),
    }
}

impl Bench<'_> {
    fn subject<'a>(&'a self, stage: &'a str, variant: &'a str) -> Subject<'a> {
        Subject { stage, model: self.model, variant, repeats: self.repeats }
    }

    fn mesh(&self) -> anyhow::Result<Soup> {
        read_mesh(self.cases, self.model)
    }

    /// Down to the base, every collapse recorded; its shape is scored at 200 faces. Then the basis on it.
    fn conversion(&self) -> anyhow::Result<Vec<Row>> {
        let made = repair(&self.mesh()?);
        let converted = timed(
            &self.subject("a simplify to 200 faces", "every collapse recorded, down to the base"),
            |_| Ok(ProgressiveMesh::new(made.mesh.clone(), &made.points).expect("repaired points are finite")),
            |done| {
                let mut progressive = done[0].clone();
                while progressive.mesh().face_count() < 200 && progressive.refine().is_some() {}
                self.leave(&Soup::new(made.points.clone(), progressive.mesh().triangles()))
            },
        )?;
        let progressive =
            ProgressiveMesh::new(made.mesh.clone(), &made.points).expect("repaired points are finite");
        let basis = timed(
            &self.subject("a basis of 50 functions", ""),
            |_| Ok(Basis::new(progressive.clone(), &made.points, &BasisOptions::default())?),
            |done| Ok([("entries".into(), done[0].values().nnz().into())].into()),
        )?;
        Ok(vec![converted, basis])
    }

    /// Leaves a mesh for the score, as the peers do.
    fn leave(&self, soup: &Soup) -> anyhow::Result<Accuracy> {
        let scratch = self.cases.with_file_name("scratch");
        let tag = format!("{}.sombrero", self.model);
        write_mesh(&scratch, &format!("{tag}."), soup)?;
        Ok([("score".into(), tag.into())].into())
    }

    /// Largest difference to the answers of all faces within reach would be slow to have; the mean square distance is
    /// compared with the peers' instead, and the crate's tests compare with brute force.
    fn closest_points(&self) -> anyhow::Result<Vec<Row>> {
        let Soup { points, triangles } = self.mesh()?;
        let queries = read_points(self.cases, &format!("{}.q.f64", self.model))?;
        let built = timed(
            &self.subject("b build", ""),
            |_| Ok(Surface::new(&points, &triangles)),
            |_| Ok(Accuracy::new()),
        )?;
        let surface = Surface::new(&points, &triangles);
        let all = |threads| -> anyhow::Result<Row> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            let variant = if threads == 1 { "1 thread" } else { "all threads" };
            timed(
                &self.subject("b query", variant),
                |_| Ok(pool.install(|| surface.closest_many(&queries))),
                |done| {
                    let squares: f64 = done[0].iter().flatten().map(|c| c.squared_distance).sum();
                    let rms = (squares / queries.len() as f64).sqrt();
                    Ok([("rms_distance".into(), rms.into()), ("queries".into(), queries.len().into())].into())
                },
            )
        };
        Ok(vec![built, all(1)?, all(0)?])
    }

    fn registration(&self) -> anyhow::Result<Vec<Row>> {
        let original = self.mesh()?;
        let mut rows = Vec::new();
        for kind in ["clean", "simplify", "noise", "crop"] {
            let prefix = |trial: usize| format!("{}.{kind}.{trial}", self.model);
            let exists = |trial: &usize| self.cases.join(format!("{}.v.f64", prefix(*trial))).exists();
            let poses = (0..TRIALS).take_while(exists).map(|t| Posed::read(self.cases, &prefix(t)));
            let poses: Vec<Posed> = poses.collect::<anyhow::Result<_>>()?;
            if poses.is_empty() {
                continue;
            }
            for (place, near) in [("local", true), ("global", false)] {
                let bench = Bench { repeats: poses.len(), ..*self };
                rows.push(timed(
                    &bench.subject(&format!("c {place}, {kind}"), ""),
                    |trial| poses[trial].registered(&original, near),
                    |found| {
                        let mut errors: Vec<f64> =
                            found.iter().zip(&poses).map(|(f, pose)| pose.error(f, &original)).collect();
                        let rms = super::measure::median(&mut errors);
                        Ok([("rms".into(), rms.into()), ("worst".into(), errors[errors.len() - 1].into())]
                            .into())
                    },
                )?);
            }
        }
        Ok(rows)
    }

    fn least_squares(&self) -> anyhow::Result<Vec<Row>> {
        let soup = self.mesh()?;
        let (basis, w, points) = marked(&soup)?;
        let found: Vec<Option<Point3<f64>>> = points.into_iter().map(Some).collect();
        let epsilon = Preset::Paper.parameters().epsilon;
        let row = timed(
            &self.subject("d least squares", ""),
            |_| Ok(extract(&basis, epsilon, &soup.points, &found)?),
            |done| {
                let difference = |(found, w): (&Option<f64>, &f64)| (found.unwrap_or(0.0) - w).powi(2);
                let error: f64 = done[0].coefficients.iter().zip(&w).map(difference).sum();
                let size: f64 = w.iter().map(|w| w * w).sum();
                Ok([
                    ("rel_err".into(), (error / size).sqrt().into()),
                    ("nnz".into(), (3 * basis.values().nnz()).into()),
                ]
                .into())
            },
        )?;
        Ok(vec![row])
    }

    /// The robust method's fit and the paper's resampling, both with what they prepare for one suspect.
    fn fitting(&self) -> anyhow::Result<Vec<Row>> {
        let soup = self.mesh()?;
        let (basis, w, _) = marked(&soup)?;
        let epsilon = Preset::Paper.parameters().epsilon;
        let suspect = read_mesh(self.cases, &format!("{}.fit", self.model))?;
        let truth = read_points(self.cases, &format!("{}.fit.marked.f64", self.model))?;
        let nuisance = Nuisance { deformation: Deformation::Similarity, modes: &[] };
        let rms = |found: &[Point3<f64>]| {
            let squares: f64 = found.iter().zip(&truth).map(|(a, b)| (a - b).norm_squared()).sum();
            (squares / truth.len() as f64).sqrt() / diagonal(&soup)
        };
        let robust = timed(
            &self.subject("e fit", "robust, surface to surface"),
            |_| Ok(Extractor::new(&basis, epsilon, &soup)?.estimate_from_surface(&suspect, nuisance)?),
            |done| {
                let rho = Correlation::of(&done[0].coefficients, &w)?.rho();
                Ok([("rms".into(), rms(&done[0].positions).into()), ("rho".into(), rho.into())].into())
            },
        )?;
        if soup.points.len() > LARGEST_RESAMPLED {
            return Ok(vec![robust]);
        }
        let paper = timed(
            &self.subject("e fit", "the paper's resampling"),
            |_| {
                Ok(resample(&soup, &suspect, &ResampleOptions::default(), &mut ChaCha8Rng::seed_from_u64(0))?)
            },
            |done| {
                let read = extract(&basis, epsilon, &soup.points, &done[0].positions)?;
                let coefficients: Vec<f64> = read.coefficients.iter().map(|c| c.unwrap_or(0.0)).collect();
                let found: Vec<Point3<f64>> = done[0]
                    .positions
                    .iter()
                    .zip(&soup.points)
                    .map(|(found, p)| found.unwrap_or(*p))
                    .collect();
                let rho = Correlation::of(&coefficients, &w)?.rho();
                Ok([("rms".into(), rms(&found).into()), ("rho".into(), rho.into())].into())
            },
        )?;
        Ok(vec![robust, paper])
    }

    fn files(&self) -> anyhow::Result<Vec<Row>> {
        let mut rows = Vec::new();
        for extension in ["obj", "ply"] {
            let path = self.cases.join(format!("{}.{extension}", self.model));
            let speed = |bytes: usize| Accuracy::from([("mb".into(), (bytes as f64 / 1e6).into())]);
            rows.push(timed(
                &self.subject(&format!("f load {extension}"), "everything kept"),
                |_| Ok(Document::read(&path)?),
                |done| Ok(speed(done[0].bytes().len())),
            )?);
            let document = Document::read(&path)?;
            let copy = path.with_file_name(format!("copy.{extension}"));
            rows.push(timed(
                &self.subject(&format!("f save {extension}"), "everything kept"),
                |_| {
                    let bytes = document.with_points(document.points())?;
                    std::fs::write(&copy, &bytes)?;
                    Ok(bytes.len())
                },
                |done| Ok(speed(done[0])),
            )?);
            std::fs::remove_file(&copy)?;
        }
        Ok(rows)
    }
}

/// A suspect somewhere, where it came from, and roughly how it goes back.
struct Posed {
    suspect: Soup,
    truth: Matrix4<f64>,
    start: Similarity3<f64>,
}

impl Posed {
    fn read(cases: &Path, prefix: &str) -> anyhow::Result<Self> {
        let matrix = |name| read_matrix(cases, &format!("{prefix}.{name}.f64"));
        let start = similarity(&matrix("start")?)?;
        Ok(Self { suspect: read_mesh(cases, prefix)?, truth: matrix("true")?, start })
    }

    fn registered(&self, original: &Soup, near: bool) -> anyhow::Result<Matrix4<f64>> {
        let reference = Reference::new(&original.points, &original.triangles)?;
        let Soup { points, triangles } = &self.suspect;
        let found = if near {
            align(&reference, points, triangles, &self.start, &IcpOptions::default())?
        } else {
            register(&reference, points, triangles, &RegisterOptions::default())?
        };
        Ok(found.best.reference_from_suspect.to_homogeneous())
    }

    /// Root mean square, over the original, of how far there and back is from where it was; in diagonals.
    fn error(&self, found: &Matrix4<f64>, original: &Soup) -> f64 {
        let round = found * self.truth;
        let squares: f64 =
            original.points.iter().map(|p| (round.transform_point(p) - p).norm_squared()).sum();
        (squares / original.points.len() as f64).sqrt() / diagonal(original)
    }
}

fn similarity(matrix: &Matrix4<f64>) -> anyhow::Result<Similarity3<f64>> {
    let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let scale = linear.determinant().cbrt();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(linear / scale));
    let shift = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    if scale <= 0.0 {
        return Err(anyhow!("a pose that is no similarity"));
    }
    Ok(Similarity3::from_isometry(Isometry3::from_parts(shift.into(), rotation), scale))
}
