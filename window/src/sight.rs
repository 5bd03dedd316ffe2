//! The camera that is turned by hand.

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_viewer::View;
use nalgebra::{Matrix4, Rotation3, Unit};

/// Free border around what is framed, as a part of the shorter side.
const MARGIN: f64 = 0.06;
/// Opening of the perspective camera, degrees.
const OPENING_DEG: f64 = 22.0;
/// Turn a pixel, radians: half a turn takes about 600 px.
const TURN_PER_PX: f64 = 0.0052;
/// How near to straight up or down the camera may look, radians.
const STEEPEST: f64 = 0.012;
/// Scales between which everything of a vehicle can be seen, mm a pixel.
const FINEST_MM_PER_PX: f64 = 1e-5;
const COARSEST_MM_PER_PX: f64 = 1e3;

/// Where the eye is and what it sees: model points to pixels and back.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    target: Point3,
    forward: Vector3,
    up: Vector3,
    /// In the plane through the target.
    mm_per_px: f64,
    perspective: bool,
    /// What stays upright while the camera is turned.
    upright: Vector3,
    size: [f64; 2],
}

/// A line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts, before everything that can be seen, mm.
    pub from: Point3,
    /// Its direction (unit).
    pub along: Vector3,
}

impl Sight {
    /// Looks as `view` does, at all of `points`; `upright` stays up when the camera is turned.
    #[must_use]
    pub fn new(view: &View, upright: Vector3, points: &[Point3], size: [u32; 2]) -> Self {
        let mut sight = Sight {
            target: Point3::origin(),
            forward: Vector3::x(),
            up: Vector3::z(),
            mm_per_px: 1.0,
            perspective: true,
            upright,
            size: size.map(|s| f64::from(s.max(1))),
        };
        sight.look(view, points);
        sight
    }

    /// Looks as `view` does, at all of `points`.
    pub fn look(&mut self, view: &View, points: &[Point3]) {
        self.forward = view.direction.try_normalize(0.0).unwrap_or(-Vector3::z());
        let right = [view.up, self.upright, Vector3::z(), Vector3::y()]
            .iter()
            .find_map(|up| self.forward.cross(up).try_normalize(1e-9))
            .unwrap_or(Vector3::x());
        self.up = right.cross(&self.forward);
        self.fit(points);
    }

    /// Frames `points` without turning.
    pub fn fit(&mut self, points: &[Point3]) {
        let (right, up, forward) = (self.right(), self.up, self.forward);
        let basis =
            |p: &Point3| Vector3::new(right.dot(&p.coords), up.dot(&p.coords), forward.dot(&p.coords));
        let seen: Vec<Point3> = points.iter().map(|p| Point3::from(basis(p))).collect();
        let extent = Aabb::of(&seen);
        if extent.is_empty() {
            return;
        }
        let centre = extent.centre();
        self.target = Point3::from(right * centre.x + up * centre.y + forward * centre.z);
        let border = MARGIN * self.size[0].min(self.size[1]);
        let half_px = self.size.map(|s| (0.5 * s - border).max(1.0));
        let half = (extent.max - extent.min) * 0.5;
        let mut scale = (half.x / half_px[0]).max(half.y / half_px[1]);
        if self.perspective {
            let tan = self.tan_per_px();
            let needed = |p: &Point3| {
                let q = p - centre;
                (q.x.abs() / half_px[0]).max(q.y.abs() / half_px[1]) / tan - q.z
            };
            scale = seen.iter().map(needed).fold(0.0, f64::max) * tan;
        }
        self.mm_per_px = scale.clamp(FINEST_MM_PER_PX, COARSEST_MM_PER_PX);
    }

    /// Takes over a new size of the picture, pixels; what is in its middle stays there, at the same scale.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size.map(|s| f64::from(s.max(1)));
    }

    /// Size of the picture, pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size.map(|s| s as u32)
    }

    /// Switches between perspective and parallel projection; the scale at the target stays.
    pub fn set_perspective(&mut self, perspective: bool) {
        self.perspective = perspective;
    }

    /// Whether near things are larger.
    #[must_use]
    pub fn is_perspective(&self) -> bool {
        self.perspective
    }

    /// Turns about `pivot` by a drag of so many pixels; the upright stays upright.
    pub fn orbit(&mut self, pivot: &Point3, drag_px: [f64; 2]) {
        let around =
            Rotation3::from_axis_angle(&Unit::new_normalize(self.upright), -drag_px[0] * TURN_PER_PX);
        let elevation = (-self.forward.dot(&self.upright)).clamp(-1.0, 1.0).asin();
        let limit = std::f64::consts::FRAC_PI_2 - STEEPEST;
        // A view from straight above may be left, not passed.
        let wanted = (elevation + drag_px[1] * TURN_PER_PX).clamp(-limit, limit);
        let over = Rotation3::from_axis_angle(&Unit::new_normalize(self.right()), elevation - wanted);
        let turn = around * over;
        self.forward = (turn * self.forward).normalize();
        let level = self.forward.cross(&self.upright).try_normalize(1e-9);
        self.up = level.map_or_else(|| turn * self.up, |right| right.cross(&self.forward)).normalize();
        self.target = pivot + turn * (self.target - pivot);
    }

    /// Moves the picture by so many pixels; `at` is what was taken hold of and stays under the pointer.
    pub fn pan(&mut self, at: &Point3, drag_px: [f64; 2]) {
        let scale = self.mm_per_px_at(at);
        self.target += self.up * (drag_px[1] * scale) - self.right() * (drag_px[0] * scale);
    }

    /// Makes everything `factor` times as large in the picture; `at` keeps its place there.
    pub fn zoom(&mut self, at: &Point3, factor: f64) {
        let scale = (self.mm_per_px / factor).clamp(FINEST_MM_PER_PX, COARSEST_MM_PER_PX);
        let share = scale / self.mm_per_px;
        self.target = at + (self.target - at) * share;
        self.mm_per_px = scale;
    }

    /// Unit vector to the right in the picture.
    #[must_use]
    pub fn right(&self) -> Vector3 {
        self.forward.cross(&self.up)
    }

    /// Unit vector upwards in the picture.
    #[must_use]
    pub fn up(&self) -> Vector3 {
        self.up
    }

    /// Unit vector into the picture.
    #[must_use]
    pub fn forward(&self) -> Vector3 {
        self.forward
    }

    /// What is in the middle of the picture.
    #[must_use]
    pub fn target(&self) -> Point3 {
        self.target
    }

    /// Scale in the plane through the target, mm a pixel.
    #[must_use]
    pub fn mm_per_px(&self) -> f64 {
        self.mm_per_px
    }

    /// Scale at `p`, mm a pixel.
    #[must_use]
    pub fn mm_per_px_at(&self, p: &Point3) -> f64 {
        match self.eye_mm() {
            Some(eye) => self.mm_per_px * ((eye + self.depth(p)) / eye).max(1e-3),
            None => self.mm_per_px,
        }
    }

    /// Distance of `p` behind the plane through the target, mm.
    #[must_use]
    pub fn depth(&self, p: &Point3) -> f64 {
        self.forward.dot(&(p - self.target))
    }

    /// Where `p` is in the picture, pixels from the top left; `None` behind the eye.
    #[must_use]
    pub fn project(&self, p: &Point3) -> Option<[f64; 2]> {
        let q = p - self.target;
        let depth = self.forward.dot(&q);
        let scale = match self.eye_mm() {
            Some(eye) if eye + depth <= 0.01 * eye => return None,
            Some(eye) => eye / (eye + depth) / self.mm_per_px,
            None => 1.0 / self.mm_per_px,
        };
        Some([
            0.5 * self.size[0] + self.right().dot(&q) * scale,
            0.5 * self.size[1] - self.up.dot(&q) * scale,
        ])
    }

    /// The line of sight through a place of the picture; parallel ones start `reach_mm` before the target.
    #[must_use]
    pub fn ray(&self, at_px: [f64; 2], reach_mm: f64) -> Ray {
        let in_plane = self.in_target_plane(at_px);
        match self.eye_mm() {
            Some(eye) => {
                let from = self.target - self.forward * eye;
                Ray { from, along: (in_plane - from).normalize() }
            }
            None => Ray { from: in_plane - self.forward * reach_mm, along: self.forward },
        }
    }

    /// The point of the plane through the target that is seen at a place of the picture.
    #[must_use]
    pub fn in_target_plane(&self, at_px: [f64; 2]) -> Point3 {
        let x = (at_px[0] - 0.5 * self.size[0]) * self.mm_per_px;
        let y = (0.5 * self.size[1] - at_px[1]) * self.mm_per_px;
        self.target + self.right() * x + self.up * y
    }

    /// Distance of the eye from the target, mm; `None` for parallel sight.
    pub(crate) fn eye_mm(&self) -> Option<f64> {
        self.perspective.then(|| self.mm_per_px / self.tan_per_px())
    }

    fn tan_per_px(&self) -> f64 {
        (0.5 * OPENING_DEG.to_radians()).tan() / (0.5 * self.size[1])
    }

    /// Near and far plane around everything in `bounds`, as distances behind the target plane, mm.
    pub(crate) fn depth_range(&self, bounds: &Aabb) -> [f64; 2] {
        let (half, middle) = ((bounds.max - bounds.min) * 0.5, self.depth(&bounds.centre()));
        let reach =
            (0..3).map(|i| (self.forward[i] * half[i]).abs()).sum::<f64>() * 1.02 + 8.0 * self.mm_per_px;
        let near = self.eye_mm().map_or(middle - reach, |eye| (middle - reach).max(-0.98 * eye));
        [near, (middle + reach).max(near + reach.max(1e-6))]
    }

    /// Clip-space matrix for points relative to `origin`; depth 0 at the near plane to 1 at the far one.
    pub(crate) fn clip_matrix(&self, origin: &Point3, [near, far]: [f64; 2]) -> Matrix4<f64> {
        let (r, u, f) = (self.right(), self.up, self.forward);
        let offset = origin - self.target;
        let row = |v: &Vector3| [v.x, v.y, v.z, v.dot(&offset)];
        let view = Matrix4::from_row_slice(&[row(&r), row(&u), row(&f), [0.0, 0.0, 0.0, 1.0]].concat());
        let [sx, sy] = self.size.map(|s| 2.0 / (s * self.mm_per_px));
        let span = far - near;
        let mut projection = Matrix4::zeros();
        match self.eye_mm() {
            None => {
                (projection[(0, 0)], projection[(1, 1)], projection[(2, 2)]) = (sx, sy, 1.0 / span);
                (projection[(2, 3)], projection[(3, 3)]) = (-near / span, 1.0);
            }
            Some(eye) => {
                // w = depth + eye, so that the scale at the target is the parallel one.
                let (a, b) = ((far + eye) / span, -(far + eye) * (near + eye) / span);
                (projection[(0, 0)], projection[(1, 1)]) = (sx * eye, sy * eye);
                (projection[(2, 2)], projection[(2, 3)]) = (a, a * eye + b);
                (projection[(3, 2)], projection[(3, 3)]) = (1.0, eye);
            }
        }
        projection * view
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use claymill_viewer::{Axes, Camera};

    const SIZE: [u32; 2] = [800, 500];

    fn corners() -> Vec<Point3> {
        let pick = |i: usize, bit: usize, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
        let corner =
            |i| Point3::new(pick(i, 0, 1000.0, 1400.0), pick(i, 1, -50.0, 70.0), pick(i, 2, 3.0, 90.0));
        (0..8).map(corner).collect()
    }

    fn sight(name: &str) -> Sight {
        let axes = Axes::default();
        Sight::new(&View::named(name, &axes).unwrap(), axes.up, &corners(), SIZE)
    }

    #[test]
    fn the_views_are_those_of_the_pictures() {
        for name in ["iso", "top", "left", "right", "front", "rear"] {
            let view = View::named(name, &Axes::default()).unwrap();
            let camera = Camera::frame(&view, corners().into_iter(), SIZE);
            let mut sight = sight(name);
            sight.set_perspective(view.opening_deg.is_some());
            sight.fit(&corners());
            for p in corners() {
                let (a, b) = (camera.project(&p).unwrap(), sight.project(&p).unwrap());
                assert_abs_diff_eq!(a[0], b[0], epsilon = 1e-6);
                assert_abs_diff_eq!(a[1], b[1], epsilon = 1e-6);
            }
        }
    }

    #[test]
    fn pixels_lead_back_along_their_rays_and_the_card_projects_likewise() {
        for perspective in [true, false] {
            let mut sight = sight("iso");
            sight.set_perspective(perspective);
            let bounds = Aabb::of(&corners());
            let range = sight.depth_range(&bounds);
            let matrix = sight.clip_matrix(&bounds.centre(), range);
            for p in corners() {
                let px = sight.project(&p).unwrap();
                let ray = sight.ray(px, 5000.0);
                let off = (p - ray.from).cross(&ray.along).norm();
                assert!(off < 1e-9, "{off}");
                let clip = matrix * (p - bounds.centre()).push(1.0);
                let ndc = clip.xyz() / clip.w;
                assert_abs_diff_eq!(px[0], 0.5 * f64::from(SIZE[0]) * (1.0 + ndc.x), epsilon = 1e-8);
                assert_abs_diff_eq!(px[1], 0.5 * f64::from(SIZE[1]) * (1.0 - ndc.y), epsilon = 1e-8);
                assert!((0.0..=1.0).contains(&ndc.z), "{ndc}");
            }
        }
    }

    #[test]
    fn zooming_and_panning_keep_the_point_under_the_pointer() {
        for perspective in [true, false] {
            let mut sight = sight("iso");
            sight.set_perspective(perspective);
            let p = Point3::new(1010.0, 60.0, 80.0);
            let before = sight.project(&p).unwrap();
            let scale = sight.mm_per_px_at(&p);
            sight.zoom(&p, 7.0);
            assert_abs_diff_eq!(sight.mm_per_px_at(&p), scale / 7.0, epsilon = 1e-9);
            sight.pan(&p, [31.0, -17.0]);
            let after = sight.project(&p).unwrap();
            assert_abs_diff_eq!(after[0], before[0] + 31.0, epsilon = 1e-6);
            assert_abs_diff_eq!(after[1], before[1] - 17.0, epsilon = 1e-6);
        }
    }

    #[test]
    fn the_pivot_stands_still_and_up_stays_up() {
        let mut sight = sight("top");
        let pivot = Point3::new(1300.0, 0.0, 50.0);
        let before = sight.project(&pivot).unwrap();
        for drag in [[3.0, -5.0], [400.0, -90.0], [-33.0, 900.0], [70.0, -2000.0]] {
            sight.orbit(&pivot, drag);
            let after = sight.project(&pivot).unwrap();
            assert_abs_diff_eq!(after[0], before[0], epsilon = 1e-6);
            assert_abs_diff_eq!(after[1], before[1], epsilon = 1e-6);
            assert!(sight.up().z >= 0.0 && sight.right().z.abs() < 1e-9, "{:?}", sight.up());
            assert_abs_diff_eq!(sight.forward().dot(&sight.up()), 0.0, epsilon = 1e-12);
        }
    }
}
