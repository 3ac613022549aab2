//! Fields that are no distances, against formulas that are written here in another way: sums,
//! products and integrals instead of closed forms.

use super::{assert_none, failures, points, printed};

type Formula = fn(&[f64]) -> f64;

/// The integral over 0..1 by Simpson's rule.
fn integral(f: impl Fn(f64) -> f64) -> f64 {
    const PIECES: usize = 400;
    let h = 1.0 / PIECES as f64;
    let at = |i: usize| f(h * i as f64);
    let inner: f64 = (1..PIECES)
        .map(|i| at(i) * if i.is_multiple_of(2) { 2.0 } else { 4.0 })
        .sum();
    (at(0) + inner + at(PIECES)) * h / 3.0
}

fn square(p: &[f64], q: &[f64]) -> f64 {
    p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum()
}

fn mixed(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect()
}

fn kernel(p: &[f64], q: &[f64], s: f64) -> f64 {
    (1.0 + s * s * square(p, q)).powi(-2)
}

/// cos(n arccos x), continued by cosh outside of -1..1.
fn chebyshev(n: i32, x: f64) -> f64 {
    let n = f64::from(n);
    if x.abs() <= 1.0 {
        (n * x.acos()).cos()
    } else {
        x.signum().powf(n) * (n * x.abs().acosh()).cosh()
    }
}

fn gyroid(p: &[f64]) -> f64 {
    (0..3).map(|i| p[i].sin() * p[(i + 1) % 3].cos()).sum()
}

const FIELDS: &[(&str, Formula)] = &[
    ("gyroid()", gyroid),
    ("gyroid(2)", |p| {
        gyroid(
            &p.iter()
                .map(|x| x * std::f64::consts::PI)
                .collect::<Vec<_>>(),
        )
    }),
    ("schwarz_p()", |p| p.iter().map(|x| x.cos()).sum()),
    ("schwarz_d()", |p| {
        // The sum over all even numbers of cosines among the factors is this one product form.
        let [x, y, z] = [p[0], p[1], p[2]];
        x.cos() * (y + z).sin() + x.sin() * (y - z).cos()
    }),
    ("neovius()", |p| {
        let c: Vec<f64> = p.iter().map(|x| x.cos()).collect();
        3.0 * c.iter().sum::<f64>() + 4.0 * c.iter().product::<f64>()
    }),
    ("iwp()", |p| {
        let c: Vec<f64> = p.iter().map(|x| x.cos()).collect();
        let total: f64 = c.iter().sum();
        let squares: f64 = c.iter().map(|c| c * c).sum();
        (total * total - squares) - (2.0 * squares - 3.0)
    }),
    ("blob_wyvill([0.3, 0, 0], 2)", |p| {
        let t = square(p, &[0.3, 0.0, 0.0]) / 4.0;
        let soft = 1.0 - 22.0 / 9.0 * t + 17.0 / 9.0 * t * t - 4.0 / 9.0 * t * t * t;
        if t < 1.0 { soft } else { 0.0 }
    }),
    (
        "convolution_line([-0.5, 0.2, 0], [0.7, -0.4, 0.3], 1.5)",
        |p| {
            let (a, b) = ([-0.5, 0.2, 0.0], [0.7, -0.4, 0.3]);
            square(&a, &b).sqrt() * integral(|t| kernel(p, &mixed(&a, &b, t), 1.5))
        },
    ),
    ("convolution_arc(150deg, 0.8, 1.5)", |p| {
        let angle = 150f64.to_radians();
        let arc = |t: f64| {
            let at = angle * (t - 0.5);
            kernel(p, &[0.8 * at.cos(), 0.8 * at.sin(), 0.0], 1.5)
        };
        0.8 * angle * integral(arc)
    }),
    (
        "convolution_triangle([-0.5, 0.2, 0], [0.7, -0.4, 0.3], [0.1, 0.8, -0.2], 1.2)",
        |p| {
            let (a, b, c) = ([-0.5, 0.2, 0.0], [0.7, -0.4, 0.3], [0.1, 0.8, -0.2]);
            let u: Vec<f64> = (0..3).map(|i| b[i] - a[i]).collect();
            let v: Vec<f64> = (0..3).map(|i| c[i] - a[i]).collect();
            let across: f64 = (0..3)
                .map(|i| {
                    (u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]).powi(2)
                })
                .sum();
            let strip = |t: f64| {
                let (from, to) = (mixed(&a, &b, t), mixed(&a, &c, t));
                t * integral(|s| kernel(p, &mixed(&from, &to, s), 1.2))
            };
            across.sqrt() * integral(strip)
        },
    ),
    ("r_union(sphere(1), plane([0, 0, 1]))", |p| {
        let (a, b) = (square(p, &[0.0; 3]).sqrt() - 1.0, p[2]);
        // The smaller root of (F - a - b)² = a² + b².
        2.0 * a * b / (a + b + a.hypot(b))
    }),
    ("smooth_union(sphere(1), plane([0, 0, 1]), 0.6)", |p| {
        let (a, b) = (square(p, &[0.0; 3]).sqrt() - 1.0, p[2]);
        let t = (0.5 + 0.5 * (b - a) / 0.6).clamp(0.0, 1.0);
        b + (a - b) * t - 0.6 * t * (1.0 - t)
    }),
    (
        "round_union(plane([1, 0, 0]), plane([0, 1, 0]), 0.5)",
        |p| {
            // Near the edge the distance from a circle of radius 1/2 that touches both planes.
            if p[0] < 0.5 && p[1] < 0.5 {
                let center = (0.5 - p[0]).hypot(0.5 - p[1]);
                if p[0].min(p[1]) > 0.5 {
                    p[0].min(p[1])
                } else {
                    0.5 - center
                }
            } else {
                p[0].min(p[1])
            }
        },
    ),
    (
        "chamfer_union(plane([1, 0, 0]), plane([0, 1, 0]), 0.5)",
        |p| {
            let bevel = (p[0] - 0.25 + p[1] - 0.25) / 2f64.sqrt();
            p[0].min(p[1]).min(bevel)
        },
    ),
    ("algebraic.chmutov_sextic", |p| {
        p.iter().map(|x| chebyshev(6, *x)).sum()
    }),
    ("algebraic.chmutov_octic", |p| {
        1.0 + p.iter().map(|x| chebyshev(8, *x)).sum::<f64>()
    }),
    ("algebraic.torus", |p| {
        // |p - circle|² = r² twice: for the nearer and the farther point of the circle.
        let r = p[0].hypot(p[1]);
        ((r - 1.0).powi(2) + p[2] * p[2] - 0.25) * ((r + 1.0).powi(2) + p[2] * p[2] - 0.25)
    }),
    ("algebraic.steiner_roman", |p| {
        let pairs: f64 = (0..3).map(|i| (p[i] * p[(i + 1) % 3]).powi(2)).sum();
        pairs - 2.0 * p.iter().product::<f64>()
    }),
    ("algebraic.clebsch", |p| {
        // Power sums instead of monomials.
        let power = |n: i32| p.iter().map(|x| x.powi(n)).sum::<f64>();
        let (s1, s2, s3) = (power(1), power(2), power(3));
        let xyz = p.iter().product::<f64>();
        let pairs = (s1 * s1 - s2) / 2.0;
        81.0 * s3 - 189.0 * (s1 * s2 - s3) + 54.0 * xyz + 126.0 * pairs - 9.0 * s2 - 9.0 * s1 + 1.0
    }),
    ("algebraic.decocube", |p| {
        (0..3)
            .map(|i| {
                let [x, y, z] = [p[i], p[(i + 1) % 3], p[(i + 2) % 3]];
                (x.hypot(y).powi(2) - 0.9025).powi(2) + (z * z - 1.0).powi(2)
            })
            .product::<f64>()
            - 0.01
    }),
];

fn check((field, formula): &(&str, Formula)) -> Result<(), String> {
    let points = points::random(3, 40);
    let text = format!("let f = {field}\nfor p in {points:?} {{ print(json(f(p))) }}\n");
    let lines = printed(&text).map_err(|error| format!("{field}: {error}"))?;
    assert_eq!(lines.len(), points.len());
    for (point, line) in points.iter().zip(&lines) {
        let value: f64 = line.parse().unwrap();
        let expected = formula(point);
        // Polynomials of high degree are sums of large terms; integrals are good to 1e-9.
        let size = point
            .iter()
            .fold(1.0, |most: f64, x| most.max(x.abs()))
            .powi(8);
        if (value - expected).abs() > 1e-9 * size.max(expected.abs()) {
            return Err(format!(
                "{field} is {value} at {point:?}, and should be {expected}"
            ));
        }
    }
    Ok(())
}

#[test]
fn fields_are_their_formulas() {
    assert_none(&failures(FIELDS, check));
}

/// The gradient of noise is continuous, in and across cells: it is that of differences.
#[test]
fn noise_is_smooth() {
    let points = points::random(3, 60);
    let text = format!(
        "let f = as_field(p -> noise(p, seed = 5))\n\
         let g = grad(f)\n\
         for p in {points:?} {{\n\
             let q = [round(p.x), p.y, p.z]\n\
             for at in [p, q] {{\n\
                 let h = 1e-5\n\
                 let d = [f(at + h*e) - f(at - h*e) for e in [[1, 0, 0], [0, 1, 0], [0, 0, 1]]] / (2*h)\n\
                 print(json([norm(g(at) - d), f(at)]))\n\
             }}\n\
         }}\n"
    );
    let lines = printed(&text).unwrap();
    assert_eq!(lines.len(), 120);
    let values: Vec<[f64; 2]> = lines
        .iter()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert!(values.iter().all(|[error, _]| *error < 1e-6), "{values:?}");
    assert!(values.iter().all(|[_, value]| value.abs() <= 1.0));
    assert!(values.iter().any(|[_, value]| *value > 0.3));
    assert!(values.iter().any(|[_, value]| *value < -0.3));
}
