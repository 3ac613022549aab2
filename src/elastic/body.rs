//! A lattice in motion: masses, springs, and a term that keeps volumes, under gravity and on the ground.
//!
//! * **Masses** are lumped: a node has its share, one of dimension + 1, of each of its simplices.
//! * **Springs** lie along all edges. A simplex of volume V with edges of rest length L gives each of them
//!   k = E V/L² (E is the stiffness), so that the energy of a strain ε is Σ ½ E V (n·ε n)²: it does not depend on the size
//!   of the cells. Were all directions n equally frequent, E would be Young's modulus, at a
//!   Poisson's ratio of 1/4 in space and 1/3 in the plane, by the means ⟨n_i n_j n_k n_l⟩ over the sphere and the circle.
//! * **Volumes** resist with the energy ½ B V (J − 1)² of a simplex whose volume is J times that at rest: springs
//!   alone do not mind whether a simplex is turned inside out.
//! * **Damping** acts along a spring: β k times the speed of its lengthening, with β = 2 ζ/ω₁, where ω₁ = π c/l and
//!   c² = E/ρ are about the slowest vibration of a body of length l. So ζ is the
//!   share of critical damping of that vibration.
//! * **The ground** is a plane in which nodes leave a dent: the force of a node of mass m at the depth δ is m Ω² δ while
//!   it goes deeper, and falls along a line that is steeper by 1/e² when it comes back (Walton
//!   and Braun, "Viscosity, granular-temperature, and stress calculations for shearing assemblies of inelastic,
//!   frictional disks", 1986): so e², and for a body that is stiff against the ground the restitution e, does not
//!   depend on mass or speed. Ω is such that a node alone would leave a dent of a twentieth of a cell.
//!   Friction is Coulomb's.
//!
//! **Time** goes on by Euler's method as in the paper's section 5, but the semi-implicit one: positions move with the new
//! velocities. The explicit one multiplies the amplitude of an undamped oscillation by √(1 + ω² dt²) in every
//! step. The first step of the velocities is a half one: they stand in the middle between positions, which makes
//! energies exact to second order and free fall exact to rounding.
//!
//! **The step** is 0.8 of the one that is proven stable for the body at rest. By Gershgorin's theorem for
//! M⁻¹K, by blocks, ω² ≤ max_i (Σ_e 2 k_e + Σ_s B/V |V_i| Σ_j |V_j| + m_i Ω²/e²)/m_i over the springs e and the simplices s of a node i,
//! where V_j is the derivative of V by a corner. With damping forces of old velocities, a vibration follows
//! z² − (2 − dt² ω² − dt β ω²) z + 1 − dt β ω² = 0, whose roots stay in the unit circle (Jury) for
//! dt < −β + √(β² + 4/ω²).

use glam::DVec3;
use rayon::prelude::*;

use super::ElasticError;
use super::lattice::Lattice;
use super::simplex::{measure, slopes};

/// The part of the stable step that is used: springs that are stretched or turned are stiffer than at
/// rest.
const SAFETY: f64 = 0.8;

/// The dent that a node alone leaves, in cells.
const DENT: f64 = 0.05;

/// So few nodes, springs or simplices are not worth a second thread.
const FEW: usize = 4096;

/// What a solid is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Mass per volume; in R2 per area.
    pub density: f64,
    /// E, about Young's modulus: force per area; in R2 per length.
    pub stiffness: f64,
    /// B: how much a change of volume is resisted, in the same units.
    pub volume_stiffness: f64,
    /// ζ, the share of critical damping of the slowest vibration.
    pub damping: f64,
}

/// What it falls on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Acceleration, downward along the last axis.
    pub gravity: f64,
    /// e: the part of its speed that a stiff body has after the impact; from [`Ground::LEAST`] to 1.
    pub restitution: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
}

impl Ground {
    /// The least restitution: the steepness 1/e² must be one that a step can follow.
    pub const LEAST: f64 = 0.1;
}

/// Where the energy is. Gravity's is 0 on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// ½ m v²
    pub kinetic: f64,
    /// In springs, in volumes and in dents of the ground, to be given back.
    pub elastic: f64,
    /// m g z
    pub gravity: f64,
    /// Lost so far: by damping, in the ground and by friction.
    pub lost: f64,
}

impl Energy {
    /// The sum, which stays the same.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.gravity + self.lost
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    position: DVec3,
    /// Between the last position and this.
    velocity: DVec3,
    mass: f64,
    /// How deep the dent is that it has made.
    dent: f64,
    /// The energy that damping, friction and the ground took.
    taken: f64,
}

#[derive(Clone, Copy, Debug)]
struct Spring {
    ends: [u32; 2],
    rest: f64,
    stiffness: f64,
}

/// What a spring does to its first end.
#[derive(Clone, Copy, Debug, Default)]
struct Pull {
    elastic: DVec3,
    damping: DVec3,
}

/// Lists of numbers, one for each node, in one piece.
#[derive(Clone, Debug)]
struct Lists {
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    /// Which of the members, in their order, each node occurs in: entries are places in the sequence.
    fn new(nodes: usize, members: impl Iterator<Item = u32> + Clone) -> Lists {
        let mut starts = vec![0_u32; nodes + 1];
        for node in members.clone() {
            starts[node as usize + 1] += 1;
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let mut next = starts.clone();
        let mut entries = vec![0; starts[nodes] as usize];
        for (place, node) in members.enumerate() {
            let at = &mut next[node as usize];
            entries[*at as usize] = place as u32;
            *at += 1;
        }
        Lists { starts, entries }
    }

    fn of(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        let range = self.starts[node] as usize..self.starts[node + 1] as usize;
        self.entries[range].iter().map(|&entry| entry as usize)
    }
}

/// A solid that moves.
#[derive(Clone, Debug)]
pub struct Body {
    dimension: usize,
    material: Material,
    ground: Ground,
    nodes: Vec<Node>,
    springs: Vec<Spring>,
    simplices: Vec<[u32; 4]>,
    /// The simplices' volumes at rest.
    volumes: Vec<f64>,
    /// The ends of springs at each node: twice the spring, plus 1 for the second end.
    ends: Lists,
    /// The corners of simplices at each node: dimension + 1 times the simplex, plus the place.
    corners: Lists,
    /// β
    damping_time: f64,
    /// Ω²
    dent_rate: f64,
    pulls: Vec<Pull>,
    pressures: Vec<[DVec3; 3]>,
    time: f64,
    started: bool,
}

impl Body {
    /// The solid at rest, its lowest node so high above the ground. The dents that it will make are made
    /// for the speed that it can have: √(2 g (height + its own height)).
    ///
    /// # Errors
    ///
    /// A number that makes no sense.
    pub fn new(
        lattice: &Lattice,
        material: Material,
        ground: Ground,
        height: f64,
    ) -> Result<Body, ElasticError> {
        check(&material, &ground, height)?;
        let dimension = lattice.dimension;
        let up = dimension - 1;
        let (low, high) = lattice.nodes.iter().fold(
            (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |(low, high), &node| (low.min(node), high.max(node)),
        );
        let mut shift = DVec3::ZERO;
        shift[up] = height - low[up];
        let mut nodes: Vec<Node> = lattice
            .nodes
            .iter()
            .map(|&position| Node {
                position: position + shift,
                velocity: DVec3::ZERO,
                mass: 0.0,
                dent: 0.0,
                taken: 0.0,
            })
            .collect();
        let volumes: Vec<f64> = lattice
            .simplices
            .iter()
            .map(|simplex| measure(dimension, simplex.map(|node| lattice.nodes[node as usize])))
            .collect();
        let corner_count = dimension + 1;
        for (simplex, volume) in lattice.simplices.iter().zip(&volumes) {
            for &node in &simplex[..corner_count] {
                nodes[node as usize].mass += material.density * volume / corner_count as f64;
            }
        }
        let springs = springs(lattice, &volumes, material.stiffness);
        let count = nodes.len();
        let ends = Lists::new(count, springs.iter().flat_map(|spring| spring.ends));
        let corners = lattice
            .simplices
            .iter()
            .flat_map(|simplex| simplex.iter().copied().take(corner_count));
        let corners = Lists::new(count, corners);
        let length = (high - low).max_element();
        let sound = (material.stiffness / material.density).sqrt();
        let speed = 2.0 * ground.gravity * (height + high[up] - low[up]);
        let mean: f64 =
            springs.iter().map(|spring| spring.rest).sum::<f64>() / springs.len() as f64;
        Ok(Body {
            dimension,
            material,
            ground,
            pulls: vec![Pull::default(); springs.len()],
            pressures: vec![[DVec3::ZERO; 3]; volumes.len()],
            nodes,
            springs,
            simplices: lattice.simplices.clone(),
            volumes,
            ends,
            corners,
            damping_time: 2.0 * material.damping * length / (std::f64::consts::PI * sound),
            dent_rate: speed / (DENT * mean * DENT * mean),
            time: 0.0,
            started: false,
        })
    }

    /// Gives all nodes a velocity, as at the beginning.
    pub fn throw(&mut self, velocity: DVec3) {
        for node in &mut self.nodes {
            node.velocity = velocity;
        }
        self.started = false;
    }

    /// The greatest step to be used: see the module's head.
    pub fn stable_step(&self) -> f64 {
        let rates = (0..self.nodes.len()).map(|node| self.rate(node) / self.nodes[node].mass);
        let square = rates.fold(0.0, f64::max);
        let beta = self.damping_time;
        // The difference of nearly equal numbers, without cancellation.
        SAFETY * (4.0 / square) / (beta + (beta * beta + 4.0 / square).sqrt())
    }

    /// The sum of a node's row of K, by blocks.
    fn rate(&self, node: usize) -> f64 {
        let corner_count = self.dimension + 1;
        let springs = self
            .ends
            .of(node)
            .map(|end| 2.0 * self.springs[end / 2].stiffness);
        let volumes = self.corners.of(node).map(|corner| {
            let simplex = corner / corner_count;
            let slopes = self.slopes_of(simplex);
            let first = -(slopes[0] + slopes[1] + slopes[2]);
            let lengths = [first, slopes[0], slopes[1], slopes[2]].map(DVec3::length);
            let sum: f64 = lengths.iter().sum();
            self.material.volume_stiffness / self.volumes[simplex]
                * lengths[corner % corner_count]
                * sum
        });
        let e = self.ground.restitution;
        let ground = self.nodes[node].mass * self.dent_rate / (e * e);
        springs.sum::<f64>() + volumes.sum::<f64>() + ground
    }

    fn corners_of(&self, simplex: usize) -> [DVec3; 4] {
        self.simplices[simplex].map(|node| self.nodes[node as usize].position)
    }

    fn slopes_of(&self, simplex: usize) -> [DVec3; 3] {
        slopes(self.dimension, self.corners_of(simplex))
    }

    /// Goes on by one step. The result does not depend on the number of threads: each node adds up what acts on
    /// it in the order of its springs and simplices.
    pub fn step(&mut self, step: f64) {
        self.find_forces();
        let (body, mut nodes) = self.without_nodes();
        // The velocities of the beginning are those at its time.
        let kick = if body.started { step } else { 0.5 * step };
        let update = |(number, node): (usize, &mut Node)| body.update(number, node, kick, step);
        match nodes.len() < FEW {
            true => nodes.iter_mut().enumerate().for_each(update),
            false => nodes.par_iter_mut().enumerate().for_each(update),
        }
        std::mem::swap(&mut self.nodes, &mut nodes);
        self.time += step;
        self.started = true;
    }

    /// The body, for forces, and its nodes, to be changed.
    fn without_nodes(&mut self) -> (&Body, Vec<Node>) {
        let nodes = std::mem::take(&mut self.nodes);
        (self, nodes)
    }

    fn update(&self, number: usize, node: &mut Node, kick: f64, step: f64) {
        let up = self.dimension - 1;
        let (force, damping) = self.force(number);
        let depth = -node.position[up];
        let support = self.support(node, depth);
        node.dent = match depth > 0.0 {
            true => node.dent.max(depth),
            false => 0.0,
        };
        let before = node.velocity;
        let mut acceleration = (force + damping) / node.mass;
        acceleration[up] += support / node.mass - self.ground.gravity;
        node.velocity += kick * acceleration;
        let mut rubbing = DVec3::ZERO;
        if support > 0.0 {
            let mut along = node.velocity;
            along[up] = 0.0;
            let speed = along.length();
            let most = self.ground.friction * support * kick / node.mass;
            let change = match speed > most {
                true => -(most / speed) * along,
                false => -along,
            };
            node.velocity += change;
            rubbing = node.mass * change;
        }
        // Kinetic energy changes by the work of the mean velocity, exactly.
        let mean = 0.5 * (before + node.velocity);
        node.taken -= mean.dot(kick * damping + rubbing) + mean[up] * kick * support;
        node.position += step * node.velocity;
    }

    /// What springs and volumes do to a node, and what damping does.
    fn force(&self, node: usize) -> (DVec3, DVec3) {
        let (mut force, mut damping) = (DVec3::ZERO, DVec3::ZERO);
        for end in self.ends.of(node) {
            let pull = &self.pulls[end / 2];
            let sign = if end % 2 == 0 { 1.0 } else { -1.0 };
            force += sign * pull.elastic;
            damping += sign * pull.damping;
        }
        let corner_count = self.dimension + 1;
        for corner in self.corners.of(node) {
            let pressures = &self.pressures[corner / corner_count];
            force += match corner % corner_count {
                0 => -(pressures[0] + pressures[1] + pressures[2]),
                place => pressures[place - 1],
            };
        }
        (force, damping)
    }

    /// What the ground does to a node that is so deep in it.
    fn support(&self, node: &Node, depth: f64) -> f64 {
        if depth <= 0.0 {
            return 0.0;
        }
        let rate = node.mass * self.dent_rate;
        if depth >= node.dent {
            return rate * depth;
        }
        let e2 = self.ground.restitution * self.ground.restitution;
        (rate / e2 * (depth - (1.0 - e2) * node.dent)).max(0.0)
    }

    /// Fills in what springs and volumes do.
    fn find_forces(&mut self) {
        let (mut pulls, mut pressures) = (
            std::mem::take(&mut self.pulls),
            std::mem::take(&mut self.pressures),
        );
        fill(&mut pulls, |spring| self.pull(spring));
        fill(&mut pressures, |simplex| self.pressure(simplex));
        (self.pulls, self.pressures) = (pulls, pressures);
    }

    fn pull(&self, number: usize) -> Pull {
        let spring = &self.springs[number];
        let [a, b] = spring.ends.map(|end| &self.nodes[end as usize]);
        let along = b.position - a.position;
        let length = along.length();
        let direction = along / length.max(f64::MIN_POSITIVE);
        let speed = (b.velocity - a.velocity).dot(direction);
        Pull {
            elastic: spring.stiffness * (length - spring.rest) * direction,
            damping: spring.stiffness * self.damping_time * speed * direction,
        }
    }

    fn pressure(&self, number: usize) -> [DVec3; 3] {
        let corners = self.corners_of(number);
        let volume = measure(self.dimension, corners);
        let excess = volume / self.volumes[number] - 1.0;
        slopes(self.dimension, corners)
            .map(|slope| -self.material.volume_stiffness * excess * slope)
    }

    /// The time that has passed.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Where the nodes are.
    pub fn positions(&self) -> Vec<DVec3> {
        self.nodes.iter().map(|node| node.position).collect()
    }

    /// The height of the lowest node.
    pub fn lowest(&self) -> f64 {
        let up = self.dimension - 1;
        let heights = self.nodes.iter().map(|node| node.position[up]);
        heights.fold(f64::INFINITY, f64::min)
    }

    /// The mass of all nodes.
    pub fn mass(&self) -> f64 {
        self.nodes.iter().map(|node| node.mass).sum()
    }

    /// The force of the ground, upward.
    pub fn support_force(&self) -> f64 {
        let up = self.dimension - 1;
        let nodes = self.nodes.iter();
        nodes
            .map(|node| self.support(node, -node.position[up]))
            .sum()
    }

    /// The number of simplices that are inverted.
    pub fn inverted(&self) -> usize {
        let simplices = 0..self.simplices.len();
        let is_inverted =
            |&simplex: &usize| measure(self.dimension, self.corners_of(simplex)) <= 0.0;
        simplices.filter(is_inverted).count()
    }

    /// Where the energy is now. Velocities are taken half a step on, given the step, to the time of the positions.
    pub fn energy(&mut self, step: f64) -> Energy {
        self.find_forces();
        let up = self.dimension - 1;
        let e = self.ground.restitution;
        let half = if self.started { 0.5 * step } else { 0.0 };
        let mut energy = Energy::default();
        for (number, node) in self.nodes.iter().enumerate() {
            let (force, damping) = self.force(number);
            let support = self.support(node, -node.position[up]);
            let mut acceleration = (force + damping) / node.mass;
            acceleration[up] += support / node.mass - self.ground.gravity;
            let velocity = node.velocity + half * acceleration;
            energy.kinetic += 0.5 * node.mass * velocity.length_squared();
            energy.gravity += node.mass * self.ground.gravity * node.position[up];
            let stored = 0.5 * support * support * e * e / (node.mass * self.dent_rate);
            energy.elastic += stored;
            energy.lost += node.taken - stored;
        }
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|end| self.nodes[end as usize].position);
            let stretch = a.distance(b) - spring.rest;
            energy.elastic += 0.5 * spring.stiffness * stretch * stretch;
        }
        for (simplex, &volume) in self.volumes.iter().enumerate() {
            let excess = measure(self.dimension, self.corners_of(simplex)) / volume - 1.0;
            energy.elastic += 0.5 * self.material.volume_stiffness * volume * excess * excess;
        }
        energy
    }
}

/// The springs: k is E times the volume of the simplices around an edge, over the square of its length.
fn springs(lattice: &Lattice, volumes: &[f64], stiffness: f64) -> Vec<Spring> {
    let mut springs: Vec<Spring> = lattice
        .springs
        .iter()
        .map(|&ends| {
            let [a, b] = ends.map(|end| lattice.nodes[end as usize]);
            Spring {
                ends,
                rest: a.distance(b),
                stiffness: 0.0,
            }
        })
        .collect();
    for (simplex, volume) in lattice.simplices.iter().zip(volumes) {
        for end in 1..=lattice.dimension {
            for start in 0..end {
                let (a, b) = (simplex[start], simplex[end]);
                let ends = [a.min(b), a.max(b)];
                if let Ok(place) = lattice.springs.binary_search(&ends) {
                    let spring = &mut springs[place];
                    spring.stiffness += stiffness * volume / (spring.rest * spring.rest);
                }
            }
        }
    }
    springs
}

/// Fills a list by its places, in parallel if it is long.
fn fill<T: Send>(list: &mut [T], entry: impl Fn(usize) -> T + Sync) {
    let set = |(place, slot): (usize, &mut T)| *slot = entry(place);
    match list.len() < FEW {
        true => list.iter_mut().enumerate().for_each(set),
        false => list
            .par_iter_mut()
            .with_min_len(FEW / 4)
            .enumerate()
            .for_each(set),
    }
}

/// Whether the numbers make sense.
fn check(material: &Material, ground: &Ground, height: f64) -> Result<(), ElasticError> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    let least = |value: f64| value >= 0.0 && value.is_finite();
    let share = (Ground::LEAST..=1.0).contains(&ground.restitution);
    let (size, none) = ("greater than 0 and finite", "at least 0 and finite");
    let demands = [
        (
            "density",
            material.density,
            positive(material.density),
            size,
        ),
        (
            "stiffness",
            material.stiffness,
            positive(material.stiffness),
            size,
        ),
        (
            "volume stiffness",
            material.volume_stiffness,
            least(material.volume_stiffness),
            none,
        ),
        ("damping", material.damping, least(material.damping), none),
        ("gravity", ground.gravity, positive(ground.gravity), size),
        ("restitution", ground.restitution, share, "from 0.1 to 1"),
        ("friction", ground.friction, least(ground.friction), none),
        ("height", height, least(height), none),
    ];
    match demands.iter().find(|(_, _, is_well, _)| !is_well) {
        None => Ok(()),
        Some(&(name, value, _, demand)) => Err(ElasticError::Number {
            name,
            value,
            demand,
        }),
    }
}
