//! A folder with files to work on, and what every refusal has to be.

use serde_json::Value;
use sombrero::io::{Document, Format, encode};
use sombrero::shapes;
use sombrero_tests::{Workshop, marked};
use std::ffi::OsString;
use std::sync::LazyLock;

pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_sombrero-under-test");

/// An original, its marked copy and the key.
pub(crate) static MADE: LazyLock<[Vec<u8>; 3]> = LazyLock::new(|| {
    let original = encode(Format::Obj, &shapes::bumpy_sphere(650)).unwrap();
    let mark = marked(&Document::parse(original.clone(), None).unwrap(), 1);
    [original, mark.bytes, mark.key.to_json().into_bytes()]
});

/// A folder with `original.obj`, `marked.obj`, `mark.key` and `secret`.
pub(crate) fn workshop() -> Workshop {
    let workshop = Workshop::new(PROGRAM);
    for (name, bytes) in ["original.obj", "marked.obj", "mark.key"].into_iter().zip(&*MADE) {
        workshop.write(name, bytes);
    }
    workshop.write("secret", "ab".repeat(32));
    workshop
}

pub(crate) fn arguments(line: &str) -> Vec<OsString> {
    line.split_whitespace().map(OsString::from).collect()
}

pub(crate) fn with_json(arguments: &[OsString]) -> Vec<OsString> {
    let mut arguments = arguments.to_vec();
    arguments.push("--json".into());
    arguments
}

/// What no message may hold.
pub(crate) fn assert_clean(message: &str) {
    for trace in ["panicked", "RUST_BACKTRACE", "backtrace", "NaN", "Some(", "Err(", "Error {", "src/"] {
        assert!(!message.contains(trace), "`{trace}` in: {message}");
    }
}

pub(crate) fn assert_holds(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// Runs what cannot be done: status 2, one sentence with these words for people and the same for programs, and the
/// folder as it was.
pub(crate) fn refused(workshop: &Workshop, arguments: &[OsString], words: &[&str]) -> String {
    let before = workshop.listing();
    let ran = workshop.run(arguments);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{arguments:?}: {}", ran.stderr);
    let message = ran.stderr.strip_prefix("sombrero: ").and_then(|text| text.strip_suffix('\n'));
    let message = message.unwrap_or_else(|| panic!("{arguments:?}: {}", ran.stderr));
    assert!(!message.contains('\n') && message.len() > 20, "{arguments:?}: not one sentence: {message}");
    assert_clean(message);
    assert_holds(message, words);
    assert!(workshop.listing() == before, "{arguments:?}: something was written");

    let told = for_programs(workshop, arguments);
    assert_eq!(told.message, message, "{arguments:?}");
    assert!(workshop.listing() == before, "{arguments:?} with --json: something was written");
    told.kind
}

/// Runs what the command line does not allow: status 2 and an explanation that holds these words.
pub(crate) fn misused(workshop: &Workshop, arguments: &[OsString], words: &[&str]) {
    let before = workshop.listing();
    let ran = workshop.run(arguments);
    assert_eq!((ran.status, ran.stdout.as_str()), (Some(2), ""), "{arguments:?}: {}", ran.stderr);
    assert_clean(&ran.stderr);
    assert_holds(&ran.stderr, words);
    let told = for_programs(workshop, arguments);
    assert_eq!(told.kind, "usage", "{arguments:?}");
    assert_clean(&told.message);
    assert_holds(&told.message, words);
    assert!(workshop.listing() == before, "{arguments:?}: something was written");
}

pub(crate) struct Told {
    pub(crate) kind: String,
    pub(crate) message: String,
}

pub(crate) fn for_programs(workshop: &Workshop, arguments: &[OsString]) -> Told {
    let ran = workshop.run(with_json(arguments));
    assert_eq!(ran.status, Some(2), "{arguments:?}: {}", ran.stdout);
    let answer = ran.json();
    let error = answer["error"].as_object().unwrap_or_else(|| panic!("{arguments:?}: {answer}"));
    assert_eq!((answer.as_object().unwrap().len(), error.len()), (1, 2), "{answer}");
    let text = |name: &str| error[name].as_str().unwrap_or_else(|| panic!("{answer}")).to_owned();
    let told = Told { kind: text("kind"), message: text("message") };
    assert!(
        !told.kind.is_empty() && told.kind.bytes().all(|b| b == b'_' || b.is_ascii_lowercase()),
        "{answer}"
    );
    assert!(!told.message.contains('\n'), "{answer}");
    told
}

/// The name of a field, and what its value has to be.
pub(crate) type Field = (&'static str, fn(&Value) -> bool);

pub(crate) fn assert_fields(answer: &Value, fields: &[Field]) {
    for (name, fits) in fields {
        let value = answer.get(name).unwrap_or_else(|| panic!("no `{name}` in {answer}"));
        assert!(fits(value), "`{name}` is {value}");
    }
}

pub(crate) fn count(value: &Value) -> bool {
    value.is_u64()
}

pub(crate) fn number(value: &Value) -> bool {
    value.as_f64().is_some_and(f64::is_finite)
}

pub(crate) fn text(value: &Value) -> bool {
    value.is_string()
}

pub(crate) fn object(value: &Value) -> bool {
    value.is_object()
}

pub(crate) fn null(value: &Value) -> bool {
    value.is_null()
}

pub(crate) fn yes(value: &Value) -> bool {
    *value == true
}

pub(crate) fn no(value: &Value) -> bool {
    *value == false
}

pub(crate) fn texts(value: &Value) -> bool {
    value.as_array().is_some_and(|list| list.iter().all(Value::is_string))
}
