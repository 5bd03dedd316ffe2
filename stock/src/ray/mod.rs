//! Where a ray runs inside a moving body. A convex body that moves along a segment sweeps a convex one, so that a ray
//! has one interval in it.

pub(crate) mod capsule;
pub(crate) mod frustum;
pub(crate) mod swollen;
pub(crate) mod window;

/// Coordinates across the rays, then along them.
pub(crate) type Turned = [f64; 3];

#[inline]
pub(crate) fn dot(a: &Turned, b: &Turned) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn plus(a: &Turned, b: &Turned, times: f64) -> Turned {
    [a[0] + b[0] * times, a[1] + b[1] * times, a[2] + b[2] * times]
}

pub(crate) fn cross(a: &Turned, b: &Turned) -> Turned {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// An interval that grows by what is found to be inside of a convex set.
#[derive(Clone, Copy)]
pub(crate) struct Found {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Found {
    pub(crate) const NOTHING: Found = Found { low: f64::INFINITY, high: f64::NEG_INFINITY };

    #[inline]
    pub(crate) fn add(&mut self, t: f64) {
        self.low = self.low.min(t);
        self.high = self.high.max(t);
    }

    #[inline]
    pub(crate) fn interval(self) -> Option<[f64; 2]> {
        (self.low < self.high).then_some([self.low, self.high])
    }
}
