//! Control points.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

use imp::engine::{CompiledField, Field};
use imp::graph::Op;
use imp::motion::{
    Advance, Control, Freedom, Metric, MotionError, Pin, PinState, Rows, Solver, advance, follow,
    sensitivity, toward_rest,
};

use crate::expressions::Random;
use crate::fields::{at, blobs, field, on_surface, sphere};

const DIRECTION: DVec3 = DVec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0);

/// A sphere with q = (1, 2, 3, 0.5), and the point of it in this direction.
fn ball() -> (CompiledField, DVec3) {
    let field = sphere(&[1.0, 2.0, 3.0, 0.5]);
    (field, DVec3::new(1.0, 2.0, 3.0) + 0.5 * DIRECTION)
}

fn pin(position: DVec3, velocity: DVec3) -> Pin {
    Pin { position, velocity }
}

fn assert_near(found: &[f64], truth: &[f64], tolerance: f64) {
    assert_eq!(found.len(), truth.len());
    for (found, truth) in found.iter().zip(truth) {
        assert!((found - truth).abs() <= tolerance, "{found} {truth}");
    }
}

#[test]
fn a_pulled_sphere_does_what_equation_8_says() {
    // F_x = 2r n and F_q = −2r (n, 1), so that λ = 2r v / 8r² and q̇ = (v n / 2, v / 2).
    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    let pins = [pin(point, 3.0 * DIRECTION)];
    let found = follow(&field, &pins, &[0.0; 4], &control).unwrap();
    let truth = [1.5 * DIRECTION.x, 1.5 * DIRECTION.y, 1.5 * DIRECTION.z, 1.5];
    assert_near(&found.velocity, &truth, 1e-13);
    assert_eq!((found.solver, found.rank), (Solver::Cholesky, 1));
    assert_eq!(found.pins[0].state, PinState::Followed);

    // A point that is off the surface by h along the normal comes back at φ F/|F_x| = φ h to the first
    // order: by equation 7 the velocity is that of a pull by −φF/|F_x|, here F = (r + h)² − r², |F_x| =
    // 2(r + h).
    let pins = [pin(point + 0.1 * DIRECTION, DVec3::ZERO)];
    let found = follow(&field, &pins, &[0.0; 4], &control).unwrap();
    // F_q = −2((r + h) n, r)
    let value = 0.6 * 0.6 - 0.5 * 0.5;
    let factor = 15.0 * value / (4.0 * (0.6 * 0.6 + 0.5 * 0.5));
    let along = 2.0 * 0.6 * factor;
    let truth = [
        along * DIRECTION.x,
        along * DIRECTION.y,
        along * DIRECTION.z,
        factor,
    ];
    assert_near(&found.velocity, &truth, 1e-12);
}

/// M^-1/2 (A M^-1/2)⁺ (c − A Q) + Q, by singular values.
fn by_pseudo_inverse(
    field: &CompiledField,
    pins: &[Pin],
    desired: &[f64],
    feedback: f64,
    metric: &DMatrix<f64>,
) -> Vec<f64> {
    let points: Vec<DVec3> = pins.iter().map(|pin| pin.position).collect();
    let rows = Rows::evaluate(field, &points);
    let mut matrix = DMatrix::zeros(pins.len(), desired.len());
    let mut side = DVector::zeros(pins.len());
    for (index, pin) in pins.iter().enumerate() {
        let (places, entries) = rows.row(index);
        for (&place, &entry) in places.iter().zip(entries) {
            matrix[(index, place as usize)] = entry;
        }
        side[index] = -(rows.gradients[index].dot(pin.velocity) + feedback * rows.values[index]);
    }
    let desired = DVector::from_row_slice(desired);
    let lower = metric.clone().cholesky().unwrap().l();
    let inverse = lower.transpose().try_inverse().unwrap();
    let left = &side - &matrix * &desired;
    let pseudo = (matrix * &inverse).pseudo_inverse(1e-9).unwrap();
    let found = &inverse * (pseudo * left) + desired;
    found.iter().copied().collect()
}

#[test]
fn the_change_is_the_least_one_in_every_metric() {
    let field = blobs();
    let random = &mut Random(5);
    let mut place = || DVec3::from_array(std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
    let pins: Vec<Pin> = (0..9).map(|_| pin(place(), place())).collect();
    let count = field.parameters().len();
    let desired: Vec<f64> = (0..count).map(|_| random.uniform(-1.0, 1.0)).collect();
    let weights: Vec<f64> = (0..count).map(|_| random.uniform(0.1, 10.0)).collect();
    let mut factor = DMatrix::from_fn(count, count, |_, _| random.uniform(-0.1, 0.1));
    factor.fill_diagonal(1.0);
    let full = &factor * factor.transpose();
    let full = 0.5 * (&full + full.transpose());
    let rows: Vec<Vec<f64>> = full
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect();
    let diagonal = DMatrix::from_diagonal(&DVector::from_row_slice(&weights));
    for (metric, matrix) in [
        (Metric::identity(), DMatrix::identity(count, count)),
        (Metric::diagonal(weights).unwrap(), diagonal),
        (Metric::full(&rows).unwrap(), full),
    ] {
        let control = Control {
            metric,
            ..Control::new(count, 1e-12)
        };
        let found = follow(&field, &pins, &desired, &control).unwrap();
        assert_eq!((found.solver, found.rank), (Solver::Cholesky, 9));
        let truth = by_pseudo_inverse(&field, &pins, &desired, control.feedback, &matrix);
        let largest = truth
            .iter()
            .fold(0.0_f64, |sum, speed| sum.max(speed.abs()));
        assert_near(&found.velocity, &truth, 1e-9 * largest);
        assert!(found.pins.iter().all(|pin| pin.state == PinState::Followed));
    }
}

#[test]
fn a_repeated_pin_changes_nothing() {
    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    let one = pin(point, DVec3::new(0.3, 0.4, -0.2));
    let single = follow(&field, &[one], &[0.0; 4], &control).unwrap();
    let double = follow(&field, &[one, one], &[0.0; 4], &control).unwrap();
    assert_eq!((double.solver, double.rank), (Solver::LeastSquares, 1));
    assert_near(&double.velocity, &single.velocity, 1e-14);
    assert!(
        double
            .pins
            .iter()
            .all(|pin| pin.state == PinState::Followed)
    );
    // All but repeated, with a condition of about 1e16: nothing becomes huge.
    let other = pin(point + 1e-8 * DVec3::X, one.velocity);
    let near = follow(&field, &[one, other], &[0.0; 4], &control).unwrap();
    assert_eq!(near.solver, Solver::LeastSquares);
    assert_near(&near.velocity, &single.velocity, 1e-6);
}

#[test]
fn contradictory_pins_are_missed_by_as_little_as_possible() {
    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    let pins = [pin(point, 3.0 * DIRECTION), pin(point, DIRECTION)];
    let found = follow(&field, &pins, &[0.0; 4], &control).unwrap();
    // The mean of both, 2, is missed by 1 at each.
    let truth = [DIRECTION.x, DIRECTION.y, DIRECTION.z, 1.0];
    assert_near(&found.velocity, &truth, 1e-12);
    assert_eq!((found.solver, found.rank), (Solver::LeastSquares, 1));
    for pin in found.pins {
        assert_eq!(pin.state, PinState::Missed);
        assert!((pin.residual - 1.0).abs() < 1e-12);
    }
    // With the radius alone, for the whole sphere could pass through where they arrive: a step can be
    // made and gone on from.
    let freedom = (0..3).fold(Freedom::all(4), Freedom::with_frozen);
    let control = Control { freedom, ..control };
    let step = advance(&field, &pins, &[0.0; 4], &control, 0.1).unwrap();
    assert!(step.pins.iter().all(|pin| pin.state == PinState::Missed));
    let apart: f64 = step.pins.iter().map(|pin| pin.residual).sum();
    assert!((apart - 0.2).abs() < 0.01, "{apart}");
    let still = step.positions.map_velocities(DVec3::ZERO);
    let next = advance(&at(&field, &step.q), &still[..1], &[0.0; 4], &control, 0.1).unwrap();
    assert_eq!(next.pins[0].state, PinState::Followed);
}

/// Pins at positions, all with the same velocity.
trait Pins {
    fn map_velocities(&self, velocity: DVec3) -> Vec<Pin>;
}

impl Pins for Vec<DVec3> {
    fn map_velocities(&self, velocity: DVec3) -> Vec<Pin> {
        self.iter()
            .map(|&position| pin(position, velocity))
            .collect()
    }
}

#[test]
fn more_pins_than_parameters_are_met_in_the_mean() {
    let (field, _) = ball();
    let random = &mut Random(3);
    let mut direction = || DVec3::from_array(std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
    let pins: Vec<Pin> = (0..20)
        .map(|_| {
            let place = DVec3::new(1.0, 2.0, 3.0) + 0.5 * direction().normalize();
            pin(place, direction())
        })
        .collect();
    let control = Control {
        feedback: 0.0,
        ..Control::new(4, 1e-12)
    };
    // |F_x| is the same at all of them, so that plain least squares have the right weights.
    let truth = by_pseudo_inverse(&field, &pins, &[0.0; 4], 0.0, &DMatrix::identity(4, 4));
    let found = follow(&field, &pins, &[0.0; 4], &control).unwrap();
    assert_near(&found.velocity, &truth, 1e-12);
    assert_eq!((found.solver, found.rank), (Solver::LeastSquares, 4));
    assert!(found.pins.iter().all(|pin| pin.state == PinState::Missed));
}

#[test]
fn frozen_parameters_keep_every_bit() {
    let field = blobs();
    let count = field.parameters().len();
    let points = on_surface(&field, 6, 1.2, &mut Random(9));
    let pins = points.map_velocities(DVec3::new(0.4, -0.3, 0.2));
    let mut freedom = Freedom::all(count);
    for place in (0..count).filter(|place| place % 4 != 1) {
        freedom = freedom.with_frozen(place);
    }
    let control = Control {
        freedom,
        ..Control::new(count, 1e-10)
    };
    let desired = vec![1.0; count];
    let velocity = follow(&field, &pins, &desired, &control).unwrap().velocity;
    let step = advance(&field, &pins, &desired, &control, 0.05).unwrap();
    let moved = step.q.iter().zip(field.parameters()).zip(velocity);
    for (place, ((after, before), speed)) in moved.enumerate() {
        let same = after.to_bits() == before.to_bits();
        assert_eq!(same, place % 4 != 1, "{place}");
        assert_eq!(speed == 0.0, place % 4 != 1);
    }
    assert!(step.pins.iter().all(|pin| pin.state == PinState::Followed));
}

#[test]
fn without_a_free_parameter_nothing_moves_and_that_is_said() {
    let (field, point) = ball();
    let freedom = (0..4).fold(Freedom::all(4), Freedom::with_frozen);
    let control = Control {
        freedom,
        ..Control::new(4, 1e-12)
    };
    let pins = [pin(point, DIRECTION)];
    let found = follow(&field, &pins, &[1.0; 4], &control).unwrap();
    assert_eq!(found.velocity, [0.0; 4]);
    assert_eq!(found.pins[0].state, PinState::Unreachable);
    assert!((found.pins[0].residual - 1.0).abs() < 1e-12);
    let step = advance(&field, &pins, &[1.0; 4], &control, 0.25).unwrap();
    assert_eq!(step.q, field.parameters());
    // (0.75² − 0.5²)/(2·0.75)
    assert_eq!(step.pins[0].state, PinState::Unreachable);
    assert!((step.pins[0].residual - 0.3125 / 1.5).abs() < 1e-12);
}

#[test]
fn a_parameter_stops_at_its_bound_and_comes_back() {
    let (field, point) = ball();
    let control = Control {
        freedom: Freedom::all(4).with_range(3, 0.3, 0.6),
        ..Control::new(4, 1e-13)
    };
    // Both the centre and the radius would move by 0.2: the radius by 0.1, the centre the rest.
    let pins = [pin(point, 0.4 * DIRECTION)];
    let step = advance(&field, &pins, &[0.0; 4], &control, 1.0).unwrap();
    assert_eq!(step.q[3], 0.6);
    assert_eq!(step.at_bounds, [3]);
    let centre = DVec3::new(1.0, 2.0, 3.0) + 0.3 * DIRECTION;
    assert_near(&step.q[..3], &centre.to_array(), 1e-12);
    assert_eq!(step.pins[0].state, PinState::Followed);

    // There it does not go on, and comes back when it is pushed.
    let there = at(&field, &step.q);
    let pins = step.positions.map_velocities(DIRECTION);
    let found = follow(&there, &pins, &[0.0; 4], &control).unwrap();
    assert_eq!((found.velocity[3], &found.at_bounds[..]), (0.0, &[3][..]));
    assert_near(&found.velocity[..3], &DIRECTION.to_array(), 1e-11);
    let pins = step.positions.map_velocities(-0.2 * DIRECTION);
    let back = advance(&there, &pins, &[0.0; 4], &control, 1.0).unwrap();
    assert!((back.q[3] - 0.5).abs() < 1e-12);
    assert!(back.at_bounds.is_empty());
}

#[test]
fn steps_that_are_far_too_large_are_cut() {
    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    for (velocity, time) in [
        (200.0 * DIRECTION, 1.0),
        (1e3 * DIRECTION.any_orthogonal_vector(), 1.0),
        (-4.0 * DIRECTION, 30.0),
    ] {
        let step = advance(&field, &[pin(point, velocity)], &[0.0; 4], &control, time).unwrap();
        // Along the normal the linear equations are those of this field: centre and radius share the
        // way.
        assert_eq!(step.cuts > 0, velocity.dot(DIRECTION).abs() < 1.0);
        assert!(step.q.iter().all(|q| q.is_finite()));
        assert_eq!(step.pins[0].state, PinState::Followed, "{step:?}");
        assert!(step.pins[0].residual <= 1e-12);
    }
    // A huge desired velocity where no pin is: no infinity.
    let none = advance(&field, &[], &[1e308; 4], &control, 1e10).unwrap();
    assert!(none.q.iter().all(|q| q.is_finite()));
}

#[test]
fn a_drag_that_no_parameter_can_follow_leaves_a_state_that_goes_on() {
    // A sphere that may only grow a little and move in x, pulled in z.
    let (field, _) = ball();
    let freedom = Freedom::all(4).with_frozen(1).with_frozen(2);
    let control = Control {
        freedom: freedom.with_range(3, 0.4, 0.6),
        ..Control::new(4, 1e-12)
    };
    let top = DVec3::new(1.0, 2.0, 3.5);
    let step = advance(&field, &[pin(top, DVec3::Z)], &[0.0; 4], &control, 1.0).unwrap();
    assert_eq!(step.pins[0].state, PinState::Missed);
    assert_eq!(step.positions, [top + DVec3::Z]);
    assert_eq!(step.q[1..3], [2.0, 3.0]);
    assert_eq!(step.q[3], 0.6);
    // At 1.5 above the centre, (1.5² − 0.6²)/3 from the sphere in the first order.
    assert!((step.pins[0].residual - (2.25 - 0.36) / 3.0).abs() < 1e-6);
    let back = [pin(step.positions[0], -1.0 * DVec3::Z)];
    let step = advance(&at(&field, &step.q), &back, &[0.0; 4], &control, 1.0).unwrap();
    assert_eq!(step.pins[0].state, PinState::Followed, "{step:?}");
}

#[test]
fn where_f_is_undefined_the_others_are_served() {
    // √x − q: a pin that goes to negative x leaves the domain.
    let field = field(1, &[1.0], |graph| {
        let x = graph.coordinate(0);
        let root = graph.apply(Op::SquareRoot, &[x]);
        let level = graph.parameter(0);
        graph.apply(Op::Subtract, &[root, level])
    });
    let control = Control::new(1, 1e-12);
    let one = [pin(DVec3::X, -2.0 * DVec3::X)];
    let step = advance(&field, &one, &[0.0], &control, 1.0).unwrap();
    assert_eq!(step.pins[0].state, PinState::Undefined);
    assert_eq!(step.pins[0].residual, f64::INFINITY);
    assert!(step.q[0].is_finite());
    let step = advance(
        &at(&field, &step.q),
        &[pin(-DVec3::X, 5.0 * DVec3::X)],
        &[0.0],
        &control,
        1.0,
    );
    let step = step.unwrap();
    assert_eq!(step.pins[0].state, PinState::Followed, "{step:?}");
    assert!((step.q[0] - 2.0).abs() < 1e-12);

    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    let bad = [
        pin(point, 3.0 * DIRECTION),
        pin(DVec3::NAN, DVec3::ZERO),
        pin(point, DVec3::INFINITY),
    ];
    let found = follow(&field, &bad, &[0.0; 4], &control).unwrap();
    let alone = follow(&field, &bad[..1], &[0.0; 4], &control).unwrap();
    assert_eq!(found.velocity, alone.velocity);
    let states: Vec<PinState> = found.pins.iter().map(|pin| pin.state).collect();
    assert_eq!(
        states,
        [PinState::Followed, PinState::Undefined, PinState::Undefined]
    );
    let step = advance(&field, &bad, &[0.0; 4], &control, 0.1).unwrap();
    assert_eq!(step.pins[0].state, PinState::Followed);
}

#[test]
fn a_pin_where_all_derivatives_vanish_does_no_harm() {
    // q x² at x = 0, where F, F_x and F_q are 0, and at its other zero set there is none.
    let field = field(1, &[2.0], |graph| {
        let x = graph.coordinate(0);
        let square = graph.apply(Op::Square, &[x]);
        let factor = graph.parameter(0);
        graph.apply(Op::Multiply, &[factor, square])
    });
    let control = Control::new(1, 1e-12);
    let still = [pin(DVec3::ZERO, DVec3::ZERO), pin(DVec3::X, DVec3::ZERO)];
    let found = follow(&field, &still, &[0.0], &control).unwrap();
    assert_eq!(found.pins[0].state, PinState::Followed);
    // φF + F_q q̇ = 0
    assert_near(&found.velocity, &[-30.0], 1e-12);
    let step = advance(&field, &still[..1], &[0.0], &control, 1.0).unwrap();
    assert_eq!((step.q[0], step.pins[0].residual), (2.0, 0.0));
}

#[test]
fn sensitivity_is_the_mean_square_speed_of_the_surface() {
    // At an octahedron's corners |F_c|/|F_x| is 1 at two of six for each axis, and |F_r|/|F_x| = 1: 1/3
    // and 1. With M = diag(1/3, 1/3, 1/3, 1), M⁻¹ F_q is along (3n, 1), so a pull by v moves the centre
    // by 3/4 of it.
    let (field, point) = ball();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let corners = axes.into_iter().flat_map(|axis| [axis, -axis]);
    let points: Vec<DVec3> = corners
        .map(|corner| DVec3::new(1.0, 2.0, 3.0) + 0.5 * corner)
        .collect();
    let control = Control {
        metric: sensitivity(&field, &points),
        ..Control::new(4, 1e-12)
    };
    let found = follow(&field, &[pin(point, 4.0 * DIRECTION)], &[0.0; 4], &control).unwrap();
    let truth = [3.0 * DIRECTION.x, 3.0 * DIRECTION.y, 3.0 * DIRECTION.z, 1.0];
    assert_near(&found.velocity, &truth, 1e-12);
}

#[test]
fn a_surface_comes_to_rest_at_its_rest_shape() {
    let rest = [1.0, 2.0, 3.0, 0.5];
    let control = Control::new(4, 1e-12);
    let mut q = vec![1.2, 2.0, 2.9, 0.8];
    for _ in 0..60 {
        let desired = toward_rest(&q, &rest, 5.0);
        q = advance(&sphere(&q), &[], &desired, &control, 0.1)
            .unwrap()
            .q;
    }
    // Half of the way each time.
    assert_near(&q, &rest, 1e-12);
}

/// A drag of a number of steps around and about; the largest residual, the least squares that were
/// needed, and the end.
fn drag(count: usize, steps: usize) -> (f64, usize, Advance) {
    let points = on_surface(&blobs(), count, 1.2, &mut Random(31));
    let phases: Vec<usize> = (0..count).collect();
    drag_points(points, &phases, steps)
}

/// The same for these points, of which those with the same phase move alike.
fn drag_points(mut points: Vec<DVec3>, phases: &[usize], steps: usize) -> (f64, usize, Advance) {
    let mut field = blobs();
    let parameters = field.parameters().len();
    let control = Control::new(parameters, 1e-10);
    let (mut largest, mut singular) = (0.0_f64, 0);
    let mut last = None;
    for step in 0..steps {
        let phase = 0.02 * step as f64;
        let pins: Vec<Pin> = points
            .iter()
            .zip(phases)
            .map(|(&point, &index)| {
                let angle = phase + 2.0 * index as f64;
                let velocity = DVec3::new(angle.cos(), (1.3 * angle).sin(), (0.7 * angle).cos());
                pin(point, 0.25 * velocity)
            })
            .collect();
        let made = advance(&field, &pins, &vec![0.0; parameters], &control, 0.03).unwrap();
        for pin in &made.pins {
            largest = largest.max(pin.residual);
        }
        singular += usize::from(made.solver == Solver::LeastSquares);
        points.clone_from(&made.positions);
        field = at(&field, &made.q);
        last = Some(made);
    }
    (largest, singular, last.unwrap())
}

#[test]
fn a_drag_of_a_thousand_steps_stays_on_its_pins() {
    for count in [1, 5] {
        let (largest, singular, end) = drag(count, 1000);
        assert!(largest <= 1e-10, "{count}: {largest:e}");
        assert_eq!(singular, 0, "{count}");
        assert!(end.q.iter().all(|q| q.abs() < 100.0), "{:?}", end.q);
    }
}

#[test]
fn a_repeated_pin_can_be_dragged() {
    let points = on_surface(&blobs(), 2, 1.2, &mut Random(31));
    let twice = vec![points[0], points[0], points[1]];
    let (largest, singular, end) = drag_points(twice, &[0, 0, 1], 300);
    assert!(largest <= 1e-10, "{largest:e}");
    // All of them, and two constraints are independent.
    assert_eq!((singular, end.rank), (300, 2));
}

#[test]
fn a_sphere_that_twenty_pins_drag_moves_with_them() {
    // Over-determined and consistent: a translation, and twice the size by the end.
    let (mut field, _) = ball();
    let centre = DVec3::new(1.0, 2.0, 3.0);
    let control = Control::new(4, 1e-12);
    let random = &mut Random(41);
    let mut number = || random.uniform(-1.0, 1.0);
    let directions: Vec<DVec3> = (0..20)
        .map(|_| DVec3::new(number(), number(), number()).normalize())
        .collect();
    for step in 0..100 {
        let [here, there] = [step, step + 1].map(|step| 0.01 * f64::from(step));
        let place = |time: f64, direction: DVec3| {
            centre + time * DVec3::new(2.0, -1.0, 0.5) + 0.5 * (1.0 + time) * direction
        };
        let pins: Vec<Pin> = directions
            .iter()
            .map(|&direction| {
                let from = place(here, direction);
                pin(from, (place(there, direction) - from) / 0.1)
            })
            .collect();
        let made = advance(&field, &pins, &[0.0; 4], &control, 0.1).unwrap();
        assert!(made.pins.iter().all(|pin| pin.state == PinState::Followed));
        assert_eq!((made.solver, made.rank), (Solver::LeastSquares, 4));
        field = at(&field, &made.q);
    }
    assert_near(field.parameters(), &[3.0, 1.0, 3.5, 1.0], 1e-10);
}

#[test]
fn a_drag_has_the_same_bits_on_any_number_of_threads() {
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let (_, _, end) = pool.unwrap().install(|| drag(40, 3));
        end.q.iter().map(|q| q.to_bits()).collect::<Vec<u64>>()
    };
    let one = bits(1);
    assert_eq!(bits(2), one);
    assert_eq!(bits(4), one);
}

#[test]
fn wrong_input_is_refused() {
    let (field, point) = ball();
    let control = Control::new(4, 1e-12);
    let pins = [pin(point, DVec3::ZERO)];
    let short = follow(&field, &pins, &[0.0; 3], &control);
    assert!(matches!(
        short,
        Err(MotionError::Length {
            found: 3,
            expected: 4,
            ..
        })
    ));
    let other = follow(&field, &pins, &[0.0; 4], &Control::new(5, 1e-12));
    assert!(matches!(other, Err(MotionError::Length { found: 5, .. })));
    let bad = follow(&field, &pins, &[f64::NAN; 4], &control);
    assert!(matches!(bad, Err(MotionError::Number { .. })));
    for time in [-1.0, f64::NAN, f64::INFINITY] {
        let bad = advance(&field, &pins, &[0.0; 4], &control, time);
        assert!(matches!(bad, Err(MotionError::Number { .. })));
    }
    assert!(Metric::diagonal(vec![1.0, 0.0]).is_err());
    assert!(Metric::full(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_err());
    assert!(Metric::full(&[vec![1.0, 0.5], vec![0.25, 1.0]]).is_err());
    assert!(Metric::full(&[vec![1.0, 0.5]]).is_err());
}
