//! What is measured on meshes of level sets, and what is made of them: in scripts, on the command
//! line, and against closed forms.

#[path = "../common/mod.rs"]
mod common;

use common::{imp_in, script};
use serde_json::{Value, json};

/// The torus with radii 1 and 0.4.
const TORUS: &str = "field torus(x, y, z) over -1.5..1.5 = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.16\n";

/// Runs a script of assertions.
fn holds(text: &str) {
    script(text).well();
}

#[test]
fn quality_and_deviation_have_names() {
    holds(&format!(
        "{TORUS}
let m = polygonize(torus, cell = 0.05)
let q = quality(m)
assert(0 <= q.worst_ratio and q.worst_ratio <= q.hundredth_ratio and q.hundredth_ratio <= q.median_ratio and q.median_ratio <= 1)
assert(q.self_intersections == 0)
assert(m.quality.mean_ratio == q.mean_ratio)
let d = deviation(m, torus)
assert(d.vertex_max < 1e-8 and d.vertex_rms <= d.vertex_max)
# A facet of size h is h^2/8 by the curvature below the surface; a cell's diagonal is 0.087.
assert(d.facet_max < 0.087^2/8/0.4*1.5 and d.facet_max > 1e-5)
assert(d.normal_max < 45 and d.normal_mean < 5 and d.turned == 0 and d.undefined == 0)
# The torus with the tube 0.01 thicker is 0.01 away, and F is off by the square of that.
let thicker = deviation(m, p -> (sqrt(p.x^2 + p.y^2) - 1)^2 + p.z^2 - 0.41^2)
assert(abs(thicker.vertex_rms - 0.01) < 2e-4)
assert(m.boundary_loops == 0 and m.nonmanifold_edges == 0 and m.nonmanifold_vertices == 0 and m.oriented)
assert(norm(m.centroid) < 1e-3)
"
    ));
}

#[test]
fn what_closes_a_mesh_along_its_box_is_no_part_of_its_deviation() {
    holds(
        "field ball(x, y, z) over [-1.5..1.5, -1.5..1.5, 0..1.5] = x^2 + y^2 + z^2 - 1
for method in [\"dual\", \"cubes\", \"octree\"] {
    let half = polygonize(ball, method = method, cell = 0.1)
    assert(half.watertight)
    let d = deviation(half, ball)
    # The disk at z = 0 has the area pi, and its facets are at most as large as half a cell.
    assert(d.capped > 600 and d.turned == 0 and d.vertex_max < 1e-8)
    # A facet with the sides h is at most h^2/2 by the curvature away, by a cell's diagonal here.
    assert(d.facet_max < 0.173^2/2)
    assert(deviation(polygonize(ball, method = method, cell = 0.1, cap = false), ball).capped == 0)
}
",
    );
}

#[test]
fn a_level_set_with_an_interior_is_told_of() {
    let flat =
        "field flat(x, y) over -1..1 = max(norm([x, y]) - 0.7, 0) - max(0.3 - norm([x, y]), 0)\n";
    let run = script(&format!("{flat}print(polygonize(flat).components)\n"));
    assert!(run.stderr.contains("W0821"), "{}", run.stderr);
    let ring = "field ring(x, y) over -1..1 = abs(norm([x, y]) - 0.5) - 0.1\n";
    let run = script(&format!("{ring}print(polygonize(ring).components)\n"));
    assert!(!run.stderr.contains("W0821"), "{}", run.stderr);
}

#[test]
fn simplified_meshes_keep_their_topology() {
    holds(
        "field double(x, y, z) over -1.3..1.3 = (x^2*(1 - x^2) - y^2)^2 + z^2 - 0.01
let m = polygonize(double, cell = 0.04)
for count in [2000, 600] {
    let s = simplify(m, count = count)
    assert(s.triangles <= count and s.triangles > count - 3)
    assert(s.genus == 2 and s.components == m.components and s.watertight and s.manifold)
    assert(quality(s).self_intersections == 0)
}
field part(x, y, z) over -1.5..1.5 = max(max(max(abs(x), abs(y)), abs(z)) - 1, 0.5 - sqrt(x^2 + y^2))
let p = polygonize(part, cell = 0.1)
let t = simplify(p, error = 0.004)
assert(t.triangles < p.triangles/4 and t.genus == 1 and t.watertight and t.manifold)
assert(abs(t.volume/p.volume - 1) < 0.01)
let open = polygonize(p -> p.z - 0.2*sin(3*p.x), bounds = [-1..1, -1..1, -1..1], cell = 0.1, cap = false)
let few = simplify(open, count = 100)
assert(few.triangles <= 100 and few.boundary_loops == 1 and few.genus == 0 and few.manifold)
",
    );
}

#[test]
fn remeshed_level_sets_are_even_and_lie_on_the_level_set() {
    holds(&format!(
        "{TORUS}
let m = polygonize(torus, cell = 0.1)
let even = remesh(m, torus, length = 0.1)
assert(even.genus == 1 and even.components == 1 and even.watertight and even.manifold)
let q = quality(even)
assert(q.self_intersections == 0 and q.hundredth_ratio > 0.7 and q.median_ratio > 0.95)
assert(q.longest_edge < 0.2)
let d = deviation(even, torus)
assert(d.vertex_max < 1e-12 and d.turned == 0)
# Another level, and the mean length of the given mesh.
let outer = remesh(polygonize(torus, cell = 0.1, iso = 0.1, bounds = -1.8..1.8), torus, iso = 0.1, iterations = 4)
assert(deviation(outer, torus, iso = 0.1).vertex_max < 1e-12)
let open = polygonize(p -> p.z - 0.2*sin(3*p.x), bounds = [-1..1, -1..1, -1..1], cell = 0.1, cap = false)
let patch = remesh(open, p -> p.z - 0.2*sin(3*p.x))
assert(patch.boundary_loops == 1 and patch.genus == 0 and patch.manifold)
"
    ));
}

#[test]
fn what_cannot_be_measured_or_made_is_an_error() {
    let fails = |text: &str, words: &str| {
        let run = script(&format!(
            "{TORUS}let m = polygonize(torus, cell = 0.2)\n{text}\n"
        ));
        assert_eq!(run.code, 1, "{text}");
        assert!(run.stderr.contains(words), "{text}: {}", run.stderr);
    };
    fails("simplify(m)", "needs `count` or `error`");
    fails(
        "polygonize(torus, cell = 4)",
        "more than the longest side of the box, 3",
    );
    fails(
        "polygonize(torus, resolution = 0.5)",
        "more than the longest side",
    );
    fails(
        "polygonize(torus, method = \"cube\")",
        "did you mean \"cubes\"?",
    );
    fails(
        "polygonize(torus, method = \"squares\")",
        "in R3 there are \"cubes\"",
    );
    let seeds =
        |points: &str| format!("polygonize(torus, method = \"continuation\", seeds = {points})");
    fails(&seeds("[]"), "there are no seeds");
    fails(
        &seeds("[[0, 5, 0]]"),
        "the seed [0, 5, 0] is not in the box",
    );
    fails("polygonize(torus, cell = 1e-5)", "`--limit cells=N`");
    fails("quality(torus)", "`m` must be a mesh");
    fails("deviation(m, (x, y) -> x)", "a mesh lies in R3");
    fails("remesh(m, torus, length = 1e-9)", "more than 1e8 triangles");
    fails("quality(m).vertex_max", "cannot be given");
}

#[test]
fn the_command_line_reports_all_measures() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("torus.imp"), TORUS).unwrap();
    let words = [
        "mesh",
        "torus.imp",
        "-o",
        "t.ply",
        "--cell",
        "0.1",
        "--report",
    ];
    let text = imp_in(folder.path(), &words).well().stdout;
    for line in [
        "mesh",
        "quality",
        "deviation",
        "genus                 1",
        "turned       0",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}:\n{text}");
    }
    let words = ["mesh", "torus.imp", "--cell", "0.1", "--report"];
    assert_eq!(imp_in(folder.path(), &words).well().stdout, text);
    let words = [
        "mesh",
        "torus.imp",
        "--cell",
        "0.1",
        "--iso",
        "0.05",
        "--report",
        "--json",
    ];
    let report = imp_in(folder.path(), &words).well().json();
    let number = |value: &Value| value.as_f64().unwrap();
    assert_eq!(report["genus"], json!(1));
    assert_eq!(report["boundary_loops"], json!(0));
    assert_eq!(report["oriented"], json!(true));
    assert_eq!(report["nonmanifold_edges"], json!(0));
    assert_eq!(report["quality"]["self_intersections"], json!(0));
    assert!(number(&report["quality"]["worst_ratio"]) > 0.0);
    assert!(number(&report["deviation"]["vertex_max"]) < 1e-8);
    assert_eq!(report["deviation"]["turned"], json!(0));
    // Pairs, as in every summary.
    assert_eq!(report["bounds"][0].as_array().unwrap().len(), 2);
}
