//! Other names leave the meaning of a program as it is, or they are refused.

use serde_json::json;

use crate::client::{Client, at, uri};

/// Asks for another name for what stands at `‸` in the first text, which is `main.imp`; the others
/// lie beside it. Tells how many places would change, or why none may.
fn rename(new: &str, files: &[(&str, &str)]) -> Result<usize, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().canonicalize().expect("a path");
    for (name, text) in files {
        std::fs::write(folder.join(name), text.replace('‸', "")).expect("a file");
    }
    let (name, marked) = files[0];
    let text = marked.replace('‸', "");
    let offset = marked.find('‸').expect("a mark");
    let address = uri(&folder.join(name));
    let mut client = Client::ready();
    client.open(&address, &text);
    let mut asked = at(&address, &text, &text[offset..], 0);
    asked["newName"] = json!(new);
    let answer = client.ask("textDocument/rename", asked);
    assert_eq!(client.finish(), 0);
    match answer["error"]["message"].as_str() {
        Some(reason) => Err(reason.to_owned()),
        None => {
            let files = answer["result"]["changes"].as_object().expect("changes");
            let edits = files
                .values()
                .map(|edits| edits.as_array().map_or(0, Vec::len));
            Ok(edits.sum())
        }
    }
}

#[test]
fn names_that_would_mean_something_else_are_not_given() {
    for (text, new, reason) in [
        (
            "print([{let b = 10; a + b} for ‸a in [1, 2]])",
            "b",
            "line 1 of main.imp",
        ),
        (
            "let a = 1\nfn f() { let ‸k = () -> a; let a = 5; k() }\nprint(f())",
            "a",
            "`a` is bound already",
        ),
        (
            "let ‸a = 1\nfn f() { let k = () -> a; let a = 5; k() }\nprint(f())",
            "c",
            "line 2 of main.imp",
        ),
        (
            "fn h() = 1\nfn f(x) { fn g() = h(); let ‸h = () -> 7; g() }",
            "c",
            "line 2 of main.imp",
        ),
        (
            "let f = (‸a, b) -> a - b\nprint(f(b = 1, a = 5))",
            "c",
            "line 2 of main.imp",
        ),
        (
            "fn f(‸a) = a\nlet g = f\nprint(g(a = 5))",
            "c",
            "line 3 of main.imp",
        ),
        (
            "fn ‸foo(l) = 1\nprint([1, 2].foo())",
            "length",
            "is a name of the language",
        ),
        ("fn ‸foo(l) = 1\nprint([1, 2].foo())", "xy", "line 2"),
        ("let ‸a = 1\nlet b = (", "c", "main.imp has syntax errors"),
        ("let ‸a = 1", "R2", "`R2` is a space"),
    ] {
        let found = rename(new, &[("main.imp", text)]);
        let given = found.expect_err(text);
        assert!(given.contains(reason), "{text}: {given}");
    }
}

#[test]
fn names_of_other_files_are_found_or_refused() {
    let part = "param ‸r = 1\nfn f(a) = a + r\n";
    let user = |text: &'static str| rename("other", &[("part.imp", part), ("user.imp", text)]);
    let early = "let v = m.r\nlet g = 1 + m.r\nimport \"part.imp\" as m";
    assert_eq!(user(early), Ok(4));
    for text in [
        "import \"part.imp\" as m\nlet k = m\nlet v = k.r",
        "import \"part.imp\" as m\nlet v = m with {m . r = 2}",
    ] {
        let given = user(text).expect_err(text);
        assert!(given.contains("of user.imp"), "{text}: {given}");
    }
    let far = [
        ("part.imp", part),
        ("middle.imp", "import \"part.imp\" as n"),
        ("user.imp", "import \"middle.imp\" as m\nlet v = m.n.r"),
    ];
    let given = rename("other", &far).expect_err("a reason");
    assert!(given.contains("line 2 of user.imp"), "{given}");
}

#[test]
fn what_is_certain_is_renamed() {
    for (text, new, count) in [
        ("fn f(a = {let t = 1; t}, ‸b = 2) = a - b\nf(b = 5)", "c", 3),
        ("let ‸a = 1\nprint(a)", "a", 0),
        ("fn ‸foo(l) = 1\nprint([1, 2].foo())", "bar", 2),
        ("fn f(‸cell) = cell\nprint(f(cell = 1))", "width", 3),
    ] {
        assert_eq!(rename(new, &[("main.imp", text)]), Ok(count), "{text}");
    }
}
