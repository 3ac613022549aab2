//! Floaters on surfaces and curves whose areas and lengths are known in closed form.

use std::process::Command;

use crate::fields::*;
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;
use imp::graph::Op;
use imp::sample::{Method, Options, Outcome, SampleError, sample};

/// The area of the hexagonal cell of a point whose neighbours are 1 away.
const HEXAGON: f64 = 0.866_025_403_784_438_6;

fn spaced(spacing: f64, bounds: Bounds) -> Options {
    Options {
        spacing: Some(spacing),
        bounds: Some(bounds),
        ..Options::default()
    }
}

/// What holds for every run: points are zeros, in the box, with unit normals; the counts agree.
fn check(outcome: &Outcome, field: &dyn Field, bounds: Bounds) {
    let samples = &outcome.samples;
    let statistics = &outcome.statistics;
    assert_eq!(statistics.points, samples.positions.len() as u64);
    assert_eq!(
        statistics.started,
        statistics.points + statistics.dropped.total()
    );
    let limit = 1e-9 * bounds.diagonal();
    for (place, &position) in samples.positions.iter().enumerate() {
        assert!(bounds.contains(position), "{position}");
        let (value, gradient) = field.value_gradient(position);
        assert!(
            value.abs() <= limit * gradient.length(),
            "{position}: {value}"
        );
        assert!((samples.normals[place] - gradient.normalize()).length() < 1e-12);
        assert!(samples.radii[place] > 0.0);
    }
}

/// Mean, standard deviation and least of the distances to the nearest neighbours.
fn nearest(outcome: &Outcome) -> (f64, f64, f64) {
    let distances = imp::geometry::nearest_distances(&outcome.samples.positions);
    let number = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / number;
    let squares: f64 = distances.iter().map(|d| (d - mean) * (d - mean)).sum();
    let least = distances.into_iter().fold(f64::INFINITY, f64::min);
    (mean, (squares / number).sqrt(), least)
}

/// A sample of so many floaters, which must be at rest.
fn counted(field: &dyn Field, half: f64, count: u64) -> Outcome {
    let options = Options {
        count: Some(count),
        bounds: Some(cube(3, half)),
        ..Options::default()
    };
    let outcome = run(field, &options);
    assert_eq!(outcome.samples.positions.len() as u64, count);
    assert!(outcome.statistics.converged, "{count}");
    outcome
}

/// Whether the number is that of the hexagonal pattern on the area, within a part.
fn assert_number(found: usize, area: f64, spacing: f64, part: f64) {
    let expected = area / (HEXAGON * spacing * spacing);
    let ratio = found as f64 / expected;
    assert!(
        (ratio - 1.0).abs() < part,
        "{found}, expected {expected:.0}"
    );
}

#[test]
fn the_sphere_is_covered_evenly() {
    let field = sphere(DVec3::ZERO, 1.0);
    let bounds = cube(3, 1.2);
    let spacing = 0.15;
    let outcome = run(&field, &spaced(spacing, bounds));
    check(&outcome, &field, bounds);
    assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
    assert!(outcome.statistics.max_residual <= 1e-12 * bounds.diagonal());
    let area = 2.0 * std::f64::consts::TAU;
    assert_number(outcome.samples.positions.len(), area, spacing, 0.05);
    // Poisson disk samples have a least distance of 0.7 to 0.77 and a mean of 0.8.
    let (mean, deviation, least) = nearest(&outcome);
    assert!(mean > 0.9 * spacing && mean < spacing, "{mean}");
    assert!(least > 0.78 * spacing, "{least}");
    assert!(deviation < 0.05 * mean, "{deviation}");
    // No hole: places of a spiral over the sphere have a floater within 1.3 times the
    // 1 / sqrt(3) of the ideal pattern.
    for i in 0..3000 {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 3000.0;
        let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
        let ring = (1.0 - z * z).sqrt();
        let place = DVec3::new(ring * cos, ring * sin, z);
        let positions = outcome.samples.positions.iter();
        let hole = positions
            .map(|p| p.distance(place))
            .fold(f64::INFINITY, f64::min);
        assert!(hole < 0.75 * spacing, "{hole}");
    }
}

#[test]
fn the_torus_has_the_number_that_its_area_asks_for() {
    let bounds = cube(3, 1.5);
    let outcome = run(&torus(), &spaced(0.15, bounds));
    check(&outcome, &torus(), bounds);
    assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
    let area = std::f64::consts::TAU * std::f64::consts::TAU * 0.3;
    assert_number(outcome.samples.positions.len(), area, 0.15, 0.05);
}

#[test]
fn surfaces_that_lie_in_the_sides_of_the_box_are_covered() {
    // x - 1, a side of the box itself; then all six sides.
    let side = field(3, |p| (p.x - 1.0, DVec3::X));
    let all = field(3, |p| {
        let axis = p.abs().max_position();
        let mut gradient = DVec3::ZERO;
        gradient[axis] = p[axis].signum();
        (p.abs().max_element() - 1.0, gradient)
    });
    let bounds = cube(3, 1.0);
    let spacing = 0.1;
    let outcome = run(&side, &spaced(spacing, bounds));
    check(&outcome, &side, bounds);
    // At the edges of the side floaters own half a cell: with 20 along each of its edges about a
    // tenth more fits.
    assert_number(outcome.samples.positions.len(), 4.0, spacing, 0.2);
    let outcome = run(&all, &spaced(spacing, bounds));
    assert_number(outcome.samples.positions.len(), 24.0, spacing, 0.1);
}

#[test]
fn a_count_is_kept_in_any_unit_of_length() {
    for scale in [1e-3, 1.0, 1e3] {
        let field = sphere(DVec3::ONE * scale, scale);
        let bounds = Bounds::from_sides(&[(-0.2 * scale, 2.2 * scale); 3]).unwrap();
        let options = Options {
            count: Some(307),
            bounds: Some(bounds),
            ..Options::default()
        };
        let outcome = run(&field, &options);
        check(&outcome, &field, bounds);
        assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
        assert!(outcome.statistics.points.abs_diff(307) <= 1);
        let spacing = nearest(&outcome).0 / scale;
        let ideal = (2.0 * std::f64::consts::TAU / (307.0 * HEXAGON)).sqrt();
        assert!((spacing / ideal - 0.95).abs() < 0.05, "{spacing}, {ideal}");
    }
}

#[test]
fn small_and_large_components_are_both_sampled() {
    let centre = DVec3::new(3.0, 0.5, -0.2);
    let field = field(3, move |p| {
        let q = p - centre;
        if p.length() - 1.0 < q.length() - 0.05 {
            (p.length() - 1.0, p.normalize())
        } else {
            (q.length() - 0.05, q.normalize())
        }
    });
    let bounds = cube(3, 3.5);
    // The spacing is larger than the small one is.
    let outcome = run(&field, &spaced(0.2, bounds));
    check(&outcome, &field, bounds);
    let positions = outcome.samples.positions.iter();
    let small = positions.filter(|p| p.distance(centre) < 0.1).count();
    assert!((1..=3).contains(&small), "{small}");
    let rest = outcome.samples.positions.len() - small;
    assert_number(rest, 2.0 * std::f64::consts::TAU, 0.2, 0.1);
}

#[test]
fn all_eight_pieces_of_the_tanglecube_are_sampled_alike() {
    let field = field(3, |p| {
        let term = |x: f64| x * x * x * x - 5.0 * x * x;
        let slope = |x: f64| 4.0 * x * x * x - 10.0 * x;
        (
            term(p.x) + term(p.y) + term(p.z) + 15.0,
            DVec3::new(slope(p.x), slope(p.y), slope(p.z)),
        )
    });
    let bounds = cube(3, 3.0);
    let options = Options {
        count: Some(800),
        bounds: Some(bounds),
        ..Options::default()
    };
    let outcome = run(&field, &options);
    check(&outcome, &field, bounds);
    let mut pieces = [0_u32; 8];
    for position in &outcome.samples.positions {
        let side = |axis: usize| usize::from(position[axis] > 0.0) << axis;
        pieces[side(0) + side(1) + side(2)] += 1;
    }
    // All have the same area.
    assert!(pieces.iter().all(|n| n.abs_diff(100) <= 10), "{pieces:?}");
}

#[test]
fn a_curve_is_divided_evenly() {
    // Cassini's oval with a = 1, b = 1.05: r² = cos 2t + √(b⁴ - sin² 2t).
    let quartic = 1.05_f64.powi(4);
    let field = field(2, move |p| {
        let s = p.x * p.x + p.y * p.y;
        let value = s * s - 2.0 * (p.x * p.x - p.y * p.y) + 1.0 - quartic;
        (
            value,
            DVec3::new(4.0 * p.x * s - 4.0 * p.x, 4.0 * p.y * s + 4.0 * p.y, 0.0),
        )
    });
    let at = |t: f64| {
        let (sin, cos) = (2.0 * t).sin_cos();
        let r = (cos + (quartic - sin * sin).sqrt()).sqrt();
        DVec3::new(r * t.cos(), r * t.sin(), 0.0)
    };
    let parts = 100_000;
    let angle = |i: i32| f64::from(i) * std::f64::consts::TAU / f64::from(parts);
    let length: f64 = (0..parts)
        .map(|i| at(angle(i)).distance(at(angle(i + 1))))
        .sum();
    let bounds = cube(2, 2.0);
    let spacing = 0.02;
    let outcome = run(&field, &spaced(spacing, bounds));
    check(&outcome, &field, bounds);
    assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
    let mut points = outcome.samples.positions.clone();
    let ratio = points.len() as f64 / (length / spacing);
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
    // Around the origin in order of the angle, which is the order along the curve.
    points.sort_by(|a, b| a.y.atan2(a.x).total_cmp(&b.y.atan2(b.x)));
    for (place, point) in points.iter().enumerate() {
        let gap = point.distance(points[(place + 1) % points.len()]);
        assert!((0.8..1.25).contains(&(gap / spacing)), "{gap}");
    }
}

#[test]
fn a_surface_that_the_box_cuts_is_sampled_up_to_the_cut() {
    let plane = field(3, |p| (p.z - 0.5 * p.x - 0.1, DVec3::new(-0.5, 0.0, 1.0)));
    let bounds = cube(3, 1.0);
    let outcome = run(&plane, &spaced(0.15, bounds));
    check(&outcome, &plane, bounds);
    assert!(outcome.statistics.converged, "{:?}", outcome.statistics);
    let area = 4.0 * 1.25_f64.sqrt();
    // Those in the rim own half a cell or less.
    assert_number(outcome.samples.positions.len(), area, 0.15, 0.15);
    for corner in [DVec3::new(1.0, 1.0, 0.6), DVec3::new(-1.0, -1.0, -0.4)] {
        let positions = outcome.samples.positions.iter();
        let hole = positions
            .map(|p| p.distance(corner))
            .fold(f64::INFINITY, f64::min);
        assert!(hole < 0.12, "{hole}");
    }
}

#[test]
fn both_sides_of_a_thin_sheet_are_sampled() {
    let sheet = field(3, |p| (p.z.abs() - 0.01, DVec3::Z * p.z.signum()));
    let bounds = cube(3, 1.0);
    let outcome = run(&sheet, &spaced(0.15, bounds));
    check(&outcome, &sheet, bounds);
    let above = outcome
        .samples
        .positions
        .iter()
        .filter(|p| p.z > 0.0)
        .count();
    assert_number(above, 4.0, 0.15, 0.2);
    assert_number(outcome.samples.positions.len() - above, 4.0, 0.15, 0.2);
}

#[test]
fn creases_neither_stall_nor_gather_floaters() {
    // A ball of radius 1 cut by (or without) the cube of half side 0.8.
    for inside in [true, false] {
        let solid = field(3, move |p| {
            let axis = (0..3)
                .max_by(|&a, &b| p[a].abs().total_cmp(&p[b].abs()))
                .unwrap();
            let mut normal = DVec3::ZERO;
            normal[axis] = p[axis].signum();
            let cube = (p[axis].abs() - 0.8, normal);
            let cube = if inside { cube } else { (-cube.0, -cube.1) };
            let ball = (p.length() - 1.0, p.normalize());
            if cube.0 > ball.0 { cube } else { ball }
        });
        let bounds = cube(3, 1.2);
        let options = Options {
            count: Some(500),
            bounds: Some(bounds),
            ..Options::default()
        };
        let outcome = run(&solid, &options);
        check(&outcome, &solid, bounds);
        let statistics = &outcome.statistics;
        assert!(statistics.points > 450, "{statistics:?}");
        assert!(statistics.iterations <= options.iteration_limit);
        if inside {
            assert!(statistics.converged, "{statistics:?}");
            let (mean, _, least) = nearest(&outcome);
            assert!(least > 0.5 * mean, "{least}, {mean}");
        }
    }
}

#[test]
fn too_few_iterations_are_reported() {
    let options = Options {
        iteration_limit: 30,
        bounds: Some(cube(3, 1.5)),
        ..Options::default()
    };
    let outcome = run(&torus(), &options);
    check(&outcome, &torus(), cube(3, 1.5));
    assert!(!outcome.statistics.converged);
}

#[test]
fn a_field_without_a_zero_gives_no_points() {
    let field = field(3, |p| (p.length_squared() + 1.0, 2.0 * p));
    let outcome = run(&field, &Options::default());
    assert!(outcome.samples.positions.is_empty());
    let nowhere = crate::fields::field(2, |_| (f64::NAN, DVec3::NAN));
    assert_eq!(run(&nowhere, &Options::default()).statistics.points, 0);
}

#[test]
fn a_single_point_and_a_whole_region_end() {
    let point = field(3, |p| (p.length_squared(), 2.0 * p));
    let region = field(3, |_| (0.0, DVec3::ZERO));
    for field in [&point as &dyn Field, &region] {
        let options = Options {
            bounds: Some(cube(3, 1.0)),
            count: Some(50),
            ..Options::default()
        };
        let outcome = run(field, &options);
        let statistics = outcome.statistics;
        assert!(statistics.singular > 0 || statistics.max_residual < 1e-8);
    }
}

#[test]
fn a_surface_rough_below_the_spacing_ends_and_says_so() {
    // Bumps of wavelength 0.03 as steep as 76 degrees, sampled at 0.08.
    let field = field(3, |p| {
        let (sines, cosines) = ((200.0 * p).map(f64::sin), (200.0 * p).map(f64::cos));
        let value = p.length() - 1.0 + 0.02 * sines.element_product();
        let slope = DVec3::new(
            cosines.x * sines.y * sines.z,
            sines.x * cosines.y * sines.z,
            sines.x * sines.y * cosines.z,
        );
        (value, p.normalize() + 4.0 * slope)
    });
    let bounds = cube(3, 1.2);
    let options = Options {
        count: Some(500),
        bounds: Some(bounds),
        ..Options::default()
    };
    let outcome = run(&field, &options);
    check(&outcome, &field, bounds);
    let statistics = &outcome.statistics;
    assert!(!statistics.converged && statistics.started <= 1000);
    assert!(statistics.points > 0 && statistics.births.unwrap() < 10_000);
}

#[test]
fn what_floaters_cannot_do_is_refused() {
    let refused = |field: &dyn Field, options: Options| match sample(field, &options, &Silent) {
        Err(SampleError::Option { option, .. }) => option,
        other => panic!("{other:?}"),
    };
    let line = field(1, |p| (p.x, DVec3::X));
    assert_eq!(refused(&line, Options::default()), "method");
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-6] {
        let options = spaced(spacing, cube(3, 1.5));
        assert_eq!(refused(&torus(), options), "spacing");
    }
    let both = Options {
        count: Some(100),
        ..spaced(0.1, cube(3, 1.5))
    };
    assert_eq!(refused(&torus(), both), "spacing");
    let particles = Options {
        method: Method::Kinematic,
        ..spaced(0.1, cube(3, 1.5))
    };
    assert_eq!(refused(&torus(), particles), "spacing");
}

#[test]
fn the_command_writes_the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let text = "field ball(p in R3) = norm(p) - 1\nfield none(p in R3) over -1..1 = norm2(p) + 1\n";
    std::fs::write(folder.path().join("ball.imp"), text).unwrap();
    let imp = |threads: &str, words: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_imp"))
            .current_dir(folder.path())
            .env("RAYON_NUM_THREADS", threads)
            .args(words)
            .output()
            .unwrap()
    };
    let bytes = ["1", "2"].map(|threads| {
        let words = [
            "sample",
            "ball.imp",
            "ball",
            "--spacing",
            "0.15",
            "-o",
            "a.ply",
        ];
        let done = imp(threads, &words);
        assert!(done.status.success(), "{done:?}");
        std::fs::read(folder.path().join("a.ply")).unwrap()
    });
    assert_eq!(bytes[0], bytes[1]);
    let done = imp("1", &["sample", "ball.imp", "none", "--json"]);
    assert_eq!(done.status.code(), Some(4));
}

#[test]
fn arcs_between_corners_are_filled() {
    // Eight corners, at which four chords of the circle of radius 0.9 meet four short arcs of it.
    let text = "field f(x, y) = max(abs(x) + abs(y) - 1, norm([x, y]) - 0.9)";
    let field = &crate::trace::compiled(text)[0];
    for (count, method) in [
        (200, Method::Floaters),
        (1000, Method::Floaters),
        (200, Method::Relax),
        (1000, Method::Relax),
    ] {
        let options = Options {
            count: Some(count),
            bounds: Some(cube(2, 3.0)),
            method,
            ..Options::default()
        };
        let outcome = run(field, &options);
        // The polygon of the points is as long as the curve only if they are all around it.
        let mut points = outcome.samples.positions.clone();
        points.sort_by(|one, other| one.y.atan2(one.x).total_cmp(&other.y.atan2(other.x)));
        let steps = (0..points.len()).map(|place| {
            let next = points[(place + 1) % points.len()];
            points[place].distance(next)
        });
        let longest = steps.fold(0.0, f64::max);
        assert!(
            longest < 2.2 * 5.4 / count as f64,
            "{count} {method:?} {longest}"
        );
    }
}

#[test]
fn edges_in_the_planes_of_symmetry_are_found() {
    let text = "field f(p in R3) = abs(p.x) + abs(p.y) + abs(p.z) - 1";
    let field = &crate::trace::compiled(text)[0];
    let options = Options {
        count: Some(600),
        bounds: Some(cube(3, 1.2)),
        ..Options::default()
    };
    let outcome = run(field, &options);
    let creases = outcome.statistics.creases.unwrap();
    assert_eq!(creases.corners, 6);
    assert!((creases.length - 12.0 * 2.0_f64.sqrt()).abs() < 1e-9);
    let positions = outcome.samples.positions.iter();
    let on_edges = positions.filter(|p| p.abs().min_element() < 1e-9).count();
    assert_eq!(on_edges as u64, creases.points);
    assert!(on_edges > 100, "{on_edges}");
}

/// The back of a sheet takes no room from its front, however thin it is: at spacings of eight times
/// the thickness both sides have their share, within the square root of their number.
#[test]
fn a_count_is_kept_on_a_thin_shell() {
    let shell = field(3, |p| {
        let radius = p.length();
        let normal = p / radius;
        (
            (radius - 1.0).abs() - 0.01,
            normal * (radius - 1.0).signum(),
        )
    });
    for count in [300, 1000] {
        let outcome = counted(&shell, 1.5, count);
        let positions = &outcome.samples.positions;
        let outside = positions.iter().filter(|p| p.length() > 1.0).count() as f64;
        let share = 1.01 * 1.01 / (1.01 * 1.01 + 0.99 * 0.99) * count as f64;
        assert!((outside - share).abs() < (count as f64).sqrt(), "{outside}");
    }
}

/// Neither edges that are no multiple of the spacing long nor bumps smaller than the spacing keep the
/// number from being the one that was asked for.
#[test]
fn a_count_is_kept_between_edges_and_on_bumps() {
    let turned = compiled(3, |graph, [x, y, z]| {
        let coefficients = [(0.8, -0.6), (0.6, 0.8)];
        let sides = coefficients.map(|(of_x, of_y)| {
            let factors = [graph.constant(of_x), graph.constant(of_y)];
            let terms = [
                graph.apply(Op::Multiply, &[factors[0], x]),
                graph.apply(Op::Multiply, &[factors[1], y]),
            ];
            let sum = graph.apply(Op::Add, &terms);
            graph.apply(Op::Abs, &[sum])
        });
        let height = graph.apply(Op::Abs, &[z]);
        let wide = graph.apply(Op::Max, &sides);
        let largest = graph.apply(Op::Max, &[wide, height]);
        let one = graph.constant(1.0);
        graph.apply(Op::Subtract, &[largest, one])
    });
    counted(&turned, 2.0, 1000);
    counted(&turned, 2.0, 1003);
    let rough = field(3, |p| {
        let (x, y) = (30.0 * p.x, 30.0 * p.y);
        let slope = DVec3::new(-1.5 * x.cos() * y.sin(), -1.5 * x.sin() * y.cos(), 1.0);
        (p.z - 0.05 * x.sin() * y.sin(), slope)
    });
    counted(&rough, 1.0, 700);
}

/// The solutions of Thomson's problem for 2, 3 and 4 points are those of any repulsion: a diameter, a
/// triangle and a tetrahedron. Rest is a step of 5e-3 radii, of 1.2 and less.
#[test]
fn few_floaters_on_a_ball_are_as_far_apart_as_they_can_be() {
    let ball = sphere(DVec3::ZERO, 1.0);
    counted(&ball, 1.5, 1);
    let apart = [2.0, 3_f64.sqrt(), (8.0_f64 / 3.0).sqrt()];
    for (count, expected) in (2..).zip(apart) {
        let outcome = counted(&ball, 1.5, count);
        let (mean, _, least) = nearest(&outcome);
        assert!((mean - expected).abs() < 1e-2, "{count}: {mean} {expected}");
        assert!((least - expected).abs() < 1e-2, "{count}: {least}");
    }
}

/// With fewer floaters than components some go without, and that is said; with fewer than corners
/// floaters are not kept on these.
#[test]
fn fewer_floaters_than_components_or_corners_are_possible() {
    let two = field(3, |p| {
        let centres = [DVec3::ZERO, DVec3::new(5.0, 0.0, 0.0)];
        let nearer = centres.map(|centre| p - centre);
        let away = if nearer[0].length() < nearer[1].length() {
            nearer[0]
        } else {
            nearer[1]
        };
        (away.length() - 1.0, away.normalize())
    });
    for count in [1, 2, 500] {
        assert_eq!(counted(&two, 7.0, count).statistics.pieces, Some(2));
    }
    let cube_field = compiled(3, |graph, coordinates| {
        let sides = coordinates.map(|side| graph.apply(Op::Abs, &[side]));
        let wide = graph.apply(Op::Max, &sides[..2]);
        let largest = graph.apply(Op::Max, &[wide, sides[2]]);
        let one = graph.constant(1.0);
        graph.apply(Op::Subtract, &[largest, one])
    });
    for count in [1, 5, 9] {
        counted(&cube_field, 2.0, count);
    }
}
