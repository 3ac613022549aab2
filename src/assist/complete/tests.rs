use super::*;

/// The labels that are offered where the text has `‸`.
fn labels_in(text: &str, surroundings: &Surroundings) -> Vec<String> {
    let offset = text.find('‸').expect("a place");
    let text = text.replace('‸', "");
    let found = complete(&text, offset, surroundings);
    for completion in &found {
        assert!(text.get(completion.replace.clone()).is_some(), "{text}");
    }
    found.into_iter().map(|found| found.label).collect()
}

fn labels(text: &str) -> Vec<String> {
    labels_in(text, &Surroundings::default())
}

#[track_caller]
fn offers(text: &str, wanted: &[&str], unwanted: &[&str]) {
    let found = labels(text);
    for word in wanted {
        assert!(found.iter().any(|label| label == word), "{word}: {found:?}");
    }
    for word in unwanted {
        assert!(
            !found.iter().any(|label| label == word),
            "{word}: {found:?}"
        );
    }
}

#[test]
fn names_of_the_file_are_offered_where_they_are_bound() {
    let text = "param radius = 1\nlet first = 2\nfield ball(p in R3) = norm(p) - radius\n‸\nlet last = 3\n";
    offers(text, &["radius", "first", "ball"], &["last", "p"]);
    offers("fn f(some) = ‸\nlet last = 1", &["some", "last", "f"], &[]);
    offers("fn f(some) = some\n‸", &["f"], &["some"]);
    offers("let own = ‸", &[], &["own"]);
}

#[test]
fn inner_names_are_offered_inside_only() {
    offers("field f(xx, yy) = ‸", &["xx", "yy"], &["f"]);
    offers("let g = tt -> ‸", &["tt"], &[]);
    offers("let g = (uu, vv = 1) -> u‸", &["uu"], &["vv"]);
    offers("f(tt -> tt, ‸)", &[], &["tt"]);
    offers("for turned in range(3) {\n    ‸\n}", &["turned"], &[]);
    offers("for turned in range(3) {\n}\n‸", &[], &["turned"]);
    offers("fn f(aa) {\n    let bb = 1\n    ‸\n}", &["aa", "bb"], &[]);
    offers("fn f(aa) {\n    let bb = 1\n}\n‸", &["f"], &["aa", "bb"]);
    offers("let l = [‸ for item in range(3)]", &["item"], &[]);
    offers("let l = sum(item + ‸ for item in range(3))", &["item"], &[]);
}

#[test]
fn arguments_are_offered_in_calls() {
    let text = "field f(x, y) = x\nlet m = polygonize(f, ‸";
    let found = labels(text);
    assert_eq!(found[0], "f =");
    assert!(found.iter().any(|label| label == "cell ="), "{found:?}");
    assert!(found.iter().any(|label| label == "method ="), "{found:?}");
    offers("polygonize(f, ce‸)", &["cell ="], &["method ="]);
    offers(
        "fn own(some, other = 1) = some\nown(1, ‸)",
        &["other ="],
        &[],
    );
    offers("ball.sample(‸)", &["spacing ="], &[]);
    // A value stands there, not a name.
    offers("polygonize(f, cell = ‸)", &["pi"], &["method ="]);
}

#[test]
fn strings_are_offered_where_they_are_known() {
    assert_eq!(labels("polygonize(f, method = \"cu‸\")"), ["cubes"]);
    assert_eq!(labels("polygonize(f, method = \"du‸\")"), ["dual"]);
    assert_eq!(labels("sample(f, method = \"kin‸"), ["kinematic"]);
    assert_eq!(labels("let a = \"‸\""), [""; 0]);
}

#[test]
fn members_stand_behind_a_point() {
    offers("let a = ease.‸", &["in_quad"], &["polygonize", "area"]);
    offers("let m = 1\nm.ar‸", &["area"], &["atan2"]);
    offers("box(1).‸", &["area", "twist"], &["let", "pi"]);
}

#[test]
fn parameters_stand_in_with() {
    let text = "param aa = 1\nsetting bb = 2\nlet cc = 3\nlet d = f with {‸";
    offers(text, &["aa", "bb"], &["cc", "sin"]);
    let text = "param aa = 1\nlet cc = 3\nlet d = f with {aa = ‸}";
    offers(text, &["aa", "cc", "sin"], &[]);
    let text = "param aa = 1\nlet cc = 3\nlet d = f with {aa = 1, ‸}";
    offers(text, &["aa"], &["cc", "sin"]);
}

#[test]
fn reserved_words_stand_where_they_may() {
    offers("‸", &["let", "param", "import", "if"], &["then", "and"]);
    offers("fn f(a) {\n    ‸\n}", &["let", "for"], &["param", "import"]);
    offers("let a = ‸", &["if", "not"], &["let", "param"]);
    offers("let a = b ‸", &["and", "with"], &["let", "a", "sin"]);
    offers("field f(p in ‸) = 1", &["R2", "R3"], &["p"]);
}

#[test]
fn nothing_is_offered_where_names_are_bound_or_read_by_people() {
    for text in [
        "let ‸",
        "fn f(‸)",
        "field f(x, ‸)",
        "# no‸",
        "let a = 12‸",
        "\"pr‸",
    ] {
        assert!(labels(text).is_empty(), "{text}: {:?}", labels(text));
    }
}

#[test]
fn sessions_add_their_names() {
    let surroundings = Surroundings {
        names: vec![
            Known::new("from_before", Kind::Variable, "a number = 1"),
            Known {
                members: vec![Known::new("special", Kind::Property, "of it")],
                ..Known::new("mine", Kind::Module, "a module")
            },
        ],
        ..Surroundings::default()
    };
    assert_eq!(labels_in("1 + from‸", &surroundings), ["from_before"]);
    assert_eq!(labels_in("mine.‸", &surroundings), ["special"]);
}

#[test]
fn imports_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let text =
        "## Of the head.\nparam size = 1 in 0..2\nfn head(a) = a\nlet inner = { let t = 1; t }\n";
    std::fs::write(folder.path().join("bolt.imp"), text).expect("a file");
    std::fs::create_dir(folder.path().join("parts")).expect("a folder");
    let surroundings = Surroundings {
        directory: folder.path().to_owned(),
        ..Surroundings::default()
    };
    let labels = |text| labels_in(text, &surroundings);
    assert_eq!(labels("import \"‸"), ["bolt.imp", "parts/"]);
    assert_eq!(labels("import \"b‸\" as b"), ["bolt.imp"]);
    assert_eq!(
        labels("import \"bolt.imp\" as b\nb.‸"),
        ["size", "head", "inner"]
    );
    assert_eq!(
        labels("import \"bolt.imp\" as b\nlet f = g with {‸"),
        ["b.size"]
    );
    assert_eq!(
        labels("import \"bolt.imp\" as b\nb.head(a‸"),
        ["a =", "abs", "acos", "acosh", "algebraic", "and"][..1]
            .iter()
            .map(|&label| label.to_owned())
            .chain(labels("1 + a‸"))
            .collect::<Vec<String>>()
    );
}

#[test]
fn no_place_in_a_broken_text_is_too_much() {
    let text = "import \"é\nfield f(x = {with {(\"a{b} 🙂\nlet [a for . in \"{\"}}} |> x ->\n";
    for offset in 0..=text.len() + 2 {
        complete(text, offset, &Surroundings::default());
    }
}

#[test]
fn calls_know_which_argument_is_being_written() {
    let call = |marked: &str| {
        let offset = marked.find('‸').expect("a place");
        let text = marked.replace('‸', "");
        call_at(&text, offset, &Surroundings::default())
            .map(|call| (call.callee.name.to_string(), call.parameter))
    };
    let is = |name: &str, parameter| Some((name.to_owned(), parameter));
    assert_eq!(call("atan2(‸"), is("atan2", Some(0)));
    assert_eq!(call("atan2(1, ‸)"), is("atan2", Some(1)));
    assert_eq!(call("atan2([1, ‸2], 3)"), is("atan2", Some(0)));
    assert_eq!(call("atan2(norm([1, 2]), ‸)"), is("atan2", Some(1)));
    assert_eq!(call("polygonize(f, cell = ‸)"), is("polygonize", Some(2)));
    assert_eq!(call("f.polygonize(‸)"), is("polygonize", Some(1)));
    assert_eq!(call("ease.in_quad(‸)"), is("in_quad", Some(0)));
    assert_eq!(call("fn own(a, b) = a\nown(1, ‸"), is("own", Some(1)));
    assert_eq!(call("max(1, 2, 3, ‸)"), is("max", Some(0)));
    assert_eq!(call("(1 + ‸)"), None);
    assert_eq!(call("atan2(1, 2)‸"), None);
}
