//! Surfaces of random signs in random octrees.

use super::*;
use crate::engine::{Field, Silent};
use crate::geometry::Bounds;
use crate::polygonize::{Method, Options, accuracy};

/// A field that is linear along every edge, with its sign at the ends from a hash of the place:
/// whatever the tetrahedra ask, its roots exist.
struct Nothing;

impl Field for Nothing {
    fn dimension(&self) -> usize {
        3
    }

    fn parameters(&self) -> &[f64] {
        &[]
    }

    fn values(&self, _points: &[&[f64]], values: &mut [f64]) {
        values.fill(0.0);
    }

    fn gradients(&self, _: &[&[f64]], values: &mut [f64], gradients: &mut [&mut [f64]]) {
        values.fill(0.0);
        gradients.iter_mut().for_each(|column| column.fill(1.0));
    }

    fn parameter_gradients(
        &self,
        points: &[&[f64]],
        values: &mut [f64],
        gradients: &mut [&mut [f64]],
        _: &mut [&mut [f64]],
    ) {
        self.gradients(points, values, gradients);
    }
}

/// Pseudo-random numbers.
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed ^ mixed >> 27
}

#[test]
fn any_signs_in_any_octree_make_a_watertight_manifold() {
    let bounds = Bounds::from_sides(&[(-1.0, 1.0), (-2.0, 0.5), (0.0, 1.5)]).unwrap();
    let levels = Levels {
        coarse: [2, 1, 2],
        finest: 3,
    };
    let lattice = Lattice::new(&bounds, [16, 8, 16]).unwrap();
    let mut uneven = 0;
    for seed in 0..150 {
        let mut state = seed;
        let mut leaves = Vec::new();
        let mut open = build::coarse(&levels);
        while let Some(node) = open.pop() {
            if node.level < levels.finest && random(&mut state) % 100 < 35 {
                open.extend(node.children());
            } else {
                leaves.push(node);
            }
        }
        leaves.sort_unstable_by_key(|leaf| leaf.low);
        let steps = leaves.iter().map(|leaf| leaf.level);
        uneven += usize::from(steps.clone().max() > steps.min().map(|level| level + 1));
        let decomposition = Decomposition::new(&lattice, &leaves);
        let values = decomposition.points(&leaves).into_iter().map(|key| {
            let positive = random(&mut state).is_multiple_of(2);
            (key, if positive { 1.0 } else { -1.0 })
        });
        let values: Values = values.collect();
        let piece = surface(&decomposition, &leaves, &values, true).unwrap();
        let options = Options {
            method: Some(Method::Octree),
            cap: true,
            ..Options::new(bounds)
        };
        let job = Job {
            field: &Nothing,
            options: &options,
            accuracy: accuracy(&options),
            monitor: &Silent,
        };
        let (mesh, _) = simplices::finish(&job, &lattice, &piece).unwrap();
        let topology = mesh.topology();
        assert!(
            topology.watertight && topology.manifold,
            "seed {seed}: {topology:?}"
        );
        // Leaves fill the box: what is inside and what is outside of the tetrahedra add up to it.
        let flipped: Values = values.iter().map(|(&key, &value)| (key, -value)).collect();
        let piece = surface(&decomposition, &leaves, &flipped, true).unwrap();
        let (other, _) = simplices::finish(&job, &lattice, &piece).unwrap();
        let whole = mesh.volume() + other.volume();
        assert!((whole - 7.5).abs() <= 1e-9, "seed {seed}: {whole}");
    }
    // Steps of more than one level occur without balance, and fit as well.
    assert!(uneven > 100, "{uneven}");
}

#[test]
fn leaves_away_from_the_surface_may_be_missing() {
    let bounds = Bounds::from_sides(&[(0.0, 1.0); 3]).unwrap();
    let levels = Levels {
        coarse: [2; 3],
        finest: 3,
    };
    let lattice = Lattice::new(&bounds, [16; 3]).unwrap();
    let options = Options {
        cap: true,
        ..Options::new(bounds)
    };
    let job = Job {
        field: &Nothing,
        options: &options,
        accuracy: accuracy(&options),
        monitor: &Silent,
    };
    for seed in 0..150 {
        let mut state = seed;
        let (mut leaves, mut missing) = (Vec::new(), Vec::new());
        let mut open = build::coarse(&levels);
        while let Some(node) = open.pop() {
            if node.level < levels.finest && random(&mut state) % 100 < 45 {
                open.extend(node.children());
            } else if random(&mut state) % 100 < 30 {
                missing.push(node);
            } else {
                leaves.push(node);
            }
        }
        leaves.sort_unstable_by_key(|leaf| leaf.low);
        let decomposition = Decomposition::new(&lattice, &leaves);
        // Whatever touches a missing leaf is outside.
        let is_outside = |place: Place| {
            missing.iter().any(|leaf: &Node| {
                (0..3).all(|axis| {
                    (leaf.low[axis]..=leaf.low[axis] + leaf.size).contains(&place[axis])
                })
            })
        };
        let values = decomposition.points(&leaves).into_iter().map(|key| {
            let chance = random(&mut state).is_multiple_of(2);
            let positive = chance || is_outside(lattice.place(key));
            (key, if positive { 1.0 } else { -1.0 })
        });
        let values: Values = values.collect();
        let piece = surface(&decomposition, &leaves, &values, true).unwrap();
        let (mesh, _) = simplices::finish(&job, &lattice, &piece).unwrap();
        let topology = mesh.topology();
        assert!(
            topology.watertight && topology.manifold,
            "seed {seed}: {topology:?}"
        );
    }
}

#[test]
fn balanced_leaves_differ_by_one_level() {
    let bounds = Bounds::from_sides(&[(0.0, 1.0); 3]).unwrap();
    let levels = Levels {
        coarse: [2; 3],
        finest: 4,
    };
    let lattice = Lattice::new(&bounds, [32; 3]).unwrap();
    let options = Options::new(bounds);
    let job = Job {
        field: &Nothing,
        options: &options,
        accuracy: accuracy(&options),
        monitor: &Silent,
    };
    // One corner of the middle divided to the last.
    let mut tree = build::Tree::default();
    let mut open = build::coarse(&levels);
    while let Some(node) = open.pop() {
        let holds = (0..3).all(|axis| node.low[axis] <= 31 && 31 < node.low[axis] + node.size);
        if holds && node.level < levels.finest {
            open.extend(node.children());
        } else {
            tree.boundary.push(node);
        }
    }
    let before = tree.boundary.len();
    balance::balance(&job, &lattice, &mut tree).unwrap();
    assert!(tree.boundary.len() > before);
    let volume: u64 = tree
        .boundary
        .iter()
        .map(|leaf| u64::from(leaf.size).pow(3))
        .sum();
    assert_eq!(volume, 64 * 64 * 64);
    for one in &tree.boundary {
        for other in &tree.boundary {
            let touch = (0..3).all(|axis| {
                one.low[axis] <= other.low[axis] + other.size
                    && other.low[axis] <= one.low[axis] + one.size
            });
            assert!(
                !touch || one.level.abs_diff(other.level) <= 1,
                "{one:?} {other:?}"
            );
        }
    }
}
