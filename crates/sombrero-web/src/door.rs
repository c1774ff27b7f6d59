//! What the worker calls. Files are copied in and out; figures are JSON; a refusal is thrown as its sentence.

use crate::file::File;
use crate::look;
use crate::mark;
use crate::view;
use serde_json::json;
use sombrero::Stages;
use sombrero::progress::{Listener, TARGET};
use sombrero::watermark::Identity;
use std::hint::black_box;
use tracing::subscriber::with_default;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// A function of the worker's, which tells the page how far its task is.
    #[wasm_bindgen(js_name = tellProgress)]
    fn tell_progress(stage: &str, done: f64, of: f64);

    /// Another, which hands the page what it need not wait for.
    #[wasm_bindgen(js_name = giveEarly)]
    fn give_early(answer: Answer);
}

/// A file for the page.
#[wasm_bindgen(getter_with_clone)]
#[derive(Debug, Clone)]
pub struct Given {
    /// Its name.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl From<File> for Given {
    fn from(File { name, bytes }: File) -> Self {
        Self { name, bytes }
    }
}

/// The answer to a task.
#[wasm_bindgen(getter_with_clone)]
#[derive(Debug)]
pub struct Answer {
    /// The files that came of it.
    pub files: Vec<Given>,
    /// The figures, as JSON.
    pub figures: String,
}

/// The figures of a marked copy. Its file and its key are given early.
///
/// # Errors
/// The sentence of a [`Refusal`](crate::Refusal).
#[wasm_bindgen(js_name = mark)]
pub fn mark_model(
    name: String,
    bytes: Vec<u8>,
    owner: String,
    recipient: String,
    secret: &[u8],
) -> Result<Answer, String> {
    make_room(bytes.len());
    let ready = |marked: &mark::MarkedCopy| {
        let files = [&marked.copy, &marked.key].map(|file| Given::from(file.clone()));
        give_early(Answer { files: files.into(), figures: "{}".to_owned() });
    };
    let identity = Identity { owner, recipient };
    let marked = heard(|| mark::mark(File { name, bytes }, identity, secret, ready));
    let report = marked.map_err(|refusal| refusal.to_string())?.report;
    Ok(Answer { files: Vec::new(), figures: serde_json::to_string(&report).map_err(|e| e.to_string())? })
}

/// The verdict on a suspect, and its report.
///
/// # Errors
/// The sentence of a [`Refusal`](crate::Refusal).
#[wasm_bindgen(js_name = look)]
pub fn look_at_suspect(
    suspect_name: String,
    suspect: Vec<u8>,
    original_name: String,
    original: Vec<u8>,
    key_name: String,
    key: Vec<u8>,
) -> Result<Answer, String> {
    make_room(suspect.len() + original.len());
    let suspect = File { name: suspect_name, bytes: suspect };
    let original = File { name: original_name, bytes: original };
    let key = File { name: key_name, bytes: key };
    let verdict = heard(|| look::look(suspect, original, &key)).map_err(|refusal| refusal.to_string())?;
    let said = json!({ "claim": verdict.claim, "notes": verdict.notes, "record": verdict.figures });
    Ok(Answer { files: vec![verdict.report.into()], figures: said.to_string() })
}

/// The page in which a model can be turned, as HTML.
///
/// # Errors
/// The sentence of a [`Refusal`](crate::Refusal).
#[wasm_bindgen(js_name = view)]
pub fn view_model(name: String, bytes: Vec<u8>) -> Result<String, String> {
    view::view(File { name, bytes }).map_err(|refusal| refusal.to_string())
}

/// Takes the memory that a task on files of so many bytes is likely to need, and gives it back to the allocator, which keeps it. A
/// browser takes long to enlarge a program's memory, however little is asked for: a third of the time of marking went there.
fn make_room(bytes: usize) {
    /// A small model's, and what comes on top for each byte of a file.
    const LEAST: usize = 128 << 20;
    const PER_BYTE: usize = 50;
    /// What a telephone may have.
    const MOST: usize = 512 << 20;
    let mut room: Vec<u8> = Vec::new();
    // Without it the task may end just as well, only later.
    if room.try_reserve_exact(LEAST.saturating_add(bytes.saturating_mul(PER_BYTE)).min(MOST)).is_ok() {
        // Unused memory would not be asked for.
        black_box(&mut room);
    }
}

/// The result of `work`, whose stages and steps the worker is told.
fn heard<T>(work: impl FnOnce() -> T) -> T {
    let tell = |stage: &str, done: u64, of: u64| tell_progress(stage, done as f64, of as f64);
    with_default(Listener::new(&[Stages::TARGET, TARGET], tell), work)
}
