//! Solids that fell: what `drop` makes.

use std::rc::Rc;

use super::{CurveSet, MeshSet, Property, count, hidden, number, shown};
use crate::elastic::{Fall, Frame};
use crate::language::value::Value;
use crate::polygonize::Statistics;

/// A solid that fell.
#[derive(Debug)]
pub struct FallSet {
    /// All of its fall.
    pub fall: Fall,
}

impl FallSet {
    /// The boundary in a frame: a mesh, or in R2 curves.
    pub fn boundary(&self, frame: &Frame) -> Value {
        match self.fall.dimension {
            2 => Value::Curves(Rc::new(CurveSet {
                curves: self.fall.curves(frame),
                method: "drop",
                statistics: Statistics::default(),
                certified: None,
            })),
            _ => Value::Mesh(Rc::new(MeshSet::new(self.fall.mesh(frame), "drop", None))),
        }
    }

    /// The boundaries of the last frame or of all, if the solid is in R2, or in R3.
    fn boundaries(&self, dimension: usize) -> Option<Vec<Value>> {
        let frames = self.fall.frames.iter();
        (self.fall.dimension == dimension)
            .then(|| frames.map(|frame| self.boundary(frame)).collect())
    }

    fn last(&self, dimension: usize) -> Option<Value> {
        let frame = self.fall.frames.last()?;
        (self.fall.dimension == dimension).then(|| self.boundary(frame))
    }
}

pub(super) const FALL: &[Property<FallSet>] = &[
    shown("time", |set| number(set.fall.frames.last()?.time)),
    shown("frames", |set| count(set.fall.frames.len())),
    shown("nodes", |set| count(set.fall.counts[0])),
    shown("tetrahedra", |set| match set.fall.dimension {
        2 => None,
        _ => count(set.fall.counts[1]),
    }),
    shown("triangles", |set| match set.fall.dimension {
        2 => count(set.fall.counts[1]),
        _ => None,
    }),
    shown("springs", |set| count(set.fall.counts[2])),
    shown("pieces", |set| count(set.fall.remarks.pieces)),
    shown("step", |set| number(set.fall.step)),
    shown("steps", |set| number(set.fall.steps as f64)),
    shown("bounces", |set| count(set.fall.bounces)),
    shown("lowest", |set| number(set.fall.lowest)),
    shown("inverted", |set| count(set.fall.inverted)),
    shown("energy_error", |set| number(set.fall.energy_error())),
    hidden("off_surface", |set| count(set.fall.remarks.off_surface)),
    hidden("energy", |set| {
        let row = |frame: &Frame| {
            let energy = &frame.energy;
            let parts = [energy.kinetic, energy.elastic, energy.gravity, energy.lost];
            Value::numbers(std::iter::once(frame.time).chain(parts))
        };
        Some(Value::list(set.fall.frames.iter().map(row).collect()))
    }),
    hidden("mesh", |set| set.last(3)),
    hidden("meshes", |set| set.boundaries(3).map(Value::list)),
    hidden("curves", |set| set.last(2)),
];
