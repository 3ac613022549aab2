//! The particle methods on surfaces with closed forms.

use crate::fields::*;
use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::sample::{Method, Options, Outcome, sample};

const METHODS: [Method; 2] = [Method::Kinematic, Method::Dynamic];

/// A distance in closed form.
type Distance = fn(DVec3) -> f64;

fn options(method: Method) -> Options {
    Options {
        method,
        ..particles()
    }
}

/// What holds for every sample: the counts add up, the residuals are within the tolerance and
/// are what the field says at the points.
fn check(outcome: &Outcome, field: &dyn Field, tolerance: f64) {
    let statistics = &outcome.statistics;
    let samples = &outcome.samples;
    let points = samples.positions.len();
    assert_eq!(statistics.points, points as u64);
    let accounted = statistics.points + statistics.dropped.total();
    assert_eq!(statistics.started, accounted, "{statistics:?}");
    assert_eq!(samples.normals.len(), points);
    assert_eq!(samples.radii.len(), points);
    assert_eq!(samples.residuals.len(), points);
    let limit = tolerance * statistics.bounds.diagonal();
    assert!(statistics.max_residual <= limit, "{statistics:?}");
    for (place, &position) in samples.positions.iter().enumerate() {
        let (value, gradient) = field.value_gradient(position);
        let residual = samples.residuals[place];
        assert!(residual <= limit);
        let expected = residual * gradient.length();
        assert!((value.abs() - expected).abs() <= 1e-12 * expected + 1e-300);
    }
}

#[test]
fn every_particle_reaches_a_smooth_surface() {
    let unit: Distance = |p| p.length() - 1.0;
    let ring: Distance = |p| (p.x.hypot(p.y) - 1.0).hypot(p.z) - 0.3;
    let fields: [(Box<dyn Field>, Distance); 2] = [
        (Box::new(sphere(DVec3::ZERO, 1.0)), unit),
        (Box::new(torus()), ring),
    ];
    for method in METHODS {
        for (field, distance) in &fields {
            let outcome = run(&**field, &options(method));
            check(&outcome, &**field, 1e-9);
            let statistics = &outcome.statistics;
            assert!(statistics.points >= 4_950, "{statistics:?}");
            assert!(statistics.converged && statistics.settled);
            // The first-order distance is the true one up to its square.
            let limit = 1.001e-9 * statistics.bounds.diagonal();
            for &position in &outcome.samples.positions {
                assert!(distance(position).abs() <= limit);
            }
        }
    }
}

#[test]
fn normals_are_unit_gradients_and_disks_do_not_overlap() {
    let outcome = run(&sphere(DVec3::ZERO, 1.0), &particles());
    let samples = &outcome.samples;
    for (position, normal) in samples.positions.iter().zip(&samples.normals) {
        assert!(position.distance(*normal) < 1e-8);
    }
    for i in 0..200 {
        for j in 0..i {
            let distance = samples.positions[i].distance(samples.positions[j]);
            assert!(samples.radii[i] + samples.radii[j] <= distance * (1.0 + 1e-15));
        }
    }
}

#[test]
fn a_tighter_tolerance_is_met_too() {
    for method in METHODS {
        let wanted = Options {
            tolerance: 1e-12,
            ..options(method)
        };
        let field = blobs();
        let outcome = run(&field, &wanted);
        check(&outcome, &field, 1e-12);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );
    }
}

#[test]
fn blobs_with_a_flat_far_field_are_reached_from_afar() {
    for method in METHODS {
        let wanted = Options {
            bounds: Some(cube(3, 8.0)),
            ..options(method)
        };
        let field = blobs();
        let outcome = run(&field, &wanted);
        check(&outcome, &field, 1e-9);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );
    }
}

#[test]
fn no_part_of_the_sphere_is_missed() {
    for method in METHODS {
        let outcome = run(&sphere(DVec3::ZERO, 1.0), &options(method));
        // Six faces of the cube around it, each divided into 4 × 4 patches.
        let mut patches = [0_u32; 96];
        for position in &outcome.samples.positions {
            let axis = (0..3)
                .max_by(|&a, &b| position[a].abs().total_cmp(&position[b].abs()))
                .unwrap();
            let side = usize::from(position[axis] > 0.0);
            let cell = |other: usize| {
                let coordinate = position[(axis + other) % 3] / position[axis].abs();
                ((coordinate + 1.0) * 2.0).clamp(0.0, 3.0) as usize
            };
            patches[((axis * 2 + side) * 4 + cell(1)) * 4 + cell(2)] += 1;
        }
        // 52 on average; the smallest patch has half the mean area.
        assert!(patches.iter().all(|&count| count >= 8), "{patches:?}");
    }
}

#[test]
fn curves_in_the_plane_are_sampled_on_every_component() {
    // (x² + y²)² - 2 a² (x² - y²) + a⁴ - b⁴ with a = 1, b = 0.95: two ovals.
    let cassini = field(2, |p| {
        let DVec3 { x, y, .. } = p;
        let s = x * x + y * y;
        let value = s * s - 2.0 * (x * x - y * y) + 1.0 - 0.95_f64.powi(4);
        (
            value,
            DVec3::new(4.0 * x * s - 4.0 * x, 4.0 * y * s + 4.0 * y, 0.0),
        )
    });
    let ellipse = field(2, |p| {
        let value = p.x * p.x / 9.0 + p.y * p.y - 1.0;
        (value, DVec3::new(2.0 * p.x / 9.0, 2.0 * p.y, 0.0))
    });
    for method in METHODS {
        let outcome = run(&cassini, &options(method));
        check(&outcome, &cassini, 1e-9);
        assert!(outcome.statistics.points >= 990, "{:?}", outcome.statistics);
        let right = outcome
            .samples
            .positions
            .iter()
            .filter(|p| p.x > 0.0)
            .count();
        assert!((300..=700).contains(&right), "{right}");

        let outcome = run(&ellipse, &options(method));
        check(&outcome, &ellipse, 1e-9);
        assert!(outcome.statistics.points >= 990, "{:?}", outcome.statistics);
        assert!(outcome.samples.positions.iter().any(|p| p.x > 2.95));
        assert!(outcome.samples.positions.iter().any(|p| p.x < -2.95));
        assert!(outcome.samples.positions.iter().all(|p| p.z == 0.0));
    }
}

#[test]
fn both_of_two_spheres_are_found_from_the_default_box() {
    // The product of two spheres of radius 0.5 at x = ±2, outside the box where the search
    // begins.
    let near = sphere(2.0 * DVec3::X, 0.5);
    let far = sphere(-2.0 * DVec3::X, 0.5);
    let both = field(3, move |p| {
        let ((f, f_x), (g, g_x)) = (near.value_gradient(p), far.value_gradient(p));
        (f * g, f * g_x + g * f_x)
    });
    for method in METHODS {
        let outcome = run(&both, &options(method));
        check(&outcome, &both, 1e-9);
        let right = outcome
            .samples
            .positions
            .iter()
            .filter(|p| p.x > 0.0)
            .count();
        let left = outcome.samples.positions.len() - right;
        assert!(right > 1_500 && left > 1_500, "{right} {left}");
    }
}

#[test]
fn all_roots_on_the_line_are_hit() {
    let roots = [-1.5, 0.0, 0.25];
    let cubic = field(1, move |p| {
        let [a, b, c] = roots.map(|root| p.x - root);
        (a * b * c, DVec3::X * (a * b + b * c + a * c))
    });
    for method in METHODS {
        for bounds in [None, Some(cube(1, 5.0))] {
            let wanted = Options {
                bounds,
                ..options(method)
            };
            let outcome = run(&cubic, &wanted);
            check(&outcome, &cubic, 1e-9);
            assert_eq!(outcome.statistics.started, 100);
            assert_eq!(outcome.statistics.points, 100);
            for root in roots {
                let hits = outcome
                    .samples
                    .positions
                    .iter()
                    .filter(|p| (p.x - root).abs() < 1e-7);
                assert!(hits.count() >= 5, "{root}");
            }
        }
    }
}

#[test]
fn a_single_root_settles_the_search() {
    let line = field(1, |p| (p.x, DVec3::X));
    let outcome = run(&line, &particles());
    assert_eq!(outcome.statistics.points, 100);
    assert!(outcome.statistics.settled, "{:?}", outcome.statistics);
}

#[test]
fn spurious_attractors_catch_particles_but_give_no_points() {
    let field = spurious_circle();
    let points = METHODS.map(|method| {
        let wanted = Options {
            bounds: Some(cube(2, 3.0)),
            ..options(method)
        };
        let outcome = run(&field, &wanted);
        check(&outcome, &field, 1e-9);
        for position in &outcome.samples.positions {
            assert!((position.length() - 1.0).abs() < 1e-8);
        }
        let dropped = outcome.statistics.dropped;
        assert_eq!(dropped.total(), dropped.spurious);
        outcome.statistics.points
    });
    let [kinematic, dynamic] = points;
    assert!(kinematic < 900, "some are caught: {kinematic}");
    assert!(dynamic > kinematic, "inertia helps: {dynamic}");
}

#[test]
fn a_field_without_a_zero_gives_an_empty_sample() {
    let bowl = field(2, |p| (1.0 + p.length_squared(), 2.0 * p));
    let plateau = field(3, |_| (1.0, DVec3::ZERO));
    for method in METHODS {
        let outcome = run(&bowl, &options(method));
        assert_eq!(outcome.statistics.points, 0);
        assert_eq!(outcome.statistics.dropped.spurious, 1_000);
        assert!(!outcome.statistics.settled && !outcome.statistics.converged);
        let outcome = run(&plateau, &options(method));
        assert_eq!(outcome.statistics.dropped.spurious, 5_000);
    }
}

#[test]
fn a_gradient_that_vanishes_on_the_surface_does_no_harm() {
    // The heart's ellipse and cusps; and the square of a sphere, whose gradient vanishes at
    // every point of the surface.
    let squared = field(3, |p| {
        let g = p.length_squared() - 1.0;
        (g * g, 4.0 * g * p)
    });
    for method in METHODS {
        let wanted = Options {
            bounds: Some(cube(3, 2.0)),
            ..options(method)
        };
        let heart = heart();
        let outcome = run(&heart, &wanted);
        check(&outcome, &heart, 1e-9);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );

        let outcome = run(&squared, &wanted);
        check(&outcome, &squared, 1e-9);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );
        for position in &outcome.samples.positions {
            // At a double zero the distance is twice |F| / |F_x|.
            assert!((position.length() - 1.0).abs() < 2.01e-9 * 4.0 * 3.0_f64.sqrt());
        }
    }
}

#[test]
fn where_value_and_gradient_underflow_together_the_residual_is_zero() {
    // x⁴⁰ is 0 for |x| < 1e-8 or so, and so is its derivative.
    let flat = field(1, |p| (p.x.powi(40), 40.0 * p.x.powi(39) * DVec3::X));
    let wanted = Options {
        bounds: Some(cube(1, 1e-9)),
        ..particles()
    };
    let outcome = run(&flat, &wanted);
    assert_eq!(outcome.statistics.points, 100);
    assert_eq!(outcome.statistics.singular, 100);
    assert_eq!(outcome.statistics.max_residual, 0.0);
    assert!(
        outcome
            .samples
            .normals
            .iter()
            .all(|&normal| normal == DVec3::ZERO)
    );
}

#[test]
fn a_surface_far_from_the_first_search_box_is_found_whole() {
    let centre = DVec3::new(1_000.0, -20.0, 3.0);
    let field = sphere(centre, 1.0);
    for method in METHODS {
        let outcome = run(&field, &options(method));
        check(&outcome, &field, 1e-9);
        let statistics = &outcome.statistics;
        assert!(
            statistics.settled && statistics.searches > 2,
            "{statistics:?}"
        );
        assert!(statistics.points >= 4_950, "{statistics:?}");
        // The final box is about twice the bounding box of the sphere.
        for (low, high) in statistics.bounds.sides() {
            assert!((high - low - 4.0).abs() < 0.3, "{statistics:?}");
        }
        let positions = &outcome.samples.positions;
        let mean = positions.iter().sum::<DVec3>() / positions.len() as f64;
        assert!(mean.distance(centre) < 0.1, "{mean}");
    }
}

#[test]
fn a_small_surface_in_large_bounds_is_found() {
    let field = sphere(DVec3::new(3.0, 2.0, 1.0), 1e-3);
    for method in METHODS {
        let wanted = Options {
            bounds: Some(cube(3, 10.0)),
            ..options(method)
        };
        let outcome = run(&field, &wanted);
        check(&outcome, &field, 1e-9);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );
        assert!(
            outcome.statistics.bounds.diagonal() < 0.1,
            "{:?}",
            outcome.statistics
        );
    }
}

#[test]
fn regions_without_a_value_count_as_outside() {
    // √x - y: undefined for half of the box.
    let half = field(2, |p| {
        let root = p.x.sqrt();
        (root - p.y, DVec3::new(0.5 / root, -1.0, 0.0))
    });
    for method in METHODS {
        let wanted = Options {
            bounds: Some(cube(2, 1.0)),
            ..options(method)
        };
        let outcome = run(&half, &wanted);
        check(&outcome, &half, 1e-9);
        let statistics = &outcome.statistics;
        assert!(statistics.nan_points > 100);
        assert_eq!(statistics.dropped.undefined, 0);
        // Those that start below the axis run into the border of the domain.
        assert!(statistics.points > 400, "{statistics:?}");
        for position in &outcome.samples.positions {
            // The parabola x = y². (F itself may be larger where F_x is infinite.)
            assert!(position.x >= 0.0 && position.y > -1e-8);
            assert!((position.x - position.y * position.y).abs() < 2e-8);
        }
    }
    let nowhere = field(3, |_| (f64::NAN, DVec3::NAN));
    let outcome = run(&nowhere, &particles());
    assert_eq!(outcome.statistics.dropped.undefined, 5_000);
}

#[test]
fn jumps_poles_and_borders_of_a_domain_are_no_zeros() {
    let jump = field(1, |p| (p.x + 5.0 * (p.x - 0.3).signum(), DVec3::X));
    let pole = field(1, |p| (1.0 / p.x, -DVec3::X / (p.x * p.x)));
    let border = field(1, |p| (1.0 + p.x.sqrt(), DVec3::X * (0.5 / p.x.sqrt())));
    for method in METHODS {
        for field in [&jump as &dyn Field, &pole, &border] {
            let wanted = Options {
                bounds: Some(cube(1, 2.0)),
                count: Some(1_000),
                ..options(method)
            };
            let outcome = run(field, &wanted);
            assert_eq!(outcome.statistics.points, 0, "{:?}", outcome.samples);
        }
    }
}

#[test]
fn creases_do_not_hold_particles() {
    // The cube |x|∞ = 0.7 as the maximum of six planes.
    let cube_field = field(3, |p| {
        let axis = (0..3)
            .max_by(|&a, &b| p[a].abs().total_cmp(&p[b].abs()))
            .unwrap();
        let mut gradient = DVec3::ZERO;
        gradient[axis] = p[axis].signum();
        (p[axis].abs() - 0.7, gradient)
    });
    // A wedge of 20 degrees between two planes.
    let wedge = field(2, |p| {
        let (sin, cos) = 10_f64.to_radians().sin_cos();
        let upper = DVec3::new(-sin, cos, 0.0);
        let lower = DVec3::new(-sin, -cos, 0.0);
        let normal = if upper.dot(p) >= lower.dot(p) {
            upper
        } else {
            lower
        };
        (normal.dot(p), normal)
    });
    for method in METHODS {
        let outcome = run(&cube_field, &options(method));
        check(&outcome, &cube_field, 1e-9);
        assert!(
            outcome.statistics.points >= 4_950,
            "{:?}",
            outcome.statistics
        );
        let wanted = Options {
            bounds: Some(cube(2, 1.0)),
            ..options(method)
        };
        let outcome = run(&wedge, &wanted);
        check(&outcome, &wedge, 1e-9);
        let dropped = outcome.statistics.dropped;
        assert!(dropped.unconverged + dropped.spurious <= 10, "{dropped:?}");
    }
}

#[test]
fn points_lie_in_the_bounds_and_the_rest_is_counted() {
    let bounds = cube(3, 0.8);
    for method in METHODS {
        let wanted = Options {
            bounds: Some(bounds),
            ..options(method)
        };
        let outcome = run(&sphere(DVec3::ZERO, 1.0), &wanted);
        let statistics = &outcome.statistics;
        assert!(statistics.points > 1_000 && statistics.dropped.left > 100);
        assert!(
            outcome
                .samples
                .positions
                .iter()
                .all(|&p| bounds.contains(p))
        );
    }
}

#[test]
fn an_unbounded_surface_leaves_the_search_unsettled() {
    let plane = field(3, |p| (p.z - 0.5, DVec3::Z));
    let outcome = run(&plane, &particles());
    let statistics = &outcome.statistics;
    assert_eq!(statistics.searches, particles().search_limit);
    assert!(!statistics.settled && !statistics.converged);
    assert_eq!(statistics.points, 5_000);
}

#[test]
fn points_are_as_exact_as_rounding_allows() {
    for text in [
        "field f(p in R3) = norm2(p) - 1",
        "field f(x, y, z) = (x^2 + y^2 + z^2 + 0.91)^2 - 4*(x^2 + y^2)",
        "field f(p in R3) = exp(-norm2(p)) + exp(-norm2(p - [1.2, 0, 0])) - 0.5",
    ] {
        let field = &crate::trace::compiled(text)[0];
        for method in METHODS {
            let options = Options {
                bounds: Some(cube(3, 2.5)),
                count: Some(500),
                ..options(method)
            };
            let statistics = sample(field, &options, &Silent).unwrap().statistics;
            let exact = 1e-14 * statistics.bounds.diagonal();
            assert!(statistics.max_residual <= exact, "{text}: {statistics:?}");
        }
    }
}
