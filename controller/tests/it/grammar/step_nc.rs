use claymill_controller::Dialect;

use super::{curve, fact, hold, with};

const FILE: &str = "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('MACHINING_SCHEMA'));\nENDSEC;\nDATA;\n\
    #1=CARTESIAN_POINT('',(0.,0.,0.));\n\
    #2=CARTESIAN_POINT('',(10.,10.,0.));\n\
    #3=CARTESIAN_POINT('',(20.,0.,0.));\n\
    #4=B_SPLINE_CURVE_WITH_KNOTS('',2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.);\n\
    #5=MILLING_TECHNOLOGY(0.1,.TCP.,$,200.,$,.F.,.F.,.F.,$);\n\
    #6=CUTTER_LOCATION_TRAJECTORY(.T.,.CONTACT.,$,#5,$,.T.,#4,$,$);\n\
    #7=TOOLPATH_LIST((#6));\n\
    #8=WORKPLAN('',(#7),$,$,$);\n\
    #9=PROJECT('',#8,(),$,$,$);\n\
    ENDSEC;\nEND-ISO-10303-21;\n";

/// The curve with weights, as a complex instance.
fn rational(weights: &str) -> String {
    let complex = format!(
        "(BOUNDED_CURVE() B_SPLINE_CURVE(2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.)\n\
         B_SPLINE_CURVE_WITH_KNOTS((3,3),(0.,1.),.UNSPECIFIED.) CURVE() GEOMETRIC_REPRESENTATION_ITEM()\n\
         RATIONAL_B_SPLINE_CURVE({weights}) REPRESENTATION_ITEM(''))"
    );
    let simple =
        "B_SPLINE_CURVE_WITH_KNOTS('',2,(#1,#2,#3),.UNSPECIFIED.,.F.,.F.,(3,3),(0.,1.),.UNSPECIFIED.)";
    with(FILE, simple, &complex)
}

/// With a second trajectory along a line from `#3` or elsewhere.
fn two(from: &str) -> String {
    let line = format!(
        "#20=CARTESIAN_POINT('',(30.,0.,0.));\n#21=POLYLINE('',({from},#20));\n\
         #22=CUTTER_LOCATION_TRAJECTORY(.T.,.CONTACT.,$,#5,$,.T.,#21,$,$);\n#7=TOOLPATH_LIST((#6,#22));"
    );
    with(FILE, "#7=TOOLPATH_LIST((#6));", &line)
}

#[test]
fn facts() {
    let file = |from, to| with(FILE, from, to);
    let facts = [
        fact("the project's plan is what is run")
            .right(FILE)
            .refused(file("#9=PROJECT('',#8,(),$,$,$);\n", ""), "step-nc-project")
            .refused(file("PROJECT('',#8", "PROJECT('',#77"), "step-nc-missing")
            .refused(file("(#7),", "(#7,#8),"), "step-nc-cycle"),
        fact("instances have one meaning each")
            .right(FILE)
            .refused(file("#2=CARTESIAN", "#1=CARTESIAN"), "step-nc-twice"),
        fact("a trajectory is of locations; contacts leave the tool's place to the control")
            .right(FILE)
            .refused(file("CUTTER_LOCATION", "CUTTER_CONTACT"), "step-nc-contact"),
        fact("its axis is fixed; a surface normal may be given")
            .right(file("#4,$,$)", "#4,$,#4)"))
            .refused(file("#4,$,$)", "#4,#4,$)"), "axis"),
        fact("its feed is positive, in the technology")
            .right(FILE)
            .refused(file("TECHNOLOGY(0.1", "TECHNOLOGY(0."), "feed")
            .refused(file("$,#5,$", "$,#4,$"), "feed"),
        fact("a curve's degree is a whole number")
            .right(FILE)
            .refused(file("('',2,", "('',2.5,"), "step-nc-degree")
            .refused(file("('',2,", "('',0,"), "step-nc-degree"),
        fact("knots stand once each with their multiplicities, in all as many as points, degree and one")
            .right(FILE)
            .refused(file("(3,3)", "(3,2)"), "step-nc-curve")
            .refused(file("(3,3)", "(3,3,1)"), "step-nc-knots")
            .refused(file("(3,3)", "(3,-3)"), "step-nc-knots"),
        fact("knots increase").right(FILE).refused(file("(0.,1.)", "(1.,0.)"), "step-nc-curve"),
        fact("control points are points")
            .right(FILE)
            .refused(file("(#1,#2,#3)", "(#1,#5,#3)"), "step-nc-missing")
            .refused(file("(10.,10.,0.)", "(10.,10.)"), "syntax"),
        fact("a rational curve is a complex instance with a positive weight for each point")
            .right(rational("(1.,0.5,1.)"))
            .refused(rational("(1.,0.5)"), "step-nc-curve")
            .refused(rational("(1.,0.,1.)"), "step-nc-curve")
            .refused(rational("(1.,-1.,1.)"), "step-nc-curve"),
        fact("a curve begins where the one before it in its list ends")
            .right(two("#3"))
            .refused(two("#2"), "step-nc-gap"),
        fact("comments and strings may hold anything")
            .right(file("#5=", "/* #5=(; */ #5=").replace("WORKPLAN(''", "WORKPLAN('a;b'"))
            .refused(file("#5=", "/* #5=(;"), "program-end"),
        fact("the file has an end").right(FILE).refused(file("END-ISO-10303-21;", ""), "program-end"),
    ];
    hold(Dialect::StepNc, &facts);
}

#[test]
fn curves_are_those_of_the_file() {
    // 0.1 m/s.
    let (_, feed) = curve(Dialect::StepNc, FILE);
    assert!((feed - 6000.0).abs() < 1e-9);
    let (found, _) = curve(Dialect::StepNc, &rational("(1.,0.5,1.)"));
    assert_eq!(found.weights(), Some(&[1.0, 0.5, 1.0][..]));
}
