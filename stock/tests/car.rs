//! Time and memory of a job as large as a car. A program of its own: it counts the memory of all.

use std::time::Instant;

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_stock::{Family, Grid, Ray, Stock, Sweep, ToolBody, Upwards};
use claymill_toolpath::Tool;
use peak_alloc::PeakAlloc;

#[global_allocator]
static PEAK: PeakAlloc = PeakAlloc;

/// A body of 5 × 2 × 1.5 m: `z = 1400·(1 − x⁴)·(1 − y⁴)`, with x and y from −1 to 1.
fn height(x: f64, y: f64) -> f64 {
    let fourth = |c: f64, half: f64| 1.0 - ((c - half) / (1.02 * half)).powi(4);
    1400.0 * fourth(x, 2500.0) * fourth(y, 1000.0)
}

/// Where a ray is below the body raised by a layer of clay.
fn clay(ray: Ray, layer_mm: f64) -> Option<Vec<[f64; 2]>> {
    let [a, b] = ray.across_mm;
    // Along x and y: the stretch about the middle on which the body is high enough.
    let stretch = |other: f64, other_half: f64, half: f64, z: f64| {
        let over = 1.0 - ((other - other_half) / (1.02 * other_half)).powi(4);
        let share = 1.0 - (z - layer_mm).max(0.0) / (1400.0 * over);
        let reach = (1.02 * half * share.max(0.0).sqrt().sqrt()).min(half);
        (share > 0.0).then(|| vec![[half - reach, half + reach]])
    };
    match ray.family.index() {
        0 => stretch(a, 1000.0, 2500.0, b),
        1 => stretch(b, 2500.0, 1000.0, a),
        _ => Some(vec![[0.0, height(a, b) + layer_mm]]),
    }
}

/// Rows along x, a centimetre apart, in pieces of 8 mm.
fn rows(body: &ToolBody, over_mm: f64) -> Vec<Sweep<'_>> {
    let tip = |x: f64, y: f64| Point3::new(x, y, height(x, y) + over_mm);
    let row = |i: u32| {
        let y = 5.0 + 10.0 * f64::from(i);
        (0..625).map(move |j| {
            let x = 8.0 * f64::from(j);
            Sweep::new(body, Vector3::z(), tip(x, y), tip(x + 8.0, y)).unwrap()
        })
    };
    (0..200).flat_map(row).collect()
}

/// Prints what readings take.
fn readings(stock: &Stock, body: &ToolBody) {
    let timed = |name: &str, read: &dyn Fn() -> String| {
        let start = Instant::now();
        let found = read();
        println!("  {name}: {found} in {:.2?}", start.elapsed());
    };
    let up = Upwards { family: Family::Z, is_reversed: false };
    let highest = || stock.height_map(up, 10).heights_mm.into_iter().fold(0.0, f64::max);
    timed("height map of 10 mm", &|| format!("{:.1} mm", highest()));
    let level = [Vector3::x(), Vector3::y(), Vector3::z()];
    let (sine, cosine) = 0.5_f64.sin_cos();
    let tilted = [Vector3::x(), Vector3::new(0.0, cosine, sine), Vector3::new(0.0, -sine, cosine)];
    for axes in [level, tilted] {
        let area = || stock.slice(axes, 300.0, 305.0).unwrap().area_mm2();
        timed("slice", &|| format!("{:.3} m²", area() / 1e6));
    }
    let clear = || {
        let move_at = |i: u32| {
            let x = 10.0 * f64::from(i % 400);
            Sweep::new(
                body,
                Vector3::z(),
                Point3::new(x, 500.0, 1440.0),
                Point3::new(x + 100.0, 900.0, 1440.0),
            )
        };
        (0..1000).filter(|i| stock.is_clear(&move_at(*i).unwrap(), 2.0).unwrap()).count()
    };
    timed("1000 rapids of 0.4 m", &|| format!("{} clear", clear()));
    let thickness = || {
        let at = |i: u32| {
            Point3::new(10.0 + 0.49 * f64::from(i), 700.0, height(10.0 + 0.49 * f64::from(i), 700.0))
        };
        (0..10_000).map(|i| stock.thickness_along(&at(i), &Vector3::z()).unwrap()).sum::<f64>() / 1e4
    };
    timed("10000 thicknesses", &|| format!("{:.1} mm on the mean", thickness()));
    timed("digest", &|| format!("{:02x?}", &stock.digest()[..4]));
    timed("surface by every 8th ray", &|| format!("{} triangles", stock.surface(8).unwrap().triangles.len()));
}

#[test]
#[ignore = "time and memory of a car at 1 mm: half a minute"]
fn a_car_is_cut_in_fifteen_seconds_and_a_gigabyte() {
    let box_mm = Aabb { min: Point3::origin(), max: Point3::new(5000.0, 2000.0, 1500.0) };
    let grid = Grid::over(&box_mm, 1.0).unwrap();
    let ball: Tool = "ball:10".parse().unwrap();
    for (name, body) in
        [("ball", ToolBody::end(&ball).unwrap()), ("ball and flutes", ToolBody::cutting(&ball).unwrap())]
    {
        PEAK.reset_peak_usage();
        let start = Instant::now();
        let mut stock = Stock::from_rays(grid, |ray| clay(ray, 25.0)).unwrap();
        let filled = start.elapsed();
        let sweeps = rows(&body, 15.0);
        let length_m = sweeps.iter().map(Sweep::length_mm).sum::<f64>() / 1e3;
        let before = stock.clone();
        let start = Instant::now();
        stock.cut_all(&sweeps);
        let cut = start.elapsed();
        let start = Instant::now();
        let (left, removed) = (stock.volume(), before.removed_since(&stock).unwrap());
        let read = start.elapsed();
        let peak_mb = PEAK.peak_usage_as_mb();
        println!(
            "{name}: {:.1} M rays filled in {filled:.2?}; {} moves, {length_m:.0} m cut in {cut:.2?} ({:.0} m/s), volumes in \
             {read:.2?}; stock {:.0} MB, peak {peak_mb:.0} MB; left {left:?}; removed {removed:?}",
            grid.rays() as f64 / 1e6,
            sweeps.len(),
            length_m / cut.as_secs_f64(),
            stock.bytes_in_memory() as f64 / 1e6,
        );
        readings(&stock, &body);
        let spread = |v: [f64; 3]| v.iter().fold(0.0f64, |a, b| a.max((b / v[2] - 1.0).abs()));
        assert!(spread(left.families_mm3) < 1e-3 && removed.best_mm3() > 1e8);
        assert!(cut.as_secs_f64() < 15.0 && peak_mb < 1e3, "{name}: {cut:?}, {peak_mb} MB");
    }
}
