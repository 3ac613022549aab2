//! The table of operations.

use super::{
    Derivative, Instruction, MachineCode, Operation, Scaling, Value, lower, partial, value,
};
use crate::graph::interval::rule;
use crate::math::scalar;

/// Makes the list of operations and their table from one set of entries: the documentation and
/// the variant's name, then the other fields of [`Operation`].
macro_rules! operations {
    ($($(#[doc = $documentation:literal])+ $op:ident { $($rules:tt)+ })+) => {
        /// An operation; [`Op::operation`] is all that is known of it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Op {
            $($(#[doc = $documentation])+ $op,)+
        }

        impl Op {
            /// Every operation, in the table's order.
            pub const ALL: &'static [Op] = &[$(Op::$op),+];

            /// The value rule as a function with the platform's calling convention, for machine
            /// code to call. Operands beyond the arity are ignored.
            pub fn host_function(self) -> extern "C" fn(f64, f64, f64) -> f64 {
                match self {
                    $(Op::$op => {
                        extern "C" fn value(a: f64, b: f64, c: f64) -> f64 {
                            Op::$op.value([a, b, c])
                        }
                        value
                    })+
                }
            }
        }

        pub(super) static OPERATIONS: &[Operation] = &[$(
            Operation {
                documentation: concat!($($documentation),+).trim_ascii(),
                $($rules)+
            }
        ),+];
    };
}

operations! {
    /// The sum a + b.
    Add {
        name: "add",
        value: Value::Two(|a, b| a + b),
        interval: |a| rule::smooth(a, a[0].range + a[1].range),
        derivative: Derivative::Partials(&[partial::one, partial::one]),
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Add),
    }

    /// The difference a − b.
    Subtract {
        name: "subtract",
        value: Value::Two(|a, b| a - b),
        interval: |a| rule::smooth(a, a[0].range - a[1].range),
        derivative: Derivative::Partials(&[partial::one, partial::minus_one]),
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Subtract),
    }

    /// The product a·b.
    Multiply {
        name: "multiply",
        value: Value::Two(|a, b| a * b),
        interval: |a| rule::smooth(a, a[0].range * a[1].range),
        derivative: Derivative::Partials(&[partial::second_operand, partial::first_operand]),
        scaling: Scaling::Product,
        code: MachineCode::Native(Instruction::Multiply),
    }

    /// The quotient a/b.
    Divide {
        name: "divide",
        value: Value::Two(|a, b| a / b),
        interval: rule::divide,
        derivative: Derivative::Partials(&[|graph, [_, b, _], _| partial::reciprocal(graph, b), partial::divisor]),
        scaling: Scaling::Quotient,
        code: MachineCode::Native(Instruction::Divide),
    }

    /// The opposite −a.
    Negate {
        name: "negate",
        value: Value::One(|a| -a),
        interval: |a| rule::smooth(a, -a[0].range),
        derivative: Derivative::Partials(&[partial::minus_one]),
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Negate),
    }

    /// The square a²: what `multiply` of equal operands becomes.
    Square {
        name: "square",
        value: Value::One(|a| a * a),
        interval: |a| rule::smooth(a, a[0].range.square()),
        derivative: Derivative::Partials(&[partial::square]),
        scaling: Scaling::Power(2.0),
        code: MachineCode::Native(Instruction::Square),
    }

    /// The power a^b; small integer exponents by repeated multiplication.
    Power {
        name: "power",
        value: Value::Two(value::power),
        interval: rule::power,
        derivative: Derivative::Partials(&[partial::power_base, partial::power_exponent]),
        scaling: Scaling::PowerOfOperand,
        code: MachineCode::Host,
    }

    /// The power a^n, n a constant integer with |n| ≤ 1024, by repeated multiplication.
    IntegerPower {
        name: "integer_power",
        value: Value::Two(value::power),
        interval: rule::power,
        derivative: Derivative::Partials(&[partial::integer_power, partial::power_exponent]),
        scaling: Scaling::PowerOfOperand,
        code: MachineCode::Lower(lower::integer_power),
    }

    /// The square root √a.
    SquareRoot {
        name: "sqrt",
        value: Value::One(f64::sqrt),
        interval: |a| rule::within(a[0].range.low >= 0.0, a, a[0].range.square_root()),
        derivative: Derivative::Partials(&[partial::square_root]),
        scaling: Scaling::Power(0.5),
        code: MachineCode::Native(Instruction::SquareRoot),
    }

    /// The exponential function e^a.
    Exp {
        name: "exp",
        value: Value::One(scalar::exp),
        interval: |a| rule::smooth(a, a[0].range.exp()),
        derivative: Derivative::Partials(&[partial::result]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The natural logarithm of a.
    Log {
        name: "log",
        value: Value::One(scalar::log),
        interval: |a| rule::within(a[0].range.low > 0.0, a, a[0].range.log()),
        derivative: Derivative::Partials(&[|graph, [a, ..], _| partial::reciprocal(graph, a)]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The sine of a, in radians.
    Sin {
        name: "sin",
        value: Value::One(scalar::sin),
        interval: |a| rule::smooth(a, a[0].range.sin()),
        derivative: Derivative::Partials(&[|graph, [a, ..], _| graph.apply(Op::Cos, &[a])]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The cosine of a, in radians.
    Cos {
        name: "cos",
        value: Value::One(scalar::cos),
        interval: |a| rule::smooth(a, a[0].range.cos()),
        derivative: Derivative::Partials(&[partial::cos]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The tangent of a, in radians.
    Tan {
        name: "tan",
        value: Value::One(scalar::tan),
        interval: |a| rule::within(!a[0].range.has_tangent_pole(), a, a[0].range.tan()),
        derivative: Derivative::Partials(&[partial::tan]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The angle in [−π/2, π/2] whose sine is a.
    Asin {
        name: "asin",
        value: Value::One(scalar::asin),
        interval: |a| rule::within(a[0].range.abs().high <= 1.0, a, a[0].range.asin()),
        derivative: Derivative::Partials(&[partial::asin]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The angle in [0, π] whose cosine is a.
    Acos {
        name: "acos",
        value: Value::One(scalar::acos),
        interval: |a| rule::within(a[0].range.abs().high <= 1.0, a, a[0].range.acos()),
        derivative: Derivative::Partials(&[partial::acos]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The angle in [−π/2, π/2] whose tangent is a.
    Atan {
        name: "atan",
        value: Value::One(scalar::atan),
        interval: |a| rule::smooth(a, a[0].range.atan()),
        derivative: Derivative::Partials(&[partial::atan]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The angle in [−π, π] of the point (b, a) as seen from the origin.
    Atan2 {
        name: "atan2",
        value: Value::Two(value::atan2),
        interval: rule::atan2,
        derivative: Derivative::Partials(&[partial::atan2_first, partial::atan2_second]),
        scaling: Scaling::Invariant,
        code: MachineCode::Host,
    }

    /// The hyperbolic sine of a.
    Sinh {
        name: "sinh",
        value: Value::One(scalar::sinh),
        interval: |a| rule::smooth(a, a[0].range.sinh()),
        derivative: Derivative::Partials(&[|graph, [a, ..], _| graph.apply(Op::Cosh, &[a])]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The hyperbolic cosine of a.
    Cosh {
        name: "cosh",
        value: Value::One(scalar::cosh),
        interval: |a| rule::smooth(a, a[0].range.cosh()),
        derivative: Derivative::Partials(&[|graph, [a, ..], _| graph.apply(Op::Sinh, &[a])]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The hyperbolic tangent of a.
    Tanh {
        name: "tanh",
        value: Value::One(scalar::tanh),
        interval: |a| rule::smooth(a, a[0].range.tanh()),
        derivative: Derivative::Partials(&[partial::tanh]),
        scaling: Scaling::None,
        code: MachineCode::Host,
    }

    /// The absolute value |a|.
    Abs {
        name: "abs",
        value: Value::One(f64::abs),
        interval: |a| rule::smooth(a, a[0].range.abs()),
        derivative: Derivative::Partials(&[|graph, [a, ..], _| graph.apply(Op::Sign, &[a])]),
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Abs),
    }

    /// The sign of a: −1, 0 or 1.
    Sign {
        name: "sign",
        value: Value::One(value::sign),
        interval: |a| rule::steps(a, value::sign),
        derivative: Derivative::Zero,
        scaling: Scaling::Invariant,
        code: MachineCode::Lower(lower::sign),
    }

    /// The largest integer that is at most a.
    Floor {
        name: "floor",
        value: Value::One(f64::floor),
        interval: |a| rule::steps(a, f64::floor),
        derivative: Derivative::Zero,
        scaling: Scaling::None,
        code: MachineCode::Native(Instruction::Floor),
    }

    /// The smallest integer that is at least a.
    Ceil {
        name: "ceil",
        value: Value::One(f64::ceil),
        interval: |a| rule::steps(a, f64::ceil),
        derivative: Derivative::Zero,
        scaling: Scaling::None,
        code: MachineCode::Native(Instruction::Ceil),
    }

    /// The integer nearest to a, halves away from zero.
    Round {
        name: "round",
        value: Value::One(value::round),
        interval: |a| rule::steps(a, value::round),
        derivative: Derivative::Zero,
        scaling: Scaling::None,
        code: MachineCode::Lower(lower::round),
    }

    /// The floored remainder a − b·⌊a/b⌋, which has the sign of b.
    Modulo {
        name: "mod",
        value: Value::Two(value::modulo),
        interval: rule::modulo,
        derivative: Derivative::Partials(&[partial::one, partial::modulus]),
        scaling: Scaling::Shared,
        code: MachineCode::Lower(lower::modulo),
    }

    /// The smaller of a and b; NaN if either is.
    Min {
        name: "min",
        value: Value::Two(value::min),
        interval: |a| rule::smooth(a, a[0].range.min(a[1].range)),
        derivative: Derivative::Branch {
            condition: |graph, [a, b, _]| graph.apply(Op::LessEqual, &[a, b]),
            taken: 0,
            otherwise: 1,
        },
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Min),
    }

    /// The larger of a and b; NaN if either is.
    Max {
        name: "max",
        value: Value::Two(value::max),
        interval: |a| rule::smooth(a, a[0].range.max(a[1].range)),
        derivative: Derivative::Branch {
            condition: |graph, [a, b, _]| graph.apply(Op::LessEqual, &[b, a]),
            taken: 0,
            otherwise: 1,
        },
        scaling: Scaling::Shared,
        code: MachineCode::Native(Instruction::Max),
    }

    /// The length √(a² + b²).
    Hypot {
        name: "hypot",
        value: Value::Two(value::hypot),
        interval: |a| rule::smooth(a, a[0].range.hypot(a[1].range)),
        derivative: Derivative::Partials(&[
            |graph, [a, ..], result| partial::hypot(graph, a, result),
            |graph, [_, b, _], result| partial::hypot(graph, b, result),
        ]),
        scaling: Scaling::Shared,
        code: MachineCode::Host,
    }

    /// 1 where a < b, else 0.
    Less {
        name: "less",
        value: Value::Two(|a, b| value::truth(a < b)),
        interval: rule::less,
        derivative: Derivative::Zero,
        scaling: Scaling::Invariant,
        code: MachineCode::Native(Instruction::Less),
    }

    /// 1 where a ≤ b, else 0.
    LessEqual {
        name: "less_equal",
        value: Value::Two(|a, b| value::truth(a <= b)),
        interval: rule::less_equal,
        derivative: Derivative::Zero,
        scaling: Scaling::Invariant,
        code: MachineCode::Native(Instruction::LessEqual),
    }

    /// 1 where a = b, else 0.
    Equal {
        name: "equal",
        value: Value::Two(|a, b| value::truth(a == b)),
        interval: rule::equal,
        derivative: Derivative::Zero,
        scaling: Scaling::Invariant,
        code: MachineCode::Native(Instruction::Equal),
    }

    /// 1 where a is not NaN, else 0: what `equal` of equal operands becomes.
    IsNumber {
        name: "is_number",
        value: Value::One(|a| value::truth(!a.is_nan())),
        interval: rule::is_number,
        derivative: Derivative::Zero,
        scaling: Scaling::None,
        code: MachineCode::Native(Instruction::IsNumber),
    }

    /// b where a ≠ 0, else c; the other one's value does not matter.
    Select {
        name: "select",
        value: Value::Three(|a, b, c| if a != 0.0 { b } else { c }),
        interval: rule::select,
        derivative: Derivative::Branch {
            condition: |_, [condition, ..]| condition,
            taken: 1,
            otherwise: 2,
        },
        scaling: Scaling::Chosen,
        code: MachineCode::Native(Instruction::Select),
    }

    /// The chain rule's product a·b, in which an exact 0 absorbs infinity and NaN.
    ChainProduct {
        name: "chain_product",
        value: Value::Two(value::chain_product),
        interval: rule::chain_product,
        derivative: Derivative::Partials(&[partial::second_operand, partial::first_operand]),
        scaling: Scaling::Product,
        code: MachineCode::Native(Instruction::ChainProduct),
    }
}
