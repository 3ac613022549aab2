//! The command line: data, exit codes, JSON, and what happens with bad input.

mod common;

use std::path::Path;

use common::{imp, imp_in, imp_with, script};
use serde_json::json;

const SPHERE: &str = "field ball(p in R3) over -1.3..1.3 = norm(p) - 1\n";

#[test]
fn eval_prints_values() {
    assert_eq!(imp(&["eval", "2^10"]).well().stdout, "1024\n");
    assert_eq!(
        imp(&["eval", "[1, 2] + 1", "\"{1/3:.3}\""]).well().stdout,
        "[2, 3]\n0.333\n"
    );
    let value = imp(&["eval", "1/0", "--json"]).well().json();
    assert_eq!(value["value"], json!("inf"));
    let values = imp(&["eval", "sqrt(-1)", "0..2", "--json"]).well().json();
    assert_eq!(values["values"], json!(["nan", {"lo": 0, "hi": 2}]));
}

#[test]
fn the_gradient_of_the_torus_is_the_closed_form() {
    let run = imp(&[
        "eval",
        "examples/torus.imp",
        "grad(torus)(1.3, 0, 0.1)",
        "--json",
    ]);
    let value = run.well().json()["value"].clone();
    for (axis, expected) in [0.6, 0.0, 0.2].into_iter().enumerate() {
        let found = value[axis].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
}

/// F = b − Σ exp(−|p − c_i|²/s_i²), so ∂F/∂s_0 = −exp(−d²/s²)·2d²/s³.
#[test]
fn the_parameter_derivative_of_the_blobs_is_the_closed_form() {
    let point = [0.3_f64, -0.2, 0.5];
    let run = imp(&[
        "eval",
        "examples/blobs.imp",
        "diff(blobs, s[0])(0.3, -0.2, 0.5)",
        "--json",
    ]);
    let found = run.well().json()["value"].as_f64().unwrap();
    let squared = (point[0] + 0.8).powi(2) + point[1].powi(2) + point[2].powi(2);
    let s = 0.7_f64;
    let expected = -(-squared / s.powi(2)).exp() * 2.0 * squared / s.powi(3);
    assert!((found - expected).abs() < 1e-14, "{found} {expected}");
}

#[test]
fn a_new_value_of_a_parameter_compiles_nothing() {
    let compilations = |expressions: &[&str]| {
        let mut words = vec!["eval", "examples/blobs.imp", "--json"];
        words.extend(expressions);
        imp(&words).well().json()["compilations"].as_u64().unwrap()
    };
    let once = compilations(&["blobs(0.1, 0.2, 0.3)"]);
    let often = compilations(&[
        "blobs(0.1, 0.2, 0.3)",
        "(blobs with {b = 0.9})(0.1, 0.2, 0.3)",
        "[(blobs with {b = v})(0.1, 0.2, 0.3) for v in 0.1..1 by 0.1]",
    ]);
    assert!(once >= 1);
    assert_eq!(once, often);
}

#[test]
fn mesh_reports_what_it_made() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ball.imp"), SPHERE).unwrap();
    let run = imp_in(
        folder.path(),
        &[
            "mesh", "ball.imp", "-o", "ball.stl", "--cell", "0.05", "--json",
        ],
    );
    let report = run.well().json();
    assert_eq!(report["output"], json!("ball.stl"));
    assert_eq!(report["genus"], json!(0));
    assert_eq!(report["watertight"], json!(true));
    assert_eq!(report["components"], json!(1));
    // Values and F_x of many points are computed in blocks or vectors, whatever the mesh's size.
    assert!(report["compilations"].as_u64().unwrap() <= 2);
    let area = report["area"].as_f64().unwrap();
    assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3);
    let triangles = report["triangles"].as_u64().unwrap();
    let bytes = std::fs::metadata(folder.path().join("ball.stl"))
        .unwrap()
        .len();
    assert_eq!(bytes, 84 + 50 * triangles);
    for key in [
        "method",
        "vertices",
        "euler",
        "boundary_edges",
        "manifold",
        "volume",
        "bounds",
    ] {
        assert!(!report[key].is_null(), "{key}");
    }
}

#[test]
fn sample_reports_what_it_made() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ball.imp"), SPHERE).unwrap();
    let run = imp_in(
        folder.path(),
        &[
            "sample", "ball.imp", "ball * 2", "-o", "ball.csv", "--count", "500", "--seed", "3",
            "--json",
        ],
    );
    let report = run.well().json();
    assert_eq!(report["method"], json!("floaters"));
    assert_eq!(report["converged"], json!(true));
    assert!(report["max_residual"].as_f64().unwrap() < 1e-8);
    let spacing = |key: &str| report["spacing"][key].as_f64().unwrap();
    assert!(0.0 < spacing("min") && spacing("min") <= spacing("mean"));
    assert!(spacing("mean") <= spacing("max") && spacing("deviation") < spacing("mean"));
    let points = report["points"].as_u64().unwrap() as usize;
    let csv = std::fs::read_to_string(folder.path().join("ball.csv")).unwrap();
    assert_eq!(csv.lines().count(), points + 1);
    for key in [
        "iterations",
        "births",
        "deaths",
        "energy",
        "evaluations",
        "seconds",
    ] {
        assert!(report[key].is_number(), "{key}");
    }
}

#[test]
fn parameters_are_set_from_outside() {
    let words = |setting| {
        [
            "eval",
            "examples/torus.imp",
            "torus(1, 0, 0)",
            "--set",
            setting,
        ]
    };
    assert_eq!(imp(&words("r=0.5")).well().stdout, "-0.25\n");
    assert_eq!(imp(&words("r = 1/4")).well().stdout, "-0.0625\n");
    let unknown = imp(&words("radius=0.5"));
    assert_eq!(unknown.code, 1);
    assert!(unknown.stderr.contains("E0208"), "{}", unknown.stderr);
    let outside = imp(&words("r=7"));
    assert_eq!(outside.code, 1);
    assert!(outside.stderr.contains("0.05..0.5"), "{}", outside.stderr);
    assert_eq!(imp(&words("r")).code, 2);
}

#[test]
fn exit_codes_tell_what_went_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &[u8]| std::fs::write(folder.path().join(name), text).unwrap();
    write("ball.imp", SPHERE.as_bytes());
    write("latin.imp", b"let caf\xe9 = 1\n");
    write("empty.imp", b"");
    write("far.imp", b"field far(p in R3) over -1..1 = norm(p) + 1\n");
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    let code = |words: &[&str]| {
        let run = imp_in(folder.path(), words);
        let lines = run.stderr.lines().count();
        assert!(run.code == 0 || lines > 0, "{words:?} is silent");
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        run.code
    };
    assert_eq!(code(&["run", "ball.imp"]), 0);
    assert_eq!(code(&["ball.imp"]), 0);
    assert_eq!(code(&["run", "empty.imp"]), 0);
    assert_eq!(code(&["run", "missing.imp"]), 3);
    assert_eq!(code(&["run", "folder"]), 3);
    assert_eq!(code(&["run", "latin.imp"]), 3);
    assert_eq!(code(&["mesh", "empty.imp", "-o", "a.stl"]), 1);
    assert_eq!(code(&["mesh", "far.imp", "-o", "a.stl"]), 4);
    assert_eq!(code(&["sample", "far.imp", "-o", "a.ply"]), 4);
    assert_eq!(code(&["mesh", "ball.imp", "-o", "no/such/place/a.stl"]), 3);
    assert_eq!(code(&["mesh", "ball.imp", "-o", "a.xyz"]), 3);
    assert_eq!(
        code(&["mesh", "ball.imp", "-o", "a.stl", "--cell", "-1"]),
        1
    );
    assert_eq!(
        code(&["mesh", "ball.imp", "-o", "a.stl", "--cell", "1e-9"]),
        1
    );
    assert_eq!(code(&["frobnicate"]), 2);
    assert_eq!(code(&[]), 2);
    assert_eq!(code(&["eval", "1 +"]), 1);
    assert_eq!(code(&["--help"]), 0);
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 5, "a failed command left a file: {left:?}");
}

#[test]
fn scripts_write_below_the_output_directory_only() {
    let text = format!("{SPHERE}export(polygonize(ball, cell = 0.3), \"../out.stl\")");
    let run = script(&text);
    assert_eq!(run.code, 3);
    assert!(run.stderr.contains("E0704"), "{}", run.stderr);
    let run = script(&text.replace("../out", "/tmp/imp-test-outside"));
    assert_eq!(run.code, 3);
    assert!(!Path::new("/tmp/imp-test-outside.stl").exists());
}

#[test]
fn errors_are_one_json_object_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["run", "-", "--json"];
    let run = imp_with(folder.path(), &words, b"let a = 1\nprint(a + bb)\n");
    assert_eq!(run.code, 1);
    let error = run.json()["error"].clone();
    assert_eq!(error["code"], json!("E0201"));
    assert_eq!(error["file"], json!("<stdin>"));
    assert_eq!((&error["line"], &error["column"]), (&json!(2), &json!(11)));
}

#[test]
fn bad_programs_end_with_one_message() {
    let parentheses = format!("let a = {}1{}", "(".repeat(10_000), ")".repeat(10_000));
    let long_line = format!("let a = 1{}", "+1".repeat(5_000_000));
    let long_name = format!("print({})", "a".repeat(10_000_000));
    let programs: &[(&str, &str)] = &[
        (&parentheses, "E0108"),
        (&long_line, "E0108"),
        (&long_name, "E0201"),
        ("fn f(n) = f(n + 1)\nprint(f(0))", "E0601"),
        ("let a = [1, 2, 3]\nprint(a[3])", "E0303"),
        ("let a = [1, 2, 3]\nprint(a[-4])", "E0303"),
        ("print([1, 2] + [1, 2, 3])", "E0302"),
        ("for i in 0..3 { print(i) }", "E0306"),
        ("let a = range(1e12)", "E0603"),
        ("while true { }", "E0604"),
        ("let a = 1\na = 2", "E0207"),
        ("let a = 1\nlet a = 2", "E0202"),
        ("assert(1 > 2, \"never\")", "E0501"),
        ("let a = 3\nprint(a(2))", "E0304"),
        ("param r = 5 in 0..1", "E0307"),
        ("field f(x) = \"text\"", "E0403"),
        ("field f(x, y) = x\nprint(f(1))", "E0401"),
        ("field f(p in R3) = p.x\npolygonize(f)", "E0402"),
        (
            "param n = 3\nfield f(x) = sum(x for i in range(n))",
            "E0310",
        ),
        ("field f(x) = x\nprint(diff(f, 3))", "E0404"),
        ("polygonize()", "E0204"),
        ("print(norm(1, 2))", "E0205"),
        ("sample(1, cuont = 3)", "E0203"),
        ("print([1].area)", "E0206"),
    ];
    for (program, expected) in programs {
        let shown: String = program.chars().take(80).collect();
        let run = script(program);
        assert_eq!(run.code, 1, "{shown}\n{}", run.stderr);
        assert!(run.stderr.contains(expected), "{shown}\n{}", run.stderr);
        let errors = run.stderr.matches("Error").count();
        assert_eq!(errors, 1, "{shown}\n{}", run.stderr);
        assert!(
            run.stderr.len() < 4000,
            "{shown}: a message of {}",
            run.stderr.len()
        );
    }
}

#[test]
fn the_reference_holds_builtins_and_the_library() {
    let whole = imp(&["doc"]).well().stdout;
    for heading in [
        "# Reference",
        "## Solids",
        "### `polygonize(",
        "### `algebraic.clebsch",
    ] {
        assert!(whole.contains(heading), "{heading}");
    }
    let torus = imp(&["doc", "torus"]).well().stdout;
    assert!(torus.starts_with("### `torus("), "{torus}");
    let wrong = imp(&["doc", "tours"]);
    assert_eq!(wrong.code, 1);
    assert!(
        wrong.stderr.contains("did you mean `torus`"),
        "{}",
        wrong.stderr
    );
}
