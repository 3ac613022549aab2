//! x
use glam::DVec3;
pub(super) fn radii(_dimension: usize, positions: &[DVec3]) -> Vec<f64> { vec![0.0; positions.len()] }
