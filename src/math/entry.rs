//! From formulas to functions: one value, or a slice of lanes.

/// A function of one number.
pub(super) trait Unary<T: Copy> {
    /// The branch-free formula.
    fn fast(x: T) -> T;

    /// Whether the formula is good for x.
    #[inline(always)]
    fn is_fast(_: T) -> bool {
        true
    }

    /// The correctly rounded value, wherever the formula is not good.
    #[inline(always)]
    fn exact(x: T) -> T {
        Self::fast(x)
    }
}

/// A function of two numbers.
pub(super) trait Binary<T: Copy> {
    /// The branch-free formula.
    fn fast(a: T, b: T) -> T;

    /// Whether the formula is good for a and b.
    fn is_fast(a: T, b: T) -> bool;

    /// The correctly rounded value, wherever the formula is not good.
    fn exact(a: T, b: T) -> T;
}

/// The function of one number.
#[inline(always)]
pub(super) fn unary<F: Unary<T>, T: Copy>(x: T) -> T {
    if F::is_fast(x) {
        F::fast(x)
    } else {
        F::exact(x)
    }
}

/// The function of each number, as many as both slices have. The formula runs over all lanes
/// first; lanes for which it is not good are replaced afterwards.
#[inline(always)]
pub(super) fn map<F: Unary<T>, T: Copy>(out: &mut [T], x: &[T]) {
    let mut all_fast = true;
    for (out, &x) in out.iter_mut().zip(x) {
        *out = F::fast(x);
        all_fast &= F::is_fast(x);
    }
    if !all_fast {
        for (out, &x) in out.iter_mut().zip(x) {
            if !F::is_fast(x) {
                *out = F::exact(x);
            }
        }
    }
}

/// The function of two numbers.
#[inline(always)]
pub(super) fn binary<F: Binary<T>, T: Copy>(a: T, b: T) -> T {
    if F::is_fast(a, b) {
        F::fast(a, b)
    } else {
        F::exact(a, b)
    }
}

/// The function of each pair, as many as all slices have, like [`map`].
#[inline(always)]
pub(super) fn map_pairs<F: Binary<T>, T: Copy>(out: &mut [T], a: &[T], b: &[T]) {
    let mut all_fast = true;
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = F::fast(a, b);
        all_fast &= F::is_fast(a, b);
    }
    if !all_fast {
        for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
            if !F::is_fast(a, b) {
                *out = F::exact(a, b);
            }
        }
    }
}
