//! The same code for several processors, chosen at run time.
//!
//! [`super::execute`] is compiled once for each set of processor features. Nothing in it is
//! reassociated or contracted, so the bits are the same; only the width of the vectors differs.

#![allow(unsafe_code)]

use super::bounds::{self, BoundsBlock};
use super::choices::{self, Pass};
use super::execute::{self, Columns};
use super::number::Number;
use crate::engine::tape::Tape;
use crate::graph::Interval;
use crate::graph::interval::Enclosure;
use std::sync::OnceLock;

/// The instruction sets that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kernels {
    /// What every processor of the architecture has: vectors of 128 bits.
    Baseline,
    /// AVX2 and FMA on x86-64: 256 bits.
    Avx2,
    /// AVX-512 F, VL, DQ and BW on x86-64: 512 bits.
    Avx512,
}

impl Kernels {
    /// All that there are, from the narrowest.
    pub const ALL: [Kernels; 3] = [Kernels::Baseline, Kernels::Avx2, Kernels::Avx512];

    /// The widest that this processor can execute.
    pub fn widest() -> Kernels {
        static WIDEST: OnceLock<Kernels> = OnceLock::new();
        *WIDEST.get_or_init(detect)
    }

    /// These or, if the processor cannot execute them, the widest that it can.
    pub fn or_narrower(self) -> Kernels {
        self.min(Kernels::widest())
    }
}

/// What the processor has.
fn detect() -> Kernels {
    #[cfg(target_arch = "x86_64")]
    {
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        let has_avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        match (has_avx2, has_avx512) {
            (true, true) => Kernels::Avx512,
            (true, false) => Kernels::Avx2,
            (false, _) => Kernels::Baseline,
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        Kernels::Baseline
    }
}

/// Makes a function that runs `$body` with these kernels or narrower ones, compiled for each.
macro_rules! dispatched {
    (
        $(#[$doc:meta])*
        $name:ident, $avx2:ident, $avx512:ident $(<$number:ident>)? =
        $body:path, $($argument:ident: $type:ty),+
    ) => {
        $(#[$doc])*
        pub(super) fn $name$(<$number: Number>)?(kernels: Kernels, $($argument: $type),+) {
            match kernels.or_narrower() {
                Kernels::Baseline => $body($($argument),+),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `or_narrower` gives `Avx2` only where `detect` has found its features.
                Kernels::Avx2 => unsafe { $avx2($($argument),+) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: `or_narrower` gives `Avx512` only where `detect` has found its features.
                Kernels::Avx512 => unsafe { $avx512($($argument),+) },
                #[cfg(not(target_arch = "x86_64"))]
                Kernels::Avx2 | Kernels::Avx512 => $body($($argument),+),
            }
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn $avx2$(<$number: Number>)?($($argument: $type),+) {
            $body($($argument),+);
        }

        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")]
        fn $avx512$(<$number: Number>)?($($argument: $type),+) {
            $body($($argument),+);
        }
    };
}

dispatched! {
    /// Runs the tape on all blocks of the columns, `group` at a time.
    run, run_avx2, run_avx512<N> = execute::run,
    tape: &Tape,
    group: usize,
    registers: &mut [N::Block],
    columns: &mut Columns<'_, '_, N>
}

dispatched! {
    /// Runs a tape over boxes and records what is decided.
    record, record_avx2, record_avx512 = choices::run,
    pass: &mut Pass<'_>
}

dispatched! {
    /// Makes blocks of boxes' sides.
    load, load_avx2, load_avx512 = bounds::load,
    blocks: &mut [BoundsBlock],
    sides: &[&[Interval]]
}

dispatched! {
    /// Copies enclosures out of a block.
    store, store_avx2, store_avx512 = bounds::store,
    enclosures: &mut [Enclosure],
    block: &BoundsBlock
}
