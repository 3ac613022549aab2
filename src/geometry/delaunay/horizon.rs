//! The facets around the tetrahedra that make way for a point, and what joins them along their edges.

/// A facet around the tetrahedra that make way.
#[derive(Clone, Copy, Debug)]
pub(super) struct HorizonFacet {
    /// Counter-clockwise seen from outside.
    pub(super) corners: [u32; 3],
    /// The tetrahedron outside.
    pub(super) beyond: u32,
    /// Its number of the facet.
    pub(super) back: u8,
}

/// An edge of the horizon with the new tetrahedron that was the first to come to it.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    edge: u64,
    round: u32,
    tetrahedron: u32,
    facet: u8,
}

/// All facets around, and a table of their edges that keeps its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Horizon {
    pub(super) facets: Vec<HorizonFacet>,
    slots: Vec<Slot>,
    /// Slots of other rounds are empty.
    round: u32,
    /// Edges in the table.
    edges: usize,
}

impl Horizon {
    /// Forgets all facets.
    pub(super) fn clear(&mut self) {
        self.facets.clear();
        self.start_round();
    }

    fn start_round(&mut self) {
        self.edges = 0;
        self.round = self.round.wrapping_add(1);
        if self.round == 0 {
            self.slots.fill(Slot::default());
            self.round = 1;
        }
    }

    /// Adds a facet.
    pub(super) fn push(&mut self, corners: [u32; 3], beyond: u32, back: u8) {
        self.facets.push(HorizonFacet {
            corners,
            beyond,
            back,
        });
    }

    /// The new tetrahedron and its facet that came to an edge before; if none did, it is noted that this one
    /// has.
    pub(super) fn join(
        &mut self,
        [a, b]: [u32; 2],
        tetrahedron: u32,
        facet: u8,
    ) -> Option<(u32, u8)> {
        // A closed surface has half as many edges again as facets; a quarter of the table is full.
        let wanted = (6 * self.facets.len()).next_power_of_two();
        if self.edges == 0 && self.slots.len() < wanted {
            self.slots = vec![Slot::default(); wanted];
            self.round = 1;
        }
        let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
        let mask = self.slots.len() - 1;
        let mut place = (edge.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & mask;
        loop {
            let slot = &mut self.slots[place];
            if slot.round != self.round {
                *slot = Slot {
                    edge,
                    round: self.round,
                    tetrahedron,
                    facet,
                };
                self.edges += 1;
                return None;
            }
            if slot.edge == edge {
                return Some((slot.tetrahedron, slot.facet));
            }
            place = (place + 1) & mask;
        }
    }
}
