//! Every command, and the example of each.

use std::path::Path;

use tempfile::TempDir;

use crate::common::{Run, imp_with};

/// A field with a parameter, in a file and in what is typed.
const TORUS: &str = "\
## How thick the torus is.
param r = 0.3 in 0.1..0.6
## A torus about the z axis.
field torus(x, y, z) over -1.5..1.5 = (sqrt(x^2 + y^2) - 1)^2 + z^2 - r^2
";

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("examples")).unwrap();
    std::fs::write(folder.path().join("examples/torus.imp"), TORUS).unwrap();
    folder
}

fn session(folder: &Path, text: &str) -> Run {
    imp_with(folder, &["repl"], text.as_bytes())
}

fn with_torus(text: &str) -> Run {
    session(folder().path(), &format!("{TORUS}{text}"))
}

#[test]
fn the_table_has_every_command_and_every_example_works() {
    let listed = with_torus(":help\n").well().stdout;
    let names: Vec<&str> = listed
        .lines()
        .filter_map(|line| line.strip_prefix(':')?.split_whitespace().next())
        .collect();
    let expected = "help doc list params set bounds check at plot mesh sample time graph clif load \
                    reload save undo quit";
    assert_eq!(names, expected.split_whitespace().collect::<Vec<_>>());
    for name in names {
        let help = with_torus(&format!(":help {name}\n")).well().stdout;
        assert!(help.lines().count() >= 4, "{help}");
        let example = help.lines().find_map(|line| line.strip_prefix("Example: "));
        let example = example.unwrap_or_else(|| panic!("{help}"));
        assert!(example.starts_with(&format!(":{name}")), "{example}");
        let folder = folder();
        let before = match name {
            "reload" => ":load examples/torus.imp\n",
            _ => TORUS,
        };
        let run = session(folder.path(), &format!("{before}{example}\n")).well();
        let silent = ["set", "load", "reload", "save", "undo", "quit"];
        assert_eq!(
            run.stdout.is_empty(),
            silent.contains(&name),
            "{example}: {}",
            run.stdout
        );
    }
}

#[test]
fn words_begin_help_and_end_the_session() {
    assert!(with_torus("help\n").well().stdout.contains(":plot"));
    for end in ["quit", "exit", ":quit", ":q", ":exit"] {
        let run = with_torus(&format!("1 + 1\n{end}\n2 + 2\n")).well();
        assert_eq!(run.stdout, "2\n", "{end}");
    }
}

#[test]
fn an_unknown_command_is_told_from_the_one_that_was_meant() {
    let run = with_torus(":boundz torus\n");
    assert_eq!(run.code, 1);
    assert!(
        run.stderr.contains("did you mean `:bounds`?"),
        "{}",
        run.stderr
    );
    let run = with_torus(":xyzzy\n");
    assert!(
        run.stderr.contains("`:help` lists the commands"),
        "{}",
        run.stderr
    );
    // A beginning that only one command has is enough.
    assert!(with_torus(":par\n").well().stdout.contains("param r = 0.3"));
}

#[test]
fn definitions_are_listed_and_documented() {
    let run = with_torus("let k = 2\nfn twice(x, times = 2) = times * x\n:list\n").well();
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert_eq!(
        lines,
        [
            "r = 0.3 : param in 0.1..0.6",
            "torus : field in R3 over -1.5..1.5, depends on r",
            "k = 2 : number",
            "twice(x, times = 2) : function",
        ]
    );
    assert!(
        with_torus(":doc torus\n")
            .well()
            .stdout
            .contains("A torus about the z axis.")
    );
    assert!(with_torus(":doc r\n").well().stdout.contains("How thick"));
    assert!(
        with_torus(":help sphere\n")
            .well()
            .stdout
            .contains("### `sphere(")
    );
    let run = with_torus(":doc sphree\n");
    assert!(
        run.stderr.contains("did you mean `sphere`?"),
        "{}",
        run.stderr
    );
}

#[test]
fn setting_a_value_keeps_range_and_documentation() {
    let run = with_torus(":set r = 0.2 + 0.2\n:params\ntorus(1, 0, 0)\n").well();
    assert!(
        run.stdout
            .starts_with("param r = 0.4 in 0.1..0.6\n    How thick"),
        "{}",
        run.stdout
    );
    assert!(
        run.stdout.trim_end().ends_with("-0.16000000000000003"),
        "{}",
        run.stdout
    );
    for (line, expected) in [
        (":set r=2", "outside"),
        (":set rr=0.2", "did you mean `r`?"),
        (":set r=0.2 in 0..9", "`in`"),
        (":set r", "nothing is said to be set"),
        (":set r=\"a\"", "a string"),
    ] {
        let run = with_torus(&format!("{line}\n"));
        assert_eq!(
            run.code,
            if line == ":set r" { 2 } else { 1 },
            "{line}: {}",
            run.stderr
        );
        assert!(run.stderr.contains(expected), "{line}: {}", run.stderr);
    }
    let run = session(
        folder().path(),
        "setting n = 3 in 1..9\nlet squares = [i^2 for i in range(n)]\n:set n=5\nsquares\n",
    );
    assert_eq!(run.well().stdout, "[0, 1, 4, 9, 16]\n");
}

#[test]
fn a_point_gives_value_gradient_hessian_and_bounds() {
    let run = with_torus(":at torus [2, 0, 0.25]\n").well();
    let lines: Vec<&str> = run.stdout.lines().collect();
    // (ρ - 1)² + z² - r² at ρ = 2, z = 1/4; its derivatives; y's second one is 2(1 - 1/ρ).
    let value: f64 = lines[0]
        .strip_prefix("value")
        .unwrap()
        .trim()
        .parse()
        .unwrap();
    assert!((value - (1.0 + 0.0625 - 0.09)).abs() < 1e-15);
    assert_eq!(lines[1], "gradient  [2, 0, 0.5]");
    assert_eq!(lines[2], "Hessian   [[2, 0, 0], [0, 1, 0], [0, 0, 2]]");
    let ends = lines[3].strip_prefix("bounds").unwrap().trim();
    let (low, rest) = ends.split_once("..").unwrap();
    let high = rest.split_whitespace().next().unwrap();
    let [low, high]: [f64; 2] = [low, high].map(|end| end.parse().unwrap());
    assert!(low < value && value < high && high - low < 1.0, "{ends}");
    let both = with_torus(":at torus(2, 0, 0.25)\n").well().stdout;
    assert_eq!(both, run.stdout);
    for (line, expected) in [
        (":at torus", "a field and a point"),
        (":at torus [1, 2]", "defined in R3"),
        (":at 5 [1, 2]", "expected a field"),
    ] {
        let run = with_torus(&format!("{line}\n"));
        assert!(run.stderr.contains(expected), "{line}: {}", run.stderr);
    }
}

#[test]
fn boxes_checks_graphs_and_code_are_shown() {
    let run = with_torus(":bounds torus\n").well();
    assert!(run.stdout.contains("over    -1.5..1.5") && run.stdout.contains("proven  ["));
    let run = with_torus("field flat(p in R2) over -1..1 = 3\n:check flat\n:check\n").well();
    assert!(
        run.stdout.contains("1 field checked, 1 warning\n"),
        "{}",
        run.stdout
    );
    assert!(
        run.stdout.contains("2 fields checked, 1 warning\n"),
        "{}",
        run.stdout
    );
    assert!(
        run.stderr.contains("the field is 3 everywhere"),
        "{}",
        run.stderr
    );
    assert!(with_torus(":graph torus\n").well().stdout.contains("sqrt"));
    assert!(
        with_torus(":clif torus\n")
            .well()
            .stdout
            .contains("function")
    );
    let run = with_torus(":time torus(1, 0, 0)\n").well();
    assert!(
        run.stdout.starts_with("-0.09\n") && run.stdout.contains(" s, "),
        "{}",
        run.stdout
    );
}

#[test]
fn meshes_and_samples_are_measured_and_written() {
    let folder = folder();
    let text = format!(
        "{TORUS}:mesh torus, cell = 0.2, \"a.stl\"\n:sample torus, \"a.ply\", spacing = 0.4\n:mesh\n"
    );
    let run = session(folder.path(), &text).well();
    assert!(run.stdout.contains("mesh: method") && run.stdout.contains("genus 1"));
    assert!(
        run.stdout.contains("samples: method floaters"),
        "{}",
        run.stdout
    );
    assert!(folder.path().join("a.stl").exists() && folder.path().join("a.ply").exists());
    let run = session(
        folder.path(),
        &format!("{TORUS}:mesh torus, \"../a.stl\"\n"),
    );
    assert_eq!(run.code, 3, "{}", run.stderr);
    assert!(
        run.stderr.contains("outside the output directory"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_picture_without_colours_is_made_of_letters() {
    let run = with_torus(":plot torus, view = \"top\"\n").well();
    let lines: Vec<&str> = run.stdout.lines().collect();
    let middle = lines[lines.len() / 2].trim();
    // A ring with a hole: letters, spaces, letters.
    let parts: Vec<&str> = middle
        .split("   ")
        .filter(|part| !part.trim().is_empty())
        .collect();
    assert_eq!(parts.len(), 2, "{}", run.stdout);
    let run = with_torus(":plot torus, path = \"a.png\", size = 32\n").well();
    assert!(!run.stdout.trim().is_empty());
    let run = with_torus(":plot torus, viw = \"top\"\n");
    assert!(
        run.stderr.contains("did you mean `view`?"),
        "{}",
        run.stderr
    );
}

#[test]
fn a_saved_session_is_the_same_when_it_is_loaded() {
    let folder = folder();
    let text = "\
let k = 2
var n = 0
n = n + k
fn count() { n = n + 1 }
count()
# a comment that stays
field ball(p in R3) over -2..2 = norm(p) - k
torus | ball
let both = ans
let k = 3
:set r = 0.25
let skin = polygonize(torus, cell = 0.25)
:save a.imp
[k, n, ball(0, 0, 0), torus(1, 0, 0), both(0, 0, 0), skin.genus]
";
    let first = session(folder.path(), &format!("{TORUS}{text}")).well();
    let saved = std::fs::read_to_string(folder.path().join("a.imp")).unwrap();
    assert!(
        saved.contains("# a comment that stays\n") && saved.contains("## How thick"),
        "{saved}"
    );
    let ask = ":load a.imp\n[k, n, ball(0, 0, 0), torus(1, 0, 0), both(0, 0, 0), skin.genus]\n:save b.imp\n";
    let second = session(folder.path(), ask).well();
    let value = first.stdout.lines().next_back().unwrap();
    assert!(
        value.starts_with("[3, 4, -3, -0.0625, -3, 1"),
        "{value}\n{saved}"
    );
    assert_eq!(second.stdout.trim_end(), value, "{saved}");
    // Saved again it is the same file, and other commands understand it too.
    assert_eq!(
        std::fs::read_to_string(folder.path().join("b.imp")).unwrap(),
        saved
    );
    crate::common::imp_in(folder.path(), &["check", "a.imp"]).well();
    let run = session(folder.path(), "let a = 1\n:save a.imp\n");
    assert_eq!(run.code, 3);
    assert!(
        run.stderr.contains("`:save! a.imp` replaces it"),
        "{}",
        run.stderr
    );
    session(folder.path(), "let a = 1\n:save! a.imp\n").well();
    assert_eq!(
        std::fs::read_to_string(folder.path().join("a.imp")).unwrap(),
        "let a = 1\n"
    );
}

#[test]
fn inputs_are_taken_back_one_after_the_other() {
    let text = "let a = 1\nfield f(p in R2) = norm(p) - a\n:undo\n";
    let run = with_torus(&format!("{text}:list\n")).well();
    let is_listed = |name: &str| run.stdout.lines().any(|line| line.starts_with(name));
    assert!(is_listed("a ") && !is_listed("f "), "{}", run.stdout);
    let run =
        with_torus(":list\nlet a = 1\n:list\nlet a = 2\n:undo\na\n:undo\n:undo\n:list\n").well();
    assert!(run.stdout.contains("\n1\n"), "{}", run.stdout);
    assert!(!run.stdout.trim_end().ends_with("1"), "{}", run.stdout);
    let run = session(folder().path(), "let a = 1\n:undo\n:undo\n");
    assert!(
        run.stderr.contains("nothing to take back"),
        "{}",
        run.stderr
    );
    // What a file replaced comes back too.
    let run = session(
        folder().path(),
        "let own = 7\n:load examples/torus.imp\n:undo\nown\n",
    );
    assert_eq!(run.well().stdout, "7\n");
}

#[test]
fn a_loaded_file_is_read_again() {
    let folder = folder();
    let path = folder.path().join("a.imp");
    std::fs::write(&path, "let a = 1\nprint(\"left out\")\n").unwrap();
    let run = session(folder.path(), ":load a.imp\na\nlet b = 2\n:reload\n:list\n").well();
    assert_eq!(run.stdout, "1\na = 1 : number\n");
    let run = session(folder.path(), ":reload\n");
    assert!(
        run.stderr.contains("no file has been loaded"),
        "{}",
        run.stderr
    );
    let run = session(folder.path(), ":load missing.imp\n");
    assert_eq!(run.code, 3, "{}", run.stderr);
    std::fs::write(&path, "let a = \n").unwrap();
    let run = session(folder.path(), ":load a.imp\n");
    assert!(
        run.code == 1 && run.stderr.contains("a.imp:1:"),
        "{}",
        run.stderr
    );
}
