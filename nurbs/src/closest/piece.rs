//! Small pieces of a surface in frames of their own. Interval arithmetic on gradient and Hessian
//! shows where the squared distance from a point is convex or monotone.

use std::sync::Arc;

use nalgebra::Matrix3;

use super::interval::{Interval, dot};
use super::net::{Direction, JetRange, Net};
use super::rim::Chord;
use crate::leaf::Leaf;
use crate::{FaceId, Jet, Point3, Vector3};

/// A small piece of a face's surface in a frame of its own: axis `x` along `u`, axis `z` along the normal, so
/// that its box is thin. Its parameters `(s, t)` run over `[-½, ½]²`.
#[derive(Debug)]
pub(super) struct Piece {
    pub(super) face: FaceId,
    /// The rims that may run through the piece; if there are none, all of it belongs to the face.
    pub(super) chords: Box<[Chord]>,
    /// The exact piece, for cutting it further.
    pub(super) net: Net,

    origin: Point3,
    /// Rows are the axes.
    axes: Matrix3<f64>,
    range: JetRange,
    /// `[E]`, `[F]`, `[G]` of the first fundamental form.
    first: [Interval; 3],
    /// Linear map from the plane of the piece to `(s, t)`, and the `(x, y)` of its zero.
    start: [f64; 4],
    middle: (f64, f64),

    /// The surface over the piece, or over the one that it is a part of.
    leaf: Arc<Leaf>,
    part: Option<Box<Part>>,
}

/// How a piece that was cut for a moment lies on one that stays: to evaluate that one's leaf a few times costs less than to
/// make another.
#[derive(Debug)]
struct Part {
    /// The frame and the parameters of the piece that stays.
    origin: Point3,
    axes: Matrix3<f64>,
    uv: [(f64, f64); 2],
    /// Its `(s, t)` there: middle and size of the part.
    s: (f64, f64),
    t: (f64, f64),
    /// From its frame to the part's.
    turn: Matrix3<f64>,
    shift: Vector3,
}

/// What the ranges of the derivatives say about the squared distance from a point over the whole piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// Convex in `(s, t)`: a constrained minimum is the only one. The Hessian of half the squared distance
    /// exceeds the diagonal matrix of these two everywhere.
    Convex([f64; 2]),
    /// Without a critical point: the signs of the derivatives by `s` and `t`, 0 where unknown, one of them
    /// known. The minimum lies on the side from which the distance rises.
    Monotone([i8; 2]),
    /// Anything.
    Unknown,
}

impl Piece {
    /// `of` is the piece that it was cut from for a moment; one that is to stay has none.
    pub(super) fn new(net: Net, face: FaceId, chords: Box<[Chord]>, of: Option<&Piece>) -> Self {
        let (origin, axes) = frame(&net);
        let moved = net.moved(&origin, &axes);
        let range = moved.range();
        let first = [
            range.su[0].squared() + range.su[1].squared() + range.su[2].squared(),
            dot(&range.su, &range.sv),
            range.sv[0].squared() + range.sv[1].squared() + range.sv[2].squared(),
        ];
        let evaluated = || Leaf::for_evaluation([net.degree.0, net.degree.1], net.rational, &moved.points);
        let leaf = of.map_or_else(|| Arc::new(evaluated()), |of| Arc::clone(&of.leaf));
        let part = of.map(|of| Box::new(of.part(&net, &origin, &axes)));
        let mid = |r: &Interval| 0.5 * (r.lo + r.hi);
        let (a, b) = (mid(&range.su[0]), mid(&range.sv[0]));
        let (c, d) = (mid(&range.su[1]), mid(&range.sv[1]));
        let determinant = a * d - b * c;
        let start = if determinant.abs() > 1e-6 * (a.abs() + b.abs()) * (c.abs() + d.abs()) {
            [d, -b, -c, a].map(|x| x / determinant)
        } else {
            [0.0; 4]
        };
        Piece {
            face,
            chords,
            net,

            origin,
            axes,
            middle: (mid(&range.p[0]), mid(&range.p[1])),
            range,
            first,
            start,

            leaf,
            part,
        }
    }

    /// `p` in the frame of the piece.
    pub(super) fn local(&self, p: &Point3) -> Vector3 {
        self.axes * (p - self.origin)
    }

    /// A direction in the frame of the piece.
    pub(super) fn turned(&self, direction: &Vector3) -> Vector3 {
        self.axes * direction
    }

    /// A point of the frame in model space.
    pub(super) fn world(&self, p: &Vector3) -> Point3 {
        self.origin + self.axes.tr_mul(p)
    }

    /// The face's parameters of `(s, t)`; the ends of the piece are met to the last bit.
    pub(super) fn parameters(&self, s: f64, t: f64) -> (f64, f64) {
        let map = |x: f64, (a, b): (f64, f64)| match x {
            x if x <= -0.5 => a,
            x if x >= 0.5 => b,
            x => (0.5 * (a + b) + x * (b - a)).clamp(a, b),
        };
        (map(s, self.net.u), map(t, self.net.v))
    }

    /// Squared distance of the box around the piece from `local`: a lower bound for the piece.
    pub(super) fn box_distance_squared(&self, local: &Vector3) -> f64 {
        let outside = |k: usize| {
            let r = &self.range.p[k];
            (r.lo - local[k]).max(local[k] - r.hi).max(0.0)
        };
        let (x, y, z) = (outside(0), outside(1), outside(2));
        // Less the rounding of the frame change.
        (x * x + y * y + z * z) * (1.0 - 1e-12)
    }

    /// Corners of the box around the piece in model space.
    pub(super) fn corners(&self) -> [Point3; 8] {
        let r = &self.range.p;
        std::array::from_fn(|k| {
            let pick = |axis: usize| {
                if k >> axis & 1 == 0 { r[axis].lo } else { r[axis].hi }
            };
            self.world(&Vector3::new(pick(0), pick(1), pick(2)))
        })
    }

    /// Lengths of the box: along `u`, across it, and its thickness.
    pub(super) fn extent(&self) -> [f64; 3] {
        self.range.p.map(Interval::width)
    }

    /// A good first guess of the foot of `local`: its projection along the piece's normal.
    pub(super) fn start(&self, local: &Vector3) -> (f64, f64) {
        let (x, y) = (local.x - self.middle.0, local.y - self.middle.1);
        let m = &self.start;
        ((m[0] * x + m[1] * y).clamp(-0.5, 0.5), (m[2] * x + m[3] * y).clamp(-0.5, 0.5))
    }

    /// Judges `½|S − p|²` over the whole piece by interval arithmetic on its gradient and Hessian.
    pub(super) fn shape(&self, local: &Vector3) -> Shape {
        let away = [0, 1, 2].map(|k| self.range.p[k] - local[k]);
        self.shape_seen_from(&away)
    }

    /// The same for all points whose difference `S − p` lies in the box `away`.
    fn shape_seen_from(&self, away: &[Interval; 3]) -> Shape {
        let uu = self.first[0] + dot(away, &self.range.suu);
        let vv = self.first[2] + dot(away, &self.range.svv);
        let uv = (self.first[1] + dot(away, &self.range.suv)).magnitude();
        if uu.lo > 0.0 && vv.lo > 0.0 && uu.lo * vv.lo > uv * uv {
            // 2 m a b ≤ m (ρ a² + b² / ρ) with ρ² = uu / vv takes the same part from both.
            let part = 1.0 - uv / (uu.lo * vv.lo).sqrt();
            return Shape::Convex([uu.lo * part, vv.lo * part]);
        }
        match [&self.range.su, &self.range.sv].map(|r| dot(away, r).sign()) {
            [0, 0] => Shape::Unknown,
            signs => Shape::Monotone(signs),
        }
    }

    /// Whether the squared distance is convex for every query within `reach` of the piece's box.
    pub(super) fn is_tame_within(&self, reach: f64) -> bool {
        let away = self.range.p.map(|r| Interval { lo: -r.width() - reach, hi: r.width() + reach });
        matches!(self.shape_seen_from(&away), Shape::Convex(_))
    }

    /// The parameter to cut: the one in which the piece bends (or is stretched unevenly) more, else the
    /// longer one.
    pub(super) fn bent_direction(&self) -> Direction {
        let size = |r: &[Interval; 3]| r.iter().map(|x| x.magnitude().powi(2)).sum::<f64>();
        let (r, [x, y, _]) = (&self.range, self.extent());
        let (bend_u, bend_v) = (size(&r.suu), size(&r.svv));
        if bend_u.max(bend_v) > 1e-6 * (x * x + y * y) {
            if bend_u >= bend_v { Direction::U } else { Direction::V }
        } else {
            self.longer_direction()
        }
    }

    /// The parameter along which the piece is longer.
    pub(super) fn longer_direction(&self) -> Direction {
        if self.first[0].hi >= self.first[2].hi { Direction::U } else { Direction::V }
    }

    /// Ranges of the derivatives by `s` and `t` in the piece's frame.
    pub(super) fn slopes(&self) -> (&[Interval; 3], &[Interval; 3]) {
        (&self.range.su, &self.range.sv)
    }

    /// Position in the piece's frame.
    pub(super) fn point(&self, s: f64, t: f64) -> Vector3 {
        let Some(part) = &self.part else { return self.leaf.point(s, t).coords };
        let (s, t) = part.place(s, t);
        part.turn * self.leaf.point(s, t).coords + part.shift
    }

    /// Position and derivatives by `s`, `t` in the piece's frame.
    pub(super) fn jet(&self, s: f64, t: f64) -> Jet {
        let Some(part) = &self.part else { return self.leaf.jet(s, t) };
        let (s, t) = part.place(s, t);
        let (j, Part { s: (_, ds), t: (_, dt), turn, shift, .. }) = (self.leaf.jet(s, t), &**part);
        Jet {
            p: (turn * j.p.coords + shift).into(),
            su: turn * j.su * *ds,
            sv: turn * j.sv * *dt,
            suu: turn * j.suu * (ds * ds),
            suv: turn * j.suv * (ds * dt),
            svv: turn * j.svv * (dt * dt),
        }
    }

    /// How a part of this piece, in a frame of its own, lies on the one that stays.
    fn part(&self, net: &Net, origin: &Point3, axes: &Matrix3<f64>) -> Part {
        let (whole_origin, whole_axes, uv) = match &self.part {
            Some(part) => (part.origin, part.axes, part.uv),
            None => (self.origin, self.axes, [self.net.u, self.net.v]),
        };
        let within = |(a, b): (f64, f64), (low, high): (f64, f64)| {
            let width = high - low;
            ((0.5 * (a + b) - 0.5 * (low + high)) / width, (b - a) / width)
        };
        Part {
            origin: whole_origin,
            axes: whole_axes,
            uv,
            s: within(net.u, uv[0]),
            t: within(net.v, uv[1]),
            turn: axes * whole_axes.transpose(),
            shift: axes * (whole_origin - origin),
        }
    }
}

impl Part {
    /// `(s, t)` on the piece that stays.
    fn place(&self, s: f64, t: f64) -> (f64, f64) {
        (self.s.0 + s * self.s.1, self.t.0 + t * self.t.1)
    }
}

/// Origin and axes that make the box around the piece small.
fn frame(net: &Net) -> (Point3, Matrix3<f64>) {
    let (p, q) = net.degree;
    let [a, b, c, d] = [net.place(0, 0), net.place(p, 0), net.place(p, q), net.place(0, q)];
    let origin = Point3::from((a + b + c + d) * 0.25);
    let along_u = (b - a) + (c - d);
    let along_v = (d - a) + (c - b);
    // Pieces with a collapsed or closed side may leave a direction undefined: any will do then.
    let unit = |v: Vector3| v.try_normalize(1e-9 * (along_u.norm() + along_v.norm()) + f64::MIN_POSITIVE);
    let x = unit(along_u).or(unit(along_v)).unwrap_or(Vector3::x());
    let z = unit((c - a).cross(&(d - b)) / (along_u.norm() + along_v.norm() + f64::MIN_POSITIVE))
        .map(|n| n - x * n.dot(&x))
        .and_then(|n| n.try_normalize(1e-6))
        .unwrap_or_else(|| {
            let aside = if x.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
            x.cross(&aside).normalize()
        });
    let y = z.cross(&x);
    (origin, Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]))
}
