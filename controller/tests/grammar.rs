//! What each control takes and what it refuses: a right program beside one with a fault, fact by fact.

use claymill_controller::{Dialect, Machine, Shape, check, elements};
use claymill_nurbs::Point3;

/// A program of the dialect around `body`, at X0 Y0 Z0 with a feed.
fn program(dialect: Dialect, body: &str) -> String {
    match dialect {
        Dialect::Heidenhain => format!(
            "0 BEGIN PGM A MM\n1 TOOL CALL 1 Z S1000\n2 L Z+0 R0 FMAX\n3 L X+0 Y+0 R0 FMAX\n{body}\n8 END PGM A MM\n"
        ),
        Dialect::AptCatia | Dialect::AptCreo => {
            format!("UNITS/MM\nRAPID\nGOTO/0.,0.,0.\nFEDRAT/600.,MMPM\n{body}\nFINI\n")
        }
        Dialect::Siemens => format!("G90 G94 G71\nG0 Z0.\nG0 X0. Y0.\nG1 F600.\n{body}\nM30\n"),
        _ => format!("G90 G94 G21\nG0 Z0.\nG0 X0. Y0.\nG1 F600.\n{body}\nM30\n"),
    }
}

/// Whether a block is rapid, its feed and its shape.
type Block = (bool, f64, Shape);

fn blocks(text: &str, dialect: Dialect) -> Vec<Block> {
    let found = elements(text, dialect, &Machine::default());
    let found = found.unwrap_or_else(|e| panic!("{dialect}: {e:?}\n{text}"));
    found.into_iter().map(|e| (e.rapid, e.feed, e.shape)).collect()
}

fn right(dialect: Dialect, body: &str) -> Vec<Block> {
    blocks(&program(dialect, body), dialect)
}

fn refused(dialect: Dialect, body: &str, rule: &str) {
    let text = program(dialect, body);
    let (line, refusal) = check(&text, dialect, &Machine::default()).expect_err(&text);
    assert_eq!(refusal.rule, rule, "line {line}: {refusal}\n{text}");
    assert!(line >= 1 && !refusal.detail.is_empty());
}

/// A cubic of one span on a straight line with a bulge: the first control point is the position.
fn g06_2(edit: impl Fn(&mut Vec<String>)) -> String {
    let mut lines: Vec<String> = [
        "G05 P10000",
        "G06.2 P4 K0. X0. Y0. Z0. R1. F5000.",
        "K0. X10. Y10. Z0. R1.",
        "K0. X20. Y10. Z0. R1.",
        "K0. X30. Y0. Z0. R1.",
        "K1.",
        "K1.",
        "K1.",
        "K1.",
        "G05 P0",
    ]
    .map(String::from)
    .to_vec();
    edit(&mut lines);
    lines.join("\n")
}

#[test]
fn g06_2_is_the_curve_of_its_words() {
    for dialect in [Dialect::Fanuc, Dialect::Mitsubishi] {
        let found = right(dialect, &g06_2(|_| ()));
        let [(false, feed, Shape::Spline(curve))] = &found[..] else { panic!("{found:?}") };
        assert_eq!(*feed, 5000.0);
        assert_eq!(curve.knots().degree(), 3);
        assert!((curve.point(0.5) - Point3::new(15.0, 7.5, 0.0)).norm() < 1e-12);
        // Order 3: degree 2, three knots at each end; R is left out where it is 1.
        let quadratic = "G05 P10000\nG06.2 P3 K0. X0. Y0. Z0. F500.\nK0. X10. Y10. Z0. R0.5\nK0. X20. Y0. Z0.\nK1.\nK1.\nK1.";
        let found = right(dialect, quadratic);
        let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
        assert_eq!((curve.knots().degree(), curve.weights()), (2, Some(&[1.0, 0.5, 1.0][..])));
    }
}

#[test]
fn g06_2_is_refused_for_every_alarm() {
    let fanuc = |edit: &dyn Fn(&mut Vec<String>), rule| refused(Dialect::Fanuc, &g06_2(edit), rule);
    // PS1002: a block without knot.
    fanuc(&|l| l[2] = "X10. Y10. Z0. R1.".into(), "nurbs-ps1002");
    // PS1004: too few knots at the end.
    fanuc(&|l| _ = l.remove(8), "nurbs-ps1004");
    // PS1005: another code within.
    fanuc(&|l| l[3] = "K0. X20. Y10. Z0. M8".into(), "nurbs-ps1005");
    // PS1007: the first and the last knots are equal.
    fanuc(&|l| l[2] = "K0.5 X10. Y10. Z0.".into(), "nurbs-p551");
    fanuc(&|l| l[8] = "K2.".into(), "nurbs-ps1007");
    // PS1008: a knot occurs too often.
    let repeated = "G06.2 P2 K0. X0. Y0. Z0.\nK0. X1. Y0. Z0.\nK1. X2. Y1. Z0.\nK1. X3. Y0. Z0.\nK1. X4. Y0. Z0.\nK2. X5. Y0. Z0.\nK3.\nK3.";
    refused(Dialect::Fanuc, repeated, "nurbs-ps1008");
    // PS1009: the first control point is the position.
    fanuc(&|l| l[1] = "G06.2 P4 K0. X0.002 Y0. Z0. R1. F5000.".into(), "nurbs-ps1009");
    // PS1006: not with radius compensation, inverse time or feed a turn.
    refused(Dialect::Fanuc, &format!("G41 D1\n{}", g06_2(|_| ())), "radius-compensation");
    refused(Dialect::Fanuc, &format!("G93\n{}", g06_2(|_| ())), "feed-mode");
    // P is 2 to 4; every axis in the first block; knots do not decrease; 3 decimals, 9 digits.
    fanuc(&|l| l[1] = "G06.2 P5 K0. X0. Y0. Z0.".into(), "nurbs-rank");
    fanuc(&|l| l[1] = "G06.2 P4 K0. X0. Y0.".into(), "nurbs-axes");
    fanuc(&|l| l[5] = "K-1.".into(), "nurbs-p551");
    fanuc(&|l| l[2] = "K0.0001 X10. Y10. Z0.".into(), "nurbs-digits");
    fanuc(&|l| l[2] = "K0. X10. Y10. Z0. R1000000.001".into(), "nurbs-digits");
    fanuc(&|l| l[2] = "K0. X10. Y10. Z0. R0.".into(), "nurbs-weight");
    // A control point behind a block with a knot only.
    fanuc(&|l| l[6] = "K1. X40. Y0. Z0.".into(), "nurbs-ps1004");
    refused(Dialect::Fanuc, "G91", "incremental");
}

#[test]
fn mitsubishi_has_its_own_rules() {
    let four = |l: &mut Vec<String>| l[2] = "K0. X10. Y10. Z0. R0.0001".into();
    right(Dialect::Mitsubishi, &g06_2(four));
    refused(Dialect::Mitsubishi, &g06_2(|l| _ = l.remove(0)), "nurbs-high-speed");
    refused(Dialect::Mitsubishi, &g06_2(|l| l[2] = "K0. X10. Y10. Z0. R100.".into()), "nurbs-weight");
    refused(Dialect::Mitsubishi, &g06_2(|l| l[2] = "K0. X10. Y10. Z0. R0.00001".into()), "nurbs-digits");
    refused(Dialect::Mitsubishi, &g06_2(|l| l[2] = "K0. X10. Y10. Z0. A5.".into()), "nurbs-axes");
}

#[test]
fn siemens_bspline() {
    let spline =
        "BSPLINE SD=3 X10. Y10. Z0. PL=0. F600.\nX20. Y10. Z0. PL=30. PW=0.5\nX30. Y0. Z0. PL=0.\nG1";
    let found = right(Dialect::Siemens, spline);
    let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
    assert_eq!(curve.knots().as_slice(), [0.0, 0.0, 0.0, 0.0, 30.0, 30.0, 30.0, 30.0]);
    assert_eq!(curve.weights(), Some(&[1.0, 1.0, 0.5, 1.0][..]));
    let bad = |body: &str, rule| refused(Dialect::Siemens, body, rule);
    bad(&spline.replace("SD=3", "SD=4"), "siemens-sd");
    bad(&spline.replace("PW=0.5", "PW=3.1"), "siemens-pw");
    bad(&spline.replace("PW=0.5", "PW=0.50001"), "siemens-pw");
    bad(&spline.replace("PL=30.", "PL=100000."), "siemens-pl");
    bad(&spline.replace(" PL=30.", ""), "siemens-pl");
    bad(&spline.replace("PL=0. F", "PL=1. F"), "siemens-pl");
    bad("BSPLINE SD=3 X10. Y10. Z0. PL=0.\nX20. Y0. Z0. PL=0.\nG1", "siemens-points");
    // The next spline would go on from the control points of this one.
    bad(&format!("{}\n{spline}", spline.strip_suffix("\nG1").unwrap()), "siemens-run-on");
}

#[test]
fn siemens_poly_is_exact_for_circles() {
    let found = right(Dialect::Siemens, "G1 X10. Y0.\nPOLY PO[X]=(0,-10) PO[Y]=(10) PO[]=(2,1) F100.\nG1");
    let (_, _, Shape::Spline(curve)) = &found[1] else { panic!("{found:?}") };
    for i in 0..=10 {
        let p = curve.point(f64::from(i) / 10.0);
        assert!((p.x.hypot(p.y) - 10.0).abs() < 1e-12);
    }
    let bad = |body: &str, rule| refused(Dialect::Siemens, body, rule);
    bad("POLY PO[X]=(10) PO[]=(1,8) F100.", "siemens-po");
    bad("POLY PO[X]=(1,2,3,4,5,6) F100.", "siemens-po");
    bad("POLY PO[A]=(1,2) F100.", "siemens-po");
    bad("POLY PO[X]=(1) PL=0. F100.", "siemens-pl");
}

#[test]
fn heidenhain_runs_backwards() {
    // X = 10 + K1·t with t from 1 to 0: from 0 to 10.
    let spl = |x: &str, y: &str, k2y: &str| {
        format!("4 SPL X+10 Y+0 Z+0 F1000\n  {x}\n  {y}{k2y} K1Y-4.0\n  K3Z0 K2Z0 K1Z+0.000E+00")
    };
    let straight = "K3X+0 K2X+0 K1X-1.0E1";
    let bulge = spl(straight, "K3Y+0 ", "K2Y+4.0");
    let found = right(Dialect::Heidenhain, &bulge);
    let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
    assert!((curve.start() - Point3::origin()).norm() < 1e-12);
    assert!((curve.point(0.5) - Point3::new(5.0, -1.0, 0.0)).norm() < 1e-12, "{:?}", curve.point(0.5));
    // The exponent may stand apart.
    right(Dialect::Heidenhain, &bulge.replace("K1X-1.0E1", "K1X-1.0 E1"));
    let bad = |body: &str, rule| refused(Dialect::Heidenhain, body, rule);
    // 1 µm is what the start may be off.
    right(Dialect::Heidenhain, &bulge.replace("K1Y-4.0", "K1Y-4.0009"));
    bad(&bulge.replace("K1Y-4.0", "K1Y-4.0011"), "heidenhain-start");
    bad(&bulge.replace("K2Y+4.0", ""), "heidenhain-k");
    bad(&bulge.replace("K2Y+4.0", "K2Y+40.0"), "heidenhain-k-digits");
    bad(&bulge.replace("K2Y+4.0", "K2Y+4.000000001"), "heidenhain-k-digits");
    bad(&bulge.replace("K2Y+4.0", "K2Y+4.0E256"), "heidenhain-k-digits");
    bad(&bulge.replace("X+10 ", "X+100000 "), "heidenhain-digits");
    // The bulge leaves upwards, the next one would start downwards: an exact stop in the middle of a pass.
    let next = "5 SPL X+20 Y+0 Z+0\n  K3X+0 K2X+0 K1X-1.0E1\n  K3Y+0 K2Y+4.0 K1Y-4.0\n  K3Z0 K2Z0 K1Z0";
    bad(&format!("{bulge}\n{next}"), "heidenhain-corner");
    right(Dialect::Heidenhain, &format!("{bulge}\n5 L X+10 Y+0 Z+0 R0 F1000\n{next}"));
    bad("4 L X+10 RL F100", "radius-compensation");
}

const BEZIER: &str = "G5.2 X10. Y10. P1. L4 F600.\nG5.2 X20. Y10. P0.5 L4\nG5.2 X30. Y0. P1. L4\nG5.3";

#[test]
fn linuxcnc_takes_bezier_pieces() {
    for dialect in [Dialect::LinuxCnc29, Dialect::LinuxCnc210] {
        let found = right(dialect, BEZIER);
        let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
        assert_eq!((curve.knots().degree(), curve.points().len()), (3, 4));
        assert_eq!(curve.weights(), Some(&[1.0, 1.0, 0.5, 1.0][..]));
        // The first pole may stand alone; L below 4 is not heard, the order stays 3.
        let alone = "G5.2 P2. L2\nG5.2 X10. Y10. P2.\nG5.2 X20. Y0. P2.\nG5.3";
        let found = right(dialect, alone);
        let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
        assert_eq!((curve.knots().degree(), curve.weights()), (2, None));
        let bad = |body: &str, rule| refused(dialect, body, rule);
        // Z in G17 is dropped by both without a word.
        bad(&BEZIER.replace("Y10. P1.", "Y10. Z5. P1."), "linuxcnc-third-axis");
        bad(&BEZIER.replace(" P0.5", ""), "linuxcnc-weight");
        bad(&BEZIER.replace("P0.5", "P0."), "linuxcnc-weight");
        bad(&BEZIER.replace("X20. ", ""), "linuxcnc-axes");
        bad(&BEZIER.replace("G5.2 X20. Y10. P0.5 L4\n", ""), "linuxcnc-few");
        bad(&BEZIER.replace("\nG5.3", "\nM8\nG5.3"), "linuxcnc-between");
        // After G5.3 no motion is active.
        bad(&format!("{BEZIER}\nX0. Y0."), "no-motion");
        right(dialect, &format!("{BEZIER}\nG1 X0. Y0."));
        bad("G6.2 P4 K0 X0. Y0. R1 Q1", "linuxcnc-g6.2");
        let many: String = (0..60).map(|i| format!("G5.2 X{i}. Y1. P1.\n")).collect();
        bad(&format!("{many}G5.3"), "linuxcnc-poles");
    }
    // Curves outside of G17: unknown to 2.9, right in 2.10 with the plane's own words.
    let xz = format!("G18\n{}", BEZIER.replace('Y', "Z"));
    refused(Dialect::LinuxCnc29, &xz, "linuxcnc-plane");
    right(Dialect::LinuxCnc210, &xz);
    // X and Y words in G18: 2.9 would move wrongly, 2.10 refuses.
    refused(Dialect::LinuxCnc29, &format!("G18\n{BEZIER}"), "linuxcnc-plane");
    refused(Dialect::LinuxCnc210, &format!("G18\n{BEZIER}"), "linuxcnc-third-axis");
}

#[test]
fn beckhoff_splines_have_four_points_and_a_type() {
    let spline = "#SPLINE TYPE BSPLINE\n#SPLINE ON\nG1 X5. Y5. F600.\nG1 X10. Y5.\nG1 X15. Y0.\n#SPLINE OFF";
    let found = right(Dialect::Beckhoff, spline);
    let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
    assert_eq!(curve.points().len(), 4);
    let bad = |body: &str, rule| refused(Dialect::Beckhoff, body, rule);
    bad(&spline.replace("#SPLINE TYPE BSPLINE\n", ""), "beckhoff-type");
    bad(&spline.replace("G1 X10. Y5.\n", ""), "beckhoff-points");
    bad(&spline.replace("G1 X10. Y5.", "G2 X10. Y5. I1."), "beckhoff-word");
    bad("#SPLINE OFF", "beckhoff-off");
}

#[test]
fn catia_statements() {
    let nurbs = "BEGIN NURBS_SIEMENS(D=3,F=4000.,AXIS=0.,0.,1.);\nN0,XT=0.,YT=0.,ZT=0.,DK=0.,W=1.;\n\
                 N1,XT=10.,YT=10.,ZT=0.,DK=0.,W=1.;\nN2,XT=20.,YT=10.,ZT=0.,DK=30.,W=1.;\n\
                 N3,XT=30.,YT=0.,ZT=0.,DK=0.,W=1.;\nEND NURBS;";
    let found = right(Dialect::AptCatia, nurbs);
    let (_, feed, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
    assert_eq!((*feed, curve.domain()), (4000.0, (0.0, 30.0)));
    let bad = |body: &str, rule| refused(Dialect::AptCatia, body, rule);
    bad(&nurbs.replace("N2,", "N4,"), "catia-point");
    bad(&nurbs.replace(",W=1.;\nN2", ";\nN2"), "catia-point");
    bad(&nurbs.replace("DK=30.", "DK=-30."), "catia-dk");
    bad(&nurbs.replace("DK=0.,W=1.;\nEND", "DK=3.,W=1.;\nEND"), "catia-dk");
    bad(&nurbs.replace("D=3", "D=4"), "catia-begin");
    bad(&nurbs.replace("AXIS=0.,0.,1.", "AXIS=VAR"), "syntax");
    bad(&nurbs.replace("N0,XT=0.", "N0,XT=1."), "catia-start");
}

#[test]
fn creo_statements() {
    let nurbs = "MOVNRB/M3AXIS\nMOVNRB/ON,4,8,0,4,33.\nMOVNRB/1,0.,0.,0.,0.,1.,1.,$\n1.,1.\n\
                 MOVNRB/2,0.,0.,0.,10.,10.,0.,20.,10.,0.,30.,0.,0.\nMOVNRB/NEXT\nGOTO/0.,0.,0.\nGOTO/30.,0.,0.\nMOVNRB/OFF";
    let found = right(Dialect::AptCreo, nurbs);
    assert!(matches!(&found[..], [(false, 600.0, Shape::Spline(_))]), "{found:?}");
    let bad = |body: &str, rule| refused(Dialect::AptCreo, body, rule);
    bad(&nurbs.replace("ON,4,8,0,4", "ON,4,8,4,4"), "movnrb-weights");
    bad(&nurbs.replace("ON,4,8,0,4", "ON,4,9,0,4"), "movnrb-count");
    bad(&nurbs.replace("20.,10.,0.,30.", "30."), "movnrb-count");
    bad(&nurbs.replace("GOTO/30.,0.,0.", "GOTO/29.,0.,0."), "movnrb-goto");
    let long: Vec<String> = (0..25).map(|i| format!("{i}.")).collect();
    let long = format!("MOVNRB/ON,4,29,0,25,1.\nMOVNRB/1,{}", long.join(","));
    bad(&long, "movnrb-24");
    bad(&nurbs.replace("MOVNRB/NEXT", "SPINDL/OFF"), "movnrb-within");
}

#[test]
fn step_nc_runs_what_the_project_lists() {
    let file = |tail: &str| {
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('MACHINING_SCHEMA'));\nENDSEC;\nDATA;\n\
             #1=CARTESIAN_POINT('',(0.,0.,0.));\n#2=CARTESIAN_POINT('',(10.,10.,0.));\n\
             #3=CARTESIAN_POINT('',(20.,0.,0.));\n\
             #4=B_SPLINE_CURVE_WITH_KNOTS('',2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);\n\
             #5=MILLING_TECHNOLOGY(0.1,.TCP.,$,200.,$,.F.,.F.,.F.,$);\n\
             #6=CUTTER_LOCATION_TRAJECTORY(.T.,.CONTACT.,$,#5,$,.T.,#4,$,$);\n#7=TOOLPATH_LIST((#6));\n\
             #8=WORKPLAN('',(#7),$,$,$);\n{tail}\nENDSEC;\nEND-ISO-10303-21;\n"
        )
    };
    let project = "#9=PROJECT('',#8,(),$,$,$);";
    let machine = Machine::default();
    let found = blocks(&file(project), Dialect::StepNc);
    assert!(matches!(&found[..], [(false, f, Shape::Spline(_))] if (f - 6000.0).abs() < 1e-9), "{found:?}");
    let rule = |text: &str| check(text, Dialect::StepNc, &machine).unwrap_err().1.rule;
    assert_eq!(rule(&file("")), "step-nc-project");
    assert_eq!(rule(&file("#9=PROJECT('',#77,(),$,$,$);")), "step-nc-missing");
    assert_eq!(rule(&file("#9=PROJECT('',#10,(),$,$,$);\n#10=WORKPLAN('',(#10),$,$,$);")), "step-nc-cycle");
    assert_eq!(rule(&file(project).replace("(3,3)", "(3,2)")), "step-nc-curve");
    assert_eq!(rule(&file(project).replace("#4,$,$)", "#4,#4,$)")), "axis");
    assert_eq!(rule(&file(project).replace("CUTTER_LOCATION", "CUTTER_CONTACT")), "step-nc-contact");
    assert_eq!(rule(&file(project).replace("END-ISO-10303-21;", "")), "program-end");
    let rational = file(project).replace(
        "B_SPLINE_CURVE_WITH_KNOTS('',2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.)",
        "(BOUNDED_CURVE() B_SPLINE_CURVE(2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.)\nB_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),\
         .UNSPECIFIED.) CURVE() RATIONAL_B_SPLINE_CURVE((1.,0.5,1.)) REPRESENTATION_ITEM(''))",
    );
    let found = blocks(&rational, Dialect::StepNc);
    let (_, _, Shape::Spline(curve)) = &found[0] else { panic!("{found:?}") };
    assert_eq!(curve.weights(), Some(&[1.0, 0.5, 1.0][..]));
}

#[test]
fn plain_g_code() {
    let found = right(Dialect::G1, "G1 X10. Y0.\nG18 G3 X0. Z10. I-10. K0.\nG17\nG0 Z50.");
    let (_, _, Shape::Arc(arc)) = &found[1] else { panic!("{found:?}") };
    // G18 sees X to the left of Z: from +X to +Z is clockwise, counterclockwise takes the long way.
    assert!((arc.sweep() - 1.5 * std::f64::consts::PI).abs() < 1e-9);
    assert!(found[2].0);
    let bad = |body: &str, rule| refused(Dialect::G1, body, rule);
    bad("G2 X10. Y0. I3. J0.", "arc-radius");
    bad("G2 X10. Y0. R5.", "arc-radius-word");
    bad("G1 X10. A5.", "axis");
    bad("G68 R30.", "unknown-code");
    bad("G1 Q5.", "unknown-word");
    assert_eq!(check("G1 X1. F100.\nM30", Dialect::G1, &Machine::default()).unwrap_err().1.rule, "position");
    assert_eq!(
        check("G0 X1. Y0. Z0.\nG1 X2.\nM30", Dialect::G1, &Machine::default()).unwrap_err().1.rule,
        "feed"
    );
    assert_eq!(check("G0 X1.", Dialect::G1, &Machine::default()).unwrap_err().1.rule, "program-end");
}

#[test]
fn linuxcnc_takes_no_arc_for_a_point() {
    for dialect in [Dialect::LinuxCnc29, Dialect::LinuxCnc210] {
        right(dialect, "G2 X0.0040 Y0. I0.0020 J0.");
        refused(dialect, "G2 X0.0012 Y0.0004 I0.0006 J0.0002", "linuxcnc-zero-radius");
    }
}
