//! The directory section: one entry of two cards for each entity.

use super::tokens;

/// What the reader needs of a directory entry.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Entry {
    /// Entity type number.
    pub(crate) kind: i64,
    /// Sequence number of the first parameter card.
    pub(crate) data: usize,
    /// Level, or minus the pointer to a list of levels.
    pub(crate) level: i64,
    /// Pointer to a transformation matrix; 0 for none.
    pub(crate) matrix: i64,
    /// Hidden by the sender.
    pub(crate) blanked: bool,
    /// Use: 0 geometry, 5 two-dimensional, 6 construction, others annotation and definitions.
    pub(crate) role: u8,
    /// Colour number, or minus the pointer to a colour definition.
    pub(crate) colour: i64,
    /// Form number.
    pub(crate) form: i64,
    /// Label, with its subscript.
    pub(crate) label: String,
}

impl Entry {
    /// Reads the entry; `None` when a card is lost or the type is not a number.
    pub(crate) fn new([first, second]: &[Vec<u8>; 2]) -> Option<Self> {
        if first.is_empty() || second.is_empty() {
            return None;
        }
        let field = |card: &[u8], number: usize| -> Option<i64> {
            let columns = card.get((number - 1) * 8..(number * 8).min(card.len()));
            tokens::integer(columns.unwrap_or(b"").trim_ascii())
        };
        let status = first.get(64..).unwrap_or(b"");
        let digit = |at: usize| status.get(at).filter(|b| b.is_ascii_digit()).map_or(0, |b| b - b'0');
        let label = String::from_utf8_lossy(second.get(56..64.min(second.len())).unwrap_or(b""));
        let subscript = field(second, 9).filter(|n| *n > 0);
        let label = match (label.trim(), subscript) {
            ("", _) => String::new(),
            (label, Some(n)) => format!("{label}({n})"),
            (label, None) => label.to_owned(),
        };
        Some(Entry {
            kind: field(first, 1)?,
            data: usize::try_from(field(first, 2)?).ok()?,
            level: field(first, 5).unwrap_or(0),
            matrix: field(first, 7).unwrap_or(0),
            blanked: digit(0) * 10 + digit(1) == 1,
            role: digit(4) * 10 + digit(5),
            colour: field(second, 3).unwrap_or(0),
            form: field(second, 5).unwrap_or(0),
            label,
        })
    }
}

/// The name of an entity type, with its number.
pub(crate) fn kind_name(kind: i64) -> String {
    let name = match kind {
        100 => "circular arc",
        102 => "composite curve",
        104 => "conic arc",
        106 => "copious data",
        108 => "plane",
        110 => "line",
        112 => "parametric spline curve",
        114 => "parametric spline surface",
        116 => "point",
        118 => "ruled surface",
        120 => "surface of revolution",
        122 => "tabulated cylinder",
        123 => "direction",
        124 => "transformation matrix",
        126 => "B-spline curve",
        128 => "B-spline surface",
        130 => "offset curve",
        140 => "offset surface",
        141 => "boundary",
        142 => "curve on surface",
        143 => "bounded surface",
        144 => "trimmed surface",
        186 => "solid B-rep",
        190 => "plane surface",
        192 => "cylindrical surface",
        194 => "conical surface",
        196 => "spherical surface",
        198 => "toroidal surface",
        202..=230 => "annotation",
        308 => "subfigure definition",
        314 => "colour definition",
        402 => "group",
        404 => "drawing",
        406 => "property",
        408 => "subfigure instance",
        410 => "view",
        502 => "vertex list",
        504 => "edge list",
        508 => "loop",
        510 => "face",
        514 => "shell",
        _ => "entity",
    };
    format!("{kind} {name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_an_entry() {
        let first = b"     144      17       0       1      12       0      41       000010501".to_vec();
        let second = b"     144       0     -33       1       0                    Roof       7".to_vec();
        let entry = Entry::new(&[first, second]).unwrap();
        assert_eq!((entry.kind, entry.data, entry.level, entry.matrix), (144, 17, 12, 41));
        assert!(!entry.blanked && entry.role == 5);
        assert_eq!((entry.colour, entry.label.as_str()), (-33, "Roof(7)"));
        assert_eq!(Entry::new(&[b"     128".to_vec(), Vec::new()]), None);
    }
}
