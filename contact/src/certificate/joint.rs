//! What goes on beyond a side of a triangle at which its face ends, and whether it can rise above a
//! ball that touches this side. Certificates of contacts reach across joints by this.

use claymill_nurbs::{Leaves, Point2, Point3, Vector3};

use crate::certificate::one_sheet::upward;
use crate::drop::{BallDrop, TIGHT, Triangle, weighted};
use crate::exact::flat::barycentric;

/// Surfaces this far apart on the rim do not go on from each other, mm.
const APART_MM: f64 = 0.2;
/// Beyond a joint the surface may begin higher by this, mm.
const RISE_MM: f64 = 2e-5;
/// And rise at such an angle that a ball which touches the first surface sinks into the other by no more than this, mm.
const SUNK_MM: f64 = 2e-5;
/// Surfaces that turn by more than this (78°) do not go on from each other.
const TURNED_COSINE: f64 = 0.2;
/// It is looked at these places on a side of a triangle.
const PLACES: [f64; 3] = [0.1, 0.5, 0.9];
/// What is across a side lies past its ends by no more than this, as a part of the distance from it.
const ASLANT: f64 = 2.0;
/// Steps to the foot of a point on a surface.
const STEPS: usize = 4;

/// What goes on from a face beyond one side of a triangle.
#[derive(Debug)]
pub(crate) struct Joint {
    /// Nothing that begins there reaches above a ball that touches this side of it.
    pub(crate) is_sound: bool,
    /// Somewhere on the side nothing begins at all.
    pub(crate) is_open: bool,
    /// Triangles of other faces (or of the other side of a seam) and where on them.
    pub(crate) onward: Vec<(u32, Point2)>,
}

impl BallDrop<'_> {
    /// Looks beyond a side of a triangle on which its face ends.
    pub(crate) fn look_beyond(&self, triangle: u32, side: usize) -> Joint {
        let t = &self.triangles[triangle as usize];
        let mesh = &self.covering.meshes[t.face as usize];
        let own = mesh.triangles[t.index as usize];
        let [i, j] = [side, (side + 1) % 3].map(|k| own[k] as usize);
        let leaves = &self.faces[t.face as usize].leaves;
        let mut joint = Joint { is_sound: true, is_open: false, onward: Vec::new() };
        let opposite = t.p[(side + 2) % 3];
        for share in PLACES {
            let at = mesh.uv[i] + (mesh.uv[j] - mesh.uv[i]) * share;
            let jet = leaves.jet(at.x, at.y);
            let (a, inward) = (jet.p, opposite - jet.p);
            let along = jet.su * (mesh.uv[j] - mesh.uv[i]).x + jet.sv * (mesh.uv[j] - mesh.uv[i]).y;
            let Some(n) = jet.normal().map(upward) else {
                joint.is_sound = false;
                return joint;
            };
            let along = along.try_normalize(0.0).unwrap_or_default();
            let Some(out) = along.cross(&n).try_normalize(0.0).map(|c| c * -c.dot(&inward).signum()) else {
                joint.is_sound = false;
                return joint;
            };
            // The nearest triangle of each face.
            let mut near: Vec<(u32, f64, Point2)> = Vec::new();
            self.tree.around(&a, APART_MM, |item| {
                let Some(other) = self.triangles.get(item) else { return };
                if self.touch_each_other(triangle, item as u32) {
                    return;
                }
                let (apart, at) = self.nearest_in(item as u32, &a);
                if apart > APART_MM + f64::from(other.deviation_mm) {
                    return;
                }
                match near.iter_mut().find(|(known, ..)| self.triangles[*known as usize].face == other.face) {
                    Some(known) if known.1 <= apart => {}
                    Some(known) => *known = (item as u32, apart, at),
                    None => near.push((item as u32, apart, at)),
                }
            });
            let mut goes_on = false;
            for (other, _, start) in near {
                let face = self.triangles[other as usize].face as usize;
                let Some((uv, foot, normal)) = foot(&self.faces[face].leaves, start, &a) else {
                    joint.is_sound = false;
                    continue;
                };
                let (apart, normal) = ((foot - a).norm(), upward(normal));
                if apart > APART_MM {
                    continue;
                }
                goes_on = true;
                let p = &self.triangles[other as usize].p;
                let middle = (p[0].coords + p[1].coords + p[2].coords) / 3.0 - foot.coords;
                let rise = (foot - a).dot(&n) - apart * apart / (2.0 * self.radius_mm());
                let slope = -normal.dot(&out) / normal.dot(&n);
                // What crosses the rim instead of going on from it rises to one side of the crossing.
                let slope_along = (normal.dot(&along) / normal.dot(&n)).abs();
                joint.is_sound &= middle.dot(&out) > 0.0
                    && rise <= RISE_MM
                    && normal.dot(&n) > TURNED_COSINE
                    && slope.max(slope_along) <= self.steepest_joint();
                if !joint.onward.iter().any(|(known, _)| *known == other) {
                    joint.onward.push((other, uv));
                }
            }
            joint.is_open |= !goes_on;
        }
        joint
    }

    /// A ball beside a joint of slope `θ` sinks in by `R·θ² / 2(1 − κ⁺R)`.
    fn steepest_joint(&self) -> f64 {
        (2.0 * SUNK_MM * (1.0 - TIGHT) / self.radius_mm()).sqrt()
    }

    /// Distance of the nearest point of a triangle, and where on its surface that is about.
    fn nearest_in(&self, triangle: u32, p: &Point3) -> (f64, Point2) {
        let t = &self.triangles[triangle as usize];
        let mesh = &self.covering.meshes[t.face as usize];
        let uv = mesh.triangles[t.index as usize].map(|i| mesh.uv[i as usize]);
        let at = nearest(&t.p, p);
        let foot = weighted(&t.p, at);
        ((foot - p).norm(), weighted(&uv, at))
    }
}

/// Whether another triangle lies out from a side of one, no further than `reach_mm`.
pub(crate) fn is_across(t: &Triangle, side: usize, other: &Triangle, reach_mm: f64) -> bool {
    let [a, b, c] = [0, 1, 2].map(|k| t.p[(side + k) % 3]);
    let Some(along) = (b - a).try_normalize(0.0) else { return false };
    let (middle, half) = (nalgebra::center(&a, &b), 0.5 * (b - a).norm());
    let inward = (c - middle) - along * (c - middle).dot(&along);
    let Some(out) = (-inward).try_normalize(0.0) else { return false };
    let [p, q, r] = other.p;
    let sides = [(p, q), (q, r), (r, p)].map(|(p, q)| nalgebra::center(&p, &q));
    [p, q, r].iter().chain(&sides).any(|p| {
        let off = p - middle;
        let (beyond, past) = (off.dot(&out), off.dot(&along).abs() - half);
        beyond > 0.0 && beyond < reach_mm && past < ASLANT * beyond
    })
}

/// Barycentric coordinates of the point of a triangle that is nearest to `p`.
fn nearest(t: &[Point3; 3], p: &Point3) -> [f64; 3] {
    let n = (t[1] - t[0]).cross(&(t[2] - t[0]));
    let at = barycentric(t, &n, p);
    if at.iter().all(|&w| w >= 0.0) {
        return at;
    }
    let on_side = |i: usize| {
        let j = (i + 1) % 3;
        let d = t[j] - t[i];
        let s = ((p - t[i]).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        let mut at = [0.0; 3];
        (at[i], at[j]) = (1.0 - s, s);
        (((t[i] + d * s) - p).norm_squared(), at)
    };
    let sides = [on_side(0), on_side(1), on_side(2)];
    sides.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or([1.0, 0.0, 0.0], |s| s.1)
}

/// The foot of `p` on a surface: where, which point, and the normal there.
fn foot(leaves: &Leaves, start: Point2, p: &Point3) -> Option<(Point2, Point3, Vector3)> {
    let ((u0, u1), (v0, v1)) = leaves.domain();
    let mut at = start;
    for _ in 0..STEPS {
        let jet = leaves.jet(at.x, at.y);
        let step = jet.tangent_coordinates(&(p - jet.p))?;
        let next = Point2::new((at.x + step.x).clamp(u0, u1), (at.y + step.y).clamp(v0, v1));
        let moved = jet.su * (next.x - at.x) + jet.sv * (next.y - at.y);
        at = next;
        if moved.norm() < 1e-4 {
            break;
        }
    }
    let jet = leaves.jet(at.x, at.y);
    Some((at, jet.p, jet.normal()?))
}
