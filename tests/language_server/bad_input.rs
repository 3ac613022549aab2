//! Clients that do not keep to the protocol: they get an error, or the server ends.

use serde_json::{Value as Json, json};

use crate::client::{Client, at};

const URI: &str = "untitled:bad";

fn frame(body: &str) -> Vec<u8> {
    format!("Content-Length: {}\r\n\r\n{body}", body.len()).into_bytes()
}

#[test]
fn the_conversation_has_a_beginning_and_an_end() {
    let mut client = Client::start();
    let (code, _) = client.refused("textDocument/hover", at(URI, "a", "a", 0));
    assert_eq!(code, -32002);
    client.open(URI, "let a = nope");
    client.request("initialize", json!({ "capabilities": {} }));
    let (code, _) = client.refused("initialize", json!({ "capabilities": {} }));
    assert_eq!(code, -32600);
    client.request("shutdown", Json::Null);
    let (code, _) = client.refused("textDocument/hover", at(URI, "a", "a", 0));
    assert_eq!(code, -32600);
    client.notify("exit", Json::Null);
    let (code, errors) = client.wait();
    assert_eq!((code, &*errors), (0, ""));

    let mut client = Client::ready();
    client.notify("exit", Json::Null);
    assert_eq!(client.wait(), (1, String::new()));
    assert_eq!(Client::ready().wait(), (1, String::new()));
    assert_eq!(Client::start().wait(), (1, String::new()));
}

#[test]
fn what_is_no_message_is_answered_with_an_error() {
    let mut client = Client::ready();
    for (body, code) in [
        ("{]", -32700),
        ("", -32700),
        ("\u{0}", -32700),
        ("[]", -32600),
        ("7", -32600),
        ("{\"jsonrpc\":\"2.0\"}", -32600),
        (&*"[".repeat(100_000), -32700),
    ] {
        client.send_raw(&frame(body));
        let answer = client.message().expect("an answer");
        assert_eq!(answer["error"]["code"], code, "{body:.20}");
        assert_eq!(answer["id"], Json::Null);
    }
    client.send_raw(b"Content-Length: 2\r\n\r\n\xff\xfe");
    let answer = client.message().expect("an answer");
    assert_eq!(answer["error"]["code"], -32700);
    // An identifier that is a number but none of ours is given back.
    client.send(&json!({ "id": 1.5, "method": "textDocument/hover" }));
    let answer = client.message().expect("an answer");
    assert_eq!(
        (&answer["error"]["code"], &answer["id"]),
        (&json!(-32600), &json!(1.5))
    );
    assert_eq!(client.finish(), 0);
}

#[test]
fn a_broken_stream_is_a_clean_end() {
    for bytes in [
        "Content-Length: 100\r\n\r\n{\"jsonrpc\":",
        "Content-Length: 100\r\n",
        "Content-Length: 999999999999\r\n\r\n{}",
        "Content-Length: x\r\n\r\n{}",
        "Content-Type: x\r\n\r\n{}",
        "GET / HTTP/1.1\r\n\r\n",
        // Too short by one: what is left is no header.
        "Content-Length: 1\r\n\r\n{}\r\n\r\n",
    ] {
        let mut client = Client::ready();
        client.send_raw(bytes.as_bytes());
        let (code, errors) = client.wait();
        assert_eq!(code, 1, "{bytes}");
        assert!(
            errors.starts_with("error: cannot read a message: "),
            "{errors}"
        );
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let mut client = Client::ready();
    let (code, message) = client.refused("textDocument/nonsense", Json::Null);
    assert_eq!(code, -32601);
    assert!(message.contains("nonsense"));
    for params in [
        Json::Null,
        json!([]),
        json!({ "textDocument": 7 }),
        json!({ "textDocument": { "uri": URI }, "position": { "line": -1, "character": 0 } }),
        json!({ "textDocument": { "uri": "\u{0}" }, "position": { "line": 0, "character": 0 } }),
        at("file:///not/open.imp", "a", "a", 0),
    ] {
        let (code, _) = client.refused("textDocument/hover", params);
        assert_eq!(code, -32602);
    }
    // Notifications are not answered; the client may log what was wrong with them.
    client.notify("textDocument/nonsense", json!({}));
    client.notify("$/cancelRequest", json!({ "id": 1 }));
    for (method, params) in [
        ("textDocument/didOpen", json!({})),
        (
            "textDocument/didChange",
            json!({ "textDocument": { "uri": URI, "version": 2 }, "contentChanges": [{ "text": "" }] }),
        ),
        (
            "textDocument/didClose",
            json!({ "textDocument": { "uri": URI } }),
        ),
    ] {
        client.notify(method, params);
        let said = client.message().expect("a message");
        assert_eq!(said["method"], "window/logMessage", "{method}");
    }
    assert_eq!(client.finish(), 0);
}

#[test]
fn places_outside_of_the_text_are_no_danger() {
    let text = "let a = \"🙂\n";
    let mut client = Client::ready();
    client.open(URI, text);
    client.diagnostics(URI, 1);
    for (line, character) in [
        (0, 9),
        (0, 10),
        (0, 9_999),
        (9_999, 0),
        (u32::MAX, u32::MAX),
    ] {
        let place = json!({ "line": line, "character": character });
        let params = json!({
            "textDocument": { "uri": URI },
            "position": place,
            "range": { "start": place, "end": { "line": 0, "character": 0 } },
        });
        for method in [
            "hover",
            "definition",
            "references",
            "documentHighlight",
            "completion",
            "signatureHelp",
            "codeAction",
            "semanticTokens/range",
        ] {
            let mut params = params.clone();
            if matches!(method, "references" | "codeAction") {
                params["context"] = json!({ "includeDeclaration": true, "diagnostics": [] });
            }
            client.request(&format!("textDocument/{method}"), params);
        }
    }
    assert_eq!(client.finish(), 0);
}

/// A text that takes long, one that would take all memory, and one whose values would be dropped
/// one inside the other: all are given up, and requests are answered meanwhile.
#[test]
fn no_text_stops_the_server() {
    let mut client = Client::ready();
    let texts = [
        "let a = sum(sin(i + j) for i in range(100000) for j in range(100000))\n",
        "var a = [1]\nwhile true { a = [a, a] }\n",
        "var f = x -> x\nfor i in range(150000) {\n    let g = f\n    f = x -> g(x)\n}\n",
        "fn f(x) = f(x) + 1\nlet a = f(1)\n",
        "var a = \"x\"\nwhile true { a = \"{a}{a}\" }\n",
        "let z = 1\nlet a = z.\n",
    ];
    let mut version = 1;
    client.open(URI, "let z = 1\n");
    for text in texts {
        version += 1;
        client.change(URI, version, json!([{ "text": text }]));
        let found = client.request("textDocument/hover", at(URI, text, "a", 0));
        assert!(found.is_null() || found.is_object());
        client.diagnostics(URI, version);
    }
    version += 1;
    client.change(URI, version, json!([{ "text": "let a = nope\n" }]));
    assert_eq!(client.diagnostics(URI, version).len(), 1);
    assert_eq!(client.finish(), 0);
}

#[test]
fn large_texts_are_taken() {
    // 5 MB of definitions that are right.
    let mut text = String::new();
    let mut number = 0;
    while text.len() < 5_000_000 {
        text += &format!("let name_{number} = {number} + {number} * sin({number}.5) # 🙂\n");
        number += 1;
    }
    let mut client = Client::ready();
    client.open(URI, &text);
    let found = client.request("textDocument/hover", at(URI, &text, "name_7 ", 1));
    let shown = found["contents"]["value"].as_str().expect("a text");
    assert!(shown.contains("let name_7 = 7"), "{shown}");
    assert_eq!(client.diagnostics(URI, 1), Vec::<Json>::new());
    let end = json!({ "line": number, "character": 0 });
    let change = json!([{ "range": { "start": end, "end": end }, "text": "let last = nope" }]);
    client.change(URI, 2, change);
    let found = client.diagnostics(URI, 2);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0]["range"]["start"]["line"], number);
    assert_eq!(client.finish(), 0);
}
