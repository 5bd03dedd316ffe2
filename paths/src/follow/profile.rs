//! The exact height of the ball centre over a drive curve, as cubic Hermite arcs between dropped
//! locations. Sampling is adaptive. A chain ends where the ball touches nothing, where the contact
//! is steep, and where the height jumps.

use claymill_contact::{BallDrop, Location, March, Support, larger_than_usual};
use claymill_nurbs::FaceId;

use crate::curve::drive::DriveCurve;
use crate::follow::proofs::Proofs;

/// Samples along a drive curve are at most this far apart, mm along the profile; a location halfway between each
/// two is checked too, and, where none of them is certified, those halfway to it. A bump of the locations' surface is at least a
/// ball wide at its foot, so one that hides between checks is lower than (⅛ mm)² / 2R. Over a ball that is larger than the usual
/// one, strides are longer and such bumps no higher.
pub(crate) const STRIDE_MM: f64 = 1.0;
/// Between samples the profile is a cubic Hermite arc; the exact location halfway may differ by this, mm.
const HERMITE_MM: f64 = 4e-4;
/// The slope at a proven bound is measured over this distance, mm.
const SLOPE_MM: f64 = 0.01;
/// Corners and jumps are narrowed down to this, mm: on the steepest ground allowed a corner is then known to
/// a micrometre.
const NARROWEST_MM: f64 = 1e-4;
/// Neighbouring samples turn by no more than this, radians, down to [`CLOSEST_MM`]: bends are then resolved
/// well enough for any way of interpolating between them.
pub(crate) const SHARPEST_TURN: f64 = 0.12;
pub(crate) const CLOSEST_MM: f64 = 0.01;
/// However steep a profile seems to be, a walk along its drive curve gets on by this, mm.
const SHORTEST_STEP_MM: f64 = 1e-3;
/// Where a pass ends is narrowed down to this, mm.
pub(crate) const END_MM: f64 = 0.05;
/// And there it ends this much earlier, mm: what lifts a written pass clear also moves it along, by no more than the
/// bias and the tolerance of the fit, and it may have ended at a wall, aslant.
const DRAWN_IN_MM: f64 = 0.02;
/// Tangents that turn by more than this between two sides of a corner make a break, degrees.
const CORNER_DEG: f64 = 2.0;
/// Where two contacts are as good as equally high, now one is taken and now the other: a corner becomes several, with
/// stretches no longer than this between them, mm.
const FLICKER_MM: f64 = 2e-3;
/// Passes are at least this long, mm, those of a small ball this share of its radius.
pub(crate) const SHORTEST_PASS_MM: f64 = 1.0;
pub(crate) const SHORTEST_PASS_RADII: f64 = 0.25;
/// Beside walls: in a bore hardly wider than the ball its centre goes round in a small circle, and cuts a large one, mm.
pub(crate) const SHORTEST_BESIDE_MM: f64 = 0.1;
/// Steeper than this (`n·axis` of the contact normal) a pass ends: the ball's side would cut.
pub(crate) const STEEPEST_NZ: f64 = 0.12;

/// A point of a profile: height of the ball's centre over the drive curve, with its slope.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Sample {
    pub(crate) s: f64,
    pub(crate) z: f64,
    pub(crate) slope: f64,
    /// The face whose inside carries the ball.
    pub(crate) face: Option<FaceId>,
    /// Nothing else can carry it close by.
    pub(crate) certified: bool,
}

/// A smooth stretch of the exact path of the ball's centre over a drive curve: heights are exact at the samples and
/// within [`HERMITE_MM`] between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Profile {
    pub(crate) samples: Vec<Sample>,
}

/// Smooth stretches that join end to end at corners.
pub(crate) type Chain = Vec<Profile>;

/// What [`follow`] found over a drive curve.
#[derive(Debug, Clone, Default)]
pub(crate) struct Followed {
    /// The chains, in order.
    pub(crate) chains: Vec<Chain>,
    /// What its locations are proven by.
    pub(crate) proofs: Proofs,
}

impl Followed {
    /// The chains up to the corners beyond which only faces carry the ball that the part does not own, if they are long
    /// enough for a pass: the neighbouring rows cover the others.
    pub(crate) fn passes(self, shortest_mm: f64, owns: impl Fn(FaceId) -> bool) -> Vec<Chain> {
        let own = self.chains.into_iter().map(|chain| up_to_others(chain, &owns));
        own.filter(|chain| is_long_enough(chain, shortest_mm)).collect()
    }
}

/// Whether a chain is long enough for a pass.
pub(crate) fn is_long_enough(chain: &Chain, shortest_mm: f64) -> bool {
    chain.iter().map(Profile::length_mm).sum::<f64>() >= shortest_mm
}

impl Profile {
    /// Height and slope at `s` (inside the profile's range).
    pub(crate) fn at(&self, s: f64) -> (f64, f64) {
        let i = self.samples.partition_point(|p| p.s <= s).clamp(1, self.samples.len() - 1);
        hermite(&self.samples[i - 1], &self.samples[i], s)
    }

    /// Height and slope at `s`; beyond the ends the profile goes on straight. It is looked for from the sample `near`, which
    /// becomes the one before `s`.
    pub(crate) fn beyond(&self, s: f64, near: &mut usize) -> (f64, f64) {
        let on = |end: Sample| (end.z + end.slope * (s - end.s), end.slope);
        if s <= self.start().s {
            on(self.start())
        } else if s >= self.end().s {
            on(self.end())
        } else {
            let samples = &self.samples;
            *near = step_to(*near, samples.len(), |i| samples[i].s <= s);
            hermite(&samples[*near], &samples[*near + 1], s)
        }
    }

    /// Takes a little off the end from which `way` leads inside; `sample` tells where it ends then.
    fn draw_in(&mut self, way: f64, sample: impl FnOnce(&Self, f64) -> Option<Sample>) {
        let end = if way > 0.0 { self.start() } else { self.end() };
        let s = end.s + way * DRAWN_IN_MM;
        let stays = |q: &Sample| (q.s - s) * way > NARROWEST_MM;
        if !self.samples.iter().any(stays) {
            return;
        }
        if let Some(drawn_in) = sample(self, s) {
            self.samples.retain(stays);
            let at = if way > 0.0 { 0 } else { self.samples.len() };
            self.samples.insert(at, drawn_in);
        }
    }

    /// What it comes to at `s`, by its samples.
    pub(crate) fn sampled(&self, s: f64) -> Sample {
        let (z, slope) = self.at(s);
        Sample { s, z, slope, face: self.face_at(s), certified: false }
    }

    /// The place halfway.
    pub(crate) fn halfway(&self) -> Sample {
        self.sampled(0.5 * (self.start().s + self.end().s))
    }

    /// The face whose inside carries the ball at both ends of the interval around `s`.
    pub(crate) fn face_at(&self, s: f64) -> Option<FaceId> {
        let i = self.samples.partition_point(|p| p.s <= s).clamp(1, self.samples.len() - 1);
        self.samples[i - 1].face.filter(|f| self.samples[i].face == Some(*f))
    }

    /// Length along the profile, by its samples.
    pub(crate) fn length_mm(&self) -> f64 {
        self.samples.windows(2).map(|w| (w[1].s - w[0].s).hypot(w[1].z - w[0].z)).sum()
    }

    pub(crate) fn start(&self) -> Sample {
        self.samples[0]
    }

    pub(crate) fn end(&self) -> Sample {
        self.samples[self.samples.len() - 1]
    }
}

/// The chain without the profiles at its ends on which only others' faces carry the ball.
fn up_to_others(mut chain: Chain, owns: impl Fn(FaceId) -> bool) -> Chain {
    let is_own = |p: &Profile| {
        let mut faces = p.samples.iter().filter_map(|q| q.face).peekable();
        faces.peek().is_none() || faces.any(&owns)
    };
    let (Some(first), Some(last)) = (chain.iter().position(is_own), chain.iter().rposition(is_own)) else {
        return Chain::new();
    };
    if last + 1 < chain.len() {
        chain.truncate(last + 1);
        chain[last].draw_in(-1.0, |p, s| Some(p.sampled(s)));
    }
    if first > 0 {
        chain.drain(..first);
        chain[0].draw_in(1.0, |p, s| Some(p.sampled(s)));
    }
    chain
}

/// Whether the exact sample `m` lies on the arc from `a` to `b`.
fn agrees(a: &Sample, b: &Sample, m: &Sample) -> bool {
    let (z, slope) = hermite(a, b, m.s);
    (z - m.z).abs() <= HERMITE_MM * (1.0 + slope * slope).sqrt()
}

pub(crate) fn angle_between([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    (ax * by - ay * bx).atan2(ax * bx + ay * by).abs()
}

/// The last of the intervals between `count` ascending values that does not begin beyond some place, from one `near` it.
pub(crate) fn step_to(near: usize, count: usize, is_behind: impl Fn(usize) -> bool) -> usize {
    let mut at = near.min(count - 2);
    while at + 2 < count && is_behind(at + 1) {
        at += 1;
    }
    while at > 0 && !is_behind(at) {
        at -= 1;
    }
    at
}

fn hermite(a: &Sample, b: &Sample, s: f64) -> (f64, f64) {
    let h = b.s - a.s;
    let t = (s - a.s) / h;
    let (t2, t3) = (t * t, t * t * t);
    let z = (2.0 * t3 - 3.0 * t2 + 1.0) * a.z
        + (t3 - 2.0 * t2 + t) * h * a.slope
        + (3.0 * t2 - 2.0 * t3) * b.z
        + (t3 - t2) * h * b.slope;
    let slope = 6.0 * (t2 - t) / h * (a.z - b.z)
        + (3.0 * t2 - 4.0 * t + 1.0) * a.slope
        + (3.0 * t2 - 2.0 * t) * b.slope;
    (z, slope)
}

/// Drops the ball along `drive` from `s0` to `s1` and returns the chains of the exact profile. A chain ends
/// where nothing is below, where the contact becomes steep, and where the height jumps.
pub(crate) fn follow(ball: &BallDrop, drive: &DriveCurve, s0: f64, s1: f64) -> Followed {
    let mut walk = Walk { drive, chains: Vec::new(), proofs: Proofs::default(), march: March::new(ball) };
    let mut here = walk.sample(s0);
    if let Some(a) = here {
        walk.begin(a);
    }
    let mut s = s0;
    let stride_mm = STRIDE_MM * larger_than_usual(ball.radius_mm()).sqrt();
    while s < s1 {
        // The stride is along the profile: steep ground needs smaller steps on the drive curve.
        let step = here.map_or(stride_mm, |a| stride_mm / (1.0 + a.slope * a.slope).sqrt());
        let step = step.max(SHORTEST_STEP_MM);
        let next = if s + 1.5 * step >= s1 { s1 } else { s + step };
        let there = walk.sample(next);
        walk.step(s, here, next, there);
        (s, here) = (next, there);
    }
    let mut chains = std::mem::take(&mut walk.chains);
    for chain in &mut chains {
        chain.retain(|p| p.samples.len() > 1 && p.length_mm() > FLICKER_MM);
        if let Some(first) = chain.first_mut().filter(|p| p.start().s > s0) {
            first.draw_in(1.0, |_, s| walk.sample(s));
        }
        if let Some(last) = chain.last_mut().filter(|p| p.end().s < s1) {
            last.draw_in(-1.0, |_, s| walk.sample(s));
        }
    }
    chains.retain(|c| !c.is_empty());
    Followed { chains, proofs: walk.proofs }
}

/// Parts the profiles of a chain where their drive curve turns sharply.
pub(crate) fn parted(chain: Chain, corners: &[f64]) -> Chain {
    /// So close to a corner the drive curve still has the direction of its side, mm.
    const SIDE_MM: f64 = 1e-6;
    let mut parts = Vec::new();
    for mut rest in chain {
        for &s in corners {
            if s <= rest.start().s + SIDE_MM || s >= rest.end().s - SIDE_MM {
                continue;
            }
            let (z, slope) = rest.at(s);
            let side = |s: f64| Sample { s, z, slope, ..Sample::default() };
            let (before, after): (Vec<Sample>, Vec<Sample>) = rest.samples.iter().partition(|q| q.s < s);
            let before = before.into_iter().filter(|q| q.s < s - SIDE_MM).chain([side(s - SIDE_MM)]);
            let after = after.into_iter().filter(|q| q.s > s + SIDE_MM);
            parts.push(Profile { samples: before.collect() });
            rest.samples = [side(s + SIDE_MM)].into_iter().chain(after).collect();
        }
        parts.push(rest);
    }
    parts
}

struct Walk<'a> {
    drive: &'a DriveCurve,
    chains: Vec<Chain>,
    proofs: Proofs,
    march: March<'a>,
}

impl Walk<'_> {
    fn drop(&mut self, s: f64) -> Option<Location> {
        let [x, y] = self.drive.at(s);
        self.march.drop(x, y)
    }

    fn sample(&mut self, s: f64) -> Option<Sample> {
        let location = self.drop(s)?;
        if location.normal.z < STEEPEST_NZ || self.march.touches_material(&location) {
            return None;
        }
        self.proofs.add(&location);
        let [ex, ey] = self.drive.direction(s);
        let (z, mut slope) = (location.centre.z, location.slope(ex, ey));
        let face = match location.support {
            Support::Face { .. } => Some(location.face),
            Support::Edge => None,
            Support::Bound => {
                slope = self.slope_of_heights(s, z).unwrap_or(slope);
                None
            }
            // The ball touches nothing there.
            Support::Side => return None,
        };
        Some(Sample { s, z, slope, face, certified: location.certified })
    }

    /// A bound has a height but no contact point to speak of, and there mostly is a corner beside it: its slope is that
    /// of the heights on the side that is straighter.
    fn slope_of_heights(&mut self, s: f64, z: f64) -> Option<f64> {
        let mut side = |way: f64| {
            let [near, far] = [1.0, 2.0].map(|k| self.drop(s + way * k * SLOPE_MM).map(|l| l.centre.z));
            let (near, far) = (near?, far?);
            Some(((near - z) / (way * SLOPE_MM), (far - 2.0 * near + z).abs()))
        };
        match (side(-1.0), side(1.0)) {
            (Some((before, bend)), Some((after, other_bend))) => {
                Some(if bend < other_bend { before } else { after })
            }
            (before, after) => before.or(after).map(|(slope, _)| slope),
        }
    }

    fn begin(&mut self, first: Sample) {
        self.chains.push(vec![Profile { samples: vec![first] }]);
    }

    fn push(&mut self, sample: Sample) {
        if let Some(profile) = self.chains.last_mut().and_then(|c| c.last_mut()) {
            profile.samples.push(sample);
        }
    }

    /// Continues from the sample at `sa` (already stored) to `sb`.
    fn step(&mut self, sa: f64, a: Option<Sample>, sb: f64, b: Option<Sample>) {
        let (Some(a), Some(b)) = (a, b) else {
            return self.approach_end(sa, a, sb, b);
        };
        let middle = 0.5 * (sa + sb);
        let Some(m) = self.sample(middle) else {
            self.step(sa, Some(a), middle, None);
            return self.step(middle, None, sb, Some(b));
        };
        let slopes = [a, m, b].map(|q| q.slope.atan());
        let courses = [sa, middle, sb].map(|s| self.drive.direction(s));
        // An S turns only on the way.
        let turn = [(0, 1), (1, 2), (0, 2)]
            .map(|(i, j)| (slopes[j] - slopes[i]).abs().max(angle_between(courses[i], courses[j])))
            .into_iter()
            .fold(0.0, f64::max);
        // A corner is on one side of the middle, wherever it is.
        let uneven = (slopes[2] - 2.0 * slopes[1] + slopes[0]).abs().to_degrees() > CORNER_DEG;
        let resolved = (turn <= SHARPEST_TURN && self.bends_evenly(sa, sb)) || sb - sa <= CLOSEST_MM;
        let gentle = resolved && !uneven;
        // On one face the slopes are exact and the middle tells all; elsewhere errors could cancel there, or something stand
        // out on both sides of it.
        let one_face = a.face.is_some() && a.face == m.face && a.face == b.face;
        let one_face = one_face && (a.certified || m.certified || b.certified);
        if gentle
            && agrees(&a, &b, &m)
            && (one_face
                || [0.25, 0.75]
                    .iter()
                    .all(|f| self.sample(sa + f * (sb - sa)).is_some_and(|q| agrees(&a, &b, &q))))
        {
            self.push(m);
            self.push(b);
        } else if sb - sa > NARROWEST_MM {
            self.step(sa, Some(a), middle, Some(m));
            self.step(middle, Some(m), sb, Some(b));
        } else {
            self.corner(a, b);
        }
    }

    /// Whether the drive curve is where its places and directions at both ends tell, seen from above.
    fn bends_evenly(&self, sa: f64, sb: f64) -> bool {
        let DriveCurve::Curved(_) = self.drive else { return true };
        let end = |s: f64, k: usize| Sample {
            s,
            z: self.drive.at(s)[k],
            slope: self.drive.direction(s)[k],
            ..Sample::default()
        };
        let off = |share: f64, k: usize| {
            let s = sa + (sb - sa) * share;
            hermite(&end(sa, k), &end(sb, k), s).0 - self.drive.at(s)[k]
        };
        [0.25, 0.5, 0.75].iter().all(|&share| off(share, 0).hypot(off(share, 1)) <= HERMITE_MM)
    }

    /// Something sharp lies between `a` and `b`, which are as good as at the same place.
    fn corner(&mut self, a: Sample, b: Sample) {
        let steepest = (1.0 / (STEEPEST_NZ * STEEPEST_NZ) - 1.0).sqrt();
        if (b.z - a.z).abs() > steepest * (b.s - a.s) {
            return self.begin(b);
        }
        let turn = (b.slope.atan() - a.slope.atan()).to_degrees();
        if turn.abs() < CORNER_DEG {
            return self.push(b);
        }
        // The corner is where the two tangents meet.
        let meet = (b.z - a.z + a.slope * a.s - b.slope * b.s) / (a.slope - b.slope);
        let s = if meet > a.s && meet < b.s { meet } else { 0.5 * (a.s + b.s) };
        let z = (a.z + a.slope * (s - a.s)).max(b.z + b.slope * (s - b.s));
        self.push(Sample { s, z, face: None, ..a });
        if let Some(chain) = self.chains.last_mut() {
            chain.push(Profile { samples: vec![Sample { s, z, face: None, ..b }, b] });
        }
    }

    /// One side has no usable location: narrows the end down.
    fn approach_end(&mut self, sa: f64, a: Option<Sample>, sb: f64, b: Option<Sample>) {
        if a.is_none() && b.is_none() {
            return;
        }
        if sb - sa <= END_MM {
            if let Some(b) = b {
                self.begin(b);
            }
            return;
        }
        let middle = 0.5 * (sa + sb);
        let m = self.sample(middle);
        self.step(sa, a, middle, m);
        self.step(middle, m, sb, b);
    }
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::analytic::{Frame as Placement, plane_patch};
    use claymill_nurbs::{Curve2, KnotVector, Point2, Point3, Vector3};

    use super::*;
    use crate::Frame;
    use claymill_contact::Covering;

    #[test]
    fn an_s_in_the_guide_is_sampled_through() {
        let placement = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
        let plane = plane_patch(&placement, (-20.0, 20.0), (-20.0, 20.0)).unwrap();
        let model = claymill_tests::model_of([plane]);
        let covering = Covering::new(&model, &[false], 1600.0, 6.0).unwrap();
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        let ball = BallDrop::new(&model, &covering, &top, 6.0);
        // Point symmetric: the ends and the middle go the same way, the quarters do not.
        let points = [(0.0, 0.0), (0.4, 0.25), (0.7, -0.25), (1.1, 0.0)].map(|(x, y)| Point2::new(x, y));
        let curve =
            Curve2::new(KnotVector::new(3, [[0.0; 4], [1.1; 4]].concat()).unwrap(), points.into(), None);
        let drive = DriveCurve::Curved(crate::curve::cubics::Cubics::new(&curve.unwrap()).unwrap());
        let [chain] = &follow(&ball, &drive, 0.0, 1.1).chains[..] else { panic!() };
        let [profile] = &chain[..] else { panic!() };
        for w in profile.samples.windows(2) {
            let turn = angle_between(drive.direction(w[0].s), drive.direction(w[1].s));
            assert!(
                turn <= SHARPEST_TURN || w[1].s - w[0].s <= CLOSEST_MM,
                "{turn} from {} to {}",
                w[0].s,
                w[1].s
            );
        }
    }

    #[test]
    fn a_valley_parts_two_stretches_however_it_is_crossed() {
        let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
        for lean in [8f64, 20.0, 60.0].map(f64::to_radians) {
            let wall = |side: f64| {
                let normal = Vector3::new(-side * lean.sin(), 0.0, lean.cos());
                let placement = Placement::new(Point3::origin(), normal, Vector3::y()).unwrap();
                let across = if side > 0.0 { (-40.0, 0.0) } else { (0.0, 40.0) };
                plane_patch(&placement, (-40.0, 40.0), across).unwrap()
            };
            let model = claymill_tests::model_of([wall(1.0), wall(-1.0)]);
            let covering = Covering::new(&model, &[false; 2], 6400.0, 6.0).unwrap();
            let ball = BallDrop::new(&model, &covering, &top, 6.0);
            for (aslant, off) in [(0.0f64, 0.0), (0.7, 0.0), (0.7, 0.123), (1.3, 0.04)] {
                let direction = [aslant.cos(), aslant.sin()];
                let origin = [off - 6.0 * direction[0], -6.0 * direction[1]];
                let drive = DriveCurve::Straight(crate::curve::drive::Line { origin, direction });
                let [chain] = &follow(&ball, &drive, 0.0, 12.0).chains[..] else { panic!() };
                let [before, after] = &chain[..] else { panic!("{} stretches at {lean}", chain.len()) };
                let slope = lean.tan() * direction[0];
                let corner = 6.0 - off / direction[0];
                let off = before.end().s - corner;
                // Heights are bounds beside a corner: within a tenth of a micrometre.
                let known = 1e-4 * (1.0 + 1.0 / slope);
                assert!(off.abs() < known, "{off} mm from the corner at {lean} crossed at {aslant}");
                for sample in before.samples.iter().chain(&after.samples) {
                    let height = 6.0 / lean.cos() + slope * (sample.s - corner).abs();
                    assert!((sample.z - height).abs() < 3e-4, "{} instead of {height}", sample.z);
                    let slope = if sample.s < corner { -slope } else { slope };
                    let near = (sample.s - corner).abs() < known;
                    assert!(
                        near || (sample.slope - slope).abs() < 0.02,
                        "{} instead of {slope}",
                        sample.slope
                    );
                }
            }
        }
    }
    #[test]
    fn a_pass_is_as_long_on_steep_ground_as_elsewhere() {
        // 2.5 mm down a wall are less than half a millimetre in plan; 0.7 mm are too short for a pass anywhere.
        for (lean_deg, length_mm, passes) in
            [(79.0f64, 2.5, 1), (79.0, 0.7, 0), (10.0, 2.5, 1), (10.0, 0.7, 0)]
        {
            let (sine, cosine) = lean_deg.to_radians().sin_cos();
            let placement =
                Placement::new(Point3::origin(), Vector3::new(-sine, 0.0, cosine), Vector3::y()).unwrap();
            let wall = plane_patch(&placement, (-20.0, 20.0), (-20.0, 20.0)).unwrap();
            let model = claymill_tests::model_of([wall]);
            let covering = Covering::new(&model, &[false], 1600.0, 3.0).unwrap();
            let top = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0];
            let ball = BallDrop::new(&model, &covering, &top, 3.0);
            let uphill = DriveCurve::Straight(crate::curve::drive::Line {
                origin: [-3.0 * sine, 0.0],
                direction: [1.0, 0.0],
            });
            let found = follow(&ball, &uphill, 0.0, length_mm * cosine).passes(SHORTEST_PASS_MM, |_| true);
            assert_eq!(found.len(), passes, "{length_mm} mm at {lean_deg}°");
        }
    }
}
