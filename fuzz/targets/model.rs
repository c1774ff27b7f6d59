#![no_main]

use libfuzzer_sys::fuzz_target;
use sombrero_tests::hostile::{Target, archived};

// The XML of a 3MF model: an archive's checksum would keep changes from its reader.
fuzz_target!(|bytes: &[u8]| {
    Target::ThreeMf.feed(&archived(bytes));
});
