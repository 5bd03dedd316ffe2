//! Many numbers as one string of bytes: number by number their form in a store would be larger, and slow to read.

use std::fmt;

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Numbers, bit for bit.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Packed(Vec<u8>);

impl Packed {
    /// Packs numbers.
    #[must_use]
    pub fn doubles(numbers: impl IntoIterator<Item = f64>) -> Self {
        Packed(numbers.into_iter().flat_map(f64::to_le_bytes).collect())
    }

    /// Packs numbers of single precision.
    #[must_use]
    pub fn singles(numbers: impl IntoIterator<Item = f32>) -> Self {
        Packed(numbers.into_iter().flat_map(f32::to_le_bytes).collect())
    }

    /// Bytes as they are.
    #[must_use]
    pub fn of_bytes(bytes: Vec<u8>) -> Self {
        Packed(bytes)
    }

    /// What was packed, as bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }

    /// Rows of so many numbers that were packed; what is left over at the end is no row.
    pub fn rows_of_doubles<const N: usize>(&self) -> impl Iterator<Item = [f64; N]> {
        let number = |at: usize| f64::from_le_bytes(self.word(at));
        (0..self.0.len() / (8 * N)).map(move |row| std::array::from_fn(|k| number(8 * (N * row + k))))
    }

    /// Rows of so many numbers of single precision that were packed.
    pub fn rows_of_singles<const N: usize>(&self) -> impl Iterator<Item = [f32; N]> {
        let number = |at: usize| f32::from_le_bytes(self.word(at));
        (0..self.0.len() / (4 * N)).map(move |row| std::array::from_fn(|k| number(4 * (N * row + k))))
    }

    fn word<const N: usize>(&self, at: usize) -> [u8; N] {
        std::array::from_fn(|k| self.0[at + k])
    }
}

impl Serialize for Packed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for Packed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_byte_buf(Bytes).map(Packed)
    }
}

/// Takes a string of bytes, borrowed or not.
struct Bytes;

impl<'de> Visitor<'de> for Bytes {
    type Value = Vec<u8>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("bytes")
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Vec<u8>, E> {
        Ok(bytes.to_vec())
    }

    fn visit_byte_buf<E: Error>(self, bytes: Vec<u8>) -> Result<Vec<u8>, E> {
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_bit_for_bit() {
        let doubles = [0.1, -0.0, f64::MIN_POSITIVE / 3.0, 1e300, f64::INFINITY, 7.0];
        let singles = [0.1_f32, -0.0, f32::MIN_POSITIVE / 3.0, 1e30];
        let all = (Packed::doubles(doubles), Packed::singles(singles));
        let mut bytes = Vec::new();
        ciborium::into_writer(&all, &mut bytes).unwrap();
        assert!(bytes.len() < 8 * 6 + 4 * 4 + 8);
        let (back, back_singles): (Packed, Packed) = ciborium::from_reader(&*bytes).unwrap();
        let rows: Vec<[f64; 3]> = back.rows_of_doubles().collect();
        let bits_of_doubles = |numbers: &[f64]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits_of_doubles(&rows.concat()), bits_of_doubles(&doubles));
        let rows: Vec<[f32; 2]> = back_singles.rows_of_singles().collect();
        let bits = |numbers: &[f32]| numbers.iter().map(|n| n.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&rows.concat()), bits(&singles));
        // A row that was cut off is none.
        assert_eq!(back.rows_of_doubles::<4>().count(), 1);
    }
}
