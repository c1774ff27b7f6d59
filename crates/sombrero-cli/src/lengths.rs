//! Lengths, areas and volumes, in the unit of the model where its file has one.

use sombrero::fidelity::digits;

/// A length in three digits.
pub(crate) fn length(x: f64, unit: Option<&str>) -> String {
    with_unit(digits(x, 3), unit, "")
}

/// A figure with so many digits and the unit to a power.
pub(crate) fn measure(x: f64, significant: usize, unit: Option<&str>, power: &str) -> String {
    with_unit(digits(x, significant), unit, power)
}

fn with_unit(digits: String, unit: Option<&str>, power: &str) -> String {
    match unit {
        Some(unit) => format!("{digits} {unit}{power}"),
        None => digits,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_follows_its_number() {
        assert_eq!(length(0.000_317_2, Some("mm")), "0.000317 mm");
        assert_eq!(length(12.0, None), "12");
        assert_eq!(measure(1234.5678, 6, Some("m"), "²"), "1234.57 m²");
    }
}
