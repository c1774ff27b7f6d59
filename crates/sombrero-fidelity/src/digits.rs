//! Figures in digits that people read.

/// `x` rounded to so many significant digits, without an exponent where a few zeros do.
///
/// ```
/// use sombrero_fidelity::digits;
///
/// assert_eq!(digits(0.40566854, 3), "0.406");
/// assert_eq!(digits(134761.4, 6), "134761");
/// assert_eq!(digits(0.00012345, 2), "0.00012");
/// assert_eq!(digits(3.0e-12, 3), "3e-12");
/// ```
pub fn digits(x: f64, significant: usize) -> String {
    let behind_point = significant.saturating_sub(1);
    let rounded: f64 = format!("{x:.behind_point$e}").parse().unwrap_or(x);
    let is_readable = rounded == 0.0 || (1e-5..1e10).contains(&rounded.abs());
    // Minus nothing is nothing to people.
    if is_readable { format!("{}", rounded + 0.0) } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_for_what_has_no_other_name() {
        for (x, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (-12.3456, "-12.3"),
            (999.96, "1000"),
            (0.000_012_34, "0.0000123"),
            (1.234e-6, "1.23e-6"),
            (1.234e12, "1.23e12"),
            (9_876_543.0, "9880000"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(digits(x, 3), text);
        }
    }
}
