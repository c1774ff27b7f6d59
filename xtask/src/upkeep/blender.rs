//! The Blender extension: its code, its manifest and the wheel in one archive, as Blender installs them from a disk.

use super::python::PACKAGE;
use anyhow::{Context, bail};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Where the extension's files are.
const FOLDER: &str = "blender";

/// Packs the extension with `wheel` for the platform `host` into `folder`; or says why there is none.
pub(super) fn extension(
    wheel: &Path,
    licences: &Path,
    host: &str,
    folder: &Path,
) -> anyhow::Result<Result<PathBuf, String>> {
    let Some(platform) = platform(host) else {
        return Ok(Err(format!("Blender has no name for {host}")));
    };
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(PACKAGE).join(FOLDER);
    let archive = folder.join(format!("sombrero-blender-{}-{platform}.zip", env!("CARGO_PKG_VERSION")));
    pack(&source, wheel, licences, platform, &archive)?;
    Ok(Ok(archive))
}

/// Blender's name for a platform.
fn platform(host: &str) -> Option<&'static str> {
    let system =
        ["linux-gnu", "apple-darwin", "pc-windows"].into_iter().find(|system| host.contains(system))?;
    match (host.split('-').next()?, system) {
        ("x86_64", "linux-gnu") => Some("linux-x64"),
        ("x86_64", "apple-darwin") => Some("macos-x64"),
        ("aarch64", "apple-darwin") => Some("macos-arm64"),
        ("x86_64", "pc-windows") => Some("windows-x64"),
        ("aarch64", "pc-windows") => Some("windows-arm64"),
        _ => None,
    }
}

/// The archive, the same bytes for the same files: in the order of their names, without times. The wheel goes in as it is.
fn pack(source: &Path, wheel: &Path, licences: &Path, platform: &str, archive: &Path) -> anyhow::Result<()> {
    let wheel_name = format!("wheels/{}", name(wheel)?);
    let mut files =
        vec![("LICENCES.md".to_owned(), fs::read(licences)?), (wheel_name.clone(), fs::read(wheel)?)];
    for entry in fs::read_dir(source)? {
        let path = entry?.path();
        if path.is_file() {
            files.push((name(&path)?, fs::read(&path)?));
        }
    }
    files.sort();
    let options =
        SimpleFileOptions::default().last_modified_time(DateTime::default()).unix_permissions(0o644);
    let mut zip = ZipWriter::new(File::create(archive)?);
    for (name, mut content) in files {
        // A wheel is an archive already.
        let method = if name == wheel_name { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        if name == "blender_manifest.toml" {
            content = with_wheel(&String::from_utf8(content)?, platform, &wheel_name)?.into_bytes();
        }
        zip.start_file(name, options.compression_method(method))?;
        zip.write_all(&content)?;
    }
    zip.finish()?;
    Ok(())
}

/// The manifest with the platform and the wheel, before the first table.
fn with_wheel(manifest: &str, platform: &str, wheel: &str) -> anyhow::Result<String> {
    let Some((fields, tables)) = manifest.split_once("\n[") else { bail!("the manifest has no table") };
    Ok(format!("{fields}\nplatforms = [\"{platform}\"]\nwheels = [\"./{wheel}\"]\n\n[{tables}"))
}

fn name(path: &Path) -> anyhow::Result<String> {
    Ok(path.file_name().context("a file has a name")?.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use zip::ZipArchive;

    const WHEEL: &str = "sombrero-0.1.0-cp310-abi3-manylinux_2_28_x86_64.whl";

    fn packed(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("sombrero-extension-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let (wheel, licences) = (folder.join(WHEEL), folder.join("licences.md"));
        fs::write(&wheel, b"a wheel").expect("a wheel");
        fs::write(&licences, b"licences").expect("licences");
        extension(&wheel, &licences, "x86_64-unknown-linux-gnu", &folder)
            .expect("an extension")
            .expect("Blender runs there")
    }

    #[test]
    fn the_archive_has_what_its_manifest_names_and_what_blender_wants() {
        let archive = packed("names");
        assert!(archive.ends_with(format!("sombrero-blender-{}-linux-x64.zip", env!("CARGO_PKG_VERSION"))));
        let mut zip = ZipArchive::new(File::open(&archive).expect("an archive")).expect("a zip");
        let mut text = |name: &str| {
            let mut text = String::new();
            zip.by_name(name).expect(name).read_to_string(&mut text).map(|_| text).expect(name)
        };
        let manifest = text("blender_manifest.toml");
        let (fields, _) = manifest.split_once("\n[").expect("tables come last");
        for line in [
            format!("wheels = [\"./wheels/{WHEEL}\"]"),
            "platforms = [\"linux-x64\"]".to_owned(),
            format!("version = \"{}\"", env!("CARGO_PKG_VERSION")),
        ] {
            assert_eq!(fields.lines().filter(|one| **one == line).count(), 1, "{line}");
        }
        assert_eq!(text(&format!("wheels/{WHEEL}")), "a wheel", "unmodified");
        assert!(text("LICENSE").contains("GNU GENERAL PUBLIC LICENSE"));
        for name in ["__init__.py", "operators.py", "panel.py", "README.md", "LICENCES.md"] {
            assert!(!text(name).is_empty(), "{name}");
        }
        let names: Vec<_> = zip.file_names().map(|name| name.expect("a name").into_owned()).collect();
        assert!(
            names.iter().all(|name| !name.contains("test") && !name.contains("__pycache__")),
            "{names:?}"
        );
        fs::remove_dir_all(archive.parent().expect("a folder")).expect("removed");
    }

    #[test]
    fn the_same_files_make_the_same_bytes() {
        let archives = [packed("once"), packed("twice")];
        let [once, twice] = archives.each_ref().map(|archive| fs::read(archive).expect("an archive"));
        assert!(once == twice);
        for archive in archives {
            fs::remove_dir_all(archive.parent().expect("a folder")).expect("removed");
        }
    }

    #[test]
    fn platforms_have_blenders_names() {
        assert_eq!(platform("aarch64-apple-darwin"), Some("macos-arm64"));
        assert_eq!(platform("x86_64-pc-windows-msvc"), Some("windows-x64"));
        assert_eq!(platform("riscv64gc-unknown-linux-gnu"), None);
    }
}
