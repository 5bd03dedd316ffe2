//! A block around a dome, planned as a whole and judged by the verifier.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use claymill_clearing::{ClearingError, Entry, LevelOptions, LevelPlan, Workpiece, plan_levels};
use claymill_contact::Covering;
use claymill_nurbs::{Aabb, Point3};
use claymill_toolpath::{Holder, Move, MoveKind, Tool, ToolRecord};
use claymill_verify::stock::{InitialStock, StockCheck, StockOptions, level_engagement};

use crate::pockets::{feeds, top};
use crate::regions::ball_part;

const LIMIT_DEG: f64 = 50.0;

fn block(half_mm: f64, top_mm: f64) -> Aabb {
    Aabb { min: Point3::new(-half_mm, -half_mm, 0.0), max: Point3::new(half_mm, half_mm, top_mm) }
}

fn options() -> LevelOptions {
    LevelOptions {
        allowance_mm: 0.5,
        step_mm: 6.0,
        engagement_deg: LIMIT_DEG,
        band_mm: None,
        holder: None,
        entry: Entry::usual(4.0),
        feeds: feeds(),
    }
}

fn planned(tool: &str, block: &Aabb, options: &LevelOptions) -> Result<LevelPlan, ClearingError> {
    let dome = ball_part(12.0, (0.0, FRAC_PI_2));
    let covering = Covering::new(&dome, &[false], dome.faces[0].area_mm2(), 4.0).expect("covered");
    let tool = tool.parse().expect("a tool");
    let piece = Workpiece { block: *block, left: None, thin_mm: 0.0, within_mm: None };
    plan_levels(&dome, &covering, &top(), &tool, &piece, options, &())
}

/// A holder that is lower than the dome keeps off it and off what is left around it; one that is not changes nothing.
#[test]
fn a_holder_keeps_out_of_what_levels_leave() {
    let block = block(20.0, 14.0);
    let tool: Tool = "flat:4,length:6".parse().expect("a tool");
    let moves_with = |stick_out_mm: f64| {
        let holder = Holder::parse(&format!("{stick_out_mm}:20-26x30"), &tool).expect("a holder");
        let options = LevelOptions { step_mm: 5.0, holder: Some((holder.clone(), 1.0)), ..options() };
        let plan = planned("flat:4,length:6", &block, &options).expect("planned");
        (holder, plan)
    };
    let free = LevelOptions { step_mm: 5.0, ..options() };
    let free = planned("flat:4,length:6", &block, &free).expect("planned");
    let (_, long) = moves_with(16.0);
    assert_eq!((long.moves, long.kept_out), (free.moves.clone(), None));
    let (holder, short) = moves_with(8.0);
    assert!(short.kept_out.is_some_and(|of| of.area_mm2 > 1.0 && of.deep_mm > 8.0), "{:?}", short.kept_out);
    let in_stock = |moves: &[Move]| {
        let moves: Vec<Move> = moves.iter().map(|m| Move { tool: "T1".into(), ..m.clone() }).collect();
        let tool = ToolRecord {
            id: "T1".into(),
            tool,
            holder: Some(holder.clone()),
            setup_stick_out_mm: BTreeMap::new(),
        };
        let stock = InitialStock::block(block.min, block.max).expect("a block");
        let check = StockCheck::new(stock, &moves, &[tool], &StockOptions::default(), &|| true);
        check.expect("a check").report(None, &|| true).expect("a report").body.touching
    };
    assert_eq!(in_stock(&short.moves), 0);
    assert!(in_stock(&free.moves) > 0);
}

#[test]
fn a_dome_in_a_block_is_roughed_within_the_limit() {
    let block = block(20.0, 14.0);
    let plan = planned("flat:4,length:20", &block, &options()).expect("planned");
    assert!(plan.levels.len() >= 3, "{:?}", plan.levels);
    for level in &plan.levels {
        assert!(level.left_mm2 <= 2e-4 * level.area_mm2 && level.refused.is_empty(), "{level:?}");
    }
    let moves: Vec<Move> = plan.moves.iter().map(|m| Move { tool: "T1".into(), ..m.clone() }).collect();
    let tool = ToolRecord {
        id: "T1".into(),
        tool: "flat:4".parse().expect("a tool"),
        holder: None,
        setup_stick_out_mm: BTreeMap::new(),
    };
    let stock = || InitialStock::block(block.min, block.max).expect("a block");
    let engaged = level_engagement(&stock(), &moves, std::slice::from_ref(&tool), &|_| true, &|| true);
    let largest = engaged.expect("measured").largest.expect("it cuts");
    assert!(largest.angle_deg <= LIMIT_DEG + 0.5, "{largest:?}");
    let check =
        StockCheck::new(stock(), &moves, &[tool], &StockOptions::default(), &|| true).expect("a check");
    let report = check.report(None, &|| true).expect("a report");
    assert_eq!(report.clear[&MoveKind::Rapid].touching, 0, "{:?}", report.clear);
    // Nothing of the dome with its allowance is cut: 4 mm of the way down its side.
    let time = check.time_of(moves.len() - 1).expect("a time");
    for k in 0..200 {
        let (a, b) = (f64::from(k) * 2.399, f64::from(k % 50) / 50.0 * 1.5);
        let p = Point3::new(a.cos() * b.cos(), a.sin() * b.cos(), b.sin()).coords * 12.49;
        assert!(p.z < 0.01 || check.is_stock(&p.into(), time), "{p:?}");
    }
    // Every move begins where the one before ended.
    for w in plan.moves.windows(2) {
        assert_eq!(w[0].end(), w[1].start(), "{} {}", w[0].seq, w[1].seq);
    }
}

/// Low stairs are cut by a ball near its pole, where it is narrower than its helices are elsewhere.
/// A flat end of radius `r` at a height `z` beside a dome of radius `R` keeps `√(R² − z²) + r` away from its axis.
#[test]
fn no_move_cuts_into_a_wall() {
    let options = LevelOptions { allowance_mm: 0.0, band_mm: Some(0.4), ..options() };
    let plan = planned("flat:4,length:20", &block(20.0, 14.0), &options).expect("planned");
    let mut deepest_mm = f64::NEG_INFINITY;
    for m in &plan.moves {
        let curve = m.curve().expect("a curve");
        let (from, to) = curve.domain();
        for k in 0..=50 {
            let p = curve.point(from + (to - from) * f64::from(k) / 50.0);
            let beside_mm = (144.0_f64 - p.z * p.z).max(0.0).sqrt() + 4.0;
            if p.z < 12.0 {
                deepest_mm = deepest_mm.max(beside_mm - p.x.hypot(p.y));
            }
        }
    }
    assert!((-5e-3..1e-3).contains(&deepest_mm), "{deepest_mm}");
}

#[test]
fn a_ball_cuts_stairs_that_are_lower_than_its_corner() {
    let stairs = LevelOptions { band_mm: Some(0.5), ..options() };
    let plan = planned("ball:4,length:20", &block(20.0, 14.0), &stairs).expect("planned");
    assert!(plan.levels.len() > 5, "{:?}", plan.levels);
}

#[test]
fn the_same_moves_whatever_the_number_of_threads() {
    let of_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| planned("flat:4", &block(14.0, 13.0), &options()).expect("planned").moves)
    };
    assert_eq!(of_threads(1), of_threads(3));
}

#[test]
fn wishes_that_make_no_sense_are_named() {
    let whole = block(20.0, 14.0);
    let refused = |tool: &str, block: &Aabb, options: &LevelOptions| planned(tool, block, options).err();
    let stock = refused("flat:4", &block(11.0, 14.0), &options());
    assert!(matches!(stock, Some(ClearingError::StockTooSmall { .. })), "{stock:?}");
    for engagement_deg in [0.0, 180.0] {
        let limit = refused("flat:4", &whole, &LevelOptions { engagement_deg, ..options() });
        assert!(matches!(limit, Some(ClearingError::Limit { .. })), "{limit:?}");
    }
    let deep = refused("flat:4,length:5", &whole, &options());
    assert!(matches!(deep, Some(ClearingError::StepBelowFlutes { .. })), "{deep:?}");
    let nan = refused("flat:4", &whole, &LevelOptions { allowance_mm: f64::NAN, ..options() });
    assert!(matches!(nan, Some(ClearingError::Number { .. })), "{nan:?}");
}
