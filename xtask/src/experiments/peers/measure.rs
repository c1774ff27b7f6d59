//! Wall and CPU time, and how far the peak of memory rises.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::Instant;

/// The name that our rows have.
pub(crate) const OURS: &str = "sombrero";

/// One measurement, as all peers print it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) stage: String,
    pub(crate) model: String,
    pub(crate) peer: String,
    #[serde(default)]
    pub(crate) version: String,
    /// Seconds on the clock: the median and the best run.
    #[serde(default)]
    pub(crate) median: f64,
    #[serde(default)]
    pub(crate) best: f64,
    /// Seconds of all threads, user and system: the median.
    #[serde(default)]
    pub(crate) cpu: f64,
    /// By how many megabytes the peak of memory rose.
    #[serde(default)]
    pub(crate) extra_mb: Option<f64>,
    /// How good the answer is, by name.
    #[serde(default)]
    pub(crate) acc: BTreeMap<String, serde_json::Value>,
    /// Why there are no figures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) error: Option<String>,
}

/// What a stage of ours is called in the table.
pub(crate) struct Subject<'a> {
    pub(crate) stage: &'a str,
    pub(crate) model: &'a str,
    /// What distinguishes rows of ours in one stage; may be empty.
    pub(crate) variant: &'a str,
    pub(crate) repeats: usize,
}

/// Seconds of all threads of this process.
pub(crate) fn cpu() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// Megabytes: the high-water mark of the memory in use, since it was last reset. Linux only, 0 elsewhere.
pub(crate) fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kilobytes.unwrap_or(0.0) / 1024.0
}

/// Lets the high-water mark fall to what is in use now.
pub(crate) fn reset_peak() {
    // Where the system does not offer it, the figure counts what came before too.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// A run longer than this is not repeated, in seconds.
const LONG: f64 = 20.0;

/// Runs `work` once to warm up and then `repeats` times, the i-th on case i, and asks `accuracy` of the results. A long
/// first run is the only one.
pub(crate) fn measure<R>(
    subject: &Subject<'_>,
    mut work: impl FnMut(usize) -> anyhow::Result<R>,
    accuracy: impl FnOnce(&[R]) -> anyhow::Result<BTreeMap<String, serde_json::Value>>,
) -> anyhow::Result<Row> {
    let mut timed = |run| -> anyhow::Result<(f64, f64, R)> {
        let (start, started) = (Instant::now(), cpu());
        let result = black_box(work(run)?);
        Ok((start.elapsed().as_secs_f64(), cpu() - started, result))
    };
    reset_peak();
    let before = peak();
    let first = timed(0)?;
    let extra_mb = peak() - before;
    let runs = if first.0 > LONG {
        vec![first]
    } else {
        drop(first);
        (0..subject.repeats).map(timed).collect::<anyhow::Result<_>>()?
    };
    let (mut wall, mut used, mut results) = (Vec::new(), Vec::new(), Vec::new());
    for (seconds, of_all_threads, result) in runs {
        wall.push(seconds);
        used.push(of_all_threads);
        results.push(result);
    }
    let peer =
        if subject.variant.is_empty() { OURS.to_owned() } else { format!("{OURS}: {}", subject.variant) };
    Ok(Row {
        stage: subject.stage.into(),
        model: subject.model.into(),
        peer,
        version: env!("CARGO_PKG_VERSION").into(),
        median: median(&mut wall),
        best: wall[0],
        cpu: median(&mut used),
        extra_mb: Some(extra_mb),
        acc: accuracy(&results)?,
        error: None,
    })
}

/// Sorts too.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
