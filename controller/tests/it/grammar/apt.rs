use claymill_controller::{Dialect, Shape};

use super::{blocks, curve, fact, hold, with};

const CATIA: &str = "BEGIN NURBS_SIEMENS(D=3,F=4000.,AXIS=0.,0.,1.);\n\
    N0,XT=0.,YT=0.,ZT=0.,DK=0.,W=1.;\n\
    N1,XT=10.,YT=10.,ZT=0.,DK=0.,W=1.;\n\
    N2,XT=20.,YT=11.,ZT=0.,DK=30.,W=1.;\n\
    N3,XT=30.,YT=0.,ZT=0.,DK=0.,W=1.;\n\
    END NURBS;";
const CREO: &str = "MOVNRB/M3AXIS\nMOVNRB/ON,4,8,0,4,33.\n\
    MOVNRB/1,0.,0.,0.,0.,1.,1.,$\n1.,1.\n\
    MOVNRB/2,0.,0.,0.,10.,10.,0.,20.,10.,0.,30.,0.,0.\n\
    MOVNRB/NEXT\nGOTO/0.,0.,0.\nGOTO/30.,0.,0.\nMOVNRB/OFF";

/// `MOVNRB/1` or `2` with `count` values.
fn values(which: u32, count: usize) -> String {
    let values: Vec<String> = (0..count).map(|i| format!("{i}.")).collect();
    format!("MOVNRB/{which},{}", values.join(","))
}

#[test]
fn catia() {
    let nurbs = |from, to| with(CATIA, from, to);
    let facts = [
        fact("D is the degree")
            .right(CATIA)
            .refused(nurbs("D=3", "D=4"), "catia-begin")
            .refused(nurbs("D=3,", ""), "catia-begin"),
        fact("F is the feed").right(CATIA).refused(nurbs("F=4000.", "F=0."), "catia-begin"),
        fact("AXIS is fixed; one that varies is for five axes")
            .right(nurbs("AXIS=0.,0.,1.", "AXIS=0,0,1"))
            .refused(nurbs("AXIS=0.,0.,1.", "AXIS=VAR,LENGTH=100."), "axis")
            .refused(nurbs("AXIS=0.,0.,1.", "AXIS=0.,0.5,0.8"), "axis"),
        fact("points are numbered from N0 on")
            .right(CATIA)
            .refused(nurbs("N2,", "N4,"), "catia-point")
            .refused(nurbs("N0,", "N1,"), "catia-point"),
        fact("a point has XT, YT, ZT, DK and W, and ends with ;")
            .right(CATIA)
            .refused(nurbs(",W=1.;\nN2", ";\nN2"), "catia-point")
            .refused(nurbs("DK=30.,", ""), "catia-point")
            .refused(nurbs("YT=11.,", ""), "catia-point")
            .refused(nurbs("W=1.;\nN2", "W=1.\nN2"), "catia-point")
            .refused(nurbs("W=1.;\nN2", "W=1.,XH=0.;\nN2"), "catia-point"),
        fact("DK are differences of knots: not negative, the outer ones 0")
            .right(CATIA)
            .refused(nurbs("DK=30.", "DK=-30."), "catia-dk")
            .refused(nurbs("DK=0.,W=1.;\nEND", "DK=3.,W=1.;\nEND"), "catia-dk")
            .refused(nurbs("ZT=0.,DK=0.", "ZT=0.,DK=1."), "catia-dk"),
        fact("weights are positive")
            .right(nurbs("DK=30.,W=1.", "DK=30.,W=0.25"))
            .refused(nurbs("DK=30.,W=1.", "DK=30.,W=0."), "catia-weight"),
        fact("there are more points than the degree")
            .right(CATIA)
            .refused(nurbs("N3,XT=30.,YT=0.,ZT=0.,DK=0.,W=1.;\n", ""), "catia-point"),
        fact("END NURBS; ends it").right(CATIA).refused(nurbs("\nEND NURBS;", ""), "catia-point"),
        fact("the first point is the current position")
            .right(CATIA)
            .refused(nurbs("XT=0.", "XT=0.002"), "catia-start"),
        fact("MOVNRB is not CATIA's").right(CATIA).refused(CREO, "unknown-word"),
        fact("GOTO has a point, tool axes are for five axes")
            .right("GOTO/1.,2.,3.")
            .refused("GOTO/1.,2.,3.,0.,0.,1.", "axis"),
        fact("feeds are for a minute")
            .right("FEDRAT/5.,IPM\nGOTO/1.,2.,3.")
            .refused("FEDRAT/0.1,MMPR\nGOTO/1.,2.,3.", "feed-mode"),
        fact("nothing stands behind FINI")
            .right("GOTO/1.,2.,3.")
            .refused("FINI\nGOTO/1.,2.,3.", "program-end"),
    ];
    hold(Dialect::AptCatia, &facts);
    let (found, feed) = curve(Dialect::AptCatia, CATIA);
    assert_eq!((feed, found.domain()), (4000.0, (0.0, 30.0)));
}

#[test]
fn creo() {
    let nurbs = |from, to| with(CREO, from, to);
    let facts = [
        fact("ON has order, knots, weights, points and length")
            .right(CREO)
            .refused(nurbs("ON,4,8,0,4,33.", "ON,4,8,0,4"), "movnrb-on")
            .refused(nurbs("ON,4,8,0,4,33.", "ON,4.5,8,0,4,33."), "movnrb-on"),
        fact("there are no weights").right(CREO).refused(nurbs("ON,4,8,0,4", "ON,4,8,4,4"), "movnrb-weights"),
        fact("there are as many knots as points and the order")
            .right(CREO)
            .refused(nurbs("ON,4,8,0,4", "ON,4,9,0,4"), "movnrb-count"),
        fact("as many values follow as ON says")
            .right(CREO)
            .refused(nurbs("20.,10.,0.,30.", "30."), "movnrb-count")
            .refused(nurbs("$\n1.,1.", "1."), "movnrb-count")
            .refused(nurbs("30.,0.,0.\nMOVNRB/N", "30.,0.,0.,1.,1.,1.\nMOVNRB/N"), "movnrb-count"),
        fact("a statement has 24 values at most")
            .right(CREO)
            .refused(format!("MOVNRB/ON,4,29,0,25,1.\n{}", values(1, 25)), "movnrb-24")
            .refused(format!("MOVNRB/ON,4,29,0,25,1.\n{}", values(2, 27)), "movnrb-24"),
        fact("knots do not decrease")
            .right(CREO)
            .refused(nurbs("MOVNRB/1,0.,0.,0.,0.", "MOVNRB/1,2.,0.,0.,0."), "movnrb-curve"),
        fact("NEXT comes before the points of the fallback, and before OFF")
            .right(CREO)
            .refused(nurbs("MOVNRB/NEXT\n", ""), "movnrb-next")
            .refused(nurbs("MOVNRB/NEXT\nGOTO/0.,0.,0.\nGOTO/30.,0.,0.\n", ""), "movnrb-next"),
        fact("the fallback ends where the curve does")
            .right(CREO)
            .refused(nurbs("GOTO/30.,0.,0.", "GOTO/29.,0.,0."), "movnrb-goto")
            .refused(nurbs("GOTO/0.,0.,0.\nGOTO/30.,0.,0.\n", ""), "movnrb-goto"),
        fact("OFF ends it, and nothing else stands within")
            .right(CREO)
            .refused(nurbs("\nMOVNRB/OFF", ""), "movnrb-within")
            .refused(nurbs("MOVNRB/NEXT", "SPINDL/OFF"), "movnrb-within"),
        fact("ON comes first").right(CREO).refused(nurbs("MOVNRB/ON,4,8,0,4,33.\n", ""), "movnrb-off"),
        fact("the first point is the current position")
            .right(CREO)
            .refused(nurbs("MOVNRB/2,0.", "MOVNRB/2,0.002"), "movnrb-start"),
        fact("three axes; two curves and their distance are for five")
            .right(CREO)
            .refused(nurbs("M3AXIS", "M5AXIS"), "axis")
            .refused(nurbs("MOVNRB/ON", "MOVNRB/LENGTH,100.\nMOVNRB/ON"), "axis"),
        fact("NURBS_SIEMENS is not Creo's").right(CREO).refused(CATIA, "unknown-word"),
    ];
    hold(Dialect::AptCreo, &facts);
    let found = blocks(Dialect::AptCreo, CREO);
    assert!(matches!(&found[..], [(false, 600.0, Shape::Spline(_))]), "{found:?}");
}
