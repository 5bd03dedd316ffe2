use std::process::Command;

use claymill_controller::{Dialect, Shape};
use claymill_nurbs::Point3;
use claymill_tests::{Need, is_installed};

use super::{Fact, Fault, blocks, curve, fact, hold, program, with};

const BEZIER: &str = "G5.2 X10. Y10. P1. L4 F600.\nG5.2 X20. Y10. P0.5 L4\nG5.2 X30. Y0. P1. L4\nG5.3";
const QUADRATIC: &str = "G5.2 X10. Y10. P1. F600.\nG5.2 X20. Y0. P1.\nG5.3";

/// `n` poles beside the position, on a parabola.
fn poles(n: usize) -> String {
    let poles: String = (1..=n).map(|i| format!("G5.2 X{i}. Y{}. P1.\n", i * i)).collect();
    format!("{poles}G5.3")
}

/// What holds in G17, in both versions.
fn shared() -> Vec<Fact> {
    let bezier = |from, to| with(BEZIER, from, to);
    vec![
        fact("each pole names X and Y")
            .right(BEZIER)
            .refused(bezier("X20. ", ""), "linuxcnc-axes")
            .refused(bezier("Y10. P0.5", "P0.5"), "linuxcnc-axes"),
        fact("a curve lies in its plane: a Z word is dropped without a message")
            .right(BEZIER)
            .wrong(bezier("Y10. P1.", "Y10. Z5. P1."), "linuxcnc-third-axis"),
        fact("each pole has its weight P; without it, the first one has a weight of -1")
            .right(BEZIER)
            .refused(bezier(" P0.5", ""), "linuxcnc-weight")
            .wrong(bezier("Y10. P1. L4 F", "Y10. L4 F"), "linuxcnc-weight"),
        fact("P is above 0")
            .right(bezier("P0.5", "P0.001"))
            .refused(bezier("P0.5", "P0."), "linuxcnc-weight")
            .refused(bezier("P0.5", "P-1."), "linuxcnc-weight")
            .wrong(bezier("Y10. P1.", "Y10. P0."), "linuxcnc-weight"),
        fact("P alone is the weight of the position, before the first pole")
            .right(format!("G5.2 P2.\n{BEZIER}"))
            .refused(format!("G5.2 P2.\nG5.2 P2.\n{BEZIER}"), "linuxcnc-axes")
            .refused(bezier("\nG5.2 X30.", "\nG5.2 P2.\nG5.2 X30."), "linuxcnc-axes"),
        fact("the order is 3, or the last L above 3")
            .right(QUADRATIC)
            .right(with(QUADRATIC, "Y0. P1.", "Y0. P1. L2"))
            .right(bezier("P1. L4 F", "P1. L9 F"))
            .refused(with(QUADRATIC, "Y0. P1.", "Y0. P1. L4"), "linuxcnc-few")
            .refused(bezier("Y0. P1. L4", "Y0. P1. L5"), "linuxcnc-few"),
        fact("L is a whole number")
            .right(bezier("L4 F", "L4.0 F"))
            .refused(bezier("L4 F", "L4.5 F"), "linuxcnc-order")
            .refused(bezier("L4 F", "L-4 F"), "linuxcnc-order"),
        fact("there are as many poles as the order, the position among them")
            .right(QUADRATIC)
            .refused(bezier("G5.2 X20. Y10. P0.5 L4\n", ""), "linuxcnc-few")
            .refused("G5.2 X10. Y0. P1.\nG5.3", "linuxcnc-few"),
        fact("knots are the control's own")
            .right(BEZIER)
            .refused(bezier("P0.5", "P0.5 K1."), "linuxcnc-word"),
        fact("G5.3 follows G5.2")
            .right(BEZIER)
            .refused("G5.3\nG1 X10.", "linuxcnc-g5.3")
            .wrong(bezier("\nG5.3", ""), "linuxcnc-between"),
        fact("G5.3 stands alone: its axis words are dropped")
            .right(BEZIER)
            .wrong(bezier("G5.3", "G5.3 X40. Y0."), "linuxcnc-between"),
        fact("only G5.2 stands between G5.2 and G5.3: another motion drops the poles before it")
            .right(BEZIER)
            .wrong(bezier("\nG5.2 X20.", "\nG1 X15.\nG5.2 X16. Y3. P1.\nG5.2 X20."), "linuxcnc-between")
            .wrong(bezier("\nG5.3", "\nM8\nG5.3"), "linuxcnc-between"),
        fact("after G5.3 no motion is active")
            .right(format!("{BEZIER}\nG1 X0. Y0."))
            .refused(format!("{BEZIER}\nX0. Y0."), "no-motion"),
        fact("the feed is not 0").right(BEZIER).refused(bezier("F600.", "F0."), "feed"),
        fact("many poles in one block take the interpreter very long")
            .right(poles(49))
            .wrong(poles(60), "linuxcnc-poles"),
        fact("straight pieces divide by zero: the control's biarcs have no joint")
            .right(BEZIER)
            .wrong("G5.2 X10. Y5. P1. L4\nG5.2 X20. Y10. P1. L4\nG5.2 X30. Y15. P1. L4\nG5.3", "linuxcnc-straight"),
        fact("G6.2 is unknown, or corrupts the position")
            .right(BEZIER)
            .refused("G6.2 X10. Y0. R1. K0 P3 Q1", "linuxcnc-g6.2"),
        fact("G5 is a cubic: I and J from its start, P and Q from its end")
            .right("G5 X10. Y0. I3. J3. P-3. Q3.")
            .refused("G5 X10. Y0. I3. J3.", "linuxcnc-bezier")
            .refused("G5 X10. Y0. I3. P-3. Q3.", "linuxcnc-bezier")
            .wrong("G5 X10. Y0. P-3. Q3.", "linuxcnc-bezier"),
        fact("G5.1 is a quadratic: I and J from its start")
            .right("G5.1 X10. Y0. I5. J5.")
            .refused("G5.1 X10. Y0.", "linuxcnc-bezier")
            .refused("G5.1 X10. Y0. I5.", "linuxcnc-bezier"),
        fact("G5 and G5.1 do not move Z")
            .right("G5.1 X10. Y0. I5. J5.")
            .refused("G5.1 X10. Y0. Z1. I5. J5.", "linuxcnc-bezier")
            .refused("G5 X10. Y0. Z1. I3. J3. P-3. Q3.", "linuxcnc-bezier"),
        fact("G5 and G5.1 are for G17")
            .right("G17\nG5.1 X10. Y0. I5. J5.")
            .refused("G18\nG5.1 X10. Y0. I5. J5.", "linuxcnc-plane")
            .refused("G19\nG5 X10. Y0. I3. J3. P-3. Q3.", "linuxcnc-plane"),
        fact("behind G5 the motion before it goes on, not another cubic")
            .right("G1 X0. Y0.\nG5 X10. Y0. I3. J3. P-3. Q3.\nX20.")
            .refused("G5 X10. Y0. I3. J3. P-3. Q3.\nX20. Y0. I3. J3. P-3. Q3.", "unknown-word"),
        fact("an arc of 1 µm is a point")
            .right("G2 X0.0040 Y0. I0.0020 J0.")
            .refused("G2 X0.0012 Y0.0004 I0.0006 J0.0002", "linuxcnc-zero-radius"),
        fact("G64 P or G61 says how far from the path corners are rounded; G64 alone and G64 P0 let them go anywhere")
            .right("G61\nG1 X10.")
            .right("G64 P0.001\nG1 X10.")
            .wrong("G64\nG1 X10.", "linuxcnc-blend")
            .wrong("G64 P0.\nG1 X10.", "linuxcnc-blend")
            .wrong("G64 P0.5\nG1 X10.", "linuxcnc-blend"),
        fact("radius compensation is off")
            .right("G40\nG1 X10.")
            .refused(format!("G41 D1\n{BEZIER}"), "radius-compensation"),
    ]
}

fn old() -> Vec<Fact> {
    let xz = BEZIER.replace('Y', "Z");
    let mut facts = shared();
    facts.extend([fact(
        "2.9 takes curves in G17 only; in others it asks for X and Y, and then moves elsewhere",
    )
    .right(format!("G17\n{BEZIER}"))
    .refused(format!("G18\n{xz}"), "linuxcnc-plane")
    .refused(format!("G19\n{}", xz.replace('X', "Y")), "linuxcnc-plane")
    .wrong(format!("G18\n{BEZIER}"), "linuxcnc-plane")]);
    facts
}

#[test]
fn facts() {
    hold(Dialect::LinuxCnc29, &old());
    let xz = BEZIER.replace('Y', "Z");
    let yz = xz.replace('X', "Y");
    let mut facts = shared();
    facts.extend([fact("2.10 takes curves in G18 and G19, by the words of the plane")
        .right(format!("G18\n{xz}"))
        .right(format!("G19\n{yz}"))
        .refused(format!("G18\n{BEZIER}"), "linuxcnc-third-axis")
        .refused(format!("G19\n{BEZIER}"), "linuxcnc-third-axis")]);
    hold(Dialect::LinuxCnc210, &facts);
}

/// The facts of 2.9 held against its interpreter: what is right it takes, and of the faults it takes those that it
/// would execute wrongly.
#[test]
fn the_interpreter_agrees() {
    if !is_installed(Need::LinuxCnc, "rs274", "linuxcnc-uspace") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for name in ["tool.tbl", "sim.var"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    let takes = |body: &str| {
        let file = folder.path().join("fact.ngc");
        std::fs::write(&file, program(Dialect::LinuxCnc29, body)).unwrap();
        let mut rs274 = Command::new("rs274");
        rs274.current_dir(folder.path()).args(["-g", "-t", "tool.tbl", "-v", "sim.var"]).arg(&file);
        let run = rs274.output().unwrap();
        let said = String::from_utf8_lossy(&run.stdout).into_owned() + &String::from_utf8_lossy(&run.stderr);
        (run.status.success() && said.contains("PROGRAM_END"), said)
    };
    let mut asked = 0;
    for fact in old() {
        for body in &fact.right {
            let (taken, said) = takes(body);
            assert!(taken, "{}:\n{body}\n{said}", fact.says);
            asked += 1;
        }
        for Fault { text, taken: expected, .. } in &fact.faults {
            let (taken, said) = takes(text);
            assert_eq!(taken, *expected, "{}:\n{text}\n{said}", fact.says);
            asked += 1;
        }
    }
    eprintln!("{asked} programs");
}

#[test]
fn poles_are_the_curve_s() {
    for dialect in [Dialect::LinuxCnc29, Dialect::LinuxCnc210] {
        let (found, _) = curve(dialect, BEZIER);
        assert_eq!((found.knots().degree(), found.points().len()), (3, 4));
        assert_eq!(found.weights(), Some(&[1.0, 1.0, 0.5, 1.0][..]));
        // The first pole may stand alone; L below 4 is not heard, the order stays 3.
        let (found, _) = curve(dialect, "G5.2 P2. L2\nG5.2 X10. Y10. P2.\nG5.2 X20. Y0. P2.\nG5.3");
        assert_eq!((found.knots().degree(), found.weights()), (2, None));
        // The last L above 3 counts.
        let (found, _) = curve(dialect, &format!("G5.2 X1. Y1. P1. L5\n{BEZIER}"));
        assert_eq!(found.knots().degree(), 3);
        let found = blocks(dialect, "G5 X10. Y0. I3. J3. P-3. Q3.\nG5.1 X20. Y0. I5. J4.");
        let [(_, _, Shape::Spline(cubic)), (_, _, Shape::Spline(quadratic))] = &found[..] else {
            panic!("{found:?}")
        };
        assert!((cubic.point(0.5) - Point3::new(5.0, 2.25, 0.0)).norm() < 1e-12);
        assert!((quadratic.point(0.5) - Point3::new(15.0, 2.0, 0.0)).norm() < 1e-12);
    }
}
