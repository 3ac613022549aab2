//! What the line editor asks while a line is typed: whether it is whole, how it is coloured, how it
//! could go on.

use std::borrow::Cow;

use rustyline::completion::{Completer, FilenameCompleter, Pair};
use rustyline::highlight::{CmdKind, Highlighter};
use rustyline::hint::Hinter;
use rustyline::validate::{ValidationContext, ValidationResult, Validator};
use rustyline::{Context, Helper};

use super::commands::{self, COMMANDS};
use crate::assist::{Class, Surroundings, complete, highlight};
use crate::syntax::is_complete;

/// Longer inputs are not coloured while they are typed, and wait for no further line: that would be
/// done again for each letter.
const LONGEST_COLORED: usize = 8_000;

/// What the line editor knows of the session.
pub(super) struct Assistant {
    /// The names of the session.
    pub(super) surroundings: Surroundings,
    /// The names of its parameters and settings.
    pub(super) parameters: Vec<String>,
    /// Whether the terminal has colours.
    pub(super) has_colors: bool,
    files: FilenameCompleter,
}

impl Assistant {
    /// One that knows no session yet.
    pub(super) fn new(has_colors: bool) -> Assistant {
        Assistant {
            surroundings: Surroundings::default(),
            parameters: Vec::new(),
            has_colors,
            files: FilenameCompleter::new(),
        }
    }

    fn is_known(&self, name: &str) -> bool {
        let names = &self.surroundings.names;
        names.iter().any(|known| *known.name == *name)
    }
}

impl Helper for Assistant {}

impl Hinter for Assistant {
    type Hint = String;
}

impl Validator for Assistant {
    fn validate(&self, context: &mut ValidationContext) -> rustyline::Result<ValidationResult> {
        let text = context.input();
        let is_whole = commands::is_command(text)
            || text.len() > super::editor::LONGEST_TYPED
            || is_complete(text);
        Ok(match is_whole {
            true => ValidationResult::Valid(None),
            false => ValidationResult::Incomplete,
        })
    }
}

impl Highlighter for Assistant {
    fn highlight<'l>(&self, line: &'l str, _place: usize) -> Cow<'l, str> {
        if !self.has_colors || line.len() > LONGEST_COLORED {
            return Cow::Borrowed(line);
        }
        let begin = command_end(line);
        let mut colored = String::new();
        if begin > 0 {
            colored += &format!("\u{1b}[1m{}\u{1b}[22m", &line[..begin]);
        }
        let text = &line[begin..];
        let mut done = 0;
        for stretch in highlight(text) {
            let word = &text[stretch.range.clone()];
            let code = match stretch.class {
                Class::Unknown if self.is_known(word) => code(Class::Variable),
                class => code(class),
            };
            colored += &text[done..stretch.range.start];
            match code {
                "" => colored += word,
                code => colored += &format!("\u{1b}[{code}m{word}\u{1b}[0m"),
            }
            done = stretch.range.end;
        }
        colored += &text[done..];
        Cow::Owned(colored)
    }

    fn highlight_char(&self, line: &str, _place: usize, _kind: CmdKind) -> bool {
        self.has_colors && line.len() <= LONGEST_COLORED
    }
}

impl Completer for Assistant {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        place: usize,
        _context: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        let before = &line[..place];
        if let Some(begun) = before.strip_prefix(':')
            && !begun.contains(char::is_whitespace)
        {
            let names = COMMANDS
                .iter()
                .filter(|command| command.name.starts_with(begun));
            let pairs = names.map(|command| Pair {
                display: format!(":{}", command.name),
                replacement: match command.arguments {
                    "" => format!(":{}", command.name),
                    _ => format!(":{} ", command.name),
                },
            });
            return Ok((0, pairs.collect()));
        }
        let begin = command_end(line).min(place);
        match line[..begin].trim() {
            ":load" | ":save" | ":save!" => {
                let skipped = begin + (before[begin..].len() - before[begin..].trim_start().len());
                let (start, pairs) = self
                    .files
                    .complete_path(&line[skipped..], place - skipped)?;
                return Ok((skipped + start, pairs));
            }
            ":set" if !before.contains('=') => {
                let begun = before[begin..].trim_start();
                let names = self
                    .parameters
                    .iter()
                    .filter(|name| name.starts_with(begun));
                let pairs = names.map(|name| Pair {
                    display: name.clone(),
                    replacement: format!("{name}="),
                });
                return Ok((place - begun.len(), pairs.collect()));
            }
            _ => {}
        }
        if line.len() > LONGEST_COLORED {
            return Ok((place, Vec::new()));
        }
        let found = complete(&line[begin..], place - begin, &self.surroundings);
        let start = found
            .first()
            .map_or(place, |first| begin + first.replace.start);
        let pairs = found
            .into_iter()
            .filter(|completion| begin + completion.replace.start == start)
            .map(|completion| Pair {
                display: completion.label.clone(),
                replacement: completion.label,
            });
        Ok((start, pairs.collect()))
    }
}

/// Where the name of a command ends, if the line begins with one.
fn command_end(line: &str) -> usize {
    match line.starts_with(':') {
        true => line.find(char::is_whitespace).unwrap_or(line.len()),
        false => 0,
    }
}

/// The colour of a class of words, as a terminal's code.
fn code(class: Class) -> &'static str {
    match class {
        Class::Keyword => "35",
        Class::Number => "36",
        Class::String => "32",
        Class::Interpolation => "33",
        Class::Comment | Class::Documentation => "90",
        Class::Function => "34",
        Class::Field => "1",
        Class::Parameter => "33",
        Class::Operator
        | Class::Punctuation
        | Class::Variable
        | Class::Property
        | Class::Unknown => "",
    }
}
