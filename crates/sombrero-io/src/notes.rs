//! Sentences about what is unusual in a file.

/// How many stored meshes are left alone, and which; `None` if there are none.
pub(crate) fn stays(count: usize, [one, many]: [&str; 2], which: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("1 {one} {which} stays as it is.")),
        _ => Some(format!("{count} {many} {which} stay as they are.")),
    }
}
