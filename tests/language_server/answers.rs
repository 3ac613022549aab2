//! What the server knows of texts.

use serde_json::{Value as Json, json};

use crate::client::{Client, at, position, uri};

const URI: &str = "untitled:scene";

const SCENE: &str = "\
## How large it is.
param radius = 1.5 in 0.5..2
setting count = 3 in 1..9
let side = 2 * count
## A ball.
field ball(p in R3) over -3..3 = norm(p) - radius
fn twice(value, times = 2) = times * value
let eased = ease.in_quad(0.5)
let four = twice(side, times = 1)
test \"it is small\" { assert(side < 10) }
";

fn open(text: &str) -> Client {
    let mut client = Client::ready();
    client.open(URI, text);
    client
}

fn codes(diagnostics: &[Json]) -> Vec<&str> {
    diagnostics
        .iter()
        .map(|one| one["code"].as_str().expect("a code"))
        .collect()
}

fn labels(completions: &Json) -> Vec<String> {
    let items = completions["items"].as_array().expect("items");
    let label = |item: &Json| item["label"].as_str().expect("a label").to_owned();
    items.iter().map(label).collect()
}

#[test]
fn texts_are_checked_while_they_are_written() {
    let mut client = open(SCENE);
    assert_eq!(client.diagnostics(URI, 1), Vec::<Json>::new());
    let whole = |text: &str| json!([{ "text": text }]);

    client.change(URI, 2, whole("let a = sqroot(2)\n"));
    let found = client.diagnostics(URI, 2);
    assert_eq!(codes(&found), ["E0201"]);
    let message = found[0]["message"].as_str().expect("a message");
    assert!(message.contains("there is no `sqroot` here"), "{message}");
    assert!(message.contains("did you mean"), "{message}");
    let range =
        json!({ "start": position("let a = s", "s", 0), "end": { "line": 0, "character": 14 } });
    assert_eq!(found[0]["range"], range);
    assert_eq!(found[0]["severity"], 1);

    client.change(URI, 3, whole("let a = (1 +\nlet b = 2"));
    assert!(!client.diagnostics(URI, 3).is_empty());
    client.change(URI, 4, whole("let a = [1, 2] + [1, 2, 3]\n"));
    assert_eq!(codes(&client.diagnostics(URI, 4)), ["E0302"]);
    client.change(URI, 5, whole("let a = 1\nlet a = 2\n"));
    let found = client.diagnostics(URI, 5);
    assert_eq!(codes(&found), ["E0202"]);
    let other = &found[0]["relatedInformation"][0];
    assert_eq!(other["location"]["range"]["start"]["line"], 0);
    client.change(URI, 6, whole("param unused = 1\n"));
    let found = client.diagnostics(URI, 6);
    assert_eq!(codes(&found), ["W0807"]);
    assert_eq!(
        (&found[0]["severity"], &found[0]["tags"]),
        (&json!(2), &json!([1]))
    );
    client.notify(
        "textDocument/didClose",
        json!({ "textDocument": { "uri": URI } }),
    );
    assert_eq!(client.finish(), 0);
}

#[test]
fn changes_count_units_of_utf_16() {
    let mut client = open("let s = \"🙂é\" # 🙂\nlet b = c\n");
    assert_eq!(codes(&client.diagnostics(URI, 1)), ["E0201"]);
    let range = |line: u32, start: u32, end: u32| {
        json!({
            "start": { "line": line, "character": start },
            "end": { "line": line, "character": end },
        })
    };
    // Behind the emoji, which are two units each; then the name that is not known.
    let changes = json!([
        { "range": range(0, 12, 13), "text": "\" + \"x\"" },
        { "range": range(1, 8, 9), "text": "s" },
    ]);
    client.change(URI, 2, changes);
    let found = client.diagnostics(URI, 2);
    // A sum of strings is not in the language: the first line now has one.
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0]["range"]["start"]["line"], 0);
    client.change(URI, 3, json!([{ "range": range(0, 12, 19), "text": "\"" }]));
    assert_eq!(client.diagnostics(URI, 3), Vec::<Json>::new());
    // Positions outside of the text are moved inside.
    client.change(
        URI,
        4,
        json!([{ "range": range(99, 7, 9), "text": "let d = 1\nbad" }]),
    );
    let found = client.diagnostics(URI, 4);
    assert_eq!(
        found[0]["range"]["start"],
        json!({ "line": 3, "character": 0 })
    );
    assert_eq!(client.finish(), 0);
}

#[test]
fn other_encodings_are_used_where_they_are_offered() {
    let mut client = Client::start();
    let general = json!({ "positionEncodings": ["utf-8", "utf-16"] });
    let result = client.request(
        "initialize",
        json!({ "capabilities": { "general": general } }),
    );
    assert_eq!(result["capabilities"]["positionEncoding"], "utf-8");
    client.open(URI, "let s = \"🙂\" + nope\n");
    let found = client.diagnostics(URI, 1);
    assert_eq!(found[0]["range"]["start"]["character"], 17);
    assert_eq!(client.finish(), 0);
}

#[test]
fn hovering_tells_signatures_values_and_documentation() {
    let mut client = open(SCENE);
    client.diagnostics(URI, 1);
    let mut hover = |part: &str, delta: usize| {
        let found = client.request("textDocument/hover", at(URI, SCENE, part, delta));
        found["contents"]["value"].as_str().unwrap_or("").to_owned()
    };
    assert_eq!(hover("How large", 1), "");
    let shown = hover("- radius", 2);
    for part in [
        "param radius = 1.5 in 0.5..2",
        "a number = 1.5",
        "How large it is.",
    ] {
        assert!(shown.contains(part), "{shown}");
    }
    let shown = hover("side, times", 1);
    assert!(shown.contains("let side = 2 * count"), "{shown}");
    assert!(shown.contains("a number = 6"), "{shown}");
    let shown = hover("ball(", 0);
    assert!(
        shown.contains("A ball.") && shown.contains("a field in R3"),
        "{shown}"
    );
    assert!(shown.contains("-3..3"), "{shown}");
    let shown = hover("twice(side", 0);
    assert!(shown.contains("fn twice(value, times = 2)"), "{shown}");
    let shown = hover("* value", 3);
    assert!(shown.contains("a parameter of the function"), "{shown}");
    let shown = hover("norm(p)", 1);
    assert!(shown.contains("norm("), "{shown}");
    let shown = hover("in_quad", 1);
    assert!(shown.contains("ease.in_quad("), "{shown}");
    assert_eq!(hover("= 1.5", 0), "");
    assert_eq!(client.finish(), 0);
}

#[test]
fn completions_know_their_place() {
    let text = format!("{SCENE}let m = ball.polygonize(ce\nlet z = \n");
    let mut client = open(&text);
    let mut complete = |part: &str, delta: usize| {
        client.request("textDocument/completion", at(URI, &text, part, delta))
    };
    let found = complete("(ce", 3);
    assert_eq!(labels(&found)[0], "cell =");
    let edit = &found["items"][0]["textEdit"];
    assert_eq!(edit["newText"], "cell =");
    assert_eq!(edit["range"]["start"], position(&text, "ce\n", 0));
    let found = complete("let z = ", 8);
    let all = labels(&found);
    for name in [
        "side",
        "ball",
        "twice",
        "radius",
        "sphere",
        "polygonize",
        "pi",
    ] {
        assert!(all.iter().any(|label| label == name), "{name}");
    }
    let items = found["items"].as_array().expect("items");
    let item = items.iter().find(|item| item["label"] == "sphere");
    let item = item.expect("sphere").clone();
    assert!(item.get("documentation").is_none());
    let item = client.request("completionItem/resolve", item);
    let text = item["documentation"]["value"].as_str().expect("a text");
    assert!(text.contains("sphere("), "{text}");
    assert_eq!(client.finish(), 0);
}

#[test]
fn signatures_show_the_argument_that_is_being_written() {
    let text = format!("{SCENE}let q = twice(1, ");
    let mut client = open(&text);
    let found = client.request("textDocument/signatureHelp", at(URI, &text, "twice(1, ", 9));
    let signature = &found["signatures"][0];
    assert_eq!(signature["label"], "twice(value, times = 2)");
    assert_eq!(found["activeParameter"], 1);
    assert_eq!(signature["parameters"][1]["label"], json!([13, 22]));
    // What comes through a pipe is the first argument.
    let piped = format!("{SCENE}let q = 3 |> twice(");
    client.change(URI, 2, json!([{ "text": piped }]));
    let found = client.request("textDocument/signatureHelp", at(URI, &piped, "> twice(", 8));
    assert_eq!(found["activeParameter"], 1);
    client.change(URI, 3, json!([{ "text": text }]));
    let found = client.request("textDocument/signatureHelp", at(URI, &text, "let side", 2));
    assert_eq!(found, Json::Null);
    assert_eq!(client.finish(), 0);
}

#[test]
fn symbols_folds_and_colours_follow_the_text() {
    let text =
        "# one\n# two\n🙂\nfn f(a) {\n    a\n}\nlet [b, c] = [1, 2]\ntest \"t\" { assert(true) }\n";
    let mut client = open(text);
    let document = json!({ "textDocument": { "uri": URI } });
    let symbols = client.request("textDocument/documentSymbol", document.clone());
    let names: Vec<&str> = symbols
        .as_array()
        .expect("symbols")
        .iter()
        .map(|symbol| symbol["name"].as_str().expect("a name"))
        .collect();
    assert_eq!(names, ["f", "b", "c", "t"]);
    let folds = client.request("textDocument/foldingRange", document.clone());
    let lines = |fold: &Json| (fold["startLine"].as_u64(), fold["endLine"].as_u64());
    let folds: Vec<_> = folds.as_array().expect("folds").iter().map(lines).collect();
    assert_eq!(folds, [(Some(0), Some(1)), (Some(3), Some(4))]);
    let tokens = client.request("textDocument/semanticTokens/full", document);
    let data = tokens["data"].as_array().expect("numbers");
    assert_eq!(data.len() % 5, 0);
    // A comment of five letters in each of the first lines; then `fn`, three lines further on.
    let numbers: Vec<u64> = data.iter().filter_map(Json::as_u64).collect();
    assert_eq!(numbers[..3], [0, 0, 5]);
    assert_eq!(numbers[5..8], [1, 0, 5]);
    assert_eq!(numbers[10..13], [2, 0, 2]);
    let range = json!({
        "textDocument": { "uri": URI },
        "range": { "start": { "line": 4, "character": 0 }, "end": { "line": 5, "character": 0 } },
    });
    let tokens = client.request("textDocument/semanticTokens/range", range);
    assert_eq!(tokens["data"].as_array().map(Vec::len), Some(5));
    assert_eq!(client.finish(), 0);
}

#[test]
fn definitions_lead_into_imported_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().canonicalize().expect("a path");
    let part = "## Of the part.\nparam size = 1 in 0..2\nfield knob(p in R3) = norm(p) - size\n";
    std::fs::write(folder.join("a part.imp"), part).expect("a file");
    let text = "import \"a part.imp\" as part\nlet s = part.size\nlet k = part.knob with {part.size = 2}\n";
    let main = uri(&folder.join("main.imp"));
    let mut client = Client::ready();
    client.open(&main, text);
    assert_eq!(client.diagnostics(&main, 1), Vec::<Json>::new());
    let found = client.request("textDocument/definition", at(&main, text, "part.size", 6));
    let part_uri = uri(&folder.join("a%20part.imp"));
    assert_eq!(found["uri"], part_uri.as_str());
    assert_eq!(
        found["range"]["start"],
        json!({ "line": 1, "character": 6 })
    );
    let found = client.request("textDocument/definition", at(&main, text, "a part.imp", 3));
    assert_eq!(found["uri"], part_uri.as_str());
    let shown = client.request("textDocument/hover", at(&main, text, "part.size", 6));
    let shown = shown["contents"]["value"].as_str().expect("a text");
    assert!(
        shown.contains("Of the part.") && shown.contains("a number = 1"),
        "{shown}"
    );
    let mut asked = at(&main, text, "part.size", 6);
    asked["context"] = json!({ "includeDeclaration": true });
    let found = client.request("textDocument/references", asked.clone());
    assert_eq!(found.as_array().map(Vec::len), Some(4));
    asked["context"] = json!({ "includeDeclaration": false });
    let found = client.request("textDocument/references", asked);
    assert_eq!(found.as_array().map(Vec::len), Some(3));
    let found = client.request(
        "textDocument/documentHighlight",
        at(&main, text, "part.size", 6),
    );
    assert_eq!(found.as_array().map(Vec::len), Some(2));
    let found = client.request("textDocument/completion", at(&main, text, "part.knob", 5));
    assert_eq!(labels(&found), ["size", "knob"]);

    // The text in the editor counts, not the one on disk, and its users are checked again.
    client.open(&part_uri, part);
    client.diagnostics(&part_uri, 1);
    let from = at(&part_uri, part, "size =", 0);
    assert_eq!(from["position"]["line"], 1);
    client.change(&part_uri, 2, json!([{ "text": "param other = 1\n" }]));
    loop {
        let found = client.diagnostics(&main, 1);
        if !found.is_empty() {
            assert_eq!(codes(&found), ["E0206"], "{found:?}");
            break;
        }
    }
    client.change(&part_uri, 3, json!([{ "text": "param size = (\n" }]));
    let found = client.diagnostics(&main, 1);
    let message = found[0]["message"].as_str().expect("a message");
    assert!(
        message.starts_with("in ") && message.contains("a part.imp"),
        "{message}"
    );
    assert_eq!(client.finish(), 0);
}

/// What is completed in strings is what the functions themselves name when they are given
/// something else.
#[test]
fn strings_that_are_completed_are_those_that_functions_take() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wrong.imp");
    for (function, parameter, call) in [
        ("polygonize", "method", "polygonize(f, method = \"?\")"),
        (
            "sample",
            "method",
            "sample(f, method = \"?\", bounds = -2..2)",
        ),
        ("plot", "style", "plot(f, style = \"?\", bounds = -2..2)"),
        (
            "thin",
            "keep",
            "thin(sample(f, count = 10, bounds = -2..2), 0.1, keep = \"?\")",
        ),
    ] {
        let text = format!("field f(x, y) = x^2 + y^2 - 1\nlet a = {call}\n");
        std::fs::write(&file, text).expect("a file");
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_imp"))
            .args(["run", "--json"])
            .arg(&file)
            .output()
            .expect("an output");
        let result: Json = serde_json::from_slice(&output.stdout).expect("an error as JSON");
        let message = result["error"]["message"].as_str().expect("a message");
        let quoted = message.split('"').skip(1).step_by(2);
        let mut named: Vec<&str> = quoted.filter(|word| *word != "?").collect();
        named.sort_unstable();
        let function = imp::language::builtin::find(function).expect("a function");
        let mut known = imp::language::builtin::choices(function, parameter);
        known.sort_unstable();
        assert_eq!(named, known, "{message}");
    }
}

#[test]
fn many_edits_of_one_message_follow_each_other() {
    let mut client = Client::ready();
    client.open(URI, "let a = 1\n");
    let start = json!({ "line": 0, "character": 0 });
    let mut changes = Vec::new();
    for number in 0..1_000 {
        // A line at the beginning, and another end for what has become the second.
        let new = format!("let a_{number} = {number}\r\n");
        changes.push(json!({ "range": { "start": start, "end": start }, "text": new }));
        let end = json!({ "line": 1, "character": 99 });
        changes.push(json!({ "range": { "start": end, "end": end }, "text": " + 1" }));
    }
    let place = json!({ "line": 1_000, "character": 4 });
    let end = json!({ "line": 1_000, "character": 5 });
    changes.push(json!({ "range": { "start": place, "end": end }, "text": "last" }));
    client.change(URI, 2, json!(changes));
    let asked = json!({ "textDocument": { "uri": URI }, "position": place });
    let found = client.request("textDocument/hover", asked);
    let shown = found["contents"]["value"].as_str().expect("a text");
    assert!(shown.contains("let last = 1 + 1\n"), "{shown}");
    assert_eq!(client.diagnostics(URI, 2), Vec::<Json>::new());
    assert_eq!(client.finish(), 0);
}

#[test]
fn completions_replace_what_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("part.imp"), "let a = 1\n").expect("a file");
    let address = uri(&folder.path().join("main.imp"));
    let text = "import \"pa.imp\" as p\nfn twice(times) = times\nlet b = twice(ti = 2)\n";
    let mut client = Client::ready();
    client.open(&address, text);
    let mut asked = |part: &str, delta: usize, label: &str| {
        let found = client.request("textDocument/completion", at(&address, text, part, delta));
        let items = found["items"].as_array().expect("items").clone();
        let item = items.into_iter().find(|item| item["label"] == label);
        item.expect("the completion")["textEdit"].clone()
    };
    let edit = asked("pa.imp", 2, "part.imp");
    assert_eq!(edit["range"]["start"], position(text, "pa.imp", 0));
    assert_eq!(edit["range"]["end"], position(text, "pa.imp", 6));
    assert_eq!(edit["newText"], "part.imp");
    // The sign of a named argument is not written twice.
    assert_eq!(asked("ti = 2", 2, "times")["newText"], "times");
    assert_eq!(client.finish(), 0);
}
