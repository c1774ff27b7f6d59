//! What a try costs: the derivation on one core of this machine.

use super::{SEED, line};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use sombrero::watermark::{Derivation, Identity, Key, OriginalDigest, Preset};

/// Orders of magnitude that are priced.
const ORDERS: [i32; 5] = [6, 9, 12, 14, 20];
const YEAR: f64 = 365.25 * 86_400.0;

#[derive(Serialize)]
pub(super) struct Price {
    derivation: String,
    /// Tries a second of one core.
    rate: f64,
    /// The same without a derivation worth the name.
    rate_stubbed: f64,
    costs: Vec<Cost>,
}

/// What it takes to reach 10^-k once on average.
#[derive(Serialize)]
struct Cost {
    k: i32,
    core_seconds: f64,
    core_years: f64,
    core_seconds_stubbed: f64,
}

impl Price {
    pub(super) fn measure(derivations: u32) -> anyhow::Result<Self> {
        let rate = rate(Derivation::STANDARD, derivations);
        let rate_stubbed = rate_of_stub();
        let costs = ORDERS.map(|k| {
            let tries = 10f64.powi(k);
            let core_seconds = tries / rate;
            let core_seconds_stubbed = tries / rate_stubbed;
            Cost { k, core_seconds, core_years: core_seconds / YEAR, core_seconds_stubbed }
        });
        let derivation = Derivation::STANDARD.to_string();
        Ok(Self { derivation, rate, rate_stubbed, costs: costs.into() })
    }

    pub(super) fn write(&self, out: &mut String) {
        let Self { derivation, rate, rate_stubbed, costs } = self;
        line(out, format_args!("## What a try costs\n"));
        line(
            out,
            format_args!(
                "One core of the machine that wrote this, CPU time: {rate:.2} tries a second with the derivation of every \
                 key ({derivation}), {rate_stubbed:.0} with the stub.\n"
            ),
        );
        line(out, format_args!("| log10 p | with the derivation | stubbed |\n|---|---|---|"));
        for Cost { k, core_seconds, core_seconds_stubbed, .. } in costs {
            let [with, without] = [*core_seconds, *core_seconds_stubbed].map(duration);
            line(out, format_args!("| -{k} | {with} | {without} |"));
        }
        line(out, format_args!(""));
    }
}

fn rate_of_stub() -> f64 {
    rate(Derivation::stub_for_experiments(), 20_000)
}

/// Keys a CPU second, made one after the other.
fn rate(derivation: Derivation, count: u32) -> f64 {
    let digest = OriginalDigest::of_file(b"original");
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let start = cpu_seconds();
    for _ in 0..count {
        let secret = super::super::case::random_secret(&mut rng);
        let parameters = Preset::Paper.parameters();
        std::hint::black_box(Key::new(
            &digest,
            Identity::default(),
            secret,
            parameters,
            &[0; 32],
            derivation,
        ));
    }
    f64::from(count) / (cpu_seconds() - start)
}

/// Of this thread.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

fn duration(seconds: f64) -> String {
    if seconds < 100.0 {
        format!("{seconds:.1} core seconds")
    } else if seconds < 2.0 * 86_400.0 {
        format!("{:.1} core hours", seconds / 3600.0)
    } else if seconds < YEAR {
        format!("{:.0} core days", seconds / 86_400.0)
    } else if seconds < 1e4 * YEAR {
        format!("{:.0} core years", seconds / YEAR)
    } else {
        format!("{:.1e} core years", seconds / YEAR)
    }
}
