//! The command killed (SIGKILL) at random moments: what it writes is whole or not there, belongs together, and the next
//! run completes.
//!
//! SOMBRERO_KILLS: how often each command is killed; 10 unless set.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Point3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sombrero::Model;
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero::watermark::{Key, embed};
use sombrero_tests::Workshop;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// A folder with an original, and how long the command takes.
struct Victim {
    workshop: Workshop,
    rng: ChaCha8Rng,
    kills: u32,
}

type Listing = BTreeMap<PathBuf, Vec<u8>>;

impl Victim {
    fn new(seed: u64) -> Self {
        let workshop = Workshop::new(env!("CARGO_BIN_EXE_sombrero-under-test"));
        workshop.write("vase.ply", encode(Format::PlyBinaryLittleEndian, &shapes::bust(6)).unwrap());
        workshop.write("buyers.csv", "recipient,file\nA-1,one\nA-2,two\nA-3,three\n");
        let kills = std::env::var("SOMBRERO_KILLS").map_or(10, |text| text.parse().unwrap());
        Self { workshop, rng: ChaCha8Rng::seed_from_u64(seed), kills }
    }

    /// Seconds of a run that is left alone.
    fn completed(&self, line: &str) -> f64 {
        let start = Instant::now();
        let ran = self.workshop.line(line);
        assert_eq!(ran.status, Some(0), "{line}: {}{}", ran.stdout, ran.stderr);
        start.elapsed().as_secs_f64()
    }

    /// Kills the command before it is likely to be done, and tells what is there.
    fn killed(&mut self, line: &str, seconds: f64) -> Listing {
        let mut command = self.workshop.command(line.split_whitespace());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(self.rng.random_range(0.0..1.1 * seconds)));
        child.kill().unwrap();
        child.wait().unwrap();
        self.visible()
    }

    /// All files but temporary ones, which a killed run cannot take away.
    fn visible(&self) -> Listing {
        let temporary = |path: &Path| path.file_name().unwrap().to_string_lossy().starts_with(".sombrero-");
        self.workshop.listing().into_iter().filter(|(path, _)| !temporary(path)).collect()
    }

    fn exists(&self, name: &str) -> bool {
        self.workshop.path(name).exists()
    }

    fn remove(&self, name: &str) {
        if self.exists(name) {
            std::fs::remove_file(self.workshop.path(name)).unwrap();
        }
    }
}

/// Tells which copy belongs to which key.
struct Pairs {
    model: Model,
    points: Vec<Point3<f64>>,
}

impl Pairs {
    fn new(victim: &Victim) -> Self {
        let original = Document::read(&victim.workshop.path("vase.ply")).unwrap();
        let model = Model::new(original.soup());
        let points = model.soup().points.clone();
        Self { model, points }
    }

    /// Each is whole or not there, and if both are there they belong together.
    fn check(&self, victim: &Victim, copy: &str, key: &str) {
        let copy = victim.exists(copy).then(|| Document::read(&victim.workshop.path(copy)).unwrap());
        let key = victim.exists(key).then(|| Key::from_json(&victim.workshop.read(key)).unwrap());
        let (Some(copy), Some(key)) = (copy, key) else { return };
        let progressive = self.model.progressive();
        let options = key.parameters.basis;
        let basis = self.model.basis_for(progressive, &options, key.parameters.epsilon).unwrap();
        let meant = embed(&self.points, &basis, &key.watermark, key.parameters.epsilon);
        let meant = self.model.stored_from_points(&meant);
        let off = copy.points().iter().zip(&meant).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-6, "copy and key do not belong together: {off}");
    }
}

#[test]
fn embed_leaves_a_copy_and_its_key_or_nothing() {
    let mut victim = Victim::new(1);
    let pairs = Pairs::new(&victim);
    let line = "embed vase.ply -o copy.ply --key copy.key";
    let seconds = victim.completed(line);
    pairs.check(&victim, "copy.ply", "copy.key");
    for number in 0..victim.kills {
        // In the place of others, and where there are none.
        if number % 2 == 0 {
            victim.remove("copy.key");
            victim.remove("copy.ply");
            victim.killed(line, seconds);
        } else {
            victim.killed(&format!("{line} --force"), seconds);
        }
        pairs.check(&victim, "copy.ply", "copy.key");
        victim.completed(&format!("{line} --force"));
        pairs.check(&victim, "copy.ply", "copy.key");
    }
}

#[test]
fn a_list_of_buyers_goes_on_where_it_was() {
    let mut victim = Victim::new(2);
    let pairs = Pairs::new(&victim);
    let line = "embed vase.ply --recipients buyers.csv --out-dir copies";
    let seconds = victim.completed(line);
    for _ in 0..victim.kills {
        std::fs::remove_dir_all(victim.workshop.path("copies")).unwrap();
        victim.killed(line, seconds);
        let mut kept = Listing::new();
        for name in ["one", "two", "three"] {
            let [copy, key] = [format!("copies/{name}.ply"), format!("copies/keys/{name}.key")];
            pairs.check(&victim, &copy, &key);
            // A copy without its key would be worthless, and nobody could tell whose it is.
            assert!(victim.exists(&key) || !victim.exists(&copy), "where the copy is, the key is");
            if victim.exists(&key) {
                kept.insert(key.clone().into(), victim.workshop.read(&key));
            }
        }
        victim.completed(line);
        for name in ["one", "two", "three"] {
            let [copy, key] = [format!("copies/{name}.ply"), format!("copies/keys/{name}.key")];
            assert!(victim.exists(&key) && victim.exists(&copy));
            pairs.check(&victim, &copy, &key);
        }
        for (key, text) in kept {
            assert_eq!(victim.workshop.read(&key), text, "{}", key.display());
        }
    }
}

#[test]
fn prepare_writes_all_or_nothing() {
    let mut victim = Victim::new(3);
    victim.completed("embed vase.ply -o copy.ply --key copy.key");
    let line = "prepare --original vase.ply --key copy.key -o vase.prepared";
    let seconds = victim.completed(line);
    let whole = victim.workshop.read("vase.prepared");
    for _ in 0..victim.kills {
        victim.remove("vase.prepared");
        victim.killed(line, seconds);
        if victim.exists("vase.prepared") {
            assert!(victim.workshop.read("vase.prepared") == whole);
        } else {
            victim.completed(line);
            assert!(victim.workshop.read("vase.prepared") == whole);
        }
    }
}

#[test]
fn a_trace_changes_nothing() {
    let mut victim = Victim::new(4);
    victim.completed("embed vase.ply --recipients buyers.csv --out-dir copies");
    let line = "trace copies/two.ply --original vase.ply --keys copies/keys";
    let seconds = victim.completed(line);
    let before = victim.visible();
    for _ in 0..victim.kills {
        assert!(victim.killed(line, seconds) == before);
    }
    victim.completed(line);
}

#[test]
fn commit_leaves_keys_that_are_whole() {
    let mut victim = Victim::new(5);
    victim.completed("embed vase.ply --recipients buyers.csv --out-dir copies");
    let names = ["one", "two", "three"].map(|name| format!("copies/keys/{name}.key"));
    let unplaced = names.clone().map(|name| victim.workshop.read(&name));
    let line = "commit vase.ply --keys copies/keys -o keys.tsq";
    let seconds = victim.completed(line);
    let placed = names.clone().map(|name| victim.workshop.read(&name));
    let request = victim.workshop.read("keys.tsq");
    for _ in 0..victim.kills {
        victim.remove("keys.tsq");
        names.iter().zip(&unplaced).for_each(|(name, text)| victim.workshop.write(name, text));
        victim.killed(line, seconds);
        let is = |texts: &[Vec<u8>]| {
            names.iter().zip(texts).filter(|(n, t)| &victim.workshop.read(n) == *t).count()
        };
        // The tree is the same whenever it is made, so each key is as before or as after.
        assert_eq!(is(&unplaced) + is(&placed), names.len());
        if victim.exists("keys.tsq") {
            assert!(victim.workshop.read("keys.tsq") == request && is(&placed) == names.len());
        } else {
            victim.completed(line);
        }
        assert!(victim.workshop.read("keys.tsq") == request && is(&placed) == names.len());
    }
}

#[test]
fn commit_to_one_key_writes_request_and_statement_or_nothing() {
    let mut victim = Victim::new(6);
    victim.completed("embed vase.ply -o copy.ply --key copy.key");
    let line = "commit vase.ply --key copy.key --statement statement";
    let seconds = victim.completed(line);
    let whole = victim.visible();
    for _ in 0..victim.kills {
        victim.remove("statement");
        victim.remove("copy.key.tsq");
        let left = victim.killed(line, seconds);
        assert!(left.iter().all(|(path, bytes)| whole.get(path) == Some(bytes)));
        victim.completed(&format!("{line} --force"));
        assert!(victim.visible() == whole);
    }
}

/// What was reported as added is there, is kept, and comes back to the byte.
#[test]
fn a_catalogue_opens_and_holds_what_was_reported() {
    let mut victim = Victim::new(7);
    std::fs::create_dir(victim.workshop.path("in")).unwrap();
    for number in 0..6_usize {
        // A sphere has 10 k^2 + 2 vertices.
        let soup = shapes::bumpy_sphere(10 * (5 + number).pow(2) + 2);
        let file = format!("in/{number}.ply");
        victim.workshop.write(file, encode(Format::PlyBinaryLittleEndian, &soup).unwrap());
    }
    // The key pair of age's own tests.
    let public = "age1t7rxyev2z3rw82stdlrrepyc39nvn86l5078zqkf5uasdy86jp6svpy7pa";
    let secret = "AGE-SECRET-KEY-1GQ9778VQXMMJVE8SK7J6VT8UJ4HDQAJUVSFCWCM02D8GEWQ72PVQ2Y5J33";
    victim.workshop.write("identity", secret);
    let line = format!("catalogue add models in --keep --encrypt-to {public} --json");
    let seconds = victim.completed(&line);
    for _ in 0..victim.kills {
        let _ = std::fs::remove_dir_all(victim.workshop.path("models"));
        let mut command = victim.workshop.command(line.split_whitespace());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_secs_f64(victim.rng.random_range(0.0..1.1 * seconds)));
        child.kill().unwrap();
        let said = String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap();
        // The last line may be cut.
        let whole = said.split_inclusive('\n').filter(|line| line.ends_with('\n'));
        let reported: Vec<serde_json::Value> =
            whole.map(|line| serde_json::from_str(line).unwrap()).collect();
        for name in reported.iter().filter_map(|added| added["original"].as_str()) {
            let export = format!("catalogue export models {name} -o back.ply --identity identity --force -q");
            victim.completed(&export);
            assert!(victim.workshop.read("back.ply") == victim.workshop.read(format!("in/{name}")), "{name}");
        }
        // The next run completes.
        victim.completed(&line);
        let list = victim.workshop.line("catalogue list models --json").json();
        let originals = list["originals"].as_array().unwrap();
        assert!(originals.len() == 6 && originals.iter().all(|listed| listed["kept"] == true), "{list}");
    }
}
