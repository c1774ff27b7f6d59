//! Marks models with spectral fields and shows what is seen and what survives. An experiment.
#![allow(clippy::print_stdout, reason = "an experiment")]

use anyhow::Result;
use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sombrero::{DetectOptions, Detector, Model, PreparedBasis, attack, io::Document};
use sombrero_attacks::Attack;
use sombrero_basis::{Amplitudes, Basis, BasisFunction, BasisOptions};
use sombrero_spectral::{Fields, FieldsOptions};
use sombrero_watermark::{Derivation, Identity, Key, OriginalDigest, Parameters, Secret, embed};
use std::time::Instant;

const ATTACKS: [(&str, &str); 18] = [
    ("none", "none"),
    ("noise", "noise:amplitude=0.002"),
    ("1/8", "simplify:ratio=0.125 transform"),
    ("9bit", "quantize:bits=9"),
    ("2nd", "watermark:preset=robust"),
    (
        "R",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark crop:fraction=0.333",
    ),
    ("1/2", "simplify:ratio=0.5 transform"),
    ("smooth", "smooth:iterations=10"),
    ("iso128", "isosurface:resolution=128 transform"),
    ("ffd", "simplify:ratio=0.5 ffd:strength=0.02 transform"),
    ("crop", "transform crop:fraction=0.333"),
    ("cropx", "crop:fraction=0.666 simplify:ratio=0.5 transform"),
    ("n0.45", "noise:amplitude=0.0045"),
    ("n0.7", "noise:amplitude=0.007"),
    ("2ndx", "reorder transform watermark:preset=robust"),
    (
        "R-2",
        "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 crop:fraction=0.333",
    ),
    ("R-c", "reorder noise:amplitude=0.002 smooth:iterations=10 transform simplify:ratio=0.5 watermark"),
    ("R-s", "reorder noise:amplitude=0.002 transform simplify:ratio=0.5 watermark crop:fraction=0.333"),
];

fn main() -> Result<()> {
    let mut options = FieldsOptions::default();
    let (mut models, mut rows, mut epsilon, mut secrets, mut out) =
        (vec![], "none,noise,1/8,9bit,2nd,R".to_string(), 0.0041, 1u8, None);
    for arg in std::env::args().skip(1) {
        match arg.split_once('=') {
            None => models.push(arg),
            Some(("pieces", x)) => options.pieces = x.parse()?,
            Some(("each", x)) => options.of_each = x.parse()?,
            Some(("noise", x)) => options.noise = x.parse()?,
            Some(("reach", x)) => options.reach = x.parse()?,
            Some(("vertices", x)) => options.vertices = x.parse()?,
            Some(("share", x)) => options.share = x.parse()?,
            Some(("rows", x)) => rows = x.into(),
            Some(("epsilon", x)) => epsilon = x.parse()?,
            Some(("secrets", x)) => secrets = x.parse()?,
            Some(("out", x)) => out = Some(x.to_string()),
            Some((name, _)) => anyhow::bail!("what is {name}?"),
        }
    }
    options.turn = epsilon;
    println!("{options:?}");
    for path in models {
        let bytes = std::fs::read(&path)?;
        let extension = path.rsplit('.').next();
        let document = Document::parse(bytes, extension)?;
        let model = Model::new(document.soup());
        let made = model.repaired();
        let start = Instant::now();
        let mut progressive = model.progressive();
        print!("progressive {:.2} s, ", start.elapsed().as_secs_f64());
        let start = Instant::now();
        let fields = Fields::new(&mut progressive, &made.points, &options)?;
        let seconds = start.elapsed().as_secs_f64();
        // Back to points.
        let points = &model.soup().points;
        let columns: Vec<Vec<(u32, Vector3<f64>)>> = fields
            .columns
            .iter()
            .map(|c| c.iter().map(|(v, d)| (made.source[*v as usize], *d)).collect())
            .map(|mut c: Vec<(u32, Vector3<f64>)>| {
                c.dedup_by_key(|e| e.0);
                c
            })
            .collect();
        let m = columns.len();
        let nnz: usize = columns.iter().map(Vec::len).sum();
        let basis = Basis::of_fields(points.len(), &columns);
        println!(
            "{path}: m {m}, {} planes, {:.1} a vertex, {seconds:.2} s",
            fields.planes,
            nnz as f64 / points.len() as f64
        );
        let basis_options = BasisOptions {
            coefficients: m,
            function: BasisFunction::Sombrero,
            amplitudes: Amplitudes::RootHeights,
        };
        let parameters = Parameters { preset: None, basis: basis_options, epsilon };
        let digest = OriginalDigest::of(document.parts());
        for secret in 1..=secrets {
            let key = Key::new(
                &digest,
                Identity::default(),
                Secret([secret; 32]),
                parameters,
                &basis.digest(),
                Derivation::STANDARD,
            );
            let moved = embed(points, &basis, &key.watermark, epsilon);
            show(&model, &moved);
            let marked = document.with_points(&model.stored_from_points(&moved))?;
            if let Some(out) = &out {
                std::fs::write(format!("{out}.{}", extension.unwrap_or("obj")), &marked)?;
            }
            if rows.is_empty() {
                continue;
            }
            let marked = Document::parse(marked, extension)?;
            let detector =
                Detector::with_prepared_basis(&document, key, PreparedBasis::from_basis(basis.clone()))?;
            for (name, spec) in
                ATTACKS.iter().filter(|(name, _)| rows == "all" || rows.split(',').any(|r| r == *name))
            {
                let attacks: Vec<Attack> = spec.split(' ').map(str::parse).collect::<Result<_, _>>()?;
                let mut rng = ChaCha8Rng::seed_from_u64(u64::from(secret));
                let attacked = attack(&marked, &attacks, &mut rng)?;
                let suspect = Document::parse(attacked.bytes, extension)?;
                let start = Instant::now();
                let found = detector.detect(&detector.suspect(&suspect), &DetectOptions::default())?;
                print!("  {name} {:.1} ({:.1}s)", found.log10_p, start.elapsed().as_secs_f64());
                use std::io::Write;
                std::io::stdout().flush()?;
            }
            println!();
        }
    }
    Ok(())
}

fn show(model: &Model, moved: &[Point3<f64>]) {
    let soup = model.soup();
    let diagonal = model.bounding_box().expect("a model has an extent").diagonal();
    let (mut turned, mut area, mut square) = (Vec::new(), 0.0, 0.0);
    for t in &soup.triangles {
        let n = |p: &[Point3<f64>]| {
            let [a, b, c] = t.map(|v| p[v as usize]);
            (b - a).cross(&(c - a)) / 2.0
        };
        let (x, y) = (n(&soup.points), n(moved));
        let a = x.norm();
        if a == 0.0 || y.norm() == 0.0 {
            continue;
        }
        let chord = (x.normalize() - y.normalize()).norm();
        turned.push((2.0 * (chord / 2.0).min(1.0).asin(), a));
        let d: Vector3<f64> =
            t.iter().map(|&v| moved[v as usize] - soup.points[v as usize]).sum::<Vector3<f64>>() / 3.0;
        square += a * d.dot(&x.normalize()).powi(2);
        area += a;
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rms = (turned.iter().map(|(t, a)| t * t * a).sum::<f64>() / area).sqrt().to_degrees();
    let quantile = |q: f64| {
        let mut sum = 0.0;
        turned
            .iter()
            .find(|(_, a)| {
                sum += a;
                sum >= q * area
            })
            .map_or(0.0, |t| t.0.to_degrees())
    };
    let made = model.repaired();
    let at: Vec<Point3<f64>> = made.source.iter().map(|&p| moved[p as usize]).collect();
    println!(
        "  mrms {:.4} % of the diagonal, normals {rms:.3} rms {:.3} p99 {:.3} max, flatness {:.1e}",
        100.0 * (square / area).sqrt() / diagonal,
        quantile(0.99),
        quantile(1.0),
        Fields::flatness(&made.points, &at, &made.mesh.triangles())
    );
}
