//! A mesh while its edges are collapsed, split and flipped: its triangles and which of them are
//! around each vertex, with the condition under which a collapse keeps the topology.
//!
//! Link condition: T. K. Dey, H. Edelsbrunner, S. Guha, D. V. Nekhayev, "Topology preserving edge
//! contraction", Publ. Inst. Math. 66 (1999).

/// No corner: the end of a list.
const NONE: u32 = u32::MAX;

/// Triangles that change. Corner `3·t + k` is vertex `k` of triangle `t`; the corners at each vertex
/// are a linked list.
pub(super) struct Surgery {
    triangles: Vec<[u32; 3]>,
    removed: Vec<bool>,
    /// The first corner at each vertex.
    first: Vec<u32>,
    /// The corner that follows at the same vertex.
    next: Vec<u32>,
}

/// The vertices around a vertex with the number of triangles on the edge to each, ascending.
type Neighbours = Vec<(u32, u32)>;

impl Surgery {
    /// The triangles of a mesh with so many vertices.
    pub(super) fn new(triangles: Vec<[u32; 3]>, vertices: usize) -> Self {
        let mut surgery = Surgery {
            removed: vec![false; triangles.len()],
            first: vec![NONE; vertices],
            next: vec![NONE; 3 * triangles.len()],
            triangles,
        };
        for number in (0..surgery.triangles.len() as u32).rev() {
            surgery.link(number);
        }
        surgery
    }

    /// Enters a triangle into the lists of its vertices.
    fn link(&mut self, triangle: u32) {
        for (k, vertex) in (0..3).zip(self.triangles[triangle as usize]) {
            let corner = 3 * triangle + k;
            self.next[corner as usize] = self.first[vertex as usize];
            self.first[vertex as usize] = corner;
        }
    }

    /// Takes a triangle out of the lists of its vertices.
    fn unlink(&mut self, triangle: u32) {
        for (k, vertex) in (0..3).zip(self.triangles[triangle as usize]) {
            let corner = 3 * triangle + k;
            let after = self.next[corner as usize];
            let mut at = self.first[vertex as usize];
            if at == corner {
                self.first[vertex as usize] = after;
                continue;
            }
            while at != NONE {
                let following = self.next[at as usize];
                if following == corner {
                    self.next[at as usize] = after;
                    break;
                }
                at = following;
            }
        }
    }

    /// The triangles that are left, in their order.
    pub(super) fn finish(self) -> Vec<[u32; 3]> {
        let pairs = self.triangles.into_iter().zip(self.removed);
        pairs
            .filter_map(|(triangle, removed)| (!removed).then_some(triangle))
            .collect()
    }

    /// The three vertices of a triangle.
    pub(super) fn corners(&self, triangle: u32) -> [u32; 3] {
        self.triangles[triangle as usize]
    }

    /// The numbers of the triangles that are left.
    pub(super) fn numbers(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.triangles.len() as u32).filter(|&number| !self.removed[number as usize])
    }

    /// The triangles around a vertex.
    pub(super) fn star(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let mut corner = self.first[vertex as usize];
        std::iter::from_fn(move || {
            let here = corner;
            corner = *self.next.get(here as usize)?;
            Some(here / 3)
        })
    }

    /// Whether the triangle has the vertex.
    pub(super) fn has(&self, triangle: u32, vertex: u32) -> bool {
        self.triangles[triangle as usize].contains(&vertex)
    }

    /// The edges, each once, the lesser vertex first, ascending.
    pub(super) fn edges(&self) -> Vec<(u32, u32)> {
        let mut edges: Vec<(u32, u32)> = self
            .numbers()
            .flat_map(|number| {
                let [a, b, c] = self.corners(number);
                [(a, b), (b, c), (c, a)]
            })
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Whether link(a) ∩ link(b) = link(ab), where a boundary counts as if a further vertex ω
    /// closed it: then collapsing the edge ab does not change the topology.
    pub(super) fn link_condition(&self, a: u32, b: u32) -> bool {
        let mut opposite: Vec<u32> = self
            .star(a)
            .filter(|&triangle| self.has(triangle, b))
            .flat_map(|triangle| self.triangles[triangle as usize])
            .filter(|&vertex| vertex != a && vertex != b)
            .collect();
        opposite.sort_unstable();
        let (around_a, around_b) = (self.neighbours(a), self.neighbours(b));
        if !common(&around_a, &around_b).eq(opposite.iter().copied()) {
            return false;
        }
        let on_boundary = |around: &Neighbours| around.iter().any(|&(_, uses)| uses == 1);
        match opposite[..] {
            // ω is in both links but not in that of an inner edge. Edges can be common too: cd
            // is if a and b are the tips of two triangles on it.
            [c, d] => {
                let both_on_boundary = on_boundary(&around_a) && on_boundary(&around_b);
                let tip = |end| self.star(end).any(|t| self.has(t, c) && self.has(t, d));
                let both_tips = tip(a) && tip(b);
                !both_on_boundary && !both_tips
            }
            // On the boundary the same edge is cω: common if the triangle stands alone.
            [c] => !(around_a.contains(&(c, 1)) && around_b.contains(&(c, 1))),
            _ => false,
        }
    }

    /// The vertices around a vertex.
    pub(super) fn neighbours(&self, vertex: u32) -> Neighbours {
        let mut around: Vec<u32> = self
            .star(vertex)
            .flat_map(|triangle| self.triangles[triangle as usize])
            .filter(|&other| other != vertex)
            .collect();
        around.sort_unstable();
        around
            .chunk_by(|a, b| a == b)
            .map(|equal| (equal[0], equal.len() as u32))
            .collect()
    }

    /// Replaces `gone` by `kept` in every triangle and removes the triangles on their edge; returns
    /// how many these were.
    pub(super) fn collapse(&mut self, kept: u32, gone: u32) -> usize {
        let star: Vec<u32> = self.star(gone).collect();
        let mut removed = 0;
        for triangle in star {
            self.unlink(triangle);
            if self.has(triangle, kept) {
                self.removed[triangle as usize] = true;
                removed += 1;
                continue;
            }
            let vertices = &mut self.triangles[triangle as usize];
            for vertex in vertices.iter_mut().filter(|vertex| **vertex == gone) {
                *vertex = kept;
            }
            self.link(triangle);
        }
        removed
    }

    /// The triangles with the edge ab.
    pub(super) fn beside(&self, a: u32, b: u32) -> impl Iterator<Item = u32> + '_ {
        self.star(a).filter(move |&triangle| self.has(triangle, b))
    }

    /// The third vertex of a triangle with the edge ab.
    pub(super) fn opposite(&self, triangle: u32, a: u32, b: u32) -> Option<u32> {
        let mut vertices = self.corners(triangle).into_iter();
        vertices.find(|&vertex| vertex != a && vertex != b)
    }

    /// Divides the edge ab, and the triangles beside it, at a new vertex, whose number is returned.
    pub(super) fn split(&mut self, a: u32, b: u32) -> u32 {
        let middle = self.first.len() as u32;
        self.first.push(NONE);
        let beside: Vec<u32> = self.beside(a, b).collect();
        for triangle in beside {
            let whole = self.corners(triangle);
            let with_middle_for = |end: u32| whole.map(|v| if v == end { middle } else { v });
            self.replace(triangle, with_middle_for(b));
            let new = self.triangles.len() as u32;
            self.triangles.push(with_middle_for(a));
            self.removed.push(false);
            self.next.extend([NONE; 3]);
            self.link(new);
        }
        middle
    }

    /// Gives a triangle other vertices.
    pub(super) fn replace(&mut self, triangle: u32, vertices: [u32; 3]) {
        self.unlink(triangle);
        self.triangles[triangle as usize] = vertices;
        self.link(triangle);
    }
}

/// The vertices that occur in both lists, ascending.
fn common(first: &Neighbours, second: &Neighbours) -> impl Iterator<Item = u32> {
    let in_second = |vertex: &u32| {
        second
            .binary_search_by_key(vertex, |&(other, _)| other)
            .is_ok()
    };
    first.iter().map(|&(vertex, _)| vertex).filter(in_second)
}
