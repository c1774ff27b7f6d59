//! `cargo xtask dist`: what is handed out, made for this platform, with checksums and the licences of what is in it.
//!
//! To hand out something else, write how it is made and add a row to [`PIECES`].

use super::python::Environment;
use super::{licences, target};
use anyhow::{Context, bail};
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

#[derive(clap::Args)]
pub(crate) struct Dist {
    /// The folder for what is made, new or empty. Default: `dist` where cargo builds.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Make these pieces only: command, page, wheel, blender (which needs the wheel).
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// The profile to build in.
    #[arg(long, value_name = "NAME", default_value = "dist")]
    profile: String,
}

/// The files of a piece, or why there are none.
type Made = Result<Vec<PathBuf>, String>;

/// A piece, and how it is made in a folder.
struct Piece {
    name: &'static str,
    make: fn(&Site) -> anyhow::Result<Made>,
}

/// In the order in which they are made.
const PIECES: [Piece; 4] = [
    Piece { name: "command", make: command },
    Piece { name: "page", make: page },
    Piece { name: "wheel", make: wheel },
    Piece { name: "blender", make: blender },
];

/// Where pieces are made, and what of.
struct Site {
    out: PathBuf,
    profile: String,
    /// The page with the licences.
    licences: PathBuf,
}

pub(crate) fn run(args: &Dist) -> anyhow::Result<()> {
    if let Some(unknown) = args.only.iter().find(|name| PIECES.iter().all(|piece| piece.name != **name)) {
        bail!("no piece is called {unknown}; there are {}", PIECES.map(|piece| piece.name).join(", "));
    }
    let out = empty(args.out.clone())?;
    let licences = out.join("LICENCES.md");
    fs::write(&licences, licences::page(&["sombrero-cli", "sombrero-python", "sombrero-web"])?)?;
    let site = Site { out, profile: args.profile.clone(), licences };
    let mut files = vec![site.licences.clone()];
    for piece in
        PIECES.iter().filter(|piece| args.only.is_empty() || args.only.iter().any(|n| n == piece.name))
    {
        println!("== {}", piece.name);
        match (piece.make)(&site)? {
            Ok(made) => files.extend(made),
            Err(why) => println!("== no {}: {why}", piece.name),
        }
    }
    files.sort();
    let sums = site.out.join("SHA256SUMS");
    fs::write(&sums, checksums(&files)?)?;
    for file in files.iter().chain([&sums]) {
        println!("{:>10} bytes  {}", file.metadata()?.len(), file.display());
    }
    Ok(())
}

/// The folder for what is made. What an earlier run left where cargo builds goes; a folder that somebody named is never emptied.
fn empty(named: Option<PathBuf>) -> anyhow::Result<PathBuf> {
    let out = match named {
        Some(folder) if folder.exists() && fs::read_dir(&folder)?.next().is_some() => {
            bail!("{}: there is something in it; name an empty folder or a new one", folder.display())
        }
        Some(folder) => folder,
        None => {
            let own = target()?.join("dist");
            if own.exists() {
                fs::remove_dir_all(&own)?;
            }
            own
        }
    };
    fs::create_dir_all(&out)?;
    Ok(out)
}

/// One line a file, as `sha256sum --check` reads them.
fn checksums(files: &[PathBuf]) -> anyhow::Result<String> {
    let mut lines = String::new();
    for file in files {
        let name = file.file_name().context("a file has a name")?.to_string_lossy();
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "{}  {name}", hex::encode(Sha256::digest(fs::read(file)?)));
    }
    Ok(lines)
}

/// The command in an archive, with manual pages, completions and licences.
fn command(site: &Site) -> anyhow::Result<Made> {
    let build = ["build", "--locked", "--package", "sombrero-cli", "--profile", &site.profile];
    if !Command::new("cargo").args(build).status()?.success() {
        bail!("the command does not build");
    }
    let folder = if site.profile == "dev" { "debug" } else { &site.profile };
    let program = format!("sombrero{}", std::env::consts::EXE_SUFFIX);
    let built = target()?.join(folder).join(&program);
    let name = format!("sombrero-{}-{}", env!("CARGO_PKG_VERSION"), super::host()?);
    let packed = site.out.join(&name);
    fs::create_dir_all(&packed)?;
    fs::copy(&built, packed.join(&program))?;
    for text in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(text, packed.join(text))?;
    }
    fs::copy(&site.licences, packed.join("LICENCES.md"))?;
    let made = Command::new(&built).args(["man", "--quiet", "-o"]).arg(packed.join("man")).status()?;
    if !made.success() {
        bail!("the command that was built does not run");
    }
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let said = Command::new(&built).args(["completions", shell]).output()?;
        fs::write(packed.join(format!("completions.{shell}")), said.stdout)?;
    }
    let archive = site.out.join(format!("{name}.tar.gz"));
    pack(&packed, &name, &archive)?;
    fs::remove_dir_all(&packed)?;
    Ok(Ok(vec![archive]))
}

/// An archive of a folder, the same bytes for the same files.
fn pack(folder: &Path, name: &str, archive: &Path) -> anyhow::Result<()> {
    let mut tar = tar::Builder::new(GzEncoder::new(File::create(archive)?, Compression::best()));
    tar.mode(tar::HeaderMode::Deterministic);
    let mut waiting = vec![folder.to_owned()];
    let mut files = Vec::new();
    while let Some(folder) = waiting.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() { &mut waiting } else { &mut files }.push(path);
        }
    }
    files.sort();
    for file in files {
        tar.append_path_with_name(&file, Path::new(name).join(file.strip_prefix(folder)?))?;
    }
    tar.into_inner()?.finish()?;
    Ok(())
}

/// The page for browsers.
fn page(site: &Site) -> anyhow::Result<Made> {
    Ok(super::page::make(&site.profile, &site.out)?.map(|page| vec![page]))
}

/// The Python package.
fn wheel(site: &Site) -> anyhow::Result<Made> {
    let environment = target()?.join("python").join("builder");
    match Environment::fresh(&environment, &[])? {
        Ok(environment) => Ok(Ok(vec![environment.wheel(&site.profile, &site.out)?])),
        Err(why) => Ok(Err(why)),
    }
}

/// The Blender extension, around the wheel.
fn blender(site: &Site) -> anyhow::Result<Made> {
    let mut made = fs::read_dir(&site.out)?.filter_map(|entry| Some(entry.ok()?.path()));
    let Some(wheel) = made.find(|path| path.extension().is_some_and(|e| e == "whl")) else {
        return Ok(Err("it needs the wheel, which was not made".to_owned()));
    };
    let made = super::blender::extension(&wheel, &site.licences, &super::host()?, &site.out)?;
    Ok(made.map(|archive| vec![archive]))
}
