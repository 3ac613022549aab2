//! Moving nodes onto the surface: where each belongs, and how far it can go there.

use glam::DVec3;
use rayon::prelude::*;

use super::simplex::quality;
use crate::engine::Field;

/// The greatest distance from the surface that counts as on it, relative to the way that a node may go.
const TOLERANCE: f64 = 1e-6;

/// The most steps along the gradient.
const STEPS: usize = 20;

/// Steps of a bisection.
pub(super) const HALVINGS: usize = 40;

/// Points that are evaluated together.
const BATCH: usize = 2048;

/// Simplices must be no flatter than this, by [`quality`].
const FLAT: f64 = 0.03;

/// The parts of the way to the surface that are tried.
const PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.0];

/// Where a node belongs.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// Where it is.
    Here,
    /// At this place of the surface.
    Surface(DVec3),
}

/// Nodes that were moved.
pub(super) struct Fitted {
    pub(super) nodes: Vec<DVec3>,
    /// Whether the node belongs on the surface, but did not get there.
    pub(super) off: Vec<bool>,
}

/// The points of F = 0 to which steps −F F_x/|F_x|² lead from these places, if they are within
/// reach; and the number of evaluations.
pub(super) fn feet(field: &dyn Field, places: &[DVec3], reach: f64) -> (Vec<Option<DVec3>>, usize) {
    let batches: Vec<(Vec<Option<DVec3>>, usize)> = places
        .par_chunks(BATCH)
        .map(|batch| feet_of_batch(field, batch, reach))
        .collect();
    let evaluations = batches.iter().map(|(_, evaluations)| evaluations).sum();
    let feet = batches.into_iter().flat_map(|(feet, _)| feet).collect();
    (feet, evaluations)
}

fn feet_of_batch(field: &dyn Field, starts: &[DVec3], reach: f64) -> (Vec<Option<DVec3>>, usize) {
    let dimension = field.dimension();
    let mut feet = vec![None; starts.len()];
    let mut places = starts.to_vec();
    let mut active: Vec<usize> = (0..starts.len()).collect();
    let mut evaluations = 0;
    for _ in 0..STEPS {
        if active.is_empty() {
            break;
        }
        evaluations += active.len();
        let columns = [0, 1, 2]
            .map(|axis| -> Vec<f64> { active.iter().map(|&place| places[place][axis]).collect() });
        let columns = columns.each_ref().map(Vec::as_slice);
        let mut values = vec![0.0; active.len()];
        let mut gradients = [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; active.len()]);
        let [x, y, z] = &mut gradients;
        let mut slices = [&mut x[..], &mut y[..], &mut z[..]];
        field.gradients(&columns[..dimension], &mut values, &mut slices[..dimension]);
        let mut going = Vec::new();
        for (number, &place) in active.iter().enumerate() {
            let gradient = DVec3::from_array([0, 1, 2].map(|axis| gradients[axis][number]));
            if values[number] == 0.0 {
                feet[place] = Some(places[place]);
                continue;
            }
            let slope = gradient.length();
            let step = -values[number] / slope * (gradient / slope);
            if !step.is_finite() {
                continue;
            }
            places[place] += step.clamp_length_max(0.5 * reach);
            let is_near = starts[place].distance(places[place]) <= reach;
            if is_near && step.length() <= TOLERANCE * reach {
                feet[place] = Some(places[place]);
            } else if starts[place].distance(places[place]) <= 2.0 * reach {
                going.push(place);
            }
        }
        active = going;
    }
    (feet, evaluations)
}

/// The place between a point inside and one outside at which F ceases to be negative, by bisection.
pub(super) fn crossing(field: &dyn Field, mut inside: DVec3, mut outside: DVec3) -> DVec3 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        match field.value(middle) < 0.0 {
            true => inside = middle,
            false => outside = middle,
        }
    }
    inside
}

/// Moves nodes to their targets, as far as no simplex becomes flat: those of a flat simplex go half of the way,
/// then a quarter, then none. Ends, since no simplex is flat where nothing is moved.
pub(super) fn fit(
    dimension: usize,
    places: Vec<DVec3>,
    targets: &[Target],
    simplices: &[[u32; 4]],
) -> Fitted {
    let mut parts = vec![0_usize; places.len()];
    let moved = |node: usize, part: usize| match targets[node] {
        Target::Here => places[node],
        Target::Surface(place) => places[node].lerp(place, PARTS[part]),
    };
    let mut nodes: Vec<DVec3> = (0..places.len()).map(|node| moved(node, 0)).collect();
    loop {
        let is_flat = |simplex: &&[u32; 4]| {
            let corners = simplex.map(|node| nodes[node as usize]);
            quality(dimension, corners) < FLAT
        };
        let flat: Vec<&[u32; 4]> = simplices.par_iter().filter(is_flat).collect();
        let mut shorter: Vec<usize> = flat
            .into_iter()
            .flatten()
            .map(|&node| node as usize)
            .filter(|&node| matches!(targets[node], Target::Surface(_)))
            .filter(|&node| parts[node] + 1 < PARTS.len())
            .collect();
        shorter.sort_unstable();
        shorter.dedup();
        if shorter.is_empty() {
            break;
        }
        for node in shorter {
            parts[node] += 1;
            nodes[node] = moved(node, parts[node]);
        }
    }
    Fitted {
        nodes,
        off: parts.into_iter().map(|part| part > 0).collect(),
    }
}
