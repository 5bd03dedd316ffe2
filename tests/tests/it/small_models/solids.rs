//! Small solids with what is hard for a ball: thin plates, fins, rims, wing tips, ledges, bores, leaning sides.

use std::f64::consts::{PI, TAU};

use claymill_nurbs::analytic::{Frame, circle_arc, cylinder, extrusion, plane_patch, revolution, segment};
use claymill_nurbs::{
    Curve2, Curve3, Face, KnotVector, Model, NurbsSurface, Point2, Point3, Source, SurfaceKind, TrimEdge,
    TrimLoop, Vector3,
};
use nalgebra::{Rotation3, Unit};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// A model, and what it is.
pub(crate) struct Solid {
    pub(crate) name: &'static str,
    pub(crate) model: Model,
}

/// Makes the faces of a kind, about so large.
type Make = fn(&mut ChaCha8Rng, f64) -> Vec<Face>;

/// One of the kinds, of chance dimensions, leaning by chance.
pub(crate) fn solid(rng: &mut ChaCha8Rng) -> Solid {
    let size_mm = between(rng, 12.0, 60.0);
    let kinds: [(&str, Make); 13] = [
        ("block", block),
        ("plate", plate),
        ("finned block", finned),
        ("wing", wing),
        ("cup", cup),
        ("wing", wing),
        ("cup", cup),
        ("plate", plate),
        ("ledges", ledges),
        ("bored block", bored),
        ("prism", prism),
        ("shell", shell),
        ("ribbed dome", dome),
    ];
    let (name, make) = kinds[rng.random_range(0..kinds.len())];
    let mut faces = make(rng, size_mm);
    let leans = [0.0, 0.0, 0.05, 0.3, 1.2][rng.random_range(0..5)];
    let axis = Vector3::new(between(rng, -1.0, 1.0), between(rng, -1.0, 1.0), between(rng, -0.3, 0.3));
    let lean = Unit::try_new(axis, 1e-3).map_or_else(Rotation3::identity, |axis| {
        Rotation3::from_axis_angle(&axis, leans * between(rng, -1.0, 1.0))
    });
    let turn = [0.0, between(rng, 0.0, TAU)][rng.random_range(0..2)];
    let turn = lean * Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    for face in &mut faces {
        face.surface = face.surface.mapped(|p| turn * p);
    }
    Solid { name, model: Model { faces, ..Model::default() } }
}

pub(crate) fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low..high)
}

/// A thickness from a few hundredths of a size to a quarter of it, thin ones as often as thick ones.
fn thin(rng: &mut ChaCha8Rng, size_mm: f64) -> f64 {
    size_mm * between(rng, 0.005f64.ln(), 0.25f64.ln()).exp()
}

pub(crate) fn whole(surface: NurbsSurface) -> Face {
    let (kind, source) = (SurfaceKind::Nurbs, Source::default());
    Face { surface, loops: Vec::new(), reversed: false, kind, source }
}

/// Control points by rows and columns, without weights.
fn net([degree_u, degree_v]: [usize; 2], points: Vec<Point3>) -> Face {
    let clamped = |degree: usize| KnotVector::clamped_uniform(degree, degree + 1);
    whole(NurbsSurface::new(clamped(degree_u), clamped(degree_v), points, None).unwrap())
}

/// A body 100 mm wide whose belly slants by 8° to both sides.
pub(crate) fn keel() -> Model {
    let side_mm = 50.0 * 8f64.to_radians().tan();
    let outline = [[0.0, 0.0], [50.0, side_mm], [50.0, 30.0], [-50.0, 30.0], [-50.0, side_mm]];
    Model { faces: drawn_out(&outline, 80.0), ..Model::default() }
}

/// The faces between two closed polygons of equally many corners, without lids.
fn sides(low: &[Point3], high: &[Point3]) -> Vec<Face> {
    let count = low.len();
    let side = |i: usize| {
        let j = (i + 1) % count;
        net([1, 1], vec![low[i], high[i], low[j], high[j]])
    };
    (0..count).map(side).collect()
}

/// A level face in a polygon, with a round hole where one is asked for.
fn lid(corners: &[Point3], hole: Option<(Point2, f64)>) -> Face {
    let z_mm = corners[0].z;
    let frame = Frame::new(Point3::new(0.0, 0.0, z_mm), Vector3::z(), Vector3::x()).unwrap();
    let reach = |k: usize| {
        let (low, high) = corners.iter().fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p[k]), b.max(p[k])));
        (low - 1.0, high + 1.0)
    };
    let edge = |pcurve| TrimEdge { pcurve, shared: None };
    let outer = (0..corners.len()).map(|i| {
        let [a, b] = [corners[i], corners[(i + 1) % corners.len()]].map(|p| p.xy());
        edge(Curve2::line(a, b))
    });
    let round = |(centre, radius_mm): (Point2, f64)| {
        let place = Frame::new(Point3::new(centre.x, centre.y, 0.0), Vector3::z(), Vector3::x()).unwrap();
        let circle = circle_arc(&place, radius_mm, (0.0, TAU)).unwrap();
        let flat = circle.points().iter().map(|p| p.xy()).collect();
        let weights = circle.weights().map(<[f64]>::to_vec);
        let pcurve = Curve2::new(circle.knots().clone(), flat, weights).unwrap().reversed();
        TrimLoop { edges: vec![edge(pcurve)] }
    };
    let mut loops = vec![TrimLoop { edges: outer.collect() }];
    loops.extend(hole.map(round));
    Face { loops, ..whole(plane_patch(&frame, reach(0), reach(1)).unwrap()) }
}

fn rectangle([x, y]: [f64; 2], [wide, deep]: [f64; 2], z_mm: f64) -> Vec<Point3> {
    let at = |sx: f64, sy: f64| Point3::new(x + sx * wide / 2.0, y + sy * deep / 2.0, z_mm);
    vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]
}

/// A box between two heights, whose upper side may be smaller.
fn tapered(at: [f64; 2], size: [f64; 2], [z0, z1]: [f64; 2], upper: f64) -> Vec<Face> {
    let (low, high) = (rectangle(at, size, z0), rectangle(at, size.map(|s| s * upper), z1));
    let mut faces = sides(&low, &high);
    faces.extend([lid(&low, None), lid(&high, None)]);
    faces
}

fn block(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let [wide, deep, high] = [0; 3].map(|_| between(rng, 0.2, 1.0) * size_mm);
    tapered([0.0; 2], [wide, deep], [0.0, high], between(rng, 0.4, 1.3))
}

/// Lying, or standing on edge.
fn plate(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let thick = thin(rng, size_mm);
    let [wide, deep] = [0; 2].map(|_| between(rng, 0.3, 1.0) * size_mm);
    match rng.random_range(0..2) {
        0 => tapered([0.0; 2], [wide, deep], [0.0, thick], 1.0),
        _ => tapered([0.0; 2], [wide, thick], [0.0, deep], between(rng, 0.5, 1.0)),
    }
}

fn finned(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let [deep, high, fin] = [0.6, 0.3, 0.5].map(|share| between(rng, 0.3, 1.0) * share * size_mm);
    let mut faces = tapered([0.0; 2], [size_mm, deep], [0.0, high], between(rng, 0.9, 1.0));
    for k in 0..rng.random_range(1..4) {
        let x = size_mm * (-0.35 + 0.3 * f64::from(k));
        let thick = thin(rng, 0.4 * size_mm);
        // A fin stands on the block, or reaches into it.
        let foot = [high, 0.5 * high][rng.random_range(0..2)];
        let size = [thick, deep * between(rng, 0.3, 0.9)];
        faces.extend(tapered([x, 0.0], size, [foot, high + fin], between(rng, 0.4, 1.0)));
    }
    faces
}

/// The upper and lower side of a section, from the nose to the two ends of a blunt tail.
fn section(origin: Point3, chord_mm: f64, [thick_mm, tail_mm]: [f64; 2], twist: f64) -> [[Point3; 4]; 2] {
    let side = |sign: f64| {
        let (bulge, tail) = (sign * thick_mm, sign * tail_mm / 2.0);
        [[0.0, 0.0], [0.0, bulge], [0.5 * chord_mm, bulge], [chord_mm, tail]].map(|[x, z]| {
            let (sine, cosine) = twist.sin_cos();
            origin + Vector3::new(x * cosine + z * sine, 0.0, z * cosine - x * sine)
        })
    };
    [side(1.0), side(-1.0)]
}

/// Upper and lower side, a blunt tail, and flat faces at both tips.
fn wing(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let (chord, taper) = (between(rng, 0.2, 0.6) * size_mm, between(rng, 0.15, 1.0));
    let thick = [chord * between(rng, 0.05, 0.2), chord * between(rng, 0.003, 0.05)];
    let tip = Point3::new(between(rng, -0.2, 0.5) * chord, size_mm, between(rng, -0.2, 0.2) * size_mm);
    let root = section(Point3::origin(), chord, thick, 0.0);
    let end = section(tip, chord * taper, thick.map(|mm| mm * taper), between(rng, -0.3, 0.3));
    let mut faces: Vec<Face> = (0..2).map(|side| net([1, 3], [root[side], end[side]].concat())).collect();
    faces.push(net([1, 1], [root, end].map(|s| [s[0][3], s[1][3]]).concat()));
    faces.extend([root, end].map(|s| net([1, 3], s.concat())));
    faces
}

/// What a closed line in the plane of radius and height makes, turned around the axis.
fn turned(line: &[[f64; 2]]) -> Vec<Face> {
    let at = |[r, z]: [f64; 2]| Point3::new(r, 0.0, z);
    let closed = line.iter().zip(line.iter().cycle().skip(1)).take(line.len());
    let piece = |(a, b): (&[f64; 2], &[f64; 2])| {
        let curve: Curve3 = segment(at(*a), at(*b), (0.0, 1.0)).unwrap();
        whole(revolution(&curve, &Point3::origin(), &Vector3::z(), (0.0, TAU)).unwrap())
    };
    closed.map(piece).collect()
}

/// A cup or a ring with a narrow rim.
fn cup(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let (foot, rim, high) = (
        size_mm * between(rng, 0.2, 0.5),
        size_mm * between(rng, 0.25, 0.5),
        size_mm * between(rng, 0.1, 0.8),
    );
    let thick = thin(rng, size_mm).min(0.3 * foot.min(rim));
    match rng.random_range(0..2) {
        0 => turned(&[[foot, 0.0], [rim, high], [rim - thick, high], [foot - thick, 0.0]]),
        _ => {
            let hub = 0.1 * foot;
            let floor = 0.2 * high;
            turned(&[
                [hub, 0.0],
                [foot, 0.0],
                [rim, high],
                [rim - thick, high],
                [foot - thick, floor],
                [hub, floor],
            ])
        }
    }
}

/// An outline in the plane of x and z, drawn out along y.
fn drawn_out(outline: &[[f64; 2]], deep_mm: f64) -> Vec<Face> {
    let corners = |y: f64| -> Vec<Point3> { outline.iter().map(|&[x, z]| Point3::new(x, y, z)).collect() };
    let mut faces = sides(&corners(0.0), &corners(deep_mm));
    let lying: Vec<Point3> = outline.iter().map(|&[x, z]| Point3::new(x, z, 0.0)).collect();
    for y in [0.0, deep_mm] {
        let mut face = lid(&lying, None);
        face.surface = face.surface.mapped(|p| Point3::new(p.x, y, p.y));
        faces.push(face);
    }
    faces
}

fn ledges(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let (mut x, mut z) = (0.0, 0.0);
    let mut outline = Vec::new();
    for _ in 0..rng.random_range(2..6) {
        let lean = [0.0, between(rng, -0.1, 0.1)][rng.random_range(0..2)];
        outline.push([x, z]);
        z += thin(rng, size_mm);
        outline.push([x + lean * (z - outline[outline.len() - 1][1]), z]);
        x += thin(rng, size_mm).max(0.02 * size_mm);
    }
    let floor = -0.1 * size_mm;
    outline.extend([[x, z], [x, floor], [0.0, floor]]);
    drawn_out(&outline, size_mm * between(rng, 0.2, 0.8))
}

fn bored(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let [wide, deep] = [0; 2].map(|_| between(rng, 0.4, 1.0) * size_mm);
    let high = thin(rng, size_mm).max(0.05 * size_mm);
    let radius_mm = 0.5 * wide.min(deep) * between(rng, 0.1, 0.97);
    let (low, up) = (rectangle([0.0; 2], [wide, deep], 0.0), rectangle([0.0; 2], [wide, deep], high));
    let hole = Some((Point2::origin(), radius_mm));
    let mut faces = sides(&low, &up);
    faces.extend([lid(&low, hole), lid(&up, hole)]);
    let wall = segment(Point3::new(radius_mm, 0.0, 0.0), Point3::new(radius_mm, 0.0, high), (0.0, high));
    faces.push(whole(revolution(&wall.unwrap(), &Point3::origin(), &Vector3::z(), (0.0, TAU)).unwrap()));
    faces
}

/// A block with a bore through it, whose wall is two halves.
pub(crate) fn eye(radius_mm: f64, high_mm: f64) -> Model {
    let [low, up] = [0.0, high_mm].map(|z| rectangle([0.0; 2], [4.0 * radius_mm; 2], z));
    let hole = Some((Point2::origin(), radius_mm));
    let mut faces = sides(&low, &up);
    faces.extend([lid(&low, hole), lid(&up, hole)]);
    let frame = Frame::new(Point3::origin(), Vector3::z(), Vector3::x()).unwrap();
    for half in [(0.0, PI), (PI, TAU)] {
        faces.push(whole(cylinder(&frame, radius_mm, half, (0.0, high_mm)).unwrap()));
    }
    Model { faces, ..Model::default() }
}

/// A polygon drawn out aslant.
fn prism(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let count: u32 = rng.random_range(3..8);
    let radius = size_mm * between(rng, 0.15, 0.5);
    let high = thin(rng, 2.0 * size_mm);
    let aside = Vector3::new(between(rng, -0.4, 0.4), between(rng, -0.4, 0.4), 0.0) * high;
    let shrink = between(rng, 0.3, 1.2);
    let corner = |k: u32| {
        let (sine, cosine) = (TAU * f64::from(k) / f64::from(count)).sin_cos();
        Point3::new(radius * cosine, radius * sine, 0.0)
    };
    let low: Vec<Point3> = (0..count).map(corner).collect();
    let up: Vec<Point3> =
        low.iter().map(|p| Point3::from(p.coords * shrink) + aside + Vector3::z() * high).collect();
    let mut faces = sides(&low, &up);
    faces.extend([lid(&low, None), lid(&up, None)]);
    faces
}

/// A bent sheet of some thickness with its narrow faces around.
fn shell(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let (deep, thick) = (size_mm * between(rng, 0.3, 1.0), thin(rng, size_mm));
    let bulge = size_mm * between(rng, 0.02, 0.3);
    let heights: Vec<f64> = (0..16).map(|_| bulge * between(rng, -1.0, 1.0)).collect();
    let sheet = |down: f64| -> Vec<Point3> {
        let at = |k: usize| {
            let (i, j) = (k / 4, k % 4);
            Point3::new(size_mm * i as f64 / 3.0, deep * j as f64 / 3.0, heights[k] - down)
        };
        (0..16).map(at).collect()
    };
    let (up, low) = (sheet(0.0), sheet(thick));
    let edge = |of: fn(usize) -> usize| {
        let line = |points: &[Point3]| (0..4).map(|k| points[of(k)]).collect::<Vec<_>>();
        net([1, 3], [line(&up), line(&low)].concat())
    };
    let around = [edge(|k| k), edge(|k| 12 + k), edge(|k| 4 * k), edge(|k| 4 * k + 3)];
    [net([3, 3], up.clone()), net([3, 3], low.clone())].into_iter().chain(around).collect()
}

/// A round body with a rib across.
fn dome(rng: &mut ChaCha8Rng, size_mm: f64) -> Vec<Face> {
    let radius = size_mm * between(rng, 0.25, 0.5);
    let high = radius * between(rng, 0.3, 1.0);
    let arc: Vec<Point3> =
        [[radius, 0.0], [radius, 0.55 * high], [0.55 * radius, high], [0.03 * radius, high]]
            .map(|[r, z]| Point3::new(r, 0.0, z))
            .into();
    let meridian = Curve3::new(KnotVector::clamped_uniform(3, 4), arc, None).unwrap();
    let mut faces = vec![whole(revolution(&meridian, &Point3::origin(), &Vector3::z(), (0.0, TAU)).unwrap())];
    faces.extend(turned(&[[0.03 * radius, 0.0], [radius, 0.0]]).drain(..1));
    let (thick, top) = (thin(rng, 0.5 * size_mm), high * between(rng, 0.8, 1.4));
    let upright = extrusion(
        &segment(Point3::new(-radius, 0.0, 0.0), Point3::new(radius, 0.0, 0.0), (0.0, 1.0)).unwrap(),
        &Vector3::z(),
        (0.0, top),
    );
    match rng.random_range(0..3) {
        // A sheet without thickness.
        0 => faces.push(whole(upright.unwrap())),
        _ => faces.extend(tapered([0.0; 2], [1.8 * radius, thick], [0.0, top], between(rng, 0.6, 1.0))),
    }
    faces
}
