//! What scripts make: samples, meshes, curves and images, with their properties.
//!
//! One table of properties for each kind serves `value.name`, the JSON summaries and the list of
//! names in messages.

mod elastic;
mod motion;
mod report;

use std::cell::OnceCell;
use std::rc::Rc;

use super::function::At;
use super::value::{Value, failure};
use crate::diagnostic::{Code, Diagnostic, suggest};
use crate::geometry::{Bounds, Curves, Mesh, Samples, Spacing, Topology};
use crate::graph::Interval;
use crate::picture::Picture;
use crate::polygonize;
use crate::sample;
use crate::syntax::tree::Name;

pub use elastic::{FallSet, SolidSet};
pub use motion::{FitSet, SimulationSet, Warned};
pub use report::{BrickTotals, ReportSet};

/// Samples and how they came about.
#[derive(Debug)]
pub struct SampleSet {
    /// The points.
    pub samples: Samples,
    /// The sampler's name.
    pub method: &'static str,
    /// What the sampler tells; absent for what was made from other samples.
    pub statistics: Option<sample::Statistics>,
    spacing: OnceCell<Option<Spacing>>,
}

/// A mesh and how it came about.
#[derive(Debug)]
pub struct MeshSet {
    /// The triangles.
    pub mesh: Mesh,
    /// The polygonizer's name, or what else made the mesh.
    pub method: &'static str,
    /// What the polygonizer tells; absent for what none made.
    pub statistics: Option<polygonize::Statistics>,
    /// What "certified" proved; absent for what other methods made.
    pub certified: Option<polygonize::Certified>,
    topology: OnceCell<Topology>,
}

/// Curves and how they came about.
#[derive(Debug)]
pub struct CurveSet {
    /// The polylines.
    pub curves: Curves,
    /// The polygonizer's name.
    pub method: &'static str,
    /// What the polygonizer tells.
    pub statistics: polygonize::Statistics,
    /// What "certified" proved; absent for what other methods made.
    pub certified: Option<polygonize::Certified>,
}

/// An image and how it came about.
#[derive(Debug)]
pub struct ImageSet {
    /// The pixels and what is known of them.
    pub picture: Picture,
    /// The dimension of the field that is seen.
    pub dimension: usize,
}

impl SampleSet {
    /// Samples; their spacing is measured when it is first asked for.
    pub fn new(
        samples: Samples,
        method: &'static str,
        statistics: Option<sample::Statistics>,
    ) -> SampleSet {
        SampleSet {
            samples,
            method,
            statistics,
            spacing: OnceCell::new(),
        }
    }

    /// Nearest-neighbour distances; `None` for fewer than two points.
    pub fn spacing(&self) -> Option<&Spacing> {
        self.spacing.get_or_init(|| self.samples.spacing()).as_ref()
    }
}

impl MeshSet {
    /// A mesh; its topology is found when it is first asked for.
    pub fn new(
        mesh: Mesh,
        method: &'static str,
        statistics: Option<polygonize::Statistics>,
    ) -> MeshSet {
        MeshSet {
            mesh,
            method,
            statistics,
            certified: None,
            topology: OnceCell::new(),
        }
    }

    /// Connectivity.
    pub fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| self.mesh.topology())
    }
}

/// The text of the proof that came with a mesh or with curves.
pub fn certificate(value: &Value) -> Option<String> {
    let certified = match value {
        Value::Mesh(set) => set.certified.as_ref(),
        Value::Curves(set) => set.certified.as_ref(),
        _ => None,
    };
    Some(certified?.certificate.text())
}

/// A named property of a kind of value; no value where it cannot be given.
struct Property<T> {
    name: &'static str,
    /// Whether summaries show it; lists of points are too long for that.
    summary: bool,
    value: fn(&T) -> Option<Value>,
}

const fn shown<T>(name: &'static str, value: fn(&T) -> Option<Value>) -> Property<T> {
    Property {
        name,
        summary: true,
        value,
    }
}

const fn hidden<T>(name: &'static str, value: fn(&T) -> Option<Value>) -> Property<T> {
    Property {
        name,
        summary: false,
        value,
    }
}

const MESH: &[Property<MeshSet>] = &[
    shown("method", |set| Some(Value::text(set.method))),
    shown("vertices", |set| count(set.mesh.positions.len())),
    shown("triangles", |set| count(set.mesh.triangles.len())),
    shown("components", |set| count(set.topology().components)),
    shown("euler", |set| {
        number(set.topology().euler_characteristic() as f64)
    }),
    shown("genus", |set| set.topology().genus().and_then(count)),
    shown("boundary_edges", |set| count(set.topology().boundary_edges)),
    shown("watertight", |set| {
        Some(Value::Bool(set.topology().watertight))
    }),
    shown("manifold", |set| Some(Value::Bool(set.topology().manifold))),
    shown("area", |set| number(set.mesh.area())),
    shown("volume", |set| {
        if set.topology().watertight {
            number(set.mesh.volume())
        } else {
            None
        }
    }),
    shown("bounds", |set| set.mesh.bounds().map(sides)),
    shown("proven", |set| {
        let certified = set.certified.as_ref()?;
        Some(Value::Bool(certified.proven))
    }),
    hidden("doubts", |set| Some(doubts(set.certified.as_ref()?, 3))),
    shown("max_residual", |set| {
        number(set.statistics.as_ref()?.max_residual)
    }),
    shown("evaluations", |set| {
        number(set.statistics.as_ref()?.evaluations as f64)
    }),
    hidden("points", |set| Some(points(&set.mesh.positions, 3))),
    hidden("normals", |set| Some(points(&set.mesh.normals, 3))),
    hidden("faces", |set| {
        Some(Value::list(
            set.mesh
                .triangles
                .iter()
                .map(|triangle| Value::numbers(triangle.map(f64::from)))
                .collect(),
        ))
    }),
    hidden("adaptation", |set| {
        report::adaptation(set.statistics.as_ref())
    }),
    hidden("leaves", |set| leaves(&set.statistics?.leaves)),
    hidden("quality", |set| {
        let quality = ReportSet::of_quality(&set.mesh);
        Some(Value::Report(Rc::new(quality)))
    }),
];

const SAMPLES: &[Property<SampleSet>] = &[
    shown("method", |set| Some(Value::text(set.method))),
    shown("count", |set| count(set.samples.positions.len())),
    shown("iterations", |set| {
        set.statistics
            .as_ref()
            .and_then(|statistics| number(f64::from(statistics.iterations)))
    }),
    shown("births", |set| {
        let births = set.statistics.as_ref()?.births?;
        number(births as f64)
    }),
    shown("deaths", |set| {
        let deaths = set.statistics.as_ref()?.deaths?;
        number(deaths as f64)
    }),
    shown("pieces", |set| {
        number(set.statistics.as_ref()?.pieces? as f64)
    }),
    shown("energy", |set| number(set.statistics.as_ref()?.energy?)),
    shown("converged", |set| {
        set.statistics
            .as_ref()
            .map(|statistics| Value::Bool(statistics.converged))
    }),
    shown("dropped", |set| {
        set.statistics
            .as_ref()
            .and_then(|statistics| number(statistics.dropped.total() as f64))
    }),
    hidden("spurious", |set| {
        let statistics = set.statistics.as_ref()?;
        number(statistics.dropped.spurious as f64)
    }),
    shown("max_residual", |set| {
        number(set.samples.residuals.iter().copied().fold(0.0, f64::max))
    }),
    shown("spacing", |set| number(set.spacing()?.mean)),
    shown("spacing_deviation", |set| number(set.spacing()?.deviation)),
    shown("spacing_min", |set| number(set.spacing()?.min)),
    shown("spacing_max", |set| number(set.spacing()?.max)),
    shown("evaluations", |set| {
        set.statistics
            .as_ref()
            .and_then(|statistics| number(statistics.evaluations as f64))
    }),
    hidden("steps", |set| number(set.statistics.as_ref()?.steps as f64)),
    hidden("times", |set| {
        let sample::Times(times) = &set.statistics.as_ref()?.times;
        let pair = |(phase, time): &(String, std::time::Duration)| {
            Value::list(vec![
                Value::text(&**phase),
                Value::Number(time.as_secs_f64()),
            ])
        };
        Some(Value::list(times.iter().map(pair).collect()))
    }),
    shown("components", |set| count(walked(set)?.components.len())),
    shown("closed", |set| {
        let all = walked(set)?.components.iter().all(|found| found.closed);
        Some(Value::Bool(all))
    }),
    shown("length", |set| number(walked(set)?.length())),
    shown("crossings", |set| number(walked(set)?.crossings as f64)),
    shown("proven", |set| Some(Value::Bool(walked(set)?.proven))),
    hidden("undecided", |set| number(walked(set)?.undecided as f64)),
    hidden("lengths", |set| {
        let components = walked(set)?.components.iter();
        Some(Value::numbers(components.map(|found| found.length)))
    }),
    shown("largest_missed", |set| {
        let proof = set.statistics.as_ref()?.proof?;
        number(proof.largest_left)
    }),
    shown("crease_points", |set| number(creased(set)?.points as f64)),
    shown("corners", |set| number(creased(set)?.corners as f64)),
    shown("crease_length", |set| number(creased(set)?.length)),
    hidden("creases_undecided", |set| {
        let creases = set.statistics.as_ref()?.creases?;
        number(creases.undecided as f64)
    }),
    shown("lines", |set| number(lines(set)?.drawn as f64)),
    hidden("vanishing", |set| number(lines(set)?.vanishing as f64)),
    shown("length", |set| in_plane(set, lines(set)?.area, |e| e.value)),
    shown("length_error", |set| {
        in_plane(set, lines(set)?.area, |e| e.error)
    }),
    shown("area", |set| estimated_area(set, |e| e.value)),
    shown("area_error", |set| estimated_area(set, |e| e.error)),
    shown("volume", |set| {
        in_space(set, lines(set)?.volume, |e| e.value)
    }),
    shown("volume_error", |set| {
        in_space(set, lines(set)?.volume, |e| e.error)
    }),
    hidden("points", |set| {
        Some(points(&set.samples.positions, set.samples.dimension))
    }),
    hidden("normals", |set| {
        Some(points(&set.samples.normals, set.samples.dimension))
    }),
    hidden("tangents", |set| {
        let tangents = &set.samples.tangents;
        (!tangents.is_empty()).then(|| points(tangents, set.samples.dimension))
    }),
    hidden("radii", |set| {
        Some(Value::numbers(set.samples.radii.iter().copied()))
    }),
    hidden("residuals", |set| {
        Some(Value::numbers(set.samples.residuals.iter().copied()))
    }),
    hidden("weights", |set| {
        let weights = &set.samples.weights;
        (!weights.is_empty()).then(|| Value::numbers(weights.iter().copied()))
    }),
    hidden("bounds", |set| {
        Bounds::of_points(set.samples.dimension, set.samples.positions.iter().copied()).map(sides)
    }),
];

/// What continuation tells of curves.
fn creased(set: &SampleSet) -> Option<sample::Creased> {
    let creases = set.statistics.as_ref()?.creases?;
    (creases.points > 0).then_some(creases)
}

fn walked(set: &SampleSet) -> Option<&sample::CurveStatistics> {
    set.statistics.as_ref()?.curves.as_ref()
}

/// What lines have told of samples.
fn lines(set: &SampleSet) -> Option<&sample::Lines> {
    set.statistics.as_ref()?.lines.as_ref()
}

type Part = fn(sample::Estimate) -> f64;

fn in_plane(set: &SampleSet, estimate: Option<sample::Estimate>, part: Part) -> Option<Value> {
    let estimate = estimate.filter(|_| set.samples.dimension == 2)?;
    number(part(estimate))
}

fn in_space(set: &SampleSet, estimate: Option<sample::Estimate>, part: Part) -> Option<Value> {
    let estimate = estimate.filter(|_| set.samples.dimension == 3)?;
    number(part(estimate))
}

/// The area of a surface; that which a curve encloses.
fn estimated_area(set: &SampleSet, part: Part) -> Option<Value> {
    let lines = lines(set)?;
    in_plane(set, lines.volume, part).or_else(|| in_space(set, lines.area, part))
}

/// The places in which the topology is not proven.
fn doubts(certified: &polygonize::Certified, dimension: usize) -> Value {
    let places: Vec<_> = certified.doubts.iter().map(|doubt| doubt.place).collect();
    points(&places, dimension)
}

const CURVES: &[Property<CurveSet>] = &[
    shown("method", |set| Some(Value::text(set.method))),
    shown("proven", |set| {
        let certified = set.certified.as_ref()?;
        Some(Value::Bool(certified.proven))
    }),
    hidden("doubts", |set| Some(doubts(set.certified.as_ref()?, 2))),
    shown("components", |set| count(set.curves.components())),
    shown("closed", |set| {
        Some(Value::Bool(
            set.curves.closed_components() == set.curves.components(),
        ))
    }),
    shown("vertices", |set| {
        count(
            set.curves
                .polylines
                .iter()
                .map(|polyline| polyline.points.len())
                .sum(),
        )
    }),
    shown("length", |set| number(set.curves.length())),
    shown("crossings", |set| match set.curves.dimension {
        3 => count(set.statistics.crossings),
        _ => None,
    }),
    shown("area", |set| set.curves.enclosed_area().and_then(number)),
    shown("bounds", |set| set.curves.bounds().map(sides)),
    shown("max_residual", |set| number(set.statistics.max_residual)),
    shown("evaluations", |set| {
        number(set.statistics.evaluations as f64)
    }),
    hidden("adaptation", |set| {
        report::adaptation(Some(&set.statistics))
    }),
    hidden("points", |set| {
        let polylines = set.curves.polylines.iter();
        Some(Value::list(
            polylines
                .map(|polyline| points(&polyline.points, set.curves.dimension))
                .collect(),
        ))
    }),
];

const IMAGE: &[Property<ImageSet>] = &[
    shown("width", |set| count(set.picture.image.width)),
    shown("height", |set| count(set.picture.image.height)),
    shown("covered", |set| number(set.picture.statistics.covered)),
    shown("undefined", |set| {
        number(set.picture.statistics.undefined as f64)
    }),
    shown("jumps", |set| match set.dimension {
        3 => number(set.picture.statistics.jumps as f64),
        _ => None,
    }),
    shown("step", |set| set.picture.statistics.step.and_then(number)),
];

/// A property of a value; `None` if there is none of that name, or it cannot be given.
pub fn property(value: &Value, name: &str) -> Option<Value> {
    match value {
        Value::Unknown => Some(Value::Unknown),
        Value::List(elements) => swizzle(elements, name),
        Value::Interval(interval) => interval_property(*interval, name),
        Value::Mesh(set) => find(MESH, set, name).or_else(|| find(report::MORE_OF_MESH, set, name)),
        Value::Samples(set) => find(SAMPLES, set, name),
        Value::Curves(set) => find(CURVES, set, name),
        Value::Image(set) => find(IMAGE, set, name),
        Value::Simulation(set) => find(motion::SIMULATION, set, name),
        Value::Fit(set) => find(motion::FIT, set, name),
        Value::Fall(set) => find(elastic::FALL, set, name),
        Value::Solid(set) => find(elastic::SOLID, set, name),
        Value::Report(set) => find(report::REPORT, set, name),
        _ => None,
    }
}

/// The properties that summaries show, with their values, in order.
pub fn summary(value: &Value) -> Vec<(&'static str, Value)> {
    fn shown_values<T>(table: &[Property<T>], set: &T) -> Vec<(&'static str, Value)> {
        table
            .iter()
            .filter(|property| property.summary)
            .filter_map(|property| Some((property.name, (property.value)(set)?)))
            .collect()
    }
    match value {
        Value::Mesh(set) => shown_values(MESH, set),
        Value::Samples(set) => shown_values(SAMPLES, set),
        Value::Curves(set) => shown_values(CURVES, set),
        Value::Image(set) => shown_values(IMAGE, set),
        Value::Simulation(set) => shown_values(motion::SIMULATION, set),
        Value::Fit(set) => shown_values(motion::FIT, set),
        Value::Fall(set) => shown_values(elastic::FALL, set),
        Value::Solid(set) => shown_values(elastic::SOLID, set),
        Value::Report(set) => shown_values(report::REPORT, set),
        _ => Vec::new(),
    }
}

/// The summary of a mesh and everything else that is a number, a truth value or a point.
pub fn details(set: &MeshSet) -> Vec<(&'static str, Value)> {
    let more = report::MORE_OF_MESH.iter();
    let tables = MESH.iter().filter(|property| property.summary).chain(more);
    tables
        .filter_map(|property| Some((property.name, (property.value)(set)?)))
        .collect()
}

/// The names of a value's properties.
pub fn property_names(value: &Value) -> Vec<&'static str> {
    match value {
        Value::List(_) => vec!["x", "y", "z"],
        Value::Interval(_) => vec!["low", "high", "width", "middle"],
        Value::Mesh(_) => MESH
            .iter()
            .chain(report::MORE_OF_MESH)
            .map(|property| property.name)
            .collect(),
        Value::Samples(_) => SAMPLES.iter().map(|property| property.name).collect(),
        Value::Curves(_) => CURVES.iter().map(|property| property.name).collect(),
        Value::Image(_) => IMAGE.iter().map(|property| property.name).collect(),
        Value::Simulation(_) => motion::SIMULATION
            .iter()
            .map(|property| property.name)
            .collect(),
        Value::Fit(_) => motion::FIT.iter().map(|property| property.name).collect(),
        Value::Fall(_) => elastic::FALL.iter().map(|property| property.name).collect(),
        Value::Solid(_) => elastic::SOLID
            .iter()
            .map(|property| property.name)
            .collect(),
        Value::Report(_) => report::REPORT
            .iter()
            .map(|property| property.name)
            .collect(),
        _ => Vec::new(),
    }
}

/// The names of all properties that anything has, each with what has it.
pub fn all_properties() -> Vec<(&'static str, &'static str)> {
    fn named<T>(
        kind: &'static str,
        table: &'static [Property<T>],
    ) -> impl Iterator<Item = (&'static str, &'static str)> {
        table.iter().map(move |property| (kind, property.name))
    }
    let vector = ["x", "y", "z"].map(|name| ("a vector", name));
    let interval = ["low", "high", "width", "middle"].map(|name| ("an interval", name));
    vector
        .into_iter()
        .chain(interval)
        .chain(named("a mesh", MESH))
        .chain(named("a mesh", report::MORE_OF_MESH))
        .chain(named("samples", SAMPLES))
        .chain(named("a curve set", CURVES))
        .chain(named("an image", IMAGE))
        .chain(named("a simulation", motion::SIMULATION))
        .chain(named("a fit", motion::FIT))
        .chain(named("a fall", elastic::FALL))
        .chain(named("a solid", elastic::SOLID))
        .chain(named("a report", report::REPORT))
        .collect()
}

/// The error for a property that a value does not have.
pub fn unknown_property(value: &Value, name: &Name) -> Box<Diagnostic> {
    let names = property_names(value);
    let known = names.contains(&&*name.text) && !matches!(value, Value::List(_));
    let message = match (value, known) {
        (Value::List(elements), _) if is_swizzle(&name.text) => format!(
            "a list of {} elements has no component `{}`",
            elements.len(),
            name.text
        ),
        (_, true) => format!(
            "`{}` cannot be given for this {}",
            name.text,
            value.kind().trim_start_matches("a ")
        ),
        _ => format!("{} has no property `{}`", value.kind(), name.text),
    };
    let mut error = failure(Code::UnknownProperty, message).at(name.span, "not there");
    error.help = if known {
        Some(match value {
            Value::Samples(_) => "it is given by some methods only".into(),
            Value::Simulation(_) => {
                "it is given after a step, `solver` and `rank` where control points or a rest shape \
                 move the surface"
                    .into()
            }
            Value::Solid(_) => "in R3 it has tetrahedra and a volume, in R2 triangles and a length".into(),
            Value::Fall(_) => "solids in R3 have a mesh, those in R2 curves".into(),
            Value::Report(_) => {
                "`quality` measures triangles, `deviation` the distance from a field's surface, \
                 `export_bricks` what it wrote"
                    .into()
            }
            Value::Mesh(set) if set.statistics.is_none() => {
                "some are defined for closed and manifold meshes only, others for what \
                 `polygonize` makes"
                    .into()
            }
            _ => "it is only defined for closed and manifold results".into(),
        })
    } else {
        match suggest::nearest(&name.text, names.iter().copied()) {
            Some(near) => Some(format!("did you mean `{near}`?")),
            None if names.is_empty() => None,
            None => Some(format!("its properties are {}", names.join(", "))),
        }
    };
    error
}

/// The number of things in a product, for `len`.
pub fn length(value: &Value) -> Option<usize> {
    match value {
        Value::Samples(set) => Some(set.samples.positions.len()),
        Value::Curves(set) => Some(set.curves.polylines.len()),
        Value::Simulation(set) => Some(set.simulation.borrow().followers().len()),
        _ => None,
    }
}

/// A box as a list of intervals.
pub fn sides(bounds: Bounds) -> Value {
    Value::list(
        bounds
            .sides()
            .map(|(low, high)| Value::Interval(Interval::new(low, high)))
            .collect(),
    )
}

fn find<T>(table: &[Property<T>], set: &T, name: &str) -> Option<Value> {
    let property = table.iter().find(|property| property.name == name)?;
    (property.value)(set)
}

fn swizzle(elements: &[Value], name: &str) -> Option<Value> {
    if !is_swizzle(name) {
        return None;
    }
    let components = name
        .chars()
        .map(|axis| elements.get("xyzw".find(axis)?).cloned())
        .collect::<Option<Vec<Value>>>()?;
    match <[Value; 1]>::try_from(components) {
        Ok([single]) => Some(single),
        Err(several) => Some(Value::list(several)),
    }
}

/// Whether a name picks components of a vector: `x`, `zx`.
pub fn is_swizzle(name: &str) -> bool {
    (1..=4).contains(&name.len()) && name.chars().all(|axis| "xyzw".contains(axis))
}

fn interval_property(interval: Interval, name: &str) -> Option<Value> {
    let number = match name {
        "low" => interval.low,
        "high" => interval.high,
        "width" => interval.high - interval.low,
        "middle" => 0.5 * (interval.low + interval.high),
        _ => return None,
    };
    Some(Value::Number(number))
}

fn number(value: f64) -> Option<Value> {
    Some(Value::Number(value))
}

fn count(value: usize) -> Option<Value> {
    number(value as f64)
}

/// The leaves of an octree, level by level from the largest: how many are inside, outside and at
/// the boundary.
fn leaves(leaves: &polygonize::Leaves) -> Option<Value> {
    let level = |level: usize| {
        [leaves.interior, leaves.exterior, leaves.boundary].map(|counts| counts[level])
    };
    let levels = (0..polygonize::Leaves::LEVELS).map(level);
    let used = levels.clone().rposition(|counts| counts != [0; 3])?;
    let numbers = |counts: [usize; 3]| Value::numbers(counts.map(|count| count as f64));
    Some(Value::list(levels.take(used + 1).map(numbers).collect()))
}

fn points(points: &[glam::DVec3], dimension: usize) -> Value {
    Value::list(
        points
            .iter()
            .map(|point| Value::numbers(point.to_array().into_iter().take(dimension)))
            .collect(),
    )
}
