//! The table of kernels: every instruction of a tape, with its formula.
//!
//! A kernel is an operation of the graph or several fused into one, so that what is between them
//! stays in processor registers. Each operation of a fused kernel rounds as it does alone: the
//! bits are the same. A kernel has one instruction per shape, which says whether an operand is
//! lanes or a scalar, the same number for all points.

use super::choices::{self, Choice};
use super::execute::{Block, Scalar, Sources};
use super::number::{LANES, Number};
use crate::engine::tape::Instruction;
use crate::graph::Op;

/// What is known of an instruction's code.
#[derive(Clone, Copy, Debug)]
pub(in crate::engine) struct Facts {
    /// The kernel; none of `Splat`.
    pub(in crate::engine) kernel: Option<Kernel>,
    /// How many operands it has.
    pub(in crate::engine) arity: usize,
    /// Bit k is set if operand k is a scalar; the bits of those beyond the arity are the first's.
    pub(in crate::engine) scalars: u8,
    /// The kind of choice that it is, if any.
    pub(in crate::engine) choice: Option<Choice>,
}

impl Facts {
    /// From the operands' kinds.
    const fn new(kernel: Option<Kernel>, kinds: &[Kind]) -> Facts {
        let mut scalars = 0;
        let mut place = 0;
        while place < 3 {
            let kind = if place < kinds.len() {
                kinds[place]
            } else {
                kinds[0]
            };
            if let Kind::Scalar = kind {
                scalars |= 1 << place;
            }
            place += 1;
        }
        let choice = match kernel {
            Some(kernel) => choices::choice(kernel),
            None => None,
        };
        Facts {
            kernel,
            arity: kinds.len(),
            scalars,
            choice,
        }
    }
}

/// What an operand is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine) enum Kind {
    /// A number for every point.
    Lanes,
    /// One number for all points.
    Scalar,
}

/// The pattern of a kind.
macro_rules! kind {
    (lanes) => {
        Kind::Lanes
    };
    (scalar) => {
        Kind::Scalar
    };
}

/// The place of an operand.
macro_rules! place {
    (a) => {
        0
    };
    (b) => {
        1
    };
    (c) => {
        2
    };
}

/// The type of an operand's block.
macro_rules! block {
    (lanes) => {
        Block<'_, N>
    };
    (scalar) => {
        Scalar<N>
    };
}

/// Makes the list of kernels, that of their instructions, and the function that executes one.
macro_rules! kernels {
    (
        operations { $($operation:ident = $rule:expr, as
            $($variant:ident($($argument:ident: $sort:ident),+)),+;)+ }
        functions_of_one { $($one:ident)+ }
        functions_of_two { $($two:ident)+ }
        functions_with_scalar { $($with:ident($whole:ident) = $function:ident;)+ }
        fused { $($kernel:ident = $formula:expr, as
            $($code:ident($($operand:ident: $kind:ident),+)),+;)+ }
    ) => {
        /// A kernel, whatever its operands are; its formula in the table says what it computes.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(in crate::engine) enum Kernel {
            $($operation,)+
            $($one,)+
            $($two,)+
            $($kernel,)+
        }

        /// An instruction: a kernel for operands of certain kinds, or `Splat`, which makes lanes of
        /// a scalar.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub(in crate::engine) enum Code {
            $($($variant,)+)+
            $($one,)+
            $($two,)+
            $($with,)+
            $($($code,)+)+
            Splat,
        }

        /// The facts of every code, in the codes' order.
        static FACTS: &[Facts] = &[
            $($(Facts::new(Some(Kernel::$operation), &[$(kind!($sort)),+]),)+)+
            $(Facts::new(Some(Kernel::$one), &[Kind::Lanes]),)+
            $(Facts::new(Some(Kernel::$two), &[Kind::Lanes, Kind::Lanes]),)+
            $(Facts::new(Some(Kernel::$whole), &[Kind::Lanes, Kind::Scalar]),)+
            $($(Facts::new(Some(Kernel::$kernel), &[$(kind!($kind)),+]),)+)+
            Facts::new(None, &[Kind::Scalar]),
        ];

        /// What an instruction gives for single numbers; those beyond its arity are ignored.
        pub(in crate::engine) fn single<N: Number>(code: Code, operands: [N; 3]) -> N {
            match code {
                $($(Code::$variant => {
                    $(let $argument = operands[place!($argument)];)+
                    $rule
                })+)+
                $(Code::$one => N::function(Op::$one, operands),)+
                $(Code::$two => N::function(Op::$two, operands),)+
                $(Code::$with => N::function(Op::$whole, operands),)+
                $($(Code::$code => {
                    $(let $operand = operands[place!($operand)];)+
                    $formula
                })+)+
                Code::Splat => operands[0],
            }
        }

        impl From<Op> for Kernel {
            fn from(op: Op) -> Kernel {
                match op {
                    $(Op::$operation => Kernel::$operation,)+
                    $(Op::$one => Kernel::$one,)+
                    $(Op::$two => Kernel::$two,)+
                }
            }
        }

        impl Kernel {
            /// The instruction for operands of these kinds, if there is one. There is one for
            /// operands that are all lanes.
            pub(in crate::engine) fn code(self, kinds: &[Kind]) -> Option<Code> {
                match (self, kinds) {
                    $($((Kernel::$operation, [$(kind!($sort)),+]) => Some(Code::$variant),)+)+
                    $((Kernel::$one, [Kind::Lanes]) => Some(Code::$one),)+
                    $((Kernel::$two, [Kind::Lanes, Kind::Lanes]) => Some(Code::$two),)+
                    $((Kernel::$whole, [Kind::Lanes, Kind::Scalar]) => Some(Code::$with),)+
                    $($((Kernel::$kernel, [$(kind!($kind)),+]) => Some(Code::$code),)+)+
                    _ => None,
                }
            }
        }

        /// The loop of every instruction over the lanes of a block. These are functions because
        /// arguments, so the compiler may assume, do not overlap; and no closures, because those
        /// it may leave as calls.
        #[allow(non_snake_case)]
        mod loops {
            use super::{Block, LANES, Number, Scalar};

            $($(
                #[inline(always)]
                pub(super) fn $variant<N: Number>(out: &mut N::Block, $($argument: block!($sort)),+) {
                    for lane in 0..LANES {
                        $(let $argument = $argument.lane(lane);)+
                        N::set(out, lane, $rule);
                    }
                }
            )+)+
            $($(
                #[inline(always)]
                pub(super) fn $code<N: Number>(out: &mut N::Block, $($operand: block!($kind)),+) {
                    for lane in 0..LANES {
                        $(let $operand = $operand.lane(lane);)+
                        N::set(out, lane, $formula);
                    }
                }
            )+)+
        }

        /// Executes one instruction on as many blocks as `out` has.
        #[inline(always)]
        pub(super) fn execute<N: Number>(
            instruction: &Instruction,
            out: &mut [N::Block],
            sources: &Sources<'_, N>,
        ) {
            match instruction.code {
                $($(Code::$variant => {
                    $(let $argument = sources.$sort(instruction.$argument);)+
                    for (block, out) in out.iter_mut().enumerate() {
                        $(let $argument = $argument.block(block);)+
                        loops::$variant::<N>(out, $($argument),+);
                    }
                })+)+
                $($(Code::$code => {
                    $(let $operand = sources.$kind(instruction.$operand);)+
                    for (block, out) in out.iter_mut().enumerate() {
                        $(let $operand = $operand.block(block);)+
                        loops::$code::<N>(out, $($operand),+);
                    }
                })+)+
                Code::Splat => out.fill(sources.scalar(instruction.a).0.splat()),
                $(Code::$one => {
                    let a = sources.lanes(instruction.a);
                    for (block, out) in out.iter_mut().enumerate() {
                        N::function_of_one(Op::$one, out, a.block(block).0);
                    }
                })+
                $(Code::$two => {
                    let a = sources.lanes(instruction.a);
                    let b = sources.lanes(instruction.b);
                    for (block, out) in out.iter_mut().enumerate() {
                        N::function_of_two(Op::$two, out, a.block(block).0, b.block(block).0);
                    }
                })+
                $(Code::$with => {
                    let a = sources.lanes(instruction.a);
                    let b = sources.scalar(instruction.b).0;
                    for (block, out) in out.iter_mut().enumerate() {
                        N::$function(out, a.block(block).0, b);
                    }
                })+
            }
        }
    };
}

impl Code {
    /// What is known of it.
    #[inline(always)]
    pub(in crate::engine) fn facts(self) -> &'static Facts {
        &FACTS[self as usize]
    }
}

kernels! {
    operations {
        Add = a.add(b), as Add(a: lanes, b: lanes), AddScalar(a: lanes, b: scalar);
        Subtract = a.subtract(b), as
            Subtract(a: lanes, b: lanes),
            SubtractScalar(a: lanes, b: scalar),
            SubtractFromScalar(a: scalar, b: lanes);
        Multiply = a.multiply(b), as
            Multiply(a: lanes, b: lanes),
            MultiplyScalar(a: lanes, b: scalar);
        Divide = a.divide(b), as
            Divide(a: lanes, b: lanes),
            DivideByScalar(a: lanes, b: scalar),
            DivideScalar(a: scalar, b: lanes);
        Negate = a.negate(), as Negate(a: lanes);
        Square = a.square(), as Square(a: lanes);
        SquareRoot = a.square_root(), as SquareRoot(a: lanes);
        Abs = a.absolute(), as Abs(a: lanes);
        Floor = a.round_down(), as Floor(a: lanes);
        Ceil = a.round_up(), as Ceil(a: lanes);
        Min = a.smaller(b), as Min(a: lanes, b: lanes), MinScalar(a: lanes, b: scalar);
        Max = a.larger(b), as Max(a: lanes, b: lanes), MaxScalar(a: lanes, b: scalar);
        Less = a.less(b), as
            Less(a: lanes, b: lanes),
            LessThanScalar(a: lanes, b: scalar),
            ScalarLess(a: scalar, b: lanes);
        LessEqual = a.less_equal(b), as
            LessEqual(a: lanes, b: lanes),
            LessEqualScalar(a: lanes, b: scalar),
            ScalarLessEqual(a: scalar, b: lanes);
        Equal = a.equal(b), as Equal(a: lanes, b: lanes), EqualScalar(a: lanes, b: scalar);
        IsNumber = a.is_number(), as IsNumber(a: lanes);
        Select = a.select(b, c), as
            Select(a: lanes, b: lanes, c: lanes),
            SelectScalar(a: lanes, b: scalar, c: lanes),
            SelectElseScalar(a: lanes, b: lanes, c: scalar),
            SelectScalars(a: lanes, b: scalar, c: scalar);
        ChainProduct = a.chain_product(b), as
            ChainProduct(a: lanes, b: lanes),
            ChainProductScalar(a: lanes, b: scalar);
    }
    functions_of_one { Exp Log Sin Cos Tan Asin Acos Atan Sinh Cosh Tanh Sign Round }
    functions_of_two { Power IntegerPower Atan2 Hypot Modulo }
    functions_with_scalar {
        IntegerPowerScalar(IntegerPower) = integer_power;
        ModuloScalar(Modulo) = modulo;
    }
    fused {
        MultiplyAdd = a.multiply(b).add(c), as
            MultiplyAdd(a: lanes, b: lanes, c: lanes),
            MultiplyScalarAdd(a: lanes, b: scalar, c: lanes),
            MultiplyAddScalar(a: lanes, b: lanes, c: scalar),
            MultiplyScalarAddScalar(a: lanes, b: scalar, c: scalar);
        MultiplySubtract = a.multiply(b).subtract(c), as
            MultiplySubtract(a: lanes, b: lanes, c: lanes),
            MultiplyScalarSubtract(a: lanes, b: scalar, c: lanes),
            MultiplySubtractScalar(a: lanes, b: lanes, c: scalar),
            MultiplyScalarSubtractScalar(a: lanes, b: scalar, c: scalar);
        SubtractProduct = c.subtract(a.multiply(b)), as
            SubtractProduct(a: lanes, b: lanes, c: lanes),
            SubtractScalarProduct(a: lanes, b: scalar, c: lanes),
            SubtractProductFromScalar(a: lanes, b: lanes, c: scalar),
            SubtractScalarProductFromScalar(a: lanes, b: scalar, c: scalar);
        SquareAdd = a.square().add(b), as
            SquareAdd(a: lanes, b: lanes),
            SquareAddScalar(a: lanes, b: scalar);
        SquaredDifference = a.subtract(b).square(), as
            SquaredDifference(a: lanes, b: lanes),
            SquaredDifferenceScalar(a: lanes, b: scalar);
        SquaredDifferenceAdd = a.subtract(b).square().add(c), as
            SquaredDifferenceAdd(a: lanes, b: lanes, c: lanes),
            SquaredDifferenceScalarAdd(a: lanes, b: scalar, c: lanes);
        RootSubtract = a.square_root().subtract(b), as
            RootSubtract(a: lanes, b: lanes),
            RootSubtractScalar(a: lanes, b: scalar);
        RootSubtractMin = a.square_root().subtract(b).smaller(c), as
            RootSubtractMin(a: lanes, b: lanes, c: lanes),
            RootSubtractScalarMin(a: lanes, b: scalar, c: lanes);
        SubtractMin = a.subtract(b).smaller(c), as
            SubtractMin(a: lanes, b: lanes, c: lanes),
            SubtractScalarMin(a: lanes, b: scalar, c: lanes),
            SubtractFromScalarMin(a: scalar, b: lanes, c: lanes);
        SubtractMax = a.subtract(b).larger(c), as
            SubtractMax(a: lanes, b: lanes, c: lanes),
            SubtractScalarMax(a: lanes, b: scalar, c: lanes),
            SubtractFromScalarMax(a: scalar, b: lanes, c: lanes);
        MaxMin = a.larger(b).smaller(c), as MaxMin(a: lanes, b: lanes, c: lanes);
        MinMax = a.smaller(b).larger(c), as MinMax(a: lanes, b: lanes, c: lanes);
        MinOfThree = a.smaller(b).smaller(c), as MinOfThree(a: lanes, b: lanes, c: lanes);
        MaxOfThree = a.larger(b).larger(c), as MaxOfThree(a: lanes, b: lanes, c: lanes);
        NegateMax = a.negate().larger(b), as
            NegateMax(a: lanes, b: lanes),
            NegateMaxScalar(a: lanes, b: scalar);
        ChainProductAdd = a.chain_product(b).add(c), as
            ChainProductAdd(a: lanes, b: lanes, c: lanes),
            ChainProductScalarAdd(a: lanes, b: scalar, c: lanes);
    }
}
