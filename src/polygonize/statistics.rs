//! What the work amounted to, whatever the method.

use super::edge_roots::{Kind, Root};
use super::springs::Subordination;
use crate::geometry::Bounds;

/// The leaves of an octree, by level: level 0 are the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Leaves {
    /// Those proven to be inside: F < iso.
    pub interior: [usize; Leaves::LEVELS],
    /// Those proven to be outside.
    pub exterior: [usize; Leaves::LEVELS],
    /// Those that the level set may pass through, and the interior ones along a cap.
    pub boundary: [usize; Leaves::LEVELS],
}

impl Leaves {
    /// No octree has more levels.
    pub const LEVELS: usize = 21;

    /// The sum of both.
    fn and(mut self, other: Self) -> Self {
        for (own, other) in [
            (&mut self.interior, other.interior),
            (&mut self.exterior, other.exterior),
            (&mut self.boundary, other.boundary),
        ] {
            for (own, other) in own.iter_mut().zip(other) {
                *own += other;
            }
        }
        self
    }
}

/// What the work amounted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Cells of the grid.
    pub cells: usize,
    /// Points at which F, or F and F_x, was evaluated.
    pub evaluations: usize,
    /// Grid points at which F is NaN.
    pub nan_points: usize,
    /// Whether the level set reaches the boundary of the box, so that it is left open or capped
    /// there; in R1, whether an end of the interval is a root.
    pub cut_by_box: bool,
    /// The greatest |F − iso| / |F_x| at a root, poor roots aside.
    pub max_residual: f64,
    /// Roots to the tolerance: in R1 those returned, else those on the edges of the grid, caps
    /// aside.
    pub good_roots: usize,
    /// Changes of sign that are no roots to the tolerance: poles, jumps, ends of the domain of F.
    /// They are vertices of meshes and curves all the same, lest these fall apart.
    pub poor_roots: usize,
    /// Whether components that are reached from no seed would be missed.
    pub may_miss_components: bool,
    /// The leaves of an octree; none for other methods.
    pub leaves: Leaves,
    /// The poor roots that are ends of the domain: F < iso on one side, F NaN on the other. There
    /// the solid F < iso ends indeed.
    pub domain_ends: usize,
    /// Cells in which a method that searches by enclosures could not decide whether there is more.
    pub undecided: usize,
    /// Facets of a mesh that are turned against F_x at their centre or have no area, as far as the
    /// method looks for them: dual contouring does.
    pub folded_facets: usize,
    /// Facets of such a mesh that intersect others; counted where there are folded ones.
    pub intersecting_facets: usize,
    /// Places on a mesh or curve beside which F is the level, too, as far as some were looked at: there
    /// the level set has an interior.
    pub flat_places: usize,
    /// How many places were looked at for that.
    pub probed_places: usize,
    /// The box along which a mesh is closed by caps, if it has any.
    pub capped_by: Option<Bounds>,
    /// Whether enclosures prove that no component, and no root, was missed.
    pub proven: bool,
    /// How the adapted triangulation came out; none for other methods.
    pub subordination: Option<Subordination>,
    /// Curves in space: crossings that were met, or places in which both surfaces are nearly tangent to
    /// each other.
    pub crossings: usize,
    /// Curves in space: corners and cusps that were met.
    pub corners: usize,
    /// "delaunay": samples that are no vertices, because they are not on the level set or not in the box,
    /// are in the same place as another or hidden by others.
    pub left_out: usize,
    /// "delaunay": vertices that had to be added to the samples to make a manifold.
    pub inserted: usize,
    /// "delaunay": vertices that are in the place of another, because the surface touches itself there.
    pub doubled: usize,
    /// "delaunay": triangles at more than 60° with the level set.
    pub athwart: usize,
}

impl Statistics {
    /// What the roots contribute.
    pub(super) fn of_roots(roots: &[Root]) -> Self {
        let count = |kind| roots.iter().filter(|root| root.kind == kind).count();
        let good = roots.iter().filter(|root| !root.is_poor());
        let domain_ends = count(Kind::DomainEnd);
        Statistics {
            max_residual: good.map(|root| root.residual).fold(0.0, f64::max),
            good_roots: count(Kind::Good),
            poor_roots: count(Kind::Jump) + domain_ends,
            domain_ends,
            ..Statistics::default()
        }
    }

    /// The statistics of two parts of the work together.
    pub(super) fn and(self, other: Self) -> Self {
        Statistics {
            cells: self.cells + other.cells,
            evaluations: self.evaluations + other.evaluations,
            nan_points: self.nan_points + other.nan_points,
            cut_by_box: self.cut_by_box || other.cut_by_box,
            max_residual: self.max_residual.max(other.max_residual),
            good_roots: self.good_roots + other.good_roots,
            poor_roots: self.poor_roots + other.poor_roots,
            domain_ends: self.domain_ends + other.domain_ends,
            undecided: self.undecided + other.undecided,
            folded_facets: self.folded_facets + other.folded_facets,
            intersecting_facets: self.intersecting_facets + other.intersecting_facets,
            flat_places: self.flat_places + other.flat_places,
            probed_places: self.probed_places + other.probed_places,
            capped_by: self.capped_by.or(other.capped_by),
            proven: self.proven && other.proven,
            may_miss_components: self.may_miss_components || other.may_miss_components,
            leaves: self.leaves.and(other.leaves),
            subordination: self.subordination.or(other.subordination),
            crossings: self.crossings + other.crossings,
            corners: self.corners + other.corners,
            left_out: self.left_out + other.left_out,
            inserted: self.inserted + other.inserted,
            doubled: self.doubled + other.doubled,
            athwart: self.athwart + other.athwart,
        }
    }
}
