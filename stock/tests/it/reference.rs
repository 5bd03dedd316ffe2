//! Volumes with closed forms, at several pitches.
//!
//! Rays sample the shape seen along them at the middles of cells. A cut whose outline has the length `l` and the depth `h`
//! is therefore known to about `h·c·√(l·c)`, and at worst, where the outline runs along the cells, to `h·l·c/2`. The
//! bounds below are one and a half times what is found: they fall with the pitch, and a wrong formula exceeds them.

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Family, Grid, Stock, Sweep, ToolBody};

use super::{block, bounds, cutting, end, upright};

/// Checks what sweeps remove of a block at pitches 1, 0.5 and 0.25, by the best family and by all, as shares of the volume.
fn removes(
    about: &str,
    stock: impl Fn(f64) -> Stock,
    sweeps: &[Sweep<'_>],
    exact: f64,
    best: [f64; 3],
    all: [f64; 3],
) {
    for (i, pitch) in [1.0, 0.5, 0.25].into_iter().enumerate() {
        let removed = stock(pitch).removed_by(sweeps);
        let off = |mm3: f64| mm3 / exact - 1.0;
        println!(
            "{about} at {pitch}: best {:+.5} {:?}, families {:?}",
            off(removed.best_mm3()),
            removed.best_family(),
            removed.families_mm3.map(|v| (off(v) * 1e5).round() / 1e5)
        );
        assert!(off(removed.best_mm3()).abs() <= best[i], "{about} at {pitch}: {removed:?}");
        assert!(
            removed.families_mm3.iter().all(|v| off(*v).abs() <= all[i]),
            "{about} at {pitch}: {removed:?}"
        );
    }
}

/// A1: a block of 100 mm without a ball of 50 mm.
#[test]
fn a_block_without_a_ball() {
    let ball = end("ball:50");
    for (pitch, bound) in [(1.0, 2e-4), (0.5, 3e-5)] {
        let mut stock = block([-50.0; 3], [50.0; 3], pitch);
        stock.cut(&upright(&ball, [0.0, 0.0, -50.0], [0.0, 0.0, -50.0]));
        let left = stock.volume();
        println!("A1 at {pitch}: {:?}", left.families_mm3.map(|v| v / 476_401.224_401_701 - 1.0));
        for v in left.families_mm3 {
            assert!((v / 476_401.224_401_701 - 1.0).abs() < bound, "{pitch}: {v}");
        }
    }
}

/// A2, A2b: a slot of 50 mm by a ball of 10 mm, 4 and 10 mm deep.
#[test]
fn slots_of_a_ball() {
    let ball = end("ball:10");
    let stock = |pitch| block([-40.0, -20.0, -20.0], [40.0, 20.0, 0.0], pitch);
    let slot = |depth: f64| [upright(&ball, [-25.0, 0.0, -depth], [25.0, 0.0, -depth])];
    removes("A2", stock, &slot(4.0), 2_672.110_271_306, [3e-3, 8e-4, 2e-4], [3e-2, 2e-2, 2e-3]);
    removes("A2b", stock, &slot(10.0), 9_948.376_736_368, [4e-3, 1.5e-3, 5e-4], [6e-3, 5e-3, 5e-4]);
}

/// A3: a whole capsule, level and slanted.
#[test]
fn capsules_inside_of_a_block() {
    let ball = end("ball:10");
    let stock = |pitch| block([-45.0; 3], [45.0; 3], pitch);
    let level = [upright(&ball, [-25.0, 0.0, -10.0], [25.0, 0.0, -10.0])];
    removes("A3", stock, &level, 19_896.753_472_735, [4e-3, 1.5e-3, 5e-4], [6e-3, 5e-3, 5e-4]);
    let half = Vector3::new(3.0, 4.0, 12.0) * (25.0 / 13.0);
    let middle = Point3::new(0.3, 0.1, -10.2);
    let slanted = [Sweep::new(&ball, Vector3::z(), middle - half, middle + half).unwrap()];
    removes("A3 slanted", stock, &slanted, 19_896.753_472_735, [4e-4, 3e-4, 1e-4], [4e-4, 3e-4, 1e-4]);
}

/// A5: a slot of 40 mm by a flat end of 5 mm, 3 mm deep.
#[test]
fn slot_of_a_flat_end() {
    let flat = cutting("flat:5");
    let stock = |pitch| block([-40.0, -20.0, -20.0], [40.0, 20.0, 0.0], pitch);
    let slot = [upright(&flat, [-20.0, 0.0, -3.0], [20.0, 0.0, -3.0])];
    removes("A5", stock, &slot, 1_435.619_449_019, [4e-3, 1.5e-3, 1.2e-3], [4e-3, 1.5e-3, 1.2e-3]);
}

/// A6: a bull-nosed end of 10 and 2 mm, 5 mm deep: plunged, and a slot of 50 mm; also along other axes.
#[test]
fn plunge_and_slot_of_a_bull_nose() {
    let bull = cutting("bull:10:2");
    let stock = |pitch| block([-40.0, -20.0, -20.0], [40.0, 20.0, 0.0], pitch);
    let plunge = [upright(&bull, [0.0, 0.0, 3.0], [0.0, 0.0, -5.0])];
    removes("A6 plunge", stock, &plunge, 1_519.270_486_973, [7e-3, 5e-3, 1.2e-3], [8e-3, 5e-3, 1.2e-3]);
    let slot = [upright(&bull, [-25.0, 0.0, -5.0], [25.0, 0.0, -5.0])];
    removes("A6 slot", stock, &slot, 6_433.429_752_332, [4e-3, 2e-3, 3e-4], [4e-3, 3e-3, 2.5e-3]);
    // The section of the slot: what a longer one adds.
    let longer = [upright(&bull, [-27.0, 0.0, -5.0], [27.0, 0.0, -5.0])];
    for pitch in [0.5, 0.25] {
        let added = stock(pitch).removed_by(&longer).best_mm3() - stock(pitch).removed_by(&slot).best_mm3();
        assert!((added / 4.0 / 98.283_185_307 - 1.0).abs() < pitch * 2e-2, "{added}");
    }
    // The same slot from the side.
    let lying = |pitch| block([0.0, -40.0, -20.0], [20.0, 40.0, 20.0], pitch);
    let (from, to) = (Point3::new(5.0, -25.0, 0.0), Point3::new(5.0, 25.0, 0.0));
    let slot = [Sweep::new(&bull, -Vector3::x(), from, to).unwrap()];
    let deep =
        Sweep::new(&bull, Vector3::x(), Point3::new(15.0, -25.0, 0.0), Point3::new(15.0, 25.0, 0.0)).unwrap();
    removes("A6 from +x", lying, &[deep], 6_433.429_752_332, [4e-3, 2e-3, 3e-4], [4e-3, 3e-3, 2.5e-3]);
    removes("A6 from -x", lying, &slot, 6_433.429_752_332, [4e-3, 2e-3, 3e-4], [4e-3, 3e-3, 2.5e-3]);
}

/// Tips of rings and of the middle that clear a square pocket with round tools.
fn pocket<'a>(body: &'a ToolBody, radius: f64, half: f64, depth: f64) -> Vec<Sweep<'a>> {
    let mut sweeps = Vec::new();
    let mut ring = half - radius;
    loop {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
            .map(|[x, y]: [f64; 2]| [x * ring, y * ring, -depth]);
        sweeps.extend(corners.windows(2).map(|c| upright(body, c[0], c[1])));
        if ring == 0.0 {
            return sweeps;
        }
        ring = (ring - radius).max(0.0);
    }
}

/// F1: a square pocket of 100 mm, 20 mm deep: what a tool of 10 mm reaches, and what smaller ones find in the corners.
#[test]
fn corners_of_a_square_pocket() {
    let tools = [("flat:10", 10.0), ("flat:5", 5.0), ("flat:2", 2.0)];
    for (pitch, bounds) in [(0.5, [2e-4, 2.5e-2, 1e-2]), (0.25, [2e-4, 1e-2, 1e-2])] {
        let mut stock = block([-60.0, -60.0, -30.0], [60.0, 60.0, 0.0], pitch);
        for (((text, radius), exact), bound) in
            tools.into_iter().zip([198_283.185_307_180, 1_287.611_019_615, 360.531_085_492]).zip(bounds)
        {
            let body = cutting(text);
            let before = stock.clone();
            stock.cut_all(&pocket(&body, radius, 50.0, 20.0));
            let removed = before.removed_since(&stock).unwrap();
            println!("F1 {text} at {pitch}: {:?}", removed.families_mm3.map(|v| v / exact - 1.0));
            assert!((removed.best_mm3() / exact - 1.0).abs() < bound, "{text} {pitch}: {removed:?}");
        }
    }
}

/// F2: a groove whose walls rise by an angle, filled up to where a ball touches them: the ball leaves R²·(tan a − a).
#[test]
fn rest_in_a_groove() {
    let cases = [(30.0_f64, 10.0, 5.375_149_359), (30.0, 3.0, 0.483_763_442), (45.0, 10.0, 21.460_183_660)];
    for (deg, radius, exact) in cases {
        for (share, bound) in [(0.02, 4e-2), (0.005, 1e-2)] {
            let pitch = share * radius;
            let (slope, centre) = (deg.to_radians().tan(), radius / deg.to_radians().cos());
            let top = centre - radius * deg.to_radians().cos();
            let half = top / slope;
            let length = 20.0 * pitch;
            let grid = Grid::over(&bounds([-half, 0.0, 0.0], [half, length, top]), pitch).unwrap();
            let mut stock = Stock::from_rays(grid, |ray| {
                let [a, b] = ray.across_mm;
                let interval = match ray.family.index() {
                    0 => [-b / slope, b / slope],
                    1 if a < b.abs() * slope => return None,
                    1 => [0.0, length],
                    _ => [a.abs() * slope, top],
                };
                Some(vec![interval]).filter(|i| i[0][0] < i[0][1])
            })
            .unwrap();
            let ball = end(&format!("ball:{radius}"));
            let tip = centre - radius;
            stock.cut(&upright(&ball, [0.0, -9.0, tip], [0.0, length + 9.0, tip]));
            let covered = grid.bounds().max.y;
            let left = stock.volume().families_mm3.map(|v| v / covered.min(length) / exact - 1.0);
            println!("F2 {deg}° R{radius} at {pitch}: {left:?}");
            assert!(left[0].abs() < bound && left[2].abs() < bound, "{deg} {radius} {pitch}: {left:?}");
        }
    }
}

/// A4: cusps of rows of a ball of 10 mm on a plane. Of a row's width `s` the ball leaves `s·R − (s/2)·√(R² − s²/4) −
/// R²·asin(s/2R)`: 0.0939 mm² at 2.82 mm, where the cusps are 0.1 mm high.
#[test]
fn cusps_between_rows() {
    let (radius, step, rows) = (10.0_f64, 2.82_f64, 10);
    let half = 0.5 * step;
    let section = step * radius
        - half * (radius * radius - half * half).sqrt()
        - radius * radius * (half / radius).asin();
    let ball = end("ball:10");
    for (parts, bound) in [(40.0, 1.5e-3), (80.0, 5e-4)] {
        let pitch = step / parts;
        let width = step * f64::from(rows);
        let mut stock = block([0.0, 0.0, 0.0], [7.05, width, 0.564], pitch);
        let sweeps: Vec<_> = (-3..rows + 3)
            .map(|i| {
                let y = step * (f64::from(i) + 0.5);
                upright(&ball, [-20.0, y, 0.0], [30.0, y, 0.0])
            })
            .collect();
        stock.cut_all(&sweeps);
        let off = stock.volume().families_mm3.map(|v| v / (section * f64::from(rows) * 7.05) - 1.0);
        println!("A4 at {pitch}: section {section}, {off:?}");
        // Rays along x and y run a pitch apart within 0.1 mm of height: they know the layer badly. Those along y cross every
        // cusp, and no list is too short for that.
        assert_eq!(stock.on_ray(Family::Y, [0, 1]).len(), rows as usize + 1);
        assert!(off[2].abs() < bound, "{pitch}: {off:?}");
    }
}
