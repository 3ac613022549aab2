//! Settings: structural values, from outside and by `with`.

use crate::common::{imp_with, script};

const GEAR: &str = "## How many teeth\nsetting teeth = 12 in 3..64\n\
    setting style = \"round\" in [\"round\", \"sharp\"]\nsetting fine = false\n\
    param depth = 1/teeth\n\
    fn tooth(k, x) = if style == \"round\" then cos(k*x) else abs(x) + k\n\
    field gear(x, y) = x^2 + y^2 - 1 - depth*sum(tooth(k, x) for k in range(teeth))\n\
    let half = gear/2\n";

#[track_caller]
fn prints(program: &str, expected: &str) {
    let run = script(&format!("{GEAR}{program}")).well();
    assert_eq!(run.stdout.trim_end(), expected, "{program}");
}

#[track_caller]
fn fails(program: &str, code: &str, words: &str) {
    let run = script(program);
    assert_eq!(run.code, 1, "{program}\n{}", run.stderr);
    for part in [code, words] {
        assert!(run.stderr.contains(part), "{program}\n{}", run.stderr);
    }
}

#[test]
fn a_setting_is_a_plain_value() {
    prints(
        "print(teeth, style, fine, [teeth][0] + 1)",
        "12 round false 13",
    );
}

#[test]
fn with_makes_the_definitions_again_that_depend_on_a_setting() {
    // depth*teeth = 1 at the default of depth, and sum(k for k in range(n)) = n(n-1)/2.
    prints("print(gear(0, 0), half(0, 0))", "-2 -1");
    prints("print((gear with {teeth = 4})(0, 0))", "-2");
    prints("print((half with {teeth = 4, depth = 1})(0, 0))", "-2.5");
    prints(
        "print(((gear with {style = \"sharp\", teeth = 5}) with {depth = 2})(0, 0))",
        "-21",
    );
    prints(
        "for n in [3, 5] { print((gear with {teeth = n, style = \"sharp\"})(0, 0)) }",
        "-2\n-3",
    );
    // Where the parameter's default was given from the new setting, a change of it stays.
    prints(
        "let g = gear with {depth = 3}\nprint((g with {teeth = 4})(0, 0))",
        "-13",
    );
    // Not only fields: any value of the file.
    prints(
        "let area = teeth*2\nprint(area with {teeth = 5}, area)",
        "10 24",
    );
    // And inside a field's body.
    prints(
        "field two(x, y) = min((gear with {teeth = 3, depth = 1})(x, y), gear(x, y))\nprint(two(0, 0))",
        "-4",
    );
}

#[test]
fn what_ran_before_a_definition_is_run_again_in_order() {
    let program = "setting k = 2\nvar n = 3\nfor i in range(2) { n = n + k }\n\
        field f(x) = x - n\nn = 100\nprint(f(0), (f with {k = 5})(0), n)";
    assert_eq!(script(program).well().stdout, "-7 -13 100\n");
}

#[test]
fn actions_are_done_again_only_where_they_are_needed() {
    let program = "setting n = 1\nfield f(p in R3) over -2..2 = norm(p) - n\n\
        print(\"once\")\nlet m = polygonize(f, cell = 0.5)\nlet v = m.volume\n\
        print((v with {n = 1}) == v, (v with {n = 1.5}) > v)";
    assert_eq!(script(program).well().stdout, "once\ntrue true\n");
}

#[test]
fn definitions_are_made_once_for_the_same_settings() {
    // Each `with` that had to make all before it would double the work: 2^60 steps.
    let mut program = String::from("setting n = 1\nfield f0(x) = x + n\n");
    for k in 1..60 {
        program += &format!("let f{k} = f{} with {{n = {k}}}\n", k - 1);
    }
    // f1 is what f0 is for n = 1, whatever n is around it.
    program += "print(f59(0))\n";
    // Every call of g under another setting makes its own.
    program += "fn g(k) = if k < 1 then n else g(k - 1) with {n = n + 1}\nprint(g(20))\n";
    assert_eq!(script(&program).well().stdout, "1\n21\n");
}

#[test]
fn what_was_made_under_a_setting_stays_as_it_was() {
    // More settings than are kept, and each function still finds its own mesh and field.
    let program = "setting n = 1 in 1..200\nfield f(p in R3) over -300..300 = norm(p) - n\n\
        let m = polygonize(f, cell = 100)\nfn measure(k) = m.volume*0 + n + k\n\
        fn moved(k) = (f with {n = k})(0, 0, 0) + n\n\
        let all = [measure with {n = 101 + i} for i in range(90)]\n\
        let others = [moved with {n = 101 + i} for i in range(90)]\n\
        print(all[0](0), all[89](1), others[0](7), others[89](7))\n";
    assert_eq!(script(program).well().stdout, "101 191 94 183\n");
}

#[test]
fn settings_are_set_from_outside() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{GEAR}print(teeth, style, gear(0, 0))");
    let imp = |words: &[&str]| imp_with(folder.path(), words, text.as_bytes());
    let set = ["run", "-", "--set", "teeth=4", "--set", "style=\"sharp\""];
    // sum(0 + k for k in range(4))/4 = 1.5
    assert_eq!(imp(&set).well().stdout, "4 sharp -2.5\n");
    let outside = imp(&["run", "-", "--set", "teeth=2"]);
    assert_eq!(outside.code, 1);
    assert!(outside.stderr.contains("E0307"), "{}", outside.stderr);
    let other = imp(&["run", "-", "--set", "style=\"blunt\""]);
    assert!(other.stderr.contains("none of"), "{}", other.stderr);
    let kind = imp(&["run", "-", "--set", "fine=1"]);
    assert!(kind.stderr.contains("E0301"), "{}", kind.stderr);
    let misspelt = imp(&["run", "-", "--set", "teth=4"]);
    assert!(misspelt.stderr.contains("`teeth`"), "{}", misspelt.stderr);
}

#[test]
fn info_lists_settings() {
    let folder = tempfile::tempdir().unwrap();
    let info = |more: &[&str]| {
        let words: Vec<&str> = ["info", "-"].iter().chain(more).copied().collect();
        imp_with(folder.path(), &words, GEAR.as_bytes()).well()
    };
    let text = info(&[]).stdout;
    assert!(
        text.contains("setting teeth = 12 in 3..64\n    How many teeth\n"),
        "{text}"
    );
    assert!(
        text.contains("setting style = \"round\" in [\"round\", \"sharp\"]\n"),
        "{text}"
    );
    // depth depends on the setting, but is a parameter: a part of q, teeth is not.
    assert!(text.contains("depends on depth\n"), "{text}");
    let json = info(&["--json"]).json();
    assert_eq!(json["settings"][0]["name"], "teeth");
    assert_eq!(json["settings"][0]["range"]["hi"], 64);
    assert_eq!(json["settings"][1]["values"][1], "sharp");
    assert_eq!(json["settings"][2]["value"], false);
}

#[test]
fn wrong_settings_are_refused() {
    fails("setting n = [1]", "E0301", "a number, a bool or a string");
    fails("setting n = 5 in 6..7", "E0307", "outside 6..7");
    fails("param r = 1\nsetting n = r", "E0310", "depends on");
    fails("setting n = 5 in 6", "E0301", "interval or a list");
    fails("fn f() { setting n = 5; n }", "E0210", "settings");
    fails("setting n = 5\nn = 6", "E0207", "not a `var`");
    fails(
        "setting n = 5\nlet f = x -> n\nprint(f with {n = \"a\"})",
        "E0301",
        "a string",
    );
    fails(
        "setting n = 5\nparam c = range(n)\nfield f(x) = sum(c) + x\nlet g = f with {n = 4}",
        "E0301",
        "shape of the parameter `c`",
    );
    // What a call has got is not made again: that must not pass unnoticed.
    fails(
        "setting n = 5\nfield f(x) = x - n\nfn g(h) = h with {n = 4}\nlet k = g(f)",
        "E0310",
        "made in a block or call",
    );
    fails(
        "setting n = 5\nprint(1 with {n = 4, n = 3})",
        "E0202",
        "given twice",
    );
}
