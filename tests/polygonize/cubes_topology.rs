//! Marching cubes and the topology of the trilinear function in every cell.

use std::collections::BTreeMap;

use crate::support::{cube, mesh};
use crate::trilinear::{Corners, Grid, connects, interpolate};
use glam::DVec3;
use imp::engine::Silent;
use imp::polygonize::{Method, Options, PolygonizeError};

/// Marsaglia's xorshift, −1 to 1.
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Random {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        random.next();
        random.next();
        random
    }

    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// The mesh of a grid has the components and the Euler number of the level set, and is a closed
/// manifold. How its values are scaled does not matter.
fn assert_has_its_topology(grid: &Grid, name: &str) {
    let sets = grid.sets();
    let options = Options {
        cell: 1.0,
        ..Options::new(cube(3, 0.0, grid.points as f64 - 1.0))
    };
    let field = grid.clone().field();
    let found = match mesh(&field, (Method::Cubes, &options), &Silent) {
        Ok(found) => found,
        Err(PolygonizeError::NoSurface { .. }) if sets.negative == 0 => return,
        Err(error) => panic!("{name}: {error}"),
    };
    let topology = found.shape.topology();
    assert!(
        topology.watertight && topology.manifold && topology.oriented,
        "{name}: {topology:?}"
    );
    // In a ball closed surfaces lie between regions like the edges of a tree between its vertices,
    // and have twice the Euler number of what they bound.
    let expected = (sets.negative + sets.positive - 1, 2 * sets.euler);
    let have = (topology.components, topology.euler_characteristic() as i64);
    assert_eq!(have, expected, "{name}: {grid:?}");
    assert_eq!(found.statistics.poor_roots, 0, "{name}");
}

/// The case of a cell after E. V. Chernyaev, "Marching cubes 33" (1995). 12.2 and 12.3 are mirror
/// images of each other, and so are 11 and 14.
fn case(cell: &Corners) -> &'static str {
    let mut inside: Vec<usize> = (0..8).filter(|&corner| cell[corner] < 0.0).collect();
    let swapped = inside.len() > 4;
    if swapped {
        inside = (0..8).filter(|&corner| cell[corner] >= 0.0).collect();
    }
    let adjacent = |a: usize, b: usize| (a ^ b).is_power_of_two();
    let degree = |&a: &usize| inside.iter().filter(|&&b| adjacent(a, b)).count();
    let edges = inside.iter().map(degree).sum::<usize>() / 2;
    // The ambiguous faces, with whether the corners in `inside` are connected.
    let faces = FACES.iter().filter_map(|face| {
        let connected = connects(face.map(|corner| cell[corner]))?;
        Some((face, connected != swapped))
    });
    let connected: Vec<[usize; 4]> = faces
        .filter(|&(_, connected)| connected)
        .map(|(face, _)| *face)
        .collect();
    let joined = connected.len();
    // The same cell in a positive surrounding tells its tunnels: there is one if the numbers of
    // regions differ from those that the faces make.
    let tunnel = || has_tunnel(cell);
    match (inside.len(), edges, joined) {
        (0, ..) => "0",
        (1, ..) => "1",
        (2, 1, _) => "2",
        (2, _, 1) => "3.2",
        (2, ..) if inside[0] ^ inside[1] != 7 => "3.1",
        (2, ..) => ["4.1", "4.2"][usize::from(tunnel())],
        (3, 2, _) => "5",
        (3, 1, 0) => ["6.1.1", "6.1.2"][usize::from(tunnel())],
        (3, 1, _) => "6.2",
        (3, _, 3) => ["7.4.1", "7.4.2"][usize::from(tunnel())],
        (3, ..) => ["7.1", "7.2", "7.3"][joined],
        (_, 4, _) => "8",
        (_, 3, _) if inside.iter().any(|corner| degree(corner) == 3) => "9",
        (_, 3, _) => ["11", "14"][usize::from(is_left_handed(&path(&inside)))],
        (_, 2, 0 | 2) if inside.iter().all(|corner| degree(corner) == 1) => {
            ["10.1.1", "10.1.2"][usize::from(tunnel())]
        }
        (_, 2, _) if inside.iter().all(|corner| degree(corner) == 1) => "10.2",
        (_, 2, 0 | 2) => ["12.1.1", "12.1.2"][usize::from(tunnel())],
        (_, 2, _) => {
            // The path's end in the connected face first, the isolated corner last.
            let mut path = path(&inside);
            if !connected[0].contains(&path[0]) {
                path.reverse();
            }
            path.extend(inside.iter().filter(|corner| degree(corner) == 0));
            ["12.2", "12.3"][usize::from(is_left_handed(&path))]
        }
        (_, _, 0 | 6) => "13.1",
        (_, _, 1 | 5) => "13.2",
        (_, _, 2 | 4) => "13.3",
        _ => {
            // The faces around a corner; if it is outside, they leave it alone.
            let shared = (0..8).find(|corner| connected.iter().all(|face| face.contains(corner)));
            match shared.is_some_and(|corner| cell[corner] >= 0.0) {
                false => "13.4",
                true => ["13.5.1", "13.5.2"][usize::from(tunnel())],
            }
        }
    }
}

const FACES: [[usize; 4]; 6] = [
    [0, 2, 6, 4],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 3, 7, 6],
    [0, 1, 3, 2],
    [4, 5, 7, 6],
];

/// All names.
const CASES: [&str; 33] = [
    "0", "1", "2", "3.1", "3.2", "4.1", "4.2", "5", "6.1.1", "6.1.2", "6.2", "7.1", "7.2", "7.3",
    "7.4.1", "7.4.2", "8", "9", "10.1.1", "10.1.2", "10.2", "11", "12.1.1", "12.1.2", "12.2",
    "12.3", "13.1", "13.2", "13.3", "13.4", "13.5.1", "13.5.2", "14",
];

/// The corners of a path in their order; a corner without neighbours is left out.
fn path(corners: &[usize]) -> Vec<usize> {
    let neighbours = |&a: &usize| {
        let adjacent = |b: &usize| (a ^ b).is_power_of_two();
        corners.iter().copied().filter(adjacent).collect::<Vec<_>>()
    };
    let first = corners.iter().find(|corner| neighbours(corner).len() == 1);
    let mut path = vec![*first.unwrap()];
    while let Some(next) = neighbours(&path[path.len() - 1])
        .into_iter()
        .find(|next| !path.contains(next))
    {
        path.push(next);
    }
    path
}

/// Whether the fourth of these corners is on the left of the path through the first three.
fn is_left_handed(path: &[usize]) -> bool {
    let place =
        |corner: usize| DVec3::from_array([0, 1, 2].map(|axis| (corner >> axis & 1) as f64));
    let [a, b, c, d] = [0, 1, 2, 3].map(|step| place(path[step]));
    (b - a).cross(c - b).dot(d - c) < 0.0
}

/// Whether regions that are separate on the faces of a cell are connected in it.
fn has_tunnel(cell: &Corners) -> bool {
    let grid = Grid {
        points: 2,
        values: cell.to_vec(),
    };
    let sets = grid.sets();
    // On the surface of the cell, as the union of corners across edges and faces.
    let mut label = [0, 1, 2, 3, 4, 5, 6, 7];
    let mut join = |a: usize, b: usize| {
        let (kept, gone) = (label[a], label[b]);
        label
            .iter_mut()
            .filter(|l| **l == gone)
            .for_each(|l| *l = kept);
    };
    for a in 0..8usize {
        for b in (0..3).map(|axis| a ^ 1 << axis) {
            if (cell[a] < 0.0) == (cell[b] < 0.0) {
                join(a, b);
            }
        }
    }
    for [a, b, c, d] in FACES {
        if let Some(connected) = connects([a, b, c, d].map(|corner| cell[corner])) {
            match connected == (cell[a] < 0.0) {
                true => join(a, c),
                false => join(b, d),
            }
        }
    }
    label.sort_unstable();
    let mut regions = label.to_vec();
    regions.dedup();
    regions.len() > sets.negative + sets.positive
}

#[test]
fn random_grids_have_the_topology_of_the_trilinear_function() {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for seed in 0..10_000 {
        let mut random = Random::new(seed);
        let points = 4 + seed as usize % 3;
        let grid = Grid::closed(points, || random.next());
        for cell in grid.cells() {
            *counts.entry(case(&cell)).or_default() += 1;
        }
        assert_has_its_topology(&grid, &format!("seed {seed}"));
    }
    for name in CASES {
        let count = counts.remove(name).unwrap_or(0);
        println!("case {name}: {count}");
        assert!(count > 0, "no cell of case {name}");
    }
    assert!(counts.is_empty(), "{counts:?}");
}

#[test]
fn every_case_alone_has_its_topology() {
    let mut wanted: BTreeMap<&str, usize> = CASES.iter().map(|name| (*name, 20)).collect();
    wanted.remove("0");
    let mut random = Random::new(1);
    for attempt in 0.. {
        assert!(attempt < 1_000_000, "{wanted:?}");
        if wanted.is_empty() {
            break;
        }
        let mut cell = [0.0; 8].map(|_: f64| random.next());
        // Of the rare signs every other cell.
        if attempt % 2 == 0 {
            for (corner, value) in cell.iter_mut().enumerate() {
                *value = value.abs();
                if corner.count_ones() % 2 == 1 {
                    *value = -*value;
                }
            }
        }
        let name = case(&cell);
        let Some(left) = wanted.get_mut(name) else {
            continue;
        };
        *left -= 1;
        if *left == 0 {
            wanted.remove(name);
        }
        // The cell in the middle of a positive layer.
        let mut grid = Grid::closed(4, || 1.0);
        for (corner, value) in cell.iter().enumerate() {
            let [i, j, k] = [0, 1, 2].map(|axis| 1 + (corner >> axis & 1));
            grid.values[(k * 4 + j) * 4 + i] = *value;
        }
        assert_has_its_topology(&grid, &format!("case {name}"));
    }
}

#[test]
fn the_scale_of_values_does_not_matter() {
    for exponent in [-300, -150, 150, 300] {
        for seed in 0..50 {
            let mut random = Random::new(seed);
            let grid = Grid::closed(5, || random.next());
            let sets = grid.sets();
            let mut scaled = grid;
            for value in &mut scaled.values {
                *value *= 10f64.powi(exponent);
            }
            // The ground truth's products overflow: it is that of the grid before.
            let options = Options {
                cell: 1.0,
                ..Options::new(cube(3, 0.0, 4.0))
            };
            let found = mesh(&scaled.field(), (Method::Cubes, &options), &Silent).unwrap();
            let topology = found.shape.topology();
            assert!(topology.watertight && topology.manifold && topology.oriented);
            assert_eq!(topology.components, sets.negative + sets.positive - 1);
            assert_eq!(topology.euler_characteristic() as i64, 2 * sets.euler);
        }
    }
}

/// The ground truth itself, on sets whose topology is known: a ball, a shell and a ring of cells.
#[test]
fn the_subdivision_knows_balls_shells_and_rings() {
    let set = |inside: &dyn Fn([usize; 3]) -> bool| {
        let points: usize = 7;
        let place = |n: usize| [n % points, n / points % points, n / points.pow(2)];
        let value = |n| if inside(place(n)) { -1.0 } else { 1.0 };
        let values = (0..points.pow(3)).map(value).collect();
        let sets = Grid { points, values }.sets();
        (sets.negative, sets.positive, sets.euler)
    };
    let from_middle = |place: [usize; 3]| place.map(|index| index.abs_diff(3));
    assert_eq!(set(&|p| from_middle(p).iter().all(|&d| d <= 1)), (1, 1, 1));
    let shell = |p| from_middle(p).iter().max() == Some(&2);
    assert_eq!(set(&shell), (1, 2, 2));
    let ring = |p| {
        let [x, y, z] = from_middle(p);
        x.max(y) == 2 && z == 0
    };
    assert_eq!(set(&ring), (1, 1, 0));
    assert_eq!(set(&|p| p == [1, 1, 1] || p == [5, 5, 5]), (2, 1, 2));
    // Its values are those of the function.
    let corners = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
    assert_eq!(interpolate(&corners, [0.5, 0.0, 0.0]), 1.5);
    assert_eq!(interpolate(&corners, [1.0, 1.0, 0.25]), 5.0);
}
