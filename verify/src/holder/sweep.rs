//! Carries a body along a move over the model: branch and bound from spans to chords, triangles and
//! pieces of triangles. What is looked for is an `Aim`.

use std::cell::RefCell;
use std::ops::ControlFlow;

use claymill_nurbs::{Aabb, Point3};

use super::aims::Spot;
use super::body::Frustum;
use super::gap::Prism;
use super::patch::{Patch, Patches};
use crate::track::{Span, Track};

/// Paths are replaced by chords that stay this near to them, mm.
pub(super) const CHORD_MM: f64 = 1e-3;
/// Stretches are halved before triangles are looked at one by one, down to this length, mm.
const SHORT_MM: f64 = 4.0;

/// Tips of a move that are tried before it is looked along.
const TRIED: usize = 8;

/// What is looked for along a move, and how good the best is that was found so far.
pub(super) trait Aim {
    /// Triangles are cut until the surface is this near to them, mm.
    fn fine_mm(&self) -> f64;
    /// A patch that keeps this distance from the body ...
    fn clearance_mm(&self) -> f64;
    /// ... raised by this is of no interest, mm.
    fn raised_mm(&self) -> f64;
    /// Takes a point of the model in: `height` above the tip, `from_axis` away from the axis. Less than that gives is no
    /// longer of interest.
    fn try_point(&mut self, body: &[Frustum], height: f64, from_axis: f64, spot: &Spot);
    /// Nothing could be worse.
    fn settled(&self) -> bool;
    /// Takes a patch in that is of interest.
    fn meet(&mut self, meeting: &Meeting<'_>);
}

/// A patch and a stretch of the path, on which body and patch come near each other.
pub(super) struct Meeting<'a> {
    pub(super) body: &'a [Frustum],
    pub(super) prism: &'a Prism,
    pub(super) patch: &'a Patch,
    /// How far surface and path may be from triangle and chord together, mm.
    pub(super) margin_mm: f64,
    /// The stretch: its parameters and tips.
    pub(super) ends: [(f64, Point3); 2],
}

/// A body carried along moves over the model.
pub(super) struct Sweep<'a> {
    pub(super) patches: Patches<'a>,
    pub(super) body: &'a [Frustum],
}

impl Sweep<'_> {
    /// Looks along a whole move: its spans together by their control points, then fewer and fewer, then chords, then
    /// triangles, then pieces of them. Whatever is left out by one of these is clear of the body, whole stretches at once.
    pub(super) fn along(&self, track: &Track, aim: &mut impl Aim) {
        let view = self.patches.view;
        let bounds = |span: &Span| track.box_of(span, |p| view.in_frame(p));
        let spans: Vec<(Span, Aabb)> = track.spans().map(|span| (span, bounds(&span))).collect();
        let stride = spans.len().div_ceil(TRIED).max(1);
        for (span, _) in spans.iter().skip(stride / 2).step_by(stride) {
            self.try_tip(track, span.middle(), aim);
        }
        self.spans(track, &spans, aim);
    }

    /// Tries the corners of triangles, which lie on the surface, with the tip at one place.
    fn try_tip(&self, track: &Track, parameter: f64, aim: &mut impl Aim) {
        let view = self.patches.view;
        let tip = view.in_frame(&track.tip(parameter));
        let at = Aabb::of([&tip]);
        let aim = RefCell::new(aim);
        view.visit(
            |bounds| {
                let aim = aim.borrow();
                !aim.settled()
                    && self.raise(bounds, &at, aim.clearance_mm(), aim.raised_mm()) > aim.raised_mm()
            },
            |i| {
                for point in view.corners(i) {
                    let arm = point - tip;
                    let spot = Spot { point, tip, parameter, face: view.face_of(i).map(|f| f.0) };
                    aim.borrow_mut().try_point(self.body, arm.z, arm.x.hypot(arm.y), &spot);
                }
                ControlFlow::Continue(())
            },
        );
    }

    fn spans(&self, track: &Track, spans: &[(Span, Aabb)], aim: &mut impl Aim) {
        let bounds = spans.iter().fold(Aabb::empty(), |b, s| b.union(&s.1));
        if aim.settled() || self.is_clear(&bounds, aim) {
            return;
        }
        if spans.len() > 1 {
            let (first, second) = spans.split_at(spans.len() / 2);
            self.spans(track, first, aim);
            self.spans(track, second, aim);
            return;
        }
        let Some((span, _)) = spans.first() else { return };
        let tip = |t: f64| (t, self.patches.view.in_frame(&track.tip(t)));
        let corners: Vec<(f64, Point3)> = track.chords(span, CHORD_MM).into_iter().map(tip).collect();
        self.chords(&corners, aim);
    }

    fn chords(&self, corners: &[(f64, Point3)], aim: &mut impl Aim) {
        let bounds = Aabb::of(corners.iter().map(|c| &c.1)).inflated(CHORD_MM);
        if corners.len() < 2 || aim.settled() || self.is_clear(&bounds, aim) {
            return;
        }
        if corners.len() > 2 {
            let middle = corners.len() / 2;
            self.chords(&corners[..=middle], aim);
            self.chords(&corners[middle..], aim);
        } else if (corners[1].1 - corners[0].1).norm() > SHORT_MM {
            let [a, b] = [corners[0], corners[1]];
            let middle = (0.5 * (a.0 + b.0), nalgebra::center(&a.1, &b.1));
            self.chords(&[a, middle], aim);
            self.chords(&[middle, b], aim);
        } else {
            self.triangles([corners[0], corners[1]], &bounds, aim);
        }
    }

    /// How much the body has to be raised at most to be clear of a box of the model on a box of tips; anything where that
    /// is less than is `of_interest`.
    fn raise(&self, model: &Aabb, tips: &Aabb, clearance_mm: f64, of_interest: f64) -> f64 {
        let beside =
            |axis: usize| (model.min[axis] - tips.max[axis]).max(tips.min[axis] - model.max[axis]).max(0.0);
        let height = model.max.z - tips.min.z;
        // Most of the model is lower than that anyway.
        if self.body.iter().all(|f| height + clearance_mm - f.low <= of_interest) {
            return f64::NEG_INFINITY;
        }
        let (x, y) = (beside(0), beside(1));
        let from_axis = (x * x + y * y).sqrt();
        let one = |f: &Frustum| f.raise(height, from_axis, clearance_mm);
        self.body.iter().map(one).fold(f64::NEG_INFINITY, f64::max)
    }

    fn concerns(&self, model: &Aabb, tips: &Aabb, aim: &impl Aim) -> bool {
        let widened = aim.clearance_mm() + self.patches.view.worst_deviation_mm();
        self.raise(model, tips, widened, aim.raised_mm()) > aim.raised_mm()
    }

    fn is_clear(&self, tips: &Aabb, aim: &impl Aim) -> bool {
        let mut clear = true;
        self.patches.view.visit(
            |bounds| self.concerns(bounds, tips, aim),
            |i| {
                let bounds = box_of(&self.patches.view.corners(i));
                if self.concerns(&bounds, tips, aim) {
                    clear = false;
                    return ControlFlow::Break(());
                }
                ControlFlow::Continue(())
            },
        );
        clear
    }

    fn triangles(&self, ends: [(f64, Point3); 2], tips: &Aabb, aim: &mut impl Aim) {
        let view = self.patches.view;
        let mut found: Vec<(f64, usize)> = Vec::new();
        let widened = aim.clearance_mm() + view.worst_deviation_mm();
        let raised = aim.raised_mm();
        view.visit(
            |bounds| self.raise(bounds, tips, widened, raised) > raised,
            |i| {
                let raise = self.raise(&box_of(&view.corners(i)), tips, widened, raised);
                if raise > raised {
                    found.push((raise, i));
                }
                ControlFlow::Continue(())
            },
        );
        // What is worst leaves the least to be looked at after it.
        found.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (raise, triangle) in found {
            if aim.settled() {
                return;
            }
            if raise > aim.raised_mm() {
                self.patch(&self.patches.whole(triangle), ends, aim);
            }
        }
    }

    fn patch(&self, patch: &Patch, ends: [(f64, Point3); 2], aim: &mut impl Aim) {
        if aim.settled() {
            return;
        }
        let margin_mm = patch.deviation_mm + CHORD_MM;
        let wanted = aim.clearance_mm() + margin_mm;
        let tips = Aabb::of([&ends[0].1, &ends[1].1]);
        if self.raise(&box_of(&patch.corners), &tips, wanted, aim.raised_mm()) <= aim.raised_mm() {
            return;
        }
        let prism = Prism::new(&patch.corners, &ends[0].1, &ends[1].1);
        // Beside a cylinder the search finds next to nothing that a glance at smaller pieces does not.
        let glances = patch.is_large();
        let clear = |f: &Frustum| match glances && f.is_cylinder() {
            true => prism.keeps_at_a_glance(f, aim.raised_mm(), wanted),
            false => prism.keeps(f, aim.raised_mm(), wanted),
        };
        if self.body.iter().all(clear) {
            return;
        }
        match self.patches.quarters(patch, aim.fine_mm()) {
            Some(quarters) => quarters.iter().for_each(|q| self.patch(q, ends, aim)),
            None => aim.meet(&Meeting { body: self.body, prism: &prism, patch, margin_mm, ends }),
        }
    }
}

/// The box of a triangle; there are very many of them.
fn box_of([a, b, c]: &[Point3; 3]) -> Aabb {
    Aabb { min: a.inf(b).inf(c), max: a.sup(b).sup(c) }
}
