//! Names are told apart, and the uncertain ones are known as such.

use super::*;

/// The places of what stands at the first `‸`, and those that are marked with it.
fn check(marked: &str) {
    let text: String = marked.replace('‸', "");
    let mut expected = Vec::new();
    let mut gone = 0;
    for (place, _) in marked.match_indices('‸') {
        expected.push(place - gone);
        gone += '‸'.len_utf8();
    }
    let index = Index::of_text(&text);
    let found = index.at(expected[0]).expect("a name");
    let places: Vec<usize> = index
        .places(&found.target)
        .map(|place| place.start)
        .collect();
    assert_eq!(places, expected, "{marked}");
}

#[test]
fn names_are_told_apart_by_their_scopes() {
    check("let ‸a = 1\nfn f(a) = a\nlet b = ‸a + f(‸a)");
    check("let a = 1\nfn f(‸a) = ‸a\nlet b = a + f(‸a = a)");
    check("param ‸r = 1\nfield f(x, y) = x - ‸r\nlet g = f with {‸r = 2}");
    check(
        "fn f(x) = later(x)\nfn ‸later(x) = x\nlet a = later(1)"
            .replacen("later(x)\n", "‸later(x)\n", 1)
            .replacen("= later(1)", "= ‸later(1)", 1)
            .as_str(),
    );
    check("let l = [‸i + j for ‸i in range(3) for j in range(‸i)]\nlet i = 1");
    check(
        "fn ‸twice(a) = 2 * a\nlet b = 3.‸twice()"
            .replace("3.", "(3).")
            .as_str(),
    );
    check("field f(‸x, y) = ‸x + y\nfield g(x, y) = x");
    check("fn f(a) {\n    let ‸t = a\n    ‸t + 1\n}\nlet t = 1\nprint(\"{t}\")");
}

#[test]
fn only_its_own_parameters_are_a_functions_arguments() {
    let index = Index::of_text("fn f(a, b = t -> t, c = 1) = (u -> v -> a + u * v + c)");
    let arguments = index.bindings[0].arguments.iter();
    let names: Vec<&str> = arguments
        .map(|&place| &*index.bindings[place].name)
        .collect();
    assert_eq!(names, ["a", "b", "c"]);
}

#[test]
fn names_of_the_language_are_found() {
    let text = "let a = ease.in_quad(0.5) + sin(1)";
    let index = Index::of_text(text);
    let target = |part: &str| {
        let place = text.find(part).expect("a part");
        index.at(place).map(|found| found.target.clone())
    };
    assert_eq!(
        target("in_quad"),
        Some(Target::Language("ease.in_quad".into()))
    );
    assert_eq!(target("sin"), Some(Target::Language("sin".into())));
    assert_eq!(target("0.5"), None);
}

#[test]
fn members_of_modules_are_found() {
    let text = "import \"b.imp\" as b\nlet a = b.head(size = 1) with {b.width = 2}";
    let index = Index::of_text(text);
    let at = |part: &str| {
        let place = text.rfind(part).expect("a part");
        index.at(place).map(|found| found.target.clone())
    };
    assert_eq!(at("head"), Some(Target::Member(0, "head".into())));
    assert_eq!(at("width"), Some(Target::Member(0, "width".into())));
    assert_eq!(at("b.width"), Some(Target::Own(0)));
    let argument = Target::MemberArgument(0, "head".into(), "size".into());
    assert_eq!(at("size"), Some(argument));
    assert_eq!(index.imports.len(), 1);
}

#[test]
fn broken_texts_have_an_index() {
    let text = "let a = 1\nlet b = (a +\nfn f(x = \nlet c = a";
    let index = Index::of_text(text);
    let found = index.at(4).expect("the name a");
    assert!(index.places(&found.target).count() >= 2);
}

#[test]
fn statements_in_defaults_do_not_end_the_parameters() {
    check("fn f(a = {let t = 1; t}, ‸b = 2) = a - ‸b\nlet c = f(‸b = 5)");
}

#[test]
fn modules_are_known_before_they_are_imported() {
    let text = "let a = b.head(size = 1) with {b.width = 2}\nimport \"b.imp\" as b";
    let index = Index::of_text(text);
    // The second of the names that are bound, after `a`.
    let module = 1;
    let at = |part: &str| {
        let place = text.find(part).expect("a part");
        index.at(place).map(|found| found.target.clone())
    };
    assert_eq!(at("head"), Some(Target::Member(module, "head".into())));
    assert_eq!(at("width"), Some(Target::Member(module, "width".into())));
    let argument = Target::MemberArgument(module, "head".into(), "size".into());
    assert_eq!(at("size"), Some(argument));
}
