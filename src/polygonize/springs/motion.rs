//! The springs' motion to equilibrium (section 5 of the paper).
//!
//! The nodes have masses and move in a viscous medium: m x'' + c x' = f, integrated by explicit Euler
//! steps. With a spring constant k, s springs at a node and a constant K for the force along the
//! gradient, the row sums of the stiffness matrix are at most 2 s k + K (Gershgorin). Scaled by that
//! bound, the step is stable whatever the stiffness is; of its velocity a node keeps nine tenths
//! in a step, so that slow motions along the surface take a tenth of the steps that they would without
//! masses. When the energy grows all nodes are stopped.

use glam::DVec3;
use rayon::prelude::*;

use super::super::project::values_at;
use super::super::{Job, PolygonizeError};
use super::complex::Complex;

/// ε relative to the side of a cell; the paper: "proportional to the meshsize".
pub(super) const EPSILON: f64 = 0.35;

/// The constant of the force along the gradient relative to that of the springs.
const PULL: f64 = 8.0;

/// What is left of the velocity after a step.
const KEPT: f64 = 0.9;

/// The farthest that a node moves in a step, relative to the side of a cell.
const REACH: f64 = 0.1;

/// Equilibrium: the lowest energy of so many steps is below that of all before by no more than this
/// part of it. Nodes may go on along the surface, where the energy is nearly the same.
const WINDOW: usize = 10;
const REST: f64 = 1e-3;

/// The most steps, in R2 and in R3. In R2 they cost little, and evenness has to travel around the curve.
const STEPS: [usize; 2] = [3000, 600];

/// No simplex becomes smaller than this part of what it was, nor one that is smaller still smaller.
const LEAST: f64 = 0.05;

/// Points that are evaluated together.
const BATCH: usize = 512;

/// How the motion ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    pub(super) steps: usize,
    pub(super) at_rest: bool,
    pub(super) evaluations: usize,
    /// Before and after.
    pub(super) energy: [f64; 2],
}

/// Signed distances of first order from the level set, (F − iso) / |F_x|, and unit normals; NaN and
/// 0 where there are none.
pub(super) fn distances(job: &Job, points: &[DVec3]) -> Vec<(f64, DVec3)> {
    let batch = |points: &[DVec3]| {
        let (values, gradients) = values_at(job.field, points);
        let signed = |(value, gradient): (f64, DVec3)| {
            let (value, slope) = (value - job.options.iso, gradient.length());
            match value.is_finite() && slope.is_finite() && slope > 0.0 {
                true => (value / slope, gradient / slope),
                // The sign at least is known.
                false => (value, DVec3::ZERO),
            }
        };
        values.into_iter().zip(gradients).map(signed).collect()
    };
    let parts: Vec<Vec<_>> = points.par_chunks(BATCH).map(batch).collect();
    parts.into_iter().flatten().collect()
}

/// Moves the nodes to equilibrium.
///
/// No node crosses the level and no simplex turns over: nodes whose step would do that stay, and try
/// half of the step next.
pub(super) fn relax(job: &Job, complex: &mut Complex) -> Result<Motion, PolygonizeError> {
    let least = complex.simplices.iter();
    let least: Vec<f64> = least
        .map(|simplex| LEAST * complex.measure(simplex, &complex.nodes))
        .collect();
    let mut at = distances(job, &complex.nodes);
    let mut eager = vec![1.0; complex.nodes.len()];
    let mut velocities = vec![DVec3::ZERO; complex.nodes.len()];
    let mut motion = Motion {
        evaluations: at.len(),
        ..Motion::default()
    };
    motion.energy[0] = energy(complex, &at);
    let mut energies = vec![motion.energy[0]];
    let most = STEPS[usize::from(complex.dimension == 3)];
    for step in 0..most {
        if job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        job.monitor.progress("springs", step as f64 / most as f64);
        let reach = REACH * complex.spacing;
        velocities
            .par_iter_mut()
            .enumerate()
            .for_each(|(node, velocity)| {
                let faster = KEPT * *velocity + euler_step(complex, node, at[node]);
                *velocity = faster.clamp_length_max(reach);
            });
        if is_at_rest(&energies) {
            motion.at_rest = true;
            break;
        }
        let tried = complex.nodes.iter().zip(&velocities).zip(&eager);
        let mut tried: Vec<DVec3> = tried
            .map(|((&node, &step), &part)| node + part * step)
            .collect();
        let mut there = distances(job, &tried);
        motion.evaluations += there.len();
        motion.steps += 1;
        let mut stays: Vec<bool> = there
            .iter()
            .zip(&complex.inside)
            .map(|((distance, _), &inside)| !distance.is_finite() || (*distance < 0.0) != inside)
            .collect();
        hold(complex, &least, &mut tried, &mut stays);
        for (node, &stays) in stays.iter().enumerate() {
            if stays {
                there[node] = at[node];
                velocities[node] = DVec3::ZERO;
            }
            let part: &mut f64 = &mut eager[node];
            *part = if stays {
                0.5 * *part
            } else {
                (1.5 * *part).min(1.0)
            };
            *part = part.max(1e-3);
        }
        complex.nodes = tried;
        at = there;
        let now = energy(complex, &at);
        if energies.last().is_some_and(|&before| now > before) {
            velocities.fill(DVec3::ZERO);
        }
        energies.push(now);
    }
    motion.energy[1] = energy(complex, &at);
    Ok(motion)
}

/// Whether the energy decreases no more, given those after each step.
fn is_at_rest(energies: &[f64]) -> bool {
    let Some(split) = energies
        .len()
        .checked_sub(WINDOW)
        .filter(|&split| split > 0)
    else {
        return false;
    };
    let lowest = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
    let (before, after) = energies.split_at(split);
    lowest(after) >= (1.0 - REST) * lowest(before)
}

/// Puts nodes that stay back to where they are, together with the nodes of simplices that would
/// become too small, until there are none: where no node moves, nothing does.
fn hold(complex: &Complex, least: &[f64], tried: &mut [DVec3], stays: &mut [bool]) {
    for (node, &stays) in stays.iter().enumerate() {
        if stays {
            tried[node] = complex.nodes[node];
        }
    }
    loop {
        let at_fault: Vec<usize> = (0..complex.simplices.len())
            .into_par_iter()
            .filter(|&number| {
                let simplex = &complex.simplices[number];
                let measure = complex.measure(simplex, tried);
                let nodes = &simplex[..complex.corners()];
                measure <= least[number]
                    && measure < complex.measure(simplex, &complex.nodes)
                    && nodes.iter().any(|&node| !stays[node as usize])
            })
            .collect();
        if at_fault.is_empty() {
            return;
        }
        for number in at_fault {
            for &node in &complex.simplices[number][..complex.corners()] {
                let node = node as usize;
                stays[node] = true;
                tried[node] = complex.nodes[node];
            }
        }
    }
}

/// The stretch of the force along the gradient: how far a node is from its side of the
/// ε-neighbourhood. Outside of the neighbourhood it attracts, within it repels.
fn stretch(complex: &Complex, node: usize, distance: f64) -> f64 {
    let epsilon = EPSILON * complex.spacing;
    let side = if complex.inside[node] {
        -epsilon
    } else {
        epsilon
    };
    (side - distance).clamp(-complex.spacing, complex.spacing)
}

/// The explicit Euler step of a node that is at rest.
fn euler_step(complex: &Complex, node: usize, (distance, normal): (f64, DVec3)) -> DVec3 {
    let here = complex.nodes[node];
    // "The diameter of the ε-neighborhood".
    let rest = 2.0 * EPSILON * complex.spacing;
    let springs = complex.springs_of(node);
    let count = springs.len() as f64;
    let mut force = DVec3::ZERO;
    for &other in &complex.around[springs] {
        let way = complex.nodes[other as usize] - here;
        let length = way.length();
        if length > 0.0 {
            force += way * (1.0 - rest / length);
        }
    }
    let pull = PULL * count;
    if distance.is_finite() {
        force += pull * stretch(complex, node, distance) * normal;
    }
    complex.freedom[node] * force / (2.0 * count + pull)
}

/// The energy of the springs and of the forces along the gradient, with k = 1.
fn energy(complex: &Complex, at: &[(f64, DVec3)]) -> f64 {
    let rest = 2.0 * EPSILON * complex.spacing;
    let springs = complex.springs.iter().map(|&[from, to]| {
        let length = complex.nodes[from as usize].distance(complex.nodes[to as usize]);
        0.5 * (length - rest) * (length - rest)
    });
    let pulls = at.iter().enumerate().map(|(node, &(distance, normal))| {
        if !distance.is_finite() || normal == DVec3::ZERO {
            return 0.0;
        }
        let stretch = stretch(complex, node, distance);
        0.5 * PULL * complex.springs_of(node).len() as f64 * stretch * stretch
    });
    springs.sum::<f64>() + pulls.sum::<f64>()
}
