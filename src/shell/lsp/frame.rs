//! Messages on a stream: a header that tells how long it is, then JSON.
//!
//! What cannot be understood as a message is told apart from what cannot be read any further: the
//! one is answered, the other ends the conversation.

use std::io::{self, BufRead, Read, Write};

use lsp_server::{ErrorCode, Message};
use serde_json::{Value as Json, json};

/// Bytes of the longest message that is taken.
const LONGEST: usize = 256_000_000;

/// Bytes of the longest line of a header.
const LONGEST_LINE: u64 = 8_192;

/// What was found on the stream.
#[derive(Debug)]
pub(super) enum Frame {
    /// A message.
    Message(Message),
    /// A whole frame that is no message, and the answer to it.
    Malformed(Json),
    /// The end of the stream, between two frames.
    End,
}

/// Reads one frame.
///
/// # Errors
///
/// Where the stream breaks off, or no header is found: nothing more can be read then.
pub(super) fn read(stream: &mut impl BufRead) -> io::Result<Frame> {
    let Some(length) = read_header(stream)? else {
        return Ok(Frame::End);
    };
    let mut body = Vec::new();
    // Memory grows with what really comes, not with what is announced.
    stream.take(length as u64).read_to_end(&mut body)?;
    if body.len() < length {
        let message = format!("the stream ends after {} of {length} bytes", body.len());
        return Err(io::Error::new(io::ErrorKind::UnexpectedEof, message));
    }
    let value: Json = match serde_json::from_slice(&body) {
        Ok(value) => value,
        Err(error) => {
            return Ok(malformed(
                Json::Null,
                ErrorCode::ParseError,
                &error.to_string(),
            ));
        }
    };
    let id = match value.get("id") {
        Some(id @ (Json::Number(_) | Json::String(_))) => id.clone(),
        _ => Json::Null,
    };
    match serde_json::from_value(value) {
        // It has an identifier, but none that a request can have.
        Ok(Message::Notification(_)) if !id.is_null() => {
            let what = "the identifier is neither a small whole number nor a string";
            Ok(malformed(id, ErrorCode::InvalidRequest, what))
        }
        Ok(message) => Ok(Frame::Message(message)),
        Err(error) => Ok(malformed(id, ErrorCode::InvalidRequest, &error.to_string())),
    }
}

fn malformed(id: Json, code: ErrorCode, error: &str) -> Frame {
    let message = format!("this is no message: {error}");
    let error = json!({ "code": code as i32, "message": message });
    Frame::Malformed(json!({ "jsonrpc": "2.0", "id": id, "error": error }))
}

/// The length that a header tells; nothing at the end of the stream.
fn read_header(stream: &mut impl BufRead) -> io::Result<Option<usize>> {
    let wrong = |message: String| io::Error::new(io::ErrorKind::InvalidData, message);
    let mut length = None;
    let mut is_first = true;
    loop {
        let mut line = Vec::new();
        let mut limited = stream.by_ref().take(LONGEST_LINE);
        let read = limited.read_until(b'\n', &mut line)?;
        if read == 0 && is_first {
            return Ok(None);
        }
        if line.last() != Some(&b'\n') {
            return Err(wrong("a header breaks off or is too long".into()));
        }
        is_first = false;
        let line = String::from_utf8_lossy(&line);
        let line = line.trim();
        if line.is_empty() {
            break;
        }
        let Some((name, value)) = line.split_once(':') else {
            return Err(wrong(format!("`{line}` is no line of a header")));
        };
        if name.trim().eq_ignore_ascii_case("content-length") {
            let value = value.trim().parse().ok();
            length = value.filter(|&length| length <= LONGEST);
            if length.is_none() {
                return Err(wrong(format!("`{line}` is no length of a message")));
            }
        }
    }
    let missing = || wrong("a header has no Content-Length".into());
    length.map(Some).ok_or_else(missing)
}

/// Writes one message.
pub(super) fn write(stream: &mut impl Write, message: &Json) -> io::Result<()> {
    let body = message.to_string();
    write!(stream, "Content-Length: {}\r\n\r\n{body}", body.len())?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> io::Result<Frame> {
        read(&mut text.as_bytes())
    }

    #[test]
    fn frames_are_read_or_refused() {
        let body = r#"{"jsonrpc":"2.0","method":"exit"}"#;
        let text = format!(
            "Content-Type: x\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        assert!(matches!(
            read_text(&text),
            Ok(Frame::Message(Message::Notification(_)))
        ));
        assert!(matches!(read_text(""), Ok(Frame::End)));
        let code = |text: &str| match read_text(text) {
            Ok(Frame::Malformed(answer)) => answer["error"]["code"].as_i64(),
            _ => None,
        };
        assert_eq!(code("Content-Length: 3\r\n\r\n{]}"), Some(-32700));
        assert_eq!(code("Content-Length: 8\r\n\r\n{\"id\":7}"), Some(-32600));
        for broken in [
            "Content-Length: 30\r\n\r\n{}",
            "Content-Length: 99999999999999999999\r\n\r\n{}",
            "Content-Length: -1\r\n\r\n{}",
            "Content-Length: 3",
            "X: 3\r\n\r\n{}",
            "\r\n\r\n",
            "no header at all\r\n",
        ] {
            assert!(read_text(broken).is_err(), "{broken}");
        }
    }
}
