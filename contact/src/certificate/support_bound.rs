//! The lower bound that a rival contact must exceed: below the tangent plane of the best contact,
//! raised by `t² / 2R` at a distance `t`, nothing can hold the ball higher.

use claymill_nurbs::{BRANCHES, Boxes, Point3, Vector3};

/// What something must rise above to hold the ball up higher than the best contact found so far.
///
/// Let that ball touch the plane `normal · q = level` in `touch`. It and all places above it make a convex body that
/// stands on the plane, and whose lower side is the ball's within `R·n_z` of `touch`: so at a distance `t` along the
/// plane it is at least `min(t, R·n_z)² / 2R` above it, and what does not rise to that cannot hold the ball up.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SupportBound {
    /// Height of the centre.
    pub(crate) z: f64,
    normal: Vector3,
    level: f64,
    touch: [f64; 2],
    /// `R·n_z`.
    reach_mm: f64,
    diameter_mm: f64,
}

impl SupportBound {
    /// Below everything: no plane at all.
    pub(crate) const NONE: SupportBound = SupportBound {
        z: f64::NEG_INFINITY,
        normal: Vector3::new(0.0, 0.0, 0.0),
        level: f64::NEG_INFINITY,
        touch: [0.0; 2],
        reach_mm: 0.0,
        diameter_mm: 0.0,
    };

    /// Above everything.
    pub(crate) const ALL: SupportBound =
        SupportBound { z: f64::INFINITY, level: f64::INFINITY, ..SupportBound::NONE };

    /// The floor of a ball that rests with its centre here, raised by `by`.
    pub(crate) fn under(centre: &Point3, normal: &Vector3, radius_mm: f64, by: f64) -> Self {
        let z = centre.z + by;
        if normal.z < 0.0 {
            return SupportBound { z, ..SupportBound::NONE };
        }
        let touch = [centre.x - radius_mm * normal.x, centre.y - radius_mm * normal.y];
        let level = normal.dot(&centre.coords) - radius_mm + by * normal.z;
        SupportBound {
            z,
            normal: *normal,
            level,
            touch,
            reach_mm: radius_mm * normal.z,
            diameter_mm: 2.0 * radius_mm,
        }
    }

    /// Whether what rises to `height` above the plane and lies in these ranges of x and y cannot hold the ball up.
    #[inline(always)]
    fn clears(&self, height: f64, x: [f64; 2], y: [f64; 2]) -> bool {
        let dx = larger(larger(x[0] - self.touch[0], self.touch[0] - x[1]), 0.0);
        let dy = larger(larger(y[0] - self.touch[1], self.touch[1] - y[1]), 0.0);
        // Along the plane it is no nearer than this, as it is no higher than `height`.
        let along = (dx * dx + dy * dy).sqrt() - height;
        let along = if along < self.reach_mm { along } else { self.reach_mm };
        (height <= 0.0) | ((along > 0.0) & (height * self.diameter_mm <= along * along))
    }

    /// Whether nothing in a box can hold the ball up, for eight boxes side by side.
    #[inline(always)]
    pub(crate) fn clears_boxes(&self, Boxes { min, max }: &Boxes) -> [bool; BRANCHES] {
        let n = &self.normal;
        // The corners that rise highest above the plane.
        let [far_x, far_y] = [0, 1].map(|axis| if n[axis] > 0.0 { &max[axis] } else { &min[axis] });
        std::array::from_fn(|k| {
            let height = n.x * f64::from(far_x[k]) + n.y * f64::from(far_y[k]) + n.z * f64::from(max[2][k]);
            let range = |axis: usize| [f64::from(min[axis][k]), f64::from(max[axis][k])];
            self.clears(height - self.level, range(0), range(1))
        })
    }

    /// Whether nothing within `delta` of these points' hull can hold the ball up.
    pub(crate) fn clears_hull(&self, points: &[Point3], delta: f64) -> bool {
        let mut top = f64::NEG_INFINITY;
        let (mut x, mut y) = ([f64::INFINITY, f64::NEG_INFINITY], [f64::INFINITY, f64::NEG_INFINITY]);
        for p in points {
            top = larger(top, self.normal.dot(&p.coords));
            x = [x[0].min(p.x), x[1].max(p.x)];
            y = [y[0].min(p.y), y[1].max(p.y)];
        }
        let widened = |[low, high]: [f64; 2]| [low - delta, high + delta];
        self.clears(top + delta - self.level, widened(x), widened(y))
    }

    /// [`clears_hull`](Self::clears_hull) of eight triangles side by side.
    #[inline(always)]
    pub(crate) fn clears_eight(&self, hulls: &Hulls) -> [bool; 8] {
        let mut clear = [true; 8];
        for k in 0..8 {
            let [x, y] = [0, 1].map(|axis| [hulls.low[axis][k], hulls.high[axis][k]]);
            clear[k] = self.clears(hulls.top(&self.normal, k) - self.level, x, y);
        }
        clear
    }
}

/// Eight triangles (or segments, with a corner twice), a number a triangle for everything.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct Hulls {
    corners: [[[f64; 8]; 3]; 3],
    /// Ranges of coordinates with `delta` around.
    pub(crate) low: [[f64; 8]; 3],
    pub(crate) high: [[f64; 8]; 3],
    delta: [f64; 8],
}

impl Hulls {
    /// Nothing that could hold a ball up.
    pub(crate) const NONE: Hulls = Hulls {
        corners: [[[0.0; 8]; 3]; 3],
        low: [[0.0; 8]; 3],
        high: [[0.0; 8]; 3],
        delta: [f64::NEG_INFINITY; 8],
    };

    /// How far the one in place `k` reaches along a unit vector.
    #[inline(always)]
    pub(crate) fn top(&self, along: &Vector3, k: usize) -> f64 {
        let of = |p: &[[f64; 8]; 3]| along.x * p[0][k] + along.y * p[1][k] + along.z * p[2][k];
        larger(larger(of(&self.corners[0]), of(&self.corners[1])), of(&self.corners[2])) + self.delta[k]
    }

    /// Puts what lies within `delta` of three points' hull in place `k`.
    pub(crate) fn put(&mut self, k: usize, points: [Point3; 3], delta: f64) {
        for (corner, p) in self.corners.iter_mut().zip(&points) {
            (0..3).for_each(|axis| corner[axis][k] = p[axis]);
        }
        for axis in 0..3 {
            let [a, b, c] = points.map(|p| p[axis]);
            self.low[axis][k] = a.min(b).min(c) - delta;
            self.high[axis][k] = a.max(b).max(c) + delta;
        }
        self.delta[k] = delta;
    }
}

/// The larger one; unlike `f64::max` without a thought for what is no number.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
