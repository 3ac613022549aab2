//! F and F_x as they are pruned for a leaf, kept beyond the exploration.

use super::Specialized;
use crate::engine::block::{self, Kernels, LANES};
use crate::engine::tape::{Place, Source, Tape};
use rustc_hash::FxHashMap;

/// F and F_x for the points of one cell, with the bits of the whole field's. It holds what its own
/// operations need, some tens of bytes for each.
pub struct Excerpt {
    tape: Tape,
    scalars: Vec<f64>,
    kernels: Kernels,
}

impl Excerpt {
    /// Of a pruned tape, with those of the scalars that it uses; none if it is too large to run.
    fn new(tape: &Tape, scalars: &[f64], kernels: Kernels) -> Option<Excerpt> {
        if tape.registers * size_of::<[f64; LANES]>() > block::LARGEST_MEMORY {
            return None;
        }
        let mut excerpt = Excerpt {
            tape: tape.clone(),
            scalars: Vec::new(),
            kernels,
        };
        let mut places: FxHashMap<u32, u32> = FxHashMap::default();
        let mut place = |old: u32| {
            *places.entry(old).or_insert_with(|| {
                excerpt.scalars.push(scalars[old as usize]);
                excerpt.scalars.len() as u32 - 1
            })
        };
        for instruction in &mut excerpt.tape.instructions {
            let kinds = instruction.code.facts().scalars;
            let sources = [&mut instruction.a, &mut instruction.b, &mut instruction.c];
            for (operand, source) in sources.into_iter().enumerate() {
                if kinds >> operand & 1 == 1 {
                    *source = Source(place(source.0));
                }
            }
        }
        for (_, copied) in &mut excerpt.tape.copies {
            if let Place::Scalar(scalar) = copied {
                *scalar = place(*scalar);
            }
        }
        Some(excerpt)
    }

    /// The number of operations for one point, fused ones counted once.
    pub fn size(&self) -> usize {
        self.tape.instructions.len()
    }

    /// F and F_x at every point; `gradients` has a column per axis. All columns are of one length.
    pub fn gradients(&self, points: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        let count = values.len();
        // At most four columns, so that nothing is allocated.
        let mut outputs: [&mut [f64]; 4] = Default::default();
        let columns = 1 + gradients.len();
        outputs[0] = values;
        for (output, column) in outputs[1..].iter_mut().zip(gradients) {
            *output = column;
        }
        let outputs = &mut outputs[..columns];
        block::run(
            &self.tape,
            self.kernels,
            count,
            points,
            &self.scalars,
            outputs,
        );
    }
}

impl Specialized<'_> {
    /// F and F_x for points of the cell, to be kept; none where they cannot be pruned.
    pub fn excerpt(&mut self) -> Option<Excerpt> {
        let kernels = self.kernels;
        let (sequence, scalars) = self.pruned_gradients()?;
        Excerpt::new(&sequence.tape, &scalars.double, kernels)
    }
}
