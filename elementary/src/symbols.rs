//! The names that the linker looks for.

/// Functions of one number.
macro_rules! of_one {
    ($number:ty: $($name:ident),*) => {
        $(#[unsafe(no_mangle)]
        extern "C" fn $name(x: $number) -> $number {
            libm::$name(x)
        })*
    };
}

/// Functions of two numbers.
macro_rules! of_two {
    ($number:ty: $($name:ident),*) => {
        $(#[unsafe(no_mangle)]
        extern "C" fn $name(x: $number, y: $number) -> $number {
            libm::$name(x, y)
        })*
    };
}

of_one!(f64: acos, acosh, asin, asinh, atan, atanh, cbrt, cos, cosh, exp, exp2, exp10, expm1);
of_one!(f64: log, log10, log1p, log2, sin, sinh, tan, tanh);
of_two!(f64: atan2, hypot, pow);
of_one!(f32: acosf, acoshf, asinf, asinhf, atanf, atanhf, cbrtf, cosf, coshf, expf, exp2f, exp10f, expm1f);
of_one!(f32: logf, log10f, log1pf, log2f, sinf, sinhf, tanf, tanhf);
of_two!(f32: atan2f, hypotf, powf);

/// Sine and cosine at once, as compilers ask for them where both are needed.
#[unsafe(no_mangle)]
extern "C" fn sincos(x: f64, sine: &mut f64, cosine: &mut f64) {
    (*sine, *cosine) = libm::sincos(x);
}

/// The same of single precision.
#[unsafe(no_mangle)]
extern "C" fn sincosf(x: f32, sine: &mut f32, cosine: &mut f32) {
    (*sine, *cosine) = libm::sincosf(x);
}
