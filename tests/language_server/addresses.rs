//! Addresses of texts, and what stands at the paths to which they lead.
#![cfg(unix)]

use std::os::unix::fs::symlink;

use serde_json::json;

use crate::client::{Client, at, uri};

#[test]
fn texts_stay_open_under_their_addresses() {
    let folder = tempfile::tempdir().expect("a folder");
    let real = folder.path().join("real");
    let link = folder.path().join("link");
    std::fs::create_dir(&real).expect("a folder");
    symlink(&real, &link).expect("a link");
    let address = uri(&link.join("new.imp"));
    let mut client = Client::ready();
    client.open(&address, "let a = 1\n");
    client.diagnostics(&address, 1);
    // Saving creates the file, and with it the path without links.
    std::fs::write(real.join("new.imp"), "let a = 1\n").expect("a file");
    client.change(&address, 2, json!([{ "text": "let a = nope\n" }]));
    assert_eq!(client.diagnostics(&address, 2).len(), 1);
    // Another address of the same file is another text.
    let other = uri(&real.join("new.imp"));
    client.open(&other, "let other = 1\n");
    let close = json!({ "textDocument": { "uri": other } });
    client.notify("textDocument/didClose", close);
    let text = "let a = nope\n";
    let found = client.request("textDocument/hover", at(&address, text, "a =", 0));
    assert!(found.is_object(), "{found}");
    assert_eq!(client.finish(), 0);
}

#[test]
fn pipes_are_not_imported() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.imp");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.is_ok_and(|status| status.success()));
    let address = uri(&folder.path().join("main.imp"));
    let mut client = Client::ready();
    client.open(&address, "import \"pipe.imp\" as p\n");
    let found = client.diagnostics(&address, 1);
    let message = found[0]["message"].as_str().expect("a message");
    assert!(message.contains("is not a regular file"), "{message}");
    std::fs::rename(&pipe, folder.path().join("pipe.vm")).expect("a pipe");
    let text = "let f = load(\"pipe.vm\")\n";
    client.change(&address, 2, json!([{ "text": text }]));
    let found = client.diagnostics(&address, 2);
    let message = found[0]["message"].as_str().expect("a message");
    assert!(message.contains("not a regular file"), "{message}");
    assert_eq!(client.finish(), 0);
}
