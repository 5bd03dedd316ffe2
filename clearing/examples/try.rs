use claymill_clearing::*;
fn main() {
    let limit = EngagementLimit::new(3.0, 53.1).unwrap();
    let f = PlanarSet::rectangle([3.0, 3.0, 57.0, 57.0]);
    let stock = PlanarSet::rectangle([-10.0, -10.0, 70.0, 70.0]);
    let t = std::time::Instant::now();
    let c = clear(&Area { feasible: &f, stock: &stock, limit, entry: Entry::usual(3.0) }, &()).unwrap();
    println!("{:?} rounds {} strokes {} length {:.1} area {:.1} eff {:.3} left {:.3}", t.elapsed(), c.rounds, c.strokes.len(), c.cut_length_mm(), c.area_mm2,
      c.area_mm2 / limit.straight_step_mm() / c.cut_length_mm(), c.left.area_mm2());
}
