//! A fall from the beginning to its end: frames of the boundary, and where the energy was.

use glam::DVec3;

use super::ElasticError;
use super::body::{Body, Energy, Ground, Material};
use super::boundary::Skin;
use super::lattice::{Lattice, Remarks};
use crate::engine::Monitor;
use crate::geometry::{Curves, Mesh};

/// What the monitor is told.
const PHASE: &str = "falling";

/// The energy may change by this part of that of the beginning before the fall is given up.
const TOLERANCE: f64 = 0.25;

/// A body that rises by this part of its height has left the ground.
const BOUNCE: f64 = 0.01;

/// How a solid falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drop {
    /// What it is made of.
    pub material: Material,
    /// What it falls on.
    pub ground: Ground,
    /// How high above the ground its lowest point is at the beginning.
    pub height: f64,
    /// For how long, at least: until the first frame that is not earlier.
    pub time: f64,
    /// The time from frame to frame.
    pub every: f64,
    /// The most steps of time.
    pub step_limit: u64,
    /// The most points of all frames.
    pub point_limit: u64,
}

impl Drop {
    /// The usual fall of a solid of this lattice: E = 100 ρ g (height + the solid's own height), so that the impact
    /// compresses it by about a seventh (the speed of the impact over that of sound), and
    /// as much resistance to changes of volume.
    pub fn new(lattice: &Lattice, density: f64, gravity: f64, height: f64) -> Drop {
        let up = lattice.dimension - 1;
        let heights = lattice.nodes.iter().map(|node| node[up]);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        let stiffness = 100.0 * density * gravity * (height + high - low);
        Drop {
            material: Material {
                density,
                stiffness,
                volume_stiffness: stiffness,
                damping: 0.01,
            },
            ground: Ground {
                gravity,
                restitution: 0.7,
                friction: 0.5,
            },
            height,
            time: 3.0,
            every: 0.04,
            step_limit: 5_000_000,
            point_limit: 10_000_000,
        }
    }
}

/// The boundary at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// When.
    pub time: f64,
    /// Where the energy was.
    pub energy: Energy,
    /// Where the nodes of the boundary were.
    pub places: Vec<DVec3>,
}

/// A solid that fell.
#[derive(Clone, Debug)]
pub struct Fall {
    /// 2 or 3.
    pub dimension: usize,
    /// The numbers of nodes, simplices and springs.
    pub counts: [usize; 3],
    /// What is remarkable about the lattice.
    pub remarks: Remarks,
    /// The step of time that was found to be stable.
    pub step: f64,
    /// The number of steps.
    pub steps: u64,
    /// The frames, the first at time 0.
    pub frames: Vec<Frame>,
    /// The lowest that any node was.
    pub lowest: f64,
    /// How often all of the body left the ground again, by more than a hundredth of its height.
    pub bounces: usize,
    /// The most simplices that were inverted in a frame.
    pub inverted: usize,
    /// When the energy was no longer kept, so that the fall ended early, if that happened.
    pub broken: Option<f64>,
    skin: Skin,
}

impl Fall {
    /// Lets a solid fall.
    ///
    /// The cost is linear in springs, simplices and steps. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    ///
    /// Numbers that make no sense, too many steps or points, and cancellation. A fall whose energy is not kept, or no longer a number, is
    /// no error: it ends there, with the frames until then.
    pub fn new(
        lattice: &Lattice,
        drop: &Drop,
        monitor: &dyn Monitor,
    ) -> Result<Fall, ElasticError> {
        check(drop)?;
        let mut body = Body::new(lattice, drop.material, drop.ground, drop.height)?;
        let frames = (drop.time / drop.every * (1.0 - 1e-12)).ceil();
        let between = (drop.every / body.stable_step()).ceil().max(1.0);
        let steps = frames * between;
        if steps > drop.step_limit as f64 {
            let limit = drop.step_limit;
            return Err(ElasticError::TooManySteps { steps, limit });
        }
        let skin = lattice.skin();
        let points = (frames + 1.0) * skin.nodes.len() as f64;
        if points > drop.point_limit as f64 {
            let limit = drop.point_limit;
            return Err(ElasticError::TooManyPoints { points, limit });
        }
        let step = drop.every / between;
        let mut fall = Fall {
            dimension: lattice.dimension,
            counts: [
                lattice.nodes.len(),
                lattice.simplices.len(),
                lattice.springs.len(),
            ],
            remarks: lattice.remarks,
            step,
            steps: 0,
            frames: Vec::new(),
            lowest: f64::INFINITY,
            bounces: 0,
            inverted: 0,
            broken: None,
            skin,
        };
        fall.take(&mut body, drop.every);
        let heights = body.positions();
        let up = lattice.dimension - 1;
        let top = heights.iter().map(|place| place[up]).fold(0.0, f64::max);
        let clearance = BOUNCE * (top - drop.height);
        let mut touched = false;
        for frame in 0..frames as u64 {
            monitor.progress(PHASE, frame as f64 / frames);
            for _ in 0..between as u64 {
                if monitor.cancelled() {
                    return Err(ElasticError::Cancelled);
                }
                body.step(step);
                fall.steps += 1;
                let lowest = body.lowest();
                fall.lowest = fall.lowest.min(lowest);
                if touched && lowest > clearance {
                    fall.bounces += 1;
                }
                touched = lowest <= 0.0 || (touched && lowest <= clearance);
            }
            fall.take(&mut body, drop.every);
            let error = fall.energy_error();
            if error.is_nan() || error > TOLERANCE {
                fall.frames.pop();
                fall.broken = Some(body.time());
                break;
            }
        }
        monitor.progress(PHASE, 1.0);
        Ok(fall)
    }

    /// Adds a frame, so long after the last one.
    fn take(&mut self, body: &mut Body, every: f64) {
        let frame = Frame {
            time: self.frames.len() as f64 * every,
            energy: body.energy(self.step),
            places: self.skin.places(&body.positions()),
        };
        self.lowest = self.lowest.min(body.lowest());
        self.inverted = self.inverted.max(body.inverted());
        self.frames.push(frame);
    }

    /// The greatest difference of the total energy from that of the beginning, in parts of it.
    pub fn energy_error(&self) -> f64 {
        let Some(first) = self.frames.first() else {
            return 0.0;
        };
        let begin = first.energy.total();
        let errors = self
            .frames
            .iter()
            .map(|frame| (frame.energy.total() - begin).abs() / begin);
        // Unlike `f64::max`, this keeps what is not a number.
        errors.fold(0.0, |most, error| match error <= most {
            true => most,
            false => error,
        })
    }

    /// The boundary in a frame as a mesh with normals; in R2 one without triangles.
    pub fn mesh(&self, frame: &Frame) -> Mesh {
        self.skin.mesh_of(frame.places.clone())
    }

    /// The boundary in a frame as curves; in R3 none.
    pub fn curves(&self, frame: &Frame) -> Curves {
        self.skin.curves_of(&frame.places)
    }
}

/// Whether the numbers that are no body's make sense.
fn check(drop: &Drop) -> Result<(), ElasticError> {
    for (name, value) in [("time", drop.time), ("every", drop.every)] {
        if !(value > 0.0 && value.is_finite()) {
            let demand = "greater than 0 and finite";
            return Err(ElasticError::Number {
                name,
                value,
                demand,
            });
        }
    }
    Ok(())
}
