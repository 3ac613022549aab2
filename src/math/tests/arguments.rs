//! Seeded arguments that cover where functions are used and where they are hard.

use super::functions::Unary;

/// The generator of G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA 2014.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(super) fn uniform(&mut self, (from, to): (f64, f64)) -> f64 {
        from + (to - from) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Of either sign, with the exponent uniform.
    pub(super) fn spread(&mut self, exponents: (f64, f64)) -> f64 {
        let exponent = self.uniform(exponents);
        let fraction = 1.0 + self.uniform((0.0, 1.0));
        let sign = if self.bits() & 1 == 0 { 1.0 } else { -1.0 };
        // In two factors, so that subnormal numbers occur too.
        let half = (exponent / 2.0).floor();
        sign * fraction * 2f64.powi(half as i32) * 2f64.powi((exponent - half) as i32)
    }

    /// A number that is off by a random power of two, down to 2⁻⁵², from one of the centres.
    pub(super) fn near(&mut self, centres: &[f64]) -> f64 {
        let centre = centres[self.bits() as usize % centres.len()];
        centre * (1.0 + self.spread((-53.0, -2.0)))
    }
}

/// The exponents of the numbers of a type.
pub(super) fn exponents(single: bool) -> (f64, f64) {
    if single {
        (-149.0, 127.9)
    } else {
        (-1074.0, 1023.9)
    }
}

/// The i-th argument of a function of one number.
pub(super) fn one(function: &Unary, index: usize, random: &mut Random, single: bool) -> f64 {
    match index % 6 {
        0 | 1 => random.uniform(function.usual),
        2 => random.uniform(function.wide),
        3 | 4 => random.near(function.centres),
        _ => random.spread(exponents(single)),
    }
}

/// The i-th pair of arguments of atan2 or hypot: all quadrants, near diagonals, far from them,
/// and anywhere.
pub(super) fn point(index: usize, random: &mut Random, single: bool) -> (f64, f64) {
    let (least, largest) = exponents(single);
    let middle = (least * 0.8, largest * 0.8);
    let y = random.uniform((-5.0, 5.0));
    match index % 4 {
        0 => (y, random.uniform((-5.0, 5.0))),
        1 => (y, random.near(&[y, -y, 2.0 * y, 0.5 * y])),
        2 => {
            let x = random.spread(middle);
            (x * random.spread((-60.0, 60.0)), x)
        }
        _ => (
            random.spread((least, largest)),
            random.spread((least, largest)),
        ),
    }
}

/// The i-th base and exponent of a power: usual ones, results over the full range from any base
/// and from bases near 1, integer powers of negative numbers, and anything.
pub(super) fn power(index: usize, random: &mut Random, single: bool) -> (f64, f64) {
    let logarithms = if single {
        (-104.0, 89.0)
    } else {
        (-745.0, 710.0)
    };
    let reach = |x: f64, random: &mut Random| (x, random.uniform(logarithms) / x.ln());
    match index % 5 {
        0 => (random.uniform((0.0, 10.0)), random.uniform((-10.0, 10.0))),
        1 => reach(random.spread(exponents(single)).abs(), random),
        2 => reach(random.near(&[1.0]), random),
        3 => {
            let y = random.uniform((-20.0, 20.0)).round();
            (random.uniform((-10.0, 10.0)), y)
        }
        _ => (
            random.spread(exponents(single)),
            random.spread((-20.0, 20.0)),
        ),
    }
}
