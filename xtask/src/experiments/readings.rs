//! `cargo xtask readings`: what each choice that the paper leaves open does to its Tables 1 and 2. One choice at a time is made
//! otherwise than `--method paper` makes it; only rows that can feel it are computed again.

use super::case::{read, secret_of_seed};
use super::tables::paper::{MODELS, Model, ROWS, Row, table2};
use anyhow::Context;
use nalgebra::{Point3, Similarity3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::attacks::{apply_all, parse_list};
use sombrero::basis::{Basis, BasisFunction, BasisOptions};
use sombrero::extraction::extract;
use sombrero::mesh::Soup;
use sombrero::registration::{Reference, RegisterOptions, register};
use sombrero::resampling::{ResampleOptions, resample};
use sombrero::stats::{WatermarkTestOptions, median, watermark_test};
use sombrero::watermark::{Preset, embed};
use sombrero_tests::recorded_watermark;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What to compute.
#[derive(clap::Args)]
pub(crate) struct Readings {
    /// Seeds for each cell.
    #[arg(long, default_value_t = 20)]
    runs: u64,
    /// Models, separated by commas. Default: all four.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Readings whose names contain one of these, separated by commas; the one that is taken is always among them. Default: all.
    #[arg(long, value_delimiter = ',')]
    readings: Vec<String>,
    /// Where `readings.md` and `readings.json` are written.
    #[arg(long, default_value = "docs/tables")]
    out: PathBuf,
}

/// A way to read the paper.
#[derive(Clone)]
struct Reading {
    name: &'static str,
    what: &'static str,
    /// Which rows can feel what it changes.
    feels: fn(&Row) -> bool,
    register: RegisterOptions,
    resample: ResampleOptions,
    test: WatermarkTestOptions,
    /// In the attacks: a text, and what stands instead.
    attack: Option<(&'static str, &'static str)>,
    /// Whether the original is laid on the suspect, instead of the suspect on the original.
    reversed: bool,
    /// Whether splits that turn a face by more than 45 degrees carry a mark too.
    all_splits: bool,
}

fn everything(_: &Row) -> bool {
    true
}

impl Reading {
    /// As `--method paper` has it.
    fn taken() -> Self {
        Self {
            name: "taken",
            what: "as `--method paper` has it",
            feels: everything,
            register: RegisterOptions::default(),
            resample: ResampleOptions::default(),
            test: WatermarkTestOptions::default(),
            attack: None,
            reversed: false,
            all_splits: false,
        }
    }

    /// One choice made otherwise, which these rows can feel.
    fn otherwise(
        name: &'static str,
        what: &'static str,
        feels: fn(&Row) -> bool,
        change: impl FnOnce(&mut Self),
    ) -> Self {
        let mut reading = Self { name, what, feels, ..Self::taken() };
        change(&mut reading);
        reading
    }

    fn all() -> Vec<Self> {
        [vec![Self::taken()], Self::of_registration(), Self::of_resampling(), Self::of_the_rest()].concat()
    }

    fn of_registration() -> Vec<Self> {
        let otherwise =
            |name, what, change: fn(&mut Self)| Self::otherwise(name, what, |row| row.registration, change);
        vec![
            otherwise(
                "robust to the end",
                "registration: pairs that fit weigh more in the last round too",
                |r| r.register.icp.uniform_reach = None,
            ),
            otherwise(
                "all alike",
                "registration: no pair weighs more than another in any round, none is rejected",
                |r| (r.register.icp.tukey, r.register.icp.rejection) = (None, None),
            ),
            otherwise(
                "near pairs",
                "registration: the last round takes pairs within 0.5 % of the diagonal instead of 2 %",
                |r| r.register.icp.uniform_reach = Some(0.005),
            ),
            otherwise("all pairs", "registration: the last round takes pairs however far apart", |r| {
                r.register.icp.uniform_reach = Some(1.0);
            }),
            otherwise(
                "the other way round",
                "registration: points of the original on planes of the suspect",
                |r| r.reversed = true,
            ),
            otherwise("2,000 samples", "registration: a tenth of the samples", |r| {
                r.register.icp.samples = 2_000;
            }),
            otherwise("200,000 samples", "registration: ten times the samples", |r| {
                r.register.icp.samples = 200_000;
            }),
        ]
    }

    fn of_resampling() -> Vec<Self> {
        let otherwise =
            |name, what, change: fn(&mut Self)| Self::otherwise(name, what, |row| row.resampling, change);
        vec![
            otherwise("c_d as printed", "resampling: springs of 1e-3 instead of 0.2", |r| {
                r.resample.deform_weight = 1e-3;
            }),
            otherwise("c_f = 1e-2", "resampling: turned faces weigh three times as much", |r| {
                r.resample.flip_weight = 1e-2;
            }),
            otherwise("no c_f", "resampling: turned faces weigh nothing", |r| r.resample.flip_weight = 0.0),
            otherwise(
                "full distances",
                "resampling: distances to feet that stay where they are for a round, not along the normal",
                |r| r.resample.sliding_resistance = 1.0,
            ),
            otherwise("4 samples a vertex", "resampling: half of the samples", |r| {
                r.resample.samples_per_vertex = 4.0;
            }),
        ]
    }

    fn of_the_rest() -> Vec<Self> {
        let smoothed = |row: &Row| row.attack.contains("smooth");
        vec![
            Self::otherwise(
                "Taubin 0.5",
                "smoothing: λ = 0.5, μ = -0.53 instead of 0.33, -0.34",
                smoothed,
                |r| r.attack = Some(("smooth:iterations=10", "smooth:iterations=10,lambda=0.5,mu=-0.53")),
            ),
            Self::otherwise("Taubin 0.63", "smoothing: λ = 0.63, μ = -0.67", smoothed, |r| {
                r.attack = Some(("smooth:iterations=10", "smooth:iterations=10,lambda=0.63,mu=-0.67"));
            }),
            Self::otherwise(
                "noise by coordinates",
                "noise: each coordinate by an even number, in units of the mean distance from the centre",
                |row| row.attack.contains("noise"),
                |r| r.attack = Some(("noise:", "coordinate-noise:")),
            ),
            Self::otherwise(
                "all splits",
                "basis: splits that turn a face by more than 45 degrees carry a mark too",
                everything,
                |r| r.all_splits = true,
            ),
            Self::otherwise(
                "no outliers",
                "test: extracted coefficients count however large they are",
                everything,
                |r| r.test.outlier_threshold = None,
            ),
        ]
    }

    /// From the suspect to the original.
    fn registered(&self, subject: &Subject, suspect: &Soup) -> Option<Similarity3<f64>> {
        let Subject { soup: original, reference, .. } = subject;
        let laid = |reference: &Reference, soup: &Soup| {
            let found = register(reference, &soup.points, &soup.triangles, &self.register).ok()?;
            Some(found.best.reference_from_suspect)
        };
        if self.reversed {
            let reference = Reference::new(&suspect.points, &suspect.triangles).ok()?;
            return Some(laid(&reference, original)?.inverse());
        }
        laid(reference, suspect)
    }

    /// log10 p of a row, by the steps that the paper took; 0 where one of them cannot be taken.
    fn look(&self, subject: &Subject, copy: &Copy, row: &Row) -> anyhow::Result<f64> {
        let specs = self.attack.map_or(row.attack.to_owned(), |(from, to)| row.attack.replace(from, to));
        let attacked =
            apply_all(&parse_list(&specs)?, &copy.soup, &mut ChaCha8Rng::seed_from_u64(copy.seed))?;
        let similarity = match row.registration {
            true => self.registered(subject, &attacked.soup),
            false => Some(Similarity3::identity()),
        };
        let Some(similarity) = similarity else { return Ok(0.0) };
        let Soup { points, triangles } = &attacked.soup;
        let found: Vec<Option<Point3<f64>>> = if row.resampling {
            let moved = Soup::new(points.iter().map(|p| similarity * p).collect(), triangles.clone());
            let mut rng = ChaCha8Rng::seed_from_u64(copy.seed);
            let Ok(found) = resample(&subject.soup, &moved, &self.resample, &mut rng) else { return Ok(0.0) };
            found.positions
        } else {
            let known = attacked.correspondence(subject.soup.points.len());
            known.into_iter().map(|p| p.map(|p| similarity * p)).collect()
        };
        let extracted = extract(&subject.basis, subject.epsilon, &subject.soup.points, &found)?.coefficients;
        Ok(watermark_test(&copy.watermark, &extracted, &self.test)?.log10_p())
    }
}

/// A model with its basis.
struct Subject {
    bytes: Vec<u8>,
    soup: Soup,
    basis: Basis,
    epsilon: f64,
    reference: Reference,
}

/// A marked copy.
struct Copy {
    seed: u64,
    watermark: Vec<f64>,
    soup: Soup,
}

impl Subject {
    fn new(folder: &Path, model: &Model, function: BasisFunction, all_splits: bool) -> anyhow::Result<Self> {
        let document = read(folder, model.file)?;
        let usual = Preset::Paper.parameters();
        let options = BasisOptions { function, ..usual.basis };
        let original = sombrero::Model::new(document.soup());
        let progressive = original.progressive();
        let progressive = if all_splits { progressive.faithful_at_every_level() } else { progressive };
        let basis = original.basis_for(progressive, &options, usual.epsilon)?;
        let soup = document.soup().clone();
        let reference = Reference::new(&soup.points, &soup.triangles)?;
        Ok(Self { bytes: document.bytes().to_vec(), soup, basis, epsilon: usual.epsilon, reference })
    }

    fn copy(&self, seed: u64) -> anyhow::Result<Copy> {
        let watermark = recorded_watermark(&self.bytes, &secret_of_seed(seed)?, self.basis.functions().len());
        let points = embed(&self.soup.points, &self.basis, &watermark, self.epsilon);
        Ok(Copy { seed, watermark, soup: Soup::new(points, self.soup.triangles.clone()) })
    }
}

/// A cell of Table 1, or of Table 2 where the function is another.
#[derive(Serialize, Clone)]
struct Cell {
    reading: &'static str,
    model: &'static str,
    function: &'static str,
    row: &'static str,
    /// One for each seed.
    log10_p: Vec<f64>,
    median: f64,
    paper: Option<f64>,
}

pub(crate) fn run(args: &Readings, folder: &Path) -> anyhow::Result<()> {
    let asked = |reading: &Reading| {
        let named = args.readings.iter().any(|part| reading.name.contains(part.as_str()));
        args.readings.is_empty() || reading.name == "taken" || named
    };
    let readings: Vec<Reading> = Reading::all().into_iter().filter(asked).collect();
    let mut cells: Vec<Cell> = Vec::new();
    std::fs::create_dir_all(&args.out)?;
    for model in MODELS.iter().filter(|m| args.only.is_empty() || args.only.iter().any(|name| name == m.name))
    {
        for function in BasisFunction::PROFILES {
            for reading in &readings {
                cells.extend(of_reading(args, folder, model, function, reading, &cells)?);
            }
            std::fs::write(args.out.join("readings.md"), markdown(args.runs, &readings, &cells))?;
            let text = serde_json::to_string(&cells)? + "\n";
            std::fs::write(args.out.join("readings.json"), text)?;
        }
    }
    Ok(())
}

/// The cells of a model and a function; those that do not feel the reading are the ones of the first reading.
fn of_reading(
    args: &Readings,
    folder: &Path,
    model: &'static Model,
    function: BasisFunction,
    reading: &Reading,
    known: &[Cell],
) -> anyhow::Result<Vec<Cell>> {
    let main = function == BasisFunction::Sombrero;
    let paper = |row: &Row| match main {
        true => row.paper_log10_p(model.name),
        false => table2(model.name, row.letter, function),
    };
    let rows: Vec<&'static Row> = ROWS.iter().filter(|row| paper(row).is_some()).collect();
    let (felt, same): (Vec<_>, Vec<_>) =
        rows.into_iter().partition(|row| reading.name == "taken" || (reading.feels)(row));
    let first = |row: &&Row| {
        let own = |c: &&Cell| c.model == model.name && c.function == function.name() && c.row == row.letter;
        known.iter().find(own).map(|cell| Cell { reading: reading.name, ..cell.clone() })
    };
    let mut cells: Vec<Cell> = same.iter().filter_map(first).collect();
    if felt.is_empty() {
        return Ok(cells);
    }
    let subject = Subject::new(folder, model, function, reading.all_splits)?;
    let of_seed = |seed: u64| {
        let copy = subject.copy(seed)?;
        felt.iter().map(|row| reading.look(&subject, &copy, row)).collect::<anyhow::Result<Vec<f64>>>()
    };
    let tried = (0..args.runs).into_par_iter().map(of_seed).collect::<anyhow::Result<Vec<_>>>()?;
    for (at, row) in felt.iter().enumerate() {
        let log10_p: Vec<f64> = tried.iter().map(|rows| rows[at]).collect();
        let median = median(&log10_p).context("a median of finite numbers")?;
        println!("{} {} {} {}: {median:.1}", reading.name, model.name, function.name(), row.letter);
        let (model, function, row, paper) = (model.name, function.name(), row.letter, paper(row));
        cells.push(Cell { reading: reading.name, model, function, row, log10_p, median, paper });
    }
    Ok(cells)
}

impl Cell {
    /// At the paper's figure or below.
    fn holds(&self) -> bool {
        self.paper.is_some_and(|paper| self.median <= paper)
    }
}

fn markdown(runs: u64, readings: &[Reading], cells: &[Cell]) -> String {
    let mut text = format!(
        "# Readings of the paper\n\nWritten by `cargo xtask readings`; {runs} seeds. One choice at a time is made otherwise than \
         `--method paper` makes it. *Held*: cells whose median is at or below the paper's figure; behind it the sum of the orders by which the others miss it.\n\n| reading | what |\n|---|---|\n"
    );
    for Reading { name, what, .. } in readings {
        let _ = writeln!(text, "| {name} | {what} |");
    }
    let mut groups: BTreeMap<(usize, &str), Vec<&Cell>> = BTreeMap::new();
    for cell in cells {
        let table = if cell.function == BasisFunction::Sombrero.name() { 1 } else { 2 };
        let place = MODELS.iter().position(|m| m.name == cell.model).unwrap_or_default();
        groups.entry((table * 10 + place, cell.model)).or_default().push(cell);
    }
    for ((number, model), group) in &groups {
        let table = number / 10;
        let functions = if table == 1 { "" } else { ", hat and derby" };
        let _ = writeln!(text, "\n## Table {table}, {model}{functions}\n");
        text.push_str(&block(readings, group));
    }
    text
}

/// A row a reading, a column a cell; medians that a reading changes.
fn block(readings: &[Reading], group: &[&Cell]) -> String {
    let of = |reading: &Reading| group.iter().filter(|c| c.reading == reading.name).collect::<Vec<_>>();
    let Some(first) = readings.first().map(of) else { return String::new() };
    let sombrero = BasisFunction::Sombrero.name();
    let name = |c: &Cell| {
        if c.function == sombrero { c.row.to_owned() } else { format!("{} {}", c.row, c.function) }
    };
    let heads: Vec<String> = first.iter().map(|c| name(c)).collect();
    let mut text =
        format!("| reading | held | {} |\n|---|---:|{}\n", heads.join(" | "), "---:|".repeat(heads.len()));
    let paper: Vec<String> =
        first.iter().map(|c| c.paper.map_or("–".into(), |p| format!("{p:.0}"))).collect();
    let _ = writeln!(text, "| the paper | | {} |", paper.join(" | "));
    for reading in readings {
        let own = of(reading);
        let short =
            0.0 + own.iter().filter(|c| !c.holds()).filter_map(|c| Some(c.median - c.paper?)).sum::<f64>();
        let held = own.iter().filter(|c| c.holds()).count();
        let shown = |head: &Cell| {
            let cell = own.iter().find(|c| c.row == head.row && c.function == head.function);
            cell.map_or("–".to_owned(), |cell| match cell.holds() {
                true => format!("{:.1}", cell.median),
                false => format!("**{:.1}**", cell.median),
            })
        };
        let medians: Vec<String> = first.iter().map(|c| shown(c)).collect();
        let _ = writeln!(
            text,
            "| {} | {held} of {}, {short:.1} | {} |",
            reading.name,
            own.len(),
            medians.join(" | ")
        );
    }
    text
}
