//! Whole jobs as a user sees them: the program from start to end, its time, CPU time and peak memory.

use super::measure::{Row, median};
use crate::experiments::program::{Program, Used};
use std::path::Path;

/// Marks the model, then finds the mark in a copy that was moved and simplified to a half.
pub(crate) fn measure(cases: &Path, model: &str, repeats: usize) -> anyhow::Result<Vec<Row>> {
    let program = Program::build()?;
    let folder = cases.with_file_name("scratch");
    std::fs::create_dir_all(&folder)?;
    let path = |name: &str| folder.join(format!("{model}.{name}")).display().to_string();
    let original = cases.join(format!("{model}.ply")).display().to_string();
    let [copy, key, suspect] = ["marked.ply", "key", "suspect.ply"].map(path);
    let embedded = timed("g embed", model, repeats, || {
        program.run(&["embed", &original, "-o", &copy, "--key", &key, "--force"])
    })?;
    program.run(&["attack", &copy, "-o", &suspect, "transform", "simplify:ratio=0.5", "--force"])?;
    let found = timed("g detect, moved and simplified", model, repeats, || {
        program.run(&["detect", &suspect, "--original", &original, "--key", &key])
    })?;
    Ok(vec![embedded, found])
}

fn timed(
    stage: &str,
    model: &str,
    repeats: usize,
    work: impl Fn() -> anyhow::Result<Used>,
) -> anyhow::Result<Row> {
    work()?;
    let runs: Vec<Used> = (0..repeats.max(1)).map(|_| work()).collect::<anyhow::Result<_>>()?;
    let of = |value: fn(&Used) -> f64| median(&mut runs.iter().map(value).collect::<Vec<_>>());
    Ok(Row {
        stage: stage.into(),
        model: model.into(),
        peer: super::measure::OURS.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        median: of(|used| used.seconds),
        best: runs.iter().map(|used| used.seconds).fold(f64::INFINITY, f64::min),
        cpu: of(|used| used.cpu),
        extra_mb: Some(of(|used| used.megabytes)),
        acc: Default::default(),
        error: None,
    })
}
