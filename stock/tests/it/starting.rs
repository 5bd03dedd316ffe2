//! What stock starts from: blocks, cylinders, closed meshes, any intervals.

use std::f64::consts::{PI, TAU};

use claymill_nurbs::{Aabb, Point3, Vector3};
use claymill_stock::{Family, Grid, Stock, StockError};

use super::{block, bounds};

#[test]
fn a_block_of_whole_cells_has_its_volume_and_little_memory() {
    let stock = block([-10.0, 5.0, 0.1], [290.0, 205.0, 100.1], 0.5);
    assert_eq!(stock.volume().families_mm3, [6e6; 3]);
    // Rays: 1.02 million. All tiles of a row are one.
    assert!(stock.bytes_in_memory() < 2_000_000, "{}", stock.bytes_in_memory());
    // The same in a larger grid.
    let grid = Grid::over(&bounds([-20.0, 0.0, 0.1], [300.0, 205.0, 120.1]), 0.5).unwrap();
    let within = Stock::block_in(grid, &bounds([-10.0, 5.0, 0.1], [290.0, 205.0, 100.1])).unwrap();
    assert_eq!(within.volume().families_mm3, [6e6; 3]);
    // A block that ends within cells has what the rays through their middles say.
    let stock = block([0.0; 3], [10.4, 10.6, 10.0], 1.0);
    assert_eq!(stock.volume().families_mm3, [11.0 * 10.4 * 10.0, 10.6 * 10.0 * 10.0, 11.0 * 10.0 * 10.0]);
}

#[test]
fn a_cylinder_along_each_axis_has_its_volume() {
    for along in Family::ALL {
        let stock = Stock::cylinder(along, Point3::new(3.0, -7.0, 20.0), 25.0, 60.0, 0.5).unwrap();
        for volume in stock.volume().families_mm3 {
            assert!((volume / (PI * 625.0 * 60.0) - 1.0).abs() < 2e-3, "{along:?} {volume}");
        }
        let refused = Stock::cylinder(along, Point3::origin(), f64::NAN, 1.0, 0.5).unwrap_err();
        assert!(matches!(refused, StockError::Radius(_)));
        assert!(Stock::cylinder(along, Point3::origin(), 1.0, f64::NAN, 0.5).is_err());
    }
}

/// A cube whose faces are divided through their middles: rays meet edges and corners exactly.
fn cube(low: f64, high: f64) -> (Vec<Point3>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let middle = 0.5 * (low + high);
    for axis in 0..3 {
        for side in [low, high] {
            let first = points.len() as u32;
            let place = |u: f64, v: f64| {
                let mut p = Point3::origin();
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
                p
            };
            points.push(place(middle, middle));
            points.extend([[low, low], [high, low], [high, high], [low, high]].map(|[u, v]| place(u, v)));
            triangles.extend((0..4).map(|i| [first, first + 1 + i, first + 1 + (i + 1) % 4]));
        }
    }
    (points, triangles)
}

#[test]
fn rays_through_edges_and_corners_of_a_mesh_count_once() {
    let (points, triangles) = cube(0.0, 10.0);
    // Middles of cells are at whole and half millimetres: on diagonals, on borders and in their common corner.
    for pitch in [1.0, 0.5] {
        let grid = Grid::over(&bounds([-2.0 - 0.5 * pitch; 3], [12.0 + 0.5 * pitch; 3]), pitch).unwrap();
        let stock = Stock::solid(grid, &points, &triangles).unwrap();
        // On one of two opposite borders a ray is inside, on the other it is not.
        assert_eq!(stock.volume().families_mm3, [1000.0; 3], "{pitch}");
    }
}

fn ball(radius: f64, count: u32) -> (Vec<Point3>, Vec<[u32; 3]>) {
    let (mut points, mut triangles) = (vec![Point3::new(0.0, 0.0, radius)], Vec::new());
    for i in 1..count {
        let (sine, cosine) = (PI * f64::from(i) / f64::from(count)).sin_cos();
        for j in 0..2 * count {
            let (y, x) = (TAU * f64::from(j) / f64::from(2 * count)).sin_cos();
            points.push(Point3::new(radius * sine * x, radius * sine * y, radius * cosine));
        }
    }
    points.push(Point3::new(0.0, 0.0, -radius));
    let last = points.len() as u32 - 1;
    let at = |i: u32, j: u32| 1 + (i - 1) * 2 * count + j % (2 * count);
    for j in 0..2 * count {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([last, at(count - 1, j + 1), at(count - 1, j)]);
        for i in 1..count - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    (points, triangles)
}

/// Volume by the divergence theorem.
fn enclosed(points: &[Point3], triangles: &[[u32; 3]]) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| points[i as usize].coords);
        a.dot(&b.cross(&c)) / 6.0
    };
    triangles.iter().map(of).sum()
}

#[test]
fn a_mesh_encloses_its_volume_however_it_is_wound() {
    let (points, mut triangles) = ball(30.0, 40);
    let exact = enclosed(&points, &triangles);
    triangles.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    for (pitch, bound) in [(1.0, 1e-3), (0.5, 3e-4)] {
        let grid = Grid::over(&Aabb::of(&points), pitch).unwrap();
        let stock = Stock::solid(grid, &points, &triangles).unwrap();
        for volume in stock.volume().families_mm3 {
            assert!((volume / exact - 1.0).abs() < bound, "{pitch}: {volume} {exact}");
        }
    }
}

#[test]
fn what_encloses_nothing_is_refused() {
    let (points, mut triangles) = cube(0.0, 10.0);
    let grid = Grid::over(&Aabb::of(&points), 1.0).unwrap();
    triangles.push([0, 1, 999]);
    let refused =
        |points: &[Point3], triangles: &[[u32; 3]]| Stock::solid(grid, points, triangles).unwrap_err();
    assert_eq!(
        refused(&points, &triangles),
        StockError::NoVertex { triangle: 24, vertex: 999, vertices: 30 }
    );
    triangles.truncate(23);
    let StockError::OpenMesh { edges, at_mm } = refused(&points, &triangles) else { panic!("it is open") };
    assert_eq!((edges, at_mm), (3, Point3::new(0.0, 0.0, 10.0)));
    let mut broken = points.clone();
    broken[3].y = f64::NAN;
    assert!(matches!(refused(&broken, &triangles), StockError::NotFinite(_)));
    assert_eq!(refused(&points, &[]), StockError::Empty { pitch_mm: 1.0 });
}

#[test]
fn intervals_come_in_any_order_and_are_rounded_outwards() {
    let grid = Grid::over(&bounds([0.0; 3], [4.0; 3]), 1.0).unwrap();
    let stock = Stock::from_rays(grid, |_| Some(vec![[3.0, 3.5], [0.000_05, 1.0], [0.5, 2.000_01]])).unwrap();
    assert_eq!(stock.on_ray(Family::Y, [1, 2]), [[0.0, 2.0001], [3.0, 3.5]]);
    assert!(stock.on_ray(Family::Y, [4, 0]).is_empty());
    for bad in [[1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        assert!(matches!(Stock::from_rays(grid, |_| Some(vec![bad])), Err(StockError::Interval { .. })));
    }
    assert_eq!(Stock::from_rays(grid, |_| None), Err(StockError::Empty { pitch_mm: 1.0 }));
}

/// A square of 100 mm as two triangles, with a layer: a plate, half cylinders at its sides, quarter balls at its corners.
#[test]
fn a_layer_is_everything_within_its_thickness() {
    let (thickness, side) = (10.0, 100.0);
    let points = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]].map(|[x, y]| Point3::new(x, y, 0.0));
    let grid = Grid::over(&bounds([-12.0, -12.0, -12.0], [112.0, 112.0, 12.0]), 0.5).unwrap();
    let layer = Stock::layer(grid, &points, &[[0, 1, 2], [0, 2, 3]], thickness).unwrap();
    let volume = |t: f64| 2.0 * t * side * side + 2.0 * PI * t * t * side + 4.0 / 3.0 * PI * t.powi(3);
    let largest = thickness.hypot(0.1 * thickness) + 1e-3;
    for found in layer.volume().families_mm3 {
        assert!(found > 0.999 * volume(thickness) && found < 1.001 * volume(largest), "{found}");
    }
    // No place within the thickness is without stock, and none beyond the largest has any.
    for i in 0..40 {
        let p = Point3::new(2.5 * f64::from(i) + 0.3, 97.0 - 2.3 * f64::from(i), 0.0);
        for direction in [1.0, -1.0] {
            let found = layer.thickness_along(&p, &Vector3::new(0.0, 0.0, direction)).unwrap();
            assert!(found >= thickness && found <= largest, "{found} at {p}");
        }
    }
    assert!(matches!(Stock::layer(grid, &points, &[[0, 1, 4]], 1.0), Err(StockError::NoVertex { .. })));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Stock::layer(grid, &points, &[[0, 1, 2]], bad), Err(StockError::Size { .. })));
    }
}
