//! What an expression is worth in f64 or f32, node by node: IEEE operations of that type, the
//! engine's elementary functions, and f64 for what does not depend on the point.

use imp::graph::operation::value::is_algebraic_power;
use imp::graph::{Graph, Node, NodeId, Op};
use imp::math::{self, Elementary};
use std::fmt::LowerExp;

/// f64 or f32, as the reference needs it.
pub(crate) trait Real: Elementary + LowerExp {
    /// The nearest number of this type.
    fn of(value: f64) -> Self;
    /// The same number.
    fn wide(self) -> f64;
    /// The bits.
    fn bits(self) -> u64;
    /// The largest integer that is at most this.
    fn floor(self) -> Self;
    /// The smallest integer that is at least this.
    fn ceil(self) -> Self;

    /// Whether it is no number.
    fn is_nan(self) -> bool {
        self.wide().is_nan()
    }

    /// The same bits, or both NaN.
    fn same(self, other: Self) -> bool {
        self.bits() == other.bits() || (self.is_nan() && other.is_nan())
    }
}

macro_rules! real {
    ($real:ident) => {
        impl Real for $real {
            fn of(value: f64) -> Self {
                value as $real
            }

            fn wide(self) -> f64 {
                self.into()
            }

            fn bits(self) -> u64 {
                self.to_bits().into()
            }

            fn floor(self) -> Self {
                $real::floor(self)
            }

            fn ceil(self) -> Self {
                $real::ceil(self)
            }
        }
    };
}

real!(f64);
real!(f32);

/// The roots at a point.
pub(crate) fn evaluate<T: Real>(
    graph: &Graph,
    roots: &[NodeId],
    point: [T; 3],
    q: &[f64],
) -> Vec<T> {
    let mut values = vec![T::of(f64::NAN); graph.len()];
    // Of nodes that do not depend on the point, in full precision.
    let mut uniform = vec![None; graph.len()];
    for id in graph.reachable(roots) {
        let number = match graph.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            Node::Parameter(index) => Some(q[index as usize]),
            Node::Coordinate(_) => None,
            Node::Apply(op, operands) => {
                let [a, b, c] = operands.map(|operand| uniform[operand.index()]);
                (|| Some(op.value([a?, b?, c?])))()
            }
        };
        uniform[id.index()] = number;
        values[id.index()] = match (number, graph.node(id)) {
            (Some(number), _) => T::of(number),
            (None, Node::Coordinate(axis)) => point[usize::from(axis)],
            (None, Node::Apply(op, operands)) => {
                apply(op, operands.map(|operand| values[operand.index()]))
            }
            (None, _) => unreachable!(),
        };
    }
    roots.iter().map(|root| values[root.index()]).collect()
}

/// One operation.
fn apply<T: Real>(op: Op, [a, b, c]: [T; 3]) -> T {
    let [zero, one, nan] = [0.0, 1.0, f64::NAN].map(T::of);
    let truth = |holds: bool| if holds { one } else { zero };
    let is_negative = |a: T| a.wide().is_sign_negative();
    let undefined = a.is_nan() || b.is_nan();
    match op {
        Op::Add => a + b,
        Op::Subtract => a - b,
        Op::Multiply => a * b,
        Op::Divide => a / b,
        Op::Negate => -a,
        Op::Square => a * a,
        Op::SquareRoot => a.sqrt(),
        Op::Abs => a.abs(),
        Op::Floor => a.floor(),
        Op::Ceil => a.ceil(),
        Op::Min | Op::Max if undefined => nan,
        Op::Min if a < b || (a == b && is_negative(a)) => a,
        Op::Max if b < a || (a == b && is_negative(b)) => a,
        Op::Min | Op::Max => b,
        Op::Less => truth(a < b),
        Op::LessEqual => truth(a <= b),
        Op::Equal => truth(a == b),
        Op::IsNumber => truth(!a.is_nan()),
        Op::Select => {
            if a != zero {
                b
            } else {
                c
            }
        }
        Op::ChainProduct => {
            if a == zero || b == zero {
                zero
            } else {
                a * b
            }
        }
        Op::Sign => {
            if zero < a {
                one
            } else if a < zero {
                -one
            } else {
                a
            }
        }
        Op::Round => round(a),
        Op::Modulo => a - b * (a / b).floor(),
        Op::IntegerPower => integer_power(a, b.wide()),
        Op::Power if is_algebraic_power(b.wide()) => T::of(op.value([a.wide(), b.wide(), 0.0])),
        Op::Power => math::pow(a, b),
        Op::Hypot => math::hypot(a, b),
        Op::Atan2 => math::atan2(a + zero, b + zero),
        Op::Exp => math::exp(a),
        Op::Log => math::log(a),
        Op::Sin => math::sin(a),
        Op::Cos => math::cos(a),
        Op::Tan => math::tan(a),
        Op::Asin => math::asin(a),
        Op::Acos => math::acos(a),
        Op::Atan => math::atan(a),
        Op::Sinh => math::sinh(a),
        Op::Cosh => math::cosh(a),
        Op::Tanh => math::tanh(a),
    }
}

/// The nearest integer, halves away from zero.
fn round<T: Real>(a: T) -> T {
    let half = T::of(0.5);
    if a < T::of(0.0) {
        if half <= a.ceil() - a {
            a.floor()
        } else {
            a.ceil()
        }
    } else if half <= a - a.floor() {
        a.ceil()
    } else {
        a.floor()
    }
}

/// aⁿ, multiplied together from the squares that the digits of n name, least significant first.
fn integer_power<T: Real>(a: T, exponent: f64) -> T {
    let one = T::of(1.0);
    if a.is_nan() || exponent == 0.0 {
        return if a.is_nan() { a } else { one };
    }
    let mut digits = exponent.abs() as u32;
    let (mut square, mut product) = (a, None);
    while digits > 0 {
        if digits & 1 == 1 {
            product = Some(product.map_or(square, |product| product * square));
        }
        digits >>= 1;
        square = square * square;
    }
    let power = product.unwrap_or(one);
    if exponent < 0.0 { one / power } else { power }
}
