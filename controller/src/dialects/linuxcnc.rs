//! G5.2 of LinuxCNC: one Bézier piece a block, whose uniform clamped knots are then the right ones.

use std::fmt::Write as _;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::Page;
use super::gcode_modes::Begins;
use crate::biarc::breaks_biarcs;
use crate::lower::Splines;
use crate::number::decimal;
use crate::words::{Value, Word};
use crate::{Plane, Refusal};

const WEIGHT_DIGITS: u8 = 6;
/// The interpreter's time grows with the cube of the poles: 10 take 9 ms, 50 a second.
const MOST_POLES: usize = 50;

pub(crate) fn splines(planes: bool) -> Splines {
    Splines {
        pieces: true,
        degrees: [3, 3],
        weights: Some([1e-3, 1e3]),
        weight_digits: WEIGHT_DIGITS,
        knot_digits: 6,
        largest_knot: 1e6,
        planes: Some(if planes { Plane::ALL.to_vec() } else { vec![Plane::Xy] }),
        max_points: MOST_POLES,
        exact_points: false,
        first_weight_one: true,
        halved: false,
        biarcs: true,
    }
}

/// Letters of a plane's two axes, X before Y before Z.
fn letters(plane: Plane) -> [usize; 2] {
    let [i, j, _] = plane.axes();
    [i.min(j), i.max(j)]
}

/// Returns the plane that is active afterwards.
pub(crate) fn write(
    out: &mut String,
    page: &Page,
    curve: &Curve3,
    rate: Option<&str>,
    active: Plane,
) -> Plane {
    let plane = Plane::ALL
        .into_iter()
        .find(|plane| crate::lower::holds(curve, *plane, &page.format))
        .unwrap_or(Plane::Xy);
    if plane != active {
        let _ = writeln!(out, "G{}", plane.g());
    }
    for (i, p) in curve.points().iter().enumerate().skip(1) {
        out.push_str("G5.2");
        for axis in letters(plane) {
            let _ = write!(out, " {}{}", ["X", "Y", "Z"][axis], page.format.text(p[axis]));
        }
        let weight = curve.weights().map_or(1.0, |w| w[i]);
        let _ = write!(out, " P{} L{}", decimal(weight, WEIGHT_DIGITS), curve.knots().degree() + 1);
        if let (1, Some(rate)) = (i, rate) {
            let _ = write!(out, " {rate}");
        }
        out.push('\n');
    }
    out.push_str("G5.3\n");
    plane
}

/// G5 and G5.1: a cubic or quadratic Bézier curve, its inner points from its ends.
pub(crate) fn bezier(
    begins: Begins,
    words: &[Word],
    plane: Plane,
    position: Option<Point3>,
    unit_mm: f64,
) -> Result<Curve3, Refusal> {
    let bad = |what: &str| Err(Refusal::new("linuxcnc-bezier", what));
    let Some(from) = position else {
        return Err(Refusal::new("position", "a curve starts from a position that is not known"));
    };
    if plane != Plane::Xy {
        return Err(Refusal::new("linuxcnc-plane", "G5 and G5.1 are for G17 only"));
    }
    let mm = |key: &str| words.iter().find(|w| w.key == key).and_then(Word::number).map(|v| v * unit_mm);
    if mm("Z").is_some() {
        return bad("G5 and G5.1 do not move Z");
    }
    let (Some(i), Some(j)) = (mm("I"), mm("J")) else { return bad("I and J must stand in the block") };
    let to = Point3::new(mm("X").unwrap_or(from.x), mm("Y").unwrap_or(from.y), from.z);
    let beside = |p: Point3, x: f64, y: f64| Point3::new(p.x + x, p.y + y, p.z);
    let points = if begins == Begins::Cubic {
        let (Some(p), Some(q)) = (mm("P"), mm("Q")) else { return bad("G5 needs P and Q") };
        vec![from, beside(from, i, j), beside(to, p, q), to]
    } else {
        vec![from, beside(from, i, j), to]
    };
    Curve3::new(KnotVector::clamped_uniform(points.len() - 1, points.len()), points, None)
        .map_err(|e| Refusal::new("linuxcnc-curve", e.to_string()))
}

/// A G5.2 that is being read.
#[derive(Debug)]
pub(crate) struct Open {
    planes: bool,
    plane: Plane,
    order: usize,
    begun: bool,
    poles: Vec<Point3>,
    weights: Vec<f64>,
}

impl Open {
    pub(crate) fn begin(planes: bool, plane: Plane, position: Option<Point3>) -> Result<Self, Refusal> {
        let Some(position) = position else {
            return Err(Refusal::new("position", "G5.2 starts from a position that is not known"));
        };
        if !planes && plane != Plane::Xy {
            return Err(Refusal::new(
                "linuxcnc-plane",
                format!("G5.2 in G{}: version 2.9 takes curves in G17 only", plane.g()),
            ));
        }
        Ok(Open { planes, plane, order: 3, begun: false, poles: vec![position], weights: vec![1.0] })
    }

    /// A block with G5.2.
    pub(crate) fn block(&mut self, words: &[Word], unit_mm: f64) -> Result<(), Refusal> {
        let first = !std::mem::replace(&mut self.begun, true);
        let mut p = self.poles[self.poles.len() - 1];
        let (mut named, mut weight) = (0, None);
        let plane = letters(self.plane);
        for w in words {
            let Value::Number { value, .. } = w.value else {
                return Err(Refusal::new("linuxcnc-word", format!("`{}` has no place in G5.2", w.key)));
            };
            match w.key {
                "X" | "Y" | "Z" => {
                    let axis = "XYZ".find(w.key).unwrap_or(0);
                    if !plane.contains(&axis) {
                        let version = if self.planes { "moves wrongly" } else { "drops the axis" };
                        return Err(Refusal::new(
                            "linuxcnc-third-axis",
                            format!(
                                "{} in G{}: the control {version} without a message",
                                w.key,
                                self.plane.g()
                            ),
                        ));
                    }
                    p[axis] = value * unit_mm;
                    named += 1;
                }
                "P" => weight = Some(value),
                // The last one above 3 counts.
                "L" if (0.0..=25.0).contains(&value) && value.fract() == 0.0 => {
                    if value > 3.0 {
                        self.order = value as usize;
                    }
                }
                "L" => return Err(Refusal::new("linuxcnc-order", format!("L{value} is no order"))),
                "F" | "G" | "N" => {}
                _ => return Err(Refusal::new("linuxcnc-word", format!("`{}` has no place in G5.2", w.key))),
            }
        }
        if weight.is_some_and(|w| w <= 0.0) {
            return Err(Refusal::new("linuxcnc-weight", "P must be above 0"));
        }
        match (named, weight) {
            (0, _) if first => self.weights[0] = weight.unwrap_or(1.0),
            (2, Some(weight)) => {
                self.poles.push(p);
                self.weights.push(weight);
            }
            (2, None) => return Err(Refusal::new("linuxcnc-weight", "a pole without P")),
            _ => return Err(Refusal::new("linuxcnc-axes", "a pole must name both axes of the plane")),
        }
        if self.poles.len() > MOST_POLES {
            return Err(Refusal::new(
                "linuxcnc-poles",
                format!("more than {MOST_POLES} poles in one block take the interpreter seconds"),
            ));
        }
        Ok(())
    }

    /// The curve at G5.3: uniform clamped knots.
    pub(crate) fn close(self) -> Result<Curve3, Refusal> {
        let (order, n) = (self.order, self.poles.len());
        if n < order {
            return Err(Refusal::new("linuxcnc-few", format!("{n} poles are too few for order {order}")));
        }
        let weights = self.weights.iter().any(|w| *w != self.weights[0]).then_some(self.weights);
        let curve = Curve3::new(KnotVector::clamped_uniform(order - 1, n), self.poles, weights)
            .map_err(|e| Refusal::new("linuxcnc-curve", e.to_string()))?;
        if breaks_biarcs(&curve) {
            return Err(Refusal::new(
                "linuxcnc-straight",
                "a piece of the curve is straight, or its ends are parallel: the control divides by zero",
            ));
        }
        Ok(curve)
    }
}
