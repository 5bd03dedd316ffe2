//! Lines and arcs through the vertices of a pass.
//!
//! Vertices lie on the arcs that the sets were made of, chords within a micrometre of them. So an arc through the vertices is nearer
//! to what was meant than the polygon, and it has no corners, each of which would raise the engagement.

use crate::outline::{Place, distance, distance_from_segment};

/// Vertices are this near to the line or arc that is put through them, mm.
const VERTEX_MM: f64 = 1.3e-3;
/// The middles of chords are this near to it on the inside, mm.
const CHORD_MM: f64 = 1.3e-3;
/// Flatter arcs are lines, mm.
const LARGEST_RADIUS_MM: f64 = 1e4;
/// An arc goes around by this much at most, radians: two arcs make a circle.
const LARGEST_SWEEP: f64 = 3.0;

/// A straight or circular piece of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathPiece {
    /// Where it starts, mm.
    pub from: [f64; 2],
    /// Where it ends, mm.
    pub to: [f64; 2],
    /// Of an arc its middle.
    pub arc: Option<ArcAbout>,
}

/// What an arc runs about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArcAbout {
    /// Its middle, mm.
    pub centre: [f64; 2],
    /// The angle from its start to its end, radians, anticlockwise if positive.
    pub sweep: f64,
}

impl PathPiece {
    /// A straight piece.
    #[must_use]
    pub fn line(from: [f64; 2], to: [f64; 2]) -> Self {
        PathPiece { from, to, arc: None }
    }

    /// An arc about a middle, anticlockwise.
    #[must_use]
    pub fn anticlockwise(from: [f64; 2], to: [f64; 2], centre: [f64; 2]) -> Self {
        let angle = |p: Place| (p[1] - centre[1]).atan2(p[0] - centre[0]);
        let sweep = (angle(to) - angle(from)).rem_euclid(std::f64::consts::TAU);
        PathPiece { from, to, arc: Some(ArcAbout { centre, sweep }) }
    }

    /// Its length, mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        match self.arc {
            Some(arc) => distance(self.from, arc.centre) * arc.sweep.abs(),
            None => distance(self.from, self.to),
        }
    }

    /// The point at a share of its length.
    #[must_use]
    pub fn at(&self, share: f64) -> [f64; 2] {
        let Some(arc) = self.arc else {
            return [0, 1].map(|k| self.from[k] + share * (self.to[k] - self.from[k]));
        };
        let (sine, cosine) = (share * arc.sweep).sin_cos();
        let d = [self.from[0] - arc.centre[0], self.from[1] - arc.centre[1]];
        [arc.centre[0] + cosine * d[0] - sine * d[1], arc.centre[1] + sine * d[0] + cosine * d[1]]
    }

    /// A full circle, anticlockwise, as two pieces.
    #[must_use]
    pub fn circle(centre: [f64; 2], radius_mm: f64) -> [Self; 2] {
        let [right, left] = [radius_mm, -radius_mm].map(|r| [centre[0] + r, centre[1]]);
        let sweep = std::f64::consts::PI;
        [(right, left), (left, right)].map(|(from, to)| PathPiece {
            from,
            to,
            arc: Some(ArcAbout { centre, sweep }),
        })
    }
}

/// Pieces through points, as few as the tolerances allow.
pub(crate) fn pieces(points: &[Place]) -> Vec<PathPiece> {
    let mut found = Vec::new();
    let mut from = 0;
    while from + 1 < points.len() {
        let mut best = (from + 1, PathPiece::line(points[from], points[from + 1]));
        // Longer and longer, then by halves.
        let (mut step, mut grows) = (1, true);
        while step > 0 {
            let to = best.0 + step;
            match (to < points.len()).then(|| piece(&points[from..=to])).flatten() {
                Some(piece) => {
                    best = (to, piece);
                    step = if grows { 2 * step } else { step / 2 };
                }
                None => {
                    grows = false;
                    step /= 2;
                }
            }
        }
        found.push(best.1);
        from = best.0;
    }
    found
}

/// One piece through all points.
fn piece(points: &[Place]) -> Option<PathPiece> {
    let (from, to) = (points[0], points[points.len() - 1]);
    if points.iter().all(|&p| distance_from_segment(p, from, to) <= VERTEX_MM) {
        let is_forward = points.windows(2).all(|w| {
            (w[1][0] - w[0][0]) * (to[0] - from[0]) + (w[1][1] - w[0][1]) * (to[1] - from[1]) >= 0.0
        });
        if is_forward {
            return Some(PathPiece::line(from, to));
        }
    }
    if points.len() < 3 {
        return None;
    }
    let centre = centre_of(from, points[points.len() / 2], to)?;
    let radius = distance(centre, from);
    let mut sweep = 0.0;
    for w in points.windows(2) {
        let middle = [0.5 * (w[0][0] + w[1][0]), 0.5 * (w[0][1] + w[1][1])];
        let sag = radius - distance(centre, middle);
        if (distance(centre, w[1]) - radius).abs() > VERTEX_MM || !(-VERTEX_MM..=CHORD_MM).contains(&sag) {
            return None;
        }
        let [a, b] = [w[0], w[1]].map(|p| [p[0] - centre[0], p[1] - centre[1]]);
        let step = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
        if step * sweep < 0.0 {
            return None;
        }
        sweep += step;
    }
    (sweep.abs() <= LARGEST_SWEEP).then_some(PathPiece { from, to, arc: Some(ArcAbout { centre, sweep }) })
}

/// The middle of the circle through three points.
fn centre_of(a: Place, b: Place, c: Place) -> Option<Place> {
    let [b, c] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1]]);
    let d = 2.0 * (b[0] * c[1] - b[1] * c[0]);
    let (b2, c2) = (b[0] * b[0] + b[1] * b[1], c[0] * c[0] + c[1] * c[1]);
    let centre = [(c[1] * b2 - b[1] * c2) / d, (b[0] * c2 - c[0] * b2) / d];
    (centre[0].hypot(centre[1]) < LARGEST_RADIUS_MM).then(|| [a[0] + centre[0], a[1] + centre[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar_set::PlanarSet;

    #[test]
    fn a_rounded_square_is_four_lines_and_four_arcs() {
        let set = PlanarSet::rectangle([0.0, 0.0, 20.0, 10.0]).eroded(3.0).dilated(3.0);
        let mut contour = set.contours().remove(0);
        contour.push(contour[0]);
        let found = pieces(&contour);
        assert!(found.len() <= 10, "{found:?}");
        let length: f64 = found.iter().map(PathPiece::length_mm).sum();
        let wanted = 60.0 - 8.0 * 3.0 + std::f64::consts::TAU * 3.0;
        assert!((length - wanted).abs() < 0.02, "{length} {wanted}");
        for w in found.windows(2) {
            assert_eq!(w[0].to, w[1].from);
        }
    }

    #[test]
    fn arcs_end_where_they_say() {
        let arc = PathPiece::anticlockwise([1.0, 0.0], [0.0, -1.0], [0.0, 0.0]);
        assert!(distance(arc.at(1.0), arc.to) < 1e-12);
        assert!((arc.length_mm() - 1.5 * std::f64::consts::PI).abs() < 1e-12);
    }
}
