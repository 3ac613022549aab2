//! Disjoint sets (union-find): which vertices, corners or points belong together.

/// A partition of `0..len`, at first into single elements.
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// Every element on its own.
    pub(crate) fn new(len: u32) -> Self {
        DisjointSets {
            parents: (0..len).collect(),
        }
    }

    /// The least element of the set that contains `element`. Halves the path on the way, so that
    /// a call costs O(log len) amortised and nearly nothing in practice.
    pub(crate) fn find(&mut self, mut element: u32) -> u32 {
        loop {
            let parent = self.parents[element as usize];
            if parent == element {
                return element;
            }
            let grandparent = self.parents[parent as usize];
            self.parents[element as usize] = grandparent;
            element = grandparent;
        }
    }

    /// Joins the sets of two elements; says whether they were different.
    ///
    /// The least element represents a set, so that the result does not depend on the order of the
    /// unions.
    pub(crate) fn union(&mut self, first: u32, second: u32) -> bool {
        let (first, second) = (self.find(first), self.find(second));
        let (low, high) = (first.min(second), first.max(second));
        self.parents[high as usize] = low;
        low != high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unions_join_transitively_and_the_least_element_represents() {
        let mut sets = DisjointSets::new(6);
        assert!(sets.union(4, 2));
        assert!(sets.union(5, 4));
        assert!(!sets.union(2, 5));
        let representatives: Vec<u32> = (0..6).map(|element| sets.find(element)).collect();
        assert_eq!(representatives, [0, 1, 2, 3, 2, 2]);
    }
}
