//! Sets without holes, grown or shrunk by a disc.
//!
//! ```text
//!         ╭──────────╮      Every edge is moved along its normal, and every corner becomes an arc about it, backwards where the
//!       ╭─┤          ├─╮    corner is hollow. How often this curve runs around a point is the Euler characteristic of
//!       │ │   set    │ │    what the disc about the point has of the set: its pieces less its holes. A set without holes
//!       ╰─┤     ╭────┼─╯    has none, so the curve runs around exactly the points that the disc of the set reaches.
//!         ╰─────╯    │
//! ```
//!
//! To shrink a set, its complement grows. That has a hole in a disc only if the whole set is in the disc; but then the set holds no
//! such disc, and nothing is left.

use std::f64::consts::{PI, TAU};

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::single::SingleIntOverlay;
use i_overlay::i_float::int::point::IntPoint;

use crate::planar_set::{Contour, STEPS_PER_MM, chord_angle};

/// Hollow corners that turn by less are parts of arcs, radians.
const SMOOTH: f64 = 0.3;
/// Edges that bulge by less between two of them are left out, steps of the grid: twice the height of chords.
const SKIPPED_STEPS: f64 = 220.0;

/// What is within a distance of a set with an anticlockwise outline; further inside than it if it is negative.
pub(crate) fn offset(outline: &Contour, mm: f64) -> Vec<Vec<Contour>> {
    if mm < 0.0 && least_width(outline) <= -2.0 * mm * STEPS_PER_MM {
        return Vec::new();
    }
    let raw = raw(outline, mm);
    let nothing: Contour = Vec::new();
    raw.overlay(&nothing, OverlayRule::Subject, FillRule::Positive)
}

/// The shorter side of the box of an outline, steps of the grid.
fn least_width(outline: &Contour) -> f64 {
    let side = |of: fn(&IntPoint<i32>) -> i32| {
        let (low, high) = outline.iter().map(of).fold((i32::MAX, i32::MIN), |(l, h), c| (l.min(c), h.max(c)));
        f64::from(high) - f64::from(low)
    };
    side(|p| p.x).min(side(|p| p.y))
}

/// The curve at a distance to the right of an outline, with all its loops.
fn raw(outline: &Contour, mm: f64) -> Contour {
    let (far, chord) = (mm * STEPS_PER_MM, chord_angle(mm.abs()));
    let mut curve = Contour::with_capacity(3 * outline.len());
    let edges: Vec<(IntPoint<i32>, IntPoint<i32>, f64)> = outline
        .iter()
        .zip(outline.iter().cycle().skip(1))
        .filter(|(a, b)| a != b)
        .map(|(&a, &b)| (a, b, (f64::from(a.x) - f64::from(b.x)).atan2(f64::from(b.y) - f64::from(a.y))))
        .collect();
    let mut push = |p: IntPoint<i32>, angle: f64, far: f64| {
        let (sine, cosine) = angle.sin_cos();
        let moved = IntPoint::new(
            (f64::from(p.x) + far * cosine).round() as i32,
            (f64::from(p.y) + far * sine).round() as i32,
        );
        if curve.last() != Some(&moved) {
            curve.push(moved);
        }
    };
    for (k, &(a, b, angle)) in edges.iter().enumerate() {
        let (_, after, next) = edges[(k + 1) % edges.len()];
        // From one normal to the next, the shorter way.
        let turn = (next - angle + PI).rem_euclid(TAU) - PI;
        let turn = if turn <= -PI { -turn } else { turn };
        if turn * far < 0.0 && turn.abs() < SMOOTH {
            // Moved edges meet in a corner, if they are long enough. Shorter ones are turned around, which would be a zigzag
            // about every corner of a hollow arc: there one point does.
            let cut = (far * (0.5 * turn).tan()).abs();
            let are_long = [(a, b), (b, after)].map(|(p, q)| length(p, q) >= 2.0 * cut);
            if are_long == [true, true] {
                push(b, angle + 0.5 * turn, far / (0.5 * turn).cos());
                continue;
            }
            let counts = [(a, b), (b, after)].map(|(p, q)| 0.25 * length(p, q) * turn.abs() > SKIPPED_STEPS);
            if counts[0] {
                push(b, angle, far);
            }
            push(b, angle + 0.5 * turn, far);
            if counts[1] {
                push(b, next, far);
            }
            continue;
        }
        let steps = (turn.abs() / chord).ceil().max(1.0) as usize;
        for i in 0..=steps {
            push(b, angle + turn * i as f64 / steps as f64, far);
        }
    }
    curve
}

fn length(a: IntPoint<i32>, b: IntPoint<i32>) -> f64 {
    (f64::from(a.x) - f64::from(b.x)).hypot(f64::from(a.y) - f64::from(b.y))
}

#[cfg(test)]
mod tests {
    use crate::outline::Outline;
    use crate::planar_set::PlanarSet;

    /// Blobs of discs with holes, cut from each other: the sets that rounds are made of.
    fn blobs(seed: u64) -> PlanarSet {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        };
        let mut set = PlanarSet::rectangle([-30.0, -30.0, 30.0, 30.0]);
        for k in 0..14 {
            let disc =
                PlanarSet::disc([60.0 * random() - 30.0, 60.0 * random() - 30.0], 1.0 + 12.0 * random());
            set = if k % 3 == 2 { set.union(&disc) } else { set.minus(&disc) };
        }
        set.simplified()
    }

    #[test]
    fn grown_and_shrunk_sets_agree_with_distances() {
        let mut looked_at = 0;
        for seed in 0..12 {
            let set = blobs(seed);
            let outline = Outline::new(&set);
            for mm in [0.05, 0.4, 1.7, 5.0, 13.0, 31.0] {
                let (grown, shrunk) = (Outline::new(&set.dilated(mm)), Outline::new(&set.eroded(mm)));
                for k in 0..1500 {
                    let p = [
                        -50.0 + 100.0 * (f64::from(k) * 0.618_034).fract(),
                        -50.0 + 100.0 * (f64::from(k) * 0.754_878).fract(),
                    ];
                    let (inside, far) = (outline.contains(p), outline.distance(p, 60.0));
                    if (far - mm).abs() < 0.004 {
                        continue;
                    }
                    looked_at += 1;
                    assert_eq!(
                        grown.contains(p),
                        inside || far < mm,
                        "seed {seed}, grown by {mm}: {p:?} at {far}"
                    );
                    assert_eq!(
                        shrunk.contains(p),
                        inside && far > mm,
                        "seed {seed}, shrunk by {mm}: {p:?} at {far}"
                    );
                }
            }
        }
        assert!(looked_at > 80_000);
    }
}
