//! Polyline simplification by the Ramer–Douglas–Peucker algorithm.

/// The points that a polyline needs to stay within `tolerance` of what it was (Ramer 1972, Douglas and Peucker
/// 1973): first and last always, and wherever a chord is too far off, the point that is farthest from it.
pub(super) fn simplified(points: &[[f32; 3]], tolerance: f32) -> Vec<[f32; 3]> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let last = points.len() - 1;
    let mut kept = vec![false; points.len()];
    (kept[0], kept[last]) = (true, true);
    let mut waiting = vec![(0, last)];
    while let Some((a, b)) = waiting.pop() {
        let distances = (a + 1..b).map(|i| (i, distance2(&points[i], &points[a], &points[b])));
        let farthest = distances.max_by(|x, y| x.1.total_cmp(&y.1));
        if let Some((i, d2)) = farthest
            && d2 > tolerance * tolerance
        {
            kept[i] = true;
            waiting.extend([(a, i), (i, b)]);
        }
    }
    points.iter().zip(kept).filter_map(|(p, kept)| kept.then_some(*p)).collect()
}

/// Squared distance from the segment `ab`.
fn distance2(p: &[f32; 3], a: &[f32; 3], b: &[f32; 3]) -> f32 {
    let dot = |u: &[f32; 3], v: &[f32; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let from = |p: &[f32; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (chord, q) = (from(b), from(p));
    let length2 = dot(&chord, &chord);
    let t = if length2 > 0.0 { (dot(&q, &chord) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let off = [q[0] - t * chord[0], q[1] - t * chord[1], q[2] - t * chord[2]];
    dot(&off, &off)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_is_farther_off_than_the_tolerance_and_straight_parts_cost_two_points() {
        let curve: Vec<[f32; 3]> = (0..2000)
            .map(|i| {
                let t = i as f32 * 0.01;
                [100.0 * t, if t > 10.0 { 40.0 * (t - 10.0).sin() } else { 0.0 }, 3.0 * (0.3 * t).cos()]
            })
            .collect();
        for tolerance in [0.05, 0.5, 5.0] {
            let kept = simplified(&curve, tolerance);
            let off = |p: &[f32; 3]| {
                kept.windows(2).map(|ab| distance2(p, &ab[0], &ab[1])).fold(f32::INFINITY, f32::min).sqrt()
            };
            let worst = curve.iter().map(off).fold(0.0, f32::max);
            assert!(worst <= tolerance + 1e-3, "{worst} > {tolerance}");
            assert!(kept.len() < curve.len() / 5, "{} points kept at {tolerance}", kept.len());
        }
        let straight: Vec<[f32; 3]> = (0..500).map(|i| [i as f32, 2.0 * i as f32, 0.0]).collect();
        assert_eq!(simplified(&straight, 0.01).len(), 2);
        assert_eq!(simplified(&straight[..1], 0.01).len(), 1);
    }
}
