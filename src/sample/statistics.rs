//! What a sampler tells about its run.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::creases::Creases;
use crate::engine::Monitor;
use crate::geometry::Bounds;

/// What happened while sampling.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    /// Particles released for the final sample, or floaters that are put on the surface in the end
    /// (without any, the particles that were to find seeds), or lines that were drawn.
    pub started: u64,
    /// Points in the final sample: `started` without the dropped ones.
    pub points: u64,
    /// Steps of the slowest particle of the final sample, Newton's not included.
    pub iterations: u32,
    /// Steps of all particles together, preliminary search included.
    pub steps: u64,
    /// Evaluations of h and ∇h at one point, everything included.
    pub evaluations: u64,
    /// Particles of the final sample that gave no point, by reason.
    pub dropped: Dropped,
    /// Whether the sample can be relied on: the preliminary search came to an end, and floaters
    /// have the number that was asked for and are at rest, or at most one other particle in a hundred is dropped as unconverged. Particles caught by spurious
    /// attractors or gone from the box are what the method expects and don't count here.
    pub converged: bool,
    /// Floaters that were born by fission or to fill a gap.
    pub births: Option<u64>,
    /// Floaters that died, superfluous seeds included.
    pub deaths: Option<u64>,
    /// Pieces of the surface as floaters find them: groups of them, at a coarse spacing, of which each
    /// has a neighbour on the same sheet.
    pub pieces: Option<u64>,
    /// The mean of D/α over the floaters when they have come to rest: the repulsion energy of each,
    /// which the ideal pattern makes 6 exp(-2) = 0.81 on a surface and 2 exp(-2) = 0.27 on a curve
    /// (equation 10 of Witkin and Heckbert; their Ê is 0.8 α).
    pub energy: Option<f64>,
    /// Rounds of the preliminary search.
    pub searches: u32,
    /// Whether the preliminary search ended because its last round found nothing outside the
    /// earlier ones. If not, the surface is probably unbounded, or there is none.
    pub settled: bool,
    /// The box in which the final particles started. Its diagonal is the unit of the tolerance.
    pub bounds: Bounds,
    /// The largest |F| / |F_x| of a point, 0 without points.
    pub max_residual: f64,
    /// Evaluations at which F, or F_x off the surface, was NaN or infinite. Such places count
    /// as outside.
    pub nan_points: u64,
    /// Whether components can have been missed, where that was looked into.
    pub proof: Option<Proof>,
    /// Points of the sample where F and F_x vanish together: the surface is singular there, or
    /// F is zero on a whole region.
    pub singular: u64,
    /// What is known of creases and corners, where they were looked for.
    pub creases: Option<Creased>,
    /// What continuation tells of curves.
    pub curves: Option<CurveStatistics>,
    /// What lines met, where the method works with lines.
    pub lines: Option<Lines>,
    /// How long each phase took.
    pub times: Times,
}

impl Statistics {
    /// Of a sampler that has done nothing yet, in this box.
    pub(super) fn new(bounds: Bounds) -> Self {
        Statistics {
            started: 0,
            points: 0,
            iterations: 0,
            steps: 0,
            evaluations: 0,
            dropped: Dropped::default(),
            converged: true,
            births: None,
            deaths: None,
            pieces: None,
            energy: None,
            searches: 0,
            settled: true,
            bounds,
            max_residual: 0.0,
            nan_points: 0,
            proof: None,
            singular: 0,
            creases: None,
            curves: None,
            lines: None,
            times: Times::default(),
        }
    }
}

/// How long each phase of a run took by the clock, in the order in which the phases began.
///
/// Any two are equal: how long a run took is no part of what it gives.
#[derive(Clone, Debug, Default)]
pub struct Times(pub Vec<(String, Duration)>);

impl PartialEq for Times {
    fn eq(&self, _: &Times) -> bool {
        true
    }
}

/// A monitor that measures phases: the time from one report to the next belongs to the phase of the
/// earlier one, and that before the first report to the first phase. It passes on all that it hears.
pub(super) struct Stopwatch<'a> {
    monitor: &'a dyn Monitor,
    laps: Mutex<Laps>,
}

struct Laps {
    times: Vec<(String, Duration)>,
    /// Which of them is running.
    current: usize,
    since: Instant,
}

impl<'a> Stopwatch<'a> {
    /// Starts now.
    pub(super) fn new(monitor: &'a dyn Monitor) -> Self {
        let laps = Laps {
            times: Vec::new(),
            current: 0,
            since: Instant::now(),
        };
        Stopwatch {
            monitor,
            laps: Mutex::new(laps),
        }
    }

    /// The times until now.
    pub(super) fn times(self) -> Times {
        let mut laps = match self.laps.into_inner() {
            Ok(laps) => laps,
            Err(poisoned) => poisoned.into_inner(),
        };
        laps.stop();
        Times(laps.times)
    }
}

impl Laps {
    /// Ends the lap.
    fn stop(&mut self) {
        let now = Instant::now();
        if let Some((_, time)) = self.times.get_mut(self.current) {
            *time += now - self.since;
            self.since = now;
        }
    }

    /// Begins a lap of a phase, which may have been begun and left before.
    fn begin(&mut self, phase: &str) {
        self.stop();
        let known = self.times.iter().position(|(name, _)| name == phase);
        self.current = known.unwrap_or(self.times.len());
        if known.is_none() {
            self.times.push((phase.to_owned(), Duration::ZERO));
        }
    }
}

impl Monitor for Stopwatch<'_> {
    fn progress(&self, phase: &str, fraction: f64) {
        if let Ok(mut laps) = self.laps.lock() {
            laps.begin(phase);
        }
        self.monitor.progress(phase, fraction);
    }

    fn cancelled(&self) -> bool {
        self.monitor.cancelled()
    }
}

/// What is known of curves that were walked along.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveStatistics {
    /// The components, in the order of their points. Where curves cross, each goes straight on and
    /// is one component; where more than two branches meet otherwise, some end.
    pub components: Vec<CurveComponent>,
    /// Points at which branches cross.
    pub crossings: u64,
    /// Corners and cusps.
    pub corners: u64,
    /// Ends inside the box: the field is undefined beyond, or branches meet there.
    pub ends: u64,
    /// Walks along the curve that were given up, because they took too many steps.
    pub unfinished: u64,
    /// Steps of which it is not proven that both ends are on the same branch: those near singular
    /// points and, for fields that are not compiled, all.
    pub unproven_steps: u64,
    /// Cells of the box in which a component may have been missed. They are tiny, unless the search
    /// was given up.
    pub undecided: u64,
    /// How many of these are at crossings, corners and ends that were met, within 1e-3 of the box's
    /// diagonal. Intervals decide where two branches cross at an angle and at most corners; where
    /// three cross, and at cusps and ends, they cannot.
    pub undecided_at_singular: u64,
    /// The largest diagonal of an undecided cell elsewhere; 0 if there is none.
    pub largest_undecided: f64,
    /// Whether it is proven that no component was missed: no cell is undecided.
    pub proven: bool,
}

impl CurveStatistics {
    /// The length of all components together.
    pub fn length(&self) -> f64 {
        self.components
            .iter()
            .map(|component| component.length)
            .sum()
    }
}

/// A component of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveComponent {
    /// Its arc length.
    pub length: f64,
    /// Whether it ends where it begins.
    pub closed: bool,
}

/// What is known from the lines that were drawn through the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// How many lines.
    pub drawn: u64,
    /// Points in which a line may only touch the surface, or lies in it.
    pub touching: u64,
    /// Places on lines where it could not be decided whether there is a root, and where nothing is a
    /// zero to the tolerance: poles, jumps, ends of the domain.
    pub undecided: u64,
    /// Stretches of lines on which F is 0 all along: on a whole region, or the line lies in the
    /// surface.
    pub vanishing: u64,
    /// Whether no root was missed, up to the rounding of F. Only fields that are compiled give the
    /// enclosures for that.
    pub proven: bool,
    /// Enclosures of F, or of F and F_x, on one box.
    pub enclosures: u64,
    /// The area of the surface in the box; in R2 the length of the curve. None where F is 0 on a
    /// whole region, and where its roots could not be counted.
    pub area: Option<Estimate>,
    /// The volume in the box on which F < 0; in R2 the area.
    pub volume: Option<Estimate>,
}

/// An estimated number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Creases and corners of a zero set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Creased {
    /// Points of the sample that lie on them.
    pub points: u64,
    /// Corners.
    pub corners: u64,
    /// The length of all creases together.
    pub length: f64,
    /// Tiny cells in which a crease or corner may have been missed.
    pub undecided: u64,
}

impl Creased {
    /// Of these creases, on which there are no points yet.
    pub(super) fn new(creases: &Creases) -> Creased {
        Creased {
            points: 0,
            corners: creases.corners.len() as u64,
            length: creases.arcs.iter().fold(0.0, |sum, arc| sum + arc.length),
            undecided: creases.report.undecided,
        }
    }
}

/// A cover of the zero set by cells in each of which it is proven to be connected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Proof {
    /// Cells that are proven to hold one connected part of the zero set, with a seed on it.
    pub covered: u64,
    /// Cells of which nothing could be proven.
    pub left: u64,
    /// The largest diagonal of these. A component that was missed is smaller, or lies in several
    /// such cells that touch. 0 if there is none.
    pub largest_left: f64,
}

/// Particles that gave no point, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Caught where the gradient vanishes and the field does not: at a local minimum of |F|, a
    /// spurious attractor, or on a plateau.
    pub spurious: u64,
    /// Not within the tolerance when the iteration limit was reached, or stuck at a jump or at
    /// the border of where the field is defined.
    pub unconverged: u64,
    /// Gone from the box.
    pub left: u64,
    /// Without a start: the field was undefined wherever they tried.
    pub undefined: u64,
}

impl Dropped {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.spurious + self.unconverged + self.left + self.undefined
    }
}

/// Counts kept while particles move. All are sums or maxima of whole numbers, so that adding
/// tallies gives the same result in any order.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub(super) iterations: u32,
    pub(super) steps: u64,
    pub(super) evaluations: u64,
    pub(super) undefined_evaluations: u64,
    pub(super) dropped: Dropped,
}

impl Tally {
    /// Adds the counts of other particles.
    pub(super) fn add(&mut self, other: &Tally) {
        self.iterations = self.iterations.max(other.iterations);
        self.steps += other.steps;
        self.evaluations += other.evaluations;
        self.undefined_evaluations += other.undefined_evaluations;
        self.dropped.spurious += other.dropped.spurious;
        self.dropped.unconverged += other.dropped.unconverged;
        self.dropped.left += other.dropped.left;
        self.dropped.undefined += other.dropped.undefined;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Silent;

    #[test]
    fn every_moment_belongs_to_one_phase() {
        let begun = Instant::now();
        let stopwatch = Stopwatch::new(&Silent);
        let pause = Duration::from_millis(2);
        for phase in ["search", "settle", "search"] {
            std::thread::sleep(pause);
            stopwatch.progress(phase, 0.0);
        }
        std::thread::sleep(pause);
        let Times(times) = stopwatch.times();
        let whole = begun.elapsed();
        let names: Vec<&str> = times.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names, ["search", "settle"]);
        // Before the first report, after it and after the last one; after the second.
        assert!(times[0].1 >= 3 * pause && times[1].1 >= pause, "{times:?}");
        assert!(times[0].1 + times[1].1 <= whole);
    }
}
