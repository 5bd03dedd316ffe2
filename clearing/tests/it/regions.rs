//! Regions of levels against closed forms.

use std::f64::consts::{FRAC_PI_2, TAU};

use claymill_clearing::{Reach, flats_mm, standing_flats_mm};
use claymill_contact::{CONTACT_EPSILON_MM, Covering};
use claymill_nurbs::analytic::{Frame as Placement, plane_patch, sphere};
use claymill_nurbs::{Model, Point3, Vector3};
use claymill_tests::model_of;

use crate::pockets::top;

pub(crate) fn ball_part(radius_mm: f64, latitudes: (f64, f64)) -> Model {
    let at = Placement::new(Point3::origin(), Vector3::z(), Vector3::x()).expect("a placement");
    let surface = sphere(&at, radius_mm, (0.0, TAU), latitudes).expect("a sphere");
    model_of([surface])
}

/// The radius of the border about the axis, on the mean and its largest deviation.
fn border(model: &Model, tool: &str, [z, allowance]: [f64; 2], within: [f64; 2]) -> [f64; 2] {
    let tool = tool.parse().expect("a tool");
    let covering = Covering::new(model, &[false], model.faces[0].area_mm2(), 5.0).expect("covered");
    let around = [-60.0, -60.0, 60.0, 60.0];
    let reach = Reach::new(model, &covering, &top(), &tool, allowance, around).expect("a reach");
    let region = reach.region(z, &()).expect("a region");
    let radii: Vec<f64> = region
        .contours()
        .iter()
        .flatten()
        .map(|[x, y]| x.hypot(*y))
        .filter(|r| (within[0]..within[1]).contains(r))
        .collect();
    assert!(radii.len() > 100, "{}", radii.len());
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    [mean, radii.iter().map(|r| (r - mean).abs()).fold(0.0, f64::max)]
}

fn is_near([mean, spread]: [f64; 2], wanted: f64) {
    // Heights of contacts are known to this, and these borders move by less than their height.
    assert!(
        (mean - wanted).abs() < CONTACT_EPSILON_MM && spread < 5e-5,
        "{mean} ± {spread} instead of {wanted}"
    );
}

#[test]
fn a_dome() {
    let dome = ball_part(50.0, (0.0, FRAC_PI_2));
    let around = [30.0, 56.0];
    // Cylindrical allowance: a wider tool that stays higher.
    is_near(border(&dome, "flat:5.5", [29.5, 0.0], around), 45.870_162_249);
    is_near(border(&dome, "flat:5", [30.0, 0.5], around), 45.623_269_194);
    is_near(border(&dome, "ball:5", [30.0, 0.5], around), 43.072_613_109);
    is_near(border(&dome, "bull:5:1", [30.0, 0.5], around), 45.124_810_030);
}

#[test]
fn a_bowl() {
    let bowl = ball_part(50.0, (-FRAC_PI_2, 0.0));
    is_near(border(&bowl, "ball:5", [-25.0, 0.5], [30.0, 42.0]), 39.752_358_421);
    is_near(border(&bowl, "flat:5", [-20.0, 0.5], [30.0, 42.0]), 40.279_686_395);
}

/// How much chords of a region's border come too near to domes of 5 mm that keep a tool of 20 mm off by 24 mm at a height of 3 mm, at
/// most, mm.
fn too_near_mm(middles: &[[f64; 2]]) -> f64 {
    let at = |[x, y]: [f64; 2]| Placement::new(Point3::new(x, y, 0.0), Vector3::z(), Vector3::x());
    let dome = |middle: &[f64; 2]| {
        sphere(&at(*middle).expect("a placement"), 5.0, (0.0, TAU), (0.0, FRAC_PI_2)).expect("a sphere")
    };
    let domes = model_of(middles.iter().map(dome));
    let covering = Covering::new(&domes, &vec![false; middles.len()], domes.faces[0].area_mm2(), 5.0);
    let covering = covering.expect("covered");
    let tool = "flat:20".parse().expect("a tool");
    let reach =
        Reach::new(&domes, &covering, &top(), &tool, 0.0, [-60.0, -60.0, 60.0, 60.0]).expect("a reach");
    let region = reach.region(3.0, &()).expect("a region");
    let mut nearest = f64::INFINITY;
    for contour in region.contours() {
        for (a, b) in contour.iter().zip(contour.iter().cycle().skip(1)) {
            for [x, y] in middles {
                nearest = nearest.min((0.5 * (a[0] + b[0]) - x).hypot(0.5 * (a[1] + b[1]) - y));
            }
        }
    }
    assert!(nearest < 24.1, "no border beside them");
    24.0 - nearest
}

/// Around a small dome the border is bent as tightly as the tool is round, and cells are a sixteenth of that. Between two domes it runs
/// through cells twice.
#[test]
fn chords_of_a_border_keep_the_allowance() {
    for middles in [&[[0.0, 0.0]][..], &[[-24.03, 0.31], [24.04, 0.31]]] {
        // Vertices are left out within 1.5 micrometres.
        let too_near_mm = too_near_mm(middles);
        assert!(too_near_mm.abs() < 3e-3, "{too_near_mm}");
    }
}

/// A step at the edge of a part is a flat though no tool fits onto it with all of its width; one as narrow as the allowance of the
/// wall behind it is none.
#[test]
fn a_step_narrower_than_the_tool_is_a_flat() {
    let plate = |z: f64, [x0, x1]: [f64; 2]| {
        let at = Placement::new(Point3::new(0.0, 0.0, z), Vector3::z(), Vector3::x()).expect("a placement");
        plane_patch(&at, (x0, x1), (0.0, 20.0)).expect("a plate")
    };
    let standing = |width_mm: f64| {
        let model = model_of([plate(4.0, [0.0, width_mm]), plate(10.0, [width_mm, 20.0])]);
        let covering = Covering::new(&model, &[false; 2], 400.0, 3.0).expect("covered");
        let tool = "flat:3".parse().expect("a tool");
        let reach = Reach::new(&model, &covering, &top(), &tool, 0.4, [-10.0, -10.0, 30.0, 30.0]);
        let flats = flats_mm(&model, &top(), 0.4);
        standing_flats_mm(&reach.expect("a reach"), &flats, 3.0, &()).expect("flats")
    };
    assert_eq!(standing(1.2), [10.4, 4.4]);
    assert_eq!(standing(0.4), [10.4]);
}
