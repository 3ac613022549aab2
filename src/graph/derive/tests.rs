//! Tests of derivatives: the rules at delicate points one by one, closed forms, differences.

use proptest::prelude::*;

use super::{forward, hessian, reverse, tangents};
use crate::graph::test_support::{cases, evaluate, expression, same};
use crate::graph::{Graph, Node, NodeId, Op};

/// The value and the derivatives in x, y, z at a point; all sweeps must agree.
fn gradient(text: &str, point: &[f64]) -> (f64, Vec<f64>) {
    let mut graph = Graph::new();
    let root = expression(&mut graph, text);
    let variables: Vec<NodeId> = (0..point.len())
        .map(|axis| graph.coordinate(axis))
        .collect();
    let adjoints = reverse(&mut graph, root, &variables);
    let mut derivatives = Vec::new();
    let (together, roots) = tangents(&graph, root, point.len());
    let value = evaluate(&graph, root, point, &[]);
    assert!(same(evaluate(&together, roots[0], point, &[]), value));
    for (axis, (&adjoint, &variable)) in adjoints.iter().zip(&variables).enumerate() {
        let of_axis = evaluate(&together, roots[axis + 1], point, &[]);
        let tangent = forward(&mut graph, &[root], variable)[0];
        let [adjoint, tangent] = [adjoint, tangent].map(|d| evaluate(&graph, d, point, &[]));
        assert!(
            adjoint == tangent || same(adjoint, tangent),
            "{text}: {adjoint} {tangent}"
        );
        assert!(
            tangent == of_axis || same(tangent, of_axis),
            "{text}: {tangent} {of_axis}"
        );
        derivatives.push(adjoint);
    }
    (evaluate(&graph, root, point, &[]), derivatives)
}

fn derivative(text: &str, x: f64) -> f64 {
    gradient(text, &[x]).1[0]
}

#[test]
fn rule_1_abs_is_flat_at_0_and_ties_go_to_the_first_operand() {
    assert_eq!(derivative("abs x", 0.0), 0.0);
    assert_eq!(derivative("abs x", -0.0), 0.0);
    assert_eq!(derivative("abs x", -2.0), -1.0);
    for op in ["min", "max"] {
        assert_eq!(derivative(&format!("{op} x negate x"), 0.0), 1.0);
        assert_eq!(derivative(&format!("{op} negate x x"), 0.0), -1.0);
        assert_eq!(gradient(&format!("{op} x y"), &[2.0, 2.0]).1, [1.0, 0.0]);
    }
    assert_eq!(gradient("min x y", &[2.0, 1.0]).1, [0.0, 1.0]);
    assert_eq!(gradient("max x y", &[2.0, 1.0]).1, [1.0, 0.0]);
    for step in [
        "sign x",
        "floor x",
        "ceil x",
        "round x",
        "less x 1",
        "equal x 1",
    ] {
        assert_eq!(derivative(step, 1.0), 0.0, "{step}");
    }
}

#[test]
fn rule_2_nan_in_is_nan_out_in_every_dependent_derivative() {
    for &op in Op::ALL {
        let chooses = [Op::Select, Op::Less, Op::LessEqual, Op::Equal, Op::IsNumber];
        if chooses.contains(&op) {
            continue;
        }
        for place in 0..op.arity() {
            let mut point = [0.5, 0.5, 0.5];
            point[place] = f64::NAN;
            let coordinates = ["x", "y", "z"];
            let text = match op {
                Op::IntegerPower => "integer_power x 3".to_string(),
                _ => format!("{} {}", op.name(), coordinates[..op.arity()].join(" ")),
            };
            if op == Op::IntegerPower && place == 1 {
                continue;
            }
            let arity = if op == Op::IntegerPower {
                1
            } else {
                op.arity()
            };
            let (value, gradient) = gradient(&text, &point[..arity]);
            assert!(value.is_nan(), "{text}");
            assert!(
                gradient.iter().all(|entry| entry.is_nan()),
                "{text}: {gradient:?}"
            );
        }
    }
    // What a root does not depend on has derivative 0 all the same.
    assert_eq!(gradient("log x", &[-1.0, 1.0]).1[1], 0.0);
}

#[test]
fn rule_3_a_domain_error_makes_value_and_derivative_nan_together() {
    for (text, x) in [
        ("log x", -1.0),
        ("sqrt x", -1.0),
        ("asin x", 2.0),
        ("acos x", -2.0),
        ("power x 0.5", -1.0),
        ("divide x sin x", 0.0),
        ("mod 1 x", 0.0),
        ("sign log x", -1.0),
        ("add multiply 2 x sqrt x", -1.0),
    ] {
        let (value, derivative) = gradient(text, &[x]);
        assert!(value.is_nan() && derivative[0].is_nan(), "{text}");
    }
}

#[test]
fn rule_4_an_exact_zero_absorbs_infinity_and_nan() {
    let norm = "sqrt add square x add square y square z";
    assert_eq!(gradient(norm, &[0.0, 0.0, 0.0]), (0.0, vec![0.0; 3]));
    assert_eq!(gradient("hypot x y", &[0.0, 0.0]), (0.0, vec![0.0; 2]));
    assert_eq!(derivative("multiply square x sqrt x", 0.0), 0.0);
    assert_eq!(derivative("sqrt x", 0.0), f64::INFINITY);
    // cos(3 atan2(y, x)) is flat where the angle is 0, though the angle's slope is 0/0.
    assert_eq!(
        gradient("cos multiply 3 atan2 y x", &[0.0, 0.0]).1,
        [0.0, 0.0]
    );
}

#[test]
fn rule_5_the_branch_not_taken_contributes_nothing() {
    assert_eq!(derivative("select less x 0 square x sqrt x", -2.0), -4.0);
    assert_eq!(derivative("select less x 0 log x square x", 3.0), 6.0);
    assert_eq!(derivative("select less 0 x sqrt x 1", 0.0), 0.0);
    assert_eq!(derivative("select NaN multiply 3 x square x", 5.0), 3.0);
    let (value, gradient) = gradient("select less x 1 multiply 2 x y", &[0.5, f64::NAN]);
    assert_eq!((value, gradient), (1.0, vec![2.0, 0.0]));
}

#[test]
fn rule_6_powers() {
    assert_eq!(gradient("power x 3", &[-2.0]), (-8.0, vec![12.0]));
    assert_eq!(gradient("power x 0", &[0.0]), (1.0, vec![0.0]));
    assert_eq!(gradient("power x y", &[0.0, 0.0]).0, 1.0);
    assert_eq!(gradient("power x y", &[-2.0, 3.0]).1[0], 12.0);
    assert_eq!(gradient("power x 1.5", &[0.0]), (0.0, vec![0.0]));
    assert_eq!(gradient("power x y", &[0.0, 2.0]), (0.0, vec![0.0, 0.0]));
    for text in ["power x -1", "power x -2", "power x -0.5", "power x -3.5"] {
        let (value, derivative) = gradient(text, &[0.0]);
        assert!(value == f64::INFINITY && derivative[0].is_nan(), "{text}");
    }
    let (value, slopes) = gradient("power x y", &[0.0, -2.0]);
    assert!(value == f64::INFINITY && slopes[0].is_nan());
    assert!(gradient("power x 0.5", &[-4.0]).0.is_nan());
    assert_eq!(derivative("power x -2", 2.0), -0.25);
}

#[test]
fn rule_7_derivatives_do_not_fold_what_may_be_infinite() {
    // 0·u has derivative 0 where u is finite, and is NaN with its derivative elsewhere.
    assert_eq!(derivative("multiply 0 exp x", 1.0), 0.0);
    assert!(derivative("multiply 0 exp x", 1000.0).is_nan());
    assert!(derivative("subtract exp x exp x", 1000.0).is_nan());
    assert!(derivative("divide x x", 0.0).is_nan());
}

/// What each operation is checked at, and its derivative in closed form there.
type ClosedForm = (&'static str, [f64; 2], fn(f64, f64) -> [f64; 2]);

const CLOSED_FORMS: &[ClosedForm] = &[
    ("add x y", [1.5, 2.5], |_, _| [1.0, 1.0]),
    ("subtract x y", [1.5, 2.5], |_, _| [1.0, -1.0]),
    ("multiply x y", [1.5, 2.5], |x, y| [y, x]),
    ("divide x y", [1.5, 2.5], |x, y| [1.0 / y, -x / (y * y)]),
    ("negate x", [1.5, 0.0], |_, _| [-1.0, 0.0]),
    ("square x", [1.7, 0.0], |x, _| [2.0 * x, 0.0]),
    ("power x y", [1.7, 2.3], |x, y| {
        [y * x.powf(y - 1.0), x.powf(y) * x.ln()]
    }),
    ("integer_power x 7", [-1.3, 0.0], |x, _| {
        [7.0 * x.powi(6), 0.0]
    }),
    ("integer_power x -3", [-1.3, 0.0], |x, _| {
        [-3.0 * x.powi(-4), 0.0]
    }),
    ("sqrt x", [2.7, 0.0], |x, _| [0.5 / x.sqrt(), 0.0]),
    ("exp x", [1.3, 0.0], |x, _| [x.exp(), 0.0]),
    ("log x", [2.7, 0.0], |x, _| [1.0 / x, 0.0]),
    ("sin x", [0.7, 0.0], |x, _| [x.cos(), 0.0]),
    ("cos x", [0.7, 0.0], |x, _| [-x.sin(), 0.0]),
    ("tan x", [0.7, 0.0], |x, _| [x.cos().powi(-2), 0.0]),
    ("asin x", [0.999_999, 0.0], |x, _| {
        [1.0 / ((1.0 - x) * (1.0 + x)).sqrt(), 0.0]
    }),
    ("acos x", [-0.3, 0.0], |x, _| {
        [-1.0 / (1.0 - x * x).sqrt(), 0.0]
    }),
    ("atan x", [3.3, 0.0], |x, _| [1.0 / (1.0 + x * x), 0.0]),
    ("atan2 x y", [1.1, -2.2], |x, y| {
        [y / (x * x + y * y), -x / (x * x + y * y)]
    }),
    ("sinh x", [1.3, 0.0], |x, _| [x.cosh(), 0.0]),
    ("cosh x", [1.3, 0.0], |x, _| [x.sinh(), 0.0]),
    ("tanh x", [15.0, 0.0], |x, _| [x.cosh().powi(-2), 0.0]),
    ("abs x", [-1.5, 0.0], |_, _| [-1.0, 0.0]),
    ("mod x y", [7.5, 2.0], |_, _| [1.0, -3.0]),
    ("mod x y", [-7.5, 2.0], |_, _| [1.0, 4.0]),
    ("min x y", [1.0, 2.0], |_, _| [1.0, 0.0]),
    ("max x y", [1.0, 2.0], |_, _| [0.0, 1.0]),
    ("hypot x y", [3.0, -4.0], |_, _| [0.6, -0.8]),
    ("select less x y x y", [3.0, -4.0], |_, _| [0.0, 1.0]),
    ("chain_product x y", [3.0, -4.0], |x, y| [y, x]),
];

#[test]
fn every_operation_has_the_derivative_of_its_closed_form() {
    for &(text, [x, y], expected) in CLOSED_FORMS {
        let (_, derivatives) = gradient(text, &[x, y]);
        for (derivative, expected) in derivatives.into_iter().zip(expected(x, y)) {
            // Both sides round a handful of times.
            let tolerance = 8.0 * f64::EPSILON * expected.abs();
            assert!(
                (derivative - expected).abs() <= tolerance,
                "{text}: {derivative} {expected}"
            );
        }
    }
    let steps = [
        Op::Sign,
        Op::Floor,
        Op::Ceil,
        Op::Round,
        Op::Less,
        Op::LessEqual,
        Op::Equal,
    ];
    for &op in Op::ALL {
        let is_covered = CLOSED_FORMS
            .iter()
            .any(|form| form.0.starts_with(op.name()));
        assert!(
            is_covered || steps.contains(&op) || op == Op::IsNumber,
            "{op:?}"
        );
    }
}

#[test]
fn derivatives_nest_three_deep() {
    // (e^2x sin x)‴ = e^2x (2 sin x + 11 cos x), since (2 + i)³ = 2 + 11i.
    let third_derivative = |text: &str, at: f64| {
        let mut graph = Graph::new();
        let root = expression(&mut graph, text);
        let x = graph.coordinate(0);
        let first = reverse(&mut graph, root, &[x])[0];
        let second = forward(&mut graph, &[first], x)[0];
        let third = reverse(&mut graph, second, &[x])[0];
        evaluate(&graph, third, &[at], &[])
    };
    let x: f64 = 0.7;
    for (text, expected) in [
        (
            "multiply exp multiply 2 x sin x",
            (2.0 * x).exp() * (2.0 * x.sin() + 11.0 * x.cos()),
        ),
        ("power x 5", 60.0 * x * x),
        ("divide 1 x", -6.0 / x.powi(4)),
        ("log x", 2.0 / x.powi(3)),
        ("power x 2.5", 1.875 / x.sqrt()),
        ("multiply x abs x", 0.0),
    ] {
        let third = third_derivative(text, x);
        assert!(
            (third - expected).abs() <= 1e-14 * expected.abs(),
            "{text}: {third} {expected}"
        );
    }
    assert!(third_derivative("log x", -1.0).is_nan());
}

#[test]
fn hessians_are_symmetric_and_right() {
    let mut graph = Graph::new();
    let root = expression(&mut graph, "add multiply square x y exp multiply x z");
    let variables: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    let matrix = hessian(&mut graph, root, &variables);
    let (x, y, z): (f64, f64, f64) = (0.3, -1.2, 0.8);
    let e = (x * z).exp();
    let expected = [
        [2.0 * y + z * z * e, 2.0 * x, e + x * z * e],
        [2.0 * x, 0.0, 0.0],
        [e + x * z * e, 0.0, x * x * e],
    ];
    for row in 0..3 {
        for column in 0..3 {
            assert_eq!(matrix[row][column], matrix[column][row]);
            let entry = evaluate(&graph, matrix[row][column], &[x, y, z], &[]);
            assert!(
                (entry - expected[row][column]).abs() < 1e-15,
                "{row} {column}"
            );
        }
    }
    assert!(evaluate(&graph, matrix[1][1], &[f64::NAN, 0.0, 0.0], &[]).is_nan());
}

#[test]
fn any_node_can_be_a_variable() {
    let mut graph = Graph::new();
    let inner = expression(&mut graph, "exp x");
    let root = expression(&mut graph, "add square exp x x");
    let x = graph.coordinate(0);
    let adjoints = reverse(&mut graph, root, &[inner, x, root]);
    let tangent = forward(&mut graph, &[root], inner)[0];
    let e = core_math::exp(0.5);
    let values: Vec<f64> = adjoints
        .iter()
        .map(|&d| evaluate(&graph, d, &[0.5], &[]))
        .collect();
    assert_eq!(values[0], 2.0 * e);
    assert_eq!(values[2], 1.0);
    assert_eq!(evaluate(&graph, tangent, &[0.5], &[]), 2.0 * e);
    assert!((values[1] - (2.0 * e * e + 1.0)).abs() < 1e-15 * values[1]);
}

/// b − Σ exp(−|p − c|²/s²) over 14 centres: 1 + 14·4 = 57 parameters.
fn blobs(graph: &mut Graph) -> NodeId {
    let gaussians: Vec<String> = (0..14)
        .map(|i| {
            let [a, b, c, s] = [1, 2, 3, 4].map(|k| format!("q{}", 4 * i + k));
            let squares = format!(
                "add add square subtract x {a} square subtract y {b} square subtract z {c}"
            );
            format!("exp divide negate {squares} square {s}")
        })
        .collect();
    let sum = gaussians
        .into_iter()
        .reduce(|sum, term| format!("add {sum} {term}"));
    expression(graph, &format!("subtract q0 {}", sum.unwrap()))
}

#[test]
fn value_and_all_derivatives_cost_a_few_times_the_value() {
    let mut graph = Graph::new();
    let root = blobs(&mut graph);
    let mut variables: Vec<NodeId> = (0..3).map(|axis| graph.coordinate(axis)).collect();
    variables.extend((0..57).map(|index| graph.parameter(index)));
    let operations = |graph: &Graph, roots: &[NodeId]| {
        let nodes = graph.reachable(roots);
        nodes
            .iter()
            .filter(|&&id| matches!(graph.node(id), Node::Apply(..)))
            .count()
    };
    let value = operations(&graph, &[root]);
    let mut roots = reverse(&mut graph, root, &variables);
    roots.push(root);
    let all = operations(&graph, &roots);
    assert_eq!(value, 14 * 13);
    assert!(all < 4 * value, "{all} operations for {value}");
}

/// Operations that a random expression is made of, by name and how their operands are tamed so
/// that values stay moderate.
const STEPS: [&str; 24] = [
    "add A B",
    "subtract A B",
    "multiply A B",
    "divide A add 2 square B",
    "negate A",
    "square A",
    "power add 1 square A tanh B",
    "integer_power A 3",
    "integer_power add 2 square A -2",
    "sqrt add 1 square A",
    "exp tanh A",
    "log add 1 square A",
    "sin A",
    "cos A",
    "tan tanh A",
    "asin multiply 0.9 tanh A",
    "acos multiply 0.9 tanh A",
    "atan A",
    "atan2 A add 1 square B",
    "sinh tanh A",
    "cosh tanh A",
    "min A B",
    "max A B",
    "select less A B multiply 2 A B",
];

/// The expression that the steps build, each from two of the earlier ones.
fn random_expression(graph: &mut Graph, steps: &[(usize, u8, u8)]) -> NodeId {
    let mut texts = vec!["x".to_string(), "y".to_string(), "q0".to_string()];
    for &(step, a, b) in steps {
        let operand = |place: u8| &texts[texts.len() - 1 - usize::from(place) % texts.len().min(4)];
        let words = STEPS[step].split(' ').map(|word| match word {
            "A" => operand(a).as_str(),
            "B" => operand(b).as_str(),
            word => word,
        });
        let text = words.collect::<Vec<_>>().join(" ");
        texts.push(text);
    }
    expression(graph, &texts[texts.len() - 1])
}

/// dF/dx by central differences, extrapolated to step 0 (Richardson), and an estimate of its error.
fn difference(function: impl Fn(f64) -> f64, x: f64) -> (f64, f64) {
    let central = |h: f64| (function(x + h) - function(x - h)) / (2.0 * h);
    let [a, b, c] = [4e-3, 2e-3, 1e-3].map(central);
    let [ab, bc] = [(4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0];
    let extrapolated = (16.0 * bc - ab) / 15.0;
    (extrapolated, (extrapolated - bc).abs())
}

#[test]
fn derivatives_of_random_expressions_agree_with_differences_and_with_each_other() {
    let checked = std::cell::Cell::new(0);
    let steps = prop::collection::vec((0..STEPS.len(), any::<u8>(), any::<u8>()), 1..9);
    let points = prop::collection::vec(-2.0..2.0, 3);
    let mut runner = proptest::test_runner::TestRunner::new(cases(1000));
    let result = runner.run(&(steps, points), |(steps, point)| {
        let mut graph = Graph::new();
        let root = random_expression(&mut graph, &steps);
        let variables = [graph.coordinate(0), graph.coordinate(1), graph.parameter(0)];
        let adjoints = reverse(&mut graph, root, &variables);
        for (place, &variable) in variables.iter().enumerate() {
            let tangent = forward(&mut graph, &[root], variable)[0];
            let at = |node: NodeId, value: f64| {
                let mut point = point.clone();
                point[place] = value;
                evaluate(&graph, node, &point, &point[2..])
            };
            let [adjoint, tangent] = [adjoints[place], tangent].map(|d| at(d, point[place]));
            let scale = adjoint.abs().max(at(root, point[place]).abs()).max(1.0);
            prop_assert!(
                (adjoint - tangent).abs() <= 1e-12 * scale,
                "{adjoint} {tangent}"
            );
            let (expected, error) = difference(|value| at(root, value), point[place]);
            if error <= 1e-9 * scale {
                prop_assert!(
                    (adjoint - expected).abs() <= 1e-7 * scale,
                    "{adjoint} {expected}"
                );
                checked.set(checked.get() + 1);
            }
        }
        Ok(())
    });
    result.unwrap();
    let checked = checked.get();
    assert!(
        checked > 2000,
        "only {checked} of 3000 differences were good enough to check"
    );
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn forward_and_reverse_take_the_same_side_at_kinks(
        steps in prop::collection::vec((0..8usize, any::<u8>(), any::<u8>()), 1..10),
        point in prop::array::uniform2(-1i32..=1),
    ) {
        const KINKED: [&str; 8] =
            ["min", "max", "abs", "add", "subtract", "multiply", "select", "sign"];
        let mut graph = Graph::new();
        let variables = [graph.coordinate(0), graph.coordinate(1)];
        let mut nodes = variables.to_vec();
        for (step, a, b) in steps {
            let [a, b] = [a, b].map(|place| nodes[usize::from(place) % nodes.len()]);
            let op = Op::ALL.iter().find(|op| op.name() == KINKED[step]).copied();
            let op = op.unwrap_or(Op::Add);
            nodes.push(graph.apply(op, &[a, b, a][..op.arity()]));
        }
        let root = nodes[nodes.len() - 1];
        let point = point.map(f64::from);
        let adjoints = reverse(&mut graph, root, &variables);
        for (variable, adjoint) in variables.into_iter().zip(adjoints) {
            let tangent = forward(&mut graph, &[root], variable)[0];
            let [adjoint, tangent] = [adjoint, tangent].map(|d| evaluate(&graph, d, &point, &[]));
            // All values are integers, so nothing rounds.
            prop_assert!(adjoint == tangent, "{adjoint} {tangent}");
        }
    }
}
