//! Where in a program a place lies, read from its words: which brackets are open there, which
//! function is being called, and which names the text binds that can be used there.
//!
//! The tree of a text that is being written lacks the very statement that is being written; its
//! words are always there.

use std::ops::Range;

use crate::syntax::words::{Word, WordKind};

/// A name that the text binds.
#[derive(Clone, Debug)]
pub(super) struct Bound {
    /// Where it is bound.
    pub(super) range: Range<usize>,
    pub(super) sort: Sort,
    /// The place of its statement's first word.
    pub(super) statement: usize,
}

/// How a name is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    Parameter,
    Setting,
    Module,
    Function,
    Field,
    /// By `let` or `var`.
    Value,
    /// A parameter of a function, a coordinate, or what a loop goes through.
    Local,
}

/// An open bracket, or the file.
#[derive(Debug, Default)]
pub(super) struct Frame {
    /// The place of the word that opens it; none for the file.
    pub(super) opener: Option<usize>,
    /// The place of the first word of the statement or argument that is being written.
    pub(super) start: usize,
    /// What is bound in it.
    bound: Vec<Bound>,
    /// What is bound until the statement ends.
    passing: Vec<Bound>,
    /// What is bound when the statement has ended.
    waiting: Vec<Bound>,
}

/// What is around a place.
pub(super) struct Scan<'text> {
    pub(super) text: &'text str,
    /// The text's words without its comments.
    pub(super) words: &'text [Word],
    /// The file, then the open brackets, innermost last.
    pub(super) frames: Vec<Frame>,
    /// How many words stand before the place.
    pub(super) before: usize,
    /// Definitions of the file that come later.
    later: Vec<Bound>,
}

impl<'text> Scan<'text> {
    /// Reads the words up to the first one that does not end before `offset`, and from there what
    /// the open brackets and the file still bind. Takes time linear in the text.
    pub(super) fn new(text: &'text str, words: &'text [Word], offset: usize) -> Scan<'text> {
        let before = words.partition_point(|word| word.range.end < offset);
        // A name that ends here is being written; anything else has been.
        let is_written = |word: &Word| {
            let is_name = matches!(
                word.kind,
                WordKind::Name | WordKind::LambdaName | WordKind::Keyword | WordKind::Text
            );
            word.range.start < offset && word.range.end == offset && !is_name
        };
        let finished = words[before..].iter().take_while(|word| is_written(word));
        let mut before = before + finished.count();
        // A bracket that was put in because none was written is not closed yet.
        let is_put_in = |word: &Word| {
            let rest = text.get(word.range.start..offset).unwrap_or_default();
            word.kind.closes() && word.range.is_empty() && rest.trim().is_empty()
        };
        while before > 0 && is_put_in(&words[before - 1]) {
            before -= 1;
        }
        let mut scan = Scan {
            text,
            words,
            frames: vec![Frame::default()],
            before,
            later: Vec::new(),
        };
        for place in 0..before {
            scan.word(place);
        }
        scan.look_ahead();
        scan
    }

    /// The text of a word.
    pub(super) fn shown(&self, place: usize) -> &'text str {
        self.words
            .get(place)
            .map_or("", |word| &self.text[word.range.clone()])
    }

    fn kind(&self, place: usize) -> Option<WordKind> {
        self.words.get(place).map(|word| word.kind)
    }

    /// The names that can be used at the place, inner ones first, those bound last first.
    pub(super) fn visible(&self) -> impl Iterator<Item = &Bound> {
        let is_in_function = matches!(
            self.frames.first().map(|file| self.shown(file.start)),
            Some("fn" | "test")
        );
        let later = self.later.iter().filter(move |_| is_in_function);
        self.frames
            .iter()
            .rev()
            .flat_map(|frame| frame.passing.iter().rev().chain(frame.bound.iter().rev()))
            .chain(later)
    }

    /// All definitions of the file, in order.
    pub(super) fn definitions(&self) -> impl Iterator<Item = &Bound> {
        let file = self.frames.first();
        file.into_iter()
            .flat_map(|file| file.bound.iter())
            .chain(&self.later)
    }

    fn frame(&mut self) -> &mut Frame {
        if self.frames.is_empty() {
            self.frames.push(Frame::default());
        }
        let last = self.frames.len() - 1;
        &mut self.frames[last]
    }

    /// Whether the innermost open bracket is one of statements, or the file.
    fn is_in_statements(&self) -> bool {
        let opener = self.frames.last().and_then(|frame| frame.opener);
        opener.is_none_or(|opener| {
            self.kind(opener) == Some(WordKind::Open)
                && self.shown(opener) == "{"
                && !self.follows_with(opener)
        })
    }

    /// Whether the brace belongs to a `with`.
    pub(super) fn follows_with(&self, opener: usize) -> bool {
        opener > 0 && self.shown(opener) == "{" && self.shown(opener - 1) == "with"
    }

    fn word(&mut self, place: usize) {
        let Some(kind) = self.kind(place) else {
            return;
        };
        match kind {
            _ if kind.opens() => {
                if kind == WordKind::LambdaOpen {
                    self.bind_parameters(place + 1);
                }
                self.frames.push(Frame {
                    opener: Some(place),
                    start: place + 1,
                    ..Frame::default()
                });
            }
            // The file is never closed.
            _ if kind.closes() => self.frames.truncate(self.frames.len().max(2) - 1),
            WordKind::StatementEnd => self.end_statement(place),
            WordKind::Punctuation if self.shown(place) == "," && !self.is_in_statements() => {
                let frame = self.frame();
                frame.passing.clear();
                frame.start = place + 1;
            }
            WordKind::LambdaName => self.bind(place, Sort::Local, Time::Passing),
            WordKind::Keyword => self.keyword(place),
            _ => {}
        }
    }

    fn end_statement(&mut self, place: usize) {
        let frame = self.frame();
        frame.passing.clear();
        let waiting = std::mem::take(&mut frame.waiting);
        frame.bound.extend(waiting);
        frame.start = place + 1;
    }

    fn keyword(&mut self, place: usize) {
        let next = place + 1;
        match self.shown(place) {
            "param" => self.bind(next, Sort::Parameter, Time::Waiting),
            "setting" => self.bind(next, Sort::Setting, Time::Waiting),
            "as" => self.bind(next, Sort::Module, Time::Waiting),
            "fn" => {
                self.bind(next, Sort::Function, Time::Now);
                if self.kind(next + 1) == Some(WordKind::Open) {
                    self.bind_parameters(next + 2);
                }
            }
            "field" => {
                self.bind(next, Sort::Field, Time::Waiting);
                if self.kind(next + 1) == Some(WordKind::Open) {
                    self.bind_parameters(next + 2);
                }
            }
            "let" | "var" => self.bind_pattern(next, Sort::Value, Time::Waiting),
            "for" => self.bind_pattern(next, Sort::Local, Time::Passing),
            _ => {}
        }
    }

    fn bind_pattern(&mut self, first: usize, sort: Sort, time: Time) {
        for place in self.pattern(first) {
            self.bind(place, sort, time);
        }
    }

    /// The places of the names of a pattern.
    fn pattern(&self, first: usize) -> Vec<usize> {
        let is_name = |place: &usize| self.kind(*place) == Some(WordKind::Name);
        (first..self.words.len())
            .take_while(|place| is_name(place) || matches!(self.shown(*place), "[" | "]" | ","))
            .filter(is_name)
            .collect()
    }

    /// Binds parameters or coordinates until the statement ends.
    fn bind_parameters(&mut self, first: usize) {
        let statement = self.frame().start;
        let rest = self.words.get(first..).unwrap_or_default();
        let names = parameter_names(self.text, rest).map(|word| Bound {
            range: word.range.clone(),
            sort: Sort::Local,
            statement,
        });
        let names: Vec<Bound> = names.collect();
        self.frame().passing.extend(names);
    }

    fn bind(&mut self, place: usize, sort: Sort, time: Time) {
        let Some(word) = self.words.get(place) else {
            return;
        };
        if !matches!(word.kind, WordKind::Name | WordKind::LambdaName) {
            return;
        }
        let frame = self.frame();
        let bound = Bound {
            range: word.range.clone(),
            sort,
            statement: frame.start,
        };
        match time {
            Time::Now => frame.bound.push(bound),
            Time::Passing => frame.passing.push(bound),
            Time::Waiting => frame.waiting.push(bound),
        }
    }

    /// Binds what stands behind the place: what comprehensions that are open there go through, and
    /// the file's later definitions.
    fn look_ahead(&mut self) {
        let mut open = self.frames.len();
        // How many brackets have been opened behind the place and not been closed.
        let mut inner = 0_usize;
        let mut start = self.before;
        for place in self.before..self.words.len() {
            let Some(kind) = self.kind(place) else {
                break;
            };
            if kind.opens() {
                inner += 1;
            } else if kind.closes() {
                match inner {
                    0 => open = open.saturating_sub(1).max(1),
                    _ => inner -= 1,
                }
            } else if inner == 0 {
                self.word_ahead(place, open, &mut start);
            }
        }
    }

    fn word_ahead(&mut self, place: usize, open: usize, start: &mut usize) {
        match self.kind(place) {
            Some(WordKind::StatementEnd) => *start = place + 1,
            Some(WordKind::Keyword) => {}
            _ => return,
        }
        let shown = self.shown(place);
        if open > 1 {
            let opener = self.frames[open - 1].opener;
            if shown == "for" && opener.is_some_and(|opener| self.shown(opener) != "{") {
                let bound = self.bound_ahead(place, Sort::Local, place);
                self.frames[open - 1].passing.extend(bound);
            }
            return;
        }
        let sort = match shown {
            "param" => Sort::Parameter,
            "setting" => Sort::Setting,
            "as" => Sort::Module,
            "fn" => Sort::Function,
            "field" => Sort::Field,
            "let" | "var" => Sort::Value,
            _ => return,
        };
        let bound = self.bound_ahead(place, sort, *start);
        self.later.extend(bound);
    }

    fn bound_ahead(&self, keyword: usize, sort: Sort, statement: usize) -> Vec<Bound> {
        let mut names = self.pattern(keyword + 1);
        if !matches!(sort, Sort::Value | Sort::Local) {
            names.truncate(1);
        }
        let bound = |place: usize| Bound {
            range: self.words[place].range.clone(),
            sort,
            statement,
        };
        names.into_iter().map(bound).collect()
    }
}

#[derive(Clone, Copy)]
enum Time {
    Now,
    Passing,
    Waiting,
}

/// The names that a list of parameters or coordinates binds; `rest` begins behind its bracket.
pub(super) fn parameter_names<'words>(
    text: &str,
    rest: &'words [Word],
) -> impl Iterator<Item = &'words Word> {
    let mut depth = 0_usize;
    let mut in_value = false;
    let mut names = Vec::new();
    for (place, word) in rest.iter().enumerate() {
        let shown = &text[word.range.clone()];
        match word.kind {
            // No list of parameters goes on behind one of these: its bracket was forgotten.
            WordKind::Keyword if matches!(shown, "fn" | "field" | "let" | "param") => break,
            kind if kind.opens() => depth += 1,
            kind if kind.closes() => match depth {
                0 => break,
                _ => depth -= 1,
            },
            WordKind::Punctuation if depth == 0 && shown == "," => in_value = false,
            WordKind::Operator | WordKind::Keyword if depth == 0 => in_value = true,
            WordKind::Name if !in_value => {
                let before = place.checked_sub(1).map(|place| &rest[place]);
                let begins = before.is_none_or(|word| {
                    word.kind.opens() || matches!(&text[word.range.clone()], ",")
                });
                if begins {
                    names.push(word);
                }
            }
            _ => {}
        }
    }
    names.into_iter()
}
