//! Views of a vehicle by name, direction or eye point, and the camera that frames a scene:
//! orthographic or perspective projection, in pixels.

use claymill_nurbs::{Aabb, Point3, Vector3};
use nalgebra::Matrix4;

/// Which model axes point up and to the vehicle's front: they give `front`, `left`, … their meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// Unit vector toward the roof.
    pub up: Vector3,
    /// Unit vector from rear to front.
    pub forward: Vector3,
}

impl Default for Axes {
    /// Up `+z`, front `-y`.
    fn default() -> Self {
        Axes { up: Vector3::z(), forward: -Vector3::y() }
    }
}

impl Axes {
    /// From axis names such as `+z` and `-y`; `None` when a name is unknown or both name the same axis.
    #[must_use]
    pub fn parse(up: &str, forward: &str) -> Option<Self> {
        let axes = Axes { up: axis(up)?, forward: axis(forward)? };
        (axes.up.dot(&axes.forward) == 0.0).then_some(axes)
    }

    fn left(&self) -> Vector3 {
        self.up.cross(&self.forward)
    }
}

fn axis(name: &str) -> Option<Vector3> {
    let (sign, letter) = match name.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, name.strip_prefix('+').unwrap_or(name)),
    };
    Some(match letter {
        "x" => Vector3::x() * sign,
        "y" => Vector3::y() * sign,
        "z" => Vector3::z() * sign,
        _ => return None,
    })
}

/// From where, and how, the scene is looked at. The camera frames the scene by itself unless it has a stand.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Name for captions.
    pub name: String,
    /// Direction of sight, from the eye into the scene; any length.
    pub direction: Vector3,
    /// What points up in the picture.
    pub up: Vector3,
    /// Full vertical opening angle of a perspective camera; `None` is orthographic.
    pub opening_deg: Option<f64>,
    /// Look only at this box instead of the whole scene.
    pub focus: Option<Aabb>,
    /// Eye and target of a camera that stands where it is told and frames nothing; the opening is then 40
    /// degrees unless told.
    pub stand: Option<[Point3; 2]>,
    /// Free border as a fraction of the picture's shorter side.
    pub margin: f64,
}

impl View {
    /// Looks along `direction` with `up` upwards.
    #[must_use]
    pub fn looking(name: &str, direction: Vector3, up: Vector3) -> Self {
        let name = name.to_owned();
        View { name, direction, up, opening_deg: None, focus: None, stand: None, margin: 0.06 }
    }

    /// From `azimuth_deg` around the vehicle (0 in front, 90 on its left) and `elevation_deg` above it,
    /// with the mild perspective of [`View::iso`].
    #[must_use]
    pub fn around(axes: &Axes, azimuth_deg: f64, elevation_deg: f64) -> Self {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let level = axes.forward * cos + axes.left() * sin;
        let (sin, cos) = elevation_deg.to_radians().sin_cos();
        // Leaning with the sight, so that it is defined from straight above too.
        let up = axes.up * cos - level * sin;
        View { opening_deg: Some(22.0), ..View::looking("camera", -(level * cos + axes.up * sin), up) }
    }

    /// From `eye` toward `target`, mm; `None` when they are one point.
    #[must_use]
    pub fn standing(axes: &Axes, eye: Point3, target: Point3) -> Option<Self> {
        let direction = (target - eye).try_normalize(1e-6)?;
        Some(View { stand: Some([eye, target]), ..View::looking("camera", direction, axes.up) })
    }

    /// From in front, above and the left, with a mild perspective.
    #[must_use]
    pub fn iso(axes: &Axes) -> Self {
        let direction = -(axes.forward * 0.75 + axes.left() * 0.95 + axes.up * 0.62);
        View { opening_deg: Some(22.0), ..View::looking("iso", direction, axes.up) }
    }

    /// From above, front to the left.
    #[must_use]
    pub fn top(axes: &Axes) -> Self {
        View::looking("top", -axes.up, -axes.left())
    }

    /// From the vehicle's left: front to the left.
    #[must_use]
    pub fn left(axes: &Axes) -> Self {
        View::looking("left", -axes.left(), axes.up)
    }

    /// From the vehicle's right: front to the right.
    #[must_use]
    pub fn right(axes: &Axes) -> Self {
        View::looking("right", axes.left(), axes.up)
    }

    /// From in front.
    #[must_use]
    pub fn front(axes: &Axes) -> Self {
        View::looking("front", -axes.forward, axes.up)
    }

    /// From behind.
    #[must_use]
    pub fn rear(axes: &Axes) -> Self {
        View::looking("rear", axes.forward, axes.up)
    }

    /// The view with this name: `iso`, `top`, `left` (also `side`), `right`, `front` or `rear`.
    #[must_use]
    pub fn named(name: &str, axes: &Axes) -> Option<Self> {
        Some(match name {
            "iso" => View::iso(axes),
            "top" => View::top(axes),
            "left" | "side" => View::left(axes),
            "right" => View::right(axes),
            "front" => View::front(axes),
            "rear" => View::rear(axes),
            _ => return None,
        })
    }

    /// The same view of a detail.
    #[must_use]
    pub fn focused(self, name: &str, focus: Aabb) -> Self {
        View { name: name.to_owned(), focus: Some(focus), ..self }
    }
}

/// A view applied to a scene and a picture size: maps model points to pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    right: Vector3,
    up: Vector3,
    forward: Vector3,
    target: Point3,
    /// Distance of the eye from the target plane, mm; `None` is orthographic.
    eye_mm: Option<f64>,
    mm_per_px: f64,
    near_mm: f64,
    far_mm: f64,
    size: [u32; 2],
}

/// Smallest extent that is framed, mm: keeps a scene of one point from being magnified without bound.
const SMALLEST_EXTENT_MM: f64 = 1e-3;

/// Opening angle of a standing camera.
const STANDING_OPENING_DEG: f64 = 40.0;

impl Camera {
    /// Frames `points` (and clips at their depth range) for a picture of `size` pixels; `points` must not
    /// be empty.
    #[must_use]
    pub fn frame(view: &View, points: impl Iterator<Item = Point3> + Clone, size: [u32; 2]) -> Self {
        let forward = view.direction.try_normalize(0.0).unwrap_or(-Vector3::z());
        let right = [view.up, Vector3::z(), Vector3::y()]
            .iter()
            .find_map(|up| forward.cross(up).try_normalize(1e-9))
            .unwrap_or(Vector3::x());
        let up = right.cross(&forward);
        let basis =
            |p: &Point3| Vector3::new(right.dot(&p.coords), up.dot(&p.coords), forward.dot(&p.coords));

        let extent = |points: &mut dyn Iterator<Item = Point3>| {
            points.fold(Aabb::empty(), |mut b, p| {
                b.add(&Point3::from(basis(&p)));
                b
            })
        };
        let all = extent(&mut points.clone());
        let framed = view.focus.as_ref().map_or(all, |focus| extent(&mut focus.vertices().into_iter()));
        let centre = view.stand.map_or_else(|| framed.centre(), |[_, target]| Point3::from(basis(&target)));
        let target = Point3::from(right * centre.x + up * centre.y + forward * centre.z);

        let shorter = f64::from(size[0].min(size[1]));
        let border_px = (view.margin.clamp(0.0, 0.45) * shorter).min(0.5 * shorter - 0.5);
        let half_px = [0, 1].map(|i| 0.5 * f64::from(size[i]) - border_px);
        let half_mm = (framed.max - framed.min) * 0.5;
        let mut mm_per_px = (half_mm.x / half_px[0]).max(half_mm.y / half_px[1]);
        mm_per_px = mm_per_px.max(SMALLEST_EXTENT_MM / shorter);

        let (mut near_mm, mut far_mm) = (all.min.z - centre.z, all.max.z - centre.z);
        let pad = 0.01 * (far_mm - near_mm) + mm_per_px * 8.0;
        near_mm -= pad;
        far_mm += pad;
        let mut eye_mm = None;
        if let Some(opening_deg) = view.opening_deg.or(view.stand.map(|_| STANDING_OPENING_DEG)) {
            let tan_per_px =
                (0.5 * opening_deg.clamp(1.0, 120.0).to_radians()).tan() / (0.5 * f64::from(size[1]));
            // The eye stands just far enough back for every framed point to fall inside the border.
            let needed = |p: &Point3| {
                let q = basis(p) - centre.coords;
                (q.x.abs() / half_px[0]).max(q.y.abs() / half_px[1]) / tan_per_px - q.z
            };
            let distance = match (&view.stand, &view.focus) {
                (Some([eye, target]), _) => (target - eye).norm(),
                (None, Some(focus)) => focus.vertices().iter().map(needed).fold(0.0, f64::max),
                (None, None) => points.map(|p| needed(&p)).fold(0.0, f64::max),
            }
            .max(SMALLEST_EXTENT_MM / tan_per_px / shorter);
            mm_per_px = distance * tan_per_px;
            near_mm = near_mm.max(-0.98 * distance);
            // Nothing of the scene may be in front of the eye.
            far_mm = far_mm.max(near_mm + pad);
            eye_mm = Some(distance);
        }
        Camera { right, up, forward, target, eye_mm, mm_per_px, near_mm, far_mm, size }
    }

    /// Millimetres per pixel; for a perspective camera in the plane through the middle of the framed box.
    #[must_use]
    pub fn mm_per_px(&self) -> f64 {
        self.mm_per_px
    }

    /// Whether the scale is the same everywhere in the picture.
    #[must_use]
    pub fn is_orthographic(&self) -> bool {
        self.eye_mm.is_none()
    }

    /// Pixel coordinates of `p` (origin at the top left corner, pixel centres at halves); `None` behind the
    /// near plane.
    #[must_use]
    pub fn project(&self, p: &Point3) -> Option<[f64; 2]> {
        let q = p - self.target;
        let depth = self.forward.dot(&q);
        if depth < self.near_mm {
            return None;
        }
        let scale = match self.eye_mm {
            Some(eye) => eye / (eye + depth) / self.mm_per_px,
            None => 1.0 / self.mm_per_px,
        };
        let [width, height] = self.size.map(f64::from);
        Some([0.5 * width + self.right.dot(&q) * scale, 0.5 * height - self.up.dot(&q) * scale])
    }

    /// Grows towards the eye, and is straight over the picture of a plane.
    pub(crate) fn nearness(&self, p: &Point3) -> f64 {
        let depth = self.forward.dot(&(p - self.target));
        self.eye_mm.map_or(-depth, |eye| 1.0 / (eye + depth))
    }

    /// The place seen at a pixel of an orthographic picture, at a [`Camera::nearness`].
    pub(crate) fn unprojected(&self, [x, y]: [f64; 2], nearness: f64) -> Point3 {
        let [width, height] = self.size.map(f64::from);
        let (right, up) = ((x - 0.5 * width) * self.mm_per_px, (0.5 * height - y) * self.mm_per_px);
        self.target + self.right * right + self.up * up - self.forward * nearness
    }

    /// Direction of `v` in the picture: right, up, toward the eye.
    #[must_use]
    pub fn in_picture(&self, v: &Vector3) -> Vector3 {
        Vector3::new(self.right.dot(v), self.up.dot(v), -self.forward.dot(v))
    }

    /// The camera's right, up and backward vectors.
    pub(crate) fn basis(&self) -> [Vector3; 3] {
        [self.right, self.up, -self.forward]
    }

    /// Homogeneous eye position relative to `origin`: a point for a perspective camera, the direction
    /// toward the eye (w = 0) for an orthographic one.
    pub(crate) fn eye(&self, origin: &Point3) -> [f64; 4] {
        match self.eye_mm {
            Some(eye) => {
                let e = self.target - self.forward * eye - origin;
                [e.x, e.y, e.z, 1.0]
            }
            None => [-self.forward.x, -self.forward.y, -self.forward.z, 0.0],
        }
    }

    /// Depth in mm from depth-buffer value `d`: `(a·d + b) / (c·d + 1)`, here `[a, b, c]`.
    pub(crate) fn depth_decode(&self) -> [f64; 3] {
        let (n, f) = (self.near_mm, self.far_mm);
        match self.eye_mm {
            None => [f - n, n, 0.0],
            Some(e) => {
                // d = F/(F−N)·(1 − N/z) with N, F, z measured from the eye.
                let (near, far) = (n + e, f + e);
                let c = -(far - near) / far;
                [-e * c, near - e, c]
            }
        }
    }

    /// Clip-space matrix for points relative to `origin` (depth 0 near to 1 far).
    pub(crate) fn clip_matrix(&self, origin: &Point3) -> Matrix4<f64> {
        let [width, height] = self.size.map(f64::from);
        let (r, u, f) = (self.right, self.up, self.forward);
        let offset = origin - self.target;
        let view = Matrix4::new(
            r.x,
            r.y,
            r.z,
            r.dot(&offset), //
            u.x,
            u.y,
            u.z,
            u.dot(&offset), //
            f.x,
            f.y,
            f.z,
            f.dot(&offset), //
            0.0,
            0.0,
            0.0,
            1.0,
        );
        let (sx, sy) = (2.0 / (width * self.mm_per_px), 2.0 / (height * self.mm_per_px));
        let span = self.far_mm - self.near_mm;
        let projection = match self.eye_mm {
            None => Matrix4::new(
                sx,
                0.0,
                0.0,
                0.0, //
                0.0,
                sy,
                0.0,
                0.0, //
                0.0,
                0.0,
                1.0 / span,
                -self.near_mm / span, //
                0.0,
                0.0,
                0.0,
                1.0,
            ),
            Some(eye) => {
                let (near, far) = (self.near_mm + eye, self.far_mm + eye);
                let (a, b) = (far / span, -far * near / span);
                // w = z + eye; x and y are to keep their scale at z = 0, hence the factor.
                Matrix4::new(
                    sx * eye,
                    0.0,
                    0.0,
                    0.0, //
                    0.0,
                    sy * eye,
                    0.0,
                    0.0, //
                    0.0,
                    0.0,
                    a,
                    a * eye + b, //
                    0.0,
                    0.0,
                    1.0,
                    eye,
                )
            }
        };
        projection * view
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Vec<Point3> {
        Aabb::of_corners([1000.0, -50.0, 3.0, 1100.0, 70.0, 40.0]).vertices().to_vec()
    }

    #[test]
    fn framing_leaves_exactly_the_margin() {
        for view in [View::top(&Axes::default()), View::iso(&Axes::default()), View::left(&Axes::default())] {
            let camera = Camera::frame(&view, cube().into_iter(), [640, 480]);
            let px: Vec<_> = cube().iter().map(|p| camera.project(p).unwrap()).collect();
            let border = 0.06 * 480.0;
            let slack = |i: usize, size: f64| {
                let low = px.iter().map(|p| p[i]).fold(f64::MAX, f64::min);
                let high = px.iter().map(|p| size - p[i]).fold(f64::MAX, f64::min);
                low.min(high)
            };
            let tightest = slack(0, 640.0).min(slack(1, 480.0));
            approx::assert_abs_diff_eq!(tightest, border, epsilon = 1e-6);
        }
    }

    #[test]
    fn the_clip_matrix_and_the_exact_projection_agree() {
        let focus = Aabb { min: Point3::new(1010.0, -10.0, 10.0), max: Point3::new(1030.0, 10.0, 20.0) };
        let iso = View::iso(&Axes::default());
        for view in [View::rear(&Axes::default()), iso.clone(), iso.focused("detail", focus)] {
            let camera = Camera::frame(&view, cube().into_iter(), [640, 480]);
            let origin = Point3::new(1050.0, 0.0, 20.0);
            let m = camera.clip_matrix(&origin);
            let [a, b, c] = camera.depth_decode();
            for p in cube() {
                let clip = m * (p - origin).push(1.0);
                let ndc = clip.xyz() / clip.w;
                let Some(px) = camera.project(&p) else { continue };
                approx::assert_abs_diff_eq!(px[0], 320.0 * (1.0 + ndc.x), epsilon = 1e-8);
                approx::assert_abs_diff_eq!(px[1], 240.0 * (1.0 - ndc.y), epsilon = 1e-8);
                assert!((0.0..=1.0).contains(&ndc.z), "{ndc}");
                let depth = camera.forward.dot(&(p - camera.target));
                approx::assert_abs_diff_eq!((a * ndc.z + b) / (c * ndc.z + 1.0), depth, epsilon = 1e-6);
            }
        }
    }

    #[test]
    fn cameras_around_and_standing_look_from_where_they_are_told() {
        let axes = Axes::default();
        let frame = |view: &View| Camera::frame(view, cube().into_iter(), [640, 480]);
        for (azimuth, elevation, like) in [(0.0, 0.0, "front"), (90.0, 0.0, "left"), (180.0, 0.0, "rear")] {
            let named = View::named(like, &axes).unwrap();
            let around = View::around(&axes, azimuth, elevation);
            approx::assert_abs_diff_eq!(around.direction, named.direction, epsilon = 1e-12);
        }
        let above = frame(&View::around(&axes, 90.0, 90.0));
        approx::assert_abs_diff_eq!(above.in_picture(&axes.up), Vector3::z(), epsilon = 1e-12);
        let (eye, target) = (Point3::new(900.0, -400.0, 300.0), Point3::new(1050.0, 0.0, 20.0));
        let camera = frame(&View::standing(&axes, eye, target).unwrap());
        let at = camera.project(&target).unwrap();
        approx::assert_abs_diff_eq!(at[0], 320.0, epsilon = 1e-9);
        approx::assert_abs_diff_eq!(at[1], 240.0, epsilon = 1e-9);
        let seen = camera.eye(&Point3::origin());
        approx::assert_abs_diff_eq!(Point3::new(seen[0], seen[1], seen[2]), eye, epsilon = 1e-9);
        assert_eq!(View::standing(&axes, eye, eye), None);
    }

    #[test]
    fn vehicle_views_show_what_their_names_say() {
        let axes = Axes::parse("+z", "-y").unwrap();
        let front_of =
            |view: View| Camera::frame(&view, cube().into_iter(), [640, 480]).in_picture(&axes.forward);
        assert_eq!(front_of(View::left(&axes)), -Vector3::x());
        assert_eq!(front_of(View::top(&axes)), -Vector3::x());
        assert_eq!(front_of(View::right(&axes)), Vector3::x());
        assert_eq!(front_of(View::front(&axes)), Vector3::z());
        assert_eq!(front_of(View::rear(&axes)), -Vector3::z());
        assert_eq!(Axes::parse("+z", "-z"), None);
    }
}
