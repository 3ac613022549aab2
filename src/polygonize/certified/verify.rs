//! The checker: proves again, from a certificate alone, what it claims.
//!
//! It computes everything anew and trusts nothing that the certificate says. With the maker it
//! shares the division of cells into simplices and the count of what is crossed; it does not search,
//! evaluates box after box by the table's rules, and does its arithmetic with intervals.

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::super::error::in_words;
use super::super::octree::Node;
use super::super::octree::decompose::Decomposition;
use super::super::simplices::Place;
use super::cells::{FINEST, Frame, Key, key};
use super::certificate::Certificate;
use super::enclosing::{self, Analysed, Known};
use super::topology::{Component, Count};
use crate::engine::{CompiledField, Field, Monitor, Program, Tier};
use crate::geometry::Bounds;
use crate::graph::{Graph, Interval, NodeId, Op};
use glam::DVec3;

/// How many cells make one piece of parallel work.
const CHUNK: usize = 256;

/// What was proven again.
#[derive(Clone, Debug, PartialEq)]
pub struct Verified {
    /// Whether all of the box is proven; if not, nothing is known of the topology.
    pub proven: bool,
    /// The box.
    pub bounds: Bounds,
    /// The nodes of the field.
    pub nodes: usize,
    /// Cells in which F − iso has no zero.
    pub decided: usize,
    /// Cells in which the normals of all simplices were tested.
    pub tested: usize,
    /// The middles of the cells of which nothing is proven.
    pub undecided: Vec<DVec3>,
    /// The components of the level set, if it is proven.
    pub components: Vec<Component>,
}

/// Why a certificate is not accepted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum VerifyError {
    /// It is not a certificate, or was altered.
    #[error("it is not a certificate, or was altered after it was written")]
    NotWhole,
    /// The field is none.
    #[error("its field cannot be read: {0}")]
    BadField(String),
    /// The box or its division is none.
    #[error("its box is not divided as it should be")]
    BadBox,
    /// The tree does not fill the box.
    #[error("its cells do not fill the box")]
    BadTree,
    /// What is said of a cell is not true, or cannot be proven.
    #[error("the cell around {place} is not proven to be what it is said to be: {what}")]
    CellFails {
        /// The middle of the cell, in words.
        place: String,
        /// What cannot be proven.
        what: &'static str,
    },
    /// The sign that F − iso is computed to have at a corner of cells is not proven.
    #[error("the sign of F at the corner {place} of a cell is not proven")]
    CornerFails {
        /// The corner, in words.
        place: String,
    },
    /// The components are others.
    #[error("what it says of the level set does not follow from its cells")]
    OtherClaims,
    /// The monitor asked for an end.
    #[error("cancelled")]
    Cancelled,
}

/// Proves again what a certificate claims.
///
/// # Errors
///
/// The first reason why the claim is not proven, or cancellation.
pub fn verify(text: &str, monitor: &dyn Monitor) -> Result<Verified, VerifyError> {
    let certificate = Certificate::read(text).ok_or(VerifyError::NotWhole)?;
    let sides = &certificate.sides;
    let bounds = Bounds::from_sides(sides)
        .filter(|_| matches!(sides.len(), 2 | 3) && certificate.coarse.len() == sides.len())
        .filter(|bounds| bounds.diagonal().is_finite() && certificate.iso.is_finite())
        .ok_or(VerifyError::BadBox)?;
    if !sides.iter().all(|(low, high)| low < high) {
        return Err(VerifyError::BadBox);
    }
    let (field, nodes) = field(&certificate, bounds.dimension)?;
    let mut coarse = [1; 3];
    coarse[..bounds.dimension].copy_from_slice(&certificate.coarse);
    let frame = Frame::new(&bounds, coarse).ok_or(VerifyError::BadBox)?;
    let cells = cells(&frame, &certificate.tree)?;
    let analysed = Analysed::new(&field);
    let mut check = Check::new(&analysed, &frame, certificate.iso, &cells, monitor)?;
    check.decided(&cells)?;
    check.corners(&cells)?;
    check.tested(&cells)?;
    let claims = check.claims(&cells)?;
    let count = |letters: &str| {
        cells
            .iter()
            .filter(|(_, own)| letters.contains(*own))
            .count()
    };
    let undecided = cells.iter().filter(|(_, letter)| *letter == '?');
    let undecided: Vec<DVec3> = undecided.map(|(node, _)| middle(&frame, node)).collect();
    if claims != certificate.components || certificate.proven != undecided.is_empty() {
        return Err(VerifyError::OtherClaims);
    }
    Ok(Verified {
        proven: certificate.proven,
        bounds,
        nodes,
        decided: count("+-c"),
        tested: count("n"),
        undecided,
        components: claims,
    })
}

/// The field of a certificate, which is evaluated by the table's rules, and its number of nodes.
fn field(
    certificate: &Certificate,
    dimension: usize,
) -> Result<(CompiledField, usize), VerifyError> {
    let bad = |line: &str| VerifyError::BadField(format!("`{line}` is no node"));
    let mut graph = Graph::new();
    let mut nodes: Vec<NodeId> = Vec::new();
    let mut root = None;
    for line in certificate.field.lines() {
        if root.is_some() {
            return Err(bad(line));
        }
        let operand = |word: &str| {
            let number: usize = word.strip_prefix('n')?.parse().ok()?;
            nodes.get(number).copied()
        };
        if let Some(word) = line.strip_prefix("output ") {
            root = Some(operand(word).ok_or_else(|| bad(line))?);
            continue;
        }
        let rest = line.strip_prefix(&format!("n{} = ", nodes.len()));
        let words: Vec<&str> = rest.ok_or_else(|| bad(line))?.split(' ').collect();
        let operands: Option<Vec<NodeId>> = words[1..].iter().map(|word| operand(word)).collect();
        let operands = operands.ok_or_else(|| bad(line))?;
        let node = node(
            &mut graph,
            words[0],
            &operands,
            (dimension, certificate.parameters.len()),
        );
        nodes.push(node.ok_or_else(|| bad(line))?);
    }
    let root = root.ok_or_else(|| bad("output"))?;
    let program = Program::with_tier(&graph, &[root], dimension, Tier::Interpreter);
    let q = program.parameters().iter();
    let q = q.filter_map(|&place| certificate.parameters.get(place as usize).copied());
    let q = q.collect();
    Ok((CompiledField::new(Arc::new(program), q), nodes.len()))
}

/// The node of a word and its operands.
fn node(
    graph: &mut Graph,
    word: &str,
    operands: &[NodeId],
    (dimension, parameters): (usize, usize),
) -> Option<NodeId> {
    if let Some(&op) = Op::ALL.iter().find(|op| op.name() == word) {
        return (op.arity() == operands.len()).then(|| graph.apply(op, operands));
    }
    if !operands.is_empty() {
        return None;
    }
    if let Some(axis) = ["x", "y", "z"]
        .iter()
        .take(dimension)
        .position(|name| *name == word)
    {
        return Some(graph.coordinate(axis));
    }
    if let Some(place) = word.strip_prefix('q') {
        let place: usize = place.parse().ok()?;
        return (place < parameters).then(|| graph.parameter(place));
    }
    Some(graph.constant(word.parse().ok()?))
}

/// The cells with their letters.
fn cells(frame: &Frame, tree: &str) -> Result<Vec<(Node, char)>, VerifyError> {
    let mut cells = Vec::new();
    let mut stack = frame.roots();
    stack.reverse();
    for letter in tree.chars() {
        let node = stack.pop().ok_or(VerifyError::BadTree)?;
        match letter {
            '(' if node.level < FINEST => {
                let children: Vec<Node> = frame.children(&node).collect();
                stack.extend(children.into_iter().rev());
            }
            '+' | '-' | 'c' | 'n' | '?' => cells.push((node, letter)),
            _ => return Err(VerifyError::BadTree),
        }
    }
    match stack.is_empty() {
        true => Ok(cells),
        false => Err(VerifyError::BadTree),
    }
}

/// The middle of a cell.
fn middle(frame: &Frame, node: &Node) -> DVec3 {
    let sides = frame.sides(node);
    DVec3::from_array(sides.map(|side| 0.5 * (side.low + side.high)))
}

/// The check in progress.
struct Check<'a> {
    analysed: &'a Analysed<'a>,
    frame: &'a Frame,
    iso: f64,
    monitor: &'a dyn Monitor,
    decomposition: Decomposition<'a>,
    /// The cells that are divided into simplices.
    active: FxHashSet<Key>,
    /// F − iso at the corners of simplices, by number.
    values: FxHashMap<u64, f64>,
}

impl<'a> Check<'a> {
    /// Evaluates F at the corners of all simplices.
    fn new(
        analysed: &'a Analysed<'a>,
        frame: &'a Frame,
        iso: f64,
        cells: &[(Node, char)],
        monitor: &'a dyn Monitor,
    ) -> Result<Self, VerifyError> {
        let divided = cells.iter().filter(|(_, letter)| "cn?".contains(*letter));
        let nodes: Vec<Node> = divided.map(|(node, _)| *node).collect();
        let decomposition = Decomposition::new(&frame.lattice, &nodes);
        let mut places: Vec<u64> = Vec::new();
        for node in &nodes {
            frame.for_each_simplex(&decomposition, node, |corners| {
                places.extend(corners.iter().map(|&corner| frame.lattice.key(corner)));
            });
        }
        places.par_sort_unstable();
        places.dedup();
        let values: Vec<f64> = places
            .par_iter()
            .map(|&place| {
                let point = frame.lattice.point(frame.lattice.place(place));
                analysed.field.value(point) - iso
            })
            .collect();
        if monitor.cancelled() {
            return Err(VerifyError::Cancelled);
        }
        Ok(Check {
            analysed,
            frame,
            iso,
            monitor,
            decomposition,
            active: nodes.iter().map(key).collect(),
            values: places.into_iter().zip(values).collect(),
        })
    }

    fn fails(&self, node: &Node, what: &'static str) -> VerifyError {
        VerifyError::CellFails {
            place: in_words(middle(self.frame, node), self.frame.dimension),
            what,
        }
    }

    /// Looks at each of some cells; gives the first failure.
    fn each(
        &self,
        cells: &[(Node, char)],
        letters: &str,
        look: impl Fn(&Node, char) -> Result<(), VerifyError> + Sync,
    ) -> Result<(), VerifyError> {
        let failure = cells
            .par_chunks(CHUNK)
            .filter_map(|cells| {
                if self.monitor.cancelled() {
                    return Some(VerifyError::Cancelled);
                }
                let mut own = cells.iter().filter(|(_, letter)| letters.contains(*letter));
                own.find_map(|(node, letter)| look(node, *letter).err())
            })
            .collect::<Vec<_>>();
        failure.into_iter().next().map_or(Ok(()), Err)
    }

    /// Checks the cells without a zero.
    fn decided(&self, cells: &[(Node, char)]) -> Result<(), VerifyError> {
        self.each(cells, "+-c", |node, letter| {
            let known = self.sign(self.frame.sides(node));
            match known == Some(letter != '+') {
                true => Ok(()),
                false => Err(self.fails(node, "F − iso may vanish in it, or has the other sign")),
            }
        })?;
        self.each(cells, "c", |node, _| match self.has_sign(node, true) {
            true => Ok(()),
            false => Err(self.fails(node, "F − iso is computed with the other sign")),
        })
    }

    /// Whether F − iso is computed to be inside, or outside, at all corners of a cell's simplices.
    fn has_sign(&self, node: &Node, is_inside: bool) -> bool {
        let mut agrees = true;
        self.frame
            .for_each_simplex(&self.decomposition, node, |corners| {
                agrees &= corners
                    .iter()
                    .all(|&corner| (self.value(corner) < 0.0) == is_inside);
            });
        agrees
    }

    /// Whether F < iso in a box, if F has no zero in it.
    fn sign(&self, sides: [Interval; 3]) -> Option<bool> {
        match enclosing::judge(self.analysed, self.iso, &[sides])[..] {
            [Known::Decided { is_inside }] => Some(is_inside),
            _ => None,
        }
    }

    /// F − iso as computed at a corner of a simplex.
    fn value(&self, place: Place) -> f64 {
        let known = self.values.get(&self.frame.lattice.key(place));
        known.copied().unwrap_or(f64::NAN)
    }

    /// Checks that corners of simplices at cells without a zero have the sign that is proven. Those of
    /// cells of which nothing is claimed need not.
    fn corners(&self, cells: &[(Node, char)]) -> Result<(), VerifyError> {
        let mut claimed: FxHashSet<u64> = FxHashSet::default();
        for (node, _) in cells.iter().filter(|(_, letter)| "cn".contains(*letter)) {
            let lattice = &self.frame.lattice;
            self.frame
                .for_each_simplex(&self.decomposition, node, |corners| {
                    claimed.extend(corners.iter().map(|&corner| lattice.key(corner)));
                });
        }
        let wrong: Vec<Place> = (claimed.par_iter())
            .filter_map(|&number| {
                let value = self.values.get(&number).copied().unwrap_or(f64::NAN);
                let place = self.frame.lattice.place(number);
                let point = self.frame.hull(&[place]);
                let natural = enclosing::values(self.analysed.field, &[point]);
                let is_proven = matches!(
                    enclosing::decided(&natural[0], self.iso, 0.0),
                    Some(Known::Decided { is_inside }) if is_inside == (value < 0.0)
                );
                (!is_proven && self.touches_decided(place)).then_some(place)
            })
            .collect();
        match wrong.into_iter().min() {
            Some(place) => Err(VerifyError::CornerFails {
                place: in_words(self.frame.lattice.point(place), self.frame.dimension),
            }),
            None => Ok(()),
        }
    }

    /// Whether a place belongs to a cell that is not divided into simplices.
    fn touches_decided(&self, place: Place) -> bool {
        let dimension = self.frame.dimension;
        let top = self.frame.lattice.top;
        (0..1u32 << dimension).any(|octant| {
            let mut low = place;
            for axis in 0..dimension {
                let is_lower = octant >> axis & 1 == 1;
                if low[axis] == if is_lower { 0 } else { top[axis] } {
                    return false;
                }
                low[axis] -= u32::from(is_lower);
            }
            let holds = |power: u32| {
                let size = 1 << power;
                self.active
                    .contains(&(low.map(|place| place / size * size), size))
            };
            !(1..=FINEST + 1).any(holds)
        })
    }

    /// Checks the cells whose normals are said to be tested.
    fn tested(&self, cells: &[(Node, char)]) -> Result<(), VerifyError> {
        self.each(cells, "n", |node, _| {
            let sides = self.frame.sides(node);
            if let Some(is_inside) = self.sign(sides) {
                // Found to be without a zero after all: then signs suffice.
                return match self.has_sign(node, is_inside) {
                    true => Ok(()),
                    false => Err(self.fails(node, "F − iso is computed with the other sign")),
                };
            }
            let Some(slopes) = self.slopes(sides) else {
                return Err(self.fails(node, "F may jump in it, or its gradient is not bounded"));
            };
            let mut failure = None;
            self.frame
                .for_each_simplex(&self.decomposition, node, |corners| {
                    if failure.is_none() {
                        failure = self.simplex(corners, &slopes).err();
                    }
                });
            failure.map_or(Ok(()), |what| Err(self.fails(node, what)))
        })
    }

    /// An enclosure of F's gradients in a box in which F is Lipschitz.
    fn slopes(&self, sides: [Interval; 3]) -> Option<[Interval; 3]> {
        match enclosing::judge(self.analysed, self.iso, &[sides])[..] {
            [Known::Gradients(slopes)] => Some(slopes),
            _ => None,
        }
    }

    /// Checks a simplex, also in the parts of the box's boundary that it touches.
    fn simplex(&self, corners: &[Place], slopes: &[Interval; 3]) -> Result<(), &'static str> {
        let dimension = self.frame.dimension;
        let normal = self.gradient(corners);
        if !is_positive(&normal[..dimension], slopes, 0) {
            return Err("the normals of a simplex and of F may differ by a right angle");
        }
        let border = |place: &Place| self.frame.border(*place);
        for part in 1u8..1 << self.frame.dimension {
            let own = |place: &&Place| border(place) & part == part;
            let touching: Vec<Place> = corners.iter().filter(own).copied().collect();
            if touching.is_empty() || is_positive(&normal[..dimension], slopes, part) {
                continue;
            }
            let hull = self.frame.hull(&touching);
            let is_inside = self.value(touching[0]) < 0.0;
            let agree = touching
                .iter()
                .all(|&place| (self.value(place) < 0.0) == is_inside);
            let has_sign = agree && self.sign(hull) == Some(is_inside);
            let along = || {
                self.slopes(hull)
                    .is_some_and(|own| is_positive(&normal[..dimension], &own, part))
            };
            if !has_sign && !along() {
                return Err("the level set may touch a side of the box there");
            }
        }
        Ok(())
    }

    /// The gradient of the linear function that has the computed values at the corners, enclosed.
    fn gradient(&self, corners: &[Place]) -> [Interval; 3] {
        let mut gradient = [None; 3];
        for pair in corners.windows(2).rev() {
            let [to, from] = [pair[0], pair[1]];
            let point = |value: f64| Interval::new(value, value);
            let mut rise = point(self.value(to)) - point(self.value(from));
            let mut new = None;
            for axis in (0..self.frame.dimension).filter(|&axis| from[axis] != to[axis]) {
                let ends = [to, from].map(|place| self.frame.lattice.coordinate(axis, place[axis]));
                let step = point(ends[0]) - point(ends[1]);
                match gradient[axis] {
                    Some(known) => rise = rise - step * known,
                    None => new = Some((axis, step)),
                }
            }
            if let Some((axis, step)) = new {
                gradient[axis] = Some(rise / step);
            }
        }
        gradient.map(|component| component.unwrap_or(Interval::EMPTY))
    }

    /// The components, by counting what is crossed.
    fn claims(&mut self, cells: &[(Node, char)]) -> Result<Vec<Component>, VerifyError> {
        let frame = self.frame;
        let mut count = Count::default();
        let divided = cells.iter().filter(|(_, letter)| "cn?".contains(*letter));
        for (node, _) in divided {
            frame.for_each_simplex(&self.decomposition, node, |corners| {
                let keys: Vec<u64> = corners.iter().map(|&own| frame.lattice.key(own)).collect();
                let inside: Vec<bool> = corners.iter().map(|&own| self.value(own) < 0.0).collect();
                count.add(&keys, &inside);
            });
        }
        let is_proven = cells.iter().all(|(_, letter)| *letter != '?');
        if is_proven && !count.is_whole(frame) {
            return Err(VerifyError::OtherClaims);
        }
        Ok(count.components(frame.dimension))
    }
}

/// Whether the inner product of two boxes, without the components in the set of bits, is positive.
fn is_positive(one: &[Interval], other: &[Interval], without: u8) -> bool {
    let mut sum = Interval::new(0.0, 0.0);
    for (axis, (&one, &other)) in one.iter().zip(other).enumerate() {
        if without >> axis & 1 == 0 {
            sum = sum + one * other;
        }
    }
    sum.low > 0.0 && sum.low <= sum.high
}
