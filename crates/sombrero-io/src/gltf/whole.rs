//! Whole numbers of the JSON, which some exporters write as floats: `36.0`.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Unexpected, Visitor};

/// A whole number, however it is spelled.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whole(u64);

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_u64(WholeVisitor)
    }
}

struct WholeVisitor;

impl Visitor<'_> for WholeVisitor {
    type Value = Whole;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a whole number that is not negative")
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Whole, E> {
        Ok(Whole(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Whole, E> {
        u64::try_from(value).map(Whole).map_err(|_| E::invalid_value(Unexpected::Signed(value), &self))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Whole, E> {
        /// Beyond this a float is no longer next to every whole number.
        const MOST: f64 = 9_007_199_254_740_992.0;
        if value.fract() == 0.0 && (0.0..=MOST).contains(&value) {
            Ok(Whole(value as u64))
        } else {
            Err(E::invalid_value(Unexpected::Float(value), &self))
        }
    }
}

impl Whole {
    /// The number, if the type can hold it.
    pub(super) fn fit<T: TryFrom<u64>, E: Error>(self) -> Result<T, E> {
        T::try_from(self.0).map_err(|_| E::invalid_value(Unexpected::Unsigned(self.0), &WholeVisitor))
    }
}

/// Reads a field.
pub(super) fn whole<'de, T: TryFrom<u64>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    Whole::deserialize(deserializer)?.fit()
}

/// Reads a field that may be missing or `null`.
pub(super) fn maybe_whole<'de, T: TryFrom<u64>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    Option::<Whole>::deserialize(deserializer)?.map(Whole::fit).transpose()
}

/// Reads a list.
pub(super) fn all_whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u32>, D::Error> {
    deserializer.deserialize_seq(ListVisitor)
}

/// Lists of numbers without a second copy of them.
struct ListVisitor;

impl<'de> Visitor<'de> for ListVisitor {
    type Value = Vec<u32>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of whole numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<u32>, A::Error> {
        let mut all = Vec::new();
        while let Some(number) = list.next_element::<Whole>()? {
            all.push(number.fit()?);
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_without_a_fraction_are_whole() {
        for (text, number) in
            [("36", 36), ("36.0", 36), ("3.6e1", 36), ("0.0", 0), ("-0.0", 0), ("4294967295.0", u32::MAX)]
        {
            assert_eq!(
                serde_json::from_str::<Whole>(text).unwrap().fit::<u32, serde_json::Error>().unwrap(),
                number
            );
        }
        for text in ["36.5", "-1", "-1.0", "1e300", "\"36\"", "true", "[]"] {
            assert!(serde_json::from_str::<Whole>(text).is_err(), "{text}");
        }
        let large = serde_json::from_str::<Whole>("4294967296.0").unwrap();
        assert!(large.fit::<u32, serde_json::Error>().is_err());
    }
}
