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

    /// Installs a wheel.
    fn install(&self, wheel: &Path) -> anyhow::Result<()> {
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
        if !Command::new(self.program("python")).args(install).arg(wheel).status()?.success() {
            bail!("the wheel cannot be installed");
        }
        Ok(())
    }

    /// Lays the package where the wheel would put it, with the library that was built with the tests.
    fn lay(&self, library: &Path) -> anyhow::Result<()> {
        let ask = ["-c", "import sysconfig; print(sysconfig.get_path('platlib'), end='')"];
        let said = Command::new(self.program("python")).args(ask).output()?;
        let folder = Path::new(&String::from_utf8(said.stdout)?).join("sombrero");
        std::fs::create_dir_all(&folder)?;
        for entry in std::fs::read_dir(Path::new(PACKAGE).join("python").join("sombrero"))? {
            let path = entry?.path();
            if path.is_file() {
                std::fs::copy(&path, folder.join(path.file_name().context("a file has a name")?))?;
            }
        }
        let name = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
        std::fs::copy(library, folder.join(name))?;
        Ok(())
    }

    /// Runs the package's tests, which compare it with `command`, or with the command of the wheel.
    fn test(&self, command: Option<&Path>) -> anyhow::Result<()> {
        let mut tests = Command::new(self.program("python"));
        tests.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]).current_dir(PACKAGE);
        tests.env("PYTHONDONTWRITEBYTECODE", "1");
        if let Some(command) = command {
            tests.env("SOMBRERO_COMMAND", command);
        }
        if !tests.status()?.success() {
            bail!("a test of the Python package failed");
        }
        Ok(())
    }
}

/// The package's tests in a fresh environment, or why they are passed over: on the wheel, or, where there is no release build, on the
/// library that was built with the other tests. maturin would compile nearly every crate again for it, with the features that
/// this one crate asks for.
pub(crate) fn check(release: bool) -> anyhow::Result<Result<(), String>> {
    let target = super::target()?;
    let folder = target.join("python");
    let built = target.join("debug");
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = built.join(format!("{prefix}_native{suffix}"));
    if !release && !library.exists() {
        return Ok(Err(format!("no {}", library.display())));
    }
    let environment = match Environment::fresh(&folder.join("environment"), &FOR_TESTS)? {
        Ok(made) => made,
        Err(why) => return Ok(Err(why)),
    };
    if release {
        let wheels = folder.join("wheels");
        if wheels.exists() {
            std::fs::remove_dir_all(&wheels)?;
        }
        environment.install(&std::path::absolute(environment.wheel("release", &wheels)?)?)?;
        environment.test(None)?;
    } else {
        environment.lay(&library)?;
        let command = built.join(format!("sombrero-under-test{}", std::env::consts::EXE_SUFFIX));
        environment.test(Some(&command))?;
    }
    Ok(Ok(()))
}

fn quiet(command: &mut Command) -> bool {
    let command = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
