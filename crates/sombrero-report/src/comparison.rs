//! Records value by value, and pages sign by sign.

use serde::Serialize;
use serde_json::Value;

/// A value that is another one now.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Difference {
    /// Its place, such as `variants[3].log10_p`, or `page, line 1, below “Files”`.
    pub field: String,
    /// The value that the report has.
    pub recorded: Value,
    /// The value that was found.
    pub found: Value,
}

/// Every value of either side, to the last digit; gives the number of them.
pub(crate) fn compare(
    field: &str,
    recorded: &Value,
    found: &Value,
    differences: &mut Vec<Difference>,
) -> usize {
    let inner = |key: &str| if field.is_empty() { key.to_owned() } else { format!("{field}.{key}") };
    match (recorded, found) {
        (Value::Object(a), Value::Object(b)) => {
            let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
            keys.sort();
            keys.dedup();
            keys.into_iter().map(|k| compare(&inner(k), &recorded[k], &found[k], differences)).sum()
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let pairs = a.iter().zip(b).enumerate();
            pairs.map(|(i, (a, b))| compare(&format!("{field}[{i}]"), a, b, differences)).sum()
        }
        _ => {
            if recorded != found {
                let (recorded, found) = (recorded.clone(), found.clone());
                differences.push(Difference { field: field.to_owned(), recorded, found });
            }
            1
        }
    }
}

/// The number of signs of an excerpt, and of those before the difference.
const SHOWN: (usize, usize) = (72, 24);

/// The first place where a page is not as it was made; `None` when both are the same bytes.
pub(crate) fn compare_pages(recorded: &str, found: &str) -> Option<Difference> {
    if recorded == found {
        return None;
    }
    let mut at = recorded.bytes().zip(found.bytes()).take_while(|(a, b)| a == b).count();
    while !(recorded.is_char_boundary(at) && found.is_char_boundary(at)) {
        at -= 1;
    }
    let before = &found[..at];
    let start = before.char_indices().rev().nth(SHOWN.1 - 1).map_or(0, |(place, _)| place);
    let line = before.matches('\n').count() + 1;
    Some(Difference {
        field: format!("page, line {line}, {}", place(before)),
        recorded: excerpt(&recorded[start..]).into(),
        found: excerpt(&found[start..]).into(),
    })
}

/// The place at the end of a piece of a page that begins with it: what it is in, and the nearest heading above. All its
/// words are ours, since the page was the same so far.
fn place(before: &str) -> String {
    let inside = |start: &str, end: &str| {
        before.rfind(start).is_some_and(|place| before.rfind(end).is_none_or(|ended| ended < place))
    };
    let after = |start: &str| before.rsplit_once(start).is_none_or(|(_, rest)| rest.contains('"'));
    if inside("<script", "</script>") {
        let id = before.rsplit_once("<script").map_or("", |(_, rest)| rest);
        let evidence = id.contains("id=\"sombrero-evidence\"");
        return if evidence { "in the record" } else { "in the script or its scene" }.to_owned();
    }
    if inside("<style", "</style>") {
        return "in the style".to_owned();
    }
    let part = if after("data:image/png;base64,") { "" } else { "in a picture " };
    match heading(before) {
        Some(heading) => format!("{part}below “{heading}”"),
        None => format!("{part}above the first heading"),
    }
}

/// The text of the last heading.
fn heading(before: &str) -> Option<&str> {
    let (end, level) = ["h1", "h2", "h3"]
        .into_iter()
        .filter_map(|level| before.rfind(&format!("</{level}>")).map(|end| (end, level)))
        .max()?;
    let (_, text) = before[..end].rsplit_once(&format!("<{level}>"))?;
    Some(text)
}

/// The beginning of a text, with signs that cannot be seen written out.
fn excerpt(text: &str) -> String {
    let hidden = |c: char| {
        c.is_control()
            || matches!(c, '\u{ad}' | '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    let signs = text.chars().take(SHOWN.0);
    signs.map(|c| if hidden(c) { c.escape_unicode().to_string() } else { c.to_string() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::json;

    #[test]
    fn every_value_is_compared_and_the_place_named() {
        let recorded = json!({ "p": 1e-9, "variants": [{ "p": 1 }, { "p": 2, "x": 0 }], "gone": null });
        let found = json!({ "p": 1e-9, "variants": [{ "p": 1 }, { "p": 3 }], "new": true });
        let mut differences = Vec::new();
        assert_eq!(compare("", &recorded, &found, &mut differences), 6);
        let fields: Vec<&str> = differences.iter().map(|d| d.field.as_str()).collect();
        assert_eq!(fields, ["new", "variants[1].p", "variants[1].x"]);
        assert_eq!((&differences[1].recorded, &differences[1].found), (&json!(2), &json!(3)));
    }

    #[test]
    fn the_place_in_a_page_is_named() {
        let page = "<style>a</style><p>0</p><h1>One</h1>\n<p>word</p><h2>Two</h2><img src=\"data:image/png;base64,AAAA\"><p>end</p>\
                    <script id=\"sombrero-evidence\">{}</script><script>run()</script>";
        let cases = [
            ("a</style>", "b</style>", "page, line 1, in the style"),
            ("<p>0", "<p>7", "page, line 1, above the first heading"),
            ("word", "sword", "page, line 2, below “One”"),
            ("base64,AAAA", "base64,ABAA", "page, line 2, in a picture below “Two”"),
            ("end</p>", "</p>", "page, line 2, below “Two”"),
            ("{}", "{ }", "page, line 2, in the record"),
            ("run()", "ran()", "page, line 2, in the script or its scene"),
        ];
        for (old, new, place) in cases {
            let difference = compare_pages(&page.replacen(old, new, 1), page).unwrap();
            assert_eq!(difference.field, place, "{new}");
        }
        assert_eq!(compare_pages(page, page), None);
    }

    #[test]
    fn signs_that_cannot_be_seen_are_written_out() {
        let difference = compare_pages("naïve \u{202e}\u{1b}[2K", "naïve word").unwrap();
        assert_eq!(difference.recorded, json!("naïve \\u{202e}\\u{1b}[2K"));
        assert_eq!(difference.found, json!("naïve word"));
    }

    proptest! {
        /// No page is taken for another, and none makes it stumble.
        #[test]
        fn only_equal_pages_are_equal(a in "[<h1>é\u{2028}\"a-c]{0,40}", b in "[<h1>é\u{2028}\"a-c]{0,40}") {
            prop_assert_eq!(compare_pages(&a, &b).is_none(), a == b);
        }
    }
}
