//! The page for browsers: the program compiled to WebAssembly, packed, and everything in one file.
//!
//! One file, because that is what a page can be that needs no network: it works from any host and from a disk, nothing is left
//! to be loaded later, and its policy can forbid every connection.

use super::target;
use anyhow::{Context, bail};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest, Sha256};
use std::env;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where browsers run Rust.
pub(crate) const WASM: &str = "wasm32-unknown-unknown";

/// Where the program is that joins Rust and JavaScript.
const BINDER: &str = "xtask/binder/Cargo.toml";

/// Names under which Chromium is installed, as the tests look for it.
const CHROMIUM: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

const TEMPLATE: &str = include_str!("../../../crates/sombrero-web/page/index.html");
const STYLE: &str = include_str!("../../../crates/sombrero-web/page/style.css");
const SCRIPT: &str = include_str!("../../../crates/sombrero-web/page/page.js");
const WORKER: &str = include_str!("../../../crates/sombrero-web/page/worker.js");
/// Of the report, which the page shows and looks like.
const REPORT_STYLE: &str = include_str!("../../../crates/sombrero-report/src/page/style.css");
const REPORT_SCRIPT: &str = include_str!("../../../crates/sombrero-report/src/page/viewer.min.js");

/// The page, built in this profile of cargo's, as `sombrero.html` in `folder`; or why there is none.
pub(crate) fn make(profile: &str, folder: &Path) -> anyhow::Result<Result<PathBuf, String>> {
    if !has_target() {
        return Ok(Err(format!("no target {WASM} (`rustup target add {WASM}`)")));
    }
    let Some(binder) = binder()? else {
        return Ok(Err(format!("{BINDER} does not build, for want of a network as a rule")));
    };
    let build = ["build", "--locked", "--package", "sombrero-web", "--target", WASM, "--profile", profile];
    if !Command::new("cargo").args(build).status()?.success() {
        bail!("the program does not build for browsers");
    }
    let built = target()?.join(WASM).join(if profile == "dev" { "debug" } else { profile });
    let bound = target()?.join("page").join("bound");
    if !Command::new(binder).arg(built.join("sombrero_web.wasm")).arg(&bound).status()?.success() {
        bail!("no JavaScript can be made for the program");
    }
    let program = fs::read(bound.join("sombrero_bg.wasm"))?;
    let page = page(&program, &fs::read_to_string(bound.join("sombrero.js"))?)?;
    fs::create_dir_all(folder)?;
    let path = folder.join("sombrero.html");
    fs::write(&path, page)?;
    Ok(Ok(path))
}

/// Builds the page and visits it with Chromium, or says why not. A program for release takes minutes to build, and one that is not
/// takes minutes to compute, so nothing is built where nothing else is built for release.
pub(crate) fn check(release: bool) -> anyhow::Result<Result<(), String>> {
    if !release {
        return Ok(Err("no release build".to_owned()));
    }
    let paths: Vec<PathBuf> = env::var_os("PATH").iter().flat_map(env::split_paths).collect();
    if !CHROMIUM.iter().any(|name| paths.iter().any(|folder| folder.join(name).is_file())) {
        return Ok(Err("no Chromium on the path".to_owned()));
    }
    let page = match make("release", &target()?.join("page"))? {
        Ok(page) => std::path::absolute(page)?,
        Err(why) => return Ok(Err(why)),
    };
    let test = ["test", "--workspace", "--test", "browser", "door::"];
    if !Command::new("cargo").args(test).env("SOMBRERO_PAGE", page).status()?.success() {
        bail!("a test of the page failed");
    }
    Ok(Ok(()))
}

/// Whether the standard library for browsers is installed.
pub(crate) fn has_target() -> bool {
    let installed = Command::new("rustc").args(["--print", "target-libdir", "--target", WASM]).output();
    installed.is_ok_and(|done| Path::new(String::from_utf8_lossy(&done.stdout).trim()).is_dir())
}

/// The program that makes the JavaScript through which a page calls the other one. A workspace of its own, so that nobody builds
/// it for anything else; a quarter of a minute, where installing `wasm-bindgen` takes several.
fn binder() -> anyhow::Result<Option<PathBuf>> {
    let folder = target()?.join("binder");
    let build = ["build", "--quiet", "--locked", "--manifest-path", BINDER, "--target-dir"];
    if !Command::new("cargo").args(build).arg(&folder).status()?.success() {
        return Ok(None);
    }
    Ok(Some(folder.join("debug").join(format!("binder{}", env::consts::EXE_SUFFIX))))
}

/// Everything in one file.
fn page(program: &[u8], glue: &str) -> anyhow::Result<String> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(program)?;
    let packed = STANDARD.encode(packed.finish()?);
    let worker = format!("{glue}\n{WORKER}");
    for script in [&worker, SCRIPT] {
        for sign in ["</script", "<script", "<!--", "\r", "\0"] {
            if script.contains(sign) {
                bail!("a script of the page holds {sign:?} and cannot stand in it");
            }
        }
    }
    filled(TEMPLATE, |name| {
        Some(match name {
            "largest" => sombrero_web::LARGEST_FILE.to_string(),
            "largest_mb" => (sombrero_web::LARGEST_FILE >> 20).to_string(),
            "policy" => policy(),
            "program" => packed.clone(),
            "script" => SCRIPT.to_owned(),
            "style" => format!("{REPORT_STYLE}{STYLE}"),
            "version" => env!("CARGO_PKG_VERSION").to_owned(),
            "worker" => worker.clone(),
            _ => return None,
        })
    })
}

/// The page may run its own script, the view of reports, its worker and WebAssembly. It may connect to nothing.
fn policy() -> String {
    let hash = |script: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(script)));
    format!(
        "default-src 'none'; connect-src 'none'; script-src {} {} 'wasm-unsafe-eval'; worker-src blob:; style-src 'unsafe-inline'; \
         img-src data:; base-uri 'none'; form-action 'none'",
        hash(SCRIPT),
        hash(REPORT_SCRIPT)
    )
}

/// The template with what belongs in the place of each `{{name}}`; what is put in is not looked at again.
fn filled(template: &str, part: impl Fn(&str) -> Option<String>) -> anyhow::Result<String> {
    let mut page = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").context("a name in the page's template has no end")?;
        page += before;
        page += &part(name).with_context(|| format!("the page's template asks for {name}"))?;
        rest = after;
    }
    Ok(page + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_binder_has_the_version_of_what_it_binds() {
        let version = |lock: &str| {
            let package =
                lock.split("\n\n").find(|package| package.contains("name = \"wasm-bindgen-shared\""))?;
            package.lines().find(|line| line.starts_with("version = ")).map(str::to_owned)
        };
        let own = version(include_str!("../../binder/Cargo.lock"));
        assert!(own.is_some());
        assert_eq!(own, version(include_str!("../../../Cargo.lock")));
    }

    #[test]
    fn a_template_is_filled_once() {
        let part = |name: &str| (name == "a").then(|| "{{b}}".to_owned());
        assert_eq!(filled("1 {{a}} 2 {{a}}", part).ok().as_deref(), Some("1 {{b}} 2 {{b}}"));
        assert!(filled("{{b}}", part).is_err() && filled("{{a", part).is_err());
    }

    #[test]
    fn the_page_allows_no_connection_and_names_no_address() {
        let page = page(b"program", "let glue;").unwrap_or_default();
        let policy = "content=\"default-src 'none'; connect-src 'none'; script-src 'sha256-";
        assert!(page.contains(policy), "{page}");
        for word in ["http:", "https:", "src=", "@import", "url(", "{{"] {
            assert!(!page.contains(word), "{word}");
        }
        assert_eq!(page.matches("<script").count(), 3);
    }
}
