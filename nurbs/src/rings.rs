//! Repairs the trim loops of a face: closes gaps, joins loops across seams and poles, and turns
//! holes against their outer loop.

use crate::arc::Arc;
use crate::nesting::to_be_turned;
use crate::tolerance::COINCIDENT_MM;
use crate::{Face, NurbsSurface, Point2, TrimLoop};

/// A closed trim loop as arcs whose ends chain to the last bit, inside the surface's domain. Outer rings run
/// anticlockwise, holes clockwise, whatever the file said.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ring {
    pub(crate) arcs: Vec<Arc>,
}

/// An open run of arcs: a loop, or a part of one between two jumps across a seam.
type Chain = Vec<Arc>;

/// The trim loops of a face, repaired: gaps closed by straight arcs, runs across the seam of a closed surface
/// cut there and joined along it, orientation set from the nesting. Empty when the face has no loops.
pub(crate) fn rings(face: &Face) -> Vec<Ring> {
    let arcs = |trim: &TrimLoop| trim.edges.iter().flat_map(|e| Arc::of_curve(&e.pcurve)).collect();
    rings_of(&face.surface, face.loops.iter().map(arcs))
}

/// The same of loops given as polygons.
pub(crate) fn polygon_rings(surface: &NurbsSurface, polygons: &[Vec<Point2>]) -> Vec<Ring> {
    let arcs = |polygon: &Vec<Point2>| {
        let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
        ends.map(|(&a, &b)| Arc::line(a, b)).collect()
    };
    rings_of(surface, polygons.iter().map(arcs))
}

fn rings_of(surface: &NurbsSurface, loops: impl Iterator<Item = Vec<Arc>>) -> Vec<Ring> {
    let window = Window::of(surface);
    let mut rings = Vec::new();
    let mut open: Vec<Chain> = Vec::new();
    for arcs in loops {
        for chain in window.chains(arcs.into_iter().filter(|a| !is_point(a)).collect()) {
            if window.across(end(&chain), start(&chain)) || window.on_seam(&chain) {
                open.push(chain);
            } else {
                rings.push(window.closed(chain));
            }
        }
    }
    rings.extend(window.joined(open).into_iter().map(|c| window.closed(c)));
    rings.retain(|r| r.arcs.len() > 1 || r.arcs.iter().any(|a| !a.is_line()));
    let wrong = to_be_turned(&rings);
    rings.iter_mut().zip(wrong).filter(|(_, wrong)| *wrong).for_each(|(ring, _)| ring.reverse());
    rings
}

fn is_point(arc: &Arc) -> bool {
    let first = arc.start();
    arc.control_points().all(|p| p == first)
}

fn start(chain: &Chain) -> Point2 {
    chain[0].start()
}

fn end(chain: &Chain) -> Point2 {
    chain[chain.len() - 1].end()
}

/// The domain of a surface and how it closes on itself.
struct Window {
    min: Point2,
    max: Point2,
    /// Period in `u` and `v` of a closed surface, else infinite.
    period: [f64; 2],
    /// Whether the sides `v = v0` and `v = v1` (and the same for `u`) shrink to a pole.
    pole: [[bool; 2]; 2],
}

impl Window {
    fn of(surface: &NurbsSurface) -> Self {
        let ((u0, u1), (v0, v1)) = surface.domain();
        let side = |axis: usize, end: usize| -> Vec<_> {
            let along = |i: usize| (i as f64 + 0.31) / 7.0;
            (0..7)
                .map(|i| match axis {
                    0 => surface.point([u0, u1][end], v0 + (v1 - v0) * along(i)),
                    _ => surface.point(u0 + (u1 - u0) * along(i), [v0, v1][end]),
                })
                .collect()
        };
        let closed = |axis: usize| {
            let (a, b) = (side(axis, 0), side(axis, 1));
            a.iter().zip(&b).all(|(p, q)| (p - q).norm() < CLOSED_MM)
        };
        let pole = |axis: usize, end: usize| {
            let points = side(axis, end);
            points.iter().all(|p| (p - points[0]).norm() < CLOSED_MM)
        };
        let pole = [0, 1].map(|axis| [0, 1].map(|end| pole(axis, end)));
        let period = |axis: usize, length: f64| {
            if closed(axis) && pole[axis] == [false; 2] { length } else { f64::INFINITY }
        };
        Window {
            min: Point2::new(u0, v0),
            max: Point2::new(u1, v1),
            period: [period(0, u1 - u0), period(1, v1 - v0)],
            pole,
        }
    }

    /// Whether the step from `a` to `b` is one period of the surface: the same point seen across the seam.
    fn across(&self, a: Point2, b: Point2) -> bool {
        let jump = |axis: usize| {
            let period = self.period[axis];
            period.is_finite() && ((b[axis] - a[axis]).abs() / period - 1.0).abs() < NEAR_PERIOD
        };
        jump(0) || jump(1)
    }

    fn on_side(&self, p: Point2) -> Option<(usize, bool)> {
        (0..2).filter(|&axis| self.period[axis].is_finite()).find_map(|axis| {
            let near = |c: f64| (p[axis] - c).abs() < NEAR_PERIOD * self.period[axis];
            (near(self.min[axis]) || near(self.max[axis])).then(|| (axis, near(self.max[axis])))
        })
    }

    /// Whether a chain that does not close starts and ends on one seam.
    fn on_seam(&self, chain: &Chain) -> bool {
        let (a, b) = (start(chain), end(chain));
        let open = (a - b).amax() > NEAR_PERIOD * (self.max - self.min).amax();
        open && self.on_side(a).is_some() && self.on_side(a) == self.on_side(b)
    }

    /// Cuts the arcs of a loop at the seams, moves every part into the window and breaks the loop where it
    /// then jumps by a period.
    fn chains(&self, mut arcs: Vec<Arc>) -> Vec<Chain> {
        for axis in 0..2 {
            if self.period[axis].is_finite() {
                arcs = arcs.into_iter().flat_map(|a| self.inside(a, axis)).collect();
            }
        }
        if arcs.is_empty() {
            return Vec::new();
        }
        let jumps = |i: usize| {
            let before = &arcs[(i + arcs.len() - 1) % arcs.len()];
            self.across(before.end(), arcs[i].start())
        };
        let first = (0..arcs.len()).find(|&i| jumps(i)).unwrap_or(0);
        let mut chains: Vec<Chain> = Vec::new();
        for i in (0..arcs.len()).map(|i| (i + first) % arcs.len()) {
            match chains.last_mut() {
                Some(chain) if !jumps(i) => chain.push(arcs[i].clone()),
                _ => chains.push(vec![arcs[i].clone()]),
            }
        }
        chains
    }

    /// The parts of an arc between seams, each moved into the window by whole periods.
    fn inside(&self, arc: Arc, axis: usize) -> Vec<Arc> {
        let (low, period) = (self.min[axis], self.period[axis]);
        let slack = 1e-9 * period;
        let fits =
            |a: &Arc| a.control_points().all(|p| p[axis] >= low - slack && p[axis] <= low + period + slack);
        let far = |a: &Arc| a.control_points().any(|p| (p[axis] - low).abs() > 8.0 * period);
        if fits(&arc) || far(&arc) {
            return vec![arc];
        }
        let mut parts = arc.monotone();
        for k in -8..=9 {
            let seam = low + f64::from(k) * period;
            let cut = |a: Arc| match a.crossing(axis, seam) {
                Some(t) => {
                    let (x, y) = a.split(t);
                    vec![x, y]
                }
                None => vec![a],
            };
            parts = parts.into_iter().flat_map(cut).collect();
        }
        let shift = |a: Arc| {
            let middle = a.point(0.5)[axis];
            let mut by = Point2::origin().coords;
            by[axis] = -((middle - low) / period).floor() * period;
            a.translated(by)
        };
        parts.into_iter().map(shift).collect()
    }

    /// Joins chains that end on a seam along it: each end goes on at the nearest start on the same side.
    fn joined(&self, mut open: Vec<Chain>) -> Vec<Chain> {
        let mut done = Vec::new();
        while let Some(mut chain) = open.pop() {
            while let Some(side) = self.on_side(end(&chain)) {
                let reach = |p: Point2| (p - end(&chain)).norm();
                let closes = (self.on_side(start(&chain)) == Some(side)).then(|| reach(start(&chain)));
                let next = |at: fn(&Chain) -> Point2| {
                    let on_side = (0..open.len()).filter(|&i| self.on_side(at(&open[i])) == Some(side));
                    on_side.min_by(|&i, &j| reach(at(&open[i])).total_cmp(&reach(at(&open[j]))))
                };
                if let Some(i) = next(start).filter(|&i| closes.is_none_or(|c| reach(start(&open[i])) < c)) {
                    chain.extend(open.swap_remove(i));
                } else if closes.is_some() {
                    break;
                } else if let Some(i) = next(end) {
                    // Two loops around the surface that run the same way: one is turned.
                    chain.extend(open.swap_remove(i).iter().rev().map(Arc::reversed));
                } else {
                    chain.extend(self.around_the_pole(&chain, side));
                    break;
                }
            }
            done.push(chain);
        }
        done
    }

    /// A single loop around a closed surface bounds the cap with the pole, or else the part up to the
    /// domain's own side, on its left.
    fn around_the_pole(&self, chain: &Chain, (axis, high): (usize, bool)) -> Chain {
        let other = 1 - axis;
        // Running toward +u the left is +v; toward +v the left is -u.
        let left_is_high = high == (axis == 0);
        let pole = match self.pole[other] {
            [true, false] => self.min[other],
            [false, true] => self.max[other],
            _ if left_is_high => self.max[other],
            _ => self.min[other],
        };
        let (mut a, mut b) = (end(chain), start(chain));
        (a[other], b[other]) = (pole, pole);
        vec![Arc::line(end(chain), a), Arc::line(a, b), Arc::line(b, start(chain))]
    }

    /// Chains the arcs to the last bit: rounding errors are moved away, gaps get straight arcs.
    fn closed(&self, chain: Chain) -> Ring {
        let rounding = 1e-12 * self.max.coords.amax().max(self.min.coords.amax());
        let starts: Vec<Point2> = chain.iter().map(Arc::start).collect();
        let mut arcs = Vec::with_capacity(chain.len() + 1);
        for (i, mut arc) in chain.into_iter().enumerate() {
            let (end, next) = (arc.end(), starts[(i + 1) % starts.len()]);
            if (next - end).amax() <= rounding {
                arc.set_end(next);
                arcs.push(arc);
            } else {
                arcs.extend([arc, Arc::line(end, next)]);
            }
        }
        Ring { arcs }
    }
}

/// Sides of a surface nearer to each other than this are one seam, or one pole, mm.
const CLOSED_MM: f64 = 10.0 * COINCIDENT_MM;
/// A step within this fraction of the period is a jump across the seam.
const NEAR_PERIOD: f64 = 1e-4;

impl Ring {
    /// Box of the control points.
    pub(crate) fn hull(&self) -> (Point2, Point2) {
        let inf = f64::INFINITY;
        let points = self.arcs.iter().flat_map(Arc::control_points);
        points.fold((Point2::new(inf, inf), Point2::new(-inf, -inf)), |(a, b), p| (a.inf(&p), b.sup(&p)))
    }

    fn reverse(&mut self) {
        self.arcs.reverse();
        self.arcs.iter_mut().for_each(|a| *a = a.reversed());
    }
}
