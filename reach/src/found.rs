//! Which directions reach which samples.
//!
//! ```text
//!     d          a tool that touches the sample p with its end comes from d when nothing holds it up on its way:
//!    ┌┴┐         not what is around p, not what hides p, not its shank, not its holder
//!    │ │  █
//!    ╰─╯  █      n·d has to be at least the cosine of the steepest slope; what leans further is met by the side
//!   ──p───█
//! ```

use claymill_contact::{BallDrop, Blocked, Covering, Frame, Location, Material, Rims, near_mm};
use claymill_nurbs::{ClosestPoints, FaceId, Vector3};
use claymill_toolpath::{Monitor, Stage};
use rayon::prelude::*;

use crate::BitSet;
use crate::cover::Table;
use crate::direction::Direction;
use crate::error::ReachError;
use crate::part::{Part, Reacher};
use crate::samples::{Sample, samples, spacing_mm};

/// A wall that leans over by no more than this is upright (`n·d`).
const UPRIGHT: f64 = 2e-3;
/// Walls are reached down to so many tool radii below where the tool rests over them, as the planner cuts them.
const DEEPEST_RADII: f64 = 20.0;
/// Beside a wall the tool keeps this away from it, mm.
const BESIDE_MM: f64 = 2e-3;

/// How near a direction comes to reaching a place: the later, the nearer.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Seen {
    /// The surface looks another way.
    Away,
    /// It leans further than it may.
    Steep,
    /// Something else is in the way, or there is material.
    Hidden,
    /// The end is held up where it would touch, or shank or holder are in the way.
    Tight,
    /// The tool gets there.
    Reached,
}

/// Which of the directions reach what.
#[derive(Debug, Clone)]
pub struct Reach {
    /// The places.
    pub samples: Vec<Sample>,
    /// Directions in columns, samples in rows.
    pub table: Table,
    /// Of each sample, the most that any direction sees of it.
    pub best: Vec<Seen>,
}

impl Reach {
    /// Finds what each direction reaches.
    ///
    /// # Errors
    /// A face cannot be covered, nothing has an area, a number cannot be, or the monitor ends it.
    pub fn new(
        part: &Part,
        reacher: &Reacher,
        directions: &[Direction],
        monitor: &dyn Monitor,
    ) -> Result<Reach, ReachError> {
        reacher.check()?;
        let area_mm2: f64 = part.face_area_mm2.iter().sum();
        let radius_mm = reacher.tool.radius_mm();
        let covering = part.covering(radius_mm)?;
        let samples = samples(part, &covering, spacing_mm(area_mm2, radius_mm));
        if samples.is_empty() {
            return Err(ReachError::Nothing);
        }
        Self::of_samples(part, reacher, &covering, samples, directions, monitor)
    }

    /// The same for samples of one's own.
    ///
    /// # Errors
    /// The monitor ends it.
    pub fn of_samples(
        part: &Part,
        reacher: &Reacher,
        covering: &Covering,
        samples: Vec<Sample>,
        directions: &[Direction],
        monitor: &dyn Monitor,
    ) -> Result<Reach, ReachError> {
        monitor.at(Stage::Setups, 0.0);
        // Without an open border there is no way behind a sheet.
        let closest = (!part.open.is_empty()).then(|| ClosestPoints::new(part.model));
        let done = std::sync::atomic::AtomicUsize::new(0);
        let of_direction = |direction: &Direction| {
            monitor.go_on()?;
            let pose = Pose::new(part, reacher, covering, &direction.frame, closest.as_ref());
            let seen: Vec<Seen> = samples.iter().map(|sample| pose.seen(sample)).collect();
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            monitor.at(Stage::Setups, count as f64 / directions.len() as f64);
            Ok(seen)
        };
        let seen: Vec<Vec<Seen>> =
            directions.par_iter().map(of_direction).collect::<Result<_, ReachError>>()?;
        let mut best = vec![Seen::Away; samples.len()];
        for of_direction in &seen {
            best.iter_mut().zip(of_direction).for_each(|(best, seen)| *best = (*best).max(*seen));
        }
        let rows = samples.len();
        let reached = |seen: &Vec<Seen>| BitSet::of(rows, (0..rows).filter(|&k| seen[k] == Seen::Reached));
        let columns = seen.iter().map(reached).collect();
        Ok(Reach { samples, table: Table { columns, rows }, best })
    }

    /// Areas of the samples, mm².
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        self.samples.iter().map(|s| s.area_mm2).collect()
    }

    /// Area of some samples, mm².
    #[must_use]
    pub fn area_mm2(&self, of: &BitSet) -> f64 {
        of.iter().map(|k| self.samples[k].area_mm2).sum()
    }

    /// Area of all samples, mm².
    #[must_use]
    pub fn whole_mm2(&self) -> f64 {
        self.samples.iter().map(|s| s.area_mm2).sum()
    }

    /// The samples that no direction reaches, face by face.
    pub fn unreached_samples(&self) -> impl Iterator<Item = &Sample> {
        let all = self.samples.iter().zip(&self.best);
        all.filter(|(_, seen)| **seen != Seen::Reached).map(|(sample, _)| sample)
    }

    /// Faces with area that no direction reaches: how much, and the most that any sees of it.
    #[must_use]
    pub fn unreached(&self) -> Vec<(FaceId, f64, Seen)> {
        let mut found: Vec<(FaceId, f64, Seen)> = Vec::new();
        for (sample, &seen) in self.samples.iter().zip(&self.best).filter(|(_, seen)| **seen != Seen::Reached)
        {
            match found.last_mut() {
                Some((face, area_mm2, best)) if *face == sample.face => {
                    *area_mm2 += sample.area_mm2;
                    *best = (*best).max(seen);
                }
                _ => found.push((sample.face, sample.area_mm2, seen)),
            }
        }
        found
    }
}

/// The part as it is reached from one direction.
pub struct Pose<'a> {
    ball: BallDrop<'a>,
    frame: Frame,
    least_facing: f64,
    walls: bool,
    allowed_mm: f64,
}

impl std::fmt::Debug for Pose<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Pose").field("frame", &self.frame).finish_non_exhaustive()
    }
}

impl<'a> Pose<'a> {
    /// Looks at a covered part from a direction. `closest` is needed where the part has open borders.
    #[must_use]
    pub fn new(
        part: &Part<'a>,
        reacher: &Reacher,
        covering: &'a Covering,
        frame: &Frame,
        closest: Option<&'a ClosestPoints<'a>>,
    ) -> Self {
        let Reacher { tool, holder, steepest_deg, walls, allowed_mm } = reacher;
        let free = part.free();
        let rims = Rims::new(part.model, part.open, free, frame);
        let near_mm = near_mm(tool.radius_mm(), 0.0);
        let sizes = [tool.radius_mm(), near_mm];
        let closest = closest.filter(|_| rims.let_through(tool.radius_mm()));
        let material = closest.and_then(|closest| Material::new(closest, covering, free, frame, sizes));
        let ball = BallDrop::of_tool(part.model, covering, frame, tool).on_free_sides(free, rims, material);
        let ball = holder.iter().fold(ball, |ball, holder| ball.with_holder(holder, 0.0));
        // A right angle is met by upright faces, whatever cosines are rounded to.
        let least_facing = if *steepest_deg >= 90.0 { 0.0 } else { steepest_deg.to_radians().cos() - 1e-9 };
        Pose { ball, frame: *frame, least_facing, walls: *walls, allowed_mm: *allowed_mm }
    }

    /// What is seen of a sample.
    #[must_use]
    pub fn seen(&self, sample: &Sample) -> Seen {
        let free = self.ball.free();
        let sides = [true, false].into_iter().filter(|&along| free.allow(sample.face, along));
        let of_side =
            |along: bool| self.seen_of_side(sample, if along { sample.normal } else { -sample.normal });
        sides.map(of_side).max().unwrap_or(Seen::Hidden)
    }

    /// The same on the side that a normal points to.
    fn seen_of_side(&self, sample: &Sample, normal: Vector3) -> Seen {
        let facing = normal.dot(&self.frame.axis());
        if facing < -UPRIGHT {
            return Seen::Away;
        }
        let is_wall = facing < self.least_facing.max(UPRIGHT);
        if is_wall && !self.walls {
            return Seen::Steep;
        }
        let ball = &self.ball;
        let n = self.frame.to_setup(&normal.into()).coords;
        // Beside a wall the tool keeps off it: rounding would push it up the whole wall.
        let beside = if is_wall { BESIDE_MM } else { 0.0 };
        let point = self.frame.to_setup(&sample.point) + n * beside;
        let (end, radius_mm) = (ball.end(), ball.radius_mm());
        let middle = if end.is_ball() { point + n * end.radius_mm() } else { point + end.to_middle(&n) };
        let touch = Location::touching(middle, n, sample.face, sample.uv.into());
        let deepest = point.z + (1.0 + DEEPEST_RADII) * radius_mm;
        if is_wall && ball.is_blocked_at(point.x, point.y, deepest) {
            return Seen::Hidden;
        }
        let by_mm = if is_wall { self.allowed_mm } else { self.allowed_mm / facing };
        match ball.blocked_from(&touch, by_mm, radius_mm) {
            None if ball.is_in_material_above(&middle) => Seen::Hidden,
            None => Seen::Reached,
            Some(Blocked::Near) => Seen::Tight,
            Some(Blocked::Far) => Seen::Hidden,
        }
    }
}
