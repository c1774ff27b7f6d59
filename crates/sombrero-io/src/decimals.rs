//! One number of decimals for all numbers of a kind in a text file, so that no digit tells which of them are new.
//!
//! A number that stays and has fewer decimals than the file is written with would end in zeros, and stand out. Where a
//! [`Filling`] is given it gets digits instead, within what its own last digit was rounded by. Which digit that is, the number does
//! not say where zeros at the end are left out: 1.5 may be 1.50000. Of A_L numbers that were rounded to L decimals, a share of
//! 0.9 · 10^(d-L) shows d of them, or 0.9 all; so A follows from how many numbers show how many decimals, from the most
//! downwards, among numbers of one size, and a number that shows d was rounded to L decimals with a probability proportional to
//! A_L 10^(d-L).

use std::collections::BTreeMap;
use std::io::Write;
use std::ops::Range;

use nalgebra::Point3;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::splice::Splice;
use crate::text;

/// How new coordinates of a text file are spelled.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Decimals {
    /// The shortest number that reads back the same and has no fewer decimals than the one before; what keeps its value
    /// keeps its spelling. The default.
    #[default]
    Exact,
    /// All coordinates with as many decimals as most of them have, or as many more as keep what rounding does to a
    /// vertex below a hundredth of the root mean square displacement.
    Own,
    /// All coordinates with so many.
    Number(u8),
}

/// Where digits come from that numbers are filled up with: equal numbers of a file get equal digits, so that what is in one
/// plane or at one place stays there, and nobody without the seed tells them from digits of a mark.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Filling(pub [u8; 32]);

impl std::fmt::Debug for Filling {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Filling(..)")
    }
}

impl Filling {
    /// Two numbers of 0 to 1 for this value, uniform as seen without the seed.
    fn uniform(&self, value: f64) -> [f64; 2] {
        // Both zeros are one number.
        let bits = (value + 0.0).to_bits().to_le_bytes();
        let hash = Sha256::new().chain_update(self.0).chain_update(bits).finalize();
        [0, 8].map(|at| {
            let mut bytes = [0; 8];
            bytes.copy_from_slice(&hash[at..at + 8]);
            (u64::from_le_bytes(bytes) >> 11) as f64 / (1_u64 << 53) as f64
        })
    }
}

/// What rounding may do, in displacements.
const SHARE: f64 = 0.01;

/// The root mean square of what rounding to whole steps does to a point, in steps: each coordinate is off by 1/√12.
const ROUNDED: f64 = 0.5;

/// Numbers whose own last digit stands for more displacements than this are not filled up: it would be seen.
const FILLED: f64 = 0.6;

/// More decimals than these nobody writes: a double has 17 digits.
const MOST: usize = 20;

/// Numbers that one task spells.
const CHUNK: usize = 1 << 14;

/// Whole numbers of more digits than a double has are spelled exactly.
const HUGE: f64 = 1e16;

/// Where the numbers of a file stand, in order.
#[derive(Debug, Default)]
pub(crate) struct Words {
    /// Coordinates of positions.
    pub(crate) coordinates: Vec<Range<usize>>,
    /// Numbers that follow them, as normals of facets do.
    pub(crate) directions: Vec<Range<usize>>,
}

/// How numbers are spelled: decimals, and the exponent if most have one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spelling {
    decimals: usize,
    exponent: Option<Exponent>,
    fill: Option<Fill>,
}

/// What numbers get in place of zeros.
#[derive(Debug, Clone, PartialEq)]
struct Fill {
    filling: Filling,
    /// The largest unit of a last digit that is filled up below.
    largest: f64,
    rounded: BTreeMap<Size, Counts>,
}

/// The binary and the decimal exponent of a number: programs round to so many bits or digits. Mantissas have neither.
type Size = (i32, i32);

/// That of mantissas.
const MANTISSA: Size = (0, 0);

/// How many numbers have so many decimals.
type Counts = [f64; MOST + 1];

/// `e+00`, `E0` or such.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Exponent {
    letter: u8,
    plus: bool,
    digits: usize,
}

/// What most of some numbers look like.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    plain: BTreeMap<Size, Counts>,
    scientific: BTreeMap<Size, Counts>,
    exponent: Option<Exponent>,
    largest: f64,
}

impl Survey {
    /// Takes note of a number.
    pub(crate) fn add(&mut self, word: &[u8]) {
        let value = text::number(word).unwrap_or(0.0);
        if value.is_finite() {
            self.largest = self.largest.max(value.abs());
        }
        let at = word.iter().position(|byte| matches!(byte, b'e' | b'E'));
        let (mantissa, exponent) = word.split_at(at.unwrap_or(word.len()));
        let decimals = text::decimals(mantissa).min(MOST);
        match exponent {
            [letter, rest @ ..] => {
                let signed = matches!(rest, [b'+' | b'-', ..]);
                let digits = rest.len() - usize::from(signed);
                let plus = rest.first() == Some(&b'+');
                let known = self.exponent.get_or_insert(Exponent { letter: *letter, plus, digits });
                known.plus |= plus;
                known.digits = known.digits.min(digits);
                self.scientific.entry(MANTISSA).or_default()[decimals] += 1.0;
            }
            [] => self.plain.entry(size(value, word)).or_default()[decimals] += 1.0,
        }
    }

    /// What most look like, with more decimals if one step of the last is too much for displacements of `rms`.
    pub(crate) fn spelling(&self, how: Decimals, rms: f64, filling: Option<Filling>) -> Spelling {
        let all = |counts: &BTreeMap<Size, Counts>| counts.values().flatten().sum::<f64>();
        let exponent = self.exponent.filter(|_| all(&self.scientific) > all(&self.plain));
        let by_size = if exponent.is_some() { &self.scientific } else { &self.plain };
        let count = |decimals: usize| by_size.values().map(|counts| counts[decimals]).sum::<f64>();
        // Of equally frequent ones the larger.
        let own = (0..=MOST).max_by(|a, b| count(*a).total_cmp(&count(*b))).unwrap_or(0);
        // A mantissa's last digit counts for as much as the largest number's.
        let mut step = 1.0;
        while exponent.is_some() && step * 10.0 <= self.largest {
            step *= 10.0;
        }
        let mut needed = 0;
        while ROUNDED * step > SHARE * rms && needed < MOST {
            step /= 10.0;
            needed += 1;
        }
        let decimals = match how {
            Decimals::Number(number) => usize::from(number).min(MOST),
            _ => own.max(needed),
        };
        let rounded = || by_size.iter().map(|(size, shown)| (*size, rounded(shown))).collect();
        let fill = filling.map(|filling| Fill { filling, largest: FILLED * rms, rounded: rounded() });
        Spelling { decimals, exponent, fill }
    }
}

/// A: how many numbers were rounded to so many decimals, from how many show how many.
fn rounded(shown: &Counts) -> Counts {
    let (mut left, mut rounded) = (*shown, Counts::default());
    for level in (0..=MOST).rev() {
        rounded[level] = left[level].max(0.0) / 0.9;
        let mut share = 0.09;
        for shown in left[..level].iter_mut().rev() {
            *shown -= share * rounded[level];
            share /= 10.0;
        }
    }
    rounded
}

/// The size of a number without exponent.
fn size(value: f64, word: &[u8]) -> Size {
    (((value.to_bits() >> 52) & 0x7ff) as i32, power(word))
}

/// The power of ten of the first digit of a number without exponent; 0 for zero.
fn power(word: &[u8]) -> i32 {
    let digits = word.iter().filter(|byte| **byte == b'.' || byte.is_ascii_digit());
    let digits: Vec<u8> = digits.copied().skip_while(|digit| *digit == b'0').collect();
    let whole = digits.iter().position(|digit| *digit == b'.').unwrap_or(digits.len());
    if whole > 0 {
        return whole as i32 - 1;
    }
    let zeros = digits.iter().skip(1).position(|digit| *digit != b'0');
    zeros.map_or(0, |zeros| -1 - zeros as i32)
}

/// The power of ten of a number's first digit; 0 for zero.
fn exponent_of(value: f64) -> i32 {
    format!("{value:e}").split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

impl Fill {
    /// The decimals to which a number was rounded that shows so many.
    fn level(&self, size: Size, shown: usize, uniform: f64) -> usize {
        let Some(rounded) = self.rounded.get(&size) else { return shown };
        let share = |level: usize| rounded[level] * 10_f64.powi(shown as i32 - level as i32);
        let mut rest = uniform * (shown..=MOST).map(share).sum::<f64>();
        for level in shown..=MOST {
            rest -= share(level);
            if rest < 0.0 {
                return level;
            }
        }
        shown
    }
}

impl Spelling {
    /// The number at `word`, with digits where it would get zeros.
    fn filled(&self, word: &[u8], value: f64) -> f64 {
        let Some(fill) = &self.fill else { return value };
        let mantissa = word.split(|byte| matches!(byte, b'e' | b'E')).next().unwrap_or_default();
        let shown = text::decimals(mantissa).min(MOST);
        if shown >= self.decimals || (mantissa.len() < word.len()) != self.exponent.is_some() {
            return value;
        }
        let [offset, level] = fill.filling.uniform(value);
        let size = if self.exponent.is_some() { MANTISSA } else { size(value, word) };
        let level = fill.level(size, shown, level) as i32;
        // Decimals of a mantissa count from its first digit on.
        let first = if self.exponent.is_some() { exponent_of(value) } else { 0 };
        let unit = 10_f64.powi(first - level);
        if unit <= fill.largest { value + unit * (offset - 0.5) } else { value }
    }

    /// Appends `value`.
    pub(crate) fn push(&self, out: &mut Vec<u8>, value: f64) {
        let (decimals, exponent) = (self.decimals, self.exponent);
        if !value.is_finite() || (exponent.is_none() && value.abs() >= HUGE) {
            text::push_number(out, value);
            return;
        }
        let Some(Exponent { letter, plus, digits }) = exponent else {
            let written = write!(out, "{value:.decimals$}");
            debug_assert!(written.is_ok(), "a Vec takes all that is written to it");
            return;
        };
        let spelled = format!("{value:.decimals$e}");
        let (mantissa, power) = spelled.split_once('e').unwrap_or((&spelled, "0"));
        out.extend_from_slice(mantissa.as_bytes());
        out.push(letter);
        let size = match power.strip_prefix('-') {
            Some(size) => {
                out.push(b'-');
                size
            }
            None => {
                out.extend(plus.then_some(b'+'));
                power
            }
        };
        out.extend(std::iter::repeat_n(b'0', digits.saturating_sub(size.len())));
        out.extend_from_slice(size.as_bytes());
    }

    /// Whether a number is spelled so already.
    fn has(&self, word: &[u8]) -> bool {
        let Some(value) = text::number(word) else { return true };
        let mut spelled = Vec::new();
        self.push(&mut spelled, value);
        // A sign that says nothing is no digit.
        spelled == word.strip_prefix(b"+").unwrap_or(word)
    }
}

/// The root mean square of displacements, over the points that moved; 0 when none did.
pub(crate) fn rms<'a>(pairs: impl Iterator<Item = (&'a Point3<f64>, &'a Point3<f64>)>) -> f64 {
    let squares = pairs.map(|(p, q)| (q - p).norm_squared()).filter(|square| *square > 0.0);
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), square| (sum + square, count + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}

/// `source`, whose numbers stand at `words`, with all of them spelled alike.
pub(crate) fn respelled(source: &[u8], words: &[(Range<usize>, &Spelling)]) -> Vec<u8> {
    // Each task has what is between its first number and that of the next.
    let firsts = words.chunks(CHUNK).skip(1).map(|part| part[0].0.start);
    let ends: Vec<usize> = firsts.chain([source.len()]).collect();
    let piece = |(k, part): (usize, &[(Range<usize>, &Spelling)])| {
        let start = k.checked_sub(1).map_or(0, |before| ends[before]);
        let mut splice = Splice::of(source, start..ends[k]);
        for (span, spelling) in part {
            let word = source.get(span.clone()).unwrap_or_default();
            // What is no number says nothing of a vertex, and stays.
            let value = text::number(word).filter(|value| value.is_finite());
            if let Some(value) = value.filter(|_| !spelling.has(word)) {
                splice.replace(span.clone(), |out| spelling.push(out, spelling.filled(word, value)));
            }
        }
        splice.finish()
    };
    if words.is_empty() {
        return source.to_vec();
    }
    words.par_chunks(CHUNK).enumerate().map(piece).collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spelling(words: &str, rms: f64) -> Spelling {
        let mut survey = Survey::default();
        words.split(' ').for_each(|word| survey.add(word.as_bytes()));
        survey.spelling(Decimals::Own, rms, None)
    }

    fn spelled(words: &str, rms: f64, value: f64) -> String {
        let mut out = Vec::new();
        spelling(words, rms).push(&mut out, value);
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn most_numbers_of_a_file_say_how() {
        assert_eq!(spelled("0.500000 1.250000 3", 1.0, 1.0 / 3.0), "0.333333");
        assert_eq!(spelled("1 2 3", 1.0, 1.0 / 3.0), "0.33");
        assert_eq!(spelled("0.12 0.25", 0.01, -2.0), "-2.0000");
        assert_eq!(spelled("1.250000e+00 -3.500000E-01", 1.0, 0.0123), "1.230000e-02");
        assert_eq!(spelled("1.5e0 2.5e-7", 1.0, 1234.5), "1.23e3");
        assert_eq!(spelled("1.25 2.5", 1.0, 1e300), "1e300");
    }

    #[test]
    fn rounding_stays_below_a_hundredth() {
        // Half a step is what rounding does to a point.
        assert_eq!(spelling("1.000", 0.05).decimals, 3);
        assert_eq!(spelling("1.000", 0.049).decimals, 4);
        assert_eq!(spelling("1.000", 1e-300).decimals, MOST);
        // The last digit of 250.0 in 2.500e+02 is a tenth.
        assert_eq!(spelling("2.500e+02 1.000e-02", 5.0).decimals, 3);
        assert_eq!(spelling("2.500e+02 1.000e-02", 4.9).decimals, 4);
    }

    /// The words as they are written when the rms displacement is this.
    fn filled(words: &str, rms: f64) -> Vec<String> {
        let mut survey = Survey::default();
        words.split(' ').for_each(|word| survey.add(word.as_bytes()));
        let spelling = survey.spelling(Decimals::Own, rms, Some(Filling([7; 32])));
        let spans = words.split(' ').scan(0, |start, word| {
            let span = *start..*start + word.len();
            *start = span.end + 1;
            Some((span, &spelling))
        });
        let filled = respelled(words.as_bytes(), &spans.collect::<Vec<_>>());
        String::from_utf8(filled).unwrap().split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn numbers_are_filled_up_within_what_they_were_rounded_by() {
        // Two decimals, and a mark that needs four.
        let words = "1.25 -3.50 0.75 1.25 12.00 2.2 7.11 8.64 9.15 4.33 5.91 6.25";
        let new = filled(words, 0.019);
        for (old, new) in words.split(' ').zip(&new) {
            let [x, y] = [old, new].map(|word| word.parse::<f64>().unwrap());
            assert!((x - y).abs() <= 0.0051, "{old} became {new}");
            assert_eq!(text::decimals(new.as_bytes()), 4, "{new}");
        }
        assert_eq!(new[0], new[3]);
        let zeros = new.iter().filter(|word| word.ends_with("00")).count();
        assert!(zeros <= 1, "{new:?}");
    }

    #[test]
    fn zeros_that_were_left_out_are_digits() {
        // Of a hundred numbers with four decimals, ten end in a zero and one in two; ten more had two from the start.
        let mut shown = Counts::default();
        (shown[4], shown[3], shown[2]) = (90.0, 9.0, 9.0 + 0.9);
        let all = rounded(&shown);
        assert!(
            (all[4] - 100.0).abs() < 1e-9 && all[3].abs() < 1e-9 && (all[2] - 10.0).abs() < 1e-9,
            "{all:?}"
        );
        let fill = Fill { filling: Filling([7; 32]), largest: 1.0, rounded: [(MANTISSA, all)].into() };
        assert_eq!(fill.level(MANTISSA, 3, 0.5), 4);
        assert_eq!([0.0, 0.9, 0.92, 0.999].map(|u| fill.level(MANTISSA, 2, u)), [2, 2, 4, 4]);
        // A mark as small as the file's own rounding is not hidden by more than itself.
        assert!(filled("1 2 3 4", 0.1).iter().all(|word| word.ends_with(".000")));
    }

    #[test]
    fn powers_are_read_off_the_digits() {
        let words = ["12.5", "-1.5", "+0.15", "0.0015", "007", "0", "0.000", ".5", "3"];
        assert_eq!(words.map(|word| power(word.as_bytes())), [1, 0, -1, -3, 0, 0, 0, -1, 0]);
        assert_eq!([1.5e-7, 12.0, 0.0].map(exponent_of), [-7, 1, 0]);
    }

    #[test]
    fn what_is_spelled_so_keeps_its_bytes() {
        let source = b"v +0.50 1.25 -0.00 # 7";
        let spelling = spelling("0.50 1.25", 1.0);
        let words = [2..7, 8..12, 13..18].map(|span| (span, &spelling));
        assert_eq!(respelled(source, &words), source);
        let shorter = Spelling { decimals: 1, ..spelling };
        let words = [2..7, 8..12, 13..18].map(|span| (span, &shorter));
        assert_eq!(respelled(source, &words), b"v 0.5 1.2 -0.0 # 7");
    }
}
