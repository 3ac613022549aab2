//! Boxes that are found for fields without a domain: what they hold, and when there is none.

mod common;

use common::script;

/// The box that `bounds` gives for a field of three coordinates, as (low, high) by axis.
fn found(definitions: &str, field: &str) -> Vec<(f64, f64)> {
    let run = script(&format!("{definitions}\nprint(json(bounds({field})))")).well();
    let value: serde_json::Value = serde_json::from_str(run.stdout.trim()).expect("JSON");
    let side = |side: &serde_json::Value| {
        let end = |name: &str| side[name].as_f64().expect("a number");
        (end("lo"), end("hi"))
    };
    let sides = value.as_array().expect("a list").iter();
    sides.map(side).collect()
}

/// The box must hold the true one, which is known in closed form, and be at most a thirtieth larger
/// on each side.
#[track_caller]
fn holds(definitions: &str, field: &str, expected: &[(f64, f64)]) {
    let found = found(definitions, field);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let lengths = expected.iter().map(|(low, high)| high - low);
    let longest = lengths.fold(0.0, f64::max);
    for (&(low, high), &(least, most)) in found.iter().zip(expected) {
        assert!(low <= least && most <= high, "{field}: {found:?}");
        let slack = longest / 30.0;
        assert!(
            least - low <= slack && high - most <= slack,
            "{field}: {found:?}, not {expected:?}"
        );
    }
}

#[track_caller]
fn has_none(definitions: &str, field: &str, code: &str, why: &str) {
    let run = script(&format!("{definitions}\nprint(bounds({field}))"));
    assert_ne!(run.code, 0, "{}", run.stdout);
    assert!(run.stderr.contains(code), "{}", run.stderr);
    assert!(run.stderr.contains(why), "{}", run.stderr);
}

#[test]
fn polynomials_are_boxed() {
    holds(
        "field f(x, y, z) = x^2 + (y - 3)^2 + z^2 - 1",
        "f",
        &[(-1.0, 1.0), (2.0, 4.0), (-1.0, 1.0)],
    );
    // x⁴ − 5x² is least at x² = 5/2, where it is −25/4: the others have that much to spare, and
    // x⁴ − 5x² = 25/2 − 11.8 has the largest root.
    let c = 11.8;
    let square = (5.0 + (25.0f64 - 4.0 * (c - 12.5)).sqrt()) / 2.0;
    let end = square.sqrt();
    holds(
        &format!("field f(x, y, z) = x^4 - 5*x^2 + y^4 - 5*y^2 + z^4 - 5*z^2 + {c}"),
        "f",
        &[(-end, end); 3],
    );
    // The highest terms vanish along axes: unbounded intervals serve.
    let box_of_double_torus = found(
        "field f(x, y, z) = (x^2*(1 - x^2) - y^2)^2 + z^2 - 0.01",
        "f",
    );
    let [x, y, z] = box_of_double_torus[..] else {
        panic!("three sides");
    };
    // Where y = z = 0, x²(1 − x²) = −1/10; and z² ≤ 1/100.
    let end = ((1.0 + 1.4f64.sqrt()) / 2.0).sqrt();
    assert!(x.1 >= end && x.1 < end + 0.1, "{x:?}");
    assert!(z.1 >= 0.1 && z.1 < 0.2, "{z:?}");
    assert!(y.1 > 0.5 && y.1 < 0.8, "{y:?}");
}

#[test]
fn distances_exponentials_and_the_heart_are_boxed() {
    holds(
        "field f(x, y, z) = (sqrt(x^2 + y^2) - 2)^2 + z^2 - 0.25",
        "f",
        &[(-2.5, 2.5), (-2.5, 2.5), (-0.5, 0.5)],
    );
    // exp(−|p|²) = 1/10.
    let end = 10f64.ln().sqrt();
    holds(
        "field f(p in R3) = 0.1 - exp(-norm2(p))",
        "f",
        &[(-end, end); 3],
    );
    let heart = found(
        "field f(x, y, z) = (x^2 + 9/4*y^2 + z^2 - 1)^3 == x^2*z^3 + 9/80*y^2*z^3",
        "f",
    );
    // It is 1.139 wide and 1.2366 high (extrema of the curve in the plane y = 0), ends at −1.
    assert!(heart[0].1 > 1.139 && heart[0].1 < 1.2, "{heart:?}");
    assert!(heart[2].1 > 1.23 && heart[2].1 < 1.3, "{heart:?}");
    assert!(heart[2].0 <= -1.0 && heart[2].0 > -1.1, "{heart:?}");
}

#[test]
fn blobs_are_boxed_at_the_present_parameters() {
    let blobs = |b: f64| {
        format!(
            "param b = {b} in 0.05..2\n\
             param c = [[-0.8, 0, 0], [0, 0.6, 0], [0.8, 0, 0]]\n\
             field f(p in R3) = b - sum(exp(-norm2(p - ci) / 0.49) for ci in c)"
        )
    };
    let [small, large] = [1.0, 0.5].map(|b| found(&blobs(b), "f"));
    for (small, large) in small.iter().zip(&large) {
        assert!(
            large.0 < small.0 && small.1 < large.1,
            "{small:?} {large:?}"
        );
    }
    // Each blob alone reaches to √(0.49·ln 2) = 0.583 from its centre, all together further.
    let [x, y, z] = large[..] else {
        panic!("three sides");
    };
    assert!(x.0 < -1.383 && x.1 > 1.383 && x.1 < 1.5, "{x:?}");
    assert!(y.0 < -0.5 && y.1 > 1.183 && y.1 < 1.3, "{y:?}");
    assert!(z.1 > 0.583 && z.1 < 0.8, "{z:?}");
}

#[test]
fn other_dimensions_and_large_distances_are_boxed() {
    holds(
        "field f(x, y) = hypot(x - 100, y) - 0.5",
        "f",
        &[(99.5, 100.5), (-0.5, 0.5)],
    );
    holds("field f(x) = x^2 - 2*x", "f", &[(0.0, 2.0)]);
    holds(
        "field f(x, y) = max(abs(x) - 1, abs(y) - 2)",
        "f",
        &[(-1.0, 1.0), (-2.0, 2.0)],
    );
}

#[test]
fn what_has_no_box_says_why() {
    has_none(
        "field f(x, y, z) = x + 2*y - z - 1",
        "f",
        "E0402",
        "infinity",
    );
    let gyroid = "field f(x, y, z) = sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)";
    has_none(gyroid, "f", "E0402", "changes its sign at a distance");
    let clebsch = "field f(x, y, z) = 81*(x^3 + y^3 + z^3) - 189*(x^2*(y + z) + y^2*(x + z) \
                   + z^2*(x + y)) + 54*x*y*z + 126*(x*y + x*z + y*z) - 9*(x^2 + y^2 + z^2) \
                   - 9*(x + y + z) + 1";
    has_none(clebsch, "f", "E0402", "infinity");
    has_none(
        "field f(x, y) = x^2 + y^2 + 1",
        "f",
        "E0405",
        "no zero anywhere",
    );
    let run = script("field f(x, y, z) = z\npolygonize(f)");
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("over"), "{}", run.stderr);
}

#[test]
fn fields_without_a_domain_are_polygonized_in_the_box_that_is_found() {
    let run = script(
        "field f(x, y, z) = x^2 + y^2 + z^2 - 1\n\
         let m = polygonize(f, resolution = 32)\n\
         assert(m.watertight and m.genus == 0)\n\
         assert(abs(m.area / (4*pi) - 1) < 0.01)\n\
         let larger = polygonize(f, iso = 3, resolution = 32)\n\
         assert(abs(larger.area / (16*pi) - 1) < 0.01)",
    );
    run.well();
}
