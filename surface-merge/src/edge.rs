//! Edges: face boundaries cut at corners, as polylines on the exact curve. Feet on an edge follow
//! by Newton's method, lengths by Simpson's rule.

use std::sync::Arc;

use claymill_nurbs::{Curve2, Domain, FaceId, Model, NurbsSurface, Point3, Vector3, bisect};
use rayon::prelude::*;

use crate::joint::EdgeStretch;
use crate::tolerance::{
    CHORD_TURN, COLLAPSED_MM, CORNER_DEG, FEWEST_CHORDS, LONGEST_CHORD_MM, MOST_HALVINGS,
};

/// Breaks of a curve nearer to each other than this share of its domain are one, but for rounding.
const SAME_SHARE: f64 = 1e-9;

/// A smooth piece of a face's boundary: no corner inside, not closed, not collapsed.
#[derive(Debug)]
pub(crate) struct Edge<'m> {
    pub(crate) face: FaceId,
    pub(crate) loop_index: usize,
    pub(crate) edge_index: usize,
    /// A polyline on the edge; the first and last station are its ends.
    pub(crate) stations: Vec<Station>,
    /// Parameters where the curve is only finitely smooth, ends included.
    pub(crate) breaks: Vec<f64>,
    /// Largest distance of the edge from its polyline, mm (measured in the middle of each chord).
    pub(crate) sagitta_mm: f64,
    /// The face lies on the left of the edge in the parameter plane.
    pub(crate) inside_left: bool,
    pub(crate) surface: &'m NurbsSurface,
    pub(crate) pcurve: Arc<Curve2>,
}

/// A point of an edge's polyline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    pub(crate) t: f64,
    pub(crate) point: Point3,
    pub(crate) speed: f64,
    /// Arc length from the edge's start, mm.
    pub(crate) s: f64,
}

/// The point of an edge nearest to some other point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeFoot {
    pub(crate) t: f64,
    pub(crate) point: Point3,
    pub(crate) velocity: Vector3,
}

/// The edges of all faces, in the order of faces and loops.
pub(crate) fn edges(model: &Model, chord_error_mm: f64) -> Vec<Edge<'_>> {
    (0..model.faces.len())
        .into_par_iter()
        .flat_map_iter(|face| face_edges(model, face, chord_error_mm))
        .collect()
}

/// The edges of some faces, in the order given.
pub(crate) fn edges_of<'m>(model: &'m Model, faces: &[FaceId], chord_error_mm: f64) -> Vec<Edge<'m>> {
    faces.par_iter().flat_map_iter(|&face| face_edges(model, face, chord_error_mm)).collect()
}

fn face_edges(model: &Model, face: FaceId, chord_error_mm: f64) -> Vec<Edge<'_>> {
    let f = &model.faces[face];
    let domain = (!f.loops.is_empty()).then(|| Domain::new(f));
    let mut found = Vec::new();
    for (loop_index, ring) in f.boundary().into_iter().enumerate() {
        for (edge_index, trim) in ring.edges.into_iter().enumerate() {
            let pcurve = Arc::new(trim.pcurve);
            for breaks in smooth_pieces(&f.surface, &pcurve) {
                let mut edge = Edge {
                    face,
                    loop_index,
                    edge_index,
                    stations: Vec::new(),
                    breaks,
                    sagitta_mm: 0.0,
                    inside_left: true,
                    surface: &f.surface,
                    pcurve: Arc::clone(&pcurve),
                };
                edge.lay_stations(chord_error_mm);
                let collapsed = edge.length_mm() <= COLLAPSED_MM;
                if !collapsed {
                    edge.inside_left = domain.as_ref().is_none_or(|d| edge.face_is_left(d));
                    found.push(edge);
                }
            }
        }
    }
    found
}

/// Cuts a trim edge at its corners, and in three when it is closed, so that a nearest point on a piece is
/// one point and a piece never meets itself. Each piece is given by its breaks, ends included.
fn smooth_pieces(surface: &NurbsSurface, pcurve: &Curve2) -> Vec<Vec<f64>> {
    let breaks = breaks(surface, pcurve);
    let (Some(&t0), Some(&t1)) = (breaks.first(), breaks.last()) else {
        return Vec::new();
    };
    let beside = 1e-7 * (t1 - t0);
    let direction = |t: f64| surface.lift(pcurve, t)[1].normalize();
    let mut pieces = vec![vec![t0]];
    for &t in &breaks[1..] {
        pieces.last_mut().expect("never empty").push(t);
        let corner =
            t < t1 && direction(t - beside).dot(&direction(t + beside)) < CORNER_DEG.to_radians().cos();
        if corner {
            pieces.push(vec![t]);
        }
    }
    let point = |t: f64| surface.lift(pcurve, t)[0];
    if pieces.len() == 1 && (point(t0) - point(t1)).norm() < COLLAPSED_MM {
        let third = (t1 - t0) / 3.0;
        let cuts = [t0, t0 + third, t1 - third, t1];
        pieces = cuts
            .windows(2)
            .map(|w| {
                // A knot may be where it is cut, but for rounding.
                let inside = breaks.iter().copied().filter(|&t| t > w[0] + beside && t < w[1] - beside);
                std::iter::once(w[0]).chain(inside).chain([w[1]]).collect()
            })
            .collect();
    }
    pieces
}

/// Where the lifted curve is not infinitely smooth: knots of the pcurve, and those of the surface when the
/// pcurve is an iso-parametric line.
fn breaks(surface: &NurbsSurface, pcurve: &Curve2) -> Vec<f64> {
    let mut breaks = pcurve.knots().breaks();
    if let ([a, b], 1, None) = (pcurve.points(), pcurve.knots().degree(), pcurve.weights()) {
        let (t0, t1) = pcurve.domain();
        let d = b - a;
        let (from, span, knots) = match (d.x == 0.0, d.y == 0.0) {
            (false, true) => (a.x, d.x, surface.knots_u().breaks()),
            (true, false) => (a.y, d.y, surface.knots_v().breaks()),
            _ => return breaks,
        };
        let shares = knots.iter().map(|k| (k - from) / span);
        let near = SAME_SHARE * (t1 - t0);
        for t in shares.map(|share| t0 + share * (t1 - t0)) {
            if t > t0 && t < t1 && breaks.iter().all(|known| (known - t).abs() > near) {
                breaks.push(t);
            }
        }
        breaks.sort_by(f64::total_cmp);
    }
    breaks
}

impl Edge<'_> {
    /// First and last parameter.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.stations[0].t, self.stations[self.stations.len() - 1].t)
    }

    pub(crate) fn length_mm(&self) -> f64 {
        self.stations[self.stations.len() - 1].s
    }

    /// The part between two parameters, as others may refer to it.
    pub(crate) fn stretch(&self, [from, to]: [f64; 2]) -> EdgeStretch {
        EdgeStretch { face: self.face, loop_index: self.loop_index, edge_index: self.edge_index, from, to }
    }

    /// The points at two parameters.
    pub(crate) fn points(&self, on: [f64; 2]) -> [Point3; 2] {
        on.map(|t| Point3::from(self.lift(t)[0]))
    }

    /// Position, velocity and acceleration.
    pub(crate) fn lift(&self, t: f64) -> [Vector3; 3] {
        self.surface.lift(&self.pcurve, t)
    }

    /// Arc length at `t`.
    pub(crate) fn arc_length(&self, t: f64) -> f64 {
        let last = self.stations.len() - 1;
        let i = self.stations.partition_point(|s| s.t <= t).clamp(1, last);
        let (a, b) = (&self.stations[i - 1], &self.stations[i]);
        arc_length_between(a, b, ((t - a.t) / (b.t - a.t)).clamp(0.0, 1.0))
    }

    /// The parameter at arc length `s`.
    pub(crate) fn at_length(&self, s: f64) -> f64 {
        let last = self.stations.len() - 1;
        let i = self.stations.partition_point(|station| station.s <= s).clamp(1, last);
        let (a, b) = (&self.stations[i - 1], &self.stations[i]);
        let (low, high) = bisect(0.0, 1.0, 1e-12, |x| arc_length_between(a, b, x) < s);
        a.t + (b.t - a.t) * 0.5 * (low + high)
    }

    /// The nearest point of the edge: nearest chord, then Newton on the exact curve.
    pub(crate) fn foot(&self, p: &Point3) -> EdgeFoot {
        let mut best = (f64::INFINITY, self.stations[0].t);
        for w in self.stations.windows(2) {
            let chord = w[1].point - w[0].point;
            let x = ((p - w[0].point).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            let distance = (p - (w[0].point + chord * x)).norm_squared();
            if distance < best.0 {
                best = (distance, w[0].t + x * (w[1].t - w[0].t));
            }
        }
        let (low, high) = self.ends();
        let mut t = best.1;
        let mut c = self.lift(t);
        for _ in 0..20 {
            let r = c[0] - p.coords;
            let newton = c[1].norm_squared() + r.dot(&c[2]);
            let slope = if newton > 0.5 * c[1].norm_squared() { newton } else { c[1].norm_squared() };
            let next = (t - r.dot(&c[1]) / slope).clamp(low, high);
            let step = (next - t).abs() * c[1].norm();
            if step == 0.0 || !step.is_finite() {
                break;
            }
            t = next;
            c = self.lift(t);
            if step < 1e-9 {
                break;
            }
        }
        EdgeFoot { t, point: Point3::from(c[0]), velocity: c[1] }
    }

    fn lay_stations(&mut self, chord_error_mm: f64) {
        let spans = self.breaks.len() - 1;
        let parts = FEWEST_CHORDS.div_ceil(spans);
        self.stations = vec![self.station(self.breaks[0])];
        for i in 0..spans {
            let (a, b) = (self.breaks[i], self.breaks[i + 1]);
            for part in 1..=parts {
                let end = if part == parts { b } else { a + (b - a) * part as f64 / parts as f64 };
                self.advance(self.station(end), chord_error_mm, 0);
            }
        }
    }

    fn station(&self, t: f64) -> Station {
        let [p, velocity, _] = self.lift(t);
        Station { t, point: Point3::from(p), speed: velocity.norm(), s: 0.0 }
    }

    /// Adds stations from the last one up to `b`, halving while the chord is too coarse.
    fn advance(&mut self, b: Station, chord_error_mm: f64, halvings: usize) {
        let a = self.stations[self.stations.len() - 1];
        let m = self.station(0.5 * (a.t + b.t));
        let (first, second, chord) = (m.point - a.point, b.point - m.point, b.point - a.point);
        let length = chord.norm();
        let bow = if length > 0.0 { first.cross(&chord).norm() / length } else { first.norm() };
        let coarse = bow > chord_error_mm || length > LONGEST_CHORD_MM || first.angle(&second) > CHORD_TURN;
        if coarse && halvings < MOST_HALVINGS && length > COLLAPSED_MM {
            self.advance(m, chord_error_mm, halvings + 1);
            self.advance(b, chord_error_mm, halvings + 1);
            return;
        }
        self.sagitta_mm = self.sagitta_mm.max(bow);
        // Simpson's rule.
        let s = a.s + (b.t - a.t) * (a.speed + 4.0 * m.speed + b.speed) / 6.0;
        self.stations.push(Station { s, ..b });
    }

    fn face_is_left(&self, domain: &Domain) -> bool {
        let (t0, t1) = self.ends();
        let ((u0, u1), (v0, v1)) = self.surface.domain();
        let [c, d, _] = self.pcurve.derivatives(0.5 * (t0 + t1));
        let (wide, high) = (u1 - u0, v1 - v0);
        let (du, dv) = (d.x / wide, d.y / high);
        let step = 1e-5 / du.hypot(dv).max(f64::MIN_POSITIVE);
        domain.contains(c.x - dv * step * wide, c.y + du * step * high)
    }
}

/// Arc length at share `x` of the parameter between two stations: cubic Hermite, so that the lengths of
/// parts add up to that of the whole.
fn arc_length_between(a: &Station, b: &Station, x: f64) -> f64 {
    let (h, rise) = (b.t - a.t, b.s - a.s);
    let (va, vb) = (a.speed * h, b.speed * h);
    a.s + x * (va + x * (3.0 * rise - 2.0 * va - vb + x * (va + vb - 2.0 * rise)))
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::{Face, KnotVector, Source, SurfaceKind};

    use super::*;

    /// A closed band with corners of its net at the thirds of its parameter, which are its knots too.
    fn band(length: f64) -> Model {
        let at = |k: usize| length * k as f64 / 3.0;
        let knots_u =
            KnotVector::new(2, vec![0.0, 0.0, 0.0, at(1), at(1), at(2), at(2), length, length, length]);
        let ring = [[1.0, 0.0], [1.0, 2.0], [-1.0, 1.0], [-3.0, 0.0], [-1.0, -1.0], [1.0, -2.0], [1.0, 0.0]];
        let net = ring.iter().flat_map(|[x, y]| [0.0, 5.0].map(|z| Point3::new(10.0 * x, 10.0 * y, z)));
        let surface =
            NurbsSurface::new(knots_u.unwrap(), KnotVector::clamped_uniform(1, 2), net.collect(), None);
        let surface = surface.unwrap();
        let (loops, source) = (Vec::new(), Source::default());
        let face = Face { surface, loops, reversed: false, kind: SurfaceKind::Nurbs, source };
        Model { faces: vec![face], ..Model::default() }
    }

    #[test]
    fn stations_advance_where_an_edge_is_cut_at_its_knots() {
        for k in 1..2000 {
            // The first is that of a bottle's neck.
            let model = band(if k == 1 { 346.166_420_233_771_3 } else { 0.173 * f64::from(k) });
            for edge in edges(&model, 0.1) {
                assert!(edge.stations.windows(2).all(|w| w[0].t < w[1].t && w[0].s < w[1].s), "{edge:?}");
                let (t0, t1) = edge.ends();
                let both = [t0, t1].map(|t| edge.arc_length(t));
                assert!(both[0] == 0.0 && (both[1] - edge.length_mm()).abs() < 1e-9, "{both:?}");
            }
        }
    }
}
