//! The tool's way through the job, for the slider of the report: few points, true to the time.

use claymill_nurbs::{Point3, Vector3};
use claymill_toolpath::Program;
use serde_json::{Value, json};

use crate::strokes::flatten;

/// Points that browsers get at most, about.
const MOST_POINTS: usize = 60_000;
/// The finest distance of the tip from where it is at that time, mm.
const FINEST_MM: f64 = 0.5;
/// Points that one may stand for: bounds the work of testing them again.
const LONGEST_RUN: usize = 400;
const CHORD_MM: f64 = 0.2;

/// The tip at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Station {
    at_s: f64,
    tip: Point3,
}

/// Where the tip is at any time of a job, and the setups with the time at which each begins.
pub(crate) struct Way {
    /// Time in s and the tip in model coordinates, mm: four little-endian numbers of 32 bits a point.
    pub(crate) bytes: Vec<u8>,
    /// `[first second, name, axis]` of every setup, and the whole time.
    pub(crate) facts: Value,
}

/// From the moves and the seconds that each takes.
pub(crate) fn way(program: &Program, seconds: &[f64]) -> Way {
    let mut setups: Vec<(f64, &str, [f64; 3])> = Vec::new();
    let mut parts: Vec<Vec<Station>> = Vec::new();
    let mut now_s = 0.0;
    for (m, took_s) in program.moves.iter().zip(seconds) {
        if setups.last().is_none_or(|s| s.1 != m.setup) {
            setups.push((now_s, &m.setup, m.axis_start));
            parts.push(Vec::new());
        }
        if let (Ok(curve), Some(part)) = (m.curve(), parts.last_mut()) {
            add(part, &flatten(&curve, CHORD_MM), now_s, *took_s);
        }
        now_s += took_s;
    }
    let mut tolerance_mm = FINEST_MM;
    loop {
        let kept: Vec<Station> = parts.iter().flat_map(|p| thinned(p, tolerance_mm)).collect();
        if kept.len() <= MOST_POINTS.max(2 * program.moves.len()) || tolerance_mm > 100.0 {
            let numbers = kept.iter().flat_map(|s| [s.at_s, s.tip.x, s.tip.y, s.tip.z]);
            let bytes = numbers.flat_map(|v| (v as f32).to_le_bytes()).collect();
            return Way { bytes, facts: json!({ "duration_s": now_s, "setups": setups }) };
        }
        tolerance_mm *= 2.0;
    }
}

/// Within a move the time goes with the length.
fn add(part: &mut Vec<Station>, points: &[Point3], from_s: f64, took_s: f64) {
    let whole_mm: f64 = points.windows(2).map(|ab| (ab[1] - ab[0]).norm()).sum();
    let mut gone_mm = 0.0;
    for (i, &tip) in points.iter().enumerate() {
        gone_mm += i.checked_sub(1).map_or(0.0, |b| (tip - points[b]).norm());
        let share = if whole_mm > 0.0 { gone_mm / whole_mm } else { 1.0 };
        part.push(Station { at_s: from_s + share * took_s, tip });
    }
}

/// Without stations whose tip is where the straight way between its neighbours has it at that time.
fn thinned(part: &[Station], tolerance_mm: f64) -> Vec<Station> {
    let mut kept = Vec::new();
    let mut anchor = 0;
    while anchor < part.len() {
        kept.push(part[anchor]);
        let mut next = anchor + 1;
        while next + 1 < part.len() && next - anchor < LONGEST_RUN {
            let (a, c) = (part[anchor], part[next + 1]);
            let way: Vector3 = c.tip - a.tip;
            let took_s = (c.at_s - a.at_s).max(1e-9);
            let near =
                |b: &Station| (a.tip + way * ((b.at_s - a.at_s) / took_s) - b.tip).norm() <= tolerance_mm;
            if !part[anchor + 1..=next].iter().all(near) {
                break;
            }
            next += 1;
        }
        anchor = next;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use claymill_toolpath::{Move, MoveKind};

    #[test]
    fn the_tip_is_where_the_moves_have_it_at_every_time() {
        let step = |setup: &str, from: [f64; 3], to: [f64; 3]| Move {
            setup: setup.into(),
            ..Move::straight(MoveKind::Cut, from.into(), to.into(), Vector3::z(), 600.0)
        };
        // Ten seconds straight on in two moves, then slowly aside, then another setup far away.
        let moves = vec![
            step("top", [0., 0., 0.], [50., 0., 0.]),
            step("top", [50., 0., 0.], [100., 0., 0.]),
            step("top", [100., 0., 0.], [100., 3., 0.]),
            step("left", [0., 900., 0.], [10., 900., 0.]),
        ];
        let way = way(&Program { moves }, &[5.0, 5.0, 6.0, 2.0]);
        let numbers: Vec<f32> =
            way.bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let points: Vec<&[f32]> = numbers.chunks_exact(4).collect();
        assert_eq!(way.facts["duration_s"], 18.0);
        assert_eq!(way.facts["setups"], json!([[0.0, "top", [0., 0., 1.]], [16.0, "left", [0., 0., 1.]]]));
        // Two moves at one speed need no point between them; a change of setup keeps both sides.
        let times: Vec<f32> = points.iter().map(|p| p[0]).collect();
        assert!(points.len() <= 7 && times.is_sorted(), "{points:?}");
        let at = |s: f32| {
            let after = times.partition_point(|t| *t < s).max(1);
            let (a, b) = (points[after - 1], points[after]);
            let share = (s - a[0]) / (b[0] - a[0]).max(1e-6);
            [1, 2, 3].map(|k| a[k] + share * (b[k] - a[k]))
        };
        for (s, place) in
            [(2.5, [25., 0., 0.]), (7.5, [75., 0., 0.]), (13.0, [100., 1.5, 0.]), (17.0, [5., 900., 0.])]
        {
            let found = at(s);
            assert!((0..3).all(|k| (found[k] - place[k]).abs() < 0.6), "{s} s: {found:?}");
        }
    }
}
