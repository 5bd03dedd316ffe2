use claymill_controller::{Dialect, Shape};
use claymill_nurbs::Point3;

use super::{blocks, curve, fact, hold, with};

/// From the position to X10 with a bulge: X = 10 - 10 t, Y = 4 t² - 4 t, t from 1 to 0.
const BULGE: &str =
    "4 SPL X+10 Y+0 Z+0 F1000\n  K3X+0 K2X+0 K1X-1.0E1\n  K3Y+0 K2Y+4.0 K1Y-4.0\n  K3Z0 K2Z0 K1Z+0.000E+00";

/// Along X to X10, then on with a slope: Y = slope·(10 - 10 t).
fn behind(slope: f64) -> String {
    format!(
        "4 SPL X+10 Y+0 F1000\n  K3X+0 K2X+0 K1X-1.0E1\n  K3Y+0 K2Y+0 K1Y+0\n\
         5 SPL X+20 Y{:+.4}\n  K3X+0 K2X+0 K1X-1.0E1\n  K3Y+0 K2Y+0 K1Y{:+.8}",
        10.0 * slope,
        -10.0 * slope
    )
}

/// The manual's example (iTNC 530, page 275), from its position.
const MANUAL: &str = "7 L X+28.338 Y+19.385 Z-0.5 FMAX\n\
    8 SPL X24.875 Y15.924 Z-0.5\n\
    K3X-4.688E-002 K2X2.459E-002 K1X3.486E+000\n\
    K3Y-4.563E-002 K2Y2.155E-002 K1Y3.486E+000\n\
    K3Z0.000E+000 K2Z0.000E+000 K1Z0.000E+000 F10000";

#[test]
fn facts() {
    let bulge = |from, to| with(BULGE, from, to);
    let facts = [
        fact("a spline names two to five axes; X, Y and Z can be checked")
            .right(BULGE)
            .right(bulge("Z+0 ", "").replace("\n  K3Z0 K2Z0 K1Z+0.000E+00", ""))
            .refused("4 SPL X+10 F1000\n  K3X+0 K2X+0 K1X-1.0E1", "heidenhain-axes")
            .refused(bulge("Z+0 F1000", "Z+0 C+5 F1000"), "axis"),
        fact("each axis has K3, K2 and K1")
            .right(BULGE)
            .refused(bulge(" K2Y+4.0", ""), "heidenhain-k")
            .refused(bulge("\n  K3Z0 K2Z0 K1Z+0.000E+00", ""), "heidenhain-k"),
        fact("they stand in this order, once")
            .right(BULGE)
            .refused(bulge("K3X+0 K2X+0 K1X-1.0E1", "K1X-1.0E1 K2X+0 K3X+0"), "heidenhain-k")
            .refused(bulge("K2X+0", "K2X+0 K2X+0"), "heidenhain-k"),
        fact("only axes that the spline names have them")
            .right(BULGE)
            .refused(bulge(" Z+0", ""), "heidenhain-k")
            .refused("4 K3X+0 K2X+0 K1X+0", "heidenhain-k"),
        fact("an end has five digits before and four behind the point")
            .right(bulge("X+10 ", "X+10.0000 "))
            .refused(bulge("X+10 ", "X+100000 "), "heidenhain-digits")
            .refused(bulge("X+10 ", "X+10.00001 "), "heidenhain-digits"),
        fact("a coefficient is below 10 with eight decimals, or has an exponent up to 255")
            .right(bulge("K3Y+0", "K3Y+0.00000001"))
            .right(bulge("K3Y+0", "K3Y+9.99999999E-255"))
            .refused(bulge("K2Y+4.0", "K2Y+40.0"), "heidenhain-k-digits")
            .refused(bulge("K2Y+4.0", "K2Y+4.000000001"), "heidenhain-k-digits")
            .refused(bulge("K2Y+4.0", "K2Y+4.0E256"), "heidenhain-k-digits"),
        fact("the exponent may stand apart, E+0 and zeros may be left out, ~ goes on in the next line")
            .right(bulge("K1X-1.0E1", "K1X-1. E+1"))
            .right(bulge("K2Y+4.0 K1Y-4.0", "K2Y4 K1Y-4.E+0"))
            .right(BULGE.replace('\n', " ~\n"))
            .refused(bulge("K1X-1.0E1", "K1X-1.0E"), "syntax"),
        fact("F and M may stand in a spline, behind its last coefficient too")
            .right(MANUAL)
            .right(bulge("F1000", "F1000 M8"))
            .refused(bulge("F1000", "S1000"), "unknown-word")
            .refused(bulge(" F1000", ""), "feed"),
        fact("a block with a position comes before")
            .right(BULGE)
            .refused(format!("4 TOOL CALL 2 Z S1000\n{BULGE}"), "position")
            .refused(format!("4 STOP\n{BULGE}"), "position"),
        fact("the start may be 1 µm off")
            .right(bulge("K1Y-4.0", "K1Y-4.0009"))
            .refused(bulge("K1Y-4.0", "K1Y-4.0011"), "heidenhain-start"),
        fact("a corner of 0.1° between splines is stopped at; L between them is another block")
            .right(behind(0.0))
            .right(behind(0.09f64.to_radians().tan()))
            .right(with(&behind(0.2), "\n5 SPL", "\n5 L X+10 Y+0 R0 F1000\n6 SPL"))
            .refused(behind(0.11f64.to_radians().tan()), "heidenhain-corner")
            .refused(behind(-0.11f64.to_radians().tan()), "heidenhain-corner"),
        fact("radius compensation is off")
            .right("4 L X+10 R0 F100")
            .refused("4 L X+10 RL F100", "radius-compensation")
            .refused("4 L X+10 RR F100", "radius-compensation"),
        fact("positions are absolute").right("4 L X+10 R0 F100").refused("4 L IX+10 R0 F100", "incremental"),
        fact("cycles that move the coordinates are not read")
            .right("4 CYCL DEF 32.0 TOLERANCE\n5 CYCL DEF 32.1 T0.002\n6 L X+10 R0 F100")
            .refused("4 CYCL DEF 7.0 DATUM SHIFT\n5 CYCL DEF 7.1 X+10\n6 L X+10 R0 F100", "heidenhain-cycle"),
        fact("a program is what stands between BEGIN PGM and END PGM")
            .right("4 L X+10 R0 F100")
            .refused("4 END PGM A MM\n5 L X+10 R0 F100", "program-end"),
    ];
    hold(Dialect::Heidenhain, &facts);
}

#[test]
fn a_spline_runs_backwards() {
    let (found, _) = curve(Dialect::Heidenhain, BULGE);
    assert!((found.start() - Point3::origin()).norm() < 1e-12);
    assert!((found.point(0.5) - Point3::new(5.0, -1.0, 0.0)).norm() < 1e-12, "{:?}", found.point(0.5));
}

#[test]
fn the_manual_s_example_has_its_feed() {
    let found = blocks(Dialect::Heidenhain, MANUAL);
    let (false, feed, Shape::Spline(found)) = &found[1] else { panic!("{found:?}") };
    assert_eq!(*feed, 10_000.0);
    assert!((found.end() - Point3::new(24.875, 15.924, -0.5)).norm() < 1e-12);
}
