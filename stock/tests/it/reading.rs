//! Readings of a stock: is a move clear, slices, heights, thickness, surface.

use claymill_nurbs::{Point3, Vector3};
use claymill_stock::{Family, Grid, Stock, StockError, Sweep, ToolBody, Upwards};
use claymill_toolpath::Holder;
use rand::{Rng, SeedableRng};

use super::{block, bounds, cutting, end, tool, upright};

const UP: Upwards = Upwards { family: Family::Z, is_reversed: false };

#[test]
fn a_move_is_clear_up_to_its_margin() {
    let stock = block([0.0; 3], [100.0, 100.0, 50.0], 1.0);
    let body = cutting("bull:10:2");
    let above = |z: f64| upright(&body, [10.0, 10.0, z], [90.0, 60.0, z]);
    assert!(stock.is_clear(&above(52.0), 1.99).unwrap());
    assert!(!stock.is_clear(&above(52.0), 2.01).unwrap());
    assert!(stock.is_clear(&above(50.0), 0.0).unwrap());
    assert!(!stock.is_clear(&above(49.999), 0.0).unwrap());
    for bad in [-1.0, f64::NAN] {
        assert!(matches!(stock.is_clear(&above(60.0), bad), Err(StockError::Size { .. })));
    }
}

#[test]
fn the_holder_is_what_touches_beside_a_deep_wall() {
    let stock = block([0.0; 3], [100.0, 100.0, 80.0], 1.0);
    let tool = tool("ball:5,length:20,shank:10");
    let holder = Holder::parse("60:27-34x50,63x26", &tool).unwrap();
    let (cutter, above) = (ToolBody::cutting(&tool).unwrap(), ToolBody::above(&tool, Some(&holder)).unwrap());
    // Beside the block, 8 mm from the wall; the holder begins 60 above the tip and is 13.5 thick.
    let at = |body| upright(body, [20.0, -8.0, 10.0], [80.0, -8.0, 10.0]);
    assert!(stock.is_clear(&at(&cutter), 1.0).unwrap());
    assert!(!stock.is_clear(&at(&above), 0.0).unwrap());
    let higher = upright(&above, [20.0, -8.0, 25.0], [80.0, -8.0, 25.0]);
    assert!(stock.is_clear(&higher, 1.0).unwrap());
}

/// Twice the area of a polygon, positive if it runs anticlockwise.
fn twice_area(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum()
}

#[test]
fn outlines_are_exact_between_rays() {
    // A wall of 11.3 mm and a rib of 0.3 mm, which no ray along z meets, stay of a block with rays a millimetre apart.
    let mut stock = block([0.0; 3], [60.0, 40.0, 20.0], 1.0);
    for [from, to] in [[11.3 + 5.0, 26.6 - 5.0], [26.9 + 5.0, 70.0]] {
        for k in 0..=20 {
            let x = from + (to - from) * f64::from(k) / 20.0;
            stock.cut(&upright(&cutting("flat:5"), [x, -10.0, 8.0], [x, 50.0, 8.0]));
        }
    }
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let area = |axes, low, high| -> f64 {
        let polygons = stock.outline(axes, low, high).unwrap();
        polygons.iter().map(|p| 0.5 * twice_area(p).abs()).sum()
    };
    // Below the cuts it is the whole block; above, the wall and the rib. Corners are cut off from the middle of a cell.
    let corners = |out_mm: f64| 2.0 * 0.5 * 0.5 * out_mm;
    approx::assert_abs_diff_eq!(area(axes, 2.0, 4.0), 2400.0 - 2.0 * corners(0.5), epsilon = 1e-3);
    let wall_and_rib = 40.0 * (11.3 + 0.3) - corners(0.5) - corners(0.8);
    approx::assert_abs_diff_eq!(area(axes, 10.0, 14.0), wall_and_rib, epsilon = 1e-2);
    // From below, with other axes across, and between two rows of rays.
    let below = [Vector3::y(), Vector3::x(), -Vector3::z()];
    approx::assert_abs_diff_eq!(area(below, -14.0, -10.0), wall_and_rib, epsilon = 1e-2);
    approx::assert_abs_diff_eq!(area(axes, 10.6, 10.9), wall_and_rib, epsilon = 1e-2);
    let turned = [Vector3::new(0.6, 0.8, 0.0), Vector3::new(-0.8, 0.6, 0.0), Vector3::z()];
    assert!(stock.outline(turned, 10.0, 14.0).is_none() && stock.outline(axes, 3.0, 3.0).is_none());
    // A round hole: within the chords of a grid, h²/8R about the hole.
    let mut stock = block([0.0; 3], [40.0, 40.0, 10.0], 1.0);
    stock.cut(&upright(&cutting("flat:8"), [20.3, 19.8, -1.0], [20.3, 19.8, 20.0]));
    let polygons = stock.outline(axes, 1.0, 9.0).unwrap();
    let left = polygons.iter().map(|p| 0.5 * twice_area(p).abs()).sum::<f64>() + 2.0 * corners(0.5);
    let exact = 1600.0 - std::f64::consts::PI * 64.0;
    assert!(left >= exact && left - exact < 2.0 * std::f64::consts::PI * 8.0 / 64.0, "{left} {exact}");
}

#[test]
fn slices_along_axes_are_exact_and_tilted_ones_hold_more() {
    let mut stock = block([0.0; 3], [60.0, 40.0, 20.0], 0.5);
    stock.cut(&upright(&cutting("flat:5"), [-10.0, 20.0, 12.0], [70.0, 20.0, 12.0]));
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let low = stock.slice(axes, 11.0, 12.0).unwrap();
    let high = stock.slice(axes, 12.0, 13.0).unwrap();
    assert_eq!((low.counts, low.area_mm2(), high.area_mm2()), ([120, 80], 2400.0, 1800.0));
    assert!(high.has_material([5, 29]) && !high.has_material([5, 30]) && !high.has_material([5, 49]));
    assert!(high.has_material([5, 50]) && !high.has_material([120, 0]));
    // The same seen from below, with other axes across.
    let below = stock.slice([Vector3::y(), Vector3::x(), -Vector3::z()], -13.0, -12.0).unwrap();
    assert_eq!((below.counts, below.area_mm2()), ([80, 120], 1800.0));
    // Turned by 30 degrees about x.
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    let tilted = [Vector3::x(), Vector3::new(0.0, cosine, sine), Vector3::new(0.0, -sine, cosine)];
    let slice = stock.slice(tilted, 1.0, 2.0).unwrap();
    // Every point of the block in the band is in a cell with material.
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut met = 0;
    for _ in 0..20_000 {
        let p = Point3::new(
            rng.random_range(0.0..60.0),
            rng.random_range(0.0..40.0),
            rng.random_range(0.0..12.0),
        );
        if (1.0..2.0).contains(&p.coords.dot(&tilted[2])) {
            let cell =
                [0, 1].map(|i| ((p.coords.dot(&tilted[i]) - slice.origin_mm[i]) / slice.cell_mm) as u32);
            assert!(slice.has_material(cell), "{p:?}");
            met += 1;
        }
    }
    assert!(met > 300, "{met}");
    // Along the tilted axis it is in material for 28 to 30 mm, in two pieces; 0.75 mm more at each of their ends.
    assert!((1700.0..2150.0).contains(&slice.area_mm2()), "{}", slice.area_mm2());
    assert_eq!(stock.slice([axes[1], axes[0], axes[2]], 0.0, 1.0), Err(StockError::Axes));
    assert!(matches!(stock.slice(axes, 1.0, f64::NAN), Err(StockError::Band { .. })));
}

#[test]
fn heights_bound_the_stock_from_all_sides() {
    let mut stock = block([0.0; 3], [60.0, 40.0, 20.0], 1.0);
    stock.cut(&upright(&cutting("flat:5"), [-10.0, 20.0, 12.0], [70.0, 20.0, 12.0]));
    let map = stock.height_map(UP, 5);
    assert_eq!((map.counts, map.cell_mm), ([12, 8], 5.0));
    assert_eq!(map.at([30.0, 20.0]), 12.0);
    assert_eq!(map.at([30.0, 12.0]), 20.0);
    assert_eq!(map.at([30.0, 40.1]), f64::NEG_INFINITY);
    assert_eq!(map.highest_in([10.0, 16.0], [50.0, 24.0]), 12.0);
    assert_eq!(map.highest_in([10.0, 16.0], [50.0, 25.0]), 20.0);
    assert_eq!(map.highest_in([-9.0, -9.0], [99.0, 99.0]), 20.0);
    let down = Upwards { family: Family::Z, is_reversed: true };
    assert!(stock.height_map(down, 5).heights_mm.iter().all(|h| *h == 0.0));
    let along_x = Upwards { family: Family::X, is_reversed: false };
    assert!(stock.height_map(along_x, 3).heights_mm.iter().all(|h| *h == 60.0 || *h == f64::NEG_INFINITY));
    assert_eq!(stock.top_mm(UP, [30.0, 20.0]), Ok(Some(12.0)));
    assert_eq!(stock.top_mm(UP, [30.0, 15.0]), Ok(Some(20.0)));
    assert_eq!(stock.top_mm(down, [30.0, 15.0]), Ok(Some(0.0)));
    assert_eq!(stock.top_mm(UP, [99.0, 15.0]), Ok(None));
    assert!(stock.top_mm(UP, [f64::NAN, 15.0]).is_err());
}

/// A wall of 0.4 mm between the rays along z, at a pitch of 1 mm: rays across find it.
#[test]
fn heights_see_a_fin_that_stands_between_the_rays() {
    let grid = Grid::over(&bounds([0.0; 3], [20.0, 20.0, 20.0]), 1.0).unwrap();
    let stock = Stock::from_rays(grid, |ray| match ray.family {
        Family::X => Some(vec![[8.8, 9.2]]),
        _ => None,
    })
    .unwrap();
    let map = stock.height_map(UP, 1);
    assert_eq!((map.at([8.9, 3.0]), map.at([9.1, 3.0])), (20.0, 20.0));
    assert_eq!(map.at([7.9, 3.0]), f64::NEG_INFINITY);
}

#[test]
fn thickness_over_a_sphere_is_that_of_the_layer() {
    let (radius, layer) = (40.0, 7.0);
    for pitch in [1.0, 0.5] {
        let reach = radius + layer;
        let grid = Grid::over(&bounds([-reach; 3], [reach; 3]), pitch).unwrap();
        let stock = Stock::from_rays(grid, |ray| {
            let [a, b] = ray.across_mm;
            let square: f64 = reach * reach - a * a - b * b;
            (square > 0.0).then(|| vec![[-square.sqrt(), square.sqrt()]])
        })
        .unwrap();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let (mut worst, mut sum): (f64, f64) = (0.0, 0.0);
        for _ in 0..2000 {
            let n = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            if n.norm() < 0.1 {
                continue;
            }
            let n = n.normalize();
            let off = stock.thickness_along(&Point3::from(n * radius), &n).unwrap() - layer;
            (worst, sum) = (worst.max(off.abs()), sum + off);
        }
        println!("thickness at {pitch}: worst {worst}, mean {}", sum / 2000.0);
        assert!(worst <= pitch && (sum / 2000.0).abs() < 0.05 * pitch, "{worst} {sum}");
        assert_eq!(stock.thickness_along(&Point3::new(0.0, 0.0, 60.0), &Vector3::z()), Ok(0.0));
        let across = stock.thickness_along(&Point3::new(0.0, 0.0, 30.0), &Vector3::x()).unwrap();
        assert!((across - (reach * reach - 900.0).sqrt()).abs() < pitch, "{across}");
        assert!(stock.thickness_along(&Point3::origin(), &Vector3::zeros()).is_err());
    }
}

/// The surface is closed, wound outwards, and encloses what the stock has.
#[test]
fn the_surface_is_closed_and_encloses_the_stock() {
    let mut stock = block([0.0; 3], [60.0, 40.0, 20.0], 1.0);
    let ball = end("ball:8");
    let (from, to) = (Point3::new(5.0, 5.0, 14.0), Point3::new(50.0, 35.0, 9.0));
    stock.cut(&Sweep::new(&ball, Vector3::z(), from, to).unwrap());
    for (step, bound) in [(1, 5e-3), (2, 5e-2)] {
        let mesh = stock.surface(step).unwrap();
        let volume: f64 = (mesh.triangles.iter())
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.points_mm[i as usize].coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        let exact = stock.volume().best_mm3();
        println!("surface by every {step}: {volume} of {exact}");
        assert!((volume / exact - 1.0).abs() < bound, "{volume} {exact}");
        let grid = *stock.grid();
        // What it encloses is stock again, and closed.
        assert!(Stock::solid(grid, &mesh.points_mm, &mesh.triangles).is_ok());
    }
}
