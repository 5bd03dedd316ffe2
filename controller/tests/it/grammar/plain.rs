use claymill_controller::{Dialect, Machine, Shape, check};

use super::{blocks, fact, hold};

#[test]
fn facts() {
    let facts = [
        fact("an arc's ends are equally far from its centre")
            .right("G2 X6. Y0. I3. J0.")
            .refused("G2 X10. Y0. I3. J0.", "arc-radius"),
        fact("an arc's centre is in its plane")
            .right("G18\nG2 X6. Z0. I3. K0.")
            .refused("G18\nG2 X6. Z0. I3. J0.", "arc-centre"),
        fact("an arc has a centre: by its radius it may be two")
            .right("G2 X6. Y0. I3. J0.")
            .refused("G2 X10. Y0. R5.", "arc-radius-word"),
        fact("a centre alone is a full circle, and belongs to an arc")
            .right("G2 I3. J0.")
            .refused("G1 X10. I3.", "no-arc")
            .refused("G1 X10.\nI3.", "no-arc"),
        fact("three axes move").right("G1 X10. Y1. Z1.").refused("G1 X10. A5.", "axis"),
        fact("codes and words are known")
            .right("G1 X10.")
            .refused("G187 P3.", "unknown-code")
            .refused("G1 Q5.", "unknown-word")
            .refused("M98", "unknown-word"),
        fact("positions are absolute").right("G90\nG1 X10.").refused("G91\nG1 X10.", "incremental"),
        fact("feeds are for a minute").right("G94\nG1 X10.").refused("G93\nG1 X10.", "feed-mode"),
        fact("after a stop or a tool change the tool is nobody knows where")
            .right("M0\nG0 Z5.\nG0 X0. Y0.\nG1 X10.")
            .refused("M0\nG1 X10.", "position")
            .refused("T2 M6\nG1 X10.", "position"),
        fact("nothing is run behind the end")
            .right("G1 X10.")
            .refused("M30\nG1 X10.", "program-end")
            .refused("M2\nG1 X10.", "program-end"),
        fact("modes hold for their whole block").right("X1. G1").refused("X10. G91", "incremental"),
    ];
    hold(Dialect::G1, &facts);
}

#[test]
fn arcs_turn_as_their_plane_says() {
    let found = blocks(Dialect::G1, "G1 X10. Y0.\nG18 G3 X0. Z10. I-10. K0.\nG17\nG0 Z50.");
    let (_, _, Shape::Arc(arc)) = &found[1] else { panic!("{found:?}") };
    // G18 sees X to the left of Z: from +X to +Z is clockwise, counterclockwise takes the long way.
    assert!((arc.sweep() - 1.5 * std::f64::consts::PI).abs() < 1e-9);
    assert!(found[2].0);
    let found = blocks(Dialect::G1, "G3 I3. J0.");
    assert!(
        matches!(&found[..], [(_, _, Shape::Arc(arc))] if (arc.length_mm() - 6.0 * std::f64::consts::PI).abs() < 1e-9)
    );
}

#[test]
fn a_program_moves_from_a_known_place_at_a_feed_to_its_end() {
    let rule = |text: &str| check(text, Dialect::G1, &Machine::default()).unwrap_err().1.rule;
    assert_eq!(rule("G1 X1. F100.\nM30"), "position");
    assert_eq!(rule("G0 X1. Y0. Z0.\nG1 X2.\nM30"), "feed");
    assert_eq!(rule("G0 X1."), "program-end");
}
