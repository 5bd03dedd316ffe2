//! The bounds of a face once more, for [`crate::audit`]: edges are followed from vertex to vertex by code of its own.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use claymill_nurbs::analytic::Frame;
use claymill_nurbs::{Curve3, Point3, Vector3};
use nalgebra::Similarity3;

use super::assembly::PlacedFace;
use super::curves::{Curve, space_curve};
use super::part21::Part21;
use super::placement::{frame, point, vertex};
use super::{Context, StepError};
use crate::audit::{Bounds, Carrier, Node, Ring, over, parts};

/// Conics are integrated in steps of this, radians.
const STEP: f64 = 0.2;
/// Samples of a spline's piece from which the place of a vertex is looked for, and steps to it.
const SAMPLES: usize = 16;
const NEWTON_STEPS: usize = 30;

/// The bounds of a face, as far as they can be followed.
pub(super) fn bounds(file: &Part21, placed: &PlacedFace, context: &Context) -> Bounds {
    if placed.bare {
        return Bounds::default();
    }
    look(file, placed, context).unwrap_or_default()
}

fn look(file: &Part21, placed: &PlacedFace, context: &Context) -> Result<Bounds, StepError> {
    let entity = file.get(placed.id)?;
    let record = match entity.part("ADVANCED_FACE") {
        Ok(record) => record,
        Err(_) => entity.part("FACE_SURFACE")?,
    };
    let (listed, surface, sense) = (record.references(1)?, record.reference(2)?, record.flag(3)?);
    let place = Place { placement: placed.placement, mm_per_unit: context.mm_per_unit };
    // A bound that is listed again is the same bound, and so is another one around the same edges.
    let (mut seen, mut rounds) = (BTreeSet::new(), BTreeSet::new());
    let (mut bounds, mut rings) = (0, Some(Vec::new()));
    for id in listed.into_iter().filter(|bound| seen.insert(*bound)) {
        let Ok((ring, round)) = ring(file, id, context, &place) else {
            (bounds, rings) = (bounds + 1, None);
            continue;
        };
        if round.is_some_and(|round| !rounds.insert(round)) {
            continue;
        }
        bounds += 1;
        if let Some(rings) = rings.as_mut().filter(|_| !ring.nodes.is_empty()) {
            rings.push(ring);
        }
    }
    Ok(Bounds {
        listed: bounds,
        rings,
        flats: None,
        carrier: carrier(file, surface, context.angle_unit, &place).ok().flatten(),
        sense,
        directed: true,
        turned: placed.reversed,
    })
}

/// From the file's coordinates to the model's.
struct Place {
    placement: Similarity3<f64>,
    mm_per_unit: f64,
}

impl Place {
    fn point(&self, p: Point3) -> Point3 {
        self.placement.transform_point(&(p * self.mm_per_unit))
    }

    fn scale(&self) -> f64 {
        self.mm_per_unit * self.placement.scaling()
    }

    fn frame(&self, frame: &Frame) -> Option<Frame> {
        let turned = |d: &Vector3| self.placement.isometry.rotation * d;
        Frame::new(self.point(frame.origin), turned(&frame.z), turned(&frame.x))
    }
}

/// Surfaces of which edges alone tell the area.
fn carrier(file: &Part21, id: u64, angle_unit: f64, place: &Place) -> Result<Option<Carrier>, StepError> {
    let entity = file.get(id)?;
    let Ok(record) = entity.only() else { return Ok(None) };
    let length = |k: usize| record.number(k).map(|x| x * place.scale());
    let kind = entity.simple_name();
    if !matches!(
        kind,
        "PLANE" | "CYLINDRICAL_SURFACE" | "CONICAL_SURFACE" | "SPHERICAL_SURFACE" | "TOROIDAL_SURFACE"
    ) {
        return Ok(None);
    }
    let Some(frame) = place.frame(&frame(file, record.reference(1)?)?) else { return Ok(None) };
    Ok(Some(match kind {
        "PLANE" => Carrier::Plane { normal: frame.z },
        "CYLINDRICAL_SURFACE" => Carrier::Cylinder { frame, radius: length(2)? },
        "CONICAL_SURFACE" => {
            Carrier::Cone { frame, radius: length(2)?, slope: (record.number(3)? * angle_unit).tan() }
        }
        "SPHERICAL_SURFACE" => Carrier::Sphere { centre: frame.origin, radius: length(2)? },
        _ => Carrier::Torus { frame, major: length(2)?, minor: length(3)? },
    }))
}

/// Edges of a loop, and whether it runs them backward; from the first of them on, whichever one the file begins with.
type Round = Vec<(u64, bool)>;

/// FACE_BOUND(name, loop, orientation).
fn ring(
    file: &Part21,
    id: u64,
    context: &Context,
    place: &Place,
) -> Result<(Ring, Option<Round>), StepError> {
    let entity = file.get(id)?;
    let record = match entity.part("FACE_OUTER_BOUND") {
        Ok(record) => record,
        Err(_) => entity.part("FACE_BOUND")?,
    };
    let (edge_loop, forward) = (file.get(record.reference(1)?)?, record.flag(2)?);
    let mut walk = Vec::new();
    let mut edges = Vec::new();
    match edge_loop.simple_name() {
        "EDGE_LOOP" => {
            for oriented in edge_loop.only()?.references(1)? {
                let oriented = file.get(oriented)?;
                let record = oriented.part("ORIENTED_EDGE")?;
                let edge = record.reference(3)?;
                let along = record.flag(4)?;
                let mut steps = edge_nodes(file, edge, context)?;
                if !along {
                    turn(&mut steps);
                }
                walk.append(&mut steps);
                edges.push((edge, along != forward));
            }
        }
        "POLY_LOOP" => {
            let corners = edge_loop.only()?.references(1)?;
            let corners: Result<Vec<Point3>, _> = corners.iter().map(|c| point(file, *c)).collect();
            let corners = corners?;
            for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                walk.extend(straight(a, b));
            }
        }
        "VERTEX_LOOP" => {}
        _ => return Err(edge_loop.unexpected("a loop")),
    }
    if !forward {
        turn(&mut walk);
        edges.reverse();
    }
    let first = (0..edges.len()).min_by_key(|k| edges[*k]);
    let round = first.map(|first| [&edges[first..], &edges[..first]].concat());
    edges.sort_unstable();
    let has_seam = edges.windows(2).any(|w| w[0].0 == w[1].0);
    let nodes = walk.into_iter().map(|n| {
        let step = place.placement.isometry.rotation * n.step * place.scale();
        Node { at: place.point(n.at), step }
    });
    Ok((Ring { nodes: nodes.collect(), has_seam }, round))
}

fn turn(nodes: &mut [Node]) {
    nodes.reverse();
    nodes.iter_mut().for_each(|n| n.step = -n.step);
}

fn straight(a: &Point3, b: &Point3) -> Vec<Node> {
    over(0.0, 1.0, |x| (a + (b - a) * x, b - a))
}

/// EDGE_CURVE(name, start, end, curve, same sense) from start to end.
fn edge_nodes(file: &Part21, id: u64, context: &Context) -> Result<Vec<Node>, StepError> {
    let entity = file.get(id)?;
    let record = entity.part("EDGE_CURVE")?;
    let (from, to, forward) = (record.reference(1)?, record.reference(2)?, record.flag(4)?);
    let (start, end) = (vertex(file, from)?, vertex(file, to)?);
    let (low, high) = if forward { (start, end) } else { (end, start) };
    let closed = from == to || start == end;
    let lost = || StepError::Geometry { id, what: "it cannot be followed".into() };
    let mut ends = None;
    let mut nodes = match space_curve(file, record.reference(3)?, context.angle_unit)?.curve {
        Curve::Line { .. } => straight(&low, &high),
        Curve::Ellipse { frame, a, b } => {
            let angle = |p: &Point3| {
                let l = frame.local(p);
                (l.y / b).atan2(l.x / a)
            };
            let from = angle(&low);
            let sweep = if closed { TAU } else { (angle(&high) - from).rem_euclid(TAU) };
            let at = |t: f64| {
                (
                    frame.point(a * t.cos(), b * t.sin(), 0.0),
                    frame.x * (-a * t.sin()) + frame.y * (b * t.cos()),
                )
            };
            let parts = (sweep / STEP).ceil().max(1.0);
            ends = Some([at(from).0, at(from + sweep).0]);
            (0..parts as usize)
                .flat_map(|k| {
                    over(from + sweep * k as f64 / parts, from + sweep * (k + 1) as f64 / parts, at)
                })
                .collect()
        }
        Curve::Bounded(curve) => {
            let (nodes, reached) = spline_nodes(&curve, &low, &high, closed).ok_or_else(lost)?;
            ends = Some(reached);
            nodes
        }
        Curve::Parabola { .. } | Curve::Hyperbola { .. } => return Err(lost()),
    };
    // What is missing to the vertices: integrals around an open curve depend on where they are taken from.
    if let Some([first, last]) = ends {
        nodes.splice(0..0, straight(&low, &first));
        nodes.extend(straight(&last, &high));
    }
    if !forward {
        turn(&mut nodes);
    }
    Ok(nodes)
}

/// The nodes from one vertex to the other, and the places where they begin and end.
fn spline_nodes(
    curve: &Curve3,
    low: &Point3,
    high: &Point3,
    closed: bool,
) -> Option<(Vec<Node>, [Point3; 2])> {
    let (first, last) = curve.domain();
    let (from, to) = (place_of(curve, low, first), if closed { first } else { place_of(curve, high, last) });
    let ranges = match () {
        () if closed && from == first => vec![(first, last)],
        () if !closed && from < to => vec![(from, to)],
        // Over the ends of a closed curve.
        () if (curve.start() - curve.end()).norm() <= 1e-3 * (1.0 + low.coords.amax()) => {
            let to = if closed { from } else { to };
            vec![(from, last), (first, to)]
        }
        () => return None,
    };
    let at = |t: f64| {
        let [p, d, _] = curve.derivatives(t);
        (Point3::from(p), d)
    };
    let mut nodes = Vec::new();
    let reached = [curve.point(ranges[0].0), curve.point(ranges[ranges.len() - 1].1)];
    for (from, to) in ranges {
        let inside = parts(curve).into_iter().map(|(a, b)| (a.max(from), b.min(to)));
        inside.filter(|(a, b)| a < b).for_each(|(a, b)| nodes.extend(over(a, b, at)));
    }
    Some((nodes, reached))
}

/// The parameter of the place nearest to a vertex; of two ends that meet the one that is `preferred`.
fn place_of(curve: &Curve3, p: &Point3, preferred: f64) -> f64 {
    let (first, last) = curve.domain();
    let away = |t: f64| (curve.point(t) - p).norm();
    let breaks = curve.knots().breaks();
    let samples = breaks
        .windows(2)
        .flat_map(|w| (0..SAMPLES).map(move |k| w[0] + (w[1] - w[0]) * k as f64 / SAMPLES as f64))
        .chain([last]);
    let (mut best, mut nearest) = (preferred, away(preferred));
    for t in samples {
        let distance = away(t);
        if distance < nearest * (1.0 - 1e-9) - f64::EPSILON * p.coords.amax() {
            (best, nearest) = (t, distance);
        }
    }
    for _ in 0..NEWTON_STEPS {
        let [c, d, dd] = curve.derivatives(best);
        let off = c - p.coords;
        let bend = d.norm_squared() + off.dot(&dd);
        let next = (best - off.dot(&d) / if bend > 0.0 { bend } else { d.norm_squared() }).clamp(first, last);
        if !next.is_finite() || away(next) >= away(best) {
            break;
        }
        best = next;
    }
    best
}
