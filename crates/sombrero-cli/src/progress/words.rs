//! Stages, names and times as somebody reads them who waits.

use std::time::Duration;

pub(super) fn left(time: Duration) -> String {
    format!("{} left", duration(time))
}

/// As precise as somebody who waits wants it.
pub(super) fn duration(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        _ if seconds < 9.95 => format!("{seconds:.1} s"),
        _ if seconds < 99.5 => format!("{seconds:.0} s"),
        _ if seconds < 5970.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.0} h {:.0} min", (seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor()),
    }
}

/// Without the middle, if the numbers would not fit into 80 columns any more.
pub(super) fn short(what: &str) -> String {
    let letters: Vec<char> = what.chars().collect();
    match letters.len() {
        0..=28 => what.to_owned(),
        count => letters[..12].iter().chain(&['…']).chain(&letters[count - 15..]).collect(),
    }
}

/// A stage in words that say something to whoever has not read the paper.
pub(super) fn words(stage: &str) -> &str {
    match stage {
        "weld" => "joining vertices",
        "repair" => "repairing the mesh",
        "conversion" => "building the progressive mesh",
        "basis" => "computing the basis",
        "insert" => "moving vertices",
        "read back" => "reading the copy back",
        "test" => "testing the mark",
        "preparation" => "preparing the original",
        "matching" => "matching the connectivity",
        "registration" => "aligning",
        "mirror image" => "aligning the mirror image",
        "extraction" => "reading the mark",
        "resampling" => "resampling",
        "tests" => "testing",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_lose_their_middle() {
        assert_eq!(short("marking vase.obj"), "marking vase.obj");
        assert_eq!(short("looking at /home/müller/scans/2026/june/vase.obj"), "looking at /…6/june/vase.obj");
    }

    #[test]
    fn durations_are_rounded() {
        let shown = |seconds| duration(Duration::from_secs_f64(seconds));
        assert_eq!([0.04, 9.94, 9.96, 99.4, 99.6].map(shown), ["0.0 s", "9.9 s", "10 s", "99 s", "2 min"]);
        assert_eq!([3600.0, 7260.0].map(shown), ["60 min", "2 h 1 min"]);
    }
}
