//! Which values of a chunk are in vector registers, and which wait in memory.
//!
//! The code of a chunk is straight, so every next use is known. When registers run out, the value
//! with the farthest next use goes (Belady, *A study of replacement algorithms for a
//! virtual-storage computer*, 1966). It is written to memory only if it is not there already, as
//! coordinates and what waits in a slot are. Linear time.

use super::assembler::{Assembler, Base, Register, Source};

/// A value of the chunk: one of its own steps, or a leaf that it loads.
pub(super) type ValueId = u32;

/// No use any more.
pub(super) const NEVER: u32 = u32::MAX;

/// What is known of a value while code is written.
#[derive(Clone, Copy)]
struct Value {
    /// Where it can be loaded from.
    memory: Option<Source>,
    /// Whether that memory is a spilling place, free again after the last use.
    is_spilled: bool,
    register: Option<Register>,
    /// The step that uses it next, or [`NEVER`].
    next: u32,
}

/// The registers of the code, and the memory for those that have no room.
pub(super) struct Registers {
    values: Vec<Value>,
    /// Which value each register holds.
    holders: [ValueId; 32],
    /// The registers that values may have, as bits.
    all: u32,
    /// Those of them that hold nothing.
    free: u32,
    /// Which registers the current instruction still reads, as bits.
    pinned: u32,
    /// Spilling places that are free.
    places: Vec<i32>,
    /// Those that the current instruction may still read.
    left: Vec<i32>,
    /// How many spilling places there are, free or not.
    count: i32,
    /// Where they begin, from r9, in bytes.
    spills: i32,
}

impl Registers {
    /// Registers 0 to `count` − 1 hold nothing. The memory of each value is given.
    pub(super) fn new(
        count: u32,
        memory: impl Iterator<Item = Option<Source>>,
        spills: i32,
    ) -> Registers {
        let value = |memory| Value {
            memory,
            is_spilled: false,
            register: None,
            next: NEVER,
        };
        Registers {
            values: memory.map(value).collect(),
            holders: [0; 32],
            all: (1 << count) - 1,
            free: (1 << count) - 1,
            pinned: 0,
            places: Vec::new(),
            left: Vec::new(),
            count: 0,
            spills,
        }
    }

    /// How many vectors of memory spilled values take.
    pub(super) fn spilled(&self) -> usize {
        self.count as usize
    }

    /// The value is used here, and then in step `next`.
    pub(super) fn note_use(&mut self, value: ValueId, next: u32) {
        self.values[value as usize].next = next;
    }

    /// Where the value is as the last operand of an instruction. It is loaded if it is worth a
    /// register: if it is used again, before some other value.
    pub(super) fn source(&mut self, code: &mut Assembler, value: ValueId) -> Source {
        let Value {
            memory,
            register,
            next,
            ..
        } = self.values[value as usize];
        match (register, memory) {
            (None, Some(memory)) if next == NEVER || !self.has_room_until(next) => memory,
            _ => Source::Register(self.load(code, value)),
        }
    }

    /// The register of the value, which stays until the instruction is written. If it is not used
    /// again it is loaded into `scratch`.
    pub(super) fn register(
        &mut self,
        code: &mut Assembler,
        value: ValueId,
        scratch: Register,
    ) -> Register {
        let Value {
            memory,
            register,
            next,
            ..
        } = self.values[value as usize];
        match (register, memory) {
            (None, Some(memory)) if next == NEVER => {
                code.load(scratch, memory);
                scratch
            }
            _ => self.load(code, value),
        }
    }

    /// The register in which the value is, if it is in one.
    pub(super) fn held(&self, value: ValueId) -> Option<Register> {
        self.values[value as usize].register
    }

    /// The value in a register of its own.
    fn load(&mut self, code: &mut Assembler, value: ValueId) -> Register {
        let Value {
            memory, register, ..
        } = self.values[value as usize];
        let register = register.unwrap_or_else(|| {
            let register = self.take(code, value);
            // A value is computed before it is used; so what is in no register is in memory.
            if let Some(memory) = memory {
                code.load(register, memory);
            }
            register
        });
        self.pinned |= 1 << register;
        register
    }

    /// The instruction's operands are known: those that nothing uses again leave their registers
    /// to its result, and their spilling places to what is spilled after it.
    pub(super) fn release(&mut self, operands: impl Iterator<Item = ValueId>) {
        self.pinned = 0;
        self.places.append(&mut self.left);
        for value in operands {
            if self.values[value as usize].next == NEVER {
                self.forget(value);
            }
        }
    }

    /// A register for a result.
    pub(super) fn result(&mut self, code: &mut Assembler, value: ValueId, next: u32) -> Register {
        self.values[value as usize].next = next;
        self.take(code, value)
    }

    /// From now on the value can be loaded from there.
    pub(super) fn note_memory(&mut self, value: ValueId, memory: Source) {
        self.values[value as usize].memory = Some(memory);
    }

    /// Nothing uses the value any more.
    pub(super) fn forget(&mut self, value: ValueId) {
        let known = &mut self.values[value as usize];
        if let Some(register) = known.register.take() {
            self.free |= 1 << register;
        }
        if let (true, Some(Source::Vector { displacement, .. })) = (known.is_spilled, known.memory)
        {
            known.is_spilled = false;
            known.memory = None;
            self.left.push(displacement);
        }
    }

    /// Whether a register is free, or holds what is used later than `next`.
    fn has_room_until(&self, next: u32) -> bool {
        self.free != 0 || self.farthest().is_some_and(|(_, farthest)| farthest > next)
    }

    /// The register whose value is used last, and when that is.
    fn farthest(&self) -> Option<(Register, u32)> {
        let mut held = self.all & !self.free & !self.pinned;
        let mut found: Option<(Register, u32)> = None;
        for register in 0..32 {
            if held & 1 == 1 {
                let next = self.values[self.holders[register as usize] as usize].next;
                if found.is_none_or(|(_, farthest)| next > farthest) {
                    found = Some((register, next));
                }
            }
            held >>= 1;
        }
        found
    }

    /// A register for the value: a free one, or that of the value which is used last.
    fn take(&mut self, code: &mut Assembler, value: ValueId) -> Register {
        let register = match self.free.trailing_zeros() {
            32 => self.evict(code),
            free => free as Register,
        };
        self.free &= !(1 << register);
        self.holders[register as usize] = value;
        self.values[value as usize].register = Some(register);
        register
    }

    /// Frees a register; its value can be loaded from memory afterwards.
    fn evict(&mut self, code: &mut Assembler) -> Register {
        // An instruction pins three registers at most, and there are more.
        let register = self.farthest().map_or(0, |(register, _)| register);
        let value = self.holders[register as usize];
        self.values[value as usize].register = None;
        if self.values[value as usize].memory.is_none() {
            let displacement = self.places.pop().unwrap_or_else(|| {
                self.count += 1;
                self.spills + (self.count - 1) * code.vectors.bytes() as i32
            });
            let place = Source::Vector {
                base: Base::R9,
                displacement,
            };
            code.store(place, register);
            self.values[value as usize].memory = Some(place);
            self.values[value as usize].is_spilled = true;
        }
        register
    }
}
