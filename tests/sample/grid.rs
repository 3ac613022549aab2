//! Grids: every crossing of every line, none twice.

use glam::DVec3;
use imp::engine::{Field, Silent};
use imp::geometry::Bounds;
use imp::graph::Op;
use imp::sample::{Method, Options, SampleError, sample};

use crate::fields::*;

fn options(bounds: Option<Bounds>, spacing: f64) -> Options {
    Options {
        method: Method::Grid,
        bounds,
        spacing: Some(spacing),
        ..Options::default()
    }
}

/// The coordinates of grid lines: `cells` + 1 of them from −half to half.
fn coordinates(half: f64, cells: usize) -> Vec<f64> {
    let place = |index: usize| -half + 2.0 * half * index as f64 / cells as f64;
    (0..=cells).map(place).collect()
}

#[test]
fn every_line_has_the_roots_of_the_torus() {
    // Of (ρ − 1)² + z² = 0.09: along z where |ρ − 1| < 0.3, along x where x² = (1 ± w)² − y².
    let half = 1.37;
    let cells = 23;
    let places = coordinates(half, cells);
    let mut expected = 0;
    for &first in &places {
        for &second in &places {
            let ring = first.hypot(second);
            expected += if (ring - 1.0).abs() < 0.3 { 2 } else { 0 };
            // Here `first` is z, and `second` x or y.
            let inside = 0.09 - first * first;
            if inside > 0.0 {
                for ring in [1.0 - inside.sqrt(), 1.0 + inside.sqrt()] {
                    expected += if ring > second.abs() { 2 * 2 } else { 0 };
                }
            }
        }
    }
    let outcome = run(
        &compiled_torus(),
        &options(Some(cube(3, half)), 2.0 * half / cells as f64),
    );
    assert_eq!(outcome.samples.positions.len(), expected);
    assert_eq!(outcome.statistics.lines.unwrap().drawn, 3 * 24 * 24);
    for p in &outcome.samples.positions {
        let on_lines =
            (0..3).filter(|&axis| places.iter().any(|place| (place - p[axis]).abs() < 1e-12));
        assert_eq!(on_lines.count(), 2);
        let off = p.x.hypot(p.y) - 1.0;
        assert!((off * off + p.z * p.z - 0.09).abs() < 1e-13);
    }
}

#[test]
fn lines_through_a_gyroid_have_the_roots_that_a_dense_scan_sees() {
    let field = compiled(3, |graph, axes| {
        let mut sum = graph.constant(0.0);
        for (one, other) in [(0, 1), (1, 2), (2, 0)] {
            let sine = graph.apply(Op::Sin, &[axes[one]]);
            let cosine = graph.apply(Op::Cos, &[axes[other]]);
            let product = graph.apply(Op::Multiply, &[sine, cosine]);
            sum = graph.apply(Op::Add, &[sum, product]);
        }
        sum
    });
    let gyroid = |p: DVec3| p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos();
    let half = 7.3;
    let cells = 11;
    let places = coordinates(half, cells);
    let mut expected = 0;
    for axis in 0..3 {
        for &first in &places {
            for &second in &places {
                let value = |step: i32| {
                    let mut point = DVec3::ZERO;
                    point[axis] = -half + 2.0 * half * f64::from(step) / 4000.0;
                    point[(axis + 1) % 3] = first;
                    point[(axis + 2) % 3] = second;
                    gyroid(point)
                };
                let signs: Vec<bool> = (0..=4000).map(|step| value(step) < 0.0).collect();
                expected += signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
            }
        }
    }
    let outcome = run(
        &field,
        &options(Some(cube(3, half)), 2.0 * half / cells as f64),
    );
    assert_eq!(outcome.samples.positions.len(), expected);
    assert!(expected > 1000);
}

#[test]
fn grid_points_on_the_surface_and_tangents_give_one_point_each() {
    // The unit sphere meets the lines with whole coordinates in the six points on the axes only,
    // each a grid point on one line through it and two tangents.
    let outcome = run(&ellipsoid(&[1.0; 3]), &options(Some(cube(3, 2.0)), 1.0));
    let mut found = outcome.samples.positions;
    found.sort_by(|one, other| one.to_array().partial_cmp(&other.to_array()).unwrap());
    let expected = [
        -DVec3::X,
        -DVec3::Y,
        -DVec3::Z,
        DVec3::Z,
        DVec3::Y,
        DVec3::X,
    ];
    assert_eq!(found.len(), 6, "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.distance(expected) < 1e-8, "{found} {expected}");
    }
}

#[test]
fn cassini_ovals_have_the_roots_of_their_quartic() {
    // (x² + y²)² − 2 (x² − y²) = 0.2: the roots of quadratics in x² or y².
    let field = compiled(2, |graph, [x, y, _]| {
        let [x, y] = [x, y].map(|axis| graph.apply(Op::Multiply, &[axis, axis]));
        let sum = graph.apply(Op::Add, &[x, y]);
        let square = graph.apply(Op::Multiply, &[sum, sum]);
        let difference = graph.apply(Op::Subtract, &[x, y]);
        let two = graph.constant(2.0);
        let double = graph.apply(Op::Multiply, &[two, difference]);
        let value = graph.apply(Op::Subtract, &[square, double]);
        let level = graph.constant(-0.2);
        graph.apply(Op::Subtract, &[value, level])
    });
    let level = -0.2;
    // t² + 2 b t + c = 0 has so many roots for x with x² = t, if none is 0.
    let roots = |b: f64, c: f64| {
        let under = b * b - c;
        let two = |t: f64| if t > 0.0 { 2 } else { 0 };
        if under > 0.0 {
            two(-b - under.sqrt()) + two(-b + under.sqrt())
        } else {
            0
        }
    };
    let half = 1.63;
    let cells = 97;
    let mut expected = 0;
    for place in coordinates(half, cells) {
        let s = place * place;
        // Along x with y² = s, and along y with x² = s.
        expected += roots(s - 1.0, s * s + 2.0 * s - level);
        expected += roots(s + 1.0, s * s - 2.0 * s - level);
    }
    let outcome = run(
        &field,
        &options(Some(cube(2, half)), 2.0 * half / cells as f64),
    );
    assert_eq!(outcome.samples.positions.len(), expected);
}

#[test]
fn a_count_is_met_closely() {
    // Moving a grid by a fraction of its cells changes the number by some square roots of it.
    for count in [300_u64, 5000] {
        let options = Options {
            spacing: None,
            count: Some(count),
            ..options(Some(cube(3, 1.5)), 1.0)
        };
        let number = run(&compiled_torus(), &options).samples.positions.len();
        assert!(
            number.abs_diff(count as usize).pow(2) <= 4 * count as usize,
            "{number}"
        );
    }
}

#[test]
fn spacings_that_make_too_many_points_are_refused_with_the_estimate() {
    let options = Options {
        count_limit: 1000,
        ..options(Some(cube(3, 1.5)), 0.01)
    };
    let refused = sample(&ellipsoid(&[1.0; 3]), &options, &Silent).unwrap_err();
    let SampleError::Option { option, found, .. } = refused else {
        panic!("{refused:?}");
    };
    // 1.5 · 4 π / 0.01² is 188,496; the area is estimated.
    assert_eq!(option, "spacing");
    assert!(found.contains("points on"), "{found}");
    let number: f64 = (found.split("about ").nth(1).unwrap().split(' ').next())
        .unwrap()
        .parse()
        .unwrap();
    assert!((number / 188_496.0 - 1.0).abs() < 0.2, "{found}");
}

#[test]
fn a_field_that_is_nowhere_zero_gives_nothing() {
    let field = ellipsoid(&[1.0; 3]);
    let away = Bounds::from_sides(&[(2.0, 3.0); 3]);
    let outcome = run(&field, &options(away, 0.1));
    assert!(outcome.samples.positions.is_empty());
    assert_eq!(field.dimension(), 3);
}
