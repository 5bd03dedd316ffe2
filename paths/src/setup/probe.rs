//! What each setup sees of places on the model.

use claymill_contact::{BallDrop, Blocked, Covering, FreeSides, Location};
use claymill_nurbs::{FaceId, Model, Point2, Point3, Vector3};
use claymill_stock::Stock;

use crate::containment::{Containment, On};
use crate::setup::leaning::{LEAST_FACING, LEAST_SLANT, OVERHANGING};
use crate::setup::space::Space;
use crate::{FitTolerance, Frame};

/// Walls are cut down to so many ball radii below where the ball rests over them: no usual tool is longer.
const DEEPEST_RADII: f64 = 20.0;
/// What looks down over so many ball radii of room is no wall but the underside of the model, or a ceiling.
const ROOM_RADII: f64 = 10.0;
/// Bounds may cross triangles of which no probe is inside: no triangle is larger than this, in ball radii.
const NEAR_RADII: f64 = 2.0;
/// An earlier ball that is kept up by no more than this share of what the own ball may be has finished a place.
const EARLIER_ALLOWED: f64 = 0.5;
/// A triangle is probed at its corners, which it shares with its neighbours, and in its middle; smaller ones than the ball
/// there only where the corners differ.
pub(crate) const PROBES: usize = 4;

/// What all setups see at the probes of triangles: [`PROBES`] for each setup, setup by setup, triangle by triangle.
pub(crate) type Probed = [Seen];

/// What a setup sees at the probes of one triangle.
pub(crate) fn of_setup(probed: &Probed, setup: usize) -> &[Seen] {
    &probed[PROBES * setup..][..PROBES]
}

/// A probed point of a triangle, as seen from one setup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Seen {
    /// The ball gets there.
    Reached {
        /// `n·axis`; negative on the side against `Su × Sv`.
        facing: f64,
        /// An earlier tool has been on this side.
        done: bool,
        /// The tool may be there, not only close by.
        in_bounds: bool,
    },
    /// The ball gets there beside a wall.
    Wall {
        /// On the side against `Su × Sv`.
        other_side: bool,
        /// An earlier tool has been on this side.
        done: bool,
    },
    /// The ball gets there, but only just: see [`LEAST_SLANT`].
    Slanting {
        /// `n·axis`; negative on the side against `Su × Sv`.
        facing: f64,
        /// An earlier tool has been on this side.
        done: bool,
    },
    /// The ball gets there, but is to be kept away.
    OutOfBounds,
    /// Leans too far or faces away.
    Steep,
    /// The ball is held up by less than its radius, or by what is above it.
    Tight {
        /// Nothing is left there that is worth cutting.
        done: bool,
    },
    /// Something else is in the way.
    Hidden,
    /// The material is on the side that faces the setup.
    Material,
}

impl Seen {
    /// Whether it is the same but for how well it faces the setup.
    fn is_like(self, other: Seen) -> bool {
        match (self.without_slants(), other.without_slants()) {
            (
                Seen::Reached { facing: a, done: before, in_bounds: here },
                Seen::Reached { facing: b, done: after, in_bounds: there },
            ) => before == after && here == there && a * b > 0.0,
            (one, other) => one == other,
        }
    }

    /// The same where slants are not worth passes.
    pub(crate) fn without_slants(self) -> Seen {
        if let Seen::Slanting { .. } = self { Seen::Steep } else { self }
    }

    /// The same where they are.
    pub(crate) fn with_slants(self) -> Seen {
        match self {
            Seen::Slanting { facing, done } => Seen::Reached { facing, done, in_bounds: true },
            other => other,
        }
    }
}

/// The stock as earlier operations left it, and the thickness from which on it is worth passes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rest<'a> {
    pub(crate) stock: &'a Stock,
    pub(crate) above_mm: f64,
}

impl Rest<'_> {
    /// Whether there is no stock at this height over a place. Where nothing can be said there is some.
    fn is_gone(&self, point: &Point3, normal: &Vector3) -> bool {
        self.stock.thickness_along(&(point + normal * self.above_mm), normal).is_ok_and(|mm| mm <= 0.0)
    }
}

/// What each of the setups sees.
pub(crate) struct Views<'a> {
    pub(crate) frames: &'a [Frame],
    pub(crate) balls: &'a [BallDrop<'a>],
    /// The tool whose rest is cut, if any.
    pub(crate) earlier: &'a [BallDrop<'a>],
    /// The stock that says where there is some left, if only that is cut.
    pub(crate) rest: Option<Rest<'a>>,
    pub(crate) space: &'a Space<'a>,
    /// The sides that may be cut.
    pub(crate) free: FreeSides<'a>,
    /// What keeps the tool in its bounds.
    pub(crate) keeps: &'a [Option<Containment<'a>>],
    pub(crate) scallop_mm: f64,
    /// Whether triangles are few enough to look closer where strips may be missed.
    pub(crate) divides: bool,
}

/// A place that is probed.
struct Place {
    face: usize,
    uv: Point2,
    point: Point3,
    normal: Vector3,
}

impl Place {
    /// What a setup sees there, if the ball may be kept up by `allowed_mm` along the normal.
    fn seen(
        &self,
        frame: &Frame,
        ball: &BallDrop,
        containment: Option<&Containment>,
        allowed_mm: f64,
    ) -> Seen {
        if self.normal.dot(&frame.axis()).abs() < LEAST_FACING {
            return Seen::Steep;
        }
        self.seen_facing(frame, ball, containment, allowed_mm)
    }

    /// The same however far it leans.
    fn seen_facing(
        &self,
        frame: &Frame,
        ball: &BallDrop,
        containment: Option<&Containment>,
        allowed_mm: f64,
    ) -> Seen {
        let facing = self.normal.dot(&frame.axis());
        if !ball.free().allow(self.face, facing > 0.0) {
            return Seen::Material;
        }
        let n = self.normal * facing.signum();
        let normal = frame.to_setup(&n.into()).coords;
        let centre = match ball.end() {
            end if end.is_ball() => frame.to_setup(&(self.point + n * end.radius_mm())),
            end => frame.to_setup(&self.point) + end.to_middle(&normal),
        };
        let touch = Location::touching(centre, normal, self.face, self.uv.into());
        match ball.blocked_from(&touch, allowed_mm / facing.abs(), ball.radius_mm()) {
            None if ball.is_in_material_above(&centre) => Seen::Hidden,
            None => {
                let at = frame.to_setup(&self.point);
                let in_bounds =
                    containment.is_none_or(|containment| containment.allows(&centre, &at, On::Pass));
                let near_mm = NEAR_RADII * ball.radius_mm();
                match in_bounds
                    || containment.is_some_and(|containment| containment.allows_near(&centre, &at, near_mm))
                {
                    true => Seen::Reached { facing, done: false, in_bounds },
                    false => Seen::OutOfBounds,
                }
            }
            Some(Blocked::Near) => Seen::Tight { done: false },
            Some(Blocked::Far) => Seen::Hidden,
        }
    }

    /// What a setup, for which this is [`Seen::Steep`], sees of it as of a wall: whether a ball gets there that keeps a little
    /// away from it. What looks down into the open is nobody's wall.
    fn seen_beside(
        &self,
        setup: usize,
        views: &Views,
        ball: &BallDrop,
        containment: Option<&Containment>,
        farther_mm: f64,
    ) -> Seen {
        let (frame, radius_mm) = (&views.frames[setup], ball.radius_mm());
        let mut seen = Seen::Steep;
        for other_side in [false, true].into_iter().filter(|other| views.free.allow(self.face, !other)) {
            let n = if other_side { -self.normal } else { self.normal };
            let facing = n.dot(&frame.axis());
            let aside = (n - frame.axis() * facing).try_normalize(0.0);
            let Some(aside) = aside.filter(|_| (OVERHANGING..LEAST_FACING).contains(&facing)) else {
                continue;
            };
            let centre = frame.to_setup(&(self.point + n * radius_mm + aside * farther_mm));
            let away = frame.to_setup(&aside.into()).coords;
            let touch = Location::touching(centre, away, self.face, self.uv.into());
            let held = ball.blocked_from(&touch, farther_mm, radius_mm);
            let at = frame.to_setup(&self.point);
            if held == Some(Blocked::Far)
                || ball.is_blocked_at(at.x, at.y, at.z + (1.0 + DEEPEST_RADII) * radius_mm)
                || views.space.is_underside(&self.point, &n, ROOM_RADII * radius_mm)
                || ball.is_in_material_above(&centre)
            {
                continue;
            }
            if held.is_none() {
                let is_kept_out =
                    containment.is_some_and(|containment| !containment.allows(&centre, &at, On::Pass));
                return if is_kept_out { Seen::OutOfBounds } else { Seen::Wall { other_side, done: false } };
            }
            seen = Seen::Tight { done: false };
        }
        seen
    }
}

/// The walls among what a place is to the setups, where none of them reaches it otherwise and may be there.
fn beside_walls(place: &Place, views: &Views, seen: &mut [Seen]) {
    let farther_mm = FitTolerance::of_scallop(views.scallop_mm).bias_mm;
    // Passes beside walls are those of a ball.
    if !views.balls.iter().all(|ball| ball.end().is_ball()) {
        return;
    }
    for k in 0..seen.len() {
        if seen[k] != Seen::Steep {
            continue;
        }
        seen[k] = place.seen_beside(k, views, &views.balls[k], views.keeps[k].as_ref(), farther_mm);
        if let Seen::Wall { done, other_side } = &mut seen[k] {
            let before = |ball| place.seen_beside(k, views, ball, None, farther_mm);
            let normal = if *other_side { -place.normal } else { place.normal };
            *done = views.rest.is_some_and(|rest| rest.is_gone(&place.point, &normal))
                || views.earlier.get(k).is_some_and(|ball| matches!(before(ball), Seen::Wall { .. }));
            return;
        }
    }
}

/// The slants among what a place is to the setups, where none of them gets to it otherwise.
fn on_slants(place: &Place, views: &Views, allowed_mm: f64, seen: &mut [Seen]) {
    for k in 0..seen.len() {
        let (frame, facing) = (&views.frames[k], place.normal.dot(&views.frames[k].axis()));
        if seen[k] != Seen::Steep || facing.abs() < LEAST_SLANT {
            continue;
        }
        let here = place.seen_facing(frame, &views.balls[k], views.keeps[k].as_ref(), allowed_mm);
        if let Seen::Reached { in_bounds: true, .. } = here {
            let before = |ball| place.seen_facing(frame, ball, None, EARLIER_ALLOWED * allowed_mm);
            let done =
                views.rest.is_some_and(|rest| rest.is_gone(&place.point, &(place.normal * facing.signum())))
                    || views.earlier.get(k).is_some_and(|ball| matches!(before(ball), Seen::Reached { .. }));
            seen[k] = Seen::Slanting { facing, done };
        }
    }
}

/// Asks of places on a face what each of the setups sees there.
pub(crate) struct Prober<'a> {
    pub(crate) model: &'a Model,
    pub(crate) covering: &'a Covering,
    pub(crate) views: &'a Views<'a>,
    pub(crate) face: usize,
    pub(crate) allowed_mm: f64,
    /// What slants is looked at as [`Seen::with_slants`] or without.
    pub(crate) slants: Slants,
}

/// Whoever may know what is seen of faces from before.
pub(crate) trait SeenBefore: Sync {
    /// What is seen of all faces, by who asks of each of them: where it is known nobody is asked. Nothing is seen of a face of
    /// which nobody asks.
    fn all<'p>(&self, prober: &(dyn Fn(FaceId) -> Option<Prober<'p>> + Sync)) -> Vec<Vec<Seen>>;
}

/// Whether a face's slants are worth passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slants {
    /// That is to be found out.
    Asked,
    /// They are cut.
    Cut,
    /// They are left.
    Left,
}

impl Prober<'_> {
    /// What is seen of all triangles, one after the other, where this is what the setups see of a place.
    pub(crate) fn triangles(&self, mut probe: impl FnMut(Point2) -> Vec<Seen>) -> Vec<Seen> {
        let mesh = &self.covering.meshes()[self.face];
        let corners: Vec<Vec<Seen>> = mesh.uv.iter().map(|&uv| probe(uv)).collect();
        let radius_mm = self.views.balls.first().map_or(0.0, BallDrop::radius_mm);
        // Of a whole vehicle this is a large part of the memory: no more is taken than is needed.
        let mut seen = Vec::with_capacity(mesh.triangles.len() * PROBES * self.views.frames.len());
        for t in &mesh.triangles {
            let at = t.map(|i| &*corners[i as usize]);
            let places = t.map(|i| mesh.points[i as usize]);
            let longest_mm = (0..3).map(|i| (places[i] - places[(i + 1) % 3]).norm()).fold(0.0, f64::max);
            let probed;
            let middle = if longest_mm < radius_mm && agree(at) {
                at[0]
            } else {
                probed = probe(centroid(t.map(|i| mesh.uv[i as usize])));
                &probed
            };
            seen.extend(by_setup([middle, at[0], at[1], at[2]]));
        }
        seen
    }

    /// What each setup sees of a place.
    pub(crate) fn probe(&self, uv: Point2) -> Vec<Seen> {
        let Prober { views, allowed_mm, .. } = *self;
        let surface = &self.model.faces[self.face].surface;
        let setups = views.frames.len();
        let mut seen = vec![Seen::Steep; setups];
        let Some((normal, _)) = surface.normal(uv.x, uv.y) else {
            return seen;
        };
        // Whether an earlier tool has been there from a setup.
        let finished = |place: &Place, setup: usize| {
            let seen = |ball| place.seen(&views.frames[setup], ball, None, EARLIER_ALLOWED * allowed_mm);
            views.earlier.get(setup).is_some_and(|ball| matches!(seen(ball), Seen::Reached { .. }))
        };
        let place = Place { face: self.face, uv, point: surface.point(uv.x, uv.y), normal };
        let mut finished_from: Vec<Option<bool>> = vec![None; setups];
        for k in 0..setups {
            seen[k] = place.seen(&views.frames[k], &views.balls[k], views.keeps[k].as_ref(), allowed_mm);
            let Seen::Reached { done, facing, .. } = &mut seen[k] else { continue };
            if views.rest.is_some_and(|rest| rest.is_gone(&place.point, &(normal * facing.signum()))) {
                *done = true;
                continue;
            }
            let side = |k: usize| normal.dot(&views.frames[k].axis()) > 0.0;
            // Mostly the same setup tells.
            let mut setups = (k..setups).chain(0..k).filter(|&other| side(other) == side(k));
            *done = setups.any(|other| *finished_from[other].get_or_insert_with(|| finished(&place, other)));
        }
        if !seen.iter().any(|s| matches!(s, Seen::Reached { in_bounds: true, .. })) {
            beside_walls(&place, views, &mut seen);
            let is_wall = seen.iter().any(|s| matches!(s, Seen::Wall { .. }));
            if self.slants != Slants::Left && !is_wall {
                on_slants(&place, views, allowed_mm, &mut seen);
            }
        }
        let is_tight = seen.iter().any(|s| matches!(s, Seen::Tight { .. }));
        if let Some(rest) = views.rest.filter(|_| is_tight) {
            let mut sides = [(true, normal), (false, -normal)].into_iter();
            let gone =
                sides.all(|(along, n)| !views.free.allow(self.face, along) || rest.is_gone(&place.point, &n));
            for s in &mut seen {
                if let Seen::Tight { done } = s {
                    *done = gone;
                }
            }
        }
        if self.slants == Slants::Cut {
            seen.iter_mut().for_each(|s| *s = s.with_slants());
        }
        seen
    }
}

pub(crate) fn centroid(corners: [Point2; 3]) -> Point2 {
    let [a, b, c] = corners.map(|p| p.coords);
    Point2::from((a + b + c) / 3.0)
}

/// What each setup sees of a triangle, of what all see at its probes.
pub(crate) fn by_setup(probes: [&[Seen]; PROBES]) -> impl Iterator<Item = Seen> {
    (0..probes[0].len()).flat_map(move |setup| probes.map(|seen| seen[setup]))
}

/// Whether no setup gets to some probe, while others are something else to a setup: there may be a strip between them that one
/// gets to.
pub(crate) fn is_in_doubt(seen: &Probed) -> bool {
    let gets_to = |s: &Seen| matches!(s, Seen::Reached { .. } | Seen::Wall { .. });
    let is_missed = |probe: usize| !seen.chunks(PROBES).any(|of_setup| gets_to(&of_setup[probe]));
    let differ = |of_setup: &[Seen]| of_setup.iter().any(|s| !s.is_like(of_setup[0]));
    (0..PROBES).any(is_missed) && seen.chunks(PROBES).any(differ)
}

/// Whether the setups see the same at three places.
fn agree([a, b, c]: [&[Seen]; 3]) -> bool {
    (0..a.len()).all(|setup| a[setup].is_like(b[setup]) && a[setup].is_like(c[setup]))
}
