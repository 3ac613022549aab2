//! The functions of one f64, compiled for the processor that is there.
//!
//! The formulas need fused multiply-adds. Where the program is compiled for processors in general,
//! each would be a call of the C library; here a second version, for processors that have them,
//! is chosen at run time. The bits are the same.

#![allow(unsafe_code)]

/// Two versions of each function, and which one runs.
macro_rules! scalar_functions {
    ($($(#[$doc:meta])* $name:ident($($x:ident),+);)+) => {
        $(
            $(#[$doc])*
            pub fn $name($($x: f64),+) -> f64 {
                #[cfg(target_arch = "x86_64")]
                if is_x86_feature_detected!("fma") && is_x86_feature_detected!("avx2") {
                    // SAFETY: the processor has both features of the function.
                    return unsafe { fused::$name($($x),+) };
                }
                super::$name($($x),+)
            }
        )+

        #[cfg(target_arch = "x86_64")]
        mod fused {
            $(
                #[target_feature(enable = "avx2,fma")]
                pub(super) fn $name($($x: f64),+) -> f64 {
                    crate::math::$name($($x),+)
                }
            )+
        }
    };
}

scalar_functions! {
    /// [`exp`](super::exp) of a number.
    exp(x);
    /// [`log`](super::log) of a number.
    log(x);
    /// [`sin`](super::sin) of a number.
    sin(x);
    /// [`cos`](super::cos) of a number.
    cos(x);
    /// [`tan`](super::tan) of a number.
    tan(x);
    /// [`asin`](super::asin) of a number.
    asin(x);
    /// [`acos`](super::acos) of a number.
    acos(x);
    /// [`atan`](super::atan) of a number.
    atan(x);
    /// [`sinh`](super::sinh) of a number.
    sinh(x);
    /// [`cosh`](super::cosh) of a number.
    cosh(x);
    /// [`tanh`](super::tanh) of a number.
    tanh(x);
    /// [`atan2`](super::atan2) of a pair.
    atan2(y, x);
    /// [`pow`](super::pow) of a pair.
    pow(x, y);
    /// [`hypot`](super::hypot) of a pair.
    hypot(a, b);
}

/// [`exp`](super::exp) of each lane, as many as both slices have: the same bits as of one number.
pub fn exp_of_each(out: &mut [f64], x: &[f64]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("fma") && is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has both features of the function.
        unsafe { fused_exp_of_each(out, x) };
        return;
    }
    super::slice::exp(out, x);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn fused_exp_of_each(out: &mut [f64], x: &[f64]) {
    super::slice::exp(out, x);
}
