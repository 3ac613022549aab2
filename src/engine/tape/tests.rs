use super::*;
use crate::engine::block::{self, Kernels};
use crate::engine::{interpret, lower};
use crate::graph::{Graph, NodeId, Op};
use std::collections::BTreeSet;

/// splitmix64 (Steele et al. 2014), below a bound.
fn below(state: &mut u64, bound: usize) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) % bound as u64) as usize
}

/// A tree of the operations that fuse, so that most results are used once.
fn tree(graph: &mut Graph, state: &mut u64, depth: usize) -> NodeId {
    const OPERATIONS: [Op; 10] = [
        Op::Add,
        Op::Subtract,
        Op::Multiply,
        Op::ChainProduct,
        Op::Min,
        Op::Max,
        Op::Square,
        Op::SquareRoot,
        Op::Negate,
        Op::Subtract,
    ];
    if depth == 0 || below(state, 6) == 0 {
        return match below(state, 6) {
            0 => graph.parameter(0),
            1 => graph.constant(0.5),
            2 => graph.constant(-1.75),
            axis => graph.coordinate(axis - 3),
        };
    }
    let op = OPERATIONS[below(state, OPERATIONS.len())];
    let operands: Vec<NodeId> = (0..op.arity())
        .map(|_| tree(graph, state, depth - 1))
        .collect();
    graph.apply(op, &operands)
}

#[test]
fn every_fused_instruction_occurs_and_has_the_bits_of_its_operations() {
    const POINT: [f64; 3] = [0.3, -0.0, 1.25];
    let mut state = 1;
    let mut codes = BTreeSet::new();
    for _ in 0..20_000 {
        let mut graph = Graph::new();
        let root = tree(&mut graph, &mut state, 5);
        let lowered = lower::lower(&graph, &[root], 3, 1);
        let tape = assemble(&lowered);
        codes.extend(
            tape.instructions
                .iter()
                .map(|instruction| format!("{:?}", instruction.code)),
        );
        let mut scalars = interpret::uniforms(&lowered, &[-0.625]);
        scalars.extend(&tape.constants);
        let mut expected = f64::NAN;
        interpret::evaluate(&lowered, &POINT, &scalars, &mut Vec::new(), |_, value| {
            expected = value;
        });
        let [x, y, z] = POINT.map(|coordinate| [coordinate]);
        let mut found = [0.0];
        let columns: [&[f64]; 3] = [&x, &y, &z];
        let outputs = &mut [&mut found[..]];
        assert!(block::run(
            &tape,
            Kernels::widest(),
            1,
            &columns,
            &scalars,
            outputs
        ));
        assert!(
            found[0].to_bits() == expected.to_bits() || (found[0].is_nan() && expected.is_nan()),
            "{} instead of {expected}: {tape:?}",
            found[0]
        );
    }
    let fused = [
        "MultiplyAdd",
        "MultiplyScalarAdd",
        "MultiplyAddScalar",
        "MultiplyScalarAddScalar",
        "MultiplySubtract",
        "MultiplyScalarSubtract",
        "MultiplySubtractScalar",
        "MultiplyScalarSubtractScalar",
        "SubtractProduct",
        "SubtractScalarProduct",
        "SubtractProductFromScalar",
        "SubtractScalarProductFromScalar",
        "SquareAdd",
        "SquareAddScalar",
        "SquaredDifference",
        "SquaredDifferenceScalar",
        "SquaredDifferenceAdd",
        "SquaredDifferenceScalarAdd",
        "RootSubtract",
        "RootSubtractScalar",
        "RootSubtractMin",
        "RootSubtractScalarMin",
        "SubtractMin",
        "SubtractScalarMin",
        "SubtractFromScalarMin",
        "SubtractMax",
        "SubtractScalarMax",
        "SubtractFromScalarMax",
        "MaxMin",
        "MinMax",
        "MinOfThree",
        "MaxOfThree",
        "NegateMax",
        "NegateMaxScalar",
        "ChainProductAdd",
        "ChainProductScalarAdd",
    ];
    for code in fused {
        assert!(codes.contains(code), "{code} does not occur");
    }
}

#[test]
fn a_sphere_takes_four_instructions_and_two_registers() {
    let mut graph = Graph::new();
    let squares: Vec<NodeId> = (0..3)
        .map(|axis| {
            let coordinate = graph.coordinate(axis);
            let centre = graph.parameter(axis);
            let difference = graph.apply(Op::Subtract, &[coordinate, centre]);
            graph.apply(Op::Square, &[difference])
        })
        .collect();
    let sum = graph.apply(Op::Add, &[squares[0], squares[1]]);
    let sum = graph.apply(Op::Add, &[sum, squares[2]]);
    let distance = graph.apply(Op::SquareRoot, &[sum]);
    let radius = graph.parameter(3);
    let root = graph.apply(Op::Subtract, &[distance, radius]);
    let tape = assemble(&lower::lower(&graph, &[root], 3, 4));
    let codes: Vec<Code> = (tape.instructions.iter())
        .map(|instruction| instruction.code)
        .collect();
    assert_eq!(
        codes,
        [
            Code::SquaredDifferenceScalar,
            Code::SquaredDifferenceScalarAdd,
            Code::SquaredDifferenceScalarAdd,
            Code::RootSubtractScalar
        ]
    );
    assert_eq!(tape.registers, 2);
    assert!(tape.copies.is_empty() && tape.constants.is_empty());
}
