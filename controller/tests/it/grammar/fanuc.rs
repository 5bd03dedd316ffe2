use claymill_controller::Dialect;
use claymill_nurbs::Point3;

use super::{Fact, curve, fact, hold, with};

/// A cubic of one span whose first control point is the position.
const CUBIC: &str = "G05 P10000\n\
    G06.2 P4 K0. X0. Y0. Z0. R1. F5000.\n\
    K0. X10. Y10. Z0. R1.\n\
    K0. X20. Y11. Z0. R1.\n\
    K0. X30. Y0. Z0. R1.\n\
    K1.\nK1.\nK1.\nK1.\n\
    G05 P0";
/// Of order 2, with three spans.
const POLYGON: &str = "G05 P10000\n\
    G06.2 P2 K0. X0. Y0. Z0.\n\
    K0. X1. Y0. Z0.\n\
    K1. X2. Y1. Z0.\n\
    K2. X3. Y0. Z0.\n\
    K3.\nK3.\n\
    G05 P0";

/// What both manuals say (Fanuc 15i/150i-MA, pages 143 to 158; Mitsubishi M700V, pages 112 to 116).
fn shared() -> Vec<Fact> {
    let cubic = |from, to| with(CUBIC, from, to);
    vec![
        fact("P is the order: 2, 3 or 4")
            .right(CUBIC)
            .right(POLYGON)
            .refused(cubic("P4", "P5"), "nurbs-rank")
            .refused(cubic("P4", "P1"), "nurbs-rank")
            .refused(cubic("P4", "P3.5"), "nurbs-rank"),
        fact("without P the order is 4")
            .right(cubic("P4 ", ""))
            .refused(with(POLYGON, "P2 ", ""), "nurbs-ps1004"),
        fact("P stands in the first block only")
            .right(CUBIC)
            .refused(cubic("K0. X10.", "P4 K0. X10."), "nurbs-rank"),
        fact("R is 1 where it is left out, and positive")
            .right(CUBIC.replace(" R1.", ""))
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R0."), "nurbs-weight")
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R-1."), "nurbs-weight"),
        fact("there are as many knots as control points and P")
            .right(CUBIC)
            .refused(cubic("K1.\nG05", "G05"), "nurbs-ps1004")
            .refused(cubic("K1.\nK1.\nG05", "G05"), "nurbs-ps1004")
            .refused(cubic("K1.\nG05", "K1.\nK1.\nG05"), "no-arc"),
        fact("G28 leads to the reference point from where the tool is, in G91, which then ends")
            .right(format!("G91 G28 Z0.\nG90\nG0 Z0.\nG0 X0. Y0.\n{CUBIC}"))
            .refused(format!("{CUBIC}\nG91 G28 Z0.\nG90\nG1 X5. F100."), "position")
            .refused(format!("{CUBIC}\nG91 G28 Z0.\nG1 X5. F100."), "position")
            .refused(format!("{CUBIC}\nG91 G28 Z0.\nG0 X0. Y0. Z0.\nG1 X5. F100."), "incremental")
            .refused(format!("{CUBIC}\nG28 Z0."), "unknown-code"),
        fact("every block has a knot")
            .right(CUBIC)
            .refused(cubic("K0. X10.", "X10."), "nurbs-ps1002")
            .refused(cubic("P4 K0.", "P4"), "nurbs-ps1002"),
        fact("knots do not decrease")
            .right(POLYGON)
            .refused(with(POLYGON, "K2.", "K0.5"), "nurbs-p551")
            .refused(cubic("K1.", "K-1."), "nurbs-p551"),
        fact("the first P and the last P knots are equal")
            .right(CUBIC)
            .refused(CUBIC.replace("\nK0.", "\nK0.5"), "nurbs-ps1007")
            .refused(cubic("K1.\nG05", "K2.\nG05"), "nurbs-ps1007"),
        fact("an inner knot occurs P times at most")
            .right(with(POLYGON, "K2.", "K1."))
            .refused(with(POLYGON, "K2. X3.", "K1. X2.5 Y1. Z0.\nK1. X3."), "nurbs-ps1008"),
        fact("there are at least P control points").right(CUBIC).refused(
            "G05 P10000\nG06.2 K0. X0. Y0. Z0.\nK0. X1. Y0. Z0.\nK1.\nK1.\nK1.\nK1.",
            "nurbs-points",
        ),
        fact("a control point does not stand behind the knots at the end")
            .right(CUBIC)
            .refused(cubic("K1.\nK1.", "K1.\nK1. X40. Y0. Z0."), "nurbs-ps1004"),
        fact("the first control point is the current position")
            .right(CUBIC)
            .refused(cubic("X0. Y0.", "X0.002 Y0."), "nurbs-ps1009")
            .refused(format!("G0 Z5.\n{CUBIC}"), "nurbs-ps1009"),
        fact("the first block names all axes that move")
            .right(CUBIC.replace(" Z0.", ""))
            .refused(cubic("X0. Y0. Z0.", "X0. Y0."), "nurbs-axes")
            .refused(cubic("K0. X0. Y0. Z0.", "K0."), "nurbs-axes"),
        fact("nothing but knots, points and weights stands within")
            .right(CUBIC)
            .refused(cubic("X10. Y10. Z0. R1.", "X10. Y10. Z0. M8"), "nurbs-ps1005")
            .refused(cubic("X10. Y10. Z0. R1.", "X10. Y10. Z0. S500"), "nurbs-ps1005")
            .refused(cubic("X10. Y10. Z0. R1.", "X10. Y10. Z0. T2"), "nurbs-ps1005")
            .refused(cubic("K0. X10.", "G1 K0. X10."), "nurbs-ps1005")
            .refused(cubic("K0. X10.", "G43 H1 K0. X10."), "nurbs-ps1005")
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R1. F600."), "nurbs-ps1005"),
        fact("it is not left before the last knot")
            .right(CUBIC)
            .refused(cubic("K0. X20.", "G1 X15. Y15.\nK0. X20."), "nurbs-ps1004")
            .refused(cubic("K1.\nK1.\nG05", "G1 X40.\nG05"), "nurbs-ps1004"),
        fact("radius compensation is off")
            .right(format!("G40\n{CUBIC}"))
            .refused(format!("G41 D1\n{CUBIC}"), "radius-compensation")
            .refused(format!("G42 D1\n{CUBIC}"), "radius-compensation"),
        fact("the feed is a minute's: not G93, not G95")
            .right(format!("G94\n{CUBIC}"))
            .refused(format!("G93\n{CUBIC}"), "feed-mode")
            .refused(format!("G95\n{CUBIC}"), "feed-mode"),
        fact("polar coordinates are off")
            .right(format!("G13.1 G15\n{CUBIC}"))
            .refused(format!("G12.1\n{CUBIC}"), "polar")
            .refused(format!("G16\n{CUBIC}"), "polar"),
        fact("length compensation comes before, scaling and rotation are off")
            .right(format!("G50 G69 G43 H1\n{CUBIC}"))
            .refused(format!("G68 X0. Y0. R30.\n{CUBIC}"), "transformed")
            .refused(format!("G51 X0. Y0. Z0. P2000\n{CUBIC}"), "transformed"),
        fact("points and knots are absolute")
            .right(format!("G90\n{CUBIC}"))
            .refused(format!("G91\n{CUBIC}"), "incremental"),
        fact("the first control point and its knot are not left out (the variant of page 158 is an option)")
            .right(CUBIC)
            .refused(cubic("P4 K0. X0. Y0. Z0. R1. F5000.", "P4 F5000."), "nurbs-axes"),
        fact("lengths have a point: without one they may be steps")
            .right(CUBIC)
            .refused(cubic("X10.", "X10"), "decimal-point")
            .refused(cubic("K1.", "K1"), "decimal-point")
            .refused("G1 X10 Y0.", "decimal-point"),
    ]
}

#[test]
fn fanuc() {
    let cubic = |from, to| with(CUBIC, from, to);
    let mut facts = shared();
    facts.extend([
        fact("knots and weights have three decimals")
            .right(cubic("Y11. Z0. R1.", "Y11. Z0. R0.001"))
            .right(with(POLYGON, "K1.", "K0.999"))
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R0.5001"), "nurbs-digits")
            .refused(with(POLYGON, "K1.", "K0.9999"), "nurbs-digits"),
        fact("knots and weights are no larger than 999999.999")
            .right(cubic("Y11. Z0. R1.", "Y11. Z0. R999999.999"))
            .right(CUBIC.replace("K1.", "K999999.999"))
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R1000000."), "nurbs-weight")
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R1000000.001"), "nurbs-digits")
            .refused(CUBIC.replace("K1.", "K1000000."), "nurbs-digits"),
        fact("any axis may move; only X, Y and Z can be checked")
            .right(CUBIC)
            .refused(cubic("X0. Y0.", "X0. A0. Y0."), "axis")
            .refused(cubic("X10. Y10.", "X10. C5. Y10."), "axis"),
        fact("G05 P10000 may be asked for, but need not")
            .right(cubic("G05 P10000\n", ""))
            .refused(cubic("G05 P10000", "G05.1 Q1"), "unknown-code"),
    ]);
    hold(Dialect::Fanuc, &facts);
}

#[test]
fn mitsubishi() {
    let cubic = |from, to| with(CUBIC, from, to);
    let mut facts = shared();
    facts.extend([
        fact("G05 P10000 is on")
            .right(CUBIC)
            .refused(cubic("G05 P10000\n", ""), "nurbs-high-speed")
            .refused(format!("{CUBIC}\n{}", cubic("G05 P10000\n", "G1 X0. Y0.\n")), "nurbs-high-speed"),
        fact("the three basic axes move")
            .right(CUBIC)
            .refused(cubic("X10. Y10.", "X10. A5. Y10."), "nurbs-axes")
            .refused(cubic("X10. Y10.", "X10. U5. Y10."), "nurbs-axes"),
        fact("weights are from 0.0001 to 99.9999")
            .right(cubic("Y11. Z0. R1.", "Y11. Z0. R0.0001"))
            .right(cubic("Y11. Z0. R1.", "Y11. Z0. R99.9999"))
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R100."), "nurbs-weight")
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R0.0000"), "nurbs-weight"),
        fact("knots and weights have four decimals")
            .right(with(POLYGON, "K1.", "K0.9999"))
            .refused(with(POLYGON, "K1.", "K0.99999"), "nurbs-digits")
            .refused(cubic("Y11. Z0. R1.", "Y11. Z0. R0.50001"), "nurbs-digits"),
        fact("knots have nine digits")
            .right(CUBIC.replace("K1.", "K99999.9999"))
            .refused(CUBIC.replace("K1.", "K100000.0001"), "nurbs-digits")
            .refused(CUBIC.replace("K1.", "K100000."), "nurbs-digits"),
    ]);
    hold(Dialect::Mitsubishi, &facts);
}

#[test]
fn g06_2_is_the_curve_of_its_words() {
    for dialect in [Dialect::Fanuc, Dialect::Mitsubishi] {
        let (cubic, feed) = curve(dialect, CUBIC);
        assert_eq!((feed, cubic.knots().degree()), (5000.0, 3));
        assert!((cubic.point(0.5) - Point3::new(15.0, 7.875, 0.0)).norm() < 1e-12);
        // Order 3: degree 2, three knots at each end; R is left out where it is 1.
        let quadratic = "G05 P10000\nG06.2 P3 K0. X0. Y0. Z0. F500.\nK0. X10. Y10. Z0. R0.5\nK0. X20. Y0. Z0.\nK1.\nK1.\nK1.";
        let (quadratic, _) = curve(dialect, quadratic);
        assert_eq!((quadratic.knots().degree(), quadratic.weights()), (2, Some(&[1.0, 0.5, 1.0][..])));
        // Axes that are not named stand still.
        let flat = format!("G0 Z7.\n{}", CUBIC.replace(" Z0.", ""));
        let found = super::blocks(dialect, &flat);
        assert!((found[1].2.end() - Point3::new(30.0, 0.0, 7.0)).norm() < 1e-12, "{found:?}");
    }
}
