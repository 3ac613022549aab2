//! Imp's side: what its engine chooses, or the block tier with the instruction set that was asked
//! for.

use std::hint::black_box;
use std::slice;
use std::sync::Arc;

use imp::engine::{CompiledField, Field, Program, Tier};
use imp::graph::Interval;
use imp::graph::interval::Enclosure;

use crate::measure::Task;
use crate::points::{boxes, points, points_f32};
use crate::subjects::Subject;

/// The field's program for a tier.
pub fn program(subject: &Subject, tier: Tier) -> Program {
    let roots = [subject.root];
    Program::with_tier(&subject.graph, &roots, subject.dimension, tier)
}

fn field(subject: &Subject, tier: Tier) -> CompiledField {
    CompiledField::new(Arc::new(program(subject, tier)), subject.q.clone())
}

/// A field with columns of points and of results.
struct Batch<T> {
    field: CompiledField,
    points: [Vec<T>; 3],
    /// F, then F_x, then F_q.
    outputs: Vec<Vec<T>>,
}

impl<T: Copy + Default> Batch<T> {
    fn new(subject: &Subject, tier: Tier, points: [Vec<T>; 3]) -> Batch<T> {
        let columns = 1 + subject.dimension + subject.q.len();
        Batch {
            field: field(subject, tier),
            outputs: vec![vec![T::default(); points[0].len()]; columns],
            points,
        }
    }

    /// The points' columns, and mutable ones for F, F_x and F_q.
    fn run(&mut self, work: impl FnOnce(&CompiledField, &[&[T]], [&mut [&mut [T]]; 3])) {
        let dimension = self.field.program().dimension();
        let points = self.points.each_ref().map(|column| &column[..]);
        let mut outputs: Vec<&mut [T]> = self.outputs.iter_mut().map(|o| &mut o[..]).collect();
        let (values, gradients) = outputs.split_at_mut(1);
        let (gradients, parameters) = gradients.split_at_mut(dimension);
        work(
            &self.field,
            &points[..dimension],
            [values, gradients, parameters],
        );
        black_box(&mut self.outputs);
    }
}

/// Evaluates F at points in f32.
fn values_f32(batch: &mut Batch<f32>) {
    batch.run(|field, points, [values, ..]| {
        assert!(field.values_f32(points, values[0]));
    });
}

/// Evaluates F at points in f64.
fn values_f64(batch: &mut Batch<f64>) {
    batch.run(|field, points, [values, ..]| field.values(points, values[0]));
}

/// Evaluates F and F_x at points in f32.
fn gradients_f32(batch: &mut Batch<f32>) {
    batch.run(|field, points, [values, gradients, _]| {
        assert!(field.gradients_f32(points, values[0], gradients));
    });
}

/// Evaluates F and F_x at points in f64.
fn gradients_f64(batch: &mut Batch<f64>) {
    batch.run(|field, points, [values, gradients, _]| {
        field.gradients(points, values[0], gradients);
    });
}

/// What a task evaluates.
#[derive(Clone, Copy)]
pub enum What {
    /// F in f32.
    Values32,
    /// F in f64.
    Values64,
    /// F and F_x in f32.
    Gradients32,
    /// F and F_x in f64.
    Gradients64,
    /// F, F_x and F_q in f64.
    ParameterGradients,
}

/// Evaluates at points.
pub fn evaluate(subject: &Subject, tier: Tier, what: What, count: usize) -> Task {
    let single = || Batch::new(subject, tier, points_f32(count));
    let double = || Batch::new(subject, tier, points(count));
    fn task<T: Send + 'static>(mut batch: Batch<T>, work: fn(&mut Batch<T>)) -> Task {
        Box::new(move || work(&mut batch))
    }
    match what {
        What::Values32 => task(single(), values_f32),
        What::Values64 => task(double(), values_f64),
        What::Gradients32 => task(single(), gradients_f32),
        What::Gradients64 => task(double(), gradients_f64),
        What::ParameterGradients => task(double(), |batch| {
            batch.run(|field, points, [values, gradients, parameters]| {
                field.parameter_gradients(points, values[0], gradients, parameters);
            });
        }),
    }
}

/// The same once: the results, all of a point together.
pub fn results(subject: &Subject, tier: Tier, what: What, count: usize) -> Vec<f64> {
    fn once<T: Copy + Into<f64>>(
        mut batch: Batch<T>,
        work: fn(&mut Batch<T>),
        columns: std::ops::Range<usize>,
    ) -> Vec<f64> {
        work(&mut batch);
        let points = 0..batch.points[0].len();
        points
            .flat_map(|point| columns.clone().map(move |column| (column, point)))
            .map(|(column, point)| match batch.outputs.get(column) {
                Some(output) => output[point].into(),
                // The derivative in a coordinate that there is not.
                None => 0.0,
            })
            .collect()
    }
    let single = || Batch::new(subject, tier, points_f32(count));
    let double = || Batch::new(subject, tier, points(count));
    match what {
        What::Values32 => once(single(), values_f32, 0..1),
        What::Values64 => once(double(), values_f64, 0..1),
        What::Gradients32 => once(single(), gradients_f32, 1..4),
        What::Gradients64 | What::ParameterGradients => once(double(), gradients_f64, 1..4),
    }
}

fn sides(count: usize) -> [Vec<Interval>; 3] {
    boxes(count).map(|column| {
        let sides = column.into_iter();
        sides
            .map(|(low, high)| Interval::new(low.into(), high.into()))
            .collect()
    })
}

/// Bounds F over boxes: all at once.
pub fn bounds_together(subject: &Subject, tier: Tier, count: usize) -> Task {
    let field = field(subject, tier);
    let dimension = subject.dimension;
    let sides = sides(count);
    let mut bounds = vec![Enclosure::of_number(0.0); count];
    Box::new(move || {
        let sides = sides.each_ref().map(|column| &column[..]);
        field.enclose(&sides[..dimension], &mut bounds);
        black_box(&mut bounds);
    })
}

/// Bounds F over boxes: one after the other.
pub fn bounds_alone(subject: &Subject, tier: Tier, count: usize) -> Task {
    let field = field(subject, tier);
    let dimension = subject.dimension;
    let [x, y, z] = sides(count);
    let run = move || {
        for ((x, y), z) in x.iter().zip(&y).zip(&z) {
            let mut bounds = [Enclosure::of_number(0.0)];
            let sides = [x, y, z].map(slice::from_ref);
            field.enclose(&sides[..dimension], &mut bounds);
            black_box(bounds);
        }
    };
    // After many boxes Imp compiles; fidget has compiled before the clock starts.
    (0..2000_usize.div_ceil(count)).for_each(|_| run());
    Box::new(run)
}

/// Bounds of F over boxes: lower and upper one of each.
pub fn bound_results(subject: &Subject, tier: Tier, count: usize) -> Vec<f64> {
    let program = program(subject, tier);
    let sides = sides(count);
    let sides = sides.each_ref().map(|column| &column[..]);
    let mut bounds = vec![Enclosure::of_number(0.0); count];
    program.enclose_batch(&sides[..subject.dimension], &subject.q, &mut [&mut bounds]);
    let ranges = bounds.iter().map(|bounds| bounds.range);
    ranges.flat_map(|range| [range.low, range.high]).collect()
}
