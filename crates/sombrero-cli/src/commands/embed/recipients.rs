//! A copy and a key for each line of a list of buyers. The basis is computed once.

use super::args::Order;
use super::copy::{Place, write};
use super::folder::{Before, before, make_folders, own_secret};
use super::keeping::Keeping;
use crate::answer::{Answer, Context, Outcome};
use crate::failure::Failure;
use crate::files;
use crate::progress::Progress;
use crate::table::Table;
use rayon::prelude::*;
use serde::Serialize;
use sombrero::io::Document;
use sombrero::watermark::{Identity, Key, OriginalDigest, Secret};
use sombrero::{EmbedOptions, EmbedReport, Embedder};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// A list of a million buyers has some 50 MB.
const LARGEST_LIST: u64 = 256 << 20;

/// The number of failures that are told one by one.
const MOST_TOLD: usize = 10;

/// The summary.
#[derive(Serialize)]
struct Report {
    input: String,
    out_dir: String,
    written: usize,
    kept: usize,
    failed: usize,
    copies: Vec<Copy>,
    seconds: f64,
}

#[derive(Serialize)]
struct Copy {
    recipient: String,
    output: String,
    key: String,
    #[serde(flatten)]
    fate: Fate,
}

#[derive(Serialize)]
#[serde(tag = "status", rename_all = "lowercase")]
enum Fate {
    Written(Box<EmbedReport>),
    Kept,
    Failed { error: Failure },
}

/// One line of the list.
struct Job {
    identity: Identity,
    output: PathBuf,
    key: PathBuf,
}

pub(super) fn run(
    inputs: &[PathBuf],
    folder: &Path,
    list: &Path,
    order: &Order<'_>,
    context: &Context,
) -> Result<Outcome, Failure> {
    let start = Instant::now();
    let given = order.secret(context.desk)?;
    let [input] = inputs else {
        return Err(Failure::new("usage", "--recipients makes copies of one file; give one input"));
    };
    if input.is_dir() {
        let what =
            "--recipients makes copies of one file, and this is a folder; give its models one at a time";
        return Err(Failure::new("usage", format!("{}: {what}", input.display())));
    }
    let mut keeping = Keeping::new(order)?;
    let progress = Progress::new(format!("marking {}", input.display()));
    let original = files::read_mesh(input, context)?;
    let rows = read_rows(list)?;
    check_names(input, &original)?;
    let keys = make_folders(folder, context)?;
    let jobs = jobs(&order.options.identity.owner, input, folder, &keys, rows);
    let digest = OriginalDigest::of(original.parts());

    let left = |job: &Job| {
        let place = Place { input, output: &job.output, key: &job.key };
        match order.force {
            true => Ok(Before::Nothing),
            false => before(&order.options, &place, &job.identity, &digest),
        }
    };
    let (mut fates, kept): (Vec<Option<Fate>>, Vec<Option<Box<Key>>>) = jobs
        .par_iter()
        .map(|job| match left(job) {
            Ok(Before::All) => (Some(Fate::Kept), None),
            Ok(Before::Key(key)) => (None, Some(key)),
            Ok(Before::Nothing) => (None, None),
            Err(error) => (Some(Fate::Failed { error }), None),
        })
        .unzip();

    if fates.iter().any(Option::is_none) {
        let failed = |e: &dyn std::error::Error| Failure::about("mesh", input, e);
        let secret = |(job, kept): (&Job, &Option<Box<Key>>)| match kept {
            Some(kept) => Ok(kept.secret),
            None => own_secret(given, &digest, &job.identity),
        };
        let secrets: Vec<Secret> = jobs.iter().zip(&kept).map(secret).collect::<Result<_, _>>()?;
        let EmbedOptions { parameters, fewer_if_small, max_displacement, .. } = order.options;
        let embedder = Embedder::within(&original, parameters, fewer_if_small, max_displacement)
            .map_err(|e| failed(&e))?;
        let total = fates.iter().filter(|fate| fate.is_none()).count();
        let made = AtomicUsize::new(0);
        progress.count(0, total);
        // One copy is much like another, and measuring takes longer than marking: the first stands for all.
        let first = fates.iter().position(Option::is_none);
        let mark = |i: usize, job: &Job, secret: &Secret, kept: Option<&Key>| {
            let place = Place { input, output: &job.output, key: &job.key };
            let new = [place.output, place.key];
            files::check_outputs(&new[..if kept.is_some() { 1 } else { 2 }], &[input, list], order.force)?;
            let marked = embedder
                .mark(job.identity.clone(), *secret, &order.rewrite(place.output))
                .map_err(|e| failed(&e))?;
            let marked = if first == Some(i) { embedder.measured(marked) } else { marked };
            write(&marked, &original, &place, &[input, list], kept, order.force, context)?;
            Ok(Fate::Written(Box::new(marked.report)))
        };
        let open = fates.par_iter_mut().zip(&jobs).zip(secrets.par_iter().zip(&kept)).enumerate();
        open.filter(|(_, ((fate, _), _))| fate.is_none()).for_each(|(i, ((fate, job), (secret, kept)))| {
            let marked = mark(i, job, secret, kept.as_deref());
            *fate = Some(marked.unwrap_or_else(|error| Fate::Failed { error }));
            progress.count(made.fetch_add(1, Ordering::Relaxed) + 1, total);
        });
    }
    drop(progress);
    let failed = |fate: &Option<Fate>| matches!(fate, Some(Fate::Failed { .. }));
    let keys: Vec<PathBuf> =
        jobs.iter().zip(&fates).filter(|(_, fate)| !failed(fate)).map(|(job, _)| job.key.clone()).collect();
    let report = report(input, folder, jobs, fates, start);
    let status = if report.failed > 0 { 2 } else { 0 };
    let answer = Answer { status, ..Answer::new(text(&report), &report)? };
    let name = Path::new(input.file_name().unwrap_or_default());
    Ok(Outcome::Answer(keeping.keep(original, input, name, &keys, answer)?))
}

fn report(input: &Path, folder: &Path, jobs: Vec<Job>, fates: Vec<Option<Fate>>, start: Instant) -> Report {
    let copies: Vec<Copy> = jobs
        .into_iter()
        .zip(fates)
        .map(|(job, fate)| Copy {
            recipient: job.identity.recipient,
            output: job.output.display().to_string(),
            key: job.key.display().to_string(),
            fate: fate.unwrap_or(Fate::Kept),
        })
        .collect();
    let count = |which: fn(&Fate) -> bool| copies.iter().filter(|copy| which(&copy.fate)).count();
    Report {
        input: input.display().to_string(),
        out_dir: folder.display().to_string(),
        written: count(|fate| matches!(fate, Fate::Written(_))),
        kept: count(|fate| matches!(fate, Fate::Kept)),
        failed: count(|fate| matches!(fate, Fate::Failed { .. })),
        copies,
        seconds: start.elapsed().as_secs_f64(),
    }
}

fn text(report: &Report) -> Table {
    let written: Vec<&EmbedReport> = report
        .copies
        .iter()
        .filter_map(|copy| match &copy.fate {
            Fate::Written(report) => Some(&**report),
            _ => None,
        })
        .collect();
    let count = |count: usize, what: &str| match count {
        0 => String::new(),
        count => format!(", {count} {what}"),
    };
    let (kept, failed) = (count(report.kept, "kept from before"), count(report.failed, "failed"));
    let notes: BTreeSet<&String> = written.iter().flat_map(|report| &report.warnings).collect();
    let failures = report.copies.iter().filter_map(|copy| match &copy.fate {
        Fate::Failed { error } => Some(format!("{}: {}", copy.recipient, error.message())),
        _ => None,
    });
    let head = format!("marked {} for {} recipients → {}", report.input, report.copies.len(), report.out_dir);
    Table::new(head)
        .row("copies", format!("{} written{kept}{failed}", report.written))
        .row("keys", format!("{}/keys (secret; keep them together with the original)", report.out_dir))
        .and(marks(&written, report.kept > 0))
        .row("seconds", format!("{:.2}", report.seconds))
        .rows("note", notes.iter().take(MOST_TOLD))
        .rows("failed", failures.take(MOST_TOLD))
}

/// The marks that were written in this run, by the longest displacement and the weakest of them.
fn marks(written: &[&EmbedReport], kept: bool) -> Table {
    let Some(first) = written.first() else { return Table::default() };
    let longest = written.iter().map(|r| r.distortion.relative_max).fold(0.0, f64::max);
    let weakest = written.iter().map(|r| r.log10_p_after_noise).fold(f64::NEG_INFINITY, f64::max);
    let new = if kept { " new one" } else { "" };
    let mark =
        format!("{} coefficients, {} basis, epsilon {}", first.coefficients, first.basis, first.epsilon);
    let read_back =
        format!("by the paper's test after noise of 0.2 % log10 p of the weakest{new} would be {weakest:.1}");
    Table::default()
        .row("mark", mark)
        .row("displacement", format!("at most {longest:.5} of the largest side"))
        .row("read back", read_back)
}

/// One line: whose copy, and the name that its files shall have.
struct Row {
    recipient: String,
    file: Option<String>,
}

fn read_rows(list: &Path) -> Result<Vec<Row>, Failure> {
    let wrong = |what: String| Failure::new("recipients", format!("{}: {what}", list.display()));
    let bytes = files::read_small(list, LARGEST_LIST, "a list in CSV with a column `recipient`")?;
    let text = decoded(&bytes);
    let separator = Separator::of(&text);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).delimiter(separator.sign()).from_reader(text.as_ref());
    let separated = separator.name();
    let unreadable =
        |e: csv::Error| wrong(format!("{e} (columns separated by {separated}); save it as CSV in UTF-8"));
    let names = reader.headers().map_err(unreadable)?.clone();
    let column = |name: &str| names.iter().position(|n| n.eq_ignore_ascii_case(name));
    let Some(recipient) = column("recipient") else {
        return Err(wrong(format!(
            "no column `recipient` in its first line (columns separated by {separated}); add one that says who gets each copy"
        )));
    };
    let file = column("file");
    let mut rows: Vec<Row> = Vec::new();
    let mut seen = BTreeSet::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let line = record.position().map_or(0, csv::Position::line);
        let text = record.get(recipient).unwrap_or_default().to_owned();
        if text.is_empty() {
            return Err(wrong(format!("line {line}: no recipient; fill it in or take the line out")));
        }
        if !seen.insert(text.clone()) {
            return Err(wrong(format!(
                "line {line}: {text} is there twice; give each copy a recipient of its own"
            )));
        }
        let file = file.and_then(|column| record.get(column)).filter(|file| !file.is_empty());
        rows.push(Row { file: file.map(slug), recipient: text });
    }
    if rows.is_empty() {
        return Err(wrong("no recipients; give a line for each copy".into()));
    }
    Ok(rows)
}

/// A list as UTF-8. Programs for tables like to begin with a mark of the byte order, and save "Unicode text" as UTF-16.
fn decoded(bytes: &[u8]) -> Cow<'_, [u8]> {
    let wide = |of: fn([u8; 2]) -> u16| {
        let units = bytes.as_chunks::<2>().0.iter().skip(1).map(|pair| of(*pair));
        let text: String =
            char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        Cow::Owned(text.into_bytes())
    };
    match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ => Cow::Borrowed(bytes),
    }
}

/// What separates the columns of a list: programs for tables take what their language uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Comma,
    Semicolon,
    Tab,
}

impl Separator {
    /// The one that the first line has most of, outside of quotes.
    fn of(text: &[u8]) -> Self {
        let first =
            text.split(|byte| matches!(byte, b'\n' | b'\r')).find(|line| !line.trim_ascii().is_empty());
        let mut quoted = false;
        let mut counts = [0_usize; 3];
        for byte in first.unwrap_or_default() {
            quoted ^= *byte == b'"';
            for (separator, count) in [Self::Comma, Self::Semicolon, Self::Tab].into_iter().zip(&mut counts) {
                *count += usize::from(!quoted && *byte == separator.sign());
            }
        }
        match counts {
            [comma, semicolon, tab] if tab > comma.max(semicolon) => Self::Tab,
            [comma, semicolon, _] if semicolon > comma => Self::Semicolon,
            _ => Self::Comma,
        }
    }

    fn sign(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
        }
    }
}

/// Copies are called as their input is, and that must not be as another format is.
fn check_names(input: &Path, original: &Document) -> Result<(), Failure> {
    files::check_format(input, original).map_err(|_| {
        let (format, extension) = (original.format(), original.extension());
        let message = format!(
            "{}: its content is {format}, and so would be that of copies of this name; rename it to end in .{extension}",
            input.display()
        );
        Failure::new("usage", message)
    })
}

/// The names of files for each row: the one in the list, or INPUT-RECIPIENT. Where two rows have the same, or none, the
/// number of the row tells them apart, so that a longer list gives the same names to the rows before.
fn jobs(owner: &str, input: &Path, folder: &Path, keys: &Path, rows: Vec<Row>) -> Vec<Job> {
    let stem =
        input.file_stem().and_then(OsStr::to_str).filter(|_| !files::is_standard(input)).unwrap_or("copy");
    let extension = input.extension().and_then(OsStr::to_str);
    let mut taken = BTreeSet::new();
    let job = |(number, row): (usize, Row)| {
        let mut name = match (row.file, slug(&row.recipient)) {
            (Some(file), _) if !file.is_empty() => file,
            (_, words) if words.is_empty() => format!("{stem}-{}", number + 1),
            (_, words) => format!("{stem}-{words}"),
        };
        while !taken.insert(name.clone()) {
            name = format!("{name}-{}", number + 1);
        }
        let file = extension.map_or_else(|| name.clone(), |extension| format!("{name}.{extension}"));
        Job {
            identity: Identity { owner: owner.to_owned(), recipient: row.recipient },
            output: folder.join(file),
            key: keys.join(format!("{name}.key")),
        }
    };
    rows.into_iter().enumerate().map(job).collect()
}

/// Letters and digits in lower case, anything else as single hyphens: a file name everywhere.
fn slug(text: &str) -> String {
    let words: Vec<String> =
        text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty()).map(str::to_lowercase).collect();
    let slug: String = words.join("-").chars().take(80).collect();
    slug.trim_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slugs_are_file_names() {
        assert_eq!(slug("Alice & Co., Ltd."), "alice-co-ltd");
        assert_eq!(slug("../../etc/passwd"), "etc-passwd");
        assert_eq!(slug("Łódź № 7"), "łódź-7");
        assert_eq!(slug("…"), "");
        assert_eq!(slug(&"x".repeat(300)).len(), 80);
    }

    #[test]
    fn the_separator_is_what_the_first_line_has() {
        for (text, separator) in [
            ("recipient", Separator::Comma),
            ("recipient,file\nA;B;C,d", Separator::Comma),
            ("recipient;file\nA,B,C;d", Separator::Semicolon),
            ("\n\nrecipient\tfile\n", Separator::Tab),
            ("\"a;b;c\",recipient", Separator::Comma),
            ("\"a,b,c\";recipient\r\n", Separator::Semicolon),
            ("a,b;recipient;file", Separator::Semicolon),
        ] {
            assert_eq!(Separator::of(text.as_bytes()), separator, "{text}");
        }
    }

    #[test]
    fn lists_come_in_what_programs_for_tables_save() {
        let text = "recipient\tfile\r\nŁódź\ta\r\n";
        let wide = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
            std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(bytes).collect()
        };
        for bytes in [
            text.as_bytes().to_vec(),
            ["\u{feff}".as_bytes(), text.as_bytes()].concat(),
            wide(u16::to_le_bytes),
            wide(u16::to_be_bytes),
        ] {
            assert_eq!(decoded(&bytes), text.as_bytes());
        }
    }
}
