//! The inner loops of leaf evaluation: Horner's rule in the power basis, or Bernstein polynomials
//! where that would lose digits, then the quotient rule and the fundamental forms.

use super::Leaf;
use super::arithmetic::Arithmetic;
use crate::MAX_DEGREE;

/// Position and derivatives, per coordinate.
#[derive(Clone, Copy)]
pub(super) struct Derivatives<R> {
    pub(super) p: [R; 3],
    pub(super) su: [R; 3],
    pub(super) sv: [R; 3],
    pub(super) suu: [R; 3],
    pub(super) suv: [R; 3],
    pub(super) svv: [R; 3],
}

/// Unit normal, `E F G` and `L M N`.
#[derive(Clone, Copy)]
pub(super) struct Forms<R> {
    pub(super) n: [R; 3],
    pub(super) first: [R; 3],
    pub(super) second: [R; 3],
}

/// Value, `∂u`, `∂u²`, `∂v`, `∂u∂v`, `∂v²` of one coordinate.
type Jet<R> = [R; 6];

// Closures and iterators over registers are left out below: what is not inlined for certain would be compiled
// without the machine's wide registers.

/// The derivatives of a leaf at `(u, v)`.
#[inline(always)]
pub(super) fn derivatives<A: Arithmetic>(a: A, leaf: &Leaf, u: A::Real, v: A::Real) -> Derivatives<A::Real> {
    let Some(powers) = &leaf.powers else {
        return project(a, leaf, bernstein(a, leaf, u, v));
    };
    let s = a.sub(u, a.all(leaf.middle.0));
    let t = a.sub(v, a.all(leaf.middle.1));
    let homogeneous = match leaf.degree[1] {
        1 => coordinates::<A, 2>(a, leaf, powers, s, t),
        2 => coordinates::<A, 3>(a, leaf, powers, s, t),
        3 => coordinates::<A, 4>(a, leaf, powers, s, t),
        4 => coordinates::<A, 5>(a, leaf, powers, s, t),
        5 => coordinates::<A, 6>(a, leaf, powers, s, t),
        6 => coordinates::<A, 7>(a, leaf, powers, s, t),
        7 => coordinates::<A, 8>(a, leaf, powers, s, t),
        _ => coordinates::<A, 0>(a, leaf, powers, s, t),
    };
    project(a, leaf, homogeneous)
}

/// The point of a leaf at `(u, v)`.
#[inline(always)]
pub(super) fn point<A: Arithmetic>(a: A, leaf: &Leaf, u: A::Real, v: A::Real) -> [A::Real; 3] {
    let Some(powers) = &leaf.powers else {
        return derivatives(a, leaf, u, v).p;
    };
    let s = a.sub(u, a.all(leaf.middle.0));
    let t = a.sub(v, a.all(leaf.middle.1));
    let [x, y, z, w] = match leaf.degree[1] {
        3 => values::<A, 4>(a, leaf, powers, s, t),
        _ => values::<A, 0>(a, leaf, powers, s, t),
    };
    let inverse = if leaf.rational { a.div(a.all(1.0), w) } else { a.all(1.0) };
    let o = &leaf.origin;
    [
        a.add(a.mul(x, inverse), a.all(o.x)),
        a.add(a.mul(y, inverse), a.all(o.y)),
        a.add(a.mul(z, inverse), a.all(o.z)),
    ]
}

/// Horner's rule without derivatives; `M` columns, any number if 0.
#[inline(always)]
fn values<A: Arithmetic, const M: usize>(
    a: A,
    leaf: &Leaf,
    powers: &[f64],
    s: A::Real,
    t: A::Real,
) -> [A::Real; 4] {
    let columns = if M == 0 { leaf.degree[1] + 1 } else { M };
    let mut out = [a.all(0.0); 4];
    for (value, powers) in out.iter_mut().zip(powers.chunks_exact((leaf.degree[0] + 1) * columns)) {
        for row in powers.chunks_exact(columns).rev() {
            let mut inner = a.all(0.0);
            for &c in row.iter().rev() {
                inner = a.mul_add(inner, t, a.all(c));
            }
            *value = a.mul_add(*value, s, inner);
        }
    }
    out
}

/// Horner's rule for each coordinate; `M` columns, any number if 0.
#[inline(always)]
fn coordinates<A: Arithmetic, const M: usize>(
    a: A,
    leaf: &Leaf,
    powers: &[f64],
    s: A::Real,
    t: A::Real,
) -> [Jet<A::Real>; 4] {
    let mut out = [[a.all(0.0); 6]; 4];
    if M == 0 {
        let columns = leaf.degree[1] + 1;
        for (jet, powers) in out.iter_mut().zip(powers.chunks_exact((leaf.degree[0] + 1) * columns)) {
            *jet = across_long(a, powers, columns, s, t);
        }
        return out;
    }
    let (rows, _) = powers.as_chunks::<M>();
    let count = leaf.degree[0] + 1;
    let of = |k: usize| rows.get(k * count..(k + 1) * count).unwrap_or_default();
    out[0] = across(a, of(0), s, t);
    out[1] = across(a, of(1), s, t);
    out[2] = across(a, of(2), s, t);
    if leaf.rational {
        out[3] = across(a, of(3), s, t);
    }
    out
}

/// Value, slope and half the second derivative of a polynomial by Horner's rule, highest power last. The first
/// steps, where derivatives are still zero, are left out.
#[inline(always)]
fn along<A: Arithmetic, const M: usize>(a: A, row: &[f64; M], t: A::Real) -> [A::Real; 3] {
    let zero = a.all(0.0);
    let (mut value, mut slope, mut bend) = (a.all(row[M - 1]), zero, zero);
    if M > 1 {
        slope = value;
        value = a.mul_add(value, t, a.all(row[M - 2]));
    }
    if M > 2 {
        bend = slope;
        slope = a.mul_add(slope, t, value);
        value = a.mul_add(value, t, a.all(row[M - 3]));
    }
    for k in 3..M {
        bend = a.mul_add(bend, t, slope);
        slope = a.mul_add(slope, t, value);
        value = a.mul_add(value, t, a.all(row[M - 1 - k]));
    }
    [value, slope, bend]
}

/// Horner's rule over rows that are polynomials in `v`, highest power last.
#[inline(always)]
fn across<A: Arithmetic, const M: usize>(a: A, rows: &[[f64; M]], s: A::Real, t: A::Real) -> Jet<A::Real> {
    let zero = a.all(0.0);
    let Some((last, rows)) = rows.split_last() else { return [zero; 6] };
    let [mut p, mut dv, mut dvv] = along(a, last, t);
    let (mut du, mut duv, mut duu) = (zero, zero, zero);
    let Some((last, rows)) = rows.split_last() else { return [p, du, duu, dv, duv, a.add(dvv, dvv)] };
    let [value, slope, bend] = along(a, last, t);
    (du, p) = (p, a.mul_add(p, s, value));
    (duv, dv) = (dv, a.mul_add(dv, s, slope));
    dvv = a.mul_add(dvv, s, bend);
    if let Some((last, rows)) = rows.split_last() {
        let [value, slope, bend] = along(a, last, t);
        (duu, du, p) = (du, a.mul_add(du, s, p), a.mul_add(p, s, value));
        (duv, dv) = (a.mul_add(duv, s, dv), a.mul_add(dv, s, slope));
        dvv = a.mul_add(dvv, s, bend);
        for row in rows.iter().rev() {
            let [value, slope, bend] = along(a, row, t);
            duu = a.mul_add(duu, s, du);
            du = a.mul_add(du, s, p);
            p = a.mul_add(p, s, value);
            duv = a.mul_add(duv, s, dv);
            dv = a.mul_add(dv, s, slope);
            dvv = a.mul_add(dvv, s, bend);
        }
    }
    [p, du, a.add(duu, duu), dv, duv, a.add(dvv, dvv)]
}

/// The same for any number of columns.
#[inline(always)]
fn across_long<A: Arithmetic>(a: A, powers: &[f64], columns: usize, s: A::Real, t: A::Real) -> Jet<A::Real> {
    let [mut p, mut du, mut duu, mut dv, mut duv, mut dvv] = [a.all(0.0); 6];
    for row in powers.chunks_exact(columns).rev() {
        let [mut value, mut slope, mut bend] = [a.all(0.0); 3];
        for &c in row.iter().rev() {
            bend = a.mul_add(bend, t, slope);
            slope = a.mul_add(slope, t, value);
            value = a.mul_add(value, t, a.all(c));
        }
        duu = a.mul_add(duu, s, du);
        du = a.mul_add(du, s, p);
        p = a.mul_add(p, s, value);
        duv = a.mul_add(duv, s, dv);
        dv = a.mul_add(dv, s, slope);
        dvv = a.mul_add(dvv, s, bend);
    }
    [p, du, a.add(duu, duu), dv, duv, a.add(dvv, dvv)]
}

/// From homogeneous to plain derivatives (The NURBS Book, eq. 4.20), and back to the model's origin.
#[inline(always)]
fn project<A: Arithmetic>(a: A, leaf: &Leaf, [x, y, z, w]: [Jet<A::Real>; 4]) -> Derivatives<A::Real> {
    let mut plain = [x, y, z];
    if leaf.rational {
        let inverse = a.div(a.all(1.0), w[0]);
        let (twice_u, twice_v) = (a.add(w[1], w[1]), a.add(w[3], w[3]));
        for c in &mut plain {
            let p = a.mul(c[0], inverse);
            let du = a.mul(a.less_product(p, w[1], c[1]), inverse);
            let dv = a.mul(a.less_product(p, w[3], c[3]), inverse);
            let duu = a.less_product(p, w[2], a.less_product(du, twice_u, c[2]));
            let duv = a.less_product(p, w[4], a.less_product(dv, w[1], a.less_product(du, w[3], c[4])));
            let dvv = a.less_product(p, w[5], a.less_product(dv, twice_v, c[5]));
            *c = [p, du, a.mul(duu, inverse), dv, a.mul(duv, inverse), a.mul(dvv, inverse)];
        }
    }
    let [x, y, z] = plain;
    let o = &leaf.origin;
    Derivatives {
        p: [a.add(x[0], a.all(o.x)), a.add(y[0], a.all(o.y)), a.add(z[0], a.all(o.z))],
        su: [x[1], y[1], z[1]],
        sv: [x[3], y[3], z[3]],
        suu: [x[2], y[2], z[2]],
        suv: [x[4], y[4], z[4]],
        svv: [x[5], y[5], z[5]],
    }
}

/// Unit normal and fundamental forms; not numbers where `Su × Sv` vanishes.
#[inline(always)]
pub(super) fn forms<A: Arithmetic>(a: A, d: &Derivatives<A::Real>) -> Forms<A::Real> {
    let (su, sv) = (&d.su, &d.sv);
    let normal = [minor(a, su, sv, 1, 2), minor(a, su, sv, 2, 0), minor(a, su, sv, 0, 1)];
    let inverse = a.div(a.all(1.0), a.sqrt(dot(a, &normal, &normal)));
    let n = [a.mul(normal[0], inverse), a.mul(normal[1], inverse), a.mul(normal[2], inverse)];
    Forms {
        n,
        first: [dot(a, su, su), dot(a, su, sv), dot(a, sv, sv)],
        second: [dot(a, &d.suu, &n), dot(a, &d.suv, &n), dot(a, &d.svv, &n)],
    }
}

#[inline(always)]
fn dot<A: Arithmetic>(a: A, x: &[A::Real; 3], y: &[A::Real; 3]) -> A::Real {
    a.mul_add(x[2], y[2], a.mul_add(x[1], y[1], a.mul(x[0], y[0])))
}

/// `x[i] y[j] − x[j] y[i]`.
#[inline(always)]
fn minor<A: Arithmetic>(a: A, x: &[A::Real; 3], y: &[A::Real; 3], i: usize, j: usize) -> A::Real {
    a.less_product(x[j], y[i], a.mul(x[i], y[j]))
}

/// The homogeneous derivatives from the Bernstein polynomials: for leaves that a power basis does not suit.
#[inline(always)]
fn bernstein<A: Arithmetic>(a: A, leaf: &Leaf, u: A::Real, v: A::Real) -> [Jet<A::Real>; 4] {
    let (bu, bv) = (basis(a, leaf.degree[0], leaf.u, u), basis(a, leaf.degree[1], leaf.v, v));
    let zero = a.all(0.0);
    let mut out = [[zero; 6]; 4];
    for (i, row) in leaf.net.chunks_exact(leaf.degree[1] + 1).enumerate() {
        for c in 0..if leaf.rational { 4 } else { 3 } {
            let mut inner = [zero; 3];
            for (j, h) in row.iter().enumerate() {
                for k in 0..3 {
                    inner[k] = a.mul_add(bv[k][j], a.all(h[c]), inner[k]);
                }
            }
            let jet = &mut out[c];
            for (slot, k, l) in [(0, 0, 0), (1, 1, 0), (2, 2, 0), (3, 0, 1), (4, 1, 1), (5, 0, 2)] {
                jet[slot] = a.mul_add(bu[k][i], inner[l], jet[slot]);
            }
        }
    }
    out
}

/// The Bernstein polynomials on an interval and their first two derivatives.
#[inline(always)]
fn basis<A: Arithmetic>(
    a: A,
    n: usize,
    (low, high): (f64, f64),
    at: A::Real,
) -> [[A::Real; MAX_DEGREE + 1]; 3] {
    let zero = a.all(0.0);
    let scale = 1.0 / (high - low);
    let x = a.mul(a.sub(at, a.all(low)), a.all(scale));
    let rest = a.mul(a.sub(a.all(high), at), a.all(scale));
    let mut powers = [[a.all(1.0); MAX_DEGREE + 1]; 2];
    for k in 1..=n {
        powers[0][k] = a.mul(powers[0][k - 1], x);
        powers[1][k] = a.mul(powers[1][k - 1], rest);
    }
    // The derivative of degree n comes from the polynomials of degree n - 1.
    let mut out = [[zero; MAX_DEGREE + 1]; 3];
    let mut factor = 1.0;
    for order in 0..=n.min(2) {
        let m = n - order;
        let mut binomial = factor;
        for i in 0..=m {
            let b = a.mul(a.mul(powers[0][i], powers[1][m - i]), a.all(binomial));
            binomial *= (m - i) as f64 / (i + 1) as f64;
            match order {
                0 => out[0][i] = b,
                1 => {
                    out[1][i] = a.sub(out[1][i], b);
                    out[1][i + 1] = b;
                }
                _ => {
                    out[2][i] = a.add(out[2][i], b);
                    out[2][i + 1] = a.less_product(a.all(2.0), b, out[2][i + 1]);
                    out[2][i + 2] = b;
                }
            }
        }
        factor *= m as f64 * scale;
    }
    out
}
