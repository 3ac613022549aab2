//! What can be said of machine code only from inside: chunks, registers, memory.

use super::*;
use crate::engine::{interpret, lower};
use crate::graph::{Graph, NodeId};

/// Outputs of three coordinates and two parameters that use every operation and share much.
fn everything() -> Lowered {
    let mut graph = Graph::new();
    let mut nodes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    nodes.extend((0..2).map(|index| graph.parameter(index)));
    let two = graph.constant(2.0);
    for &op in Op::ALL {
        let count = nodes.len();
        let operands = match op {
            Op::IntegerPower => vec![nodes[count - 1], two],
            _ => (0..op.arity())
                .map(|place| nodes[(count - 1) / (3 * place + 1)])
                .collect(),
        };
        let result = graph.apply(op, &operands);
        let leaf = nodes[count % 5];
        nodes.push(graph.apply(Op::Add, &[result, leaf]));
    }
    lower::lower(&graph, &nodes, 3, 2)
}

/// The columns of all outputs at points that depend on `count`.
fn run(code: &MachineCode, lowered: &Lowered, count: usize) -> Vec<Vec<f64>> {
    let column = |factor: f64| {
        (0..count)
            .map(move |i| (i as f64 * factor) % 4.0 - 2.0)
            .collect()
    };
    let points: [Vec<f64>; 3] = [column(0.37), column(0.73), column(0.19)];
    let uniforms = interpret::uniforms(lowered, &[0.7, -1.3]);
    let mut outputs = vec![vec![0.25; count]; lowered.outputs.len()];
    let mut columns: Vec<&mut [f64]> = outputs.iter_mut().map(|column| &mut column[..]).collect();
    let points = points.each_ref().map(|column| &column[..]);
    assert!(code.run(count, &points, &uniforms, &mut columns));
    outputs
}

/// The bits, with one NaN.
fn bits(columns: &[Vec<f64>]) -> Vec<u64> {
    let number = |&value: &f64| if value.is_nan() { f64::NAN } else { value }.to_bits();
    columns.iter().flatten().map(number).collect()
}

#[test]
fn chunks_change_nothing() {
    let lowered = everything();
    let whole = compile_with(
        &lowered,
        Lengths {
            whole: usize::MAX,
            chunk: 1,
        },
    )
    .unwrap();
    assert_eq!(whole.chunks.len(), 1);
    for chunk in [1, 3, 16] {
        let cut = compile_with(&lowered, Lengths { whole: 0, chunk }).unwrap();
        assert_eq!(cut.chunks.len(), lowered.steps.len().div_ceil(chunk));
        assert!(cut.slots > 0);
        for count in [0, 1, 63, 64, 65, 200] {
            assert_eq!(
                bits(&run(&whole, &lowered, count)),
                bits(&run(&cut, &lowered, count))
            );
        }
    }
}

#[test]
fn slots_are_used_again() {
    // x, sin x, sin sin x, …: between chunks only one value is alive.
    let mut graph = Graph::new();
    let mut root = graph.coordinate(0);
    for _ in 0..1_000 {
        root = graph.apply(Op::Sin, &[root]);
    }
    let lowered = lower::lower(&graph, &[root], 1, 0);
    let plan = chunk::plan(
        &lowered,
        Lengths {
            whole: 0,
            chunk: 10,
        },
    );
    assert_eq!(plan.chunks.len(), 100);
    assert!(plan.slots <= 2, "{} slots", plan.slots);
}

#[test]
fn wrong_lengths_are_refused() {
    let lowered = everything();
    let code = compile(&lowered).unwrap();
    let uniforms = interpret::uniforms(&lowered, &[0.7, -1.3]);
    let (x, short) = ([0.0; 4], [0.0; 3]);
    let mut outputs = vec![vec![0.0; 4]; lowered.outputs.len()];
    let mut columns: Vec<&mut [f64]> = outputs.iter_mut().map(|column| &mut column[..]).collect();
    assert!(code.run(4, &[&x, &x, &x], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x, &short], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x], &uniforms, &mut columns));
    assert!(!code.run(4, &[&x, &x, &x], &uniforms[1..], &mut columns));
    assert!(!code.run(5, &[&x, &x, &x], &uniforms, &mut columns));
    columns.pop();
    assert!(!code.run(4, &[&x, &x, &x], &uniforms, &mut columns));
}

#[test]
fn too_large_a_kernel_is_refused() {
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let mut root = x;
    for _ in 0..=LARGEST_KERNEL / 2 {
        root = graph.apply(Op::Multiply, &[root, x]);
        root = graph.apply(Op::Subtract, &[root, x]);
    }
    let lowered = lower::lower(&graph, &[root], 1, 0);
    assert!(matches!(compile(&lowered), Err(Refusal::TooLarge)));
}

#[test]
fn code_uses_no_wide_registers() {
    let lowered = everything();
    let plan = chunk::plan(&lowered, chunk::LENGTHS);
    let isa = target().unwrap();
    let source = Source {
        lowered: &lowered,
        plan: &plan,
        lanes: Lanes::One,
    };
    let mut context = Context::for_function(named(source, 0, isa.default_call_conv()));
    context.set_disasm(true);
    let code = context.compile(&**isa, &mut Default::default()).unwrap();
    let assembly = code.vcode.as_ref().unwrap();
    assert!(assembly.lines().count() > 200);
    if cfg!(target_arch = "x86_64") {
        assert!(assembly.contains("%xmm"));
        assert!(!assembly.contains("%ymm") && !assembly.contains("%zmm"));
    }
}

/// Whether the upper halves of the vector registers hold anything: bit 2 of XINUSE, which
/// XGETBV(1) gives (Intel SDM, volume 1, section 13.6). `None` where the processor cannot tell.
#[cfg(target_arch = "x86_64")]
pub(in crate::engine::jit) fn upper_halves_in_use() -> Option<bool> {
    use std::arch::x86_64::__cpuid_count;
    if !std::arch::is_x86_feature_detected!("avx") || __cpuid_count(0xd, 1).eax & 4 == 0 {
        return None;
    }
    let low: u32;
    // SAFETY: the instruction exists (just checked; AVX implies XSAVE), reads only, and writes
    // the two registers that are named.
    unsafe { std::arch::asm!("xgetbv", in("ecx") 1, out("eax") low, out("edx") _) };
    Some(low & 4 != 0)
}

#[cfg(target_arch = "x86_64")]
#[test]
fn upper_halves_are_clean_after_a_call() {
    let lowered = everything();
    let code = compile(&lowered).unwrap();
    run(&code, &lowered, 100);
    let Some(after) = upper_halves_in_use() else {
        return;
    };
    assert!(!after, "the kernel left the upper halves dirty");
    // The processor really tells: a register with a full upper half is seen.
    // SAFETY: AVX exists, since there was an answer; the one register written is named, and
    // the second instruction leaves the upper halves as they were found.
    unsafe { std::arch::asm!("vcmpps ymm15, ymm15, ymm15, 15", out("xmm15") _) };
    let dirty = upper_halves_in_use();
    // SAFETY: the same.
    unsafe { std::arch::asm!("vzeroupper") };
    assert_eq!(dirty, Some(true));
}
