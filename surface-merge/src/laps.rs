//! Boundaries that end on the middle of another face: patches on patches, overlaps, walls on floors.

use claymill_nurbs::{Aabb, FaceId, Point3, bisect};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::account::Bare;
use crate::edge::Edge;
use crate::joint::EdgeStretch;
use crate::lone::LoneFaces;
use crate::tolerance::{ALONG_DEG, LAP_STEP_MM};

/// A stretch of edge that lies on the inside of another face.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lap {
    /// Where.
    pub stretch: EdgeStretch,
    /// The face under it (the nearest one).
    pub onto: FaceId,
    /// Length, mm.
    pub length_mm: f64,
    /// Largest distance from that face, mm.
    pub gap_mm: f64,
    /// Its two ends, mm.
    pub ends: [Point3; 2],
}

/// Ends of laps are located to this, mm.
const END_MM: f64 = 1e-6;
/// Places on one stretch that are looked at, at most: half a kilometre of steps.
const MOST_STEPS: f64 = 1e5;

/// Tells which parts of the stretches without a neighbouring edge lie on the inside of another face, and
/// which are left. Laps shorter than [`LAP_STEP_MM`] may be missed, and a lap is longer than what any edge has within the
/// tolerance that merely leaves the face.
pub(crate) fn find(
    edges: &[Edge<'_>],
    bare: &[Bare],
    lone: &LoneFaces<'_>,
    is_copy: &[bool],
    tolerance_mm: f64,
) -> (Vec<Lap>, Vec<Bare>) {
    let parts: Vec<(Vec<Lap>, Vec<Bare>)> =
        bare.par_iter().map(|bare| Walk::new(edges, bare, lone, is_copy, tolerance_mm).parts()).collect();
    let (mut laps, mut left) = (Vec::new(), Vec::new());
    for (found, rest) in parts {
        laps.extend(found);
        left.extend(rest);
    }
    (laps, left)
}

/// Along one stretch.
struct Walk<'a, 'm, 'l> {
    edge: &'a Edge<'m>,
    bare: Bare,
    lone: &'a LoneFaces<'l>,
    /// Faces that the stretch may lie on.
    hosts: Vec<FaceId>,
    tolerance_mm: f64,
}

/// A place on the edge, and the nearest face whose inside is there.
#[derive(Debug, Clone, Copy)]
struct Place {
    s: f64,
    onto: Option<FaceId>,
    gap_mm: f64,
}

impl<'a, 'm, 'l> Walk<'a, 'm, 'l> {
    fn new(
        edges: &'a [Edge<'m>],
        bare: &Bare,
        lone: &'a LoneFaces<'l>,
        is_copy: &[bool],
        tolerance_mm: f64,
    ) -> Self {
        let edge = &edges[bare.edge];
        let mut bounds = Aabb::of(&edge.points([bare.from, bare.to].map(|s| edge.at_length(s))));
        let inside = edge.stations.iter().filter(|station| station.s > bare.from && station.s < bare.to);
        inside.for_each(|station| bounds.add(&station.point));
        let mut hosts = lone.touching(&bounds.inflated(edge.sagitta_mm + tolerance_mm));
        hosts.retain(|&f| f != edge.face && !is_copy[f]);
        Walk { edge, bare: *bare, lone, hosts, tolerance_mm }
    }

    fn place(&self, s: f64) -> Place {
        let p = Point3::from(self.edge.lift(self.edge.at_length(s))[0]);
        let mut place = Place { s, onto: None, gap_mm: self.tolerance_mm };
        for &host in &self.hosts {
            // On its boundary it would be a joint, or one that runs away at too large an angle.
            let foot = self.lone.closest(host, &p, self.tolerance_mm).filter(|f| !f.on_boundary);
            if let Some(foot) = foot.filter(|f| place.onto.is_none() || f.distance_mm < place.gap_mm) {
                place = Place { s, onto: Some(host), gap_mm: foot.distance_mm };
            }
        }
        place
    }

    /// The last place where `at`'s answer holds before `beyond`, where another one does.
    fn change(&self, at: Place, beyond: f64) -> f64 {
        let (low, high) = bisect(at.s, beyond, END_MM, |s| self.place(s).onto == at.onto);
        0.5 * (low + high)
    }

    fn parts(&self) -> (Vec<Lap>, Vec<Bare>) {
        let Bare { from, to, .. } = self.bare;
        if self.hosts.is_empty() {
            return (Vec::new(), vec![self.bare]);
        }
        // An edge that leaves a face at a larger angle than neighbours may have does not lie on it.
        let shortest = self.tolerance_mm / ALONG_DEG.to_radians().sin();
        let steps = ((to - from) / LAP_STEP_MM).ceil().clamp(8.0, MOST_STEPS) as usize;
        let mut laps = Vec::new();
        let mut left: Vec<Bare> = Vec::new();
        let mut close = |start: f64, end: f64, onto: Option<FaceId>, gap_mm: f64| match onto {
            Some(onto) if end - start > shortest => {
                let on = [start, end].map(|s| self.edge.at_length(s));
                laps.push(Lap {
                    stretch: self.edge.stretch(on),
                    onto,
                    length_mm: end - start,
                    gap_mm,
                    ends: self.edge.points(on),
                });
            }
            _ => match left.last_mut() {
                Some(last) if last.to == start => last.to = end,
                _ => left.push(Bare { from: start, to: end, ..self.bare }),
            },
        };
        // The ends themselves are corners, which lie on the boundary of all that meet there.
        let inset = self.tolerance_mm.min(0.1 * (to - from));
        let at = |k: usize| from + inset + (to - from - 2.0 * inset) * k as f64 / steps as f64;
        let mut last = self.place(at(0));
        let (mut start, mut gap_mm) = (from, 0.0f64);
        for k in 1..=steps {
            let next = self.place(at(k));
            if next.onto != last.onto {
                let end = self.change(last, next.s);
                close(start, end, last.onto, gap_mm.max(last.gap_mm));
                (start, gap_mm) = (end, 0.0);
            }
            gap_mm = gap_mm.max(next.gap_mm);
            last = next;
        }
        close(start, to, last.onto, gap_mm.max(last.gap_mm));
        (laps, left)
    }
}
