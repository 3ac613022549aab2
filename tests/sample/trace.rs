//! Continuation along curves: lengths in closed form, equal distances, and every component.

use std::f64::consts::{PI, SQRT_2, TAU};
use std::path::PathBuf;

use glam::DVec3;
use imp::diagnostic::{Diagnostic, SourceId};
use imp::engine::{CompiledField, Field, Monitor, Silent};
use imp::geometry::Bounds;
use imp::language::{Host, Limits, Mode, Session};
use imp::sample::{CurveStatistics, Method, Options, Outcome, SampleError, sample, sample_curve};
use imp::syntax::parse;

use crate::fields::{cube, field};

/// Listens to nothing.
struct Deaf;

impl Host for Deaf {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, _warning: Diagnostic) {}

    fn wrote(&mut self, _path: &std::path::Path) {}

    fn read_source(
        &mut self,
        path: &std::path::Path,
    ) -> Result<(SourceId, std::sync::Arc<str>), Diagnostic> {
        panic!("{} is not read here", path.display())
    }

    fn monitor(&self) -> &dyn Monitor {
        &Silent
    }
}

/// The fields that vanish on what `field f` of a program in the language stands for.
pub(crate) fn compiled(text: &str) -> Vec<CompiledField> {
    let mut session = Session::new(
        Box::new(Deaf),
        Mode::Define,
        Limits::default(),
        PathBuf::new(),
        Vec::new(),
    );
    let parsed = parse(SourceId(0), text);
    assert!(parsed.diagnostics.is_empty(), "{text}");
    session.run(&parsed.tree).unwrap();
    let found = session.fields().get("f").cloned().unwrap();
    found.surfaces(session.graph(), &[]).unwrap()
}

/// The options of continuation in a box.
fn options(bounds: Bounds, count: u64) -> Options {
    Options {
        method: Method::Trace,
        bounds: Some(bounds),
        count: Some(count),
        ..Options::default()
    }
}

fn trace(text: &str, options: &Options) -> Result<Outcome, SampleError> {
    match compiled(text).as_slice() {
        [one, other] => sample_curve([one, other], options, &Silent),
        [field] => sample(field, options, &Silent),
        _ => panic!("one or two fields"),
    }
}

fn curves(outcome: &Outcome) -> &CurveStatistics {
    outcome.statistics.curves.as_ref().unwrap()
}

/// Lengths in ascending order.
fn lengths(outcome: &Outcome) -> Vec<f64> {
    let mut lengths: Vec<f64> = curves(outcome)
        .components
        .iter()
        .map(|component| component.length)
        .collect();
    lengths.sort_by(f64::total_cmp);
    lengths
}

/// The curve is traced, with these lengths, all components closed or all open, and nothing missed.
#[track_caller]
fn traced(text: &str, half: f64, expected: &[f64], closed: bool) -> Outcome {
    let outcome = measured(text, half, expected, closed);
    let curves = curves(&outcome);
    assert!(curves.proven && curves.undecided == 0, "{curves:?}");
    outcome
}

/// The same, but for what is left undecided at singular points that were met.
#[track_caller]
fn measured(text: &str, half: f64, expected: &[f64], closed: bool) -> Outcome {
    let dimension = if text.contains("z)") { 3 } else { 2 };
    let outcome = trace(text, &options(cube(dimension, half), 200)).unwrap();
    let found = lengths(&outcome);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        // The rule of the ninth degree is that good on steps that turn by a few degrees.
        assert!(
            (found - expected).abs() < 1e-8 * expected,
            "{found} {expected}"
        );
    }
    let curves = curves(&outcome);
    assert_eq!(curves.undecided, curves.undecided_at_singular, "{curves:?}");
    assert_eq!(curves.proven, curves.undecided == 0);
    assert!(curves.components.iter().all(|found| found.closed == closed));
    assert_eq!(outcome.samples.positions.len(), 200);
    assert!(outcome.statistics.max_residual < 1e-13);
    outcome
}

/// The composite midpoint rule, which for smooth periodic integrands converges faster than any
/// power.
fn periodic_integral(period: f64, integrand: impl Fn(f64) -> f64) -> f64 {
    let count = 4000;
    let step = period / f64::from(count);
    let at = |place: i32| integrand((f64::from(place) + 0.5) * step);
    (0..count).map(at).sum::<f64>() * step
}

#[test]
fn closed_curves_have_their_lengths() {
    traced("field f(x, y) = x^2 + y^2 - 1", 1.5, &[TAU], true);
    let speed = |t: f64| (3.0 * t.sin()).hypot(t.cos());
    let perimeter = periodic_integral(TAU, speed);
    traced("field f(x, y) = x^2/9 + y^2 - 1", 4.0, &[perimeter], true);
    // A distance has a gradient of length 1; a cube of it has hardly any.
    traced("field f(x, y) = sqrt(x^2 + y^2) - 1", 1.5, &[TAU], true);
}

/// r² = cos 2θ ± √(b⁴ - sin² 2θ) with foci at ±1: two loops for b < 1, one for b > 1.
#[test]
fn cassini_ovals_have_one_loop_or_two() {
    let text = |b: f64| format!("field f(x, y) = (x^2 + y^2)^2 - 2*(x^2 - y^2) + 1 - ({b})^4");
    // One loop, by the angle θ.
    let b: f64 = 1.05;
    let speed = |t: f64| {
        let radius = |t: f64| {
            let root = (b.powi(4) - (2.0 * t).sin().powi(2)).sqrt();
            ((2.0 * t).cos() + root).sqrt()
        };
        let step = 1e-5;
        radius(t).hypot((radius(t + step) - radius(t - step)) / (2.0 * step))
    };
    traced(&text(b), 2.0, &[periodic_integral(TAU, speed)], true);
    // Two loops: (z - 1)(z + 1) = b² e^{it}, so that |dz/dt| = b² / (2 |z|) with z² = 1 + b² e^{it}.
    let b: f64 = 0.98;
    let square = b * b;
    let speed = |t: f64| {
        let modulus = (1.0 + square * t.cos()).hypot(square * t.sin()).sqrt();
        0.5 * square / modulus
    };
    let loop_length = periodic_integral(TAU, speed);
    traced(&text(b), 2.0, &[loop_length; 2], true);
}

#[test]
fn branches_go_straight_on_over_crossings() {
    // The lemniscate's length is twice the lemniscate constant, 2.62205755429211981.
    let text = "field f(x, y) = (x^2 + y^2)^2 - x^2 + y^2";
    let outcome = traced(text, 1.5, &[5.244_115_108_584_24], true);
    assert_eq!(curves(&outcome).crossings, 1);
    // Three branches in one point, where the direction of the equations does not turn round.
    let text = "field f(x, y) = (x^2 + y^2)^2 - x^3 + 3*x*y^2";
    let speed = |t: f64| (3.0 * t).cos().hypot(3.0 * (3.0 * t).sin());
    let outcome = measured(text, 1.5, &[periodic_integral(PI, speed)], true);
    assert_eq!(curves(&outcome).crossings, 1);
    // No enclosure tells it from three branches around a tiny triangle.
    assert!(!curves(&outcome).proven);
    // Two lines, and the circle that crosses each twice.
    let text = "field f(x, y) = x*y*(x^2 + y^2 - 1)";
    let outcome = trace(text, &options(cube(2, 2.0), 100)).unwrap();
    assert_eq!(curves(&outcome).crossings, 5);
    for (found, expected) in lengths(&outcome).iter().zip([4.0, 4.0, TAU]) {
        assert!((found - expected).abs() < 1e-7, "{found}");
    }
}

#[test]
fn corners_and_cusps_are_passed() {
    let near = |text: &str, expected: f64, corners: u64| {
        let outcome = trace(text, &options(cube(2, 2.5), 100)).unwrap();
        let found = lengths(&outcome);
        assert_eq!(found.len(), 1, "{text}: {found:?}");
        // Of a cusp, a tip as short as the shortest step is cut off.
        assert!(
            (found[0] - expected).abs() < 1e-5,
            "{} {expected}",
            found[0]
        );
        let curves = curves(&outcome);
        assert!(
            curves.components[0].closed && curves.corners == corners,
            "{curves:?}"
        );
    };
    near("field f(x, y) = max(abs(x), abs(y)) - 1", 8.0, 4);
    near("field f(x, y) = (x^2 + y^2 - 1)^3 + 27*x^2*y^2", 6.0, 4);
    near("field f(x, y) = (x^2 + y^2 + x)^2 - x^2 - y^2", 8.0, 1);
    // Two circles of radius 1 whose centres are 1 apart, without what is inside the other.
    let text = "field f(x, y) = min(x^2 + y^2 - 1, (x - 1)^2 + y^2 - 1)";
    near(text, 2.0 * (TAU - TAU / 3.0), 2);
}

#[test]
fn curves_end_at_the_box() {
    // The quarters of xy = 1 between x = 1/2 and 2, by Simpson's rule on a smooth integrand.
    let count = 2000;
    let step = 1.5 / f64::from(count);
    let speed = |place: f64| 1.0_f64.hypot((0.5 + place * step).powi(-2));
    let simpson = |place: i32| {
        let place = f64::from(place);
        (speed(place) + 4.0 * speed(place + 0.5) + speed(place + 1.0)) * step / 6.0
    };
    let length: f64 = (0..count).map(simpson).sum();
    let outcome = traced("field f(x, y) = x*y - 1", 2.0, &[length; 2], false);
    let on_border = outcome
        .samples
        .positions
        .iter()
        .filter(|point| point.abs().max_element() == 2.0);
    assert_eq!(on_border.count(), 4);
    // A circle that touches the box in four points is not cut there, and not proven.
    let outcome = trace("field f(x, y) = x^2 + y^2 - 1", &options(cube(2, 1.0), 100)).unwrap();
    assert_eq!(curves(&outcome).components.len(), 1);
    assert!(curves(&outcome).components[0].closed);
    // A curve ends where the field does: y = √x, from the origin to (2, √2).
    let outcome = trace("field f(x, y) = y - sqrt(x)", &options(cube(2, 2.0), 100)).unwrap();
    let length = 4.5_f64.sqrt() + 0.25 * (2.0 * SQRT_2).asinh();
    assert!((lengths(&outcome)[0] - length).abs() < 1e-5);
    assert_eq!(curves(&outcome).ends, 1);
}

#[test]
fn components_of_all_sizes_are_found_and_kept_apart() {
    let text = "field f(x, y) = (x^2 + y^2 - 1)*((x - 1.5)^2 + (y - 1.5)^2 - 1e-4)";
    traced(text, 2.0, &[0.01 * TAU, TAU], true);
    let text = "field f(x, y) = (x^2 + y^2 - 1)*(x^2 + y^2 - 1.02^2)";
    traced(text, 2.0, &[TAU, 1.02 * TAU], true);
}

#[test]
fn what_may_hide_a_component_is_not_called_proven() {
    // A circle too small to be walked along, isolated zeros, and a circle beside a crossing.
    for other in [
        "(x - 2)^2 + y^2 - 1e-14",
        "(x - 2.1)^2 + (y - 0.3)^2 - 1e-14",
        "(x - 2)^2 + y^2",
        "(x - 2.1)^2 + (y - 0.3)^2",
        "(x + 2)*(y - 1.9)*((x + 1.9999)^2 + (y - 1.9001)^2 - 1e-14)",
    ] {
        let text = format!("field f(x, y) = (x^2 + y^2 - 1)*({other})");
        let outcome = trace(&text, &options(cube(2, 3.0), 100)).unwrap();
        let curves = curves(&outcome);
        let circle = |length: &f64| (length - TAU).abs() < 1e-7;
        assert!(lengths(&outcome).iter().any(circle), "{other}");
        assert!(
            !curves.proven && curves.undecided > 0,
            "{other}: {curves:?}"
        );
    }
    let text = "field f(x, y) = (x^2 + y^2 - 1)*((x - 2)^2 + y^2)";
    let outcome = trace(text, &options(cube(2, 3.0), 100)).unwrap();
    let curves = curves(&outcome);
    // What could not be walked along is no end of the curve.
    assert_eq!((curves.ends, curves.undecided_at_singular), (0, 0));
    assert!(curves.largest_undecided < 1e-3 && curves.largest_undecided > 0.0);
}

#[test]
fn crossings_at_an_angle_and_corners_hide_nothing() {
    // Two lines and a circle; a hyperbola that misses a crossing by far less than cells can tell.
    let text = "field f(x, y) = x*y*(x^2 + y^2 - 1)";
    let outcome = trace(text, &options(cube(2, 2.1), 100)).unwrap();
    assert!(curves(&outcome).proven && curves(&outcome).crossings == 5);
    let text = "field f(x, y) = (x - 0.3)*(y + 0.2*x) - 1e-13";
    assert!(curves(&trace(text, &options(cube(2, 2.0), 100)).unwrap()).proven);
    for text in [
        "field f(x, y) = max(abs(x), abs(y)) - 1",
        "field f(x, y) = abs(x) + abs(y) - 1",
        "field f(x, y) = min(x^2 + y^2 - 1, (x - 1)^2 + y^2 - 1)",
    ] {
        let outcome = trace(text, &options(cube(2, 2.5), 100)).unwrap();
        assert!(curves(&outcome).proven, "{text}: {:?}", curves(&outcome));
    }
}

#[test]
fn a_search_without_an_end_is_given_up() {
    // Ever finer waves: what is left is large, and counted.
    let text = "field f(x, y) = y - sin(1/x)";
    let outcome = trace(text, &options(cube(2, 1.0), 100)).unwrap();
    let curves = curves(&outcome);
    assert!(!curves.proven && curves.undecided > curves.undecided_at_singular);
    // Both sides of the pole are seen: they are symmetric.
    let side = |sign: f64| {
        let positions = outcome.samples.positions.iter();
        positions.filter(|point| sign * point.x > 0.0).count()
    };
    assert!(
        side(1.0) > 20 && side(-1.0) > 20,
        "{} {}",
        side(1.0),
        side(-1.0)
    );
    // About a million in vain, and what the steps take.
    let statistics = &outcome.statistics;
    assert!(statistics.evaluations < (1 << 21) + 50 * statistics.steps);
    // A square is 0 without a change of sign, wherever the cells fall.
    for half in [1.5, 1.0, 1.7] {
        let text = "field f(x, y) = (x^2 + y^2 - 1)^2";
        let found = trace(text, &options(cube(2, half), 100));
        assert!(
            matches!(found, Err(SampleError::NoCurve { .. })),
            "{found:?}"
        );
    }
}

/// 2πn/5 for gaps, for closed curves; chords on a circle tell the arc between points.
#[test]
fn points_are_at_equal_distances() {
    let check = |options: &Options, number: usize| {
        let outcome = trace("field f(x, y) = x^2 + y^2 - 1", options).unwrap();
        let points = &outcome.samples.positions;
        assert_eq!(points.len(), number);
        let arc = TAU / number as f64;
        for (place, point) in points.iter().enumerate() {
            let next = points[(place + 1) % number];
            let found = 2.0 * (0.5 * point.distance(next)).asin();
            assert!((found - arc).abs() < 1e-9 * arc, "{found} {arc}");
        }
        for (tangent, normal) in outcome
            .samples
            .tangents
            .iter()
            .zip(&outcome.samples.normals)
        {
            // The inside is on the left.
            assert!(tangent.cross(*normal).distance(DVec3::NEG_Z) < 1e-12);
        }
    };
    check(&options(cube(2, 1.5), 137), 137);
    let spaced = Options {
        spacing: Some(0.1),
        count: None,
        ..options(cube(2, 1.5), 1)
    };
    check(&spaced, 63);
    // The parabola's arc length is s(x) = x √(1/4 + x²) + asinh(2x) / 4.
    let outcome = trace("field f(x, y) = y - x^2", &options(cube(2, 1.0), 50)).unwrap();
    let along = |x: f64| x * (0.25 + x * x).sqrt() + 0.25 * (2.0 * x).asinh();
    let mut xs: Vec<f64> = outcome
        .samples
        .positions
        .iter()
        .map(|point| point.x)
        .collect();
    xs.sort_by(f64::total_cmp);
    let gap = 2.0 * along(1.0) / 49.0;
    for pair in xs.windows(2) {
        assert!((along(pair[1]) - along(pair[0]) - gap).abs() < 1e-8 * gap);
    }
    // Of two components, each gets its part.
    let text = "field f(x, y) = (x^2 + y^2 - 1)*((x - 3)^2 + y^2 - 0.25)";
    let outcome = trace(text, &options(cube(2, 4.0), 300)).unwrap();
    let right = outcome
        .samples
        .positions
        .iter()
        .filter(|point| point.x > 2.0);
    assert_eq!(right.count(), 100);
}

#[test]
fn curves_in_space_have_their_lengths() {
    // By its parametrization (cos t, sin t, 2 sin(t/2)) + (1, 0, 0), 0 to 4π.
    let viviani = "field f(x, y, z) = [x^2 + y^2 + z^2 - 4, (x - 1)^2 + y^2 - 1]";
    let length = periodic_integral(4.0 * PI, |t| (1.0 + (0.5 * t).cos().powi(2)).sqrt());
    let outcome = measured(viviani, 2.5, &[length], true);
    assert_eq!(curves(&outcome).crossings, 1);
    let circle = "field f(x, y, z) = [x^2 + y^2 + z^2 - 1, x + y + z - 0.5]";
    let radius = (1.0 - 0.25 / 3.0_f64).sqrt();
    let outcome = traced(circle, 1.5, &[TAU * radius], true);
    for (point, tangent) in outcome
        .samples
        .positions
        .iter()
        .zip(&outcome.samples.tangents)
    {
        let outward = *point - DVec3::splat(0.5 / 3.0);
        assert!(tangent.dot(outward).abs() < 1e-12 && tangent.dot(DVec3::ONE).abs() < 1e-12);
    }
    // Two rings through each other.
    let links = "field f(x, y, z) = [(sqrt(x^2 + y^2) - 1)*(x - 0.3), z]";
    let outcome = trace(links, &options(cube(3, 1.7), 100)).unwrap();
    assert_eq!(curves(&outcome).crossings, 2);
    assert_eq!(lengths(&outcome).len(), 2);
}

#[test]
fn the_trefoil_is_one_closed_curve() {
    let text = "field f(x, y, z) = {
        let r2 = x^2 + y^2 + z^2
        let [a, b] = [r2 - 1, 2*z]
        [(r2 + 1)*(a^2 - b^2) + 8*(x^3 - 3*x*y^2), (r2 + 1)*2*a*b + 8*(3*x^2*y - y^3)]
    }";
    let outcome = trace(text, &options(cube(3, 2.5), 500)).unwrap();
    let curves = curves(&outcome);
    assert!(curves.proven && curves.components.len() == 1 && curves.components[0].closed);
    // The chords of inscribed polygons, extrapolated: their defect falls with the square.
    let chords = |every: usize| {
        let points: Vec<DVec3> = outcome
            .samples
            .positions
            .iter()
            .copied()
            .step_by(every)
            .collect();
        let next = points.iter().cycle().skip(1);
        points
            .iter()
            .zip(next)
            .map(|(one, other)| one.distance(*other))
            .sum::<f64>()
    };
    let extrapolated = (4.0 * chords(1) - chords(2)) / 3.0;
    assert!((curves.components[0].length - extrapolated).abs() < 1e-6);
    assert!((extrapolated - 20.643).abs() < 5e-4, "{extrapolated}");
}

#[test]
fn what_is_no_curve_is_refused() {
    let refused = |text: &str, dimension| {
        let found = trace(text, &options(cube(dimension, 2.0), 100));
        assert!(
            matches!(found, Err(SampleError::NoCurve { .. })),
            "{text}: {found:?}"
        );
    };
    // A square, which does not change its sign; a region; surfaces that touch along a circle or in
    // a point, and that coincide.
    refused("field f(x, y) = (x^2 + y^2 - 1)^2", 2);
    refused("field f(x, y) = max(x^2 + y^2 - 1, 0)", 2);
    refused("field f(x, y, z) = [x^2 + y^2 + z^2 - 1, x^2 + y^2 - 1]", 3);
    refused("field f(x, y, z) = [x^2 + y^2 + z^2 - 1, z - 1]", 3);
    refused(
        "field f(x, y, z) = [x^2 + y^2 + z^2 - 1, x^2 + y^2 + z^2 - 1]",
        3,
    );
    // Where there is nothing, that is proven.
    for text in [
        "field f(x, y) = x^2 + y^2 + 1",
        "field f(x, y, z) = [z - 1, z + x^2]",
    ] {
        let dimension = compiled(text)[0].dimension();
        let outcome = trace(text, &options(cube(dimension, 2.0), 100)).unwrap();
        assert!(
            outcome.samples.positions.is_empty() && curves(&outcome).proven,
            "{text}"
        );
    }
}

#[test]
fn options_that_do_not_fit_are_refused() {
    let text = "field f(x, y) = x^2 + y^2 - 1";
    let close = Options {
        spacing: Some(1e-9),
        count: None,
        ..options(cube(2, 1.5), 1)
    };
    assert!(matches!(
        trace(text, &close),
        Err(SampleError::Option {
            option: "spacing",
            ..
        })
    ));
    let line = field(1, |p| (p.x, DVec3::X));
    let error = sample(&line, &options(cube(1, 1.0), 1), &Silent).unwrap_err();
    assert!(error.to_string().contains("kinematic"), "{error}");
    let fields = compiled("field f(x, y, z) = [x, y]");
    let floaters = Options::default();
    let error = sample_curve([&fields[0], &fields[1]], &floaters, &Silent).unwrap_err();
    assert!(error.to_string().contains("\"trace\""), "{error}");
    let unbounded = Options {
        bounds: None,
        ..options(cube(2, 1.0), 10)
    };
    let error = trace("field f(x, y) = x - y", &unbounded).unwrap_err();
    assert!(
        matches!(
            error,
            SampleError::Option {
                option: "bounds",
                ..
            }
        ),
        "{error}"
    );
    // Without bounds, those that hold all of the curve are found.
    let outcome = trace("field f(x, y) = (x - 7)^2 + y^2 - 1", &unbounded).unwrap();
    assert!((lengths(&outcome)[0] - TAU).abs() < 1e-8);
}

#[test]
fn fields_of_which_nothing_can_be_enclosed_start_from_a_grid() {
    let circle = field(2, |p| (p.length_squared() - 1.0, 2.0 * p));
    let outcome = sample(&circle, &options(cube(2, 1.5), 100), &Silent).unwrap();
    assert!((lengths(&outcome)[0] - TAU).abs() < 1e-8);
    assert!(!curves(&outcome).proven);
    let sphere = field(3, |p| (p.length_squared() - 1.0, 2.0 * p));
    let plane = field(3, |p| (p.z - 0.2, DVec3::Z));
    let outcome = sample_curve([&sphere, &plane], &options(cube(3, 1.5), 100), &Silent).unwrap();
    assert!((lengths(&outcome)[0] - TAU * 0.96_f64.sqrt()).abs() < 1e-8);
    // Half of it is NaN: an open curve, no points beyond.
    let half = field(2, |p| {
        let value = if p.x < 0.0 {
            f64::NAN
        } else {
            p.length_squared() - 1.0
        };
        (value, 2.0 * p)
    });
    let outcome = sample(&half, &options(cube(2, 1.5), 100), &Silent).unwrap();
    assert!((lengths(&outcome)[0] - PI).abs() < 1e-5);
    assert!(outcome.samples.positions.iter().all(|point| point.x >= 0.0));
    assert_eq!(curves(&outcome).ends, 2);
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let run = |text: &str, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let work = || trace(text, &options(cube(3, 2.5), 300)).unwrap();
        let outcome = pool.build().unwrap().install(work);
        let points = outcome.samples.positions.iter();
        let bits: Vec<[u64; 3]> = points
            .map(|point| point.to_array().map(f64::to_bits))
            .collect();
        (bits, outcome.statistics)
    };
    for text in [
        "field f(x, y, z) = [x^2 + y^2 + z^2 - 4, (x - 1)^2 + y^2 - 1]",
        "field f(x, y, z) = x^2 + y^2 + 2*z^2 - 1",
    ] {
        let [one, two, four] = [1, 2, 4].map(|threads| run(text, threads));
        assert!(one == two && one == four, "{text}");
    }
}

/// The nearest-neighbour distances, in spacings of the hexagonal pattern of as many points on the
/// area: least and mean.
fn evenness(points: &[DVec3], area: f64) -> (f64, f64) {
    let ideal = (2.0 * area / (3.0_f64.sqrt() * points.len() as f64)).sqrt();
    let nearest = |point: &DVec3| {
        let others = points.iter().filter(|other| *other != point);
        let distances = others.map(|other| other.distance(*point));
        distances.fold(f64::INFINITY, f64::min) / ideal
    };
    let found: Vec<f64> = points.iter().map(nearest).collect();
    let least = found.iter().copied().fold(f64::INFINITY, f64::min);
    (least, found.iter().sum::<f64>() / found.len() as f64)
}

#[test]
fn fronts_cover_surfaces_evenly() {
    let torus = "field f(x, y, z) = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.09";
    for (text, area) in [
        ("field f(x, y, z) = x^2 + y^2 + z^2 - 1", 4.0 * PI),
        (torus, 4.0 * PI * PI * 0.3),
    ] {
        let outcome = trace(text, &options(cube(3, 1.5), 1000)).unwrap();
        let points = &outcome.samples.positions;
        assert!(outcome.statistics.converged && points.len().abs_diff(1000) <= 10);
        assert!(outcome.statistics.max_residual < 1e-14);
        assert_eq!(outcome.statistics.proof.unwrap().left, 0);
        // Random points have 0.003 and 0.46, Poisson disks at best 0.77 and 0.82.
        let (least, mean) = evenness(points, area);
        assert!(least > 0.7 && mean > 0.88, "{least} {mean}");
    }
    // No hole has room for another point.
    let ball = "field f(x, y, z) = x^2 + y^2 + z^2 - 1";
    let spaced = Options {
        spacing: Some(0.1),
        count: None,
        ..options(cube(3, 1.5), 1)
    };
    let outcome = trace(ball, &spaced).unwrap();
    for number in 0..4000 {
        let z = 1.0 - (f64::from(number) + 0.5) / 2000.0;
        let (sine, cosine) = (2.399_963 * f64::from(number)).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        let place = DVec3::new(ring * cosine, ring * sine, z);
        let distances = outcome
            .samples
            .positions
            .iter()
            .map(|point| point.distance(place));
        let nearest = distances.fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.1, "{nearest} at {place}");
    }
}

#[test]
fn fronts_reach_every_component_and_keep_sheets_apart() {
    let text = "field f(x, y, z) = min(x^2 + y^2 + z^2 - 1, norm([x - 1.5, y - 1.5, z]) - 0.05)";
    let outcome = trace(text, &options(cube(3, 2.0), 500)).unwrap();
    let small = outcome
        .samples
        .positions
        .iter()
        .filter(|point| point.x + point.y > 2.5);
    assert!(small.count() >= 1);
    // Both sides of a plate that is thinner than the spacing, up to the box.
    let outcome = trace(
        "field f(x, y, z) = abs(z - 0.1) - 0.01",
        &options(cube(3, 1.0), 500),
    )
    .unwrap();
    let points = &outcome.samples.positions;
    let upper = points.iter().filter(|point| point.z > 0.1).count();
    assert!((200..300).contains(&upper), "{upper} of {}", points.len());
    let on_border = points
        .iter()
        .filter(|point| point.abs().max_element() == 1.0);
    // Spacing about 0.13: 120 would fit along both borders.
    let on_border = on_border.count();
    assert!(on_border > 40, "{on_border}");
    // A cube: no point piles up on an edge.
    let outcome = trace(
        "field f(x, y, z) = max(abs(x), abs(y), abs(z)) - 1",
        &options(cube(3, 1.5), 1000),
    );
    let (least, mean) = evenness(&outcome.unwrap().samples.positions, 24.0);
    assert!(least > 0.6 && mean > 0.8, "{least} {mean}");
}

#[test]
fn fronts_refuse_what_they_cannot_cover() {
    let singular = trace(
        "field f(x, y, z) = (x^2 + y^2 + z^2 - 1)^2",
        &options(cube(3, 2.0), 100),
    );
    assert!(
        matches!(singular, Err(SampleError::NoCurve { fields: 1 })),
        "{singular:?}"
    );
    let empty = trace(
        "field f(x, y, z) = x^2 + y^2 + z^2 + 1",
        &options(cube(3, 2.0), 100),
    )
    .unwrap();
    assert!(empty.samples.positions.is_empty() && empty.statistics.proof.unwrap().left == 0);
    let close = Options {
        spacing: Some(1e-6),
        count: None,
        count_limit: 1000,
        ..options(cube(3, 1.5), 1)
    };
    let text = "field f(x, y, z) = x^2 + y^2 + z^2 - 1";
    let found = trace(text, &close);
    // 4π over the area of a hexagonal cell, within the accuracy of a coarse front.
    let Err(SampleError::Option { option, found, .. }) = found else {
        panic!("{found:?}");
    };
    let number = found.split_once("about ").unwrap().1.trim_end_matches(')');
    let expected = 4.0 * std::f64::consts::PI / (0.75_f64.sqrt() * 1e-12);
    let ratio = number.parse::<f64>().unwrap() / expected;
    assert!(
        option == "spacing" && (0.8..1.2).contains(&ratio),
        "{ratio}"
    );
    // Nothing can be enclosed, and half of it is not a number.
    let half = field(3, |p| {
        let value = if p.x < 0.0 {
            f64::NAN
        } else {
            p.length_squared() - 1.0
        };
        (value, 2.0 * p)
    });
    let outcome = sample(&half, &options(cube(3, 1.5), 300), &Silent).unwrap();
    let points = &outcome.samples.positions;
    assert!(points.len().abs_diff(300) <= 3 && outcome.statistics.proof.is_none());
    assert!(
        points
            .iter()
            .all(|point| point.x >= 0.0 && (point.length() - 1.0).abs() < 1e-12)
    );
}
