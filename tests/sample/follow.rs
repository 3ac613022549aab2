//! Floaters on surfaces that move: they stay on them, evenly spread, and no more are born than area
//! is.

use std::sync::Arc;

use imp::engine::{CompiledField, Field, Program, Silent};
use imp::geometry::{Bounds, nearest_distances};
use imp::graph::{Graph, NodeId, Op};
use imp::sample::{Followed, Followers, Options};

/// A program over coordinates and so many parameters.
fn program(
    dimension: usize,
    parameters: usize,
    make: impl FnOnce(&mut Graph, [NodeId; 3], &[NodeId]) -> NodeId,
) -> Arc<Program> {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let parameters: Vec<NodeId> = (0..parameters)
        .map(|index| graph.parameter(index))
        .collect();
    let root = make(&mut graph, coordinates, &parameters);
    Arc::new(Program::new(&graph, &[root], dimension))
}

fn sum(graph: &mut Graph, terms: &[NodeId]) -> NodeId {
    let first = terms[0];
    let rest = terms[1..].iter();
    rest.fold(first, |sum, &term| graph.apply(Op::Add, &[sum, term]))
}

/// Σ ((x_i - c_i) / r_i)² − 1; the parameters are c and r.
fn ellipsoid(dimension: usize) -> Arc<Program> {
    program(dimension, 2 * dimension, |graph, coordinates, q| {
        let mut terms = vec![graph.constant(-1.0)];
        for axis in 0..dimension {
            let off = graph.apply(Op::Subtract, &[coordinates[axis], q[axis]]);
            let part = graph.apply(Op::Divide, &[off, q[dimension + axis]]);
            terms.push(graph.apply(Op::Multiply, &[part, part]));
        }
        sum(graph, &terms)
    })
}

/// 0.5 − Σ exp(−|x − c|²) over two centres on the x-axis; the parameters are their places.
fn two_blobs() -> Arc<Program> {
    program(3, 2, |graph, [x, y, z], q| {
        let half = graph.constant(0.5);
        let blobs = [q[0], q[1]].map(|center| {
            let off = graph.apply(Op::Subtract, &[x, center]);
            let squares = [off, y, z].map(|side| graph.apply(Op::Multiply, &[side, side]));
            let square = sum(graph, &squares);
            let exponent = graph.apply(Op::Negate, &[square]);
            graph.apply(Op::Exp, &[exponent])
        });
        let blobs = sum(graph, &blobs);
        graph.apply(Op::Subtract, &[half, blobs])
    })
}

fn followers(program: &Arc<Program>, q: &[f64], half: f64, count: u64) -> Followers {
    let field = CompiledField::new(Arc::clone(program), q.to_vec());
    let options = Options {
        count: Some(count),
        bounds: Bounds::from_sides(&vec![(-half, half); field.dimension()]),
        ..Options::default()
    };
    let (followers, statistics) = Followers::new(&field, &options, false, &Silent).unwrap();
    assert!(statistics.converged);
    followers
}

/// Goes to each q in turn; every floater is on the surface after each step.
fn go(
    followers: &mut Followers,
    program: &Arc<Program>,
    path: impl Iterator<Item = Vec<f64>>,
) -> Vec<Followed> {
    let path: Vec<Vec<f64>> = path.collect();
    path.windows(2)
        .map(|pair| {
            let followed = followers
                .follow(program, [&pair[0], &pair[1]], &Silent)
                .unwrap();
            let field = CompiledField::new(Arc::clone(program), pair[1].clone());
            let samples = followers.samples();
            for &position in &samples.positions {
                let (value, gradient) = field.value_gradient(position);
                assert!(value.abs() <= followers.tolerance() * gradient.length());
            }
            followed
        })
        .collect()
}

/// Least and mean distance of nearest neighbours, in units of the ideal spacing on an area.
fn evenness(followers: &Followers, area: f64) -> (f64, f64) {
    let positions = followers.samples().positions;
    let ideal = (area / (0.75_f64.sqrt() * positions.len() as f64)).sqrt();
    let distances = nearest_distances(&positions);
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    let least = distances.into_iter().fold(f64::INFINITY, f64::min);
    (least / ideal, mean / ideal)
}

/// 4 π, and the area of the spheroid of half axes 10, 1, 1: 2 π (1 + 10 asin(e) / e), e² = 0.99.
const SPHERE: f64 = 4.0 * std::f64::consts::PI;
const SPHEROID: f64 = 99.144_4;

fn total(steps: &[Followed], count: impl Fn(&Followed) -> u64) -> u64 {
    steps.iter().map(count).sum()
}

/// A body that is moved takes its floaters along: nobody is born at its front or dies at its back, and
/// the pattern stays as even as that of a body at rest.
#[test]
fn a_moving_body_takes_its_floaters_along() {
    let program = ellipsoid(3);
    let at = |place: f64| vec![place, 0.5 * place, 0.0, 1.0, 1.0, 1.0];
    let mut floaters = followers(&program, &at(0.0), 1.5, 1000);
    let path = (0..=40).map(|step| at(0.1 * f64::from(step)));
    let steps = go(&mut floaters, &program, path);
    assert_eq!(
        total(&steps, |step| step.births + step.deaths + step.lost),
        0
    );
    let (least, mean) = evenness(&floaters, SPHERE);
    assert!(least > 0.8 && mean > 0.92, "{least} {mean}");
    // In the plane, too.
    let program = ellipsoid(2);
    let mut floaters = followers(&program, &[0.0, 0.0, 1.0, 1.0], 1.5, 100);
    let path = (0..=40).map(|step| vec![0.1 * f64::from(step), 0.0, 1.0, 1.0]);
    let steps = go(&mut floaters, &program, path);
    assert_eq!(
        total(&steps, |step| step.births + step.deaths + step.lost),
        0
    );
}

/// Stretched to ten times its length in 30 steps, as in figure 1 of Witkin and Heckbert, a sphere has
/// eight times its area. Radii may be a little larger than before when nobody splits any more, so
/// there may be a quarter less than eight times the floaters; 20 steps later they are evenly spread.
#[test]
fn a_stretched_body_is_covered_soon() {
    let program = ellipsoid(3);
    let stretched = |length: f64| vec![0.0, 0.0, 0.0, length, 1.0, 1.0];
    let mut floaters = followers(&program, &stretched(1.0), 1.5, 400);
    let path = (0..=30).map(|step| stretched(1.0 + 0.3 * f64::from(step)));
    let steps = go(&mut floaters, &program, path);
    assert_eq!(total(&steps, |step| step.lost), 0);
    let at_rest = std::iter::repeat_n(stretched(10.0), 21);
    go(&mut floaters, &program, at_rest);
    let grown = floaters.len() as f64 / 400.0 / (SPHEROID / SPHERE);
    assert!((0.75..1.1).contains(&grown), "{grown}");
    let (least, mean) = evenness(&floaters, SPHEROID);
    assert!(least > 0.5 && mean > 0.85, "{least} {mean}");
    // And back again: the crowd dies.
    let path = (0..=30).map(|step| stretched(10.0 - 0.3 * f64::from(step)));
    go(&mut floaters, &program, path);
    go(
        &mut floaters,
        &program,
        std::iter::repeat_n(stretched(1.0), 41),
    );
    let number = floaters.len();
    assert!((360..840).contains(&number), "{number}");
}

/// One blob becomes two and one again; each has half of the floaters, the radius being √ln 2 when they
/// are far apart.
#[test]
fn a_body_that_splits_and_merges_is_followed() {
    let program = two_blobs();
    let apart = |distance: f64| vec![-distance, distance];
    let mut floaters = followers(&program, &apart(0.0), 3.0, 1000);
    let path = (0..=60).map(|step| apart(0.05 * f64::from(step)));
    go(&mut floaters, &program, path);
    let positions = floaters.samples().positions;
    let left = positions.iter().filter(|p| p.x < 0.0).count() as f64;
    let share = left / positions.len() as f64;
    assert!((share - 0.5).abs() < 0.03, "{share}");
    let (least, mean) = evenness(&floaters, 2.0 * SPHERE * 2_f64.ln());
    assert!(least > 0.5 && mean > 0.85, "{least} {mean}");
    let path = (0..=60).rev().map(|step| apart(0.05 * f64::from(step)));
    go(&mut floaters, &program, path);
    go(&mut floaters, &program, std::iter::repeat_n(apart(0.0), 41));
    let number = floaters.len();
    assert!((700..2100).contains(&number), "{number}");
}

/// No floater is left of a surface that vanishes; when it is there again it has to be searched.
#[test]
fn a_surface_that_vanishes_is_found_again() {
    let program = program(3, 1, |graph, coordinates, q| {
        let squares = coordinates.map(|side| graph.apply(Op::Multiply, &[side, side]));
        let square = sum(graph, &squares);
        graph.apply(Op::Subtract, &[square, q[0]])
    });
    let mut floaters = followers(&program, &[1.0], 1.5, 200);
    go(&mut floaters, &program, [vec![1.0], vec![-1.0]].into_iter());
    assert!(floaters.is_empty());
    go(&mut floaters, &program, [vec![-1.0], vec![1.0]].into_iter());
    assert!(floaters.is_empty());
    let field = CompiledField::new(Arc::clone(&program), vec![1.0]);
    floaters.search(&field, &Silent).unwrap();
    assert!((180..220).contains(&floaters.len()));
}

/// Far too large a step is made in parts, and said to be rough.
#[test]
fn a_leap_is_told() {
    let program = ellipsoid(2);
    let mut floaters = followers(&program, &[0.0, 0.0, 1.0, 1.0], 1.5, 100);
    let steps = go(
        &mut floaters,
        &program,
        [vec![0.0, 0.0, 1.0, 1.0], vec![1e6, 0.0, 1.0, 1.0]].into_iter(),
    );
    assert!(steps[0].rough && steps[0].lost > 0);
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let runs = [1, 2, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let program = two_blobs();
            let mut floaters = followers(&program, &[0.0, 0.0], 3.0, 500);
            let path = (0..=20).map(|step| vec![-0.1 * f64::from(step), 0.1 * f64::from(step)]);
            go(&mut floaters, &program, path);
            floaters.samples()
        })
    });
    assert_eq!(runs[0], runs[1]);
    assert_eq!(runs[0], runs[2]);
}
