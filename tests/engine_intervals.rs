//! Enclosures of boxes: what a field or its gradient can be is never outside, alone and in
//! batches, for random expressions that use every operation, and boxes of all kinds.
//!
//! What is compared. The natural enclosure holds every value that the operations compute, with
//! their rounding errors: computed values are looked for in it. That of the gradient holds what
//! the derivative graph computes, likewise. The mean-value form holds exact values only, so a
//! computed one may be outside: instead, the table's interval rules enclose the exact value at a
//! point, and that enclosure must meet it.

#[path = "engine_common/expressions.rs"]
#[allow(dead_code)]
mod expressions;
#[path = "engine_common/fields.rs"]
mod fields;

use expressions::{PARAMETERS, Random, SPECIAL, direct, expression};
use imp::engine::{CompiledField, Kernels, Program, Tier};
use imp::graph::interval::{Enclosure, Regularity, enclose};
use imp::graph::{Graph, Interval, NodeId, Op, derive};
use std::sync::Arc;

const EXPRESSIONS: u64 = 3_000;
const BOXES: usize = 30;
const POINTS: usize = 8;

/// The instruction sets that this processor can execute.
fn kernels() -> impl Iterator<Item = Kernels> {
    Kernels::ALL
        .into_iter()
        .filter(|kernels| kernels.or_narrower() == *kernels)
}

fn program(graph: &Graph, roots: &[NodeId], kernels: Kernels) -> Program {
    Program::with_tier(graph, roots, 3, Tier::Block(kernels))
}

/// The values of the program's own parameters.
fn own(program: &Program, q: &[f64]) -> Vec<f64> {
    let parameters = program.parameters().iter();
    parameters.map(|&index| q[index as usize]).collect()
}

fn slices<T>(columns: &[Vec<T>]) -> Vec<&[T]> {
    columns.iter().map(|column| &column[..]).collect()
}

/// Something that no result is.
const UNSET: Enclosure = Enclosure {
    range: Interval {
        low: 0.123,
        high: 0.123,
    },
    regularity: Regularity::Defined,
};

/// A side of any kind: unbounded, between special numbers, a number, from or to 0, subnormal,
/// huge, narrow or wide.
fn random_side(random: &mut Random) -> Interval {
    match random.below(12) {
        0 => Interval::ENTIRE,
        1 => {
            let (a, b) = (random.choose(SPECIAL), random.choose(SPECIAL));
            Interval::new(a.min(b), a.max(b))
        }
        2 => Interval::point(random.uniform(-2.0, 2.0)),
        3 => Interval::new(0.0, random.uniform(0.0, 3.0)),
        4 => Interval::new(random.uniform(-3.0, 0.0), 0.0),
        5 => {
            let a = f64::from_bits(random.bits() >> random.choose(&[12, 13, 40, 63]));
            Interval::new(-a, a * random.uniform(0.0, 2.0))
        }
        6 => {
            let a = random.uniform(-1e9, 1e9);
            Interval::new(a, a + random.uniform(0.0, 7.0))
        }
        7 | 8 => {
            let a = random.uniform(-2.0, 2.0);
            Interval::new(a, a + random.uniform(0.0, 1e-6))
        }
        _ => {
            let a = random.uniform(-3.0, 3.0);
            Interval::new(a, a + random.uniform(0.0, 2.0) * random.uniform(0.0, 1.0))
        }
    }
}

/// A finite number in a side, often an end of it.
fn inside(random: &mut Random, side: Interval) -> Option<f64> {
    let (low, high) = (side.low.max(-1e300), side.high.min(1e300));
    let number = match random.below(4) {
        0 => low,
        1 => high,
        _ => random.uniform(low, high).clamp(low.min(high), high),
    };
    (number.is_finite() && side.contains(number)).then_some(number)
}

/// One expression on many boxes, by a program of these kernels.
struct Subject {
    graph: Graph,
    /// F and F_x.
    roots: Vec<NodeId>,
    q: [f64; PARAMETERS],
    sides: [Vec<Interval>; 3],
    natural: Vec<Enclosure>,
    tightened: Vec<Enclosure>,
    gradients: [Vec<Interval>; 3],
}

impl Subject {
    fn new(seed: u64, kernels: Kernels) -> Subject {
        let mut graph = Graph::new();
        let root = expression(&mut graph, seed);
        let random = &mut Random(seed ^ 0xb0c5);
        let q = std::array::from_fn(|_| match seed % 8 {
            0 => random.choose(SPECIAL),
            _ => random.uniform(-2.0, 2.0),
        });
        let sides = [(); 3].map(|()| (0..BOXES).map(|_| random_side(random)).collect());
        let program = Arc::new(program(&graph, &[root], kernels));
        let field = CompiledField::new(program.clone(), own(&program, &q));
        let (mut natural, mut tightened) = (vec![UNSET; BOXES], vec![UNSET; BOXES]);
        let mut gradients = [(); 3].map(|()| vec![UNSET.range; BOXES]);
        field.enclose(&slices(&sides), &mut natural);
        let mut columns = gradients.each_mut().map(|column| &mut column[..]);
        field.enclose_gradients(&slices(&sides), &mut tightened, &mut columns);
        let axes: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
        let mut roots = vec![root];
        roots.extend(derive::reverse(&mut graph, root, &axes));
        Subject {
            graph,
            roots,
            q,
            sides,
            natural,
            tightened,
            gradients,
        }
    }

    fn sides(&self, index: usize) -> [Interval; 3] {
        self.sides.each_ref().map(|column| column[index])
    }

    /// The table's rules, node by node.
    fn ruled(&self, sides: &[Interval; 3]) -> Enclosure {
        enclose(&self.graph, &self.roots[..1], sides, |place| {
            self.q[place as usize]
        })[0]
    }

    /// Compares with values at points of one box. Returns how many were compared.
    fn check(&self, index: usize, random: &mut Random, parts: &[NodeId]) -> usize {
        let sides = self.sides(index);
        let (natural, tightened) = (self.natural[index], self.tightened[index]);
        let mut checks = 0;
        for _ in 0..POINTS {
            let [x, y, z] = sides.map(|side| inside(random, side));
            let (Some(x), Some(y), Some(z)) = (x, y, z) else {
                continue;
            };
            let point = [x, y, z];
            let what = format!("at {point:?} in {sides:?} with {:?}", self.q);
            // An infinite intermediate result is undefined, whatever becomes of it.
            let values = direct(&self.graph, parts, point, &self.q);
            if values.iter().any(|value| value.is_infinite()) {
                continue;
            }
            let roots = self.roots.iter().map(|root| {
                let place = parts.binary_search(root).unwrap();
                values[place]
            });
            let values: Vec<f64> = roots.collect();
            if values[0].is_nan() {
                assert_eq!(natural.regularity, Regularity::Partial, "{what}");
                assert_eq!(tightened.regularity, Regularity::Partial, "{what}");
                continue;
            }
            assert!(natural.range.contains(values[0]), "{natural:?} {what}");
            checks += 1;
            let exact = self.ruled(&point.map(Interval::point)).range;
            assert!(
                exact.is_empty() || !tightened.range.intersection(exact).is_empty(),
                "{tightened:?} misses {exact:?} {what}"
            );
            checks += 1;
            for (gradient, &slope) in self.gradients.iter().zip(&values[1..]) {
                assert!(
                    slope.is_nan() || gradient[index].contains(slope),
                    "{slope} is not in {:?} {what}",
                    gradient[index]
                );
                checks += usize::from(!slope.is_nan());
            }
        }
        checks
    }
}

/// One quarter of the expressions: values and gradients at points of all boxes. Returns how many
/// were compared, and of how many enclosures how many were as tight as the table's rules, to a
/// relative difference of 1e-9.
fn nothing_escapes(quarter: u64) -> (usize, usize, usize) {
    let (mut checks, mut compared, mut tight) = (0, 0, 0);
    for seed in (quarter..EXPRESSIONS).step_by(4) {
        let subject = Subject::new(seed, Kernels::widest());
        let parts = subject.graph.reachable(&subject.roots);
        let random = &mut Random(seed ^ 0x9017);
        for index in 0..BOXES {
            let natural = subject.natural[index];
            let ruled = subject.ruled(&subject.sides(index));
            let what = format!("seed {seed} on {:?}: {ruled:?}", subject.sides(index));
            // A theorem for each operation; for expressions it holds for these seeds.
            assert!(natural.regularity <= ruled.regularity, "{natural:?} {what}");
            let tightened = subject.tightened[index];
            assert_eq!(tightened.regularity, natural.regularity, "{what}");
            let close = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
            compared += 1;
            tight += usize::from(
                close(natural.range.low, ruled.range.low)
                    && close(natural.range.high, ruled.range.high),
            );
            checks += subject.check(index, random, &parts);
        }
    }
    (checks, compared, tight)
}

/// Of one quarter: more than a quarter of a million comparisons, no failure, and enclosures that are
/// as tight as the rules nearly always.
fn check_quarter(quarter: u64) {
    let (checks, compared, tight) = nothing_escapes(quarter);
    assert!(
        checks > 250_000 && tight > compared / 10 * 9,
        "{checks}, {tight} of {compared}"
    );
}

#[test]
fn nothing_escapes_in_quarter_0() {
    check_quarter(0);
}

#[test]
fn nothing_escapes_in_quarter_1() {
    check_quarter(1);
}

#[test]
fn nothing_escapes_in_quarter_2() {
    check_quarter(2);
}

#[test]
fn nothing_escapes_in_quarter_3() {
    check_quarter(3);
}

#[test]
fn a_box_is_enclosed_the_same_alone_in_a_batch_and_by_every_instruction_set() {
    for seed in 0..400 {
        let subject = Subject::new(seed, Kernels::widest());
        for kernels in kernels() {
            let other = Subject::new(seed, kernels);
            let what = format!("seed {seed}, {kernels:?}");
            assert_eq!(other.natural, subject.natural, "{what}");
            assert_eq!(other.tightened, subject.tightened, "{what}");
            assert_eq!(other.gradients, subject.gradients, "{what}");
        }
        let program = program(&subject.graph, &subject.roots[..1], Kernels::widest());
        let q = own(&program, &subject.q);
        let compiled =
            Program::with_tier(&subject.graph, &subject.roots[..1], 3, Tier::MachineCode);
        for index in 0..BOXES {
            let sides = subject.sides(index);
            let mut range = [UNSET.range];
            program.enclose(&sides, &q, &mut range);
            assert_eq!(range[0], subject.natural[index].range, "seed {seed}");
            // Machine code is tighter; it may know that there is no value where blocks do not.
            compiled.enclose(&sides, &q, &mut range);
            let natural = subject.natural[index].range;
            assert_eq!(range[0], range[0].intersection(natural), "seed {seed}");
            let columns = sides.map(|side| [side]);
            let columns = columns.each_ref().map(|column| &column[..]);
            let mut value = [UNSET];
            let mut slopes = [[UNSET.range]; 3];
            let mut outputs = slopes.each_mut().map(|column| &mut column[..]);
            program.enclose_gradient_batch(&columns, &q, &mut value, &mut outputs);
            assert_eq!(value[0], subject.tightened[index], "seed {seed}");
            for (slope, column) in slopes.iter().zip(&subject.gradients) {
                assert_eq!(slope[0], column[index], "seed {seed}");
            }
        }
    }
}

/// How many numbers there are from a to b.
fn distance(a: f64, b: f64) -> u64 {
    let place = |x: f64| {
        let bits = x.to_bits() as i64;
        if bits < 0 { i64::MIN - bits } else { bits }
    };
    place(a).abs_diff(place(b))
}

/// One operation on coordinates; an integer power's exponent is a constant.
fn operation(op: Op, exponent: f64) -> (Graph, NodeId) {
    let mut graph = Graph::new();
    let mut operands: Vec<NodeId> = (0..op.arity()).map(|axis| graph.coordinate(axis)).collect();
    if op == Op::IntegerPower {
        operands[1] = graph.constant(exponent);
    }
    let root = graph.apply(op, &operands);
    (graph, root)
}

/// Every operation alone: wherever the rule's range ends the block tier's does, or at most so
/// many numbers further out: one for arithmetic, where the rule's is the tightest; three for
/// functions, where the rule is one step wider than its correctly rounded end and the vector
/// functions err by one unit more before they move by two. Repeated multiplication moves once for
/// each.
#[test]
fn single_operations_hold_the_rules_and_are_hardly_wider() {
    let ordinary = |end: f64| end == 0.0 || (1e-290..1e290).contains(&end.abs());
    for &op in Op::ALL {
        let steps = match op {
            Op::Add | Op::Subtract | Op::Multiply | Op::Divide | Op::Square | Op::SquareRoot => 1,
            Op::IntegerPower => 16,
            // The remainder of a rounded division, and exponents with integers at their ends.
            Op::Modulo | Op::Power => continue,
            _ => 4,
        };
        let random = &mut Random(op as u64);
        for round in 0..12 {
            let (graph, root) = operation(op, [2.0, 3.0, -1.0, -2.0, 7.0, 8.0][round % 6]);
            let sides = [(); 3].map(|()| (0..200).map(|_| random_side(random)).collect::<Vec<_>>());
            let program = program(&graph, &[root], Kernels::widest());
            let mut found = vec![UNSET; 200];
            program.enclose_batch(&slices(&sides), &[], &mut [&mut found]);
            for (index, found) in found.iter().enumerate() {
                let sides = sides.each_ref().map(|column| column[index]);
                let rule = enclose(&graph, &[root], &sides, |_| 0.0)[0];
                let what = format!("{op:?} on {sides:?}: {found:?} and {rule:?}");
                assert_eq!(found.regularity, rule.regularity, "{what}");
                assert_eq!(found.range.is_empty(), rule.range.is_empty(), "{what}");
                let (range, rule) = (found.range, rule.range);
                assert!(range.low <= rule.low && rule.high <= range.high, "{what}");
                for (end, expected) in [(range.low, rule.low), (range.high, rule.high)] {
                    if ordinary(expected) && !rule.is_empty() {
                        let is_close = distance(end, expected) <= steps || end.abs() <= 1e-320;
                        assert!(is_close, "{what}: {}", distance(end, expected));
                    }
                }
            }
        }
    }
}

/// F and F_x of a root of x and y over one box.
fn slopes(graph: &Graph, root: NodeId, x: Interval, y: Interval) -> (Enclosure, [Interval; 2]) {
    let program = Program::new(graph, &[root], 2);
    let (mut value, mut slopes) = ([UNSET], [[UNSET.range]; 2]);
    let mut outputs = slopes.each_mut().map(|column| &mut column[..]);
    program.enclose_gradient_batch(&[&[x], &[y]], &[], &mut value, &mut outputs);
    (value[0], slopes.map(|[slope]| slope))
}

#[test]
fn the_mean_value_form_shrinks_with_the_square_of_the_width() {
    let mut graph = Graph::new();
    let [x, one] = [graph.coordinate(0), graph.constant(1.0)];
    let rest = graph.apply(Op::Subtract, &[one, x]);
    let root = graph.apply(Op::Multiply, &[x, rest]);
    for exponent in 2..8 {
        let h = 10f64.powi(-exponent);
        let side = Interval::new(0.5 - h, 0.5 + h);
        let (value, slopes) = slopes(&graph, root, side, Interval::point(0.0));
        // x − x² is in [1/4 − h², 1/4] and its slope 1 − 2x in [−2h, 2h], so the form is
        // 1/4 ± 2h², but for rounding; the natural enclosure is 1/4 ± (h + h²).
        let Interval { low, high } = value.range;
        assert!(low <= (0.25 - h * h).next_up() && 0.25 <= high, "{value:?}");
        assert!(high - low <= 4.001 * h * h + 1e-15, "{value:?}");
        // Exact: the ends of the side are close to 1/2.
        let ends = [1.0 - 2.0 * side.low, 1.0 - 2.0 * side.high];
        assert!(ends.iter().all(|&end| slopes[0].contains(end)));
        assert!(slopes[0].high - slopes[0].low <= 4.001 * h + 1e-15);
        assert_eq!(slopes[1], Interval::point(0.0));
    }
}

#[test]
fn gradients_at_kinks_hold_the_gradients_of_both_sides() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let unit = Interval::new(0.0, 1.0);
    let holds = |range: Interval, low: f64, high: f64| range.low <= low && high <= range.high;
    // |x| on boxes across, beside and at the kink; and away from it, where it has none.
    let root = graph.apply(Op::Abs, &[x]);
    for side in [(-1.0, 1.0), (0.0, 1.0), (-1.0, 0.0), (0.0, 0.0)] {
        let side = Interval::new(side.0, side.1);
        let (value, slope) = slopes(&graph, root, side, unit);
        assert!(holds(slope[0], -1.0, 1.0), "{side:?}: {slope:?}");
        assert_eq!(value.regularity, Regularity::Continuous);
    }
    let away = slopes(&graph, root, Interval::new(0.5, 1.0), unit).1;
    assert_eq!(away, [Interval::point(1.0), Interval::point(0.0)]);
    for op in [Op::Min, Op::Max] {
        let root = graph.apply(op, &[x, y]);
        for (x, y) in [
            ((0.0, 1.0), (0.5, 2.0)),
            ((0.0, 1.0), (1.0, 2.0)),
            ((1.0, 2.0), (0.0, 1.0)),
            ((1.0, 1.0), (1.0, 1.0)),
        ] {
            let (x, y) = (Interval::new(x.0, x.1), Interval::new(y.0, y.1));
            let slope = slopes(&graph, root, x, y).1;
            assert!(
                slope.iter().all(|slope| holds(*slope, 0.0, 1.0)),
                "{slope:?}"
            );
        }
        let apart = slopes(&graph, root, unit, Interval::new(2.0, 3.0)).1;
        let first = f64::from(u8::from(op == Op::Min));
        assert_eq!(apart, [first, 1.0 - first].map(Interval::point));
    }
    // A cone's gradients are all directions.
    let root = graph.apply(Op::Hypot, &[x, y]);
    let around = Interval::new(-1.0, 1.0);
    let slope = slopes(&graph, root, around, around).1;
    assert_eq!(slope, [around; 2]);
}

#[test]
fn a_jump_is_not_bridged_by_the_mean_value_form() {
    let mut graph = Graph::new();
    let [x, ten, zero] = [
        graph.coordinate(0),
        graph.constant(10.0),
        graph.constant(0.0),
    ];
    let is_negative = graph.apply(Op::Less, &[x, zero]);
    let shifted = graph.apply(Op::Add, &[x, ten]);
    let root = graph.apply(Op::Select, &[is_negative, x, shifted]);
    let side = Interval::new(-0.1, 0.1);
    let (value, _) = slopes(&graph, root, side, side);
    assert_eq!(value.regularity, Regularity::Defined);
    assert!(value.range.contains(-0.1) && value.range.contains(10.1));
}

#[test]
fn unbounded_empty_and_undefined_operands_give_what_is_left() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let q = graph.parameter(0);
    let sum = graph.apply(Op::Add, &[x, y]);
    let product = graph.apply(Op::Multiply, &[x, y]);
    let scaled = graph.apply(Op::Multiply, &[x, q]);
    let root_of_x = graph.apply(Op::SquareRoot, &[x]);
    let least = graph.apply(Op::Min, &[root_of_x, y]);
    let roots = [sum, product, scaled, root_of_x, least];
    let program = Program::new(&graph, &roots, 2);
    let enclose = |x: Interval, y: Interval, q: f64| {
        let mut found = [[UNSET]; 5];
        let mut outputs = found.each_mut().map(|column| &mut column[..]);
        program.enclose_batch(&[&[x], &[y]], &[q], &mut outputs);
        found.map(|[enclosure]| enclosure)
    };
    let [sum, product, scaled, root, least] = enclose(Interval::ENTIRE, Interval::point(0.0), 2.0);
    assert_eq!(sum.range, Interval::ENTIRE);
    // Zero times any number is 0, but for the step that tells underflow.
    assert!(product.range.contains(0.0) && product.range.high < 1e-320);
    assert!(product.range.low > -1e-320 && product.regularity == Regularity::Continuous);
    assert_eq!(scaled.range, Interval::ENTIRE);
    assert_eq!(root.range, Interval::new(0.0, f64::INFINITY));
    assert_eq!(root.regularity, Regularity::Partial);
    assert_eq!(least.range, Interval::new(0.0, 0.0));
    // Nothing of an empty side, and nothing of a parameter that is NaN.
    let empty = enclose(Interval::EMPTY, Interval::point(1.0), 2.0);
    assert!(empty.iter().all(|found| found.range.is_empty()));
    assert!(
        empty
            .iter()
            .all(|found| found.regularity == Regularity::Partial)
    );
    let undefined = enclose(Interval::new(1.0, 2.0), Interval::point(1.0), f64::NAN);
    assert!(undefined[2].range.is_empty() && !undefined[0].range.is_empty());
    let negative = enclose(Interval::new(-2.0, -1.0), Interval::point(1.0), 1.0);
    assert!(negative[3].range.is_empty() && negative[4].range.is_empty());
    // A sum that overflows is some large number, and differences of such are not empty.
    let huge = Interval::point(f64::MAX);
    let [sum, product, ..] = enclose(huge, huge, 1.0);
    assert!(sum.range.contains(f64::MAX) && sum.range.high == f64::INFINITY);
    assert!(product.range.contains(f64::MAX) && product.range.high == f64::INFINITY);
}

#[test]
fn columns_that_are_missing_or_short_count_as_empty() {
    let mut graph = Graph::new();
    let [x, y] = [0, 1].map(|axis| graph.coordinate(axis));
    let root = graph.apply(Op::Add, &[x, y]);
    let program = Program::new(&graph, &[root], 2);
    let side = Interval::new(0.0, 1.0);
    let mut values = [UNSET; 3];
    program.enclose_batch(&[&[side; 3]], &[], &mut [&mut values]);
    assert_eq!(values, [UNSET; 3]);
    program.enclose_batch(&[&[side; 3], &[side; 2]], &[], &mut [&mut values]);
    assert!(values[1].range.contains(2.0) && values[2] == UNSET);
    let (mut first, mut second) = ([UNSET.range; 3], [UNSET.range; 1]);
    let mut values = [UNSET; 3];
    let outputs = &mut [&mut first[..], &mut second[..]];
    program.enclose_gradient_batch(&[&[side; 3], &[side; 3]], &[], &mut values, outputs);
    assert!(values[0].range.contains(2.0) && values[1] == UNSET);
    assert_eq!((first[0], first[1]), (Interval::point(1.0), UNSET.range));
    // A missing side has no value, nor has what depends on it.
    let mut range = [side];
    program.enclose(&[side], &[], &mut range);
    assert!(range[0].is_empty());
}

#[test]
fn large_fields_and_long_batches_agree_with_the_rules() {
    for example in [fields::torus(), fields::blobs(14), fields::spheres(100)] {
        let random = &mut Random(11);
        let sides = [(); 3].map(|()| {
            let side = |_| {
                let a = random.uniform(-1.0, 1.0);
                Interval::new(a, a + random.uniform(0.0, 0.3))
            };
            (0..201).map(side).collect::<Vec<_>>()
        });
        let program = Program::new(&example.graph, &[example.root], 3);
        let mut found = vec![UNSET; 201];
        program.enclose_batch(&slices(&sides), &example.q, &mut [&mut found]);
        for (index, found) in found.iter().enumerate() {
            let sides = sides.each_ref().map(|column| column[index]);
            let q = |place: u32| example.q[place as usize];
            let rule = enclose(&example.graph, &[example.root], &sides, q)[0];
            assert_eq!(found.regularity, rule.regularity, "{}", example.name);
            let (low, high) = (rule.range.low, rule.range.high);
            let slack = 1e-13 * (1.0 + low.abs().max(high.abs()));
            assert!(found.range.low <= low && high <= found.range.high);
            assert!(low - slack <= found.range.low && found.range.high <= high + slack);
        }
    }
}
