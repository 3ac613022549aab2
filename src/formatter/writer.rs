//! The words and comments of a text, written to a document one after the other.

use super::document::{Document, Group, Place};
use crate::diagnostic::Span;

/// The words that separate and say nothing else.
const SEPARATORS: [&str; 2] = [",", ";"];

/// Writes the words of a text in their order, and each comment where it stands between them.
pub(super) struct Writer<'text> {
    text: &'text str,
    words: &'text [Span],
    comments: &'text [Span],
    /// The words and comments that are written.
    word: usize,
    comment: usize,
    /// Where what was written last ends in the text.
    end: usize,
    /// Whether a comment stands behind the word that was written last.
    behind_comment: bool,
    /// The document so far.
    pub(super) document: Document<'text>,
    /// For each open bracket whether line ends say nothing in it.
    brackets: Vec<bool>,
    /// The brackets that stand close around the element that is being written, up to its block: what
    /// comes before that must fit on the line, for behind the block the line goes on after its bracket
    /// alone.
    hugging: Option<Group>,
}

/// How what stands in brackets is set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brackets {
    /// As many elements stand on a line as fit, instead of one.
    pub(super) fills: bool,
    /// An element that has lines of its own: the brackets stand close around it.
    pub(super) hugged: Option<usize>,
    /// A comma stands behind the last element where each has its line.
    pub(super) comma: bool,
}

impl Brackets {
    /// Around any number of elements.
    pub(super) const LIST: Brackets = Brackets {
        fills: false,
        hugged: None,
        comma: true,
    };
    /// Around one thing that is not an element.
    pub(super) const SINGLE: Brackets = Brackets {
        comma: false,
        ..Brackets::LIST
    };
}

impl<'text> Writer<'text> {
    /// Writes these words and comments, which must stand in this text.
    pub(super) fn new(text: &'text str, words: &'text [Span], comments: &'text [Span]) -> Self {
        Writer {
            text,
            words,
            comments,
            word: 0,
            comment: 0,
            end: 0,
            behind_comment: false,
            document: Document::default(),
            brackets: Vec::new(),
            hugging: None,
        }
    }

    /// The formatted text.
    pub(super) fn finish(self) -> String {
        self.document.print()
    }

    fn slice(&self, span: Span) -> &'text str {
        &self.text[span.start as usize..span.end as usize]
    }

    /// The next word; empty at the end.
    pub(super) fn next_word(&self) -> &'text str {
        self.words
            .get(self.word)
            .map_or("", |&span| self.slice(span))
    }

    /// Where the next word begins.
    pub(super) fn next_start(&self) -> usize {
        self.words
            .get(self.word)
            .map_or(self.text.len(), |span| span.start as usize)
    }

    /// Whether the next word, an operator, was written close to one of its operands.
    pub(super) fn is_next_tight(&self) -> bool {
        let end = |index: usize| self.words.get(index).map(|span| span.end);
        let start = |index: usize| self.words.get(index).map(|span| span.start);
        let before = self.word.checked_sub(1).and_then(end);
        before == start(self.word) || end(self.word) == start(self.word + 1)
    }

    /// Whether a line ends between what was written last and the next word.
    pub(super) fn is_line_before_word(&self) -> bool {
        let between = self.text.get(self.end..self.next_start());
        between.is_some_and(|between| between.contains('\n'))
    }

    /// Whether there is a line's end in a part of the text.
    pub(super) fn has_lines(&self, span: Span) -> bool {
        self.slice(span).contains('\n')
    }

    /// Whether the next word cannot stand on the line at hand, because of a comment.
    pub(super) fn is_after_comment(&self) -> bool {
        self.has_comment_before_word() || self.behind_comment
    }

    /// Whether a comment stands on its own line before the next word.
    pub(super) fn has_comment_before_word(&self) -> bool {
        self.comments
            .get(self.comment)
            .is_some_and(|comment| (comment.start as usize) < self.next_start())
    }

    /// Whether line ends say nothing here.
    pub(super) fn is_in_brackets(&self) -> bool {
        self.brackets.last().copied().unwrap_or(false)
    }

    /// Goes past the next word, and past the comment behind it on its line unless it is `crowded`
    /// there: then it goes on a line of its own, before the word that follows.
    fn advance(&mut self, crowded: bool) {
        self.behind_comment = crowded;
        let Some(&span) = self.words.get(self.word) else {
            return;
        };
        match self.slice(span) {
            "(" | "[" => self.brackets.push(true),
            "{" => self.brackets.push(false),
            ")" | "]" | "}" => drop(self.brackets.pop()),
            _ => {}
        }
        self.word += 1;
        self.end = span.end as usize;
        let Some(&comment) = self.comments.get(self.comment) else {
            return;
        };
        let (start, end) = (comment.start as usize, comment.end as usize);
        let next_to_it = start >= self.end && start < self.next_start();
        if next_to_it && !crowded && !self.text[self.end..start].contains('\n') {
            self.document.trailing_comment(self.slice(comment));
            self.behind_comment = true;
            self.comment += 1;
            self.end = end;
        }
    }

    /// Writes the comments before the next word, each on its own line.
    pub(super) fn comments(&mut self) {
        while self.has_comment_before_word() {
            let comment = self.comments[self.comment];
            self.document.own_line_comment(self.slice(comment));
            self.comment += 1;
            self.end = self.end.max(comment.end as usize);
            self.behind_comment = false;
        }
    }

    /// Writes comments between statements, with the empty lines before them, and says whether an
    /// empty line stands before the next word. `documented`: whether the last comment may be the
    /// doc comment of the statement that comes.
    pub(super) fn comments_between(&mut self, documented: bool, first: bool) -> bool {
        let mut first = first;
        let mut detached = false;
        let mut joins = false;
        while self.has_comment_before_word() {
            let comment = self.comments[self.comment];
            let start = comment.start as usize;
            let line = self.text[..start].rsplit('\n').next().unwrap_or("");
            let behind_word = !line.trim().is_empty();
            let blank = !first && (joins || self.is_blank_before(start));
            self.document.end_line(blank);
            self.comments_one(comment);
            // A comment that only looks like documentation must not become it, nor a part of it.
            joins = behind_word && self.slice(comment).starts_with("##");
            detached = joins || (self.slice(comment).starts_with("##") && !documented);
            first = false;
        }
        !first && (detached || self.is_blank_before(self.next_start()))
    }

    fn comments_one(&mut self, comment: Span) {
        self.document.own_line_comment(self.slice(comment));
        self.comment += 1;
        self.end = comment.end as usize;
    }

    fn is_blank_before(&self, place: usize) -> bool {
        let between = self.text.get(self.end..place).unwrap_or("");
        between.bytes().filter(|&byte| byte == b'\n').count() > 1
    }

    /// Writes the next word.
    pub(super) fn word(&mut self) {
        self.comments();
        let word = self.next_word();
        self.document.word(word);
        self.advance(false);
    }

    /// Writes the next word, an operator: it may stand before the comment of its line.
    pub(super) fn operator(&mut self) {
        self.comments();
        let word = self.next_word();
        self.document.attached(word);
        self.advance(self.behind_comment);
    }

    /// Writes so many words with spaces between them.
    pub(super) fn spaced_words(&mut self, count: usize) {
        for index in 0..count {
            if index > 0 {
                self.document.space();
            }
            self.word();
        }
    }

    /// Goes past separators; says whether there was one. Comments before them come behind them.
    pub(super) fn skip_separators(&mut self) -> bool {
        let mut found = false;
        while SEPARATORS.contains(&self.next_word()) {
            self.advance(self.behind_comment);
            found = true;
        }
        found
    }

    /// Writes the comma between two elements, whatever separated them.
    pub(super) fn comma(&mut self) {
        self.document.comma();
        self.skip_separators();
    }

    /// Writes brackets with so many elements, each written by `element`.
    pub(super) fn enclosed(
        &mut self,
        brackets: Brackets,
        count: usize,
        mut element: impl FnMut(&mut Self, usize),
    ) {
        let outer = self.hugging.take();
        let group = self.document.open();
        self.word();
        self.document.indent();
        // Bindings may begin with separators.
        self.skip_separators();
        if count > 0 {
            self.document.line("", false);
        }
        let mut place: Option<Place> = None;
        for index in 0..count {
            let is_last = index + 1 == count;
            let hugged = brackets.hugged == Some(index) && !self.is_after_comment();
            if hugged {
                self.document.measure_to_here(group);
                self.hugging = Some(group);
            }
            element(self, index);
            if hugged {
                self.hugging = None;
                self.document.measure_from_here(group);
            }
            if !is_last {
                self.comma();
            }
            if let Some(place) = place.take() {
                self.document.filled(place);
            }
            match is_last {
                true => self.end_list(group, brackets),
                false if brackets.fills => place = Some(self.document.fill(" ")),
                false => self.document.line(" ", false),
            }
        }
        self.comments();
        self.document.dedent();
        if count > 0 {
            self.document.line("", false);
        }
        self.word();
        self.document.close(group);
        self.hugging = outer;
    }

    /// The block begins that an element in close brackets ends with.
    pub(super) fn begin_hugged_block(&mut self) {
        if let Some(group) = self.hugging.take() {
            self.document.measure_head_to_here(group);
        }
    }

    /// What stands behind the last element: a comma that was written there keeps the list broken.
    fn end_list(&mut self, group: Group, brackets: Brackets) {
        let written = self.next_word() == ",";
        if brackets.comma {
            self.document.if_broken(",");
            if written {
                self.document.force(group);
            }
        }
        self.skip_separators();
    }
}
