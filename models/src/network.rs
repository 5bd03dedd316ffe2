//! The feature curves of a generated model, with their mirror images. Two sheets on the same piece
//! of a curve meet exactly.

use claymill_nurbs::Point3;

use crate::spline::Spline;

/// Index of a feature curve in its [`Network`].
pub(crate) type CurveId = usize;

/// The feature curves of a generated model. Sheets are hung between pieces of them; two sheets that take
/// overlapping pieces of the same curve are neighbours, and meet exactly.
#[derive(Debug, Default)]
pub(crate) struct Network {
    curves: Vec<(Spline, Twin)>,
}

/// What a curve becomes when the model is mirrored left to right.
#[derive(Debug, Clone, Copy)]
enum Twin {
    Other(CurveId),
    /// It crosses the middle of the model and maps to itself, its parameter to the negative.
    ItselfBackwards,
}

/// A directed piece of a feature curve: one of the four edges of a sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    pub(crate) curve: CurveId,
    /// Parameter of the curve where the edge starts.
    pub(crate) from: f64,
    /// Parameter where it ends; smaller than `from` when the edge runs against the curve.
    pub(crate) to: f64,
}

impl Edge {
    /// The curve's parameter at the share `s` of the edge.
    pub(crate) fn parameter(&self, s: f64) -> f64 {
        self.from + (self.to - self.from) * s
    }

    /// The share of the edge at the curve's parameter `t`.
    pub(crate) fn share(&self, t: f64) -> f64 {
        (t - self.from) / (self.to - self.from)
    }
}

impl Network {
    /// Adds a curve of the right side and its mirror image; returns the right one.
    pub(crate) fn add_pair(&mut self, right: Spline) -> CurveId {
        let id = self.curves.len();
        let left = right.mirrored();
        self.curves.push((right, Twin::Other(id + 1)));
        self.curves.push((left, Twin::Other(id)));
        id
    }

    /// Adds a curve from the right side (negative parameters) to the left, given by its right half: the
    /// last point of `half` is on the middle plane at parameter 0.
    pub(crate) fn add_across(&mut self, half: &[(f64, Point3)]) -> CurveId {
        let other = half.iter().rev().skip(1).map(|(t, p)| (-t, Point3::new(p.x, -p.y, p.z)));
        let table: Vec<_> = half.iter().copied().chain(other).collect();
        self.curves.push((Spline::through(&table), Twin::ItselfBackwards));
        self.curves.len() - 1
    }

    /// The curve's point at `t`.
    pub(crate) fn point(&self, curve: CurveId, t: f64) -> Point3 {
        self.curves[curve].0.point(t)
    }

    /// The whole curve as an edge.
    pub(crate) fn whole(&self, curve: CurveId) -> Edge {
        let (from, to) = self.curves[curve].0.domain();
        Edge { curve, from, to }
    }

    /// The edge as a curve over `[0, 1]` in its own direction.
    pub(crate) fn piece(&self, edge: Edge) -> Spline {
        let (low, high) = (edge.from.min(edge.to), edge.from.max(edge.to));
        let part = self.curves[edge.curve].0.restricted(low, high);
        part.normalised(edge.from > edge.to)
    }

    /// The same edge on the other side of the model.
    pub(crate) fn mirrored(&self, edge: Edge) -> Edge {
        match self.curves[edge.curve].1 {
            Twin::Other(curve) => Edge { curve, ..edge },
            Twin::ItselfBackwards => Edge { curve: edge.curve, from: -edge.from, to: -edge.to },
        }
    }
}
