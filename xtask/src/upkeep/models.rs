//! `cargo xtask models`: the paper's models, pinned by hash. They belong to others and are never committed.

use anyhow::{Context, bail};
use sha2::{Digest, Sha256};
use std::path::Path;
use std::process::Command;

#[derive(clap::Args)]
pub(crate) struct Models {
    /// Only check the files that are there.
    #[arg(long)]
    verify: bool,
}

struct Source {
    file: &'static str,
    sha256: &'static str,
    /// Where it comes from.
    address: &'static str,
    /// For a file converted from OFF the comment that it starts with.
    comment: Option<&'static str>,
}

const SOURCES: [Source; 4] = [
    Source {
        file: "fandisk.obj",
        sha256: "ea5bab2fbf545b1915f0d9faf6cc61ff8c18e0d8174ad61f8e35de15d8f6e3f8",
        address: "https://raw.githubusercontent.com/alecjacobson/common-3d-test-models/8a4f8642acaf43f9cd7b67858a1502e1055ef202/data/fandisk.obj",
        comment: None,
    },
    Source {
        file: "head.obj",
        sha256: "96e4b68c71887dc6213d84f18958be4e16e8f4eaaa2a22dff41aff40119993f9",
        address: "https://raw.githubusercontent.com/aaarne/matthew/a9fc598b4b65cfb868bb676814bcceb1da3a09f6/data/mannequin.off",
        comment: Some("# mannequin head; OFF to OBJ, coordinate text, vertex order and face order unchanged"),
    },
    Source {
        file: "dragon.obj",
        sha256: "4dca523997fb6ea58dd3748d03f388c0219654ff7a90075e8c5b0d5d9058bb5b",
        address: "https://raw.githubusercontent.com/wangke517/High-Capacity-RDH-in-Encrypted-3D-Mesh-Models-Based-on-Dynamic-Prediction-and-Virtual-Connection/40225d9da2705764c72e7893c8d66f3c9c98468d/off/dragon.off",
        comment: Some(
            "# Stanford dragon, 50000 vertices; OFF to OBJ, coordinate text, vertex order and face order unchanged",
        ),
    },
    Source {
        file: "bunny.ply",
        sha256: "b1acc63bece78444aa2e15bdcc72371a201279b98c6f5d4b74c993d02f0566fe",
        address: "https://raw.githubusercontent.com/google/draco/47238930f698250f474163e1a29d77858aa5c158/testdata/bun_zipper.ply",
        comment: None,
    },
];

pub(crate) fn run(args: &Models, folder: &Path) -> anyhow::Result<()> {
    let mut wrong = Vec::new();
    for source in &SOURCES {
        let path = folder.join(source.file);
        if !args.verify && !path.exists() {
            fetch(source, &path)?;
        }
        let verdict = match std::fs::read(&path) {
            Err(_) => "missing",
            Ok(bytes) if hex::encode(Sha256::digest(&bytes)) == source.sha256 => "as pinned",
            Ok(_) => "another file",
        };
        println!("{:<12} {verdict}", source.file);
        if verdict != "as pinned" {
            wrong.push(source.file);
        }
    }
    if wrong.is_empty() {
        Ok(())
    } else {
        bail!("not as pinned in {}: {}", folder.display(), wrong.join(", "))
    }
}

/// With curl, which every system has; OFF becomes OBJ with the numbers' text unchanged.
fn fetch(source: &Source, path: &Path) -> anyhow::Result<()> {
    println!("fetching {}", source.file);
    let output = Command::new("curl")
        .args(["--fail", "--silent", "--show-error", "--location", source.address])
        .output();
    let output =
        output.context("curl cannot be started; install it or put the models into the folder by hand")?;
    if !output.status.success() {
        bail!("{} cannot be fetched: {}", source.file, String::from_utf8_lossy(&output.stderr).trim());
    }
    let bytes = match source.comment {
        Some(comment) => obj_of_off(comment, &output.stdout)?,
        None => output.stdout,
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(path, bytes).with_context(|| format!("{} cannot be written", path.display()))
}

/// `v x y z` and `f a b c` with the text of the coordinates as it is.
fn obj_of_off(comment: &str, off: &[u8]) -> anyhow::Result<Vec<u8>> {
    let text = std::str::from_utf8(off)?;
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let counts = lines.by_ref().find(|line| *line != "OFF").context("an OFF file has a line of counts")?;
    let vertices: usize = counts.split_whitespace().next().context("the first count is missing")?.parse()?;
    let mut obj = format!("{comment}\n");
    for line in lines.by_ref().take(vertices) {
        obj.push_str(&format!("v {}\n", line.split_whitespace().collect::<Vec<_>>().join(" ")));
    }
    for line in lines {
        let corners = line.split_whitespace().skip(1).map(|v| Ok((v.parse::<usize>()? + 1).to_string()));
        obj.push_str(&format!("f {}\n", corners.collect::<anyhow::Result<Vec<_>>>()?.join(" ")));
    }
    Ok(obj.into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn off_becomes_obj_with_the_same_numbers() {
        let off = b"OFF\n3 1 0\n0 0 1e-3\n1.50 0 0\n0 1 0\n3  0 1 2\n";
        let obj = obj_of_off("# c", off).unwrap();
        assert_eq!(String::from_utf8(obj).unwrap(), "# c\nv 0 0 1e-3\nv 1.50 0 0\nv 0 1 0\nf 1 2 3\n");
    }
}
