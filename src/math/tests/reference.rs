//! The functions to about 100 bits, as truth for the tests: Taylor series in doubled precision,
//! and one Newton step from the correctly rounded value where the inverse has a series.

use std::f64::consts::{FRAC_PI_2, LN_2};
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::super::double::{ordered_sum, product, sum};

/// An unevaluated sum of two numbers.
#[derive(Clone, Copy)]
pub(super) struct Wide {
    pub(super) high: f64,
    pub(super) low: f64,
}

const LN2: Wide = Wide {
    high: LN_2,
    low: 2.3190468138462996e-17,
};

fn wide(x: f64) -> Wide {
    Wide { high: x, low: 0.0 }
}

fn exact_product(a: f64, b: f64) -> Wide {
    let p = product(a, b);
    Wide {
        high: p.high,
        low: p.low,
    }
}

fn normalised(high: f64, low: f64) -> Wide {
    let s = ordered_sum(high, low);
    Wide {
        high: s.high,
        low: s.low,
    }
}

impl Add for Wide {
    type Output = Wide;

    fn add(self, other: Wide) -> Wide {
        let high = sum(self.high, other.high);
        let low = sum(self.low, other.low);
        let partial = ordered_sum(high.high, high.low + low.high);
        normalised(partial.high, partial.low + low.low)
    }
}

impl Neg for Wide {
    type Output = Wide;

    fn neg(self) -> Wide {
        Wide {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Wide {
    type Output = Wide;

    fn sub(self, other: Wide) -> Wide {
        self + -other
    }
}

impl Mul for Wide {
    type Output = Wide;

    fn mul(self, other: Wide) -> Wide {
        let p = exact_product(self.high, other.high);
        normalised(
            p.high,
            p.low + (self.high * other.low + self.low * other.high),
        )
    }
}

impl Div for Wide {
    type Output = Wide;

    fn div(self, other: Wide) -> Wide {
        let first = self.high / other.high;
        let rest = self - other * wide(first);
        let second = rest.high / other.high;
        let rest = rest - other * wide(second);
        normalised(first, second) + wide(rest.high / other.high)
    }
}

fn root(a: Wide) -> Wide {
    let first = a.high.sqrt();
    if first == 0.0 {
        return wide(0.0);
    }
    let rest = a - exact_product(first, first);
    normalised(first, rest.high / (2.0 * first))
}

/// (eʳ − 1, n) with w = n·ln 2 + r.
fn reduced_exponential(w: Wide) -> (Wide, i32) {
    let n = (w.high / LN_2).round();
    let r = w - LN2 * wide(n);
    let r = Wide {
        high: r.high / 256.0,
        low: r.low / 256.0,
    };
    let mut series = wide(1.0);
    for k in (2..16).rev() {
        series = wide(1.0) + series * r / wide(f64::from(k));
    }
    let mut less_one = series * r;
    for _ in 0..8 {
        less_one = less_one + less_one + less_one * less_one;
    }
    (less_one, n as i32)
}

fn exponential(w: Wide) -> Wide {
    let (less_one, n) = reduced_exponential(w);
    let value = less_one + wide(1.0);
    // In two factors, either of which is a normal number.
    let (half, rest) = (2f64.powi(n / 2), 2f64.powi(n - n / 2));
    Wide {
        high: value.high * half * rest,
        low: value.low * half * rest,
    }
}

/// e^w − 1, also for small w.
fn exponential_less_one(w: Wide) -> Wide {
    match reduced_exponential(w) {
        (less_one, 0) => less_one,
        _ => exponential(w) - wide(1.0),
    }
}

fn logarithm(x: f64) -> Wide {
    let (x, shift) = if x < 1e-300 {
        (x * 2f64.powi(100), 100)
    } else {
        (x, 0)
    };
    let k = (x.to_bits() >> 52) as i32 - 1023;
    let (m, k) = (x / 2f64.powi(k.min(1000)) / 2f64.powi(k - k.min(1000)), k);
    let (m, k) = if m > 1.4 { (m / 2.0, k + 1) } else { (m, k) };
    let guess = core_math::log(m);
    // m·e^(−guess) − 1 without cancellation.
    let d = wide(m) * exponential_less_one(wide(-guess)) + wide(m - 1.0);
    let correction = d - d * d * wide(0.5);
    LN2 * wide(f64::from(k - shift)) + (wide(guess) + correction)
}

/// Sine and cosine, for |x| up to 2²¹ or so.
fn sine_and_cosine(x: f64) -> (Wide, Wide) {
    let n = (x / FRAC_PI_2).round();
    let r = wide(x) - exact_product(n, FRAC_PI_2);
    let r = r - exact_product(n, 6.123233995736766e-17) - exact_product(n, -1.4973849048591833e-33);
    let square = r * r;
    let (mut sine, mut cosine) = (wide(1.0), wide(1.0));
    for k in (1..15).rev() {
        let k = f64::from(k);
        sine = wide(1.0) - sine * square / wide(2.0 * k * (2.0 * k + 1.0));
        cosine = wide(1.0) - cosine * square / wide(2.0 * k * (2.0 * k - 1.0));
    }
    let sine = sine * r;
    match (n as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// The angle of the point (x, y), by one Newton step from a guess.
fn angle(y: Wide, x: Wide, guess: f64) -> Wide {
    let (sine, cosine) = sine_and_cosine(guess);
    wide(guess) + (y * cosine - x * sine) / (x * cosine + y * sine)
}

/// √(1 − x²).
fn leg(x: f64) -> Wide {
    root((wide(1.0) - wide(x)) * (wide(1.0) + wide(x)))
}

pub(super) fn exp(x: f64) -> Wide {
    exponential(wide(x))
}

pub(super) fn log(x: f64) -> Wide {
    logarithm(x)
}

pub(super) fn sin(x: f64) -> Wide {
    sine_and_cosine(x).0
}

pub(super) fn cos(x: f64) -> Wide {
    sine_and_cosine(x).1
}

pub(super) fn tan(x: f64) -> Wide {
    let (sine, cosine) = sine_and_cosine(x);
    sine / cosine
}

pub(super) fn asin(x: f64) -> Wide {
    angle(wide(x), leg(x), core_math::asin(x))
}

pub(super) fn acos(x: f64) -> Wide {
    angle(leg(x), wide(x), core_math::acos(x))
}

pub(super) fn atan(x: f64) -> Wide {
    angle(wide(x), wide(1.0), core_math::atan(x))
}

pub(super) fn sinh(x: f64) -> Wide {
    let less_one = exponential_less_one(wide(x.abs()));
    (less_one + less_one / (less_one + wide(1.0))) * wide(0.5_f64.copysign(x))
}

pub(super) fn cosh(x: f64) -> Wide {
    let power = exponential(wide(x));
    (power + wide(1.0) / power) * wide(0.5)
}

pub(super) fn tanh(x: f64) -> Wide {
    let less_one = exponential_less_one(wide(2.0 * x));
    less_one / (less_one + wide(2.0))
}

pub(super) fn atan2(y: f64, x: f64) -> Wide {
    let scale = y.abs().max(x.abs());
    // A power of two near the larger one; dividing by it is exact or far below the result.
    let scale = f64::from_bits(scale.to_bits() & (0x7FF << 52));
    angle(wide(y / scale), wide(x / scale), core_math::atan2(y, x))
}

pub(super) fn pow(x: f64, y: f64) -> Wide {
    let magnitude = exponential(wide(y) * logarithm(x.abs()));
    let odd = y % 2.0 != 0.0;
    if x < 0.0 && odd {
        -magnitude
    } else {
        magnitude
    }
}

pub(super) fn hypot(a: f64, b: f64) -> Wide {
    let scale = a.abs().max(b.abs());
    let scale = f64::from_bits(scale.to_bits() & (0x7FF << 52));
    let (a, b) = (a / scale, b / scale);
    let unit = root(exact_product(a, a) + exact_product(b, b));
    Wide {
        high: unit.high * scale,
        low: unit.low * scale,
    }
}
