//! Fans in place of patches.
//!
//! A centre beyond the sides of its own patch, where the sharp edge runs through a cell whose roots do
//! not tell of it, makes triangles that lie upside down over a neighbouring patch. A fan with such
//! ones is made only if flips with the triangles below put all of them right.

use rustc_hash::{FxHashMap, FxHashSet};

use super::fans::Fan;
use super::flips;
use crate::geometry::Mesh;
use crate::polygonize::grid::Grid;
use crate::polygonize::{Job, PolygonizeError};

/// Replaces patches by fans, and flips edges until sharp edges are edges of the mesh. Returns the
/// number of evaluations.
pub(super) fn weave(
    (job, grid, mesh): (&Job, &Grid, &mut Mesh),
    fans: &[Fan],
) -> Result<usize, PolygonizeError> {
    if fans.is_empty() {
        return Ok(0);
    }
    let first = mesh.positions.len();
    let vertices = first + fans.len();
    if u32::try_from(vertices).is_err() {
        return Err(PolygonizeError::TooManyVertices { vertices });
    }
    mesh.positions.extend(fans.iter().map(|fan| fan.position));
    mesh.normals.extend(fans.iter().map(|fan| fan.normal));
    let mut weaver = Weaver::new(mesh, fans);
    let numbered = || fans.iter().zip(first as u32..);
    for (fan, centre) in numbered().filter(|(fan, _)| fan.turned.is_empty()) {
        weaver.add(fan, centre);
    }
    for (fan, centre) in numbered().filter(|(fan, _)| !fan.turned.is_empty()) {
        weaver.add_with_flips(fan, centre);
    }
    let Weaver {
        triangles, gone, ..
    } = weaver;
    let kept = triangles.into_iter().zip(gone).filter(|(_, gone)| !gone);
    let mut triangles: Vec<[u32; 3]> = kept.map(|(corners, _)| corners).collect();
    let evaluations = flips::flip((job, grid, mesh), first as u32, &mut triangles);
    mesh.triangles = triangles;
    Ok(evaluations)
}

/// A mesh that is being changed.
struct Weaver<'a> {
    mesh: &'a Mesh,
    triangles: Vec<[u32; 3]>,
    /// Which of them are replaced.
    gone: Vec<bool>,
    /// Which have been changed by a flip; they are not changed again.
    flipped: Vec<bool>,
    /// The triangles at the sides of fans, and at those sides of patches beyond which a fan is upside
    /// down.
    at_side: FxHashMap<[u32; 2], usize>,
    /// The pairs of vertices that flips have joined.
    joined: FxHashSet<[u32; 2]>,
}

/// The flip of the edge between two triangles: what becomes of them.
struct Flip {
    numbers: [usize; 2],
    corners: [[u32; 3]; 2],
    joins: [u32; 2],
}

impl<'a> Weaver<'a> {
    fn new(mesh: &'a Mesh, fans: &[Fan]) -> Weaver<'a> {
        let turned = fans.iter().flat_map(|fan| {
            let side = |&place: &usize| fan.sides[place];
            fan.turned.iter().map(side)
        });
        let beyond: FxHashSet<[u32; 2]> = turned.map(|[from, to]| [to, from]).collect();
        let mut at_side = FxHashMap::default();
        if !beyond.is_empty() {
            for (number, &[a, b, c]) in mesh.triangles.iter().enumerate() {
                let sides = [[a, b], [b, c], [c, a]].into_iter();
                let wanted = sides.filter(|side| beyond.contains(side));
                at_side.extend(wanted.map(|side| (side, number)));
            }
        }
        Weaver {
            mesh,
            triangles: mesh.triangles.clone(),
            gone: vec![false; mesh.triangles.len()],
            flipped: vec![false; mesh.triangles.len()],
            at_side,
            joined: FxHashSet::default(),
        }
    }

    /// Adds a fan in place of its patch.
    fn add(&mut self, fan: &Fan, centre: u32) {
        for &triangle in &fan.replaced {
            self.gone[triangle] = true;
        }
        for &[from, to] in &fan.sides {
            self.at_side.insert([from, to], self.triangles.len());
            self.triangles.push([from, to, centre]);
            self.gone.push(false);
            self.flipped.push(false);
        }
    }

    /// Adds a fan with triangles that are upside down, and flips these; or leaves the patch.
    fn add_with_flips(&mut self, fan: &Fan, centre: u32) {
        if fan.replaced.iter().any(|&triangle| self.flipped[triangle]) {
            return;
        }
        let first = self.triangles.len();
        let flips = fan.turned.iter().map(|&place| {
            let below = self.below(fan.sides[place])?;
            let flip = self.flip(
                fan.sides[place],
                [first + place, below.0],
                [centre, below.1],
            )?;
            let is_new = fan.sides.iter().all(|&[corner, _]| corner != below.1);
            is_new.then_some(flip)
        });
        let Some(flips) = flips.collect::<Option<Vec<Flip>>>() else {
            return;
        };
        let mut others: Vec<[usize; 2]> = flips
            .iter()
            .map(|flip| [flip.numbers[1], flip.joins[1] as usize])
            .collect();
        others.sort_unstable();
        // Neither a triangle nor a corner twice.
        let mut corners: Vec<usize> = others.iter().map(|other| other[1]).collect();
        corners.sort_unstable();
        if others.windows(2).any(|pair| pair[0][0] == pair[1][0])
            || corners.windows(2).any(|pair| pair[0] == pair[1])
        {
            return;
        }
        self.add(fan, centre);
        for flip in flips {
            self.apply(flip);
        }
    }

    /// The triangle beyond a side that may be changed, and its corner across.
    fn below(&self, [from, to]: [u32; 2]) -> Option<(usize, u32)> {
        let number = *self.at_side.get(&[to, from])?;
        let corners = self.triangles[number];
        let across = corners
            .into_iter()
            .find(|corner| ![from, to].contains(corner))?;
        (!self.gone[number] && !self.flipped[number]).then_some((number, across))
    }

    /// The flip of a side, from which the corners across are joined; `None` if a triangle would turn
    /// its back to the surface.
    fn flip(&self, [from, to]: [u32; 2], numbers: [usize; 2], joins: [u32; 2]) -> Option<Flip> {
        let [one, two] = joins;
        let corners = [[from, two, one], [to, one, two]];
        let pair = [one.min(two), one.max(two)];
        let is_sound = one != two
            && !self.joined.contains(&pair)
            && corners.iter().all(|corners| self.faces_outward(*corners));
        is_sound.then_some(Flip {
            numbers,
            corners,
            joins,
        })
    }

    fn apply(&mut self, flip: Flip) {
        let [one, two] = flip.joins;
        self.joined.insert([one.min(two), one.max(two)]);
        for (number, corners) in flip.numbers.into_iter().zip(flip.corners) {
            self.triangles[number] = corners;
            self.flipped[number] = true;
        }
    }

    /// Whether a triangle does not turn its back to the surface at its first corner, a root.
    fn faces_outward(&self, triangle: [u32; 3]) -> bool {
        let [a, b, c] = triangle.map(|vertex| self.mesh.positions[vertex as usize]);
        let across = (b - a).cross(c - a);
        across.dot(self.mesh.normals[triangle[0] as usize]) >= 0.0
    }
}
