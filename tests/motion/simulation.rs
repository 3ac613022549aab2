//! Surfaces that move, with floaters and control points.

use std::sync::Arc;

use glam::DVec3;

use imp::engine::{CompiledField, Field, Program, Silent};
use imp::geometry::Bounds;
use imp::graph::{Graph, Op};
use imp::motion::{Freedom, Measure, Setting, Simulation, SimulationError};
use imp::sample::Options;

use crate::fields::sphere_distance;

fn setting(parameters: usize, half: f64, count: u64) -> Setting {
    Setting {
        options: Options {
            count: Some(count),
            bounds: Bounds::from_sides(&[(-half, half); 3]),
            ..Options::default()
        },
        walls: false,
        freedom: Freedom::all(parameters),
        measure: Measure::Sensitivity,
        rest: None,
    }
}

fn simulation(field: &CompiledField, setting: Setting) -> Simulation {
    let q = field.parameters().to_vec();
    let program = Arc::clone(field.program());
    Simulation::new(program, q, setting, &Silent).unwrap().0
}

#[test]
fn a_drag_takes_its_time_and_steps_without_time_change_nothing() {
    let field = sphere_distance(&[0.0, 0.0, 0.0, 1.0]);
    let mut simulation = simulation(&field, setting(4, 1.5, 100));
    let [left, right] = [DVec3::NEG_X, DVec3::X].map(|place| simulation.pin(place));
    let goal = DVec3::new(1.5, 0.5, 0.0);
    simulation.drag(right, goal, 0.2).unwrap();
    simulation.step(0.0, None, &Silent).unwrap();
    assert_eq!(simulation.pins()[right].1, DVec3::X);
    for step in 1..=5 {
        simulation.step(0.05, None, &Silent).unwrap();
        let part = (0.25 * f64::from(step)).min(1.0);
        let expected = DVec3::X + part * (goal - DVec3::X);
        assert!(simulation.pins()[right].1.distance(expected) < 1e-12);
        assert_eq!(simulation.pins()[left].1, DVec3::NEG_X);
        // To the tolerance of the floaters, 1e-9 of the box.
        assert!(simulation.pins().iter().all(|pin| pin.2 < 1e-8));
    }
    simulation.release(left).unwrap();
    let gone = simulation.drag(left, goal, 0.0);
    assert_eq!(
        gone,
        Err(SimulationError::NoPin {
            index: left,
            count: 2
        })
    );
    assert_eq!(simulation.pins().len(), 1);
}

/// A rest shape is approached exponentially, however large the step is.
#[test]
fn a_rest_shape_is_approached_and_not_passed() {
    let field = sphere_distance(&[0.0, 0.0, 0.0, 1.0]);
    for rate in [1.0, 40.0, 1e9] {
        let setting = Setting {
            rest: Some((vec![0.0, 0.0, 0.0, 2.0], rate)),
            ..setting(4, 1.5, 50)
        };
        let mut simulation = simulation(&field, setting);
        for step in 1..=3 {
            simulation.step(0.1, None, &Silent).unwrap();
            let expected = 2.0 - (-rate * 0.1 * f64::from(step)).exp();
            assert!((simulation.q()[3] - expected).abs() < 1e-12, "{rate}");
        }
    }
}

/// The smaller of |x| − 1 and |x − 3 e_x|² − a, a being the parameter.
fn second_ball(a: f64) -> CompiledField {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let three = graph.constant(3.0);
    let one = graph.constant(1.0);
    let off = graph.apply(Op::Subtract, &[coordinates[0], three]);
    let square = |graph: &mut Graph, first| {
        let [_, y, z] = coordinates;
        let squares = [first, y, z].map(|side| graph.apply(Op::Square, &[side]));
        let sum = graph.apply(Op::Add, &squares[..2]);
        graph.apply(Op::Add, &[sum, squares[2]])
    };
    let near = square(&mut graph, coordinates[0]);
    let near = graph.apply(Op::SquareRoot, &[near]);
    let near = graph.apply(Op::Subtract, &[near, one]);
    let far = square(&mut graph, off);
    let parameter = graph.parameter(0);
    let far = graph.apply(Op::Subtract, &[far, parameter]);
    let root = graph.apply(Op::Min, &[near, far]);
    let program = Program::new(&graph, &[root], 3);
    CompiledField::new(Arc::new(program), vec![a])
}

/// A component that appears beside another is found by itself, and floaters fill it.
#[test]
fn a_component_that_appears_gets_floaters() {
    let field = second_ball(-1.0);
    let mut simulation = simulation(&field, setting(1, 5.0, 200));
    assert!((190..=210).contains(&simulation.followers().len()));
    for step in 1..=60 {
        let a = (-1.0 + 0.1 * f64::from(step)).min(1.0);
        simulation.step(0.03, Some(&[a]), &Silent).unwrap();
    }
    let positions = simulation.followers().samples().positions;
    let second = positions.iter().filter(|place| place.x > 1.5).count();
    // As large as the first; radii may end a little larger.
    assert!((120..=240).contains(&second), "{second}");
}

/// What is recorded is how it was, every so often, and the beginning.
#[test]
fn frames_are_kept() {
    let field = sphere_distance(&[0.0, 0.0, 0.0, 1.0]);
    let mut simulation = simulation(&field, setting(4, 1.5, 50));
    assert!(simulation.frames().is_empty());
    simulation.record(3);
    for step in 1..=7 {
        let place = 0.1 * f64::from(step);
        simulation
            .step(0.5, Some(&[place, 0.0, 0.0, 1.0]), &Silent)
            .unwrap();
    }
    let times: Vec<f64> = simulation.frames().iter().map(|frame| frame.time).collect();
    assert_eq!(times, [0.0, 1.5, 3.0]);
    for frame in simulation.frames() {
        let center = DVec3::X * 0.2 * frame.time;
        for place in &frame.samples.positions {
            assert!((place.distance(center) - 1.0).abs() < 1e-8);
        }
    }
}

#[test]
fn a_recording_is_no_longer_than_is_allowed() {
    let field = sphere_distance(&[0.0, 0.0, 0.0, 1.0]);
    let mut setting = setting(4, 1.5, 50);
    setting.options.count_limit = 120;
    let mut simulation = simulation(&field, setting);
    simulation.record(1);
    simulation.step(0.1, None, &Silent).unwrap();
    let refused = simulation.step(0.1, None, &Silent).map(|_| ());
    assert_eq!(refused, Err(SimulationError::TooLong { limit: 120 }));
    assert_eq!(simulation.steps(), 1);
}
