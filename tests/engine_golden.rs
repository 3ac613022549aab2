//! The intermediate forms that `imp dump` prints, for a field small enough to be read.

use imp::engine::Program;
use imp::graph::{Graph, Op};

/// exp(−a·x²) − min(y, √a): a product of parameters, a host function, a choice.
fn program() -> Program {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let a = graph.parameter(6);
    let square = graph.apply(Op::Square, &[x]);
    let product = graph.apply(Op::Multiply, &[a, square]);
    let exponent = graph.apply(Op::Negate, &[product]);
    let gaussian = graph.apply(Op::Exp, &[exponent]);
    let limit = graph.apply(Op::SquareRoot, &[a]);
    let smaller = graph.apply(Op::Min, &[y, limit]);
    let root = graph.apply(Op::Subtract, &[gaussian, smaller]);
    Program::new(&graph, &[root], 2)
}

#[test]
fn graph_text_is_readable() {
    insta::assert_snapshot!(program().graph_text());
}

#[test]
fn clif_is_the_same_on_every_machine() {
    insta::assert_snapshot!(program().clif());
}
