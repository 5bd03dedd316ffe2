//! Certified contacts against the search among all candidates.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::atomic::Ordering;

use claymill_nurbs::analytic::{self, Frame as Placement};
use claymill_nurbs::{Face, KnotVector, Model, NurbsSurface, Point3, Vector3};
use claymill_tests::model_of;
use rayon::prelude::*;

use crate::Frame;
use crate::certificate::one_sheet::{SHARED, upward};
use crate::drop::{Triangle, weighted};
use crate::{BallDrop, CONTACT_EPSILON_MM, Covering, March};

const R: f64 = 10.0;
const SAME_MM: f64 = 1e-7;

impl BallDrop<'_> {
    /// Forgets what is certified, for good.
    fn searching(self) -> Self {
        self.certificates.triangles.iter().for_each(|t| t.store(SHARED, Ordering::Relaxed));
        self
    }
}

fn top() -> Frame {
    Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap()[0]
}

fn covered(model: &Model, radius_mm: f64) -> Covering {
    let area_mm2 = model.faces.iter().map(Face::area_mm2).sum();
    Covering::new(model, &vec![false; model.faces.len()], area_mm2, radius_mm).unwrap()
}

/// A gentle wave of ± 2 mm, 160 mm long and wide, lifted and moved; bent along two directions.
fn wave(lifted: f64, (x0, x1): (f64, f64)) -> NurbsSurface {
    let knots = || KnotVector::clamped_uniform(3, 12);
    let at = |k: usize| -1.0 + 2.0 * k as f64 / 11.0;
    let net = (0..12).flat_map(|i| {
        (0..12).map(move |j| {
            let x = x0 + (x1 - x0) * 0.5 * (at(i) + 1.0);
            Point3::new(x, 80.0 * at(j), lifted + 2.0 * (x / 30.0).sin() * (2.0 * at(j)).cos())
        })
    });
    NurbsSurface::new(knots(), knots(), net.collect(), None).unwrap()
}

fn sphere(centre: Point3, radius_mm: f64) -> NurbsSurface {
    let frame = Placement::new(centre, Vector3::z(), Vector3::x()).unwrap();
    analytic::sphere(&frame, radius_mm, (0.0, TAU), (-FRAC_PI_2, FRAC_PI_2)).unwrap()
}

/// What a grid of drops comes to: certified ones, all, and the largest difference of certified ones from the search on
/// another model.
fn compare(of: &Model, truth: &Model) -> (usize, usize, f64) {
    let (covering, other) = (covered(of, R), covered(truth, R));
    let ball = BallDrop::new(of, &covering, &top(), R);
    let searching = BallDrop::new(truth, &other, &top(), R).searching();
    let (mut certified, mut all, mut apart) = (0, 0, 0.0f64);
    for j in 0..60 {
        let mut march = March::new(&ball);
        for i in 0..120 {
            let (x, y) = (-59.3 + f64::from(i), -59.1 + 2.0 * f64::from(j));
            let (Some(found), Some(exact)) = (march.drop(x, y), searching.drop(x, y)) else { continue };
            assert!(!exact.certified);
            all += 1;
            if found.certified {
                certified += 1;
                apart = apart.max((found.centre.z - exact.centre.z).abs());
            }
        }
    }
    (certified, all, apart)
}

#[test]
fn a_smooth_sheet_is_certified_and_what_stands_beside_it_is_not() {
    let sheet = || wave(0.0, (-80.0, 80.0));
    let smooth = model_of([sheet()]);
    let (certified, all, apart) = compare(&smooth, &smooth);
    assert!(certified == all && apart < SAME_MM, "{certified} of {all}, {apart}");
    let height = |x: f64, y: f64| {
        let covering = covered(&smooth, R);
        BallDrop::new(&smooth, &covering, &top(), R).drop(x, y).unwrap().centre.z - R
    };
    let on = |x: f64, y: f64, above: f64| Point3::new(x, y, height(x, y) + above);
    // What spoils it, and how many of the locations it may and must cost.
    let plate = |above: f64| {
        let frame = Placement::new(on(20.0, 10.0, above), Vector3::z(), Vector3::x()).unwrap();
        analytic::plane_patch(&frame, (-6.0, 6.0), (-6.0, 6.0)).unwrap()
    };
    let spoilers: [(&str, Vec<NurbsSurface>); 6] = [
        ("needle", vec![sphere(on(3.0, 4.0, 0.2), 0.05)]),
        ("bump", vec![sphere(on(-21.0, 4.0, -3.0), 4.0)]),
        ("plate just above", vec![plate(0.3)]),
        ("plate far above", vec![plate(25.0)]),
        ("plate through the sheet", vec![plate(0.0)]),
        ("sheet just above half of it", vec![wave(0.02, (0.0, 80.0))]),
    ];
    for (name, spoiler) in spoilers {
        let half = name.starts_with("sheet");
        let spoiled = model_of(std::iter::once(sheet()).chain(spoiler));
        let (certified, all, apart) = compare(&spoiled, &spoiled);
        assert!(apart < SAME_MM, "{name}: {apart}");
        let fewest = if half { 0.25 } else { 0.8 };
        assert!(certified < all && certified as f64 > fewest * all as f64, "{name}: {certified} of {all}");
        // Were the spoiler not seen, this would show it.
        let (_, _, missed) = compare(&smooth, &spoiled);
        assert!(missed > 100.0 * CONTACT_EPSILON_MM, "{name}: {missed}");
    }
    let below = model_of([sheet(), wave(-0.5, (-80.0, 80.0))]);
    let (certified, all, apart) = compare(&below, &below);
    assert!(certified as f64 > 0.95 * all as f64 && apart < SAME_MM, "{certified} of {all}, {apart}");
}

/// Two halves of a wave are one sheet over their joint; turned down or lifted against each other they are not.
#[test]
fn a_sheet_goes_on_over_a_joint_without_a_step() {
    let parted = |lifted: f64| {
        let (near, far) = wave(0.0, (-80.0, 80.0)).split_u(0.5).unwrap();
        let far = far.mapped(|p| p + Vector3::new(0.0, 0.0, lifted));
        model_of([near, far])
    };
    let (certified, all, apart) = compare(&parted(0.0), &parted(0.0));
    assert!(certified as f64 > 0.99 * all as f64 && apart < SAME_MM, "{certified} of {all}, {apart}");
    for step in [1e-3, 0.1, 2.0] {
        let (certified, all, apart) = compare(&parted(step), &parted(step));
        assert!(certified as f64 > 0.7 * all as f64 && apart < SAME_MM, "{certified} of {all}, {apart}");
        let (_, _, missed) = compare(&parted(0.0), &parted(step));
        assert!(missed > 0.5 * step);
    }
    for turned_deg in [-20.0f64, -0.5, 0.5, 20.0] {
        let (sine, cosine) = turned_deg.to_radians().sin_cos();
        let half = |side: f64| {
            let along = Vector3::new(cosine, 0.0, side * sine);
            let frame = Placement::new(Point3::origin(), along.cross(&Vector3::y()), along).unwrap();
            let range = if side > 0.0 { (0.0, 80.0) } else { (-80.0, 0.0) };
            analytic::plane_patch(&frame, range, (-80.0, 80.0)).unwrap()
        };
        let roof = model_of([half(-1.0), half(1.0)]);
        let (certified, all, apart) = compare(&roof, &roof);
        assert!(apart < SAME_MM, "{turned_deg}: {apart}");
        assert!(certified as f64 > 0.6 * all as f64, "{turned_deg}: {certified} of {all}");
    }
}

/// A slope of two faces, and one that crosses their joint: it goes on from neither.
#[test]
fn a_face_that_crosses_a_joint_is_no_part_of_the_sheet() {
    let slope = wave(0.0, (-80.0, 80.0)).mapped(|p| p + Vector3::new(0.0, 0.0, 0.8 * p.x));
    let (near, far) = slope.split_v(0.5).unwrap();
    let mut crossings = 0;
    for k in 0..40 {
        let across = wave(0.3 * f64::from(k), (-80.0, 80.0));
        let across = across.mapped(|p| p + Vector3::new(0.0, 0.0, 0.3 * p.y));
        let model = model_of([near.clone(), far.clone(), across]);
        let covering = covered(&model, R);
        let ball = BallDrop::new(&model, &covering, &top(), R);
        for (triangle, of) in ball.triangles.iter().enumerate().filter(|(_, t)| t.face < 2) {
            for side in 0..3 {
                let Some(joint) = ball.joint(triangle as u32, side) else { continue };
                if joint.onward.iter().any(|(other, _)| ball.triangles[*other as usize].face == 2) {
                    crossings += 1;
                    assert!(!joint.is_sound, "{k}: face {} goes on in what crosses it", of.face);
                }
            }
        }
    }
    assert!(crossings > 20, "{crossings}");
}

/// Two faces of a ship's bow hang together; beside that a crack of a quarter of a millimetre is between them, and one lip
/// stands above the other.
#[test]
fn a_sheet_does_not_go_on_across_a_crack() {
    let Some(folder) = claymill_tests::corpus() else { return };
    let model = claymill_exchange::read(&folder.join("ship_hull_55.iges")).unwrap().model;
    let covering = covered(&model, R);
    let [_, left, ..] = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    let ball = BallDrop::new(&model, &covering, &left, R);
    let searching = BallDrop::new(&model, &covering, &left, R).searching();
    let mut certified = 0;
    for k in 0..600 {
        let (x, y) = (-2520.0 + 0.5 * f64::from(k % 100), -198.0 + 8.0 * f64::from(k / 100));
        let found = ball.drop(x, y).unwrap();
        certified += u32::from(found.certified);
        let apart = (found.centre.z - searching.drop(x, y).unwrap().centre.z).abs();
        assert!(apart < CONTACT_EPSILON_MM + SAME_MM, "at {x} {y}: {apart}");
    }
    assert!(certified > 200, "{certified}");
}

/// On real parts, from above: along rows with certificates against the search from scratch.
#[test]
fn certified_locations_are_those_of_the_search() {
    let Some(folder) = claymill_tests::corpus() else { return };
    for (name, least) in [
        ("race_car_nose_141.stp", 0.25),
        ("helmet_928.igs", 0.2),
        ("ship_hull_55.iges", 0.8),
        ("prismatic_ctc05_inch.stp", 0.3),
    ] {
        let model = claymill_exchange::read(&folder.join(name)).unwrap().model;
        let covering = covered(&model, R);
        let ball = BallDrop::new(&model, &covering, &top(), R);
        let searching = BallDrop::new(&model, &covering, &top(), R).searching();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        ball.for_each_box(|b| {
            low = [low[0].min(b.min.x), low[1].min(b.min.y)];
            high = [high[0].max(b.max.x), high[1].max(b.max.y)];
        });
        let (mut certified, mut all) = (0u32, 0u32);
        for row in 0..40 {
            let y = low[1] + (high[1] - low[1]) * (f64::from(row) + 0.37) / 40.0;
            let mut march = March::new(&ball);
            for k in 0..400 {
                let x = low[0] + (high[0] - low[0]) * (f64::from(k) + 0.41) / 400.0;
                let Some(found) = march.drop(x, y) else { continue };
                all += 1;
                if found.certified {
                    certified += 1;
                    let exact = searching.drop(x, y).unwrap().centre.z;
                    let apart = (found.centre.z - exact).abs();
                    // The search itself leaves out what is higher by less.
                    assert!(apart < CONTACT_EPSILON_MM + SAME_MM, "{name} at {x} {y}: {apart}");
                }
            }
        }
        assert!(f64::from(certified) > least * f64::from(all), "{name}: {certified} of {all}");
    }
}

/// Places in a triangle: close to its corners and in its middle.
const PLACES: [[f64; 3]; 4] = [[0.9, 0.05, 0.05], [0.05, 0.9, 0.05], [0.05, 0.05, 0.9], [1.0 / 3.0; 3]];

/// How many contacts inside of certified triangles were looked at from five directions, how much higher the search finds a
/// ball held than there, at most, and where.
fn worst_of_certified(model: &Model, radius_mm: f64) -> (u64, f64, Point3) {
    let covering = covered(model, radius_mm);
    let nothing = || (0u64, 0.0f64, Point3::origin());
    let join = |a: (u64, f64, Point3), b: (u64, f64, Point3)| {
        let (_, higher_mm, at) = if b.1 > a.1 { b } else { a };
        (a.0 + b.0, higher_mm, at)
    };
    let of_frame = |frame: Frame| {
        let ball = BallDrop::new(model, &covering, &frame, radius_mm);
        let searching = BallDrop::new(model, &covering, &frame, radius_mm).searching();
        let of_place = |t: &Triangle, at: [f64; 3]| {
            let (mesh, face) = (&covering.meshes[t.face as usize], &ball.faces[t.face as usize]);
            let uv = weighted(&mesh.triangles[t.index as usize].map(|i| mesh.uv[i as usize]), at);
            let jet = face.leaves.jet(uv.x, uv.y);
            let Some(normal) = jet.normal().map(upward) else { return nothing() };
            if face.domain.as_ref().is_some_and(|d| !d.contains(uv.x, uv.y)) {
                return nothing();
            }
            let centre = jet.p + normal * radius_mm;
            let higher = searching.drop_above(centre.x, centre.y, centre.z + CONTACT_EPSILON_MM);
            (1, higher.map_or(0.0, |rest| rest.centre.z - centre.z), centre)
        };
        let of_triangle = |index: usize| {
            let t = &ball.triangles[index];
            let places = PLACES.iter().filter(|_| ball.is_alone(index as u32));
            places.map(|at| of_place(t, *at)).fold(nothing(), join)
        };
        (0..ball.triangles.len()).into_par_iter().map(of_triangle).reduce(nothing, join)
    };
    let frames = Frame::five("+z".parse().unwrap(), "+x".parse().unwrap()).unwrap();
    frames.map(of_frame).into_iter().fold(nothing(), join)
}

#[test]
fn nothing_rises_beside_a_certified_contact_of_real_models() {
    let Some(folder) = claymill_tests::corpus() else { return };
    let balls = [
        ("helmet_928.igs", 3.0),
        ("perfume_bottle.3dm", 3.0),
        ("prismatic_ctc05_inch.stp", 3.0),
        ("race_car_nose_141.stp", 10.0),
        ("ship_hull_55.iges", 10.0),
    ];
    for (name, radius_mm) in balls {
        let model = claymill_exchange::read(&folder.join(name)).unwrap().model;
        let (places, higher_mm, at) = worst_of_certified(&model, radius_mm);
        println!("{name}, ball of {radius_mm} mm: {places} places, none higher by more than {higher_mm} mm");
        assert!(places > 5_000, "{name}: {places}");
        // What a location may be too low by anyway, as much again for cracks that a ball hardly sinks into.
        assert!(higher_mm <= CONTACT_EPSILON_MM, "{name}: {higher_mm} mm at {at}");
    }
}
