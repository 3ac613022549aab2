//! Exploring does not allocate once it has warmed up. Alone in its process, whose allocations it
//! counts.
#![allow(unsafe_code)]

#[path = "engine_common/fields.rs"]
mod fields;

use glam::DVec3;
use imp::engine::{
    Cell, CompiledField, Explorer, Program, Silent, Specialized, Subdivision, explore,
};
use imp::graph::interval::Enclosure;
use imp::graph::{Graph, Node, NodeId, Op};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The system's allocator, counting.
struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

// SAFETY: all is done by the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise is handed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is handed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promise is handed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The example with |x| in the place of x.
fn mirrored(example: &fields::Example) -> (Graph, NodeId) {
    let mut graph = Graph::new();
    let mut copies = vec![example.root; example.graph.len()];
    for id in example.graph.reachable(&[example.root]) {
        copies[id.index()] = match example.graph.node(id) {
            Node::Constant(bits) => graph.constant(f64::from_bits(bits)),
            Node::Coordinate(0) => {
                let x = graph.coordinate(0);
                graph.apply(Op::Abs, &[x])
            }
            Node::Coordinate(axis) => graph.coordinate(axis.into()),
            Node::Parameter(index) => graph.parameter(index as usize),
            Node::Apply(op, operands) => {
                let operands = operands.map(|operand| copies[operand.index()]);
                graph.apply(op, &operands[..op.arity()])
            }
        };
    }
    (graph, copies[example.root.index()])
}

/// Counts allocations from the first leaf of a task to its last, with values and gradients.
struct Count;

impl Explorer for Count {
    /// The counts at the beginning and at the end, leaves, and operations of their fields.
    type Task = (usize, usize, usize, usize);

    fn begin(&self, _: &Cell) -> Self::Task {
        let now = COUNT.load(Ordering::Relaxed);
        (now, now, 0, 0)
    }

    fn decided(&self, _: &mut Self::Task, _: &Cell, _: &Enclosure) {}

    fn leaf(&self, task: &mut Self::Task, cell: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        let middle = (cell.low + cell.high) / 2.0;
        let points = middle.to_array().map(|x| [x; 100]);
        let points = points.each_ref().map(|column| &column[..]);
        let mut values = [0.0; 100];
        field.values(&points, &mut values);
        let [mut x, mut y, mut z] = [[0.0; 100]; 3];
        field.gradients(&points, &mut values, &mut [&mut x, &mut y, &mut z]);
        assert!(values[0].is_finite() && x[0].is_finite());
        task.1 = COUNT.load(Ordering::Relaxed);
        task.2 += 1;
        task.3 += field.size();
    }
}

#[test]
fn a_second_task_of_the_same_size_allocates_nothing() {
    let example = fields::spheres(60);
    let (graph, root) = mirrored(&example);
    let program = Arc::new(Program::new(&graph, &[root], 3));
    let field = CompiledField::new(program, example.q);
    let subdivision = Subdivision {
        low: DVec3::splat(-1.5),
        high: DVec3::splat(1.5),
        splits: vec![[2, 1, 1], [2, 4, 4], [2; 3], [2; 3]],
        descending: [false; 3],
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let tasks = pool
        .unwrap()
        .install(|| explore(&field, &subdivision, &Count, &Silent));
    let [(_, _, first, sizes), (begin, end, second, same)] = tasks[..] else {
        panic!("two tasks were asked for");
    };
    assert!(first > 100, "{first}");
    // |x| is −x in the first half, which takes an operation, and x in the second one.
    assert_eq!(first, second);
    assert!(same <= sizes && 9 * sizes < 10 * same, "{sizes} {same}");
    assert_eq!(begin, end);
}
