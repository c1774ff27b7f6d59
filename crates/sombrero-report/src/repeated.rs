//! Fields that an object of JSON has twice.
//!
//! RFC 8259 leaves open which of them counts: readers take the last, the first, or neither. Whoever writes a report could so
//! show one figure to one reader and another to the next.

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use std::collections::BTreeSet;
use std::fmt;
use thiserror::Error;

/// A report has a field twice.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the field {field} is there twice, and programs differ in which of them counts; take a report as it was written"
)]
#[non_exhaustive]
pub struct RepeatedField {
    /// Its place, such as `variants[3].log10_p`.
    pub field: String,
}

/// Refuses JSON in which an object, however deep, has a field twice. Of what is no JSON nothing is said.
pub(crate) fn check(json: &str) -> Result<(), RepeatedField> {
    let mut repeated = None;
    let value = Value { place: String::new(), repeated: &mut repeated };
    // An error is that of the field, or of what is no JSON.
    let _ = value.deserialize(&mut serde_json::Deserializer::from_str(json));
    repeated.map_or(Ok(()), |field| Err(RepeatedField { field }))
}

/// Any value, passed over.
struct Value<'a> {
    place: String,
    repeated: &'a mut Option<String>,
}

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<(), A::Error> {
        let Self { place, repeated } = self;
        let mut names = BTreeSet::new();
        while let Some(name) = fields.next_key::<String>()? {
            let place = if place.is_empty() { name.clone() } else { format!("{place}.{name}") };
            if !names.insert(name) {
                *repeated = Some(place);
                return Err(A::Error::custom("a field is there twice"));
            }
            fields.next_value_seed(Value { place, repeated: &mut *repeated })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let Self { place, repeated } = self;
        let mut at = 0;
        while items
            .next_element_seed(Value { place: format!("{place}[{at}]"), repeated: &mut *repeated })?
            .is_some()
        {
            at += 1;
        }
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_found_at_any_depth_however_it_is_spelled() {
        for (json, field) in [
            (r#"{"p":1,"p":1}"#, "p"),
            (r#"{"p":1,"\u0070":2}"#, "p"),
            (r#"{"a":{"b":[0,{"c":null,"d":"","c":true}]}}"#, "a.b[1].c"),
            (r#"[[1],{"x":{},"x":[]}]"#, "[1].x"),
        ] {
            assert_eq!(check(json), Err(RepeatedField { field: field.into() }), "{json}");
        }
    }

    #[test]
    fn the_same_name_elsewhere_is_no_repetition() {
        for json in [r#"{"a":{"a":[{"a":-1},{"a":1.5}]},"b":{"a":18446744073709551615}}"#, "[]", "{", ""] {
            assert_eq!(check(json), Ok(()), "{json}");
        }
    }
}
