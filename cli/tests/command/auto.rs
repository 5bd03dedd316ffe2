//! The choice among strategies: the cheapest is cut, and those given up were dearer already.

use std::f64::consts::PI;

use claymill_nurbs::analytic::{Frame, cylinder, sphere};
use claymill_nurbs::{NurbsSurface, Point3, Vector3};
use claymill_toolpath::{Considered, Job};

use crate::scratch;
use crate::steep::planned;

/// A lying cylinder and a cap beside it.
fn shapes() -> Vec<NurbsSurface> {
    let lying = Frame::new(Point3::origin(), Vector3::x(), Vector3::z()).unwrap();
    let barrel = cylinder(&lying, 40.0, (-1.2, 1.2), (0.0, 80.0)).unwrap();
    let upright = Frame::new(Point3::new(150.0, 0.0, 0.0), Vector3::z(), Vector3::x()).unwrap();
    vec![barrel, sphere(&upright, 30.0, (0.0, 2.0 * PI), (0.3, 1.4)).unwrap()]
}

fn cost_mm(c: &Considered) -> f64 {
    // What a turn counts as, in length.
    c.length_mm + 60.0 * f64::from(c.passes)
}

#[test]
fn auto_cuts_what_costs_least_and_lays_no_other_to_its_end_in_vain() {
    let folder = scratch();
    let laid = |strategy: &str| planned(folder.path(), shapes(), &["--strategy", strategy], strategy).0;
    let chosen = laid("auto");
    let alone: Vec<Job> = ["planar", "flow", "scallop", "isoparametric"].map(laid).into();
    let mut given_up = 0;
    for part in &chosen.regions {
        assert_eq!(part.considered.len(), alone.len());
        let whole: Vec<&Considered> = (alone.iter().flat_map(|job| &job.regions))
            .filter(|r| (r.region, &r.setup) == (part.region, &part.setup))
            .map(|r| &r.considered[0])
            .collect();
        let least = whole.iter().copied().min_by(|a, b| cost_mm(a).total_cmp(&cost_mm(b))).unwrap();
        assert_eq!(part.strategy, least.strategy);
        for (laid, whole) in part.considered.iter().zip(&whole) {
            assert_eq!(laid.strategy, whole.strategy);
            if laid.given_up {
                assert!(
                    cost_mm(laid) >= cost_mm(least) && cost_mm(laid) <= cost_mm(whole),
                    "{laid:?} {whole:?}"
                );
                given_up += 1;
            } else {
                assert_eq!(laid, *whole);
            }
        }
    }
    assert!(given_up > 0, "{:?}", chosen.regions);
}
