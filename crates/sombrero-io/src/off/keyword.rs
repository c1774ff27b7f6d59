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

    /// Understands `[ST][C][N][4][n]OFF`, also with its letters in another order, as MeshLab writes them, which changes
    /// nothing of the order of the values. Where `OFF` is not in capitals, `n` means `N`.
    fn parse(keyword: &[u8]) -> Option<Self> {
        let (letters, off) = keyword.split_at_checked(keyword.len().checked_sub(3)?)?;
        if !off.eq_ignore_ascii_case(b"OFF") {
            return None;
        }
        let letters = if off == b"OFF" { letters.to_vec() } else { letters.to_ascii_uppercase() };
        let (mut keyword, mut rest) = (Self::default(), letters.as_slice());
        while !rest.is_empty() {
            let (seen, letters) = match rest {
                [b'S', b'T', rest @ ..] => (&mut keyword.texture, rest),
                [b'C', rest @ ..] => (&mut keyword.colours, rest),
                [b'N', rest @ ..] => (&mut keyword.normals, rest),
                [b'4', rest @ ..] => (&mut keyword.four, rest),
                [b'n', rest @ ..] => (&mut keyword.any, rest),
                _ => return None,
            };
            if std::mem::replace(seen, true) {
                return None;
            }
            rest = letters;
        }
        Some(keyword)
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
