//! What can go wrong, each in one sentence that says where and what to do about it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::format::Format;

/// Where in a file something stands.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A line of a text file, counted from 1.
    Line(usize),
    /// An element of a binary file, counted from 0, such as `vertex` 5 or `facet` 7.
    Element {
        /// What kind of element.
        name: String,
        /// Its number.
        index: usize,
    },
    /// A line of a text inside an archive, counted from 1.
    PartLine {
        /// The text's name in the archive.
        part: String,
        /// The line.
        line: usize,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Element { name, index } => write!(f, "{name} {index} (counted from 0)"),
            Self::PartLine { part, line } => write!(f, "line {line} of `{part}`"),
        }
    }
}

/// Why bytes are not a mesh that can be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseError {
    /// There are no bytes.
    #[error("the file is empty; export the model again")]
    Empty,
    /// Neither the content nor the extension names a format that is read.
    #[error("this is not an OBJ, PLY, OFF, STL, glTF or 3MF file; export the model in one of these formats")]
    Unrecognised,
    /// A variant of a known format that is not read.
    #[error("{what} is not supported; {cure}")]
    Unsupported {
        /// The variant's name.
        what: String,
        /// What to do instead.
        cure: &'static str,
    },
    /// A file that this one refers to cannot be read.
    #[error("the file it refers to, `{name}`, {problem}; keep both files together in one folder")]
    Companion {
        /// The name as the file gives it.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Data that unpack to more than a file of this size may.
    #[error("{what} unpacks to more than {limit} bytes; raise the limit if you trust the file")]
    Unpacked {
        /// What was being unpacked.
        what: String,
        /// How many bytes are allowed.
        limit: u64,
    },
    /// The ZIP archive around the mesh is damaged or ambiguous.
    #[error("the ZIP archive {problem}; copy or export the file again")]
    Archive {
        /// What is wrong with it, as the rest of a sentence.
        problem: String,
    },
    /// The text or the header breaks the format's rules.
    #[error("{place}: {problem}; correct this or export the model again")]
    Malformed {
        /// Where.
        place: Place,
        /// What is wrong there.
        problem: String,
    },
    /// A word that should be a number is none.
    #[error("{place}: expected a number, found `{found}`; {}", spelling_cure(found))]
    NotANumber {
        /// Where.
        place: Place,
        /// The word, shortened.
        found: String,
    },
    /// A coordinate is infinite or not a number.
    #[error("{place}: a coordinate is not finite; give the vertex a position or remove it")]
    NonFinite {
        /// Where.
        place: Place,
    },
    /// A face names a vertex that does not exist.
    #[error("{place}: {}; correct the index or export the model again", reference(*index, *first, *count))]
    IndexOutOfRange {
        /// Where.
        place: Place,
        /// The index as the file spells it.
        index: i64,
        /// The number of the first vertex: 1 in OBJ, else 0.
        first: usize,
        /// How many vertices there are (before this line, for a negative index of OBJ).
        count: usize,
    },
    /// A header promises more than the file can hold.
    #[error(
        "the header promises {count} of `{element}`, which take at least {needed} bytes, but only {available} \
         follow; the file was cut off or its header is wrong: copy or export it again"
    )]
    Overclaimed {
        /// What kind of element.
        element: String,
        /// How many are promised.
        count: u64,
        /// Bytes they need at least.
        needed: u64,
        /// Bytes there are.
        available: u64,
    },
    /// The file ends too early.
    #[error(
        "the file ends inside {element} {index} (counted from 0); it was cut off: copy or export it again"
    )]
    Truncated {
        /// What kind of element.
        element: String,
        /// The number of the element that is incomplete.
        index: usize,
    },
    /// The content is of another format than the name says, and cannot be read as that.
    #[error("its content looks like {name}, but {source}")]
    Guessed {
        /// The format that the content looks like.
        name: &'static str,
        /// What is wrong with it.
        source: Box<Self>,
    },
    /// A scene without triangles.
    #[error(
        "nothing that it shows has triangles (there are only points or lines, or meshes that no scene or build \
         shows); export the model again with its surface"
    )]
    NothingShown,
    /// There are no vertices at all.
    #[error("the file holds no vertices; export the model again with its geometry")]
    NoVertices,
    /// More vertices than [`Limits`](crate::Limits) allow, or than 32-bit indices can tell apart.
    #[error("the file holds more than {limit} vertices; raise the limit or split the model into parts")]
    TooManyVertices {
        /// How many are allowed.
        limit: usize,
    },
}

impl ParseError {
    /// Where the trouble is, when it is at one place.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::Malformed { place, .. }
            | Self::NotANumber { place, .. }
            | Self::NonFinite { place }
            | Self::IndexOutOfRange { place, .. } => Some(place),
            _ => None,
        }
    }
}

fn reference(index: i64, first: usize, count: usize) -> String {
    if index < 0 && first == 1 {
        format!("a face counts back to vertex {index}, but only {count} vertices stand before it")
    } else {
        format!("a face refers to vertex {index}, but the file has {count} vertices, counted from {first}")
    }
}

/// Why a file could not be read. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("{}: cannot be read ({source}); check the path and the permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A directory, a device, a pipe or a socket.
    #[error("{}: not a regular file; give the path of a mesh file", path.display())]
    NotAFile {
        /// What is not a file.
        path: PathBuf,
    },
    /// Larger than [`Limits`](crate::Limits) allow.
    #[error("{}: larger than {limit} bytes; raise the limit or simplify the model", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The largest size allowed, in bytes.
        limit: u64,
    },
    /// The content is not a mesh that can be read.
    #[error("{}{} {source}", path.display(), if source.place().is_some() { "," } else { ":" })]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ParseError,
    },
}

impl ReadError {
    /// The file that could not be read.
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. }
            | Self::NotAFile { path }
            | Self::TooLarge { path, .. }
            | Self::Parse { path, .. } => path,
        }
    }
}

/// Why a mesh could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// Not one position for each vertex of the file.
    #[error("{given} positions for a file of {expected} vertices; give exactly one for each")]
    WrongCount {
        /// Positions given.
        given: usize,
        /// Vertices in the file.
        expected: usize,
    },
    /// A new coordinate is infinite or not a number.
    #[error("vertex {vertex} (counted from 0) would get a coordinate that is not finite; give it a position")]
    NonFinite {
        /// The vertex.
        vertex: usize,
    },
    /// A new coordinate does not fit the 32-bit floats of the file.
    #[error(
        "vertex {vertex} (counted from 0) would get the coordinate {value:?}, too large for the file's 32-bit \
         floats; scale the model down or store it with 64-bit coordinates"
    )]
    Overflow {
        /// The vertex.
        vertex: usize,
        /// The coordinate.
        value: f64,
    },
    /// The file keeps positions as whole numbers, which cannot take the new ones.
    #[error(
        "vertex {vertex} (counted from 0) cannot move: the file stores `{property}` as whole numbers; \
         store the positions as float or double first"
    )]
    IntegerCoordinates {
        /// The vertex.
        vertex: usize,
        /// The property that is of an integer type: `x`, `y` or `z`.
        property: &'static str,
    },
    /// A new coordinate lies beyond the whole numbers that the file stores positions as.
    #[error(
        "vertex {vertex} (counted from 0) would get the coordinate {value:?}, beyond the whole numbers that the \
         file stores positions as; store the positions as floats first"
    )]
    OffGrid {
        /// The vertex.
        vertex: usize,
        /// The coordinate, as it would be stored.
        value: f64,
    },
    /// The file gives a vertex its position without storing it.
    #[error(
        "vertex {vertex} (counted from 0) cannot move: the file stores no position for it (an accessor without \
         a buffer view); export the model again"
    )]
    NotStored {
        /// The vertex.
        vertex: usize,
    },
    /// The file keeps positions in a way in which they cannot be replaced.
    #[error("{}", lowered(why))]
    Fixed {
        /// Why, and what to do: [`Document::fixed`](crate::Document::fixed).
        why: String,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} (counted from 0) refers to vertex {index}, but there are {count}; \
         correct the index"
    )]
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        index: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// Nothing to write: no vertices, or, for STL and 3MF, no triangles.
    #[error("the mesh has nothing that {format} can hold; give it vertices and triangles")]
    Nothing {
        /// The format asked for.
        format: Format,
    },
    /// More triangles than the format can count.
    #[error("{count} triangles are more than {format} can count; split the model or choose another format")]
    TooMany {
        /// The format asked for.
        format: Format,
        /// How many triangles there are.
        count: usize,
    },
    /// The output is there already.
    #[error("{}: already exists; choose another name or allow overwriting", path.display())]
    Exists {
        /// The output.
        path: PathBuf,
    },
    /// The output has a name that Windows keeps for devices, or that it cannot keep as it is.
    #[error("{}: Windows cannot have a file of this name; choose another name", path.display())]
    Reserved {
        /// The output.
        path: PathBuf,
    },
    /// The output is a symbolic link.
    #[error("{}: a link, so it is neither replaced nor followed; give the name of a file, or - for standard output where that is meant", path.display())]
    Link {
        /// The output.
        path: PathBuf,
    },
    /// The output is a directory, a device, a pipe or a socket.
    #[error("{}: not a regular file, so it cannot be replaced; choose another name", path.display())]
    NotAFile {
        /// The output.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: cannot be written ({}", path.display(), writing_cure(source))]
    Io {
        /// The output.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
}

/// What to do about a word that should be a number.
fn spelling_cure(found: &str) -> &'static str {
    // Programs that go by the language of the system write 0,5 where the formats want 0.5.
    let has_comma = || found.matches(',').count() == 1 && found.replace(',', ".").parse::<f64>().is_ok();
    if has_comma() && !found.ends_with(',') {
        "decimals need a point instead of the comma: export the model again with other settings of language"
    } else {
        "correct this or export the model again"
    }
}

/// What the operating system said about a file that cannot be written, and what to do.
fn writing_cure(source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => "its folder is not there); make the folder first".into(),
        _ => format!("{source}); check the folder and the free space"),
    }
}

/// A sentence of a note as that of an error: these begin small and have no full stop.
fn lowered(sentence: &str) -> String {
    let mut letters = sentence.trim_end_matches('.').chars();
    letters.next().into_iter().flat_map(char::to_lowercase).chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_read_error_is_one_sentence_with_path_and_line() {
        let source = ParseError::IndexOutOfRange { place: Place::Line(12), index: 99, first: 1, count: 8 };
        let error = ReadError::Parse { path: "model.obj".into(), source };
        assert_eq!(
            error.to_string(),
            "model.obj, line 12: a face refers to vertex 99, but the file has 8 vertices, counted from 1; \
             correct the index or export the model again"
        );
        let error = ReadError::Parse { path: "model.obj".into(), source: ParseError::Empty };
        assert_eq!(error.to_string(), "model.obj: the file is empty; export the model again");
        assert_eq!(error.path(), Path::new("model.obj"));
    }

    #[test]
    fn a_negative_index_is_explained_as_counting_back() {
        let error = ParseError::IndexOutOfRange { place: Place::Line(2), index: -9, first: 1, count: 8 };
        assert!(error.to_string().contains("counts back to vertex -9, but only 8 vertices stand before it"));
    }

    #[test]
    fn elements_of_binary_files_are_named() {
        let error = ParseError::NonFinite { place: Place::Element { name: "vertex".into(), index: 5 } };
        assert!(error.to_string().starts_with("vertex 5 (counted from 0): "));
    }
}
