//! What can be wrong with one object.

use claymill_nurbs::NurbsError;
use thiserror::Error;

use crate::trim::TrimError;

/// Why an object or one of its faces could not be used. Positions are byte offsets in the file.
#[derive(Debug, Clone, PartialEq, Error)]
pub(super) enum Fault {
    #[error("the data break off at byte {at}")]
    Ended { at: usize },
    #[error("the data at byte {at} do not match their checksum")]
    Checksum { at: usize },
    #[error("byte {at} holds {found}, not {wanted}")]
    Found { at: usize, found: String, wanted: &'static str },
    #[error("version {version} of {what} is not known")]
    Version { what: &'static str, version: u8 },
    #[error("a {0} has no surfaces that could be read")]
    Unsupported(&'static str),
    #[error("{what} {index} does not exist")]
    Missing { what: &'static str, index: i64 },
    #[error("{0}")]
    Geometry(&'static str),
    #[error("curves are nested too deeply")]
    Nested,
    #[error("{0}")]
    Nurbs(#[from] NurbsError),
    #[error("{0}")]
    Trim(#[from] TrimError),
    #[error("the surface has no area")]
    NoArea,
    #[error("the object is hidden in the file")]
    Hidden,
    #[error("the object's layer ({0}) is hidden in the file")]
    LayerHidden(String),
    #[error("the object belongs to a page layout, not to the model")]
    Layout,
    #[error("the block `{0}` lies in another file")]
    Linked(String),
    #[error("the block that is placed here is not in the file")]
    NoBlock,
    #[error("blocks are nested too deeply or contain themselves")]
    NestedBlocks,
    #[error("the placement of the block is not an affine map")]
    Placement,
    #[error("the file unfolds to more geometry than its size allows")]
    TooMuch,
}

impl Fault {
    /// What to do about it.
    pub(super) fn advice(&self) -> &'static str {
        match self {
            Fault::Ended { .. } | Fault::Checksum { .. } | Fault::Found { .. } | Fault::Missing { .. } => {
                "The file is damaged: copy it or save it again."
            }
            Fault::Version { .. } | Fault::Nested => {
                "Open the file in Rhino and save it again, as version 5 to 8."
            }
            Fault::Unsupported(_) => {
                "Convert it to surfaces in Rhino (ToNURBS, MeshToNURB) if it is to be cut, and save again."
            }
            Fault::Geometry(_) | Fault::Nurbs(_) => "Rebuild this face in Rhino and save again.",
            Fault::Trim(_) => "Rebuild the trim of this face in Rhino (Untrim, Trim) and save again.",
            Fault::NoArea => "Nothing is lost: delete the degenerate face in Rhino.",
            Fault::Hidden | Fault::LayerHidden(_) => "Show it in Rhino and save again if it is to be cut.",
            Fault::Layout => "Move the object to model space if it is to be cut.",
            Fault::Linked(_) => "Embed the block in the file (BlockManager, Embedded) and save again.",
            Fault::NoBlock | Fault::NestedBlocks | Fault::Placement | Fault::TooMuch => {
                "Explode the block in Rhino (ExplodeBlock) and save again."
            }
        }
    }
}
