//! What the zero set of the linear interpolant is: a count, no computation.
//!
//! In every simplex that has corners on both sides the zero set is one convex polygon or, in R2,
//! one segment. Its corners are crossed edges, its edges are crossed faces. So a component's Euler
//! characteristic is the number of its crossed edges, less that of its crossed triangles and, in R3,
//! plus that of its crossed tetrahedra. What is crossed and in one simplex only is its boundary.

use rustc_hash::FxHashMap;

use super::cells::Frame;
use crate::geometry::DisjointSets;

/// A connected part of a level set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Component {
    /// The Euler characteristic: of a closed surface in space 2 − 2·genus, of a closed curve 0.
    pub euler: i64,
    /// The number of closed curves that bound a surface; the number of ends of a curve.
    pub boundaries: usize,
}

impl Component {
    /// The number of handles of a surface: the genus of what it is with a disk in every boundary. `None` if
    /// the counts do not belong to an orientable surface.
    pub fn genus(&self) -> Option<u64> {
        let doubled = 2 - self.euler - i64::try_from(self.boundaries).ok()?;
        (doubled >= 0 && doubled % 2 == 0).then_some(doubled.unsigned_abs() / 2)
    }
}

/// A crossed triangle; in R2 it is a simplex.
struct Triangle {
    /// The numbers of its corners, ascending.
    corners: [u64; 3],
    /// Its crossed edges.
    crossed: [u32; 2],
    /// In how many simplices it is.
    uses: u32,
}

/// The count in the making.
#[derive(Default)]
pub(super) struct Count {
    /// The numbers of crossed edges.
    edges: FxHashMap<[u64; 2], u32>,
    /// Of every crossed simplex one crossed edge of it.
    simplices: Vec<u32>,
    /// The crossed triangles, and their numbers.
    triangles: Vec<Triangle>,
    numbers: FxHashMap<[u64; 3], u32>,
    joined: Vec<[u32; 2]>,
}

impl Count {
    /// Adds a simplex, given by its corners' numbers and which of them are inside.
    pub(super) fn add(&mut self, corners: &[u64], inside: &[bool]) {
        if inside.iter().all(|&own| own == inside[0]) {
            return;
        }
        let mut first = None;
        let count = corners.len();
        for a in 0..count {
            for b in a + 1..count {
                for c in b + 1..count {
                    if let Some(edge) = self.add_triangle([a, b, c], corners, inside) {
                        let first = *first.get_or_insert(edge);
                        self.joined.push([first, edge]);
                    }
                }
            }
        }
        self.simplices.extend(first);
    }

    /// Adds a triangle of a simplex if it is crossed, and gives the number of a crossed edge of it.
    fn add_triangle(
        &mut self,
        places: [usize; 3],
        corners: &[u64],
        inside: &[bool],
    ) -> Option<u32> {
        let sides = [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end| places[end]));
        let mut crossed = sides.iter().filter(|[a, b]| inside[*a] != inside[*b]);
        let (one, other) = (crossed.next()?, crossed.next()?);
        let numbers = [one, other].map(|ends| {
            let mut name = ends.map(|end| corners[end]);
            name.sort_unstable();
            let next = self.edges.len() as u32;
            *self.edges.entry(name).or_insert(next)
        });
        let mut name = places.map(|place| corners[place]);
        name.sort_unstable();
        let next = self.triangles.len() as u32;
        let number = *self.numbers.entry(name).or_insert(next);
        if number == next {
            self.triangles.push(Triangle {
                corners: name,
                crossed: numbers,
                uses: 0,
            });
        }
        self.triangles[number as usize].uses += 1;
        self.joined.push(numbers);
        Some(numbers[0])
    }

    /// Whether what was counted ends nowhere but in the sides of the box.
    pub(super) fn is_whole(&self, frame: &Frame) -> bool {
        let place = |key: u64| frame.lattice.place(key);
        match frame.dimension {
            2 => (self.ends().iter()).all(|ends| frame.in_one_side(&ends.map(place))),
            _ => {
                let mut open = self.open_triangles();
                !self.is_branched() && open.all(|corners| frame.in_one_side(&corners.map(place)))
            }
        }
    }

    /// Crossed triangles that are in one simplex only, by their corners' numbers, in any order.
    fn open_triangles(&self) -> impl Iterator<Item = &[u64; 3]> {
        let open = self.triangles.iter().filter(|own| own.uses == 1);
        open.map(|own| &own.corners)
    }

    /// Whether a crossed triangle is in more than two simplices, which no triangulation has.
    fn is_branched(&self) -> bool {
        self.triangles.iter().any(|own| own.uses > 2)
    }

    /// Crossed edges, and of how many triangles each is a side.
    fn uses(&self) -> Vec<u32> {
        let mut uses = vec![0; self.edges.len()];
        for Triangle { crossed, .. } in &self.triangles {
            crossed.iter().for_each(|&edge| uses[edge as usize] += 1);
        }
        uses
    }

    /// The crossed edges that are in one triangle only: in R2 where curves end.
    fn ends(&self) -> Vec<[u64; 2]> {
        let uses = self.uses();
        let ends = self
            .edges
            .iter()
            .filter(|(_, number)| uses[**number as usize] == 1);
        ends.map(|(&name, _)| name).collect()
    }

    /// The components, in ascending order.
    pub(super) fn components(&self, dimension: usize) -> Vec<Component> {
        let count = self.edges.len() as u32;
        let mut sets = DisjointSets::new(count);
        for &[one, other] in &self.joined {
            sets.union(one, other);
        }
        let mut found = vec![
            Component {
                euler: 0,
                boundaries: 0
            };
            count as usize
        ];
        for edge in 0..count {
            found[sets.find(edge) as usize].euler += 1;
        }
        for Triangle { crossed, .. } in &self.triangles {
            found[sets.find(crossed[0]) as usize].euler -= 1;
        }
        if dimension == 3 {
            for &edge in &self.simplices {
                found[sets.find(edge) as usize].euler += 1;
            }
            let mut loops = DisjointSets::new(count);
            let mut on_boundary = vec![false; count as usize];
            for Triangle { crossed, uses, .. } in &self.triangles {
                if *uses == 1 {
                    loops.union(crossed[0], crossed[1]);
                    crossed
                        .iter()
                        .for_each(|&edge| on_boundary[edge as usize] = true);
                }
            }
            for edge in (0..count).filter(|&edge| on_boundary[edge as usize]) {
                if loops.find(edge) == edge {
                    found[sets.find(edge) as usize].boundaries += 1;
                }
            }
        } else {
            for (edge, uses) in self.uses().into_iter().enumerate() {
                if uses == 1 {
                    found[sets.find(edge as u32) as usize].boundaries += 1;
                }
            }
        }
        let mut components: Vec<Component> = (0..count)
            .filter(|&edge| sets.find(edge) == edge)
            .map(|edge| found[edge as usize])
            .collect();
        components.sort_unstable();
        components
    }
}
