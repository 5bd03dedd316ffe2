//! The engagement of every cutting move of levels: how far around the tool cuts, at every place of every move.
//!
//! ```text
//!          feed →           In the plane of a level everything that was cut is a union of discs, one every few hundredths of a
//!      ○○○○○○○○○○           millimetre of the way. The front half of the tool's circle, less the arcs inside of earlier
//!     ○○○○○○○○(   )═        discs, less what was never stock, is what it cuts with now (closed forms; discs instead of
//!      ○○○○○○○○○○           sweeps make it larger by less than 0.1 µm of depth).
//! ```
//!
//! Moves whose height changes are entries. They cut as they must, are counted apart, and only clear.

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, Curve3, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, ToolRecord};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::discs::{Discs, turned};
use super::error::{KeepGoing, StockError};
use super::flatten::{Chord, flatten};
use super::initial::InitialStock;
use crate::across::across;
use crate::report::Place;

/// Width of a bin of the histogram, degrees.
pub const ENGAGEMENT_BIN_DEG: f64 = 5.0;
/// Bins of the histogram, the last with all that is more.
pub const ENGAGEMENT_BINS: usize = 36;
/// Curves become chords within this distance, mm.
const CHORD_MM: f64 = 2e-4;
/// Discs leave cusps between them that are no higher than this, mm.
const CUSP_MM: f64 = 1e-4;
/// The engagement is measured this often at least, in radii of the tool.
const SPACING: f64 = 0.03;
/// Planes are this much above the lower end of the flank, mm: a skin that an earlier cut at the same height left by rounding is
/// below it.
const ABOVE_MM: f64 = 0.02;
/// Heights that differ by less are one level, mm.
const LEVEL_MM: f64 = 1e-3;
/// A move whose height changes by more is an entry, mm.
const LEVEL_MOVE_MM: f64 = 2e-4;
/// Ends of what was never stock are found to this, degrees.
const END_DEG: f64 = 0.01;
/// Arcs are looked at this often for what was never stock, degrees.
const SCAN_DEG: f64 = 1.0;
/// Places of which it is kept what was told of them.
const KNOWN: usize = 8;

/// The engagement of the level moves of a program.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelEngagement {
    /// Length of level moves that was looked at, mm.
    pub length_mm: f64,
    /// Length by engagement: bins of 5°, the first with all that cuts nothing.
    pub histogram_mm: Vec<f64>,
    /// The largest engagement, degrees, and where.
    pub largest: Option<LevelPose>,
    /// Moves whose height changes and that cut: entries.
    pub entries: u64,
    /// Levels.
    pub levels: u64,
}

/// An engagement at a place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelPose {
    /// Sum of the engaged angles, degrees.
    pub angle_deg: f64,
    /// The tip, with move and parameter.
    pub at: Place,
}

/// Whether a place is stock, and within which distance all other places are as it is, mm; no more than a limit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Told {
    pub(crate) is_stock: bool,
    pub(crate) alike_mm: f64,
}

/// What there is to be cut along one axis.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    /// No stock is out of this box.
    pub(crate) bounds: Aabb,
    /// What is told of a place within a limit: stock is what no move along another axis took away before.
    pub(crate) tell: &'a (dyn Fn(&Point3, f64) -> Told + Sync),
}

/// Asks what is told of places that are mostly close to each other: what was told of the last ones often says all.
struct Asked<'a> {
    ground: &'a Ground<'a>,
    limit_mm: f64,
    known: [Option<(Point3, Told)>; KNOWN],
    oldest: usize,
}

impl<'a> Asked<'a> {
    fn new(ground: &'a Ground<'a>, limit_mm: f64) -> Self {
        Asked { ground, limit_mm, known: [None; KNOWN], oldest: 0 }
    }

    fn at(&mut self, p: &Point3) -> Told {
        let near = |&(at, told): &(Point3, Told)| {
            let alike_mm = told.alike_mm - (p - at).norm();
            (alike_mm > 0.0).then_some(Told { alike_mm, ..told })
        };
        let known = self.known.iter().flatten().filter_map(near);
        let widest = known.reduce(|a, b| if b.alike_mm > a.alike_mm { b } else { a });
        widest.unwrap_or_else(|| {
            let told = (self.ground.tell)(p, self.limit_mm);
            self.known[self.oldest] = Some((*p, told));
            self.oldest = (self.oldest + 1) % KNOWN;
            told
        })
    }
}

/// A cutting move with its chords and tool.
struct Way<'a> {
    of: &'a Move,
    curve: Curve3,
    chords: Vec<Chord>,
    tool: &'a ToolRecord,
    /// Height of the tip, mm; `None` of an entry.
    level: Option<f64>,
    /// The lowest height of the tip, mm.
    low: f64,
    is_wanted: bool,
}

/// Measures the engagement along the wanted ones of all moves that stay on a level: cuts, level lead-ins and links. The axis is that
/// of each move; what is cut along other axes is not taken off.
///
/// # Errors
/// A move is not a curve or names a tool that is not given; stopped.
pub fn level_engagement(
    stock: &InitialStock<'_>,
    moves: &[Move],
    tools: &[ToolRecord],
    is_wanted: &(dyn Fn(&Move) -> bool + Sync),
    keep_going: KeepGoing<'_>,
) -> Result<LevelEngagement, StockError> {
    let tell = |p: &Point3, _| {
        let (is_stock, signed_mm) = (stock.contains(p), stock.signed_mm(p));
        Told { is_stock, alike_mm: (if is_stock { -signed_mm } else { signed_mm }).max(0.0) }
    };
    let ground = Ground { bounds: stock.bounds(), tell: &tell };
    engagement_on(&ground, moves, tools, is_wanted, keep_going)
}

/// The same where only some of the initial stock is still there.
pub(crate) fn engagement_on(
    ground: &Ground<'_>,
    moves: &[Move],
    tools: &[ToolRecord],
    is_wanted: &(dyn Fn(&Move) -> bool + Sync),
    keep_going: KeepGoing<'_>,
) -> Result<LevelEngagement, StockError> {
    let mut by_axis: BTreeMap<[i64; 3], Vec<Way<'_>>> = BTreeMap::new();
    for m in moves.iter().filter(|m| m.kind != MoveKind::Rapid && m.axis_start == m.axis_end) {
        let unknown = || StockError::UnknownTool { seq: m.seq, tool: m.tool.clone() };
        let tool = tools.iter().find(|t| t.id == m.tool).ok_or_else(unknown)?;
        let axis = Vector3::from(m.axis_start);
        let heights = m.points.iter().map(|p| Vector3::from(*p).dot(&axis));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let level = (high - low <= LEVEL_MOVE_MM).then_some(low);
        let chords = flatten(m, CHORD_MM, 1.0)?.chords;
        let key = m.axis_start.map(|c| (c * 1e9).round() as i64);
        let (curve, is_wanted) = (m.curve()?, is_wanted(m));
        by_axis.entry(key).or_default().push(Way { of: m, curve, chords, tool, level, low, is_wanted });
    }
    let mut all = LevelEngagement { histogram_mm: vec![0.0; ENGAGEMENT_BINS], ..LevelEngagement::default() };
    for ways in by_axis.into_values() {
        let mut levels: Vec<f64> = ways.iter().filter(|w| w.is_wanted).filter_map(|w| w.level).collect();
        levels.sort_unstable_by(f64::total_cmp);
        levels.dedup_by(|a, b| (*a - *b).abs() <= LEVEL_MM);
        all.entries += ways.iter().filter(|w| w.is_wanted && w.level.is_none()).count() as u64;
        all.levels += levels.len() as u64;
        let found: Vec<LevelEngagement> =
            levels.par_iter().map(|&z| on_level(ground, &ways, z, keep_going)).collect::<Result<_, _>>()?;
        found.into_iter().for_each(|one| all.add(one));
    }
    Ok(all)
}

impl LevelEngagement {
    /// Length in bins that lie beyond an angle, mm.
    #[must_use]
    pub fn above_mm(&self, angle_deg: f64) -> f64 {
        let beyond = (angle_deg / ENGAGEMENT_BIN_DEG).ceil().max(0.0) as usize;
        self.histogram_mm.iter().skip(beyond).sum()
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.length_mm += other.length_mm;
        self.entries += other.entries;
        self.levels += other.levels;
        self.histogram_mm.iter_mut().zip(other.histogram_mm).for_each(|(a, b)| *a += b);
        let size = |pose: &Option<LevelPose>| pose.as_ref().map_or(0.0, |p| p.angle_deg);
        if size(&other.largest) > size(&self.largest) {
            self.largest = other.largest;
        }
    }
}

/// Radius of a tool at a height above its tip, mm; 0 where it is not.
fn radius_at(tool: &ToolRecord, height: f64) -> f64 {
    let (radius, corner) = (tool.tool.radius_mm(), tool.tool.corner_radius_mm());
    if height < 0.0 {
        0.0
    } else if height >= corner {
        radius
    } else {
        radius - corner + (corner * corner - (corner - height).powi(2)).sqrt()
    }
}

/// Height of what was cut before a level: the nearest one above that was cut earlier, or else the top of the stock, mm.
fn cut_above(ground: &Ground<'_>, ways: &[Way<'_>], z: f64, first: &Way<'_>) -> f64 {
    let earlier = ways.iter().filter(|w| w.of.kind == MoveKind::Cut && w.of.seq < first.of.seq);
    let above = earlier.filter_map(|w| w.level).filter(|l| *l > z + LEVEL_MM).reduce(f64::min);
    let axis = Vector3::from(first.of.axis_start);
    let (middle, half) = (ground.bounds.centre(), 0.5 * (ground.bounds.max - ground.bounds.min));
    above.unwrap_or_else(|| middle.coords.dot(&axis) + axis.abs().dot(&half))
}

/// The moves at one height, in the plane just above the lower end of the flank; just below what was cut before where that is lower,
/// as of a ball.
fn on_level(
    ground: &Ground<'_>,
    ways: &[Way<'_>],
    z: f64,
    keep_going: KeepGoing<'_>,
) -> Result<LevelEngagement, StockError> {
    let mut found =
        LevelEngagement { histogram_mm: vec![0.0; ENGAGEMENT_BINS], ..LevelEngagement::default() };
    let is_here = |w: &&Way<'_>| w.is_wanted && w.level.is_some_and(|l| (l - z).abs() <= LEVEL_MM);
    let corner = ways.iter().filter(is_here).map(|w| w.tool.tool.corner_radius_mm()).fold(0.0, f64::max);
    let Some(first) = ways.iter().find(is_here) else { return Ok(found) };
    let axis = Vector3::from(first.of.axis_start);
    let x = across(&axis);
    let y = axis.cross(&x);
    let plane = if corner > 0.0 {
        (z + corner + ABOVE_MM).min(cut_above(ground, ways, z, first) - ABOVE_MM)
    } else {
        z + ABOVE_MM
    };
    let flat = |p: &Point3| [p.coords.dot(&x), p.coords.dot(&y)];
    let solid = |[u, v]: [f64; 2]| Point3::from(x * u + y * v + axis * plane);
    let widest_mm = ways.iter().map(|w| w.tool.tool.radius_mm()).fold(0.1, f64::max);
    let mut discs = Discs::new(widest_mm);
    let mut asked = Asked::new(ground, 2.0 * widest_mm);
    // Nothing is measured after the last move of the level, and what runs above the plane cuts nothing there.
    let last = ways.iter().rposition(|w| is_here(&w)).map_or(0, |k| k + 1);
    for way in ways[..last].iter().filter(|w| w.low < plane) {
        if !keep_going() {
            return Err(StockError::Stopped);
        }
        let is_measured = is_here(&way);
        let radius = radius_at(way.tool, plane - z);
        let step = (8.0 * way.tool.tool.radius_mm() * CUSP_MM).sqrt();
        let mut since = f64::INFINITY;
        for (k, chord) in way.chords.iter().enumerate() {
            let [a, b] = chord.tips;
            let length = (b - a).norm();
            let count = (length / step).ceil().max(1.0) as usize;
            let [from, to] = chord.parameters;
            for i in 0..count {
                let parameter = from + (to - from) * (i as f64 + 0.5) / count as f64;
                // On the curve, not on its chord: within a chord an arc turns by more than a tenth of a degree.
                let [tip, way_on, _] = way.curve.derivatives(parameter);
                let tip = Point3::from(tip);
                let heading = way_on.try_normalize(0.0).map(|d| [d.dot(&x), d.dot(&y)]);
                since += length / count as f64;
                let is_last = k + 1 == way.chords.len() && i + 1 == count;
                if let Some(heading) = heading.filter(|_| is_measured && radius > 0.0)
                    && (since >= SPACING * radius || is_last)
                {
                    let here = flat(&tip);
                    let mut tell = |deg: f64| {
                        let d = turned(heading, deg);
                        asked.at(&solid([here[0] + radius * d[0], here[1] + radius * d[1]]))
                    };
                    let uncovered = discs.uncovered(here, heading, radius);
                    let angle_deg = uncovered.iter().map(|arc| stock_deg(*arc, radius, &mut tell)).sum();
                    let weight = if since.is_finite() { since } else { length / count as f64 };
                    found.take(angle_deg, weight, || Place {
                        point_mm: tip.into(),
                        move_seq: Some(way.of.seq),
                        parameter: Some(parameter),
                        face: None,
                        entity: None,
                    });
                    since = 0.0;
                }
                discs.push(flat(&tip), radius_at(way.tool, plane - tip.coords.dot(&axis)));
            }
        }
        if let Some(chord) = way.chords.last() {
            let tip = chord.tips[1];
            discs.push(flat(&tip), radius_at(way.tool, plane - tip.coords.dot(&axis)));
        }
    }
    Ok(found)
}

impl LevelEngagement {
    fn take(&mut self, angle_deg: f64, length_mm: f64, at: impl FnOnce() -> Place) {
        self.length_mm += length_mm;
        let bin = if angle_deg > 0.0 { (angle_deg / ENGAGEMENT_BIN_DEG) as usize } else { 0 };
        self.histogram_mm[bin.min(ENGAGEMENT_BINS - 1)] += length_mm;
        if angle_deg > self.largest.as_ref().map_or(0.0, |l| l.angle_deg) {
            self.largest = Some(LevelPose { angle_deg, at: at() });
        }
    }
}

/// How much of an arc is stock, degrees. What is told of a place holds for as much of the arc as is within that distance; beyond that
/// it is looked at every [`SCAN_DEG`], and where it changes bisected.
fn stock_deg([from, to]: [f64; 2], radius_mm: f64, tell: &mut dyn FnMut(f64) -> Told) -> f64 {
    let (mut deg, mut at, mut told) = (0.0, from, tell(from));
    while at < to {
        // A chord is shorter than its arc.
        let known = (at + (told.alike_mm / radius_mm).to_degrees()).min(to);
        let next = known.max(at + SCAN_DEG).min(to);
        let then = tell(next);
        let (mut same, mut other) = (known, next);
        if then.is_stock == told.is_stock {
            same = next;
        } else {
            while other - same > END_DEG {
                let middle = 0.5 * (same + other);
                if tell(middle).is_stock == told.is_stock { same = middle } else { other = middle }
            }
            same = 0.5 * (same + other);
        }
        deg += if told.is_stock { same - at } else { next - same };
        (at, told) = (next, then);
    }
    deg
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;

    use super::*;

    fn tool() -> ToolRecord {
        ToolRecord {
            id: "T1".into(),
            tool: "flat:5".parse().expect("a flat end"),
            holder: None,
            setup_stick_out_mm: BTreeMap::new(),
        }
    }

    fn straight(a: [f64; 2], b: [f64; 2]) -> Move {
        let [a, b] = [a, b].map(|[x, y]| Point3::new(x, y, 10.0));
        Move { tool: "T1".into(), ..Move::straight(MoveKind::Cut, a, b, Vector3::z(), 1000.0) }
    }

    fn block() -> InitialStock<'static> {
        InitialStock::block(Point3::origin(), Point3::new(100.0, 60.0, 20.0)).expect("a block")
    }

    #[test]
    fn a_straight_pass_has_the_angle_of_its_step_over() {
        // Radius 5, step-over 1: 36.87°; the material is on the right.
        let moves = [straight([-10.0, 56.0], [110.0, 56.0]), straight([110.0, 50.0], [-10.0, 50.0])];
        let all = level_engagement(&block(), &moves[..1], &[tool()], &|_| true, &|| true).expect("measured");
        // From the edge of the block: 9 mm deep.
        let wanted = 90.0 + (0.8_f64).asin().to_degrees();
        let found = all.largest.expect("it cuts").angle_deg;
        assert!((found - wanted).abs() < 0.1, "{found} {wanted}");
        let both = level_engagement(&block(), &moves, &[tool()], &|_| true, &|| true).expect("measured");
        assert!((both.length_mm - 240.0).abs() < 1.0);
    }

    /// A quarter of a circle about (x, 30), from an angle of so many quarters on.
    fn quarter(x: f64, radius: f64, quarters: u8) -> Move {
        let angle = std::f64::consts::FRAC_PI_2 * f64::from(quarters);
        let ((s, c), weight) = (angle.sin_cos(), 0.5_f64.sqrt());
        let at =
            |u: f64, v: f64| Point3::new(x + radius * (u * c - v * s), 30.0 + radius * (u * s + v * c), 10.0);
        let points = vec![at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        let knots = KnotVector::clamped_uniform(2, 3);
        let arc = Curve3::new(knots, points, Some(vec![1.0, weight, 1.0])).expect("an arc");
        Move { tool: "T1".into(), ..Move::along(MoveKind::Cut, &arc, Vector3::z(), 1000.0) }
    }

    #[test]
    fn loops_cut_at_most_beside_their_front() {
        // Loops of radius 4 with a tool of radius 5, moved on by 1 mm: 54.900° (B4 of the reference cases).
        let slot = straight([-10.0, 30.0], [30.0, 30.0]);
        let mut moves = vec![slot];
        for loop_of in 0..30 {
            let x = 12.0 + f64::from(loop_of);
            // The front half of the loop: from below to above.
            moves.extend([3, 0].map(|quarters| quarter(x, 4.0, quarters)));
        }
        for (k, m) in moves.iter_mut().enumerate() {
            m.seq = k as u64;
        }
        // The first loops come out of the slot.
        let late = |m: &Move| m.seq > 20 * 2;
        let all = level_engagement(&block(), &moves, &[tool()], &late, &|| true).expect("measured");
        let found = all.largest.expect("it cuts").angle_deg;
        assert!((found - 54.900_367_805).abs() < 0.1, "{found}");
    }

    /// Stock outside of a hole of radius 3 about the origin: what is told of few places says the same as looking everywhere.
    #[test]
    fn what_is_told_of_places_says_how_much_of_an_arc_is_stock() {
        for k in 0..200 {
            let share = |by: f64| (f64::from(k) * by).fract();
            let (x, y, radius) =
                (8.0 * share(0.618_034), 4.0 * share(0.754_878), 0.5 + 6.0 * share(0.569_84));
            let at = |deg: f64| {
                let (sine, cosine) = deg.to_radians().sin_cos();
                (x + radius * cosine).hypot(y + radius * sine) - 3.0
            };
            let mut asked = 0;
            let mut tell = |deg: f64| {
                asked += 1;
                Told { is_stock: at(deg) > 0.0, alike_mm: at(deg).abs() }
            };
            let [from, to] = [-70.0, 85.0];
            let found = stock_deg([from, to], radius, &mut tell);
            let count = 15_500;
            let step = (to - from) / f64::from(count);
            let is_stock = |j: &u32| at(from + (f64::from(*j) + 0.5) * step) > 0.0;
            let wanted = step * (0..count).filter(is_stock).count() as f64;
            assert!((found - wanted).abs() < 0.05, "{k}: {found} instead of {wanted}");
            assert!(asked < 220, "{k}: {asked}");
        }
    }

    /// All places as near as is told are as it is told.
    #[test]
    fn places_around_are_as_it_is_told() {
        use crate::stock::{StockCheck, StockOptions};
        let moves = [straight([-10.0, 20.0], [110.0, 20.0]), quarter(50.0, 15.0, 1), quarter(30.0, 9.0, 2)];
        let check = StockCheck::new(block(), &moves, &[tool()], &StockOptions::default(), &|| true).unwrap();
        let end = check.time_of(2).unwrap();
        let mut kinds = [0; 2];
        for k in 0..2000 {
            let share = |by: f64| (f64::from(k) * by).fract();
            let p = Point3::new(
                -5.0 + 110.0 * share(0.618_034),
                -5.0 + 70.0 * share(0.754_878),
                -2.0 + 24.0 * share(0.569_84),
            );
            let told = check.told_at(&p, end, 8.0);
            assert_eq!(told.is_stock, check.is_stock(&p, end), "{p}");
            kinds[usize::from(told.is_stock)] += 1;
            let (angle, lean) = (100.0 * share(0.17), 100.0 * share(0.31));
            let way = Vector3::new(angle.cos() * lean.cos(), angle.sin() * lean.cos(), lean.sin());
            let near = p + way * (0.999 * told.alike_mm.min(8.0));
            assert_eq!(told.is_stock, check.is_stock(&near, end), "{p}, {near}");
        }
        assert!(kinds.iter().all(|n| *n > 200), "{kinds:?}");
    }
}
