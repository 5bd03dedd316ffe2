//! Defects where faces meet.

use claymill_nurbs::Model;

use super::{Defect, DefectCode, GAP_MM};
use crate::{Joint, JointSample, Merge};

pub(super) fn of(model: &Model, merged: &Merge) -> Vec<Defect> {
    let mut found = Vec::new();
    for joint in &merged.joints {
        let [a, b] = joint.sides.map(|s| s.face);
        let mut add = |code, size| {
            let faces = if a == b { vec![a] } else { vec![a.min(b), a.max(b)] };
            found.push(Defect { code, faces, at: worst(joint).point, size });
        };
        let gap = gap(worst(joint));
        if gap > GAP_MM {
            add(DefectCode::Gap, gap);
        }
        if joint.non_manifold {
            add(DefectCode::NonManifold, joint.length_mm);
        }
        let turned = |id: usize| model.faces[id].reversed;
        if a != b && !joint.non_manifold && joint.normals_agree != (turned(a) == turned(b)) {
            add(DefectCode::InconsistentNormals, joint.length_mm);
        }
    }
    for gap in &merged.wide_gaps {
        let (a, b) = (gap.stretch.face, gap.beside);
        let faces = if a == b { vec![a] } else { vec![a.min(b), a.max(b)] };
        found.push(Defect { code: DefectCode::Gap, faces, at: gap.at, size: gap.gap_max_mm });
    }
    found
}

fn gap(sample: &JointSample) -> f64 {
    sample.gap_normal_mm.abs().hypot(sample.gap_lateral_mm)
}

fn worst(joint: &Joint) -> &JointSample {
    joint.samples.iter().max_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(&joint.mid)
}
