//! Moves as chords: parameters between which the tip keeps within a stated distance of a straight
//! way and the axis within a stated angle of a fixed one.
//!
//! Curves are cut into Bézier pieces. Of a polynomial one the second differences of the control points bound the second
//! derivative, so `n` equal parts keep within `max|c''|/(8 n²)` of their chords. A rational one is halved until its
//! control points do.

use claymill_nurbs::{Curve3, Point3, Vector3};
use claymill_toolpath::Move;

use super::error::{StockError, placed};

/// A straight stretch of a move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chord {
    /// Parameters of the move at both ends.
    pub(super) parameters: [f64; 2],
    /// Tips at both ends.
    pub(super) tips: [Point3; 2],
    /// Unit axes at both ends.
    pub(super) axes: [Vector3; 2],
}

/// A move as chords.
#[derive(Debug, Clone)]
pub(super) struct Flat {
    pub(super) chords: Vec<Chord>,
    /// Bound on the distance of the tip from its chord, mm; 0 of straight moves.
    pub(super) sag_mm: f64,
    /// Bound on the turn of the axis within a chord, rad; 0 where it does not turn.
    pub(super) turn: f64,
    /// Whether its curve has weights: then nothing is known of where on a chord a parameter is.
    pub(super) is_rational: bool,
}

/// An axis turns no farther than this within a move, degrees.
const FARTHEST_TURN_DEG: f64 = 120.0;
/// Axes that differ by less are one direction, rad.
const SAME_AXIS: f64 = 1e-12;
/// A move has no more chords than this by its turn, and no Bézier piece more by its bend.
const MOST_CHORDS: f64 = 65_536.0;
/// Rational pieces are halved so often at most.
const MOST_HALVINGS: u32 = 16;

/// Flattens a move within `sag_mm`; the axis turns by no more than `turn` within a chord, as far as the bound on chords allows.
pub(super) fn flatten(m: &Move, sag_mm: f64, turn: f64) -> Result<Flat, StockError> {
    let curve = m.curve()?;
    for p in curve.points() {
        placed("coordinate of a move, mm,", p.coords.as_slice())?;
    }
    let unit = |a: [f64; 3]| Vector3::from(a).normalize();
    let ends = [unit(m.axis_start), unit(m.axis_end)];
    let whole_turn = ends[0].angle(&ends[1]);
    let whole_turn = if whole_turn > SAME_AXIS { whole_turn } else { 0.0 };
    if whole_turn > FARTHEST_TURN_DEG.to_radians() {
        let turn_deg = whole_turn.to_degrees();
        return Err(StockError::Turn { seq: m.seq, turn_deg, limit_deg: FARTHEST_TURN_DEG });
    }
    let mut parameters = Vec::new();
    let mut is_bent = false;
    for piece in curve.bezier_pieces() {
        let found = cut(&piece, sag_mm);
        is_bent |= bend(&piece) > 0.0;
        parameters.extend_from_slice(if parameters.is_empty() { &found } else { &found[1..] });
    }
    let (first, last) = curve.domain();
    let mut turned = 0.0;
    if whole_turn > 0.0 {
        // By the parameter the blend turns fastest in its middle: there the blended vector is shortest.
        let fastest = (2.0 * (0.5 * whole_turn).tan()).max(whole_turn);
        let count = (fastest / turn).ceil().clamp(1.0, MOST_CHORDS);
        turned = fastest / count;
        parameters.extend((1..count as usize).map(|k| first + (last - first) * k as f64 / count));
        parameters.sort_unstable_by(f64::total_cmp);
        parameters.dedup();
    }
    let axis = |t: f64| {
        if whole_turn == 0.0 {
            return ends[0];
        }
        (ends[0] + (ends[1] - ends[0]) * ((t - first) / (last - first))).normalize()
    };
    let stations: Vec<(f64, Point3)> = parameters.iter().map(|&t| (t, curve.point(t))).collect();
    let chord = |w: &[(f64, Point3)]| Chord {
        parameters: [w[0].0, w[1].0],
        tips: [w[0].1, w[1].1],
        axes: [axis(w[0].0), axis(w[1].0)],
    };
    let chords = stations.windows(2).map(chord).collect();
    Ok(Flat {
        chords,
        sag_mm: if is_bent { sag_mm } else { 0.0 },
        turn: turned,
        is_rational: m.weights.is_some(),
    })
}

/// Twice the bound of how far a Bézier piece leaves a straight, evenly parametrised way: 0 of a straight one.
fn bend(piece: &Curve3) -> f64 {
    if piece.weights().is_some() {
        return off_chord(piece.points());
    }
    let p = piece.points();
    let size = p.iter().map(|q| q.coords.amax()).fold(1.0, f64::max);
    let largest = p.windows(3).map(|w| (w[0] - w[1] + (w[2] - w[1])).norm()).fold(0.0, f64::max);
    let degree = (p.len() - 1) as f64;
    // What rounding leaves of a straight one is none.
    let bend = degree * (degree - 1.0) * largest;
    if bend < 1e-12 * size { 0.0 } else { bend }
}

/// The parameters that cut a Bézier piece into chords, its ends included.
fn cut(piece: &Curve3, sag_mm: f64) -> Vec<f64> {
    let (first, last) = piece.domain();
    if let Some(weights) = piece.weights() {
        let net = piece.points().iter().zip(weights).map(|(p, &w)| (p.coords * w, w)).collect();
        let mut found = vec![first];
        halve(net, [first, last], sag_mm, MOST_HALVINGS, &mut found);
        return found;
    }
    let count = (bend(piece) / (8.0 * sag_mm)).sqrt().ceil().clamp(1.0, MOST_CHORDS) as usize;
    let inner = (1..count).map(|k| first + (last - first) * k as f64 / count as f64);
    std::iter::once(first).chain(inner).chain([last]).collect()
}

/// Halves a rational piece until its control points are near its chord (de Casteljau on weighted points); adds the ends.
fn halve(net: Vec<(Vector3, f64)>, [from, to]: [f64; 2], sag_mm: f64, left: u32, found: &mut Vec<f64>) {
    let points: Vec<Point3> = net.iter().map(|(p, w)| Point3::from(p / *w)).collect();
    if left == 0 || off_chord(&points) <= sag_mm {
        found.push(to);
        return;
    }
    let (mut row, mut before, mut behind) = (net, Vec::new(), Vec::new());
    while let (Some(&a), Some(&b)) = (row.first(), row.last()) {
        before.push(a);
        behind.push(b);
        row = row.windows(2).map(|w| (0.5 * (w[0].0 + w[1].0), 0.5 * (w[0].1 + w[1].1))).collect();
    }
    behind.reverse();
    let middle = 0.5 * (from + to);
    halve(before, [from, middle], sag_mm, left - 1, found);
    halve(behind, [middle, to], sag_mm, left - 1, found);
}

/// The largest distance of control points from the chord between first and last.
fn off_chord(points: &[Point3]) -> f64 {
    let (Some(a), Some(b)) = (points.first(), points.last()) else { return 0.0 };
    let way = b - a;
    let square = way.norm_squared().max(f64::MIN_POSITIVE);
    let off = |p: &Point3| (p - a - way * ((p - a).dot(&way) / square).clamp(0.0, 1.0)).norm();
    points.iter().map(off).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use claymill_nurbs::KnotVector;
    use claymill_toolpath::MoveKind;

    use super::*;

    /// Every place of a bent move is within the sag of a chord; a straight one is one chord.
    #[test]
    fn chords_keep_within_their_sag() {
        let knots = KnotVector::new(3, vec![0.0, 0.0, 0.0, 0.0, 30.0, 60.0, 60.0, 60.0, 60.0]).unwrap();
        let points =
            [[0.0, 0.0, 0.0], [10.0, 20.0, 3.0], [30.0, -20.0, 5.0], [50.0, 10.0, 1.0], [60.0, 0.0, 0.0]];
        let weights = [None, Some(vec![1.0, 2.0, 0.5, 1.0, 1.0])];
        for weights in weights {
            let curve = Curve3::new(knots.clone(), points.map(Point3::from).to_vec(), weights).unwrap();
            let m = Move::along(MoveKind::Cut, &curve, Vector3::z(), 1000.0);
            let flat = flatten(&m, 0.01, 0.1).unwrap();
            assert!(flat.sag_mm == 0.01 && flat.chords.len() > 10, "{}", flat.chords.len());
            for c in &flat.chords {
                for k in 0..=10 {
                    let t = c.parameters[0] + (c.parameters[1] - c.parameters[0]) * f64::from(k) / 10.0;
                    let off = off_chord(&[c.tips[0], curve.point(t), c.tips[1]]);
                    assert!(off <= 0.01 + 1e-12, "{off}");
                }
            }
        }
        let m =
            Move::straight(MoveKind::Cut, Point3::origin(), Point3::new(9.0, 1.0, 2.0), Vector3::z(), 1.0);
        let flat = flatten(&m, 0.01, 0.1).unwrap();
        assert!(flat.chords.len() == 1 && flat.sag_mm == 0.0 && flat.turn == 0.0);
        let turned = Move { axis_end: [0.6, 0.0, 0.8], ..m.clone() };
        let flat = flatten(&turned, 0.01, 0.01).unwrap();
        assert!(flat.chords.iter().all(|c| c.axes[0].angle(&c.axes[1]) <= flat.turn && flat.turn <= 0.01));
        let over = Move { axis_end: [0.0, 0.0, -1.0], ..m };
        assert!(matches!(flatten(&over, 0.01, 0.01), Err(StockError::Turn { .. })));
    }
}
