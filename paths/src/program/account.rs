//! Where the area goes: which setup cuts how much of what, and why the rest stays.

use std::collections::BTreeMap;

use claymill_contact::{Covering, FreeSides};
use claymill_nurbs::{FaceId, Model};
use claymill_toolpath::{Area, FaceAccount, UncutReason};

use crate::plan::regions::Regions;
use crate::setup::assignment::{Assignment, MOST_SETUPS};

/// Where the area of a face goes, mm².
struct FaceSums {
    /// Cut by each setup.
    cut: [f64; MOST_SETUPS],
    uncut: [(UncutReason, f64); 4],
}

impl FaceSums {
    fn new() -> Self {
        use UncutReason::{EarlierTool, Hidden, OutOfBounds, TooTight};
        FaceSums {
            cut: [0.0; MOST_SETUPS],
            uncut: [Hidden, TooTight, EarlierTool, OutOfBounds].map(|r| (r, 0.0)),
        }
    }

    fn add(&mut self, assignment: &Assignment, area_mm2: f64) {
        for (sum, share) in self.cut.iter_mut().zip(assignment.cut) {
            *sum += area_mm2 * f64::from(share);
        }
        for ((_, sum), share) in self.uncut.iter_mut().zip([
            assignment.hidden,
            assignment.tight,
            assignment.done,
            assignment.out_of_bounds,
        ]) {
            *sum += area_mm2 * f64::from(share);
        }
    }

    fn scale(&mut self, by: f64) {
        self.cut.iter_mut().chain(self.uncut.iter_mut().map(|u| &mut u.1)).for_each(|sum| *sum *= by);
    }
}

/// Where the area goes, by face: shares of the triangles, scaled to the face's exact area.
pub(crate) struct Account {
    faces: Vec<FaceSums>,
    pub(crate) region_setup_mm2: Vec<[f64; MOST_SETUPS]>,
}

impl Account {
    pub(crate) fn new(covering: &Covering, assignments: &[Vec<Assignment>], regions: &Regions) -> Self {
        let count = regions.of_face.iter().max().map_or(0, |m| m + 1);
        let mut region_setup_mm2 = vec![[0.0; MOST_SETUPS]; count];
        let mut faces = Vec::with_capacity(assignments.len());
        for (face, assignment) in assignments.iter().enumerate() {
            let mut sums = FaceSums::new();
            let mut total = 0.0;
            for (area, f) in covering.areas_mm2(face).zip(assignment) {
                total += area;
                sums.add(f, area);
            }
            sums.scale(if total > 0.0 { regions.face_area_mm2[face] / total } else { 0.0 });
            for (sum, cut) in region_setup_mm2[regions.of_face[face]].iter_mut().zip(sums.cut) {
                *sum += cut;
            }
            faces.push(sums);
        }
        Account { faces, region_setup_mm2 }
    }

    /// The account by face and in total. What the shares leave over by rounding goes to the largest entry,
    /// so that the sum is the face's area.
    /// `bare` faces are those that could not be covered.
    pub(crate) fn faces(
        &self,
        model: &Model,
        regions: &Regions,
        free: FreeSides,
        bare: &[FaceId],
    ) -> (Area, Vec<FaceAccount>) {
        let mut all = Area::default();
        let mut rows = Vec::with_capacity(self.faces.len());
        for (face, sums) in self.faces.iter().enumerate() {
            let total_mm2 = regions.face_area_mm2[face];
            let mut area = Area { total_mm2, cut_mm2: sums.cut.iter().sum(), uncut_mm2: BTreeMap::new() };
            if bare.contains(&face) {
                area.uncut_mm2.insert(UncutReason::NotCovered, total_mm2);
            } else if regions.excluded[face] {
                area.uncut_mm2.insert(UncutReason::Excluded, total_mm2);
            } else {
                for (reason, value) in sums.uncut {
                    if value > 0.0 {
                        area.uncut_mm2.insert(reason, value);
                    }
                }
                let rest = total_mm2 - area.cut_mm2 - area.uncut_mm2.values().sum::<f64>();
                match area.uncut_mm2.values_mut().max_by(|a, b| a.total_cmp(b)) {
                    Some(most) if *most > area.cut_mm2 => *most += rest,
                    _ => area.cut_mm2 += rest,
                }
            }
            all.total_mm2 += area.total_mm2;
            all.cut_mm2 += area.cut_mm2;
            for (reason, value) in &area.uncut_mm2 {
                *all.uncut_mm2.entry(*reason).or_default() += value;
            }
            let entity = model.faces[face].source.entity.clone();
            let free_side = free.of(face);
            rows.push(FaceAccount { face, entity, region: regions.of_face[face], free_side, area });
        }
        (all, rows)
    }
}
