#![no_main]

use libfuzzer_sys::fuzz_target;
use sombrero_tests::hostile::Target;

fuzz_target!(|bytes: &[u8]| {
    Target::Ply.feed(bytes);
});
