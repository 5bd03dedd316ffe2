//! The largest absolute number of a JSON text, found without keeping anything else. Readers refuse
//! files with implausible numbers by it.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};

/// The largest number of a JSON text by its absolute value, without anything kept of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Largest(pub(crate) f64);

impl<'de> Deserialize<'de> for Largest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Any)
    }
}

struct Any;

impl<'de> Visitor<'de> for Any {
    type Value = Largest;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Largest, E> {
        Ok(Largest(value.abs()))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Largest, E> {
        Ok(Largest(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Largest, E> {
        Ok(Largest((value as f64).abs()))
    }

    fn visit_bool<E>(self, _: bool) -> Result<Largest, E> {
        Ok(Largest(0.0))
    }

    fn visit_str<E>(self, _: &str) -> Result<Largest, E> {
        Ok(Largest(0.0))
    }

    fn visit_unit<E>(self) -> Result<Largest, E> {
        Ok(Largest(0.0))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Largest, A::Error> {
        let mut largest = 0.0;
        while let Some(Largest(item)) = items.next_element()? {
            largest = f64::max(largest, item);
        }
        Ok(Largest(largest))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut items: A) -> Result<Largest, A::Error> {
        let mut largest = 0.0;
        while let Some((_, Largest(item))) = items.next_entry::<serde::de::IgnoredAny, Largest>()? {
            largest = f64::max(largest, item);
        }
        Ok(Largest(largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_wherever_they_are() {
        let largest = |text: &str| serde_json::from_str::<Largest>(text).unwrap().0;
        assert_eq!(largest(r#"{"a":[1,-7.5,{"b":3}],"c":"9","d":null,"e":true}"#), 7.5);
        assert_eq!(largest("[18446744073709551615,-9]"), 18_446_744_073_709_551_615.0);
        assert_eq!(largest("\"text\""), 0.0);
        assert!(serde_json::from_str::<Largest>("[1e999]").is_err());
    }
}
