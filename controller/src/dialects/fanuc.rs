//! G06.2 of Fanuc and Mitsubishi.

use std::fmt::Write as _;

use claymill_nurbs::{Curve3, KnotVector, Point3};

use super::Page;
use super::flavour::Flavour;
use crate::lower::Splines;
use crate::number::decimal;
use crate::words::{Value, Word};
use crate::{Machine, Refusal};

/// Digits of a K or R word.
const WORD_DIGITS: usize = 9;

/// What G06.2 takes, with `digits` decimals for knots and weights: Fanuc's IS-B has 3, Mitsubishi 4.
pub(crate) fn splines(machine: &Machine, digits: u8) -> Splines {
    let largest = largest_knot(if digits == 3 { Flavour::Fanuc } else { Flavour::Mitsubishi });
    let weights = if digits == 3 { [0.001, 999_999.999] } else { [0.0001, 99.9999] };
    Splines {
        pieces: false,
        degrees: [1, 3],
        weights: Some(weights),
        weight_digits: digits,
        knot_digits: digits,
        largest_knot: largest,
        planes: None,
        max_points: machine.max_points.unwrap_or(usize::MAX),
        exact_points: false,
        first_weight_one: false,
        halved: false,
        biarcs: false,
    }
}

/// Nine digits with three or four decimals.
fn largest_knot(flavour: Flavour) -> f64 {
    if flavour == Flavour::Mitsubishi { 99_999.999_9 } else { 999_999.999 }
}

pub(crate) fn write(out: &mut String, page: &Page, curve: &Curve3, rate: Option<&str>) {
    let rank = curve.knots().degree() + 1;
    let knots = curve.knots().as_slice();
    // Knots have at most four decimals after `splines`.
    let knot = |k: f64| decimal(k, 4);
    for (i, p) in curve.points().iter().enumerate() {
        if i == 0 {
            let _ = write!(out, "G06.2 P{rank} ");
        }
        let _ = write!(out, "K{} {}", knot(knots[i]), page.xyz(p));
        if let Some(weights) = curve.weights() {
            let _ = write!(out, " R{}", knot(weights[i]));
        }
        if let (0, Some(rate)) = (i, rate) {
            let _ = write!(out, " {rate}");
        }
        out.push('\n');
    }
    for k in &knots[curve.points().len()..] {
        let _ = writeln!(out, "K{}", knot(*k));
    }
}

/// A G06.2 that is being read.
#[derive(Debug)]
pub(crate) struct Open {
    flavour: Flavour,
    rank: usize,
    knots: Vec<f64>,
    points: Vec<Point3>,
    weights: Vec<f64>,
    /// Axes of the first block: no other one moves.
    axes: [bool; 3],
    /// The last control point; at first the current position, for axes that stand still.
    last: Point3,
}

/// More control points than any control keeps.
const MOST_POINTS: usize = 1_000_000;

impl Open {
    /// The block with G06.2 itself.
    pub(crate) fn begin(
        flavour: Flavour,
        words: &[Word],
        unit_mm: f64,
        position: Option<Point3>,
        step_mm: f64,
        high_speed: bool,
    ) -> Result<Self, Refusal> {
        let mut rank = 4;
        for w in words.iter().filter(|w| w.key == "P") {
            rank = match w.number() {
                Some(p) if p == 2.0 || p == 3.0 || p == 4.0 => p as usize,
                _ => return Err(Refusal::new("nurbs-rank", "P must be 2, 3 or 4")),
            };
        }
        if flavour == Flavour::Mitsubishi && !high_speed {
            return Err(Refusal::new("nurbs-high-speed", "G06.2 needs G05 P10000 before it"));
        }
        let axes = ["X", "Y", "Z"].map(|a| words.iter().any(|w| w.key == a));
        if axes == [false; 3] {
            return Err(Refusal::new("nurbs-axes", "the first block of G06.2 must name the axes that move"));
        }
        let Some(position) = position else {
            return Err(Refusal::new("position", "G06.2 starts from a position that is not known"));
        };
        let (knots, points, weights) = Default::default();
        let mut open = Open { flavour, rank, knots, points, weights, axes, last: position };
        let rest: Vec<Word> =
            words.iter().filter(|w| !matches!(w.key, "G" | "P" | "F" | "N")).cloned().collect();
        open.block(&rest, unit_mm)?;
        let gap = (open.last - position).norm();
        if gap > 0.5 * step_mm {
            return Err(Refusal::new(
                "nurbs-ps1009",
                format!("the first control point is {gap:.4} mm from the current position"),
            ));
        }
        Ok(open)
    }

    /// A further block; the curve when it is the last one.
    pub(crate) fn block(&mut self, words: &[Word], unit_mm: f64) -> Result<Option<Curve3>, Refusal> {
        let mut knot = None;
        let mut weight = 1.0;
        let mut p = self.last;
        let mut moves = false;
        let decimals = if self.flavour == Flavour::Mitsubishi { 4 } else { 3 };
        for w in words {
            let Value::Number { value, decimals: given, digits, .. } = w.value else {
                return Err(Refusal::new("nurbs-word", format!("`{}` has no place in a NURBS", w.key)));
            };
            let large = w.key == "K" && value.abs() > largest_knot(self.flavour);
            if matches!(w.key, "K" | "R") && (given > decimals || digits > WORD_DIGITS || large) {
                return Err(Refusal::new(
                    "nurbs-digits",
                    format!("{}{value} has more than {decimals} decimals or {WORD_DIGITS} digits", w.key),
                ));
            }
            match w.key {
                "K" => knot = Some(value),
                "R" => weight = value,
                "X" | "Y" | "Z" => {
                    let axis = "XYZ".find(w.key).unwrap_or(0);
                    if !self.axes[axis] {
                        return Err(Refusal::new(
                            "nurbs-axes",
                            format!("{} moves, but the first block of G06.2 does not name it", w.key),
                        ));
                    }
                    p[axis] = value * unit_mm;
                    moves = true;
                }
                "A" | "B" | "C" | "U" | "V" | "W" if self.flavour == Flavour::Mitsubishi => {
                    return Err(Refusal::new("nurbs-axes", "G06.2 moves the three basic axes only"));
                }
                "A" | "B" | "C" | "U" | "V" | "W" => {
                    return Err(Refusal::new("axis", format!("`{}`: only X, Y and Z can be checked", w.key)));
                }
                "P" => return Err(Refusal::new("nurbs-rank", "P stands in the first block only")),
                "N" => {}
                _ => {
                    return Err(Refusal::new(
                        "nurbs-ps1005",
                        format!("`{}{value}` before the last knot: the NURBS is left early", w.key),
                    ));
                }
            }
        }
        let Some(knot) = knot else {
            return Err(Refusal::new("nurbs-ps1002", "a block of a NURBS has no knot K"));
        };
        if self.knots.last().is_some_and(|last| knot < *last) {
            return Err(Refusal::new(
                "nurbs-p551",
                format!("knot K{knot} is smaller than the one before it"),
            ));
        }
        if moves {
            if self.knots.len() > self.points.len() {
                return Err(Refusal::new("nurbs-ps1004", "a control point after a block with a knot only"));
            }
            let range =
                if self.flavour == Flavour::Mitsubishi { 0.0001..=99.9999 } else { 0.001..=999_999.999 };
            if !range.contains(&weight) {
                return Err(Refusal::new("nurbs-weight", format!("weight R{weight} is out of range")));
            }
            self.points.push(p);
            self.last = p;
            self.weights.push(weight);
        }
        self.knots.push(knot);
        if self.points.len() > MOST_POINTS {
            return Err(Refusal::new("nurbs-size", format!("more than {MOST_POINTS} control points")));
        }
        if self.knots.len() < self.points.len() + self.rank {
            return Ok(None);
        }
        self.curve().map(Some)
    }

    /// What is missing when the program goes on to something else.
    pub(crate) fn early(&self) -> Refusal {
        let missing = self.points.len() + self.rank - self.knots.len();
        Refusal::new("nurbs-ps1004", format!("{missing} of the last {} knots are missing", self.rank))
    }

    fn curve(&self) -> Result<Curve3, Refusal> {
        let (rank, n) = (self.rank, self.points.len());
        if n < rank {
            return Err(Refusal::new("nurbs-points", format!("{n} control points are too few for P{rank}")));
        }
        let equal = |knots: &[f64]| knots.iter().all(|k| *k == knots[0]);
        if !equal(&self.knots[..rank]) || !equal(&self.knots[n..]) {
            return Err(Refusal::new(
                "nurbs-ps1007",
                format!("the first and the last {rank} knots must be equal"),
            ));
        }
        if self.knots[rank..n].chunk_by(|a, b| a == b).any(|run| run.len() > rank) {
            return Err(Refusal::new("nurbs-ps1008", format!("a knot occurs more than {rank} times")));
        }
        let weights = self.weights.iter().any(|w| *w != 1.0).then(|| self.weights.clone());
        KnotVector::new(rank - 1, self.knots.clone())
            .and_then(|knots| Curve3::new(knots, self.points.clone(), weights))
            .map_err(|e| Refusal::new("nurbs-curve", e.to_string()))
    }
}
