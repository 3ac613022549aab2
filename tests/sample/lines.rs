//! All roots on lines, and nothing else: seen in R1, where the grid is one line, and on grids whose
//! lines have roots that are known.

use std::f64::consts::PI;

use glam::DVec3;
use imp::engine::CompiledField;
use imp::geometry::Bounds;
use imp::graph::Op;
use imp::sample::{Method, Options, Outcome};

use crate::fields::*;

/// The roots of a field in R1 on an interval, ascending.
fn roots(field: &CompiledField, low: f64, high: f64) -> (Vec<f64>, Outcome) {
    let options = Options {
        method: Method::Grid,
        bounds: Bounds::from_sides(&[(low, high)]),
        ..Options::default()
    };
    let outcome = run(field, &options);
    let roots = outcome.samples.positions.iter().map(|p| p.x).collect();
    (roots, outcome)
}

fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() <= tolerance, "{found} {expected}");
    }
}

/// F of one coordinate.
fn function(op: Op) -> CompiledField {
    compiled(1, |graph, [x, ..]| graph.apply(op, &[x]))
}

#[test]
fn roots_that_crowd_are_all_found() {
    // sin(1/x) = 0 at 1/(k π): from 1/(31 π) to 1/π between 0.01 and 1.
    let field = compiled(1, |graph, [x, ..]| {
        let one = graph.constant(1.0);
        let inverse = graph.apply(Op::Divide, &[one, x]);
        graph.apply(Op::Sin, &[inverse])
    });
    let (found, outcome) = roots(&field, 0.01, 1.0);
    let expected: Vec<f64> = (1..=31).rev().map(|k| 1.0 / (f64::from(k) * PI)).collect();
    assert_near(&found, &expected, 1e-14);
    let lines = outcome.statistics.lines.unwrap();
    assert!(lines.proven && lines.touching == 0 && lines.undecided == 0);
}

#[test]
fn a_root_at_the_end_and_at_the_middle_of_a_segment_counts_once() {
    // x (x² − 1) on −1..1; and halving falls on 0 exactly.
    let field = compiled(1, |graph, [x, ..]| {
        let one = graph.constant(1.0);
        let square = graph.apply(Op::Multiply, &[x, x]);
        let factor = graph.apply(Op::Subtract, &[square, one]);
        graph.apply(Op::Multiply, &[x, factor])
    });
    let (found, _) = roots(&field, -1.0, 1.0);
    assert_near(&found, &[-1.0, 0.0, 1.0], 1e-15);
}

#[test]
fn double_roots_are_kept_and_said_to_touch() {
    // (x − 1/3)², which has no change of sign.
    let field = compiled(1, |graph, [x, ..]| {
        let third = graph.constant(1.0 / 3.0);
        let off = graph.apply(Op::Subtract, &[x, third]);
        graph.apply(Op::Multiply, &[off, off])
    });
    let (found, outcome) = roots(&field, -1.0, 1.0);
    assert_near(&found, &[1.0 / 3.0], 1e-8);
    assert_eq!(outcome.statistics.lines.unwrap().touching, 1);
    // With 1e-9 added there is none, which is proven.
    let field = compiled(1, |graph, [x, ..]| {
        let square = graph.apply(Op::Multiply, &[x, x]);
        let little = graph.constant(1e-9);
        graph.apply(Op::Add, &[square, little])
    });
    let (found, outcome) = roots(&field, -1.0, 0.7);
    assert!(found.is_empty());
    assert_eq!(outcome.statistics.lines.unwrap().undecided, 0);
}

#[test]
fn poles_jumps_and_ends_of_the_domain_are_no_roots() {
    let (found, outcome) = roots(&function(Op::Tan), -5.0, 5.0);
    assert_near(&found, &[-PI, 0.0, PI], 1e-14);
    assert_eq!(
        outcome.statistics.lines.unwrap().undecided,
        4,
        "±π/2, ±3π/2"
    );
    // 1/x; the pole is where segments are halved.
    let field = compiled(1, |graph, [x, ..]| {
        let one = graph.constant(1.0);
        graph.apply(Op::Divide, &[one, x])
    });
    for (low, high) in [(-1.0, 1.0), (-1.0, 0.7), (-0.01, 3.0)] {
        let (found, outcome) = roots(&field, low, high);
        assert!(found.is_empty(), "{found:?}");
        assert_eq!(outcome.statistics.lines.unwrap().undecided, 1);
    }
    // ⌊x⌋ + 1/2 jumps over 0 at 0.
    let field = compiled(1, |graph, [x, ..]| {
        let half = graph.constant(0.5);
        let floor = graph.apply(Op::Floor, &[x]);
        graph.apply(Op::Add, &[floor, half])
    });
    let (found, _) = roots(&field, -0.9, 0.8);
    assert!(found.is_empty(), "{found:?}");
    // √x + 1 ends at 0, where |F| / |F_x| vanishes; √x − 1/2 has a root beyond its end.
    for (shift, expected) in [(1.0, &[][..]), (-0.5, &[0.25])] {
        let field = compiled(1, |graph, [x, ..]| {
            let shift = graph.constant(shift);
            let root = graph.apply(Op::SquareRoot, &[x]);
            graph.apply(Op::Add, &[root, shift])
        });
        for low in [-1.0, -0.3] {
            assert_near(&roots(&field, low, 1.0).0, expected, 1e-14);
        }
    }
}

#[test]
fn kinks_are_roots_like_others() {
    // |x| − x/2 − 1: −2/3 and 2; max(x, 3 x) = 0 at a kink.
    let field = compiled(1, |graph, [x, ..]| {
        let [half, one] = [0.5, 1.0].map(|number| graph.constant(number));
        let magnitude = graph.apply(Op::Abs, &[x]);
        let half = graph.apply(Op::Multiply, &[half, x]);
        let difference = graph.apply(Op::Subtract, &[magnitude, half]);
        graph.apply(Op::Subtract, &[difference, one])
    });
    assert_near(&roots(&field, -3.0, 4.0).0, &[-2.0 / 3.0, 2.0], 1e-14);
    let field = compiled(1, |graph, [x, ..]| {
        let three = graph.constant(3.0);
        let steep = graph.apply(Op::Multiply, &[three, x]);
        graph.apply(Op::Max, &[x, steep])
    });
    assert_near(&roots(&field, -1.0, 0.8).0, &[0.0], 1e-14);
}

#[test]
fn both_of_two_very_close_sheets_are_met() {
    // |z| = 1e-7 in a box of side 2: lines along z have two roots, 2e-7 apart.
    let field = compiled(3, |graph, [_, _, z]| {
        let magnitude = graph.apply(Op::Abs, &[z]);
        let half = graph.constant(1e-7);
        graph.apply(Op::Subtract, &[magnitude, half])
    });
    let options = Options {
        method: Method::Grid,
        bounds: Bounds::from_sides(&[(-1.0, 1.0), (-1.0, 1.0), (-1.1, 1.0)]),
        spacing: Some(0.5),
        ..Options::default()
    };
    let positions = run(&field, &options).samples.positions;
    let upper = positions
        .iter()
        .filter(|p| (p.z - 1e-7).abs() < 1e-15)
        .count();
    let lower = positions
        .iter()
        .filter(|p| (p.z + 1e-7).abs() < 1e-15)
        .count();
    assert_eq!((upper, lower, positions.len()), (25, 25, 50));
}

#[test]
fn fields_without_enclosures_are_said_not_to_be_proven() {
    let options = Options {
        method: Method::Grid,
        bounds: Some(cube(3, 1.3)),
        spacing: Some(0.2),
        ..Options::default()
    };
    let plain = run(&sphere(DVec3::ZERO, 1.0), &options);
    let proven = run(&ellipsoid(&[1.0; 3]), &options);
    assert!(!plain.statistics.lines.unwrap().proven);
    assert!(proven.statistics.lines.unwrap().proven);
    assert_eq!(
        plain.samples.positions.len(),
        proven.samples.positions.len()
    );
    for (one, other) in plain
        .samples
        .positions
        .iter()
        .zip(&proven.samples.positions)
    {
        assert!(one.distance(*other) < 1e-12);
    }
}
