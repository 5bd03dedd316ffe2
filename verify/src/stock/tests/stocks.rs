//! What a program starts from: membership, distances, volumes.

use claymill_nurbs::{MeshOptions, Model, NurbsSurface};

use super::super::{BoxInStock, InitialStock, StockError, Table};
use super::*;

/// Twelve triangles of a box.
fn box_mesh(low: [f64; 3], high: [f64; 3]) -> (Vec<Point3>, Vec<[u32; 3]>) {
    let corner = |k: usize| [0, 1, 2].map(|i| if k >> i & 1 == 0 { low[i] } else { high[i] });
    let points = (0..8).map(|k| Point3::from(corner(k))).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (points, quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect())
}

#[test]
fn a_mesh_is_the_block_that_it_bounds() {
    let (low, high) = ([-3.0, 1.0, 2.0], [7.0, 9.0, 11.0]);
    let (points, triangles) = box_mesh(low, high);
    let mesh = InitialStock::mesh(&points, &triangles).unwrap();
    let exact = block(low, high);
    let mut r = Random(3);
    for _ in 0..20_000 {
        let p = Point3::new(2.0, 5.0, 6.0) + r.vector(8.0);
        assert_eq!(mesh.contains(&p), exact.contains(&p), "{p}");
        let (a, b) = (mesh.signed_mm(&p), exact.signed_mm(&p));
        // Beside edges the block's distance is a lower bound.
        assert!(if b < 0.0 { (a - b).abs() < 1e-9 } else { a >= b - 1e-9 }, "{p} {a} {b}");
    }
    // On the diagonals of the sides, where rays meet edges.
    for k in 1..100 {
        let t = f64::from(k) / 100.0;
        let p = Point3::new(-3.0 + 10.0 * t, 1.0 + 8.0 * t, 2.0 + 9.0 * t);
        assert!(mesh.contains(&p), "{p}");
    }
    // Two boxes that run into each other are their union.
    let (more, others) = box_mesh([5.0, 5.0, 5.0], [15.0, 15.0, 15.0]);
    let first = points.len() as u32;
    let points: Vec<Point3> = points.into_iter().chain(more).collect();
    let triangles: Vec<[u32; 3]> =
        triangles.into_iter().chain(others.iter().map(|t| t.map(|i| i + first))).collect();
    let both = InitialStock::mesh(&points, &triangles).unwrap();
    assert!(
        [[6.0, 6.0, 6.0], [14.0, 14.0, 14.0], [0.0, 2.0, 3.0]]
            .map(Point3::from)
            .iter()
            .all(|p| both.contains(p))
    );
    assert!(!both.contains(&Point3::new(14.0, 2.0, 3.0)));
    assert!(matches!(
        InitialStock::mesh(&points, &triangles[1..]),
        Err(StockError::OpenMesh { open_edges: 3 })
    ));
    assert!(matches!(InitialStock::mesh(&points, &[]), Err(StockError::Empty(_))));
    assert!(matches!(InitialStock::mesh(&points, &[[0, 1, 99]]), Err(StockError::Vertex { triangle: 0 })));
}

#[test]
fn a_leaning_cylinder_and_boxes_against_it() {
    let axis = Vector3::new(0.0, 3.0, 4.0);
    let stock = InitialStock::cylinder(Point3::new(1.0, 2.0, 3.0), axis, 5.0, 20.0).unwrap();
    let a = axis.normalize();
    let middle = Point3::new(1.0, 2.0, 3.0) + a * 10.0;
    assert!((stock.signed_mm(&middle) + 5.0).abs() < 1e-12);
    assert!(
        stock.contains(&(middle + Vector3::x() * 4.999)) && !stock.contains(&(middle + Vector3::x() * 5.001))
    );
    let b = |p: Point3, half: f64| claymill_nurbs::Aabb { min: p, max: p }.inflated(half);
    assert_eq!(stock.over_box(&b(middle, 1.0)), BoxInStock::Inside);
    assert_eq!(stock.over_box(&b(middle + Vector3::x() * 9.0, 1.0)), BoxInStock::Outside);
    assert_eq!(stock.over_box(&b(middle + Vector3::x() * 5.0, 1.0)), BoxInStock::Undecided);
    let bounds = stock.bounds();
    let mut r = Random(5);
    for _ in 0..5000 {
        let p = middle + r.vector(20.0);
        assert!(!stock.contains(&p) || bounds.distance_squared(&p) == 0.0, "{p}");
    }
    let t = stock.last_inside(&middle, &Vector3::x(), [-20.0, 20.0]).unwrap();
    assert!((t - 5.0).abs() < 1e-8 && stock.last_inside(&middle, &Vector3::x(), [6.0, 20.0]).is_none());
}

/// A bilinear sheet, z = 10 at x = 0 and 20 at x = 40, y from 0 to 30.
fn sheet() -> Model {
    let net = [[0.0, 0.0, 10.0], [0.0, 30.0, 10.0], [40.0, 0.0, 20.0], [40.0, 30.0, 20.0]];
    let knots = KnotVector::new(1, vec![0.0, 0.0, 1.0, 1.0]).unwrap();
    let surface = NurbsSurface::new(knots.clone(), knots, net.map(Point3::from).to_vec(), None).unwrap();
    claymill_tests::model_of([surface])
}

#[test]
fn a_layer_on_a_sheet_and_all_below_it() {
    let model = sheet();
    let mesh = MeshOptions { deviation_mm: 0.01, longest_edge_mm: 5.0 };
    let table = Table { down: Vector3::new(0.0, 0.0, -2.0), height_mm: 1.0 };
    let solid = InitialStock::layer(&model, 3.0, Some(table), &mesh).unwrap();
    let thin = InitialStock::layer(&model, 3.0, None, &mesh).unwrap();
    let n = Vector3::new(-10.0, 0.0, 40.0).normalize();
    let on = Point3::new(20.0, 15.0, 15.0);
    assert!(solid.contains(&(on + n * 2.999)) && !solid.contains(&(on + n * 3.001)));
    assert!(thin.contains(&(on - n * 2.999)) && !thin.contains(&(on - n * 3.001)));
    assert!(
        solid.contains(&Point3::new(20.0, 15.0, 1.001)) && !solid.contains(&Point3::new(20.0, 15.0, 0.999))
    );
    assert!(!solid.contains(&Point3::new(-0.5, 15.0, 3.0)) && solid.contains(&Point3::new(0.5, 15.0, 3.0)));
    // No seam between triangles lets light through, no distance changes faster than its point, no sign is wrong.
    let mut r = Random(23);
    for _ in 0..3000 {
        let inside = Point3::new(r.between(0.01, 39.99), r.between(0.01, 29.99), r.between(1.01, 9.9));
        assert!(solid.contains(&inside), "{inside}");
        let (p, q) =
            (Point3::new(20.0, 15.0, 10.0) + r.vector(25.0), Point3::new(20.0, 15.0, 10.0) + r.vector(25.0));
        for stock in [&solid, &thin] {
            let (a, b) = (stock.signed_mm(&p), stock.signed_mm(&q));
            assert!((a - b).abs() <= (p - q).norm() + 1e-9, "{p} {q} {a} {b}");
            assert!(a == 0.0 || (a < 0.0) == stock.contains(&p), "{p} {a}");
            assert!(!stock.contains(&p) || stock.bounds().distance_squared(&p) == 0.0, "{p}");
        }
    }
    // Down on the sheet: a rapid 4 mm above it is clear of a layer of 3 mm, one at 2 mm is not.
    let above = |d: f64| {
        let [a, b] = [(2.0, 10.5), (38.0, 19.5)]
            .map(|(x, z)| Point3::new(x, 15.0, z) + n * (d + 2.0) - Vector3::z() * 2.0);
        straight(MoveKind::Rapid, a.into(), b.into())
    };
    let moves = [above(4.0), above(2.0)];
    let check = check(solid, &moves, &[tool("T1", "ball:2", None)]);
    assert_eq!(check.rapid_is_clear(0, 0).unwrap(), super::super::StockProof::Clear);
    let found = check.rapid_is_clear(1, 0).unwrap();
    assert!(matches!(&found, super::super::StockProof::Hit(h) if (h.size_mm - 1.0).abs() < 0.1), "{found:?}");
}
