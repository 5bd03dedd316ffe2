//! Further rows wherever the exact paths of two neighbours leave too much between them.
//!
//! The raster spaces rows by the surface's slope and curvature in the middle of each triangle. Over creases,
//! tight bends and places where a row ends early that is not the whole truth, so the rows are held against
//! the model once more: halfway between two neighbours the ball is dropped, which tells where the surface is,
//! and what the two leave over that contact is measured along the normal there.
//!
//! ```text
//!      a        m        b      m: exact location halfway
//!      ●        ○        ●      x: where the balls at a and b meet
//!       ╲______ x ______╱
//!     ──────────┴───────────    height of x over m's contact = crest
//! ```

use std::collections::BTreeMap;

use claymill_contact::{BallDrop, Location, March, Support};
use claymill_nurbs::{FaceId, Point2, Point3, Vector3};
use rayon::prelude::*;

use crate::curve::drive::DriveCurve;
use crate::follow::profile::{Chain, Profile, STEEPEST_NZ};
use crate::pattern::near::{PassIndex, Touch, cut_to_mm};
use crate::pattern::rows::raster::{Raster, Row};
use crate::pattern::step_over::{come_by_mm, flat_mm};

/// Neighbouring rows are not parted further below this share of the flat step-over.
const CLOSEST: f64 = 0.08;

/// Close to the end of a part, crests are worth a pass of their own from this share of the scallop height on: the passes of
/// what is beyond, which are not known here, mostly lower them.
pub(crate) const WORTH_A_PASS: f64 = 1.25;

/// A row with its exact path.
#[derive(Debug, Clone)]
pub(crate) struct PlannedPass {
    /// Position across the rows.
    pub(crate) q: f64,
    /// What the row runs over.
    pub(crate) drive: DriveCurve,
    /// The stretches of it that were to be followed.
    pub(crate) planned: Vec<(f64, f64)>,
    /// Its exact path; gaps between chains are not cut.
    pub(crate) chains: Vec<Chain>,
    /// Planned since the crests were last looked at.
    pub(crate) fresh: bool,
}

/// The ball on a row: its centre and the direction it moves in.
#[derive(Debug, Clone, Copy)]
struct OnRow<'a> {
    row: &'a PlannedPass,
    centre: Point3,
    feed: Vector3,
    face: Option<FaceId>,
    q: f64,
    fresh: bool,
}

/// What is on a row at some place.
#[derive(Debug, Clone, Copy)]
enum There<'a> {
    Ball(OnRow<'a>),
    /// The ball was to come by and cannot.
    Barred {
        q: f64,
        fresh: bool,
    },
}

impl<'a> There<'a> {
    fn q(&self) -> f64 {
        match self {
            There::Ball(OnRow { q, .. }) | There::Barred { q, .. } => *q,
        }
    }

    fn fresh(&self) -> bool {
        match self {
            There::Ball(OnRow { fresh, .. }) | There::Barred { fresh, .. } => *fresh,
        }
    }

    fn ball(&self) -> Option<&OnRow<'a>> {
        match self {
            There::Ball(ball) => Some(ball),
            There::Barred { .. } => None,
        }
    }
}

/// A place between two rows where these leave too much, by what is abreast of it.
#[derive(Debug, Clone, Copy)]
struct Crest {
    q: f64,
    column: usize,
    m: Location,
    feed: Vector3,
}

impl PlannedPass {
    /// How much of what was to be followed is not, mm.
    pub(crate) fn left_mm(&self) -> f64 {
        let planned: f64 = self.planned.iter().map(|(a, b)| b - a).sum();
        let ends = |chain: &Chain| Some(chain.last()?.end().s - chain.first()?.start().s);
        planned - self.chains.iter().filter_map(ends).sum::<f64>()
    }

    fn there(&self, s: f64) -> Option<There<'_>> {
        let planned = || self.planned.iter().any(|&(from, to)| from <= s && s <= to);
        let barred = || planned().then_some(There::Barred { q: self.q, fresh: self.fresh });
        self.at(s).map(There::Ball).or_else(barred)
    }

    fn profile_at(&self, s: f64) -> Option<&Profile> {
        let holds = |c: &&Chain| c[0].start().s <= s && s <= c[c.len() - 1].end().s;
        let chain = self.chains.iter().find(holds)?;
        chain.iter().find(|p| s <= p.end().s)
    }

    /// Where the ball's centre is, or the middle of another end.
    pub(crate) fn centre_at(&self, s: f64) -> Option<Point3> {
        let [x, y] = self.drive.at(s);
        Some(Point3::new(x, y, self.profile_at(s)?.at(s).0))
    }

    fn at(&self, s: f64) -> Option<OnRow<'_>> {
        let profile = self.profile_at(s)?;
        let (z, slope) = profile.at(s);
        let [x, y] = self.drive.at(s);
        let [ex, ey] = self.drive.direction(s);
        Some(OnRow {
            row: self,
            centre: Point3::new(x, y, z),
            feed: Vector3::new(ex, ey, slope).normalize(),
            face: profile.face_at(s),
            q: self.q,
            fresh: self.fresh,
        })
    }
}

/// Rows halfway between neighbours in `laid` (sorted by position) where these leave crests higher than
/// `scallop_mm` on what is the part's own: by the raster, and by `claimed` (a face, and the parameters on it).
/// Over an edge it counts only where both rows run on the part: beyond its border others cut. Where one of the two is
/// barred, what can be reached ends between them, and the other one may be a step away from there. Only pairs with a
/// fresh row are looked at, and nothing is missing where passes in the valleys cut.
pub(crate) fn missing_rows(
    ball: &BallDrop,
    raster: &Raster,
    laid: &[PlannedPass],
    in_valleys: &PassIndex,
    scallop_mm: f64,
    drive: impl Fn(f64) -> DriveCurve + Sync,
    claimed: impl Fn(FaceId, Option<Point2>) -> bool + Sync,
) -> Vec<Row> {
    let closest_mm = CLOSEST * flat_mm(ball.radius_mm(), scallop_mm);
    let on_part = |beside: [Option<&OnRow>; 2], m: &Location| match m.support {
        Support::Face { u, v } => claimed(m.face, Some(Point2::new(u, v))),
        Support::Edge | Support::Bound => {
            let whole =
                |row: Option<&OnRow>| row.is_some_and(|row| row.face.is_none_or(|f| claimed(f, None)));
            claimed(m.face, None) && beside.into_iter().all(whole)
        }
        Support::Side => false,
    };
    let of_column = |column: usize| {
        let s = raster.middle(column);
        let mut found = Vec::new();
        let mut before: Option<There> = None;
        let mut march = March::new(ball);
        for b in laid.iter().filter_map(|row| row.there(s)) {
            if let Some(a) = before
                && (a.fresh() || b.fresh())
                && (a.ball().is_some() || b.ball().is_some())
                && b.q() - a.q() > 2.0 * closest_mm
                && let Some(q) = raster.claimed_between(column, a.q(), b.q())
            {
                let mut look = |q: f64, beside: [Option<&OnRow>; 2]| {
                    let [x, y] = drive(q).at(s);
                    let m = march.drop(x, y).filter(|m| m.normal.z >= STEEPEST_NZ && on_part(beside, m))?;
                    let [ex, ey] = drive(q).direction(s);
                    let feed = Vector3::new(ex, ey, m.slope(ex, ey)).normalize();
                    let left = |row: &OnRow| match ball.end() {
                        end if end.is_ball() => left_mm(row, &m, &feed, ball.radius_mm()),
                        end => row.row.left_by_mm(&end, &ball.contact(&m), &m.normal, s),
                    };
                    let left = beside.map(|row| row.map_or(f64::INFINITY, left));
                    Some((Crest { q, column, m, feed }, left))
                };
                let beside = [a.ball(), b.ball()];
                // Where only one of the two has cut down to the middle, the other touches something else: the crest is
                // nearer to that one, up to where the part ends.
                let halfway = look(q, beside);
                let towards = match halfway {
                    Some((crest, [left, right])) if left.min(right) > scallop_mm => {
                        found.push(crest);
                        None
                    }
                    Some((_, [_, right])) if right > scallop_mm => Some(b.q()),
                    Some((_, [left, _])) if left > scallop_mm => Some(a.q()),
                    _ => None,
                };
                let between = |on: f64, off: f64| {
                    let at = raster.claimed_between(column, on.min(off), on.max(off))?;
                    ((off - on).abs() > closest_mm && at != on && at != off).then_some(at)
                };
                let end =
                    towards.and_then(|off| up_to_the_end(q, off, scallop_mm, between, |q| look(q, beside)));
                found.extend(end);
            }
            before = Some(b);
        }
        found
    };
    let mut found: Vec<Crest> = (0..raster.columns()).into_par_iter().flat_map_iter(of_column).collect();
    if !found.is_empty() {
        // Aslant over a valley, rows come past somewhere else than abreast.
        let near = PassIndex::new(laid, come_by_mm(&ball.end(), scallop_mm));
        let is_left = |Crest { m, feed, .. }: &Crest| {
            let touch = Touch::of(m, *feed, ball.contact(m));
            ![&near, in_valleys].into_iter().any(|near| near.is_cut(&touch, &ball.end(), scallop_mm))
        };
        found = found.into_par_iter().filter(is_left).collect();
    }
    let mut columns_at: BTreeMap<u64, (f64, Vec<usize>)> = BTreeMap::new();
    for Crest { q, column, .. } in found {
        columns_at.entry(q.to_bits()).or_insert((q, Vec::new())).1.push(column);
    }
    let mut rows: Vec<Row> =
        columns_at.into_values().map(|(q, columns)| raster.row_over(q, &columns)).collect();
    rows.sort_by(|a, b| a.q.total_cmp(&b.q));
    rows
}

/// The first crest that is too high on the way from a place `on` the part to one `off` it, by halving; what is left over a
/// place by the rows on both sides comes from `look`, which finds nothing off the part.
fn up_to_the_end(
    mut on: f64,
    mut off: f64,
    scallop_mm: f64,
    between: impl Fn(f64, f64) -> Option<f64>,
    mut look: impl FnMut(f64) -> Option<(Crest, [f64; 2])>,
) -> Option<Crest> {
    let mut high_mm = scallop_mm;
    while let Some(at) = between(on, off) {
        match look(at) {
            Some((crest, [left, right])) if left.min(right) > high_mm => return Some(crest),
            Some(_) => on = at,
            None => off = at,
        }
        high_mm = WORTH_A_PASS * scallop_mm;
    }
    None
}

/// What the ball on a row leaves over `m`'s contact, along the normal there.
fn left_mm(p: &OnRow, m: &Location, feed: &Vector3, radius_mm: f64) -> f64 {
    let contact = m.centre - m.normal * radius_mm;
    // Where the path crosses the plane through m across the feed.
    let crossing = p.centre + p.feed * ((m.centre - p.centre).dot(feed) / p.feed.dot(feed));
    cut_to_mm(&contact, &m.normal, &crossing, radius_mm)
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::analytic::{Frame as Placement, plane_patch};

    use super::*;
    use crate::Frame;
    use crate::curve::drive::Line;
    use crate::follow::profile::follow;
    use crate::pattern::rows::raster::Patch;
    use claymill_contact::Covering;

    const R: f64 = 10.0;
    const SCALLOP_MM: f64 = 0.1;

    /// Rows along x over a plane of 200 by 40 mm that rises at `tilt_deg` across them.
    fn further_rows(tilt_deg: f64, at: &[f64]) -> Vec<f64> {
        let (sine, cosine) = tilt_deg.to_radians().sin_cos();
        let normal = Vector3::new(0.0, -sine, cosine);
        let placement = Placement::new(Point3::origin(), normal, Vector3::x()).unwrap();
        let surface = plane_patch(&placement, (0.0, 200.0), (0.0, 40.0)).unwrap();
        let model = claymill_tests::model_of([surface]);
        let covering = Covering::new(&model, &[false], 8000.0, R).unwrap();
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        let ball = BallDrop::new(&model, &covering, &top, R);
        let corners = [[0.0, 0.0], [200.0, 0.0], [200.0, 40.0 * cosine], [0.0, 40.0 * cosine]];
        let patch = |k: [usize; 3]| Patch { corners: k.map(|i| corners[i]), distance_mm: 2.8, stretch: 1.0 };
        let raster = Raster::new(&[patch([0, 1, 2]), patch([0, 2, 3])], 1.4, 0.0).unwrap();
        let drive = |q: f64| DriveCurve::Straight(Line { origin: [0.0, q], direction: [1.0, 0.0] });
        let laid: Vec<PlannedPass> = at
            .iter()
            .map(|&q| PlannedPass {
                q,
                drive: drive(q),
                planned: vec![(1.0, 199.0)],
                chains: follow(&ball, &drive(q), 1.0, 199.0).chains,
                fresh: true,
            })
            .collect();
        let rows =
            missing_rows(&ball, &raster, &laid, &PassIndex::new(&[], 1.0), SCALLOP_MM, drive, |_, _| true);
        for row in &rows {
            let [(from, to)] = row.stretches[..] else { panic!("{row:?}") };
            assert!(from < 4.0 && to > 196.0, "{row:?}");
        }
        rows.iter().map(|row| row.q).collect()
    }

    #[test]
    fn rows_are_added_just_where_the_step_over_formula_says() {
        // s = 2 √(2 R h − h²) = 2.8213 mm on the surface, times the cosine of its tilt across the rows.
        for tilt_deg in [0.0, 35.0, 60.0_f64] {
            let step = crate::pattern::step_over::flat_mm(R, SCALLOP_MM) * tilt_deg.to_radians().cos();
            let close = 5.0 + 0.999 * step;
            assert_eq!(further_rows(tilt_deg, &[5.0, close]), Vec::<f64>::new(), "{tilt_deg}");
            let wide = 5.0 + 1.001 * step;
            let added = further_rows(tilt_deg, &[5.0, wide, wide + 0.9 * step]);
            assert_eq!(added.len(), 1, "{tilt_deg}");
            approx::assert_abs_diff_eq!(added[0], 0.5 * (5.0 + wide), epsilon = 1e-3);
        }
    }
}
