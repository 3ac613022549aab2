//! Shapes against predicates that are written from their definitions, without distances.
//!
//! The predicate says where F must be negative. It also gives the distance itself: the nearest
//! place of a fine grid where the predicate changes is as far away as |F| says, up to a grid cell.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use imp::library::entries;

use super::points::{self, REACH};
use super::{assert_none, failures, printed, promise};

type Inside = fn(&[f64]) -> bool;

fn norm(vector: &[f64]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Within |p_i| < half_i.
fn in_box(p: &[f64], half: &[f64]) -> bool {
    p.iter().zip(half).all(|(p, half)| p.abs() < *half)
}

/// Left of every side of a convex polygon, counterclockwise.
fn in_convex(x: f64, y: f64, corners: &[[f64; 2]]) -> bool {
    (0..corners.len()).all(|i| {
        let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % corners.len()]);
        (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0
    })
}

/// The winding number of a polygon around a point, by the angles under which sides are seen.
fn in_polygon(x: f64, y: f64, corners: &[[f64; 2]]) -> bool {
    let total: f64 = (0..corners.len())
        .map(|i| {
            let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % corners.len()]);
            let (ax, ay, bx, by) = (ax - x, ay - y, bx - x, by - y);
            (ax * by - ay * bx).atan2(ax * bx + ay * by)
        })
        .sum();
    total.abs() > PI
}

fn regular(n: usize, r: f64, turn: f64) -> Vec<[f64; 2]> {
    let angle = |i: usize| turn + TAU * i as f64 / n as f64;
    (0..n)
        .map(|i| [r * angle(i).cos(), r * angle(i).sin()])
        .collect()
}

fn star(n: usize, r: f64, inner: f64) -> Vec<[f64; 2]> {
    let corner = |i: usize| {
        let (angle, r) = (
            PI * i as f64 / n as f64,
            if i.is_multiple_of(2) { r } else { inner },
        );
        [r * angle.cos(), r * angle.sin()]
    };
    (0..2 * n).map(corner).collect()
}

/// Within r of one of many points of a curve, t in 0..1.
fn near_curve(p: &[f64], r: f64, curve: impl Fn(f64) -> [f64; 2]) -> bool {
    let height = p.get(2).copied().unwrap_or(0.0);
    (0..=200).any(|i| {
        let [x, y] = curve(f64::from(i) / 200.0);
        (p[0] - x).powi(2) + (p[1] - y).powi(2) + height * height < r * r
    })
}

fn near_segment(p: &[f64], a: &[f64], b: &[f64], r: f64) -> bool {
    let along = minus(b, a);
    let t = (dot(&minus(p, a), &along) / dot(&along, &along)).clamp(0.0, 1.0);
    let foot: Vec<f64> = a.iter().zip(&along).map(|(a, d)| a + t * d).collect();
    norm(&minus(p, &foot)) < r
}

/// In front of none of the planes n·p = d.
fn behind(p: &[f64], planes: &[([f64; 3], f64)]) -> bool {
    planes.iter().all(|(n, d)| dot(p, n) < *d)
}

fn round(p: &[f64]) -> f64 {
    p[0].hypot(p[1])
}

fn degrees(angle: f64) -> f64 {
    angle.to_radians()
}

/// The hull of two discs at (0, ∓h/2): some disc on the way holds the point.
fn in_hull(x: f64, y: f64, r1: f64, r2: f64, h: f64) -> bool {
    (0..=200).any(|i| {
        let t = f64::from(i) / 200.0;
        x.hypot(y + h / 2.0 - t * h) < r1 + t * (r2 - r1)
    })
}

const PHI: f64 = 1.618_033_988_749_895;

/// Within the mirror images of planes through all changes of signs, cyclically.
fn within_planes(p: &[f64], n: [f64; 3], d: f64) -> bool {
    (0..3).all(|shift| {
        let size: f64 = (0..3).map(|i| n[i] * p[(i + shift) % 3].abs()).sum();
        size < d
    })
}

const PLANE: &[(&str, Inside)] = &[
    ("circle(1.2)", |p| norm(p) < 1.2),
    ("ellipse(1.4, 0.8)", |p| {
        (p[0] / 1.4).powi(2) + (p[1] / 0.8).powi(2) < 1.0
    }),
    (
        "even_odd([[[-1, -1], [1, -1], [1, 1], [-1, 1]], [[-0.4, -0.4], [0.4, -0.4], [0.4, 0.4], [-0.4, 0.4]]])",
        |p| in_box(p, &[1.0, 1.0]) && !in_box(p, &[0.4, 0.4]),
    ),
    ("rectangle([1.6, 1])", |p| in_box(p, &[0.8, 0.5])),
    ("rectangle_between([-0.5, -1], [1, 0.4])", |p| {
        -0.5 < p[0] && p[0] < 1.0 && -1.0 < p[1] && p[1] < 0.4
    }),
    ("rounded_rectangle([1.6, 1], 0.2)", |p| {
        let q = [p[0].abs(), p[1].abs()];
        let corner = q[0] > 0.6 && q[1] > 0.3;
        in_box(p, &[0.8, 0.5]) && (!corner || (q[0] - 0.6).hypot(q[1] - 0.3) < 0.2)
    }),
    ("chamfer_rectangle([1.6, 1.2], 0.25)", |p| {
        in_box(p, &[0.8, 0.6]) && p[0].abs() + p[1].abs() < 1.4 - 0.25
    }),
    ("segment([-0.8, -0.3], [0.6, 0.5], 0.3)", |p| {
        near_segment(p, &[-0.8, -0.3], &[0.6, 0.5], 0.3)
    }),
    ("line([1, 2], 0.3)", |p| {
        p[0] + 2.0 * p[1] < 0.3 * 5f64.sqrt()
    }),
    (
        "polygon([[-1, -0.8], [1, -0.8], [0.2, 0], [1, 0.9], [-1, 0.6]])",
        |p| {
            in_polygon(
                p[0],
                p[1],
                &[
                    [-1.0, -0.8],
                    [1.0, -0.8],
                    [0.2, 0.0],
                    [1.0, 0.9],
                    [-1.0, 0.6],
                ],
            )
        },
    ),
    ("regular_polygon(5, 1.1)", |p| {
        in_convex(p[0], p[1], &regular(5, 1.1, 0.0))
    }),
    ("star(5, 1.2, 0.5)", |p| {
        in_polygon(p[0], p[1], &star(5, 1.2, 0.5))
    }),
    ("hexagram(1.2)", |p| {
        in_convex(p[0], p[1], &regular(3, 1.2, 0.0)) || in_convex(p[0], p[1], &regular(3, 1.2, PI))
    }),
    ("triangle([-1, -0.7], [1.1, -0.5], [0.1, 1])", |p| {
        in_convex(p[0], p[1], &[[-1.0, -0.7], [1.1, -0.5], [0.1, 1.0]])
    }),
    ("equilateral_triangle(1)", |p| {
        in_convex(p[0], p[1], &regular(3, 1.0, FRAC_PI_2))
    }),
    ("isosceles_triangle(1.4, 1.8)", |p| {
        in_convex(p[0], p[1], &[[-0.7, -0.9], [0.7, -0.9], [0.0, 0.9]])
    }),
    ("trapezoid(1.6, 0.8, 1)", |p| {
        in_convex(
            p[0],
            p[1],
            &[[-0.8, -0.5], [0.8, -0.5], [0.4, 0.5], [-0.4, 0.5]],
        )
    }),
    ("parallelogram(1.2, 1, 0.4)", |p| {
        (p[0] - 0.4 * p[1]).abs() < 0.6 && p[1].abs() < 0.5
    }),
    ("rhombus(1.3, 0.8)", |p| {
        p[0].abs() / 1.3 + p[1].abs() / 0.8 < 1.0
    }),
    ("uneven_capsule(0.6, 0.3, 1)", |p| {
        in_hull(p[0], p[1], 0.6, 0.3, 1.0)
    }),
    ("pie(100deg, 1.2)", |p| {
        norm(p) < 1.2 && p[1].atan2(p[0]).abs() < degrees(50.0)
    }),
    ("arc(200deg, 0.9, 0.25)", |p| {
        near_curve(p, 0.25, |t| {
            let angle = degrees(200.0 * t - 100.0);
            [0.9 * angle.cos(), 0.9 * angle.sin()]
        })
    }),
    ("ring(1.2, 0.7)", |p| 0.7 < norm(p) && norm(p) < 1.2),
    ("cut_disk(1.1, 0.3)", |p| norm(p) < 1.1 && p[1] > 0.3),
    ("vesica(1.3, 0.6)", |p| {
        (p[0] - 0.6).hypot(p[1]) < 1.3 && (p[0] + 0.6).hypot(p[1]) < 1.3
    }),
    ("moon(0.6, 1.1, 0.9)", |p| {
        norm(p) < 1.1 && (p[0] - 0.6).hypot(p[1]) > 0.9
    }),
    ("egg(0.9, 0.3)", |p| {
        // A half disc, and above it the part of three discs that the egg's arcs belong to.
        let (x, y) = (p[0].abs(), p[1]);
        let top = (y - 0.6 * 3f64.sqrt()).hypot(x) < 0.3;
        let below = y < 0.0 && x.hypot(y) < 0.9;
        let side = y >= 0.0 && (x + 0.6).hypot(y) < 1.5 && 3f64.sqrt() * (x + 0.6) >= y;
        below || side || (y >= 0.0 && 3f64.sqrt() * (x + 0.6) < y && top)
    }),
    ("heart(1.4)", |p| {
        let (x, y) = (p[0].abs() / 1.4, p[1] / 1.4);
        (x < y && x + y < 1.0) || (x - 0.25).hypot(y - 0.75) < 0.125f64.sqrt()
    }),
    ("plus_sign(1.8, 0.6)", |p| {
        in_box(p, &[0.9, 0.3]) || in_box(p, &[0.3, 0.9])
    }),
    ("rounded_x(1.4, 0.2)", |p| {
        near_segment(p, &[-0.7, -0.7], &[0.7, 0.7], 0.2)
            || near_segment(p, &[-0.7, 0.7], &[0.7, -0.7], 0.2)
    }),
    ("parabola(0.8)", |p| p[1] > 0.8 * p[0] * p[0]),
    ("bezier2([-1, -0.6], [0.2, 1.4], [1, -0.4], 0.15)", |p| {
        near_curve(p, 0.15, |t| {
            let s = 1.0 - t;
            let part = |a: f64, b: f64, c: f64| s * s * a + 2.0 * s * t * b + t * t * c;
            [part(-1.0, 0.2, 1.0), part(-0.6, 1.4, -0.4)]
        })
    }),
    ("stairs(3, 0.5, 0.4)", |p| {
        0.0 < p[0] && p[0] < 1.5 && 0.0 < p[1] && p[1] < 0.4 * (p[0] / 0.5).floor() + 0.4
    }),
    ("tunnel(1.6, 0.8)", |p| {
        (p[0].abs() < 0.8 && -0.8 < p[1] && p[1] <= 0.0) || (p[1] > 0.0 && norm(p) < 0.8)
    }),
    ("horseshoe(220deg, 0.8, 0.4, 0.3)", |p| {
        let half = degrees(110.0);
        let (x, y) = (p[0].abs(), p[1]);
        let angle = x.atan2(-y);
        let arc = angle < half && (x.hypot(y) - 0.8).abs() < 0.15;
        let along = x * half.cos() + y * half.sin();
        let across = x * half.sin() - y * half.cos();
        arc || ((0.0..0.4).contains(&along) && (across - 0.8).abs() < 0.15)
    }),
];

const SOLIDS: &[(&str, Inside)] = &[
    ("sphere(1.2)", |p| norm(p) < 1.2),
    ("box([1.6, 1, 1.2])", |p| in_box(p, &[0.8, 0.5, 0.6])),
    ("box_between([-0.5, -1, -0.7], [1, 0.4, 0.9])", |p| {
        in_box(&minus(p, &[0.25, -0.3, 0.1]), &[0.75, 0.7, 0.8])
    }),
    ("rounded_box([1.6, 1, 1.2], 0.2)", |p| {
        let beyond: Vec<f64> = minus(
            &p.iter().map(|p| p.abs()).collect::<Vec<_>>(),
            &[0.6, 0.3, 0.4],
        );
        norm(&beyond.iter().map(|b| b.max(0.0)).collect::<Vec<_>>()) < 0.2
    }),
    ("box_frame([1.8, 1.4, 1.6], 0.3)", |p| {
        let half = [0.9, 0.7, 0.8];
        let near = (0..3).filter(|&i| p[i].abs() > half[i] - 0.3).count();
        in_box(p, &half) && near >= 2
    }),
    ("torus(0.9, 0.35)", |p| (round(p) - 0.9).hypot(p[2]) < 0.35),
    ("capped_torus(200deg, 0.9, 0.3)", |p| {
        near_curve(p, 0.3, |t| {
            let angle = degrees(200.0 * t - 100.0);
            [0.9 * angle.cos(), 0.9 * angle.sin()]
        })
    }),
    ("link(0.6, 0.6, 0.2)", |p| {
        let x = p[0].abs() - 0.3;
        let ring = if x > 0.0 { x.hypot(p[1]) } else { p[1].abs() };
        (ring - 0.6).hypot(p[2]) < 0.2
    }),
    ("cylinder(0.8, 1.2)", |p| round(p) < 0.8 && p[2].abs() < 0.6),
    ("cylinder_inf(0.7)", |p| round(p) < 0.7),
    ("rounded_cylinder(0.9, 0.2, 1.2)", |p| {
        let (r, z) = (round(p), p[2].abs());
        let edge = r > 0.7 && z > 0.4;
        r < 0.9 && z < 0.6 && (!edge || (r - 0.7).hypot(z - 0.4) < 0.2)
    }),
    ("capsule([-0.6, -0.3, -0.4], [0.6, 0.4, 0.5], 0.4)", |p| {
        near_segment(p, &[-0.6, -0.3, -0.4], &[0.6, 0.4, 0.5], 0.4)
    }),
    ("cone(0.9, 1.5)", |p| {
        p[2] > -0.75 && round(p) < 0.9 * (0.75 - p[2]) / 1.5
    }),
    (
        "capped_cone([-0.3, -0.2, -0.6], [0.3, 0.1, 0.7], 0.8, 0.4)",
        |p| {
            let (a, b) = ([-0.3, -0.2, -0.6], [0.3, 0.1, 0.7]);
            let along = minus(&b, &a);
            let t = dot(&minus(p, &a), &along) / dot(&along, &along);
            let foot: Vec<f64> = a.iter().zip(&along).map(|(a, d)| a + t * d).collect();
            (0.0..1.0).contains(&t) && norm(&minus(p, &foot)) < 0.8 - 0.4 * t
        },
    ),
    ("round_cone(0.7, 0.35, 1)", |p| {
        in_hull(round(p), p[2], 0.7, 0.35, 1.0)
    }),
    ("solid_angle(80deg, 1.2)", |p| {
        norm(p) < 1.2 && round(p).atan2(p[2]) < degrees(40.0)
    }),
    ("cut_sphere(1.1, 0.2)", |p| norm(p) < 1.1 && p[2] > 0.2),
    ("hollow_cut_sphere(1, 0.2, 0.25)", |p| {
        let rim = (1.0 - 0.04f64).sqrt();
        let wall = (norm(p) - 1.0).abs() < 0.125 && p[2] < 0.2 * norm(p);
        wall || (round(p) - rim).hypot(p[2] - 0.2) < 0.125
    }),
    ("ellipsoid([1.3, 0.7, 0.9])", |p| {
        (p[0] / 1.3).powi(2) + (p[1] / 0.7).powi(2) + (p[2] / 0.9).powi(2) < 1.0
    }),
    ("plane([1, 2, -1], 0.3)", |p| {
        p[0] + 2.0 * p[1] - p[2] < 0.3 * 6f64.sqrt()
    }),
    ("half_space([1, 2, -1], [0.2, 0, 0.4])", |p| {
        p[0] + 2.0 * p[1] - p[2] < -0.2
    }),
    ("slab(0.9, [1, 0, 1])", |p| {
        (p[0] + p[2]).abs() < 0.45 * 2f64.sqrt()
    }),
    ("prism(5, 1, 1.2)", |p| {
        p[2].abs() < 0.6 && in_convex(p[0], p[1], &regular(5, 1.0, 0.0))
    }),
    ("hex_prism(1, 1.1)", |p| {
        p[2].abs() < 0.55 && in_convex(p[0], p[1], &regular(6, 1.0, 0.0))
    }),
    ("tri_prism(1.1, 1)", |p| {
        p[2].abs() < 0.5 && in_convex(p[0], p[1], &regular(3, 1.1, 0.0))
    }),
    ("rhombus_prism(1.1, 0.7, 1)", |p| {
        p[0].abs() / 1.1 + p[1].abs() / 0.7 < 1.0 && p[2].abs() < 0.5
    }),
    (
        "convex_polyhedron([[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[-1, -1, -1], [1, 0, 0], [0, 1, 0]], [[-1, -1, -1], [0, 1, 0], [0, 0, 1]], [[-1, -1, -1], [0, 0, 1], [1, 0, 0]]])",
        |p| {
            // The hull of the unit vectors and -(1, 1, 1): x + y - 3 z < 1 and so on.
            behind(
                p,
                &[
                    ([1.0, 1.0, 1.0], 1.0),
                    ([1.0, 1.0, -3.0], 1.0),
                    ([1.0, -3.0, 1.0], 1.0),
                    ([-3.0, 1.0, 1.0], 1.0),
                ],
            )
        },
    ),
    ("pyramid(1.6, 1.4)", |p| {
        p[2] > -0.7 && p[0].abs().max(p[1].abs()) < 0.8 * (0.7 - p[2]) / 1.4
    }),
    ("wedge([1.4, 1, 1.2])", |p| {
        in_box(p, &[0.7, 0.5, 0.6]) && p[0] / 0.7 + p[2] / 0.6 < 0.0
    }),
    ("tetrahedron(1.3)", |p| {
        let d = 1.3 / 3f64.sqrt();
        behind(
            p,
            &[
                ([-1.0, -1.0, -1.0], d),
                ([-1.0, 1.0, 1.0], d),
                ([1.0, -1.0, 1.0], d),
                ([1.0, 1.0, -1.0], d),
            ],
        )
    }),
    ("octahedron(1.2)", |p| {
        p[0].abs() + p[1].abs() + p[2].abs() < 1.2
    }),
    ("dodecahedron(1.1)", |p| {
        // The planes through the corner (1, 1, 1) r/√3 across (0, φ, 1).
        within_planes(p, [0.0, PHI, 1.0], 1.1 / 3f64.sqrt() * (1.0 + PHI))
    }),
    ("icosahedron(1.2)", |p| {
        // The planes through the corner (0, 1, φ) s across (1, 1, 1) and (0, 1/φ, φ) turned.
        let s = 1.2 / (1.0 + PHI * PHI).sqrt();
        let size = p[0].abs() + p[1].abs() + p[2].abs();
        size < s * (1.0 + PHI) && within_planes(p, [0.0, PHI, 1.0 / PHI], s * (1.0 + PHI))
    }),
    (
        "mirrored_polyhedron([[[1, 0, 0], [0, 1, 0], [0, 0, 1]]])",
        |p| p[0].abs() + p[1].abs() + p[2].abs() < 1.0,
    ),
    ("vesica3(1.3, 0.6)", |p| (round(p) + 0.6).hypot(p[2]) < 1.3),
    (
        "triangle3([-1, -0.6, 0], [1, -0.5, 0.4], [0, 0.9, -0.3], 0.2)",
        |p| {
            near_triangle(
                p,
                0.2,
                [[-1.0, -0.6, 0.0], [1.0, -0.5, 0.4], [0.0, 0.9, -0.3]],
            )
        },
    ),
    (
        "quad3([-1, -0.6, 0], [1, -0.6, 0.4], [0.8, 0.6, 0.36], [-0.8, 0.6, 0.04], 0.2)",
        |p| {
            near_triangle(
                p,
                0.2,
                [[-1.0, -0.6, 0.0], [1.0, -0.6, 0.4], [0.8, 0.6, 0.36]],
            ) || near_triangle(
                p,
                0.2,
                [[-1.0, -0.6, 0.0], [0.8, 0.6, 0.36], [-0.8, 0.6, 0.04]],
            )
        },
    ),
    (
        "polyline([[-1, -0.5, 0], [0, 0.6, 0.3], [0.4, -0.6, 0.5], [1, 0.4, -0.4]], 0.15)",
        |p| {
            near_segment(p, &[-1.0, -0.5, 0.0], &[0.0, 0.6, 0.3], 0.15)
                || near_segment(p, &[0.0, 0.6, 0.3], &[0.4, -0.6, 0.5], 0.15)
                || near_segment(p, &[0.4, -0.6, 0.5], &[1.0, 0.4, -0.4], 0.15)
        },
    ),
];

/// Above or below a triangle by less than r, or near one of its sides.
fn near_triangle(p: &[f64], r: f64, corners: [[f64; 3]; 3]) -> bool {
    let [a, b, c] = corners;
    let (u, v, w) = (minus(&b, &a), minus(&c, &a), minus(p, &a));
    // w = s u + t v + the rest across both: the normal equations.
    let (uu, uv, vv) = (dot(&u, &u), dot(&u, &v), dot(&v, &v));
    let (uw, vw) = (dot(&u, &w), dot(&v, &w));
    let d = uu * vv - uv * uv;
    let (s, t) = ((vv * uw - uv * vw) / d, (uu * vw - uv * uw) / d);
    let rest: Vec<f64> = (0..3).map(|i| w[i] - s * u[i] - t * v[i]).collect();
    let over = s > 0.0 && t > 0.0 && s + t < 1.0 && norm(&rest) < r;
    over || (0..3).any(|i| near_segment(p, &corners[i], &corners[(i + 1) % 3], r))
}

/// Every plane figure and solid that says something of distances stands in a table.
#[test]
fn every_shape_has_a_predicate() {
    for entry in entries() {
        if !["Plane figures", "Solids"].contains(&entry.section) {
            continue;
        }
        let promise = promise(entry);
        let first = [&promise.exact, &promise.exact_outside, &promise.bound]
            .into_iter()
            .find_map(|list| list.first());
        if let Some(example) = first {
            let known = PLANE
                .iter()
                .chain(SOLIDS)
                .any(|(shape, _)| shape == example);
            assert!(known, "no predicate for {example}");
        }
    }
}

/// Middles of the edges of a grid along which the predicate changes.
fn border(inside: Inside, dimension: usize, cells: usize) -> Vec<Vec<f64>> {
    let side = 2.0 * REACH / cells as f64;
    let count = cells + 1;
    let point = |index: usize| -> Vec<f64> {
        (0..dimension)
            .map(|axis| -REACH + side * (index / count.pow(axis as u32) % count) as f64)
            .collect()
    };
    let total = count.pow(dimension as u32);
    let inside_at: Vec<bool> = (0..total).map(|index| inside(&point(index))).collect();
    let mut found = Vec::new();
    for index in 0..total {
        for axis in 0..dimension {
            let stride = count.pow(axis as u32);
            let last = index / stride % count == cells;
            if !last && inside_at[index] != inside_at[index + stride] {
                let mut middle = point(index);
                middle[axis] += side / 2.0;
                found.push(middle);
            }
        }
    }
    found
}

fn check((shape, inside, dimension): &(&str, Inside, usize)) -> Result<(), String> {
    let cells = if *dimension == 2 { 200 } else { 32 };
    let side = 2.0 * REACH / cells as f64;
    let border = border(*inside, *dimension, cells);
    let bound = shape.starts_with("ellips");
    let points = points::random(*dimension, 100);
    let text = format!("let f = {shape}\nfor p in {points:?} {{ print(json(f(p))) }}\n");
    let lines = printed(&text).map_err(|error| format!("{shape}: {error}"))?;
    assert_eq!(lines.len(), points.len());
    for (point, line) in points.iter().zip(&lines) {
        let value: f64 = line.parse().unwrap_or(f64::NAN);
        if value.is_nan() {
            return Err(format!("{shape} is {line} at {point:?}"));
        }
        // Predicates of curves are made of many points: 2e-3 is beyond their steps.
        if value.abs() > 2e-3 && inside(point) != (value < 0.0) {
            return Err(format!("{shape} is {value} at {point:?}"));
        }
        let distance = border
            .iter()
            .map(|place| norm(&minus(point, place)))
            .fold(f64::INFINITY, f64::min);
        let edge = REACH
            - point
                .iter()
                .fold(0.0, |most: f64, part| most.max(part.abs()));
        // The border that is nearest may lie outside of the grid.
        let unseen = distance > edge;
        // The grid misses thin tips, up to a few cells of them.
        let tolerance = 3.0 * side;
        let too_far = value.abs() > distance + tolerance;
        let too_near = !bound && !unseen && value > 0.0 && value < distance - tolerance;
        if too_far || too_near {
            return Err(format!(
                "{shape} is {value} at {point:?}, {distance} from the border"
            ));
        }
    }
    Ok(())
}

#[test]
fn shapes_are_where_they_should_be() {
    let plane = PLANE.iter().map(|&(shape, inside)| (shape, inside, 2));
    let solids = SOLIDS.iter().map(|&(shape, inside)| (shape, inside, 3));
    let all: Vec<(&str, Inside, usize)> = plane.chain(solids).collect();
    assert_none(&failures(&all, check));
}
