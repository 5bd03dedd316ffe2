//! Moves as the verifier sees them: the ball centre's curve, its spans and polygons within a chord
//! error.

use std::collections::BTreeMap;

use claymill_nurbs::{Aabb, Curve3, Point3, Vector3};
use claymill_toolpath::{Job, KeyMaker, Move, MoveError, MoveKind, PartKey, Program, Tool};

use crate::VerifyError;
use crate::end::EndBody;

/// Ways shorter than this have one box, mm.
const SHORT_WAY_MM: f64 = 100.0;
/// Axes that differ by less are one direction.
const SAME_AXIS: f64 = 1e-9;

/// A stretch of a track between two knots.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// Its last control point.
    last: usize,
    /// Its parameters.
    ends: (f64, f64),
}

impl Span {
    /// The parameter in the middle.
    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.ends.0 + self.ends.1)
    }
}

/// A move as the ball's centre sees it: the tip's curve shifted by the radius along the tool axis.
#[derive(Debug)]
pub(crate) struct Track {
    pub(crate) seq: u64,
    pub(crate) kind: MoveKind,
    pub(crate) region: usize,
    /// Index in the job's setups.
    pub(crate) setup: usize,
    /// Number of the pass in the whole job: moves of one pass, region and setup share it.
    pub(crate) pass: u32,
    pub(crate) radius_mm: f64,
    /// The end, if it is no ball.
    pub(crate) end: Option<EndBody>,
    /// Index in the job's tools.
    pub(crate) tool: usize,
    tip: Curve3,
    axis_start: Vector3,
    axis_end: Vector3,
}

impl Track {
    /// Prepares every move of a program, in machining order.
    pub(crate) fn all(job: &Job, program: &Program) -> Result<Vec<Track>, VerifyError> {
        let mut passes = BTreeMap::new();
        let mut tracks = Vec::with_capacity(program.moves.len());
        for m in &program.moves {
            let count = passes.len() as u32;
            let pass = *passes.entry((m.setup.as_str(), m.region, m.pass)).or_insert(count);
            tracks.push(Track::new(job, m, pass)?);
        }
        Ok(tracks)
    }

    fn new(job: &Job, m: &Move, pass: u32) -> Result<Track, VerifyError> {
        let unknown = |what, name: &str| VerifyError::Unknown { seq: m.seq, what, name: name.to_owned() };
        let tool = job.tools.iter().position(|t| t.id == m.tool);
        let setup = job.setups.iter().position(|s| s.name == m.setup);
        let setup = setup.ok_or_else(|| unknown("setup", &m.setup))?;
        let tool = tool.ok_or_else(|| unknown("tool", &m.tool))?;
        let of_tool = &job.tools[tool].tool;
        let end = EndBody::of(of_tool);
        Ok(Track { pass, setup, tool, end, ..Track::of(m, of_tool.radius_mm())? })
    }

    /// A move by itself, as the first of the first setup with the first tool.
    pub(crate) fn of(m: &Move, radius_mm: f64) -> Result<Track, MoveError> {
        Ok(Track {
            seq: m.seq,
            kind: m.kind,
            region: m.region,
            setup: 0,
            pass: 0,
            radius_mm,
            end: None,
            tool: 0,
            tip: m.curve()?,
            axis_start: Vector3::from(m.axis_start),
            axis_end: Vector3::from(m.axis_end),
        })
    }

    /// Whether material is removed in passing: every kind but rapids.
    pub(crate) fn sweeps(&self) -> bool {
        self.kind != MoveKind::Rapid
    }

    /// Ball centre, or the middle of another end's disc, and its derivative at parameter `t`.
    pub(crate) fn centre(&self, t: f64) -> (Point3, Vector3) {
        let [tip, speed, _] = self.tip.derivatives(t);
        let (t0, t1) = self.tip.domain();
        let turn = self.axis_end - self.axis_start;
        let blend = self.axis_start + turn * ((t - t0) / (t1 - t0));
        let size = blend.norm();
        let axis = blend / size;
        let turning = (turn - axis * axis.dot(&turn)) / (size * (t1 - t0));
        let r = self.end.map_or(self.radius_mm, |end| end.corner_mm);
        (Point3::from(tip + axis * r), speed + turning * r)
    }

    /// The tool axis of an end that does not turn.
    pub(crate) fn axis_at(&self, t: f64) -> Vector3 {
        let (t0, t1) = self.tip.domain();
        (self.axis_start + (self.axis_end - self.axis_start) * ((t - t0) / (t1 - t0))).normalize()
    }

    /// Boxes around the tip's way in some coordinates, one behind the other: spans together, as long as they are short.
    pub(crate) fn boxes_of_tips(&self, turned: impl Fn(&Point3) -> Point3) -> Vec<Aabb> {
        let mut boxes: Vec<Aabb> = Vec::new();
        for span in self.spans() {
            let own = self.box_of(&span, &turned);
            match boxes.last_mut() {
                Some(last) if last.union(&own).diagonal() <= SHORT_WAY_MM => *last = last.union(&own),
                _ => boxes.push(own),
            }
        }
        boxes
    }

    /// What it is, without its number: the way of a tool.
    pub(crate) fn key(&self, tool: &Tool) -> PartKey {
        KeyMaker::new("move")
            .debug(&(self.kind, tool))
            .curve(&self.tip)
            .numbers(self.axis_start.iter().chain(self.axis_end.iter()).copied())
            .finish()
    }

    /// The tip at parameter `t`.
    pub(crate) fn tip(&self, t: f64) -> Point3 {
        self.tip.point(t)
    }

    /// Whether the tool stands along `axis` all the way.
    pub(crate) fn stands_along(&self, axis: &Vector3) -> bool {
        [self.axis_start, self.axis_end].iter().all(|own| (own - axis).norm() < SAME_AXIS)
    }

    /// The stretches between knots.
    pub(crate) fn spans(&self) -> impl Iterator<Item = Span> {
        let (knots, degree) = (self.tip.knots().as_slice(), self.tip.knots().degree());
        (degree..knots.len() - degree - 1)
            .filter(|&k| knots[k] < knots[k + 1])
            .map(|k| Span { last: k, ends: (knots[k], knots[k + 1]) })
    }

    /// A box around a span of the tip's curve in some coordinates: around its control points.
    pub(crate) fn box_of(&self, span: &Span, turned: impl Fn(&Point3) -> Point3) -> Aabb {
        let hull = &self.tip.points()[span.last - self.tip.knots().degree()..=span.last];
        hull.iter().fold(Aabb::empty(), |mut bounds, p| {
            bounds.add(&turned(p));
            bounds
        })
    }

    /// First and last parameter.
    pub(crate) fn domain(&self) -> (f64, f64) {
        self.tip.domain()
    }

    /// Parameters of the knots and of stations between them no farther apart than `spacing_mm`.
    pub(crate) fn stations(&self, spacing_mm: f64) -> Vec<f64> {
        self.divided(|t0, t1| {
            let fastest =
                [t0, 0.5 * (t0 + t1), t1].map(|t| self.centre(t).1.norm()).into_iter().fold(0.0, f64::max);
            fastest * (t1 - t0) / spacing_mm
        })
    }

    /// Parameters of a polygon no farther than `chord_mm` from the centre's curve.
    pub(crate) fn polygon(&self, chord_mm: f64) -> Vec<f64> {
        self.divided(|t0, t1| self.chord_count(t0, t1, chord_mm))
    }

    /// The same for one span and the tip.
    pub(crate) fn chords(&self, span: &Span, chord_mm: f64) -> Vec<f64> {
        let (t0, t1) = span.ends;
        let count = whole(self.chord_count(t0, t1, chord_mm));
        let step = (t1 - t0) / count as f64;
        (0..count).map(|i| t0 + step * i as f64).chain([t1]).collect()
    }

    /// How many chords a span needs.
    fn chord_count(&self, t0: f64, t1: f64, chord_mm: f64) -> f64 {
        // The second derivative of a cubic is linear on a span, so that its ends bound it; the
        // middle and the margin are for other degrees and weights. Just inside the span because
        // derivatives jump at knots.
        let inset = 1e-9 * (t1 - t0);
        let bend = [t0 + inset, 0.5 * (t0 + t1), t1 - inset]
            .map(|t| self.tip.derivatives(t)[2].norm())
            .into_iter()
            .fold(0.0, f64::max);
        let margin = if self.tip.knots().degree() > 3 || self.tip.weights().is_some() { 1.5 } else { 1.0 };
        let turn = if self.axis_start == self.axis_end {
            0.0
        } else {
            let angle = self.axis_start.angle(&self.axis_end);
            let (a, b) = self.domain();
            self.radius_mm * (angle / (b - a)).powi(2)
        };
        (t1 - t0) * ((bend + turn) * margin / (8.0 * chord_mm)).sqrt()
    }

    /// The distinct knots with each span cut in equal parts, `parts` rounded up.
    fn divided(&self, parts: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (first, last) = self.domain();
        let mut knots: Vec<f64> = self.tip.knots().as_slice().to_vec();
        knots.retain(|k| (first..=last).contains(k));
        knots.dedup();
        let mut stations = vec![first];
        for span in knots.windows(2) {
            let count = whole(parts(span[0], span[1]));
            let step = (span[1] - span[0]) / count as f64;
            stations.extend((1..count).map(|i| span[0] + step * i as f64));
            stations.push(span[1]);
        }
        stations
    }
}

/// A number of parts, rounded up.
fn whole(parts: f64) -> usize {
    parts.ceil().clamp(1.0, 1e6) as usize
}
