//! Solids as simplices, and such that fell: what `tetrahedralize` and `drop` make.

use std::cell::OnceCell;
use std::rc::Rc;

use super::{CurveSet, MeshSet, Property, count, hidden, number, points, shown};
use crate::elastic::{Fall, Frame, Lattice, Relaxation};
use crate::language::value::Value;
use crate::polygonize::Statistics;

/// A solid as tetrahedra, in R2 as triangles.
#[derive(Debug)]
pub struct SolidSet {
    /// The simplices.
    pub lattice: Lattice,
    /// How they came to rest.
    pub relaxation: Relaxation,
    boundary: OnceCell<Value>,
    ratios: OnceCell<Vec<f64>>,
}

impl SolidSet {
    /// A solid; what is not told here is found when it is first asked for.
    pub fn new(lattice: Lattice, relaxation: Relaxation) -> SolidSet {
        SolidSet {
            lattice,
            relaxation,
            boundary: OnceCell::new(),
            ratios: OnceCell::new(),
        }
    }

    /// The boundary: a mesh, or in R2 curves.
    fn boundary(&self) -> &Value {
        const METHOD: &str = "tetrahedralize";
        self.boundary.get_or_init(|| match self.lattice.dimension {
            2 => Value::Curves(Rc::new(CurveSet {
                certified: None,
                curves: self.lattice.curves(),
                method: METHOD,
                statistics: Statistics::default(),
            })),
            _ => Value::Mesh(Rc::new(MeshSet::new(self.lattice.mesh(), METHOD, None))),
        })
    }

    /// The radius ratios, ascending.
    fn ratios(&self) -> &[f64] {
        self.ratios
            .get_or_init(|| self.lattice.solid().radius_ratios())
    }

    fn simplices(&self, dimension: usize) -> Option<Value> {
        (self.lattice.dimension == dimension).then(|| {
            let corners = self.lattice.simplices.iter();
            let numbers = |simplex: &[u32; 4]| {
                let nodes = simplex.iter().take(dimension + 1);
                Value::numbers(nodes.map(|&node| f64::from(node)))
            };
            Value::list(corners.map(numbers).collect())
        })
    }
}

pub(super) const SOLID: &[Property<SolidSet>] = &[
    shown("nodes", |set| count(set.lattice.nodes.len())),
    shown("tetrahedra", |set| match set.lattice.dimension {
        3 => count(set.lattice.simplices.len()),
        _ => None,
    }),
    shown("triangles", |set| match set.lattice.dimension {
        2 => count(set.lattice.simplices.len()),
        _ => None,
    }),
    shown("pieces", |set| count(set.lattice.remarks.pieces)),
    shown("euler", |set| {
        number(set.lattice.euler_characteristic() as f64)
    }),
    shown("volume", |set| match set.lattice.dimension {
        3 => number(set.lattice.volume()),
        _ => None,
    }),
    shown("area", |set| match set.boundary() {
        Value::Mesh(mesh) => number(mesh.mesh.area()),
        _ => number(set.lattice.volume()),
    }),
    shown("length", |set| match set.boundary() {
        Value::Curves(curves) => number(curves.curves.length()),
        _ => None,
    }),
    shown("mean_ratio", |set| {
        let ratios = set.ratios();
        number(ratios.iter().sum::<f64>() / ratios.len() as f64)
    }),
    shown("hundredth_ratio", |set| {
        let ratios = set.ratios();
        number(*ratios.get(ratios.len() / 100)?)
    }),
    shown("worst_ratio", |set| number(*set.ratios().first()?)),
    shown("off_surface", |set| count(set.lattice.remarks.off_surface)),
    shown("steps", |set| count(set.relaxation.steps)),
    shown("at_rest", |set| Some(Value::Bool(set.relaxation.at_rest))),
    hidden("energy", |set| Some(Value::numbers(set.relaxation.energy))),
    hidden("boundary", |set| Some(set.boundary().clone())),
    hidden("points", |set| {
        Some(points(&set.lattice.nodes, set.lattice.dimension))
    }),
    hidden("cells", |set| set.simplices(3).or_else(|| set.simplices(2))),
];

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
