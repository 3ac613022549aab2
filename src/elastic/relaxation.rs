//! Springs that make the simplices of a solid well-shaped (Velho, Gomes and Terzopoulos, "Implicit
//! manifolds, triangulations and dynamics", sections 5 and 6).
//!
//! Nodes of the boundary stay on F = 0, along which the springs draw them. Those inside are passive: no
//! field moves them, and springs between two of them have a tenth of the stiffness. The nodes move in a
//! viscous medium by explicit Euler steps until the energy decreases no more. No simplex turns over.
//! Springs even out lengths, which does not keep tetrahedra from being flat, so that afterwards, other
//! than in the paper, nodes of the worst simplices are put where the worst around them is best.

use glam::DVec3;
use rayon::prelude::*;

use super::{ElasticError, Lattice, fitting};
use crate::engine::{Field, Monitor};
use crate::geometry::{Bounds, radius_ratio};

/// The stiffness of a spring between two nodes inside, relative to those of the boundary.
const PASSIVE: f64 = 0.1;

/// The most steps.
const STEPS: usize = 400;

/// The farthest that a node moves in a step, relative to the mean length of springs.
const REACH: f64 = 0.1;

/// Equilibrium: in so many steps the energy decreases by no more than this part of it.
const WINDOW: usize = 10;
const REST: f64 = 1e-3;

/// No simplex gets a radius ratio below this, nor one that has less a smaller one.
const LEAST: f64 = 0.2;

/// Simplices with a radius ratio below this are made better, in so many rounds.
const GOOD: f64 = 0.5;
const ROUNDS: usize = 8;

/// How the springs came to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relaxation {
    /// Euler steps.
    pub steps: usize,
    /// Whether the energy decreases no more.
    pub at_rest: bool,
    /// The energy of the springs, before and after; those of the boundary have the stiffness 1.
    pub energy: [f64; 2],
}

/// A spring from a node.
#[derive(Clone, Copy)]
struct Spring {
    to: u32,
    stiffness: f64,
    rest: f64,
}

/// Things around each node.
struct Around<T> {
    starts: Vec<usize>,
    things: Vec<T>,
}

impl<T: Copy> Around<T> {
    /// From pairs of a node and a thing, in any order; that of each node's things is kept.
    fn new(nodes: usize, mut pairs: Vec<(u32, T)>) -> Self {
        pairs.sort_by_key(|&(node, _)| node);
        let start = |node| pairs.partition_point(|&(other, _)| other < node as u32);
        Around {
            starts: (0..=nodes).map(start).collect(),
            things: pairs.into_iter().map(|(_, thing)| thing).collect(),
        }
    }

    fn of(&self, node: usize) -> &[T] {
        &self.things[self.starts[node]..self.starts[node + 1]]
    }
}

/// A lattice while it comes to rest.
struct Relaxing<'a> {
    lattice: &'a mut Lattice,
    field: &'a dyn Field,
    /// The mean length of springs.
    length: f64,
    springs: Around<Spring>,
    simplices: Around<u32>,
    on_boundary: Vec<bool>,
    /// Nodes in sides of the box, where it cuts the solid.
    fixed: Vec<bool>,
    evaluations: usize,
}

impl Lattice {
    /// Lets springs even out the lattice, which was made of this field in this box, and counts anew
    /// the nodes that are not on the surface.
    ///
    /// The cost is some hundred times the number of nodes of the boundary in evaluations of F. The
    /// result does not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// Cancellation.
    pub fn relax(
        &mut self,
        field: &dyn Field,
        bounds: &Bounds,
        monitor: &dyn Monitor,
    ) -> Result<Relaxation, ElasticError> {
        let mut relaxing = Relaxing::new(self, field, bounds);
        let mut relaxation = Relaxation {
            energy: [relaxing.energy(); 2],
            ..Relaxation::default()
        };
        let mut eager = vec![1.0; relaxing.lattice.nodes.len()];
        let mut energies = vec![relaxation.energy[0]];
        while relaxation.steps < STEPS && !relaxation.at_rest {
            if monitor.cancelled() {
                return Err(ElasticError::Cancelled);
            }
            monitor.progress("springs", relaxation.steps as f64 / STEPS as f64);
            relaxing.step(&mut eager);
            relaxation.steps += 1;
            energies.push(relaxing.energy());
            if let Some(before) = energies.iter().rev().nth(WINDOW) {
                relaxation.at_rest = before - relaxing.energy() <= REST * before;
            }
        }
        for _ in 0..ROUNDS {
            if monitor.cancelled() {
                return Err(ElasticError::Cancelled);
            }
            let settled = relaxing.settle();
            if !relaxing.improve() && !settled {
                break;
            }
        }
        relaxation.energy[1] = relaxing.energy();
        let off_surface = relaxing.far_nodes().len();
        let evaluations = relaxing.evaluations;
        self.remarks.evaluations += evaluations;
        self.remarks.off_surface = off_surface;
        Ok(relaxation)
    }
}

impl<'a> Relaxing<'a> {
    fn new(lattice: &'a mut Lattice, field: &'a dyn Field, bounds: &Bounds) -> Self {
        let count = lattice.nodes.len();
        let mut on_boundary = vec![false; count];
        for &node in lattice.boundary.iter().flatten() {
            on_boundary[node as usize] = true;
        }
        let in_side = |point: &DVec3| {
            let mut sides = bounds.sides().enumerate();
            sides.any(|(axis, (low, high))| point[axis] == low || point[axis] == high)
        };
        let between = |&[from, to]: &[u32; 2]| {
            lattice.nodes[from as usize].distance(lattice.nodes[to as usize])
        };
        let is_passive = |ends: &[u32; 2]| !ends.iter().any(|&end| on_boundary[end as usize]);
        let active = || lattice.springs.iter().filter(|ends| !is_passive(ends));
        let length = active().map(between).sum::<f64>() / active().count().max(1) as f64;
        let springs = lattice.springs.iter().flat_map(|ends| {
            let (stiffness, rest) = match is_passive(ends) {
                true => (PASSIVE, between(ends)),
                false => (1.0, length),
            };
            let spring = |to| Spring {
                to,
                stiffness,
                rest,
            };
            let [from, to] = *ends;
            [(from, spring(to)), (to, spring(from))]
        });
        let dimension = lattice.dimension;
        let simplices = lattice.simplices.iter().zip(0..).flat_map(|(own, number)| {
            let corners = own.iter().take(dimension + 1);
            corners.map(move |&node| (node, number))
        });
        Relaxing {
            springs: Around::new(count, springs.collect()),
            simplices: Around::new(count, simplices.collect()),
            fixed: lattice.nodes.iter().map(in_side).collect(),
            lattice,
            field,
            length,
            on_boundary,
            evaluations: 0,
        }
    }

    fn energy(&self) -> f64 {
        let nodes = &self.lattice.nodes;
        let of_node = |node: usize| -> f64 {
            let springs = self.springs.of(node).iter();
            let each = springs.map(|spring| {
                let excess = nodes[node].distance(nodes[spring.to as usize]) - spring.rest;
                // Each spring is met from both ends.
                0.25 * spring.stiffness * excess * excess
            });
            each.sum()
        };
        (0..nodes.len()).map(of_node).sum()
    }

    /// The step of a node: f / c, with a viscosity c of 5/4 of what is stable (Gershgorin).
    fn euler_step(&self, node: usize) -> DVec3 {
        let nodes = &self.lattice.nodes;
        let (mut force, mut stiffness) = (DVec3::ZERO, 0.0);
        for spring in self.springs.of(node) {
            let way = nodes[spring.to as usize] - nodes[node];
            let length = way.length();
            if length > 0.0 {
                force += spring.stiffness * way * (1.0 - spring.rest / length);
            }
            stiffness += spring.stiffness;
        }
        let step = force / (1.25 * stiffness).max(f64::MIN_POSITIVE);
        step.clamp_length_max(REACH * self.length)
    }

    /// One step of all nodes; those that would make a simplex flat stay, and try half of it next.
    fn step(&mut self, eager: &mut [f64]) {
        let nodes = &self.lattice.nodes;
        let mut tried: Vec<DVec3> = (0..nodes.len())
            .into_par_iter()
            .map(|node| match self.fixed[node] {
                true => nodes[node],
                false => nodes[node] + eager[node] * self.euler_step(node),
            })
            .collect();
        let moved: Vec<usize> = (0..nodes.len())
            .filter(|&node| self.on_boundary[node] && !self.fixed[node])
            .collect();
        let places: Vec<DVec3> = moved.iter().map(|&node| tried[node]).collect();
        let (feet, evaluations) = fitting::feet(self.field, &places, self.length);
        self.evaluations += evaluations;
        let mut stays = vec![false; nodes.len()];
        for (&node, foot) in moved.iter().zip(feet) {
            match foot {
                // One that is not on the surface yet goes there by and by.
                Some(foot) => {
                    let way = foot - nodes[node];
                    tried[node] = nodes[node] + way.clamp_length_max(2.0 * REACH * self.length);
                }
                None => stays[node] = true,
            }
        }
        self.hold(&mut tried, &mut stays);
        for (part, stays) in eager.iter_mut().zip(stays) {
            *part = match stays {
                true => f64::max(0.5 * *part, 1e-3),
                false => f64::min(1.5 * *part, 1.0),
            };
        }
        self.lattice.nodes = tried;
    }

    fn ratio(&self, simplex: u32, nodes: &[DVec3]) -> f64 {
        let corners = self.lattice.simplices[simplex as usize];
        radius_ratio(
            self.lattice.dimension,
            corners.map(|node| nodes[node as usize]),
        )
    }

    /// Puts nodes that stay back, and all those of simplices that would become too flat: where no node
    /// moves, nothing does.
    fn hold(&self, tried: &mut [DVec3], stays: &mut [bool]) {
        let nodes = &self.lattice.nodes;
        for (node, &stays) in stays.iter().enumerate() {
            if stays {
                tried[node] = nodes[node];
            }
        }
        loop {
            let at_fault: Vec<usize> = (0..self.lattice.simplices.len())
                .into_par_iter()
                .filter(|&number| {
                    let corners = self.lattice.simplices[number];
                    let ratio = self.ratio(number as u32, tried);
                    ratio < LEAST
                        && ratio < self.ratio(number as u32, nodes)
                        && corners.iter().any(|&node| !stays[node as usize])
                })
                .collect();
            if at_fault.is_empty() {
                return;
            }
            for number in at_fault {
                for node in self.lattice.simplices[number] {
                    stays[node as usize] = true;
                    tried[node as usize] = nodes[node as usize];
                }
            }
        }
    }

    /// The worst ratio around a node if it was at a place.
    fn worst_around(&self, node: usize, place: DVec3) -> f64 {
        let nodes = &self.lattice.nodes;
        let ratios = self.simplices.of(node).iter().map(|&simplex| {
            let corners = self.lattice.simplices[simplex as usize];
            let at = |corner: u32| match corner as usize == node {
                true => place,
                false => nodes[corner as usize],
            };
            radius_ratio(self.lattice.dimension, corners.map(at))
        });
        ratios.fold(f64::INFINITY, f64::min)
    }

    /// Moves nodes of poor simplices, one after the other, where the worst around them is better.
    /// Whether there were any.
    fn improve(&mut self) -> bool {
        let is_flat = |&number: &usize| self.ratio(number as u32, &self.lattice.nodes) < GOOD;
        let poor: Vec<usize> = (0..self.lattice.simplices.len())
            .into_par_iter()
            .filter(is_flat)
            .collect();
        let mut nodes: Vec<usize> = poor
            .into_iter()
            .flat_map(|number| self.lattice.simplices[number].map(|node| node as usize))
            .filter(|&node| !self.fixed[node])
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut moved = false;
        for node in nodes {
            let here = self.lattice.nodes[node];
            let worst = self.worst_around(node, here);
            if worst >= GOOD {
                continue;
            }
            let mut best = (worst + 1e-3, here);
            for place in self.candidates(node) {
                let ratio = self.worst_around(node, place);
                if ratio > best.0 {
                    best = (ratio, place);
                }
            }
            if best.1 != here {
                self.lattice.nodes[node] = best.1;
                moved = true;
            }
        }
        moved
    }

    /// Places around a node where it might be better; on the surface for nodes of the boundary.
    fn candidates(&mut self, node: usize) -> Vec<DVec3> {
        const STEPS: [f64; 3] = [0.2, 0.07, 0.02];
        let here = self.lattice.nodes[node];
        let flat = self.lattice.dimension == 2;
        let ways = (0..27).map(|way: i32| {
            DVec3::new(
                f64::from(way % 3),
                f64::from(way / 3 % 3),
                f64::from(way / 9),
            ) - 1.0
        });
        let ways = ways.filter(|way| *way != DVec3::ZERO && (!flat || way.z == 0.0));
        let ways: Vec<DVec3> = ways.map(DVec3::normalize).collect();
        let steps = STEPS
            .iter()
            .flat_map(|step| ways.iter().map(move |way| step * way));
        let places: Vec<DVec3> = steps.map(|step| here + self.length * step).collect();
        if !self.on_boundary[node] {
            return places;
        }
        let (feet, evaluations) = fitting::feet(self.field, &places, 0.5 * self.length);
        self.evaluations += evaluations;
        feet.into_iter().flatten().collect()
    }

    /// Puts nodes of the boundary that are not on the surface there, or nearer to it. Whether there
    /// were any.
    fn settle(&mut self) -> bool {
        const PARTS: [f64; 3] = [1.0, 0.5, 0.25];
        let mut moved = false;
        for (node, foot) in self.far_nodes() {
            let (Some(foot), here) = (foot, self.lattice.nodes[node]) else {
                continue;
            };
            let least = LEAST.min(self.worst_around(node, here));
            let places = PARTS.map(|part| here.lerp(foot, part));
            let better = |place: &&DVec3| self.worst_around(node, **place) >= 0.5 * least;
            if let Some(&place) = places.iter().find(better) {
                self.lattice.nodes[node] = place;
                moved = true;
            }
        }
        moved
    }

    /// The nodes of the boundary that are not on the surface, with the places there.
    fn far_nodes(&mut self) -> Vec<(usize, Option<DVec3>)> {
        let own = (0..self.lattice.nodes.len())
            .filter(|&node| self.on_boundary[node] && !self.fixed[node]);
        let own: Vec<usize> = own.collect();
        let places: Vec<DVec3> = own.iter().map(|&node| self.lattice.nodes[node]).collect();
        let (feet, evaluations) = fitting::feet(self.field, &places, self.length);
        self.evaluations += evaluations;
        let far = |node: usize, foot: Option<DVec3>| {
            let here = self.lattice.nodes[node];
            foot.is_none_or(|foot| foot.distance(here) > 1e-5 * self.length)
        };
        let pairs = own.into_iter().zip(feet);
        pairs.filter(|&(node, foot)| far(node, foot)).collect()
    }
}
