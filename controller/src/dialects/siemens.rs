//! BSPLINE and POLY of Siemens 840D.
//!
//! A BSPLINE starts at the current position, which is its first control point with weight 1. `PL` of control
//! point `i` is `u[i + D - 1] - u[i + D - 2]` of the knots `u`, as CATIA writes its DK: 0, 0, 30, 0 for one
//! cubic span of 30 that begins at the current position.

use std::fmt::Write as _;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::Page;
use crate::lower::Splines;
use crate::number::decimal;
use crate::words::{Value, Word, first_chars, syntax};
use crate::{Machine, Refusal};

const WEIGHT_DIGITS: u8 = 4;
const LARGEST_WEIGHT: f64 = 3.0;
const LARGEST_INTERVAL: f64 = 99_999.999_9;
/// Decimals of polynomial coefficients.
const COEFFICIENT_DIGITS: u8 = 9;
const LARGEST_DEGREE: usize = 5;
/// A denominator smaller than this share of its ends is as good as a zero.
const SMALLEST_DENOMINATOR: f64 = 1e-3;

/// BSPLINE, then POLY piece by piece, which is exact for weights that BSPLINE does not take.
pub(crate) fn splines(machine: &Machine) -> Vec<Splines> {
    let bspline = Splines {
        pieces: false,
        degrees: [2, 3],
        weights: Some([1e-4, LARGEST_WEIGHT]),
        weight_digits: WEIGHT_DIGITS,
        knot_digits: 4,
        largest_knot: LARGEST_INTERVAL,
        planes: None,
        max_points: machine.max_points.unwrap_or(usize::MAX),
        exact_points: false,
        first_weight_one: true,
        halved: false,
        biarcs: false,
    };
    let poly = Splines {
        pieces: true,
        degrees: [1, LARGEST_DEGREE],
        weights: Some([1e-6, 1e6]),
        weight_digits: 12,
        exact_points: true,
        ..bspline.clone()
    };
    vec![bspline, poly]
}

pub(crate) fn write(out: &mut String, page: &Page, curve: &Curve3, rate: Option<&str>) {
    let degree = curve.knots().degree();
    let fits = |w: &f64| *w <= LARGEST_WEIGHT && (w - crate::number::round(*w, WEIGHT_DIGITS)).abs() < 1e-12;
    let bspline = (2..=3).contains(&degree)
        && curve.weights().is_none_or(|w| w[0] == 1.0 && w.iter().all(fits))
        && curve.points().iter().all(|p| (page.format.snap_point(p) - p).norm() < 1e-9);
    if bspline {
        write_bspline(out, page, curve, rate);
    } else {
        write_poly(out, page, curve, rate);
    }
    // Ends the spline: without it the next one would go on from this one's control points.
    out.push_str("G1\n");
}

fn write_bspline(out: &mut String, page: &Page, curve: &Curve3, rate: Option<&str>) {
    let (degree, u) = (curve.knots().degree(), curve.knots().as_slice());
    for (i, p) in curve.points().iter().enumerate().skip(1) {
        if i == 1 {
            let _ = write!(out, "BSPLINE SD={degree} ");
        }
        let interval = u[i + degree - 1] - u[i + degree - 2];
        let _ = write!(out, "{} PL={}", page.xyz(p), decimal(interval, 4));
        if let Some(weights) = curve.weights() {
            let _ = write!(out, " PW={}", decimal(weights[i], WEIGHT_DIGITS));
        }
        if let (1, Some(rate)) = (i, rate) {
            let _ = write!(out, " {rate}");
        }
        out.push('\n');
    }
}

/// Power-basis coefficients of a Bézier polynomial on 0..=1.
pub(crate) fn power_basis(bezier: &[f64]) -> Vec<f64> {
    let p = bezier.len() - 1;
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
    (0..=p)
        .map(|k| {
            let sum: f64 =
                (0..=k).map(|i| if (k - i) % 2 == 0 { 1.0 } else { -1.0 } * choose(k, i) * bezier[i]).sum();
            choose(p, k) * sum
        })
        .collect()
}

/// Bézier points of a polynomial in the power basis on 0..=1.
pub(crate) fn bernstein(power: &[f64]) -> Vec<f64> {
    let p = power.len() - 1;
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
    (0..=p).map(|i| (0..=i).map(|k| choose(i, k) / choose(p, k) * power[k]).sum()).collect()
}

fn write_poly(out: &mut String, page: &Page, curve: &Curve3, rate: Option<&str>) {
    let unit = page.format.units.mm();
    // The denominator is 1 at the start.
    let first = curve.weights().map_or(1.0, |w| w[0]);
    let weight = |i: usize| curve.weights().map_or(1.0, |w| w[i] / first);
    out.push_str("POLY");
    let end = curve.points()[curve.points().len() - 1];
    for axis in 0..3 {
        let bezier: Vec<f64> =
            curve.points().iter().enumerate().map(|(i, p)| p[axis] * weight(i) / unit).collect();
        let _ = write!(out, " PO[{}]=({}", ["X", "Y", "Z"][axis], page.format.text(end[axis]));
        for a in power_basis(&bezier).iter().skip(2) {
            let _ = write!(out, ",{}", decimal(*a, COEFFICIENT_DIGITS));
        }
        out.push(')');
    }
    if curve.weights().is_some() {
        let bezier: Vec<f64> = (0..curve.points().len()).map(weight).collect();
        let _ = write!(out, " PO[]=({}", decimal(bezier[bezier.len() - 1], COEFFICIENT_DIGITS));
        for a in power_basis(&bezier).iter().skip(2) {
            let _ = write!(out, ",{}", decimal(*a, COEFFICIENT_DIGITS));
        }
        out.push(')');
    }
    out.push_str(" PL=1.");
    if let Some(rate) = rate {
        let _ = write!(out, " {rate}");
    }
    out.push('\n');
}

/// The knots of `n` control points of degree `d` from the interval of each, as the head of this file has it;
/// `None` where an outer interval is not zero.
pub(crate) fn knots_of_intervals(
    d: usize,
    n: usize,
    interval: impl Fn(usize) -> Option<f64>,
) -> Option<Vec<f64>> {
    let mut knots = vec![0.0; d];
    for i in 1..n {
        let interval = interval(i).unwrap_or(0.0);
        if (i < 2 || i + d > n + 1) && interval != 0.0 {
            return None;
        }
        knots.push(knots[knots.len() - 1] + interval);
    }
    while knots.len() < n + d + 1 {
        knots.push(knots[knots.len() - 1]);
    }
    Some(knots)
}

/// A BSPLINE that is being read.
#[derive(Debug)]
pub(crate) struct Open {
    degree: usize,
    points: Vec<Point3>,
    weights: Vec<f64>,
    /// `PL` of the points from the second one on.
    intervals: Vec<Option<f64>>,
}

impl Open {
    pub(crate) fn begin(position: Option<Point3>) -> Result<Self, Refusal> {
        let Some(position) = position else {
            return Err(Refusal::new("position", "BSPLINE starts from a position that is not known"));
        };
        Ok(Open { degree: 3, points: vec![position], weights: vec![1.0], intervals: Vec::new() })
    }

    pub(crate) fn block(&mut self, words: &[Word], unit_mm: f64) -> Result<(), Refusal> {
        let mut p = self.points[self.points.len() - 1];
        let (mut weight, mut interval, mut moves) = (1.0, None, false);
        for w in words {
            let Value::Number { value, decimals, .. } = w.value else { continue };
            match w.key {
                "X" | "Y" | "Z" => {
                    p["XYZ".find(w.key).unwrap_or(0)] = value * unit_mm;
                    moves = true;
                }
                "SD" if value == 2.0 || value == 3.0 => self.degree = value as usize,
                "SD" => {
                    return Err(Refusal::new("siemens-sd", format!("SD={value}: the degree must be 2 or 3")));
                }
                "PW" => {
                    if !(value > 0.0 && value <= LARGEST_WEIGHT) || decimals > 4 {
                        return Err(Refusal::new(
                            "siemens-pw",
                            format!("PW={value}: weights are from 0.0001 to 3 with 4 decimals"),
                        ));
                    }
                    weight = value;
                }
                "PL" => {
                    if !(0.0..=LARGEST_INTERVAL).contains(&value) || decimals > 4 {
                        return Err(Refusal::new(
                            "siemens-pl",
                            format!("PL={value}: intervals are up to 99999.9999 with 4 decimals"),
                        ));
                    }
                    interval = Some(value);
                }
                _ => {}
            }
        }
        if moves {
            if interval.is_none() {
                return Err(Refusal::new(
                    "siemens-pl",
                    "a control point without PL: the control would choose its own",
                ));
            }
            self.points.push(p);
            self.weights.push(weight);
            self.intervals.push(interval);
        }
        Ok(())
    }

    /// The curve, once the spline has ended.
    pub(crate) fn close(self) -> Result<Curve3, Refusal> {
        let (d, n) = (self.degree, self.points.len());
        if n <= d {
            return Err(Refusal::new("siemens-points", format!("{n} control points are too few for SD={d}")));
        }
        let knots = knots_of_intervals(d, n, |i| self.intervals.get(i.wrapping_sub(1)).copied().flatten())
            .ok_or_else(|| Refusal::new("siemens-pl", "the outer intervals of a BSPLINE must be 0"))?;
        let weights = self.weights.iter().any(|w| *w != 1.0).then_some(self.weights);
        KnotVector::new(d, knots)
            .and_then(|knots| Curve3::new(knots, self.points, weights))
            .map_err(|e| Refusal::new("siemens-curve", e.to_string()))
    }
}

/// Whether a block is a call that changes nothing for X, Y and Z.
pub(crate) fn call(text: &str) -> Result<bool, Refusal> {
    if text.starts_with("CYCLE832") {
        return Err(compressor("CYCLE832"));
    }
    let Some(list) = text.strip_prefix("SPLINEPATH(") else { return Ok(false) };
    let list = list.strip_suffix(')').ok_or_else(|| syntax("SPLINEPATH without `)`"))?;
    match list.split(',').skip(1).map(str::trim).find(|axis| !["X", "Y", "Z"].contains(axis)) {
        Some(axis) => {
            Err(Refusal::new("axis", format!("`{}`: only X, Y and Z can be checked", first_chars(axis))))
        }
        None => Ok(true),
    }
}

/// Why a word that means something to this control is not read.
pub(crate) fn stranger(key: &str) -> Option<Refusal> {
    match key {
        "ASPLINE" | "CSPLINE" | "BAUTO" | "BNAT" | "BTAN" | "EAUTO" | "ENAT" | "ETAN" => {
            let detail = format!("{key}: splines through points are the control's own");
            Some(Refusal::new("siemens-through", detail))
        }
        "COMPON" | "COMPCURV" | "COMPCAD" | "COMPSURF" | "CTOL" => Some(compressor(key)),
        _ => None,
    }
}

fn compressor(key: &str) -> Refusal {
    Refusal::new("siemens-compressor", format!("{key}: the control fits a curve of its own to the blocks"))
}

/// One block of POLY from `position`: polynomials, and axes that go straight to where their word says.
pub(crate) fn poly(words: &[Word], position: Point3, unit_mm: f64) -> Result<Curve3, Refusal> {
    let bad = |what: &str| Refusal::new("siemens-po", what);
    let mut length = 1.0;
    let mut lists: [Option<&[f64]>; 4] = [None; 4];
    let mut straight = [None; 3];
    for w in words {
        match (w.key, &w.value) {
            ("PL", Value::Number { value, .. }) if *value > 0.0 && *value <= LARGEST_INTERVAL => {
                length = *value
            }
            ("PL", _) => return Err(Refusal::new("siemens-pl", "PL of a polynomial must be positive")),
            ("PO", Value::List(list)) => {
                let slot = match w.index {
                    Some("X") => 0,
                    Some("Y") => 1,
                    Some("Z") => 2,
                    Some("") => 3,
                    _ => return Err(bad("PO names an axis that does not move")),
                };
                if list.is_empty() || list.len() > LARGEST_DEGREE {
                    return Err(bad("a polynomial has 1 to 5 numbers: its end and a2 to a5"));
                }
                lists[slot] = Some(list);
            }
            ("PO", _) => return Err(bad("PO needs a list")),
            ("X" | "Y" | "Z", Value::Number { value, .. }) => {
                straight["XYZ".find(w.key).unwrap_or(0)] = Some(*value);
            }
            _ => {}
        }
    }
    let degree = lists.iter().flatten().map(|l| l.len()).max().unwrap_or(0).max(2);
    // Coefficients on 0..=1 from the value at both ends and those from the square on.
    let power = |start: f64, end: f64, list: Option<&[f64]>| {
        let mut a = vec![0.0; degree + 1];
        a[0] = start;
        for (k, c) in list.unwrap_or(&[]).iter().enumerate().skip(1) {
            a[k + 1] = c * length.powi(k as i32 + 1);
        }
        a[1] = end - a[0] - a[2..].iter().sum::<f64>();
        a
    };
    if (0..3).any(|axis| straight[axis].is_some() && (lists[axis].is_some() || lists[3].is_some())) {
        return Err(bad("an axis stands beside its own PO, or beside a denominator"));
    }
    let below_end = lists[3].map_or(1.0, |l| l[0]);
    let below = bernstein(&power(1.0, below_end, lists[3]));
    if below.iter().any(|w| *w < SMALLEST_DENOMINATOR) {
        return Err(bad("the denominator has a zero, or comes near one, on the interval"));
    }
    let mut coordinates = Vec::with_capacity(3);
    for axis in 0..3 {
        let start = position[axis] / unit_mm;
        coordinates.push(match lists[axis] {
            Some(list) => bernstein(&power(start, list[0] * below_end, Some(list))),
            None if straight[axis].is_some() => {
                bernstein(&power(start, straight[axis].unwrap_or(start), None))
            }
            // An axis that is not named stands still.
            None => below.iter().map(|w| w * start).collect(),
        });
    }
    let points = (0..=degree).map(|i| {
        Point3::from(nalgebra::Vector3::from_fn(|axis, _| coordinates[axis][i] / below[i] * unit_mm))
    });
    let mut knots = vec![0.0; degree + 1];
    knots.extend(vec![1.0; degree + 1]);
    let rational = lists[3].is_some();
    KnotVector::new(degree, knots)
        .and_then(|knots| Curve3::new(knots, points.collect(), rational.then(|| below.clone())))
        .map_err(|e| Refusal::new("siemens-curve", e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::{Comments, words};

    #[test]
    fn the_manual_s_quarter_circle_is_one() {
        let block = words("PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1)", Comments::Semicolon).unwrap();
        let curve = poly(&block, Point3::new(10.0, 0.0, 3.0), 1.0).unwrap();
        for i in 0..=20 {
            let p = curve.point(f64::from(i) / 20.0);
            approx::assert_relative_eq!(p.x.hypot(p.y), 10.0, epsilon = 1e-12);
            approx::assert_relative_eq!(p.z, 3.0, epsilon = 1e-12);
        }
        assert!((curve.end() - Point3::new(0.0, 10.0, 3.0)).norm() < 1e-12);
        let zero = words("PO[X]=(0) PO[]=(1,8)", Comments::Semicolon).unwrap();
        assert_eq!(poly(&zero, Point3::origin(), 1.0).unwrap_err().rule, "siemens-po");
    }

    #[test]
    fn power_basis_and_back() {
        let b = [1.0, -2.0, 5.0, 0.5, 3.0, 2.0];
        for (x, y) in bernstein(&power_basis(&b)).iter().zip(b) {
            approx::assert_relative_eq!(*x, y, epsilon = 1e-12);
        }
    }
}
