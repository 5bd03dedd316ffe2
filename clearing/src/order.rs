//! The order of passes, and how the tool gets from one to the next.
//!
//! A pass may run as soon as all passes of earlier rounds near it have run: then nothing is uncut about it that was not when it was
//! laid. So one corner is cleared to its end before the tool moves on, which saves most of the links.

use crate::engagement::EngagementLimit;
use crate::fronts::{Front, Pass};
use crate::outline::{Outline, Place, distance};
use crate::planar_set::PlanarSet;

/// Parts are entered by links no further than this, mm.
const GRAZE_MM: f64 = 3e-3;

/// What is thinner than twice this is no cleared ground, mm.
const HAIR_MM: f64 = 1e-3;
/// Places where the tool has been are kept this far apart, in its radii.
const APART: f64 = 0.25;
/// Ways over other places are no longer than so many straight ones, each of which counts as long as this at least, mm.
const LONGEST_DETOUR: f64 = 4.0;
const SHORTEST_DETOUR_MM: f64 = 10.0;
/// Places that are tried on the way.
const MOST_OVER: usize = 24;
/// Along a link it is looked every so many radii what the tool may cut.
const STEP: f64 = 0.05;

/// What there may be on a level besides the stock that it cuts.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'a> {
    /// Where the centre meets what levels below have left.
    pub(crate) ridges: &'a PlanarSet,
    /// Thin stock that may be there.
    pub(crate) doubtful: &'a PlanarSet,
}

/// What links lead over.
pub(crate) struct Floor<'a> {
    /// What the centre has reached in the end.
    pub(crate) reached: &'a PlanarSet,
    pub(crate) beside: Beside<'a>,
    pub(crate) limit: &'a EngagementLimit,
}

/// A pass in its turn.
pub(crate) struct Ordered<'a> {
    pub(crate) pass: &'a Pass,
    /// Over which places there is a clear way from the end of the pass before, if there is one.
    pub(crate) link: Option<Vec<Place>>,
    /// From where, and over which places, the tool comes to the pass through ridges: along the level, which cuts them.
    pub(crate) through: Vec<Place>,
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

/// Passes in order from a place on, at which the tool is or is not.
pub(crate) fn order<'a>(
    fronts: &'a [Front],
    floor: &Floor<'_>,
    (from, is_here): (Place, bool),
) -> Vec<Ordered<'a>> {
    let Floor { reached, beside, limit } = floor;
    let radius_mm = limit.radius_mm();
    let mut nodes = nodes(fronts, radius_mm);
    wait(&mut nodes, radius_mm);
    let ridges = Ridges::new(beside.ridges, reached);
    let doubtful = Outline::new(beside.doubtful);
    let room = Outline::new(&reached.dilated(GRAZE_MM / 3.0));
    let blocks: Vec<Block> = fronts.iter().map(|f| Block::new(&f.part, reached)).collect();
    let mut left_of_front: Vec<usize> = fronts.iter().map(|f| f.passes.len()).collect();
    let mut ready: Vec<usize> = (0..nodes.len()).filter(|&k| nodes[k].waits_for == 0).collect();
    let mut found = Vec::with_capacity(nodes.len());
    let (mut at, mut been) = (from, vec![from]);
    while !ready.is_empty() {
        let far = |k: usize| distance(at, nodes[k].pass.start());
        let nearest = (0..ready.len()).min_by(|&a, &b| far(ready[a]).total_cmp(&far(ready[b])));
        let k = ready.swap_remove(nearest.unwrap_or(0));
        let to = nodes[k].pass.start();
        let uncleared: Vec<&Block> =
            blocks.iter().zip(&left_of_front).filter(|(_, n)| **n > 0).map(|(b, _)| b).collect();
        let is_clear = |p: Place, q: Place| {
            !room.crosses(p, q)
                && !uncleared.iter().any(|b| b.is_hit(p, q))
                && (beside.doubtful.is_empty() || is_gentle(&doubtful, p, q, limit))
        };
        let is_linked = is_here || !found.is_empty();
        let link = is_linked.then(|| link(at, to, &been, &is_clear)).flatten();
        found.push(ridges.avoided(nodes[k].pass, at, link, &is_clear));
        for place in [to, nodes[k].pass.end()] {
            if !been.iter().any(|b| distance(*b, place) < APART * radius_mm) {
                been.push(place);
            }
        }
        at = nodes[k].pass.end();
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

/// Ridges of levels below, and where there are none.
struct Ridges {
    outline: Option<Outline>,
    /// Places on the border of what is reached without them: the tool may come straight down there.
    clear: Vec<Place>,
}

impl Ridges {
    fn new(ridges: &PlanarSet, reached: &PlanarSet) -> Self {
        if ridges.is_empty() {
            return Ridges { outline: None, clear: Vec::new() };
        }
        let clear = reached.minus(&ridges.dilated(GRAZE_MM));
        let clear = clear.contours().into_iter().flatten().collect();
        Ridges { outline: Some(Outline::new(ridges)), clear }
    }

    /// A pass to which no link and no way straight down leads through ridges.
    fn avoided<'a>(
        &self,
        pass: &'a Pass,
        at: Place,
        link: Option<Vec<Place>>,
        is_clear: &dyn Fn(Place, Place) -> bool,
    ) -> Ordered<'a> {
        let as_it_is = |link| Ordered { pass, link, through: Vec::new() };
        let Some(outline) = self.outline.as_ref().filter(|_| !pass.is_ramped()) else {
            return as_it_is(link);
        };
        let to = pass.start();
        let is_met = |p: Place, q: Place| outline.contains(p) || outline.crosses(p, q);
        match link {
            Some(via) => {
                let through: Vec<Place> = std::iter::once(at).chain(via.iter().copied()).collect();
                let ends = through.iter().skip(1).chain([&to]);
                if through.iter().zip(ends).any(|(p, q)| is_met(*p, *q)) {
                    Ordered { pass, link: Some(Vec::new()), through }
                } else {
                    as_it_is(Some(via))
                }
            }
            None if outline.contains(to) => {
                let mut clear: Vec<(f64, Place)> =
                    self.clear.iter().map(|p| (distance(*p, to), *p)).collect();
                clear.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                let through = clear.iter().map(|c| c.1).find(|p| is_clear(*p, to));
                Ordered { pass, link: None, through: through.into_iter().collect() }
            }
            None => as_it_is(None),
        }
    }
}

/// What is in the way of links until it is cleared.
struct Block {
    bounds: Option<[f64; 4]>,
    outline: Outline,
}

impl Block {
    fn new(part: &PlanarSet, reached: &PlanarSet) -> Self {
        let inside = in_the_way(part, reached);
        Block { bounds: inside.bounds(), outline: Outline::new(&inside) }
    }

    fn is_hit(&self, p: Place, q: Place) -> bool {
        self.bounds.is_some_and(|b| meets(&b, p, q))
            && (self.outline.crosses(p, q) || self.outline.contains(p))
    }
}

/// A clear way to a place: straight, or over one or two of the places where the tool has been.
fn link(at: Place, to: Place, been: &[Place], is_clear: &dyn Fn(Place, Place) -> bool) -> Option<Vec<Place>> {
    if is_clear(at, to) {
        return Some(Vec::new());
    }
    let length_mm = |p: &Place| distance(at, *p) + distance(*p, to);
    let most_mm = LONGEST_DETOUR * distance(at, to).max(SHORTEST_DETOUR_MM);
    let mut over: Vec<Place> = been.iter().copied().filter(|p| length_mm(p) < most_mm).collect();
    over.sort_by(|a, b| length_mm(a).total_cmp(&length_mm(b)));
    over.truncate(MOST_OVER);
    if let Some(p) = over.iter().find(|p| is_clear(at, **p) && is_clear(**p, to)) {
        return Some(vec![*p]);
    }
    let first: Vec<Place> = over.iter().copied().filter(|p| is_clear(at, *p)).collect();
    let second: Vec<Place> = over.iter().copied().filter(|p| is_clear(*p, to)).collect();
    let both = first.iter().flat_map(|p| second.iter().map(move |q| [*p, *q]));
    let whole_mm = |[p, q]: &[Place; 2]| distance(at, *p) + distance(*p, *q) + distance(*q, to);
    let mut both: Vec<[Place; 2]> = both.filter(|pair| whole_mm(pair) < most_mm).collect();
    both.sort_by(|a, b| whole_mm(a).total_cmp(&whole_mm(b)));
    both.into_iter().take(MOST_OVER).find(|[p, q]| is_clear(*p, *q)).map(|pair| pair.to_vec())
}

/// Whether a tool on a straight way cuts along no more than the limit, if what may be there is.
fn is_gentle(doubtful: &Outline, from: Place, to: Place, limit: &EngagementLimit) -> bool {
    let length_mm = distance(from, to);
    if length_mm == 0.0 {
        return true;
    }
    let way = [0, 1].map(|k| to[k] - from[k]);
    let heading = way.map(|w| w / length_mm);
    let steps = (length_mm / (STEP * limit.radius_mm())).ceil() as usize;
    let engaged_rad = |k: usize| {
        let share = k as f64 / steps as f64;
        doubtful.front_inside([0, 1].map(|i| from[i] + share * way[i]), limit.radius_mm(), heading)
    };
    // From the end: a pass begins where stock is.
    (0..=steps).rev().all(|k| engaged_rad(k) <= limit.limit_deg().to_radians())
}

/// Where a link runs through a part that is not cleared yet. It may graze the side towards cleared ground, but not run along a wall:
/// beside that the part goes on into what the centre never reaches.
fn in_the_way(part: &PlanarSet, reached: &PlanarSet) -> PlanarSet {
    const BESIDE_MM: f64 = 4.0 * GRAZE_MM;
    let Some([x0, y0, x1, y1]) = part.bounds() else { return PlanarSet::default() };
    let around = PlanarSet::rectangle([x0 - BESIDE_MM, y0 - BESIDE_MM, x1 + BESIDE_MM, y1 + BESIDE_MM]);
    // Borders of both that are the same but for the grid leave hairs between them, through which no link leads.
    let clear = around.intersection(reached).minus(part).eroded(HAIR_MM);
    around.minus(&clear.dilated(HAIR_MM + GRAZE_MM))
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
        let mut samples = vec![pass.start()];
        for &p in &pass.points {
            if samples.last().is_none_or(|&last| distance(last, p) >= 0.25 * radius_mm) {
                samples.push(p);
            }
        }
        samples.push(pass.end());
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
    fn a_link_goes_around_a_wall() {
        let room = PlanarSet::rectangle([0.0, 0.0, 30.0, 30.0]);
        let wall = Outline::new(&room.minus(&PlanarSet::rectangle([14.0, 5.0, 16.0, 40.0])));
        let is_clear = |p, q| !wall.crosses(p, q);
        let been = [[10.0, 10.0], [15.0, 2.0], [15.0, 28.0]];
        assert_eq!(link([10.0, 3.0], [20.0, 3.0], &been, &is_clear), Some(Vec::new()));
        assert_eq!(link([10.0, 12.0], [20.0, 12.0], &been, &is_clear), Some(vec![[15.0, 2.0]]));
        assert_eq!(link([10.0, 12.0], [20.0, 12.0], &been[..1], &is_clear), None);
        let been = [[12.0, 2.0], [18.0, 2.0]];
        assert_eq!(link([12.0, 15.0], [18.0, 15.0], &been, &is_clear), Some(been.to_vec()));
    }

    /// A crescent before the tool is met along much of it, one beside it is not.
    #[test]
    fn a_link_leads_along_doubtful_stock_and_not_into_it() {
        let limit = EngagementLimit::new(10.0, 45.0).unwrap();
        let disc = |x: f64, radius_mm: f64| PlanarSet::disc([x, 0.0], radius_mm);
        let crescent = Outline::new(&disc(0.0, 10.3).minus(&disc(0.0, 10.0)));
        assert!(!is_gentle(&crescent, [-4.0, 0.0], [0.2, 0.0], &limit));
        let wall = Outline::new(&PlanarSet::rectangle([-50.0, 10.0, 50.0, 10.3]));
        assert!(is_gentle(&wall, [-4.0, 0.2], [4.0, 0.2], &limit));
    }

    #[test]
    fn no_link_leads_between_a_part_and_the_wall() {
        let reached = PlanarSet::rectangle([-5.0, 0.0, 15.0, 10.0]);
        // Some steps of the grid away from the wall.
        let part = PlanarSet::rectangle([0.0, 3e-5, 10.0, 10.0]);
        assert!(Block::new(&part, &reached).is_hit([-1.0, 0.0], [11.0, 0.0]));
    }

    #[test]
    fn a_link_along_a_wall_runs_through_what_is_not_cleared_there() {
        let reached = PlanarSet::rectangle([-5.0, 0.0, 15.0, 10.0]);
        let part = PlanarSet::rectangle([0.0, 0.0, 10.0, 10.0]);
        let block = Block::new(&part, &reached);
        let is_blocked = |from, to| block.is_hit(from, to);
        assert!(is_blocked([-1.0, 0.0], [11.0, 0.0]), "along the wall");
        assert!(is_blocked([-1.0, 5.0], [11.0, 5.0]), "through the middle");
        assert!(!is_blocked([0.0, 1.0], [0.0, 9.0]), "along the side that is cleared");
        assert!(!is_blocked([-4.0, 0.0], [-1.0, 0.0]), "along the wall beside cleared ground");
    }
}
