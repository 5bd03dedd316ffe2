//! Which part of the model each setup can cut, and which setup cuts it.

use claymill_nurbs::{Model, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::contact::{BallDrop, Covering, Held, Location};
use crate::keep::{INSIDE_MM, Keep};
use crate::plan::Regions;
use crate::space::Space;
use crate::together::together;
use crate::{FitTolerance, Frame};

/// A surface that leans further from the tool axis than this is not cut by a ball that comes down on it (`n·axis`, 80°): it
/// is a wall, which the ball passes beside.
pub(crate) const LEAST_FACING: f64 = 0.173_648;
/// A wall that leans over by no more than this still is one: an upright wall does by rounding.
pub(crate) const OVERHANGING: f64 = -2e-3;
/// Walls are cut down to so many ball radii below where the ball rests over them: no usual tool is longer.
const DEEPEST_RADII: f64 = 20.0;
/// A place counts as reached when the ball is kept away from it by no more than this, in scallop heights.
const ALLOWED: f64 = 0.5;
/// What looks down over so many ball radii of room is no wall but the underside of the model, or a ceiling.
const ROOM_RADII: f64 = 10.0;
/// From a direction that faces this well, a region is cut as a whole as far as possible (53°).
const GOOD_FACING: f64 = 0.6;
/// Bounds may cross triangles of which no probe is inside: no triangle is larger than this, in ball radii.
const NEAR_RADII: f64 = 2.0;
/// A setup takes the lead in a region only for an area worth a part of its own, in squares of a ball radius.
const LEAST_PART_RADII2: f64 = 4.0;
/// Walls smaller than this are not worth passes of their own, as long as all of them are no more than this share of what is cut.
const LEAST_WALL_RADII2: f64 = 1.0;
const MOST_LEFT: f64 = 2e-4;

/// A probed point of a triangle, as seen from one setup.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Seen {
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
    /// The ball gets there, but is to be kept away.
    OutOfBounds,
    /// Leans too far or faces away.
    Steep,
    /// The ball is held up by less than its radius, or by what is above it.
    Tight,
    /// Something else is in the way.
    Hidden,
}

impl Seen {
    /// Whether it is the same but for how well it faces the setup.
    fn is_like(self, other: Seen) -> bool {
        match (self, other) {
            (
                Seen::Reached { facing: a, done: before, in_bounds: here },
                Seen::Reached { facing: b, done: after, in_bounds: there },
            ) => before == after && here == there && a * b > 0.0,
            _ => self == other,
        }
    }
}

/// What each of the five setups sees.
pub(crate) struct Views<'a> {
    pub(crate) frames: &'a [Frame],
    pub(crate) balls: &'a [BallDrop<'a>],
    /// The tool whose rest is cut, if any.
    pub(crate) earlier: &'a [BallDrop<'a>],
    pub(crate) space: &'a Space<'a>,
    /// What keeps the tool in its bounds.
    pub(crate) keeps: &'a [Option<Keep<'a>>],
    pub(crate) scallop_mm: f64,
    /// Whether triangles are few enough to look closer where strips may be missed.
    pub(crate) divides: bool,
}

/// Fate of the points probed on one triangle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Fate {
    /// Bit `s`: setup `s` cuts here.
    pub(crate) setups: u8,
    /// Bit `s`: it does so on the side against `Su × Sv`.
    pub(crate) other_side: u8,
    /// Bit `s`: for setup `s` it is a wall, on the side of `Su × Sv` and on the other.
    walls: [u8; 2],
    /// Share of the triangle that setup `s` is the first to cut.
    pub(crate) cut: [f32; 5],
    /// How much of it as a wall.
    walls_cut: [f32; 5],
    /// Share not cut, by reason: hidden, too tight.
    pub(crate) hidden: f32,
    /// Share not cut because the ball does not fit.
    pub(crate) tight: f32,
    /// Share that an earlier tool has finished.
    pub(crate) done: f32,
    /// Share that the tool is kept away from.
    pub(crate) out_of_bounds: f32,
}

impl Fate {
    /// Whether any setup cuts it, from above or from beside.
    fn is_cut(&self) -> bool {
        self.setups != 0 || self.walls != [0, 0]
    }

    pub(crate) fn is_cut_by(&self, setup: usize) -> bool {
        self.setups & (1 << setup) != 0
    }

    /// Whether it is a wall of the setup, on the side of `Su × Sv` or on the other.
    pub(crate) fn is_wall_of(&self, setup: usize, other_side: bool) -> bool {
        self.walls[usize::from(other_side)] & (1 << setup) != 0
    }

    /// The wall of a setup is hidden after all.
    fn leave_wall(&mut self, setup: usize) {
        let share = std::mem::take(&mut self.walls_cut[setup]);
        self.walls.iter_mut().for_each(|bits| *bits &= !(1 << setup));
        self.cut[setup] -= share;
        self.hidden += share;
    }

    /// What cuts any of four equal parts, and the mean of their shares.
    fn of_parts(parts: [Fate; 4]) -> Fate {
        let mut all = Fate::default();
        for part in parts {
            all.setups |= part.setups;
            all.other_side |= part.other_side;
            (0..2).for_each(|side| all.walls[side] |= part.walls[side]);
            let own = [&mut all.cut, &mut all.walls_cut].into_iter().flatten();
            let others = [part.cut, part.walls_cut].into_iter().flatten();
            own.zip(others).for_each(|(sum, share)| *sum += 0.25 * share);
            all.hidden += 0.25 * part.hidden;
            all.tight += 0.25 * part.tight;
            all.done += 0.25 * part.done;
            all.out_of_bounds += 0.25 * part.out_of_bounds;
        }
        all
    }

    /// The side of the surface that a setup cuts: 1 on that of `Su × Sv`, −1 on the other.
    pub(crate) fn side(&self, setup: usize) -> f64 {
        if self.other_side & (1 << setup) == 0 { 1.0 } else { -1.0 }
    }
}

/// An earlier ball that is kept up by no more than this share of what the own ball may be has finished a place.
const EARLIER_ALLOWED: f64 = 0.5;
/// A triangle is probed at its corners, which it shares with its neighbours, and in its middle; smaller ones than the ball
/// there only where the corners differ.
const PROBES: usize = 4;
/// A triangle in doubt is divided so many times, where triangles are few.
const HALVINGS: u32 = 2;

/// What becomes of the triangles of all faces.
pub(crate) struct Fates {
    /// By face and triangle.
    pub(crate) of: Vec<Vec<Fate>>,
    /// By face: parts of triangles that no setup gets to, though one does to others of the triangle.
    pub(crate) missed: Vec<Vec<[Point2; 3]>>,
}

/// Decides for every triangle of every face which setups cut it; none does where a face is excluded.
///
/// Probes that keep the ball up by no more than half a scallop height along the normal count as reached.
pub(crate) fn assign(model: &Model, covering: &Covering, views: &Views, regions: &Regions) -> Fates {
    let allowed_mm = ALLOWED * views.scallop_mm;
    let prober = |face: usize| Prober { model, covering, views, face, allowed_mm };
    let probed = |face: usize| {
        if regions.excluded[face] {
            return Vec::new();
        }
        prober(face).triangles()
    };
    let seen: Vec<Vec<[[Seen; PROBES]; 5]>> = (0..model.faces.len()).into_par_iter().map(probed).collect();
    let radius_mm = views.balls.first().map_or(0.0, BallDrop::radius_mm);
    let least_part_mm2 = LEAST_PART_RADII2 * radius_mm.powi(2);
    let leads = lead_setups(covering, &seen, regions.of_face, least_part_mm2);
    let decided: Vec<(Vec<Fate>, Vec<[Point2; 3]>)> = seen
        .par_iter()
        .enumerate()
        .map(|(face, triangles)| {
            let mut missed = Vec::new();
            if regions.excluded[face] {
                return (vec![Fate::default(); covering.meshes[face].triangles.len()], missed);
            }
            let (order, mesh, prober) = (&leads[regions.of_face[face]], &covering.meshes[face], prober(face));
            let decide_on =
                |(seen, t): (&[[Seen; PROBES]; 5], &[u32; 3])| match views.divides && is_in_doubt(seen) {
                    true => prober.divided(t.map(|i| mesh.uv[i as usize]), order, HALVINGS, &mut missed),
                    false => decide(seen, order),
                };
            (triangles.iter().zip(&mesh.triangles).map(decide_on).collect(), missed)
        })
        .collect();
    let (mut fates, missed): (Vec<Vec<Fate>>, Vec<Vec<[Point2; 3]>>) = decided.into_iter().unzip();
    leave_small_walls(covering, &mut fates, LEAST_WALL_RADII2 * radius_mm.powi(2), radius_mm);
    Fates { of: fates, missed }
}

/// A triangle of which some is a setup's wall.
struct WallTriangle {
    face: usize,
    triangle: usize,
    centre: Point3,
    area_mm2: f64,
}

/// Takes from the setups the smallest walls that come to less than `least_mm2` together with those around, up to `near_mm`
/// away, as long as all these are a small share of what is cut.
fn leave_small_walls(covering: &Covering, fates: &mut [Vec<Fate>], least_mm2: f64, near_mm: f64) {
    let cut_mm2 = |(face, fates): (usize, &Vec<Fate>)| -> f64 {
        let areas = covering.areas_mm2(face).zip(fates);
        areas.map(|(area_mm2, fate)| area_mm2 * f64::from(fate.cut.iter().sum::<f32>())).sum()
    };
    let mut may_be_left_mm2 = MOST_LEFT * fates.iter().enumerate().map(cut_mm2).sum::<f64>();
    let small_of = |setup: usize| {
        let of_face = |(face, fates): (usize, &Vec<Fate>)| -> Vec<WallTriangle> {
            let mesh = &covering.meshes[face];
            let all = fates.iter().zip(covering.areas_mm2(face)).enumerate();
            let walls = all.filter(|(_, (fate, _))| fate.walls_cut[setup] > 0.0);
            let wall = |(triangle, (fate, area_mm2)): (usize, (&Fate, f64))| {
                let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.points[i as usize].coords);
                let centre = Point3::from((a + b + c) / 3.0);
                WallTriangle { face, triangle, centre, area_mm2: area_mm2 * f64::from(fate.walls_cut[setup]) }
            };
            walls.map(wall).collect()
        };
        let walls: Vec<WallTriangle> = fates.par_iter().enumerate().flat_map_iter(of_face).collect();
        let groups = together(walls, near_mm, |wall| wall.centre).into_iter().map(move |group| {
            let area_mm2: f64 = group.iter().map(|wall| wall.area_mm2).sum();
            (area_mm2, setup, group)
        });
        groups.filter(|&(area_mm2, ..)| area_mm2 < least_mm2)
    };
    let mut small: Vec<_> = (0..5).flat_map(small_of).collect();
    small.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (area_mm2, setup, group) in small {
        may_be_left_mm2 -= area_mm2;
        if may_be_left_mm2 < 0.0 {
            break;
        }
        group.iter().for_each(|wall| fates[wall.face][wall.triangle].leave_wall(setup));
    }
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
    fn seen(&self, frame: &Frame, ball: &BallDrop, keep: Option<&Keep>, allowed_mm: f64) -> Seen {
        let facing = self.normal.dot(&frame.axis());
        if facing.abs() < LEAST_FACING {
            return Seen::Steep;
        }
        let n = self.normal * facing.signum();
        let centre = frame.to_setup(&(self.point + n * ball.radius_mm()));
        let normal = frame.to_setup(&n.into()).coords;
        let touch = Location::touching(centre, normal, self.face, self.uv.into());
        match ball.held_from(&touch, allowed_mm / facing.abs(), ball.radius_mm()) {
            None => {
                let at = frame.to_setup(&self.point);
                let in_bounds = keep.is_none_or(|keep| keep.allows(&centre, &at, INSIDE_MM));
                let near_mm = NEAR_RADII * ball.radius_mm();
                match in_bounds || keep.is_some_and(|keep| keep.allows_near(&centre, &at, near_mm)) {
                    true => Seen::Reached { facing, done: false, in_bounds },
                    false => Seen::OutOfBounds,
                }
            }
            Some(Held::Near) => Seen::Tight,
            Some(Held::Far) => Seen::Hidden,
        }
    }

    /// What a setup, for which this is [`Seen::Steep`], sees of it as of a wall: whether a ball gets there that keeps a little
    /// away from it. What looks down into the open is nobody's wall.
    fn seen_beside(
        &self,
        setup: usize,
        views: &Views,
        ball: &BallDrop,
        keep: Option<&Keep>,
        farther_mm: f64,
    ) -> Seen {
        let (frame, radius_mm) = (&views.frames[setup], ball.radius_mm());
        let mut seen = Seen::Steep;
        for other_side in [false, true] {
            let n = if other_side { -self.normal } else { self.normal };
            let facing = n.dot(&frame.axis());
            let aside = (n - frame.axis() * facing).try_normalize(0.0);
            let Some(aside) = aside.filter(|_| (OVERHANGING..LEAST_FACING).contains(&facing)) else {
                continue;
            };
            let centre = frame.to_setup(&(self.point + n * radius_mm + aside * farther_mm));
            let away = frame.to_setup(&aside.into()).coords;
            let touch = Location::touching(centre, away, self.face, self.uv.into());
            let held = ball.held_from(&touch, farther_mm, radius_mm);
            let at = frame.to_setup(&self.point);
            if held == Some(Held::Far)
                || ball.is_held_at(at.x, at.y, at.z + (1.0 + DEEPEST_RADII) * radius_mm)
                || views.space.is_underside(&self.point, &n, ROOM_RADII * radius_mm)
            {
                continue;
            }
            if held.is_none() {
                let is_kept_out = keep.is_some_and(|keep| !keep.allows(&centre, &at, INSIDE_MM));
                return if is_kept_out { Seen::OutOfBounds } else { Seen::Wall { other_side, done: false } };
            }
            seen = Seen::Tight;
        }
        seen
    }
}

/// The walls among what a place is to the setups, where none of them reaches it otherwise.
fn beside_walls(place: &Place, views: &Views, seen: &mut [Seen; 5]) {
    let farther_mm = FitTolerance::of_scallop(views.scallop_mm).bias_mm;
    for k in 0..5 {
        if seen[k] != Seen::Steep {
            continue;
        }
        seen[k] = place.seen_beside(k, views, &views.balls[k], views.keeps[k].as_ref(), farther_mm);
        if let Seen::Wall { done, .. } = &mut seen[k] {
            let before = |ball| place.seen_beside(k, views, ball, None, farther_mm);
            *done = views.earlier.get(k).is_some_and(|ball| matches!(before(ball), Seen::Wall { .. }));
            return;
        }
    }
}

/// Asks of places on a face what each of the setups sees there.
struct Prober<'a> {
    model: &'a Model,
    covering: &'a Covering,
    views: &'a Views<'a>,
    face: usize,
    allowed_mm: f64,
}

impl Prober<'_> {
    /// What is seen of all triangles.
    fn triangles(&self) -> Vec<[[Seen; PROBES]; 5]> {
        let mesh = &self.covering.meshes[self.face];
        let corners: Vec<[Seen; 5]> = mesh.uv.iter().map(|&uv| self.probe(uv)).collect();
        let radius_mm = self.views.balls.first().map_or(0.0, BallDrop::radius_mm);
        mesh.triangles
            .iter()
            .map(|t| {
                let at = t.map(|i| &corners[i as usize]);
                let places = t.map(|i| mesh.points[i as usize]);
                let longest_mm = (0..3).map(|i| (places[i] - places[(i + 1) % 3]).norm()).fold(0.0, f64::max);
                let middle = if longest_mm < radius_mm && agree(at) {
                    *at[0]
                } else {
                    self.probe(centroid(t.map(|i| mesh.uv[i as usize])))
                };
                by_setup([&middle, at[0], at[1], at[2]])
            })
            .collect()
    }

    fn probe(&self, uv: Point2) -> [Seen; 5] {
        let Prober { views, allowed_mm, .. } = *self;
        let surface = &self.model.faces[self.face].surface;
        let mut seen = [Seen::Steep; 5];
        let Some((normal, _)) = surface.normal(uv.x, uv.y) else {
            return seen;
        };
        // Whether an earlier tool has been there from a setup.
        let finished = |place: &Place, setup: usize| {
            let seen = |ball| place.seen(&views.frames[setup], ball, None, EARLIER_ALLOWED * allowed_mm);
            views.earlier.get(setup).is_some_and(|ball| matches!(seen(ball), Seen::Reached { .. }))
        };
        let place = Place { face: self.face, uv, point: surface.point(uv.x, uv.y), normal };
        let mut finished_from: [Option<bool>; 5] = [None; 5];
        for k in 0..5 {
            seen[k] = place.seen(&views.frames[k], &views.balls[k], views.keeps[k].as_ref(), allowed_mm);
            let Seen::Reached { done, .. } = &mut seen[k] else { continue };
            let side = |k: usize| normal.dot(&views.frames[k].axis()) > 0.0;
            // Mostly the same setup tells.
            let mut setups = (k..5).chain(0..k).filter(|&other| side(other) == side(k));
            *done = setups.any(|other| *finished_from[other].get_or_insert_with(|| finished(&place, other)));
        }
        if !seen.iter().any(|s| matches!(s, Seen::Reached { .. })) {
            beside_walls(&place, views, &mut seen);
        }
        seen
    }

    /// The fate of a triangle by those of the four that its sides' middles make of it, and so on.
    /// What no setup gets to is added to what is `missed`.
    fn divided(
        &self,
        [a, b, c]: [Point2; 3],
        leads: &[usize],
        halvings: u32,
        missed: &mut Vec<[Point2; 3]>,
    ) -> Fate {
        let middle = nalgebra::center::<f64, 2>;
        let [ab, bc, ca] = [middle(&a, &b), middle(&b, &c), middle(&c, &a)];
        let of_part = |part: [Point2; 3]| {
            let [first, second, third] = part.map(|uv| self.probe(uv));
            let seen = by_setup([&self.probe(centroid(part)), &first, &second, &third]);
            if halvings > 1 && is_in_doubt(&seen) {
                return self.divided(part, leads, halvings - 1, missed);
            }
            let fate = decide(&seen, leads);
            if !fate.is_cut() {
                missed.push(part);
            }
            fate
        };
        Fate::of_parts([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(of_part))
    }
}

fn centroid(corners: [Point2; 3]) -> Point2 {
    let [a, b, c] = corners.map(|p| p.coords);
    Point2::from((a + b + c) / 3.0)
}

/// What each setup sees of a triangle, of what all see at its probes.
fn by_setup(probes: [&[Seen; 5]; PROBES]) -> [[Seen; PROBES]; 5] {
    std::array::from_fn(|setup| probes.map(|seen| seen[setup]))
}

/// Whether no setup gets to some probe, while others are something else to a setup: there may be a strip between them that one
/// gets to.
fn is_in_doubt(seen: &[[Seen; PROBES]; 5]) -> bool {
    let gets_to = |s: &Seen| matches!(s, Seen::Reached { .. } | Seen::Wall { .. });
    let is_missed = |probe: usize| !seen.iter().any(|of_setup| gets_to(&of_setup[probe]));
    let differ = |of_setup: &[Seen; PROBES]| of_setup.iter().any(|s| !s.is_like(of_setup[0]));
    (0..PROBES).any(is_missed) && seen.iter().any(differ)
}

/// Whether the setups see the same at three places.
fn agree([a, b, c]: [&[Seen; 5]; 3]) -> bool {
    (0..5).all(|setup| a[setup].is_like(b[setup]) && a[setup].is_like(c[setup]))
}

/// For each region, the setups in the order in which they may claim its triangles: whichever faces the
/// largest area well comes first, then the best for what is left, and so on.
fn lead_setups(
    covering: &Covering,
    seen: &[Vec<[[Seen; PROBES]; 5]>],
    region_of_face: &[usize],
    least_part_mm2: f64,
) -> Vec<Vec<usize>> {
    let regions = region_of_face.iter().max().map_or(0, |m| m + 1);
    let mut faces_of = vec![Vec::new(); regions];
    for (face, &region) in region_of_face.iter().enumerate() {
        faces_of[region].push(face);
    }
    faces_of
        .par_iter()
        .map(|faces| {
            // (area, setups that face it well) of each triangle.
            let mut open: Vec<(f64, [bool; 5])> = Vec::new();
            for &face in faces {
                let areas = covering.areas_mm2(face);
                open.extend(seen[face].iter().zip(areas).map(|(t, area)| {
                    let well = |s: &[Seen; PROBES]| {
                        s.iter()
                            .any(|p| matches!(p, Seen::Reached { facing, in_bounds: true, .. } if facing.abs() >= GOOD_FACING))
                    };
                    (area, std::array::from_fn(|k| well(&t[k])))
                }));
            }
            let mut order: Vec<usize> = Vec::new();
            loop {
                let sums: [f64; 5] = std::array::from_fn(|k| {
                    open.iter().filter(|(_, well)| well[k]).map(|(area, _)| area).sum()
                });
                let best = (0..5).max_by(|&a, &b| sums[a].total_cmp(&sums[b]).then(b.cmp(&a))).unwrap_or(0);
                if sums[best] < least_part_mm2 || order.len() == 5 {
                    return order;
                }
                order.push(best);
                open.retain(|(_, well)| !well[best]);
            }
        })
        .collect()
}

/// A triangle goes to the first leading setup that faces it well, else to the one that faces it best; probes
/// that this one does not reach may bring in further setups.
fn decide(seen: &[[Seen; PROBES]; 5], leads: &[usize]) -> Fate {
    let best = |k: usize| {
        let facing = |s: &Seen| if let Seen::Reached { facing, .. } = s { facing.abs() } else { 0.0 };
        seen[k].iter().map(facing).fold(0.0, f64::max)
    };
    let mut order: Vec<usize> = leads.iter().copied().filter(|&k| best(k) >= GOOD_FACING).take(1).collect();
    let mut others: Vec<usize> = (0..5).filter(|k| !order.contains(k) && best(*k) > 0.0).collect();
    others.sort_by(|&a, &b| best(b).total_cmp(&best(a)).then(a.cmp(&b)));
    order.extend(others);

    let mut fate = Fate::default();
    let share = 1.0 / PROBES as f32;
    let mut finished = true;
    for probe in 0..PROBES {
        let reached = |inside: bool| {
            order.iter().find_map(|&k| match seen[k][probe] {
                Seen::Reached { facing, done, in_bounds } if in_bounds || !inside => {
                    Some((k, facing, done, in_bounds))
                }
                _ => None,
            })
        };
        if let Some((k, facing, done, in_bounds)) = reached(true).or_else(|| reached(false)) {
            fate.setups |= 1 << k;
            fate.other_side |= u8::from(facing < 0.0) << k;
            *(if in_bounds { &mut fate.cut[k] } else { &mut fate.out_of_bounds }) += share;
            finished &= done;
        } else if let Some((k, other_side, done)) = (0..5).find_map(|k| match seen[k][probe] {
            Seen::Wall { other_side, done } => Some((k, other_side, done)),
            _ => None,
        }) {
            fate.walls[usize::from(other_side)] |= 1 << k;
            fate.cut[k] += share;
            fate.walls_cut[k] += share;
            finished &= done;
        } else if (0..5).any(|k| seen[k][probe] == Seen::OutOfBounds) {
            fate.out_of_bounds += share;
        } else if (0..5).any(|k| seen[k][probe] == Seen::Tight) {
            fate.tight += share;
            finished = false;
        } else {
            fate.hidden += share;
        }
    }
    // What the earlier tool has finished in part, or ends in a corner, is cut as a whole: passes overlap.
    if finished {
        let Fate { hidden, out_of_bounds, .. } = fate;
        fate = Fate { hidden, out_of_bounds, done: fate.cut.iter().sum(), ..Fate::default() };
    }
    fate
}
