//! One number of decimals for all numbers of a kind in a text file, so that no digit tells which of them are new.

use std::io::Write;
use std::ops::Range;

use nalgebra::Point3;

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

/// What rounding may do, in displacements.
const SHARE: f64 = 0.01;

/// The root mean square of what rounding to whole steps does to a point, in steps: each coordinate is off by 1/√12.
const ROUNDED: f64 = 0.5;

/// More decimals than these nobody writes: a double has 17 digits.
const MOST: usize = 20;

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Spelling {
    decimals: usize,
    exponent: Option<Exponent>,
}

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
    plain: [usize; MOST + 1],
    scientific: [usize; MOST + 1],
    exponent: Option<Exponent>,
    largest: f64,
}

impl Survey {
    /// Takes note of a number.
    pub(crate) fn add(&mut self, word: &[u8]) {
        if let Some(value) = text::number(word).filter(|value| value.is_finite()) {
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
                count(&mut self.scientific, decimals);
            }
            [] => count(&mut self.plain, decimals),
        }
    }

    /// What most look like, with more decimals if one step of the last is too much for displacements of `rms`.
    pub(crate) fn spelling(&self, how: Decimals, rms: f64) -> Spelling {
        let all = |counts: &[usize]| counts.iter().sum::<usize>();
        let exponent = self.exponent.filter(|_| all(&self.scientific) > all(&self.plain));
        let counts = if exponent.is_some() { &self.scientific } else { &self.plain };
        // Of equally frequent ones the larger.
        let own = (0..=MOST).max_by_key(|decimals| counts.get(*decimals)).unwrap_or(0);
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
        Spelling { decimals, exponent }
    }
}

fn count(counts: &mut [usize], decimals: usize) {
    if let Some(count) = counts.get_mut(decimals) {
        *count += 1;
    }
}

impl Spelling {
    /// Appends `value`.
    pub(crate) fn push(&self, out: &mut Vec<u8>, value: f64) {
        let Self { decimals, exponent } = *self;
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
pub(crate) fn respelled(source: &[u8], words: &[(Range<usize>, Spelling)]) -> Vec<u8> {
    let mut splice = Splice::new(source);
    for (span, spelling) in words {
        let word = source.get(span.clone()).unwrap_or_default();
        // What is no number says nothing of a vertex, and stays.
        let value = text::number(word).filter(|value| value.is_finite());
        if let Some(value) = value.filter(|_| !spelling.has(word)) {
            splice.replace(span.clone(), |out| spelling.push(out, value));
        }
    }
    splice.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spelling(words: &str, rms: f64) -> Spelling {
        let mut survey = Survey::default();
        words.split(' ').for_each(|word| survey.add(word.as_bytes()));
        survey.spelling(Decimals::Own, rms)
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

    #[test]
    fn what_is_spelled_so_keeps_its_bytes() {
        let source = b"v +0.50 1.25 -0.00 # 7";
        let spelling = spelling("0.50 1.25", 1.0);
        let words = [2..7, 8..12, 13..18].map(|span| (span, spelling));
        assert_eq!(respelled(source, &words), source);
        let words = [2..7, 8..12, 13..18].map(|span| (span, Spelling { decimals: 1, ..spelling }));
        assert_eq!(respelled(source, &words), b"v 0.5 1.2 -0.0 # 7");
    }
}
