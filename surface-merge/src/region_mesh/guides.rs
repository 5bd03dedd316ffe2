//! The two opposite sides of a region that passes run between, from its loops and corners: sides,
//! halves, rings or ends.

use std::f64::consts::PI;

use claymill_nurbs::Point3;

use super::{BoundaryLoop, RegionMesh};

/// Two sides of a region between which a pattern can run.
#[derive(Debug, Clone, PartialEq)]
pub struct Guides {
    /// Vertices of the one side, in order.
    pub from: Vec<u32>,
    /// Vertices of the other side, in order.
    pub to: Vec<u32>,
    /// How they were found.
    pub kind: GuideKind,
}

/// What kind of guides a region has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuideKind {
    /// The longer two of the four sides between the four corners of the outer loop.
    Sides,
    /// Two opposite parts of an outer loop that does not have four corners: its ends are left free.
    Halves,
    /// The two loops of a ring.
    Rings,
    /// The two ends that are farthest from each other: of a closed surface, or of one that is open at one end alone.
    Ends,
    /// Sides that somebody chose.
    Chosen,
}

/// A second loop shorter than this part of the longest is a hole in a sheet, not the other end of a ring.
pub(super) const HOLE: f64 = 0.25;
/// A surface with more than this times the area of the disc that its longest loop could enclose is no sheet spanned over
/// that loop but an arm that begins there. A field between two halves of the loop fades along an arm, to a tenth by
/// this length (by exp(−2π) within each circumference).
const ARM: f64 = 4.0;
/// A sheet is compact with at least this share of the area of the disc that its longest loop could enclose: an oval twice as
/// long as wide has 0.85 (isoperimetric quotient).
const COMPACT: f64 = 0.8;
/// A loop this near the far end of an arm, in its length, is that end.
const AT_END: f64 = 0.3;
/// A corner turns by more than this, degrees.
const CORNER_DEG: f64 = 30.0;
/// Turns within this part of the loop's length are one corner.
const CORNER_REACH: f64 = 0.03;
/// Corners are this part of the loop's length apart.
const CORNERS_APART: f64 = 0.06;
/// Corners looked at; a region may have more.
const MOST_CORNERS: usize = 14;
/// Where a side is missing, this part of the loop on each side of the tip stands for it.
pub(super) const TIP: f64 = 0.04;
/// The same for loops without tips.
pub(super) const ROUND_END: f64 = 0.125;
/// Two tips cut a loop into halves when none is shorter than this part of it.
const SHORT_HALF: f64 = 0.3;

impl RegionMesh<'_> {
    /// A sensible choice of two opposite sides: iso-lines of a field from the one to the other run along the
    /// region.
    ///
    /// A ring has its two loops; an arm, a surface much longer than its longest loop is wide, has that loop and its far
    /// end. Any other region with a border has two parts of its longest loop: its corners
    /// (turns of more than 30° in the surface) are found, the four that turn most and lie farthest from each
    /// other make four sides, and the longer two opposite ones are taken. With fewer corners the free sides
    /// are short stretches around the tips; with none or one, around the two points farthest from each other. Further
    /// loops are holes that lines run around. A closed surface has its two ends.
    #[must_use]
    pub fn guides(&self) -> Guides {
        match self.loops() {
            [] => self.ends(),
            [outer, inner] if inner.length_mm > HOLE * outer.length_mm => {
                Guides { from: outer.vertices.clone(), to: inner.vertices.clone(), kind: GuideKind::Rings }
            }
            [outer, others @ ..] if self.is_arm(outer) => self.arm(outer, others),
            [outer, ..] => self.sides(outer),
        }
    }

    /// Where distances over the region are measured from: the first of its guides, or the whole border where that is one
    /// loop without a corner around something compact, so that lines at a distance follow each other inwards. From a part of
    /// such a border they would run on around its ends and meet head on along a seam.
    #[must_use]
    pub fn distance_guide(&self) -> Vec<u32> {
        if let [outer, holes @ ..] = self.loops()
            && holes.iter().all(|l| l.length_mm <= HOLE * outer.length_mm)
            && self.area_mm2() > COMPACT * outer.length_mm.powi(2) / (4.0 * PI)
            && Ring::new(self, outer).corners().is_empty()
        {
            return outer.vertices.clone();
        }
        self.guides().from
    }

    fn is_arm(&self, outer: &BoundaryLoop) -> bool {
        self.area_mm2() > ARM * outer.length_mm.powi(2) / (4.0 * PI)
    }

    /// From the longest loop of an arm to its far end: the loop that is there, or where the surface closes.
    fn arm(&self, outer: &BoundaryLoop, others: &[BoundaryLoop]) -> Guides {
        let begin = centre(outer.vertices.iter().map(|&v| self.point(v)));
        let far = farthest_from(self.vertices.iter().map(|v| v.point), &begin);
        let is_at_end = |l: &&BoundaryLoop| {
            let at = centre(l.vertices.iter().map(|&v| self.point(v)));
            (at - far).norm() < AT_END * (far - begin).norm()
        };
        // Loops come by length.
        match others.iter().find(is_at_end) {
            Some(end) => {
                Guides { from: outer.vertices.clone(), to: end.vertices.clone(), kind: GuideKind::Rings }
            }
            None => {
                Guides { from: outer.vertices.clone(), to: self.vertices_near(&far), kind: GuideKind::Ends }
            }
        }
    }

    fn sides(&self, outer: &BoundaryLoop) -> Guides {
        let ring = Ring::new(self, outer);
        let (kind, corners) = ring.sides();
        let side = |k: usize| ring.stretch(corners[k], corners[(k + 1) % 4]);
        let way = |k: usize| ring.way(corners[k], corners[(k + 1) % 4]);
        let first = usize::from(way(1) + way(3) > way(0) + way(2));
        Guides { from: side(first), to: side((first + 2) % 4), kind }
    }

    fn ends(&self) -> Guides {
        let points = || self.vertices.iter().map(|v| v.point);
        let a = farthest_from(points(), &centre(points()));
        let b = farthest_from(points(), &a);
        Guides { from: self.vertices_near(&a), to: self.vertices_near(&b), kind: GuideKind::Ends }
    }

    pub(super) fn vertices_near(&self, p: &Point3) -> Vec<u32> {
        let near = |i: &u32| (self.point(*i) - p).norm() <= 2.0 * self.edge_mm;
        (0..self.vertices.len() as u32).filter(near).collect()
    }

    /// Sum of the angles of the triangles around each vertex, radians.
    fn angle_sums(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.vertices.len()];
        for triangle in &self.triangles {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|j| self.point(triangle[(k + j) % 3]));
                sums[triangle[k] as usize] += (b - a).angle(&(c - a));
            }
        }
        sums
    }
}

fn centre(points: impl ExactSizeIterator<Item = Point3>) -> Point3 {
    let share = 1.0 / points.len() as f64;
    points.fold(Point3::origin(), |centre, p| centre + p.coords * share)
}

fn farthest_from(points: impl Iterator<Item = Point3>, from: &Point3) -> Point3 {
    points.fold(*from, |far, p| if (p - from).norm() > (far - from).norm() { p } else { far })
}

/// A loop with its arc length and its turning.
pub(super) struct Ring {
    vertices: Vec<u32>,
    points: Vec<Point3>,
    /// Arc length up to each vertex, mm.
    s: Vec<f64>,
    length: f64,
    /// Turn toward the inside at each vertex, radians.
    turn: Vec<f64>,
}

impl Ring {
    pub(super) fn new(mesh: &RegionMesh<'_>, ring: &BoundaryLoop) -> Self {
        let sums = mesh.angle_sums();
        let points: Vec<Point3> = ring.vertices.iter().map(|&v| mesh.point(v)).collect();
        let mut s = Vec::with_capacity(points.len());
        let mut length = 0.0;
        for k in 0..points.len() {
            s.push(length);
            length += (points[(k + 1) % points.len()] - points[k]).norm();
        }
        let turn = ring.vertices.iter().map(|&v| PI - sums[v as usize]).collect();
        Ring { vertices: ring.vertices.clone(), points, s, length, turn }
    }

    fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Arc length from one vertex forward to another.
    fn way(&self, from: usize, to: usize) -> f64 {
        (self.s[to] - self.s[from]).rem_euclid(self.length)
    }

    /// The vertices from one to another, both included.
    pub(super) fn stretch(&self, from: usize, to: usize) -> Vec<u32> {
        let count = (to + self.len() - from) % self.len();
        (0..=count).map(|k| self.vertices[(from + k) % self.len()]).collect()
    }

    /// The vertices a part of the loop's length before and after one.
    pub(super) fn around(&self, vertex: usize, part: f64) -> [usize; 2] {
        [-part, part].map(|p| {
            let s = (self.s[vertex] + p * self.length).rem_euclid(self.length);
            self.s.partition_point(|&x| x < s) % self.len()
        })
    }

    /// The corners with their turn in degrees, by turn, in order around the loop.
    pub(super) fn corners(&self) -> Vec<(usize, f64)> {
        let reach = CORNER_REACH * self.length;
        let turn = |i: usize| -> f64 {
            let mut sum = self.turn[i];
            for step in [1, self.len() - 1] {
                let mut k = (i + step) % self.len();
                loop {
                    let way = self.way(i, k).min(self.way(k, i));
                    if way >= reach || k == i {
                        break;
                    }
                    sum += self.turn[k] * (1.0 - way / reach);
                    k = (k + step) % self.len();
                }
            }
            sum.to_degrees()
        };
        let mut all: Vec<(usize, f64)> = (0..self.len()).map(|i| (i, turn(i))).collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut found: Vec<(usize, f64)> = Vec::new();
        for (i, turn) in all {
            if turn < CORNER_DEG || found.len() == MOST_CORNERS {
                break;
            }
            let apart = |j: usize| self.way(i, j).min(self.way(j, i)) > CORNERS_APART * self.length;
            if found.iter().all(|f| apart(f.0)) {
                found.push((i, turn));
            }
        }
        found.sort_by_key(|f| f.0);
        found
    }

    /// Four places that cut the loop into sides, in order.
    fn sides(&self) -> (GuideKind, [usize; 4]) {
        let found = self.corners();
        let halves = |tips: [usize; 2], part: f64| {
            let [[a, b], [c, d]] = tips.map(|k| self.around(k, part));
            (GuideKind::Halves, [a, b, c, d])
        };
        let (kind, mut corners) = match (self.four_corners(&found), &found[..]) {
            (Some(four), _) => (GuideKind::Sides, four),
            (None, &[(a, _), (b, _), (c, _)]) => {
                // The corner opposite the shortest side is a tip.
                let (_, [p, q, tip]) = [[b, c, a], [c, a, b]]
                    .into_iter()
                    .map(|way| (self.way(way[0], way[1]), way))
                    .fold((self.way(a, b), [a, b, c]), |x, y| if y.0 < x.0 { y } else { x });
                let [x, y] = self.around(tip, TIP);
                (GuideKind::Sides, [p, q, x, y])
            }
            (None, &[(a, _), (b, _)]) if self.way(a, b).min(self.way(b, a)) > SHORT_HALF * self.length => {
                halves([a, b], TIP)
            }
            _ => {
                let (a, b) = self.farthest();
                halves([a, b], ROUND_END)
            }
        };
        corners.sort_unstable();
        (kind, corners)
    }

    /// The four corners that turn most and lie farthest from each other.
    fn four_corners(&self, corners: &[(usize, f64)]) -> Option<[usize; 4]> {
        let mut best: Option<(f64, [usize; 4])> = None;
        for a in 0..corners.len() {
            for b in a + 1..corners.len() {
                for c in b + 1..corners.len() {
                    for d in c + 1..corners.len() {
                        let four = [a, b, c, d].map(|k| corners[k]);
                        let turning: f64 = four.iter().map(|f| f.1.min(90.0) / 90.0).sum();
                        let chord = |k: usize| self.points[four[k].0] - self.points[four[(k + 1) % 4].0];
                        let around: f64 = (0..4).map(|k| chord(k).norm()).sum();
                        let score = turning + 4.0 * around / self.length;
                        if best.is_none_or(|b| score > b.0 + 1e-9) {
                            best = Some((score, four.map(|f| f.0)));
                        }
                    }
                }
            }
        }
        best.map(|b| b.1)
    }

    /// Two vertices far from each other.
    fn farthest(&self) -> (usize, usize) {
        let far = |i: usize| {
            let distance = |k: &usize| (self.points[*k] - self.points[i]).norm();
            (0..self.len()).fold(i, |best, k| if distance(&k) > distance(&best) { k } else { best })
        };
        let a = far(far(0));
        (a, far(a))
    }
}
