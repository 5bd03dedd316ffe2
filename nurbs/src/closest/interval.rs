//! Interval arithmetic without directed rounding: users leave a margin far above rounding.

use std::ops::{Add, Mul, Sub};

/// A range of reals. Rounding is not directed: every user leaves a margin far above rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    pub(super) lo: f64,
    pub(super) hi: f64,
}

impl Interval {
    /// The hull of `values`.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let start = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
        values.into_iter().fold(start, |r, x| Interval { lo: r.lo.min(x), hi: r.hi.max(x) })
    }

    /// Range of squares.
    pub(super) fn squared(self) -> Self {
        let nearest = self.lo.max(-self.hi).max(0.0);
        let farthest = self.magnitude();
        Interval { lo: nearest * nearest, hi: farthest * farthest }
    }

    /// Largest absolute value.
    pub(super) fn magnitude(self) -> f64 {
        self.hi.max(-self.lo)
    }

    /// Range of quotients by a range of positive numbers.
    pub(super) fn over_positive(self, divisor: Interval) -> Self {
        self * Interval { lo: 1.0 / divisor.hi, hi: 1.0 / divisor.lo }
    }

    /// The sign that all of the range has, else 0.
    pub(super) fn sign(self) -> i8 {
        i8::from(self.lo > 0.0) - i8::from(self.hi < 0.0)
    }

    pub(super) fn width(self) -> f64 {
        self.hi - self.lo
    }
}

/// Range of the scalar product of vectors from two boxes.
pub(super) fn dot(a: &[Interval; 3], b: &[Interval; 3]) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Add for Interval {
    type Output = Interval;
    fn add(self, o: Interval) -> Interval {
        Interval { lo: self.lo + o.lo, hi: self.hi + o.hi }
    }
}

impl Sub for Interval {
    type Output = Interval;
    fn sub(self, o: Interval) -> Interval {
        Interval { lo: self.lo - o.hi, hi: self.hi - o.lo }
    }
}

impl Sub<f64> for Interval {
    type Output = Interval;
    fn sub(self, x: f64) -> Interval {
        Interval { lo: self.lo - x, hi: self.hi - x }
    }
}

impl Mul for Interval {
    type Output = Interval;
    fn mul(self, o: Interval) -> Interval {
        let (a, b, c, d) = (self.lo * o.lo, self.lo * o.hi, self.hi * o.lo, self.hi * o.hi);
        Interval { lo: a.min(b).min(c.min(d)), hi: a.max(b).max(c.max(d)) }
    }
}
