//! The base profile of a chain: as fast as acceleration allows, so that its average over a window keeps every limit.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::{Joint, Limits, Place};

/// A stretch of constant acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Leg {
    pub(crate) length_mm: f64,
    /// Speed at its ends, mm/s.
    pub(crate) from: f64,
    pub(crate) to: f64,
}

impl Leg {
    pub(crate) fn time_s(&self) -> f64 {
        2.0 * self.length_mm / (self.from + self.to)
    }
}

/// A place of the profile: distance, and the square of the speed.
type Node = (f64, f64);

/// Where a profile begins.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Start {
    /// Way behind it, mm.
    pub(crate) s: f64,
    /// Its speed, mm/s.
    pub(crate) v: f64,
    /// So far its speed is kept, mm.
    pub(crate) keep: f64,
}

/// Speed over places from `start` to rest, for an acceleration `a` and the window `t` of the filter; where `start` is
/// too fast for what comes, the profile begins slower.
pub(crate) fn legs(places: &[(Joint, Place)], start: Start, a: f64, t: f64, limits: &Limits) -> Vec<Leg> {
    let pieces = pieces(places, start, a, t, limits);
    let nodes = held(&fastest(&pieces, start.v), start.v, t);
    let leg = |w: &[Node]| Leg { length_mm: w[1].0 - w[0].0, from: w[0].1.sqrt(), to: w[1].1.sqrt() };
    nodes.windows(2).map(leg).filter(|l| l.length_mm > 0.0).collect()
}

/// A stretch with one highest speed and one highest acceleration.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: f64,
    to: f64,
    speed: f64,
    push: f64,
}

/// Something that holds from one place to another: the smaller, the stronger.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hold {
    from: f64,
    to: f64,
    most: f64,
}

/// What holds at a point without a window holds so far on either side, mm.
const POINT_MM: f64 = 1e-7;

/// Nothing that moves is slower, mm/s.
const STILL_MM_PER_S: f64 = 1e-3;

/// The highest speed is held over the window's time at that speed, half on either side of what needs it; the highest
/// acceleration over the whole window on either side.
fn pieces(places: &[(Joint, Place)], start: Start, a: f64, t: f64, limits: &Limits) -> Vec<Piece> {
    let (mut speeds, mut pushes) = (Vec::new(), Vec::new());
    if start.keep > 0.0 {
        speeds.push(Hold { from: start.s, to: start.s + start.keep, most: start.v });
    }
    let mut at = 0.0;
    for (i, (joint, place)) in places.iter().enumerate() {
        let cap = place.cap(limits);
        let mut joint_jerk = 0.0;
        if i > 0 {
            let v = joint.speed.max(STILL_MM_PER_S).min(cap);
            if joint.speed < cap {
                let half = (0.5 * v * t).max(POINT_MM);
                speeds.push(Hold { from: at - half, to: at + half, most: v });
            }
            if joint.jerk_per_speed > 0.0 {
                joint_jerk = joint.jerk_per_speed * v;
                let most = place.push(v, joint_jerk, a, limits);
                if most < a {
                    pushes.push(Hold { from: at - v * t, to: at + v * t, most });
                }
            }
        }
        let end = at + place.length_mm;
        speeds.push(Hold { from: at - 0.5 * cap * t, to: end + 0.5 * cap * t, most: cap });
        let push = place.push(cap, joint_jerk, a, limits);
        if push < a {
            pushes.push(Hold { from: at - cap * t, to: end + cap * t, most: push });
        }
        at = end;
    }
    let (speeds, pushes) = (lowest(speeds, at, f64::INFINITY), lowest(pushes, at, a));
    // Both step functions in one.
    let (mut i, mut k, mut from) = (0, 0, start.s);
    let mut pieces = Vec::with_capacity(speeds.len() + pushes.len());
    while i < speeds.len() && k < pushes.len() {
        let to = speeds[i].to.min(pushes[k].to);
        if to > from {
            let (speed, push) = (speeds[i].most, pushes[k].most);
            pieces.push(Piece { from: from - start.s, to: to - start.s, speed, push });
            from = to;
        }
        if speeds[i].to <= to {
            i += 1;
        }
        if pushes[k].to <= to {
            k += 1;
        }
    }
    pieces
}

/// A hold in a heap whose top is the strongest.
struct Strongest(Hold);

impl PartialEq for Strongest {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Strongest {}
impl PartialOrd for Strongest {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Strongest {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.most.total_cmp(&self.0.most).then_with(|| self.0.to.total_cmp(&other.0.to))
    }
}

/// The lower envelope of holds over `0..end`, in order and without a gap; `usual` where nothing holds.
fn lowest(mut holds: Vec<Hold>, end: f64, usual: f64) -> Vec<Hold> {
    holds.push(Hold { from: 0.0, to: end, most: usual });
    for h in &mut holds {
        (h.from, h.to) = (h.from.max(0.0), h.to.min(end));
    }
    holds.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut active: BinaryHeap<Strongest> = BinaryHeap::new();
    let mut envelope: Vec<Hold> = Vec::new();
    let (mut next, mut at) = (0, 0.0);
    while at < end {
        while next < holds.len() && holds[next].from <= at {
            active.push(Strongest(holds[next]));
            next += 1;
        }
        while active.peek().is_some_and(|h| h.0.to <= at) {
            active.pop();
        }
        let Some(top) = active.peek().map(|h| h.0) else { break };
        // Weaker ones may begin meanwhile; a stronger one ends this stretch.
        while next < holds.len() && holds[next].from < top.to && holds[next].most >= top.most {
            active.push(Strongest(holds[next]));
            next += 1;
        }
        let to = holds.get(next).map_or(top.to, |h| h.from.min(top.to));
        match envelope.last_mut() {
            Some(last) if last.most == top.most => last.to = to,
            _ => envelope.push(Hold { from: at, to, most: top.most }),
        }
        at = to;
    }
    envelope
}

/// The squares of the highest speeds that acceleration allows, from `start` to rest; linear between the nodes.
fn fastest(pieces: &[Piece], start: f64) -> Vec<Node> {
    let n = pieces.len();
    let mut w = vec![0.0; n + 1];
    w[0] = start * start;
    for (i, p) in pieces.iter().enumerate() {
        let next = pieces.get(i + 1).map_or(0.0, |q| q.speed.min(p.speed).powi(2));
        w[i + 1] = next.min(w[i] + 2.0 * p.push * (p.to - p.from));
    }
    for (i, p) in pieces.iter().enumerate().rev() {
        w[i] = w[i].min(w[i + 1] + 2.0 * p.push * (p.to - p.from));
    }
    let mut nodes: Vec<Node> = vec![(0.0, w[0])];
    for (i, p) in pieces.iter().enumerate() {
        let (w0, w1) = (w[i], w[i + 1]);
        let top = (p.speed * p.speed).min(0.5 * (w0 + w1) + p.push * (p.to - p.from)).max(w0).max(w1);
        for (s, v) in
            [(p.from + 0.5 * (top - w0) / p.push, top), (p.to - 0.5 * (top - w1) / p.push, top), (p.to, w1)]
        {
            if s > nodes[nodes.len() - 1].0 {
                nodes.push((s, v));
            }
        }
    }
    nodes
}

/// Cuts every peak down to a speed that is held for the time `t`.
fn held(nodes: &[Node], start: f64, t: f64) -> Vec<Node> {
    if t <= 0.0 {
        return nodes.to_vec();
    }
    let floor = start * start;
    let mut kept: Vec<Node> = Vec::with_capacity(nodes.len());
    let mut i = 0;
    while i < nodes.len() {
        kept.push(nodes[i]);
        // The last node of a peak: what follows is lower, what came was not.
        let down = nodes.get(i + 1).is_some_and(|n| n.1 < nodes[i].1);
        let up = kept.len() >= 2 && kept[kept.len() - 2].1 <= nodes[i].1 || kept.len() == 1;
        if !(down && up) {
            i += 1;
            continue;
        }
        let mut level = nodes[i].1;
        // First node of the peak in `kept`, and last one in `nodes`.
        let (mut l, mut r) = (kept.len() - 1, i);
        // At the level of a valley the peak at first ends there; only what is too short so takes in what rises behind.
        let mut beyond = false;
        loop {
            while l > 0 && kept[l - 1].1 >= level && (beyond || kept[l].1 > level || kept[l - 1].1 == level) {
                l -= 1;
            }
            while r + 1 < nodes.len()
                && nodes[r + 1].1 >= level
                && (beyond || nodes[r].1 > level || nodes[r + 1].1 == level)
            {
                r += 1;
            }
            let below_left = (l > 0).then(|| kept[l - 1]);
            let below_right = nodes.get(r + 1).copied();
            // Where the slopes have come down to a level.
            let on = |a: Node, b: Node, w: f64| {
                if a.1 == b.1 { b.0 } else { a.0 + (b.0 - a.0) * (w - a.1) / (b.1 - a.1) }
            };
            let left = |w: f64| below_left.map_or(kept[0].0, |b| on(b, kept[l], w));
            let right = |w: f64| below_right.map_or(nodes[nodes.len() - 1].0, |b| on(b, nodes[r], w));
            // A profile that begins at a speed cannot be lower there.
            let next = below_left.map_or(floor.min(level), |n| n.1).max(below_right.map_or(0.0, |n| n.1));
            let (wide, wider) = (right(level) - left(level), right(next) - left(next));
            if wide >= level.sqrt() * t {
                if r > i || level < nodes[i].1 {
                    let ends = [(left(level), level), (right(level), level)];
                    kept.truncate(l);
                    kept.extend(ends);
                    i = r;
                }
                break;
            }
            if next > level {
                beyond = true;
                continue;
            }
            beyond = false;
            if wider >= next.sqrt() * t || next >= level {
                // Linear in between: wide + slope · (level − u²) = t · u.
                let slope = if level > next { (wider - wide) / (level - next) } else { 0.0 };
                let u2 = if slope > 0.0 {
                    let u = (-t + (t * t + 4.0 * slope * (wide + slope * level)).sqrt()) / (2.0 * slope);
                    (u * u).clamp(next, level)
                } else {
                    next
                };
                let ends = [(left(u2), u2), (right(u2), u2)];
                kept.truncate(l);
                kept.extend(ends);
                i = r;
                break;
            }
            level = next;
        }
        i += 1;
    }
    kept
}

/// Legs that come to rest as soon as acceleration allows, and are nowhere faster than `plan`; the speed may be kept
/// first.
pub(crate) fn brake(
    places: &[(Joint, Place)],
    plan: &[Node],
    start: Start,
    a: f64,
    t: f64,
    limits: &Limits,
) -> Vec<Leg> {
    let end = plan[plan.len() - 1].0;
    let pieces = pieces(places, Start { keep: 0.0, ..start }, a, t, limits);
    let bounds = pieces.iter().map(|p| p.to).chain(plan.iter().map(|n| n.0)).chain([start.keep]);
    let mut stations: Vec<f64> = bounds.filter(|s| (0.0..=end).contains(s)).collect();
    stations.sort_by(f64::total_cmp);
    stations.dedup();
    let (mut piece, mut next) = (0, 1);
    let mut nodes: Vec<Node> = vec![(0.0, start.v * start.v)];
    for s in stations {
        let (from, w) = nodes[nodes.len() - 1];
        if s <= from {
            continue;
        }
        while piece + 1 < pieces.len() && pieces[piece].to <= from {
            piece += 1;
        }
        while next + 1 < plan.len() && plan[next].0 <= from {
            next += 1;
        }
        let slope = if from < start.keep { 0.0 } else { -2.0 * pieces[piece].push };
        let (low, high) = (plan[next - 1], plan[next]);
        let rate = if high.0 > low.0 { (high.1 - low.1) / (high.0 - low.0) } else { 0.0 };
        let planned = |s: f64| low.1 + rate * (s - low.0);
        let (own, theirs) = (w + slope * (s - from), planned(s));
        if own > theirs && slope > rate {
            // The plan brakes earlier: follow it.
            let over = ((planned(from) - w).max(0.0) / (slope - rate)).min(s - from);
            nodes.push((from + over, w + slope * over));
            nodes.push((s, theirs.max(0.0)));
        } else if own <= 0.0 {
            nodes.push((from - w / slope, 0.0));
            break;
        } else {
            nodes.push((s, own));
        }
    }
    if let Some(last) = nodes.last_mut() {
        last.1 = 0.0;
    }
    let leg = |w: &[Node]| Leg { length_mm: w[1].0 - w[0].0, from: w[0].1.sqrt(), to: w[1].1.sqrt() };
    nodes.windows(2).map(leg).filter(|l| l.length_mm > 0.0 && l.from + l.to > 0.0).collect()
}
