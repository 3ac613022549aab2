//! Instructions as an assembler makes them, kernels that need more registers than there are, and the
//! registers after a call. That kernels have the right bits is tested with those of the other
//! widths, in `vector`.

use super::assembler::{
    ADD, Assembler, Base, COMPARE, LOAD, MULTIPLY, SQUARE_ROOT, SUBTRACT, Source, TERNARY_LOGIC,
};
use super::*;
use crate::engine::jit::chunk::{self, Lengths};
use crate::engine::lower;
use crate::graph::{Graph, NodeId, Op};
use Base::{R9, R10, R11, Rax, Rbp, Rcx, Rdx};
use Source::Register;

fn lanes(base: Base, displacement: i32) -> Source {
    Source::Lanes { base, displacement }
}

fn vector(displacement: i32) -> Source {
    let base = R9;
    Source::Vector { base, displacement }
}

fn number(displacement: i32) -> Source {
    let base = Rcx;
    Source::Number { base, displacement }
}

/// The bytes of one instruction are those that the GNU assembler makes of its text.
#[track_caller]
fn gives(vectors: Vectors, write: impl FnOnce(&mut Assembler), bytes: &[u8]) {
    let mut code = Assembler::new(vectors);
    write(&mut code);
    let length = code.length();
    assert_eq!(&code.finish()[..length], bytes);
}

#[test]
#[rustfmt::skip]
fn instructions_of_512_bits_are_those_of_an_assembler() {
    const F32: Vectors = Vectors { is_512: true, is_f64: false };
    const F64: Vectors = Vectors { is_512: true, is_f64: true };
    // vaddps zmm1,zmm2,zmm3
    gives(F32, |code| code.instruction(ADD, 1, 2, Register(3)), &[0x62, 0xf1, 0x6c, 0x48, 0x58, 0xcb]);
    // vaddpd zmm31,zmm16,ZMMWORD PTR [rax+rdi*1]
    gives(F64, |code| code.instruction(ADD, 31, 16, lanes(Rax, 0)), &[0x62, 0x61, 0xfd, 0x40, 0x58, 0x3c, 0x38]);
    // vmulps zmm8,zmm9,ZMMWORD PTR [r10+rdi*1+0x40]
    gives(F32, |code| code.instruction(MULTIPLY, 8, 9, lanes(R10, 64)), &[0x62, 0x51, 0x34, 0x48, 0x59, 0x44, 0x3a, 0x01]);
    // vmulps zmm8,zmm9,ZMMWORD PTR [rdx+rdi*1+0x1000]
    gives(F32, |code| code.instruction(MULTIPLY, 8, 9, lanes(Rdx, 0x1000)), &[0x62, 0x71, 0x34, 0x48, 0x59, 0x44, 0x3a, 0x40]);
    // vmulps zmm8,zmm9,ZMMWORD PTR [rdx+rdi*1+0x4000]
    gives(F32, |code| code.instruction(MULTIPLY, 8, 9, lanes(Rdx, 0x4000)), &[0x62, 0x71, 0x34, 0x48, 0x59, 0x84, 0x3a, 0x00, 0x40, 0x00, 0x00]);
    // vsubps zmm7,zmm29,DWORD BCST [rcx+0x14]
    gives(F32, |code| code.instruction(SUBTRACT, 7, 29, number(20)), &[0x62, 0xf1, 0x14, 0x50, 0x5c, 0x79, 0x05]);
    // vsubpd zmm7,zmm29,QWORD BCST [rcx+0x1f40]
    gives(F64, |code| code.instruction(SUBTRACT, 7, 29, number(8000)), &[0x62, 0xf1, 0x95, 0x50, 0x5c, 0xb9, 0x40, 0x1f, 0x00, 0x00]);
    // vbroadcastss zmm17,DWORD PTR [rcx]
    gives(F32, |code| code.load(17, number(0)), &[0x62, 0xe2, 0x7d, 0x48, 0x18, 0x09]);
    // vbroadcastsd zmm17,QWORD PTR [rcx]
    gives(F64, |code| code.load(17, number(0)), &[0x62, 0xe2, 0xfd, 0x48, 0x19, 0x09]);
    // vmovups ZMMWORD PTR [rbp+rdi*1+0x0],zmm20
    gives(F32, |code| code.store(lanes(Rbp, 0), 20), &[0x62, 0xe1, 0x7c, 0x48, 0x11, 0x64, 0x3d, 0x00]);
    // vmovupd ZMMWORD PTR [r9+0x80],zmm20
    gives(F64, |code| code.store(vector(128), 20), &[0x62, 0xc1, 0xfd, 0x48, 0x11, 0x61, 0x02]);
    // vcmpneqps k3,zmm4,zmm21
    gives(F32, |code| code.immediate(COMPARE, 3, 4, Register(21), 4), &[0x62, 0xb1, 0x5c, 0x48, 0xc2, 0xdd, 0x04]);
    // vmovups zmm2{k5}{z},zmm2
    gives(F32, |code| code.masked(LOAD, 2, 0, Register(2), 5), &[0x62, 0xf1, 0x7c, 0xcd, 0x10, 0xd2]);
    // vblendmpd zmm4{k2},zmm5,zmm6
    gives(F64, |code| code.blend(4, 5, Register(6), 2), &[0x62, 0xf2, 0xd5, 0x4a, 0x65, 0xe6]);
    // vpternlogd zmm4,zmm30,DWORD BCST [rcx],0xd4
    gives(F32, |code| code.immediate(TERNARY_LOGIC, 4, 30, number(0), 0xd4), &[0x62, 0xf3, 0x0d, 0x50, 0x25, 0x21, 0xd4]);
    // vrndscaleps zmm4,zmm30,0x9
    gives(F32, |code| code.round(4, Register(30), 1), &[0x62, 0x93, 0x7d, 0x48, 0x08, 0xe6, 0x09]);
    // vrndscalepd zmm4,zmm30,0xa
    gives(F64, |code| code.round(4, Register(30), 2), &[0x62, 0x93, 0xfd, 0x48, 0x09, 0xe6, 0x0a]);
    // vsqrtps zmm4,ZMMWORD PTR [r11+rdi*1]
    gives(F32, |code| code.instruction(SQUARE_ROOT, 4, 0, lanes(R11, 0)), &[0x62, 0xd1, 0x7c, 0x48, 0x51, 0x24, 0x3b]);
}

#[test]
#[rustfmt::skip]
fn instructions_of_256_bits_are_those_of_an_assembler() {
    const F32: Vectors = Vectors { is_512: false, is_f64: false };
    const F64: Vectors = Vectors { is_512: false, is_f64: true };
    // vaddps ymm1,ymm2,ymm3
    gives(F32, |code| code.instruction(ADD, 1, 2, Register(3)), &[0xc4, 0xe1, 0x6c, 0x58, 0xcb]);
    // vaddpd ymm12,ymm15,YMMWORD PTR [rax+rdi*1]
    gives(F64, |code| code.instruction(ADD, 12, 15, lanes(Rax, 0)), &[0xc4, 0x61, 0x05, 0x58, 0x24, 0x38]);
    // vmulps ymm8,ymm9,YMMWORD PTR [r10+rdi*1+0x40]
    gives(F32, |code| code.instruction(MULTIPLY, 8, 9, lanes(R10, 64)), &[0xc4, 0x41, 0x34, 0x59, 0x44, 0x3a, 0x40]);
    // vmulps ymm8,ymm9,YMMWORD PTR [rdx+rdi*1+0x1000]
    gives(F32, |code| code.instruction(MULTIPLY, 8, 9, lanes(Rdx, 0x1000)), &[0xc4, 0x61, 0x34, 0x59, 0x84, 0x3a, 0x00, 0x10, 0x00, 0x00]);
    // vsubps ymm7,ymm14,YMMWORD PTR [rcx+0x20]
    gives(F32, |code| code.instruction(SUBTRACT, 7, 14, number(32)), &[0xc4, 0xe1, 0x0c, 0x5c, 0x79, 0x20]);
    // vmovups YMMWORD PTR [rbp+rdi*1+0x0],ymm14
    gives(F32, |code| code.store(lanes(Rbp, 0), 14), &[0xc4, 0x61, 0x7c, 0x11, 0x74, 0x3d, 0x00]);
    // vmovupd YMMWORD PTR [r9+0x80],ymm14
    gives(F64, |code| code.store(vector(128), 14), &[0xc4, 0x41, 0x7d, 0x11, 0xb1, 0x80, 0x00, 0x00, 0x00]);
    // vcmpneqps ymm3,ymm4,ymm11
    gives(F32, |code| code.immediate(COMPARE, 3, 4, Register(11), 4), &[0xc4, 0xc1, 0x5c, 0xc2, 0xdb, 0x04]);
    // vblendvps ymm1,ymm2,ymm3,ymm15
    gives(F32, |code| code.choose(1, 2, Register(3), 15), &[0xc4, 0xe3, 0x6d, 0x4a, 0xcb, 0xf0]);
    // vblendvpd ymm1,ymm2,YMMWORD PTR [rcx],ymm15
    gives(F64, |code| code.choose(1, 2, number(0), 15), &[0xc4, 0xe3, 0x6d, 0x4b, 0x09, 0xf0]);
    // vroundps ymm4,ymm13,0x9
    gives(F32, |code| code.round(4, Register(13), 1), &[0xc4, 0xc3, 0x7d, 0x08, 0xe5, 0x09]);
    // vroundpd ymm4,ymm13,0xa
    gives(F64, |code| code.round(4, Register(13), 2), &[0xc4, 0xc3, 0x7d, 0x09, 0xe5, 0x0a]);
    // vsqrtps ymm4,YMMWORD PTR [r11+rdi*1]
    gives(F32, |code| code.instruction(SQUARE_ROOT, 4, 0, lanes(R11, 0)), &[0xc4, 0xc1, 0x7c, 0x51, 0x24, 0x3b]);
}

/// A constant is found relative to the end of the instruction, behind all code, and stands there
/// once however often it is used.
#[test]
fn constants_stand_behind_the_code() {
    for (is_512, copies) in [(true, 1), (false, 4)] {
        let vectors = Vectors {
            is_512,
            is_f64: true,
        };
        let mut code = Assembler::new(vectors);
        let [a, b, again] = [1.5f64, 2.5, 1.5].map(|number| code.constant(number.to_bits()));
        assert_eq!((a, a == b), (again, false));
        code.instruction(ADD, 0, 0, b);
        let end = code.length();
        let bytes = code.finish();
        let way = i32::from_le_bytes(bytes[end - 4..end].try_into().unwrap()) as usize;
        assert_eq!((end + way) % 8, 0);
        assert_eq!(bytes[end + way..][..8], 2.5f64.to_le_bytes());
        assert_eq!(bytes.len(), 64 + 2 * copies * 8);
    }
}

/// How many vectors are spilled where so many sums are needed after all are known.
fn spilled(sums: usize, is_512: bool) -> usize {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let sums: Vec<NodeId> = (0..sums)
        .map(|index| {
            let factor = graph.constant(index as f64 + 1.5);
            let product = graph.apply(Op::Multiply, &[x, factor]);
            graph.apply(Op::Add, &[product, y])
        })
        .collect();
    let last = sums[sums.len() - 1];
    let root = sums.iter().fold(last, |product, &sum| {
        graph.apply(Op::Multiply, &[product, sum])
    });
    let lowered = lower::lower(&graph, &[root], 3, 0);
    let whole = Lengths {
        whole: usize::MAX,
        chunk: 1,
    };
    let plan = chunk::plan(&lowered, whole);
    let is_f64 = true;
    Chunk::new(&lowered, &plan, Vectors { is_512, is_f64 }, 0)
        .write()
        .1
}

#[test]
fn only_what_has_no_register_is_spilled() {
    // While the last sum is computed, it and y have registers, too.
    for (is_512, registers) in [(true, 29), (false, 13)] {
        assert_eq!(spilled(registers - 2, is_512), 0);
        let more = spilled(registers + 10, is_512);
        assert!((10..=12).contains(&more), "{more} instead of 10");
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn upper_halves_are_clean_after_a_call() {
    use crate::engine::jit::{tests::upper_halves_in_use, vector};
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let root = graph.apply(Op::Square, &[x]);
    let lowered = lower::lower(&graph, &[root], 1, 0);
    for kernels in Kernels::ALL {
        let code = vector::compile::<f64>(&lowered, kernels).unwrap();
        let mut squares = [0.0; 64];
        assert!(code.run(64, &[&[3.0; 64]], &[], &mut [&mut squares]));
        assert_ne!(upper_halves_in_use(), Some(true), "{kernels:?}");
        assert_eq!(squares, [9.0; 64]);
    }
}
