use claymill_controller::Dialect;

use super::{curve, fact, hold, with};

const SPLINE: &str =
    "#SPLINE TYPE BSPLINE\n#SPLINE ON\nG1 X5. Y5. F600.\nG1 X10. Y5.\nG1 X15. Y0.\n#SPLINE OFF";

#[test]
fn facts() {
    let spline = |from, to| with(SPLINE, from, to);
    let facts = [
        fact("the type of spline is chosen: without it, splines go through their points")
            .right(SPLINE)
            .refused(spline("#SPLINE TYPE BSPLINE\n", ""), "beckhoff-type")
            .refused(spline("TYPE BSPLINE", "TYPE AKIMA"), "beckhoff-type"),
        fact("#SPLINE ON and OFF, or G151 and G150, stand around the points")
            .right(SPLINE)
            .right(SPLINE.replace("#SPLINE ON", "G151").replace("#SPLINE OFF", "G150"))
            .refused("#SPLINE OFF\nG1 X5.", "beckhoff-off")
            .refused("G150\nG1 X5.", "beckhoff-off")
            .refused(spline("\nG1 X10.", "\n#SPLINE ON\nG1 X10."), "beckhoff-run-on")
            .refused(spline("\n#SPLINE OFF", ""), "beckhoff-word"),
        fact("there are at least four points, the position among them")
            .right(SPLINE)
            .refused(spline("G1 X10. Y5.\n", ""), "beckhoff-points"),
        fact("points are linear blocks, without knots and weights")
            .right(spline("G1 X10.", "X10."))
            .refused(spline("G1 X10. Y5.", "G2 X10. Y5. I1."), "beckhoff-word")
            .refused(spline("G1 X10. Y5.", "G1 X10. Y5. K1."), "unknown-word")
            .refused(spline("G1 X10. Y5.", "G1 X10. Y5. R0.5"), "unknown-word")
            .refused(spline("G1 X10. Y5.", "M8"), "beckhoff-word"),
        fact("it starts at a known position").right(SPLINE).refused(format!("M0\n{SPLINE}"), "position"),
    ];
    hold(Dialect::Beckhoff, &facts);
}

#[test]
fn the_position_is_the_first_point() {
    assert_eq!(curve(Dialect::Beckhoff, SPLINE).0.points().len(), 4);
}
