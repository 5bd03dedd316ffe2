//! From which angles about an axis a place is seen: the section of the part in the place's own plane.
//!
//! ```text
//!        ╭──╮ blocked          every line of sight square to the axis lies in one plane; the triangles cut by it are
//!    ╲   │  │                  segments, and a segment hides the angles between its two ends
//!     ╲  ╰──╯ ╱
//!      ╲     ╱  seen: an arc   which ends are exact is asked of the surfaces themselves, by rays
//!  ─────●p──╱──────
//! ```

use std::ops::ControlFlow;

use claymill_contact::Frame;
use claymill_nurbs::{Aabb, BoxTree, ClosestPoints, FaceMesh, MeshOptions, Point3, Vector3, tessellate};
use rayon::prelude::*;

use crate::cover::Arc;
use crate::error::ReachError;
use crate::part::Part;
use crate::samples::Sample;

/// Rays leave the surface from here, mm: more than rounding, less than any burr.
const OFF_MM: f64 = 1e-3;
/// Where triangles do not decide, rays are at most so far apart, degrees.
const APART_DEG: f64 = 0.05;
/// So many rays are asked where triangles do not decide, at most.
const MOST_RAYS: usize = 4_000;
/// Places along each side of a section at which room is looked for.
const ROOM_GRID: usize = 48;
/// Ends of arcs are halved to this, degrees.
const END_DEG: f64 = 0.004;
/// Normals of a surface differ from that of its triangle by so many deviations over the shortest side.
const TURNS: f64 = 8.0;
/// A normal as near to the axis as this is seen from all around, or from nowhere (sine).
const ALONG_AXIS: f64 = 1e-6;

/// A part cut by planes square to an axis.
#[derive(Debug)]
pub struct Slices<'a> {
    part: &'a Part<'a>,
    frame: Frame,
    triangles: Vec<([Point3; 3], f64)>,
    tree: BoxTree,
    /// Length of a ray that leaves the part, mm.
    reach_mm: f64,
    steepest_deg: f64,
}

impl<'a> Slices<'a> {
    /// Makes triangles that keep within `deviation_mm` of the faces. The frame's `z` is the axis. Surfaces that lean
    /// further from a line of sight than `steepest_deg` are not seen.
    ///
    /// # Errors
    /// A face cannot be covered with triangles.
    pub fn new(
        part: &'a Part<'a>,
        frame: &Frame,
        deviation_mm: f64,
        steepest_deg: f64,
    ) -> Result<Self, ReachError> {
        crate::error::check("the largest angle between normal and tool", steepest_deg, 0.0, 90.0)?;
        let size = part.face_area_mm2.iter().sum::<f64>().sqrt();
        let options = MeshOptions { deviation_mm, longest_edge_mm: size.max(1.0) };
        let of_face = |face: usize| {
            let made = tessellate(&part.model.faces[face], &options);
            made.map_err(|source| {
                let entity = part.model.faces[face].source.entity.clone();
                ReachError::Face { face, entity, source }
            })
        };
        let meshes: Vec<FaceMesh> =
            (0..part.model.faces.len()).into_par_iter().map(of_face).collect::<Result<_, _>>()?;
        let triangles: Vec<([Point3; 3], f64)> = meshes
            .iter()
            .flat_map(|mesh| {
                mesh.triangles.iter().zip(&mesh.deviation_mm).map(|(t, deviation)| {
                    (t.map(|i| frame.to_setup(&mesh.points[i as usize])), f64::from(*deviation))
                })
            })
            .collect();
        let boxes: Vec<Aabb> = triangles.iter().map(|(t, d)| Aabb::of(t).inflated(*d)).collect();
        let whole = Aabb::of(triangles.iter().flat_map(|(t, _)| t));
        let reach_mm = if whole.is_empty() { 0.0 } else { 2.0 * (whole.max - whole.min).norm() };
        Ok(Slices { part, frame: *frame, triangles, tree: BoxTree::new(&boxes), reach_mm, steepest_deg })
    }

    /// Smallest diameter of a bar along the axis that holds the part, mm, and where its middle is in the frame.
    #[must_use]
    pub fn bar(&self) -> (f64, [f64; 2]) {
        let deviation = self.triangles.iter().map(|(_, d)| *d).fold(0.0, f64::max);
        let points: Vec<[f64; 2]> = self.triangles.iter().flat_map(|(t, _)| t.map(|p| [p.x, p.y])).collect();
        let (middle, radius) = crate::bar::smallest_circle(&points);
        (2.0 * (radius + deviation), middle)
    }

    /// The largest circle inside of the section at a height, by its middle and radius: found on a grid of places, so it may
    /// be a little larger. `None` where nothing is cut.
    #[must_use]
    pub fn room_at(&self, height_mm: f64) -> Option<([f64; 2], f64)> {
        let mut segments: Vec<[[f64; 2]; 2]> = Vec::new();
        let from = Point3::new(0.0, 0.0, height_mm);
        let meets = |b: &Aabb| b.min[2] <= height_mm && height_mm <= b.max[2];
        self.tree.visit(
            |boxes| boxes.each(meets),
            |item| {
                segments.extend(self.triangles.get(item).and_then(|(t, _)| section(t, &from)));
                ControlFlow::Continue(())
            },
        );
        let ends = || segments.iter().flatten();
        let range = |k: usize| {
            ends().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(p[k]), b.max(p[k])])
        };
        let [x, y] = [range(0), range(1)];
        let at = |[a, b]: [f64; 2], i: usize| a + (b - a) * (i as f64 + 0.5) / ROOM_GRID as f64;
        let places = (0..ROOM_GRID).flat_map(|i| (0..ROOM_GRID).map(move |j| (i, j)));
        let room = |(i, j): (usize, usize)| {
            let p = [at(x, i), at(y, j)];
            // Inside where a line to one side crosses the section an odd number of times.
            let crosses = |[a, b]: &[[f64; 2]; 2]| {
                (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
            };
            let is_inside = segments.iter().filter(|s| crosses(s)).count() % 2 == 1;
            let moved = |q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
            let nearest = segments.iter().map(|[a, b]| distance_of_segment(moved(*a), moved(*b)));
            is_inside.then(|| (p, nearest.fold(f64::INFINITY, f64::min)))
        };
        let best = places.filter_map(room).max_by(|a, b| a.1.total_cmp(&b.1));
        best.filter(|(_, radius)| radius.is_finite() && *radius > 0.0)
    }

    /// How far the part goes along the axis, mm.
    #[must_use]
    pub fn along_mm(&self) -> [f64; 2] {
        let heights = self.triangles.iter().flat_map(|(t, _)| t.map(|p| p.z));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(z), b.max(z)])
    }

    /// Arcs of angles, from the frame's `x` on, from which a sample is seen: as exact as the triangles.
    #[must_use]
    pub fn arcs(&self, sample: &Sample) -> Vec<Arc> {
        let views = self.views(sample);
        merged(views.into_iter().flat_map(|view| {
            let off_mm = 2.0 * self.deviation_near(sample) + OFF_MM;
            let hidden = self.hidden(&(view.point + view.normal * off_mm));
            without(&view.faced, &hidden.iter().map(|h| h.arc).collect::<Vec<_>>())
        }))
    }

    /// The same, exact: where triangles do not decide, rays do.
    #[must_use]
    pub fn exact_arcs(&self, sample: &Sample, closest: &ClosestPoints) -> Vec<Arc> {
        let views = self.views(sample);
        merged(views.into_iter().flat_map(|view| {
            let from = view.point + view.normal * OFF_MM;
            let hidden = self.hidden(&from);
            let is_free = |deg: f64| {
                let (sine, cosine) = deg.to_radians().sin_cos();
                let way = self.frame.to_model(&Point3::new(cosine, sine, 0.0)).coords;
                let from = self.frame.to_model(&from);
                closest.crossings(&from, &way, self.reach_mm).all.is_empty()
            };
            asked(&view.faced, &hidden, is_free)
        }))
    }

    /// A sample's sides that are free, with the arc that each of them faces.
    fn views(&self, sample: &Sample) -> Vec<View> {
        let free = self.part.free();
        let sides = [true, false].into_iter().filter(|&along| free.allow(sample.face, along));
        let of_side = |along: bool| {
            let normal = if along { sample.normal } else { -sample.normal };
            let normal = self.frame.to_setup(&normal.into()).coords;
            let level = normal.x.hypot(normal.y);
            let least = if self.steepest_deg >= 90.0 { 0.0 } else { self.steepest_deg.to_radians().cos() };
            let faced = if level < ALONG_AXIS {
                (least == 0.0).then_some(Arc { from_deg: 0.0, span_deg: 360.0 })
            } else {
                (least <= level).then(|| {
                    let half = (least / level).min(1.0).acos().to_degrees();
                    let middle = normal.y.atan2(normal.x).to_degrees();
                    Arc { from_deg: (middle - half).rem_euclid(360.0), span_deg: 2.0 * half }
                })
            };
            Some(View { point: self.frame.to_setup(&sample.point), normal, faced: faced? })
        };
        sides.filter_map(of_side).collect()
    }

    /// How far triangles around a place may be from the surface, mm.
    fn deviation_near(&self, sample: &Sample) -> f64 {
        let at = self.frame.to_setup(&sample.point);
        let mut most = 0.0_f64;
        let is_near = |b: &Aabb| (0..3).all(|k| b.min[k] <= at[k] && at[k] <= b.max[k]);
        self.tree.visit(
            |boxes| boxes.each(is_near),
            |item| {
                most = self.triangles.get(item).map_or(most, |(_, d)| most.max(*d));
                ControlFlow::Continue(())
            },
        );
        most
    }

    /// What the section hides from a place.
    fn hidden(&self, from: &Point3) -> Vec<Hidden> {
        let mut found = Vec::new();
        let meets = |b: &Aabb| b.min[2] <= from.z && from.z <= b.max[2];
        self.tree.visit(
            |boxes| boxes.each(meets),
            |item| {
                found.extend(self.triangles.get(item).and_then(|(t, d)| hidden_by(t, *d, from)));
                ControlFlow::Continue(())
            },
        );
        found
    }
}

/// One side of a sample in the frame.
struct View {
    point: Point3,
    normal: Vector3,
    faced: Arc,
}

/// What a triangle hides, and how far its ends may be off.
#[derive(Debug, Clone, Copy)]
struct Hidden {
    arc: Arc,
    off_deg: f64,
}

/// What a triangle hides in the plane of a place, seen from there.
fn hidden_by(corners: &[Point3; 3], deviation_mm: f64, from: &Point3) -> Option<Hidden> {
    let [a, b] = section(corners, from)?;
    let [first, second] = [a, b].map(|p: [f64; 2]| p[1].atan2(p[0]).to_degrees());
    let turn = (second - first + 540.0).rem_euclid(360.0) - 180.0;
    let from_deg = if turn >= 0.0 { first } else { second };
    let nearest = distance_of_segment(a, b);
    let aside_mm = aside_mm(corners, deviation_mm);
    let off = if nearest > aside_mm { (aside_mm / nearest).asin().to_degrees() } else { 180.0 };
    Some(Hidden { arc: Arc { from_deg: from_deg.rem_euclid(360.0), span_deg: turn.abs() }, off_deg: off })
}

/// The section of a triangle with the plane of a place, seen from there.
fn section(corners: &[Point3; 3], from: &Point3) -> Option<[[f64; 2]; 2]> {
    let above = corners.map(|p| p.z - from.z);
    let mut ends: Vec<[f64; 2]> = Vec::with_capacity(3);
    for k in 0..3 {
        let (a, b) = (k, (k + 1) % 3);
        if (above[a] < 0.0) != (above[b] < 0.0) {
            let share = above[a] / (above[a] - above[b]);
            let at = corners[a] + (corners[b] - corners[a]) * share;
            ends.push([at.x - from.x, at.y - from.y]);
        }
    }
    <[[f64; 2]; 2]>::try_from(ends).ok()
}

/// How far the section of the surface may be from that of its triangle: the flatter both lie in the plane, the farther.
fn aside_mm(corners: &[Point3; 3], deviation_mm: f64) -> f64 {
    let [a, b, c] = *corners;
    let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return f64::INFINITY };
    let shortest = [b - a, c - b, a - c].iter().map(Vector3::norm).fold(f64::INFINITY, f64::min);
    // A piece of surface that bulges by its deviation between two corners turns by four times that over their distance;
    // it may do so within the triangle and slide as well.
    let turn = TURNS * deviation_mm / shortest;
    let level = normal.x.hypot(normal.y) - turn;
    if level > 0.0 { deviation_mm / level } else { f64::INFINITY }
}

/// How near a segment comes to the origin.
fn distance_of_segment(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length2 = dx * dx + dy * dy;
    let share = if length2 > 0.0 { (-(a[0] * dx + a[1] * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (a[0] + dx * share).hypot(a[1] + dy * share)
}

/// Stretches of an arc, in degrees along it, where these arcs lie.
fn stretches(within: &Arc, arcs: &[Arc]) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::with_capacity(arcs.len());
    for arc in arcs {
        let start = (arc.from_deg - within.from_deg).rem_euclid(360.0);
        for start in [start, start - 360.0] {
            let stretch = [start.max(0.0), (start + arc.span_deg).min(within.span_deg)];
            if stretch[0] < stretch[1] {
                all.push(stretch);
            }
        }
    }
    all.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut united: Vec<[f64; 2]> = Vec::new();
    for [from, to] in all {
        match united.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => united.push([from, to]),
        }
    }
    united
}

/// What is left between stretches, from 0 to `end`.
fn between(stretches: &[[f64; 2]], end: f64) -> Vec<[f64; 2]> {
    let mut left = Vec::new();
    let mut at = 0.0;
    for &[from, to] in stretches {
        if from > at {
            left.push([at, from]);
        }
        at = to.max(at);
    }
    if at < end {
        left.push([at, end]);
    }
    left
}

fn without(within: &Arc, hidden: &[Arc]) -> Vec<Arc> {
    let free = between(&stretches(within, hidden), within.span_deg);
    free.into_iter().map(|s| along(within, s)).collect()
}

fn along(within: &Arc, [from, to]: [f64; 2]) -> Arc {
    Arc { from_deg: (within.from_deg + from).rem_euclid(360.0), span_deg: to - from }
}

/// What is free of an arc: as triangles say where they are sure, and by rays elsewhere.
fn asked(within: &Arc, hidden: &[Hidden], is_free: impl Fn(f64) -> bool) -> Vec<Arc> {
    let wider: Vec<Arc> = hidden.iter().map(|h| widened(&h.arc, h.off_deg)).collect();
    let may_be_blocked = stretches(within, &wider);
    // The core of what a triangle hides is hidden by the surface as well. Near its ends, where the next triangle may go on
    // or not, nothing is sure.
    let core = |h: &Hidden| {
        let span_deg = h.arc.span_deg - 2.0 * h.off_deg;
        (span_deg > 0.0).then(|| Arc { from_deg: (h.arc.from_deg + h.off_deg).rem_euclid(360.0), span_deg })
    };
    let blocked = stretches(within, &hidden.iter().filter_map(core).collect::<Vec<_>>());
    let open: Vec<Arc> = between(&blocked, within.span_deg).iter().map(|s| along(within, *s)).collect();
    let doubtful: Vec<[f64; 2]> = may_be_blocked
        .iter()
        .flat_map(|may| {
            stretches(&along(within, *may), &open).into_iter().map(|[a, b]| [may[0] + a, may[0] + b])
        })
        .collect();
    let whole: f64 = doubtful.iter().map(|[a, b]| b - a).sum();
    let apart = APART_DEG.max(whole / MOST_RAYS as f64);
    let is_doubtful = |at: f64| doubtful.iter().any(|[a, b]| (*a..=*b).contains(&at));
    let may = |at: f64| may_be_blocked.iter().any(|[a, b]| (*a..=*b).contains(&at));
    let is_seen = |at: f64| match () {
        () if !may(at) => true,
        () if !is_doubtful(at) => false,
        () => is_free(within.from_deg + at),
    };
    // Places where the answer may change: ends of stretches, and rays between them where nothing is sure.
    let mut stops: Vec<f64> = vec![0.0, within.span_deg];
    for &[a, b] in doubtful.iter().chain(&may_be_blocked) {
        stops.extend([a, b]);
    }
    for &[a, b] in &doubtful {
        let count = ((b - a) / apart).ceil().max(1.0) as usize;
        stops.extend((1..count).map(|k| a + (b - a) * k as f64 / count as f64));
    }
    stops.sort_by(f64::total_cmp);
    stops.dedup();
    // Between two of them the answer is that of their middle.
    let middles: Vec<f64> = stops.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    stops.extend(middles);
    stops.sort_by(f64::total_cmp);
    // Ends themselves are asked just beside: a line of sight along a tangent is no line of sight.
    let beside = |at: f64| at.clamp(1e-6_f64.min(within.span_deg), (within.span_deg - 1e-6).max(0.0));
    let mut free = Vec::new();
    let mut open: Option<f64> = None;
    let mut last: Option<(f64, bool)> = None;
    for at in stops {
        let seen = is_seen(beside(at));
        if let Some((before, was)) = last {
            if was && !seen {
                let end = bisect(before, at, |at| is_seen(beside(at)));
                free.extend(open.take().map(|from| [from, end]));
            } else if !was && seen {
                open = Some(bisect(at, before, |at| is_seen(beside(at))));
            }
        } else if seen {
            open = Some(at);
        }
        last = Some((at, seen));
    }
    free.extend(open.map(|from| [from, within.span_deg]));
    free.into_iter().map(|s| along(within, s)).collect()
}

/// The last place from `seen` to `hidden` that is seen.
fn bisect(mut seen: f64, mut hidden: f64, is_seen: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        if (seen - hidden).abs() <= END_DEG {
            break;
        }
        let middle = 0.5 * (seen + hidden);
        if is_seen(middle) { seen = middle } else { hidden = middle }
    }
    seen
}

fn widened(arc: &Arc, by_deg: f64) -> Arc {
    let span_deg = arc.span_deg + 2.0 * by_deg;
    if span_deg >= 360.0 {
        return Arc { from_deg: 0.0, span_deg: 360.0 };
    }
    Arc { from_deg: (arc.from_deg - by_deg).rem_euclid(360.0), span_deg }
}

/// Arcs without overlaps.
fn merged(arcs: impl Iterator<Item = Arc>) -> Vec<Arc> {
    let arcs: Vec<Arc> = arcs.collect();
    if arcs.len() < 2 {
        return arcs;
    }
    let whole = Arc { from_deg: 0.0, span_deg: 360.0 };
    stretches(&whole, &arcs).into_iter().map(|s| along(&whole, s)).collect()
}
