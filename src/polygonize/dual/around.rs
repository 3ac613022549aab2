//! Which facets or triangles meet at a vertex.

use super::facets::Patch;
use super::place::Vertex;

/// The facets around vertices.
pub(super) struct Around {
    starts: Vec<u32>,
    facets: Vec<u32>,
}

impl Around {
    /// Of all facets; O(facets).
    pub(super) fn new(facets: &[impl Patch], vertices: usize) -> Around {
        let mut starts = vec![0u32; vertices + 1];
        for &corner in facets.iter().flat_map(Patch::corners) {
            starts[corner as usize + 1] += 1;
        }
        for vertex in 0..vertices {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut around = vec![0; starts[vertices] as usize];
        for (number, facet) in facets.iter().enumerate() {
            for &corner in facet.corners() {
                around[next[corner as usize] as usize] = number as u32;
                next[corner as usize] += 1;
            }
        }
        Around {
            starts,
            facets: around,
        }
    }

    /// The facets around a vertex.
    pub(super) fn of<'a, P>(&'a self, facets: &'a [P], vertex: u32) -> impl Iterator<Item = &'a P> {
        let numbers = self.numbers(vertex).iter();
        numbers.map(|&number| &facets[number as usize])
    }

    /// Their numbers.
    pub(super) fn numbers(&self, vertex: u32) -> &[u32] {
        let range = self.starts[vertex as usize]..self.starts[vertex as usize + 1];
        &self.facets[range.start as usize..range.end as usize]
    }
}

/// The shape of the worst triangle in the facets around a vertex.
pub(super) fn worst(
    around: &Around,
    facets: &[impl Patch],
    vertices: &[Vertex],
    vertex: u32,
) -> f64 {
    let shapes = around
        .of(facets, vertex)
        .map(|facet| facet.fitness(vertices));
    shapes.fold(1.0, f64::min)
}
