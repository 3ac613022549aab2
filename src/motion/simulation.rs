//! A surface and its floaters, moving together: the loop of Witkin and Heckbert's section 5.
//!
//! A step sets the desired q̇ (Q: towards where a path wants q to be, and towards the rest shape), moves the
//! control points and the surface with them (`control`), and lets the floaters follow
//! ([`Followers`]).

use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use super::metric::{Metric, sensitivity};
use super::{Advance, Control, Freedom, MotionError, Pin, advance, toward_rest};
use crate::engine::{CompiledField, Field, Monitor, Program};
use crate::geometry::Samples;
use crate::math::scalar;
use crate::sample::{Followed, Followers, Options, SampleError, Statistics};

/// Of so many floaters, evenly picked, the sensitivity of parameters is learnt.
const PROBES: usize = 256;

/// While the surface moves a survey is made every so many steps.
const SURVEY: u64 = 4;

/// What a small change of q is, for a surface that moves.
#[derive(Clone, Debug)]
pub enum Measure {
    /// The one that compensates for how differently parameters move the surface, learnt anew in every step:
    /// see [`sensitivity`].
    Sensitivity,
    /// Always this one.
    Given(Metric),
}

/// How a surface is moved.
#[derive(Clone, Debug)]
pub struct Setting {
    /// How the floaters are made.
    pub options: Options,
    /// Whether the bounds of the options are walls that no floater passes. Without, they are only where the
    /// surface is at the beginning.
    pub walls: bool,
    /// What may change of q.
    pub freedom: Freedom,
    /// What a small change of q is.
    pub measure: Measure,
    /// The q of the rest shape, and which part of the way to it the surface would go in a unit of time.
    pub rest: Option<(Vec<f64>, f64)>,
}

/// Why there is no simulation, or no step.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SimulationError {
    /// The floaters.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The control points.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// There is no such control point.
    #[error("there is no control point {index}: {}", known(*count))]
    NoPin {
        /// Which was asked for.
        index: usize,
        /// How many there have been.
        count: usize,
    },
    /// More points were recorded than are allowed.
    #[error("the recording would have more than {limit} points")]
    TooLong {
        /// How many are allowed.
        limit: u64,
    },
}

fn known(count: usize) -> String {
    match count {
        0 => "nothing is pinned".to_owned(),
        1 => "only 0 has been pinned".to_owned(),
        _ => format!("0 to {} have been pinned", count - 1),
    }
}

/// A control point that may be on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ControlPoint {
    position: DVec3,
    /// Where it goes, and how much time is left for that.
    goal: Option<(DVec3, f64)>,
}

impl ControlPoint {
    /// As it moves in a step of this time.
    fn pin(&self, time: f64) -> Pin {
        let velocity = match self.goal {
            Some((goal, left)) if time > 0.0 => (goal - self.position) / left.max(time),
            _ => DVec3::ZERO,
        };
        Pin {
            position: self.position,
            velocity,
        }
    }

    fn arrive(&mut self, position: DVec3, time: f64) {
        self.position = position;
        if time > 0.0 {
            // What is left of the time is rounding if it is a tiny part of the step.
            self.goal = self
                .goal
                .map(|(goal, left)| (goal, left - time))
                .filter(|(_, left)| *left > 1e-9 * time);
        }
    }
}

/// One picture of a moving surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// When.
    pub time: f64,
    /// The floaters.
    pub samples: Samples,
    /// The control points.
    pub pins: Vec<DVec3>,
}

/// Frames, one every so many steps.
#[derive(Clone, Debug)]
struct Film {
    every: u64,
    frames: Vec<Frame>,
}

/// What a step did.
#[derive(Clone, Debug)]
pub struct Step {
    /// The surface and the control points; `None` where q went along its path alone, or nothing moved it.
    pub advance: Option<Advance>,
    /// The floaters.
    pub followed: Followed,
    /// Whether no floater is left.
    pub vanished: bool,
    /// Whether there are as many floaters as there may be.
    pub full: bool,
}

/// A surface that moves, with floaters on it and control points that move it.
pub struct Simulation {
    program: Arc<Program>,
    q: Vec<f64>,
    setting: Setting,
    followers: Followers,
    pins: Vec<Option<ControlPoint>>,
    time: f64,
    steps: u64,
    film: Option<Film>,
}

impl Simulation {
    /// A surface at rest, covered by floaters; and how they came about.
    ///
    /// # Errors
    /// If there is no sample of the surface.
    pub fn new(
        program: Arc<Program>,
        q: Vec<f64>,
        setting: Setting,
        monitor: &dyn Monitor,
    ) -> Result<(Simulation, Statistics), SimulationError> {
        let field = CompiledField::new(Arc::clone(&program), q.clone());
        let (followers, statistics) =
            Followers::new(&field, &setting.options, setting.walls, monitor)?;
        let simulation = Simulation {
            program,
            q,
            setting,
            followers,
            pins: Vec::new(),
            time: 0.0,
            steps: 0,
            film: None,
        };
        Ok((simulation, statistics))
    }

    /// The surface as it is now.
    pub fn field(&self) -> CompiledField {
        CompiledField::new(Arc::clone(&self.program), self.q.clone())
    }

    /// The program of the surface.
    pub fn program(&self) -> &Arc<Program> {
        &self.program
    }

    /// q, in the order of the program's parameters.
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// The time that has passed.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The number of steps that were made.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The floaters.
    pub fn followers(&self) -> &Followers {
        &self.followers
    }

    /// The control points that are there, with their numbers, and |F|/|F_x| at each.
    pub fn pins(&self) -> Vec<(usize, DVec3, f64)> {
        let field = self.field();
        let pins = self.pins.iter().enumerate();
        pins.filter_map(|(index, pin)| {
            let position = pin.as_ref()?.position;
            let (value, gradient) = field.value_gradient(position);
            let distance = match value == 0.0 {
                true => 0.0,
                false => value.abs() / gradient.length(),
            };
            Some((index, position, distance))
        })
        .collect()
    }

    /// Adds a control point and gives its number. The surface goes to it with the next step.
    pub fn pin(&mut self, position: DVec3) -> usize {
        self.pins.push(Some(ControlPoint {
            position,
            goal: None,
        }));
        self.pins.len() - 1
    }

    /// Lets a control point go to a place, straight and evenly, in so much time; at once if that is 0,
    /// which is to say in the next step.
    ///
    /// # Errors
    /// If there is no such point.
    pub fn drag(&mut self, index: usize, goal: DVec3, time: f64) -> Result<(), SimulationError> {
        let count = self.pins.len();
        match self.pins.get_mut(index) {
            Some(Some(pin)) => {
                pin.goal = Some((goal, time));
                Ok(())
            }
            _ => Err(SimulationError::NoPin { index, count }),
        }
    }

    /// Takes a control point away.
    ///
    /// # Errors
    /// If there is no such point.
    pub fn release(&mut self, index: usize) -> Result<(), SimulationError> {
        let count = self.pins.len();
        match self.pins.get_mut(index) {
            Some(pin @ Some(_)) => {
                *pin = None;
                Ok(())
            }
            _ => Err(SimulationError::NoPin { index, count }),
        }
    }

    /// Records a frame now and after every so many steps. What was recorded before is gone.
    pub fn record(&mut self, every: u64) {
        self.film = Some(Film {
            every: every.max(1),
            frames: vec![self.frame()],
        });
    }

    /// The frames that were recorded.
    pub fn frames(&self) -> &[Frame] {
        self.film.as_ref().map_or(&[], |film| &film.frames)
    }

    /// One step of this time. `path` is the q that is wanted at its end, as far as control points
    /// allow.
    ///
    /// # Errors
    /// If the monitor cancels, or the recording is too long; the state is then that before the step,
    /// or that of some part of it, and can go on.
    pub fn step(
        &mut self,
        time: f64,
        path: Option<&[f64]>,
        monitor: &dyn Monitor,
    ) -> Result<Step, SimulationError> {
        self.check_recording()?;
        let before = self.q.clone();
        let advance = self.advance(time, path)?;
        let mut followed = self
            .followers
            .follow(&self.program, [&before, &self.q], monitor)?;
        self.time += time;
        self.steps += 1;
        self.survey(&before, &mut followed, monitor)?;
        if self
            .film
            .as_ref()
            .is_some_and(|film| self.steps.is_multiple_of(film.every))
        {
            let frame = self.frame();
            if let Some(film) = &mut self.film {
                film.frames.push(frame);
            }
        }
        Ok(Step {
            advance,
            followed,
            vanished: self.followers.is_empty(),
            full: self.followers.is_full(),
        })
    }

    /// Looks for parts of the surface that no floater is on: now and then, and when some were lost.
    fn survey(
        &mut self,
        before: &[f64],
        followed: &mut Followed,
        monitor: &dyn Monitor,
    ) -> Result<(), SimulationError> {
        let is_moving = before != self.q;
        let is_due = self.steps.is_multiple_of(SURVEY) && is_moving;
        if is_due || followed.lost > 0 || (self.followers.is_empty() && is_moving) {
            let pins: Vec<DVec3> = self.pins.iter().flatten().map(|pin| pin.position).collect();
            let field = self.field();
            self.followers.survey(&field, &pins, followed);
            if self.followers.is_empty() {
                self.followers.search(&field, monitor)?;
            }
        }
        Ok(())
    }

    /// Moves the surface and the control points.
    fn advance(
        &mut self,
        time: f64,
        path: Option<&[f64]>,
    ) -> Result<Option<Advance>, SimulationError> {
        let mut desired = vec![0.0; self.q.len()];
        if let Some((rest, rate)) = &self.setting.rest {
            // So fast that after the step the exponential part of the way is left, however long it is.
            let part = 1.0 - scalar::exp(-rate * time);
            if time > 0.0 {
                desired = toward_rest(&self.q, rest, part / time);
            }
        }
        let is_free = self.pins.iter().all(Option::is_none);
        match path {
            Some(path) if is_free && self.setting.rest.is_none() => {
                self.q.copy_from_slice(path);
                return Ok(None);
            }
            Some(path) if time > 0.0 => {
                for ((desired, to), from) in desired.iter_mut().zip(path).zip(&self.q) {
                    *desired += (to - from) / time;
                }
            }
            _ if is_free && self.setting.rest.is_none() => return Ok(None),
            _ => {}
        }
        let field = self.field();
        let tolerance = self.followers.tolerance();
        let metric = match &self.setting.measure {
            Measure::Sensitivity => sensitivity(&field, &self.probes()),
            Measure::Given(metric) => metric.clone(),
        };
        let control = Control {
            metric,
            freedom: self.setting.freedom.clone(),
            ..Control::new(self.q.len(), tolerance)
        };
        let pins: Vec<Pin> = self
            .pins
            .iter()
            .flatten()
            .map(|pin| pin.pin(time))
            .collect();
        let advance = advance(&field, &pins, &desired, &control, time)?;
        self.q.clone_from(&advance.q);
        for (pin, &position) in self.pins.iter_mut().flatten().zip(&advance.positions) {
            pin.arrive(position, time);
        }
        Ok(Some(advance))
    }

    /// Places all over the surface.
    fn probes(&self) -> Vec<DVec3> {
        let positions = self.followers.samples().positions;
        let stride = positions.len().div_ceil(PROBES).max(1);
        positions.into_iter().step_by(stride).collect()
    }

    /// How it is now.
    pub fn frame(&self) -> Frame {
        Frame {
            time: self.time,
            samples: self.followers.samples(),
            pins: self.pins.iter().flatten().map(|pin| pin.position).collect(),
        }
    }

    fn check_recording(&self) -> Result<(), SimulationError> {
        let limit = self.setting.options.count_limit;
        let points = self
            .frames()
            .iter()
            .map(|frame| frame.samples.positions.len() as u64);
        match points.sum::<u64>() + self.followers.len() as u64 > limit && self.film.is_some() {
            true => Err(SimulationError::TooLong { limit }),
            false => Ok(()),
        }
    }
}
