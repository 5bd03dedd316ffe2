//! When a front that leaves some vertices arrives at all others.
//!
//! Fast marching on triangles (Kimmel and Sethian, "Computing geodesic paths on manifolds", 1998): vertices are settled in the
//! order of their times; over a triangle with two settled corners the front is straight and arrives at the third between
//! them, or else along one of its sides.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::intrinsic::Intrinsic;

/// The times at all vertices, at a speed of 1 from the `sources`; infinite where no triangle leads.
pub(super) fn times(intrinsic: &Intrinsic, count: usize, sources: &[usize]) -> Vec<f64> {
    let around = Around::new(&intrinsic.triangles, count);
    let mut front = Front { times: vec![f64::INFINITY; count], open: BinaryHeap::new() };
    let mut settled = vec![false; count];
    sources.iter().for_each(|&v| front.arrive(v, 0.0));
    while let Some(Reverse((_, v))) = front.open.pop() {
        if std::mem::replace(&mut settled[v], true) {
            continue;
        }
        for &triangle in around.of(v) {
            let triangle = triangle as usize;
            let corners = intrinsic.triangles[triangle].map(|c| c as usize);
            let lengths = intrinsic.lengths[triangle];
            for k in (0..3).filter(|&k| !settled[corners[k]]) {
                // Sides lead from each corner to the next one.
                let (next, last) = ((k + 1) % 3, (k + 2) % 3);
                let beside = |other: usize, length: f64| {
                    (front.times[corners[other]], length, settled[corners[other]])
                };
                let (a, b) = (beside(next, lengths[k]), beside(last, lengths[last]));
                let along = [a, b].into_iter().filter(|s| s.2).map(|(t, length, _)| t + length);
                let mut time = along.fold(f64::INFINITY, f64::min);
                if a.2 && b.2 {
                    time = time.min(across([a.0, b.0], [a.1, b.1], lengths[next]));
                }
                front.arrive(corners[k], time);
            }
        }
    }
    front.times
}

struct Front {
    times: Vec<f64>,
    /// Positive floats sort like their bits.
    open: BinaryHeap<Reverse<(u64, usize)>>,
}

impl Front {
    fn arrive(&mut self, vertex: usize, time: f64) {
        if time < self.times[vertex] {
            self.times[vertex] = time;
            self.open.push(Reverse((time.to_bits(), vertex)));
        }
    }
}

/// When a straight front that passes two corners of a triangle at these times arrives at the third, whose sides to them are so
/// long; infinite if it does not come from between them.
fn across(times: [f64; 2], [to_a, to_b]: [f64; 2], base: f64) -> f64 {
    let late = times[0].max(times[1]);
    let t = times.map(|t| t - late);
    // With `u` the direction of the front, `(a, b)·u = t − T`; that `u` is a unit vector makes a quadratic equation of `T`.
    let (aa, bb) = (to_a * to_a, to_b * to_b);
    let ab = 0.5 * (aa + bb - base * base);
    let determinant = aa * bb - ab * ab;
    let square =
        |p: [f64; 2], q: [f64; 2]| bb * p[0] * q[0] - ab * (p[0] * q[1] + p[1] * q[0]) + aa * p[1] * q[1];
    let (ones, mixed, own) = (square([1.0; 2], [1.0; 2]), square([1.0; 2], t), square(t, t));
    let root = mixed * mixed - ones * (own - determinant);
    if determinant <= 0.0 || ones <= 0.0 || root < 0.0 {
        return f64::INFINITY;
    }
    let arrival = (mixed + root.sqrt()) / ones;
    let r = t.map(|t| t - arrival);
    let is_between = bb * r[0] - ab * r[1] <= 0.0 && aa * r[1] - ab * r[0] <= 0.0;
    if is_between && arrival >= 0.0 { late + arrival } else { f64::INFINITY }
}

/// The triangles around each vertex.
struct Around {
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl Around {
    fn new(triangles: &[[u32; 3]], count: usize) -> Self {
        let mut first = vec![0u32; count + 1];
        triangles.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
        for v in 0..count {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut sorted = vec![0; 3 * triangles.len()];
        for (t, corners) in triangles.iter().enumerate() {
            for &v in corners {
                sorted[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Around { first, triangles: sorted }
    }

    fn of(&self, vertex: usize) -> &[u32] {
        &self.triangles[self.first[vertex] as usize..self.first[vertex + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_front_arrives_when_it_should() {
        // Corners at (3, 0) and (0, 4) from the third; a front that runs along (−0.6, −0.8) from 10 mm away.
        let front = |x: f64, y: f64| 10.0 - 0.6 * x - 0.8 * y;
        let arrival = across([front(3.0, 0.0), front(0.0, 4.0)], [3.0, 4.0], 5.0);
        approx::assert_relative_eq!(arrival, 10.0, epsilon = 1e-12);
        // One that comes from beyond the side to (3, 0) has to run along that.
        assert_eq!(across([0.0, 4.5], [3.0, 4.0], 5.0), f64::INFINITY);
    }
}
