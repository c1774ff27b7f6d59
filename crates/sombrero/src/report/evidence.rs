//! The answer of a test for programs, carried by the page for people.
//!
//! JSON stays the same JSON when a sign inside one of its strings is written as `\uXXXX`, and the signs that could
//! end a script or start a tag appear nowhere else in JSON. With them escaped, no file name can close the element
//! that holds it, and whoever reads the page back needs to undo nothing.

use maud::{Markup, PreEscaped};

const START: &str = "<script type=\"application/json\" id=\"sombrero-evidence\">";
const END: &str = "</script>";

/// The element that holds the JSON.
pub(super) fn element(json: &str) -> Markup {
    PreEscaped(format!("{START}{}{END}", escaped(json)))
}

/// JSON that may stand inside an element. Line separators are escaped too, because some readers of JSON stumble.
fn escaped(json: &str) -> String {
    let mut text = String::with_capacity(json.len());
    for sign in json.chars() {
        match sign {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => text += &format!("\\u{:04x}", u32::from(sign)),
            _ => text.push(sign),
        }
    }
    text
}

/// The JSON that a page carries as [`DetectionReport::evidence`](super::DetectionReport::evidence).
///
/// It has the same meaning as what was put in; some signs inside strings may be written as `\uXXXX` now. `None`
/// when the page carries none, or more than one, since then nobody can say which is meant. Nothing else about the
/// page is checked: anybody can write such a page, so a reader has to test what it says.
///
/// # Example
/// ```
/// use sombrero::report::evidence_of;
///
/// let page = r#"<p>…</p><script type="application/json" id="sombrero-evidence">{"a":1}</script>"#;
/// assert_eq!(evidence_of(page), Some(r#"{"a":1}"#));
/// assert_eq!(evidence_of("<p>Some other page</p>"), None);
/// ```
pub fn evidence_of(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(START)?;
    let (json, rest) = rest.split_once(END)?;
    (!rest.contains(START)).then_some(json)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_closes_the_element() {
        let json = "{\"name\":\"</script><!--&\u{2028}\u{2029}\\\\\"}";
        let text = escaped(json);
        assert_eq!(text, r#"{"name":"\u003c/script\u003e\u003c!--\u0026\u2028\u2029\\"}"#);
        let page = format!("<p></p>{}<p></p>", element(json).into_string());
        assert_eq!(evidence_of(&page), Some(text.as_str()));
    }

    #[test]
    fn none_or_two_are_no_evidence() {
        let one = element("{}").into_string();
        assert_eq!(evidence_of(&one), Some("{}"));
        assert_eq!(evidence_of(""), None);
        assert_eq!(evidence_of(START), None);
        assert_eq!(evidence_of(&(one.clone() + &one)), None);
    }
}
