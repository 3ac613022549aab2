//! fidget's side: its machine code and its interpreter behind one interface.
//!
//! Tapes are made before the clock starts, and evaluators and their memory are kept. Its shapes'
//! evaluators are those that its documentation shows and its renderers use; they copy their input.
//! The function's evaluators inside of them, which do not, are measured too.

use std::hint::black_box;
use std::sync::mpsc::{Sender, channel};

use fidget::eval::{BulkEvaluator, Function, MathFunction, Tape, TracingEvaluator};
use fidget::shape::{EzShape, Shape};
use fidget::types::{Grad, Interval};
use fidget::var::{Var, VarMap};

use crate::measure::Task;
use crate::points::{boxes, points_f32};
use crate::subjects::Subject;

/// One of fidget's ways to evaluate.
pub trait Peer: Function + MathFunction + 'static {}

impl<F: Function + MathFunction + 'static> Peer for F {}

fn function<F: Peer>(subject: &Subject) -> F {
    let made = F::new(&subject.context, &[subject.node]);
    made.unwrap_or_else(|error| panic!("{}: {error}", subject.name))
}

/// The columns of the axes in the order that a tape has them in.
fn ordered<T: Clone>(vars: &VarMap, columns: [T; 3]) -> Vec<T> {
    let mut places: Vec<(Var, usize)> = vars.iter().collect();
    places.sort_by_key(|(_, place)| *place);
    let axis = |var| match var {
        Var::X => 0,
        Var::Y => 1,
        Var::Z => 2,
        Var::V(_) => unreachable!("parameters are constants here"),
    };
    let axes = places.into_iter().map(|(var, _)| axis(var));
    axes.map(|axis| columns[axis].clone()).collect()
}

/// The field as one of its shapes.
pub fn shape<F: Peer>(subject: &Subject) -> Shape<F> {
    Shape::new_raw(function(subject))
}

/// Coordinates of points with their own derivatives.
fn seeds(count: usize) -> [Vec<Grad>; 3] {
    let [x, y, z] = points_f32(count);
    [
        x.into_iter().map(|x| Grad::new(x, 1.0, 0.0, 0.0)).collect(),
        y.into_iter().map(|y| Grad::new(y, 0.0, 1.0, 0.0)).collect(),
        z.into_iter().map(|z| Grad::new(z, 0.0, 0.0, 1.0)).collect(),
    ]
}

/// F at points, handed on.
fn with_values<F: Peer>(
    subject: &Subject,
    count: usize,
    mut each: impl FnMut(&[f32]) + Send + 'static,
) -> Task {
    let tape = function::<F>(subject).float_slice_tape(Default::default());
    let columns = ordered(tape.vars(), points_f32(count));
    let mut evaluator = F::new_float_slice_eval();
    Box::new(move || match evaluator.eval(&tape, &columns) {
        Ok(output) => each(&output[0]),
        Err(error) => panic!("{error}"),
    })
}

/// F and F_x at points, handed on.
fn with_gradients<F: Peer>(
    subject: &Subject,
    count: usize,
    mut each: impl FnMut(&[Grad]) + Send + 'static,
) -> Task {
    let tape = function::<F>(subject).grad_slice_tape(Default::default());
    let columns = ordered(tape.vars(), seeds(count));
    let mut evaluator = F::new_grad_slice_eval();
    Box::new(move || match evaluator.eval(&tape, &columns) {
        Ok(output) => each(&output[0]),
        Err(error) => panic!("{error}"),
    })
}

/// Bounds of F over boxes, one after the other, handed on.
fn with_bounds<F: Peer>(
    subject: &Subject,
    count: usize,
    mut each: impl FnMut(Interval) + Send + 'static,
) -> Task {
    let tape = function::<F>(subject).interval_tape(Default::default());
    let columns = ordered(tape.vars(), boxes(count));
    let sides: Vec<Vec<Interval>> = (0..count)
        .map(|index| {
            let sides = columns.iter().map(|column| column[index]);
            sides.map(|(low, high)| Interval::new(low, high)).collect()
        })
        .collect();
    let mut evaluator = F::new_interval_eval();
    Box::new(move || {
        for sides in &sides {
            match evaluator.eval(&tape, sides) {
                Ok((output, _)) => each(output[0]),
                Err(error) => panic!("{error}"),
            }
        }
    })
}

/// Evaluates F at points by a shape's evaluator.
pub fn shape_values<F: Peer>(subject: &Subject, count: usize) -> Task {
    let tape = shape::<F>(subject).ez_float_slice_tape();
    let [x, y, z] = points_f32(count);
    let mut evaluator = Shape::<F>::new_float_slice_eval();
    Box::new(move || match evaluator.eval(&tape, &x, &y, &z) {
        Ok(values) => {
            black_box(values);
        }
        Err(error) => panic!("{error}"),
    })
}

/// Evaluates F and F_x at points by a shape's evaluator.
pub fn shape_gradients<F: Peer>(subject: &Subject, count: usize) -> Task {
    let tape = shape::<F>(subject).ez_grad_slice_tape();
    let [x, y, z] = seeds(count);
    let mut evaluator = Shape::<F>::new_grad_slice_eval();
    Box::new(move || match evaluator.eval(&tape, &x, &y, &z) {
        Ok(gradients) => {
            black_box(gradients);
        }
        Err(error) => panic!("{error}"),
    })
}

/// Bounds F over boxes by a shape's evaluator, one at a time: there is no other way.
pub fn shape_bounds<F: Peer>(subject: &Subject, count: usize) -> Task {
    let tape = shape::<F>(subject).ez_interval_tape();
    let [x, y, z] = boxes(count).map(|column| {
        let sides = column.into_iter();
        sides
            .map(|(low, high)| Interval::new(low, high))
            .collect::<Vec<Interval>>()
    });
    let mut evaluator = Shape::<F>::new_interval_eval();
    Box::new(move || {
        for index in 0..count {
            match evaluator.eval(&tape, x[index], y[index], z[index]) {
                Ok((bounds, _)) => {
                    black_box(bounds);
                }
                Err(error) => panic!("{error}"),
            }
        }
    })
}

/// Evaluates F at points.
pub fn values<F: Peer>(subject: &Subject, count: usize) -> Task {
    with_values::<F>(subject, count, |values| {
        black_box(values);
    })
}

/// Evaluates F and F_x at points.
pub fn gradients<F: Peer>(subject: &Subject, count: usize) -> Task {
    with_gradients::<F>(subject, count, |gradients| {
        black_box(gradients);
    })
}

/// Bounds F over boxes, one at a time: there is no other way.
pub fn bounds<F: Peer>(subject: &Subject, count: usize) -> Task {
    with_bounds::<F>(subject, count, |bounds| {
        black_box(bounds);
    })
}

fn send(sender: &Sender<f64>, number: f64) {
    if sender.send(number).is_err() {
        unreachable!("the receiver outlives the task");
    }
}

/// What a task hands on, once.
fn collect<T: Send + 'static>(task: impl FnOnce(Sender<T>) -> Task) -> Vec<T> {
    let (sender, receiver) = channel();
    task(sender)();
    receiver.into_iter().collect()
}

/// F at points.
pub fn value_results<F: Peer>(subject: &Subject, count: usize) -> Vec<f64> {
    collect(|sender| {
        with_values::<F>(subject, count, move |values| {
            let all = values.iter().map(|&value| f64::from(value));
            all.for_each(|value| send(&sender, value));
        })
    })
}

/// F_x at points, all components of a point together.
pub fn gradient_results<F: Peer>(subject: &Subject, count: usize) -> Vec<f64> {
    collect(|sender| {
        with_gradients::<F>(subject, count, move |gradients| {
            let all = gradients
                .iter()
                .flat_map(|grad| [grad.dx, grad.dy, grad.dz]);
            all.for_each(|part| send(&sender, f64::from(part)));
        })
    })
}

/// Bounds of F over boxes: lower and upper one of each.
pub fn bound_results<F: Peer>(subject: &Subject, count: usize) -> Vec<f64> {
    collect(|sender| {
        with_bounds::<F>(subject, count, move |bounds| {
            let ends = [bounds.lower(), bounds.upper()].map(f64::from);
            ends.into_iter().for_each(|end| send(&sender, end));
        })
    })
}
