//! Wall and CPU time, and the peak of memory, by the rules of `../../bench.py`.

use rustix::time::{ClockId, clock_gettime};
use serde_json::{Value, json};
use std::hint::black_box;
use std::time::Instant;
use std::{env, fs};

/// Seconds; a run this long needs no warm-up before it.
const LONG: f64 = 5.0;
/// Seconds; no further run starts after so many.
const ENOUGH: f64 = 20.0;

/// A whole number from the environment.
pub(crate) fn number(name: &str, default: usize) -> usize {
    env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

/// Seconds of all threads of this process.
fn cpu() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// Megabytes: the high-water mark.
fn peak() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

pub(crate) struct Timer {
    repeats: usize,
    wall: Vec<f64>,
    cpu: Vec<f64>,
    extra_mb: f64,
}

impl Timer {
    pub(crate) fn new(repeats: usize) -> Self {
        Self { repeats, wall: Vec::new(), cpu: Vec::new(), extra_mb: 0.0 }
    }

    /// Runs `work` once to warm up and then `repeats` times; returns the last result.
    pub(crate) fn run<R>(&mut self, mut work: impl FnMut() -> R) -> R {
        // The mark falls to what is in use now; where it cannot, its growth is a lower bound.
        let _ = fs::write("/proc/self/clear_refs", "5");
        let before = peak();
        let mut last = self.once(&mut work);
        // The first run's: later ones reuse memory that the allocator kept.
        self.extra_mb = peak() - before;
        if self.wall[0] < LONG {
            self.wall.clear();
            self.cpu.clear();
        }
        while self.wall.len() < self.repeats && self.wall.iter().sum::<f64>() < ENOUGH {
            drop(last);
            last = self.once(&mut work);
        }
        last
    }

    fn once<R>(&mut self, work: &mut impl FnMut() -> R) -> R {
        let (used, start) = (cpu(), Instant::now());
        let result = black_box(work());
        self.wall.push(start.elapsed().as_secs_f64());
        self.cpu.push(cpu() - used);
        result
    }

    pub(crate) fn best(&self) -> f64 {
        self.wall.iter().copied().fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn least_cpu(&self) -> f64 {
        self.cpu.iter().copied().fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn fill_in(&self, row: &mut Value) {
        row["median"] = median(&self.wall).into();
        row["best"] = self.best().into();
        row["cpu"] = median(&self.cpu).into();
        row["runs"] = self.wall.len().into();
        row["extra_mb"] = json!((self.extra_mb * 10.0).round() / 10.0);
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 }
}
