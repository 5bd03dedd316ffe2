//! Gouges, excess and rapid clearance of a program by dense sampling of the ball. The curves are
//! evaluated by de Boor's algorithm here, independently of planner and verifier.

use claymill_nurbs::{ClosestPoints, Hint, Model, Point3, Vector3};
use claymill_toolpath::{Move, MoveKind, Program};

/// What a ball does along a program, by dense sampling.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ball {
    /// Places that were measured.
    pub samples: u64,
    /// Deepest entry into any face on moves that are not rapid, mm, and the move; negative when the ball
    /// nowhere touches.
    pub deepest: Option<(f64, u64)>,
    /// Largest distance of the ball from the face under it along passes, where the nearest point lies inside
    /// a face, mm, and the move.
    pub excess: Option<(f64, u64)>,
    /// Smallest distance of the ball from the model along rapids, mm, and the move; `None` when it is never
    /// nearer than a radius.
    pub rapid_clearance: Option<(f64, u64)>,
}

/// Runs a ball along all moves of a program, a sample every `spacing_mm` or closer.
#[must_use]
pub fn measure_ball(model: &Model, program: &Program, radius_mm: f64, spacing_mm: f64) -> Ball {
    let closest = ClosestPoints::new(model);
    let mut ball = Ball::default();
    let keep_larger = |slot: &mut Option<(f64, u64)>, value: f64, seq: u64| {
        if slot.is_none_or(|(v, _)| value > v) {
            *slot = Some((value, seq));
        }
    };
    for m in &program.moves {
        let mut hint = Hint::default();
        for tip in samples(m, spacing_mm) {
            ball.samples += 1;
            let centre = tip + radius_mm * Vector3::from(m.axis_start);
            let Some(foot) = closest.closest_from(&centre, 2.0 * radius_mm, &mut hint) else { continue };
            let clearance = foot.distance_mm - radius_mm;
            if m.kind == MoveKind::Rapid {
                if ball.rapid_clearance.is_none_or(|(c, _)| clearance < c) {
                    ball.rapid_clearance = Some((clearance, m.seq));
                }
                continue;
            }
            keep_larger(&mut ball.deepest, -clearance, m.seq);
            if m.kind == MoveKind::Cut && !foot.on_boundary {
                keep_larger(&mut ball.excess, clearance, m.seq);
            }
        }
    }
    ball
}

/// Points along a move, ends included; the knots are about arc length.
fn samples(m: &Move, spacing_mm: f64) -> impl Iterator<Item = Point3> {
    let (from, to) = (m.knots[m.degree], m.knots[m.points.len()]);
    let steps = ((to - from) / spacing_mm).ceil().max(1.0) as u32;
    (0..=steps).map(move |i| de_boor(m, from + (to - from) * f64::from(i) / f64::from(steps)))
}

/// The curve's point by repeated linear interpolation (de Boor, "On calculating with B-splines", 1972).
fn de_boor(m: &Move, t: f64) -> Point3 {
    let (p, knots) = (m.degree, &m.knots);
    let after = knots.partition_point(|k| *k <= t).clamp(p + 1, m.points.len());
    let span = after - 1;
    let mut d: Vec<Point3> = (0..=p).map(|j| Point3::from(m.points[span - p + j])).collect();
    for level in 1..=p {
        for j in (level..=p).rev() {
            let i = span - p + j;
            let share = (t - knots[i]) / (knots[i + p + 1 - level] - knots[i]);
            d[j] = d[j - 1] + share * (d[j] - d[j - 1]);
        }
    }
    d[p]
}
