//! XML by tags and their places, as far as 3MF uses it.
//!
//! Tags are found by quick-xml; their attributes are taken apart here, since the writer has to know where each
//! value stands. No entity is ever declared: a document type declaration is refused.

use std::borrow::Cow;
use std::ops::Range;

use memchr::memmem::Finder;
use quick_xml::Reader;
use quick_xml::events::Event;

use crate::error::{ParseError, Place};
use crate::text;

/// The namespace of the core specification.
pub(super) const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";

/// The namespaces of the core specification: this one, and that of its first edition.
const CORES: [&str; 2] = [CORE, "http://schemas.microsoft.com/3dmanufacturing/2013/01"];

/// Most namespaces that may be declared at one place. Files have fewer than twenty, and each tag looks through
/// all of them.
const MOST_NAMESPACES: usize = 100;

/// A walk over the tags of a part.
pub(super) struct Xml<'a> {
    part: String,
    text: &'a str,
    /// Length of the byte order mark, which the reader does not see.
    mark: usize,
    reader: Reader<&'a [u8]>,
    depth: usize,
    namespaces: Vec<Namespace<'a>>,
    /// Finds the tags that declare namespaces.
    declaration: Finder<'static>,
}

struct Namespace<'a> {
    /// How deep the tag is that declares it.
    depth: usize,
    prefix: &'a str,
    uri: &'a str,
    /// Whether it is the one of the core specification: told once, since every tag asks.
    core: bool,
}

/// What stands between `<` and `>`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tag<'a> {
    /// Where in the part `<` stands.
    pub(super) at: usize,
    /// The name and the attributes.
    pub(super) body: &'a str,
    /// Whether it ends itself, as `<a/>` does.
    pub(super) empty: bool,
}

/// A step of the walk.
pub(super) enum Step<'a> {
    Open(Tag<'a>),
    Close,
    End,
}

impl<'a> Xml<'a> {
    /// Starts before the first tag of the part that is called `part`.
    pub(super) fn new(part: String, bytes: &'a [u8]) -> Result<Self, ParseError> {
        if text::is_utf16(bytes) || bytes.iter().take(2).any(|&b| b == 0) {
            return Err(ParseError::Unsupported {
                what: format!("UTF-16 in the part `{part}`"),
                cure: "export the model again with UTF-8",
            });
        }
        let text = std::str::from_utf8(bytes).map_err(|error| ParseError::Malformed {
            place: place(&part, bytes, error.valid_up_to()),
            problem: "the text is not UTF-8".into(),
        })?;
        let mark = text::beginning(bytes);
        let reader = Reader::from_str(text.get(mark..).unwrap_or_default());
        Ok(Self {
            part,
            text,
            mark,
            reader,
            depth: 0,
            namespaces: Vec::new(),
            declaration: Finder::new("xmlns"),
        })
    }

    /// How many tags are open.
    pub(super) fn depth(&self) -> usize {
        self.depth
    }

    fn at(&self) -> usize {
        self.mark.saturating_add(usize::try_from(self.reader.buffer_position()).unwrap_or(usize::MAX))
    }

    /// The next tag.
    pub(super) fn step(&mut self) -> Result<Step<'a>, ParseError> {
        while self.namespaces.last().is_some_and(|namespace| namespace.depth > self.depth) {
            self.namespaces.pop();
        }
        loop {
            let at = self.at();
            let event = self.reader.read_event().map_err(|error| self.malformed(at, error.to_string()))?;
            let (length, empty) = match event {
                Event::Start(tag) => (tag.len(), false),
                Event::Empty(tag) => (tag.len(), true),
                Event::End(_) => {
                    self.depth = self.depth.saturating_sub(1);
                    return Ok(Step::Close);
                }
                Event::Eof if self.depth > 0 => {
                    return Err(self.malformed(at, "the text ends although tags are open".into()));
                }
                Event::Eof => return Ok(Step::End),
                Event::DocType(_) => {
                    let problem = "a document type declaration (DOCTYPE) stands here, which 3MF forbids";
                    return Err(self.malformed(at, problem.into()));
                }
                _ => continue,
            };
            let body = self.text.get(at + 1..at + 1 + length).unwrap_or_default();
            let tag = Tag { at, body, empty };
            self.declare(tag)?;
            self.depth += usize::from(!empty);
            return Ok(Step::Open(tag));
        }
    }

    /// Takes in the namespaces that a tag declares.
    fn declare(&mut self, tag: Tag<'a>) -> Result<(), ParseError> {
        if self.declaration.find(tag.body.as_bytes()).is_none() {
            return Ok(());
        }
        for attribute in Attributes::new(tag.body) {
            let (name, value) = attribute.map_err(|problem| self.malformed(tag.at, problem.into()))?;
            let prefix = match name.split_once(':') {
                None if name == "xmlns" => "",
                Some(("xmlns", prefix)) => prefix,
                _ => continue,
            };
            if self.namespaces.len() >= MOST_NAMESPACES {
                let problem = format!("more than {MOST_NAMESPACES} namespaces are declared here");
                return Err(self.malformed(tag.at, problem));
            }
            let uri = tag.body.get(value).unwrap_or_default().trim();
            self.namespaces.push(Namespace {
                depth: self.depth + 1,
                prefix,
                uri,
                core: CORES.contains(&uri),
            });
        }
        Ok(())
    }

    fn find(&self, prefix: &str) -> Option<&Namespace<'a>> {
        // Most tags have no prefix, and to compare empty strings by their bytes can be slow: processors stumble
        // over the address that they do not have.
        let same = |own: &str| own.len() == prefix.len() && (prefix.is_empty() || own == prefix);
        self.namespaces.iter().rev().find(|namespace| same(namespace.prefix))
    }

    /// The namespace that a prefix stands for; empty for none.
    pub(super) fn namespace(&self, prefix: &str) -> &'a str {
        self.find(prefix).map_or("", |namespace| namespace.uri)
    }

    /// Whether a tag is of the core specification.
    pub(super) fn is_core(&self, tag: Tag<'a>) -> bool {
        self.find(self.name(tag).0).is_some_and(|namespace| namespace.core)
    }

    /// The prefix and the name of a tag.
    pub(super) fn name(&self, tag: Tag<'a>) -> (&'a str, &'a str) {
        let length = tag.body.bytes().position(|byte| is_space(byte.into())).unwrap_or(tag.body.len());
        let name = tag.body.get(..length).unwrap_or_default();
        match memchr::memchr(b':', name.as_bytes()).and_then(|at| name.split_at_checked(at)) {
            Some((prefix, local)) => (prefix, local.get(1..).unwrap_or_default()),
            None => ("", name),
        }
    }

    /// The text of an attribute of this name and namespace.
    pub(super) fn attribute_of(
        &self,
        tag: Tag<'a>,
        namespace: &str,
        local: &str,
    ) -> Result<Option<Cow<'a, str>>, ParseError> {
        for attribute in Attributes::new(tag.body) {
            let (name, value) = attribute.map_err(|problem| self.malformed(tag.at, problem.into()))?;
            if let Some((prefix, own)) = name.split_once(':')
                && own == local
                && self.namespace(prefix) == namespace
            {
                return self.value(tag, value).map(Some);
            }
        }
        Ok(None)
    }

    /// Where the values of the named attributes stand in the tag's body.
    pub(super) fn pick<const N: usize>(
        &self,
        tag: Tag<'a>,
        names: [&str; N],
    ) -> Result<[Option<Range<usize>>; N], ParseError> {
        pick(tag.body, names).map_err(|problem| self.malformed(tag.at, problem))
    }

    /// The text of a value.
    pub(super) fn value(&self, tag: Tag<'a>, span: Range<usize>) -> Result<Cow<'a, str>, ParseError> {
        let raw = tag.body.get(span).unwrap_or_default();
        if !raw.contains('&') {
            return Ok(Cow::Borrowed(raw));
        }
        quick_xml::escape::unescape(raw).map_err(|error| self.malformed(tag.at, error.to_string()))
    }

    /// The [`value`](Self::value) of an attribute that may be missing.
    pub(super) fn maybe(
        &self,
        tag: Tag<'a>,
        span: Option<Range<usize>>,
    ) -> Result<Option<Cow<'a, str>>, ParseError> {
        span.map(|span| self.value(tag, span)).transpose()
    }

    /// An error at byte `at`.
    pub(super) fn malformed(&self, at: usize, problem: String) -> ParseError {
        ParseError::Malformed { place: self.place(at), problem }
    }

    /// The line of byte `at`.
    pub(super) fn place(&self, at: usize) -> Place {
        place(&self.part, self.text.as_bytes(), at)
    }

    /// What the part is called.
    pub(super) fn part(&self) -> &str {
        &self.part
    }
}

/// The line of byte `at` in a part.
pub(super) fn place(part: &str, bytes: &[u8], at: usize) -> Place {
    match text::line_at(bytes, at) {
        Place::Line(line) => Place::PartLine { part: part.to_owned(), line },
        other => other,
    }
}

fn is_space(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\r' | '\n')
}

/// Where the values of the named attributes stand in `body`, spaces around them left out.
pub(super) fn pick<const N: usize>(
    body: &str,
    names: [&str; N],
) -> Result<[Option<Range<usize>>; N], String> {
    let mut spans = [const { None }; N];
    for attribute in Attributes::new(body) {
        let (name, value) = attribute?;
        if let Some((span, _)) = spans.iter_mut().zip(names).find(|(_, wanted)| *wanted == name)
            && span.replace(trimmed(body, value)).is_some()
        {
            return Err(format!("the tag gives `{name}` twice"));
        }
    }
    Ok(spans)
}

fn trimmed(body: &str, span: Range<usize>) -> Range<usize> {
    let raw = body.get(span.clone()).unwrap_or_default();
    let start = span.start + (raw.len() - raw.trim_start_matches(is_space).len());
    start..start + raw.trim_matches(is_space).len()
}

/// The attributes of a tag: each name, and where its value stands.
struct Attributes<'a> {
    body: &'a str,
    at: usize,
}

impl<'a> Attributes<'a> {
    fn new(body: &'a str) -> Self {
        Self { body, at: body.find(is_space).unwrap_or(body.len()) }
    }

    fn rest(&self) -> &'a str {
        self.body.get(self.at..).unwrap_or_default()
    }

    fn skip_spaces(&mut self) {
        let rest = self.rest();
        self.at += rest.len() - rest.trim_start_matches(is_space).len();
    }

    fn attribute(&mut self) -> Option<(&'a str, Range<usize>)> {
        let name = self.rest().split(|c| c == '=' || is_space(c)).next().filter(|name| !name.is_empty())?;
        self.at += name.len();
        self.skip_spaces();
        self.at += self.rest().starts_with('=').then_some(1)?;
        self.skip_spaces();
        let quote = self.rest().bytes().next().filter(|byte| matches!(byte, b'"' | b'\''))?;
        self.at += 1;
        let length = memchr::memchr(quote, self.rest().as_bytes())?;
        let value = self.at..self.at + length;
        self.at = value.end + 1;
        Some((name, value))
    }
}

impl<'a> Iterator for Attributes<'a> {
    type Item = Result<(&'a str, Range<usize>), &'static str>;

    fn next(&mut self) -> Option<Self::Item> {
        self.skip_spaces();
        if self.rest().is_empty() {
            return None;
        }
        let attribute = self.attribute();
        if attribute.is_none() {
            self.at = self.body.len();
        }
        Some(attribute.ok_or("an attribute is not of the form name=\"value\""))
    }
}
