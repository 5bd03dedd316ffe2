//! Scallop heights from the written paths alone: beside each sample of a pass the neighbouring
//! passes, the cusp where the swept balls meet, and its distance from the exact surface.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use claymill_nurbs::{Hint, Point3, Vector3};
use claymill_toolpath::{Cancelled, MoveKind, Packed};
use serde::{Deserialize, Serialize};

use crate::crest_peak::{OF_PASS, Seed, keep_best};
use crate::distribution::Distribution;
use crate::end::crest::EndCrests;
use crate::options::{REACH_STEPS, SCALLOP_BAR};
use crate::parts::{Numbers, Outlook, Parts, Portable, Sees};
use crate::reach::Reach;
use crate::report::{CrestSample, Crests, HISTOGRAM_BIN, HISTOGRAM_BINS, Place, RegionCrests};
use crate::scene::{Scene, Stage};
use crate::swept::{Piece, Swept};
use crate::track::Track;

/// A third pass that has been deeper than this beyond a crest has cut it away: a share of the scallop height, at least in mm.
/// It has to be more than chords take from the paths ([`VerifyOptions::chord_mm`](crate::VerifyOptions::chord_mm)).
const CUT_AWAY_SHARE: f64 = 0.01;
const CUT_AWAY_MM: f64 = 1e-3;
/// Neighbours nearer than this run on the same line, mm.
const SAME_LINE_MM: f64 = 1e-3;
/// The next turn of a spiral is a neighbour of its own pass: it lies aside, by this share of its distance at least, and leads the
/// same way or back (cosine, 60°). What the pass comes to over a hump lies below.
const ASIDE: f64 = 0.5;
const ALONG: f64 = 0.5;
/// Of one pass, pieces that cross at distances nearer to each other than by this share are parts of one line.
const SAME_TURN: f64 = 0.5;

/// Behind the ends of passes, what is left up to so many scallop heights may be a crest.
const BEYOND_ENDS: f64 = 5.0;

/// Crests within these shares of the height asked for count as even.
const EVEN: (f64, f64) = (0.90, SCALLOP_BAR);

/// A crest beside a pass.
pub(crate) struct Standing {
    pub(crate) crest: CrestSample,
    /// Length of the pass that it stands for.
    pub(crate) length_mm: f32,
    /// Whether two passes of one region and setup run on either side of it.
    pub(crate) inside: bool,
}

/// The crests along one pass.
#[derive(Default)]
pub(crate) struct Along {
    pub(crate) crests: Vec<Standing>,
    pub(crate) highest: Option<(f64, Place)>,
    /// Higher than the limit where the ball does not fit: what is left there is no scallop.
    pub(crate) out_of_reach: u64,
    /// Where the crests may be higher between two samples, or beyond the last one.
    pub(crate) seeds: Vec<Seed>,
    /// Where it was asked what the tool can reach.
    pub(crate) asked: Vec<Outlook>,
}

impl Along {
    /// Takes in a crest, and its place if it is the highest so far.
    pub(crate) fn stand(&mut self, standing: Standing, place: impl FnOnce() -> Place) {
        let height_mm = standing.crest.height_mm;
        self.crests.push(standing);
        if self.highest.as_ref().is_none_or(|highest| height_mm > highest.0) {
            self.highest = Some((height_mm, place()));
        }
    }
}

/// Crests along a pass as they are kept.
#[derive(Serialize, Deserialize)]
pub(crate) struct KeptAlong {
    /// Foot and height of each, mm.
    crests: Packed,
    /// Length of the pass that each stands for, mm; negative where it is not inside.
    lengths: Packed,
    highest: Option<(f64, Place)>,
    out_of_reach: u64,
    /// Place and promise, mm.
    seeds: Packed,
}

impl Portable for Along {
    type Form = KeptAlong;

    fn form(&self, numbers: &Numbers<'_>) -> Option<KeptAlong> {
        let row = |p: &Point3, mm: f64| [p.x, p.y, p.z, mm];
        let length = |s: &Standing| if s.inside { s.length_mm } else { -s.length_mm };
        Some(KeptAlong {
            crests: Packed::doubles(self.crests.iter().flat_map(|s| row(&s.crest.foot, s.crest.height_mm))),
            lengths: Packed::singles(self.crests.iter().map(length)),
            highest: numbers.own_at(self.highest.as_ref())?,
            out_of_reach: self.out_of_reach,
            seeds: Packed::doubles(self.seeds.iter().flat_map(|s| row(&s.at, s.promise_mm))),
        })
    }

    fn of_form(form: KeptAlong, numbers: &Numbers<'_>) -> Option<Along> {
        let crests = form.crests.rows_of_doubles().zip(form.lengths.rows_of_singles());
        let standing = |([x, y, z, height_mm], [length_mm]): ([f64; 4], [f32; 1])| Standing {
            crest: CrestSample { foot: Point3::new(x, y, z), height_mm },
            length_mm: length_mm.abs(),
            inside: length_mm.is_sign_positive(),
        };
        let seed = |[x, y, z, promise_mm]: [f64; 4]| Seed { at: Point3::new(x, y, z), promise_mm };
        Some(Along {
            crests: crests.map(standing).collect(),
            highest: numbers.at(form.highest)?,
            out_of_reach: form.out_of_reach,
            seeds: form.seeds.rows_of_doubles().map(seed).collect(),
            asked: Vec::new(),
        })
    }

    fn asks_far(&self) -> &[Outlook] {
        &self.asked
    }
}

/// The crest on one side of a pass at one place.
#[derive(Clone, Copy)]
struct Beside {
    foot: Point3,
    height_mm: f64,
    feed: Vector3,
}

/// Measures the crests that neighbouring passes leave between them, from the written paths alone: for each
/// sample on a pass the nearest pass on either side, the cusp where the two swept balls meet, and its exact
/// distance from the surface.
///
/// ```text
///         c        c₂          plane perpendicular to the feed at c
///        ● R      ● R          x: the two tubes meet
///         ╲  ╲  ╱  ╱
///     ─────╲__x___╱─────       height of x over the faces = scallop
/// ```
pub(crate) fn measure(
    scene: &Scene<'_>,
    swept: &Swept<'_>,
    reach: &Reach<'_>,
    parts: &Parts<'_>,
    stage: &Stage<'_>,
) -> Result<(Crests, Vec<CrestSample>, Vec<Seed>), Cancelled> {
    let passes: Vec<&Track> = scene.tracks.iter().filter(|t| t.kind == MoveKind::Cut).collect();
    let look = |track: &Track| match &track.end {
        None => crests_along(scene, swept, reach, track),
        Some(body) => EndCrests { scene, swept, reach, track, body }.along(),
    };
    let found: Vec<Along> = parts.along(("crests", Sees::Moves), &passes, stage, look)?;

    let (mut heights, mut inside) = (Distribution::default(), Distribution::default());
    let mut by_region: BTreeMap<usize, Distribution> = BTreeMap::new();
    let mut highest: Option<(f64, Place)> = None;
    let mut samples = Vec::with_capacity(found.iter().map(|f| f.crests.len()).sum());
    let mut out_of_reach = 0;
    let mut seeds = Vec::new();
    for (track, along) in passes.iter().zip(found) {
        out_of_reach += along.out_of_reach;
        seeds.extend(along.seeds);
        let regional = by_region.entry(track.region).or_default();
        for Standing { crest, length_mm, inside: is_inside } in along.crests {
            heights.add(crest.height_mm, f64::from(length_mm));
            regional.add(crest.height_mm, f64::from(length_mm));
            if is_inside {
                inside.add(crest.height_mm, f64::from(length_mm));
            }
            samples.push(crest);
        }
        if let Some(h) = along.highest
            && highest.as_ref().is_none_or(|best| h.0 > best.0)
        {
            highest = Some(h);
        }
    }
    let asked = scene.scallop_mm();
    let bin = |v: f64| ((v.max(0.0) / (HISTOGRAM_BIN * asked)) as usize).min(HISTOGRAM_BINS - 1);
    let is_even = |v: f64| (EVEN.0 * asked..=EVEN.1 * asked).contains(&v);
    let regional = |(region, heights): (usize, Distribution)| RegionCrests {
        region,
        max_mm: heights.max(),
        p99_mm: heights.percentile(0.99),
        p95_mm: heights.percentile(0.95),
        mean_mm: heights.mean(),
    };
    let crests = Crests {
        samples: heights.count(),
        max_mm: highest.as_ref().map_or(0.0, |h| h.0),
        max_at: highest.map(|h| h.1),
        p99_mm: heights.percentile(0.99),
        p95_mm: heights.percentile(0.95),
        mean_mm: heights.mean(),
        even_share: heights.share(is_even),
        inside_share: if heights.weight() > 0.0 { inside.weight() / heights.weight() } else { 0.0 },
        even_inside_share: inside.share(is_even),
        histogram: heights.shares(HISTOGRAM_BINS, bin),
        out_of_reach,
        by_region: by_region.into_iter().filter(|r| r.1.count() > 0).map(regional).collect(),
    };
    Ok((crests, samples, seeds))
}

fn crests_along(scene: &Scene<'_>, swept: &Swept<'_>, reach: &Reach<'_>, track: &Track) -> Along {
    let limit = scene.options.scallop_limit * scene.scallop_mm();
    let spare = limit - scene.scallop_mm();
    let (radius, h) = (track.radius_mm, scene.scallop_mm().min(track.radius_mm));
    let step_over = scene.step_over_mm(radius);
    let cut_away_mm = CUT_AWAY_MM.max(CUT_AWAY_SHARE * scene.scallop_mm());
    let mut along = Along::default();
    let mut at_contact = Hint::default();
    let mut at_crest = [Hint::default(), Hint::default()];
    let stations = track.stations(scene.options.crest_spacing_mm);
    let mut beside_pass: [Vec<Option<Beside>>; 2] = Default::default();
    // Interval middles: knots and ends of passes have no perpendicular plane of their own.
    for pair in stations.windows(2) {
        let t = 0.5 * (pair[0] + pair[1]);
        let (c, speed) = track.centre(t);
        let Some(feed) = speed.try_normalize(1e-9) else {
            continue;
        };
        let Some(contact) = scene.closest.closest_from(&c, radius + h, &mut at_contact) else {
            continue;
        };
        let up = (c - contact.point) / contact.distance_mm.max(1e-9);
        let sides = neighbours(swept, track, &c, &feed, &up, REACH_STEPS * step_over);
        let beside = own_beside(swept, track, &sides);
        beside_pass.iter_mut().for_each(|side| side.push(None));
        for (side, hint) in at_crest.iter_mut().enumerate() {
            let Some(piece) = sides[side][0] else { continue };
            let other = swept.track(&piece);
            let (through, direction, _) = crossing(other, piece.parameters, &c, &feed);
            let Some(top) = cusp(&c, radius, &feed, &up, (&through, &direction, other.radius_mm)) else {
                continue;
            };
            if swept.covers(&top, cut_away_mm) {
                continue;
            }
            let Some(foot) = scene.closest.closest_from(&top, radius, hint) else {
                continue;
            };
            if !scene.faces_squarely(&foot, &top) {
                continue;
            }
            let Some((n, _)) = scene.model.faces[foot.face].surface.normal(foot.u, foot.v) else {
                continue;
            };
            let normal = if n.dot(&up) < 0.0 { -n } else { n };
            // A sheet without thickness is finished when one of its sides is.
            let back = foot.point - normal * scene.scallop_mm();
            if foot.distance_mm > scene.scallop_mm() && swept.covers(&back, 0.0) {
                continue;
            }
            let below = (top - foot.point).dot(&normal) < 0.0;
            let height_mm = if below { -foot.distance_mm } else { foot.distance_mm };
            let free = scene.free_sides[foot.face];
            let is_left = || {
                free.allows(n.dot(&normal) > 0.0)
                    && reach.is_left(&foot.point, &normal, spare, free.is_both())
            };
            if height_mm > limit {
                along.asked.push(Outlook { at: foot.point, normal });
                if !is_left() {
                    along.out_of_reach += 1;
                    continue;
                }
            }
            if let Some(last) = beside_pass[side].last_mut() {
                *last = Some(Beside { foot: foot.point, height_mm, feed });
            }
            let standing = Standing {
                crest: CrestSample { foot: foot.point, height_mm },
                length_mm: (pair[1] - pair[0]) as f32,
                inside: beside[side] == [true; 2] && beside[1 - side][0],
            };
            along.stand(standing, || Place {
                move_seq: Some(track.seq),
                parameter: Some(t),
                ..scene.place(top, Some(foot.face))
            });
        }
    }
    for side in &beside_pass {
        along.seeds.extend(promising(side));
        along.seeds.extend(beyond_ends(scene, swept, side, 0.5 * step_over));
    }
    keep_best(&mut along.seeds, OF_PASS);
    along
}

/// Of the nearest passes on either side and those beyond them, which are of the same region and setup.
pub(crate) fn own_beside(
    swept: &Swept<'_>,
    track: &Track,
    sides: &[[Option<Piece>; 2]; 2],
) -> [[bool; 2]; 2] {
    let is_own = |piece: &Option<Piece>| {
        piece.as_ref().is_some_and(|p| {
            let other = swept.track(p);
            (other.region, other.setup) == (track.region, track.setup)
        })
    };
    sides.each_ref().map(|side| side.each_ref().map(is_own))
}

/// Where crests may rise between two samples: as far again as they rise to a sample from the one beside it.
fn promising(side: &[Option<Beside>]) -> impl Iterator<Item = Seed> + '_ {
    let height = |k: Option<usize>| k.and_then(|k| side.get(k).copied().flatten()).map(|b| b.height_mm);
    side.iter().enumerate().filter_map(move |(k, here)| {
        let Beside { foot, height_mm, .. } = (*here)?;
        let rise = [height(k.checked_sub(1)), height(Some(k + 1))].into_iter().flatten();
        let rise = rise.map(|beside| height_mm - beside).fold(0.0, f64::max);
        Some(Seed { at: foot, promise_mm: height_mm + rise })
    })
}

/// Half a step-over before the first crest beside a pass and behind the last one, where the balls of other moves meet theirs.
fn beyond_ends<'a>(
    scene: &'a Scene<'_>,
    swept: &'a Swept<'_>,
    side: &'a [Option<Beside>],
    ahead_mm: f64,
) -> impl Iterator<Item = Seed> + 'a {
    let first = side.iter().flatten().next().map(|b| (b, -ahead_mm));
    let last = side.iter().flatten().next_back().map(|b| (b, ahead_mm));
    [first, last].into_iter().flatten().filter_map(move |(b, mm)| {
        let foot = scene.closest.closest(&(b.foot + b.feed * mm), ahead_mm)?;
        let (n, _) = scene.model.faces[foot.face].surface.normal(foot.u, foot.v)?;
        let free = scene.free_sides[foot.face];
        let left = swept.residual(&foot.point, &n, BEYOND_ENDS * scene.scallop_mm(), free)?;
        Some(Seed {
            at: foot.point,
            promise_mm: left.height_mm.max(b.height_mm) + (left.height_mm - b.height_mm).abs(),
        })
    })
}

/// The nearest other pass, or other turn of its own, on either side of `c`, where it crosses the plane perpendicular to the feed,
/// and the nearest but one.
pub(crate) fn neighbours(
    swept: &Swept<'_>,
    track: &Track,
    c: &Point3,
    feed: &Vector3,
    up: &Vector3,
    reach_mm: f64,
) -> [[Option<Piece>; 2]; 2] {
    let aside = feed.cross(up);
    let mut nearest: [[Option<(Piece, f64)>; 2]; 2] = [[None; 2]; 2];
    swept.visit_near(c, reach_mm, |piece| {
        let other = swept.track(piece);
        if other.kind != MoveKind::Cut {
            return ControlFlow::Continue(());
        }
        let (a, b) = (piece.capsule.a - c, piece.capsule.b - c);
        let (da, db) = (a.dot(feed), b.dot(feed));
        if da * db > 0.0 || da == db {
            return ControlFlow::Continue(());
        }
        let v = a + (b - a) * (da / (da - db));
        let (beside, distance) = (v.dot(&aside), v.norm());
        if distance > reach_mm || beside.abs() < SAME_LINE_MM {
            return ControlFlow::Continue(());
        }
        let leads_along = || (b - a).dot(feed).abs() > ALONG * (b - a).norm();
        if is_of_pass(other, track) && !(beside.abs() > ASIDE * distance && leads_along()) {
            return ControlFlow::Continue(());
        }
        let [first, second] = &mut nearest[usize::from(beside > 0.0)];
        let found = Some((*piece, distance));
        let is_nearer = |than: &Option<(Piece, f64)>| than.is_none_or(|(_, best)| distance < best);
        let is_same = |found: &Option<(Piece, f64)>| {
            found.is_some_and(|(p, at)| {
                let apart = (distance - at).abs() > SAME_TURN * distance.min(at);
                is_of_pass(swept.track(&p), other) && !apart
            })
        };
        if is_nearer(first) {
            if !is_same(first) {
                *second = *first;
            }
            *first = found;
        } else if !is_same(first) && is_nearer(second) {
            *second = found;
        }
        ControlFlow::Continue(())
    });
    nearest.map(|side| side.map(|found| found.map(|(piece, _)| piece)))
}

fn is_of_pass(a: &Track, b: &Track) -> bool {
    (a.region, a.pass) == (b.region, b.pass) && a.setup == b.setup
}

/// Where exactly a track crosses the plane through `c` perpendicular to `feed`, its direction and parameter there; the
/// crossing lies between the two parameters.
pub(crate) fn crossing(
    track: &Track,
    (mut low, mut high): (f64, f64),
    c: &Point3,
    feed: &Vector3,
) -> (Point3, Vector3, f64) {
    let ahead = |t: f64| (track.centre(t).0 - c).dot(feed);
    let (mut at_low, mut at_high) = (ahead(low), ahead(high));
    let mut t = 0.5 * (low + high);
    // Secant steps that keep the bracket; pieces are nearly straight, so that two or three are enough.
    for _ in 0..5 {
        if at_high != at_low {
            t = (low - (high - low) * at_low / (at_high - at_low)).clamp(low, high);
        }
        let here = ahead(t);
        if here.abs() < 1e-9 {
            break;
        }
        if (here > 0.0) == (at_high > 0.0) {
            (high, at_high) = (t, here);
        } else {
            (low, at_low) = (t, here);
        }
    }
    let (centre, way) = track.centre(t);
    (centre, way, t)
}

/// The point toward the surface where the circle of the ball at `c`, perpendicular to the feed, meets the
/// tube of another pass, given by a point in the same plane, the direction there and the radius. For
/// parallel passes this is the intersection of two circles; from there Newton accounts for obliqueness.
fn cusp(
    c: &Point3,
    r: f64,
    feed: &Vector3,
    up: &Vector3,
    (through, direction, r2): (&Point3, &Vector3, f64),
) -> Option<Point3> {
    let v = through - c;
    let d = v.norm();
    let e = v / d;
    let g = feed.cross(&e);
    let down = if g.dot(up) > 0.0 { -g } else { g };
    let axis = direction.try_normalize(1e-12)?;

    let mut cosine = (d * d + r * r - r2 * r2) / (2.0 * d * r);
    if cosine.abs() >= 1.0 {
        return None;
    }
    let mut angle = cosine.acos();
    for _ in 0..10 {
        let sine = angle.sin();
        cosine = angle.cos();
        let x = c + (e * cosine + down * sine) * r;
        let arm = x - through;
        let arm = arm - axis * arm.dot(&axis);
        let miss = arm.norm() - r2;
        if miss.abs() < 1e-10 {
            return Some(x);
        }
        let rate = arm.dot(&(down * cosine - e * sine)) * r / arm.norm();
        angle -= miss / rate;
        if !angle.is_finite() {
            return None;
        }
    }
    None
}
