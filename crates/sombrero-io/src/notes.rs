//! Sentences about what is unusual in a file.

/// How many stored meshes carry no mark, and which; `None` if there are none.
pub(crate) fn unmarked(count: usize, [one, many]: [&str; 2], which: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("UNMARKED: 1 {one} {which} stays as it is.")),
        _ => Some(format!("UNMARKED: {count} {many} {which} stay as they are.")),
    }
}
