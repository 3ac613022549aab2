//! Floaters on a surface that moves (Witkin and Heckbert, section 3.3): equation 5 with F_q · q̇.
//!
//! ```text
//! ṗ^i = P^i - (F_x · P^i + F_q · q̇ + φ F) / (F_x · F_x) F_x      (5)
//! ```
//!
//! Splits into what the surface does to a floater and what floaters do to each other:
//!
//! 1. *Carried* by the surface: along the normal by -F_q · Δq / |F_x|, and along the surface so that
//!    the floater keeps its normal (Stam and Schmidt, "On the velocity of an implicit surface", ACM
//!    Transactions on Graphics 30, 2011): the tangential t with d(F_x) parallel to F_x,
//!    S t = -(F_xq Δq + s F_xx n) / |F_x| in the tangent plane, S = F_xx / |F_x| there. Without it
//!    floaters on a body that is moved stay behind, crowd at its back and are born at its front.
//!    Where the surface is flat nothing tells how it moves along itself, and t is 0.
//! 2. *Repelled* by each other, with births and deaths: one step of the paper's adaptive repulsion.
//! 3. *Put* on F = 0 by Newton's method; the paper's feedback φ leaves a few thousandths of a radius.
//!
//! A change of q that carries a floater farther than a radius is made in parts. Who cannot follow
//! dies, and fission fills what is missing.

use std::sync::Arc;

use glam::{DMat2, DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::FISSION_STREAM;
use super::fission::{Dice, Target};
use super::population::{Floater, Population};
use super::run::LARGEST;
use crate::engine::{CompiledField, Field, Monitor, Program};
use crate::geometry::{Bounds, Samples};
use crate::sample::newton::{Point, Polish, polish};
use crate::sample::random::Stream;
use crate::sample::statistics::{Stopwatch, Times};
use crate::sample::{Options, Outcome, SampleError, Statistics, sample};

/// Floaters that share calls of the field.
const CHUNK: usize = 256;

/// σ̂ in units of the radius at rest, half the spacing: who is as far from the others as at the
/// beginning is not about to split.
const SLACK: f64 = 1.1;

/// A change of q is made in parts in which no floater is carried farther than this, in σ̂.
const FARTHEST: f64 = 1.0;

/// And in at most so many parts.
const MOST_PARTS: usize = 64;

/// Floaters that are off the surface by this part of σ̂ after they were carried may repel each other.
const NEAR: f64 = 0.05;

/// Curvatures below this part of 1 / extent count as flat.
const FLAT: f64 = 0.3;

/// The population may grow to so many times the first one.
const GROWTH: usize = 32;

/// How far a floater that lost the surface looks for it, in radii.
const LEASH: f64 = 4.0;

/// The room around floaters in which they may move when no box is given, in σ̂ and in extents.
const ROOM: (f64, f64) = (8.0, 0.1);

/// What [`Followers::follow`] did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// Floaters born by fission.
    pub births: u64,
    /// Floaters that died of crowding.
    pub deaths: u64,
    /// Floaters that lost the surface.
    pub lost: u64,
    /// In how many parts q was changed.
    pub parts: u32,
    /// How far the surface carried a floater, at most.
    pub farthest: f64,
    /// Whether the change was so large that a part of it carried floaters farther than their radius.
    pub rough: bool,
    /// Evaluations of F and its derivatives at one point.
    pub evaluations: u64,
    /// How long each phase took.
    pub times: Times,
}

/// Floaters that follow a moving surface.
pub struct Followers {
    floaters: Vec<Floater>,
    dice: Dice,
    options: Options,
    target: Target,
    /// The box that floaters do not leave; none for a surface that may go anywhere.
    walls: Option<Bounds>,
    capacity: usize,
    dimension: usize,
    /// Points may be off the surface by so much.
    tolerance: f64,
}

impl Followers {
    /// Floaters at rest on the surface as it is now: those of [`sample()`], without creases. With
    /// `walls` no floater leaves the bounds that the options give; without, the bounds are where the
    /// surface is searched for now.
    ///
    /// # Errors
    /// Those of [`sample()`].
    pub fn new(
        field: &CompiledField,
        options: &Options,
        walls: bool,
        monitor: &dyn Monitor,
    ) -> Result<(Followers, Statistics), SampleError> {
        let Outcome {
            samples,
            statistics,
        } = sample(field, options, monitor)?;
        let spacing_radius = samples.radii.first().copied().unwrap_or(1.0);
        let desired = SLACK * spacing_radius;
        let mut followers = Followers {
            floaters: Vec::new(),
            dice: Dice::new(Stream::new(options.seed, FISSION_STREAM + 1)),
            options: options.clone(),
            target: Target {
                desired,
                largest: LARGEST * desired,
                in_turn: true,
            },
            walls: options.bounds.filter(|_| walls),
            capacity: usize::try_from(options.count_limit)
                .unwrap_or(usize::MAX)
                .min(GROWTH * samples.positions.len().max(1)),
            dimension: field.dimension(),
            tolerance: options.tolerance * statistics.bounds.diagonal(),
        };
        followers.place(field, &samples, spacing_radius);
        Ok((followers, statistics))
    }

    /// Puts floaters on the points of a sample.
    fn place(&mut self, field: &CompiledField, samples: &Samples, radius: f64) {
        let mut population = Population::new(field, self.room(), self.options.rules);
        let here = population.evaluate(&samples.positions);
        let points = samples.positions.iter().zip(here);
        self.floaters = points
            .map(|(&position, here)| Floater::at_rest(Point { position, here }, radius))
            .collect();
    }

    /// The number of floaters.
    pub fn len(&self) -> usize {
        self.floaters.len()
    }

    /// Whether there are none: the surface has vanished, or nobody could follow it.
    pub fn is_empty(&self) -> bool {
        self.floaters.is_empty()
    }

    /// Whether there are as many as there may be.
    pub fn is_full(&self) -> bool {
        self.floaters.len() >= self.capacity
    }

    /// σ̂: the radius that floaters strive for.
    pub fn desired_radius(&self) -> f64 {
        self.target.desired
    }

    /// How far from the surface a point may be.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Where they are, with their radii and their distances from the surface.
    pub fn samples(&self) -> Samples {
        let floaters = self.floaters.iter();
        Samples {
            dimension: self.dimension,
            positions: floaters.clone().map(|floater| floater.position).collect(),
            normals: floaters.clone().map(|floater| floater.normal).collect(),
            radii: floaters.clone().map(|floater| floater.radius).collect(),
            residuals: floaters.map(|floater| floater.here.distance()).collect(),
            ..Samples::default()
        }
    }

    /// Searches the surface anew, where no floater is left.
    ///
    /// # Errors
    /// Those of [`sample()`].
    pub fn search(
        &mut self,
        field: &CompiledField,
        monitor: &dyn Monitor,
    ) -> Result<(), SampleError> {
        let options = Options {
            count: None,
            spacing: Some(2.0 * self.target.desired / SLACK),
            ..self.options.clone()
        };
        let found = sample(field, &options, monitor)?;
        let radius = self.target.desired / SLACK;
        self.place(field, &found.samples, radius);
        Ok(())
    }

    /// Follows the surface while q changes from one value to another, both in the order of the
    /// program's parameters, and takes a step of adaptive repulsion.
    ///
    /// About seven evaluations a floater and part; the number of parts grows with the change.
    ///
    /// # Errors
    /// If the monitor cancels; the floaters are then those of some part.
    pub fn follow(
        &mut self,
        program: &Arc<Program>,
        [from, to]: [&[f64]; 2],
        monitor: &dyn Monitor,
    ) -> Result<Followed, SampleError> {
        let stopwatch = Stopwatch::new(monitor);
        let mut followed = Followed::default();
        let between = |part: f64| {
            let q = from.iter().zip(to).map(|(a, b)| a + part * (b - a));
            CompiledField::new(Arc::clone(program), q.collect())
        };
        stopwatch.progress("move", 0.0);
        let change: Vec<f64> = from.iter().zip(to).map(|(a, b)| b - a).collect();
        let mut before = CompiledField::new(Arc::clone(program), from.to_vec());
        let is_moving = change.iter().any(|&change| change != 0.0);
        let mut shifts = match is_moving {
            true => self.shifts(&before, &change, &mut followed),
            false => Vec::new(),
        };
        let whole = shifts.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        let wanted = whole / (FARTHEST * self.target.desired);
        let parts = (wanted.ceil() as usize).clamp(1, MOST_PARTS);
        followed.rough = wanted > MOST_PARTS as f64;
        followed.parts = parts as u32;
        for part in 1..=parts {
            if monitor.cancelled() {
                return Err(SampleError::Cancelled);
            }
            let after = match part == parts {
                true => CompiledField::new(Arc::clone(program), to.to_vec()),
                false => between(part as f64 / parts as f64),
            };
            if is_moving {
                stopwatch.progress("move", 0.0);
                let change: Vec<f64> = change.iter().map(|c| c / parts as f64).collect();
                if part > 1 {
                    shifts = self.shifts(&before, &change, &mut followed);
                } else {
                    shifts.iter_mut().for_each(|shift| *shift /= parts as f64);
                }
                self.carry([&before, &after], &shifts, &mut followed);
            }
            stopwatch.progress("repel", 0.0);
            self.repel(&after, &mut followed);
            before = after;
        }
        followed.times = stopwatch.times();
        Ok(followed)
    }

    /// The box in which floaters may move.
    fn room(&self) -> Bounds {
        if let Some(walls) = self.walls {
            return walls;
        }
        let places = self.floaters.iter().map(|floater| floater.position);
        let around = Bounds::of_points(self.dimension, places);
        let around = around.or(self.options.bounds).unwrap_or(Bounds {
            dimension: self.dimension,
            min: DVec3::ZERO,
            max: DVec3::ZERO,
        });
        let margin = ROOM.0 * self.target.desired + ROOM.1 * around.diagonal();
        let mut room = around;
        for axis in 0..self.dimension {
            room.min[axis] -= margin;
            room.max[axis] += margin;
        }
        room
    }

    /// -F_q · Δq / |F_x| at every floater: how far the surface goes along its normal.
    fn shifts(&self, field: &CompiledField, change: &[f64], followed: &mut Followed) -> Vec<f64> {
        let shifts: Vec<f64> = self
            .floaters
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| {
                let rates = rates(field, chunk, change);
                chunk
                    .iter()
                    .zip(rates)
                    .map(|(floater, rate)| {
                        let shift = -rate / floater.here.gradient.length();
                        if shift.is_finite() { shift } else { 0.0 }
                    })
                    .collect::<Vec<_>>()
            })
            .collect();
        followed.evaluations += self.floaters.len() as u64;
        let farthest = shifts.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        followed.farthest = followed.farthest.max(farthest);
        shifts
    }

    /// Carries the floaters with the surface, from one field to the next.
    fn carry(
        &mut self,
        [before, after]: [&CompiledField; 2],
        shifts: &[f64],
        followed: &mut Followed,
    ) {
        let longest = shifts.iter().fold(0.0, |most: f64, s| most.max(s.abs()));
        let places = self.floaters.iter().map(|floater| floater.position);
        let extent = Bounds::of_points(self.dimension, places).map_or(0.0, |box_| box_.diagonal());
        let flat = FLAT / extent.max(f64::MIN_POSITIVE);
        let mut population = Population::new(after, self.room(), self.options.rules);
        let old: Vec<DVec3> = self
            .floaters
            .iter()
            .map(|floater| floater.position)
            .collect();
        let there = population.evaluate(&old);
        let hessians: Vec<DMat3> = self
            .floaters
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| hessians(before, chunk))
            .collect();
        let room = population.bounds;
        let places: Vec<DVec3> = self
            .floaters
            .iter()
            .zip(shifts)
            .zip(hessians.iter().zip(&there))
            .map(|((floater, &shift), (hessian, there))| {
                let turn = there.gradient - floater.here.gradient;
                let along = keeping_normal(floater, shift, *hessian, turn, (flat, self.dimension));
                let along = along.clamp_length_max(longest);
                let place = floater.position + shift * floater.normal + along;
                let place = if place.is_finite() {
                    place
                } else {
                    floater.position
                };
                place.clamp(room.min, room.max)
            })
            .collect();
        let there = population.evaluate(&places);
        for ((floater, place), there) in self.floaters.iter_mut().zip(places).zip(there) {
            floater.position = place;
            floater.here = there;
            let normal = there.normal();
            if normal != DVec3::ZERO {
                floater.normal = normal;
            }
            floater.is_fixed = false;
        }
        followed.evaluations += 3 * self.floaters.len() as u64;
        // Repulsion begins on the surface, or so close to it that it may end there.
        let near = NEAR * self.target.desired;
        let is_near = |floater: &Floater| floater.here.distance() <= near;
        if !self.floaters.iter().all(is_near) {
            self.put_on(after, followed);
        }
    }

    /// One step of adaptive repulsion.
    fn repel(&mut self, field: &CompiledField, followed: &mut Followed) {
        if self.floaters.is_empty() {
            return;
        }
        let mut population = Population::new(field, self.room(), self.options.rules);
        population.floaters = std::mem::take(&mut self.floaters);
        population.capacity = self.capacity;
        population.skin = 0.0;
        let changes = population.adapt(self.target, &mut self.dice);
        followed.births += changes.births;
        followed.deaths += changes.deaths;
        followed.evaluations += population.tally.evaluations;
        self.floaters = std::mem::take(&mut population.floaters);
        self.put_on(field, followed);
    }

    /// Puts floaters on the surface to the tolerance; who finds none near is lost.
    fn put_on(&mut self, field: &CompiledField, followed: &mut Followed) {
        let mut population = Population::new(field, self.room(), self.options.rules);
        population.floaters = std::mem::take(&mut self.floaters);
        population.land(self.tolerance);
        followed.evaluations += population.tally.evaluations;
        self.floaters = std::mem::take(&mut population.floaters);
        let is_off = |floater: &Floater| {
            let distance = floater.here.distance();
            distance.is_nan() || distance > self.tolerance || !floater.here.is_defined()
        };
        let off: Vec<usize> = (0..self.floaters.len())
            .filter(|&index| is_off(&self.floaters[index]))
            .collect();
        if off.is_empty() {
            return;
        }
        let diagonal = population.bounds.diagonal();
        let wanted = Polish {
            tolerance: self.tolerance,
            leash: LEASH * self.target.desired,
            diagonal,
        };
        let points = off.iter().map(|&index| Point {
            position: self.floaters[index].position,
            here: self.floaters[index].here,
        });
        let (polished, evaluations) = polish(field, &wanted, points);
        followed.evaluations += evaluations;
        let walls = population.bounds;
        let mut stays = vec![true; self.floaters.len()];
        for (&index, point) in off.iter().zip(polished) {
            match point.filter(|point| walls.contains(point.position)) {
                Some(point) => {
                    let floater = &mut self.floaters[index];
                    floater.position = point.position;
                    floater.here = point.here;
                    floater.normal = point.here.normal();
                }
                None => {
                    stays[index] = false;
                    followed.lost += 1;
                }
            }
        }
        let mut stays = stays.into_iter();
        self.floaters.retain(|_| stays.next() != Some(false));
    }
}

/// F_q · Δq at the floaters.
fn rates(field: &CompiledField, floaters: &[Floater], change: &[f64]) -> Vec<f64> {
    let number = floaters.len();
    let columns = columns(floaters);
    let points = columns.each_ref().map(Vec::as_slice);
    let dimension = field.dimension();
    let mut values = vec![0.0; number];
    let mut gradients = [(); 3].map(|()| vec![0.0; number]);
    let mut by_parameter = vec![vec![0.0; number]; change.len()];
    field.parameter_gradients(
        &points[..dimension],
        &mut values,
        &mut gradients.each_mut().map(Vec::as_mut_slice)[..dimension],
        &mut by_parameter
            .iter_mut()
            .map(Vec::as_mut_slice)
            .collect::<Vec<_>>(),
    );
    let mut rates = vec![0.0; number];
    for (column, &change) in by_parameter.iter().zip(change) {
        if change != 0.0 {
            for (rate, derivative) in rates.iter_mut().zip(column) {
                *rate += change * derivative;
            }
        }
    }
    rates
}

/// F_xx at the floaters.
fn hessians(field: &CompiledField, floaters: &[Floater]) -> Vec<DMat3> {
    let number = floaters.len();
    let columns = columns(floaters);
    let points = columns.each_ref().map(Vec::as_slice);
    let dimension = field.dimension();
    let mut values = vec![0.0; number];
    let mut gradients = [(); 3].map(|()| vec![0.0; number]);
    let mut entries = vec![vec![0.0; number]; dimension * (dimension + 1) / 2];
    field.hessians(
        &points[..dimension],
        &mut values,
        &mut gradients.each_mut().map(Vec::as_mut_slice)[..dimension],
        &mut entries
            .iter_mut()
            .map(Vec::as_mut_slice)
            .collect::<Vec<_>>(),
    );
    let mut hessians = vec![DMat3::ZERO; number];
    let pairs = (0..dimension).flat_map(|row| (row..dimension).map(move |column| (row, column)));
    for ((row, column), entries) in pairs.zip(&entries) {
        for (hessian, &entry) in hessians.iter_mut().zip(entries) {
            hessian.col_mut(row)[column] = entry;
            hessian.col_mut(column)[row] = entry;
        }
    }
    hessians
}

/// Where floaters are, a column an axis.
fn columns(floaters: &[Floater]) -> [Vec<f64>; 3] {
    let column = |axis: usize| {
        floaters
            .iter()
            .map(|floater| floater.position[axis])
            .collect()
    };
    [column(0), column(1), column(2)]
}

/// How far a floater goes along the surface to keep its normal, while it goes `shift` along the normal
/// and F_x changes by `turn` where it is.
fn keeping_normal(
    floater: &Floater,
    shift: f64,
    hessian: DMat3,
    turn: DVec3,
    (flat, dimension): (f64, usize),
) -> DVec3 {
    let slope = floater.here.gradient.length();
    let normal = floater.normal;
    let change = (turn + shift * (hessian * normal)) / slope;
    let along = if dimension == 2 {
        let tangent = DVec3::new(-normal.y, normal.x, 0.0);
        let curvature = tangent.dot(hessian * tangent) / slope;
        let damped = curvature / (curvature * curvature + flat * flat);
        -damped * tangent.dot(change) * tangent
    } else {
        let (one, other) = normal.any_orthonormal_pair();
        let [image, other_image] = [one, other].map(|tangent| hessian * tangent / slope);
        let (a, b, c) = (one.dot(image), one.dot(other_image), other.dot(other_image));
        let shape = DMat2::from_cols_array(&[a, b, b, c]);
        let damped = shape * shape + DMat2::from_diagonal(DVec2::splat(flat * flat));
        let change = DVec2::new(one.dot(change), other.dot(change));
        let along = -(damped.inverse() * (shape * change));
        along.x * one + along.y * other
    };
    if along.is_finite() {
        along
    } else {
        DVec3::ZERO
    }
}
