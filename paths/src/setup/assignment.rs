//! Which part of the model each setup can cut, and which setup cuts it.

use std::collections::HashMap;

use claymill_contact::{BallDrop, Covering};
use claymill_nurbs::{Model, Point2, Point3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tracing::info_span;

use crate::pattern::together::together;
use crate::plan::regions::Regions;
use crate::setup::borders::{Border, Ground, smooth};
use crate::setup::probe::{
    PROBES, Probed, Prober, Seen, SeenBefore, Slants, Views, by_setup, centroid, is_in_doubt, of_setup,
};

/// A place counts as reached when the ball is kept away from it by no more than this, in scallop heights.
const ALLOWED: f64 = 0.5;
/// From a direction that faces this well, a region is cut as a whole as far as possible (53°).
const GOOD_FACING: f64 = 0.6;
/// A setup takes the lead in a region only for an area worth a part of its own, in squares of a ball radius.
const LEAST_PART_RADII2: f64 = 4.0;
/// Walls smaller than this are not worth passes of their own, as long as all of them are no more than this share of what is cut.
const LEAST_WALL_RADII2: f64 = 1.0;
const MOST_LEFT: f64 = 2e-4;

/// Setups of a job at most: a bit for each.
pub(crate) const MOST_SETUPS: usize = u8::BITS as usize;

/// Assignment of the points probed on one triangle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Packed", into = "Packed")]
pub(crate) struct Assignment {
    /// Bit `s`: setup `s` cuts here.
    pub(crate) setups: u8,
    /// Bit `s`: it does so on the side against `Su × Sv`.
    pub(crate) other_side: u8,
    /// Bit `s`: for setup `s` it is a wall, on the side of `Su × Sv` and on the other.
    walls: [u8; 2],
    /// Share of the triangle that setup `s` is the first to cut.
    pub(crate) cut: [f32; MOST_SETUPS],
    /// How much of it as a wall.
    walls_cut: [f32; MOST_SETUPS],
    /// Share not cut, by reason: hidden, too tight.
    pub(crate) hidden: f32,
    /// Share not cut because the ball does not fit.
    pub(crate) tight: f32,
    /// Share that an earlier tool has finished.
    pub(crate) done: f32,
    /// Share that the tool is kept away from.
    pub(crate) out_of_bounds: f32,
}

/// An assignment without the names of its fields, of which a plan has as many as triangles: bits, cut, walls cut, not cut.
pub(crate) type Packed = ([u8; 4], [f32; MOST_SETUPS], [f32; MOST_SETUPS], [f32; 4]);

impl From<Assignment> for Packed {
    fn from(of: Assignment) -> Self {
        let Assignment { setups, other_side, walls: [along, against], cut, walls_cut, .. } = of;
        let not_cut = [of.hidden, of.tight, of.done, of.out_of_bounds];
        ([setups, other_side, along, against], cut, walls_cut, not_cut)
    }
}

impl From<Packed> for Assignment {
    fn from((bits, cut, walls_cut, [hidden, tight, done, out_of_bounds]): Packed) -> Self {
        let [setups, other_side, along, against] = bits;
        let walls = [along, against];
        Assignment { setups, other_side, walls, cut, walls_cut, hidden, tight, done, out_of_bounds }
    }
}

impl Assignment {
    /// A setup cuts it on the side that faces it.
    fn is_for(&mut self, setup: usize, facing: f64) {
        self.setups |= 1 << setup;
        self.other_side |= u8::from(facing < 0.0) << setup;
    }

    /// Whether any setup cuts it, from above or from beside.
    fn is_cut(&self) -> bool {
        self.setups != 0 || self.walls != [0, 0]
    }

    pub(crate) fn is_cut_by(&self, setup: usize) -> bool {
        self.setups & (1 << setup) != 0
    }

    /// The setup that cuts most of it, if none cuts it as a wall.
    pub(crate) fn main_setup(&self) -> Option<u8> {
        if self.walls != [0, 0] {
            return None;
        }
        self.main_of(self.setups)
    }

    /// The one of some setups, given as bits, that cuts most of it.
    pub(crate) fn main_of(&self, setups: u8) -> Option<u8> {
        let setups = (0..MOST_SETUPS).filter(|k| setups & (1 << k) != 0);
        setups.reduce(|a, b| if self.cut[b] > self.cut[a] { b } else { a }).map(|k| k as u8)
    }

    /// Parts what is cut between setups by the shares that are their own; others do not get there.
    pub(crate) fn part(&mut self, shares: [Option<f32>; MOST_SETUPS]) {
        let side = u8::from(self.main_setup().is_some_and(|k| self.side(usize::from(k)) < 0.0));
        let all: f32 = self.cut.iter().sum();
        (self.setups, self.other_side) = (0, 0);
        for (k, share) in shares.into_iter().enumerate() {
            self.cut[k] = all * share.unwrap_or(0.0);
            self.setups |= u8::from(share.is_some()) << k;
            self.other_side |= (u8::from(share.is_some()) & side) << k;
        }
    }

    /// Whether it is a wall of the setup, on the side of `Su × Sv` or on the other.
    pub(crate) fn is_wall_of(&self, setup: usize, other_side: bool) -> bool {
        self.walls[usize::from(other_side)] & (1 << setup) != 0
    }

    /// Whether it is a wall of the setup on either side.
    pub(crate) fn is_a_wall_of(&self, setup: usize) -> bool {
        [false, true].into_iter().any(|other_side| self.is_wall_of(setup, other_side))
    }

    /// The wall of a setup is hidden after all.
    fn leave_wall(&mut self, setup: usize) {
        let share = std::mem::take(&mut self.walls_cut[setup]);
        self.walls.iter_mut().for_each(|bits| *bits &= !(1 << setup));
        self.cut[setup] -= share;
        self.hidden += share;
    }

    /// What cuts any of four equal parts, and the mean of their shares.
    fn of_parts(parts: [Assignment; 4]) -> Assignment {
        let mut all = Assignment::default();
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

/// A triangle in doubt is divided so many times, where triangles are few.
const HALVINGS: u32 = 2;

/// What becomes of the triangles of all faces.
#[derive(Serialize, Deserialize)]
pub(crate) struct Assignments {
    /// By face and triangle.
    pub(crate) of: Vec<Vec<Assignment>>,
    /// By face: parts of triangles that no setup gets to, though one does to others of the triangle.
    pub(crate) missed: Vec<Vec<[Point2; 3]>>,
    /// By face: where borders between setups cross triangles, by triangle and setup.
    pub(crate) borders: Vec<Vec<Border>>,
    /// Whether anything is cut of which no setup faces more than a slant.
    pub(crate) slants: bool,
}

/// Decides for every triangle of every face which setups cut it; none does where a face is excluded.
///
/// Probes that keep the ball up by no more than half a scallop height along the normal count as reached.
///
/// What is `known` of the places of faces is not asked again.
pub(crate) fn assign(
    model: &Model,
    covering: &Covering,
    views: &Views,
    regions: &Regions,
    known: Option<&dyn SeenBefore>,
) -> Assignments {
    let allowed_mm = ALLOWED * views.scallop_mm;
    let prober = |face: usize, slants: Slants| Prober { model, covering, views, face, allowed_mm, slants };
    let setups = views.frames.len();
    let asking = |face: usize| (!regions.excluded[face]).then(|| prober(face, Slants::Asked));
    let probed =
        |face: usize| asking(face).map_or_else(Vec::new, |prober| prober.triangles(|uv| prober.probe(uv)));
    let mut seen: Vec<Vec<Seen>> = info_span!("probes").in_scope(|| match known {
        Some(known) => known.all(&asking),
        None => (0..model.faces.len()).into_par_iter().map(probed).collect(),
    });
    let _span = info_span!("decisions").entered();
    let radius_mm = views.balls.first().map_or(0.0, BallDrop::radius_mm);
    let least_part_mm2 = LEAST_PART_RADII2 * radius_mm.powi(2);
    let slants = worthy_slants(covering, &mut seen, setups, regions.of_face, least_part_mm2);
    let leads = lead_setups(covering, &seen, setups, regions.of_face, least_part_mm2);
    let decided: Vec<(Vec<Assignment>, Vec<[Point2; 3]>)> = seen
        .par_iter()
        .enumerate()
        .map(|(face, triangles)| {
            let mesh = &covering.meshes()[face];
            if regions.excluded[face] {
                return (vec![Assignment::default(); mesh.triangles.len()], Vec::new());
            }
            let region = regions.of_face[face];
            let (prober, leads) = (prober(face, slants[region]), &leads[region]);
            let mut dividing = Dividing { prober, leads, known: HashMap::new(), missed: Vec::new() };
            let decide_on = |(seen, t): (&[Seen], &[u32; 3])| match views.divides && is_in_doubt(seen) {
                true => dividing.divided(t.map(|i| mesh.uv[i as usize]), HALVINGS),
                false => decide(seen, leads),
            };
            let assigned = triangles.chunks(PROBES * setups).zip(&mesh.triangles).map(decide_on).collect();
            (assigned, dividing.missed)
        })
        .collect();
    let (mut assignments, missed): (Vec<Vec<Assignment>>, Vec<Vec<[Point2; 3]>>) =
        decided.into_iter().unzip();
    let ground = Ground { covering, region_of_face: regions.of_face, seen: &seen, setups, radius_mm };
    let borders = smooth(&ground, &mut assignments);
    leave_small_walls(covering, &mut assignments, setups, LEAST_WALL_RADII2 * radius_mm.powi(2), radius_mm);
    let slants = slants.contains(&Slants::Cut);
    Assignments { of: assignments, missed, borders, slants }
}

/// Region by region, whether what slants is worth passes; what is seen of it says so from then on.
fn worthy_slants(
    covering: &Covering,
    seen: &mut [Vec<Seen>],
    setups: usize,
    region_of_face: &[usize],
    least_part_mm2: f64,
) -> Vec<Slants> {
    let is_slanting = |s: &Seen| matches!(s, Seen::Slanting { .. });
    let mut areas_mm2 = vec![0.0; region_of_face.iter().max().map_or(0, |m| m + 1)];
    for (face, triangles) in seen.iter().enumerate() {
        for (probed, area_mm2) in triangles.chunks(PROBES * setups).zip(covering.areas_mm2(face)) {
            let slanting =
                (0..PROBES).filter(|&p| probed.chunks(PROBES).any(|of_setup| is_slanting(&of_setup[p])));
            areas_mm2[region_of_face[face]] += area_mm2 * slanting.count() as f64 / PROBES as f64;
        }
    }
    let worthy = |area_mm2: f64| if area_mm2 >= least_part_mm2 { Slants::Cut } else { Slants::Left };
    let slants: Vec<Slants> = areas_mm2.into_iter().map(worthy).collect();
    for (triangles, &region) in seen.iter_mut().zip(region_of_face) {
        let cut = slants[region] == Slants::Cut;
        for s in triangles {
            *s = if cut { s.with_slants() } else { s.without_slants() };
        }
    }
    slants
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
fn leave_small_walls(
    covering: &Covering,
    assignments: &mut [Vec<Assignment>],
    setups: usize,
    least_mm2: f64,
    near_mm: f64,
) {
    let cut_mm2 = |(face, assignments): (usize, &Vec<Assignment>)| -> f64 {
        let areas = covering.areas_mm2(face).zip(assignments);
        areas.map(|(area_mm2, assignment)| area_mm2 * f64::from(assignment.cut.iter().sum::<f32>())).sum()
    };
    let mut may_be_left_mm2 = MOST_LEFT * assignments.iter().enumerate().map(cut_mm2).sum::<f64>();
    let small_of = |setup: usize| {
        let of_face = |(face, assignments): (usize, &Vec<Assignment>)| -> Vec<WallTriangle> {
            let mesh = &covering.meshes()[face];
            let all = assignments.iter().zip(covering.areas_mm2(face)).enumerate();
            let walls = all.filter(|(_, (assignment, _))| assignment.walls_cut[setup] > 0.0);
            let wall = |(triangle, (assignment, area_mm2)): (usize, (&Assignment, f64))| {
                let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.points[i as usize].coords);
                let centre = Point3::from((a + b + c) / 3.0);
                WallTriangle {
                    face,
                    triangle,
                    centre,
                    area_mm2: area_mm2 * f64::from(assignment.walls_cut[setup]),
                }
            };
            walls.map(wall).collect()
        };
        let walls: Vec<WallTriangle> = assignments.par_iter().enumerate().flat_map_iter(of_face).collect();
        let groups = together(walls, near_mm, |wall| wall.centre).into_iter().map(move |group| {
            let area_mm2: f64 = group.iter().map(|wall| wall.area_mm2).sum();
            (area_mm2, setup, group)
        });
        groups.filter(|&(area_mm2, ..)| area_mm2 < least_mm2)
    };
    let mut small: Vec<_> = (0..setups).flat_map(small_of).collect();
    small.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (area_mm2, setup, group) in small {
        may_be_left_mm2 -= area_mm2;
        if may_be_left_mm2 < 0.0 {
            break;
        }
        group.iter().for_each(|wall| assignments[wall.face][wall.triangle].leave_wall(setup));
    }
}

/// Triangles of one face that are divided where they are in doubt.
struct Dividing<'a> {
    prober: Prober<'a>,
    /// The setups in the order in which they may claim.
    leads: &'a [usize],
    /// What is seen of places that have been asked: the parts of a triangle, and its neighbours, share most of theirs.
    known: HashMap<[u64; 2], Vec<Seen>>,
    /// What no setup gets to.
    missed: Vec<[Point2; 3]>,
}

impl Dividing<'_> {
    fn seen(&mut self, uv: Point2) -> Vec<Seen> {
        let bits = [uv.x.to_bits(), uv.y.to_bits()];
        self.known.entry(bits).or_insert_with(|| self.prober.probe(uv)).clone()
    }

    /// The fate of a triangle by those of the four that its sides' middles make of it, and so on.
    fn divided(&mut self, [a, b, c]: [Point2; 3], halvings: u32) -> Assignment {
        let middle = nalgebra::center::<f64, 2>;
        let [ab, bc, ca] = [middle(&a, &b), middle(&b, &c), middle(&c, &a)];
        let of_part = |part: [Point2; 3]| {
            let [first, second, third] = part.map(|uv| self.seen(uv));
            let inside = self.seen(centroid(part));
            let seen: Vec<Seen> = by_setup([&inside, &first, &second, &third]).collect();
            if halvings > 1 && is_in_doubt(&seen) {
                return self.divided(part, halvings - 1);
            }
            let assignment = decide(&seen, self.leads);
            if !assignment.is_cut() {
                self.missed.push(part);
            }
            assignment
        };
        Assignment::of_parts([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(of_part))
    }
}

/// For each region, the setups in the order in which they may claim its triangles: whichever faces the
/// largest area well comes first, then the best for what is left, and so on.
fn lead_setups(
    covering: &Covering,
    seen: &[Vec<Seen>],
    setups: usize,
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
            let mut open: Vec<(f64, [bool; MOST_SETUPS])> = Vec::new();
            for &face in faces {
                let areas = covering.areas_mm2(face);
                open.extend(seen[face].chunks(PROBES * setups).zip(areas).map(|(t, area)| {
                    let well = |s: &[Seen]| {
                        s.iter()
                            .any(|p| matches!(p, Seen::Reached { facing, in_bounds: true, .. } if facing.abs() >= GOOD_FACING))
                    };
                    (area, std::array::from_fn(|k| k < setups && well(of_setup(t, k))))
                }));
            }
            let mut order: Vec<usize> = Vec::new();
            loop {
                let sums: [f64; MOST_SETUPS] = std::array::from_fn(|k| {
                    open.iter().filter(|(_, well)| well[k]).map(|(area, _)| area).sum()
                });
                let best = (0..setups).max_by(|&a, &b| sums[a].total_cmp(&sums[b]).then(b.cmp(&a))).unwrap_or(0);
                if sums[best] < least_part_mm2 || order.len() == setups {
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
fn decide(seen: &Probed, leads: &[usize]) -> Assignment {
    let setups = seen.len() / PROBES;
    let at = |k: usize, probe: usize| of_setup(seen, k)[probe];
    let best = |k: usize| {
        let facing = |s: &Seen| if let Seen::Reached { facing, .. } = s { facing.abs() } else { 0.0 };
        of_setup(seen, k).iter().map(facing).fold(0.0, f64::max)
    };
    let mut order: Vec<usize> = leads.iter().copied().filter(|&k| best(k) >= GOOD_FACING).take(1).collect();
    let mut others: Vec<usize> = (0..setups).filter(|k| !order.contains(k) && best(*k) > 0.0).collect();
    others.sort_by(|&a, &b| best(b).total_cmp(&best(a)).then(a.cmp(&b)));
    order.extend(others);

    let mut assignment = Assignment::default();
    let share = 1.0 / PROBES as f32;
    let mut finished = true;
    for probe in 0..PROBES {
        let reached = |inside: bool| {
            order.iter().find_map(|&k| match at(k, probe) {
                Seen::Reached { facing, done, in_bounds } if in_bounds == inside => Some((k, facing, done)),
                _ => None,
            })
        };
        let near = reached(false);
        if let Some((k, facing, done)) = reached(true) {
            assignment.is_for(k, facing);
            assignment.cut[k] += share;
            finished &= done;
        } else if let Some((k, other_side, done)) = (0..setups).find_map(|k| match at(k, probe) {
            Seen::Wall { other_side, done } => Some((k, other_side, done)),
            _ => None,
        }) {
            assignment.walls[usize::from(other_side)] |= 1 << k;
            assignment.cut[k] += share;
            assignment.walls_cut[k] += share;
            finished &= done;
        } else if near.is_some() || (0..setups).any(|k| at(k, probe) == Seen::OutOfBounds) {
            // Places close by may be in bounds.
            near.into_iter().for_each(|(k, facing, _)| assignment.is_for(k, facing));
            assignment.out_of_bounds += share;
        } else if let Some(done) = (0..setups).find_map(|k| match at(k, probe) {
            Seen::Tight { done } => Some(done),
            _ => None,
        }) {
            assignment.tight += share;
            finished &= done;
        } else {
            assignment.hidden += share;
        }
    }
    // What the earlier tool has finished in part, or ends in a corner, is cut as a whole: passes overlap.
    if finished {
        let Assignment { hidden, out_of_bounds, tight, .. } = assignment;
        let done = assignment.cut.iter().sum();
        assignment = Assignment { hidden, out_of_bounds, tight, done, ..Assignment::default() };
    }
    assignment
}
