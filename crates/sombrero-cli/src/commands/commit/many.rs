//! One timestamp for all keys of a folder: the root of a tree of their commitments is what is stamped, and each key keeps
//! the path that leads to it.

use super::{Args, LARGEST_TOKEN, meaning};
use crate::answer::{Answer, Context};
use crate::failure::Failure;
use crate::files;
use crate::key_folder::{KeyFolder, Skipped, no_keys};
use crate::progress::Progress;
use crate::table::Table;
use crate::timestamp::{self, Stamp};
use rayon::prelude::*;
use serde::Serialize;
use sombrero::Tracer;
use sombrero::io::{Access, Document, Output, replace_each};
use sombrero::watermark::{Key, Mismatch, Path as TreePath, hash_tree};
use sombrero_timestamp::{Token, request};
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report {
    digest: String,
    keys: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    request: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    timestamp: Option<Stamp>,
    skipped: Vec<Skipped>,
}

pub(super) fn run(args: &Args, folder: &Path, context: &Context) -> Result<Answer, Failure> {
    let _progress = Progress::new(format!("verifying the keys in {}", folder.display()));
    let KeyFolder { paths, keys, mut skipped } = KeyFolder::read(folder, context.desk)?;
    let original = files::read_mesh(&args.input, context)?;
    let mut genuine = Vec::new();
    for ((path, key), checked) in paths.into_iter().zip(keys.iter()).zip(checked(args, &original, &keys)?) {
        match checked {
            Ok(()) => genuine.push((path, key.clone())),
            Err(reason) => skipped.push(Skipped::new(&path, &reason)),
        }
    }
    if genuine.is_empty() {
        return Err(no_keys(folder, &skipped));
    }
    let report = match &args.token {
        None => ask(args, folder, genuine, skipped)?,
        Some(token) => store(args, token, genuine, skipped)?,
    };
    Answer::new(text(args, folder, &report), &report)
}

/// Nobody shall wait for a timestamp of a key that is of no use.
fn checked(args: &Args, original: &Document, keys: &[Key]) -> Result<Vec<Result<(), Mismatch>>, Failure> {
    let failed = |e| Failure::about("mesh", &args.input, &e);
    let (_, rejected) = Tracer::new(original, keys.to_vec()).map_err(failed)?;
    let mut checked: Vec<Result<(), Mismatch>> = vec![Ok(()); keys.len()];
    for rejected in rejected {
        checked[rejected.index] = Err(rejected.reason);
    }
    checked.par_iter_mut().zip(keys).filter(|(checked, _)| checked.is_ok()).for_each(|(checked, key)| {
        *checked = key.check_watermark();
    });
    Ok(checked)
}

/// Gives every key without a timestamp its place in a tree, and writes the request for the root.
fn ask(
    args: &Args,
    folder: &Path,
    genuine: Vec<(PathBuf, Key)>,
    mut skipped: Vec<Skipped>,
) -> Result<Report, Failure> {
    let (mut placed, stamped): (Vec<_>, Vec<_>) =
        genuine.into_iter().partition(|(_, key)| args.force || key.timestamp.is_none());
    skipped.extend(stamped.iter().map(|(path, _)| Skipped::new(path, &"it has a timestamp already")));
    if placed.is_empty() {
        let message =
            format!("{}: all keys have a timestamp; give --force to replace them", folder.display());
        return Err(Failure::new("timestamp", message));
    }
    let commitments: Vec<[u8; 32]> = placed.iter().map(|(_, key)| key.commitment()).collect();
    let (root, paths) = hash_tree(&commitments);
    let request_path = args.output.clone().unwrap_or_else(|| folder.with_added_extension("tsq"));
    // Without a request, keys that have their places in this very tree are what a run left that was broken off.
    let is_left = |key: &Key, path: &TreePath| key.path.as_ref() == Some(path) && !request_path.exists();
    let waiting = |((_, key), path): &(&(PathBuf, Key), &TreePath)| key.path.is_some() && !is_left(key, path);
    if let Some(((path, _), _)) = placed.iter().zip(&paths).find(waiting).filter(|_| !args.force) {
        let message = format!(
            "{}: waits for a timestamp that was asked for before; store it with --token, or give --force to ask anew",
            path.display()
        );
        return Err(Failure::new("timestamp", message));
    }
    for ((_, key), path) in placed.iter_mut().zip(paths) {
        (key.path, key.timestamp) = (Some(path), None);
    }
    files::check_outputs(&[&request_path], &[&args.input], args.force)?;
    // The request last: where it is, the keys are whole.
    write(&placed)?;
    let request = request(&root, None);
    files::write_all(&[Output { path: &request_path, bytes: &request, access: Access::Usual }], args.force)?;
    let request = Some(request_path.display().to_string());
    Ok(Report { digest: hex::encode(root), keys: placed.len(), request, timestamp: None, skipped })
}

/// Checks the authority's answer and puts the token into all keys whose paths lead to what it stamps.
fn store(
    args: &Args,
    token_path: &Path,
    genuine: Vec<(PathBuf, Key)>,
    mut skipped: Vec<Skipped>,
) -> Result<Report, Failure> {
    let anchors = timestamp::anchors(args.ca.as_deref())?;
    let answer = files::read_small(token_path, LARGEST_TOKEN, "the authority's answer")?;
    let token = Token::from_der(&answer).map_err(|e| Failure::about("timestamp", token_path, &e))?;
    let fits = |key: &Key| key.path.is_some() && key.stamped() == *token.digest();
    let (mut meant, others): (Vec<_>, Vec<_>) = genuine.into_iter().partition(|(_, key)| fits(key));
    skipped.extend(others.iter().map(|(path, _)| Skipped::new(path, &"the token is not for it")));
    if meant.is_empty() {
        let message = format!(
            "{}: for none of these keys; ask for a timestamp with `commit --keys` first",
            token_path.display()
        );
        return Err(Failure::new("timestamp", message));
    }
    let stamp = timestamp::check(token_path, &answer, token.digest(), &anchors)?;
    for (_, key) in &mut meant {
        key.timestamp = Some(token.to_der().to_vec());
    }
    write(&meant)?;
    let digest = hex::encode(token.digest());
    Ok(Report { digest, keys: meant.len(), request: None, timestamp: Some(stamp), skipped })
}

/// Each key is whole at any moment.
fn write(keys: &[(PathBuf, Key)]) -> Result<(), Failure> {
    let texts: Vec<String> = keys.iter().map(|(_, key)| key.to_json()).collect();
    let outputs: Vec<Output<'_>> = keys
        .iter()
        .zip(&texts)
        .map(|((path, _), text)| Output { path, bytes: text.as_bytes(), access: Access::Private })
        .collect();
    Ok(replace_each(&outputs)?)
}

fn text(args: &Args, folder: &Path, report: &Report) -> Table {
    let (folder, input) = (folder.display(), args.input.display());
    let request = report.request.as_ref();
    let mut table = Table::new(format!("commitment to {} keys in {folder} and {input}", report.keys))
        .row("digest", format!("SHA-256 {}, the root of a tree", report.digest))
        .row("stored", "in each key: its place in the tree, whose hash changes; its commitment does not")
        .rows("request", request.map(|r| format!("{r} (RFC 3161: send it to a timestamping authority)")));
    if let Some(stamp) = &report.timestamp {
        table = table.and(stamp.rows());
    }
    table.and(Skipped::rows(&report.skipped)).and(meaning())
}
