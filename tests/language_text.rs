//! Text as a shape, in the letters of a font made for this: rectangles, and a D of one quadratic curve.
//! Its em is 1000 units; I is the rectangle from (100, 0) to (300, 700), O a frame from (100, 0) to
//! (700, 700) around a hole from (300, 200) to (500, 500); their advances are 400 and 800.

mod common;

use std::fs;
use std::path::Path;

use common::{imp_with, script};

/// Runs a program beside the font.
fn run(program: &str) -> common::Run {
    let folder = tempfile::tempdir().unwrap();
    let font = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/blocks.ttf");
    fs::copy(font, folder.path().join("blocks.ttf")).unwrap();
    imp_with(folder.path(), &["run", "-"], program.as_bytes())
}

#[test]
fn letters_are_distances_to_their_outlines() {
    let printed = run("let t = text(\"IO\", \"blocks.ttf\", 10)\n\
         print(t(2, 3), t(0, 3), t(8, 1), t(8, 3.5), t(8, 7.5))")
    .well()
    .stdout;
    // The middle of the I, a unit left of it; inside the O's frame, in its hole, above it.
    assert_eq!(printed.trim(), "-1 1 -1 1 0.5");
}

#[test]
fn texts_are_extruded_and_measured() {
    let printed = run(
        "let m = polygonize(text(\"O I\", \"blocks.ttf\").extrude(0.5), \
         bounds = [-0.2..1.9, -0.2..0.9, -0.4..0.4], cell = 0.02)\n\
         print(m.components, m.genus)\n\
         assert(abs(m.volume / (0.5*(0.6*0.7 - 0.2*0.3 + 0.2*0.7)) - 1) < 0.02)",
    )
    .well()
    .stdout;
    assert_eq!(printed.trim(), "2 1");
}

#[test]
fn curves_are_chords_close_to_them() {
    // The D's curve has its middle at t = 1/2: (0 + 2·800 + 0)/4 + ... of its last quarter.
    let printed = run("let d = outlines(\"D\", \"blocks.ttf\", 1)\n\
         print(len(d), max(p.x for p in d[0]) <= 0.8, len(d[0]) > 12)")
    .well()
    .stdout;
    assert_eq!(printed.trim(), "1 true true");
}

#[test]
fn what_is_no_font_and_what_it_lacks_is_said() {
    for (program, words) in [
        ("text(\"A\", \"blocks.ttf\")", "no letter `A`"),
        ("text(\"I\", \"none.ttf\")", "none.ttf"),
        ("text(\"I\", \".\")", "folder"),
    ] {
        let run = run(&format!("let t = {program}"));
        assert_eq!(run.code, 3, "{program}: {}", run.stderr);
        assert!(run.stderr.contains(words), "{program}: {}", run.stderr);
    }
    let empty = run("let t = text(\" \", \"blocks.ttf\")");
    assert_eq!(empty.code, 1);
    assert!(empty.stderr.contains("no polygon"), "{}", empty.stderr);
    assert_eq!(script("print(outlines(3, \"a.ttf\"))").code, 1);
}
