//! Groups faces into sheets over their joints, creases included, and orients them against each
//! other: union-find with a parity for each face.

use std::collections::BTreeMap;

use claymill_nurbs::FaceId;

use crate::Merge;

/// Which faces hang together, and which of them are turned.
pub(super) struct Hanging {
    parent: Vec<usize>,
    /// `Su × Sv` points to another side than that of the parent.
    turned: Vec<bool>,
    /// Joints that turn over: the two faces, and length, mm.
    contrary: Vec<(FaceId, f64)>,
}

/// Faces that hang together.
pub(super) struct Group {
    /// Ascending.
    pub(super) faces: Vec<FaceId>,
    /// `Su × Sv` of each points to another side than that of the first.
    pub(super) turned: Vec<bool>,
    /// Length of joints that say otherwise, mm.
    pub(super) contrary_mm: f64,
}

impl Hanging {
    /// Over the joints of two faces, the longest first, so that what is wrong is cut where it is shortest. Where more than two
    /// faces meet, nobody says which of them go on in which.
    pub(super) fn new(faces: usize, merged: &Merge) -> Self {
        let mut hanging =
            Hanging { parent: (0..faces).collect(), turned: vec![false; faces], contrary: Vec::new() };
        for copy in &merged.duplicates {
            hanging.join([copy.original, copy.copy], !copy.normals_agree, 0.0);
        }
        let mut joints: Vec<(f64, [FaceId; 2], bool)> = (merged.joints.iter())
            .filter(|joint| !joint.non_manifold && !joint.outdone)
            .map(|joint| (joint.length_mm, joint.sides.map(|side| side.face), !joint.normals_agree))
            .collect();
        joints.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (length_mm, faces, turns) in joints {
            hanging.join(faces, turns, length_mm);
        }
        hanging
    }

    fn join(&mut self, [a, b]: [FaceId; 2], turns: bool, length_mm: f64) {
        let ((root_a, turned_a), (root_b, turned_b)) = (self.root(a), self.root(b));
        let turns = turns != (turned_a != turned_b);
        if root_a == root_b {
            if turns {
                self.contrary.push((a, length_mm));
            }
            return;
        }
        let (root, child) = (root_a.min(root_b), root_a.max(root_b));
        self.parent[child] = root;
        self.turned[child] = turns;
    }

    /// The root of a face, and whether the face is turned against it.
    fn root(&mut self, face: FaceId) -> (FaceId, bool) {
        let (mut root, mut turned) = (face, false);
        while self.parent[root] != root {
            turned ^= self.turned[root];
            root = self.parent[root];
        }
        // The way is shortened for the next time.
        let (mut at, mut left) = (face, turned);
        while self.parent[at] != root && at != root {
            let (next, own) = (self.parent[at], self.turned[at]);
            (self.parent[at], self.turned[at]) = (root, left);
            left ^= own;
            at = next;
        }
        (root, turned)
    }

    pub(super) fn groups(mut self) -> Vec<Group> {
        let mut groups: BTreeMap<FaceId, Group> = BTreeMap::new();
        for face in 0..self.parent.len() {
            let (root, turned) = self.root(face);
            let group = groups.entry(root).or_insert_with(|| Group {
                faces: Vec::new(),
                turned: Vec::new(),
                contrary_mm: 0.0,
            });
            group.faces.push(face);
            group.turned.push(turned);
        }
        for (face, length_mm) in std::mem::take(&mut self.contrary) {
            let (root, _) = self.root(face);
            groups.entry(root).and_modify(|group| group.contrary_mm += length_mm);
        }
        groups.into_values().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(turns: [bool; 4]) -> Vec<Group> {
        let mut hanging = Hanging { parent: (0..5).collect(), turned: vec![false; 5], contrary: Vec::new() };
        for (face, turn) in turns.into_iter().enumerate() {
            hanging.join([face, (face + 1) % 4], turn, 1.0);
        }
        hanging.groups()
    }

    #[test]
    fn turned_faces_are_told_from_the_first_whatever_the_way_to_them() {
        let groups = strip([true, true, false, false]);
        assert_eq!(groups.len(), 2);
        assert_eq!(groups[0].turned, [false, true, false, false]);
        assert_eq!(groups[0].contrary_mm, 0.0);
        assert_eq!(groups[1].faces, [4]);
    }

    #[test]
    fn a_ring_that_turns_over_once_has_no_two_sides() {
        let groups = strip([true, false, false, false]);
        assert_eq!(groups[0].contrary_mm, 1.0);
    }
}
