//! How long an editor waits: from a keystroke in a file of 2,000 lines to fresh diagnostics, with
//! the real server at the other end of two pipes.

// A measurement's result goes to standard output.
#![allow(clippy::print_stdout)]

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use serde_json::{Value as Json, json};

const LINES: usize = 2_000;
const KEYSTROKES: usize = 101;
const URI: &str = "untitled:large";

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut server = Command::new(env!("CARGO_BIN_EXE_imp"))
        .arg("lsp")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut input = server.stdin.take().ok_or("no pipe")?;
    let mut output = BufReader::new(server.stdout.take().ok_or("no pipe")?);
    send(
        &mut input,
        &json!({ "id": 1, "method": "initialize", "params": { "capabilities": {} } }),
    )?;
    receive(&mut output)?;
    let text = program();
    let item = json!({ "uri": URI, "languageId": "imp", "version": 0, "text": text });
    notify(
        &mut input,
        "textDocument/didOpen",
        json!({ "textDocument": item }),
    )?;
    diagnostics(&mut output, 0)?;
    let mut times = Vec::new();
    for version in 1..=KEYSTROKES {
        // A digit of a constant in the middle of the file.
        let at = |character: usize| json!({ "line": LINES / 2 + 2, "character": character });
        let column = "let value_0000 = ".len();
        let change = json!({
            "range": { "start": at(column), "end": at(column + 1) },
            "text": (version % 9 + 1).to_string(),
        });
        let params = json!({
            "textDocument": { "uri": URI, "version": version },
            "contentChanges": [change],
        });
        let begun = Instant::now();
        notify(&mut input, "textDocument/didChange", params)?;
        let found = diagnostics(&mut output, version)?;
        times.push(begun.elapsed().as_secs_f64() * 1e3);
        if found != 0 {
            return Err(format!("{found} diagnostics of a file that is right").into());
        }
    }
    times.sort_by(f64::total_cmp);
    println!(
        "keystroke to diagnostics, {LINES} lines, {} bytes: median {:.1} ms, 95 % within {:.1} ms, worst {:.1} ms",
        text.len(),
        times[KEYSTROKES / 2],
        times[KEYSTROKES * 95 / 100],
        times[KEYSTROKES - 1]
    );
    drop(input);
    server.wait()?;
    Ok(())
}

/// A file of all sorts of definitions and statements, which is right.
fn program() -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut number = 0;
    while lines.len() < LINES {
        let block = [
            format!("## The size of part {number}."),
            format!("param size_{number} = 1.5 in 0.5..2"),
            format!("let value_{number:04} = 2 * {number} + sin({number} / 7) # a constant"),
            format!("fn grown_{number}(x, by_how_much = 2) = x * by_how_much + value_{number:04}"),
            format!("field part_{number}(p in R3) over -3..3 = {{"),
            format!("    let q = p - [grown_{number}(0.1), 0, {number}]"),
            format!("    min(norm(q) - size_{number}, box(1).twist(45deg)(q))"),
            "}".to_owned(),
            format!("let mesh_{number} = polygonize(part_{number}, cell = 0.1)"),
            format!("print(\"{{mesh_{number}.area:.3}} of part {number}\")"),
        ];
        lines.extend(block);
        number += 1;
    }
    lines.join("\n") + "\n"
}

fn send(input: &mut ChildStdin, message: &Json) -> Result<(), Failure> {
    let body = message.to_string();
    write!(input, "Content-Length: {}\r\n\r\n{body}", body.len())?;
    input.flush()?;
    Ok(())
}

fn notify(input: &mut ChildStdin, method: &str, params: Json) -> Result<(), Failure> {
    send(input, &json!({ "method": method, "params": params }))
}

/// The number of diagnostics of a version of the text, when they come.
fn diagnostics(output: &mut BufReader<ChildStdout>, version: usize) -> Result<usize, Failure> {
    loop {
        let message = receive(output)?;
        if message["method"] == "textDocument/publishDiagnostics"
            && message["params"]["version"] == version
        {
            let list = message["params"]["diagnostics"].as_array();
            return Ok(list.map_or(0, Vec::len));
        }
    }
}

fn receive(output: &mut BufReader<ChildStdout>) -> Result<Json, Failure> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        if output.read_line(&mut line)? == 0 {
            return Err("the server is gone".into());
        }
        match line.trim().strip_prefix("Content-Length: ") {
            Some(value) => length = value.parse()?,
            None if line.trim().is_empty() => break,
            None => {}
        }
    }
    let mut body = vec![0; length];
    output.read_exact(&mut body)?;
    Ok(serde_json::from_slice(&body)?)
}
