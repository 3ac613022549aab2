//! Radii: the disk that each point of a sample may claim.

use glam::DVec3;

use crate::geometry::nearest_distances;

/// Half the distance from each point to the nearest other, 0 for a point that is alone. The
/// disks of these radii don't overlap. Costs O(n log n).
pub(super) fn radii(positions: &[DVec3]) -> Vec<f64> {
    let half = |distance: f64| {
        if distance.is_finite() {
            0.5 * distance
        } else {
            0.0
        }
    };
    nearest_distances(positions).into_iter().map(half).collect()
}
