//! Elementary functions that give the same bits on every Linux machine.
//!
//! ```text
//!   f64::sin in any crate ─▶ the symbol `sin` ─▶ here, over the crate `libm`        not ─▶ libm.so.6 of the system
//! ```
//!
//! `f64::sin` and its like call the C library of the system. That library chooses its code by the processor, and its results change
//! from version to version in the last bit. Plans of one model on two machines would differ then, and parts of plans could not be
//! shared. This crate defines the functions under the names that the linker looks for, so that all code of a program calls these:
//! that of other crates too. `+ − × ÷ √` and fused products are exact by IEEE 754 and need nothing.
//!
//! A program takes the functions in by `use claymill_elementary as _;` in any of its crates. Nothing else changes:
//!
//! ```
//! use claymill_elementary as _;
//!
//! let x = std::hint::black_box(0.7_f64);
//! assert_eq!(x.sin().to_bits(), libm::sin(x).to_bits());
//! ```
//!
//! On other systems than Linux the crate is empty, and the functions stay those of the system.

#[cfg(target_os = "linux")]
mod symbols;

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::hint::black_box;

    #[test]
    fn the_standard_functions_are_those_of_the_crate() {
        for k in 1..2000 {
            let x = black_box(f64::from(k) * 3.7e-4);
            let pairs = [
                (x.sin(), libm::sin(x)),
                (x.cos(), libm::cos(x)),
                (x.sin_cos().0 + x.sin_cos().1, libm::sin(x) + libm::cos(x)),
                (x.tan(), libm::tan(x)),
                (x.acos(), libm::acos(x)),
                (x.atan2(0.3), libm::atan2(x, 0.3)),
                (x.hypot(0.3), libm::hypot(x, 0.3)),
                (x.exp(), libm::exp(x)),
                (x.ln(), libm::log(x)),
                (x.powf(1.7), libm::pow(x, 1.7)),
                (x.cbrt(), libm::cbrt(x)),
            ];
            for (standard, own) in pairs {
                assert!(standard.to_bits() == own.to_bits() || (standard.is_nan() && own.is_nan()), "{x}");
            }
        }
    }
}
