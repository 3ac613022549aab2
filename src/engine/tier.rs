//! The tiers: what can execute a kernel, and their names.

use super::Kernels;
use super::jit::vector;

/// What executes kernels. All give the same bits; they differ in what they cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tier {
    /// For each batch what is fastest: machine code for few points, blocks for many, and vectors
    /// where there have been very many.
    #[default]
    Automatic,
    /// Machine code made by Cranelift, point after point.
    MachineCode,
    /// Machine code in vectors of this instruction set's width or, where the processor lacks it, a
    /// narrower one: 128 bits by Cranelift, 256 and 512 by Imp itself.
    Vector(Kernels),
    /// Blocks of points, one operation after the other, by kernels for this instruction set or,
    /// where the processor lacks it, a narrower one.
    Block(Kernels),
    /// The reference interpreter; ten to forty times slower, on every platform.
    Interpreter,
}

impl Tier {
    /// Every tier with the name that it is chosen by.
    pub const ALL: [(&'static str, Tier); 9] = [
        ("automatic", Tier::Automatic),
        ("machine-code", Tier::MachineCode),
        ("vector-avx512", Tier::Vector(Kernels::Avx512)),
        ("vector-avx2", Tier::Vector(Kernels::Avx2)),
        ("vector-baseline", Tier::Vector(Kernels::Baseline)),
        ("block-avx512", Tier::Block(Kernels::Avx512)),
        ("block-avx2", Tier::Block(Kernels::Avx2)),
        ("block-baseline", Tier::Block(Kernels::Baseline)),
        ("interpreter", Tier::Interpreter),
    ];

    /// The tier of this name. `vector` and `block` alone are the widest that there are.
    pub fn named(name: &str) -> Option<Tier> {
        let is_meant =
            |&(other, _): &(&'static str, Tier)| other == name || Tier::short(other) == Some(name);
        let mut all = Tier::ALL.into_iter();
        all.find(is_meant).map(|(_, tier)| tier)
    }

    /// The shorter name, if there is one.
    pub fn short(name: &'static str) -> Option<&'static str> {
        name.strip_suffix("-avx512")
    }

    /// What evaluates many points without an interruption by compiling.
    pub(super) fn quick() -> Tier {
        let kernels = Kernels::widest();
        match vector::are_wide(kernels) {
            true => Tier::Vector(kernels),
            false => Tier::Block(kernels),
        }
    }

    /// The kernels for work that is always done in blocks.
    pub(super) fn kernels(self) -> Kernels {
        match self {
            Tier::Block(kernels) | Tier::Vector(kernels) => kernels.or_narrower(),
            _ => Kernels::widest(),
        }
    }
}
