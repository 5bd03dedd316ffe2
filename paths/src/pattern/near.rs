//! What the passes laid so far leave over a place on the model.

use claymill_contact::{EndShape, Location};
use claymill_nurbs::{Point3, Vector3};
use rustc_hash::FxHashMap;

use crate::pattern::rows::crests::PlannedPass;

/// Passes are looked for within this many cells.
const REACH_CELLS: i32 = 2;
/// A pass that runs less along the feed than this crosses it, as a cosine, and of two beside a place.
const CROSSING: f64 = 0.9;
const CROSSING_BESIDE: f64 = 0.2;
const NEWTON_STEPS: usize = 4;
/// A pass comes by where its ball is no further along the feed than this many cells.
const COMES_BY: f64 = 0.1;

/// All laid passes by where they run in plan.
pub(crate) struct PassIndex<'a> {
    laid: &'a [PlannedPass],
    cell_mm: f64,
    cells: FxHashMap<[i32; 2], Vec<At>>,
}

/// A sample of a pass.
#[derive(Clone, Copy)]
struct At {
    laid: u32,
    chain: u32,
    profile: u32,
    s: f64,
    ball: [f32; 3],
}

impl At {
    fn profile(&self) -> (u32, u32, u32) {
        (self.laid, self.chain, self.profile)
    }

    /// Squared distance of the ball from a place, mm².
    fn away(&self, p: &Point3) -> f32 {
        let [a, b, c] = self.ball;
        let [x, y, z] = [p.x, p.y, p.z].map(|c| c as f32);
        (a - x) * (a - x) + (b - y) * (b - y) + (c - z) * (c - z)
    }

    fn ball_mm(&self) -> Point3 {
        Point3::from(self.ball.map(f64::from))
    }
}

/// A place on the model where the ball should touch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    pub(crate) point: Point3,
    pub(crate) normal: Vector3,
    /// The ball's.
    pub(crate) centre: Point3,
    /// Direction in which the passes around mostly run.
    pub(crate) feed: Vector3,
}

impl Touch {
    /// Where a tool at rest touches, in a `point`.
    pub(crate) fn of(rest: &Location, feed: Vector3, point: Point3) -> Self {
        let Location { centre, normal, .. } = *rest;
        Touch { point, normal, centre, feed }
    }
}

impl<'a> PassIndex<'a> {
    pub(crate) fn new(laid: &'a [PlannedPass], cell_mm: f64) -> Self {
        let mut near = PassIndex { laid, cell_mm, cells: FxHashMap::default() };
        for (l, row) in laid.iter().enumerate() {
            for (c, chain) in row.chains.iter().enumerate() {
                for (p, profile) in chain.iter().enumerate() {
                    let mut before = None;
                    for sample in &profile.samples {
                        let [x, y] = row.drive.at(sample.s);
                        let cell = near.cell([x, y]);
                        if before != Some(cell) {
                            let ball = [x as f32, y as f32, sample.z as f32];
                            let [laid, chain, profile] = [l, c, p].map(|k| k as u32);
                            let at = At { laid, chain, profile, s: sample.s, ball };
                            near.cells.entry(cell).or_default().push(at);
                        }
                        before = Some(cell);
                    }
                }
            }
        }
        near
    }

    fn cell(&self, p: [f64; 2]) -> [i32; 2] {
        p.map(|v| (v / self.cell_mm).floor() as i32)
    }

    /// Whether a pass comes past that cuts to no more than `most_mm` over a place.
    pub(crate) fn is_cut(&self, touch: &Touch, end: &EndShape, most_mm: f64) -> bool {
        let Touch { point, normal, centre, .. } = touch;
        let mut passes: Vec<&At> = self.around(centre).collect();
        let cuts = |at: &At| {
            let left_mm = if end.is_ball() {
                cut_to_mm(point, normal, &self.crossing(at, touch, CROSSING).0, end.radius_mm())
            } else {
                let (_, s) = self.crossing(at, touch, CROSSING);
                self.laid[at.laid as usize].left_by_mm(end, point, normal, s)
            };
            left_mm <= most_mm
        };
        // Nearly always the nearest one has, and no other needs to be looked at.
        match passes.iter().min_by(|a, b| a.away(centre).total_cmp(&b.away(centre))) {
            None => return false,
            Some(nearest) if cuts(nearest) => return true,
            Some(_) => passes.sort_by(|a, b| a.away(centre).total_cmp(&b.away(centre))),
        }
        // A pass that comes past more than once, a closed one where it ends, counts each time.
        let again_mm = f64::from(4 * REACH_CELLS) * self.cell_mm;
        let mut seen: Vec<&At> = vec![passes[0]];
        passes.into_iter().skip(1).any(|at| {
            if seen.iter().any(|s| s.profile() == at.profile() && (s.s - at.s).abs() < again_mm) {
                return false;
            }
            seen.push(at);
            cuts(at)
        })
    }

    /// The balls on the nearest passes that come by to the left and to the right of a place, seen along the feed.
    pub(crate) fn beside(&self, touch: &Touch) -> [Option<Point3>; 2] {
        let Touch { normal, centre, feed, .. } = touch;
        let left = normal.cross(feed);
        let mut sides: [Vec<(f32, &At)>; 2] = Default::default();
        for at in self.around(centre) {
            let side = usize::from((at.ball_mm() - centre).dot(&left) < 0.0);
            sides[side].push((at.away(centre), at));
        }
        sides.map(|mut passes| {
            while let Some((_, nearest)) = passes.iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                let (ball, profile) = (self.crossing(nearest, touch, CROSSING_BESIDE).0, nearest.profile());
                if (ball - centre).dot(feed).abs() <= COMES_BY * self.cell_mm {
                    return Some(ball);
                }
                // It ends before it comes by.
                passes.retain(|(_, at)| at.profile() != profile);
            }
            None
        })
    }

    /// Samples of passes, one a cell.
    fn around(&self, p: &Point3) -> impl Iterator<Item = &At> {
        let [i, j] = self.cell([p.x, p.y]);
        let around = (-REACH_CELLS..=REACH_CELLS)
            .flat_map(move |a| (-REACH_CELLS..=REACH_CELLS).map(move |b| [i + a, j + b]));
        around.filter_map(|cell| self.cells.get(&cell)).flatten()
    }

    /// The ball on the pass where it comes past, and where on the drive curve that is.
    fn crossing(&self, at: &At, Touch { centre, feed, .. }: &Touch, crossing: f64) -> (Point3, f64) {
        let row = &self.laid[at.laid as usize];
        let profile = &row.chains[at.chain as usize][at.profile as usize];
        let (s0, s1) = (profile.start().s, profile.end().s);
        let mut s = at.s;
        let mut ball = *centre;
        for _ in 0..NEWTON_STEPS {
            let ([x, y], [dx, dy]) = row.drive.at_with_direction(s);
            let (z, slope) = profile.at(s);
            ball = Point3::new(x, y, z);
            let along = Vector3::new(dx, dy, slope);
            // A pass that crosses comes nearest where it is nearest.
            let crosses = along.normalize().dot(feed).abs() < crossing;
            let feed = if crosses { along.normalize() } else { *feed };
            let next = (s - (ball - centre).dot(&feed) / along.dot(&feed)).clamp(s0, s1);
            if next == s {
                break;
            }
            s = next;
        }
        (ball, s)
    }
}

/// Height over `point` along `normal` to which a ball cuts; infinite when it comes not near.
pub(crate) fn cut_to_mm(point: &Point3, normal: &Vector3, ball: &Point3, radius_mm: f64) -> f64 {
    let from = point - ball;
    let down = from.dot(normal);
    let within = down * down - from.norm_squared() + radius_mm * radius_mm;
    if within >= 0.0 { -down - within.sqrt() } else { f64::INFINITY }
}
