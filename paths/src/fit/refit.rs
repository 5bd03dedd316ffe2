//! Fits cubic NURBS to profiles, above the exact locations by the bias: least squares, span
//! splitting, rounding to the written digits, and a final measurement of the written curve.

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{WRITTEN_STEP_MM, round_to_written};

use crate::curve::drive::{DriveCurve, lift};
use crate::curve::spline::{Datum, SpanBasis, knot_vector, least_squares};
use crate::fit::breaks::thinned;
use crate::fit::target::{Target, corner};
use crate::follow::profile::{Chain, Profile, Sample};
use crate::{FitTolerance, Frame};

/// Shorter stretches cannot be told from a point in the written digits, mm.
const SHORTEST_MM: f64 = 20.0 * WRITTEN_STEP_MM;
/// Straight pieces shorter than this are not halved: both halves could vanish, and neither could be far off, mm.
const HALVED_MM: f64 = 3.0 * SHORTEST_MM;
const ROUNDS: usize = 12;
/// Data points per span, at least; and their largest distance, mm.
const DATA_PER_SPAN: usize = 8;
const DATA_MM: f64 = 0.5;
pub(crate) const LONGEST_SPAN_MM: f64 = 400.0;
/// Beside its drive curve a pass comes closer to whatever stands there, on a steep slope as much as it is aside: that
/// counts twice.
const ASIDE_SHARE: f64 = 2.0;
/// The written error is checked at points this far apart, mm, and at least eight a span.
const CHECK_MM: f64 = 0.25;
/// And between two such points as often as the profile has samples there, at most.
const MOST_PASSED: usize = 64;

/// The places that a profile is about, and how they are written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Over<'a> {
    pub(crate) drive: &'a DriveCurve,
    pub(crate) frame: &'a Frame,
    pub(crate) radius_mm: f64,
    pub(crate) tolerance: FitTolerance,
}

impl Over<'_> {
    fn tip(&self, centre: &Point3) -> Point3 {
        self.frame.to_model(&Point3::new(centre.x, centre.y, centre.z - self.radius_mm)).map(round_to_written)
    }

    fn centre(&self, tip: &Point3) -> Point3 {
        let p = self.frame.to_setup(tip);
        Point3::new(p.x, p.y, p.z + self.radius_mm)
    }
}

/// A fitted stretch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fit {
    /// The tip's curve with the written digits.
    pub(crate) curve: Curve3,
    /// Lowest and highest distance of the written curve from the exact locations, mm.
    pub(crate) error_mm: (f64, f64),
}

/// The curves over a chain: its smooth stretches are fitted each on its own and meet at the corners between them.
pub(crate) fn fit_chain(chain: &Chain, over: &Over) -> Vec<Fit> {
    let between = chain.windows(2).map(|two| corner(&two[0], &two[1], over));
    let corners: Vec<Option<Point3>> = [None].into_iter().chain(between).chain([None]).collect();
    let stretches = chain.iter().zip(corners.windows(2));
    stretches.flat_map(|(profile, ends)| fit(profile, [ends[0], ends[1]], over)).collect()
}

/// Fits a smooth stretch by as few curves as can be: one, unless it resists (see [`fit_one`]); then it is
/// halved, in the end into straight pieces so short that they are within tolerance too, or that what lifts them
/// clear of the exact locations is no more than a few of the written digits. Stretches below these vanish.
fn fit(profile: &Profile, corners: [Option<Point3>; 2], over: &Over) -> Vec<Fit> {
    let target = Target::new(profile, corners, over);
    if let Some(whole) = fit_one(profile, &target, over) {
        return vec![whole];
    }
    let mut samples = profile.samples.clone();
    if samples.len() <= 2 {
        let piece = straight(profile, &target, over);
        let is_far = |fit: &Fit| fit.error_mm.1 > over.tolerance.bias_mm + over.tolerance.fit_mm;
        if profile.length_mm() < HALVED_MM || !piece.as_ref().is_some_and(is_far) {
            return piece.into_iter().collect();
        }
        samples.insert(1, profile.halfway());
    }
    let middle = samples.len() / 2;
    let half = |samples: &[Sample], corners| fit(&Profile { samples: samples.to_vec() }, corners, over);
    let mut parts = half(&samples[..=middle], [corners[0], None]);
    parts.extend(half(&samples[middle..], [None, corners[1]]));
    parts
}

/// The straight piece between the ends, raised until it is on the safe side.
fn straight(profile: &Profile, target: &Target, over: &Over) -> Option<Fit> {
    let breaks = [0.0, round_to_written(target.length())];
    if breaks[1] < SHORTEST_MM {
        return None;
    }
    let (a, b) = target.ends();
    let line = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|x| a + (b - a) * x);
    let curve = round(&line, &breaks, over)?;
    let miss = |curve: &Curve3| span_errors(curve, &breaks, |_| None, profile, over)[0];
    let low_mm = miss(&curve).low_mm;
    let raised = line.map(|p| Point3::new(p.x, p.y, p.z + (over.tolerance.bias_mm - low_mm).max(0.0)));
    let curve = round(&raised, &breaks, over)?;
    let SpanError { low_mm, high_mm, .. } = miss(&curve);
    Some(Fit { curve, error_mm: (low_mm, high_mm) })
}

/// Fits a smooth stretch by one cubic NURBS on the safe side of the exact locations: least squares on
/// arc length, spans split where the error is too large, rounded to the written digits, then measured again;
/// in the end knots that are not needed are taken out.
///
/// `None` when the stretch is shorter than the written digits can show, or does not come within tolerance.
fn fit_one(profile: &Profile, target: &Target, over: &Over) -> Option<Fit> {
    let length = round_to_written(target.length());
    if length < SHORTEST_MM {
        return None;
    }
    let spline =
        |breaks, before: Option<&Spline>| Spline::closest(target, breaks, length, before, profile, over);
    let mut found = spline(target.first_breaks(length), None)?;
    for _ in 0..ROUNDS {
        if found.is_within() {
            let Spline { curve, errors, .. } = thinned(found, spline);
            let low = errors.iter().map(|e| e.low_mm).fold(f64::INFINITY, f64::min);
            let high = errors.iter().map(|e| e.high_mm).fold(f64::NEG_INFINITY, f64::max);
            return Some(Fit { curve, error_mm: (low, high) });
        }
        let finer = found.finer(target);
        if finer.len() == found.breaks.len() {
            return None;
        }
        found = spline(finer, Some(&found))?;
    }
    None
}

/// A fitted spline with what it misses.
pub(crate) struct Spline {
    pub(crate) breaks: Vec<f64>,
    pub(crate) curve: Curve3,
    /// What it misses, span by span.
    pub(crate) errors: Vec<SpanError>,
    /// What it may miss.
    pub(crate) tolerance: FitTolerance,
}

/// Lowest and highest distance of a span from the exact locations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SpanError {
    low_mm: f64,
    high_mm: f64,
    /// Where on the drive curve the span ends.
    end_s: f64,
}

impl Spline {
    fn closest(
        target: &Target,
        breaks: Vec<f64>,
        length: f64,
        before: Option<&Spline>,
        profile: &Profile,
        over: &Over,
    ) -> Option<Self> {
        let curve = round(&closest_cubic(target, &breaks, length)?, &breaks, over)?;
        let known = |span| before?.known(span, &breaks, &curve);
        let errors = span_errors(&curve, &breaks, known, profile, over);
        Some(Spline { breaks, curve, errors, tolerance: over.tolerance })
    }

    /// What a span of another spline misses if it is one of this one's: a break moves few control points by as much as
    /// the written digits show.
    fn known(&self, span: usize, breaks: &[f64], curve: &Curve3) -> Option<SpanError> {
        // Of equal breaks the last begins a span.
        let own = self.breaks.partition_point(|b| *b <= breaks[span]).checked_sub(1)?;
        let knots = [self.curve.knots(), curve.knots()].map(claymill_nurbs::KnotVector::as_slice);
        let same = own + 1 < self.breaks.len()
            && knots[0][own + 1..own + 7] == knots[1][span + 1..span + 7]
            && self.curve.points()[own..own + 4] == curve.points()[span..span + 4];
        same.then(|| self.errors[own])
    }

    /// Largest distance from the biased path over a span, mm.
    pub(crate) fn miss_mm(&self, span: usize) -> f64 {
        let SpanError { low_mm, high_mm, .. } = self.errors[span];
        let bias_mm = self.tolerance.bias_mm;
        (bias_mm - low_mm).max(high_mm - bias_mm)
    }

    fn is_within(&self) -> bool {
        (0..self.errors.len()).all(|span| self.miss_mm(span) <= self.tolerance.fit_mm)
    }
}

/// Control points of the least-squares cubic whose ends are the target's ends.
fn closest_cubic(target: &Target, breaks: &[f64], length: f64) -> Option<Vec<Point3>> {
    let scale = target.length() / length;
    let places = breaks.windows(2).filter(|span| span[1] > span[0]).flat_map(|span| {
        let width = span[1] - span[0];
        let count = ((width / DATA_MM).ceil() as usize).max(DATA_PER_SPAN);
        let place = move |k| (span[0] + width * (k as f64 + 0.5) / count as f64, width / count as f64);
        (0..count).map(place)
    });
    let mut near = 0;
    let data = places.map(|(t, weight)| Datum { t, weight, p: target.at(t * scale, &mut near) });
    least_squares(&knot_vector(breaks)?, target.ends(), data)
}

fn round(points: &[Point3], breaks: &[f64], over: &Over) -> Option<Curve3> {
    let tips = points.iter().map(|p| over.tip(p)).collect();
    Curve3::new(knot_vector(breaks)?, tips, None).ok()
}

/// Lowest and highest distance of the written curve from the exact profile, span by span, along the
/// direction of lift, where it is not `known`. Points beyond the profile's ends are compared with its end tangents.
fn span_errors(
    curve: &Curve3,
    breaks: &[f64],
    known: impl Fn(usize) -> Option<SpanError>,
    profile: &Profile,
    over: &Over,
) -> Vec<SpanError> {
    let mut at_sample = 0;
    let mut measured = |index: usize, from_s: f64| {
        let mut near = from_s;
        let (mut low_mm, mut high_mm) = (f64::INFINITY, f64::NEG_INFINITY);
        let length = breaks[index + 1] - breaks[index];
        if length == 0.0 {
            return SpanError { low_mm, high_mm, end_s: near };
        }
        let basis = SpanBasis::new(curve.knots(), index + curve.knots().degree());
        let [a, b, c, d] =
            basis.span(std::array::from_fn(|i| over.centre(&curve.points()[basis.first + i]).coords));
        let count = ((length / CHECK_MM).ceil() as usize).max(8);
        let mut check = |x: f64| {
            let centre = a + (b + (c + d * x) * x) * x;
            near = over.drive.nearest(centre.x, centre.y, near);
            let (place, [ex, ey]) = over.drive.at_with_direction(near);
            let (z, slope) = profile.beyond(near, &mut at_sample);
            let off = centre - Vector3::new(place[0], place[1], z);
            let level = ex.hypot(ey);
            let e = off.dot(&lift([ex / level, ey / level], slope / level));
            let aside = ASIDE_SHARE * (off.x * ey - off.y * ex).abs() / level;
            low_mm = low_mm.min(e).min(over.tolerance.bias_mm - aside);
            high_mm = high_mm.max(e).max(over.tolerance.bias_mm + aside);
            at_sample
        };
        let mut before = check(0.0);
        for k in 0..count {
            let at = |part: usize, parts: usize| (k as f64 + part as f64 / parts as f64) / count as f64;
            let after = check(at(1, 1));
            // Samples of the profile are closer together where it bends sharply.
            let passed = after.abs_diff(before).min(MOST_PASSED);
            (1..passed).for_each(|part| {
                check(at(part, passed));
            });
            before = after;
        }
        check(1.0);
        SpanError { low_mm, high_mm, end_s: near }
    };
    let mut end_s = profile.start().s;
    (0..breaks.len() - 1)
        .map(|span| {
            let error = known(span).unwrap_or_else(|| measured(span, end_s));
            end_s = error.end_s;
            error
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Curve2, KnotVector, Point2};

    use super::*;
    use crate::curve::drive::Line;

    const ALONG_X: DriveCurve = DriveCurve::Straight(Line { origin: [0.0, 0.0], direction: [1.0, 0.0] });

    fn usual() -> FitTolerance {
        FitTolerance::of_scallop(0.1)
    }

    fn top() -> Frame {
        Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0]
    }

    fn sample(s: f64, z: f64, slope: f64) -> Sample {
        Sample { s, z, slope, ..Sample::default() }
    }

    fn fit_along_x(profile: &Profile) -> Fit {
        let over = Over { drive: &ALONG_X, frame: &top(), radius_mm: 0.0, tolerance: usual() };
        fit_one(profile, &Target::new(profile, [None; 2], &over), &over).unwrap()
    }

    fn sampled(from: f64, to: f64, f: impl Fn(f64) -> (f64, f64)) -> Profile {
        let count = ((to - from) * 2.0).ceil() as usize;
        let at = |i: usize| {
            let s = from + (to - from) * i as f64 / count as f64;
            let (z, slope) = f(s);
            sample(s, z, slope)
        };
        Profile { samples: (0..=count).map(at).collect() }
    }

    #[test]
    fn a_straight_pass_needs_four_control_points() {
        let fit = fit_along_x(&sampled(0.0, 300.0, |s| (2.0 + 0.25 * s, 0.25)));
        assert_eq!(fit.curve.points().len(), 4);
        assert!(fit.error_mm.0 > 0.0 && fit.error_mm.1 < 5e-3, "{:?}", fit.error_mm);
    }

    #[test]
    fn arcs_stay_above_the_exact_path_and_near_the_fourth_root_law() {
        for radius in [100.0f64, 1000.0, 4000.0] {
            let half = 0.35 * radius;
            let exact = |s: f64| ((radius * radius - s * s).sqrt(), -s / (radius * radius - s * s).sqrt());
            let fit = fit_along_x(&sampled(-half, half, exact));
            // An independent, denser look at the written curve.
            let (t0, t1) = fit.curve.domain();
            for i in 0..=20_000 {
                let p = fit.curve.point(t0 + (t1 - t0) * f64::from(i) / 20_000.0);
                let above = p.x.hypot(p.z) - radius;
                assert!((0.0..=5e-3).contains(&above), "radius {radius}: {above} mm");
            }
            let law = (t1 - t0) / (384.0 * usual().fit_mm * radius.powi(3)).powf(0.25);
            let spans = fit.curve.points().len() - 3;
            assert!((spans as f64) <= 1.3 * law + 3.0, "radius {radius}: {spans} spans, law {law:.1}");
        }
    }

    #[test]
    fn a_straight_piece_is_raised_above_a_bulge() {
        let ends = [(0.0, 0.1), (0.5, -0.1)];
        let samples = ends.map(|(s, slope)| sample(s, 0.0, slope)).to_vec();
        let profile = Profile { samples };
        let over = Over { drive: &ALONG_X, frame: &top(), radius_mm: 0.0, tolerance: usual() };
        let target = Target::new(&profile, [None; 2], &over);
        let piece = straight(&profile, &target, &over).unwrap();
        assert!(piece.error_mm.0 > 0.0, "{:?}", piece.error_mm);
        // The Hermite arc rises by h·slope/4 = 12.5 µm in the middle.
        approx::assert_abs_diff_eq!(piece.curve.point(0.25).z, 0.0125 + usual().bias_mm, epsilon = 2e-4);
    }

    #[test]
    fn what_resists_a_fit_is_never_written_far_above_its_face() {
        // A drive curve that begins with two nanometres of rounding errors, in which the search for the nearest place is
        // caught: nothing fits there.
        let knots = [[0.0; 4], [2.2e-9, 2.2e-9, 0.5554, 0.5554], [1.1108; 4]].concat();
        let points = [
            [0.0, 0.0],
            [4.8e-10, 4.6e-10],
            [1.31e-9, -1.24e-9],
            [0.12256, 0.13875],
            [0.24625, 0.27650],
            [0.49550, 0.55030],
            [0.62106, 0.68635],
            [0.74740, 0.82170],
        ];
        let points = points.map(Point2::from).to_vec();
        let curve = Curve2::new(KnotVector::new(3, knots).unwrap(), points, None).unwrap();
        let drive = DriveCurve::Curved(crate::curve::cubics::Cubics::new(&curve).unwrap());
        let over = Over { drive: &drive, frame: &top(), radius_mm: 0.0, tolerance: usual() };
        let level = Profile { samples: [0.0, 0.5, 1.0].map(|s| sample(s, 0.0, 0.0)).to_vec() };
        assert!(fit_one(&level, &Target::new(&level, [None; 2], &over), &over).is_none());
        let pieces = fit(&level, [None; 2], &over);
        let mut end = Point3::origin();
        for Fit { curve, .. } in &pieces {
            let (t0, t1) = curve.domain();
            assert!((curve.point(t0) - end).norm() < 0.02);
            end = curve.point(t1);
            let highest = curve.points().iter().map(|p| p.z).fold(0.0, f64::max);
            assert!(highest < 0.01, "{highest} mm above");
        }
        let [x, y] = drive.at(1.0);
        assert!((end - Point3::new(x, y, 0.0)).norm() < 0.005);
    }

    #[test]
    fn stretches_meet_above_the_corner_between_them() {
        // A valley: 30° down, then 45° up.
        let (down, up) = (-(30f64.to_radians().tan()), 1.0);
        let side = |s: f64, slope: f64| sample(s, s * slope, slope);
        let before = Profile { samples: [-8.0, -1e-3, -2e-4, 0.0].map(|s| side(s, down)).to_vec() };
        let after = Profile { samples: [0.0, 1e-4, 7.0].map(|s| side(s, up)).to_vec() };
        let over = Over { drive: &ALONG_X, frame: &top(), radius_mm: 0.0, tolerance: usual() };
        let [first, second] = &fit_chain(&vec![before, after], &over)[..] else { panic!() };
        assert_eq!(first.curve.end(), second.curve.start());
        for (fit, slope) in [(first, down), (second, up)] {
            let (t0, t1) = fit.curve.domain();
            for i in 0..=1000 {
                let p = fit.curve.point(t0 + (t1 - t0) * f64::from(i) / 1000.0);
                let above = (p.z - slope * p.x) / slope.hypot(1.0);
                approx::assert_abs_diff_eq!(above, usual().bias_mm, epsilon = 1.5e-4);
            }
        }
    }

    #[test]
    fn a_sharp_bend_between_two_checks_is_seen() {
        // Lines that meet in an arc of 0.2 mm, 5° long, beside the beginning, where no corner marks it.
        const REACH: f64 = 0.2;
        let (sine, at) = (5f64.to_radians().sin(), 0.03);
        let exact = |s: f64| {
            let x = (s - at).clamp(0.0, REACH * sine);
            let (z, slope) = (REACH - (REACH * REACH - x * x).sqrt(), x / (REACH * REACH - x * x).sqrt());
            (z + slope * (s - at - x).max(0.0), slope)
        };
        let places =
            (0..=30).map(|k| 0.004 * f64::from(k)).chain((1..=40).map(|k| 0.12 + 0.5 * f64::from(k)));
        let samples = places.map(|s| sample(s, exact(s).0, exact(s).1)).collect();
        for fit in fit_chain(
            &vec![Profile { samples }],
            &Over { drive: &ALONG_X, frame: &top(), radius_mm: 0.0, tolerance: usual() },
        ) {
            let (t0, t1) = fit.curve.domain();
            for i in 0..=20_000 {
                let p = fit.curve.point(t0 + (t1 - t0) * f64::from(i) / 20_000.0);
                let above = (p.z - exact(p.x).0) * (1.0 + exact(p.x).1.powi(2)).sqrt().recip();
                assert!((0.0..=3.85e-3).contains(&above), "{above} mm above at {}", p.x);
            }
        }
    }

    #[test]
    fn a_curvature_jump_is_fitted_within_tolerance() {
        // Line, then an arc of radius 40: G1 with a jump of 1/40.
        let exact = |s: f64| {
            if s <= 0.0 { (0.0, 0.0) } else { (40.0 - (1600.0 - s * s).sqrt(), s / (1600.0 - s * s).sqrt()) }
        };
        let fit = fit_along_x(&sampled(-100.0, 25.0, exact));
        assert!(fit.error_mm.0 > 0.0 && fit.error_mm.1 < 5e-3, "{:?}", fit.error_mm);
        // A span for the line, two or three for the arc, one more point for the two knots in one between them.
        assert!(fit.curve.points().len() <= 8, "{} control points", fit.curve.points().len());
    }
}
