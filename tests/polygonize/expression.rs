//! Compiled fields written as arithmetic in Rust, for tests of what enclosures prove.

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::rc::Rc;
use std::sync::Arc;

use imp::engine::{CompiledField, Program};
use imp::graph::{Graph, NodeId, Op};

/// An expression in a graph.
#[derive(Clone)]
pub(crate) struct Expression {
    graph: Rc<RefCell<Graph>>,
    node: NodeId,
}

/// The field in so many dimensions that a closure makes of the coordinates.
pub(crate) fn compiled(
    dimension: usize,
    make: impl FnOnce(&[Expression]) -> Expression,
) -> CompiledField {
    let graph = Rc::new(RefCell::new(Graph::new()));
    let coordinates: Vec<Expression> = (0..dimension)
        .map(|axis| {
            let node = graph.borrow_mut().coordinate(axis);
            let graph = Rc::clone(&graph);
            Expression { graph, node }
        })
        .collect();
    let root = make(&coordinates).node;
    let program = Program::new(&graph.borrow(), &[root], dimension);
    CompiledField::new(Arc::new(program), Vec::new())
}

impl Expression {
    pub(crate) fn number(&self, number: f64) -> Expression {
        let node = self.graph.borrow_mut().constant(number);
        let graph = Rc::clone(&self.graph);
        Expression { graph, node }
    }

    pub(crate) fn apply(&self, op: Op, others: &[&Expression]) -> Expression {
        let mut operands = vec![self.node];
        operands.extend(others.iter().map(|other| other.node));
        let node = self.graph.borrow_mut().apply(op, &operands);
        let graph = Rc::clone(&self.graph);
        Expression { graph, node }
    }

    pub(crate) fn square(&self) -> Expression {
        self.apply(Op::Square, &[])
    }

    pub(crate) fn power(&self, exponent: i32) -> Expression {
        self.apply(Op::IntegerPower, &[&self.number(f64::from(exponent))])
    }

    pub(crate) fn sqrt(&self) -> Expression {
        self.apply(Op::SquareRoot, &[])
    }

    pub(crate) fn abs(&self) -> Expression {
        self.apply(Op::Abs, &[])
    }

    pub(crate) fn sine(&self) -> Expression {
        self.apply(Op::Sin, &[])
    }

    pub(crate) fn min(&self, other: &Expression) -> Expression {
        self.apply(Op::Min, &[other])
    }

    pub(crate) fn max(&self, other: &Expression) -> Expression {
        self.apply(Op::Max, &[other])
    }
}

/// An operator between expressions and numbers.
macro_rules! operator {
    ($name:ident, $method:ident, $op:expr) => {
        impl $name for Expression {
            type Output = Expression;
            fn $method(self, other: Expression) -> Expression {
                self.apply($op, &[&other])
            }
        }
        impl $name<f64> for Expression {
            type Output = Expression;
            fn $method(self, other: f64) -> Expression {
                self.apply($op, &[&self.number(other)])
            }
        }
        impl $name<Expression> for f64 {
            type Output = Expression;
            fn $method(self, other: Expression) -> Expression {
                other.number(self).apply($op, &[&other])
            }
        }
    };
}

operator!(Add, add, Op::Add);
operator!(Sub, sub, Op::Subtract);
operator!(Mul, mul, Op::Multiply);
operator!(Div, div, Op::Divide);

impl Neg for Expression {
    type Output = Expression;
    fn neg(self) -> Expression {
        self.apply(Op::Negate, &[])
    }
}
