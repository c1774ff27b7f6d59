//! Numbers as people read them.

use maud::{Markup, html};

/// The first sentence of the page's foot.
pub(super) const FOR_THE_OWNER: &str = "Written for the owner alone: this page is as secret as the key. Do not publish it, and do not hand it to the other side.";

/// Below this log10 p the arithmetic is no longer the weakest link.
pub(super) const BEYOND_CHANCE: f64 = -15.0;

/// Smaller exponents than this say no more; a perfect match would give one of three hundred digits.
const SMALLEST_EXPONENT: f64 = -10_000.0;

/// A number with a typographic minus; a dash for what is no number.
pub(super) fn decimal(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    if value.abs() >= 1e12 {
        return format!("{value:.2e}").replace('-', "−");
    }
    let text = format!("{value:.digits$}");
    // What rounds to zero has no sign.
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if zero { text.replace('-', "") } else { text.replace('-', "−") }
}

/// A share as percent with two significant digits, and more where it is near the whole.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if !value.is_finite() {
        return "–".into();
    }
    let digits = match value.abs() {
        0.0 => 0,
        v if v < 1e-6 => return "less than 0.000001\u{a0}%".into(),
        v if v >= 9.95 => usize::from(v.fract() != 0.0),
        v => (1.0 - v.log10().floor()).max(1.0) as usize,
    };
    format!("{}\u{a0}%", decimal(value, digits))
}

/// 10 to the power of `log10`, to one decimal; whole where it is whole.
pub(super) fn power(log10: f64) -> Markup {
    if log10.is_nan() || log10 < SMALLEST_EXPONENT {
        return html! { "below 10" sup { (decimal(SMALLEST_EXPONENT, 0)) } };
    }
    let whole = (log10 - log10.round()).abs() < 1e-9;
    html! { "10" sup { (decimal(log10, usize::from(!whole))) } }
}

/// A probability: as it is down to a hundredth, then as a power of ten.
pub(super) fn p_value(log10_p: f64) -> Markup {
    if log10_p > -2.0 {
        html! { (decimal(10_f64.powf(log10_p.min(0.0)), 2)) }
    } else {
        power(log10_p)
    }
}

/// The end of the sentence "the chance is …". Large odds are cut, not rounded, lest they promise too much.
pub(super) fn odds(log10_p: f64) -> Markup {
    if log10_p > -2.0 {
        return html! { "about " (decimal(100.0 * 10_f64.powf(log10_p.min(0.0)), 0)) " in 100" };
    }
    if log10_p > -6.0 {
        return html! { "about 1 in " (grouped(10_f64.powf(-log10_p))) };
    }
    // A hair is allowed for a logarithm that is meant to be whole.
    let exponent = (-log10_p.max(SMALLEST_EXPONENT) + 1e-9).floor();
    html! { "less than 1 in 10" sup { (decimal(exponent, 0)) } }
}

/// Two significant digits, thousands set apart.
fn grouped(value: f64) -> String {
    let unit = 10_f64.powf((value.log10() - 1.0).floor().max(0.0));
    in_thousands(&decimal((value / unit).round() * unit, 0))
}

/// How many, thousands set apart.
pub(super) fn count(number: usize) -> String {
    in_thousands(&number.to_string())
}

fn in_thousands(digits: &str) -> String {
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A name and its value, as an entry of a list of pairs.
pub(super) fn pair(name: &str, value: Markup) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals() {
        assert_eq!(decimal(-0.25, 2), "−0.25");
        assert_eq!(decimal(-0.001, 2), "0.00");
        assert_eq!(decimal(f64::NAN, 2), "–");
        assert_eq!(decimal(-1e300, 3), "−1.00e300");
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!([0, 999, 1000, 1_234_567].map(count), ["0", "999", "1,000", "1,234,567"]);
    }

    #[test]
    fn percents_keep_two_digits() {
        let cases = [
            (0.0, "0\u{a0}%"),
            (1.0, "100\u{a0}%"),
            (0.9961, "99.6\u{a0}%"),
            (0.05, "5.0\u{a0}%"),
            (0.001234, "0.12\u{a0}%"),
            (1e-9, "less than 0.000001\u{a0}%"),
            (f64::INFINITY, "–"),
        ];
        for (share, text) in cases {
            assert_eq!(percent(share), text);
        }
    }

    #[test]
    fn powers_of_ten() {
        assert_eq!(power(-6.0).into_string(), "10<sup>−6</sup>");
        assert_eq!(p_value(-16.92).into_string(), "10<sup>−16.9</sup>");
        assert_eq!(p_value(-1.0).into_string(), "0.10");
        for log10 in [f64::NAN, f64::NEG_INFINITY, f64::MIN] {
            assert_eq!(power(log10).into_string(), "below 10<sup>−10000</sup>");
        }
    }

    #[test]
    fn odds_never_promise_too_much() {
        let cases = [
            (0.0, "about 100 in 100"),
            (-0.5, "about 32 in 100"),
            (-3.4, "about 1 in 2,500"),
            (-5.99, "about 1 in 980,000"),
            (-6.0, "less than 1 in 10<sup>6</sup>"),
            (-16.92, "less than 1 in 10<sup>16</sup>"),
            (f64::MIN, "less than 1 in 10<sup>10000</sup>"),
        ];
        for (log10, text) in cases {
            assert_eq!(odds(log10).into_string(), text);
        }
    }
}
