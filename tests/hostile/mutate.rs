//! Valid files made invalid, as random changes, transmission errors and attackers would.

use rand::{Rng, RngExt};

/// Files stay below this.
const LARGEST: usize = 1 << 20;

/// Words that text readers find hard.
const WORDS: &[&[u8]] = &[
    b"4294967296",
    b"-1",
    b"0",
    b"1e999",
    b"-1e-320",
    b"nan",
    b"1.5",
    b"18446744073709551616",
    b"9223372036854775807",
    b"2147483648",
    b"",
    b"\"",
    b"\\\n",
    b"{",
    b"[",
    b"null",
    b"true",
    b"\xff\xfe",
    b"#",
];

/// Numbers that binary readers find hard.
const NUMBERS: [u32; 10] =
    [0, 1, 3, 0x7f, 0xff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x7f80_0000, 0x7fc0_0000];

/// `valid` after one to four changes; `other` lends pieces.
pub fn mutated<R: Rng + ?Sized>(valid: &[u8], other: &[u8], rng: &mut R) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    // Mostly one: what is hardly wrong gets furthest.
    for _ in 0..=rng.random_range(0..8_u32).saturating_sub(4) {
        change(&mut bytes, other, rng);
    }
    bytes.truncate(LARGEST);
    bytes
}

fn change<R: Rng + ?Sized>(bytes: &mut Vec<u8>, other: &[u8], rng: &mut R) {
    if bytes.is_empty() {
        bytes.extend_from_slice(other);
        return;
    }
    let at = rng.random_range(0..bytes.len());
    let to = (at + 1 + rng.random_range(0..40_usize)).min(bytes.len());
    match rng.random_range(0..12_u32) {
        0 => bytes[at] ^= 1 << rng.random_range(0..8_u32),
        1 => bytes[at] = rng.random(),
        2 => number(bytes, at, rng),
        3 => drop(bytes.drain(at..to)),
        4 => bytes.truncate(at),
        5 => repeat(bytes, at, to, rng),
        6 => insert(bytes, at, &piece(other, rng)),
        7 => insert(bytes, at, WORDS[rng.random_range(0..WORDS.len())]),
        8 | 9 => word(bytes, at, WORDS[rng.random_range(0..WORDS.len())]),
        10 => word(bytes, at, &piece(other, rng)),
        _ => swap(bytes, at, rng),
    }
}

/// A number of four bytes written over those at `at`, as often as not on a multiple of four.
fn number<R: Rng + ?Sized>(bytes: &mut [u8], at: usize, rng: &mut R) {
    let at = if rng.random() { at & !3 } else { at };
    let value = NUMBERS[rng.random_range(0..NUMBERS.len())];
    let spelled = if rng.random() { value.to_le_bytes() } else { value.to_be_bytes() };
    bytes[at..].iter_mut().zip(spelled).for_each(|(byte, new)| *byte = new);
}

fn piece<R: Rng + ?Sized>(other: &[u8], rng: &mut R) -> Vec<u8> {
    let from = rng.random_range(0..=other.len());
    other[from..].iter().take(rng.random_range(0..60)).copied().collect()
}

fn insert(bytes: &mut Vec<u8>, at: usize, new: &[u8]) {
    bytes.splice(at..at, new.iter().copied());
}

/// The word around `at` replaced: what stands between spaces, commas, quotes or brackets.
fn word(bytes: &mut Vec<u8>, at: usize, new: &[u8]) {
    let splits = |b: &u8| b.is_ascii_whitespace() || b",:\"'[]{}<>=/".contains(b);
    let from = bytes[..at].iter().rposition(splits).map_or(0, |i| i + 1);
    let to = bytes[at..].iter().position(splits).map_or(bytes.len(), |i| at + i);
    bytes.splice(from..to.max(from), new.iter().copied());
}

/// A piece many times over.
fn repeat<R: Rng + ?Sized>(bytes: &mut Vec<u8>, from: usize, to: usize, rng: &mut R) {
    let piece = bytes[from..to].to_vec();
    let most = if rng.random_range(0..200_u32) == 0 { 20_000 } else { 20 };
    let copies = piece.repeat(rng.random_range(1..=most));
    insert(bytes, from, &copies[..copies.len().min(LARGEST)]);
}

/// Two lines, or what is between two line ends, change places.
fn swap<R: Rng + ?Sized>(bytes: &mut Vec<u8>, at: usize, rng: &mut R) {
    let mut lines: Vec<&[u8]> = bytes.split_inclusive(|&b| b == b'\n' || b == b',').collect();
    let (i, j) = (at % lines.len(), rng.random_range(0..lines.len()));
    lines.swap(i, j);
    *bytes = lines.concat();
}
