//! The columns of a sample, for the formats that write them as a table.

use crate::geometry::Samples;

/// The names of the columns.
pub(super) const NAMES: [&str; 8] = ["x", "y", "z", "nx", "ny", "nz", "radius", "residual"];

/// One row for each sample, in the order of [`NAMES`].
pub(super) fn rows(samples: &Samples) -> impl Iterator<Item = [f64; 8]> + '_ {
    let vectors = samples.positions.iter().zip(&samples.normals);
    let numbers = samples.radii.iter().zip(&samples.residuals);
    vectors
        .zip(numbers)
        .map(|((p, n), (&radius, &residual))| [p.x, p.y, p.z, n.x, n.y, n.z, radius, residual])
}
