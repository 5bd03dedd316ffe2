//! Passes begin where nothing is left to cut: the tool comes straight down there.

use claymill_clearing::{Approach, Area, EngagementLimit, Entry, PathPiece, PlanarSet, Stroke, clear};

const RADIUS_MM: f64 = 3.0;
/// The tool may graze by this, mm.
const GRAZE_MM: f64 = 0.01;

/// What the tool would plunge into at the starts of strokes, mm².
fn plunged_mm2(strokes: &[Stroke], stock: &PlanarSet) -> f64 {
    let mut uncut = stock.clone();
    let mut worst = 0.0_f64;
    for stroke in strokes {
        let ways: Vec<&PathPiece> = stroke.lead_in.iter().chain(&stroke.cut).collect();
        let Some((first, last)) = ways.first().zip(ways.last()) else { continue };
        // A ring without a circle that leads into it is entered by a ramp along itself.
        let is_ramped =
            stroke.lead_in.is_empty() && (0..2).all(|k| (first.from[k] - last.to[k]).abs() < 1e-3);
        if stroke.approach == Approach::Over && !is_ramped {
            let below = PlanarSet::disc(first.from, RADIUS_MM - GRAZE_MM).intersection(&uncut);
            worst = worst.max(below.area_mm2());
        }
        for piece in ways {
            let steps = (piece.length_mm() / 0.2).ceil();
            for k in 0..=steps as u32 {
                uncut = uncut.minus(&PlanarSet::disc(piece.at(f64::from(k) / steps), RADIUS_MM));
            }
        }
    }
    worst
}

/// A helix as wide as the pocket touches its walls: what is cut next runs along them between the places where it does.
#[test]
fn nothing_is_below_the_start_of_a_pass() {
    for length_mm in [10.0, 10.3, 18.0, 30.0] {
        let pocket = PlanarSet::rectangle([0.0, -5.0, length_mm, 5.0]);
        let feasible = pocket.eroded(RADIUS_MM);
        let limit = EngagementLimit::new(RADIUS_MM, 45.0).expect("a limit");
        let entry = Entry { helix_mm: RADIUS_MM, ..Entry::usual(RADIUS_MM) };
        let area = Area { feasible: &feasible, stock: &pocket, limit, entry };
        let cleared = clear(&area, &()).expect("a pocket");
        let plunged_mm2 = plunged_mm2(&cleared.strokes, &pocket);
        println!("{length_mm} mm: {plunged_mm2:.4} mm², {} strokes", cleared.strokes.len());
        assert!(plunged_mm2 < 0.01, "{length_mm}: {plunged_mm2}");
    }
}
