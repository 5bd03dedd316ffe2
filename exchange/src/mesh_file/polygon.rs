//! Plane polygons as triangles.

use claymill_nurbs::{Point2, Point3, Vector3};

/// Hollow polygons of more corners than this are refused: cutting ears takes up to the third power of their number.
const MOST_CORNERS: usize = 256;

/// The polygon as triangles. Convex ones are fanned, others lose one ear after the other.
pub(super) fn triangles(ring: &[Point3]) -> Result<Vec<[Point3; 3]>, String> {
    let fan = || (1..ring.len() - 1).map(|i| [ring[0], ring[i], ring[i + 1]]).collect();
    if ring.len() == 3 {
        return Ok(fan());
    }
    // Newell's normal: the sum over all corners seen from the first.
    let spokes: Vec<Vector3> = ring[1..].iter().map(|p| p - ring[0]).collect();
    let normal: Vector3 = spokes.windows(2).map(|w| w[0].cross(&w[1])).sum();
    let Some(normal) = normal.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite())) else {
        return Ok(fan());
    };
    let Some(x) = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).try_normalize(0.0) else {
        return Ok(fan());
    };
    let y = normal.cross(&x);
    let flat: Vec<Point2> =
        ring.iter().map(|p| p - ring[0]).map(|d| Point2::new(d.dot(&x), d.dot(&y))).collect();
    let count = flat.len();
    if (0..count).all(|i| turn(&flat[i], &flat[(i + 1) % count], &flat[(i + 2) % count]) >= 0.0) {
        return Ok(fan());
    }
    if count > MOST_CORNERS {
        return Err(format!("a polygon that is not convex has {count} corners, more than {MOST_CORNERS}"));
    }
    Ok(ears(&flat).into_iter().map(|t| t.map(|i| ring[i])).collect())
}

/// Twice the area of the triangle; positive where it turns left.
fn turn(a: &Point2, b: &Point2, c: &Point2) -> f64 {
    (b - a).perp(&(c - a))
}

/// Ears: corners that turn left, with no other corner inside. Where rounding leaves none, the sharpest left turn is
/// cut, so that no part of the polygon is lost.
fn ears(flat: &[Point2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut out = Vec::with_capacity(flat.len() - 2);
    let mut start = 0;
    while left.len() > 3 {
        let count = left.len();
        let corner = |i: usize| [left[(i + count - 1) % count], left[i % count], left[(i + 1) % count]];
        let is_ear = |i: &usize| {
            let [a, b, c] = corner(*i).map(|k| flat[k]);
            let inside =
                |p: &Point2| turn(&a, &b, p) >= 0.0 && turn(&b, &c, p) >= 0.0 && turn(&c, &a, p) >= 0.0;
            let others = left.iter().map(|k| &flat[*k]).filter(|p| **p != a && **p != b && **p != c);
            turn(&a, &b, &c) >= 0.0 && !others.into_iter().any(inside)
        };
        // Going on behind the last ear keeps long strips from becoming fans of needles.
        let found = (start..start + count).find(is_ear).map(|i| i % count);
        let ear = found.unwrap_or_else(|| {
            let area = |i: &usize| {
                let [a, b, c] = corner(*i).map(|k| flat[k]);
                turn(&a, &b, &c)
            };
            (0..count).max_by(|i, j| area(i).total_cmp(&area(j))).unwrap_or(0)
        });
        out.push(corner(ear));
        left.remove(ear);
        start = ear;
    }
    out.extend(<[usize; 3]>::try_from(left.as_slice()));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(triangles: &[[Point3; 3]]) -> f64 {
        triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum()
    }

    #[test]
    fn hollow_polygons_are_covered_once() {
        // A comb: teeth one wide and five high on a back one high, tilted in space.
        let mut outline = vec![(0.0, 0.0), (9.0, 0.0)];
        for k in (0..5).rev() {
            let x = 2.0 * f64::from(k);
            outline.extend([(x + 1.0, 6.0), (x, 6.0)]);
            if k > 0 {
                outline.extend([(x, 1.0), (x - 1.0, 1.0)]);
            }
        }
        for backwards in [false, true] {
            let mut ring: Vec<_> = outline.iter().map(|(x, y)| Point3::new(*x, 0.6 * y, 0.8 * y)).collect();
            if backwards {
                ring.reverse();
            }
            let found = triangles(&ring).unwrap();
            assert_eq!(found.len(), ring.len() - 2);
            approx::assert_abs_diff_eq!(area(&found), 9.0 + 25.0, epsilon = 1e-12);
        }
    }
}
