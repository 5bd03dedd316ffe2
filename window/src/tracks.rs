//! The tool paths of a job as lines, and where the tool is at any time.

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind};
use claymill_viewer::{Scene, StrokeStyle, drawn_moves, flatten};

use crate::exhibit::JobToShow;
use crate::lines::{Lines, Stroke};

/// Drawn lines leave their curves by no more than this, mm.
const CHORD_MM: f64 = 0.1;
/// Chords of the tip's way along which time is measured, mm.
const STATION_CHORD_MM: f64 = 0.02;

/// The tool at some moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolPlace {
    /// Index of the move that it is on.
    pub of: usize,
    /// The part of the move that is done, by length.
    pub share: f64,
    /// Its tip, mm.
    pub tip: Point3,
    /// From the tip to the holder (unit).
    pub axis: Vector3,
    /// Radius, mm.
    pub radius_mm: f64,
}

/// The moves of a job: tags of the lines are indices of moves.
#[derive(Debug, Default)]
pub(crate) struct Tracks {
    pub(crate) lines: Lines,
    /// When each move begins, and when the last one ends, s.
    pub(crate) begins_s: Vec<f64>,
}

impl Tracks {
    /// `scene` holds the surfaces that the moves are drawn on.
    pub(crate) fn new(scene: &Scene, shown: &JobToShow) -> Self {
        let style = StrokeStyle { tools: &shown.job.tools, ..StrokeStyle::new(CHORD_MM) };
        let drawn = drawn_moves(scene, &shown.program, &style);
        let mut strokes = Vec::new();
        let mut group = 0;
        let moves = &shown.program.moves;
        for (i, (m, parts)) in moves.iter().zip(drawn).enumerate() {
            let pass = |m: &Move| (m.region, m.pass);
            let before = i.checked_sub(1).map(|b| &moves[b]);
            group += u32::from(before.is_some_and(|b| pass(b) != pass(m) || b.setup != m.setup));
            for part in parts.into_iter().flatten() {
                let relative = |p: &Point3| [0, 1, 2].map(|k| (p[k] - scene.origin[k]) as f32);
                strokes.push(Stroke {
                    tag: i as u32,
                    group,
                    thinned: matches!(m.kind, MoveKind::Cut | MoveKind::Link),
                    points: part.iter().map(relative).collect(),
                });
            }
        }
        Tracks { lines: Lines::new(&strokes, step_over_mm(&shown.job)), begins_s: begins(&shown.seconds) }
    }

    /// How long the job takes, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.begins_s.last().copied().unwrap_or(0.0)
    }

    /// The move at a time; at its first moment rather than at the end of the one before.
    pub(crate) fn move_at(&self, at_s: f64) -> usize {
        let last = self.begins_s.len().saturating_sub(2);
        self.begins_s.partition_point(|b| *b <= at_s).saturating_sub(1).min(last)
    }
}

/// Usual distance of neighbouring passes.
fn step_over_mm(job: &Job) -> f32 {
    let length_mm = job.totals.length.cut_mm;
    if length_mm > 0.0 { (job.area.cut_mm2 / length_mm).clamp(0.05, 50.0) as f32 } else { 1.0 }
}

fn begins(seconds: &[f64]) -> Vec<f64> {
    let mut now_s = 0.0;
    let mut begins = vec![0.0];
    begins.extend(seconds.iter().map(|s| {
        now_s += s;
        now_s
    }));
    begins
}

/// The tool on move `of` after `share` of its time; within a move the time goes with the length.
pub(crate) fn tool_at(shown: &JobToShow, of: usize, share: f64) -> Option<ToolPlace> {
    let m = shown.program.moves.get(of)?;
    let curve = m.curve().ok()?;
    let tip = point_at(&curve, share);
    let (start, end) = (Vector3::from(m.axis_start), Vector3::from(m.axis_end));
    let axis = start.lerp(&end, share).try_normalize(0.0).unwrap_or(start);
    let radius_mm = shown.job.tools.iter().find(|t| t.id == m.tool).map_or(1.0, |t| t.tool.radius_mm());
    Some(ToolPlace { of, share, tip, axis, radius_mm })
}

/// The point after `share` of a curve's length.
fn point_at(curve: &Curve3, share: f64) -> Point3 {
    let points = flatten(curve, STATION_CHORD_MM);
    let whole_mm: f64 = points.windows(2).map(|ab| (ab[1] - ab[0]).norm()).sum();
    let mut left_mm = share.clamp(0.0, 1.0) * whole_mm;
    for ab in points.windows(2) {
        let mm = (ab[1] - ab[0]).norm();
        if left_mm <= mm && mm > 0.0 {
            return ab[0] + (ab[1] - ab[0]) * (left_mm / mm);
        }
        left_mm -= mm;
    }
    points.last().copied().unwrap_or_else(|| curve.end())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use claymill_nurbs::KnotVector;

    #[test]
    fn half_of_a_quarter_circle_is_at_45_degrees() {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let p = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let points = vec![p(50.0, 0.0), p(50.0, 50.0), p(0.0, 50.0)];
        let arc = Curve3::new(KnotVector::clamped_uniform(2, 3), points, Some(vec![1.0, s, 1.0])).unwrap();
        for (share, degrees) in [(0.0, 0.0_f64), (0.5, 45.0), (0.25, 22.5), (1.0, 90.0)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            assert_abs_diff_eq!(point_at(&arc, share), p(50.0 * cos, 50.0 * sin), epsilon = 0.03);
        }
    }

    #[test]
    fn moves_are_found_by_time() {
        let tracks = Tracks { lines: Lines::default(), begins_s: begins(&[10.0, 2.0, 10.0]) };
        assert_eq!(tracks.duration_s(), 22.0);
        let at = [0.0, 9.9, 10.0, 11.0, 12.0, 22.0, 99.0];
        assert_eq!(at.map(|t| tracks.move_at(t)), [0, 0, 1, 1, 2, 2, 2]);
    }
}
