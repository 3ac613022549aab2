//! `imp render` and `plot`: pictures as files.

mod common;

use std::fs;
use std::path::Path;

use common::{imp_in, imp_with, script};
use tempfile::{TempDir, tempdir};

const SCENE: &str = "\
field ball(p in R3) over -1.3..1.3 = norm(p) - 1
field disc(p in R2) over [-2..2, -1..1] = norm(p) - 0.8
field wave(x) over 0..7 = sin(x)
field free(p in R3) = norm(p) - 1
field endless(p in R3) = p.x
field pair(p in R2) over -1..1 = [p.x, p.y]
";

fn folder() -> TempDir {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("scene.imp"), SCENE).unwrap();
    folder
}

/// Width, height, channels and bytes.
fn decoded(path: &Path) -> (u32, u32, usize, Vec<u8>) {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width, info.height, info.color_type.samples(), bytes)
}

#[test]
fn pictures_of_every_dimension_are_written() {
    let folder = folder();
    for (field, size, expected) in [
        ("ball", "64", (64, 64)),
        ("ball", "40x24", (40, 24)),
        ("disc", "64", (64, 32)),
        ("wave", "64", (64, 40)),
        ("ball & !(free + 0.5)", "32", (32, 32)),
    ] {
        let words = [
            "render",
            "scene.imp",
            field,
            "-o",
            "a.png",
            "--size",
            size,
            "--json",
        ];
        let run = imp_in(
            folder.path(),
            &[&words[..], &["--bounds", "-1..1"]].concat(),
        );
        let run = if field == "ball & !(free + 0.5)" {
            run
        } else {
            imp_in(folder.path(), &words)
        };
        let object = run.well().json();
        let (width, height, channels, _) = decoded(&folder.path().join("a.png"));
        assert_eq!((width, height), expected, "{field}");
        assert_eq!(channels, 3, "{field}");
        assert_eq!(object["width"], width);
        assert_eq!(object["height"], height);
        assert_eq!(object["output"], "a.png");
        assert!(object["covered"].as_f64().unwrap() > 0.1, "{field}");
        assert!(object["seconds"].is_number() && object["warnings"].is_array());
    }
}

#[test]
fn the_background_can_be_transparent() {
    let folder = folder();
    for field in ["ball", "disc"] {
        let words = ["render", "scene.imp", field, "-o", "a.png", "--size", "64"];
        imp_in(folder.path(), &[&words[..], &["--transparent"]].concat()).well();
        let (width, height, channels, bytes) = decoded(&folder.path().join("a.png"));
        assert_eq!(channels, 4);
        let opacity = |x: u32, y: u32| bytes[(4 * (y * width + x) + 3) as usize];
        assert_eq!(opacity(0, 0), 0, "{field}");
        assert_eq!(opacity(width / 2, height / 2), 255, "{field}");
    }
}

#[test]
fn options_of_the_camera_change_the_picture_as_they_say() {
    let folder = folder();
    let part = "field part(x, y, z) over -1..1 = max(abs(x) - 0.9, abs(y) - 0.3, abs(z) - 0.1)\n";
    fs::write(folder.path().join("part.imp"), part).unwrap();
    let covered = |options: &[&str]| {
        let words = [
            "render",
            "part.imp",
            "--size",
            "64",
            "--whole",
            "--samples",
            "1",
            "--json",
        ];
        let run = imp_in(folder.path(), &[&words[..], options].concat()).well();
        run.json()["covered"].as_f64().unwrap()
    };
    // Of the sides of 2, enlarged by a margin of 5 %, in each direction.
    let scale = 2.0 * 2.0 * 1.05 * 1.05;
    for (view, area) in [
        ("top", 1.8 * 0.6),
        ("front", 1.8 * 0.2),
        ("left", 0.6 * 0.2),
        ("90,0", 0.6 * 0.2),
        ("0, -90", 1.8 * 0.6),
    ] {
        let found = covered(&["--view", view]);
        // An edge may be a pixel off: the perimeter in pixels of 1/64², at most 5 by 32.
        assert!((found - area / scale).abs() < 0.04, "{view}: {found}");
    }
    // A wide angle from near: the front is larger than with parallel rays against the back.
    assert_ne!(
        covered(&["--view", "top"]),
        covered(&["--view", "top", "--perspective", "60"])
    );
    let all = covered(&["--view", "30,20", "--perspective", "25", "--occlusion"]);
    assert!(all > 0.05 && all < 0.5);
}

#[test]
fn bytes_are_the_same_for_any_number_of_threads() {
    let folder = folder();
    for field in ["ball", "disc"] {
        let files: Vec<Vec<u8>> = ["1", "2", "3"]
            .iter()
            .map(|threads| {
                let words = ["render", "scene.imp", field, "-o", "a.png", "--size", "150"];
                let options = ["--occlusion", "--threads", threads];
                imp_in(folder.path(), &[&words[..], &options].concat()).well();
                fs::read(folder.path().join("a.png")).unwrap()
            })
            .collect();
        assert!(files.iter().all(|file| *file == files[0]), "{field}");
    }
}

#[test]
fn scripts_plot() {
    let folder = folder();
    let text = format!(
        "{SCENE}
let image = plot(ball, \"ball.png\", size = 48, view = \"top\")
assert(image.width == 48 and image.height == 48 and image.jumps == 0)
plot(disc, \"disc.png\", size = [60, 50], style = \"fill\", transparent = true)
plot(sin, \"sine.png\", size = 64, bounds = [-3..3])
plot((x, y) -> x*y - 0.2, \"hyperbola.png\", size = 64, bounds = -1..1, step = 0.1)
export(plot(ball, size = 32, view = [30deg, 20deg], perspective = 35deg, occlusion = true), \"b.png\")
print(plot(wave, size = 32))
"
    );
    let run = imp_with(
        folder.path(),
        &["run", "-", "--out", "build"],
        text.as_bytes(),
    )
    .well();
    assert!(
        run.stdout.starts_with("image: width 32, height 20"),
        "{}",
        run.stdout
    );
    for (name, size) in [
        ("ball", (48, 48)),
        ("disc", (60, 50)),
        ("sine", (64, 40)),
        ("hyperbola", (64, 64)),
        ("b", (32, 32)),
    ] {
        let path = folder.path().join("build").join(name).with_extension("png");
        let (width, height, ..) = decoded(&path);
        assert_eq!((width, height), size, "{name}");
        assert!(
            run.stderr.contains(&format!("{name}.png")),
            "{}",
            run.stderr
        );
    }
}

#[test]
fn what_cannot_be_is_said_and_leaves_no_file() {
    let folder = folder();
    for (words, code, error) in [
        (&["ball", "--size", "0"][..], 2, "--size"),
        (&["ball", "--size", "-5"], 2, "--size"),
        (&["ball", "--size", "20000x20000"], 1, "E0309"),
        (&["ball", "--size", "1e300"], 2, "--size"),
        (&["ball", "--size", "3.5"], 2, "--size"),
        (&["ball", "--size", "9000"], 1, "E0309"),
        (&["ball", "--view", "above"], 2, "--view"),
        (&["ball", "--view", "1,2,3"], 2, "--view"),
        (&["ball", "--perspective", "0"], 2, "--perspective"),
        (&["ball", "--perspective", "200"], 2, "--perspective"),
        (&["ball", "--samples", "0"], 2, "--samples"),
        (&["ball", "--bounds", "0..inf"], 1, "E0309"),
        (&["ball", "--bounds", "[-1..1, -1..1]"], 1, "E0401"),
        (&["disc", "--style", "oil"], 2, "--style"),
        (&["disc", "--step", "0"], 1, "E0309"),
        (&["endless"], 1, "E0402"),
        (&["pair"], 1, "E0403"),
        (&["nowhere"], 1, "E0201"),
        (&["ball", "--perspective", "wide"], 2, "--perspective"),
    ] {
        let words = [&["render", "scene.imp"], words, &["-o", "a.png"]].concat();
        let run = imp_in(folder.path(), &words);
        assert_eq!(run.code, code, "{words:?}\n{}", run.stderr);
        assert!(run.stderr.contains(error), "{words:?}\n{}", run.stderr);
    }
    for (output, error) in [
        ("a.jpg", "E0705"),
        ("a", "E0705"),
        ("a.stl", "E0706"),
        ("no/a.png", "E0703"),
    ] {
        let words = ["render", "scene.imp", "ball", "--size", "16", "-o", output];
        let run = imp_in(folder.path(), &words);
        assert_eq!(run.code, 3, "{output}");
        assert!(run.stderr.contains(error), "{output}: {}", run.stderr);
        let text = format!("{SCENE}plot(ball, \"{output}\", size = 16)\n");
        let run = imp_with(folder.path(), &["run", "-"], text.as_bytes());
        assert_eq!(run.code, 3, "{output}");
        assert!(run.stderr.contains(error), "{output}: {}", run.stderr);
    }
    let outside = format!("{SCENE}plot(ball, \"../a.png\", size = 16)\n");
    let run = imp_with(folder.path(), &["run", "-"], outside.as_bytes());
    assert!(run.stderr.contains("E0704"), "{}", run.stderr);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn odd_fields_give_a_picture_and_a_note() {
    for (field, warning) in [
        ("field f(p in R3) over -1..1 = sqrt(-1 - norm2(p))", "W0801"),
        ("field f(p in R3) over -1..1 = norm(p) + 1", "W0806"),
        ("field f(p in R3) over -1..1 = floor(p.x) + 0.5", "W0804"),
        ("field f(p in R2) over -1..1 = sqrt(p.x)", "W0801"),
        ("field f(x) over -1..1 = log(x)", "W0801"),
    ] {
        let run = script(&format!("{field}\nplot(f, \"a.png\", size = 32)\n")).well();
        assert!(run.stderr.contains(warning), "{field}\n{}", run.stderr);
        assert!(run.stderr.contains("wrote"), "{field}\n{}", run.stderr);
    }
    // Constant, infinite and enormous fields are no trouble either.
    for field in ["0", "1", "inf", "-inf", "1e300*p.x", "1/p.x", "1e-300*p.x"] {
        for space in ["R2", "R3"] {
            let text = format!("field f(p in {space}) over -1..1 = {field} + 0*p.x\n");
            script(&format!("{text}plot(f, \"a.png\", size = 16)\n")).well();
        }
    }
}

#[test]
fn help_has_examples() {
    let run = common::imp(&["render", "--help"]).well();
    for word in [
        "Examples:",
        "--view",
        "--occlusion",
        "--transparent",
        "DEGREES",
    ] {
        assert!(run.stdout.contains(word), "{word}");
    }
}
