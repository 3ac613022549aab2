//! What is wrong with a sampling is said, with the place, what is expected and what to do.

use std::process::Command;

const SCENES: &str = "\
field none(p in R3) over -1..1 = norm2(p) + 1
field thick(p in R3) over -2..2 = max(norm(p) - 1, 0)
field zero(p in R3) over -2..2 = 0*p.x
field squared(p in R3) over -1.5..1.5 = (norm2(p) - 1)^2
field heart(x, y, z) over -1.5..1.5 = (x^2 + 9/4*y^2 + z^2 - 1)^3 == x^2*z^3 + 9/80*y^2*z^3
field nan(p in R3) over -1..1 = sqrt(-1 - norm2(p))
field half(p in R3) over -1.5..1.5 = sqrt(p.x)*0 + norm(p) - 1
field roots(x) over -2..2 = x^2 - 1
field rings(x, y) over -9..9 = (x^2 + y^2 - 1)*(x^2 + y^2 - 4)*(x^2 + y^2 - 9)
field waves(x, y) over -1..1 = y - sin(1/x)
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
fn a_region_without_a_surface_is_warned_of_by_every_method_of_lines() {
    for method in ["rays", "poisson", "grid"] {
        for scene in ["thick", "zero"] {
            let words = format!("{scene} --count 300 --method {method}");
            let parts = ["W0812", "the field is 0 all along", "it has no area"];
            assert_said(&words, 0, &parts);
        }
    }
    for method in ["kinematic", "dynamic"] {
        assert_said(
            &format!("zero --count 300 --method {method}"),
            0,
            &["W0812", "0 on a whole region"],
        );
    }
}

#[test]
fn a_zero_set_that_is_no_surface_is_warned_of() {
    let words = "thick --count 300";
    assert_said(words, 0, &["W0812", "the field is 0 on a whole region"]);
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
fn arguments_that_a_method_would_ignore_are_refused() {
    for (words, parts) in [
        (
            "ball --friction 0.1",
            ["`friction`", "is for \\\"dynamic\\\""],
        ),
        (
            "ball --method kinematic --friction 0.1",
            ["`friction`", "is for \\\"dynamic\\\""],
        ),
        (
            "ball --method rays --potential square",
            ["`potential`", "\\\"kinematic\\\" and \\\"dynamic\\\""],
        ),
        (
            "ball --method poisson --direction [0,0,1]",
            ["`direction`", "is for \\\"rays\\\""],
        ),
        (
            "ball --method dynamic --seeds [[0,0,1]]",
            ["`seeds`", "\\\"floaters\\\" and \\\"relax\\\""],
        ),
        (
            "ball --method grid --rule phi=3",
            ["`phi`", "\\\"floaters\\\" and \\\"relax\\\""],
        ),
    ] {
        assert_said(words, 1, &["E0309", "no meaning", parts[0], parts[1]]);
    }
}

#[test]
fn what_is_wrong_with_a_number_is_said_with_its_range() {
    let whole = "`count` must be a whole number from 1 to 10000000";
    for (words, found) in [
        ("ball --count 1e300", "but it is 1e300"),
        ("ball --count -3", "but it is -3.0"),
        ("ball --count 2.5", "but it is 2.5"),
    ] {
        assert_said(words, 1, &["E0309", whole, found]);
    }
    let direction = "ball --method rays --direction [0,1]";
    assert_said(direction, 1, &["E0309", "of 3 numbers, but this has 2"]);
    let tolerance = "ball --tolerance 1e-30";
    assert_said(tolerance, 1, &["E0309", "limit of rounding", "not 1e-30"]);
    let huge = "ball --bounds -1e308..1e308";
    assert_said(huge, 1, &["E0309", "within ±1e100"]);
    let relax = "roots --method relax";
    assert_said(relax, 1, &["E0309", "\\\"relax\\\" is not for roots"]);
    for method in ["floaters", "kinematic", "trace", "rays", "grid", "poisson"] {
        let words = format!("ball --limit particles=10 --method {method}");
        let help = "give a `count` of at most 10, or raise the limit";
        assert_said(&words, 1, &["E0606", "without `count`", help]);
    }
}

#[test]
fn another_number_of_points_than_was_asked_for_is_warned_of() {
    let words = "rings --method trace --count 2";
    assert_said(words, 0, &["W0803", "3 points, not 2, on the 3 components"]);
    let words = "waves --method trace";
    assert_said(words, 0, &["W0803", "given up", "W0813"]);
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
        &["E0309", "points of 3 numbers, but one of them has 2"],
    );
    assert_said("ball --seeds 1", 1, &["E0301", "must be points, as in"]);
}
