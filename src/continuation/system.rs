//! One or two equations whose solutions are a curve, and Newton's steps onto it.
//!
//! A curve in space is where F = 0 and G = 0. A curve in the plane is taken for the curve in space
//! where z = 0 and F(x, y) = 0, so that all that follows is written once. Both equations are
//! divided by the length of their gradients: what is left of them are distances and unit normals.

use std::cell::Cell;

use glam::DVec3;

use crate::engine::{CompiledField, Field};
use crate::geometry::length;

/// Newton's method converges in a handful of steps from where a predictor leads, or is not wanted.
const STEP_LIMIT: usize = 12;

/// On a sphere around a cusp branches are close to each other, and steps halve the distance until
/// they are closer to one than to the other.
const SPHERE_STEP_LIMIT: usize = 48;

/// Where surfaces touch, so many of Newton's steps lead to a residual of this part of the distance.
const TOUCHING_STEP_LIMIT: usize = 24;
const TOUCHING: f64 = 1e-8;

/// Steps that are not shorter than the last one by this factor are errors of rounding.
const STALLED: f64 = 0.9;

/// Steps that are shorter than this part of the coordinates are rounding.
const ROUNDING: f64 = 4e-16;

/// Normals with a smaller sine between them have no common plane of steps.
const PARALLEL: f64 = 1e-13;

/// The equations of a curve, with a count of what their solution costs.
pub(crate) struct System<'a> {
    /// F, or F and G.
    pub(crate) fields: Vec<&'a dyn Field>,
    /// 2 or 3.
    pub(crate) dimension: usize,
    /// The unit of length: the diagonal of the box.
    pub(crate) diagonal: f64,
    /// The largest distance from the curve that is accepted.
    pub(crate) tolerance: f64,
    evaluations: Cell<u64>,
    undefined: Cell<u64>,
}

/// The equations at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Local {
    /// F / |F_x| of each.
    pub(crate) distances: [f64; 2],
    /// F_x / |F_x| of each; 0 where the gradient vanishes.
    pub(crate) normals: [DVec3; 2],
    /// The product of the lengths of the gradients and the sine between them: 0 where the curve has
    /// no tangent.
    pub(crate) strength: f64,
}

impl Local {
    /// The direction of the curve, not of unit length: the product of the normals, as long as
    /// the sine between them. In the plane it has F < 0 on its left.
    pub(crate) fn direction(&self) -> DVec3 {
        self.normals[0].cross(self.normals[1])
    }

    /// The larger |F| / |F_x|.
    pub(crate) fn residual(&self) -> f64 {
        self.distances[0].abs().max(self.distances[1].abs())
    }
}

/// What Newton's method arrived at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corrected {
    pub(crate) position: DVec3,
    pub(crate) local: Local,
    /// The length of the first step.
    pub(crate) first: f64,
    /// That of the second, as a part of the first: the rate of contraction.
    pub(crate) contraction: f64,
    /// How far off the position may be: the length of steps that do not become shorter any more.
    pub(crate) noise: f64,
}

/// What is asked of a solution beside the equations.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Condition {
    /// Nothing: each step is the shortest, that of the Moore-Penrose inverse.
    Nearest,
    /// To lie in the plane through a point with this unit normal.
    Plane(DVec3, DVec3),
    /// To lie on the sphere with this centre and radius.
    Sphere(DVec3, f64),
}

impl<'a> System<'a> {
    /// The curve where all fields vanish: one field in R2, two in R3.
    pub(crate) fn new(fields: Vec<&'a dyn Field>, diagonal: f64, tolerance: f64) -> System<'a> {
        let dimension = fields.first().map_or(2, |field| field.dimension());
        System {
            fields,
            dimension,
            diagonal,
            tolerance,
            evaluations: Cell::new(0),
            undefined: Cell::new(0),
        }
    }

    /// Evaluations so far, enclosures included, and how many of them were undefined.
    pub(crate) fn counts(&self) -> (u64, u64) {
        (self.evaluations.get(), self.undefined.get())
    }

    /// Counts evaluations that were made elsewhere.
    pub(crate) fn count(&self, evaluations: u64) {
        self.evaluations.set(self.evaluations.get() + evaluations);
    }

    /// The compiled fields, if all are.
    pub(crate) fn compiled(&self) -> Option<Vec<&'a CompiledField>> {
        self.fields.iter().map(|field| field.compiled()).collect()
    }

    /// The equations at a point; `None` where one is undefined.
    pub(crate) fn local(&self, point: DVec3) -> Option<Local> {
        let mut local = Local {
            distances: [point.z, 0.0],
            normals: [DVec3::Z, DVec3::ZERO],
            strength: 1.0,
        };
        let first = 2 - self.fields.len().min(2);
        for (place, field) in (first..2).zip(&self.fields) {
            self.count(1);
            let (value, gradient) = field.value_gradient(point);
            let slope = length(gradient);
            if !(value.is_finite() && slope.is_finite()) {
                self.undefined.set(self.undefined.get() + 1);
                return None;
            }
            local.strength *= slope;
            if slope > 0.0 {
                local.distances[place] = value / slope;
                local.normals[place] = gradient / slope;
            } else {
                local.distances[place] = if value == 0.0 { 0.0 } else { f64::INFINITY };
                local.normals[place] = DVec3::ZERO;
            }
        }
        local.strength *= local.direction().length();
        Some(local)
    }

    /// Whether the equations hold at a point to the tolerance.
    fn holds(&self, local: &Local) -> bool {
        local.residual() <= self.tolerance
    }

    /// Newton's method from a start, with steps no longer than `reach`.
    ///
    /// It ends where steps have the length of rounding errors, or have ceased to become shorter
    /// and the residual is within the tolerance. `None` if that does not come about.
    pub(crate) fn solve(
        &self,
        start: DVec3,
        condition: Condition,
        reach: f64,
    ) -> Option<Corrected> {
        let mut position = start;
        let mut first = 0.0;
        let mut contraction = 0.0;
        let mut last = f64::INFINITY;
        let limit = match condition {
            Condition::Sphere(..) => SPHERE_STEP_LIMIT,
            _ => STEP_LIMIT,
        };
        for step in 0..limit {
            let local = self.local(position)?;
            let mut shift = newton_step(&local, position, condition)?;
            let mut size = shift.length();
            let floor = ROUNDING * (self.diagonal + position.abs().max_element());
            let stalled = step > 1 && size > STALLED * last && size <= self.tolerance;
            if size <= floor || stalled {
                return self.holds(&local).then_some(Corrected {
                    position,
                    local,
                    first,
                    contraction,
                    noise: if stalled { last } else { floor },
                });
            }
            if size > reach {
                if !matches!(condition, Condition::Sphere(..)) {
                    return None;
                }
                shift *= reach / size;
                size = reach;
            }
            match step {
                0 => first = size,
                1 => contraction = size / first,
                _ => {}
            }
            last = size;
            position += shift;
        }
        let local = self.local(position)?;
        (last <= self.tolerance && self.holds(&local)).then_some(Corrected {
            position,
            local,
            first,
            contraction,
            noise: last,
        })
    }
}

impl System<'_> {
    /// Whether both surfaces have a common point near a start, with a smaller sine between their
    /// normals than this. Where surfaces touch, each of Newton's steps halves the distance.
    pub(crate) fn touching(&self, start: DVec3, reach: f64, sine: f64) -> bool {
        let mut position = start;
        for _ in 0..TOUCHING_STEP_LIMIT {
            let Some(local) = self.local(position) else {
                return false;
            };
            if local.residual() <= TOUCHING * reach {
                return local.direction().length() < sine;
            }
            let Some(step) = newton_step(&local, position, Condition::Nearest) else {
                return false;
            };
            position += step;
            if position.distance(start) > reach {
                return false;
            }
        }
        false
    }
}

/// The step to where both tangent planes and the condition's meet, by the formula for three
/// planes; `None` where they have no common point.
fn newton_step(local: &Local, position: DVec3, condition: Condition) -> Option<DVec3> {
    let [a, b] = local.normals;
    let product = local.direction();
    let sine = product.length();
    if sine.is_nan() || sine <= PARALLEL {
        return None;
    }
    let (normal, offset) = match condition {
        Condition::Nearest => (product / sine, 0.0),
        Condition::Plane(through, normal) => (normal, (through - position).dot(normal)),
        Condition::Sphere(centre, radius) => {
            let out = position - centre;
            let distance = out.length();
            (out / distance, radius - distance)
        }
    };
    let determinant = normal.dot(product);
    let step = offset * product
        - local.distances[0] * b.cross(normal)
        - local.distances[1] * normal.cross(a);
    let step = step / determinant;
    (determinant.abs() > PARALLEL && step.is_finite()).then_some(step)
}
