//! Curves as polylines.

use glam::DVec3;

/// Curves in the plane or in space.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// 2 or 3; plane curves have z = 0.
    pub dimension: usize,
    /// The connected pieces.
    pub polylines: Vec<Polyline>,
}

/// One connected curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polyline {
    /// Its points in order; a closed curve does not repeat the first. A plane curve has the
    /// inside (F < 0) on its left.
    pub points: Vec<DVec3>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
}
