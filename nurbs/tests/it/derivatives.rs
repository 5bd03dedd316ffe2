//! Derivatives to the second order, of the surface itself and of its leaves: against polynomials whose derivatives
//! are known, at knots of every multiplicity and at the ends, and against differences on true splines.

use claymill_nurbs::{Jet, KnotVector, LANES, Leaves, NurbsSurface, Places, Point3, Shapes, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A polynomial in two variables, coefficient of `uⁱ vʲ` at `[i][j]`.
type Polynomial = Vec<Vec<f64>>;

/// Value, first and second derivatives of something at one place: `f, u, v, uu, uv, vv`.
type Series = [f64; 6];

fn random_polynomial(rng: &mut ChaCha8Rng, p: usize, q: usize, constant: f64, spread: f64) -> Polynomial {
    let mut c: Polynomial =
        (0..=p).map(|_| (0..=q).map(|_| rng.random_range(-spread..spread)).collect()).collect();
    c[0][0] += constant;
    c
}

fn series(c: &Polynomial, u: f64, v: f64) -> Series {
    let mut out = [0.0; 6];
    let power = |x: f64, n: usize, order: usize| match n.checked_sub(order) {
        Some(rest) => (0..order).map(|k| (n - k) as f64).product::<f64>() * x.powi(rest as i32),
        None => 0.0,
    };
    for (i, row) in c.iter().enumerate() {
        for (j, c) in row.iter().enumerate() {
            let orders = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];
            for (slot, (k, l)) in orders.into_iter().enumerate() {
                out[slot] += c * power(u, i, k) * power(v, j, l);
            }
        }
    }
    out
}

/// The quotient of two Taylor series, term by term.
fn quotient(f: &Series, w: &Series) -> Series {
    // Taylor coefficients carry halves where derivatives do not.
    let halves = [1.0, 1.0, 1.0, 0.5, 1.0, 0.5];
    let [f, w] = [f, w].map(|s| -> Series { std::array::from_fn(|k| s[k] * halves[k]) });
    let mut q = [0.0; 6];
    q[0] = f[0] / w[0];
    q[1] = (f[1] - q[0] * w[1]) / w[0];
    q[2] = (f[2] - q[0] * w[2]) / w[0];
    q[3] = (f[3] - q[0] * w[3] - q[1] * w[1]) / w[0];
    q[4] = (f[4] - q[0] * w[4] - q[1] * w[2] - q[2] * w[1]) / w[0];
    q[5] = (f[5] - q[0] * w[5] - q[2] * w[2]) / w[0];
    std::array::from_fn(|k| q[k] / halves[k])
}

/// The control value of a polynomial at `p` knots a direction: its polar form, in which `tᵏ` becomes the mean of all
/// products of `k` of the knots.
fn polar(c: &Polynomial, us: &[f64], vs: &[f64]) -> f64 {
    let means = |knots: &[f64]| -> Vec<f64> {
        let mut sums = vec![1.0];
        for (count, t) in knots.iter().enumerate() {
            sums.push(0.0);
            for k in (1..=count + 1).rev() {
                sums[k] += sums[k - 1] * t;
            }
        }
        let mut binomial = 1.0;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum /= binomial;
            binomial *= (knots.len() - k) as f64 / (k + 1) as f64;
        }
        sums
    };
    let (mu, mv) = (means(us), means(vs));
    c.iter().zip(&mu).map(|(row, a)| row.iter().zip(&mv).map(|(c, b)| c * a * b).sum::<f64>()).sum()
}

/// Knots on `[0, 1]` with an inner one of every multiplicity up to the degree.
fn knots(degree: usize) -> KnotVector {
    let mut all = vec![0.0; degree + 1];
    for multiplicity in 1..=degree {
        let at = (multiplicity as f64 - 0.3) / (degree as f64 + 0.4);
        all.extend(vec![at; multiplicity]);
    }
    all.extend(vec![1.0; degree + 1]);
    KnotVector::new(degree, all).unwrap()
}

/// The same knots and, unclamped, without their ends.
fn unclamped(degree: usize) -> KnotVector {
    let all = (0..2 * degree + 4).map(|i| i as f64 / (2 * degree + 3) as f64).collect();
    KnotVector::new(degree, all).unwrap()
}

fn spline(ku: &KnotVector, kv: &KnotVector, value: impl Fn(&[f64], &[f64]) -> [f64; 4]) -> NurbsSurface {
    let (p, q) = (ku.degree(), kv.degree());
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for i in 0..ku.point_count() {
        for j in 0..kv.point_count() {
            let [x, y, z, w] = value(&ku.as_slice()[i + 1..=i + p], &kv.as_slice()[j + 1..=j + q]);
            points.push(Point3::new(x / w, y / w, z / w));
            weights.push(w);
        }
    }
    NurbsSurface::new(ku.clone(), kv.clone(), points, Some(weights)).unwrap()
}

/// Places at every break, just beside it and between.
fn places(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let mut all = breaks.clone();
    for w in breaks.windows(2) {
        all.extend([0.01, 0.31, 0.5, 0.77].map(|x| w[0] + (w[1] - w[0]) * x));
    }
    all
}

fn parts(j: &Jet) -> [Vector3; 6] {
    [j.p.coords, j.su, j.sv, j.suu, j.suv, j.svv]
}

/// The jet at lane 3 of a batch.
fn batched(leaves: &Leaves, u: f64, v: f64) -> Jet {
    let mut shapes = [Shapes::default(); 1];
    let leaf = leaves.at(u, v);
    let at = |low: f64, high: f64, x: f64| {
        std::array::from_fn(|k| if k == 3 { x } else { low + (high - low) / LANES as f64 * k as f64 })
    };
    let places = Places { u: at(leaf.u().0, leaf.u().1, u), v: at(leaf.v().0, leaf.v().1, v) };
    leaf.shapes(&[places], &mut shapes);
    shapes[0].jet(3)
}

#[test]
fn polynomials_keep_their_derivatives_whatever_the_knots() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for p in 1..=7 {
        for (q, rational) in [(p, false), (p, true), (8 - p, false), (8 - p, true)] {
            for (ku, kv) in [(knots(p), knots(q)), (unclamped(p), knots(q)), (knots(p), unclamped(q))] {
                let mut coordinate = || random_polynomial(&mut rng, p, q, 0.0, 40.0);
                let xyz = [coordinate(), coordinate(), coordinate()];
                let w = random_polynomial(
                    &mut rng,
                    p,
                    q,
                    1.0,
                    if rational { 0.6 / ((p + 1) * (q + 1)) as f64 } else { 0.0f64.next_up() },
                );
                let surface = spline(&ku, &kv, |us, vs| {
                    let [x, y, z] = xyz.each_ref().map(|c| polar(c, us, vs));
                    [x, y, z, polar(&w, us, vs)]
                });
                assert_eq!(surface.is_rational(), rational);
                let leaves = Leaves::new(&surface);
                // What one unit of rounding of a control point does to a derivative.
                let size = xyz.iter().flatten().flatten().map(|c| c.abs()).sum::<f64>();
                let narrow = |k: &KnotVector| k.breaks().windows(2).map(|w| w[1] - w[0]).fold(1.0, f64::min);
                let (du, dv) = (p as f64 / narrow(&ku), q as f64 / narrow(&kv));
                let scale = [1.0, du, dv, du * du, du * dv, dv * dv];
                for &u in &places(&ku) {
                    for &v in &places(&kv) {
                        let below = series(&w, u, v);
                        let exact = xyz.each_ref().map(|c| quotient(&series(c, u, v), &below));
                        for (name, jet) in [
                            ("surface", surface.jet(u, v)),
                            ("leaf", leaves.jet(u, v)),
                            ("batch", batched(&leaves, u, v)),
                        ] {
                            for (k, part) in parts(&jet).iter().enumerate() {
                                for c in 0..3 {
                                    let off = (part[c] - exact[c][k]).abs() / (size * scale[k]);
                                    assert!(
                                        off < 2e-15,
                                        "{name} {p}x{q} rational {rational} at {u} {v}: part {k} off by {off:e}"
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// One-sided differences of the second order, toward the inside of a span.
fn differences(f: impl Fn(f64) -> Vector3, h: f64) -> [Vector3; 2] {
    let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(|k| f(k * h));
    [(b * 4.0 - a * 3.0 - c) / (2.0 * h), (a * 2.0 - b * 5.0 + c * 4.0 - d) / (h * h)]
}

#[test]
fn splines_with_jumps_agree_with_differences_from_the_side_that_counts() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for p in 1..=7 {
        for rational in [false, true] {
            let (ku, kv) = (knots(p), knots(8 - p));
            let count = (ku.point_count(), kv.point_count());
            let mut points = Vec::new();
            for i in 0..count.0 {
                for j in 0..count.1 {
                    let z = rng.random_range(-0.3..0.3);
                    points.push(Point3::new(i as f64 * 3.0, j as f64 * 2.0 + 0.5 * z, z));
                }
            }
            let weights = (0..points.len()).map(|_| rng.random_range(0.8..1.2)).collect();
            let surface =
                NurbsSurface::new(ku.clone(), kv.clone(), points, rational.then_some(weights)).unwrap();
            let leaves = Leaves::new(&surface);
            // A knot belongs to the span above it, the last one to the span below.
            let inward = |k: &KnotVector, t: f64| {
                let breaks = k.breaks();
                let span = breaks.partition_point(|&b| b <= t).clamp(1, breaks.len() - 1) - 1;
                let (a, b) = (breaks[span], breaks[span + 1]);
                let h = 1e-4 * (b - a);
                if t > 0.5 * (a + b) { -h } else { h }
            };
            for &u in &places(&ku) {
                for &v in &places(&kv) {
                    let leaf = leaves.at(u, v);
                    let (hu, hv) = (inward(&ku, u), inward(&kv, v));
                    // The surface's own evaluation cannot look at a span from its upper end.
                    let at = |a: f64, b: f64| leaf.jet(u + a, v + b).p.coords;
                    let [su, suu] = differences(|h| at(h, 0.0), hu);
                    let [sv, svv] = differences(|h| at(0.0, h), hv);
                    let cross = |h: f64| differences(|k| at(h, k), hv)[0];
                    let suv = differences(cross, hu)[0];
                    // How much derivatives may be: nets of 20 mm over the widths of the span.
                    let steep = [20.0 * 1e-4 / hu.abs(), 20.0 * 1e-4 / hv.abs()];
                    let bent = steep[0].max(steep[1]).powi(2);
                    for jet in [surface.jet(u, v), leaves.jet(u, v), batched(&leaves, u, v)] {
                        let close = |name: &str, found: Vector3, expected: Vector3, slack: f64| {
                            assert!(
                                (found - expected).norm() < slack,
                                "degree {p} rational {rational} at {u} {v}: {name} {found} {expected}"
                            );
                        };
                        close("Su", jet.su, su, 1e-5 * steep[0]);
                        close("Sv", jet.sv, sv, 1e-5 * steep[1]);
                        close("Suu", jet.suu, suu, 1e-3 * bent);
                        close("Suv", jet.suv, suv, 1e-3 * bent);
                        close("Svv", jet.svv, svv, 1e-3 * bent);
                    }
                }
            }
        }
    }
}

#[test]
fn leaves_are_the_surface_to_twelve_digits_at_every_degree() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for degree in [1, 2, 3, 4, 5, 6, 7, 8, 11, 15, 25] {
        // Smooth nets suit a power basis; wild ones of a high degree do not.
        for wild in [0.0, 0.02, 5.0] {
            for rational in [false, true] {
                for (stretch, offset) in [(1.0, 0.0), (1e-9, 0.0), (3e5, -1e6)] {
                    let knot = |t: f64| offset + stretch * t;
                    let of = |k: &KnotVector| {
                        KnotVector::new(k.degree(), k.as_slice().iter().map(|&t| knot(t)).collect()).unwrap()
                    };
                    let count = degree + 3;
                    let (ku, kv) = (
                        of(&KnotVector::clamped_uniform(degree, count)),
                        of(&KnotVector::clamped_uniform(degree, count)),
                    );
                    let (mut points, mut weights) = (Vec::new(), Vec::new());
                    for i in 0..count {
                        for j in 0..count {
                            let (x, y) = (i as f64 / count as f64, j as f64 / count as f64);
                            let mut noise = || rng.random_range(-1.0..1.0) * wild;
                            let smooth =
                                [60.0 * x, 50.0 * y, 20.0 * (1.3 * x).sin() + 15.0 * (1.7 * y).cos()];
                            let [x, y, z] = smooth.map(|c| c + noise());
                            points.push(Point3::new(4000.0 + x, y - 900.0, z));
                            weights.push(1.0 + 0.3 * noise().abs() / (wild + 1.0) + 0.2 * (x * y / 3000.0));
                        }
                    }
                    let surface = NurbsSurface::new(ku, kv, points, rational.then_some(weights)).unwrap();
                    let leaves = Leaves::new(&surface);
                    let n = degree as f64 * 3.0 / stretch;
                    let scale = [1.0, n, n, n * n, n * n, n * n];
                    for k in 0..100 {
                        let (u, v) =
                            (knot(rng.random()), knot(if k < 4 { f64::from(k) / 3.0 } else { rng.random() }));
                        let (a, b) = (leaves.jet(u, v), surface.jet(u, v));
                        assert_eq!(batched(&leaves, u, v), a, "one and eight are the same bits");
                        assert_eq!(leaves.point(u, v), a.p, "with derivatives or without");
                        for (k, (x, y)) in parts(&a).iter().zip(parts(&b)).enumerate() {
                            let off = (x - y).norm() / scale[k];
                            // Positions are 4 m from the origin, derivatives of a leaf of 60 mm.
                            let size = if k == 0 { 4000.0 } else { 60.0 + wild };
                            assert!(
                                off < 1e-12 * size,
                                "degree {degree} wild {wild} rational {rational} stretch {stretch}: part {k} off {off:e}"
                            );
                        }
                    }
                }
            }
        }
    }
}
