//! The case table of marching cubes, derived from rules instead of typed in, and the further
//! cases where signs do not tell the topology.
//!
//! A case is told by the signs at the corners of a cube. Lorensen and Cline, "Marching cubes",
//! SIGGRAPH 1987, is the source of the table's use; [`loops`](super::loops) and
//! [`patches`](super::patches) have the rules. Where there is more than one surface that fits
//! the signs, the values at the corners decide as [`interior`](super::interior) says; of these
//! cases, which are few in most fields, each is made when it is met.

use std::sync::{LazyLock, OnceLock};

use super::interior::{Tunnel, joined_faces, tunnel};
use super::loops::{ambiguous_faces, loops};
use super::patches::{Passage, Patches};

/// The triangles of each of the 256 cases.
pub(super) static TABLE: LazyLock<CaseTable> = LazyLock::new(CaseTable::generate);

/// Triangles of all cases in one list, and where each case starts in it.
pub(super) struct CaseTable {
    starts: [usize; 257],
    triangles: Vec<[u8; 3]>,
    /// For each case where its variants start, one more for the end. Only a case that signs do
    /// not decide has any.
    variant_starts: [usize; 257],
    variants: Vec<OnceLock<Patches>>,
}

/// How many passages through a cube there are, none included.
const PASSAGES: usize = 9;

impl CaseTable {
    /// The triangles of a case, as triples of edges, counter-clockwise seen from outside the
    /// surface, if signs decide it. Bit c of `case` tells whether corner c is inside.
    pub(super) fn triangles(&self, case: u8) -> &[[u8; 3]] {
        let case = usize::from(case);
        &self.triangles[self.starts[case]..self.starts[case + 1]]
    }

    /// Whether more than one surface fits the signs. Then the case has no triangles of its own.
    pub(super) fn is_ambiguous(&self, case: u8) -> bool {
        let case = usize::from(case);
        self.variant_starts[case] < self.variant_starts[case + 1]
    }

    /// The patches of an ambiguous case and the tunnel that is possible there, given F − iso at
    /// the corners: those of the trilinear function with these values.
    pub(super) fn variant(&self, case: u8, values: &[f64; 8]) -> (&Patches, Option<Tunnel>) {
        let (joined, tunnel) = (joined_faces(case, values), tunnel(values));
        let passage = tunnel.map(|tunnel| tunnel.passage);
        // The ambiguous faces are few: their bits, one after the other, are the number.
        let ambiguous = (0..6).filter(|face| ambiguous_faces(case) >> face & 1 == 1);
        let faces = ambiguous.enumerate();
        let number: usize = faces
            .map(|(place, face)| usize::from(joined >> face & 1) << place)
            .sum();
        let way = passage.map_or(0, |Passage { inside, diagonal }| {
            1 + 4 * usize::from(inside) + diagonal
        });
        let place = self.variant_starts[usize::from(case)] + number * PASSAGES + way;
        let patches = self.variants[place].get_or_init(|| Patches::new(case, joined, passage));
        (patches, tunnel)
    }

    fn generate() -> Self {
        let mut table = CaseTable {
            starts: [0; 257],
            triangles: Vec::new(),
            variant_starts: [0; 257],
            variants: Vec::new(),
        };
        for case in 0..=255u8 {
            let faces = ambiguous_faces(case);
            let next = usize::from(case) + 1;
            if faces != 0 || loops(case, 0).len() > 1 {
                let count = PASSAGES << faces.count_ones();
                let more = std::iter::repeat_with(OnceLock::new).take(count);
                table.variants.extend(more);
            } else {
                table
                    .triangles
                    .extend(Patches::new(case, 0, None).triangles);
            }
            table.starts[next] = table.triangles.len();
            table.variant_starts[next] = table.variants.len();
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simple_cases_are_in_the_table_and_the_others_have_variants() {
        // Of the 256 cases those of Chernyaev's numbers 3, 4, 6, 7, 10, 12 and 13 are ambiguous:
        // both signs of 12, 4, 24 and 8 placements, and 6, 24 and 2 more.
        let ambiguous = (0..=255).filter(|&case| TABLE.is_ambiguous(case)).count();
        assert_eq!(ambiguous, 2 * (12 + 4 + 24 + 8) + 6 + 24 + 2);
        for case in 0..=255u8 {
            let own = TABLE.triangles(case).len();
            let none = TABLE.is_ambiguous(case) || case == 0 || case == 255;
            assert_eq!(own == 0, none, "case {case}");
        }
    }

    #[test]
    fn the_inside_corner_of_the_simplest_case_is_behind_its_triangle() {
        assert_eq!(TABLE.triangles(1).len(), 1);
        let mut triangle = TABLE.triangles(1)[0];
        let first = triangle.iter().position(|&edge| edge == 0).unwrap();
        triangle.rotate_left(first);
        // The edges along x, y and z from corner 0: the normal points to (1, 1, 1).
        assert_eq!(triangle, [0, 4, 8]);
    }

    #[test]
    fn values_choose_the_variant() {
        // Two opposite corners inside: apart, or connected where they are deep.
        let values = |depth: f64| [-depth, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, -depth];
        let triangles = |depth| TABLE.variant(0b1000_0001, &values(depth)).0.triangles.len();
        assert_eq!([triangles(1.0), triangles(20.0)], [2, 6]);
    }
}
