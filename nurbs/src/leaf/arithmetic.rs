//! One arithmetic for single numbers and SIMD registers, so that one formula serves both and all
//! widths give the same bits.

use pulp::Simd;

/// Arithmetic on one or several numbers at a time, so that one and the same formula serves a single point and
/// eight side by side. Every operation rounds once, products and sums together where the machine fuses them:
/// all widths give the same bits.
pub(super) trait Arithmetic: Copy {
    /// The numbers.
    type Real: Copy;
    fn all(self, x: f64) -> Self::Real;
    fn add(self, a: Self::Real, b: Self::Real) -> Self::Real;
    fn sub(self, a: Self::Real, b: Self::Real) -> Self::Real;
    fn mul(self, a: Self::Real, b: Self::Real) -> Self::Real;
    fn div(self, a: Self::Real, b: Self::Real) -> Self::Real;
    fn sqrt(self, a: Self::Real) -> Self::Real;
    /// `a b + c`.
    fn mul_add(self, a: Self::Real, b: Self::Real, c: Self::Real) -> Self::Real;
    /// `c − a b`.
    fn less_product(self, a: Self::Real, b: Self::Real, c: Self::Real) -> Self::Real;
}

/// As many numbers as a register of the machine holds.
#[derive(Clone, Copy)]
pub(super) struct Wide<S>(pub(super) S);

impl<S: Simd> Arithmetic for Wide<S> {
    type Real = S::f64s;

    #[inline(always)]
    fn all(self, x: f64) -> S::f64s {
        self.0.splat_f64s(x)
    }
    #[inline(always)]
    fn add(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.add_f64s(a, b)
    }
    #[inline(always)]
    fn sub(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.sub_f64s(a, b)
    }
    #[inline(always)]
    fn mul(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.mul_f64s(a, b)
    }
    #[inline(always)]
    fn div(self, a: S::f64s, b: S::f64s) -> S::f64s {
        self.0.div_f64s(a, b)
    }
    #[inline(always)]
    fn sqrt(self, a: S::f64s) -> S::f64s {
        self.0.sqrt_f64s(a)
    }
    #[inline(always)]
    fn mul_add(self, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        self.0.mul_add_e_f64s(a, b, c)
    }
    #[inline(always)]
    fn less_product(self, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        self.0.negate_mul_add_e_f64s(a, b, c)
    }
}

/// One number; `FUSED` where the registers of the machine fuse products and sums.
#[derive(Clone, Copy)]
pub(super) struct Single<const FUSED: bool>;

impl<const FUSED: bool> Arithmetic for Single<FUSED> {
    type Real = f64;

    #[inline(always)]
    fn all(self, x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn add(self, a: f64, b: f64) -> f64 {
        a + b
    }
    #[inline(always)]
    fn sub(self, a: f64, b: f64) -> f64 {
        a - b
    }
    #[inline(always)]
    fn mul(self, a: f64, b: f64) -> f64 {
        a * b
    }
    #[inline(always)]
    fn div(self, a: f64, b: f64) -> f64 {
        a / b
    }
    #[inline(always)]
    fn sqrt(self, a: f64) -> f64 {
        a.sqrt()
    }
    #[inline(always)]
    fn mul_add(self, a: f64, b: f64, c: f64) -> f64 {
        if FUSED { a.mul_add(b, c) } else { a * b + c }
    }
    #[inline(always)]
    fn less_product(self, a: f64, b: f64, c: f64) -> f64 {
        if FUSED { (-a).mul_add(b, c) } else { c - a * b }
    }
}
