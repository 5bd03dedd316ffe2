//! Whether an end gets to where it stands, coming from above: over what it does not cut in its middle it has to move.
//!
//! ```text
//!      ╭───╮ ╭─────────╮      An end with a dead centre of diameter d leaves a core below itself, unless it moves by d or more at
//!      │ ● │ │ ●─────● │      the height where it stands. In a round hole that is hardly wider than the end it cannot.
//!      ╰───╯ ╰────d────╯
//! ```

use std::collections::{BTreeSet, VecDeque};

use claymill_nurbs::Point3;

/// Straight ways that are tried, and places on each.
const WAYS: u32 = 16;
const PLACES: u32 = 8;
/// Where none of them is free, all around is searched in steps of this, in dead centres, up to so many places.
const FINE: f64 = 1.0 / 48.0;
const MOST_PLACES: usize = 4_000;
/// Steps to the eight places around one.
const AROUND: [[i32; 2]; 8] = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]];

/// Whether an end gets to a place of its tip at which it is free, in a frame whose `z` is the axis. `is_free` tells it of other places
/// at the same height.
pub(crate) fn gets_in(tip: &Point3, dead_centre_mm: f64, is_free: &dyn Fn(&Point3) -> bool) -> bool {
    let is_clear = |way| is_straight_clear(tip, dead_centre_mm, way, is_free);
    dead_centre_mm <= 0.0 || (0..WAYS).any(is_clear) || has_room(tip, dead_centre_mm, is_free)
}

/// Whether the end may move straight, forth and back, by its dead centre in all.
fn is_straight_clear(tip: &Point3, dead_centre_mm: f64, way: u32, is_free: &dyn Fn(&Point3) -> bool) -> bool {
    let (sine, cosine) = (std::f64::consts::PI * f64::from(way) / f64::from(WAYS)).sin_cos();
    let free = |step_mm: f64| {
        let at = |k: u32| step_mm * f64::from(k);
        let is_free = |k: &u32| is_free(&Point3::new(tip.x + at(*k) * cosine, tip.y + at(*k) * sine, tip.z));
        (1..=PLACES).take_while(is_free).count() as u32
    };
    let step_mm = dead_centre_mm / f64::from(PLACES);
    let forth = free(step_mm);
    forth >= PLACES || forth + free(-step_mm) >= PLACES
}

/// Whether what is free about a place is as wide as the dead centre. Where that takes too long to tell it is.
fn has_room(tip: &Point3, dead_centre_mm: f64, is_free: &dyn Fn(&Point3) -> bool) -> bool {
    let step_mm = FINE * dead_centre_mm;
    let at =
        |[i, j]: [i32; 2]| Point3::new(tip.x + step_mm * f64::from(i), tip.y + step_mm * f64::from(j), tip.z);
    let mut seen = BTreeSet::from([[0, 0]]);
    let mut open = VecDeque::from([[0, 0]]);
    let (mut low, mut high) = ([0, 0], [0, 0]);
    while let Some(cell) = open.pop_front() {
        for k in 0..2 {
            (low[k], high[k]) = (low[k].min(cell[k]), high[k].max(cell[k]));
        }
        let widest = (0..2).map(|k| high[k] - low[k]).max().unwrap_or(0);
        if f64::from(widest) * FINE >= 1.0 || seen.len() > MOST_PLACES {
            return true;
        }
        for next in AROUND.map(|[i, j]| [cell[0] + i, cell[1] + j]) {
            if seen.insert(next) && is_free(&at(next)) {
                open.push_back(next);
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_hole_has_to_be_as_wide_as_the_dead_centre() {
        for (room_mm, wanted) in [(1.0, false), (1.9, false), (2.1, true), (30.0, true)] {
            let is_free = |p: &Point3| p.x.hypot(p.y) <= room_mm;
            assert_eq!(gets_in(&Point3::new(0.3, 0.2, 5.0), 4.0, &is_free), wanted, "{room_mm}");
        }
        let nowhere = |_: &Point3| false;
        assert!(gets_in(&Point3::origin(), 0.0, &nowhere), "it may plunge");
        assert!(!gets_in(&Point3::origin(), 1.0, &nowhere));
    }

    #[test]
    fn a_slot_has_to_be_as_long_also_where_it_is_bent() {
        // Along a quarter of a circle of radius 6.
        let bent = |p: &Point3| (p.x.hypot(p.y) - 6.0).abs() < 0.2 && p.x > -0.1 && p.y > -0.1;
        assert!(gets_in(&Point3::new(6.0, 0.0, 0.0), 5.0, &bent));
        assert!(!gets_in(&Point3::new(6.0, 0.0, 0.0), 7.0, &bent));
    }
}
