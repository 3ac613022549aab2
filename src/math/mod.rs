//! Elementary functions: one definition for constants, scripts and every tier of the engine.
//!
//! Each function is a branch-free formula of IEEE operations, written once for f64 and f32, with
//! errors below 1 ulp. A loop of it over lanes is compiled to vector code by the caller's target
//! features, and the bits do not depend on them: fused multiply-adds are written out, nothing is
//! reassociated, and a processor without them computes the same bits slowly. Where a formula is
//! not good (circular functions of huge angles, powers of 0, hypotenuses that would overflow), the
//! correctly rounded function is called instead.
//!
//! The largest errors found, in units in the last place, for f32 over all arguments (of pairs, ten
//! million), for f64 over ten million arguments, usual, hard and arbitrary:
//!
//! | | f64 | f32 | | f64 | f32 |
//! | --- | --- | --- | --- | --- | --- |
//! | exp | 0.76 | 0.91 | atan | 0.72 | 0.74 |
//! | log | 0.65 | 0.68 | atan2 | 0.75 | 0.75 |
//! | sin | 0.73 | 0.75 | sinh | 0.84 | 0.80 |
//! | cos | 0.73 | 0.74 | cosh | 0.71 | 0.77 |
//! | tan | 0.85 | 0.88 | tanh | 0.69 | 0.73 |
//! | asin | 0.66 | 0.68 | pow | 0.77 | 0.77 |
//! | acos | 0.60 | 0.66 | hypot | 0.51 | 0.51 |
//!
//! The functions of this module take one value, those of [`mod@slice`] as many as there are. All are
//! `#[inline(always)]`, so that a caller with `#[target_feature]` gets code for its features. Those
//! of [`scalar`] are for callers without.
//! Special values are those of C99, except that NaN in any operand of [`pow`] or [`hypot`] gives
//! NaN. Which NaN (sign and payload) is not specified.

mod double;
mod entry;
mod exact;
mod exponential;
mod float;
mod functions;
mod hyperbolic;
mod inverse;
mod logarithm;
mod polynomial;
mod power;
pub mod scalar;
pub mod slice;
#[cfg(test)]
mod tests;
mod trigonometric;

pub use functions::{
    acos, asin, atan, atan2, cos, cosh, exp, hypot, log, pow, sin, sinh, tan, tanh,
};

/// A type that has the elementary functions: f64 or f32.
pub trait Elementary:
    exponential::Exponential
    + logarithm::Logarithm
    + trigonometric::Trigonometric
    + inverse::InverseTrigonometric
    + hyperbolic::Hyperbolic
    + power::Power
    + exact::CorrectlyRounded
{
}

impl Elementary for f64 {}
impl Elementary for f32 {}
