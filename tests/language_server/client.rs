//! A client of the language server that speaks the protocol over pipes.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};

/// How long anything may take before a test gives up: far more than on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A server in a process of its own, and the pipes to it.
pub(crate) struct Client {
    process: Child,
    input: Option<ChildStdin>,
    received: Receiver<Json>,
    /// What the server said without being asked.
    pub(crate) said: Vec<Json>,
    next: i64,
}

impl Client {
    /// Starts a server without saying anything to it.
    pub(crate) fn start() -> Client {
        let mut process = Command::new(env!("CARGO_BIN_EXE_imp"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the server starts");
        let input = process.stdin.take();
        let output = process.stdout.take().expect("a pipe");
        let (sender, received) = channel();
        std::thread::spawn(move || {
            let mut output = BufReader::new(output);
            while let Some(message) = read(&mut output) {
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        Client {
            process,
            input,
            received,
            said: Vec::new(),
            next: 1,
        }
    }

    /// Starts a server and begins the conversation; a client that knows UTF-16 only.
    pub(crate) fn ready() -> Client {
        let mut client = Client::start();
        client.request("initialize", json!({ "capabilities": {} }));
        client.notify("initialized", json!({}));
        client
    }

    /// Sends bytes as they are.
    pub(crate) fn send_raw(&mut self, bytes: &[u8]) {
        let input = self.input.as_mut().expect("an open pipe");
        // A server that has ended does not read any more.
        let _ = input.write_all(bytes).and_then(|()| input.flush());
    }

    pub(crate) fn send(&mut self, message: &Json) {
        let body = message.to_string();
        let frame = format!("Content-Length: {}\r\n\r\n{body}", body.len());
        self.send_raw(frame.as_bytes());
    }

    pub(crate) fn notify(&mut self, method: &str, params: Json) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The next message, whatever it is; nothing if the server has closed its end.
    pub(crate) fn message(&mut self) -> Option<Json> {
        match self.received.recv_timeout(PATIENCE) {
            Ok(message) => Some(message),
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => None,
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => panic!("the server says nothing"),
        }
    }

    /// The whole answer to a request.
    pub(crate) fn ask(&mut self, method: &str, params: Json) -> Json {
        let id = self.next;
        self.next += 1;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let message = self.message().expect("an answer");
            if message["id"] == id && message.get("method").is_none() {
                return message;
            }
            self.said.push(message);
        }
    }

    /// The result of a request that must succeed.
    pub(crate) fn request(&mut self, method: &str, params: Json) -> Json {
        let answer = self.ask(method, params);
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        answer["result"].clone()
    }

    /// The error of a request that must fail: code and message.
    pub(crate) fn refused(&mut self, method: &str, params: Json) -> (i64, String) {
        let answer = self.ask(method, params);
        let error = &answer["error"];
        let code = error["code"].as_i64();
        let message = error["message"].as_str();
        (
            code.unwrap_or_else(|| panic!("{method} succeeds: {answer}")),
            message.expect("a message").to_owned(),
        )
    }

    pub(crate) fn open(&mut self, uri: &str, text: &str) {
        let item = json!({ "uri": uri, "languageId": "imp", "version": 1, "text": text });
        self.notify("textDocument/didOpen", json!({ "textDocument": item }));
    }

    /// Changes a text: each change is a range, if it is not the whole text, and what is there now.
    pub(crate) fn change(&mut self, uri: &str, version: i64, changes: Json) {
        let params = json!({
            "textDocument": { "uri": uri, "version": version },
            "contentChanges": changes,
        });
        self.notify("textDocument/didChange", params);
    }

    /// Waits for the diagnostics of a version of a text.
    pub(crate) fn diagnostics(&mut self, uri: &str, version: i64) -> Vec<Json> {
        let is_it = |message: &Json| {
            message["method"] == "textDocument/publishDiagnostics"
                && message["params"]["uri"] == uri
                && message["params"]["version"] == version
        };
        let begun = Instant::now();
        loop {
            let found = self.said.iter().position(is_it);
            if let Some(place) = found {
                let message = self.said.remove(place);
                let list = message["params"]["diagnostics"].as_array();
                return list.expect("a list").clone();
            }
            assert!(begun.elapsed() < PATIENCE, "no diagnostics of {uri}");
            let message = self.message().expect("diagnostics");
            self.said.push(message);
        }
    }

    /// Ends the conversation as it should; the exit code.
    pub(crate) fn finish(mut self) -> i32 {
        self.request("shutdown", Json::Null);
        self.notify("exit", Json::Null);
        self.wait().0
    }

    /// Closes the pipe and waits for the end: the exit code, and what is on standard error.
    pub(crate) fn wait(mut self) -> (i32, String) {
        drop(self.input.take());
        let begun = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("a process") {
                let mut errors = String::new();
                let stderr = self.process.stderr.take();
                stderr
                    .expect("a pipe")
                    .read_to_string(&mut errors)
                    .expect("text");
                return (status.code().expect("an exit code"), errors);
            }
            assert!(begun.elapsed() < PATIENCE, "the server does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        // Where a test has failed the server must not stay.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn read(output: &mut impl BufRead) -> Option<Json> {
    let mut length = None;
    loop {
        let mut line = String::new();
        if output.read_line(&mut line).ok()? == 0 {
            return None;
        }
        match line.trim().split_once(": ") {
            Some(("Content-Length", value)) => length = value.parse().ok(),
            Some(_) => {}
            None => break,
        }
    }
    let mut body = vec![0; length?];
    output.read_exact(&mut body).ok()?;
    serde_json::from_slice(&body).ok()
}

/// The address of a file.
pub(crate) fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// The position of the first place of `part`, and `delta` characters of UTF-16 behind it.
pub(crate) fn position(text: &str, part: &str, delta: usize) -> Json {
    let offset = text.find(part).unwrap_or_else(|| panic!("no {part}"));
    let line = text[..offset].matches('\n').count();
    let start = text[..offset].rfind('\n').map_or(0, |end| end + 1);
    let character = text[start..offset].encode_utf16().count() + delta;
    json!({ "line": line, "character": character })
}

/// The parameters of a request about a place.
pub(crate) fn at(uri: &str, text: &str, part: &str, delta: usize) -> Json {
    json!({ "textDocument": { "uri": uri }, "position": position(text, part, delta) })
}
