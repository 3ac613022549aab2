//! The order in which points are inserted: random halves, each along a space-filling curve
//! (N. Amenta, S. Choi and G. Rote, "Incremental constructions con BRIO", 2003). The halves keep
//! the number of tetrahedra on the way small, the curve keeps the ways short.

use glam::DVec3;

use crate::geometry::Bounds;

/// Bits along each axis of the curve: three times as many fit a number.
const BITS: u32 = 20;

/// The first rounds are not smaller than this.
const FIRST: usize = 64;

/// The numbers of the points in the order of insertion.
pub(super) fn insertion_order(points: &[DVec3]) -> Vec<u32> {
    let rounds = (points.len() / FIRST + 1).ilog2();
    let bounds = Bounds::of_points(3, points.iter().copied());
    let place = |point: DVec3| match &bounds {
        Some(bounds) => place_on_curve(bounds, point),
        None => 0,
    };
    let mut order: Vec<(u32, u64, u32)> = (points.iter().zip(0..))
        .map(|(&point, number)| (round(number, rounds), place(point), number))
        .collect();
    order.sort_unstable();
    order.into_iter().map(|(_, _, number)| number).collect()
}

/// The round of a point: half of all are in the last one, a quarter in that before, and so on.
fn round(number: u32, rounds: u32) -> u32 {
    // The last step of a generator of random numbers ("splitmix64").
    let mut bits = u64::from(number).wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    rounds - (bits ^ bits >> 31).trailing_zeros().min(rounds)
}

/// The place of a point on Hilbert's curve through a box.
///
/// By J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707 (2004).
fn place_on_curve(bounds: &Bounds, point: DVec3) -> u64 {
    let scale = f64::from((1u32 << BITS) - 1) / bounds.size().max_element().max(1e-300);
    let offset = (point - bounds.min) * scale;
    let mut axes = offset.to_array().map(|coordinate| coordinate as u32);
    // Undo the excess work: reflections and exchanges, from the largest cells down.
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        let lower = bit - 1;
        for axis in 0..3 {
            if axes[axis] & bit != 0 {
                axes[0] ^= lower;
            } else {
                let exchanged = (axes[0] ^ axes[axis]) & lower;
                axes[0] ^= exchanged;
                axes[axis] ^= exchanged;
            }
        }
        bit >>= 1;
    }
    // Gray code.
    axes[1] ^= axes[0];
    axes[2] ^= axes[1];
    let mut flips = 0;
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        if axes[2] & bit != 0 {
            flips ^= bit - 1;
        }
        bit >>= 1;
    }
    axes = axes.map(|coordinate| coordinate ^ flips);
    let mut place = 0;
    for bit in (0..BITS).rev() {
        for coordinate in axes {
            place = place << 1 | u64::from(coordinate >> bit & 1);
        }
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_through_a_grid_by_steps_to_neighbours() {
        let bounds = Bounds::from_sides(&[(0.0, 7.0); 3]).unwrap();
        let mut cells = Vec::new();
        for number in 0..512 {
            let [x, y, z] = [number & 7, number >> 3 & 7, number >> 6].map(f64::from);
            // Inside of the cell: its lower corner may be rounded down into the one before.
            let inside = DVec3::new(x, y, z) * 0.875 + 0.4;
            cells.push((place_on_curve(&bounds, inside), DVec3::new(x, y, z)));
        }
        cells.sort_by_key(|cell| cell.0);
        for pair in cells.windows(2) {
            assert_eq!((pair[1].1 - pair[0].1).abs().element_sum(), 1.0);
        }
    }

    #[test]
    fn each_number_is_there_once() {
        let points: Vec<DVec3> = (0..1000).map(|n| DVec3::splat(f64::from(n % 7))).collect();
        let mut order = insertion_order(&points);
        order.sort_unstable();
        assert!(order.into_iter().eq(0..1000));
        assert!(insertion_order(&[]).is_empty());
    }
}
