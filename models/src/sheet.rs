//! Master surfaces, each one smooth region before it is cut into patches: bilinearly blended Coons
//! surfaces with a relief, and tubes.

use claymill_nurbs::{KnotVector, NurbsSurface, Point3, Vector3};

use crate::network::{Edge, Network};
use crate::spline::{Spline, greville, united};

/// A master surface: one smooth region of a generated model before it is cut into patches.
///
/// ```text
///            top  v = 1
///         ┌──────────────┐
///   left  │              │ right        u runs along bottom and top, v along left and right,
///   u = 0 │              │ u = 1        each over [0, 1]
///         └──────────────┘
///           bottom v = 0
/// ```
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    pub(crate) name: String,
    pub(crate) surface: NurbsSurface,
    /// The feature curves it ends on: bottom, top, left, right; `None` where it ends in the air.
    pub(crate) edges: [Option<Edge>; 4],
    /// The left edge is the right edge: a tube.
    pub(crate) closed: bool,
    /// It is the mirror image of the sheet before it.
    pub(crate) is_mirror_image: bool,
}

/// The four edges of a sheet, in the order bottom, top, left, right.
pub(crate) type Frame = [Edge; 4];

/// How a sheet departs from the Coons surface of its frame.
pub(crate) struct Form<'a> {
    /// Roughly the direction in which the outside lies.
    pub(crate) outward: Vector3,
    /// Further knots in `u` and `v` along which the relief may bend; twice for a line of tangent contact.
    pub(crate) lines: (&'a [f64], &'a [f64]),
    /// Added inside, at `(u, v)` in `[0, 1]²`; the rim stays where it is.
    pub(crate) relief: &'a dyn Fn(f64, f64) -> Vector3,
    /// How far the sheet is turned outward about its edges (bottom, top, left, right), degrees, within the
    /// first millimetres: pressed-in seams, without which panels that meet along a smooth line would share
    /// a tangent plane where a third one joins them.
    pub(crate) seams_deg: [f64; 4],
}

/// Distances from the edges at which a sheet with pressed-in seams has knots, mm.
const SEAM_MM: [f64; 2] = [8.0, 24.0];

impl Sheet {
    /// Hangs a sheet into its frame: the bilinearly blended Coons surface of the four edges, built on
    /// control points (exact, since all four are cubic B-splines on common knots), plus the form's relief.
    pub(crate) fn hung(name: &str, network: &Network, frame: Frame, form: &Form) -> Sheet {
        let [bottom, top, left, right] = frame.map(|edge| network.piece(edge));
        let seams = |a: &Spline, b: &Spline| -> Vec<f64> {
            let shares = SEAM_MM.map(|d| d / (0.5 * (a.length() + b.length())));
            let [first, second] = shares;
            vec![first, second, 1.0 - second, 1.0 - first]
        };
        let common = |a: &Spline, b: &Spline, lines: &[f64]| {
            let all = united(&united(&a.knots, &b.knots), lines);
            if form.seams_deg == [0.0; 4] { all } else { united(&all, &seams(a, b)) }
        };
        let knots_u = common(&bottom, &top, form.lines.0);
        let knots_v = common(&left, &right, form.lines.1);
        let [bottom, top] = [bottom, top].map(|s| s.with_knots(knots_u.clone()).points);
        let [left, right] = [left, right].map(|s| s.with_knots(knots_v.clone()).points);
        let (g, h) = (greville(&knots_u), greville(&knots_v));
        let (last_i, last_j) = (g.len() - 1, h.len() - 1);
        let mut net = Net { columns: h.len(), points: Vec::with_capacity(g.len() * h.len()) };
        for (i, &u) in g.iter().enumerate() {
            for (j, &v) in h.iter().enumerate() {
                net.points.push(if j == 0 {
                    bottom[i]
                } else if j == last_j {
                    top[i]
                } else if i == 0 {
                    left[j]
                } else if i == last_i {
                    right[j]
                } else {
                    let between = mix(bottom[i], top[i], v) + mix(left[j], right[j], u);
                    let ends = [(bottom[0], top[0]), (bottom[last_i], top[last_i])];
                    let [start, end] = ends.map(|(a, b)| Point3::from(mix(a, b, v)));
                    Point3::from(between - mix(start, end, u) + (form.relief)(u, v))
                });
            }
        }
        net.press_seams(form);
        Sheet {
            name: name.to_owned(),
            surface: surface(knots_u, knots_v, net.points),
            edges: frame.map(Some),
            closed: false,
            is_mirror_image: false,
        }
    }

    /// The mirror image on the other side of the model.
    pub(crate) fn mirrored(&self, name: &str, network: &Network) -> Sheet {
        let (rows, columns) = self.surface.size();
        let net = (0..rows)
            .flat_map(|i| (0..columns).map(move |j| (i, j)))
            .map(|(i, j)| {
                let p = self.surface.control_point(i, j);
                Point3::new(p.x, -p.y, p.z)
            })
            .collect();
        let knots = |k: &KnotVector| k.as_slice().to_vec();
        Sheet {
            name: name.to_owned(),
            surface: surface(knots(self.surface.knots_u()), knots(self.surface.knots_v()), net),
            edges: self.edges.map(|edge| edge.map(|e| network.mirrored(e))),
            closed: self.closed,
            is_mirror_image: true,
        }
    }

    /// A tube: `rings[j]` are the control points of the closed curve that stands for control point `j` of a
    /// profile with `knots_v` over `[0, 1]`. Smooth around, as smooth along as the profile's knots.
    pub(crate) fn tube(name: &str, knots_v: Vec<f64>, rings: &[Vec<Point3>]) -> Sheet {
        let open: Vec<Spline> = rings.iter().map(|ring| Spline::closed(ring).normalised(false)).collect();
        let knots_u = open[0].knots.clone();
        let net =
            (0..open[0].points.len()).flat_map(|i| open.iter().map(move |ring| ring.points[i])).collect();
        Sheet {
            name: name.to_owned(),
            surface: surface(knots_u, knots_v, net),
            edges: [None; 4],
            closed: true,
            is_mirror_image: false,
        }
    }
}

/// Control points of a sheet under construction, `(i, j)` at `i · columns + j`.
struct Net {
    columns: usize,
    points: Vec<Point3>,
}

impl Net {
    fn at(&self, i: usize, j: usize) -> Point3 {
        self.points[i * self.columns + j]
    }

    /// Lifts the control points next to the rim off the surface, in proportion to their distance from it.
    fn press_seams(&mut self, form: &Form) {
        let (rows, columns) = (self.points.len() / self.columns, self.columns);
        let (last_i, last_j) = (rows - 1, columns - 1);
        let along_u = |j: usize, next: usize| (1..last_i).map(move |i| [(i, j), (i, next), (i + 1, next)]);
        let along_v = |i: usize, next: usize| (1..last_j).map(move |j| [(i, j), (next, j), (next, j + 1)]);
        let strips: [Vec<[(usize, usize); 3]>; 4] = [
            along_u(0, 1).collect(),
            along_u(last_j, last_j - 1).collect(),
            along_v(0, 1).collect(),
            along_v(last_i, last_i - 1).collect(),
        ];
        let mut lifts = Vec::new();
        for (strip, degrees) in strips.into_iter().zip(form.seams_deg) {
            for [rim, inner, beside] in strip {
                let [rim, at, beside] = [rim, inner, beside].map(|(i, j)| self.at(i, j));
                let normal = (at - rim).cross(&(beside - at)).normalize();
                let normal = normal * normal.dot(&form.outward).signum();
                lifts.push((inner, normal * ((at - rim).norm() * degrees.to_radians().tan())));
            }
        }
        for ((i, j), lift) in lifts {
            self.points[i * columns + j] += lift;
        }
    }
}

fn mix(a: Point3, b: Point3, share: f64) -> Vector3 {
    a.coords * (1.0 - share) + b.coords * share
}

pub(crate) fn surface(knots_u: Vec<f64>, knots_v: Vec<f64>, net: Vec<Point3>) -> NurbsSurface {
    let knots = |k| KnotVector::new(3, k).expect("feature curves have sound knots");
    NurbsSurface::new(knots(knots_u), knots(knots_v), net, None).expect("one point for each pair of knots")
}
