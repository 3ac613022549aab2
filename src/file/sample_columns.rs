//! The columns of a sample, for the formats that write them as a table.

use crate::geometry::Samples;

/// The names of the columns of positions and normals.
pub(super) const VECTORS: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// The names of the columns: tangents and weights only where there are any.
pub(super) fn names(samples: &Samples) -> Vec<&'static str> {
    let mut names = VECTORS.to_vec();
    names.extend(["radius", "residual"]);
    if !samples.tangents.is_empty() {
        names.extend(["tx", "ty", "tz"]);
    }
    if !samples.weights.is_empty() {
        names.push("weight");
    }
    names
}

/// One row for each sample, in the order of [`names`].
pub(super) fn rows(samples: &Samples) -> impl Iterator<Item = Vec<f64>> + '_ {
    let vectors = samples.positions.iter().zip(&samples.normals);
    let numbers = samples.radii.iter().zip(&samples.residuals);
    vectors
        .zip(numbers)
        .enumerate()
        .map(|(place, ((p, n), (&radius, &residual)))| {
            let mut row = vec![p.x, p.y, p.z, n.x, n.y, n.z, radius, residual];
            if let Some(tangent) = samples.tangents.get(place) {
                row.extend(tangent.to_array());
            }
            row.extend(samples.weights.get(place));
            row
        })
}
