//! Which positions of two rotary axes bring the tool along a direction.

use claymill_nurbs::Vector3;
use claymill_toolpath::RotaryAxis;

/// A direction is met where its component along an axis agrees as well as this.
const SAME: f64 = 1e-9;

/// Whether one or two rotary axes come to a tool axis, given in the coordinates in which the part stands. Which of two axes
/// carries the other is not known: either order counts.
pub(crate) fn comes_to(axes: &[&RotaryAxis], tool: &Vector3) -> bool {
    match axes {
        [] => true,
        [only] => positions(&still(only), only, tool),
        [first, second, ..] => positions(first, second, tool) || positions(second, first, tool),
    }
}

/// An axis that does not move, beside a single one.
fn still(beside: &RotaryAxis) -> RotaryAxis {
    let [x, y, z] = beside.direction;
    RotaryAxis { travel_deg: [-1e-9, 1e-9], direction: [y, z, x], ..*beside }
}

/// Whether turning upright by `second`, then by `first` about where it stands, meets the direction. An axis that turns the
/// table turns the part the other way.
fn positions(first: &RotaryAxis, second: &RotaryAxis, tool: &Vector3) -> bool {
    let unit = |axis: &RotaryAxis| {
        Vector3::from(axis.direction).normalize() * if axis.turns_table { -1.0 } else { 1.0 }
    };
    let (one, two) = (unit(first), unit(second));
    // What `second` makes of upright must have the component along `one` that the tool has.
    let (along, across, side) = (two * two.z, Vector3::z() - two * two.z, two.cross(&Vector3::z()));
    let (a, b, c) = (one.dot(&across), one.dot(&side), one.dot(&(tool - along)));
    let size = a.hypot(b);
    if c.abs() > size + SAME {
        return false;
    }
    let middle = b.atan2(a);
    let spread = if size > SAME { (c / size).clamp(-1.0, 1.0).acos() } else { 0.0 };
    [middle + spread, middle - spread].into_iter().any(|angle| {
        let half = along + across * angle.cos() + side * angle.sin();
        let flat = |v: &Vector3| v - one * one.dot(v);
        let (from, to) = (flat(&half), flat(tool));
        let turn = one.dot(&from.cross(&to)).atan2(from.dot(&to));
        // Along its own axis any position of the first one will do.
        let first_fits = from.norm() < 1e-7 || travels(first, turn);
        first_fits && travels(second, angle)
    })
}

fn travels(axis: &RotaryAxis, radians: f64) -> bool {
    let [low, high] = axis.travel_deg;
    let deg = radians.to_degrees();
    // In whole turns up to where it travels; a hair beyond its end is its end.
    let turns = ((low - deg - 1e-6) / 360.0).ceil();
    deg + 360.0 * turns <= high + 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(direction: [f64; 3], travel_deg: [f64; 2]) -> RotaryAxis {
        RotaryAxis { travel_deg, direction, point_mm: [0.0; 3], turns_table: false, max_deg_per_min: None }
    }

    #[test]
    fn a_fork_head_comes_to_what_its_travel_allows() {
        let (a, c) = (axis([1.0, 0.0, 0.0], [-100.0, 100.0]), axis([0.0, 0.0, 1.0], [-200.0, 200.0]));
        let lean = |deg: f64, about: f64| {
            let (deg, about) = (deg.to_radians(), about.to_radians());
            Vector3::new(deg.sin() * about.cos(), deg.sin() * about.sin(), deg.cos())
        };
        for about in [0.0, 45.0, 170.0, 260.0] {
            for (deg, expected) in [(0.0, true), (45.0, true), (99.0, true), (101.0, false), (180.0, false)] {
                assert_eq!(comes_to(&[&a, &c], &lean(deg, about)), expected, "{deg} {about}");
            }
        }
        // Alone, the a axis leans across x only.
        assert!(comes_to(&[&a], &lean(60.0, 90.0)) && comes_to(&[&a], &lean(60.0, -90.0)));
        assert!(!comes_to(&[&a], &lean(60.0, 80.0)) && !comes_to(&[&a], &lean(120.0, 90.0)));
        assert!(comes_to(&[], &lean(120.0, 90.0)));
    }
}
