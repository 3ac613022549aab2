//! A level set whose topology is proven: no resolution is given, cells are divided until enclosures
//! prove that the mesh and the level set are isotopic in the box.
//!
//! The idea of subdividing until normals vary little in each cell is that of S. Plantinga and G. Vegter,
//! "Isotopic approximation of implicit curves and surfaces" (Symposium on Geometry Processing, 2004).
//! What is proven here is simpler. The box is divided into cells. In some F − iso has no zero.
//! The others are divided into simplices that fit together ([`super::octree::decompose`]); let L be
//! linear in each simplex, with the values of F − iso as computed at the corners (a 0 stands for a
//! tiny positive number).
//!
//! **Theorem.** Suppose that in each of these other cells B, F is Lipschitz, and that for each of its
//! simplices T, ⟨g, ξ⟩ > 0 for the gradient g of L in T and all generalised gradients ξ of F in B. Suppose
//! that where a cell without a zero of F meets another, L has the sign of F. Then the
//! zero sets of F − iso and L are isotopic.
//!
//! *Proof.* Let F_t = (1 − t)·(F − iso) + t·L, and p a zero of F_t. Cells without a zero of F have none
//! of F_t, so all simplices around p are tested ones. Let V be the element of least norm of ∂F(p), which is convex
//! and does not hold 0, as no ξ in it is orthogonal to g. Then ⟨ξ, V⟩ ≥ |V|² > 0 for all ξ in ∂F(p), and as V is one of them, ⟨g, V⟩ > 0 for all simplices at p:
//! V is a direction in which all F_s, s in [0, 1], ascend at p at a positive rate. By semicontinuity so
//! is it near p, and a partition of unity joins such directions to a smooth vector field along which all
//! F_s ascend around their zero sets. Each F_t thus has a Lipschitz zero set that the field crosses, and
//! along its flow lines that of F moves to that of L as t does from 0 to 1. ∎
//!
//! In the sides, edges and corners of the box the same holds of F and L restricted to them, with the
//! components of g and ξ along them (`boundary`), so that the field can be chosen tangential there and
//! the isotopy keeps the box. Where T meets such a part and F has no zero, L must have F's sign.
//!
//! The mesh is that of marching tetrahedra: L's zero set, with its vertices moved along their edges to roots of
//! F. Cells that cannot be proven are left as they are when dividing is of no use any more, and named
//! with a reason (`doubts`): then nothing is claimed.

mod boundary;
mod cells;
mod certificate;
mod doubts;
mod enclosing;
mod forest;
mod normals;
mod topology;
mod verify;

pub use certificate::Certificate;
pub use doubts::Cause;
pub use topology::Component;
pub use verify::{Verified, VerifyError, verify};

use glam::DVec3;
use rayon::prelude::*;

use self::cells::Frame;
use self::enclosing::Analysed;
use self::forest::{Forest, Leaf, State};
use self::topology::Count;
use super::edge_roots::{self, Root, Segment};
use super::grid::Seen;
use super::octree::decompose::Decomposition;
use super::octree::{self, Node};
use super::{Found, Job, PolygonizeError, Shape, Statistics, border, simplices, squares};
use crate::geometry::{Curves, DisjointSets};
use rustc_hash::FxHashMap;

/// What is proven of a level set.
#[derive(Clone, Debug, PartialEq)]
pub struct Certified {
    /// Whether the mesh or the curves are proven to be isotopic to the level set in the box.
    pub proven: bool,
    /// The components of what was made, without caps: those of the level set where that is proven.
    pub components: Vec<Component>,
    /// Where the proof failed: neighbouring cells together, those of most cells first.
    pub doubts: Vec<Doubt>,
    /// The proof, to be checked by others.
    pub certificate: Certificate,
}

impl Certified {
    /// Why there is nothing at this level; none if it is proven that there is something.
    pub(super) fn emptiness(&self, iso: f64, dimension: usize) -> Option<PolygonizeError> {
        match self.doubts.first() {
            Some(&Doubt { place, cause, .. }) => Some(PolygonizeError::MaybeEmpty {
                iso,
                dimension,
                place,
                cause,
            }),
            None if self.proven && self.components.is_empty() => {
                Some(PolygonizeError::ProvenEmpty { iso })
            }
            None => None,
        }
    }
}

/// A place where nothing is proven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Doubt {
    /// The middle of the box around its cells.
    pub place: DVec3,
    /// The length of that box's diagonal.
    pub size: f64,
    /// How many cells it has.
    pub cells: usize,
    /// The reason that most of them have.
    pub cause: Cause,
    /// |F − iso| and |F_x| at the place.
    pub values: [f64; 2],
}

/// Makes the level set and proves what can be proven.
pub(super) fn prove(job: &Job) -> Result<(Found, Certified), PolygonizeError> {
    let Some(field) = job.field.compiled() else {
        return Err(PolygonizeError::NothingToProveWith);
    };
    let frame = Frame::of_box(&job.options.bounds).ok_or(PolygonizeError::TooManyCells {
        needed: f64::INFINITY,
        limit: job.options.cell_limit,
    })?;
    let analysed = Analysed::new(field);
    let forest = Forest::grow(job, &analysed, &frame)?;
    let nodes: Vec<Node> = forest.leaves.iter().map(|leaf| leaf.node).collect();
    let decomposition = Decomposition::new(&forest.frame.lattice, &nodes);
    let count = counted(&forest, &decomposition, &nodes);
    let is_decided = |leaf: &Leaf| !matches!(leaf.state, State::Doubtful(_));
    // A level set that ends inside of the box would be a mistake of the program's.
    let proven = forest.leaves.iter().all(is_decided) && count.is_whole(&frame);
    let components = count.components(frame.dimension);
    let place = (&job.options.bounds, job.accuracy.iso);
    let certified = Certified {
        proven,
        doubts: doubts(&forest),
        certificate: Certificate::of(&forest, place, (proven, &components)),
        components,
    };
    let seen = seen(&forest);
    let (shape, more) = match forest.frame.dimension {
        2 => curves(job, &forest, &decomposition, &nodes)?,
        _ => {
            let piece = octree::surface(&decomposition, &nodes, &forest.values, job.options.cap)?;
            let (mesh, more) = simplices::finish(job, &forest.frame.lattice, &piece)?;
            (Shape::Mesh(mesh), more)
        }
    };
    let statistics = Statistics {
        cells: forest.leaves.len() + forest.decided.len(),
        evaluations: forest.evaluations,
        undecided: certified.doubts.iter().map(|doubt| doubt.cells).sum(),
        ..Statistics::default()
    }
    .and(more);
    let statistics = Statistics {
        proven: certified.proven,
        ..statistics
    };
    Ok(((shape, seen, statistics), certified))
}

/// The crossed simplices.
fn counted(forest: &Forest, decomposition: &Decomposition, nodes: &[Node]) -> Count {
    let lattice = &forest.frame.lattice;
    let mut count = Count::default();
    for node in nodes {
        forest
            .frame
            .for_each_simplex(decomposition, node, |corners| {
                let keys =
                    [0, 1, 2, 3].map(|index| corners.get(index).map_or(0, |&own| lattice.key(own)));
                let inside = [0, 1, 2, 3].map(|index| {
                    corners
                        .get(index)
                        .is_some_and(|&own| forest.value(own) < 0.0)
                });
                count.add(&keys[..corners.len()], &inside[..corners.len()]);
            });
    }
    count
}

/// On which side of the level cells and points were seen to be.
fn seen(forest: &Forest) -> Seen {
    let values: Vec<f64> = forest.values.values().copied().collect();
    let mut seen = Seen::of_values(&values);
    seen.inside += forest
        .decided
        .values()
        .filter(|&&is_inside| is_inside)
        .count();
    seen.outside += forest
        .decided
        .values()
        .filter(|&&is_inside| !is_inside)
        .count();
    seen
}

/// The curves in the triangles, with the inside on their left.
fn curves(
    job: &Job,
    forest: &Forest,
    decomposition: &Decomposition,
    nodes: &[Node],
) -> Result<(Shape, Statistics), PolygonizeError> {
    let lattice = &forest.frame.lattice;
    let mut numbers: FxHashMap<[u64; 2], usize> = FxHashMap::default();
    let mut crossed: Vec<Segment> = Vec::new();
    let mut segments: Vec<[usize; 2]> = Vec::new();
    let mut is_cut = false;
    for node in nodes {
        forest
            .frame
            .for_each_simplex(decomposition, node, |corners| {
                let values: Vec<f64> = corners.iter().map(|&corner| forest.value(corner)).collect();
                // Around the triangle the inside is left once and reached once.
                let mut vertex = |leaves: bool| {
                    let step = (0..3).find(|&step| {
                        (values[step] < 0.0) == leaves && (values[(step + 1) % 3] < 0.0) != leaves
                    })?;
                    let next = (step + 1) % 3;
                    let [inside, outside] = if leaves { [step, next] } else { [next, step] };
                    let name = [inside, outside].map(|corner| lattice.key(corners[corner]));
                    is_cut |= forest
                        .frame
                        .in_one_side(&[corners[inside], corners[outside]]);
                    Some(*numbers.entry(name).or_insert_with(|| {
                        let point = |corner: usize| DVec3 {
                            z: 0.0,
                            ..lattice.point(corners[corner])
                        };
                        crossed.push(Segment {
                            inside: point(inside),
                            outside: point(outside),
                            inside_value: values[inside],
                            outside_value: values[outside],
                        });
                        crossed.len() - 1
                    }))
                };
                if let (Some(leaves), Some(enters)) = (vertex(true), vertex(false)) {
                    segments.push([leaves, enters]);
                }
            });
    }
    let solved: Vec<(Vec<Root>, usize)> = crossed
        .par_chunks(4096)
        .map(|part| edge_roots::solve(&mut { job.field }, job.accuracy, part, job.monitor))
        .collect();
    if job.monitor.cancelled() {
        return Err(PolygonizeError::Cancelled);
    }
    let evaluations = solved.iter().map(|(_, count)| count).sum();
    let roots: Vec<Root> = solved.into_iter().flat_map(|(roots, _)| roots).collect();
    let positions: Vec<DVec3> = roots.iter().map(|root| root.position).collect();
    let statistics = Statistics {
        evaluations,
        cut_by_box: is_cut,
        ..Statistics::of_roots(&roots)
    };
    let mut polylines = squares::join(&positions, &segments);
    if job.options.cap {
        let is_inside = forest.corner_is_inside();
        polylines = border::closed(polylines, &job.options.bounds, is_inside);
    }
    Ok((
        Shape::Curves(Curves {
            dimension: 2,
            polylines,
        }),
        statistics,
    ))
}

/// The cells that were given up, neighbours together.
fn doubts(forest: &Forest) -> Vec<Doubt> {
    let given_up: Vec<(Node, Cause)> = forest
        .leaves
        .iter()
        .filter_map(|leaf| match leaf.state {
            State::Doubtful(cause) => Some((leaf.node, cause)),
            _ => None,
        })
        .collect();
    let mut sets = DisjointSets::new(given_up.len() as u32);
    let by_key: FxHashMap<cells::Key, u32> = given_up
        .iter()
        .enumerate()
        .map(|(number, (node, _))| (cells::key(node), number as u32))
        .collect();
    for (number, (node, _)) in given_up.iter().enumerate() {
        for neighbour in forest.frame.neighbours(node) {
            if let Some(&other) = by_key.get(&neighbour) {
                sets.union(number as u32, other);
            }
        }
    }
    let mut groups: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
    for number in 0..given_up.len() {
        groups
            .entry(sets.find(number as u32))
            .or_default()
            .push(number);
    }
    let mut groups: Vec<Vec<usize>> = groups.into_values().collect();
    groups.sort_unstable_by_key(|group| (std::cmp::Reverse(group.len()), group[0]));
    groups
        .into_iter()
        .map(|group| doubt(forest, &given_up, &group))
        .collect()
}

/// A group of cells as one place.
fn doubt(forest: &Forest, given_up: &[(Node, Cause)], group: &[usize]) -> Doubt {
    let lattice = &forest.frame.lattice;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut causes: Vec<Cause> = Vec::with_capacity(group.len());
    for &number in group {
        let (node, cause) = given_up[number];
        low = low.min(lattice.point(node.low));
        high = high.max(lattice.point(node.at([2; 3])));
        causes.push(cause);
    }
    if forest.frame.dimension == 2 {
        (low.z, high.z) = (0.0, 0.0);
    }
    causes.sort_unstable();
    let most = causes
        .chunk_by(|one, other| one == other)
        .max_by_key(|part| part.len());
    let middle = 0.5 * (low + high);
    // Of a group that is spread out the middle is elsewhere: then its first cell stands for it.
    let node = given_up[group[0]].0;
    let first = 0.5 * (lattice.point(node.low) + lattice.point(node.at([2; 3])));
    let cell = lattice
        .point(node.at([2; 3]))
        .distance(lattice.point(node.low));
    let size = low.distance(high);
    let place = if size > 8.0 * cell { first } else { middle };
    let place = if forest.frame.dimension == 2 {
        DVec3 { z: 0.0, ..place }
    } else {
        place
    };
    let (place, values) = doubts::settled(
        forest.analysed.field,
        forest.frame.dimension,
        forest.iso(),
        place,
        cell,
    );
    Doubt {
        place,
        size,
        cells: group.len(),
        cause: most.map_or(Cause::Budget, |part| part[0]),
        values,
    }
}
