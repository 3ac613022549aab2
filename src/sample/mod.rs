//! Samplers: points on the zero set.
//!
//! A sampler takes a [`Field`] and returns [`Samples`]: points with their normals, radii and
//! residuals. [`sample`] is the one entry; each method has a file of its own. Samplers know of
//! fields only what the `Field` trait says, and neither the language nor the command line.
//!
//! The default are the floaters of Witkin and Heckbert, which spread evenly over the surface by
//! repulsion (`floaters`). The others are the physically-based particles of Figueiredo and Gomes
//! ("Physically-based sampling of implicit objects"): many particles are released at random,
//! each moves towards the surface on its own, and where they come to rest is the sample. In
//! reading order: the rules of motion (`kinematic`, `dynamic`), the flight of particles under such a
//! rule (`flight`), Newton's polish (`newton`), a release of particles from a box, through flight
//! and polish (`release`), and the search for the right box (`search`).
//! [`thin()`] makes a sample sparser and more even.
//!
//! Three methods work with lines, on which all roots are found (`lines`): points of random lines
//! (`rays`), which tell area and volume too, points on the edges of a grid (`grid`), and blue noise,
//! for which a dense sample by rays is thinned out (`poisson`).

mod cover;
mod creases;
mod density;
mod dynamic;
mod evaluation;
mod flight;
mod floaters;
mod grid;
mod kinematic;
mod lines;
mod newton;
mod particle;
mod poisson;
mod radii;
mod random;
mod rays;
mod release;
mod rules;
mod search;
mod statistics;
mod thin;
mod trace;

pub use creases::{Corner, Crease, CreasePoint, CreaseReport, Creases, creases};
pub use density::{Density, Focus, sample_graded};
pub use floaters::{Followed, Followers};
pub use rules::Rules;
pub use statistics::{
    Creased, CurveComponent, CurveStatistics, Dropped, Estimate, Lines, Proof, Statistics, Times,
};
pub use thin::{Keep, thin};

use std::fmt;
use std::sync::Arc;

use glam::DVec3;
use thiserror::Error;

use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, Samples};
use newton::Point;
use particle::Motion;
use random::Stream;
use release::{Release, release};
use statistics::Stopwatch;

/// A way to place points on a zero set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Particles on the surface that repel each other, with births and deaths (Witkin and
    /// Heckbert): evenly spread. For fields in R2 and R3.
    #[default]
    Floaters,
    /// Floaters of one radius that come to rest and then split all at once, generation by
    /// generation (Turk).
    Relax,
    /// Particles whose velocity is -sign(F) F_x (Figueiredo and Gomes): converges fastest.
    Kinematic,
    /// Particles on which -sign(F) F_x acts as a force, with friction (Figueiredo and Gomes):
    /// avoids spurious attractors better.
    Dynamic,
    /// Continuation: along curves in R2, and in R3 those on which two fields vanish
    /// ([`sample_curve`]), at exactly equal distances; over surfaces, by a front of points.
    Trace,
    /// The points in which random lines meet the surface: uniformly distributed, independent. For
    /// fields in R2 and R3.
    Rays,
    /// The points in which the edges of a regular grid meet the surface. In R1 all roots.
    Grid,
    /// Random points none of which is close to another one: of many that random lines meet, those
    /// that crowd are eliminated. For fields in R2 and R3.
    Poisson,
}

impl Method {
    /// All methods with the names under which they are asked for, in the order of messages.
    pub const NAMES: &[(Method, &str)] = &[
        (Method::Floaters, "floaters"),
        (Method::Relax, "relax"),
        (Method::Kinematic, "kinematic"),
        (Method::Dynamic, "dynamic"),
        (Method::Trace, "trace"),
        (Method::Rays, "rays"),
        (Method::Grid, "grid"),
        (Method::Poisson, "poisson"),
    ];

    /// Whether the method finds its points on lines through a box, which must then be given.
    pub fn uses_lines(self) -> bool {
        matches!(self, Method::Rays | Method::Grid | Method::Poisson)
    }

    /// The name under which it is asked for.
    pub fn name(self) -> &'static str {
        let mut named = Method::NAMES.iter().filter(|(method, _)| *method == self);
        named.next().map_or("", |(_, name)| name)
    }

    /// The method of this name.
    pub fn named(name: &str) -> Option<Method> {
        let mut named = Method::NAMES.iter().filter(|(_, known)| *known == name);
        named.next().map(|(method, _)| *method)
    }
}

/// What the particles of Figueiredo and Gomes move down, and vanishes on the zero set alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Potential {
    /// |F|: the force is as large close to the surface as far from it, and turns round on it.
    #[default]
    Absolute,
    /// F²: the force is continuous. It has more spurious attractors.
    Square,
}

impl Potential {
    /// All potentials with their names.
    pub const NAMES: &[(Potential, &str)] = &[
        (Potential::Absolute, "absolute"),
        (Potential::Square, "square"),
    ];

    /// The potential of this name.
    pub fn named(name: &str) -> Option<Potential> {
        let mut named = Potential::NAMES.iter().filter(|(_, known)| *known == name);
        named.next().map(|(potential, _)| *potential)
    }
}

/// What a sampler is asked to do. The default suits every field.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The method.
    pub method: Method,
    /// How many floaters there are in the end (`None`: 500 on a curve, 2,000 on a surface), or
    /// how many other particles are released; what does not reach the surface gives no point
    /// (`None`: 100 in R1, 1,000 in R2 and 5,000 in R3, the paper's advice for curves and
    /// surfaces). At most `count_limit`.
    pub count: Option<u64>,
    /// The largest number of particles.
    pub count_limit: u64,
    /// The distance between neighbouring floaters, instead of a count: that of the hexagonal
    /// pattern with as many points on the same area, also for rays and Poisson samples; that between
    /// points of continuation, on closed curves rounded to a part of the length; or the sides of the
    /// grid's cells. Particles that are released know no spacing.
    pub spacing: Option<f64>,
    /// The spacing of floaters as a function of the place. With a count only its ratios matter.
    pub varying: Option<Varying>,
    /// Where floaters start, instead of seeds on every component: points near the zero set, from
    /// which they spread over the components that these lie on.
    pub seeds: Vec<DVec3>,
    /// Where the random starts come from: the same seed gives the same bytes.
    pub seed: u64,
    /// The box to search, from which no point strays. `None`: the search begins in -1..1 and
    /// goes where it finds the surface.
    pub bounds: Option<Bounds>,
    /// The largest |F| / |F_x| of a point, relative to the diagonal of the box in which the
    /// final particles start; at most 0.01 and at least 1e-15, which is the limit of rounding. It
    /// decides which points are kept: those that are go on to that limit where they can.
    pub tolerance: f64,
    /// The part of its velocity that friction takes from a dynamic particle in its first step
    /// (γ δ, without a unit); above 0 and at most 1. Less friction passes more spurious
    /// attractors and takes more steps.
    pub friction: f64,
    /// What kinematic and dynamic particles move down.
    pub potential: Potential,
    /// The largest number of steps of a particle.
    pub iteration_limit: u32,
    /// The largest number of rounds of the preliminary search. With 0 there is none: the
    /// particles start all over the bounds.
    pub search_limit: u32,
    /// The parameters of floaters.
    pub rules: Rules,
    /// Whether floaters follow the paper from one seed a component to the end, with the radius
    /// [`Rules::sigma`], instead of refining a first generation. Then there is no count.
    pub exact: bool,
    /// The direction of rays; `None`: every direction. Components beyond the dimension don't count.
    pub direction: Option<DVec3>,
}

/// The spacing that is wanted at each point, as the value of a field of as many coordinates as
/// the one that is sampled.
#[derive(Clone)]
pub struct Varying(pub Arc<dyn Field>);

impl fmt::Debug for Varying {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Varying")
    }
}

/// The same field, not an equal one.
impl PartialEq for Varying {
    fn eq(&self, other: &Varying) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Options {
    /// The largest number of particles, unless more are allowed: their points take about a gigabyte.
    pub const MOST: u64 = 10_000_000;
}

impl Default for Options {
    fn default() -> Self {
        Options {
            method: Method::default(),
            count: None,
            count_limit: Options::MOST,
            spacing: None,
            varying: None,
            seeds: Vec::new(),
            seed: 0,
            bounds: None,
            tolerance: 1e-9,
            friction: 0.05,
            potential: Potential::default(),
            iteration_limit: 1000,
            search_limit: 10,
            rules: Rules::default(),
            exact: false,
            direction: None,
        }
    }
}

/// A sample and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The points, in the order of the particles that found them.
    pub samples: Samples,
    /// What happened on the way.
    pub statistics: Statistics,
}

/// Why there is no sample.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SampleError {
    /// An option is out of its range.
    #[error("`{option}` must be {expected}, not {found}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// More particles than are allowed.
    #[error("{count} particles are too many (the limit is {limit})")]
    TooMany {
        /// How many are asked for.
        count: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// The box has another number of sides than the field has coordinates.
    #[error("the bounds have {bounds} sides, but the field has {field} coordinates")]
    Dimension {
        /// Sides of the box.
        bounds: usize,
        /// Coordinates of the field.
        field: usize,
    },
    /// The method is for other dimensions.
    #[error("the method \"{method}\" is not for {subject}; use \"{other}\"")]
    Method {
        /// The method's name.
        method: &'static str,
        /// What it cannot sample.
        subject: &'static str,
        /// A method that can.
        other: &'static str,
    },
    /// Continuation found no regular point of the curve or surface.
    #[error("the zero set cannot be followed: {}", no_curve(*fields))]
    NoCurve {
        /// How many fields vanish there: 2 on a curve in space, else 1.
        fields: usize,
    },
    /// The monitor asked to stop.
    #[error("sampling was cancelled")]
    Cancelled,
}

/// Why Newton's method finds no point with a tangent.
fn no_curve(fields: usize) -> &'static str {
    match fields {
        1 => {
            "wherever the field vanishes its gradient does too, because it does not change its \
             sign there or is 0 on a whole region"
        }
        _ => {
            "wherever both fields vanish their gradients are parallel, because the surfaces touch \
             there or have a whole region in common"
        }
    }
}

/// Samples the curve in R3 on which two fields vanish, by continuation.
///
/// Points are at equal distances along each component of the curve, with their tangents; their
/// normals are those of the first field. See [`sample`] for the rest.
///
/// # Errors
/// If a field is not in R3, if the method is another one, if there is a curve but no regular point
/// of it, and for the reasons of [`sample`].
pub fn sample_curve(
    fields: [&dyn Field; 2],
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    if options.method != Method::Trace {
        return Err(SampleError::Method {
            method: options.method.name(),
            subject: "a curve in space",
            other: Method::Trace.name(),
        });
    }
    for field in fields {
        if field.dimension() != 3 {
            return Err(SampleError::Dimension {
                bounds: 3,
                field: field.dimension(),
            });
        }
    }
    start_box(3, options)?;
    check(options)?;
    check_default(options, DEFAULT_ON_CURVE)?;
    timed(monitor, |monitor| trace::curve(&fields, options, monitor))
}

/// Runs a sampler and notes how long its phases took.
fn timed(
    monitor: &dyn Monitor,
    run: impl FnOnce(&dyn Monitor) -> Result<Outcome, SampleError>,
) -> Result<Outcome, SampleError> {
    let stopwatch = Stopwatch::new(monitor);
    let mut outcome = run(&stopwatch)?;
    outcome.statistics.times = stopwatch.times();
    Ok(outcome)
}

/// Samples the zero set of a field.
///
/// Every point has |F| / |F_x| within the tolerance and, if bounds are given, lies in them;
/// particles that end anywhere else are dropped and counted. The result depends on the field
/// and the options only, not on the number of threads. A field without a zero gives an empty
/// sample, not an error.
///
/// The cost is some tens of evaluations of F and F_x per particle.
///
/// # Errors
/// If an option is out of its range or does not fit the field, and if the monitor cancels.
pub fn sample(
    field: &dyn Field,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let dimension = field.dimension();
    let start_box = start_box(dimension, options)?;
    check(options)?;
    check_default(options, default_count(options.method, dimension))?;
    timed(monitor, |monitor| {
        by_method(field, start_box, options, monitor)
    })
}

/// Leaves the work to the file of the method.
fn by_method(
    field: &dyn Field,
    start_box: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let dimension = field.dimension();
    match options.method {
        Method::Relax if dimension == 1 => Err(SampleError::Method {
            method: options.method.name(),
            subject: "roots on a line",
            other: Method::Kinematic.name(),
        }),
        Method::Floaters | Method::Relax => floaters::floaters(field, start_box, options, monitor),
        Method::Kinematic => {
            let potential = options.potential;
            let motion = kinematic::Kinematic { potential };
            particles(field, &motion, start_box, options, monitor)
        }
        Method::Trace if dimension == 2 => trace::curve(&[field], options, monitor),
        Method::Trace if dimension == 3 => trace::surface(field, options, monitor),
        Method::Trace => Err(SampleError::Method {
            method: options.method.name(),
            subject: "roots on a line",
            other: Method::Kinematic.name(),
        }),
        Method::Dynamic => {
            let motion = dynamic::Dynamic {
                friction: options.friction,
                potential: options.potential,
            };
            particles(field, &motion, start_box, options, monitor)
        }
        Method::Rays => rays::rays(field, start_box, options, monitor),
        Method::Grid => grid::grid(field, start_box, options, monitor),
        Method::Poisson => poisson::poisson(field, start_box, options, monitor),
    }
}

/// The particle methods: the preliminary search, then the final release.
fn particles(
    field: &dyn Field,
    motion: &dyn Motion,
    start_box: Bounds,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Outcome, SampleError> {
    let count =
        (options.count).unwrap_or_else(|| default_count(options.method, start_box.dimension));
    let first = Release {
        field,
        motion,
        stream: Stream::new(options.seed, 0),
        count,
        bounds: start_box,
        reach: search::reach(options.bounds, start_box),
        within: options.bounds,
        tolerance: options.tolerance,
        iteration_limit: options.iteration_limit,
    };
    let mut searching = statistics::Tally::default();
    let located = search::locate(&first, options, monitor, &mut searching)?;
    let last = Release {
        bounds: located.bounds,
        reach: search::reach(options.bounds, located.bounds),
        ..first
    };
    let progress = |fraction| monitor.progress("sample", fraction);
    progress(0.0);
    let (points, tally) = release(&last, monitor, &progress).ok_or(SampleError::Cancelled)?;
    let samples = samples(start_box.dimension, &points);
    let vanishing = points
        .iter()
        .filter(|point| point.here.gradient == DVec3::ZERO);
    let rarely_unconverged = tally.dropped.unconverged <= count / 100;
    let statistics = Statistics {
        started: count,
        points: points.len() as u64,
        iterations: tally.iterations,
        steps: searching.steps + tally.steps,
        evaluations: searching.evaluations + tally.evaluations,
        dropped: tally.dropped,
        converged: located.settled && rarely_unconverged,
        searches: located.rounds,
        settled: located.settled,
        max_residual: samples.residuals.iter().copied().fold(0.0, f64::max),
        nan_points: searching.undefined_evaluations + tally.undefined_evaluations,
        singular: vanishing.count() as u64,
        ..Statistics::new(located.bounds)
    };
    Ok(Outcome {
        samples,
        statistics,
    })
}

/// How many points there are without any wish on a curve, and on a surface.
const DEFAULT_ON_CURVE: u64 = 500;
const DEFAULT_ON_SURFACE: u64 = 2000;

/// How many points, or particles, there are without any wish; 0 where that is left to the field.
fn default_count(method: Method, dimension: usize) -> u64 {
    match (method, dimension) {
        (Method::Kinematic | Method::Dynamic, 1) => 100,
        (Method::Kinematic | Method::Dynamic, 2) => 1_000,
        (Method::Kinematic | Method::Dynamic, _) => 5_000,
        (_, 1) => 0,
        (_, 2) => DEFAULT_ON_CURVE,
        _ => DEFAULT_ON_SURFACE,
    }
}

/// Refuses the number that is used without any wish if it is above the limit.
fn check_default(options: &Options, count: u64) -> Result<(), SampleError> {
    let wished = options.count.is_some()
        || options.spacing.is_some()
        || options.varying.is_some()
        || options.exact;
    match !wished && count > options.count_limit {
        true => Err(SampleError::TooMany {
            count,
            limit: options.count_limit,
        }),
        false => Ok(()),
    }
}

/// Points with all that a sample says about them.
fn samples(dimension: usize, points: &[Point]) -> Samples {
    let positions: Vec<DVec3> = points.iter().map(|point| point.position).collect();
    let radii = radii::radii(&positions);
    Samples {
        dimension,
        normals: points.iter().map(|point| point.here.normal()).collect(),
        residuals: points.iter().map(|point| point.here.distance()).collect(),
        radii,
        tangents: Vec::new(),
        positions,
        weights: Vec::new(),
    }
}

/// The box in which the search begins: the bounds, or -1..1.
fn start_box(dimension: usize, options: &Options) -> Result<Bounds, SampleError> {
    if options.bounds.is_none() && options.method.uses_lines() {
        return Err(out_of_range(
            "bounds",
            "a box, through which lines are drawn,",
            "left out".to_owned(),
        ));
    }
    let corner = |value: f64| {
        DVec3::from_array([0, 1, 2].map(|axis| if axis < dimension { value } else { 0.0 }))
    };
    let bounds = options.bounds.unwrap_or(Bounds {
        dimension,
        min: corner(-1.0),
        max: corner(1.0),
    });
    if bounds.dimension != dimension {
        return Err(SampleError::Dimension {
            bounds: bounds.dimension,
            field: dimension,
        });
    }
    // Squares of lengths, and boxes grown by the search, must neither overflow nor underflow.
    let well = |(low, high): (f64, f64)| low < high && low.abs().max(high.abs()) <= 1e100;
    if !bounds.sides().all(well) || bounds.diagonal() < 1e-100 {
        return Err(out_of_range(
            "bounds",
            "a box with sides of positive length within ±1e100",
            format!("{:?}", bounds.sides().collect::<Vec<_>>()),
        ));
    }
    Ok(bounds)
}

/// A part of the box that rounding does not fall below.
const SMALLEST_TOLERANCE: f64 = 1e-15;

/// Whether the options that are numbers lie in their ranges.
fn check(options: &Options) -> Result<(), SampleError> {
    let range = |option, expected, found: &dyn ToString| {
        Err(out_of_range(option, expected, found.to_string()))
    };
    if options.count == Some(0) {
        return range("count", "at least 1", &0);
    }
    if let Some(count) = options.count
        && count > options.count_limit
    {
        let limit = options.count_limit;
        return Err(SampleError::TooMany { count, limit });
    }
    if let Some(spacing) = options.spacing {
        if !(spacing > 0.0 && spacing.is_finite()) {
            return range("spacing", "greater than 0 and finite", &spacing);
        }
        if matches!(options.method, Method::Kinematic | Method::Dynamic) {
            return range("spacing", "left out with this method", &spacing);
        }
        if options.count.is_some() {
            return range("spacing", "left out where `count` is given", &spacing);
        }
    }
    if !options.seeds.is_empty() && options.method == Method::Trace {
        return range("seeds", "left out with this method", &"given");
    }
    if options.varying.is_some() && !matches!(options.method, Method::Floaters | Method::Relax) {
        return range("spacing", "a number with this method", &"a function");
    }
    for (name, value) in options.rules.named() {
        if !(value > 0.0 && value.is_finite()) {
            return range(name, "greater than 0 and finite", &value);
        }
    }
    if options.exact && options.method != Method::Floaters {
        return range("exact", "left out with this method", &true);
    }
    if options.exact && options.count.is_some() {
        return range(
            "count",
            "left out with `exact`, which gives `sigma`",
            &"given",
        );
    }
    if !options.exact && options.rules.sigma.is_some() {
        return range("sigma", "left out without `exact`", &"given");
    }
    if !(SMALLEST_TOLERANCE..=0.01).contains(&options.tolerance) {
        let expected = "at most 0.01 and at least 1e-15, which is the limit of rounding,";
        return range("tolerance", expected, &format!("{:e}", options.tolerance));
    }
    if !(options.friction > 0.0 && options.friction <= 1.0) {
        return range("friction", "above 0 and at most 1", &options.friction);
    }
    let flies = matches!(options.method, Method::Kinematic | Method::Dynamic);
    if options.potential != Potential::default() && !flies {
        return range("potential", "left out with this method", &"\"square\"");
    }
    if let Some(direction) = options.direction {
        if options.method != Method::Rays {
            return range("direction", "left out with this method", &direction);
        }
        let length = crate::geometry::length(direction);
        if !(length > 0.0 && length.is_finite()) {
            return range("direction", "a finite vector that is not 0", &direction);
        }
    }
    if options.iteration_limit == 0 {
        return range("iteration_limit", "at least 1", &options.iteration_limit);
    }
    Ok(())
}

/// Refuses a spacing that asks for too many points, about so many.
fn refuse_too_fine(spacing: f64, points: f64, limit: u64) -> Result<(), SampleError> {
    if points <= limit as f64 {
        return Ok(());
    }
    Err(out_of_range(
        "spacing",
        &format!("larger, for at most {limit} points"),
        format!("{spacing} (which takes about {points:.0})"),
    ))
}

fn out_of_range(option: &'static str, expected: &str, found: String) -> SampleError {
    SampleError::Option {
        option,
        expected: expected.to_owned(),
        found,
    }
}
