//! Guides over which the dropped ball keeps its height: the exact contour lines of the surface of its centres.
//!
//! ```text
//!   places near the line ──Newton on the drop, uphill or downhill──► places on it
//!   two neighbours, with tangents across the contact normals ──► cubic; halved until the ball keeps its height halfway
//! ```
//!
//! The drop is that on *all* faces, so a line follows whatever carries the ball: it rolls around edges and turns
//! where the ball touches a second face.

use claymill_nurbs::{Curve2, KnotVector, Point2, Vector2};

use crate::contact::{BallDrop, CONTACT_EPSILON_MM, Location, March, Support};
use crate::guide::Guide;
use crate::plan_curve::Drawn;
use crate::profile::STEEPEST_NZ;

/// The ball's centre keeps its height to this, mm.
const LEVEL_MM: f64 = 5e-7;
/// A place is on the line when its height is right to this, mm.
const ON_LEVEL_MM: f64 = 1e-8;
const NEWTON_STEPS: usize = 12;
/// Flatter than this (rise by way) there is no line to speak of.
const FLATTEST: f64 = 0.05;
/// Corners are narrowed down to this and ends to that, mm.
const NARROWEST_MM: f64 = 1e-4;
const END_MM: f64 = 0.05;
/// Neighbouring places of a line are no further apart, mm: a bend between them cannot hide.
const LONGEST_MM: f64 = 4.0;
/// Nor do they turn by more, as a cosine.
const SHARPEST: f64 = 0.94;
const SHORTEST_MM: f64 = 0.5;

/// A place on the line: the number of the given place that it follows, and the direction uphill.
#[derive(Debug, Clone, Copy)]
struct Node {
    index: usize,
    at: Point2,
    uphill: Vector2,
}

/// The contour line at `height` through `places`, none of which may be further beside it than `aside_mm`: one guide, or
/// several where it turns sharply or is interrupted.
pub(crate) fn contour(ball: &BallDrop, places: &[Point2], height: f64, aside_mm: f64) -> Vec<Drawn> {
    let mut trace = Trace { march: March::new(ball), height, aside_mm, runs: Vec::new() };
    let mut before: Option<(Point2, Option<Node>)> = None;
    for (index, &place) in places.iter().enumerate() {
        let node = trace.node(index, place);
        match before {
            Some((from, a)) => trace.step(from, a, place, node),
            None => trace.runs.extend(node.map(|n| vec![n])),
        }
        before = Some((place, node));
    }
    trace.runs.iter().filter_map(|run| drawn(run)).collect()
}

struct Trace<'a> {
    march: March<'a>,
    height: f64,
    aside_mm: f64,
    runs: Vec<Vec<Node>>,
}

impl Trace<'_> {
    /// The place of the line that is reached from `from` uphill or downhill.
    fn node(&mut self, index: usize, from: Point2) -> Option<Node> {
        let mut at = from;
        for _ in 0..NEWTON_STEPS {
            let location = self.march.drop(at.x, at.y)?;
            let uphill = uphill(&location)?;
            let off = self.height - location.centre.z;
            if off.abs() <= self.bound(&location, ON_LEVEL_MM) {
                return Some(Node { index, at, uphill });
            }
            at += uphill * (off / uphill.norm_squared());
            if (at - from).norm() > self.aside_mm {
                return None;
            }
        }
        None
    }

    /// How far off the height may be: what rests on a proven bound is known no better.
    fn bound(&self, location: &Location, exact_mm: f64) -> f64 {
        if location.support == Support::Bound { 2.0 * CONTACT_EPSILON_MM } else { exact_mm }
    }

    /// Goes on from `a` (already stored), looked for at `from`, to `b`, looked for at `to`.
    fn step(&mut self, from: Point2, a: Option<Node>, to: Point2, b: Option<Node>) {
        match (a, b) {
            (Some(a), Some(b)) => self.join(a, b),
            (None, None) => {}
            _ if (to - from).norm() <= END_MM => self.runs.extend(b.map(|b| vec![b])),
            _ => {
                let middle = nalgebra::center(&from, &to);
                let index = a.or(b).map_or(0, |n| n.index);
                let m = self.node(index, middle);
                self.step(from, a, middle, m);
                self.step(middle, m, to, b);
            }
        }
    }

    fn join(&mut self, a: Node, b: Node) {
        let way = b.at - a.at;
        let length = way.norm();
        if length <= NARROWEST_MM {
            return self.close(a, b);
        }
        let piece = Piece::new(&a, &b);
        let halfway = piece.middle();
        let turns = piece.from.dot(&piece.to) < SHARPEST || piece.from.dot(&way) <= 0.0;
        if length <= LONGEST_MM
            && !turns
            && let Some(location) = self.march.drop(halfway.x, halfway.y)
            && (location.centre.z - self.height).abs() <= self.bound(&location, LEVEL_MM)
        {
            return self.push(b);
        }
        let middle = if turns { nalgebra::center(&a.at, &b.at) } else { halfway };
        match self.node(a.index, middle) {
            // Halves that do not shrink lead nowhere.
            Some(m) if (m.at - a.at).norm().max((b.at - m.at).norm()) < 0.9 * length => {
                self.join(a, m);
                self.join(m, b);
            }
            _ if length > END_MM => {
                self.step(a.at, Some(a), middle, None);
                self.step(middle, None, b.at, Some(b));
            }
            _ => self.close(a, b),
        }
    }

    /// Two places that are as good as the same: the line goes on, or turns here.
    fn close(&mut self, a: Node, b: Node) {
        let smooth = a.uphill.normalize().dot(&b.uphill.normalize()) > SMOOTH;
        if smooth && (b.at - a.at).norm() <= NARROWEST_MM { self.push(b) } else { self.runs.push(vec![b]) }
    }

    fn push(&mut self, node: Node) {
        if let Some(run) = self.runs.last_mut() {
            run.push(node);
        }
    }
}

/// Cosine of a turn that is no corner (2°).
const SMOOTH: f64 = 0.9994;

/// Rise by way of the surface of centres, if the ball's side does not cut and it is not too flat.
fn uphill(location: &Location) -> Option<Vector2> {
    let n = location.normal;
    let uphill = Vector2::new(-n.x, -n.y) / n.z;
    (n.z >= STEEPEST_NZ && uphill.norm() >= FLATTEST).then_some(uphill)
}

/// A cubic between two places of the line, with its unit tangents and its length.
struct Piece {
    ends: [Point2; 2],
    from: Vector2,
    to: Vector2,
    length: f64,
}

impl Piece {
    fn new(a: &Node, b: &Node) -> Self {
        let way = b.at - a.at;
        // Uphill stays on the same side.
        let side = |n: &Node| Vector2::new(-n.uphill.y, n.uphill.x).normalize();
        let sign = if (side(a) + side(b)).dot(&way) < 0.0 { -1.0 } else { 1.0 };
        let (from, to) = (side(a) * sign, side(b) * sign);
        // An arc that turns by 2φ is φ / sin φ times as long as its chord.
        let half = 0.5 * from.angle(&to);
        let length = way.norm() * if half > 1e-6 { half / half.sin() } else { 1.0 };
        Piece { ends: [a.at, b.at], from, to, length }
    }

    fn middle(&self) -> Point2 {
        nalgebra::center(&self.ends[0], &self.ends[1]) + (self.from - self.to) * (self.length / 8.0)
    }
}

/// The C¹ cubic through the places; its parameter is about arc length.
fn drawn(run: &[Node]) -> Option<Drawn> {
    let pieces: Vec<Piece> = run.windows(2).map(|w| Piece::new(&w[0], &w[1])).collect();
    let (first, last) = (pieces.first()?, pieces.last()?);
    let mut at = vec![(run[0].index, 0.0)];
    let mut points = vec![first.ends[0]];
    let mut knots = vec![0.0; 4];
    let mut s = 0.0;
    for (piece, node) in pieces.iter().zip(&run[1..]) {
        s += piece.length;
        points.push(piece.ends[0] + piece.from * (piece.length / 3.0));
        points.push(piece.ends[1] - piece.to * (piece.length / 3.0));
        knots.extend([s, s]);
        at.push((node.index, s));
    }
    points.push(last.ends[1]);
    knots.extend([s, s]);
    if s < SHORTEST_MM {
        return None;
    }
    let guide = Guide::Curved(Curve2::new(KnotVector::new(3, knots).ok()?, points, None).ok()?);
    Some(Drawn { guide, at })
}
