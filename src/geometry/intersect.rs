//! Where a mesh passes through itself: pairs of triangles with a common point that does not belong
//! to a corner or side that they share.
//!
//! Candidates come from a hierarchy of boxes over the triangles in Morton order, pairs are decided
//! by exact predicates. Neighbours are told by shared vertices, as everywhere in this room; of a
//! pair that shares a corner or a side it is asked whether it meets elsewhere, too.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use super::predicates::{Plane, Side, facing_axis, side_of_line, side_of_plane};
use super::{Bounds, Mesh};

impl Mesh {
    /// The pairs of triangles that intersect, ascending, the lesser number first.
    ///
    /// Touching counts, and so does a triangle that folds back onto its neighbour. Triangles
    /// without area and those with positions that are not finite intersect nothing.
    /// Costs O(n log n) for the triangles of a surface, in parallel, plus the number of pairs; the
    /// result does not depend on the number of threads.
    pub fn self_intersections(&self) -> Vec<[u32; 2]> {
        let hierarchy = Hierarchy::new(self);
        let of_block = |block| {
            let mut pairs = Vec::new();
            hierarchy.for_candidates(block, |first, second| {
                if intersect(first, second) {
                    let (a, b) = (first.number, second.number);
                    pairs.push([a.min(b), a.max(b)]);
                }
            });
            pairs
        };
        let blocks = (0..hierarchy.blocks()).into_par_iter();
        let mut pairs: Vec<[u32; 2]> = blocks.flat_map_iter(of_block).collect();
        pairs.par_sort_unstable();
        pairs
    }

    /// How many triangles intersect another one, as [`Mesh::self_intersections`] means it.
    pub fn self_intersecting_triangles(&self) -> usize {
        let hierarchy = Hierarchy::new(self);
        let known: Vec<AtomicBool> = self.triangles.iter().map(|_| false.into()).collect();
        (0..hierarchy.blocks()).into_par_iter().for_each(|block| {
            hierarchy.for_candidates(block, |first, second| {
                let flags = [first, second].map(|facet| &known[facet.number as usize]);
                // A pair of which both are known tells nothing new, so the order does not matter.
                let is_known = flags.iter().all(|flag| flag.load(Relaxed));
                if !is_known && intersect(first, second) {
                    flags.iter().for_each(|flag| flag.store(true, Relaxed));
                }
            });
        });
        known.iter().filter(|flag| flag.load(Relaxed)).count()
    }
}

/// A triangle with an area.
#[derive(Clone, Copy)]
struct Facet {
    plane: Plane,
    /// An axis along which it is seen with an area.
    axis: usize,
    vertices: [u32; 3],
    /// Its place in the mesh.
    number: u32,
}

/// An axis-aligned box.
#[derive(Clone, Copy)]
struct Span {
    min: DVec3,
    max: DVec3,
}

impl Span {
    const NOTHING: Span = Span {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    fn of([a, b, c]: [DVec3; 3]) -> Span {
        Span {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
    }

    fn union(self, other: Span) -> Span {
        Span {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    fn meets(&self, other: &Span) -> bool {
        // Without branches, which would be mispredicted.
        let (first, second) = (self.min.to_array(), self.max.to_array());
        let (low, high) = (other.min.to_array(), other.max.to_array());
        (0..3).fold(true, |meets, k| {
            meets & (first[k] <= high[k]) & (low[k] <= second[k])
        })
    }
}

/// Boxes around blocks of triangles that are near each other in Morton order, around pairs of
/// blocks, and so on up to one box around all.
struct Hierarchy {
    facets: Vec<Facet>,
    spans: Vec<Span>,
    /// The boxes of the blocks first, the box around everything last.
    levels: Vec<Vec<Span>>,
}

/// Triangles in a block.
const BLOCK: usize = 4;

impl Hierarchy {
    fn new(mesh: &Mesh) -> Hierarchy {
        let facets: Vec<Facet> = facets(mesh).collect();
        let facets = in_morton_order(&facets);
        let spans: Vec<Span> = facets
            .iter()
            .map(|facet| Span::of(facet.corners()))
            .collect();
        let around = |spans: &[Span]| spans.iter().copied().fold(Span::NOTHING, Span::union);
        let mut levels: Vec<Vec<Span>> = vec![spans.chunks(BLOCK).map(around).collect()];
        while let Some(finer) = levels.last().filter(|level| level.len() > 1) {
            levels.push(finer.chunks(2).map(around).collect());
        }
        Hierarchy {
            facets,
            spans,
            levels,
        }
    }

    fn blocks(&self) -> usize {
        self.levels[0].len()
    }

    /// Calls `visit` with every pair of triangles whose boxes meet, the first of them in this block
    /// and the second further on.
    fn for_candidates(&self, block: usize, mut visit: impl FnMut(&Facet, &Facet)) {
        let own = &self.levels[0][block];
        let mut pending = vec![(self.levels.len() - 1, 0)];
        while let Some((level, node)) = pending.pop() {
            // The last block below this node.
            let last = ((node + 1) << level) - 1;
            if last < block || !self.levels[level][node].meets(own) {
                continue;
            }
            if level > 0 {
                let children = [2 * node + 1, 2 * node].into_iter();
                let below = &self.levels[level - 1];
                pending.extend(
                    children
                        .filter(|&child| child < below.len())
                        .map(|child| (level - 1, child)),
                );
                continue;
            }
            let other = &self.levels[0][node];
            for first in self.members(block) {
                if !self.spans[first].meets(other) {
                    continue;
                }
                for second in self.members(node) {
                    if first < second && self.spans[first].meets(&self.spans[second]) {
                        visit(&self.facets[first], &self.facets[second]);
                    }
                }
            }
        }
    }

    fn members(&self, block: usize) -> std::ops::Range<usize> {
        BLOCK * block..(BLOCK * (block + 1)).min(self.facets.len())
    }
}

/// The triangles of a mesh that have an area.
fn facets(mesh: &Mesh) -> impl Iterator<Item = Facet> + '_ {
    mesh.triangles
        .iter()
        .zip(0..)
        .filter_map(|(&vertices, number)| {
            let corners = vertices.map(|vertex| mesh.positions[vertex as usize]);
            let finite = corners.iter().all(|corner| corner.is_finite());
            let axis = finite.then(|| facing_axis(corners)).flatten()?;
            Some(Facet {
                plane: Plane::through(corners),
                axis,
                vertices,
                number,
            })
        })
}

/// The triangles, those near each other one after the other.
fn in_morton_order(facets: &[Facet]) -> Vec<Facet> {
    let center = |facet: &Facet| facet.corners().iter().sum::<DVec3>() / 3.0;
    let Some(bounds) = Bounds::of_points(3, facets.iter().map(center)) else {
        return Vec::new();
    };
    let places = facets.iter().zip(0..);
    let mut coded: Vec<(u64, u32)> = places
        .map(|(facet, place)| (morton_code(&bounds, center(facet)), place))
        .collect();
    coded.par_sort_unstable();
    let places = coded.into_iter();
    places.map(|(_, place)| facets[place as usize]).collect()
}

/// The place of a point on the curve through the box that alternates between halves along x, y
/// and z, 21 times.
fn morton_code(bounds: &Bounds, point: DVec3) -> u64 {
    const CELLS: f64 = (1 << 21) as f64;
    let size = bounds.size();
    (0..3).fold(0, |code, axis| {
        let part = (point[axis] - bounds.min[axis]) / size[axis];
        // The cast saturates; a box without extent along the axis gives NaN, which becomes 0.
        let cell = ((part * CELLS) as u64).min((1 << 21) - 1);
        code | spread(cell) << axis
    })
}

/// Moves the 21 lowest bits apart, two zeros after each.
fn spread(bits: u64) -> u64 {
    let mut spread = bits;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        spread = (spread | spread << shift) & mask;
    }
    spread
}

/// Whether two triangles have a point in common that belongs to no corner or side that they
/// share.
fn intersect(first: &Facet, second: &Facet) -> bool {
    let shared = |facet: &Facet, other: &Facet| facet.vertices.map(|v| other.vertices.contains(&v));
    let in_first = shared(first, second);
    match in_first.iter().filter(|&&shared| shared).count() {
        0 => apart(first, second),
        1 => at_a_corner(first, &in_first, second, &shared(second, first)),
        2 => folds_onto(first, &in_first, second),
        _ => true,
    }
}

/// Whether triangles that share nothing intersect.
fn apart(first: &Facet, second: &Facet) -> bool {
    let of_second = second.corners().map(|corner| first.plane.side(corner));
    if all_on_one_side(of_second) {
        return false;
    }
    let of_first = first.corners().map(|corner| second.plane.side(corner));
    if all_on_one_side(of_first) {
        return false;
    }
    // If they meet, the end of their common segment is on a side of one of them.
    let some_side_crosses = |of: &Facet, sides: [Side; 3], other: &Facet| {
        (0..3).any(|k| {
            let next = (k + 1) % 3;
            let ends = [of.corners()[k], of.corners()[next]];
            other.meets_segment(ends, [sides[k], sides[next]])
        })
    };
    some_side_crosses(first, of_first, second) || some_side_crosses(second, of_second, first)
}

fn all_on_one_side([a, b, c]: [Side; 3]) -> bool {
    a != Side::Equal && a == b && b == c
}

/// Whether triangles that share a corner meet elsewhere, too.
///
/// Then they have a segment from that corner in common, or an area there. It leaves one of the two
/// first, through the side opposite of the corner.
fn at_a_corner(
    first: &Facet,
    shared_by_first: &[bool; 3],
    second: &Facet,
    shared_by_second: &[bool; 3],
) -> bool {
    let opposite = |facet: &Facet, shared: &[bool; 3]| {
        let corner = shared.iter().position(|&shared| shared).unwrap_or(0);
        [1, 2].map(|step| facet.corners()[(corner + step) % 3])
    };
    let of_second = opposite(second, shared_by_second);
    let second_sides = of_second.map(|end| first.plane.side(end));
    if second_sides[0] != Side::Equal && second_sides[0] == second_sides[1] {
        return false;
    }
    let of_first = opposite(first, shared_by_first);
    let first_sides = of_first.map(|end| second.plane.side(end));
    second.meets_segment(of_first, first_sides) || first.meets_segment(of_second, second_sides)
}

/// Whether two triangles that share a side lie upon each other.
fn folds_onto(first: &Facet, shared: &[bool; 3], second: &Facet) -> bool {
    let tip = shared.iter().position(|&shared| !shared).unwrap_or(0);
    let [a, b] = [1, 2].map(|step| (tip + step) % 3);
    let ends = [first.vertices[a], first.vertices[b]];
    let tips = second.vertices.iter().position(|v| !ends.contains(v));
    let (Some(other_tip), [a, b]) = (tips, [first.corners()[a], first.corners()[b]]) else {
        return true;
    };
    let tips = [first.corners()[tip], second.corners()[other_tip]];
    let axis = first.axis;
    first.plane.side(tips[1]) == Side::Equal
        && side_of_line(axis, a, b, tips[0]) == side_of_line(axis, a, b, tips[1])
}

impl Facet {
    fn corners(&self) -> [DVec3; 3] {
        self.plane.points
    }

    /// Whether a segment, whose ends lie on these sides of the triangle's plane, meets the triangle.
    fn meets_segment(&self, [p, q]: [DVec3; 2], sides: [Side; 2]) -> bool {
        match sides {
            [Side::Equal, Side::Equal] => self.meets_segment_in_plane([p, q]),
            [first, second] if first == second => false,
            _ => {
                let [a, b, c] = self.corners();
                // The line passes the three sides the same way round, or through one of them.
                let around =
                    [(a, b), (b, c), (c, a)].map(|(from, to)| side_of_plane(p, q, from, to));
                !(around.contains(&Side::Less) && around.contains(&Side::Greater))
            }
        }
    }

    /// The same for a segment in the plane of the triangle.
    fn meets_segment_in_plane(&self, [p, q]: [DVec3; 2]) -> bool {
        let [a, b, c] = self.corners();
        let sides = [(a, b), (b, c), (c, a)];
        let around = sides.map(|(from, to)| side_of_line(self.axis, from, to, p));
        let is_inside = !(around.contains(&Side::Less) && around.contains(&Side::Greater));
        is_inside
            || sides
                .iter()
                .any(|&(from, to)| segments_meet(self.axis, [p, q], [from, to]))
    }
}

/// Whether two segments meet, seen along an axis.
fn segments_meet(axis: usize, [p, q]: [DVec3; 2], [a, b]: [DVec3; 2]) -> bool {
    let of_ab = [a, b].map(|point| side_of_line(axis, p, q, point));
    let of_pq = [p, q].map(|point| side_of_line(axis, a, b, point));
    if of_ab == [Side::Equal; 2] {
        // All on one line: their extents along it must overlap.
        return [(axis + 1) % 3, (axis + 2) % 3]
            .iter()
            .all(|&k| p[k].min(q[k]) <= a[k].max(b[k]) && a[k].min(b[k]) <= p[k].max(q[k]));
    }
    let separated = |[first, second]: [Side; 2]| first == second && first != Side::Equal;
    !separated(of_ab) && !separated(of_pq)
}

#[cfg(test)]
mod tests {
    use super::super::test_meshes::{
        cube, disjoint_union, disk, mesh, moebius_strip, octahedron, tetrahedron, torus,
    };
    use super::*;

    type Integers = [i64; 3];

    fn minus(a: Integers, b: Integers) -> Integers {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Integers, b: Integers) -> Integers {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }

    /// Whether two convex plane polygons have no common point, by the theorem of the separating
    /// axis in integers: an independent computation for the predicates.
    fn are_separated(first: &[Integers], second: &[Integers]) -> bool {
        let edges = |polygon: &[Integers]| -> Vec<Integers> {
            let next = polygon.iter().cycle().skip(1);
            polygon
                .iter()
                .zip(next)
                .map(|(&a, &b)| minus(b, a))
                .collect()
        };
        let (of_first, of_second) = (edges(first), edges(second));
        let normals = [&of_first, &of_second].map(|edges| cross(edges[0], edges[1]));
        let mut axes = normals.to_vec();
        for &a in &of_first {
            axes.push(cross(normals[0], a));
            axes.extend(of_second.iter().map(|&b| cross(a, b)));
        }
        axes.extend(of_second.iter().map(|&b| cross(normals[1], b)));
        let extent = |polygon: &[Integers], axis: Integers| {
            let along = |p: &Integers| (0..3).map(|k| i128::from(p[k]) * i128::from(axis[k])).sum();
            let places: Vec<i128> = polygon.iter().map(along).collect();
            (*places.iter().min().unwrap(), *places.iter().max().unwrap())
        };
        axes.into_iter().any(|axis| {
            let ((a, b), (c, d)) = (extent(first, axis), extent(second, axis));
            b < c || d < a
        })
    }

    /// A generator of small integers.
    fn random(seed: u64) -> impl FnMut(u64) -> i64 {
        let mut state = seed;
        move |below| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            ((state >> 20) % below) as i64
        }
    }

    fn has_area(corners: &[Integers; 3]) -> bool {
        cross(minus(corners[1], corners[0]), minus(corners[2], corners[0])) != [0; 3]
    }

    fn soup(points: &[Integers], triangles: &[[u32; 3]]) -> Mesh {
        let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(|x| x as f64)).collect();
        mesh(&points, triangles)
    }

    #[test]
    fn pairs_that_share_nothing_agree_with_separating_axes() {
        // A small grid makes points in planes, on lines and in each other frequent.
        let mut random = random(1);
        let mut met = [0; 2];
        for size in [3, 4, 7, 100] {
            for _ in 0..5000 {
                let [first, second] = [0, 0].map(|_| [0; 3].map(|_| [0; 3].map(|_| random(size))));
                if !has_area(&first) || !has_area(&second) {
                    continue;
                }
                let both = soup(&[first, second].concat(), &[[0, 1, 2], [3, 4, 5]]);
                let meets = !are_separated(&first, &second);
                assert_eq!(
                    both.self_intersections().len(),
                    usize::from(meets),
                    "{first:?} {second:?}"
                );
                met[usize::from(meets)] += 1;
            }
        }
        assert!(met.iter().all(|&count| count > 2000), "{met:?}");
    }

    #[test]
    fn pairs_that_share_a_corner_agree_with_separating_axes() {
        // Two triangles that meet beyond a common corner on a grid of 4³ points have a common point
        // at more than a thousandth of the way to the opposite side: cutting that much off one of
        // them, after everything was made a thousand times larger, leaves an intersection.
        let mut random = random(2);
        let mut met = [0; 2];
        for _ in 0..20_000 {
            let [v, a, b, c, d] = [0; 5].map(|_| [0; 3].map(|_| random(4)));
            if !has_area(&[v, a, b]) || !has_area(&[v, c, d]) {
                continue;
            }
            let both = soup(&[v, a, b, c, d], &[[0, 1, 2], [4, 0, 3]]);
            let large = |p: Integers| p.map(|x| 1000 * x);
            let near = |p: Integers| [0, 1, 2].map(|k| 999 * v[k] + p[k]);
            let cut = [near(a), large(a), large(b), near(b)];
            let meets = !are_separated(&cut, &[v, c, d].map(large));
            assert_eq!(
                both.self_intersections().len(),
                usize::from(meets),
                "{v:?} {a:?} {b:?} {c:?} {d:?}"
            );
            met[usize::from(meets)] += 1;
        }
        assert!(met.iter().all(|&count| count > 1000), "{met:?}");
    }

    #[test]
    fn neighbours_intersect_only_where_one_folds_onto_the_other() {
        let corners = [[0, 0, 0], [4, 0, 0], [1, 3, 0]];
        let with_tip = |tip: Integers| {
            let points = [&corners[..], &[tip]].concat();
            soup(&points, &[[0, 1, 2], [1, 0, 3]]).self_intersections()
        };
        assert!(with_tip([1, -3, 0]).is_empty());
        assert!(with_tip([1, 2, 1]).is_empty());
        assert_eq!(with_tip([2, 1, 0]), [[0, 1]]);
        assert_eq!(with_tip([9, 9, 0]), [[0, 1]]);
        assert_eq!(
            soup(&corners, &[[0, 1, 2], [2, 1, 0]]).self_intersections(),
            [[0, 1]]
        );
    }

    #[test]
    fn embedded_surfaces_do_not_intersect_themselves() {
        for surface in [
            cube(1.0, DVec3::ZERO),
            tetrahedron(),
            octahedron(),
            torus(2.0, 0.5, 60, 40),
            disk(9),
        ] {
            assert_eq!(surface.self_intersections(), [[0; 2]; 0]);
            assert_eq!(surface.self_intersecting_triangles(), 0);
        }
        // In a plane the strip with a twist must cross itself.
        assert!(!moebius_strip().self_intersections().is_empty());
        assert_eq!(Mesh::default().self_intersecting_triangles(), 0);
    }

    #[test]
    fn a_torus_whose_tube_is_too_thick_crosses_itself_near_the_axis() {
        let spindle = torus(1.0, 1.3, 40, 40);
        let pairs = spindle.self_intersections();
        assert!(pairs.is_sorted());
        let mut found: Vec<u32> = pairs.iter().flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        assert_eq!(spindle.self_intersecting_triangles(), found.len());
        // The tube reaches the axis at height sqrt(1.3² − 1); a facet is about 0.2 high.
        let height = (1.3f64 * 1.3 - 1.0).sqrt();
        for &number in &found {
            let corners = spindle.triangles[number as usize];
            let corner = spindle.positions[corners[0] as usize];
            assert!((corner.z.abs() - height).abs() < 0.25, "{corner}");
        }
        assert!(found.len() > 40);
    }

    #[test]
    fn two_solids_that_cross_are_counted_and_far_ones_are_not() {
        let pair = |offset: f64| {
            disjoint_union(octahedron(), &{
                let mut other = octahedron();
                other
                    .positions
                    .iter_mut()
                    .for_each(|p| *p += DVec3::X * offset);
                other
            })
        };
        assert_eq!(pair(2.5).self_intersecting_triangles(), 0);
        // At distance 2 they touch in one corner, in which eight triangles meet.
        assert_eq!(pair(2.0).self_intersecting_triangles(), 8);
        assert_eq!(pair(2.0).self_intersections().len(), 16);
        assert_eq!(pair(2.0 + 1e-15).self_intersecting_triangles(), 0);
    }

    #[test]
    fn triangles_without_area_and_unknown_positions_are_left_out() {
        let mut solid = octahedron();
        solid.positions[0] = DVec3::NAN;
        assert!(solid.self_intersections().is_empty());
        solid.positions.fill(DVec3::ONE);
        assert!(solid.self_intersections().is_empty());
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        let spindle = torus(1.0, 1.3, 90, 90);
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| spindle.self_intersections())
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}
