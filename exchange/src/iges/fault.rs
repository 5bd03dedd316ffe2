//! What can be wrong with one entity.

use claymill_nurbs::NurbsError;
use thiserror::Error;

use crate::chart::ChartError;
use crate::trim::TrimError;

use super::directory::kind_name;

/// Why an entity could not be used. `de` is its directory entry's sequence number.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum Fault {
    #[error("DE {de} does not exist or its directory entry is damaged")]
    Missing { de: i64 },
    #[error("the parameter data of DE {de} are missing or break off")]
    Ended { de: i64 },
    #[error("the parameter data of DE {de} are those of another entity")]
    Mixed { de: i64 },
    #[error("parameter {index} of DE {de} is `{found}`, not {wanted}")]
    Value { de: i64, index: usize, found: String, wanted: &'static str },
    #[error("DE {de} is a {}, not {wanted}", kind_name(*kind))]
    Kind { de: i64, kind: i64, wanted: &'static str },
    #[error("{} (DE {de}) is not supported", kind_name(*kind))]
    Unsupported { de: i64, kind: i64 },
    #[error("DE {de} contains itself, or entities are nested too deeply")]
    Nested { de: i64 },
    #[error("DE {de} unfolds to {bytes} bytes: it refers to the same things again and again")]
    TooMuch { de: i64, bytes: u64 },
    #[error("DE {de}: {source}")]
    Nurbs { de: i64, source: NurbsError },
    #[error("DE {de}: {what}")]
    Geometry { de: i64, what: &'static str },
    #[error("{0}")]
    Trim(#[from] TrimError),
    #[error("{0}")]
    Chart(#[from] ChartError),
    #[error("the surface has no area")]
    NoArea,
    #[error("the face is hidden (blanked) in the file")]
    Blanked,
}

impl Fault {
    /// What to do about it.
    pub(crate) fn advice(&self) -> &'static str {
        match self {
            Fault::Missing { .. } | Fault::Ended { .. } | Fault::Mixed { .. } | Fault::Nested { .. } => {
                "The file is damaged or cut short: copy or export it again."
            }
            Fault::Value { .. } | Fault::Kind { .. } => "Export the face again; the file is damaged here.",
            Fault::Unsupported { .. } => {
                "Export with surfaces as B-splines (128), curves as B-splines (126) and trims as 144."
            }
            Fault::Nurbs { .. } | Fault::Geometry { .. } | Fault::TooMuch { .. } => {
                "Rebuild this face in the original system and export again."
            }
            Fault::Trim(_) | Fault::Chart(_) => {
                "Rebuild the trim of this face in the original system and export again."
            }
            Fault::NoArea => "Nothing is lost: delete the degenerate face in the original system.",
            Fault::Blanked => {
                "Make the face visible in the original system and export again if it is to be cut."
            }
        }
    }
}
