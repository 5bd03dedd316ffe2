//! The ladder from a curve to what a control takes of it.

mod blocks;
mod fitted;
mod written;

use claymill_nurbs::Curve3;
use serde::Serialize;

use crate::follow::deviation;
use crate::number::LengthFormat;
use crate::{Plane, Refusal, Shape};

pub(crate) use blocks::chords;
use blocks::{as_blocks, as_chords};
use fitted::hermite;
use written::written;

/// What a dialect takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Abilities {
    /// Forms of curves, the best first; none for a control that knows lines and arcs only.
    pub splines: Vec<Splines>,
    /// G2 and G3 in the planes of two axes.
    pub arcs: bool,
}

/// What a dialect takes of curves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Splines {
    /// One polynomial piece at a time instead of a curve with inner knots.
    pub pieces: bool,
    /// Lowest and highest degree.
    pub degrees: [usize; 2],
    /// Smallest and largest weight after the curve's weights were scaled so that the largest one is `[1]`
    /// or less; `None` for a control without weights.
    pub weights: Option<[f64; 2]>,
    /// Decimals of weights.
    pub weight_digits: u8,
    /// Decimals of knots.
    pub knot_digits: u8,
    /// Largest knot.
    pub largest_knot: f64,
    /// Planes in which curves may lie; `None` for any place in space.
    pub planes: Option<Vec<Plane>>,
    /// Largest number of control points in one curve.
    pub max_points: usize,
    /// Whether inner control points keep all their digits: polynomial coefficients have more than coordinates.
    pub exact_points: bool,
    /// Whether the first weight must be 1, because it cannot be written.
    pub first_weight_one: bool,
    /// Whether each piece is written with a knot in its middle: for uniform splines of five points or more.
    pub halved: bool,
    /// Whether the control makes biarcs of a curve, which straight pieces break.
    pub biarcs: bool,
}

/// What a curve became.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rung {
    /// A straight move of the job.
    Straight,
    /// The job's curve itself, rounded.
    Nurbs,
    /// A polynomial curve fitted to it.
    Polynomial,
    /// Pairs of tangent arcs, with straight moves where those take fewer blocks.
    Biarcs,
    /// Straight moves.
    Chords,
}

impl Rung {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Rung::Straight => "straight",
            Rung::Nurbs => "as NURBS",
            Rung::Polynomial => "as polynomials",
            Rung::Biarcs => "as biarcs",
            Rung::Chords => "as chords",
        }
    }
}

/// A curve as a control takes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lowered {
    /// What it became.
    pub rung: Rung,
    /// Its shapes, in written digits, each starting where the one before it ends.
    pub shapes: Vec<Shape>,
    /// Largest distance from the job's curve after rounding, mm.
    pub error_mm: f64,
}

/// Takes a curve down the ladder NURBS, polynomial, biarcs, straight moves until what is left is within
/// `tolerance_mm` of the curve, the rounding to `format` aside.
///
/// # Errors
/// Not even straight moves stay within the tolerance: the digits are too coarse for it.
pub(crate) fn lower(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Result<Lowered, Refusal> {
    // Rounding a point moves it by no more than half a step along each axis.
    let allowed = tolerance_mm + 0.87 * format.step_mm();
    if 0.87 * format.step_mm() > tolerance_mm {
        return Err(Refusal::new(
            "digits",
            format!(
                "rounding to {} decimals takes up to {:.4} mm, more than the tolerance of {tolerance_mm} mm: give \
                 tolerance_mm = {:.3} or more digits",
                format.digits,
                0.87 * format.step_mm(),
                (1e3 * format.step_mm()).ceil() / 1e3
            ),
        ));
    }
    let (from, to) = (format.snap_point(&curve.start()), format.snap_point(&curve.end()));
    if curve.knots().degree() == 1 && curve.points().len() == 2 {
        let shapes = if from == to { Vec::new() } else { vec![Shape::Line { from, to }] };
        let error_mm = (from - curve.start()).norm().max((to - curve.end()).norm());
        return Ok(Lowered { rung: Rung::Straight, shapes, error_mm });
    }
    type Attempt = fn(&Curve3, &Abilities, &LengthFormat, f64) -> Option<Vec<Shape>>;
    let rungs: [(Rung, Attempt); 4] = [
        (Rung::Nurbs, as_nurbs),
        (Rung::Polynomial, as_polynomial),
        (Rung::Biarcs, as_blocks),
        (Rung::Chords, as_chords),
    ];
    let mut least = f64::INFINITY;
    for (rung, attempt) in rungs {
        // An attempt looks at a few places only: where it was too bold, it aims at less.
        for share in [1.0, 0.7, 0.4, 0.1] {
            let Some(shapes) = attempt(curve, abilities, format, share * tolerance_mm) else { break };
            let error_mm = deviation(curve, &shapes);
            if error_mm <= allowed {
                let straight = shapes.iter().all(|s| matches!(s, Shape::Line { .. }));
                let rung = if rung == Rung::Biarcs && straight { Rung::Chords } else { rung };
                return Ok(Lowered { rung, shapes, error_mm });
            }
            least = least.min(error_mm);
            if rung == Rung::Nurbs {
                break;
            }
        }
    }
    Err(Refusal::new(
        "tolerance",
        format!(
            "the curve can be written within {least:.6} mm only, {allowed:.6} mm are allowed: give it more digits or a larger tolerance_mm"
        ),
    ))
}

/// Whether all control points lie in a plane that the control takes curves in.
fn lies_in(curve: &Curve3, planes: Option<&[Plane]>, format: &LengthFormat) -> bool {
    let Some(planes) = planes else { return true };
    planes.iter().any(|plane| holds(curve, *plane, format))
}

/// Whether a curve's points have one written coordinate across the plane.
pub(crate) fn holds(curve: &Curve3, plane: Plane, format: &LengthFormat) -> bool {
    let k = plane.axes()[2];
    let first = format.snap(curve.points()[0][k]);
    curve.points().iter().all(|p| format.snap(p[k]) == first)
}

/// In the first form that takes the curve within the tolerance.
fn as_nurbs(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let fits = |splines: &&Splines| {
        lies_in(curve, splines.planes.as_deref(), format)
            && curve.knots().degree() <= splines.degrees[1]
            && (curve.weights().is_none() || splines.weights.is_some())
    };
    let allowed = tolerance_mm + 0.87 * format.step_mm();
    let mut forms = abilities.splines.iter().filter(fits).peekable();
    while let Some(splines) = forms.next() {
        match written(curve, splines, format) {
            Some(shapes) if forms.peek().is_none() || deviation(curve, &shapes) <= allowed => {
                return Some(shapes);
            }
            _ => {}
        }
    }
    None
}

fn as_polynomial(
    curve: &Curve3,
    abilities: &Abilities,
    format: &LengthFormat,
    tolerance_mm: f64,
) -> Option<Vec<Shape>> {
    let splines = abilities.splines.first()?;
    if !lies_in(curve, splines.planes.as_deref(), format) || splines.degrees[1] < 3 {
        return None;
    }
    written(&hermite(curve, 0.5 * tolerance_mm)?, splines, format)
}
