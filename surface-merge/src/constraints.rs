//! What the user wants kept apart or together, whatever the joints are like.

use std::collections::BTreeMap;

use claymill_nurbs::FaceId;
use serde::{Deserialize, Serialize};

use crate::MergeError;
use crate::disjoint_sets::DisjointSets;
use crate::duplicates::Duplicate;

/// Wishes that go before all limits. Copies of faces follow their originals.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Constraints {
    /// A class for each face: faces of different classes are never one region. Empty: all are of one class.
    pub class_of_face: Vec<usize>,
    /// Sets of faces that join over every joint among them, creases too.
    pub together: Vec<Vec<FaceId>>,
}

/// The constraints of a model with so many faces.
pub(crate) struct Wishes {
    class_of_face: Vec<usize>,
    /// Faces of the same set have the same number.
    set_of_face: Vec<usize>,
}

impl Constraints {
    pub(crate) fn check(&self, faces: usize) -> Result<(), MergeError> {
        let classes = self.class_of_face.len();
        if classes != 0 && classes != faces {
            return Err(MergeError::Classes { classes, faces });
        }
        if let Some(&face) = self.together.iter().flatten().find(|f| **f >= faces) {
            return Err(MergeError::NoSuchFace { face, faces });
        }
        if classes == 0 {
            return Ok(());
        }
        let sets = self.sets(faces);
        let mut first: BTreeMap<usize, FaceId> = BTreeMap::new();
        for (face, &set) in sets.iter().enumerate() {
            let other = *first.entry(set).or_insert(face);
            if self.class_of_face[other] != self.class_of_face[face] {
                return Err(MergeError::Contradiction { faces: [other, face] });
            }
        }
        Ok(())
    }

    fn sets(&self, faces: usize) -> Vec<usize> {
        let mut sets = DisjointSets::new(faces);
        for w in self.together.iter().flat_map(|set| set.windows(2)) {
            sets.join(w[0], w[1]);
        }
        (0..faces).map(|f| sets.root(f)).collect()
    }

    pub(crate) fn of(&self, faces: usize, duplicates: &[Duplicate]) -> Wishes {
        let mut class_of_face =
            if self.class_of_face.is_empty() { vec![0; faces] } else { self.class_of_face.clone() };
        duplicates.iter().for_each(|d| class_of_face[d.copy] = class_of_face[d.original]);
        Wishes { class_of_face, set_of_face: self.sets(faces) }
    }
}

impl Wishes {
    /// Whether two faces are to be kept apart.
    pub(crate) fn apart(&self, [a, b]: [FaceId; 2]) -> bool {
        self.class_of_face[a] != self.class_of_face[b]
    }

    /// Whether two faces are to be one region.
    pub(crate) fn together(&self, [a, b]: [FaceId; 2]) -> bool {
        a != b && self.set_of_face[a] == self.set_of_face[b]
    }
}
