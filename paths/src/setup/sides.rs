//! Which side of each face is cut.

use claymill_contact::Covering;
use claymill_nurbs::{FaceId, FaceMesh, Vector3};

use crate::Frame;
use crate::setup::assignment::{Assignment, MOST_SETUPS};
use crate::setup::in_triangle::area_vector;
use crate::setup::leaning::LEAST_FACING;

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
    cut_mm2: [[f64; 2]; MOST_SETUPS],
    /// Most is cut on the other.
    other: bool,
}

impl Sides {
    pub(crate) fn new(covering: &Covering, assignments: &[Vec<Assignment>], frames: &[Frame]) -> Self {
        let side = |(mesh, assignments): (&FaceMesh, &Vec<Assignment>)| {
            let mut side = Side::default();
            for (t, assignment) in
                mesh.triangles.iter().zip(assignments).filter(|(_, assignment)| assignment.setups != 0)
            {
                let area = area_vector(mesh, t);
                let area_mm2 = area.norm();
                for (k, frame) in frames.iter().enumerate() {
                    let facing = area.dot(&frame.axis());
                    if facing.abs() > LEAST_FACING * area_mm2 {
                        side.cut_mm2[k][usize::from(facing < 0.0)] += area_mm2 * f64::from(assignment.cut[k]);
                    }
                }
            }
            let [upper, lower] = side.cut_mm2.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
            Side { other: lower > upper, ..side }
        };
        Sides { faces: covering.meshes().iter().zip(assignments).map(side).collect() }
    }

    /// The normal of a face on the side from which most of it is cut.
    pub(crate) fn up(&self, face: FaceId, normal: Vector3) -> Vector3 {
        if self.faces[face].other { -normal } else { normal }
    }

    /// Whether a setup cuts the faces on those sides, but for little.
    pub(crate) fn suit(&self, faces: &[FaceId], setup: usize) -> bool {
        let (mut all, mut other) = (0.0, 0.0);
        for &face in faces {
            let side = &self.faces[face];
            let cut = side.cut_mm2[setup];
            all += cut[0] + cut[1];
            other += cut[usize::from(!side.other)];
        }
        other <= OTHER_SIDE * all
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::Point3;
    use claymill_nurbs::analytic::{Frame as Placement, cylinder, plane_patch};

    use super::*;

    const LEFT: usize = 1;
    const RIGHT: usize = 2;

    fn frames() -> [Frame; 5] {
        Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()
    }

    /// What is cut by the setup that faces it, on either side if it is thin.
    fn cut(covering: &Covering, thin: bool) -> Vec<Vec<Assignment>> {
        let frames = frames();
        let mesh = &covering.meshes()[0];
        let of_triangle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.points[i as usize]);
            let middle = (a.coords + b.coords + c.coords) / 3.0;
            let mut assignment = Assignment::default();
            // A setup faces the half of an upright cylinder around the origin that is on its side.
            let faces = |k: usize| middle.dot(&frames[k].axis()) > 0.0;
            for k in [LEFT, RIGHT].into_iter().filter(|&k| thin || faces(k)) {
                assignment.setups |= 1 << k;
                assignment.cut[k] = if thin { 0.5 } else { 1.0 };
            }
            assignment
        };
        vec![mesh.triangles.iter().map(of_triangle).collect()]
    }

    #[test]
    fn a_body_is_cut_from_outside_by_all_setups() {
        let placement = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let surface = cylinder(&placement, 20.0, (0.0, std::f64::consts::TAU), (0.0, 30.0)).unwrap();
        let outwards = surface.normal(0.01, 15.0).unwrap().0.dot(&surface.point(0.01, 15.0).coords) > 0.0;
        let model = claymill_tests::model_of([surface]);
        let covering = Covering::new(&model, &[false], 3000.0, 6.0).unwrap();
        let sides = Sides::new(&covering, &cut(&covering, false), &frames());
        assert!(sides.suit(&[0], LEFT) && sides.suit(&[0], RIGHT));
        assert_eq!(sides.up(0, Vector3::x()).x > 0.0, outwards);
    }

    #[test]
    fn a_sheet_is_cut_from_both_sides() {
        let left = frames()[LEFT].axis();
        let placement = Placement::new(Point3::origin(), left, Vector3::x()).unwrap();
        let sheet = plane_patch(&placement, (-20.0, 20.0), (-20.0, 20.0)).unwrap();
        let model = claymill_tests::model_of([sheet]);
        let covering = Covering::new(&model, &[false], 1600.0, 6.0).unwrap();
        let sides = Sides::new(&covering, &cut(&covering, true), &frames());
        assert_ne!(sides.suit(&[0], LEFT), sides.suit(&[0], RIGHT));
    }
}
