//! The faces of a part: solids and sets of surfaces hold shells, and these hold faces.

use std::collections::BTreeSet;

use super::bare;
use super::part21::{Part21, name_length};

/// Solids hold shells hold faces: nesting of containers.
const DEEPEST: usize = 8;

/// A face of a part.
#[derive(Debug, Clone)]
pub(super) struct OwnFace {
    pub(super) id: u64,
    /// The containers of the face, outermost first, and the face itself.
    pub(super) owners: Vec<u64>,
    /// Turned over by ORIENTED_FACE.
    pub(super) reversed: bool,
    /// Not a face of the file but a surface of a geometric set.
    pub(super) bare: bool,
    /// Index of the context of its representation.
    pub(super) context: usize,
}

/// Where a face should be and is none.
#[derive(Debug, Clone)]
pub(super) struct Lost {
    /// What is referred to.
    pub(super) id: u64,
    /// The shell that does.
    pub(super) shell: u64,
}

/// What the items of a part's representations hold.
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub(super) faces: Vec<OwnFace>,
    pub(super) lost: Vec<Lost>,
    /// How often something was listed that had been listed before, and the first of it.
    pub(super) repeated: (usize, u64),
    /// Faces and containers that were come by, and which way round.
    seen: BTreeSet<(u64, bool)>,
}

impl Contents {
    /// Adds the faces of a solid, shell or face.
    pub(super) fn add(&mut self, file: &Part21, item: u64, context: usize) {
        self.collect(file, item, context, &mut Vec::new(), false);
    }

    fn collect(&mut self, file: &Part21, id: u64, context: usize, owners: &mut Vec<u64>, reversed: bool) {
        if owners.len() >= DEEPEST {
            return;
        }
        let text = file.text(id);
        let name = &text[..name_length(text)];
        let is_container = is_container(name);
        let is_face = matches!(name, b"ADVANCED_FACE" | b"FACE_SURFACE");
        let bare = !is_face && !is_container && bare::is_surface(text);
        if !is_face && !is_container && !bare {
            if let Some(shell) = owners.last().filter(|shell| holds_faces_alone(file.text(**shell))) {
                self.lost.push(Lost { id, shell: *shell });
            }
            return;
        }
        // Read once, however often it is listed.
        if !self.seen.insert((id, reversed)) {
            let (count, first) = self.repeated;
            self.repeated = (count + 1, if count == 0 { id } else { first });
            return;
        }
        owners.push(id);
        if is_container {
            if let Ok(entity) = file.get(id) {
                let turned =
                    name.starts_with(b"ORIENTED_") && entity.only().and_then(|r| r.flag(3)) == Ok(false);
                for item in entity.references() {
                    self.collect(file, item, context, owners, reversed != turned);
                }
            }
        } else {
            let reversed = reversed && !bare;
            self.faces.push(OwnFace { id, owners: owners.clone(), reversed, bare, context });
        }
        owners.pop();
    }
}

fn is_container(name: &[u8]) -> bool {
    matches!(
        name,
        b"MANIFOLD_SOLID_BREP"
            | b"BREP_WITH_VOIDS"
            | b"FACETED_BREP"
            | b"SHELL_BASED_SURFACE_MODEL"
            | b"FACE_BASED_SURFACE_MODEL"
            | b"CONNECTED_FACE_SET"
            | b"OPEN_SHELL"
            | b"CLOSED_SHELL"
            | b"ORIENTED_CLOSED_SHELL"
            | b"ORIENTED_OPEN_SHELL"
            | b"ORIENTED_FACE"
            | b"GEOMETRIC_SET"
    )
}

/// Whether whatever a container refers to must be a face.
fn holds_faces_alone(text: &[u8]) -> bool {
    let name = &text[..name_length(text)];
    matches!(name, b"CONNECTED_FACE_SET" | b"OPEN_SHELL" | b"CLOSED_SHELL" | b"ORIENTED_FACE")
}
