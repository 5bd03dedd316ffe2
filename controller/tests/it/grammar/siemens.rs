use claymill_controller::{Dialect, Shape};

use super::{blocks, curve, fact, hold, with};

/// One cubic span of 30 from the position, as CATIA writes its knot differences.
const CUBIC: &str =
    "BSPLINE SD=3 X10. Y10. Z0. PL=0. F600.\nX20. Y10. Z0. PL=30. PW=0.5\nX30. Y0. Z0. PL=0.\nG1";
const QUADRATIC: &str = "BSPLINE SD=2 X10. Y10. Z0. PL=0.\nX20. Y0. Z0. PL=12.5\nG1";
/// The manual's quarter circle.
const CIRCLE: &str = "G1 X10. Y0.\nPOLY PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1) F100.\nG1";

#[test]
fn facts() {
    let cubic = |from, to| with(CUBIC, from, to);
    let long = CUBIC.replace("G1", "").trim_end().to_owned();
    let facts = [
        fact("SD is the degree: 2 or 3")
            .right(CUBIC)
            .right(QUADRATIC)
            .refused(cubic("SD=3", "SD=4"), "siemens-sd")
            .refused(cubic("SD=3", "SD=1"), "siemens-sd")
            .refused(cubic("SD=3", "SD=2.5"), "siemens-sd"),
        fact("without SD the degree is 3")
            .right(cubic("SD=3 ", ""))
            .refused(with(QUADRATIC, "SD=2 ", ""), "siemens-points"),
        fact("there are more control points than the degree, the position among them")
            .right(CUBIC)
            .refused(cubic("X30. Y0. Z0. PL=0.\n", ""), "siemens-points"),
        fact("weights are no larger than 3, and positive")
            .right(cubic("PW=0.5", "PW=3."))
            .right(cubic("PW=0.5", "PW=0.0001"))
            .refused(cubic("PW=0.5", "PW=3.0001"), "siemens-pw")
            .refused(cubic("PW=0.5", "PW=0."), "siemens-pw")
            .refused(cubic("PW=0.5", "PW=-1."), "siemens-pw"),
        fact("weights have four decimals")
            .right(cubic("PW=0.5", "PW=0.5001"))
            .refused(cubic("PW=0.5", "PW=0.50001"), "siemens-pw"),
        fact("knot intervals are up to 99999.9999 with four decimals")
            .right(cubic("PL=30.", "PL=99999.9999"))
            .right(cubic("PL=30.", "PL=0.0001"))
            .refused(cubic("PL=30.", "PL=100000."), "siemens-pl")
            .refused(cubic("PL=30.", "PL=0.00001"), "siemens-pl")
            .refused(cubic("PL=30.", "PL=-1."), "siemens-pl"),
        fact("an interval that is left out is the control's own")
            .right(CUBIC)
            .refused(cubic(" PL=30.", ""), "siemens-pl"),
        fact("the outer intervals are 0: the spline begins and ends at its first and last points")
            .right(CUBIC)
            .refused(cubic("PL=0. F", "PL=1. F"), "siemens-pl")
            .refused(cubic("Z0. PL=0.\nG1", "Z0. PL=1.\nG1"), "siemens-pl"),
        fact("BSPLINE stays on: the next spline would go on from this one's points")
            .right(format!("{CUBIC}\nBSPLINE X40. Y0. Z0. PL=0.\nX50. Y0. Z0. PL=1.\nX60. Y1. Z0. PL=0.\nG1"))
            .refused(format!("{long}\n{CUBIC}"), "siemens-run-on"),
        fact("a spline ends before the program does")
            .right(CUBIC)
            .refused(format!("{}\n; nothing ends it", cubic("X30. Y0. Z0. PL=0.\nG1", "")), "siemens-points"),
        fact("the spline starts at a known position")
            .right(CUBIC)
            .refused(format!("M0\n{CUBIC}"), "position"),
        fact("SPLINEPATH names the axes that follow the spline; X, Y and Z can be checked")
            .right(format!("SPLINEPATH(1,X,Y,Z)\n{CUBIC}"))
            .refused(format!("SPLINEPATH(1,X,Y,Z,A)\n{CUBIC}"), "axis")
            .refused(cubic("X20. Y10.", "X20. A5. Y10."), "unknown-word"),
        fact("A and C splines go through points, with conditions at their ends")
            .right(CUBIC)
            .refused(cubic("BSPLINE", "ASPLINE"), "siemens-through")
            .refused(cubic("BSPLINE", "CSPLINE"), "siemens-through")
            .refused(format!("BNAT ENAT\n{CUBIC}"), "siemens-through"),
        fact("a compressor puts splines of its own in place of blocks")
            .right("COMPOF\nG1 X10. Y0.")
            .refused("COMPCAD\nG1 X10. Y0.", "siemens-compressor")
            .refused("G1 COMPCURV X10. Y0.", "siemens-compressor")
            .refused("CTOL=0.01\nG1 X10. Y0.", "siemens-compressor")
            .refused("CYCLE832(0.01,_FINISH,0.8)\nG1 X10. Y0.", "siemens-compressor"),
        fact("radius compensation, which the control takes with splines, moves the path")
            .right(format!("G40\n{CUBIC}"))
            .refused(format!("G41 D1\n{CIRCLE}"), "radius-compensation"),
        fact("a polynomial has an end and a2 to a5")
            .right("POLY PO[X]=(10,1,2,3,4) PO[Y]=(5) F100.\nG1")
            .refused("POLY PO[X]=(1,2,3,4,5,6) F100.", "siemens-po")
            .refused("POLY PO[X]=10. F100.", "unknown-word"),
        fact("PL of a polynomial is the length of its parameter: 1 when left out, never 0")
            .right("POLY PO[X]=(10,1) PL=2.5 F100.\nG1")
            .right(CIRCLE)
            .refused("POLY PO[X]=(10,1) PL=0. F100.", "siemens-pl")
            .refused("POLY PO[X]=(10,1) PL=100000. F100.", "siemens-pl"),
        fact("a denominator has no zero")
            .right(CIRCLE)
            .refused("POLY PO[X]=(10) PO[]=(1,8) F100.", "siemens-po")
            .refused("POLY PO[X]=(10) PO[]=(0,1) F100.", "siemens-po"),
        fact("polynomials are those of the geometry axes")
            .right(CIRCLE)
            .refused("POLY PO[A]=(1,2) F100.", "siemens-po"),
        fact("an axis without PO goes straight, but not under a denominator or beside its own PO")
            .right("POLY PO[Y]=(9.3,1,7.67) X70. PL=5. F100.\nG1")
            .right("POLY F100.\nX5. Y5.\nG1")
            .refused("POLY PO[X]=(0,-10) Y10. PO[]=(2,1) F100.", "siemens-po")
            .refused("POLY PO[X]=(5,1) X5. F100.", "siemens-po"),
        fact("PO is for POLY").right(CIRCLE).refused("G1 PO[X]=(10,1) F100.", "unknown-word"),
        fact("G70 and G71 choose the unit, G20 and G21 do not")
            .right("G70\nG1 X1. Y0.")
            .refused("G20\nG1 X1. Y0.", "unknown-code"),
        fact("work offsets are G54 to G57 and G505 to G599")
            .right("G55\nG1 X10. Y0.")
            .right("G505\nG1 X10. Y0.")
            .right("G599\nG1 X10. Y0.")
            .refused("G504\nG1 X10. Y0.", "unknown-code")
            .refused("G600\nG1 X10. Y0.", "unknown-code")
            .refused("G507.5\nG1 X10. Y0.", "unknown-code"),
        fact("G4 is a dwell, whose F is a time").right("G4 F2.\nG1 X10. Y0.").refused("G1 X10. F0.", "feed"),
    ];
    hold(Dialect::Siemens, &facts);
}

#[test]
fn bspline_is_the_curve_of_its_words() {
    let (found, _) = curve(Dialect::Siemens, CUBIC);
    assert_eq!(found.knots().as_slice(), [0.0, 0.0, 0.0, 0.0, 30.0, 30.0, 30.0, 30.0]);
    assert_eq!(found.weights(), Some(&[1.0, 1.0, 0.5, 1.0][..]));
    let (found, _) = curve(Dialect::Siemens, QUADRATIC);
    assert_eq!(found.knots().as_slice(), [0.0, 0.0, 0.0, 12.5, 12.5, 12.5]);
}

#[test]
fn poly_is_exact_for_circles_and_counts_its_length() {
    let found = blocks(Dialect::Siemens, CIRCLE);
    let (_, _, Shape::Spline(circle)) = &found[1] else { panic!("{found:?}") };
    for i in 0..=10 {
        let p = circle.point(f64::from(i) / 10.0);
        assert!((p.x.hypot(p.y) - 10.0).abs() < 1e-12);
    }
    // x = a1·p + p² up to p = 2 and x = 10, so that a1 = 3; y goes straight.
    let (found, _) = curve(Dialect::Siemens, "POLY PO[X]=(10,1) Y8. PL=2. F100.\nG1");
    let middle = found.point(0.5);
    assert!((middle.x - 4.0).abs() < 1e-12 && (middle.y - 4.0).abs() < 1e-12, "{middle:?}");
}

#[test]
fn a_dwell_changes_no_feed() {
    let found = blocks(Dialect::Siemens, "G4 F2.\nG1 X10.");
    assert_eq!(found[0].1, 600.0);
}
