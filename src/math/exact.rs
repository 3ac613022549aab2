//! The correctly rounded functions, for arguments to which no fast formula applies.

/// Correctly rounded functions of one type, with this project's rule that NaN in any operand
/// gives NaN.
pub trait CorrectlyRounded: Copy {
    /// sin x.
    fn exact_sin(x: Self) -> Self;
    /// cos x.
    fn exact_cos(x: Self) -> Self;
    /// tan x.
    fn exact_tan(x: Self) -> Self;
    /// sinh x.
    fn exact_sinh(x: Self) -> Self;
    /// cosh x.
    fn exact_cosh(x: Self) -> Self;
    /// The angle of the point (x, y).
    fn exact_atan2(y: Self, x: Self) -> Self;
    /// xʸ.
    fn exact_pow(x: Self, y: Self) -> Self;
    /// √(a² + b²).
    fn exact_hypot(a: Self, b: Self) -> Self;
}

/// The two types differ in the names of the functions only.
macro_rules! correctly_rounded {
    ($float:ident: $sin:ident $cos:ident $tan:ident $sinh:ident $cosh:ident $atan2:ident
     $pow:ident $hypot:ident) => {
        impl CorrectlyRounded for $float {
            fn exact_sin(x: Self) -> Self {
                core_math::$sin(x)
            }

            fn exact_cos(x: Self) -> Self {
                core_math::$cos(x)
            }

            fn exact_tan(x: Self) -> Self {
                core_math::$tan(x)
            }

            fn exact_sinh(x: Self) -> Self {
                core_math::$sinh(x)
            }

            fn exact_cosh(x: Self) -> Self {
                core_math::$cosh(x)
            }

            fn exact_atan2(y: Self, x: Self) -> Self {
                core_math::$atan2(y, x)
            }

            fn exact_pow(x: Self, y: Self) -> Self {
                let nan = x.is_nan() || y.is_nan();
                if nan {
                    Self::NAN
                } else {
                    core_math::$pow(x, y)
                }
            }

            fn exact_hypot(a: Self, b: Self) -> Self {
                let nan = a.is_nan() || b.is_nan();
                if nan {
                    Self::NAN
                } else {
                    core_math::$hypot(a, b)
                }
            }
        }
    };
}

correctly_rounded!(f64: sin cos tan sinh cosh atan2 pow hypot);
correctly_rounded!(f32: sinf cosf tanf sinhf coshf atan2f powf hypotf);
