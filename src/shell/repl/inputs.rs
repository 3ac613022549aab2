//! What comes through a pipe, divided into inputs: commands, and statements that are whole.

use std::io::{BufRead, Read};

use super::commands;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::is_complete;

/// More bytes than these are not taken as one input.
const LONGEST: usize = 64_000_000;

/// Longer inputs are looked at only behind lines that begin with a closing bracket: each look goes
/// through the whole of it.
const LONGEST_LOOKED_AT: usize = 65_536;

/// The inputs that come from a reader.
pub(super) struct Inputs<Reader> {
    reader: Reader,
    lines: usize,
    bytes: usize,
}

impl<Reader: BufRead> Inputs<Reader> {
    /// The inputs of a reader, none read yet.
    pub(super) fn new(reader: Reader) -> Self {
        Inputs {
            reader,
            lines: 0,
            bytes: 0,
        }
    }

    /// The next input as soon as it is whole, with the number of lines before it; nothing at the
    /// end.
    pub(super) fn next_input(&mut self) -> Result<Option<(usize, String)>, Box<Diagnostic>> {
        let mut input = String::new();
        let mut lines_before = self.lines;
        // Comments belong to what comes below them.
        let mut has_words = false;
        while let Some(line) = self.next_line()? {
            if !has_words && commands::is_command(&line) {
                return Ok(Some((self.lines - 1, line)));
            }
            if input.trim().is_empty() {
                input.clear();
                lines_before = self.lines - 1;
            }
            input += &line;
            if input.len() > LONGEST {
                let message = format!("an input is longer than {LONGEST} bytes");
                return Err(Box::new(Diagnostic::error(Code::CannotRead, message)));
            }
            let is_first = !has_words;
            has_words |= !line.trim_start().is_empty() && !line.trim_start().starts_with('#');
            let closes = line.trim_start().starts_with([')', ']', '}']);
            let is_looked_at = is_first || input.len() <= LONGEST_LOOKED_AT || closes;
            if has_words && is_looked_at && is_complete(&input) {
                return Ok(Some((lines_before, input)));
            }
        }
        // What is not whole at the end is run as it is, and says what is missing.
        Ok(has_words.then_some((lines_before, input)))
    }

    fn next_line(&mut self) -> Result<Option<String>, Box<Diagnostic>> {
        let mut bytes = Vec::new();
        let mut reader = (&mut self.reader).take(LONGEST as u64 + 1);
        reader.read_until(b'\n', &mut bytes).map_err(|error| {
            let message = format!("cannot read `<stdin>`: {error}");
            Box::new(Diagnostic::error(Code::CannotRead, message))
        })?;
        if bytes.is_empty() {
            return Ok(None);
        }
        let before = self.bytes;
        self.bytes += bytes.len();
        self.lines += 1;
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = before + error.utf8_error().valid_up_to();
            let message = format!("`<stdin>` is not UTF-8 text: byte {at} cannot be read");
            Box::new(Diagnostic::error(Code::NotText, message).help("save it as UTF-8"))
        })?;
        // Some editors begin a file with a byte order mark, which says nothing here.
        let mark = '\u{feff}';
        Ok(Some(match before {
            0 => text.trim_start_matches(mark).to_string(),
            _ => text,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_end_where_they_are_whole_and_know_their_lines() {
        let text = "let a = [\n1]\n:list\nquit\n\n# said\na\n1 +\n\n2\n(";
        let mut inputs = Inputs::new(text.as_bytes());
        let mut found = Vec::new();
        while let Some((lines, input)) = inputs.next_input().unwrap() {
            found.push((lines, input));
        }
        let expected = [
            (0, "let a = [\n1]\n"),
            (2, ":list\n"),
            (3, "quit\n"),
            (5, "# said\na\n"),
            (7, "1 +\n\n2\n"),
            (10, "("),
        ];
        assert_eq!(
            found,
            expected.map(|(lines, text)| (lines, text.to_string()))
        );
    }

    #[test]
    fn an_input_is_given_before_the_next_one_is_there() {
        struct Slow(Vec<&'static [u8]>);
        impl Read for Slow {
            fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
                let part = self.0.remove(0);
                bytes[..part.len()].copy_from_slice(part);
                Ok(part.len())
            }
        }
        // A third read would fail.
        let parts = Slow(vec![b"1 + 1\n", b"2 + 2\n"]);
        let mut inputs = Inputs::new(std::io::BufReader::new(parts));
        assert_eq!(inputs.next_input().unwrap(), Some((0, "1 + 1\n".into())));
        assert_eq!(inputs.next_input().unwrap(), Some((1, "2 + 2\n".into())));
    }
}
