//! The recursive driver and pruning: pruned fields against whole ones to the last bit, what is
//! decided against samples, and the order and shape of the subdivision.

#[path = "engine_common/expressions.rs"]
#[allow(dead_code)]
mod expressions;
#[path = "engine_common/fields.rs"]
mod fields;

use expressions::{PARAMETERS, Random, SPECIAL, direct, expression, same};
use glam::DVec3;
use imp::engine::{
    Cell, CompiledField, Explorer, Field, Kernels, Program, Silent, Specialized, Subdivision, Tier,
    explore,
};
use imp::graph::interval::{Enclosure, Regularity};
use imp::graph::{Graph, NodeId, Op};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Random expressions joined by choices, so that there is something to prune.
fn choices(graph: &mut Graph, seed: u64) -> NodeId {
    let random = &mut Random(seed ^ 0xc401);
    let mut root = expression(graph, seed);
    for part in 0..4 {
        let other = match random.below(2) {
            0 => expression(graph, seed.wrapping_mul(31) + part),
            _ => plane(graph, random),
        };
        root = match random.below(6) {
            0 => graph.apply(Op::Min, &[root, other]),
            1 => graph.apply(Op::Max, &[other, root]),
            2 => {
                let op = random.choose(&[Op::Less, Op::LessEqual, Op::Equal]);
                let bound = plane(graph, random);
                let condition = graph.apply(op, &[other, bound]);
                let otherwise = plane(graph, random);
                graph.apply(Op::Select, &[condition, root, otherwise])
            }
            3 => {
                let magnitude = graph.apply(Op::Abs, &[other]);
                graph.apply(Op::Add, &[root, magnitude])
            }
            4 => {
                // 0 on one side: what chain rules and compact supports are made of.
                let zero = graph.constant(random.choose(&[0.0, -0.0, 1.0]));
                let ramp = graph.apply(Op::Max, &[zero, other]);
                let product = graph.apply(Op::ChainProduct, &[ramp, root]);
                let rest = plane(graph, random);
                graph.apply(Op::Add, &[product, rest])
            }
            _ => {
                let condition = graph.apply(Op::IsNumber, &[root]);
                graph.apply(Op::Select, &[condition, root, other])
            }
        };
    }
    root
}

/// A linear function, which boxes decide more often than not.
fn plane(graph: &mut Graph, random: &mut Random) -> NodeId {
    let axis = random.below(3);
    let coordinate = graph.coordinate(axis);
    let scale = graph.constant(random.choose(&[1.0, -1.0, 3.0]));
    let offset = graph.constant(random.choose(&[0.0, -0.0, 0.5, -0.25, 1.0]));
    let scaled = graph.apply(Op::Multiply, &[coordinate, scale]);
    graph.apply(Op::Add, &[scaled, offset])
}

/// Compares the field of every leaf with the whole one.
struct Compare<'a> {
    whole: &'a CompiledField,
    graph: &'a Graph,
    root: NodeId,
    q: [f64; PARAMETERS],
    seed: u64,
    size: usize,
    pruned: AtomicUsize,
    with_gradients: bool,
}

/// Fills columns of values and of gradients.
type Work<'a> = dyn FnMut(&mut [f64], &mut [&mut [f64]]) + 'a;

impl Explorer for Compare<'_> {
    type Task = ();

    fn begin(&self, _: &Cell) {}

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut (), _: &Cell, _: &Enclosure) {
        unreachable!("nothing is decided");
    }

    fn leaf(&self, _: &mut (), cell: &Cell, found: &Enclosure, field: &mut Specialized<'_>) {
        if field.size() < self.size {
            self.pruned.fetch_add(1, Ordering::Relaxed);
        }
        let random = &mut Random(self.seed ^ cell.index.iter().fold(7, |a, &b| a * 31 + b as u64));
        let mut columns = [const { Vec::new() }; 3];
        for _ in 0..12 {
            for (axis, column) in columns.iter_mut().enumerate() {
                let (low, high) = (cell.low[axis], cell.high[axis]);
                let middle = random.uniform(low, high).clamp(low, high);
                let special = match random.choose(SPECIAL) {
                    // Not a number of any box.
                    special if special.is_nan() => middle,
                    special => special.clamp(low, high),
                };
                column.push(random.choose(&[low, high, middle, middle, special]));
            }
        }
        let points = columns.each_ref().map(|column| &column[..]);
        let mut values = vec![0.25; 12];
        field.values(&points, &mut values);
        for (index, &value) in values.iter().enumerate() {
            let point = points.map(|column| column[index]);
            let expected = direct(self.graph, &[self.root], point, &self.q)[0];
            assert!(
                same(value, expected),
                "seed {}, {cell:?}, {point:?}: {value:e} instead of {expected:e}",
                self.seed
            );
            // Where something is not defined, its infinity or NaN may lead elsewhere.
            assert!(
                found.regularity == Regularity::Partial || found.range.contains(expected),
                "seed {}, {cell:?}, {point:?}: {expected:e} is not in {found:?}",
                self.seed
            );
        }
        if self.with_gradients {
            let columns = |work: &mut Work| {
                let mut columns = vec![vec![0.25; 12]; 4];
                let mut all: Vec<&mut [f64]> = columns.iter_mut().map(|c| &mut c[..]).collect();
                let (values, gradients) = all.split_at_mut(1);
                work(values[0], gradients);
                columns.concat()
            };
            let expected = columns(&mut |values, gradients| {
                self.whole.gradients(&points, values, gradients);
            });
            let found = columns(&mut |values, gradients| {
                field.gradients(&points, values, gradients);
            });
            let excerpt = field.excerpt().expect("it is small");
            let kept = columns(&mut |values, gradients| {
                excerpt.gradients(&points, values, gradients);
            });
            let expected = expected.iter().chain(&expected);
            for (found, expected) in found.iter().chain(&kept).zip(expected) {
                assert!(
                    same(*found, *expected),
                    "seed {}, {cell:?}: {found:e} instead of {expected:e}",
                    self.seed
                );
            }
        }
    }
}

/// Explores random boxes with random expressions; returns in how many leaves something was pruned.
fn compare(seeds: std::ops::Range<u64>, with_gradients: bool) -> usize {
    let mut pruned = 0;
    for seed in seeds {
        let mut graph = Graph::new();
        let root = choices(&mut graph, seed);
        let random = &mut Random(seed ^ 0xb0c5);
        let q: [f64; PARAMETERS] = std::array::from_fn(|_| match random.below(12) {
            0 => random.choose(SPECIAL),
            _ => random.uniform(-2.0, 2.0),
        });
        let tier = random.choose(&[Tier::Automatic, Tier::Block(Kernels::Baseline)]);
        let program = Arc::new(Program::with_tier(&graph, &[root], 3, tier));
        let parameters = program.parameters().iter();
        let own = parameters.map(|&index| q[index as usize]).collect();
        let field = CompiledField::new(program.clone(), own);
        let corner = |random: &mut Random| {
            DVec3::from_array(std::array::from_fn(|_| match random.below(4) {
                0 => random.choose(&[0.0, -0.0, 0.5, -1.0, 1e160, -1e300]),
                _ => random.uniform(-2.0, 2.0),
            }))
        };
        let (a, b) = (corner(random), corner(random));
        let subdivision = Subdivision {
            low: a.min(b),
            high: a.max(b),
            splits: vec![[2, 1, 1], [2, 2, 1], [1, 2, 2], [2, 1, 2]],
            descending: [false; 3],
        };
        let compare = Compare {
            whole: &field,
            graph: &graph,
            root,
            q,
            seed,
            size: whole_size(&field),
            pruned: AtomicUsize::new(0),
            with_gradients,
        };
        explore(&field, &subdivision, &compare, &Silent);
        pruned += compare.pruned.into_inner();
    }
    pruned
}

/// The size of the field where nothing is pruned: in a box so large that it decides nothing.
fn whole_size(field: &CompiledField) -> usize {
    struct Size;
    impl Explorer for Size {
        type Task = usize;
        fn begin(&self, _: &Cell) -> usize {
            0
        }
        fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
            false
        }
        fn decided(&self, _: &mut usize, _: &Cell, _: &Enclosure) {}
        fn leaf(&self, size: &mut usize, _: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
            *size = field.size();
        }
    }
    let subdivision = Subdivision {
        low: DVec3::splat(-1e3),
        high: DVec3::splat(1e3),
        splits: vec![[1; 3]],
        descending: [false; 3],
    };
    explore(field, &subdivision, &Size, &Silent)[0]
}

#[test]
fn pruned_values_are_those_of_the_whole_field() {
    let pruned = compare(0..320, false);
    // There are 64 leaves for each of the 320; a test that prunes nothing tests nothing.
    assert!(pruned > 2_000, "{pruned}");
}

#[test]
fn pruned_gradients_are_those_of_the_whole_field() {
    let pruned = compare(5000..5100, true);
    assert!(pruned > 600, "{pruned}");
}

/// Adds up how long the gradients of leaves are.
struct Lengths;

impl Explorer for Lengths {
    type Task = [usize; 2];

    fn begin(&self, _: &Cell) -> [usize; 2] {
        [0; 2]
    }

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut [usize; 2], _: &Cell, _: &Enclosure) {}

    fn leaf(&self, sum: &mut [usize; 2], _: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        sum[0] += field.excerpt().expect("it is small").size();
        sum[1] += 1;
    }
}

#[test]
fn gradients_are_as_short_as_their_leaves_allow() {
    let field = field(&fields::spheres(100));
    let mean = |splits: &[[usize; 3]]| {
        let sums = explore(&field, &subdivision(splits), &Lengths, &Silent);
        let [length, leaves] = [0, 1].map(|place| sums.iter().map(|sum| sum[place]).sum::<usize>());
        length as f64 / leaves as f64
    };
    // A leaf of an eighth of the box meets a few of the spheres, half of it a great part of them.
    let (coarse, fine) = (mean(&[[2; 3]]), mean(&[[2; 3], [4; 3]]));
    assert!(fine < 0.5 * coarse, "{fine} of {coarse}");
}

/// Asks in every leaf for gradients all over the box.
struct Elsewhere<'a>(&'a CompiledField);

impl Explorer for Elsewhere<'_> {
    type Task = ();

    fn begin(&self, _: &Cell) {}

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut (), _: &Cell, _: &Enclosure) {}

    fn leaf(&self, _: &mut (), cell: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        let far = Cell {
            low: DVec3::splat(-1.0),
            high: DVec3::splat(0.7),
            ..*cell
        };
        let columns = [grid(cell, 3), grid(&far, 3)];
        let columns = [0, 1, 2].map(|axis| [&columns[0][axis][..], &columns[1][axis]].concat());
        let points = columns.each_ref().map(|column| &column[..]);
        let [mut found, mut expected] = [(); 2].map(|()| vec![vec![0.0; 54]; 4]);
        let columns = |all: &mut Vec<Vec<f64>>, work: &mut Work| {
            let mut all: Vec<&mut [f64]> = all.iter_mut().map(|c| &mut c[..]).collect();
            let (values, gradients) = all.split_at_mut(1);
            work(values[0], gradients);
        };
        columns(&mut found, &mut |values, gradients| {
            field.gradients(&points, values, gradients);
        });
        columns(&mut expected, &mut |values, gradients| {
            self.0.gradients(&points, values, gradients);
        });
        assert_eq!(found, expected, "{cell:?}");
    }
}

#[test]
fn gradients_are_right_also_outside_of_the_leaf() {
    let field = field(&fields::spheres(100));
    let subdivision = subdivision(&[[2; 3], [4; 3]]);
    explore(&field, &subdivision, &Elsewhere(&field), &Silent);
}

/// What an exploration visits.
#[derive(Clone, Debug, PartialEq)]
enum Visit {
    Decided(Cell, Enclosure),
    Leaf(Cell, usize, Vec<f64>),
}

/// Writes down what it visits, with values at a grid of points in each leaf.
struct Record;

fn grid(cell: &Cell, count: usize) -> [Vec<f64>; 3] {
    let mut columns = [const { Vec::new() }; 3];
    for index in 0..count * count * count {
        let places = [index % count, index / count % count, index / count / count];
        for axis in 0..3 {
            let part = places[axis] as f64 / (count - 1) as f64;
            let (low, high) = (cell.low[axis], cell.high[axis]);
            columns[axis].push((low + (high - low) * part).clamp(low, high));
        }
    }
    columns
}

impl Explorer for Record {
    type Task = Vec<Visit>;

    fn begin(&self, _: &Cell) -> Vec<Visit> {
        Vec::new()
    }

    fn decided(&self, visits: &mut Vec<Visit>, cell: &Cell, enclosure: &Enclosure) {
        visits.push(Visit::Decided(*cell, *enclosure));
    }

    fn leaf(
        &self,
        visits: &mut Vec<Visit>,
        cell: &Cell,
        _: &Enclosure,
        field: &mut Specialized<'_>,
    ) {
        let columns = grid(cell, 3);
        let mut values = vec![0.0; 27];
        field.values(&columns.each_ref().map(|column| &column[..]), &mut values);
        visits.push(Visit::Leaf(*cell, field.size(), values));
    }
}

fn field(example: &fields::Example) -> CompiledField {
    let program = Arc::new(Program::new(&example.graph, &[example.root], 3));
    CompiledField::new(program, example.q.clone())
}

fn subdivision(splits: &[[usize; 3]]) -> Subdivision {
    Subdivision {
        low: DVec3::new(-1.3, -1.2, -1.1),
        high: DVec3::new(1.25, 1.2, 0.7),
        splits: splits.to_vec(),
        descending: [false; 3],
    }
}

#[test]
fn decided_cells_have_the_sign_of_their_enclosure() {
    for example in [fields::torus(), fields::blobs(14), fields::spheres(100)] {
        let field = field(&example);
        let subdivision = subdivision(&[[3, 2, 2], [2, 3, 2], [3, 3, 3]]);
        let (mut inside, mut outside) = (0, 0);
        for visit in explore(&field, &subdivision, &Record, &Silent).concat() {
            let Visit::Decided(cell, Enclosure { range, .. }) = visit else {
                continue;
            };
            let is_inside = range.high < 0.0;
            assert!(is_inside || range.low > 0.0, "{range:?}");
            let columns = grid(&cell, 6);
            let mut values = vec![0.0; 216];
            field.values(&columns.each_ref().map(|column| &column[..]), &mut values);
            for value in values {
                assert_eq!(value < 0.0, is_inside, "{}, {cell:?}", example.name);
                assert!(range.contains(value));
            }
            match is_inside {
                true => inside += 1,
                false => outside += 1,
            }
        }
        assert!(inside > 0 && outside > 0, "{}", example.name);
    }
}

#[test]
fn cells_tile_the_box() {
    let example = fields::spheres(40);
    let field = field(&example);
    let subdivision = subdivision(&[[2, 3, 1], [5, 2, 3], [1, 2, 4], [3, 2, 2]]);
    let all = subdivision.cells(3);
    assert_eq!(all, [30, 24, 24]);
    let mut covered = vec![0; 30 * 24 * 24];
    for visit in explore(&field, &subdivision, &Record, &Silent).concat() {
        let cell = match visit {
            Visit::Decided(cell, _) | Visit::Leaf(cell, ..) => cell,
        };
        let cells = subdivision.cells(cell.level);
        let span: [usize; 3] = std::array::from_fn(|axis| all[axis] / cells[axis]);
        for index in 0..span.iter().product() {
            let inner = [
                index % span[0],
                index / span[0] % span[1],
                index / span[0] / span[1],
            ];
            let [x, y, z] = std::array::from_fn(|axis| cell.index[axis] * span[axis] + inner[axis]);
            covered[(z * 24 + y) * 30 + x] += 1;
        }
        // The faces are those of the small cells at the corners, to the last bit.
        let first = std::array::from_fn(|axis| cell.index[axis] * span[axis]);
        let last = std::array::from_fn(|axis| (cell.index[axis] + 1) * span[axis] - 1);
        assert_eq!(subdivision.cell(3, first).low, cell.low);
        assert_eq!(subdivision.cell(3, last).high, cell.high);
        for axis in 0..3 {
            assert!(cell.low[axis] < cell.high[axis]);
            if cell.index[axis] == 0 {
                assert_eq!(cell.low[axis], subdivision.low[axis]);
            } else {
                let mut neighbour = cell.index;
                neighbour[axis] -= 1;
                let neighbour = subdivision.cell(cell.level, neighbour);
                assert_eq!(cell.low[axis], neighbour.high[axis]);
            }
            if cell.index[axis] + 1 == cells[axis] {
                assert_eq!(cell.high[axis], subdivision.high[axis]);
            }
        }
    }
    assert!(covered.iter().all(|&times| times == 1));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let example = fields::spheres(100);
    let field = field(&example);
    let subdivision = subdivision(&[[4, 4, 5], [4, 4, 2], [2, 2, 2]]);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap()
            .install(|| explore(&field, &subdivision, &Record, &Silent))
    };
    let one = run(1);
    assert_eq!(one.len(), 80);
    assert!(one.iter().flatten().count() > 1000);
    assert!(one == run(3));
}

/// Visits every leaf.
struct Everything;

impl Explorer for Everything {
    type Task = Vec<[usize; 3]>;

    fn begin(&self, cell: &Cell) -> Vec<[usize; 3]> {
        assert_eq!(cell.level, 0);
        Vec::new()
    }

    fn wants(&self, _: &mut Vec<[usize; 3]>, cell: &Cell) -> bool {
        cell.level < 2 || cell.index[0] != 5
    }

    fn decides(&self, _: &Cell, _: &Enclosure) -> bool {
        false
    }

    fn decided(&self, _: &mut Vec<[usize; 3]>, _: &Cell, _: &Enclosure) {
        unreachable!("nothing is decided");
    }

    fn leaf(
        &self,
        visits: &mut Vec<[usize; 3]>,
        cell: &Cell,
        _: &Enclosure,
        _: &mut Specialized<'_>,
    ) {
        visits.push(cell.index);
    }
}

#[test]
fn cells_are_visited_in_the_order_of_the_subdivision() {
    let example = fields::torus();
    let field = field(&example);
    // More than 64 children of a cell, so that they are bounded in several passes.
    let splits = [[2, 1, 2], [5, 5, 4], [1, 2, 1]];
    let subdivision = Subdivision {
        descending: [false, true, true],
        ..subdivision(&splits)
    };
    let tasks = explore(&field, &subdivision, &Everything, &Silent);
    let mut expected = Vec::new();
    for z0 in [1, 0] {
        for x0 in [0, 1] {
            let mut task = Vec::new();
            for z1 in (0..4).rev() {
                for y1 in (0..5).rev() {
                    for x1 in 0..5 {
                        for y2 in [1, 0] {
                            let leaf = [x0 * 5 + x1, y1 * 2 + y2, z0 * 4 + z1];
                            if leaf[0] != 5 {
                                task.push(leaf);
                            }
                        }
                    }
                }
            }
            expected.push(task);
        }
    }
    assert!(tasks == expected);
}

#[test]
fn fields_become_smaller_from_level_to_level() {
    let example = fields::spheres(100);
    let field = field(&example);
    let mut sizes = vec![whole_size(&field) as f64];
    let splits = [[2; 3], [2; 3], [2; 3], [4; 3], [1; 3]];
    // A short field is pruned for the cell around a leaf, not for the leaf, so the last split is
    // one that does nothing.
    for depth in 1..splits.len() {
        let mut splits = splits[..depth].to_vec();
        splits.push([1; 3]);
        let visits = explore(&field, &subdivision(&splits), &Record, &Silent).concat();
        let leaves = visits.iter().filter_map(|visit| match visit {
            Visit::Leaf(_, size, _) => Some(*size as f64),
            Visit::Decided(..) => None,
        });
        let leaves: Vec<f64> = leaves.collect();
        sizes.push(leaves.iter().sum::<f64>() / leaves.len() as f64);
    }
    for pair in sizes.windows(2) {
        assert!(pair[1] < 0.8 * pair[0], "{sizes:?}");
    }
}

#[test]
fn a_field_that_is_too_large_to_be_bounded_is_explored_as_a_whole() {
    // 200,000 numbers that are all alive before the first sum: a block of bounds for each would
    // take 300 MB.
    let mut graph = Graph::new();
    let x = graph.coordinate(0);
    let products: Vec<NodeId> = (0..200_000)
        .map(|index| {
            let factor = graph.constant(1.5 + index as f64);
            let product = graph.apply(Op::Multiply, &[x, factor]);
            graph.apply(Op::Abs, &[product])
        })
        .collect();
    let mut root = x;
    for product in products {
        root = graph.apply(Op::Add, &[root, product]);
    }
    let program = Arc::new(Program::with_tier(&graph, &[root], 1, Tier::Interpreter));
    let field = CompiledField::new(program, Vec::new());
    let subdivision = Subdivision {
        low: DVec3::splat(1.0),
        high: DVec3::splat(2.0),
        splits: vec![[2, 1, 1], [2, 1, 1]],
        descending: [false; 3],
    };
    let visits = explore(&field, &subdivision, &Ends, &Silent).concat();
    let mut expected = vec![0.0; 8];
    let ends = [1.0, 1.25, 1.25, 1.5, 1.5, 1.75, 1.75, 2.0];
    field.values(&[&ends], &mut expected);
    assert_eq!(visits, expected);
}

/// The values at the ends of cells on the line.
struct Ends;

impl Explorer for Ends {
    type Task = Vec<f64>;

    fn begin(&self, _: &Cell) -> Vec<f64> {
        Vec::new()
    }

    fn decided(&self, _: &mut Vec<f64>, cell: &Cell, _: &Enclosure) {
        unreachable!("{cell:?} cannot be decided");
    }

    fn leaf(&self, found: &mut Vec<f64>, cell: &Cell, _: &Enclosure, field: &mut Specialized<'_>) {
        let mut values = [0.0; 2];
        field.values(&[&[cell.low.x, cell.high.x]], &mut values);
        found.extend(values);
    }
}
