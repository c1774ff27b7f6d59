//! The keyword: what the vertices have beside their positions.

use crate::attributes::Attributes;
use crate::text::{self, Joining, Lines};

/// What the keyword says about the vertices.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) struct Keyword {
    pub(super) texture: bool,
    pub(super) colours: bool,
    pub(super) normals: bool,
    /// `4OFF`: homogeneous coordinates.
    four: bool,
    /// `nOFF`: any number of dimensions.
    any: bool,
}

impl Keyword {
    /// The keyword that a file begins with, and the byte behind it, where the first count may follow without a space.
    pub(super) fn of(bytes: &[u8]) -> Option<(Self, usize)> {
        let mut lines = Lines::new(bytes, text::beginning(bytes), Joining::Never);
        let word = lines.first_word()?;
        let spelled = &bytes[word.clone()];
        let length = spelled.iter().rposition(|byte| !byte.is_ascii_digit())? + 1;
        Some((Self::parse(&spelled[..length])?, word.start + length))
    }

    /// Understands `[ST][C][N][4][n]OFF`.
    fn parse(keyword: &[u8]) -> Option<Self> {
        if keyword == b"off" {
            return Some(Self::default());
        }
        let mut rest = keyword.strip_suffix(b"OFF")?;
        let mut has = |letters: &[u8]| match rest.strip_prefix(letters) {
            Some(after) => {
                rest = after;
                true
            }
            None => false,
        };
        let keyword = Self {
            texture: has(b"ST"),
            colours: has(b"C"),
            normals: has(b"N"),
            four: has(b"4"),
            any: has(b"n"),
        };
        rest.is_empty().then_some(keyword)
    }

    /// Why files of this keyword are not read, if they are not.
    pub(super) fn refused(self) -> Option<&'static str> {
        match self {
            Self { any: true, .. } => Some("nOFF (positions of any dimension)"),
            Self { four: true, .. } => Some("4OFF (homogeneous positions)"),
            _ => None,
        }
    }

    /// Notes the names of what vertices have.
    pub(super) fn note(self, attributes: &mut Attributes) {
        let names =
            [(self.normals, "normals"), (self.colours, "colours"), (self.texture, "texture coordinates")];
        for (_, name) in names.iter().filter(|(has, _)| *has) {
            attributes.note(name);
        }
    }
}
