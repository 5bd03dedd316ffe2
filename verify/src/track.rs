use std::collections::BTreeMap;

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::{Job, Move, MoveKind, Program};

use crate::VerifyError;

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
        let tool = job.tools.iter().find(|t| t.id == m.tool);
        let setup = job.setups.iter().position(|s| s.name == m.setup);
        Ok(Track {
            seq: m.seq,
            kind: m.kind,
            region: m.region,
            setup: setup.ok_or_else(|| unknown("setup", &m.setup))?,
            pass,
            radius_mm: tool.ok_or_else(|| unknown("tool", &m.tool))?.tool.radius_mm(),
            tip: m.curve()?,
            axis_start: Vector3::from(m.axis_start),
            axis_end: Vector3::from(m.axis_end),
        })
    }

    /// Whether material is removed in passing: every kind but rapids.
    pub(crate) fn sweeps(&self) -> bool {
        self.kind != MoveKind::Rapid
    }

    /// Ball centre and its derivative at parameter `t`.
    pub(crate) fn centre(&self, t: f64) -> (Point3, Vector3) {
        let [tip, speed, _] = self.tip.derivatives(t);
        let (t0, t1) = self.tip.domain();
        let turn = self.axis_end - self.axis_start;
        let blend = self.axis_start + turn * ((t - t0) / (t1 - t0));
        let size = blend.norm();
        let axis = blend / size;
        let turning = (turn - axis * axis.dot(&turn)) / (size * (t1 - t0));
        let r = self.radius_mm;
        (Point3::from(tip + axis * r), speed + turning * r)
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
        let turns = self.axis_start != self.axis_end;
        self.divided(|t0, t1| {
            // The second derivative of a cubic is linear on a span, so that its ends bound it; the
            // middle and the margin are for other degrees and weights. Just inside the span because
            // derivatives jump at knots.
            let inset = 1e-9 * (t1 - t0);
            let bend = [t0 + inset, 0.5 * (t0 + t1), t1 - inset]
                .map(|t| self.tip.derivatives(t)[2].norm())
                .into_iter()
                .fold(0.0, f64::max);
            let margin =
                if self.tip.knots().degree() > 3 || self.tip.weights().is_some() { 1.5 } else { 1.0 };
            let turn = if turns {
                let angle = self.axis_start.angle(&self.axis_end);
                let (a, b) = self.domain();
                self.radius_mm * (angle / (b - a)).powi(2)
            } else {
                0.0
            };
            (t1 - t0) * ((bend + turn) * margin / (8.0 * chord_mm)).sqrt()
        })
    }

    /// The distinct knots with each span cut in equal parts, `parts` rounded up.
    fn divided(&self, parts: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let (first, last) = self.domain();
        let mut knots: Vec<f64> = self.tip.knots().as_slice().to_vec();
        knots.retain(|k| (first..=last).contains(k));
        knots.dedup();
        let mut stations = vec![first];
        for span in knots.windows(2) {
            let count = parts(span[0], span[1]).ceil().clamp(1.0, 1e6) as usize;
            let step = (span[1] - span[0]) / count as f64;
            stations.extend((1..count).map(|i| span[0] + step * i as f64));
            stations.push(span[1]);
        }
        stations
    }
}
