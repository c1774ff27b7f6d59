//! The way to standard output and standard error, and what foreign text may not do there.

use std::fmt::Write as _;
use std::io::Write;

/// `text` as it may stand in a line: control characters and line ends, which could move a terminal's cursor or begin a line
/// that we never said, and signs that turn the reading direction are shown as escapes such as `\u{202e}`.
pub(crate) fn visible(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for sign in text.chars() {
        if is_misleading(sign) {
            // Writing to a string cannot fail.
            let _ = write!(shown, "{}", sign.escape_unicode());
        } else {
            shown.push(sign);
        }
    }
    shown
}

fn is_misleading(sign: char) -> bool {
    // Unicode's Bidi_Control, its separators of lines and paragraphs, and what takes no room at all.
    let turns = matches!(sign, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    sign.is_control() || turns || matches!(sign, '\u{2028}' | '\u{2029}' | '\u{200b}' | '\u{feff}')
}

/// Prints text of our own, line ends included. Whoever closed the pipe has read what they wanted; that is no error.
pub(crate) fn say(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{text}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}

/// One line on standard error. When nobody listens, the exit status still tells.
pub(crate) fn complain(sentence: &str) {
    let _ = writeln!(std::io::stderr(), "sombrero: {}", visible(sentence));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn foreign_text_moves_nothing() {
        assert_eq!(visible("a\nFOUND\r\t\u{1b}[2J\u{9b}"), r"a\u{a}FOUND\u{d}\u{9}\u{1b}[2J\u{9b}");
        assert_eq!(
            visible("\u{202e}jbo.xe\u{2066}\u{200f}\u{2028}"),
            r"\u{202e}jbo.xe\u{2066}\u{200f}\u{2028}"
        );
    }

    #[test]
    fn scripts_of_the_world_stay_as_they_are() {
        for text in ["Łódź № 7", "مزهرية", "כד", "花瓶", "می\u{200c}خواهم", "👩\u{200d}🎨 → …"]
        {
            assert_eq!(visible(text), text);
        }
    }

    proptest! {
        #[test]
        fn any_text_becomes_one_line_and_does_so_once(text in any::<String>()) {
            let shown = visible(&text);
            prop_assert!(!shown.chars().any(is_misleading));
            prop_assert_eq!(shown.lines().count().max(1), 1);
            prop_assert_eq!(visible(&shown), shown);
        }
    }
}
