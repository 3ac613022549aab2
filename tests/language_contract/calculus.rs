//! Derivative operators against closed forms, to 1e-12 relative to the value's size or 1.

use serde_json::Value;

use crate::common::imp_with;

/// What an expression is at each of the points, under these definitions.
fn values(definitions: &str, expression: &str, points: &[[f64; 3]]) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let listed: Vec<String> = points.iter().map(|p| format!("{p:?}")).collect();
    let expression = format!("[({expression})(p) for p in [{}]]", listed.join(", "));
    let words = ["eval", "-", &expression, "--json"];
    let run = imp_with(folder.path(), &words, definitions.as_bytes()).well();
    run.json()["value"].as_array().unwrap().clone()
}

#[track_caller]
fn near(found: &Value, expected: f64, what: &str) {
    let found = found.as_f64().unwrap_or(f64::NAN);
    let error = (found - expected).abs();
    assert!(
        error <= 1e-12 * expected.abs().max(1.0),
        "{what}: {found} is not {expected}"
    );
}

#[track_caller]
fn agree(
    definitions: &str,
    expression: &str,
    points: &[[f64; 3]],
    closed: impl Fn([f64; 3]) -> f64,
) {
    for (found, &point) in values(definitions, expression, points).iter().zip(points) {
        near(found, closed(point), &format!("{expression} at {point:?}"));
    }
}

#[track_caller]
fn agree_vectors(
    definitions: &str,
    expression: &str,
    points: &[[f64; 3]],
    closed: impl Fn([f64; 3]) -> [f64; 3],
) {
    for (found, &point) in values(definitions, expression, points).iter().zip(points) {
        for (axis, expected) in closed(point).into_iter().enumerate() {
            near(
                &found[axis],
                expected,
                &format!("{expression} [{axis}] at {point:?}"),
            );
        }
    }
}

const POINTS: [[f64; 3]; 4] = [
    [1.0, 0.0, 0.0],
    [0.6, -0.7, 0.5],
    [-1.25, 0.5, 2.0],
    [0.1, 0.2, -0.9],
];

/// As a field and as a plain function of a point.
const SPHERE: [&str; 2] = ["field f(p in R3) = norm(p) - 1", "fn f(p) = norm(p) - 1"];

fn length(p: [f64; 3]) -> f64 {
    (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt()
}

#[test]
fn a_sphere_bends_by_one_over_its_radius() {
    for sphere in SPHERE {
        agree(sphere, "mean_curvature(f)", &POINTS, |p| 1.0 / length(p));
        agree(sphere, "gaussian_curvature(f)", &POINTS, |p| {
            length(p).powi(-2)
        });
        agree(sphere, "k1(f)", &POINTS, |p| 1.0 / length(p));
        agree(sphere, "k2(f)", &POINTS, |p| 1.0 / length(p));
        agree(sphere, "laplacian(f)", &POINTS, |p| 2.0 / length(p));
        agree_vectors(sphere, "normal(f)", &POINTS, |p| p.map(|x| x / length(p)));
        agree_vectors(sphere, "curl(grad(f))", &POINTS, |_| [0.0; 3]);
    }
    // The sign belongs to the solid: a ball's complement has its normal inwards.
    agree(SPHERE[0], "mean_curvature(!f)", &POINTS, |p| {
        -1.0 / length(p)
    });
    // Curvature belongs to the level set and not to the field that describes it.
    let cubed = "field f(p in R3) = exp(norm2(p)^3)";
    agree(cubed, "mean_curvature(f)", &POINTS[..2], |p| {
        1.0 / length(p)
    });
}

#[test]
fn a_circle_in_the_plane_bends_by_one_over_its_radius() {
    let circle = "field c(p in R2) = norm2(p) - 1\nfield f(p in R3) = mean_curvature(c)(p.xy)\n\
        field g(p in R3) = curl(q -> [-q.y, q.x])(p.xy)";
    agree(circle, "f", &POINTS, |p| 1.0 / p[0].hypot(p[1]));
    agree(circle, "g", &POINTS, |_| 2.0);
}

/// The distance from a circle of radius R around the z axis: its level sets are tori.
const TORUS: &str = "let R = 2\nfn f(p) = norm([norm(p.xy) - R, p.z])";

/// Distance from the axis, R, and from the circle.
fn torus(p: [f64; 3]) -> (f64, f64, f64) {
    let rho = p[0].hypot(p[1]);
    (rho, 2.0, (rho - 2.0).hypot(p[2]))
}

const NEAR_TORUS: [[f64; 3]; 4] = [
    [2.5, 0.0, 0.0],
    [1.75, 0.0, 0.25],
    [1.0, -1.5, 0.5],
    [-0.5, 1.25, -0.75],
];

#[test]
fn a_torus_bends_by_its_tube_and_by_its_place() {
    // Across the tube 1/r, along it (rho - R)/(r rho).
    let along = |p| {
        let (rho, big, r) = torus(p);
        (rho - big) / (r * rho)
    };
    agree(TORUS, "k1(f)", &NEAR_TORUS, |p| 1.0 / torus(p).2);
    agree(TORUS, "k2(f)", &NEAR_TORUS, along);
    agree(TORUS, "gaussian_curvature(f)", &NEAR_TORUS, |p| {
        along(p) / torus(p).2
    });
    agree(TORUS, "mean_curvature(f)", &NEAR_TORUS, |p| {
        0.5 * (along(p) + 1.0 / torus(p).2)
    });
}

#[test]
fn an_ellipsoid_and_a_catenoid() {
    let ellipsoid = "let s = [1, 2, 3]\nfield f(p in R3) = norm2(p/s) - 1";
    let at = |u: f64, v: f64| [u.cos() * v.cos(), 2.0 * u.sin() * v.cos(), 3.0 * v.sin()];
    let on = [at(0.0, 0.0), at(0.7, 0.4), at(2.0, -1.1), at(-1.0, 1.3)];
    let h = |p: [f64; 3]| p[0].powi(2) + p[1].powi(2) / 16.0 + p[2].powi(2) / 81.0;
    agree(ellipsoid, "gaussian_curvature(f)", &on, |p| {
        1.0 / (36.0 * h(p).powi(2))
    });
    agree(ellipsoid, "mean_curvature(f)", &on, |p| {
        (14.0 - length(p).powi(2)) / (72.0 * h(p).powf(1.5))
    });
    let catenoid = "field f(x, y, z) = x^2 + y^2 - cosh(z)^2";
    let at = |u: f64, z: f64| [u.cos() * z.cosh(), u.sin() * z.cosh(), z];
    let on = [at(0.0, 0.0), at(0.7, 0.4), at(2.0, -1.1), at(-1.0, 1.3)];
    agree(catenoid, "mean_curvature(f)", &on, |_| 0.0);
    agree(catenoid, "gaussian_curvature(f)", &on, |p| {
        -p[2].cosh().powi(-4)
    });
}

#[test]
fn operators_nest_three_deep() {
    for sphere in SPHERE {
        // The level sets of 1/|p| are spheres seen from inside.
        agree(sphere, "mean_curvature(mean_curvature(f))", &POINTS, |p| {
            -1.0 / length(p)
        });
        agree(
            sphere,
            "mean_curvature(mean_curvature(mean_curvature(f)))",
            &POINTS,
            |p| 1.0 / length(p),
        );
        agree(sphere, "laplacian(laplacian(f))", &POINTS, |_| 0.0);
        agree_vectors(sphere, "grad(norm(grad(laplacian(f))))", &POINTS, |p| {
            p.map(|x| -4.0 * x * length(p).powi(-4))
        });
    }
    // The Laplacian of a torus's mean curvature 1/r - R/(2 r rho), by hand in cylindrical
    // coordinates.
    agree(TORUS, "div(grad(mean_curvature(f)))", &NEAR_TORUS, |p| {
        let (rho, big, r) = torus(p);
        let of_inverse = (1.0 - (rho - big) / rho) / r.powi(3);
        let of_product = of_inverse / rho
            + 2.0 * (rho - big) / (rho * rho * r.powi(3))
            + 1.0 / (r * rho.powi(3));
        of_inverse - 0.5 * big * of_product
    });
    agree_vectors(TORUS, "grad(gaussian_curvature(f))", &NEAR_TORUS, |p| {
        let (rho, big, r) = torus(p);
        let outwards = (rho * r * r - (rho - big) * (r * r + 2.0 * rho * (rho - big)))
            / (rho * rho * r.powi(4));
        let up = -2.0 * p[2] * (rho - big) / (rho * r.powi(4));
        [outwards * p[0] / rho, outwards * p[1] / rho, up]
    });
}

#[test]
fn derivatives_by_parameters_and_coordinates() {
    let blobs = "param b = 0.5\nparam c = [[-1, 0, 0], [1, 0.5, 0]]\nparam s = [0.5, 0.75]\n\
        fn f(p) = b - sum(exp(-norm2(p - ci)/si^2) for [ci, si] in zip(c, s))\n\
        field g(p in R3) = f(p)\nfield dx(p in R3) = diff(g, p.x)(p)";
    let bump = |p: [f64; 3]| {
        let d = [p[0] - 1.0, p[1] - 0.5, p[2]];
        (d, (-length(d).powi(2) / 0.5625).exp())
    };
    for f in ["f", "g"] {
        agree(blobs, &format!("diff({f}, b)"), &POINTS, |_| 1.0);
        agree(blobs, &format!("diff({f}, c[1].x)"), &POINTS, |p| {
            let (d, value) = bump(p);
            -value * 2.0 * d[0] / 0.5625
        });
        agree(blobs, &format!("diff({f}, s)[1]"), &POINTS, |p| {
            let (d, value) = bump(p);
            -value * 2.0 * length(d).powi(2) / 0.75_f64.powi(3)
        });
        // Mixed: F_q and F_x in any order.
        agree(
            blobs,
            &format!("diff(grad({f}), c[1].x)[1]"),
            &POINTS,
            |p| {
                let (d, value) = bump(p);
                value * 4.0 * d[0] * d[1] / 0.5625_f64.powi(2)
            },
        );
    }
    let slope = values(blobs, "grad(g).x", &POINTS);
    for (found, expected) in values(blobs, "dx", &POINTS).iter().zip(slope) {
        assert_eq!(*found, expected);
    }
}

#[test]
fn derivatives_are_sampled_and_polygonized_like_any_field() {
    let folder = tempfile::tempdir().unwrap();
    // |grad(x^2 + 4y^2 + z^2)| = 2 on the ellipsoid x^2 + 16 y^2 + z^2 = 1.
    let program = "field f(p in R3) = norm2(p*[1, 2, 1])\n\
        let m = polygonize(norm(grad(f)) - 2, bounds = -1.2..1.2, cell = 0.05)\n\
        assert(m.watertight and abs(m.volume - 4/3*pi/4) < 0.02, \"{m.volume}\")\n\
        fn ball(p) = norm2(p) - 1\n\
        let s = sample(1 - 2*mean_curvature(ball), bounds = [-3..3, -3..3, -3..3], count = 300)\n\
        assert(len(s) > 100 and max(abs(norm(p) - 2) for p in s.points) < 1e-6)\n";
    imp_with(folder.path(), &["run", "-"], program.as_bytes()).well();
}

#[test]
fn what_has_no_such_derivative_is_told() {
    let folder = tempfile::tempdir().unwrap();
    for (program, code) in [
        ("field f(p in R3) = norm(p)\nlet d = div(f)", "E0401"),
        (
            "field f(p in R2) = norm(p)\nlet k = gaussian_curvature(f)",
            "E0401",
        ),
        ("field f(x) = x^2\nlet k = mean_curvature(f)", "E0401"),
        ("field f(p in R3) = p\nlet k = normal(f)", "E0401"),
        ("let k = mean_curvature(3)", "E0301"),
        (
            "param r = 1\nfield f(x) = r*x\nlet d = diff(f, r^2)",
            "E0404",
        ),
    ] {
        let run = imp_with(folder.path(), &["run", "-"], program.as_bytes());
        assert_eq!(run.code, 1, "{program}");
        assert!(run.stderr.contains(code), "{program}\n{}", run.stderr);
    }
}
