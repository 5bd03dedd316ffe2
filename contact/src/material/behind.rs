//! Where a ball would be in the material, though it may touch nothing there.
//!
//! ```text
//!        axis                        a sheet that stands upright, with the material on its right: the ball comes
//!   free  ↑   │   material           to rest on something else there, and nothing holds it up on its way.
//!         │   │    ╷ ╷ way up        But the sheet is what is nearest to it, on the wrong side.
//!             │    │ │
//!             │    ╰●╯
//!             ╰────────
//! ```
//!
//! Only the open border of a sheet lets a ball get there. What is nearest to its centre tells on which side it is, as long as that
//! is the inside of a face. Far away from all faces nobody knows.

use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, BoxTree, ClosestPoints, FaceId, Foot, Hint, Point3, Vector3};

use crate::Frame;
use crate::material::free_sides::FreeSides;
use crate::{Covering, larger_than_usual};

/// This near to the side of the material a ball must not come, mm; a large one this much times the root of how much larger than
/// usual it is. Nor nearer than so many scallop heights: what is left below a ball by no more than about that is cut by it.
const NEAR_MM: f64 = 1.1;
const NEAR_SCALLOPS: f64 = 1.6;
/// Files let faces curl over at their borders, by less than this: a side has to be that of the material all around, mm.
const ALL_AROUND_MM: f64 = 0.2;
/// On the way up it is looked this often, in ball radii, where a face is near.
const RISE_RADII: f64 = 0.1;
/// A face is behind the ball where its triangle is so far behind, in ball radii: normals differ within a triangle.
const BEHIND_RADII: f64 = 0.5;
/// And by so much in how far it looks up (`n·axis`).
const NORMALS_DIFFER: f64 = 0.1;

/// How near to the side of the material a ball must not come, mm.
#[must_use]
pub fn near_mm(radius_mm: f64, scallop_mm: f64) -> f64 {
    (NEAR_MM * larger_than_usual(radius_mm).sqrt()).max(NEAR_SCALLOPS * scallop_mm)
}

/// The material of open sheets, as a ball of a setup meets it.
#[derive(Debug)]
pub struct Material<'a> {
    closest: &'a ClosestPoints<'a>,
    free: FreeSides<'a>,
    frame: Frame,
    radius_mm: f64,
    near_mm: f64,
    backs: Vec<Back>,
    tree: BoxTree,
}

/// A triangle behind which a ball may come down.
#[derive(Debug)]
struct Back {
    /// A corner, in the setup's coordinates.
    at: Point3,
    /// On the free side.
    normal: Vector3,
    heights: [f64; 2],
    deviation_mm: f64,
}

impl<'a> Material<'a> {
    /// The material behind all faces that have a free side; `None` if there is nothing that a ball could get behind.
    #[must_use]
    pub fn new(
        closest: &'a ClosestPoints<'a>,
        covering: &Covering,
        free: FreeSides<'a>,
        frame: &Frame,
        [radius_mm, near_mm]: [f64; 2],
    ) -> Option<Self> {
        let within_mm = radius_mm + near_mm;
        // Where a sheet looks up further, a ball behind it is below it on its whole way.
        let least_upright = (1.0 - (radius_mm / within_mm).powi(2)).sqrt() + NORMALS_DIFFER;
        let (mut backs, mut boxes) = (Vec::new(), Vec::new());
        for (face, mesh) in covering.meshes.iter().enumerate() {
            if free.of(face).is_both() {
                continue;
            }
            for (triangle, deviation_mm) in mesh.triangles.iter().zip(&covering.deviation_mm[face]) {
                let corners = triangle.map(|i| frame.to_setup(&mesh.points[i as usize]));
                let [a, b, c] = corners;
                let Some(n) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
                let normal = if free.allow(face, true) { n } else { -n };
                if normal.z > least_upright {
                    continue;
                }
                let deviation_mm = f64::from(*deviation_mm);
                let around = Aabb::of(&corners).inflated(deviation_mm + within_mm);
                backs.push(Back { at: a, normal, heights: [around.min[2], around.max[2]], deviation_mm });
                boxes.push(around);
            }
        }
        let tree = (!boxes.is_empty()).then(|| BoxTree::new(&boxes))?;
        Some(Material { closest, free, frame: *frame, radius_mm, near_mm, backs, tree })
    }

    /// Whether a ball on its way up from a place of its centre, in the setup's coordinates, is in the material somewhere.
    #[must_use]
    pub fn is_above(&self, centre: &Point3) -> bool {
        let may_hold =
            |b: &Aabb| (0..2).all(|k| b.min[k] <= centre[k] && centre[k] <= b.max[k]) && centre.z <= b.max[2];
        let mut behind = Vec::new();
        let visit = |k: usize| {
            behind.extend(self.behind(&self.backs[k], centre));
            ControlFlow::Continue(())
        };
        self.tree.visit(|boxes| boxes.each(may_hold), visit);
        // Triangles one above the other, and those beside each other, are looked at together.
        behind.sort_by(|a: &[f64; 2], b| a[0].total_cmp(&b[0]));
        let mut hint = Hint::default();
        let mut from = f64::NEG_INFINITY;
        behind.into_iter().any(|[low, high]| {
            if high <= from {
                return false;
            }
            let low = low.max(from);
            from = high;
            self.is_within(centre, [low, high], &mut hint)
        })
    }

    /// The heights at which a ball on its way up may be behind a triangle.
    fn behind(&self, back: &Back, centre: &Point3) -> Option<[f64; 2]> {
        let (mut from, mut to) = (centre.z.max(back.heights[0]), back.heights[1]);
        // How far before the triangle's plane the ball is at a height: between two bounds it may be behind.
        let level = back.normal.dot(&(Point3::new(centre.x, centre.y, 0.0) - back.at));
        let bounds = [
            -(self.radius_mm + self.near_mm + back.deviation_mm),
            back.deviation_mm - BEHIND_RADII * self.radius_mm,
        ];
        if back.normal.z.abs() < f64::EPSILON {
            if !(bounds[0]..=bounds[1]).contains(&level) {
                return None;
            }
        } else {
            let [a, b] = bounds.map(|mm| (mm - level) / back.normal.z);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
        (from <= to).then_some([from, to])
    }

    /// Whether the ball is in the material somewhere between two heights of its centre.
    fn is_within(&self, centre: &Point3, [from, to]: [f64; 2], hint: &mut Hint) -> bool {
        let within_mm = self.radius_mm + self.near_mm;
        let least_mm = RISE_RADII * self.radius_mm;
        let mut height = from;
        while height <= to {
            let at = self.frame.to_model(&Point3::new(centre.x, centre.y, height));
            let foot = self.closest.closest_from(&at, within_mm + self.radius_mm, hint);
            let clear_mm = foot.as_ref().map_or(self.radius_mm, |foot| foot.distance_mm - within_mm);
            if clear_mm <= 0.0 && foot.is_some_and(|foot| self.is_beyond(&foot, &at)) {
                return true;
            }
            height += clear_mm.max(least_mm);
        }
        false
    }

    /// Whether a ball with its centre at a place of the model is in the material, or so near to its side that it counts as cutting
    /// from there; `foot` is the nearest place of the model.
    #[must_use]
    pub fn holds(&self, foot: &Foot, centre: &Point3) -> bool {
        foot.distance_mm <= self.radius_mm + self.near_mm && self.is_beyond(foot, centre)
    }

    /// Whether a place is on the side of the material of what is nearest to it.
    fn is_beyond(&self, foot: &Foot, centre: &Point3) -> bool {
        is_of_material(self.closest, self.free, foot, centre)
    }
}

/// Whether a place is on the side of the material of what is nearest to it, and that is the inside of a face.
fn is_of_material(closest: &ClosestPoints, free: FreeSides, foot: &Foot, centre: &Point3) -> bool {
    let face: FaceId = foot.face;
    if foot.on_boundary || free.of(face).is_both() {
        return false;
    }
    let surface = &closest.model().faces[face].surface;
    let is_of_material = |u: f64, v: f64| {
        let normal = surface.normal(u, v);
        normal.is_some_and(|(n, _)| !free.allow(face, n.dot(&(centre - surface.point(u, v))) > 0.0))
    };
    if !is_of_material(foot.u, foot.v) {
        return false;
    }
    let (jet, ((u0, u1), (v0, v1))) = (surface.jet(foot.u, foot.v), surface.domain());
    let step = |slope: Vector3| ALL_AROUND_MM / slope.norm().max(f64::MIN_POSITIVE);
    let (du, dv) = (step(jet.su), step(jet.sv));
    let around = [(du, 0.0), (-du, 0.0), (0.0, dv), (0.0, -dv)].map(|(a, b)| (foot.u + a, foot.v + b));
    let is_inside = |&(u, v): &(f64, f64)| (u0..=u1).contains(&u) && (v0..=v1).contains(&v);
    around.iter().all(|at| is_inside(at) && is_of_material(at.0, at.1))
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
    use claymill_toolpath::FreeSide;

    use super::*;

    const R: f64 = 5.0;
    const NEAR: f64 = 1.0;

    #[test]
    fn a_ball_is_behind_an_upright_plate_on_its_whole_way_up() {
        let placement = Placement::new(Point3::origin(), Vector3::x(), Vector3::y()).unwrap();
        let plate = plane_patch(&placement, (0.0, 40.0), (0.0, 30.0)).unwrap();
        let free_x = plate.normal(20.0, 15.0).unwrap().0.x;
        let model = claymill_tests::model_of([plate]);
        let covering = Covering::new(&model, &[false], 1200.0, R).unwrap();
        let closest = ClosestPoints::new(&model);
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        for (side, free_x) in [(FreeSide::Along, free_x), (FreeSide::Against, -free_x)] {
            let sides = [side];
            let material =
                Material::new(&closest, &covering, FreeSides::new(&sides), &top, [R, NEAR]).unwrap();
            let is_above = |x: f64, y: f64, z: f64| {
                let centre = Point3::new(x * free_x, y, z);
                material.is_above(&top.to_setup(&centre))
            };
            for z in [-60.0, 0.0, 15.0, 29.0] {
                assert!(is_above(-R - 0.1, 20.0, z) && is_above(0.1 - R - NEAR, 20.0, z), "{z}");
                // On the free side, farther behind, and beside the plate.
                assert!(!is_above(R + 0.1, 20.0, z) && !is_above(-0.1 - R - NEAR, 20.0, z), "{z}");
                assert!(!is_above(-R - 0.1, -1.0, z), "{z}");
            }
            assert!(!is_above(-R - 0.1, 20.0, 31.0));
        }
        let both = [FreeSide::Both];
        assert!(Material::new(&closest, &covering, FreeSides::new(&both), &top, [R, NEAR]).is_none());
    }

    #[test]
    fn nothing_gets_behind_a_level_plate_from_above() {
        let placement = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let plate = plane_patch(&placement, (0.0, 40.0), (0.0, 30.0)).unwrap();
        let model = claymill_tests::model_of([plate]);
        let covering = Covering::new(&model, &[false], 1200.0, R).unwrap();
        let (closest, sides) = (ClosestPoints::new(&model), [FreeSide::Along]);
        let five = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
        let of = |frame: &Frame| Material::new(&closest, &covering, FreeSides::new(&sides), frame, [R, NEAR]);
        assert!(of(&five[0]).is_none() && five[1..].iter().all(|side| of(side).is_some()));
    }
}
