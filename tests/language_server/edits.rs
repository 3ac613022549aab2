//! Changes that the server proposes.

use serde_json::{Value as Json, json};

use crate::client::{Client, at, position, uri};

/// A text after some edits, which do not overlap.
fn edited(text: &str, edits: &Json) -> String {
    let offset = |place: &Json| {
        let line = place["line"].as_u64().expect("a line") as usize;
        let column = place["character"].as_u64().expect("a column") as usize;
        let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
        let units = text[start..]
            .char_indices()
            .scan(0, |units, (byte, letter)| {
                let before = *units;
                *units += letter.len_utf16();
                Some((before, byte))
            });
        let mut units = units.chain([(usize::MAX, text.len() - start)]);
        let found = units.find(|&(units, _)| units >= column);
        start + found.expect("a place").1
    };
    let edits = edits.as_array().expect("edits").iter();
    let mut edits: Vec<(usize, usize, &str)> = edits
        .map(|edit| {
            let range = &edit["range"];
            let new = edit["newText"].as_str().expect("a text");
            (offset(&range["start"]), offset(&range["end"]), new)
        })
        .collect();
    edits.sort_unstable();
    let mut text = text.to_owned();
    for (start, end, new) in edits.into_iter().rev() {
        text.replace_range(start..end, new);
    }
    text
}

#[test]
fn names_are_changed_in_open_files_and_on_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().canonicalize().expect("a path");
    let part = "param size = 1\nfn grown(times) = size * times\n";
    let main = "import \"part.imp\" as part\n# 🙂\nlet s = \"🙂{part.size}\"\nlet t = part.grown(times = 2)\n";
    let user = "import \"part.imp\" as p\nlet s = p.size\n";
    for (name, text) in [("part.imp", part), ("main.imp", main), ("user.imp", user)] {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    let address = |name: &str| uri(&folder.join(name));
    let mut client = Client::ready();
    client.open(&address("main.imp"), main);
    let mut rename = |text: &str, file: &str, part: &str, delta: usize, new: &str| {
        let mut asked = at(&address(file), text, part, delta);
        asked["newName"] = json!(new);
        client.request("textDocument/rename", asked)["changes"].clone()
    };
    let changes = rename(main, "main.imp", "part.size", 7, "extent_of_it");
    let after = |name: &str, text: &str| edited(text, &changes[address(name).as_str()]);
    assert_eq!(
        after("part.imp", part),
        "param extent_of_it = 1\nfn grown(times) = extent_of_it * times\n"
    );
    assert_eq!(
        after("main.imp", main),
        main.replace("part.size", "part.extent_of_it")
    );
    assert_eq!(
        after("user.imp", user),
        user.replace("p.size", "p.extent_of_it")
    );
    // The name of a module belongs to the file that imports it.
    let changes = rename(main, "main.imp", "part.grown", 1, "bolt");
    assert_eq!(changes.as_object().map(|files| files.len()), Some(1));
    assert_eq!(
        edited(main, &changes[address("main.imp").as_str()]),
        main.replace("as part", "as bolt")
            .replace("part.size", "bolt.size")
            .replace("part.grown", "bolt.grown")
    );
    let changes = rename(main, "main.imp", "times = 2", 1, "factor");
    assert_eq!(
        edited(part, &changes[address("part.imp").as_str()]),
        "param size = 1\nfn grown(factor) = size * factor\n"
    );
    assert_eq!(
        edited(main, &changes[address("main.imp").as_str()]),
        main.replace("times = 2", "factor = 2")
    );
    assert_eq!(client.finish(), 0);
}

#[test]
fn programs_are_formatted_and_broken_ones_are_left_alone() {
    const URI: &str = "untitled:style";
    let text = "let  a=[1,2 ,3]  # 🙂 three\n\n\n\nfield ball(p in R3)=norm(p)-1\n";
    let styled = "let a = [1, 2, 3] # 🙂 three\n\nfield ball(p in R3) = norm(p) - 1\n";
    let asked = json!({
        "textDocument": {"uri": URI},
        "options": {"tabSize": 4, "insertSpaces": true},
    });
    let mut client = Client::ready();
    client.open(URI, text);
    let edits = client.request("textDocument/formatting", asked.clone());
    assert_eq!(edited(text, &edits), styled);
    client.change(URI, 2, json!([{"text": styled}]));
    let edits = client.request("textDocument/formatting", asked.clone());
    assert_eq!(edits, json!([]));
    client.change(URI, 3, json!([{"text": "let a = [1,,"}]));
    assert!(client.request("textDocument/formatting", asked).is_null());
    assert_eq!(client.finish(), 0);
}

#[test]
fn names_that_cannot_be_changed_are_refused() {
    const URI: &str = "untitled:names";
    let text = "let one = sin(1)\nlet two = one\n";
    let mut client = Client::ready();
    client.open(URI, text);
    let found = client.request("textDocument/prepareRename", at(URI, text, "= one", 3));
    assert_eq!(found["start"], position(text, "= one", 2));
    for (part, reason) in [
        ("sin", "`sin` belongs to the language"),
        ("let", "no name that a file defines"),
    ] {
        let (code, message) = client.refused("textDocument/prepareRename", at(URI, text, part, 1));
        assert_eq!(code, -32803);
        assert!(message.contains(reason), "{message}");
    }
    for (new, reason) in [
        ("two", "bound already, in line 2"),
        ("while", "a word of the language"),
        ("2a", "not a name"),
        ("sphere", "a name of the language"),
    ] {
        let mut asked = at(URI, text, "one", 1);
        asked["newName"] = json!(new);
        let (code, message) = client.refused("textDocument/rename", asked);
        assert_eq!(code, -32803);
        assert!(message.contains(reason), "{message}");
    }
    assert_eq!(client.finish(), 0);
}

#[test]
fn a_misspelt_name_can_be_put_right() {
    const URI: &str = "untitled:misspelt";
    let text = "let radius = 1\nlet a = \"🙂{radios}\"\n";
    let mut client = Client::ready();
    client.open(URI, text);
    assert_eq!(client.diagnostics(URI, 1).len(), 1);
    let place = position(text, "radios", 2);
    let asked = json!({
        "textDocument": { "uri": URI },
        "range": { "start": place, "end": place },
        "context": { "diagnostics": [] },
    });
    let actions = client.request("textDocument/codeAction", asked);
    assert_eq!(actions.as_array().map(Vec::len), Some(1));
    let edits = &actions[0]["edit"]["changes"][URI];
    assert_eq!(edited(text, edits), text.replace("radios", "radius"));
    assert_eq!(client.finish(), 0);
}
