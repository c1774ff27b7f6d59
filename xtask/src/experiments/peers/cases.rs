//! The cases that all peers are given, as plain little-endian arrays: see `benches/peers/README.md`.

use crate::experiments::case::read;
use anyhow::Context;
use nalgebra::{Isometry3, Matrix4, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, UnitSphere};
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::Basis;
use sombrero::io::{Format, encode};
use sombrero::mesh::Soup;
use sombrero::watermark::Preset;
use std::path::Path;

/// Poses in each kind of registration.
pub(crate) const TRIALS: usize = 5;

/// What is done to a suspect before it is moved.
const KINDS: [(&str, &str); 4] = [
    ("clean", "none"),
    ("simplify", "simplify:ratio=0.5"),
    ("noise", "noise:amplitude=0.002"),
    ("crop", "crop:fraction=0.667"),
];

/// Writes the cases unless they are there.
pub(crate) fn write(folder: &Path, models: &Path) -> anyhow::Result<()> {
    let done = folder.join("complete");
    if done.exists() {
        return Ok(());
    }
    eprintln!("making the cases");
    std::fs::create_dir_all(folder)?;
    let bunny = sombrero::Model::new(read(models, "bunny.ply")?.soup());
    let bunny = compact(bunny.soup());
    let big = attacked(&bunny, "subdivide:scheme=loop,iterations=2 noise:amplitude=0.00002", 3)?;
    for (model, soup) in [("bunny", &bunny), ("big", &big)] {
        let case = Case { folder, model, soup };
        case.write_mesh()?;
        case.write_fit()?;
        case.write_poses()?;
    }
    Ok(std::fs::write(done, [])?)
}

/// The mesh without vertices that no face uses.
fn compact(soup: &Soup) -> Soup {
    let repaired = sombrero::mesh::repair(soup);
    Soup::new(repaired.points, repaired.mesh.triangles())
}

fn attacked(soup: &Soup, specs: &str, seed: u64) -> anyhow::Result<Soup> {
    Ok(apply_all(&parse_list(specs)?, soup, &mut ChaCha8Rng::seed_from_u64(seed))?.soup)
}

/// B and the marked copy: the paper's 50 functions, with the coefficients of seed 5.
pub(crate) fn marked(soup: &Soup) -> anyhow::Result<(Basis, Vec<f64>, Vec<Point3<f64>>)> {
    let parameters = Preset::Paper.parameters();
    let basis = sombrero::Model::new(soup).basis(&parameters.basis)?;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let w: Vec<f64> = (0..basis.functions().len()).map(|_| StandardNormal.sample(&mut rng)).collect();
    let points = sombrero::watermark::embed(&soup.points, &basis, &w, parameters.epsilon);
    Ok((basis, w, points))
}

struct Case<'a> {
    folder: &'a Path,
    model: &'a str,
    soup: &'a Soup,
}

impl Case<'_> {
    fn put(&self, name: &str, bytes: Vec<u8>) -> anyhow::Result<()> {
        let path = self.folder.join(format!("{}.{name}", self.model));
        std::fs::write(&path, bytes).with_context(|| path.display().to_string())
    }

    fn put_mesh(&self, prefix: &str, soup: &Soup) -> anyhow::Result<()> {
        write_mesh(self.folder, &format!("{}.{prefix}", self.model), soup)
    }

    /// The mesh, as arrays and as files, and a query near each vertex: up to half a percent of the diagonal away.
    fn write_mesh(&self) -> anyhow::Result<()> {
        self.put_mesh("", self.soup)?;
        self.put("ply", single_precision(self.soup))?;
        self.put("obj", encode(Format::Obj, self.soup)?)?;
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let reach = 0.005 * diagonal(self.soup);
        let near = |p: &Point3<f64>| p + Vector3::from_fn(|_, _| rng.random_range(-reach..reach));
        let queries: Vec<Point3<f64>> = self.soup.points.iter().map(near).collect();
        self.put("q.f64", reals(coordinates(&queries)))
    }

    /// B of ε w, its right-hand side, and the marked copy simplified to a half.
    fn write_fit(&self) -> anyhow::Result<()> {
        let (basis, w, points) = marked(self.soup)?;
        let epsilon = Preset::Paper.parameters().epsilon;
        let (mut starts, mut rows, mut values) = (vec![0u64], Vec::new(), Vec::new());
        for (i, column) in basis.values().col_iter().enumerate() {
            let step = epsilon * basis.step(i);
            for (&vertex, &value) in column.row_indices().iter().zip(column.values()) {
                for axis in 0..3 {
                    rows.push((3 * vertex + axis) as u64);
                    values.push(value * step[axis]);
                }
            }
            starts.push(rows.len() as u64);
        }
        let right: Vec<f64> = points
            .iter()
            .zip(&self.soup.points)
            .flat_map(|(a, b)| {
                let d = a - b;
                [d.x, d.y, d.z]
            })
            .collect();
        let whole = |numbers: Vec<u64>| numbers.into_iter().flat_map(u64::to_le_bytes).collect::<Vec<u8>>();
        self.put("lsq.p", whole(starts))?;
        self.put("lsq.i", whole(rows))?;
        self.put("lsq.x", reals(values))?;
        self.put("lsq.r", reals(right))?;
        self.put("lsq.w", reals(w.clone()))?;
        self.put("fit.w", reals(w))?;
        self.put("fit.marked.f64", reals(coordinates(&points)))?;
        let copy = Soup::new(points, self.soup.triangles.clone());
        self.put_mesh("fit.", &attacked(&copy, "simplify:ratio=0.5", 0)?)
    }

    /// Suspects under any similarity, with a rough pose that brings them near.
    fn write_poses(&self) -> anyhow::Result<()> {
        let small = self.model == "bunny";
        for (kind, attack) in KINDS {
            for trial in 0..if small { TRIALS } else { usize::from(kind == "simplify") } {
                let mut rng = ChaCha8Rng::seed_from_u64(100 + trial as u64);
                let still = attacked(self.soup, attack, 100 + trial as u64)?;
                let motion = any_similarity(&mut rng, diagonal(self.soup));
                let moved = Soup::new(still.points.iter().map(|p| motion * p).collect(), still.triangles);
                let start = near(self.soup, &mut rng) * motion.inverse();
                let prefix = format!("{kind}.{trial}.");
                self.put_mesh(&prefix, &moved)?;
                self.put(&format!("{prefix}true.f64"), reals(rows(&motion)))?;
                self.put(&format!("{prefix}start.f64"), reals(rows(&start)))?;
            }
        }
        Ok(())
    }
}

/// Any rotation, a scale from 0.3 to 3, a shift about as long as the model.
fn any_similarity(rng: &mut impl Rng, diagonal: f64) -> Similarity3<f64> {
    let mut normal = || -> f64 { StandardNormal.sample(rng) };
    let rotation =
        UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(normal(), normal(), normal(), normal()));
    let shift = Vector3::from_fn(|_, _| diagonal * normal());
    let scale = rng.random_range(0.3f64.ln()..3f64.ln()).exp();
    Similarity3::from_isometry(Isometry3::from_parts(Translation3::from(shift), rotation), scale)
}

/// 5 degrees, 5 % of scale and about 3 % of the diagonal away from where the model is.
fn near(soup: &Soup, rng: &mut impl Rng) -> Similarity3<f64> {
    let mean = soup.points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / soup.points.len() as f64;
    let axis = Vector3::from(Distribution::<[f64; 3]>::sample(&UnitSphere, rng));
    let turned = UnitQuaternion::from_scaled_axis(axis * 5f64.to_radians());
    let shift = Vector3::from_fn(|_, _| {
        let step: f64 = StandardNormal.sample(rng);
        0.03 * diagonal(soup) * step / 3f64.sqrt()
    });
    let about = mean - 1.05 * (turned * mean) + shift;
    Similarity3::from_parts(Translation3::from(about), turned, 1.05)
}

pub(crate) fn diagonal(soup: &Soup) -> f64 {
    soup.bounding_box().map_or(0.0, |b| b.diagonal())
}

/// A binary PLY with 32-bit coordinates, which every peer reads.
fn single_precision(soup: &Soup) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        soup.points.len(),
        soup.triangles.len()
    )
    .into_bytes();
    bytes.extend(coordinates(&soup.points).into_iter().flat_map(|x| (x as f32).to_le_bytes()));
    for corners in &soup.triangles {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

fn coordinates(points: &[Point3<f64>]) -> Vec<f64> {
    points.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn reals(values: Vec<f64>) -> Vec<u8> {
    values.into_iter().flat_map(f64::to_le_bytes).collect()
}

fn rows(motion: &Similarity3<f64>) -> Vec<f64> {
    motion.to_homogeneous().transpose().iter().copied().collect()
}

/// A mesh as two arrays, whose names begin with `prefix`.
pub(crate) fn write_mesh(folder: &Path, prefix: &str, soup: &Soup) -> anyhow::Result<()> {
    let corners = soup.triangles.iter().flatten().flat_map(|i| i.to_le_bytes());
    std::fs::write(folder.join(format!("{prefix}v.f64")), reals(coordinates(&soup.points)))?;
    Ok(std::fs::write(folder.join(format!("{prefix}f.u32")), corners.collect::<Vec<u8>>())?)
}

/// Reading them back.
pub(crate) fn read_mesh(folder: &Path, prefix: &str) -> anyhow::Result<Soup> {
    let triangles = numbers(&folder.join(format!("{prefix}.f.u32")), u32::from_le_bytes)?;
    let triangles = triangles.as_chunks::<3>().0.to_vec();
    Ok(Soup::new(read_points(folder, &format!("{prefix}.v.f64"))?, triangles))
}

pub(crate) fn read_points(folder: &Path, name: &str) -> anyhow::Result<Vec<Point3<f64>>> {
    let values = read_reals(folder, name)?;
    Ok(values.as_chunks::<3>().0.iter().map(|&p| Point3::from(p)).collect())
}

pub(crate) fn read_matrix(folder: &Path, name: &str) -> anyhow::Result<Matrix4<f64>> {
    Ok(Matrix4::from_row_slice(&read_reals(folder, name)?))
}

fn read_reals(folder: &Path, name: &str) -> anyhow::Result<Vec<f64>> {
    numbers(&folder.join(name), f64::from_le_bytes)
}

fn numbers<const N: usize, T>(path: &Path, from: fn([u8; N]) -> T) -> anyhow::Result<Vec<T>> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    Ok(bytes.as_chunks::<N>().0.iter().map(|&c| from(c)).collect())
}
