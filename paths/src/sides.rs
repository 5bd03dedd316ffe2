//! Which side of each face is cut.

use claymill_nurbs::{FaceId, Vector3};

use crate::Frame;
use crate::contact::Covering;
use crate::reach::{Fate, LEAST_FACING};

/// What a setup cuts of a region from the other side than most is cut from may be this share of it for it to count as
/// none.
const OTHER_SIDE: f64 = 0.05;

/// The side of each face from which most of it is cut, and how much each setup cuts from which side.
pub(crate) struct Sides {
    faces: Vec<Side>,
}

#[derive(Default)]
struct Side {
    /// Cut by each setup on the side of `Su × Sv`, and on the other, mm².
    cut_mm2: [[f64; 2]; 5],
}

impl Sides {
    pub(crate) fn new(covering: &Covering, fates: &[Vec<Fate>], frames: &[Frame]) -> Self {
        let side = |(mesh, fates): (&claymill_nurbs::FaceMesh, &Vec<Fate>)| {
            let mut side = Side::default();
            for (t, fate) in mesh.triangles.iter().zip(fates).filter(|(_, fate)| fate.setups != 0) {
                let [a, b, c] = t.map(|i| mesh.points[i as usize]);
                let [p, q, r] = t.map(|i| mesh.uv[i as usize]);
                let double = (b - a).cross(&(c - a)) * (q - p).perp(&(r - p)).signum();
                let area_mm2 = 0.5 * double.norm();
                for (k, frame) in frames.iter().enumerate() {
                    let facing = 0.5 * double.dot(&frame.axis());
                    if facing.abs() > LEAST_FACING * area_mm2 {
                        side.cut_mm2[k][usize::from(facing < 0.0)] += area_mm2 * f64::from(fate.cut[k]);
                    }
                }
            }
            side
        };
        Sides { faces: covering.meshes.iter().zip(fates).map(side).collect() }
    }

    /// The normal of a face on the side from which most of it is cut.
    pub(crate) fn up(&self, face: FaceId, normal: Vector3) -> Vector3 {
        let [upper, lower] = self.faces[face].cut_mm2.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
        if lower > upper { -normal } else { normal }
    }

    /// Whether a setup cuts the faces on those sides, but for little.
    pub(crate) fn suit(&self, faces: &[FaceId], setup: usize) -> bool {
        let (mut all, mut other) = (0.0, 0.0);
        for &face in faces {
            let cut = self.faces[face].cut_mm2[setup];
            let own = usize::from(self.up(face, Vector3::z()).z < 0.0);
            all += cut[0] + cut[1];
            other += cut[1 - own];
        }
        other <= OTHER_SIDE * all
    }
}
