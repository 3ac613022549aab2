//! What is wrong with a sampling is said, with the place, what is expected and what to do.

use std::process::Command;

const SCENES: &str = "\
field none(p in R3) over -1..1 = norm2(p) + 1
field thick(p in R3) over -2..2 = max(norm(p) - 1, 0)
field squared(p in R3) over -1.5..1.5 = (norm2(p) - 1)^2
field heart(x, y, z) over -1.5..1.5 = (x^2 + 9/4*y^2 + z^2 - 1)^3 == x^2*z^3 + 9/80*y^2*z^3
field nan(p in R3) over -1..1 = sqrt(-1 - norm2(p))
field half(p in R3) over -1.5..1.5 = sqrt(p.x)*0 + norm(p) - 1
field ball(p in R3) over -1.5..1.5 = norm(p) - 1
";

/// The exit code of `imp sample` with these words, and what it says.
fn sampled(words: &str) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.imp"), SCENES).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_imp"))
        .current_dir(folder.path())
        .args(["sample", "s.imp", "--json"])
        .args(words.split(' '))
        .output()
        .unwrap();
    let said = String::from_utf8(done.stdout).unwrap() + &String::from_utf8_lossy(&done.stderr);
    (done.status.code().unwrap(), said)
}

/// Whether the code is this and everything is said.
fn assert_said(words: &str, code: i32, parts: &[&str]) {
    let (found, said) = sampled(words);
    assert_eq!(found, code, "{words}: {said}");
    for part in parts {
        assert!(said.contains(part), "{words}: no `{part}` in {said}");
    }
}

#[test]
fn a_box_without_a_zero_set_is_an_error_of_every_method() {
    for method in [
        "floaters",
        "relax",
        "kinematic",
        "dynamic",
        "trace",
        "rays",
        "poisson",
        "grid",
    ] {
        let words = format!("none --method {method}");
        assert_said(
            &words,
            4,
            &["E0405", "zero", "give `bounds` that hold the surface"],
        );
    }
    let words = "nan --method rays";
    assert_said(
        words,
        4,
        &["E0405", "not a number at", "check where it is defined"],
    );
    assert_said("nan --method kinematic", 4, &["E0405", "not a number at"]);
}

#[test]
fn a_zero_set_that_is_no_surface_is_warned_of() {
    for method in ["floaters", "rays"] {
        let words = format!("thick --count 300 --method {method}");
        assert_said(&words, 0, &["W0812", "the field is 0 on a whole region"]);
    }
    // A front keeps to the border of the region.
    assert_said("thick --count 300 --method trace", 0, &["W0813"]);
    // Of the square nothing can be proven, and a front has no direction.
    assert_said("squared --count 300", 0, &["W0813", "across"]);
    assert_said(
        "squared --method trace",
        4,
        &["E0405", "does not change its sign"],
    );
    let (code, said) = sampled("heart --count 300");
    assert!(code == 0 && said.contains("\"points\":300"), "{said}");
}

#[test]
fn regions_without_a_value_are_counted() {
    for method in ["floaters", "kinematic", "trace"] {
        let words = format!("half --count 300 --method {method}");
        assert_said(&words, 0, &["W0801", "not a number at"]);
    }
}

#[test]
fn a_spacing_that_fits_nothing_is_refused_or_warned_of() {
    // 1.2e8 points.
    for method in ["floaters", "relax", "trace", "rays", "poisson", "grid"] {
        let words = format!("ball --spacing 0.00035 --method {method}");
        let parts = [
            "E0309",
            "`spacing` must be larger",
            "10000000",
            "which takes about 1",
        ];
        assert_said(&words, 1, &parts);
    }
    for method in ["floaters", "trace", "rays", "poisson"] {
        let words = format!("ball --spacing 50 --method {method}");
        assert_said(&words, 0, &["W0814", "larger than the distance"]);
    }
    assert_said(
        "ball --spacing 50 --method grid",
        4,
        &["E0405", "smaller `spacing`"],
    );
    assert_said("ball --spacing 0", 1, &["E0309", "greater than 0"]);
}

#[test]
fn seeds_that_lead_nowhere_are_refused() {
    for seed in ["[[0,0,0]]", "[[0,0,9]]", "[[0,0,0/0]]"] {
        let words = format!("ball --seeds {seed}");
        assert_said(
            &words,
            1,
            &["E0309", "`seeds` must be points of the box within"],
        );
    }
    assert_said(
        "ball --seeds [[0,1]]",
        1,
        &["E0301", "must be points, as in"],
    );
}
