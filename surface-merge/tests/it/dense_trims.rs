//! Plates with very many trimmed holes, their trim curves in parameter windows of any width and offset.

use std::f64::consts::SQRT_2;
use std::sync::mpsc;
use std::time::Duration;

use crate::scene::face;
use claymill_nurbs::{Curve2, Face, KnotVector, Model, NurbsSurface, Point2, Point3, TrimEdge, TrimLoop};
use claymill_surface_merge::{Merge, MergeOptions, merge};

/// Size of a cell of the plate with one hole or slot in it, mm.
const CELL_MM: f64 = 20.0;
const RADIUS_MM: f64 = 4.0;
/// Half the length of a slot's straight sides, mm.
const SLOT_MM: f64 = 3.0;
/// The plate's parameters are this many times its millimetres.
const PER_MM: f64 = 0.001;
/// No merge of this size takes so long.
const PATIENCE: Duration = Duration::from_secs(120);

/// Parameter windows of trim curves in which a millionth of a millimetre can be told apart.
const FINE: [(f64, f64); 5] =
    [(0.0, 1.0), (0.999_999_98, 0.999_999_99), (1e6, 1e6 + 1.0), (-4e9, -4e9 + 1e3), (-1e-12, 1e-12)];

/// Others, with a few hundred numbers in them.
const COARSE: [(f64, f64); 3] =
    [(0.999_999_987_438_820_7, 0.999_999_987_438_9), (1e6, 1e6 + 5e-8), (-4e9, -4e9 + 1e-4)];

/// A curve of a plan view: a straight line, or a quarter of a circle.
#[derive(Clone, Copy)]
struct Stretch {
    ends: [Point2; 2],
    corner: Option<Point2>,
}

impl Stretch {
    fn points(&self) -> Vec<Point2> {
        self.corner.map_or_else(|| self.ends.to_vec(), |corner| vec![self.ends[0], corner, self.ends[1]])
    }

    fn weights(&self) -> Option<Vec<f64>> {
        self.corner.map(|_| vec![1.0, 1.0 / SQRT_2, 1.0])
    }

    fn knots(&self, (t0, t1): (f64, f64)) -> KnotVector {
        let degree = self.points().len() - 1;
        KnotVector::new(degree, [vec![t0; degree + 1], vec![t1; degree + 1]].concat()).unwrap()
    }

    /// On the plate, in a parameter window.
    fn pcurve(&self, window: (f64, f64)) -> Curve2 {
        let points = self.points().iter().map(|p| p * PER_MM).collect();
        Curve2::new(self.knots(window), points, self.weights()).unwrap()
    }

    /// The wall below; its upper side leaves the plate's by `sinks_mm` on its way.
    fn wall(&self, sinks_mm: f64) -> NurbsSurface {
        let points = self.points();
        let last = (points.len() - 1) as f64;
        let rows = points.iter().enumerate().flat_map(|(i, p)| {
            let top = -sinks_mm * i as f64 / last;
            [Point3::new(p.x, p.y, top), Point3::new(p.x, p.y, -10.0)]
        });
        let weights = self.weights().map(|w| w.into_iter().flat_map(|w| [w, w]).collect());
        NurbsSurface::new(self.knots((0.0, 1.0)), KnotVector::clamped_uniform(1, 2), rows.collect(), weights)
            .unwrap()
    }
}

/// A round hole, or a slot, clockwise.
fn hole(centre: Point2, half_length: f64) -> Vec<Stretch> {
    let at = |x: f64, y: f64| Point2::new(centre.x + x, centre.y + y);
    let (l, r) = (half_length, RADIUS_MM);
    let arc = |a: Point2, corner: Point2, b: Point2| Stretch { ends: [a, b], corner: Some(corner) };
    let line = |a: Point2, b: Point2| Stretch { ends: [a, b], corner: None };
    let mut around = vec![
        arc(at(-l - r, 0.0), at(-l - r, r), at(-l, r)),
        arc(at(l, r), at(l + r, r), at(l + r, 0.0)),
        arc(at(l + r, 0.0), at(l + r, -r), at(l, -r)),
        arc(at(-l, -r), at(-l - r, -r), at(-l - r, 0.0)),
    ];
    if l > 0.0 {
        around.insert(3, line(at(l, -r), at(-l, -r)));
        around.insert(1, line(at(-l, r), at(l, r)));
    }
    around
}

fn trim(stretches: &[Stretch], window: (f64, f64)) -> TrimLoop {
    let edge = |s: &Stretch| TrimEdge { pcurve: s.pcurve(window), shared: None };
    TrimLoop { edges: stretches.iter().map(edge).collect() }
}

/// A plate of so many cells with a wall under each stretch of each hole.
fn housing(columns: usize, rows: usize, window: (f64, f64)) -> Model {
    let (x, y) = (columns as f64 * CELL_MM, rows as f64 * CELL_MM);
    let corners = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)].map(|(x, y)| Point2::new(x, y));
    let outside: Vec<Stretch> =
        (0..4).map(|k| Stretch { ends: [corners[k], corners[(k + 1) % 4]], corner: None }).collect();
    let mut loops = vec![trim(&outside, window)];
    let mut walls: Vec<Face> = Vec::new();
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let centre = Point2::new((i as f64 + 0.5) * CELL_MM, (j as f64 + 0.5) * CELL_MM);
        let around = hole(centre, if (i + j) % 2 == 0 { 0.0 } else { SLOT_MM });
        loops.push(trim(&around, window));
        walls.extend(around.iter().map(|s| face(s.wall(0.05))));
    }
    let knots =
        |length: f64| KnotVector::new(1, [0.0, 0.0, length * PER_MM, length * PER_MM].into()).unwrap();
    let net = [(0.0, 0.0), (0.0, y), (x, 0.0), (x, y)].map(|(x, y)| Point3::new(x, y, 0.0)).to_vec();
    let plate = NurbsSurface::new(knots(x), knots(y), net, None).unwrap();
    let mut faces = vec![Face { loops, ..face(plate) }];
    faces.append(&mut walls);
    Model { faces, ..Model::default() }
}

/// Merges in a thread of its own, so that a merge that does not end fails.
fn merged(model: Model) -> Merge {
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || drop(send.send(merge(&model, &MergeOptions::default()))));
    receive.recv_timeout(PATIENCE).expect("merging ends").unwrap()
}

#[test]
fn joints_that_end_within_edges_do_not_depend_on_the_windows_of_trim_curves() {
    let joints = |window| {
        let mut found: Vec<(usize, usize, f64)> = merged(housing(4, 3, window))
            .joints
            .iter()
            .map(|j| (j.sides[0].face, j.sides[1].face, j.length_mm))
            .collect();
        found.sort_by_key(|f| (f.0, f.1));
        found
    };
    let usual = joints(FINE[0]);
    // Every wall follows the plate for some way, and none of them all the way.
    let partly = usual.iter().filter(|j| j.0 == 0 && j.2 > 0.5 && j.2 < 5.5).count();
    assert_eq!(partly, 12 * 4 + 6 * 2, "{usual:?}");
    for window in FINE {
        let here = joints(window);
        assert_eq!(here.len(), usual.len(), "{window:?}");
        for (a, b) in here.iter().zip(&usual) {
            assert_eq!((a.0, a.1), (b.0, b.1));
            assert!((a.2 - b.2).abs() < 1e-5, "{window:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn merging_ends_where_parameters_can_hardly_be_told_apart() {
    for window in COARSE {
        assert!(!merged(housing(3, 2, window)).joints.is_empty());
    }
}

#[test]
fn a_housing_with_hundreds_of_holes_is_merged_in_seconds() {
    let model = housing(20, 15, FINE[1]);
    let begun = std::time::Instant::now();
    let found = merged(model);
    assert!(found.joints.len() >= 20 * 15 * 4);
    assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
}
