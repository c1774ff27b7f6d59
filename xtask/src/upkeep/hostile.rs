//! `cargo xtask hostile`: mutated files by the million, fed to every reader.
//!
//! Input k of a target is the same on every machine, so what fails is found again by its number.

use anyhow::{Context, bail};
use clap::Args;
use rayon::prelude::*;
use sombrero_tests::hostile::{Target, input, seeds};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// No input may take longer.
const LONGEST: Duration = Duration::from_secs(2);
/// The process may not need more, whatever it reads.
const MOST_MEMORY: u64 = 1 << 30;
/// Inputs that a thread takes at a time.
const BATCH: u64 = 1000;

#[derive(Args)]
pub(crate) struct Hostile {
    /// Inputs for each target.
    #[arg(long, default_value_t = 1_250_000)]
    inputs: u64,
    /// The number of the first input.
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Only these targets: obj, ply, off, stl, gltf, glb, 3mf, key.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Write the valid files that everything starts from to a folder for each target, and stop.
    #[arg(long, value_name = "DIR")]
    corpus: Option<PathBuf>,
}

/// What came of the inputs to one target.
#[derive(Default)]
struct Tally {
    accepted: u64,
    slowest: (Duration, u64),
    panics: Vec<u64>,
}

impl Tally {
    fn with(mut self, other: Self) -> Self {
        self.accepted += other.accepted;
        self.slowest = self.slowest.max(other.slowest);
        self.panics.extend(other.panics);
        self
    }
}

pub(crate) fn run(args: &Hostile) -> anyhow::Result<()> {
    let chosen: Vec<Target> = Target::ALL
        .into_iter()
        .filter(|t| args.only.is_empty() || args.only.iter().any(|name| name == t.name()))
        .collect();
    if let Some(folder) = &args.corpus {
        return chosen.iter().try_for_each(|&target| write_corpus(target, folder));
    }
    let watch = Watch::start();
    let mut bad = false;
    for target in chosen {
        let start = Instant::now();
        let tally = feed(target, args, &watch);
        let (slowest, index) = tally.slowest;
        println!(
            "{:5} {} inputs in {:.0} s, {:.1} % read as files, slowest {:.0} ms (input {index}), {} panics{}",
            target.name(),
            args.inputs,
            start.elapsed().as_secs_f64(),
            100.0 * tally.accepted as f64 / args.inputs.max(1) as f64,
            1e3 * slowest.as_secs_f64(),
            tally.panics.len(),
            tally.panics.iter().take(10).map(|i| format!(" {i}")).collect::<String>(),
        );
        bad |= !tally.panics.is_empty() || slowest > LONGEST;
    }
    watch.stop();
    if let Some(peak) = peak_memory() {
        println!("peak memory of the whole run: {} MB", peak >> 20);
        bad |= peak > MOST_MEMORY;
    }
    if bad {
        bail!("an input made a reader panic, hang or take too much memory");
    }
    Ok(())
}

fn feed(target: Target, args: &Hostile, watch: &Watch) -> Tally {
    let seeds = seeds(target);
    let batches = args.inputs.div_ceil(BATCH);
    let of_batch = |batch: u64| {
        let first = args.from + batch * BATCH;
        let last = (first + BATCH).min(args.from + args.inputs);
        (first..last).fold(Tally::default(), |tally, index| tally.with(one(target, &seeds, index, watch)))
    };
    (0..batches).into_par_iter().map(of_batch).reduce(Tally::default, Tally::with)
}

fn one(target: Target, seeds: &[Vec<u8>], index: u64, watch: &Watch) -> Tally {
    let bytes = input(target, seeds, index);
    let start = Instant::now();
    let fed = watch.during(target, index, || catch_unwind(|| target.feed(&bytes)));
    Tally {
        accepted: u64::from(matches!(fed, Ok(true))),
        slowest: (start.elapsed(), index),
        panics: if fed.is_err() { vec![index] } else { Vec::new() },
    }
}

/// Ends the program when an input hangs: nothing else could.
struct Watch {
    running: &'static Mutex<Vec<(Instant, &'static str, u64)>>,
    done: &'static AtomicBool,
}

impl Watch {
    fn start() -> Self {
        static RUNNING: Mutex<Vec<(Instant, &str, u64)>> = Mutex::new(Vec::new());
        static DONE: AtomicBool = AtomicBool::new(false);
        std::thread::spawn(|| {
            while !DONE.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(200));
                let hung = RUNNING
                    .lock()
                    .ok()
                    .and_then(|all| all.iter().find(|(since, ..)| since.elapsed() > 5 * LONGEST).copied());
                if let Some((_, target, index)) = hung {
                    eprintln!("{target} hangs at input {index}");
                    std::process::exit(1);
                }
            }
        });
        Self { running: &RUNNING, done: &DONE }
    }

    fn during<T>(&self, target: Target, index: u64, work: impl FnOnce() -> T) -> T {
        if let Ok(mut all) = self.running.lock() {
            all.push((Instant::now(), target.name(), index));
        }
        let result = work();
        if let Ok(mut all) = self.running.lock() {
            all.retain(|(_, name, i)| (*name, *i) != (target.name(), index));
        }
        result
    }

    fn stop(&self) {
        self.done.store(true, Ordering::Relaxed);
    }
}

/// The most memory that this process ever had, where the system tells.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
}

fn write_corpus(target: Target, folder: &Path) -> anyhow::Result<()> {
    let folder = folder.join(target.name());
    std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    for (i, seed) in seeds(target).iter().enumerate() {
        let path = folder.join(format!("seed-{i}.{}", target.name()));
        std::fs::write(&path, seed).with_context(|| format!("{} cannot be written", path.display()))?;
    }
    Ok(())
}
