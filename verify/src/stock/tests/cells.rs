//! Cubes that are said to be clear hold no stock, and most of what is far from stock is said to be clear.

use claymill_toolpath::{Move, MoveKind};

use super::super::cells::Cells;
use super::super::piece::Sweep;
use super::*;

#[test]
fn what_cubes_call_clear_meets_no_stock_and_most_of_what_is_clear_they_call_so() {
    let mut r = Random(29);
    let moves: Vec<Move> = (0..300)
        .map(|k| {
            let from = Point3::from(r.vector(40.0));
            let m = Move::straight(MoveKind::Cut, from, from + r.vector(30.0), r.direction(), 100.0);
            Move { tool: "T1".into(), seq: k, ..m }
        })
        .collect();
    let tools = [tool("T1", "bull:14:3", None)];
    let check = check(block([-40.0; 3], [40.0, 40.0, 20.0]), &moves, &tools);
    let cells = Cells::over(&check.stock.bounds());
    let (mut called, mut clear) = (0, 0);
    for _ in 0..1000 {
        let start = Point3::from(r.vector(60.0));
        let radius = r.between(1.0, 8.0);
        let shape = Shape::frustum([0.0, radius], [r.between(2.0, 20.0), radius]);
        let sweep = Sweep { start, way: r.vector(10.0), axis: r.direction(), shape };
        let before = (r.unit() * 400.0) as u32;
        let bounds = sweep.bounds();
        let size = bounds.max - bounds.min;
        let places = (0..2000)
            .map(|_| bounds.min + Vector3::new(size.x * r.unit(), size.y * r.unit(), size.z * r.unit()));
        let meets = places.filter(|p| sweep.holds(p)).any(|p| check.is_stock(&p, before));
        let is_clear = cells.are_clear_of(&sweep, before, (&check.stock, &check.sweeps));
        assert!(!(is_clear && meets), "{sweep:?} before {before}");
        called += u32::from(is_clear);
        clear += u32::from(!meets);
    }
    assert!(clear > 100 && f64::from(called) > 0.7 * f64::from(clear), "{called} of {clear}");
}
