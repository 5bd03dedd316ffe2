//! Fields of foreign JSON, which may be missing or of another type.

use serde_json::Value;

/// A finite number of an object.
pub(super) fn number(object: &Value, key: &str) -> Option<f64> {
    object.get(key)?.as_f64().filter(|v| v.is_finite())
}

/// A finite number above zero.
pub(super) fn positive(object: &Value, key: &str) -> Option<f64> {
    number(object, key).filter(|v| *v > 0.0)
}

/// A whole number from 1.
pub(super) fn count(object: &Value, key: &str) -> Option<u32> {
    object.get(key)?.as_u64().and_then(|n| u32::try_from(n).ok()).filter(|n| *n > 0)
}

/// A text of an object; empty where there is none.
pub(super) fn text<'v>(object: &'v Value, key: &str) -> &'v str {
    object.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// The entries of a list; none where there is no list.
pub(super) fn list<'v>(object: &'v Value, key: &str) -> &'v [Value] {
    object.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A length as a file has it, without the last bit's noise of a unit's conversion.
pub(super) fn tidy(mm: f64) -> f64 {
    let rounded = (mm * 1e9).round() / 1e9;
    if rounded.is_finite() && (rounded - mm).abs() <= 1e-12 * mm.abs().max(1.0) { rounded } else { mm }
}
