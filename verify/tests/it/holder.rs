//! Holder and shank over shapes whose clearances are known.

use crate::synthetic::{self, R, along, check, job, model, program, rectangle, straight};
use claymill_nurbs::{Curve3, KnotVector, Model, NurbsSurface, Point3, Vector3};
use claymill_toolpath::MoveKind::{Cut, LeadIn, Rapid};
use claymill_toolpath::{Holder, Job, Move, Setup, Tool};
use claymill_verify::{
    FindingCode, HolderClearance, Severity, Verification, VerifyOptions, stick_outs_needed_mm, verify_program,
};

/// Heights and distances are found to this: 0.01 mm, and what paths and surfaces may be from chords and triangles.
const FOUND: f64 = 0.02;

fn ruled(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> NurbsSurface {
    let knots = || KnotVector::clamped_uniform(1, 2);
    NurbsSurface::new(knots(), knots(), [a, b, c, d].map(Point3::from).to_vec(), None).unwrap()
}

/// A floor, and a wall of this height on it at `x = 0`.
fn wall(height: f64) -> Model {
    let wall = ruled([0.0, -100.0, 0.0], [0.0, 100.0, 0.0], [0.0, -100.0, height], [0.0, 100.0, height]);
    model([rectangle((0.0, 200.0), (-100.0, 100.0), 0.0), wall])
}

fn held(model: &Model, holder: &str, clearance_mm: f64, moves: Vec<Move>) -> Verification {
    let mut job = job(model);
    job.tools[0].holder = Some(Holder::parse(holder, &job.tools[0].tool).unwrap());
    let options = VerifyOptions { holder_clearance_mm: Some(clearance_mm), ..synthetic::options() };
    verify_program(model, &job, &program(moves), &options, &()).unwrap()
}

fn holder_of(v: &Verification) -> &HolderClearance {
    v.holder.as_ref().unwrap()
}

fn needed(v: &Verification) -> f64 {
    holder_of(v).stick_out_needed_mm(None).unwrap()
}

fn severity(v: &Verification) -> Option<Severity> {
    v.verdict.findings.iter().find(|f| f.code == FindingCode::Holder).map(|f| f.severity)
}

/// A pass on the floor along the wall, its axis this far from it.
fn beside(x: f64) -> Vec<Move> {
    vec![straight(Cut, 0, Point3::new(x, -50.0, R), Point3::new(x, 50.0, R))]
}

#[test]
fn beside_a_wall_the_stick_out_is_its_height_or_none_is_needed() {
    let model = wall(40.0);
    // A cylinder of radius 20: its rim clears the wall's top edge by 1 mm on a quarter circle about the rim.
    for x in [12.0_f64, 19.0, 20.2, 20.8, 21.5, 30.0] {
        let v = held(&model, "60:40x50", 1.0, beside(x));
        let outside = x - 20.0;
        let expected = if outside <= 0.0 {
            41.0
        } else if outside < 1.0 {
            40.0 + (1.0 - outside * outside).sqrt()
        } else {
            // The floor under the holder.
            R
        };
        let found = needed(&v);
        // Next to the vertical tangent a micrometre aside is more than a micrometre up.
        assert!((-1e-6..FOUND).contains(&(found - expected)), "{x}: {found} for {expected}");
        assert_eq!(severity(&v), None, "{x}");
        let place = holder_of(&v).regions[0].at.as_ref();
        if outside < 1.0 {
            let place = place.unwrap();
            assert!(place.point_mm[0].abs() < 0.01 && (place.point_mm[2] - 40.0).abs() < 0.01, "{place:?}");
            assert_eq!(
                (place.face, place.entity.as_deref(), place.move_seq),
                (Some(1), Some("DE 3"), Some(0))
            );
        }
    }
}

#[test]
fn the_distance_from_a_wall_is_that_of_the_textbook() {
    let model = wall(40.0);
    for (x, stick_out, expected) in [
        (23.0, 30.0, Some(3.0)),
        (23.0, 44.0, Some(5.0)),
        (12.0, 47.5, Some(7.5)),
        (12.0, 39.0, Some(0.0)),
        (12.0, 60.0, None),
    ] {
        let v = held(&model, &format!("{stick_out}:40x50"), 1.0, beside(x));
        let holder = holder_of(&v);
        match (holder.clearance_min_mm, expected) {
            (Some(found), Some(expected)) => {
                assert!((found - expected).abs() < FOUND, "{x}, {stick_out}: {found} for {expected}");
            }
            (found, expected) => assert_eq!(found, expected, "{x}, {stick_out}"),
        }
        let touches = expected == Some(0.0);
        assert_eq!((holder.touching, holder.near), (u64::from(touches), u64::from(touches)));
        assert_eq!(severity(&v), touches.then_some(Severity::Error));
    }
}

#[test]
fn a_millimetre_less_than_needed_is_found_and_a_hundredth_more_is_not() {
    let cases: [(Model, &str, Vec<Move>); 3] = [
        (wall(40.0), "27-40x50,63x26", beside(14.0)),
        (wall(55.0), "20x10,80x20", beside(18.0)),
        (
            wall(30.0),
            "34-27x50",
            vec![straight(Rapid, 0, Point3::new(60.0, 0.0, 14.0), Point3::new(12.0, 3.0, 11.0))],
        ),
    ];
    for (model, sections, moves) in cases {
        let of = |stick_out: f64| held(&model, &format!("{stick_out}:{sections}"), 1.0, moves.clone());
        let least = needed(&of(100.0));
        assert!(least > 15.0, "{least}");
        assert_eq!(severity(&of(least + 0.01)), None, "{sections}: {least}");
        assert_eq!(severity(&of(least - 0.05)), Some(Severity::Warning), "{sections}: {least}");
        let short = of(least - 1.0);
        assert!(severity(&short).is_some(), "{sections}: {least}");
        assert_eq!(severity(&of(least - 6.0)), Some(Severity::Error), "{sections}: {least}");
        let text = &short.verdict.findings.iter().find(|f| f.code == FindingCode::Holder).unwrap().message;
        assert!(text.contains("stick out") && text.contains("region 0"), "{text}");
    }
}

#[test]
fn each_setup_is_judged_with_its_own_stick_out() {
    let model = wall(40.0);
    let mut job = job(&model);
    job.setups.push(Setup { name: "again".into(), ..job.setups[0].clone() });
    job.tools[0].holder = Some(Holder::parse("60:27-40x50,63x26", &job.tools[0].tool).unwrap());
    let moves: Vec<Move> = ["top", "again"]
        .into_iter()
        .flat_map(|setup| beside(14.0).into_iter().map(move |m| Move { setup: setup.into(), ..m }))
        .collect();
    let judged =
        |job: &Job| verify_program(&model, job, &program(moves.clone()), &synthetic::options(), &()).unwrap();
    let stick_outs =
        |v: &Verification| ["top", "again"].map(|setup| holder_of(v).stick_out_mm(setup).unwrap());
    let one_for_all = judged(&job);
    assert_eq!((stick_outs(&one_for_all), severity(&one_for_all)), ([60.0, 60.0], None));
    assert_eq!(holder_of(&one_for_all).setups(), ["top", "again"]);

    job.tools[0].setup_stick_out_mm.insert("again".into(), 30.0);
    let short = judged(&job);
    assert_eq!((stick_outs(&short), severity(&short)), ([60.0, 30.0], Some(Severity::Error)));
    assert_eq!(holder_of(&short).touching, 1);
    let text = &short.verdict.findings.iter().find(|f| f.code == FindingCode::Holder).unwrap().message;
    assert!(text.contains("or more in again, or cut") && !text.contains("top"), "{text}");

    let options = VerifyOptions { holder: job.tools[0].holder.clone(), ..synthetic::options() };
    let instead = verify_program(&model, &job, &program(moves.clone()), &options, &()).unwrap();
    assert_eq!((stick_outs(&instead), severity(&instead)), ([60.0, 60.0], None));
    // What is needed does not depend on what there is.
    let needed = stick_outs_needed_mm(&model, &job, &program(moves.clone()), &synthetic::options(), &());
    let needed: Vec<f64> = needed.unwrap().into_values().collect();
    // The nose's rim, 13.5 mm from the axis, clears the wall's top edge by 1 mm.
    let expected = 40.0 + (1.0_f64 - 0.25).sqrt();
    assert!(
        needed.len() == 2 && needed.iter().all(|mm| (0.0..FOUND).contains(&(mm - expected))),
        "{needed:?}"
    );
}

/// A sphere of exact arcs about the origin.
fn sphere(radius: f64) -> NurbsSurface {
    let s = 0.5_f64.sqrt();
    let circle = [
        (1.0, 0.0, 1.0),
        (1.0, 1.0, s),
        (0.0, 1.0, 1.0),
        (-1.0, 1.0, s),
        (-1.0, 0.0, 1.0),
        (-1.0, -1.0, s),
        (0.0, -1.0, 1.0),
        (1.0, -1.0, s),
        (1.0, 0.0, 1.0),
    ];
    let meridian = [(0.0, -1.0, 1.0), (1.0, -1.0, s), (1.0, 0.0, 1.0), (1.0, 1.0, s), (0.0, 1.0, 1.0)];
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for (x, y, w) in circle {
        for (out, up, v) in meridian {
            points.push(Point3::new(x * out, y * out, up) * radius);
            weights.push(w * v);
        }
    }
    let quarters = |n: usize| {
        let inner = (1..n).flat_map(|k| [k as f64, k as f64]);
        KnotVector::new(2, [0.0; 3].into_iter().chain(inner).chain([n as f64; 3]).collect()).unwrap()
    };
    NurbsSurface::new(quarters(4), quarters(2), points, Some(weights)).unwrap()
}

#[test]
fn a_cone_beside_a_sphere() {
    let (radius, clearance) = (30.0, 1.0);
    let model = model([sphere(radius)]);
    // The tip at the height of the middle runs past it at x = 45; the cone opens by 45° from 10 to 40 mm radius.
    let pass = vec![straight(LeadIn, 0, Point3::new(45.0, -20.0, R), Point3::new(45.0, 20.0, R))];
    let v = held(&model, "50:20-80x30,80x30", clearance, pass.clone());
    // The cone's side, from the axis: height = stick-out + ρ - 10. At 45° a tangent plane of the sphere grown by the
    // clearance crosses the axis, 45 mm away, where √2·31 - 45 says; the rim at 40 mm, 30 mm up, is above the sphere there.
    let side = f64::sqrt(2.0) * (radius + clearance) - 45.0 + 10.0;
    let foot_radius = 45.0 - (radius + clearance) * 0.5_f64.sqrt();
    assert!((10.0..40.0).contains(&foot_radius));
    let expected = side.max(R);
    assert!((-1e-6..FOUND).contains(&(needed(&v) - expected)), "{} for {expected}", needed(&v));
    // Raised by this much more, the cone is farther away by the sine of 45°.
    for more in [2.0, 5.0] {
        let stick_out = expected + more;
        let v = held(&model, &format!("{stick_out}:20-80x30,80x30"), clearance, pass.clone());
        let wanted = stick_out - (f64::sqrt(2.0) * radius - 35.0);
        let found = holder_of(&v).clearance_min_mm.unwrap();
        assert!((found - wanted * 0.5_f64.sqrt()).abs() < FOUND, "{found}, {wanted}");
    }
}

#[test]
fn into_a_pocket_the_nose_goes_and_the_flange_stays_above() {
    // A pocket 60 mm wide and 50 deep.
    let side = |x: f64| ruled([x, -100.0, 0.0], [x, 100.0, 0.0], [x, -100.0, 50.0], [x, 100.0, 50.0]);
    let model = model([
        rectangle((-30.0, 30.0), (-100.0, 100.0), 0.0),
        side(-30.0),
        side(30.0),
        rectangle((30.0, 130.0), (-100.0, 100.0), 50.0),
        rectangle((-130.0, -30.0), (-100.0, 100.0), 50.0),
    ]);
    let v = held(&model, "40:30x25,70x20", 2.0, beside(0.0));
    // The flange's lower end is 25 mm above the nose's, and has to be 2 mm above the rim.
    assert!((needed(&v) - 27.0).abs() < FOUND, "{}", needed(&v));
    assert!((holder_of(&v).clearance_min_mm.unwrap_or(10.0) - 10.0).abs() < FOUND);
    // With a plain nose nothing is near: only the floor, 2 mm below.
    let slim = held(&model, "40:30x80", 2.0, beside(0.0));
    assert!((needed(&slim) - R).abs() < FOUND, "{}", needed(&slim));
    // Beside a side of the pocket the nose itself has to stay above the rim.
    let aside = held(&model, "80:30x80", 2.0, beside(14.0));
    let expected = 50.0 + (4.0_f64 - 1.0).sqrt();
    assert!((needed(&aside) - expected).abs() < FOUND, "{}", needed(&aside));
}

#[test]
fn nothing_hides_between_samples_of_a_long_straight_move() {
    // A needle 0.2 mm thick beside the middle of a move of 180 mm.
    let needle = ruled([100.0, 15.0, 0.0], [100.2, 15.0, 0.0], [100.0, 15.0, 33.0], [100.2, 15.0, 33.0]);
    let model = model([rectangle((0.0, 200.0), (-100.0, 100.0), 0.0), needle]);
    let row = straight(Cut, 0, Point3::new(10.0, 0.0, R), Point3::new(190.0, 0.0, R));
    let v = held(&model, "30:40x40", 1.0, vec![row]);
    assert!((needed(&v) - 34.0).abs() < FOUND, "{}", needed(&v));
    let at = holder_of(&v).clearance_min_at.as_ref().unwrap();
    assert!((80.0..120.0).contains(&(at.parameter.unwrap() + 10.0)) && at.face == Some(1), "{at:?}");
    assert_eq!(holder_of(&v).touching, 1);
}

#[test]
fn bent_passes_and_tilted_ones() {
    // A quarter circle about a post: the axis is nowhere nearer than at its middle control point's shoulder.
    let post = ruled([0.0, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.0, 60.0], [0.1, 0.1, 60.0]);
    let model = model([rectangle((-100.0, 100.0), (-100.0, 100.0), 0.0), post]);
    let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 60.0, 60.0, 60.0]).unwrap();
    let points = [(40.0, 0.0), (40.0, 40.0), (0.0, 40.0)].map(|(x, y)| Point3::new(x, y, R)).to_vec();
    let bend = along(Cut, 0, &Curve3::new(knots, points, Some(vec![1.0, 0.5_f64.sqrt(), 1.0])).unwrap());
    let nearest = 40.0 - 0.1 * f64::sqrt(2.0);
    for (radius, clear) in [(30.0, nearest - 30.0), (37.0, nearest - 37.0)] {
        let v = held(&model, &format!("20:{}x80", 2.0 * radius), 1.0, vec![bend.clone()]);
        let found = holder_of(&v).clearance_min_mm.unwrap();
        assert!((found - clear).abs() < FOUND, "{found} for {clear}");
    }
    let mut tilted = bend;
    tilted.axis_end = Vector3::new(0.1, 0.0, 1.0).normalize().into();
    let v = held(&model, "20:60x80", 1.0, vec![tilted]);
    assert_eq!((holder_of(&v).moves, holder_of(&v).moves_not_checked), (0, 1));
    assert!(v.verdict.findings.iter().any(|f| f.code == FindingCode::HolderNotChecked));
}

#[test]
fn without_a_holder_there_is_no_account_of_one() {
    let model = wall(40.0);
    let v = check(&model, &job(&model), &program(beside(15.0)));
    assert!(v.holder.is_none() && v.verdict.findings.iter().all(|f| f.code != FindingCode::Holder));
}

#[test]
fn the_shank_may_run_along_a_wall_but_not_into_it() {
    // The wall leans over the ball: its top is nearer to the axis than its foot.
    let leaning = |by: f64| {
        let wall = ruled([0.0, -100.0, 12.0], [0.0, 100.0, 12.0], [by, -100.0, 40.0], [by, 100.0, 40.0]);
        model([rectangle((0.0, 200.0), (-100.0, 100.0), 0.0), wall])
    };
    for (by, depth) in [(0.0, None), (0.004, None), (0.02, Some(0.02)), (3.0, Some(3.0))] {
        let model = leaning(by);
        let v = check(&model, &job(&model), &program(beside(R)));
        let shank = v.shank.as_ref().unwrap();
        assert_eq!(shank.touching, u64::from(depth.is_some()), "{by}: {shank:?}");
        let found = v.verdict.findings.iter().find(|f| f.code == FindingCode::Shank);
        assert_eq!(found.map(|f| f.severity), depth.map(|_| Severity::Error));
        if let Some(depth) = depth {
            assert!((shank.deepest_mm - depth).abs() < 0.2 * depth, "{shank:?}");
        }
    }
}

/// A job whose tool has a taper or a shank of its own.
fn with_tool(model: &Model, tool: &str, moves: Vec<Move>) -> Verification {
    let mut job = job(model);
    let tool: Tool = tool.parse().unwrap();
    job.request.tool = tool;
    job.tools[0].tool = tool;
    check(model, &job, &program(moves))
}

#[test]
fn a_thicker_shank_stands_on_what_the_ball_passes() {
    // The ball runs along a wall of 40 mm that is 12 mm away from its axis.
    let model = wall(40.0);
    for (tool, touching) in [
        ("ball:10,length:45,shank:40", None),
        ("ball:10,length:30,shank:23", None),
        // Over the wall's top by 3 mm, 10 mm below it.
        ("ball:10,length:30,shank:30", Some(3.0)),
        // By 8 mm, but only 5 mm below the top.
        ("ball:10,length:35,shank:40", Some(5.0)),
        // The tangent at 5° is 9.96 mm from the axis and 9.13 mm up: 12.66 mm at the wall's top.
        ("ball:10,taper:5,length:60", Some(0.66)),
        ("ball:10,taper:3,length:60", None),
    ] {
        let v = with_tool(&model, tool, beside(12.0));
        let shank = v.shank.as_ref().unwrap();
        assert_eq!(shank.touching, u64::from(touching.is_some()), "{tool}: {shank:?}");
        if let Some(depth) = touching {
            assert!((shank.deepest_mm - depth).abs() < 0.1 * depth, "{tool}: {shank:?}");
        }
    }
}

#[test]
fn rapids_count_what_stands_above_the_ball() {
    // 12 mm beside the axis there is a wall of 40 mm.
    let model = wall(40.0);
    let rapid = |z: f64| vec![straight(Rapid, 0, Point3::new(12.0, -50.0, z), Point3::new(12.0, 50.0, z))];
    for (tool, tip, clearance) in [
        ("ball:10", 20.0, 20.0),
        ("ball:10,length:30,shank:40", 20.0, 10.0),
        ("ball:10,length:30,shank:40", 8.0, -2.0),
        ("ball:10,length:30,shank:23", 8.0, 8.0),
    ] {
        let v = with_tool(&model, tool, rapid(tip + R));
        let found = v.rapids.clearance_min_mm.unwrap();
        assert!((found - clearance).abs() < 0.03, "{tool} at {tip}: {found}");
        assert_eq!(v.rapids.touching, u64::from(clearance < 0.0), "{tool}");
    }
}
