//! The instructions of x86-64 that wide code consists of, as bytes.
//!
//! After Intel's Software Developer's Manual, volume 2, sections 2.1 (prefixes and addresses), 2.3
//! (VEX, for 256 bits) and 2.7 (EVEX, for 512). There are only as many forms as the code needs:
//! three operands, of which the last may be in memory.

use std::collections::hash_map::Entry;

use rustc_hash::FxHashMap;

/// The vectors of the code: how wide they are, and of which numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::engine::jit) struct Vectors {
    /// 512 bits and EVEX (AVX-512 F and DQ), or 256 bits and VEX (AVX2).
    pub(in crate::engine::jit) is_512: bool,
    /// f64 or f32.
    pub(in crate::engine::jit) is_f64: bool,
}

impl Vectors {
    /// The bytes of a vector.
    pub(in crate::engine::jit) fn bytes(self) -> usize {
        if self.is_512 { 64 } else { 32 }
    }

    /// The logarithm to base 2 of the bytes of a number.
    pub(super) fn shift(self) -> u8 {
        if self.is_f64 { 3 } else { 2 }
    }

    /// How often a number that is the same for all lanes stands in memory: 512-bit instructions
    /// repeat it by themselves.
    pub(in crate::engine::jit) fn copies(self) -> usize {
        if self.is_512 { 1 } else { 32 >> self.shift() }
    }
}

/// A general register that addresses start from, by its number in instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Base {
    Rax = 0,
    Rcx = 1,
    Rdx = 2,
    Rbp = 5,
    R9 = 9,
    R10 = 10,
    R11 = 11,
}

/// A vector register by its number.
pub(super) type Register = u8;

/// Where the last operand of an instruction is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// In a register.
    Register(Register),
    /// In memory, at the offset of the points (rdi) from here: a vector.
    Lanes { base: Base, displacement: i32 },
    /// In memory, exactly here: a vector.
    Vector { base: Base, displacement: i32 },
    /// In memory, exactly here: a number as often as [`Vectors::copies`] says.
    Number { base: Base, displacement: i32 },
    /// A constant: a place of the code's own table.
    Constant(u32),
}

/// A mask register: k1 to k7; 0 stands for none.
pub(super) type Mask = u8;

/// The operation of an instruction: opcode map and opcode. The prefix and the width bit follow
/// from the map and the kind of number.
#[derive(Clone, Copy)]
pub(super) struct Opcode {
    map: u8,
    code: u8,
}

/// Opcodes of the map 0F; for f64 they have the prefix 66.
const fn packed(code: u8) -> Opcode {
    Opcode { map: 1, code }
}

/// Opcodes of the maps 0F38 (2) and 0F3A (3), always with the prefix 66.
const fn extended(map: u8, code: u8) -> Opcode {
    Opcode { map, code }
}

pub(super) const LOAD: Opcode = packed(0x10);
pub(super) const STORE: Opcode = packed(0x11);
pub(super) const SQUARE_ROOT: Opcode = packed(0x51);
pub(super) const AND: Opcode = packed(0x54);
pub(super) const OR: Opcode = packed(0x56);
pub(super) const EXCLUSIVE_OR: Opcode = packed(0x57);
pub(super) const ADD: Opcode = packed(0x58);
pub(super) const MULTIPLY: Opcode = packed(0x59);
pub(super) const SUBTRACT: Opcode = packed(0x5c);
pub(super) const MINIMUM: Opcode = packed(0x5d);
pub(super) const DIVIDE: Opcode = packed(0x5e);
pub(super) const MAXIMUM: Opcode = packed(0x5f);
/// With a predicate as immediate. VEX: a vector of masks; EVEX: a mask register.
pub(super) const COMPARE: Opcode = packed(0xc2);
/// EVEX only: the third operand where the mask is set, else the second.
pub(super) const BLEND: Opcode = extended(2, 0x65);
/// EVEX only: any function of three bits, by its table.
pub(super) const TERNARY_LOGIC: Opcode = extended(3, 0x25);

/// The instructions of one function, and the constants behind them.
pub(super) struct Assembler {
    pub(super) vectors: Vectors,
    code: Vec<u8>,
    /// The constants by their bits, in the order of their places.
    constants: Vec<u64>,
    places: FxHashMap<u64, u32>,
    /// Where a displacement to a constant stands, where its instruction ends, and its place.
    references: Vec<(usize, usize, u32)>,
}

impl Assembler {
    pub(super) fn new(vectors: Vectors) -> Assembler {
        Assembler {
            vectors,
            code: Vec::new(),
            constants: Vec::new(),
            places: FxHashMap::default(),
            references: Vec::new(),
        }
    }

    /// How many bytes there are so far.
    pub(super) fn length(&self) -> usize {
        self.code.len()
    }

    /// The constant of these bits.
    pub(super) fn constant(&mut self, bits: u64) -> Source {
        let place = match self.places.entry(bits) {
            Entry::Occupied(place) => *place.get(),
            Entry::Vacant(place) => {
                self.constants.push(bits);
                *place.insert(self.constants.len() as u32 - 1)
            }
        };
        Source::Constant(place)
    }

    /// Instructions as they are.
    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.code.extend_from_slice(bytes);
    }

    /// A displacement or number of 32 bits.
    pub(super) fn number(&mut self, number: i32) {
        self.bytes(&number.to_le_bytes());
    }

    /// Makes the number of 32 bits at this place the way from behind it to the end.
    pub(super) fn lead_here(&mut self, place: usize) {
        let way = (self.code.len() - place - 4) as i32;
        self.code[place..place + 4].copy_from_slice(&way.to_le_bytes());
    }

    /// out = first ∘ second. Where the instruction has only one operand, it is the second, and
    /// the first must be 0.
    pub(super) fn instruction(
        &mut self,
        opcode: Opcode,
        out: Register,
        first: Register,
        second: Source,
    ) {
        self.encode(opcode, [out, first], second, (0, false), None);
    }

    /// The same with an immediate.
    pub(super) fn immediate(
        &mut self,
        opcode: Opcode,
        out: Register,
        first: Register,
        second: Source,
        immediate: u8,
    ) {
        self.encode(opcode, [out, first], second, (0, false), Some(immediate));
    }

    /// EVEX only: the same under a mask; the other lanes become 0.
    pub(super) fn masked(
        &mut self,
        opcode: Opcode,
        out: Register,
        first: Register,
        second: Source,
        mask: Mask,
    ) {
        self.encode(opcode, [out, first], second, (mask, true), None);
    }

    /// EVEX only: `second` where the mask is set, else `first`.
    pub(super) fn blend(&mut self, out: Register, first: Register, second: Source, mask: Mask) {
        self.encode(BLEND, [out, first], second, (mask, false), None);
    }

    /// VEX only: `second` where the sign of `choice` is set, else `first`.
    pub(super) fn choose(
        &mut self,
        out: Register,
        first: Register,
        second: Source,
        choice: Register,
    ) {
        let opcode = extended(3, if self.vectors.is_f64 { 0x4b } else { 0x4a });
        self.immediate(opcode, out, first, second, choice << 4);
    }

    /// Rounds to integers: 1 down, 2 up. No exception is noted.
    pub(super) fn round(&mut self, out: Register, source: Source, direction: u8) {
        let opcode = extended(3, if self.vectors.is_f64 { 0x09 } else { 0x08 });
        self.immediate(opcode, out, 0, source, 8 | direction);
    }

    /// Loads what is no register yet.
    pub(super) fn load(&mut self, out: Register, source: Source) {
        let opcode = self.load_of(source);
        self.instruction(opcode, out, 0, source);
    }

    /// EVEX only: the same under a mask; the other lanes become 0.
    pub(super) fn load_masked(&mut self, out: Register, source: Source, mask: Mask) {
        let opcode = self.load_of(source);
        self.masked(opcode, out, 0, source, mask);
    }

    /// The instruction that loads this; a number that stands there once has one of its own.
    fn load_of(&self, source: Source) -> Opcode {
        match source {
            Source::Number { .. } | Source::Constant(_) if self.vectors.is_512 => {
                extended(2, if self.vectors.is_f64 { 0x19 } else { 0x18 })
            }
            _ => LOAD,
        }
    }

    /// Stores a vector.
    pub(super) fn store(&mut self, place: Source, register: Register) {
        self.instruction(STORE, register, 0, place);
    }

    /// One instruction: `registers` are those of the fields ModRM.reg and vvvv.
    fn encode(
        &mut self,
        opcode: Opcode,
        registers: [Register; 2],
        source: Source,
        mask: (Mask, bool),
        immediate: Option<u8>,
    ) {
        if self.vectors.is_512 {
            self.evex(opcode, registers, source, mask);
        } else {
            self.vex(opcode, registers, source);
        }
        let reference = self.address(registers[0], source, opcode);
        self.code.extend(immediate);
        if let (Some(place), Source::Constant(constant)) = (reference, source) {
            self.references.push((place, self.code.len(), constant));
        }
    }

    /// The prefix of three bytes, and the opcode.
    fn vex(&mut self, opcode: Opcode, [reg, vvvv]: [Register; 2], source: Source) {
        let [x, b] = high_bits(source);
        let inverted = |bit: u8, place: u8| (1 - (bit & 1)) << place;
        let prefix = u8::from(opcode.map > 1 || self.vectors.is_f64);
        self.bytes(&[
            0xc4,
            inverted(reg >> 3, 7) | inverted(x, 6) | inverted(b, 5) | opcode.map,
            (!vvvv & 15) << 3 | 1 << 2 | prefix,
            opcode.code,
        ]);
    }

    /// The prefix of four bytes, and the opcode.
    fn evex(
        &mut self,
        opcode: Opcode,
        [reg, vvvv]: [Register; 2],
        source: Source,
        (mask, zeroes): (Mask, bool),
    ) {
        let [x, b] = high_bits(source);
        let inverted = |bit: u8, place: u8| (1 - (bit & 1)) << place;
        let prefix = u8::from(opcode.map > 1 || self.vectors.is_f64);
        let repeats = self.repeats(source, opcode);
        self.bytes(&[
            0x62,
            inverted(reg >> 3, 7)
                | inverted(x, 6)
                | inverted(b, 5)
                | inverted(reg >> 4, 4)
                | opcode.map,
            u8::from(self.vectors.is_f64) << 7 | (!vvvv & 15) << 3 | 1 << 2 | prefix,
            u8::from(zeroes) << 7 | 2 << 5 | u8::from(repeats) << 4 | inverted(vvvv >> 4, 3) | mask,
            opcode.code,
        ]);
    }

    /// Whether the instruction repeats a number of the memory in all lanes by a bit of its own;
    /// loads do so by their opcode.
    fn repeats(&self, source: Source, opcode: Opcode) -> bool {
        let is_repeated = matches!(source, Source::Number { .. } | Source::Constant(_));
        let is_load = opcode.map == 2 && matches!(opcode.code, 0x18 | 0x19);
        self.vectors.is_512 && is_repeated && !is_load
    }

    /// ModRM, SIB and displacement. Returns where the displacement to a constant stands.
    fn address(&mut self, reg: Register, source: Source, opcode: Opcode) -> Option<usize> {
        let reg = (reg & 7) << 3;
        let (base, displacement, is_indexed) = match source {
            Source::Register(register) => {
                self.code.push(0xc0 | reg | register & 7);
                return None;
            }
            Source::Constant(_) => {
                self.code.push(reg | 5);
                self.number(0);
                return Some(self.code.len() - 4);
            }
            Source::Lanes { base, displacement } => (base, displacement, true),
            Source::Vector { base, displacement } | Source::Number { base, displacement } => {
                (base, displacement, false)
            }
        };
        // The byte of a displacement counts in units of what is read, with EVEX.
        let is_number = matches!(source, Source::Number { .. });
        let unit = match (self.vectors.is_512, is_number) {
            (false, _) => 1,
            (true, true) => 1 << self.vectors.shift(),
            (true, false) => 64,
        };
        debug_assert!(!is_number || opcode.code != STORE.code);
        let short = i8::try_from(displacement / unit).ok();
        let short = short.filter(|_| displacement % unit == 0);
        let kind = match short {
            Some(0) if base as u8 & 7 != 5 => 0,
            Some(_) => 1,
            None => 2,
        };
        let base = base as u8 & 7;
        match is_indexed {
            // The index is rdi (7), times 1.
            true => self.bytes(&[kind << 6 | reg | 4, 7 << 3 | base]),
            false => self.code.push(kind << 6 | reg | base),
        }
        match (kind, short) {
            (1, Some(short)) => self.code.push(short as u8),
            (2, _) => self.number(displacement),
            _ => {}
        }
        None
    }

    /// The code and behind it its constants, from a multiple of a vector on.
    pub(super) fn finish(mut self) -> Vec<u8> {
        let table = self.code.len().next_multiple_of(64);
        self.code.resize(table, 0xcc);
        let copies = self.vectors.copies();
        let size = copies << self.vectors.shift();
        for &bits in &self.constants {
            let bytes = bits.to_le_bytes();
            for _ in 0..copies {
                self.code
                    .extend_from_slice(&bytes[..1 << self.vectors.shift()]);
            }
        }
        for &(place, end, constant) in &self.references {
            let way = (table + constant as usize * size - end) as i32;
            self.code[place..place + 4].copy_from_slice(&way.to_le_bytes());
        }
        self.code
    }
}

/// What the prefixes' bits X and B extend.
fn high_bits(source: Source) -> [u8; 2] {
    match source {
        Source::Register(register) => [register >> 4, register >> 3],
        Source::Constant(_) => [0, 0],
        Source::Lanes { base, .. } | Source::Vector { base, .. } | Source::Number { base, .. } => {
            [0, base as u8 >> 3]
        }
    }
}
