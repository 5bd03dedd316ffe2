//! The order of passes, and how the tool gets from one to the next.
//!
//! A pass may run as soon as all passes of earlier rounds near it have run: then nothing is uncut about it that was not when it was
//! laid. So one corner is cleared to its end before the tool moves on, which saves most of the links.

use crate::fronts::{Front, Pass};
use crate::outline::{Outline, Place, distance};
use crate::planar_set::PlanarSet;

/// Parts are entered by links no further than this, mm.
const GRAZE_MM: f64 = 3e-3;

/// A pass with the number of its front.
pub(crate) struct Ordered<'a> {
    pub(crate) pass: &'a Pass,
    /// Whether the straight way from the end of the pass before is clear.
    pub(crate) is_linked: bool,
}

/// A pass as the order sees it.
struct Node<'a> {
    pass: &'a Pass,
    front: usize,
    round: usize,
    samples: Vec<Place>,
    bounds: [f64; 4],
    /// Passes that have to run before and have not.
    waits_for: usize,
    /// Passes that wait for this one.
    frees: Vec<usize>,
}

pub(crate) fn start_of(pass: &Pass) -> Place {
    pass.lead.map_or(pass.points[0], |lead| lead.from)
}

pub(crate) fn end_of(pass: &Pass) -> Place {
    pass.lead.map_or(pass.points[pass.points.len() - 1], |lead| lead.to)
}

/// Passes in order from a place on.
pub(crate) fn order<'a>(
    fronts: &'a [Front],
    reached: &PlanarSet,
    radius_mm: f64,
    from: Place,
) -> Vec<Ordered<'a>> {
    let mut nodes = nodes(fronts, radius_mm);
    wait(&mut nodes, radius_mm);
    let room = Outline::new(&reached.dilated(GRAZE_MM / 3.0));
    let blocks: Vec<(Option<[f64; 4]>, Outline)> = fronts
        .iter()
        .map(|f| {
            let inside = in_the_way(&f.part, reached);
            (inside.bounds(), Outline::new(&inside))
        })
        .collect();
    let mut left_of_front: Vec<usize> = fronts.iter().map(|f| f.passes.len()).collect();
    let mut ready: Vec<usize> = (0..nodes.len()).filter(|&k| nodes[k].waits_for == 0).collect();
    let mut found = Vec::with_capacity(nodes.len());
    let mut at = from;
    while !ready.is_empty() {
        let far = |k: usize| distance(at, start_of(nodes[k].pass));
        let nearest = (0..ready.len()).min_by(|&a, &b| far(ready[a]).total_cmp(&far(ready[b])));
        let k = ready.swap_remove(nearest.unwrap_or(0));
        let to = start_of(nodes[k].pass);
        let is_blocked = |(bounds, outline): &(Option<[f64; 4]>, Outline)| {
            bounds.is_some_and(|b| meets(&b, at, to)) && (outline.crosses(at, to) || outline.contains(at))
        };
        let is_linked = !room.crosses(at, to)
            && !blocks.iter().zip(&left_of_front).any(|(b, &left)| left > 0 && is_blocked(b));
        found.push(Ordered { pass: nodes[k].pass, is_linked });
        at = end_of(nodes[k].pass);
        left_of_front[nodes[k].front] -= 1;
        for other in std::mem::take(&mut nodes[k].frees) {
            nodes[other].waits_for -= 1;
            if nodes[other].waits_for == 0 {
                ready.push(other);
            }
        }
        // The same order whatever was removed before.
        ready.sort_unstable();
    }
    found
}

/// Where a link runs through a part that is not cleared yet. It may graze the side towards cleared ground, but not run along a wall:
/// beside that the part goes on into what the centre never reaches.
fn in_the_way(part: &PlanarSet, reached: &PlanarSet) -> PlanarSet {
    const BESIDE_MM: f64 = 4.0 * GRAZE_MM;
    let Some([x0, y0, x1, y1]) = part.bounds() else { return PlanarSet::default() };
    let around = PlanarSet::rectangle([x0 - BESIDE_MM, y0 - BESIDE_MM, x1 + BESIDE_MM, y1 + BESIDE_MM]);
    part.union(&around.minus(reached)).eroded(GRAZE_MM)
}

fn meets(b: &[f64; 4], p: Place, q: Place) -> bool {
    (0..2).all(|k| p[k].min(q[k]) <= b[k + 2] && p[k].max(q[k]) >= b[k])
}

fn nodes(fronts: &[Front], radius_mm: f64) -> Vec<Node<'_>> {
    let of_front = |(front, f): (usize, &'_ Front)| -> Vec<(usize, usize)> {
        (0..f.passes.len()).map(|pass| (front, pass)).collect()
    };
    let all = fronts.iter().enumerate().flat_map(of_front);
    all.map(|(front, k)| {
        let pass = &fronts[front].passes[k];
        let mut samples = vec![start_of(pass)];
        for &p in &pass.points {
            if samples.last().is_none_or(|&last| distance(last, p) >= 0.25 * radius_mm) {
                samples.push(p);
            }
        }
        samples.push(end_of(pass));
        let bounds = pass
            .points
            .iter()
            .chain(&samples)
            .fold([f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY], |b, p| {
                [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])]
            });
        Node { pass, front, round: fronts[front].round, samples, bounds, waits_for: 0, frees: Vec::new() }
    })
    .collect()
}

/// Finds which passes have to wait for which.
fn wait(nodes: &mut [Node<'_>], radius_mm: f64) {
    // Points of two passes that are further apart than this see nothing of each other.
    let reach = 2.0 * radius_mm;
    // A long straight stretch has samples at its ends alone.
    let is_near = |a: &Node<'_>, b: &Node<'_>| {
        let apart =
            (0..2).any(|k| a.bounds[k] > b.bounds[k + 2] + reach || b.bounds[k] > a.bounds[k + 2] + reach);
        !apart
            && a.samples.windows(2).any(|w| {
                b.samples.windows(2).any(|v| {
                    let gap = crate::outline::distance_from_segment(w[0], v[0], v[1])
                        .min(crate::outline::distance_from_segment(w[1], v[0], v[1]))
                        .min(crate::outline::distance_from_segment(v[0], w[0], w[1]))
                        .min(crate::outline::distance_from_segment(v[1], w[0], w[1]));
                    gap < reach + 0.25 * radius_mm
                })
            })
    };
    for k in 0..nodes.len() {
        for j in 0..k {
            if nodes[j].round < nodes[k].round && is_near(&nodes[j], &nodes[k]) {
                nodes[j].frees.push(k);
                nodes[k].waits_for += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_along_a_wall_runs_through_what_is_not_cleared_there() {
        let reached = PlanarSet::rectangle([-5.0, 0.0, 15.0, 10.0]);
        let part = PlanarSet::rectangle([0.0, 0.0, 10.0, 10.0]);
        let block = Outline::new(&in_the_way(&part, &reached));
        let is_blocked = |from, to| block.crosses(from, to) || block.contains(from);
        assert!(is_blocked([-1.0, 0.0], [11.0, 0.0]), "along the wall");
        assert!(is_blocked([-1.0, 5.0], [11.0, 5.0]), "through the middle");
        assert!(!is_blocked([0.0, 1.0], [0.0, 9.0]), "along the side that is cleared");
        assert!(!is_blocked([-4.0, 0.0], [-1.0, 0.0]), "along the wall beside cleared ground");
    }
}
