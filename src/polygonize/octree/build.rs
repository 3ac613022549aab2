//! Divides the box into leaves, level by level.

use rayon::prelude::*;

use super::super::enclosure::{Colour, classify};
use super::super::simplices::Lattice;
use super::super::{Job, Leaves, PolygonizeError, check_cells};
use super::flat::is_flat;
use super::{Levels, Node};

/// How many nodes are looked at together.
const CHUNK: usize = 64;

/// The leaves.
#[derive(Default)]
pub(super) struct Tree {
    /// Those that the level set may pass through and, with a cap, the interior ones along the
    /// sides of the box: what the surface is made in.
    pub(super) boundary: Vec<Node>,
    /// The others, counted.
    pub(super) leaves: Leaves,
    /// Points at which F was evaluated.
    pub(super) evaluations: usize,
}

/// What becomes of a node.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Interior,
    Exterior,
    Boundary,
    /// To be divided.
    Open,
}

/// The leaves that the field needs.
pub(super) fn build(
    job: &Job,
    lattice: &Lattice,
    levels: &Levels,
) -> Result<Tree, PolygonizeError> {
    check_cells(
        levels.coarse.iter().map(|&count| count as f64).product(),
        job.options,
    )?;
    let mut tree = Tree::default();
    let mut open = coarse(levels);
    for level in 0..=levels.finest {
        let most = if level == levels.finest { 0 } else { 1 };
        let divided = tree.add(job, lattice, &open, most)?;
        job.monitor.progress(
            "building the octree",
            f64::from(level + 1) / f64::from(levels.finest + 1),
        );
        // What is below a node of the boundary grows with its area at least.
        let left = f64::from(levels.finest - level);
        let needed =
            tree.boundary.len() as f64 + divided.len() as f64 * (1 << (2 * left as u32)) as f64;
        check_cells(needed, job.options)?;
        open = divided.iter().flat_map(Node::children).collect();
    }
    Ok(tree)
}

/// The nodes of the coarsest level.
pub(super) fn coarse(levels: &Levels) -> Vec<Node> {
    let size = 2 << levels.finest;
    let [x, y, z] = levels.coarse.map(|count| count as u32);
    let node = |low: [u32; 3]| Node {
        level: 0,
        low: low.map(|index| index * size),
        size,
    };
    (0..z)
        .flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| node([i, j, k]))))
        .collect()
}

impl Tree {
    /// Takes nodes of one level as leaves; returns those that must be divided first, none if
    /// `divisions` is 0.
    ///
    /// # Errors
    ///
    /// Cancelled.
    pub(super) fn add(
        &mut self,
        job: &Job,
        lattice: &Lattice,
        nodes: &[Node],
        divisions: usize,
    ) -> Result<Vec<Node>, PolygonizeError> {
        let verdicts: Vec<(Vec<Verdict>, usize)> = nodes
            .par_chunks(CHUNK)
            .map(|nodes| match job.monitor.cancelled() {
                true => (Vec::new(), 0),
                false => judge(job, lattice, nodes, divisions > 0),
            })
            .collect();
        if job.monitor.cancelled() {
            return Err(PolygonizeError::Cancelled);
        }
        let mut divided = Vec::new();
        for (nodes, (verdicts, evaluations)) in nodes.chunks(CHUNK).zip(verdicts) {
            self.evaluations += evaluations;
            for (&node, verdict) in nodes.iter().zip(verdicts) {
                let level = node.level as usize;
                match verdict {
                    Verdict::Boundary => self.boundary.push(node),
                    Verdict::Interior => self.leaves.interior[level] += 1,
                    Verdict::Exterior => self.leaves.exterior[level] += 1,
                    Verdict::Open => divided.push(node),
                }
            }
        }
        Ok(divided)
    }
}

/// What becomes of nodes, and the number of evaluations that took.
fn judge(job: &Job, lattice: &Lattice, nodes: &[Node], may_divide: bool) -> (Vec<Verdict>, usize) {
    let boxes: Vec<_> = nodes
        .iter()
        .map(|node| [[0; 3], [2; 3]].map(|halves| lattice.point(node.at(halves))))
        .collect();
    let colours = match job.field.compiled() {
        Some(field) => classify(field, job.accuracy.iso, &boxes),
        None => vec![(Colour::Boundary, false); nodes.len()],
    };
    let mut verdicts: Vec<Verdict> = colours
        .iter()
        .zip(nodes)
        .map(|(&(colour, _), node)| match colour {
            Colour::Exterior => Verdict::Exterior,
            Colour::Interior if job.options.cap && node.touches_side(lattice) => Verdict::Boundary,
            Colour::Interior => Verdict::Interior,
            Colour::Boundary if may_divide => Verdict::Open,
            Colour::Boundary => Verdict::Boundary,
        })
        .collect();
    // Only where the surface is provably one sheet is it looked at closer.
    let sheets: Vec<usize> = (0..nodes.len())
        .filter(|&index| verdicts[index] == Verdict::Open && colours[index].1)
        .collect();
    let candidates: Vec<Node> = sheets.iter().map(|&index| nodes[index]).collect();
    let flat = is_flat(job, lattice, &candidates);
    for (&index, flat) in sheets.iter().zip(&flat.leaves) {
        if *flat {
            verdicts[index] = Verdict::Boundary;
        }
    }
    (verdicts, flat.evaluations)
}
