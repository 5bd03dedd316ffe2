//! Distance between a moving triangle and a frustum by the Gilbert–Johnson–Keerthi algorithm, as a
//! proven lower bound, and the height at which a clearance is kept.

use claymill_nurbs::{Point3, Vector3};
use nalgebra::{Matrix2, Matrix3, Vector2};

use super::body::Frustum;

/// Distances are found to this, mm.
const SETTLED_MM: f64 = 1e-7;
/// Steps of the search for a distance, and for a height; what is returned after the last is still a bound.
const STEPS: usize = 80;
const RAISES: usize = 40;
/// Triangles whose normals point up or down by less than this have the body on either side.
const UPRIGHT: f64 = 0.2;
/// Directions that point down by less than this are level.
const LEVEL: f64 = 1e-12;

/// A triangle as the moving tip sees it: the hull of the triangle at both ends of a straight stretch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prism {
    /// Corner `j` seen from end `e` is `3 e + j`.
    corners: [Vector3; 6],
}

/// The distance of a prism from a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    /// The distance is at least this, mm; 0 where they meet.
    pub(super) at_least: f64,
    /// Unit normal of a plane between the two that far apart, from the body to the prism.
    pub(super) normal: Vector3,
    /// The nearest point of the prism as weights of its corners.
    pub(super) weights: [f64; 6],
}

impl Prism {
    pub(super) fn new(triangle: &[Point3; 3], from: &Point3, to: &Point3) -> Self {
        let [a, b, c] = triangle;
        Prism { corners: [a - from, b - from, c - from, a - to, b - to, c - to] }
    }

    fn support(&self, direction: &Vector3, offset: f64) -> (Vector3, usize) {
        let along = |k: &usize| self.corners[*k].dot(direction);
        let farthest = (1..6).fold(0, |best, k| if along(&k) > along(&best) { k } else { best });
        (self.corners[farthest] - Vector3::new(0.0, 0.0, offset), farthest)
    }

    pub(super) fn top(&self) -> f64 {
        self.corners.iter().map(|c| c.z).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether a plane along the triangle, or else any, keeps the two this far apart.
    pub(super) fn keeps(&self, body: &Frustum, offset: f64, distance: f64) -> bool {
        self.keeps_at_a_glance(body, offset, distance)
            || self.gap(body, offset, distance).at_least >= distance
    }

    /// Whether a plane along the triangle, or the triangle's outline beside a cylinder, says that they are this far apart.
    pub(super) fn keeps_at_a_glance(&self, body: &Frustum, offset: f64, distance: f64) -> bool {
        let [a, b, c, ..] = self.corners;
        let normal = (b - a).cross(&(c - a));
        let size = normal.norm();
        if size > 0.0 {
            let down = normal * (-normal.z.signum() / size);
            // Of an upright triangle rounding tells which side is below.
            let ceiling = (self.top() - offset).max(body.high) + 1.0;
            let upright = (normal.z.abs() < UPRIGHT * size).then_some((-down, ceiling));
            let apart = |(away, ceiling): (Vector3, f64)| {
                let (nearest, _) = self.support(&-away, offset);
                away.dot(&(nearest - body.support(&away, 0.0, ceiling))) >= distance
            };
            if [(down, f64::INFINITY)].into_iter().chain(upright).any(apart) {
                return true;
            }
        }
        body.is_cylinder() && self.aside_mm(body.low + offset - distance) >= body.outer + distance
    }

    /// How far all of the triangle that gets above a height over the tip is from the axis: over the ground, on a stretch that
    /// climbs a little less.
    fn aside_mm(&self, height: f64) -> f64 {
        let [a, b, c, onward, ..] = self.corners;
        let way = a - onward;
        let height = height + way.z.min(0.0);
        let mut outline = [Vector2::zeros(); 4];
        let mut count = 0;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            if p.z >= height {
                outline[count] = p.xy();
                count += 1;
            }
            if (p.z < height) != (q.z < height) && count < 4 {
                outline[count] = p.xy() + (q - p).xy() * ((height - p.z) / (q.z - p.z));
                count += 1;
            }
        }
        distance_over_ground(&outline[..count], &way.xy())
    }

    /// Distance from `body`, raised by `offset`, by Gilbert, Johnson and Keerthi's search (1988): the point nearest to the
    /// origin of the difference of two convex bodies lies in a simplex of at most four of its corners. It ends early
    /// when the distance is known to be `enough`. Any step gives a plane between the bodies, and so a bound.
    pub(super) fn gap(&self, body: &Frustum, offset: f64, enough: f64) -> Gap {
        // Seen from the body, so that raising it does not cost digits.
        let ceiling = (self.top() - offset).max(body.high) + 1.0;
        let start =
            self.corners[0] - Vector3::new(0.0, 0.0, offset) - body.support(&-Vector3::z(), 0.0, ceiling);
        let mut simplex =
            Simplex { points: [start; 4], corners: [0; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1 };
        let mut best = Gap { at_least: 0.0, normal: -Vector3::z(), weights: [0.0; 6] };
        for _ in 0..STEPS {
            let nearest = simplex.nearest_point();
            let size = nearest.norm();
            if size < SETTLED_MM {
                best.at_least = 0.0;
                break;
            }
            let direction = nearest / size;
            let (p, corner) = self.support(&-direction, offset);
            let point = p - body.support(&direction, 0.0, ceiling);
            let bound = direction.dot(&point);
            if bound > best.at_least {
                (best.at_least, best.normal) = (bound, direction);
            }
            if best.at_least >= enough || size - best.at_least <= SETTLED_MM || !simplex.add(point, corner) {
                break;
            }
        }
        for k in 0..simplex.count {
            best.weights[simplex.corners[k]] += simplex.weights[k];
        }
        best
    }

    /// How high the body has to be raised to keep `distance` from the prism, and the gap then; `None` if less than
    /// `known` will do. Newton from above on a convex function: every step keeps the distance.
    pub(super) fn raise(&self, body: &Frustum, distance: f64, known: f64) -> Option<(f64, Gap)> {
        let mut offset = self.top() + distance - body.low;
        for _ in 0..RAISES {
            if offset <= known {
                return None;
            }
            let gap = self.gap(body, offset, f64::INFINITY);
            let (excess, steepness) = (gap.at_least - distance, -gap.normal.z);
            if excess <= SETTLED_MM {
                return Some((offset, gap));
            }
            if steepness < LEVEL {
                return None;
            }
            offset -= excess / steepness;
        }
        let gap = self.gap(body, offset, f64::INFINITY);
        (offset > known).then_some((offset, gap))
    }
}

/// Distance of the outline of a convex area from the way from the origin to `end`; infinite where there is no area.
fn distance_over_ground(outline: &[Vector2<f64>], end: &Vector2<f64>) -> f64 {
    let origin = Vector2::zeros();
    let sides = || (0..outline.len()).map(|i| (outline[i], outline[(i + 1) % outline.len()]));
    let turns = || sides().map(|(p, q)| (q - p).perp(&-p));
    if !outline.is_empty() && (turns().all(|t| t >= 0.0) || turns().all(|t| t <= 0.0)) {
        return 0.0;
    }
    let of_point = |x: &Vector2<f64>, p: &Vector2<f64>, q: &Vector2<f64>| {
        let side = q - p;
        let along = (x - p).dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE);
        (x - p - side * along.clamp(0.0, 1.0)).norm_squared()
    };
    let of_side = |(p, q): (Vector2<f64>, Vector2<f64>)| {
        let beyond = |from: &Vector2<f64>, to: &Vector2<f64>, x: &Vector2<f64>| (to - from).perp(&(x - from));
        let crosses = beyond(&p, &q, &origin) * beyond(&p, &q, end) < 0.0
            && beyond(&origin, end, &p) * beyond(&origin, end, &q) < 0.0;
        if crosses {
            return 0.0;
        }
        let ends = of_point(&origin, &p, &q).min(of_point(end, &p, &q));
        ends.min(of_point(&p, &origin, end)).min(of_point(&q, &origin, end))
    };
    sides().map(of_side).fold(f64::INFINITY, f64::min).sqrt()
}

/// Up to four points of the difference, and the prism's corners that they come from.
struct Simplex {
    points: [Vector3; 4],
    corners: [usize; 4],
    weights: [f64; 4],
    count: usize,
}

impl Simplex {
    fn nearest_point(&self) -> Vector3 {
        (0..self.count).map(|k| self.points[k] * self.weights[k]).sum()
    }

    /// Takes a point in and leaves out those that the nearest point does not need; false when nothing is gained.
    fn add(&mut self, point: Vector3, corner: usize) -> bool {
        if self.count == self.points.len() {
            return false;
        }
        let before = self.nearest_point().norm_squared();
        let last = self.count;
        (self.points[last], self.corners[last]) = (point, corner);
        let mut best: Option<(f64, [f64; 4], usize)> = None;
        // All faces of the simplex that have the new point; the others were searched before.
        for others in 0..1usize << last {
            let Some(weights) = self.foot(others, last) else { continue };
            let nearest: Vector3 = (0..=last).map(|k| self.points[k] * weights[k]).sum();
            let square = nearest.norm_squared();
            if best.is_none_or(|b| square < b.0) {
                best = Some((square, weights, others | 1 << last));
            }
        }
        let Some((_, weights, used)) = best.filter(|b| b.0 < before) else { return false };
        self.count = 0;
        for k in (0..=last).filter(|k| used >> k & 1 == 1) {
            let at = self.count;
            (self.points[at], self.corners[at], self.weights[at]) =
                (self.points[k], self.corners[k], weights[k]);
            self.count += 1;
        }
        true
    }

    /// Weights of the point nearest to the origin in the plane of the new point and some `others`; `None` when it is not
    /// inside or they do not span that plane.
    fn foot(&self, others: usize, last: usize) -> Option<[f64; 4]> {
        let origin = self.points[last];
        let mut chosen = [0; 3];
        let mut count = 0;
        for k in (0..last).filter(|k| others >> k & 1 == 1) {
            chosen[count] = k;
            count += 1;
        }
        let side = |k: usize| self.points[chosen[k]] - origin;
        let right = |k: usize| -side(k).dot(&origin);
        let shares = match count {
            0 => [0.0; 3],
            1 => {
                let size = side(0).norm_squared();
                if size == 0.0 {
                    return None;
                }
                [right(0) / size, 0.0, 0.0]
            }
            2 => {
                let gram = Matrix2::from_fn(|i, j| side(i).dot(&side(j)));
                let s = gram.try_inverse()? * Vector2::new(right(0), right(1));
                [s.x, s.y, 0.0]
            }
            _ => {
                let gram = Matrix3::from_columns(&[side(0), side(1), side(2)]);
                let s = gram.try_inverse()? * -origin;
                [s.x, s.y, s.z]
            }
        };
        let rest = 1.0 - shares.iter().sum::<f64>();
        let inside = shares[..count].iter().all(|s| *s > 0.0) && rest > 0.0;
        inside.then(|| {
            let mut weights = [0.0; 4];
            weights[last] = rest;
            (0..count).for_each(|k| weights[chosen[k]] = shares[k]);
            weights
        })
    }
}
