//! The point nearest to some planes: T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual contouring
//! of Hermite data", SIGGRAPH 2002, with the pseudoinverse of its section 2.3.

use glam::DVec3;

/// Eigenvalues below this part of the largest one belong to directions in which the planes do not
/// bind: it is the square of half the sine of the least angle between faces that makes an edge.
const FLAT: f64 = 3e-3;

/// The planes n·x = d by their sums: AᵀA and Aᵀb relative to a point.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// xx, yy, zz, xy, yz, zx.
    squares: [f64; 6],
    moments: DVec3,
}

/// The point nearest to the planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nearest {
    /// From where the sums are relative to: the shortest way to it.
    pub(super) offset: DVec3,
    /// In how many directions planes bind.
    pub(super) rank: usize,
    /// A direction of length 1 in which they bind least.
    pub(super) free: DVec3,
}

impl Quadric {
    /// Adds the plane with a normal of length 1 at a signed distance along it.
    pub(super) fn add(&mut self, normal: DVec3, distance: f64) {
        let DVec3 { x, y, z } = normal;
        let products = [x * x, y * y, z * z, x * y, y * z, z * x];
        for (sum, product) in self.squares.iter_mut().zip(products) {
            *sum += product;
        }
        self.moments += normal * distance;
    }

    /// The nearest point with at most so many binding directions.
    pub(super) fn nearest(&self, most: usize) -> Nearest {
        let (values, vectors) = eigen(self.squares);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        let largest = values[order[0]];
        let binding = |&&place: &&usize| values[place] > FLAT * largest;
        let mut offset = DVec3::ZERO;
        let mut rank = 0;
        for &place in order.iter().take(most).filter(binding) {
            offset += vectors[place] * (vectors[place].dot(self.moments) / values[place]);
            rank += 1;
        }
        Nearest {
            offset,
            rank,
            free: vectors[order[2]],
        }
    }
}

/// The eigenvalues and eigenvectors of a symmetric matrix (xx, yy, zz, xy, yz, zx) by Jacobi's
/// rotations (Press et al., Numerical Recipes, 3rd ed., section 11.1).
fn eigen([xx, yy, zz, xy, yz, zx]: [f64; 6]) -> ([f64; 3], [DVec3; 3]) {
    const SWEEPS: usize = 8;
    let mut matrix = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
    let mut vectors = [DVec3::X, DVec3::Y, DVec3::Z];
    for _ in 0..SWEEPS {
        let off = matrix[0][1].abs() + matrix[0][2].abs() + matrix[1][2].abs();
        let on = matrix[0][0].abs() + matrix[1][1].abs() + matrix[2][2].abs();
        if off <= 1e-17 * on {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if matrix[p][q] == 0.0 {
                continue;
            }
            let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * matrix[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let r = 3 - p - q;
            let (rp, rq) = (matrix[r][p], matrix[r][q]);
            matrix[p][p] -= t * matrix[p][q];
            matrix[q][q] += t * matrix[p][q];
            (matrix[p][q], matrix[q][p]) = (0.0, 0.0);
            (matrix[r][p], matrix[p][r]) = (c * rp - s * rq, c * rp - s * rq);
            (matrix[r][q], matrix[q][r]) = (s * rp + c * rq, s * rp + c * rq);
            let (vp, vq) = (vectors[p], vectors[q]);
            vectors[p] = vp * c - vq * s;
            vectors[q] = vp * s + vq * c;
        }
    }
    ([matrix[0][0], matrix[1][1], matrix[2][2]], vectors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_their_point() {
        let point = DVec3::new(0.3, -0.2, 0.7);
        let mut quadric = Quadric::default();
        for normal in [
            DVec3::X,
            DVec3::new(0.6, 0.8, 0.0),
            DVec3::new(0.0, 0.6, 0.8),
        ] {
            quadric.add(normal, normal.dot(point));
        }
        let nearest = quadric.nearest(3);
        assert_eq!(nearest.rank, 3);
        assert!(nearest.offset.distance(point) < 1e-14);
    }

    #[test]
    fn two_planes_bind_two_directions_and_leave_their_line_free() {
        let mut quadric = Quadric::default();
        for _ in 0..3 {
            quadric.add(DVec3::X, 0.5);
            quadric.add(DVec3::new(0.6, 0.8, 0.0), 0.3);
        }
        // The foot of the perpendicular from the origin: x = 0.5, 0.6·0.5 + 0.8·y = 0.3.
        let nearest = quadric.nearest(3);
        assert_eq!(nearest.rank, 2);
        assert!(nearest.offset.distance(DVec3::new(0.5, 0.0, 0.0)) < 1e-14);
        assert!(nearest.free.cross(DVec3::Z).length() < 1e-14);
        let along_one = quadric.nearest(1);
        assert_eq!(along_one.rank, 1);
    }

    #[test]
    fn no_plane_binds_nothing() {
        assert_eq!(Quadric::default().nearest(3).offset, DVec3::ZERO);
    }
}
