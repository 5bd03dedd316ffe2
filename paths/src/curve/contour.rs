//! Drive curves over which the ball keeps its height: the exact contour lines of the surface of its centres, whether it is
//! dropped on that or comes beside a wall.
//!
//! ```text
//!   places near the line ──Newton, uphill or downhill──► places on it
//!   two neighbours, with tangents across the contact normals ──► cubic; halved until the ball keeps its height halfway
//! ```
//!
//! *All* faces count, so a line follows whatever the ball touches: it rolls around edges and turns where the ball touches
//! a second face.

use claymill_contact::{BallDrop, CONTACT_EPSILON_MM, Location, March, Support};
use claymill_nurbs::{Curve2, KnotVector, Point2, Vector2};

use crate::curve::cubics::Cubics;
use crate::curve::drive::DriveCurve;
use crate::curve::plan_curve::Drawn;
use crate::follow::profile::STEEPEST_NZ;

/// The ball's centre keeps its height to this, mm.
const LEVEL_MM: f64 = 5e-7;
/// A place is on the line when its height is right to this, mm.
const ON_LEVEL_MM: f64 = 1e-8;
const NEWTON_STEPS: usize = 12;
/// Flatter than this (rise by way) there is no line to speak of.
pub(crate) const FLATTEST: f64 = 0.05;
/// Corners are narrowed down to this and ends to that, mm.
const NARROWEST_MM: f64 = 1e-4;
const END_MM: f64 = 0.05;
/// Halfway between two places the line is looked for no further aside than this share of their distance, so that
/// halves become shorter; and they are halved so often at most.
const SHRINK: f64 = 0.25;
const DEEPEST: u32 = 20;
/// Neighbouring places of a line are no further apart, mm: a bend between them cannot hide.
const LONGEST_MM: f64 = 4.0;
/// Nor do they turn by more, as a cosine.
const SHARPEST: f64 = 0.94;
/// Drive curves over which it is dropped are at least this long, mm.
const SHORTEST_MM: f64 = 0.5;

/// A place on the line, and the direction uphill.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Number of the given place, or of the one before.
    index: usize,
    given: bool,
    /// Where the line turns sharply between the node before and this one.
    corner: Option<Point2>,
    at: Point2,
    uphill: Vector2,
}

/// A place that was looked at, and what was found.
type Sought = (Point2, Option<Node>);

/// A hill in plan, of which a contour line is sought.
pub(crate) trait HeightField {
    /// How the line is to be reached from a place, if there is anything there.
    fn seen(&mut self, from: Point2) -> Option<Seen>;
}

/// A place on a hill.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    /// How much higher the line is, mm.
    pub(crate) residual_mm: f64,
    /// Rise by way, if it is steep enough for a line.
    pub(crate) uphill: Option<Vector2>,
    /// Whether it is known no better than to the bounds of contacts.
    pub(crate) is_bound: bool,
}

/// Where the ball rests, and the height of the line.
struct Dropped<'a> {
    march: March<'a>,
    height: f64,
}

impl HeightField for Dropped<'_> {
    fn seen(&mut self, from: Point2) -> Option<Seen> {
        let location = self.march.drop(from.x, from.y).filter(|l| l.support != Support::Side)?;
        Some(Seen {
            residual_mm: self.height - location.centre.z,
            uphill: uphill(&location),
            is_bound: location.support == Support::Bound,
        })
    }
}

/// The contour line at `height` through `places`, none of which may be further beside it than `aside_mm`: one drive curve, or
/// several where it turns sharply or is interrupted.
pub(crate) fn contour(ball: &BallDrop, places: &[Point2], height: f64, aside_mm: f64) -> Vec<Drawn> {
    contour_of(Dropped { march: March::new(ball), height }, places, aside_mm, SHORTEST_MM)
}

/// The same of any hill, of drive curves that are at least so long.
pub(crate) fn contour_of(
    field: impl HeightField,
    places: &[Point2],
    aside_mm: f64,
    shortest_mm: f64,
) -> Vec<Drawn> {
    let mut trace = Trace { field, uphill: 1.0, runs: Vec::new() };
    let sought = |(index, place): (usize, &Point2)| {
        let node = trace.node(index, *place, aside_mm);
        (*place, node.map(|n| Node { given: true, ..n }))
    };
    let sought: Vec<Sought> = places.iter().enumerate().map(sought).collect();
    // Uphill is on the same side all along the line.
    let along = |w: &[Sought]| w[0].1.map_or(0.0, |n| n.along(1.0).dot(&(w[1].0 - w[0].0)));
    trace.uphill = if sought.windows(2).map(along).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let mut before: Option<Sought> = None;
    for (place, node) in sought {
        match before {
            // Where triangles meet in a point places are the same but for rounding, and a drive curve between the two would
            // turn anyhow; on their way to the line places close together may pass each other.
            Some((_, Some(a)))
                if node.is_some_and(|b| {
                    let way = b.at - a.at;
                    let back = way.dot(&a.along(trace.uphill)) <= 0.0;
                    way.norm() <= NARROWEST_MM || (back && way.norm() < 2.0 * aside_mm)
                }) =>
            {
                continue;
            }
            Some(from) => trace.step(from, (place, node), 0),
            None => trace.runs.extend(node.map(|n| vec![n])),
        }
        before = Some((place, node));
    }
    let uphill = trace.uphill;
    trace.runs.iter().filter_map(|run| drawn(run, uphill, shortest_mm)).collect()
}

impl Node {
    /// The way on along the line, uphill to the right (1) or left (−1).
    fn along(&self, uphill: f64) -> Vector2 {
        Vector2::new(-self.uphill.y, self.uphill.x).normalize() * uphill
    }
}

struct Trace<H> {
    field: H,
    /// On which side uphill is.
    uphill: f64,
    runs: Vec<Vec<Node>>,
}

impl<H: HeightField> Trace<H> {
    /// The place of the line that is reached from `from` uphill or downhill, if it is no further than `aside_mm`.
    fn node(&mut self, index: usize, from: Point2, aside_mm: f64) -> Option<Node> {
        let mut at = from;
        for _ in 0..NEWTON_STEPS {
            let seen = self.field.seen(at)?;
            let uphill = seen.uphill?;
            if seen.is_on_line(ON_LEVEL_MM) {
                return Some(Node { index, given: false, corner: None, at, uphill });
            }
            at += uphill * (seen.residual_mm / uphill.norm_squared());
            if (at - from).norm() > aside_mm {
                return None;
            }
        }
        None
    }

    /// Goes on from `a` (already stored), looked for at `from`, to `b`, looked for at `to`.
    fn step(&mut self, (from, a): Sought, (to, b): Sought, depth: u32) {
        let (from, to) = (a.map_or(from, |a| a.at), b.map_or(to, |b| b.at));
        let length = (to - from).norm();
        match (a, b) {
            (Some(a), Some(b)) => self.join(a, b, depth),
            (None, None) => {}
            _ if length <= END_MM || depth >= DEEPEST => self.runs.extend(b.map(|b| vec![b])),
            _ => {
                let middle = nalgebra::center(&from, &to);
                let index = a.or(b).map_or(0, |n| n.index);
                let m = self.node(index, middle, SHRINK * length);
                self.step((from, a), (middle, m), depth + 1);
                self.step((middle, m), (to, b), depth + 1);
            }
        }
    }

    fn join(&mut self, a: Node, b: Node, depth: u32) {
        let way = b.at - a.at;
        let length = way.norm();
        if length <= NARROWEST_MM || depth >= DEEPEST {
            return self.close(a, b);
        }
        let piece = Piece::new(&a, &b, self.uphill);
        if piece.from.dot(&way) <= 0.0 && piece.to.dot(&way) <= 0.0 {
            // Back the way it came.
            return if length > END_MM {
                self.runs.push(vec![b])
            };
        }
        let halfway = piece.middle();
        let turns =
            piece.from.dot(&piece.to) < SHARPEST || piece.from.dot(&way) <= 0.0 || piece.to.dot(&way) <= 0.0;
        let sharp = length <= SHARP_MM && piece.from.dot(&piece.to) < SMOOTH;
        if length <= LONGEST_MM
            && !turns
            && !sharp
            && self.field.seen(halfway).is_some_and(|seen| seen.is_on_line(LEVEL_MM))
        {
            return self.push(b);
        }
        let middle = if turns { nalgebra::center(&a.at, &b.at) } else { halfway };
        match self.node(a.index, middle, SHRINK * length) {
            Some(m) => {
                self.join(a, m, depth + 1);
                self.join(m, b, depth + 1);
            }
            None if length > END_MM => {
                self.step((a.at, Some(a)), (middle, None), depth + 1);
                self.step((middle, None), (b.at, Some(b)), depth + 1);
            }
            None => self.close(a, b),
        }
    }

    /// Two places that are as good as the same: the line goes on, or turns here.
    fn close(&mut self, a: Node, b: Node) {
        let smooth = a.uphill.normalize().dot(&b.uphill.normalize()) > SMOOTH;
        let way = b.at - a.at;
        if way.norm() > NARROWEST_MM {
            self.runs.push(vec![b]);
        } else if !smooth {
            // The corner is where the two tangents meet.
            let (from, to) = (a.along(self.uphill), b.along(self.uphill));
            let share = way.perp(&to) / from.perp(&to);
            let on = share.abs() < 2.0 * NARROWEST_MM;
            let corner = if on { a.at + from * share } else { nalgebra::center(&a.at, &b.at) };
            self.push(Node { corner: Some(corner), ..b });
        } else if way.dot(&(a.along(self.uphill) + b.along(self.uphill))) > 0.0 {
            self.push(b);
        }
    }

    fn push(&mut self, node: Node) {
        if let Some(run) = self.runs.last_mut() {
            run.push(node);
        }
    }
}

/// Cosine of a turn that is no corner (0.3°): a pass may be sampled over it like over any other place.
const SMOOTH: f64 = 0.999_986;
/// What turns by more within this way is narrowed down to a corner, mm.
const SHARP_MM: f64 = 0.01;

impl Seen {
    /// Whether it is as high as the line, to `exact_mm` or as well as bounds tell.
    fn is_on_line(&self, exact_mm: f64) -> bool {
        self.residual_mm.abs() <= if self.is_bound { 2.0 * CONTACT_EPSILON_MM } else { exact_mm }
    }
}

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
    fn new(a: &Node, b: &Node, uphill: f64) -> Self {
        Piece::between([a.at, b.at], a.along(uphill), b.along(uphill))
    }

    fn between(ends: [Point2; 2], from: Vector2, to: Vector2) -> Self {
        let way = ends[1] - ends[0];
        // An arc that turns by 2φ is φ / sin φ times as long as its chord.
        let half = 0.5 * from.angle(&to);
        let length = way.norm() * if half > 1e-6 { half / half.sin() } else { 1.0 };
        Piece { ends, from, to, length }
    }

    fn middle(&self) -> Point2 {
        nalgebra::center(&self.ends[0], &self.ends[1]) + (self.from - self.to) * (self.length / 8.0)
    }
}

/// Places of a line between two of its corners: where, the way on, and the number of a given place.
type Smooth = Vec<(Point2, Vector2, Option<usize>)>;

/// The smooth stretches of a run; where it was narrowed down to a corner only the corner is left.
fn stretches(run: &[Node], uphill: f64) -> Vec<Smooth> {
    let mut all: Vec<Smooth> = Vec::new();
    let mut open: Smooth = Vec::new();
    for (k, node) in run.iter().enumerate() {
        if let (Some(corner), Some(before)) = (node.corner, k.checked_sub(1)) {
            while open.len() > 1 && (open[open.len() - 1].0 - corner).norm() < SHARP_MM {
                open.pop();
            }
            let mut corner = corner;
            if open.len() == 1 && (open[0].0 - corner).norm() < SHARP_MM {
                // Two corners in one.
                corner = open[0].0;
            } else {
                open.push((corner, run[before].along(uphill), None));
                all.push(std::mem::take(&mut open));
            }
            open = vec![(corner, node.along(uphill), None)];
        }
        let begun = open.len() == 1 && open[0].2.is_none();
        if !begun || (node.at - open[0].0).norm() >= SHARP_MM {
            open.push((node.at, node.along(uphill), (node.given || k == 0).then_some(node.index)));
        }
    }
    all.push(open);
    all.retain(|s| s.len() > 1);
    all
}

/// The cubic through the places, C¹ but for its corners; its parameter is about arc length.
fn drawn(run: &[Node], uphill: f64, shortest_mm: f64) -> Option<Drawn> {
    let (first, last) = (run.first()?, run.last()?);
    let stretches = stretches(run, uphill);
    let mut points = vec![stretches.first()?[0].0];
    let mut at = vec![(first.index, 0.0)];
    let mut knots = vec![0.0; 4];
    let mut corners = Vec::new();
    let mut s = 0.0;
    for (k, stretch) in stretches.iter().enumerate() {
        if k > 0 {
            points.push(stretch[0].0);
            knots.push(s);
            corners.push(s);
        }
        for w in stretch.windows(2) {
            let piece = Piece::between([w[0].0, w[1].0], w[0].1, w[1].1);
            s += piece.length;
            points.push(piece.ends[0] + piece.from * (piece.length / 3.0));
            points.push(piece.ends[1] - piece.to * (piece.length / 3.0));
            knots.extend([s, s]);
            at.extend(w[1].2.map(|index| (index, s)));
        }
    }
    if s < shortest_mm {
        return None;
    }
    if at[at.len() - 1].1 < s {
        at.push((last.index, s));
    }
    points.push(stretches.last()?.last()?.0);
    knots.extend([s, s]);
    let curve = Curve2::new(KnotVector::new(3, knots).ok()?, points, None).ok()?;
    let drive = DriveCurve::Curved(Cubics::new(&curve)?);
    Some(Drawn { drive, at, corners })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use claymill_nurbs::analytic::{Frame as Placement, cone, plane_patch, sphere, torus};
    use claymill_nurbs::{Face, Model, NurbsSurface, Point3, Vector3};

    use super::*;
    use crate::Frame;
    use crate::follow::profile::follow;
    use claymill_contact::Covering;

    const R: f64 = 6.0;

    /// The contour line of a ball of 6 mm at `height` through `places`.
    fn lines(surfaces: Vec<NurbsSurface>, height: f64, places: &[Point2]) -> Vec<Drawn> {
        let model: Model = claymill_tests::model_of(surfaces);
        let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
        let covering = Covering::new(&model, &vec![false; model.faces.len()], area_mm2, R).unwrap();
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        let ball = BallDrop::new(&model, &covering, &top, R);
        let found = contour(&ball, places, height, 1.0);
        for drawn in &found {
            let end = drawn.at[drawn.at.len() - 1].1;
            let chains = follow(&ball, &drawn.drive, 0.0, end).chains;
            assert_eq!(chains.len(), 1);
            for sample in chains[0].iter().flat_map(|p| &p.samples) {
                // Where the line turns, the ball rises along either wall: corners are known less well.
                let turns = drawn.corners.iter().any(|s| (s - sample.s).abs() < 1e-3);
                let near_mm = if turns { 1e-4 } else { 1e-6 };
                assert!((sample.z - height).abs() < near_mm, "{} instead of {height}", sample.z);
            }
        }
        found
    }

    /// Places within half a millimetre of a circle about the axis.
    fn around(radius: f64, (from, to): (f64, f64)) -> Vec<Point2> {
        let place = |k: u32| {
            let angle = from + (to - from) * f64::from(k) / 90.0;
            let r = radius + 0.5 * f64::from(k * k).sin();
            Point2::new(r * angle.cos(), r * angle.sin())
        };
        (0..=90).map(place).collect()
    }

    fn assert_circle(found: &[Drawn], radius: f64, turn: f64) {
        let [drawn] = found else { panic!("{} guides", found.len()) };
        let end = drawn.at[drawn.at.len() - 1].1;
        approx::assert_relative_eq!(end, radius * turn, max_relative = 1e-4);
        for k in 0..=997 {
            let [x, y] = drawn.drive.at(end * f64::from(k) / 997.0);
            assert!((x.hypot(y) - radius).abs() < 1e-6, "{} instead of {radius}", x.hypot(y));
        }
    }

    fn placement() -> Placement {
        Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap()
    }

    #[test]
    fn a_cone_a_sphere_and_a_valley_of_a_torus_have_circles() {
        // A cone whose side rises at 60°: the offset one is wider by R / sin 60°.
        let slope = 60f64.to_radians();
        let side = cone(&placement(), 60.0, slope - FRAC_PI_2, (0.0, TAU), (0.0, 70.0)).unwrap();
        let radius = 60.0 - 40.0 / slope.tan() + R / slope.sin();
        assert_circle(&lines(vec![side], 40.0, &around(radius, (0.0, TAU))), radius, TAU);

        let dome = sphere(&placement(), 40.0, (0.0, TAU), (0.0, FRAC_PI_2)).unwrap();
        let radius = 46f64.powi(2).mul_add(1.0, -900.0).sqrt();
        assert_circle(&lines(vec![dome], 30.0, &around(radius, (0.2, 4.0))), radius, 3.8);

        // The inner half of a gutter: the ball's centre runs 20 − 6 mm from the tube's axis.
        let gutter = torus(&placement(), 50.0, 20.0, (0.0, TAU), (PI, 1.5 * PI)).unwrap();
        let radius = 50.0 - (14f64.powi(2) - 64.0).sqrt();
        assert_circle(&lines(vec![gutter], -8.0, &around(radius, (0.0, TAU))), radius, TAU);
    }

    #[test]
    fn places_that_are_the_same_but_for_rounding_are_one() {
        let dome = sphere(&placement(), 40.0, (0.0, TAU), (0.0, FRAC_PI_2)).unwrap();
        let radius = 46f64.powi(2).mul_add(1.0, -900.0).sqrt();
        let on = |angle: f64| Point2::new(radius * angle.cos(), radius * angle.sin());
        let places: Vec<Point2> = (0..=20)
            .map(|k| 0.05 * f64::from(k))
            .flat_map(|a| [on(a), on(a + 5e-11), on(a + 1e-10)])
            .collect();
        let found = lines(vec![dome], 30.0, &places);
        assert_circle(&found, radius, 1.0);
        let DriveCurve::Curved(curve) = &found[0].drive else { panic!() };
        let shortest = curve.breaks().windows(2).map(|w| w[1] - w[0]);
        assert!(shortest.fold(f64::INFINITY, f64::min) > NARROWEST_MM);
        // A place ahead is found from the beginning.
        for ahead in [1e-3, 0.1, 0.5] {
            let [x, y] = found[0].drive.at(ahead);
            approx::assert_abs_diff_eq!(found[0].drive.nearest(x, y, 0.0), ahead, epsilon = 1e-8);
        }
    }

    #[test]
    fn in_the_valley_of_two_walls_the_line_turns() {
        // Walls that rise at 60° over x = 0 and y = 0 and meet in a valley.
        let (sine, cosine) = 60f64.to_radians().sin_cos();
        let wall = |normal: Vector3, along: Vector3| {
            let frame = Placement::new(Point3::origin(), normal, along).unwrap();
            plane_patch(&frame, (-60.0, 60.0), (-60.0, 60.0)).unwrap()
        };
        let walls = vec![
            wall(Vector3::new(sine, 0.0, cosine), Vector3::y()),
            wall(Vector3::new(0.0, sine, cosine), Vector3::x()),
        ];
        // x sin + z cos = R on the first.
        let beside = (R - 10.0 * cosine) / sine;
        let down = (0..=20).map(|k| Point2::new(beside, beside + 20.0 - f64::from(k)));
        let right = (1..=20).map(|k| Point2::new(beside + f64::from(k), beside));
        let found = lines(walls, 10.0, &down.chain(right).collect::<Vec<_>>());
        let [drawn] = &found[..] else { panic!("{} guides", found.len()) };
        let [corner] = drawn.corners[..] else { panic!("{:?}", drawn.corners) };
        let [x, y] = drawn.drive.at(corner);
        assert!((x - beside).hypot(y - beside) < 1e-6, "{x} {y} instead of {beside}");
        for (s, along) in [(corner - 1e-3, [0.0, -1.0]), (corner + 1e-3, [1.0, 0.0])] {
            let [x, y] = drawn.drive.direction(s);
            assert!((x - along[0]).hypot(y - along[1]) < 1e-6, "{x} {y}");
        }
    }
}
