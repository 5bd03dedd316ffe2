//! What the passes laid so far leave over a place on the model.

use std::collections::HashMap;

use claymill_nurbs::{Point3, Vector3};

use crate::crests::Laid;

/// Passes are looked for within this many cells.
const REACH_CELLS: i32 = 2;
/// A pass that runs less along the feed than this crosses it, as a cosine.
const CROSSING: f64 = 0.2;
const NEWTON_STEPS: usize = 4;

/// All laid passes by where they run in plan.
pub(crate) struct LaidNear<'a> {
    laid: &'a [Laid],
    cell_mm: f64,
    cells: HashMap<[i32; 2], Vec<At>>,
}

/// A sample of a pass.
#[derive(Clone, Copy)]
struct At {
    laid: u32,
    chain: u32,
    profile: u32,
    s: f64,
}

impl At {
    fn profile(&self) -> (u32, u32, u32) {
        (self.laid, self.chain, self.profile)
    }
}

impl<'a> LaidNear<'a> {
    pub(crate) fn new(laid: &'a [Laid], cell_mm: f64) -> Self {
        let mut near = LaidNear { laid, cell_mm, cells: HashMap::new() };
        for (l, row) in laid.iter().enumerate() {
            for (c, chain) in row.chains.iter().enumerate() {
                for (p, profile) in chain.iter().enumerate() {
                    let mut before = None;
                    for sample in &profile.samples {
                        let cell = near.cell(row.guide.at(sample.s));
                        if before != Some(cell) {
                            let at = At { laid: l as u32, chain: c as u32, profile: p as u32, s: sample.s };
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

    /// Height along `normal` over `point` to which the passes near `centre` cut, `feed` being the direction in
    /// which they mostly run; infinite when none does.
    pub(crate) fn left_mm(
        &self,
        point: &Point3,
        normal: &Vector3,
        centre: &Point3,
        feed: &Vector3,
        radius_mm: f64,
    ) -> f64 {
        let [i, j] = self.cell([centre.x, centre.y]);
        let mut lowest = f64::INFINITY;
        // A pass that comes past more than once, a closed one where it ends, counts each time.
        let again_mm = f64::from(4 * REACH_CELLS) * self.cell_mm;
        let mut seen: Vec<At> = Vec::new();
        for di in -REACH_CELLS..=REACH_CELLS {
            for dj in -REACH_CELLS..=REACH_CELLS {
                for at in self.cells.get(&[i + di, j + dj]).into_iter().flatten() {
                    let same = |s: &At| s.profile() == at.profile() && (s.s - at.s).abs() < again_mm;
                    if seen.iter().any(same) {
                        continue;
                    }
                    seen.push(*at);
                    let ball = self.crossing(at, centre, feed);
                    lowest = lowest.min(cut_to_mm(point, normal, &ball, radius_mm));
                }
            }
        }
        lowest
    }

    /// The ball on the pass where it comes past `centre`.
    fn crossing(&self, at: &At, centre: &Point3, feed: &Vector3) -> Point3 {
        let row = &self.laid[at.laid as usize];
        let profile = &row.chains[at.chain as usize][at.profile as usize];
        let (s0, s1) = (profile.start().s, profile.end().s);
        let mut s = at.s;
        let mut ball = *centre;
        for _ in 0..NEWTON_STEPS {
            let ([x, y], [dx, dy]) = (row.guide.at(s), row.guide.direction(s));
            let (z, slope) = profile.at(s);
            ball = Point3::new(x, y, z);
            let along = Vector3::new(dx, dy, slope);
            // A pass that crosses comes nearest where it is nearest.
            let feed = if along.normalize().dot(feed).abs() < CROSSING { along.normalize() } else { *feed };
            let next = (s - (ball - centre).dot(&feed) / along.dot(&feed)).clamp(s0, s1);
            if next == s {
                break;
            }
            s = next;
        }
        ball
    }
}

/// Height over `point` along `normal` to which a ball cuts; infinite when it comes not near.
pub(crate) fn cut_to_mm(point: &Point3, normal: &Vector3, ball: &Point3, radius_mm: f64) -> f64 {
    let from = point - ball;
    let down = from.dot(normal);
    let within = down * down - from.norm_squared() + radius_mm * radius_mm;
    if within >= 0.0 { -down - within.sqrt() } else { f64::INFINITY }
}
