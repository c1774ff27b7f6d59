//! `cargo xtask collusion`: several of a thousand buyers average their copies. How many of them are named, and is
//! anybody else?

use super::case::read;
use anyhow::Context;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::BasisOptions;
use sombrero::io::{Document, Format, Rewrite, encode};
use sombrero::mesh::Soup;
use sombrero::watermark::{Derivation, Identity, Key, Parameters, Preset, Secret};
use sombrero::{DetectOptions, Embedder, Trace, Tracer};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Leakers.
const COUNTS: [usize; 11] = [1, 2, 3, 5, 8, 10, 12, 15, 20, 25, 30];

/// What is done to the mean, so that it is not found by its connectivity alone.
const ATTACKS: [(&str, &str); 4] = [
    ("mean of the copies", "none"),
    ("mean, noise 0.2 %", "noise:amplitude=0.002"),
    ("mean, smoothing", "smooth:iterations=10"),
    ("mean, moved, simplified to a half", "transform simplify:ratio=0.5"),
];

/// What to try.
#[derive(clap::Args)]
pub(crate) struct Collusion {
    /// Choices of leakers for each cell.
    #[arg(long, default_value_t = 5)]
    runs: u64,
    /// How many have a copy.
    #[arg(long, default_value_t = 1000)]
    buyers: usize,
    /// Models.
    #[arg(long, value_delimiter = ',', default_values_t = ["fandisk".to_owned(), "bunny".to_owned()])]
    only: Vec<String>,
    /// Numbers of coefficients.
    #[arg(long, value_delimiter = ',', default_values_t = [200, 400])]
    coefficients: Vec<usize>,
    /// Where `collusion.md` and `collusion.json` are written.
    #[arg(long, default_value = "docs/collusion")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Cell {
    model: String,
    coefficients: usize,
    attack: &'static str,
    leakers: usize,
    /// Of the leakers, one number a run.
    named: Vec<usize>,
    /// Of all others.
    innocent: Vec<usize>,
    /// The leaker that shows least, and the best of the others.
    weakest_log10_p: Vec<f64>,
    best_innocent_log10_p: Vec<f64>,
}

pub(crate) fn run(args: &Collusion, folder: &Path) -> anyhow::Result<()> {
    let mut cells = Vec::new();
    for model in &args.only {
        let known = super::tables::paper::MODELS.iter().find(|m| m.name == model.as_str());
        let document = read(folder, known.with_context(|| format!("no model `{model}`"))?.file)?;
        for &coefficients in &args.coefficients {
            let usual = Preset::Robust.parameters();
            let basis = BasisOptions { coefficients, ..usual.basis };
            // As far as the usual mark moves vertices: the energy is shared by twice as many.
            let epsilon = usual.epsilon * (usual.basis.coefficients as f64 / coefficients as f64).sqrt();
            let shop = Shop::new(&document, Parameters { preset: None, basis, epsilon }, args.buyers)?;
            for (attack, specs) in ATTACKS {
                for leakers in COUNTS.into_iter().filter(|&count| count <= args.buyers) {
                    let cell = shop.cell(model, attack, specs, leakers, args.runs)?;
                    eprintln!(
                        "{model} {coefficients} {attack} {leakers}: {:?} {:?}",
                        cell.named, cell.innocent
                    );
                    cells.push(cell);
                }
            }
        }
    }
    let text = markdown(args, &cells);
    println!("{text}");
    std::fs::create_dir_all(&args.out)?;
    std::fs::write(args.out.join("collusion.md"), text)?;
    Ok(std::fs::write(args.out.join("collusion.json"), serde_json::to_string_pretty(&cells)? + "\n")?)
}

/// An original, everybody's secret, and all keys.
struct Shop<'a> {
    embedder: Embedder<'a>,
    tracer: Tracer,
    buyers: Vec<(Identity, Secret)>,
    triangles: &'a [[u32; 3]],
}

impl<'a> Shop<'a> {
    fn new(document: &'a Document, parameters: Parameters, buyers: usize) -> anyhow::Result<Self> {
        let stub = Derivation::stub_for_experiments();
        let embedder = Embedder::new(document, parameters, false)?.with_derivation(stub);
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let buyer =
            |i| (Identity { owner: String::new(), recipient: format!("buyer {i}") }, Secret(rng.random()));
        let buyers: Vec<(Identity, Secret)> = (0..buyers).map(buyer).collect();
        let keys: Vec<Key> = buyers.iter().map(|(who, secret)| embedder.key(who.clone(), *secret)).collect();
        let (tracer, rejected) = Tracer::trusting(document, keys)?;
        anyhow::ensure!(rejected.is_empty(), "a key of our own was rejected");
        Ok(Self { embedder, tracer, buyers, triangles: document.triangles() })
    }

    fn cell(
        &self,
        model: &str,
        attack: &'static str,
        specs: &str,
        leakers: usize,
        runs: u64,
    ) -> anyhow::Result<Cell> {
        let mut cell = Cell {
            model: model.to_owned(),
            coefficients: self.embedder.parameters().basis.coefficients,
            attack,
            leakers,
            named: Vec::new(),
            innocent: Vec::new(),
            weakest_log10_p: Vec::new(),
            best_innocent_log10_p: Vec::new(),
        };
        let attacks = parse_list(specs)?;
        for seed in 0..runs {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let guilty = distinct(leakers, self.buyers.len(), &mut rng);
            let suspect = apply_all(&attacks, &self.mean(&guilty)?, &mut rng)?.soup;
            let file = Document::parse(encode(Format::PlyBinaryLittleEndian, &suspect)?, None)?;
            let trace = self.tracer.trace(&file, &DetectOptions::default())?;
            let count = |leaks: bool| {
                trace.recipients.iter().filter(|r| r.named && guilty.contains(&r.index) == leaks).count()
            };
            cell.named.push(count(true));
            cell.innocent.push(count(false));
            let scores = |leaks: bool| scores(&trace, &guilty, leaks);
            cell.weakest_log10_p.push(scores(true).fold(f64::NEG_INFINITY, f64::max));
            cell.best_innocent_log10_p.push(scores(false).fold(0.0, f64::min));
        }
        Ok(cell)
    }

    /// Vertex by vertex, of the copies as files store them.
    fn mean(&self, guilty: &[usize]) -> anyhow::Result<Soup> {
        let mut sums = Vec::new();
        for &i in guilty {
            let (identity, secret) = self.buyers[i].clone();
            let copy = self.embedder.mark(identity, secret, &Rewrite::default())?;
            sums.resize(copy.points.len(), Vector3::<f64>::zeros());
            sums.iter_mut().zip(&copy.points).for_each(|(sum, p)| *sum += p.coords);
        }
        let points = sums.into_iter().map(|sum| (sum / guilty.len() as f64).into()).collect();
        Ok(Soup::new(points, self.triangles.to_vec()))
    }
}

/// So many different numbers below `limit`.
fn distinct(count: usize, limit: usize, rng: &mut ChaCha8Rng) -> Vec<usize> {
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let next = rng.random_range(0..limit);
        if !chosen.contains(&next) {
            chosen.push(next);
        }
    }
    chosen
}

fn scores<'t>(trace: &'t Trace, guilty: &'t [usize], leaks: bool) -> impl Iterator<Item = f64> + 't {
    trace.recipients.iter().filter(move |r| guilty.contains(&r.index) == leaks).map(|r| r.log10_p)
}

fn markdown(args: &Collusion, cells: &[Cell]) -> String {
    let mut text = format!(
        "# Leakers who average their copies\n\n\
         Of {} buyers some average their copies. Named of them, smallest of {} runs (innocents named in all runs); and \
         the largest log10 p among the leakers, median of the runs. Threshold -6, corrected for all buyers and tests. \
         With more coefficients the strength is lowered so that vertices move about as far. \
         Made by `cargo xtask collusion`.\n",
        args.buyers, args.runs
    );
    for model in &args.only {
        for &coefficients in &args.coefficients {
            let _ = write!(text, "\n## {model}, {coefficients} coefficients\n\n| leakers |");
            ATTACKS.iter().for_each(|(attack, _)| text += &format!(" {attack} |"));
            text += &format!("\n|---:|{}\n", "---:|".repeat(ATTACKS.len()));
            for leakers in COUNTS {
                let of = |attack: &str| {
                    cells.iter().find(|c| {
                        c.model == *model
                            && c.coefficients == coefficients
                            && c.leakers == leakers
                            && c.attack == attack
                    })
                };
                let row: Vec<String> =
                    ATTACKS.iter().filter_map(|(attack, _)| of(attack)).map(shown).collect();
                if !row.is_empty() {
                    let _ = writeln!(text, "| {leakers} | {} |", row.join(" | "));
                }
            }
        }
    }
    text
}

fn shown(cell: &Cell) -> String {
    let least = cell.named.iter().min().copied().unwrap_or(0);
    let innocent: usize = cell.innocent.iter().sum();
    let weakest = sombrero::stats::median(&cell.weakest_log10_p).unwrap_or(0.0);
    format!("{least} ({innocent}); {weakest:.1}")
}
