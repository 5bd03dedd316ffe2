//! The thinnest bar that holds a part: the smallest circle around points.

/// Middle and radius of the smallest circle that holds all points.
///
/// Only corners of the convex hull matter. They are added one after the other; where one is outside, the circle through
/// it that holds those before is the smallest (Welzl).
pub(crate) fn smallest_circle(points: &[[f64; 2]]) -> ([f64; 2], f64) {
    let hull = hull(points);
    let mut circle = Circle { middle: hull.first().copied().unwrap_or([0.0; 2]), radius: 0.0 };
    for i in 0..hull.len() {
        if circle.holds(hull[i]) {
            continue;
        }
        circle = Circle { middle: hull[i], radius: 0.0 };
        for j in 0..i {
            if circle.holds(hull[j]) {
                continue;
            }
            circle = Circle::over(hull[i], hull[j]);
            for k in 0..j {
                if !circle.holds(hull[k]) {
                    circle = Circle::through([hull[i], hull[j], hull[k]]).unwrap_or(circle);
                }
            }
        }
    }
    (circle.middle, circle.radius)
}

#[derive(Debug, Clone, Copy)]
struct Circle {
    middle: [f64; 2],
    radius: f64,
}

/// What is farther outside than this share of the radius is outside.
const ROUNDING: f64 = 1e-12;

impl Circle {
    fn holds(&self, [x, y]: [f64; 2]) -> bool {
        (x - self.middle[0]).hypot(y - self.middle[1]) <= self.radius * (1.0 + ROUNDING)
    }

    fn over(a: [f64; 2], b: [f64; 2]) -> Self {
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        Circle { middle, radius: 0.5 * (a[0] - b[0]).hypot(a[1] - b[1]) }
    }

    /// `None` of points on a line.
    fn through([a, b, c]: [[f64; 2]; 3]) -> Option<Self> {
        let (bx, by) = (b[0] - a[0], b[1] - a[1]);
        let (cx, cy) = (c[0] - a[0], c[1] - a[1]);
        let d = 2.0 * (bx * cy - by * cx);
        if d == 0.0 {
            return None;
        }
        let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
        let (x, y) = ((cy * b2 - by * c2) / d, (bx * c2 - cx * b2) / d);
        Some(Circle { middle: [a[0] + x, a[1] + y], radius: x.hypot(y) })
    }
}

/// Corners of the convex hull (Andrew's chains).
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let turns =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let chain = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for &p in points {
            while chain.len() > 1 && turns(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut sorted.iter());
    hull.extend(chain(&mut sorted.iter().rev()));
    hull
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_circle_over_two_or_three_points_that_holds_all_is_smaller(
            points in prop::collection::vec([-50.0..50.0_f64, -50.0..50.0_f64], 2..12)
        ) {
            let (middle, radius) = smallest_circle(&points);
            let holds = |c: &Circle| points.iter().all(|p| {
                (p[0] - c.middle[0]).hypot(p[1] - c.middle[1]) <= c.radius + 1e-9
            });
            let found = Circle { middle, radius };
            prop_assert!(holds(&found));
            let n = points.len();
            let mut least = f64::INFINITY;
            for i in 0..n {
                for j in 0..n {
                    let pair = Circle::over(points[i], points[j]);
                    if holds(&pair) { least = least.min(pair.radius); }
                    for k in 0..n {
                        let Some(c) = Circle::through([points[i], points[j], points[k]]) else { continue };
                        if holds(&c) { least = least.min(c.radius); }
                    }
                }
            }
            prop_assert!((radius - least).abs() < 1e-6, "{radius} {least}");
        }
    }
}
