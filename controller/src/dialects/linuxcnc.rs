//! G5.2 of LinuxCNC: one Bézier piece a block, whose uniform clamped knots are then the right ones.

use std::fmt::Write as _;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::Page;
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

/// A G5.2 that is being read.
#[derive(Debug)]
pub(crate) struct Open {
    planes: bool,
    plane: Plane,
    order: usize,
    pub(crate) poles: Vec<Point3>,
    pub(crate) weights: Vec<f64>,
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
        Ok(Open { planes, plane, order: 3, poles: vec![position], weights: vec![1.0] })
    }

    /// A block with G5.2.
    pub(crate) fn block(&mut self, words: &[Word], unit_mm: f64) -> Result<(), Refusal> {
        let first = self.poles.len() == 1;
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
                "L" if (1.0..=25.0).contains(&value) => self.order = self.order.max(value as usize),
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
        Curve3::new(KnotVector::clamped_uniform(order - 1, n), self.poles, weights)
            .map_err(|e| Refusal::new("linuxcnc-curve", e.to_string()))
    }
}
