//! The Python package: maturin where it can be had, the wheel, and its tests in a fresh virtual environment.

use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The package.
pub(crate) const PACKAGE: &str = "crates/sombrero-python";

/// What the tests use; the heavy ones (Open3D, PyVista, Ray) are used where they are installed.
const FOR_TESTS: [&str; 3] = ["numpy", "pytest", "trimesh"];

/// A virtual environment.
pub(crate) struct Environment(PathBuf);

impl Environment {
    /// A fresh one in `folder` with maturin and `packages`; or why there is none.
    pub(crate) fn fresh(folder: &Path, packages: &[&str]) -> anyhow::Result<Result<Self, String>> {
        if folder.exists() {
            std::fs::remove_dir_all(folder)?;
        }
        let made = quiet(Command::new("python3").args(["-m", "venv"]).arg(folder));
        if !made {
            return Ok(Err("no python3 with the module venv".to_owned()));
        }
        let made = Self(folder.to_owned());
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "maturin>=1.9,<2"];
        if !quiet(Command::new(made.program("python")).args(install).args(packages)) {
            return Ok(Err(format!("no registry that has maturin, {}", packages.join(", "))));
        }
        Ok(Ok(made))
    }

    fn program(&self, name: &str) -> PathBuf {
        let folder = if cfg!(windows) { "Scripts" } else { "bin" };
        self.0.join(folder).join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
    }

    /// The wheel, built in this profile of cargo's and put into `folder`.
    pub(crate) fn wheel(&self, profile: &str, folder: &Path) -> anyhow::Result<PathBuf> {
        let mut command = Command::new(self.program("maturin"));
        command.args(["build", "--locked", "--profile", profile, "--manifest-path"]);
        command.arg(Path::new(PACKAGE).join("Cargo.toml")).arg("--out").arg(folder);
        command.arg("--interpreter").arg(self.program("python"));
        if !command.status().context("maturin cannot be started")?.success() {
            bail!("the wheel does not build");
        }
        let wheels = std::fs::read_dir(folder)?.filter_map(|entry| Some(entry.ok()?.path()));
        let mut wheels: Vec<PathBuf> =
            wheels.filter(|path| path.extension().is_some_and(|e| e == "whl")).collect();
        wheels.sort();
        wheels.pop().context("maturin made no wheel")
    }

    /// Installs the wheel and runs the package's tests on it.
    pub(crate) fn test(&self, wheel: &Path) -> anyhow::Result<()> {
        let python = self.program("python");
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        if !Command::new(&python).args(install).arg(wheel).status()?.success() {
            bail!("the wheel cannot be installed");
        }
        let mut tests = Command::new(&python);
        tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]).current_dir(PACKAGE);
        if !tests.env("PYTHONDONTWRITEBYTECODE", "1").status()?.success() {
            bail!("a test of the Python package failed");
        }
        Ok(())
    }
}

/// The wheel in the profile of the tests, so that no crate is compiled for it alone, and its tests; or why they are passed over.
pub(crate) fn check() -> anyhow::Result<Result<(), String>> {
    let folder = super::target()?.join("python");
    let environment = match Environment::fresh(&folder.join("environment"), &FOR_TESTS)? {
        Ok(made) => made,
        Err(why) => return Ok(Err(why)),
    };
    let wheels = folder.join("wheels");
    if wheels.exists() {
        std::fs::remove_dir_all(&wheels)?;
    }
    environment.test(&std::path::absolute(environment.wheel("test", &wheels)?)?)?;
    Ok(Ok(()))
}

fn quiet(command: &mut Command) -> bool {
    let command = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
