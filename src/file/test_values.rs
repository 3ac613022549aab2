//! Values for the tests of the formats, with numbers that rounding would spoil.

use glam::DVec3;

use crate::geometry::{Animation, Curves, Image, Mesh, Polyline, Samples, Solid};

/// Numbers whose shortest text is long, tiny, huge, negative or zero.
const AWKWARD: [f64; 9] = [
    0.1,
    1.0 / 3.0,
    -2.0,
    5e-324,
    1.7976931348623157e308,
    -1e-7,
    123456789.12345679,
    0.0,
    1e23,
];

fn awkward(number: usize) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| AWKWARD[(3 * number + 2 * axis) % AWKWARD.len()]))
}

/// Unit vectors up to rounding.
fn unit(number: usize) -> DVec3 {
    DVec3::new(2.0 / 7.0, 3.0 / 7.0 - number as f64 * 1e-16, 6.0 / 7.0)
}

/// Five vertices, three triangles, normals.
pub(super) fn mesh() -> Mesh {
    Mesh {
        positions: (0..5).map(awkward).collect(),
        normals: (0..5).map(unit).collect(),
        triangles: vec![[0, 1, 2], [2, 1, 3], [3, 4, 0]],
    }
}

/// The same without normals.
pub(super) fn mesh_without_normals() -> Mesh {
    Mesh {
        normals: Vec::new(),
        ..mesh()
    }
}

/// As many with positions that single precision holds exactly, for formats that have no other.
pub(super) fn single_precision_mesh() -> Mesh {
    let place = |number: usize| DVec3::new(number as f64 / 8.0, -1.5, (number * number) as f64);
    Mesh {
        positions: (0..5).map(place).collect(),
        ..mesh()
    }
}

/// Four samples.
pub(super) fn samples() -> Samples {
    Samples {
        dimension: 3,
        positions: (0..4).map(awkward).collect(),
        normals: (0..4).map(unit).collect(),
        radii: AWKWARD[..4].to_vec(),
        residuals: AWKWARD[5..].to_vec(),
        tangents: Vec::new(),
        weights: Vec::new(),
    }
}

/// The same with tangents and weights.
pub(super) fn samples_of_lines() -> Samples {
    Samples {
        tangents: (1..5).map(unit).collect(),
        weights: AWKWARD[1..5].to_vec(),
        ..samples()
    }
}

/// Three columns and two rows, every pixel different, some of them transparent.
pub(super) fn image() -> Image {
    let pixel = |number: u8| {
        [
            10 * number,
            255 - number,
            0,
            if number < 2 { 0 } else { 255 },
        ]
    };
    Image {
        width: 3,
        height: 2,
        pixels: (0..6).map(pixel).collect(),
    }
}

/// Two pictures, 40 ms each.
pub(super) fn animation() -> Animation {
    let first = image();
    let mut second = image();
    second.pixels.reverse();
    Animation {
        frames: vec![first, second],
        delay: 40,
    }
}

/// A closed triangle, an open curve, a curve without points and one of a single point.
pub(super) fn plane_curves() -> Curves {
    let polyline = |points: &[(f64, f64)], closed| Polyline {
        points: points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect(),
        closed,
    };
    Curves {
        dimension: 2,
        polylines: vec![
            polyline(&[(0.1, 0.2), (1.0 / 3.0, -4.0), (7.0, 1e-7)], true),
            polyline(&[(-3.0, 0.0), (2.0, 123.456)], false),
            polyline(&[], true),
            polyline(&[(1.0, 2.0)], false),
        ],
    }
}

/// One open curve in space.
pub(super) fn space_curves() -> Curves {
    Curves {
        dimension: 3,
        polylines: vec![Polyline {
            points: (0..3).map(awkward).collect(),
            closed: false,
        }],
    }
}

/// What a writer makes of a value.
pub(super) fn bytes<T>(
    writer: impl Fn(&mut dyn std::io::Write, &T) -> std::io::Result<()>,
    value: &T,
) -> Vec<u8> {
    let mut bytes = Vec::new();
    writer(&mut bytes, value).unwrap();
    bytes
}

/// The same as text.
pub(super) fn text<T>(
    writer: impl Fn(&mut dyn std::io::Write, &T) -> std::io::Result<()>,
    value: &T,
) -> String {
    String::from_utf8(bytes(writer, value)).unwrap()
}

/// Two tetrahedra with a common face.
pub(super) fn solid() -> Solid {
    Solid {
        dimension: 3,
        nodes: vec![
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::splat(0.1 + 0.9),
        ],
        simplices: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
    }
}
