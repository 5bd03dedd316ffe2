//! Passes beside walls: what leans too far for a ball that comes down on it is cut by one that passes beside it.
//!
//! ```text
//!        │   │
//!        │   │           levels one below the other; at each the ball's centre keeps
//!   ▒▒▒▒▒│ ● │           the radius away from all faces, and nothing stands above it
//!   ▒▒▒▒▒│╲_╱
//! ```

use claymill_contact::{Location, Support};
use claymill_nurbs::{Curve3, FaceId, Foot, Hint, KnotVector, Point2, Point3, Vector2, Vector3, bisect};
use claymill_surface_merge::RegionMesh;
use claymill_toolpath::{Move, MoveKind, round_to_written};

use crate::curve::contour::{FLATTEST, HeightField, Seen, contour_of};
use crate::curve::drive::DriveCurve;
use crate::curve::plan_curve::Drawn;
use crate::fit::written::one_span;
use crate::follow::profile::{
    CLOSEST_MM, END_MM, Followed, Profile, SHARPEST_TURN, SHORTEST_BESIDE_MM, STRIDE_MM, Sample,
    angle_between,
};
use crate::follow::proofs::Proofs;
use crate::pattern::levels::field::mesh_edge_mm;
use crate::pattern::levels::pattern::{ASIDE, Levels};
use crate::pattern::levels::waterline::CentreHeights;
use crate::pattern::part_region::PartRegion;
use crate::pattern::rows::crests::PlannedPass;
use crate::setup::claims::Claims;
use crate::setup::context::SetupContext;
use crate::setup::leaning::{LEAST_FACING, OVERHANGING};
use crate::setup::slopes::Slopes;

/// The model is looked for this much farther from a wall than the ball's centre is, mm.
const FARTHER_MM: f64 = 1.0;
/// What stands above a ball may hold it up by this much, mm: that much is known of it.
const HELD_MM: f64 = 1e-3;
/// Links beside a wall are bowed away from it by this share of their length.
const BOW: f64 = 0.3;
/// Parts of a link as short as this count as clear when their middle is, mm.
const SHORT_MM: f64 = 5e-3;
/// On the way across a ball is dropped so often that what stands between two drops enters by no more than this, mm.
const BETWEEN_MM: f64 = 2e-3;
/// Before it goes up a ball goes off a wall by the largest of these that there is room for.
const OFF_WALL_MM: [f64; 4] = [2.0, 1.0, 0.5, 0.2];
/// A link may be this long, in flat step-overs.
const LINK_STEPS: f64 = 8.0;

/// The ball with its centre at a height, as if the model rose towards its walls.
struct Adjacency<'a> {
    context: &'a SetupContext<'a>,
    height: f64,
    away_mm: f64,
    hint: Hint,
}

impl Adjacency<'_> {
    /// The nearest place on a face, which way the ball's centre is from there (of unit length), and how far.
    fn nearest(&mut self, at: Point3) -> Option<(Foot, Vector3)> {
        let frame = &self.context.frame;
        let at = frame.to_model(&at);
        let closest = self.context.walls.closest;
        let foot = closest.closest_from(&at, self.away_mm + FARTHER_MM, &mut self.hint)?;
        let away = frame.to_setup(&Point3::from(at - foot.point)).coords.try_normalize(0.0)?;
        Some((foot, away))
    }
}

impl HeightField for Adjacency<'_> {
    fn seen(&mut self, from: Point2) -> Option<Seen> {
        let (foot, away) = self.nearest(Point3::new(from.x, from.y, self.height))?;
        let uphill: Vector2 = -away.xy();
        Some(Seen {
            residual_mm: foot.distance_mm - self.away_mm,
            uphill: (uphill.norm() >= FLATTEST).then_some(uphill),
            is_bound: false,
        })
    }
}

impl SetupContext<'_> {
    /// Passes beside the walls of a part, from the highest down: those on one side of its faces, then those on the other.
    pub(crate) fn lay_walls(&self, ground: &PartRegion) -> ([Vec<PlannedPass>; 2], Proofs) {
        let mut proofs = Proofs::default();
        let is_wall = |f: &FaceId| self.walls.claims.iter().any(|claims| claims.any(*f));
        let faces: Vec<FaceId> = ground.faces.iter().copied().filter(is_wall).collect();
        let edge_mm = mesh_edge_mm(self.ball.radius_mm(), self.scallop_mm);
        let Ok(mesh) = RegionMesh::new(self.model, &faces, self.walls.joints, edge_mm) else {
            return (Default::default(), proofs);
        };
        let upper = self.sides_of(&mesh);
        let laid = [1.0, -1.0].map(|side| {
            let sides: Vec<f64> = upper.iter().map(|s| s * side).collect();
            let claims = Claims::of_two(&self.walls.claims, &faces, |face| sides[face] < 0.0);
            let (beside_walls, slopes) = (Some(&sides[..]), Slopes::All);
            let context = SetupContext { claims: &claims, beside_walls, slopes, ..*self };
            let (laid, of_side) = context.lay_side(&mesh, ground);
            proofs += of_side;
            laid
        });
        (laid, proofs)
    }

    /// The side of each face that is the upper one of a mesh: 1 for that of `Su × Sv`, −1 for the other. The patches of a region
    /// are turned either way.
    fn sides_of(&self, mesh: &RegionMesh) -> Vec<f64> {
        let mut sides = vec![0.0; self.model.faces.len()];
        for ([a, b, c], &face) in mesh.corners().iter().zip(mesh.face_of_triangle()) {
            sides[face] += (b - a).perp(&(c - a));
        }
        sides.into_iter().map(|double_area: f64| if double_area < 0.0 { -1.0 } else { 1.0 }).collect()
    }

    fn lay_side(&self, mesh: &RegionMesh, ground: &PartRegion) -> (Vec<PlannedPass>, Proofs) {
        let (mut laid, mut proofs) = (Vec::new(), Proofs::default());
        let heights = CentreHeights::new(mesh, self);
        let waterlines = heights.waterlines().into_iter().map(|levels| Box::new(levels) as Box<dyn Levels>);
        let mut rounds = self.begin_levels(waterlines.collect());
        while rounds.go_on() {
            proofs += self.lay_levels(&mut rounds, &mut laid, ground);
        }
        laid.sort_by(|a, b| b.q.total_cmp(&a.q));
        (laid, proofs)
    }

    fn beside(&self, height: f64) -> Adjacency<'_> {
        // What is written may lie a fit tolerance beside the drive curve.
        let away_mm = self.ball.radius_mm() + self.tolerance.bias_mm;
        Adjacency { context: self, height, away_mm, hint: Hint::default() }
    }

    /// The lines at a height on which the ball touches the walls near `places`.
    pub(crate) fn wall_contour(&self, places: &[Point2], height: f64) -> Vec<Drawn> {
        contour_of(self.beside(height), places, ASIDE * self.flat_step_mm(), SHORTEST_BESIDE_MM)
    }

    /// Whether something else keeps the ball from a place on a wall.
    pub(crate) fn is_kept_from_wall(
        &self,
        centre: Point3,
        normal: Vector3,
        spot: (FaceId, [f64; 2]),
    ) -> bool {
        let bias_mm = self.tolerance.bias_mm;
        let Some(aside) = Vector3::new(normal.x, normal.y, 0.0).try_normalize(0.0) else { return true };
        let touch = Location::touching(centre + aside * bias_mm, aside, spot.0, spot.1);
        self.ball.is_blocked_from(&touch, bias_mm)
    }

    /// The stretches of a drive curve at a height, from one parameter to another, on which nothing stands above the ball.
    pub(crate) fn follow_beside(&self, drive: &DriveCurve, height: f64, [s0, s1]: [f64; 2]) -> Followed {
        let mut beside = self.beside(height);
        let mut proofs = Proofs::default();
        let mut sample = |s: f64| {
            let [x, y] = drive.at(s);
            let centre = Point3::new(x, y, height);
            let (foot, away) = beside.nearest(centre)?;
            let is_free = foot.distance_mm >= self.ball.radius_mm()
                && self.is_on_free_side(&foot, away)
                && !self.ball.is_in_material_above(&centre)
                && self.is_free_above(centre, &foot, away);
            proofs.locations += u64::from(is_free);
            is_free.then_some(Sample { s, z: height, face: Some(foot.face), ..Sample::default() })
        };
        let mut stretches: Vec<Vec<Sample>> = Vec::new();
        let mut here = sample(s0);
        stretches.extend(here.map(|a| vec![a]));
        let mut s = s0;
        while s < s1 {
            let mut next = if s + 1.5 * STRIDE_MM >= s1 { s1 } else { s + STRIDE_MM };
            // Once around a small circle a drive curve has the direction that it began with.
            let turns =
                |a: f64, b: f64| angle_between(drive.direction(a), drive.direction(b)) > SHARPEST_TURN;
            let turns_on_the_way = |next: f64| {
                let middle = 0.5 * (s + next);
                turns(s, next) || turns(s, middle) || turns(middle, next)
            };
            while next - s > CLOSEST_MM && turns_on_the_way(next) {
                next = 0.5 * (s + next);
            }
            let there = sample(next);
            if here.is_some() != there.is_some() {
                let (mut free, held) = (here.or(there), if here.is_some() { next } else { s });
                if let Some(a) = free {
                    bisect(a.s, held, END_MM, |s| {
                        let found = sample(s);
                        free = found.or(free);
                        found.is_some()
                    });
                }
                if here.is_none() {
                    stretches.push(Vec::new());
                }
                let last = stretches.last_mut().zip(free.filter(|a| a.s != s && a.s != next));
                last.into_iter().for_each(|(stretch, end)| stretch.push(end));
            }
            stretches.last_mut().zip(there).into_iter().for_each(|(stretch, b)| stretch.push(b));
            (s, here) = (next, there);
        }
        stretches.retain(|samples| samples.len() > 1);
        let chains = stretches.into_iter().map(|samples| vec![Profile { samples }]).collect();
        Followed { chains, proofs }
    }

    /// A link between passes beside walls, bowed away from these; `None` when the way is long or not clear.
    pub(crate) fn link_beside(&self, from: Point3, to: Point3) -> Option<Vec<Move>> {
        let up = Vector3::z() * self.ball.radius_mm();
        let [a, b] = [from, to].map(|tip| self.frame.to_setup(&tip) + up);
        let length_mm = (b - a).norm();
        if length_mm > LINK_STEPS * self.flat_step_mm() {
            return None;
        }
        let mut beside = self.beside(a.z);
        let mut bow = |end: Point3| -> Option<Point3> {
            let (_, away) = beside.nearest(end)?;
            let level = Vector3::new(away.x, away.y, 0.0);
            Some(end + level.try_normalize(0.0).unwrap_or_default() * (BOW * length_mm))
        };
        let centres = [a, bow(a)?, bow(b)?, b];
        let tips = centres.map(|c| self.frame.to_model(&(c - up)).map(round_to_written));
        let points = [from, tips[1], tips[2], to];
        let length = round_to_written(length_mm.max(points.windows(2).map(|w| (w[1] - w[0]).norm()).sum()));
        let curve = one_span(points, length)?;
        let is_clear = self.is_link_clear(&curve, length, &mut beside);
        let feed = self.feeds.cut_mm_per_min;
        is_clear.then(|| vec![Move::along(MoveKind::Link, &curve, self.frame.axis(), feed)])
    }

    /// A place aside of the upright wall that a ball with its tip at `from` touches, for it to go up from there; `None` beside
    /// no wall and where there is no room.
    pub(crate) fn off_wall(&self, from: Point3) -> Option<Point3> {
        if !self.ball.end().is_ball() {
            return None;
        }
        let up = Vector3::z() * self.ball.radius_mm();
        let centre = self.frame.to_setup(&from) + up;
        let mut beside = self.beside(centre.z);
        let (foot, away) = beside.nearest(centre)?;
        if foot.distance_mm > beside.away_mm + HELD_MM || away.z.abs() > LEAST_FACING {
            return None;
        }
        let aside = Vector3::new(away.x, away.y, 0.0).try_normalize(0.0)?;
        OFF_WALL_MM.iter().find_map(|mm| {
            let to = self.frame.to_model(&(centre + aside * *mm - up)).map(round_to_written);
            let is_clear = self.is_way_clear(from, to);
            (is_clear && self.is_free_at(self.frame.to_setup(&to) + up, &mut beside)).then_some(to)
        })
    }

    /// Whether the straight way of the ball's tip from one place to another, as written, is clear.
    pub(crate) fn is_way_clear(&self, from: Point3, to: Point3) -> bool {
        let length = round_to_written((to - from).norm());
        let knots = KnotVector::new(1, vec![0.0, 0.0, length, length]);
        let curve = knots.and_then(|knots| Curve3::new(knots, vec![from, to], None));
        curve.is_ok_and(|curve| self.is_curve_clear(&curve))
    }

    /// Whether the way of the ball's tip along a curve from the end of a pass is clear; the parameter is about arc length.
    pub(crate) fn is_curve_clear(&self, curve: &Curve3) -> bool {
        if !self.ball.end().is_ball() {
            return self.enters_nothing(curve);
        }
        let length = curve.domain().1;
        self.is_link_clear(curve, length, &mut self.beside(self.frame.to_setup(&curve.start()).z))
    }

    /// Whether the ball enters nothing along a curve of its tip, nor the material, nor has anything above it.
    fn is_link_clear(&self, curve: &Curve3, length: f64, beside: &mut Adjacency) -> bool {
        let radius_mm = self.ball.radius_mm();
        let centre = |t: f64| self.frame.to_setup(&curve.point(t)) + Vector3::z() * radius_mm;
        // No faster than its control polygon.
        let fastest_mm = curve.points().windows(2).map(|w| (w[1] - w[0]).norm()).fold(0.0, f64::max);
        let speed = 3.0 * fastest_mm / length;
        let mut open = vec![(0.0, length)];
        while let Some((t0, t1)) = open.pop() {
            let (middle, half_mm) = (0.5 * (t0 + t1), 0.5 * (t1 - t0) * speed);
            let nearest = beside.nearest(centre(middle));
            let distance_mm = nearest.map_or(beside.away_mm + FARTHER_MM, |(foot, _)| foot.distance_mm);
            let is_in_material =
                || nearest.is_some_and(|(foot, _)| self.is_in_material(&foot, centre(middle)));
            if distance_mm < radius_mm || is_in_material() {
                return false;
            }
            if distance_mm < radius_mm + half_mm && half_mm > SHORT_MM {
                open.extend([(t0, middle), (middle, t1)]);
            }
        }
        // Passes end where something begins to stand above them: at their ends it is known how much. What stands above a ball
        // stands above it farther down, too: only the way across counts.
        let plan: Vec<Point2> = curve.points().iter().map(|p| self.frame.to_setup(p).xy()).collect();
        let across_mm: f64 = plan.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        // The sagitta of the ball, and that of the curve: its second derivative is that of its polygon at most.
        let bend_mm = plan.windows(3).map(|w| (w[2] - w[1] - (w[1] - w[0])).norm()).fold(0.0, f64::max);
        let of_ball = across_mm / (8.0 * radius_mm * BETWEEN_MM).sqrt();
        let of_curve = (6.0 * bend_mm / (8.0 * BETWEEN_MM)).sqrt();
        let looks = of_ball.max(of_curve).ceil().max(2.0) as u32;
        let places: Vec<Point3> =
            (0..=looks).map(|k| centre(length * f64::from(k) / f64::from(looks))).collect();
        self.containment.is_none_or(|containment| containment.allows_way(&places))
            && places[1..places.len() - 1].iter().all(|&at| self.is_free_at(at, beside))
    }

    fn is_in_material(&self, foot: &Foot, centre: Point3) -> bool {
        self.ball.is_in_material(foot, &self.frame.to_model(&centre))
    }

    /// Whether nothing holds a ball up that comes down to a place, nor does it come through the material.
    fn is_free_at(&self, at: Point3, beside: &mut Adjacency) -> bool {
        if self.ball.is_in_material_above(&at) {
            return false;
        }
        match beside.nearest(at) {
            Some((foot, away)) => self.is_free_above(at, &foot, away),
            None => self.ball.drop(at.x, at.y).is_none_or(|rest| rest.centre.z <= at.z + HELD_MM),
        }
    }

    /// Whether a ball that is this way from the nearest place of the model is where no material is.
    fn is_on_free_side(&self, foot: &Foot, away: Vector3) -> bool {
        let free = self.ball.free();
        free.of(foot.face).is_both()
            || foot.on_boundary
            || (self.ball.surface(foot.face).normal(foot.u, foot.v))
                .is_none_or(|(n, _)| free.allow(foot.face, n.dot(&away) > 0.0))
    }

    /// Whether nothing holds a ball up that comes down beside the nearest place of the model, which way it is from there.
    fn is_free_above(&self, centre: Point3, foot: &Foot, away: Vector3) -> bool {
        let aside = Vector3::new(away.x, away.y, 0.0).try_normalize(0.0).unwrap_or(away);
        let touch = Location::touching(centre, aside, foot.face, [foot.u, foot.v]);
        // A face that is not touched, or leans over, may come nearer farther up.
        let touched_mm = self.ball.radius_mm() + self.tolerance.bias_mm + HELD_MM;
        let speaks_for_face = foot.distance_mm <= touched_mm && away.z >= OVERHANGING;
        let touch = if speaks_for_face { touch } else { Location { support: Support::Edge, ..touch } };
        !self.ball.is_blocked_from(&touch, HELD_MM)
    }
}
