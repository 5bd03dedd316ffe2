//! Symmetric bodies of which a file holds one half.

use std::fmt;
use std::str::FromStr;

use claymill_nurbs::Model;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a job cuts of a half that its file holds: the image in a plane through the origin, or the half and its image.
///
/// ```text
///      the file          y            y:both
///                   │              │
///      ╭──────      │              ╭──────
///      │            │              │
///    ──┼── y = 0  ──┼── y = 0    ──┼── y = 0
///                   │              │
///                   ╰──────        ╰──────
/// ```
///
/// ```
/// # use claymill_toolpath::Mirror;
/// assert_eq!("y:both".parse(), Ok(Mirror { axis: 1, keeps_model: true }));
/// assert_eq!(Mirror { axis: 0, keeps_model: false }.to_string(), "x");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct Mirror {
    /// The coordinate axis that the plane stands on: 0, 1 or 2 for x, y or z.
    pub axis: usize,
    /// The half in the file is cut too.
    pub keeps_model: bool,
}

/// Text that is not an axis, with or without `:both`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} names no plane to mirror in: x, y or z, or with :both for the half in the file and its image")]
pub struct MirrorError(String);

const AXES: [&str; 3] = ["x", "y", "z"];
const BOTH: &str = "both";

impl Mirror {
    /// What is cut of a model.
    #[must_use]
    pub fn of(self, model: &Model) -> Model {
        match self.keeps_model {
            true => model.with_image(self.axis),
            false => model.mirrored(self.axis),
        }
    }
}

impl fmt::Display for Mirror {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(AXES[self.axis])?;
        if self.keeps_model { write!(f, ":{BOTH}") } else { Ok(()) }
    }
}

impl FromStr for Mirror {
    type Err = MirrorError;

    fn from_str(text: &str) -> Result<Self, MirrorError> {
        let wrong = || MirrorError(text.to_owned());
        let (axis, keeps_model) = match text.trim().split_once(':') {
            None => (text.trim(), false),
            Some((axis, BOTH)) => (axis, true),
            Some(_) => return Err(wrong()),
        };
        let axis = AXES.iter().position(|name| *name == axis).ok_or_else(wrong)?;
        Ok(Mirror { axis, keeps_model })
    }
}

impl TryFrom<String> for Mirror {
    type Error = MirrorError;

    fn try_from(text: String) -> Result<Self, MirrorError> {
        text.parse()
    }
}

impl From<Mirror> for String {
    fn from(mirror: Mirror) -> String {
        mirror.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_that_names_no_plane_is_refused() {
        for text in ["", "w", "y:", "y:half", "y:both:", "-y", "Y"] {
            assert_eq!(text.parse::<Mirror>(), Err(MirrorError(text.to_owned())));
        }
        for text in ["x", "y", "z", "x:both", "z:both"] {
            assert_eq!(text.parse::<Mirror>().unwrap().to_string(), text);
        }
    }
}
