//! `load`: fields from `.vm` files, meshes from `.obj`, `.stl`, `.ply` and `.off` files, and what is
//! said of files that are none.

mod common;

use std::fs;

use common::{Run, imp_in};
use tempfile::{TempDir, tempdir};

/// A folder with these files, by name and text.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// The values of expressions over what the folder's `a.imp` defines.
fn values(folder: &TempDir, expressions: &[String]) -> Vec<f64> {
    let mut words = vec!["eval", "a.imp", "--json"];
    words.extend(expressions.iter().map(String::as_str));
    let json = imp_in(folder.path(), &words).well().json();
    let values = json["values"].as_array().expect("a list of values");
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
    values.iter().map(number).collect()
}

/// Runs a script that loads `a.vm`.
fn loading(vm: &str, options: &[&str]) -> Run {
    let folder = folder(&[("a.vm", vm), ("a.imp", "let f = load(\"a.vm\")\nprint(f)")]);
    imp_in(folder.path(), &[&["run", "a.imp"], options].concat())
}

/// A report as one line: it is wrapped where the terminal ends.
fn on_one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[track_caller]
fn refuses(vm: &str, words: &[&str]) {
    let run = loading(vm, &[]);
    assert_eq!(run.code, 3, "{}", run.stderr);
    let text = on_one_line(&run.stderr);
    assert_eq!(text.matches("Error").count(), 1, "{text}");
    for word in ["E0707", "a.imp:1:14"].iter().chain(words) {
        assert!(text.contains(word), "`{word}` is missing in {text}");
    }
}

/// x² + y² + z² − 1
const BALL: &str = "_x var-x\n_y var-y\n_z var-z\n_a square _x\n_b square _y\n_c square _z\n\
                    _d add _a _b\n_e add _d _c\n_1 const 1\n_f sub _e _1\n";

/// What an operation of one operand computes.
type One = fn(f64) -> f64;

/// What an operation of two operands computes.
type Two = fn(f64, f64) -> f64;

#[test]
fn every_operation_has_its_value() {
    let of_one: [(&str, One); 17] = [
        ("neg", |a| -a),
        ("abs", f64::abs),
        ("recip", f64::recip),
        ("sqrt", f64::sqrt),
        ("square", |a| a * a),
        ("floor", f64::floor),
        ("ceil", f64::ceil),
        ("round", f64::round),
        ("sin", f64::sin),
        ("cos", f64::cos),
        ("tan", f64::tan),
        ("asin", f64::asin),
        ("acos", f64::acos),
        ("atan", f64::atan),
        ("exp", f64::exp),
        ("ln", f64::ln),
        ("not", |a| f64::from(a == 0.0)),
    ];
    let of_two: [(&str, Two); 11] = [
        ("add", |a, b| a + b),
        ("sub", |a, b| a - b),
        ("mul", |a, b| a * b),
        ("div", |a, b| a / b),
        ("atan2", f64::atan2),
        ("min", f64::min),
        ("max", f64::max),
        ("compare", |a, b| f64::from(a > b) - f64::from(a < b)),
        ("mod", f64::rem_euclid),
        ("and", |a, b| if a == 0.0 { a } else { b }),
        ("or", |a, b| if a != 0.0 { a } else { b }),
    ];
    let points = [(0.5, 0.75), (-2.25, 0.5), (0.0, -1.5), (3.5, 3.5)];
    let mut script = String::new();
    let mut files = Vec::new();
    let mut expected = Vec::new();
    let names = of_one.iter().map(|(name, _)| *name);
    for (index, name) in names
        .chain(of_two.iter().map(|(name, _)| *name))
        .enumerate()
    {
        let operands = if index < of_one.len() { "a" } else { "a b" };
        files.push((
            format!("{name}.vm"),
            format!("a var-x\nb var-y\nr {name} {operands}\n"),
        ));
        script += &format!("let f{index} = load(\"{name}.vm\")\n");
        for (x, y) in points {
            let value = match of_one.get(index) {
                Some((_, value)) => value(x),
                None => of_two[index - of_one.len()].1(x, y),
            };
            expected.push((format!("f{index}({x}, {y})"), name, value));
        }
    }
    files.push(("a.imp".into(), script));
    let files: Vec<(&str, &str)> = files.iter().map(|(n, t)| (&n[..], &t[..])).collect();
    let folder = folder(&files);
    let expressions: Vec<String> = expected.iter().map(|(text, ..)| text.clone()).collect();
    let found = values(&folder, &expressions);
    assert_eq!(found.len(), 28 * points.len());
    for ((text, name, value), found) in expected.into_iter().zip(found) {
        // JSON has no infinities: they are read as NaN here. The platform's elementary functions
        // and these are within an ulp of the truth each.
        let is_same = (found - value).abs() <= 4.0 * f64::EPSILON * value.abs();
        let is_none = found.is_nan() && !value.is_finite();
        assert!(is_same || is_none, "{name}: {text} is {found}, not {value}");
    }
}

#[test]
fn a_loaded_field_is_a_field_like_any_other() {
    let script = "let f = load(\"models/ball.vm\")\n\
                  let plane = load(\"models/plane.vm\")\n\
                  field g(p in R3) over -1.5..1.5 = 2*load(\"models/ball.vm\")(p.x, p.y, p.z + 1) + p.x\n\
                  let m = polygonize(f, bounds = -1.5..1.5, cell = 0.1)\n\
                  assert(m.watertight and m.genus == 0)\n\
                  assert(abs(m.area - 4*pi) < 0.2)\n\
                  assert(sample(f, bounds = -2..2, count = 50).count > 0)\n\
                  let circle = polygonize(plane, bounds = -2..2, cell = 0.1)\n\
                  assert(abs(circle.length - 2*pi) < 0.1)\n\
                  print(f(1, 2, 3), grad(f)(1, 2, 3), f([0, 0, 0]), plane(3, 4), g(1, 0, 0))\n\
                  let e = (f + 1)(0..2, 0, 0)\n\
                  print(e > -1e-9, e < 4 + 1e-9, grad(g)(1, 0, 0), (f + g)(0, 0, 0))\n";
    let folder = folder(&[("a.imp", script)]);
    fs::create_dir(folder.path().join("models")).unwrap();
    let plane = "_x var-x\n_y var-y\n_a mul _x _x\n_b mul _y _y\n_c add _a _b\n_d const 1.0\n\
                 _e sub _c _d\n";
    fs::write(folder.path().join("models/ball.vm"), BALL).unwrap();
    fs::write(folder.path().join("models/plane.vm"), plane).unwrap();
    // Paths start at the script's folder, wherever the program was started.
    let path = folder.path().join("a.imp");
    let elsewhere = tempdir().unwrap();
    let run = imp_in(elsewhere.path(), &["run", path.to_str().unwrap()]).well();
    // The enclosure is of the range 0..4, rounded outward.
    assert_eq!(
        run.stdout.lines().collect::<Vec<_>>(),
        ["13 [2, 4, 6] -1 24 3", "true true [5, 0, 4] -1"]
    );
}

#[test]
fn wrong_lines_are_reported_with_their_place() {
    refuses(
        "a var-x\nb foo a\n",
        &["`a.vm`, line 2", "`foo`", "expected one of const"],
    );
    refuses(
        "a var-x\n\nb add a\n",
        &["line 3", "`add` with 1 operand", "expected two names"],
    );
    refuses(
        "b neg a\n",
        &["line 1", "`a` is not known", "from a line above"],
    );
    refuses(
        "a var-x\n# b\na var-y\n",
        &["line 3", "`a` is taken by line 1", "a new name"],
    );
    refuses(
        "a const one\n",
        &["line 1", "`one` is not a number", "expected one"],
    );
    refuses("", &["line 1", "ends without an operation"]);
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let folder = folder(&[("mesh.obj", "v 0 0 0\n"), ("mesh.svg", "")]);
    fs::create_dir(folder.path().join("folder.vm")).unwrap();
    for (path, code, words) in [
        ("no.vm", "E0701", "cannot read `no.vm`"),
        ("folder.vm", "E0701", "it is a folder"),
        (
            "mesh.svg",
            "E0706",
            "the format SVG is only written; .obj, .stl, .ply, .off, .vm can be read",
        ),
        (
            "mesh.obj",
            "E0707",
            "`mesh.obj`, line 1: 1 point and no polygon with an area; expected a mesh",
        ),
        ("mesh.xyz", "E0705", "no file format is called `.xyz`"),
    ] {
        fs::write(folder.path().join("a.imp"), format!("load(\"{path}\")")).unwrap();
        // A file is looked at also where nothing is run.
        for command in ["run", "check"] {
            let run = imp_in(folder.path(), &[command, "a.imp"]);
            let text = on_one_line(&run.stderr);
            assert_eq!(run.code, 3, "{text}");
            assert!(text.contains(code) && text.contains(words), "{text}");
        }
    }
}

#[test]
fn the_number_of_lines_is_limited_by_that_of_nodes() {
    let mut vm = String::from("n0 var-x\n");
    for index in 1..500 {
        vm += &format!("n{index} sin n{}\n", index - 1);
    }
    loading(&vm, &[]).well();
    let run = loading(&vm, &["--limit", "nodes=100"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let text = on_one_line(&run.stderr);
    assert!(
        text.contains("E0602") && text.contains("more than 100 lines"),
        "{text}"
    );
}

/// The tetrahedron with edges of length √2 at four corners of the unit cube: its area is 2√3, its
/// volume 1/3.
const TETRAHEDRON: &str = "OFF\n4 4 6\n0 0 0\n1 1 0\n1 0 1\n0 1 1\n\
                           3 0 1 2\n3 0 3 1\n3 0 2 3\n3 1 3 2\n";

#[test]
fn a_loaded_mesh_is_a_mesh_like_any_other() {
    let script = "let m = load(\"models/a.off\")\n\
                  print(m.method, m.vertices, m.triangles, m.watertight, genus(m), components(m))\n\
                  print(abs(area(m) - 2*sqrt(3)) < 1e-15, abs(volume(m) - 1/3) < 1e-15)\n\
                  field ball(p in R3) = norm(p) - load(\"models/a.off\").volume\n\
                  print(ball(1, 0, 0) > 0.66)\n\
                  let image = plot(m, \"a.png\", size = 40)\n\
                  assert(image.covered > 0.05)\n\
                  for name in [\"b.obj\", \"b.ply\", \"b.stl\", \"b.off\", \"b.glb\", \"b.3mf\", \"b.vtp\"] {\n\
                      export(m, name)\n\
                  }\n";
    let folder = folder(&[("a.imp", script)]);
    fs::create_dir(folder.path().join("models")).unwrap();
    fs::write(folder.path().join("models/a.off"), TETRAHEDRON).unwrap();
    let run = imp_in(folder.path(), &["run", "a.imp"]).well();
    assert_eq!(
        run.stdout.lines().collect::<Vec<_>>(),
        ["loaded 4 4 true 0 1", "true true", "true"]
    );
    for name in ["b.obj", "b.ply", "b.stl", "b.off"] {
        let expression = format!("load(\"{name}\").points");
        let run = imp_in(folder.path(), &["eval", &expression]).well();
        assert_eq!(
            run.stdout.trim(),
            "[[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]]",
            "{name}"
        );
    }
    let run = imp_in(folder.path(), &["eval", "load(\"b.off\")", "--json"]).well();
    let report = run.json();
    assert_eq!(report["value"]["method"], "loaded");
    // What only a polygonizer knows is absent.
    assert!(report["value"].get("max_residual").is_none());
    assert!(report["value"].get("evaluations").is_none());
    let run = imp_in(folder.path(), &["eval", "load(\"b.off\").evaluations"]);
    assert_eq!(run.code, 1);
    let text = on_one_line(&run.stderr);
    assert!(text.contains("cannot be given for this mesh"), "{text}");
}

#[test]
fn what_is_polygonized_reads_back_with_its_measures() {
    let script = "field torus(x, y, z) over -1.5..1.5 = (sqrt(x^2 + y^2) - 1)^2 + z^2 - 0.3^2\n\
                  let m = polygonize(torus, cell = 0.15)\n\
                  for name in [\"a.obj\", \"a.ply\", \"a.off\", \"a.stl\"] {\n\
                      export(m, name)\n\
                  }\n\
                  print(m.area, m.volume, m.triangles)\n";
    let folder = folder(&[("a.imp", script)]);
    let told = imp_in(folder.path(), &["run", "a.imp"]).well().stdout;
    let expected: Vec<f64> = told
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    for (name, tolerance) in [
        // Exact positions; sums over them in another order may be rounded otherwise.
        ("a.obj", 1e-14),
        ("a.ply", 1e-14),
        ("a.off", 1e-14),
        ("a.stl", 1e-6),
    ] {
        let words = ["area", "volume", "triangles", "genus", "components"];
        let words = words.map(|word| format!("load(\"{name}\").{word}"));
        let found = values(&folder, &words);
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() <= tolerance,
                "{name}: {found}, not {expected}"
            );
        }
        assert_eq!(found[3..], [1.0, 1.0], "{name}");
    }
}

#[test]
fn the_bytes_of_a_mesh_are_limited() {
    let folder = folder(&[("a.off", TETRAHEDRON)]);
    let length = TETRAHEDRON.len();
    for (limit, code) in [(length, 0), (length - 1, 1)] {
        let limit = format!("input={limit}");
        let words = ["eval", "load(\"a.off\").genus", "--limit", &limit];
        let run = imp_in(folder.path(), &words);
        assert_eq!(run.code, code, "{}", run.stderr);
        let text = on_one_line(&run.stderr);
        assert!(
            code == 0 || text.contains("E0609") && text.contains("--limit input=N"),
            "{text}"
        );
    }
}
