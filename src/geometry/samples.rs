//! Point samples.

use glam::DVec3;

/// Points on a zero set. The lists have one entry per point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// 1, 2 or 3; components beyond it are 0.
    pub dimension: usize,
    /// Where.
    pub positions: Vec<DVec3>,
    /// F_x / |F_x|; 0 where the gradient vanishes. On a curve in space, that of the first of its
    /// two fields.
    pub normals: Vec<DVec3>,
    /// Unit tangents in the order of the points, for curves that were walked along; else empty.
    pub tangents: Vec<DVec3>,
    /// The disk that a point may claim: the repulsion radius of a floater; for other samples half
    /// the distance to the nearest other point.
    pub radii: Vec<f64>,
    /// |F| / |F_x|: the first-order distance from the zero set.
    pub residuals: Vec<f64>,
    /// By what each point is to be weighed in means over the surface, where points are not spread
    /// in proportion to area; empty where they all weigh the same.
    pub weights: Vec<f64>,
}
