//! `import "path.imp" as name`.

use crate::common::{Run, imp_with};

/// Files in a folder of their own.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Folder {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        Folder(folder)
    }

    fn imp(&self, words: &[&str]) -> Run {
        imp_with(self.0.path(), words, b"")
    }

    #[track_caller]
    fn fails(&self, words: &[&str], code: i32, parts: &[&str]) {
        let run = self.imp(words);
        assert_eq!(run.code, code, "{}\n{}", run.stdout, run.stderr);
        for part in parts {
            assert!(run.stderr.contains(part), "{part}\n{}", run.stderr);
        }
    }
}

const BRACKET: &str = "import \"../units.imp\" as units\n\
    ## The radius\nparam r = 1 in 0..10\nsetting n = 1\nlet k = units.inch*2\n\
    field plate(p in R3) over -2..2 = norm(p) - r*n\nfn scaled(x, times = 1) = x*k*times\n\
    let area = polygonize(plate, cell = 0.5).area\n\
    var table = []\nfor i in range(3) { table = append(table, i^2) }\n\
    print(\"not shown\")\nexport(1, \"nowhere.stl\")\nassert(false)\n\
    test \"not run\" { assert(false) }\n";

fn parts() -> Folder {
    Folder::new(&[
        (
            "main.imp",
            "import \"parts/bracket.imp\" as bracket\nimport \"units.imp\" as u\nparam s = 2\n\
             field part(p in R3) over -2..2 = bracket.plate(p) - s\nprint(1)\n\
             test \"t\" { assert(part(0, 0, 0) == -3) }\n",
        ),
        ("parts/bracket.imp", BRACKET),
        ("units.imp", "let inch = 25.4\nparam q = 7\n"),
    ])
}

#[test]
fn a_module_gives_its_definitions() {
    let folder = parts();
    let value = |expression: &str| {
        let run = folder.imp(&["eval", "main.imp", expression]).well();
        run.stdout.trim_end().to_string()
    };
    assert_eq!(value("bracket.k"), "50.8");
    assert_eq!(value("bracket.scaled(2, times = 10)"), "1016");
    assert_eq!(value("2 |> bracket.scaled"), "101.6");
    assert_eq!(value("bracket.table"), "[0, 1, 4]");
    assert_eq!(value("bracket.units.inch == u.inch"), "true");
    assert_eq!(value("bracket.area > 5"), "true");
    assert_eq!(value("bracket"), "the module bracket");
    // Definitions only: nothing of it was printed, asserted or written.
    assert_eq!(folder.imp(&["run", "main.imp"]).well().stdout, "1\n");
    folder.imp(&["check", "main.imp"]).well();
    let tested = folder.imp(&["test", "main.imp"]).well();
    assert!(tested.stdout.ends_with("1 test: 1 passed, 0 failed\n"));
}

#[test]
fn its_parameters_are_part_of_q() {
    let folder = parts();
    let value = |expression: &str, more: &[&str]| {
        let words: Vec<&str> = ["eval", "main.imp", expression]
            .iter()
            .chain(more)
            .copied()
            .collect();
        folder.imp(&words).well().stdout.trim_end().to_string()
    };
    assert_eq!(value("part(0, 0, 0)", &[]), "-3");
    assert_eq!(
        value("(part with {bracket.r = 5, s = 1})(0, 0, 0)", &[]),
        "-6"
    );
    assert_eq!(value("(part with {bracket.n = 3})(0, 0, 0)", &[]), "-5");
    assert_eq!(value("diff(part, bracket.r)(0, 0, 0)", &[]), "-1");
    let set = ["--set", "bracket.r=2", "--set", "bracket.n=4"];
    assert_eq!(value("part(0, 0, 0)", &set), "-10");
    // Reached twice it is one module, and has one name.
    assert_eq!(
        value("[u.q, bracket.units.q]", &["--set", "bracket.units.q=8"]),
        "[8, 8]"
    );
    let info = folder.imp(&["info", "main.imp"]).well().stdout;
    for line in [
        "    depends on bracket.r, s\n",
        "param bracket.r = 1 in 0..10\n    The radius\n",
        "setting bracket.n = 1",
    ] {
        assert!(info.contains(line), "{line}\n{info}");
    }
    // A module by another name is the same module.
    let other = "{ let b = bracket; (part with {b.r = 5, bracket.n = 2})(0, 0, 0) }";
    assert_eq!(value(other, &[]), "-12");
    folder.fails(
        &["eval", "main.imp", "part with {brackt.r = 5}"],
        1,
        &["E0201", "no module `brackt`"],
    );
    folder.fails(
        &["eval", "main.imp", "part with {bracket.r = 50}"],
        1,
        &["E0307", "`bracket.r`"],
    );
    folder.fails(&["run", "main.imp", "--set", "bracket.x=2"], 1, &["E0208"]);
}

#[test]
fn a_function_of_a_module_changes_its_own_settings() {
    let folder = Folder::new(&[
        (
            "main.imp",
            "import \"m.imp\" as m\nprint(m.at(5), m.f(0))\n",
        ),
        (
            "m.imp",
            "setting n = 2\nfield f(x) = x - n\nfn at(k) = (f with {n = k})(0)\n",
        ),
    ]);
    assert_eq!(folder.imp(&["run", "main.imp"]).well().stdout, "-5 -2\n");
}

#[test]
fn a_module_finds_files_beside_it() {
    let folder = Folder::new(&[
        (
            "main.imp",
            "import \"parts/m.imp\" as m\nprint(m.now(0.5, 0), m.later()(0.5, 0))\n",
        ),
        (
            "parts/m.imp",
            "let now = load(\"x.vm\")\nfn later() = load(\"x.vm\")\n",
        ),
        ("parts/x.vm", "a var-x\nb const 2\nc mul a b\n"),
    ]);
    assert_eq!(folder.imp(&["run", "main.imp"]).well().stdout, "1 1\n");
}

#[test]
fn missing_names_and_files_are_told_with_the_way_to_them() {
    let folder = parts();
    folder.fails(
        &["eval", "main.imp", "bracket.plat"],
        1,
        &["E0206", "the module `bracket` has no `plat`", "`plate`"],
    );
    folder.fails(
        &["eval", "main.imp", "bracket.sin(1)"],
        1,
        &["E0206", "has no `sin`"],
    );
    let folder = Folder::new(&[
        ("a.imp", "import \"b.imp\" as b\n"),
        ("b.imp", "import \"c.imp\" as c\n"),
        (
            "d.imp",
            "import \"wrong.imp\" as w\nimport \"name.imp\" as n\nimport \"bad.imp\" as b\n",
        ),
        ("wrong.imp", "let x 3\n"),
        ("e.imp", "import \"name.imp\" as n\n"),
        ("name.imp", "let x = radus\n"),
        ("f.imp", "import \"bad.imp\" as n\nlet y = n.x\n"),
        ("bad.imp", "let x = [1][3]\n"),
        ("inside.imp", "fn f() { import \"bad.imp\" as b; 1 }\n"),
    ]);
    folder.fails(
        &["run", "a.imp"],
        3,
        &["E0701", "c.imp", "b.imp:1:8", "a.imp:1:8"],
    );
    folder.fails(
        &["run", "d.imp"],
        1,
        &["E0101", "wrong.imp:1:7", "d.imp:1:8"],
    );
    folder.fails(
        &["run", "e.imp"],
        1,
        &["E0201", "name.imp:1:9", "e.imp:1:8"],
    );
    folder.fails(
        &["run", "f.imp"],
        1,
        &["E0303", "bad.imp:1:13", "f.imp:1:8"],
    );
    folder.fails(&["run", "inside.imp"], 1, &["E0210"]);
}

#[test]
fn circles_are_told_with_all_their_files() {
    let folder = Folder::new(&[
        ("a.imp", "import \"b.imp\" as b\n"),
        ("b.imp", "let x = 1\nimport \"sub/c.imp\" as c\n"),
        ("sub/c.imp", "import \"../a.imp\" as a\n"),
        ("self.imp", "import \"./self.imp\" as me\n"),
    ]);
    folder.fails(
        &["run", "a.imp"],
        1,
        &[
            "E0211",
            "`a.imp` → `b.imp` → `sub/c.imp` → `",
            "a.imp:1:8",
            "b.imp:2:8",
        ],
    );
    folder.fails(&["check", "self.imp"], 1, &["E0211"]);
}

#[test]
fn files_outside_the_allowed_folders_are_not_read() {
    let folder = Folder::new(&[
        ("in/main.imp", "import \"../lib/x.imp\" as x\nprint(x.y)\n"),
        ("lib/x.imp", "let y = 3\n"),
    ]);
    // From above, the present folder holds both.
    assert_eq!(folder.imp(&["run", "in/main.imp"]).well().stdout, "3\n");
    let inside = folder.0.path().join("in");
    let imp = |words: &[&str]| imp_with(&inside, words, b"");
    let refused = imp(&["run", "main.imp"]);
    assert_eq!(refused.code, 3);
    for words in ["E0708", "--allow-read", "main.imp:1:8"] {
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
    assert!(!refused.stderr.contains("let y"), "{}", refused.stderr);
    let allowed = imp(&["run", "main.imp", "--allow-read", "../lib"]).well();
    assert_eq!(allowed.stdout, "3\n");
    // A link does not help.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../lib/x.imp", inside.join("link.imp")).unwrap();
        std::fs::write(inside.join("b.imp"), "import \"link.imp\" as x\n").unwrap();
        assert_eq!(imp(&["run", "b.imp"]).code, 3);
    }
}
