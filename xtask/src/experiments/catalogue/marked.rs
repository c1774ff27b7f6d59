//! Marked originals from suspect to verdict, and suspects that were made from none of them, by the program as its users get it:
//! `embed`, `catalogue add`, `detect` where somebody tells the original, and `search` where nobody does.

use super::families::{MEMBERS, is_kit, original};
use super::queries::Class;
use crate::experiments::program::Program;
use anyhow::Context;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::io::{Document, Format, encode};
use sombrero::mesh::Soup;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Families of originals that are never marked.
const STRANGERS: u64 = 1 << 29;

/// A suspect made from a marked copy.
#[derive(Serialize)]
struct Copy {
    original: u64,
    class: &'static str,
    /// Whether `detect` finds the mark when it is told original and key.
    told: bool,
    /// Whether `search` names owner and buyer.
    named: bool,
    /// Others that it names.
    others: usize,
    /// Its place among the candidates, from 0.
    rank: Option<usize>,
    told_cpu: f64,
    search_cpu: f64,
}

/// A suspect that carries no mark.
#[derive(Serialize)]
struct Foreign {
    kind: &'static str,
    class: &'static str,
    /// Whether anybody is named.
    named: bool,
    /// The least, corrected for all tests of the search.
    log10_p: f64,
    tests: u64,
    search_cpu: f64,
}

#[derive(Serialize)]
struct Record {
    copies: Vec<Copy>,
    foreign: Vec<Foreign>,
}

/// The folder of the experiment.
struct Workshop {
    program: Program,
    folder: PathBuf,
}

/// `copies` marked originals, each of another family, and as many questions about them; and `foreign` suspects, every second a sibling
/// of one of them, the others of families that nobody marked.
pub(super) fn run(folder: &Path, copies: u64, foreign: u64, out: &Path) -> anyhow::Result<()> {
    let shop = Workshop { program: Program::build()?, folder: folder.to_owned() };
    ["originals", "copies", "keys", "suspects"]
        .iter()
        .try_for_each(|name| fs::create_dir_all(folder.join(name)))?;
    let families: Vec<u64> = (0..copies).collect();
    families.par_iter().map(|&k| shop.mark(k)).collect::<anyhow::Result<Vec<()>>>()?;
    let (catalogue, originals) = (shop.path("catalogue"), shop.path("originals"));
    shop.program.run(&["catalogue", "add", &catalogue, &originals])?;
    let copies = families.par_iter().map(|&k| shop.copy(k)).collect::<anyhow::Result<_>>()?;
    let ask = |k: u64| shop.foreign(k, families.len() as u64);
    let foreign = (0..foreign).into_par_iter().map(ask).collect::<anyhow::Result<_>>()?;
    let record = Record { copies, foreign };
    fs::create_dir_all(out)?;
    fs::write(out.join("marked.md"), markdown(&record))?;
    Ok(fs::write(out.join("marked.json"), serde_json::to_string_pretty(&record)? + "\n")?)
}

/// The original of a family that is marked: all members have their turn.
fn member(family: u64) -> u64 {
    family * MEMBERS + 7 * family % MEMBERS
}

/// What is done to the `k`-th suspect, made of this original.
fn class(k: u64, original: u64) -> Class {
    let single: Vec<Class> = Class::ALL.into_iter().filter(|class| *class != Class::HalfKit).collect();
    if is_kit(original) { Class::HalfKit } else { single[k as usize % single.len()] }
}

impl Workshop {
    fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    fn write(&self, name: &str, soup: &Soup) -> anyhow::Result<String> {
        let path = self.path(name);
        fs::write(&path, encode(Format::PlyBinaryLittleEndian, soup)?)?;
        Ok(path)
    }

    /// Original, copy and key of a family.
    fn mark(&self, family: u64) -> anyhow::Result<()> {
        let input = self.write(&format!("originals/{family:04}.ply"), &original(member(family)))?;
        let (copy, key) = self.copy_and_key(family);
        if !Path::new(&key).exists() {
            let (owner, buyer) = (format!("owner {family}"), format!("buyer {family}"));
            let told =
                ["embed", &input, "-o", &copy, "--key", &key, "--owner", &owner, "--recipient", &buyer];
            self.program.run(&[&told[..], &["--threads", "1", "--force"]].concat())?;
        }
        Ok(())
    }

    fn copy_and_key(&self, family: u64) -> (String, String) {
        (self.path(&format!("copies/{family:04}.ply")), self.path(&format!("keys/{family:04}.key")))
    }

    fn search(&self, suspect: &str) -> anyhow::Result<(serde_json::Value, f64)> {
        let (catalogue, keys) = (self.path("catalogue"), self.path("keys"));
        let told = ["search", suspect, "--catalogue", &catalogue, "--keys", &keys, "--threads", "1"];
        let (used, _) = self.program.ask(&told)?;
        Ok((used.answer, used.cpu))
    }

    /// What is found in a suspect made from the copy of a family.
    fn copy(&self, family: u64) -> anyhow::Result<Copy> {
        let (copy, key) = self.copy_and_key(family);
        let class = class(family, member(family));
        let made = class.suspect(Document::read(Path::new(&copy))?.soup(), family)?;
        let suspect = self.write(&format!("suspects/{family:04}.ply"), &made.soup)?;
        let original = self.path(&format!("originals/{family:04}.ply"));
        let told = ["detect", &suspect, "--original", &original, "--key", &key, "--threads", "1"];
        let (detected, told) = self.program.ask(&told)?;
        let (answer, search_cpu) = self.search(&suspect)?;
        let found = named(&answer);
        let own = (format!("owner {family}"), format!("buyer {family}"));
        let listed = answer["candidates"].as_array().context("no candidates")?;
        let stem = format!("{family:04}.ply");
        Ok(Copy {
            original: member(family),
            class: class.name(),
            told,
            named: found.contains(&own),
            others: found.iter().filter(|names| **names != own).count(),
            rank: listed
                .iter()
                .position(|c| c["original"].as_str().is_some_and(|name| name.ends_with(&stem))),
            told_cpu: detected.cpu,
            search_cpu,
        })
    }

    fn foreign(&self, k: u64, families: u64) -> anyhow::Result<Foreign> {
        let sibling = member(k / 2 % families) / MEMBERS * MEMBERS + (member(k / 2 % families) + 1) % MEMBERS;
        let (kind, index) = match k % 2 {
            0 => ("a sibling of a marked one", sibling),
            _ => ("of another family", (STRANGERS + k) * MEMBERS),
        };
        let class = class(k / 2, index);
        let made = class.suspect(&original(index), STRANGERS + k)?;
        let suspect = self.write(&format!("suspects/foreign-{k:04}.ply"), &made.soup)?;
        let (answer, search_cpu) = self.search(&suspect)?;
        let listed = answer["candidates"].as_array().context("no candidates")?;
        Ok(Foreign {
            kind,
            class: class.name(),
            named: !named(&answer).is_empty(),
            log10_p: listed.iter().filter_map(|c| c["log10_p"].as_f64()).fold(0.0, f64::min),
            tests: answer["tests"].as_u64().unwrap_or(0),
            search_cpu,
        })
    }
}

/// Owners and buyers whose marks an answer of `search` says were found.
fn named(answer: &serde_json::Value) -> Vec<(String, String)> {
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let found = answer["candidates"].as_array().into_iter().flatten().filter(|c| c["found"] == true);
    found.map(|c| (text(&c["owner"]), text(&c["recipient"]))).collect()
}

fn mean(of: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = of.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    sum / f64::max(count, 1.0)
}

fn markdown(record: &Record) -> String {
    let mut text = format!(
        "# From a suspect to a name\n\nWritten by `cargo xtask catalogue --marked {} --foreign {}`. Each original is of another family \
         and has one marked copy; suspects were made from the copies, in any pose and at any size. *Told*: `detect` with original and \
         key. *Named*: `search` with catalogue and the folder of all keys names owner and buyer. Seconds: CPU, of the program from \
         start to end, on one thread.\n\n\
         | suspect | asked | told | named | both | others named | told, s | named, s |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|\n",
        record.copies.len(),
        record.foreign.len()
    );
    let mut rows: Vec<(&str, Vec<&Copy>)> = Class::ALL
        .iter()
        .map(|class| (class.name(), record.copies.iter().filter(|copy| copy.class == class.name()).collect()))
        .collect();
    rows.push(("all", record.copies.iter().collect()));
    for (name, of) in rows {
        let count = |which: fn(&Copy) -> bool| of.iter().filter(|copy| which(copy)).count();
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {} | {:.1} | {:.1} |",
            of.len(),
            count(|copy| copy.told),
            count(|copy| copy.named),
            count(|copy| copy.told && copy.named),
            of.iter().map(|copy| copy.others).sum::<usize>(),
            mean(of.iter().map(|copy| copy.told_cpu)),
            mean(of.iter().map(|copy| copy.search_cpu)),
        );
    }
    text += "\nSuspects that carry no mark, treated likewise.\n\n\
             | suspect | asked | named | p <= 0.01 | least log10 p | tests planned | s |\n\
             |---|---:|---:|---:|---:|---:|---:|\n";
    for kind in ["a sibling of a marked one", "of another family"] {
        let of: Vec<&Foreign> = record.foreign.iter().filter(|foreign| foreign.kind == kind).collect();
        let _ = writeln!(
            text,
            "| {kind} | {} | {} | {} | {:.1} | {:.1} | {:.1} |",
            of.len(),
            of.iter().filter(|foreign| foreign.named).count(),
            of.iter().filter(|foreign| foreign.log10_p <= -2.0).count(),
            of.iter().map(|foreign| foreign.log10_p).fold(0.0, f64::min),
            mean(of.iter().map(|foreign| foreign.tests as f64)),
            mean(of.iter().map(|foreign| foreign.search_cpu)),
        );
    }
    text
}
