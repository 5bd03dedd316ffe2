//! A triangulation known by its edge lengths alone, made Delaunay by flipping edges.
//!
//! With Delaunay triangles the cotangent weights of inner edges are not negative, so that fields have no
//! maxima or minima but where they are told to (Bobenko and Springborn, "A discrete Laplace–Beltrami operator
//! for simplicial surfaces", 2007). Vertices stay where they are.

use super::connectivity::NONE;

/// Triangle inequalities hold with this part of the mean length to spare, so that cotangents stay below its
/// inverse and the equations sound.
const SPARE: f64 = 1e-4;
/// Sides are flipped until the cotangents of the angles across them sum to more than this.
const FLAT: f64 = -1e-9;
/// Flips at most, for each side.
const MOST_FLIPS: usize = 20;

#[derive(Debug, Clone)]
pub(super) struct Intrinsic {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Of side `k`, from corner `k` to the next.
    pub(super) lengths: Vec<[f64; 3]>,
    twins: Vec<u32>,
}

impl Intrinsic {
    /// `lengths` are equal on both sides of an edge.
    pub(super) fn new(triangles: &[[u32; 3]], twins: &[u32], lengths: Vec<[f64; 3]>) -> Self {
        let mut found = Intrinsic { triangles: triangles.to_vec(), lengths, twins: twins.to_vec() };
        found.mend_inequalities();
        found.thicken();
        found.make_delaunay();
        found
    }

    fn length(&self, side: usize) -> f64 {
        self.lengths[side / 3][side % 3]
    }

    /// Shortens sides that are longer than the other two together, as uneven metrics may have them.
    fn mend_inequalities(&mut self) {
        for _ in 0..8 {
            let mut changed = false;
            for t in 0..self.triangles.len() {
                for k in 0..3 {
                    let l = self.lengths[t];
                    let most = l[(k + 1) % 3] + l[(k + 2) % 3];
                    if l[k] > most * (1.0 + 1e-12) {
                        self.lengths[t][k] = most;
                        let twin = self.twins[3 * t + k];
                        if twin != NONE {
                            self.lengths[twin as usize / 3][twin as usize % 3] = most;
                        }
                        changed = true;
                    }
                }
            }
            if !changed {
                break;
            }
        }
    }

    /// Makes all sides longer by as little as turns the flattest needle into a triangle (Sharp and Crane, "A
    /// Laplacian for nonmanifold triangle meshes", 2020).
    fn thicken(&mut self) {
        let spare = SPARE * self.mean_length();
        let lacks = |l: &[f64; 3]| {
            let sum: f64 = l.iter().sum();
            l.iter().fold(0.0f64, |most, x| most.max(spare - (sum - 2.0 * x)))
        };
        let more = self.lengths.iter().map(lacks).fold(0.0, f64::max);
        self.lengths.iter_mut().flatten().for_each(|l| *l += more);
    }

    fn make_delaunay(&mut self) {
        let mut open: Vec<u32> = (0..self.twins.len() as u32).rev().collect();
        let mut waiting = vec![true; open.len()];
        let mut flips = MOST_FLIPS * open.len();
        while let Some(side) = open.pop() {
            let side = side as usize;
            waiting[side] = false;
            if self.twins[side] == NONE || flips == 0 {
                continue;
            }
            let twin = self.twins[side] as usize;
            if side / 3 == twin / 3 || self.cotangent(side) + self.cotangent(twin) >= FLAT {
                continue;
            }
            if self.flip(side) {
                flips -= 1;
                for s in [0, 2].into_iter().flat_map(|k| [side / 3 * 3 + k, twin / 3 * 3 + k]) {
                    if !waiting[s] {
                        waiting[s] = true;
                        open.push(s as u32);
                    }
                }
            }
        }
    }

    /// Cotangent of the angle opposite a side.
    fn cotangent(&self, side: usize) -> f64 {
        cotangents(&self.lengths[side / 3])[side % 3]
    }

    /// Replaces the side between two triangles by the other diagonal of their quadrilateral. The new diagonal
    /// is the second side of both.
    fn flip(&mut self, side: usize) -> bool {
        let next = |s: usize| s / 3 * 3 + (s + 1) % 3;
        let twin = self.twins[side] as usize;
        let [s1, s2] = [next(side), next(next(side))];
        let [t1, t2] = [next(twin), next(next(twin))];
        let (t, u) = (side / 3, twin / 3);
        let (base, bc, ca) = (self.length(side), self.length(s1), self.length(s2));
        let (ad, db) = (self.length(t1), self.length(t2));
        let above = place(base, ca, bc);
        let below = place(base, ad, db);
        let diagonal = (above[0] - below[0]).hypot(above[1] + below[1]);
        if diagonal.is_nan() || diagonal <= 0.0 {
            return false;
        }
        let corner = |s: usize| self.triangles[s / 3][s % 3];
        let (a, b, c, d) = (corner(side), corner(s1), corner(s2), corner(t2));
        let moved = [(s1, 3 * u), (s2, 3 * t + 2), (t1, 3 * t), (t2, 3 * u + 2)];
        let beyond = moved.map(|(old, _)| {
            let n = self.twins[old];
            moved.iter().find(|m| m.0 as u32 == n).map_or(n, |m| m.1 as u32)
        });
        self.triangles[t] = [a, d, c];
        self.triangles[u] = [b, c, d];
        self.lengths[t] = [ad, diagonal, ca];
        self.lengths[u] = [bc, diagonal, db];
        for ((_, new), n) in moved.into_iter().zip(beyond) {
            self.twins[new] = n;
            if n != NONE {
                self.twins[n as usize] = new as u32;
            }
        }
        self.twins[3 * t + 1] = (3 * u + 1) as u32;
        self.twins[3 * u + 1] = (3 * t + 1) as u32;
        true
    }

    /// Mean length of all sides.
    fn mean_length(&self) -> f64 {
        let sum: f64 = self.lengths.iter().flatten().sum();
        sum / (3 * self.lengths.len()) as f64
    }

    /// A triangle laid out in the plane: first corner at the origin, second on the positive x axis.
    pub(super) fn flat(&self, triangle: usize) -> [[f64; 2]; 3] {
        let [l0, l1, l2] = self.lengths[triangle];
        [[0.0; 2], [l0, 0.0], place(l0, l2, l1)]
    }

    /// The cotangent weights: for each pair of vertices joined by a side, half the cotangents of the angles across it.
    pub(super) fn weights(&self) -> Vec<(u32, u32, f64)> {
        let mut weights = Vec::with_capacity(self.twins.len());
        for (triangle, lengths) in self.triangles.iter().zip(&self.lengths) {
            let cotangents = cotangents(lengths);
            for k in 0..3 {
                let (i, j) = (triangle[k], triangle[(k + 1) % 3]);
                if i != j {
                    weights.push((i.min(j), i.max(j), 0.5 * cotangents[k]));
                }
            }
        }
        weights.sort_by_key(|w| (w.0, w.1));
        weights.dedup_by(|b, a| {
            let same = (a.0, a.1) == (b.0, b.1);
            if same {
                a.2 += b.2;
            }
            same
        });
        weights
    }
}

/// The third corner over a base from the origin along x, at the distances `from_start` and `from_end`.
fn place(base: f64, from_start: f64, from_end: f64) -> [f64; 2] {
    let x = (base * base + from_start * from_start - from_end * from_end) / (2.0 * base);
    [x, (from_start * from_start - x * x).max(1e-20 * base * base).sqrt()]
}

/// Area by Heron's formula, never quite zero.
fn area(l: &[f64; 3]) -> f64 {
    let s = 0.5 * (l[0] + l[1] + l[2]);
    (s * (s - l[0]) * (s - l[1]) * (s - l[2])).max(1e-20 * s.powi(4)).sqrt()
}

/// Cotangents of the angles opposite the three sides.
fn cotangents(l: &[f64; 3]) -> [f64; 3] {
    let squares = l.map(|x| x * x);
    let sum: f64 = squares.iter().sum();
    let by = 0.25 / area(l);
    squares.map(|x| (sum - 2.0 * x) * by)
}

#[cfg(test)]
mod tests {
    use super::super::connectivity::twins;
    use super::*;

    #[test]
    fn a_bad_diagonal_is_flipped_and_no_weight_between_triangles_is_negative() {
        // A flat strip of squares, sheared so far that every diagonal is the wrong one.
        let places: Vec<[f64; 2]> =
            (0..2).flat_map(|y| (0..9).map(move |x| [x as f64 + 2.5 * f64::from(y), f64::from(y)])).collect();
        let mut triangles = Vec::new();
        for x in 0..8 {
            triangles.push([x, x + 1, x + 10]);
            triangles.push([x, x + 10, x + 9]);
        }
        let length = |a: u32, b: u32| {
            let (p, q) = (places[a as usize], places[b as usize]);
            (p[0] - q[0]).hypot(p[1] - q[1])
        };
        let links = twins(&triangles);
        let lengths = triangles.iter().map(|&[a, b, c]| [length(a, b), length(b, c), length(c, a)]);
        let found = Intrinsic::new(&triangles, &links, lengths.collect());
        let total = |ls: &[[f64; 3]]| ls.iter().map(area).sum::<f64>();
        approx::assert_relative_eq!(total(&found.lengths), 8.0, epsilon = 1e-9);
        for side in 0..found.twins.len() {
            let twin = found.twins[side];
            if twin != NONE {
                assert_eq!(found.twins[twin as usize] as usize, side);
                assert!(found.cotangent(side) + found.cotangent(twin as usize) >= -1e-6);
                approx::assert_relative_eq!(found.length(side), found.length(twin as usize));
            }
        }
        // Linear functions are harmonic on the plane at inner vertices; here all vertices are on the border,
        // so the weights are tested by their row sums against the gradient energy of x: its area.
        let weights = found.weights();
        let energy: f64 = weights
            .iter()
            .map(|&(i, j, w)| w * (places[i as usize][0] - places[j as usize][0]).powi(2))
            .sum();
        approx::assert_relative_eq!(energy, 8.0, epsilon = 1e-6);
    }
}
