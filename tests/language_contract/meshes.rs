//! Meshes of particles, adapted triangulations, solids as tetrahedra, and files of curves in space, from the
//! user's end.

use std::fs;
use std::path::Path;

use crate::common::{Run, imp_in, imp_with, script};

const BALL: &str = "field ball(p in R3) over -1.3..1.3 = norm(p) - 1\n";

#[track_caller]
fn holds(program: &str) {
    script(program).well();
}

#[track_caller]
fn fails(program: &str, code: i32, words: &[&str]) {
    let run = script(program);
    assert_eq!(run.code, code, "{program}\n{}", run.stderr);
    for part in words {
        assert!(run.stderr.contains(part), "{program}\n{}", run.stderr);
    }
}

#[test]
fn samples_are_joined_with_the_arguments_that_belong_to_it() {
    holds(&format!(
        "{BALL}let s = sample(ball, count = 200)\n\
         let m = polygonize(ball, method = \"delaunay\", samples = s)\n\
         assert(m.vertices == 200 and m.triangles == 396 and m.genus == 0 and m.watertight)\n\
         let t = polygonize(ball, method = \"delaunay\", samples = s.points)\n\
         assert(t.vertices == 200 and t.points == m.points and t.faces == m.faces)\n\
         let u = polygonize(ball, method = \"delaunay\", cell = 0.2)\n\
         assert(u.watertight and u.quality.hundredth_ratio > 0.7)"
    ));
    let wrong = [
        (
            "method = \"cubes\", samples = [[1, 0, 0]]",
            "E0309",
            "`samples` has no meaning",
        ),
        ("method = \"delaunay\", samples = []", "E03", "samples"),
        (
            "method = \"delaunay\", samples = 3",
            "E03",
            "samples of a surface",
        ),
        (
            "method = \"delaunay\", samples = [[1, 0]]",
            "E03",
            "samples of a surface",
        ),
        (
            "method = \"springs\", cap = true",
            "E0309",
            "leaves a surface open",
        ),
        (
            "method = \"delaunay\", cap = true",
            "E0309",
            "leaves a surface open",
        ),
        (
            "method = \"delaunay\", snap = true",
            "E0309",
            "`snap` has no meaning",
        ),
    ];
    for (arguments, code, words) in wrong {
        fails(
            &format!("{BALL}polygonize(ball, {arguments})"),
            1,
            &[code, words],
        );
    }
    // Points that are nowhere near the surface.
    let far = format!("{BALL}polygonize(ball, method = \"delaunay\", samples = [[9, 9, 9]])");
    fails(&far, 1, &["none of the 1 samples"]);
}

#[test]
fn springs_tell_what_became_of_the_triangulation() {
    holds(
        "field circle(x, y) over -1.6..1.6 = x^2 + y^2 - 1\n\
         let c = polygonize(circle, method = \"springs\", resolution = 24).adaptation\n\
         assert(c.at_rest and c.transversal_after == 1 and c.regular_after == 1)\n\
         assert(c.parallel_after == 1 and c.parallel_before < 0.7)\n\
         assert(c.energy_after < c.energy_before/2 and c.side_ratio_after > 2*c.side_ratio_before)",
    );
    holds(&format!(
        "{BALL}let m = polygonize(ball, method = \"springs\", resolution = 16)\n\
         let a = m.adaptation\n\
         assert(a.at_rest and a.steps > 0 and a.simplices > 1000 and a.transversal_after == 1)\n\
         assert(a.triangle_ratio_after > 0.9 and a.triangle_ratio_before < 0.75)\n\
         assert(a.triangle_ratio_after == m.quality.mean_ratio)\n\
         assert(a.smallest_angle_after > a.smallest_angle_before)\n\
         assert(a.simplex_ratio_after > a.simplex_ratio_before)"
    ));
    // Where the box cuts the surface it is left open.
    holds(
        "field rod(x, y, z) over -1..1 = x^2 + y^2 - 0.25\n\
         let m = polygonize(rod, method = \"springs\", resolution = 8)\n\
         assert(not m.watertight and m.genus == 0)",
    );
    let other = format!("{BALL}print(polygonize(ball, method = \"cubes\", cell = 0.3).adaptation)");
    fails(&other, 1, &["`adaptation` cannot be given"]);
}

#[test]
fn solids_are_tetrahedra_with_measures_or_refused() {
    holds(&format!(
        "{BALL}let s = tetrahedralize(ball, 0.25)\n\
         assert(s.euler == 1 and s.pieces == 1 and s.off_surface == 0)\n\
         assert(abs(s.volume - 4/3*pi) < 0.12 and abs(s.area - 4*pi) < 0.2)\n\
         assert(abs(s.boundary.volume - s.volume) < 1e-12 and s.boundary.genus == 0)\n\
         assert(len(s.points) == s.nodes and len(s.cells) == s.tetrahedra and len(s.cells[0]) == 4)\n\
         assert(s.worst_ratio > 0.3 and s.mean_ratio > 0.65)"
    ));
    holds(
        "field disk(p in R2) over -1.3..1.3 = norm(p) - 1\n\
         let s = tetrahedralize(disk, 0.1)\n\
         assert(abs(s.area - pi) < 0.02 and abs(s.length - 2*pi) < 0.02 and s.euler == 1)\n\
         assert(s.boundary.closed and len(s.cells[0]) == 3 and s.triangles > 300)",
    );
    let refused = |body: &str, code: i32, words: &[&str]| {
        let program = format!("field f(p in R3) over -1..1 = {body}\ntetrahedralize(f, 0.25)");
        fails(&program, code, words);
    };
    refused("norm(p) + 1", 4, &["E0405", "the solid is empty"]);
    refused("norm(p) - 9", 4, &["E0405", "the solid fills the box"]);
    refused("sqrt(-1 - norm2(p))", 4, &["E0405", "not a number"]);
    refused("norm(p - 0.12) - 0.05", 4, &["E0405"]);
    refused("norm(p) - 1.1", 0, &["W0802", "the box cuts the solid"]);
    refused("norm(p) - 0.8 + 0*sqrt(p.x + 0.2)", 0, &["W0801"]);
    fails(
        "field f(x) over -1..1 = x\ntetrahedralize(f, 0.1)",
        1,
        &["E0401"],
    );
    fails(
        &format!("{BALL}tetrahedralize(ball, 9)"),
        1,
        &["E0309", "cell"],
    );
    fails(
        &format!("{BALL}print(tetrahedralize(ball).length)"),
        1,
        &["E0206"],
    );
}

/// A circle of radius 1 that lies in no plane of coordinates.
const CIRCLE: &str = "field circle(x, y, z) over -1.4..1.4 = [x^2 + y^2 + z^2 - 1, x + 2*y - z]\n";

fn exported(folder: &Path, name: &str) -> Run {
    let program = format!(
        "{CIRCLE}let c = polygonize(circle, cell = 0.1)\nassert(c.closed and abs(c.length - 2*pi) < 0.02)\n\
         print(c.points)\nexport(c, \"{name}\")"
    );
    imp_with(folder, &["run", "-"], program.as_bytes())
}

/// The points of the first curve, from what the script prints.
fn printed(run: &Run) -> Vec<[f64; 3]> {
    let text = run.stdout.trim().trim_matches(['[', ']']);
    let points = text.split("], [");
    points.map(|point| numbers(point.split(", "))).collect()
}

fn numbers<'a>(words: impl Iterator<Item = &'a str>) -> [f64; 3] {
    let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

#[test]
fn curves_in_space_are_written_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    // OBJ: every point, and one line through all that returns to the first.
    let points = printed(&exported(folder.path(), "a.obj").well());
    assert!(points.len() > 40);
    let text = String::from_utf8(read("a.obj")).unwrap();
    let vertices = text.lines().filter_map(|line| line.strip_prefix("v "));
    let vertices: Vec<[f64; 3]> = vertices.map(|line| numbers(line.split(' '))).collect();
    assert_eq!(vertices, points);
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with("l ")).collect();
    let indices: Vec<usize> = lines[0][2..]
        .split(' ')
        .map(|word| word.parse().unwrap())
        .collect();
    let expected: Vec<usize> = (1..=points.len()).chain([1]).collect();
    assert_eq!((lines.len(), indices), (1, expected));
    // CSV: a row for each point, with the number of its curve.
    exported(folder.path(), "a.csv").well();
    let text = String::from_utf8(read("a.csv")).unwrap();
    let mut rows = text.lines();
    let head: Vec<&str> = rows.next().unwrap().split(',').collect();
    let place = |name: &str| head.iter().position(|own| *own == name).unwrap();
    let columns = ["x", "y", "z"].map(place);
    let rows: Vec<[f64; 3]> = rows
        .map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            numbers(columns.iter().map(|&column| cells[column]))
        })
        .collect();
    assert_eq!(rows[..points.len()], points);
    // A closed curve ends with its first point again.
    assert_eq!(rows[points.len()..], points[..1]);
    // VTP: the bytes of all coordinates, one after the other.
    exported(folder.path(), "a.vtp").well();
    let bytes: Vec<u8> = points
        .as_flattened()
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    let file = read("a.vtp");
    assert!(file.windows(bytes.len()).any(|window| window == bytes));
    let head = String::from_utf8_lossy(&file[..1000]).into_owned();
    let counts = format!(
        "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"1\"",
        points.len()
    );
    assert!(head.contains(&counts), "{head}");
    // Drawings are of curves in the plane.
    for name in ["a.svg", "a.dxf", "a.stl", "a.ply", "a.vtu"] {
        let run = exported(folder.path(), name);
        assert_eq!(run.code, 3, "{name}");
        for part in ["E0706", "curves in space", ".obj, .vtp, .csv"] {
            assert!(run.stderr.contains(part), "{name}: {}", run.stderr);
        }
        assert!(!folder.path().join(name).exists());
    }
}

#[test]
fn reports_of_springs_have_a_part_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ball.imp"), BALL).unwrap();
    fs::write(
        folder.path().join("disk.imp"),
        "field disk(x, y) over -1.3..1.3 = x^2 + y^2 - 1\n",
    )
    .unwrap();
    for file in ["ball.imp", "disk.imp"] {
        let words = [
            "mesh",
            file,
            "--method",
            "springs",
            "--resolution",
            "12",
            "--report",
            "--json",
        ];
        let told = imp_in(folder.path(), &words).well().json();
        let part = &told["adaptation"];
        assert_eq!(part["transversal_after"], 1, "{told}");
        assert_eq!(part["triangle_ratio_after"].is_number(), file == "ball.imp");
        assert!(told["vertices"].is_number());
    }
}
