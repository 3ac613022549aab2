//! Statements, blocks, and the parts of definitions.

use super::document::Group;
use super::expression::Place;
use super::writer::{Brackets, Writer};
use crate::syntax::tree::{
    Block, Coordinates, Expression, ExpressionKind, FunctionParameter, Pattern, Statement,
    StatementKind,
};

impl Writer<'_> {
    /// A whole file.
    pub(super) fn file(&mut self, statements: &[Statement]) {
        self.statements(statements, "");
    }

    /// Statements, each on a line of its own if the innermost group is broken, and the comments
    /// between and behind them. `start` stands before the first on an unbroken line.
    fn statements(&mut self, statements: &[Statement], start: &'static str) {
        for (index, statement) in statements.iter().enumerate() {
            self.skip_separators();
            let documented = statement.documentation.is_some();
            let blank = self.comments_between(documented, index == 0);
            match index {
                0 => self.document.line(start, blank),
                _ => self.document.line("; ", blank),
            }
            self.statement(&statement.kind);
        }
        self.skip_separators();
        self.comments_between(false, statements.is_empty());
    }

    fn statement(&mut self, kind: &StatementKind) {
        match kind {
            StatementKind::Parameter { value, range, .. }
            | StatementKind::Setting { value, range, .. } => {
                self.spaced_words(2);
                self.assigned(value);
                if let Some(range) = range {
                    self.document.space();
                    self.operator();
                    self.document.space();
                    self.expression(range, Place::Inline);
                }
            }
            StatementKind::Import { .. } => self.spaced_words(4),
            StatementKind::Test { body, .. } => {
                self.spaced_words(2);
                self.block_behind(body);
            }
            StatementKind::Let { pattern, value } => {
                self.spaced_words(1);
                self.document.space();
                self.pattern(pattern);
                self.assigned(value);
            }
            StatementKind::Variable { value, .. } => {
                self.spaced_words(2);
                self.assigned(value);
            }
            StatementKind::Assignment { target, value } => {
                self.expression(target, Place::Inline);
                self.assigned(value);
            }
            StatementKind::Function { function, .. } => {
                self.spaced_words(2);
                self.parameters(&function.parameters);
                match &*function.body.kind {
                    ExpressionKind::Block(body) if self.next_word() == "{" => {
                        self.block_behind(body);
                    }
                    _ => self.assigned(&function.body),
                }
            }
            StatementKind::Field {
                coordinates,
                domain,
                body,
                ..
            } => self.field(coordinates, domain, body),
            StatementKind::For {
                pattern,
                iterable,
                body,
            } => {
                self.spaced_words(1);
                self.document.space();
                self.each(pattern, iterable);
                self.block_behind(body);
            }
            StatementKind::While { condition, body } => {
                self.spaced_words(1);
                self.document.space();
                self.expression(condition, Place::Inline);
                self.block_behind(body);
            }
            StatementKind::Expression(expression) => {
                let place = match &*expression.kind {
                    ExpressionKind::If { .. } => Place::Indented,
                    _ => Place::Inline,
                };
                self.expression(expression, place);
            }
            // A text with errors is not formatted.
            StatementKind::Error => {}
        }
    }

    /// `field name(coordinates) over domain = body`
    fn field(&mut self, coordinates: &Coordinates, domain: &[Expression], body: &Expression) {
        self.spaced_words(2);
        match coordinates {
            Coordinates::Named(names) => {
                self.enclosed(Brackets::LIST, names.len(), |writer, _| writer.word());
            }
            Coordinates::Point { .. } => {
                self.enclosed(Brackets::SINGLE, 1, |writer, _| writer.spaced_words(3));
            }
        }
        if !domain.is_empty() {
            self.document.space();
            self.word();
            let group = self.document.open();
            self.document.indent();
            for (index, side) in domain.iter().enumerate() {
                if index > 0 {
                    self.comma();
                }
                self.document.line(" ", false);
                self.expression(side, Place::Indented);
            }
            self.document.dedent();
            self.document.close(group);
        }
        self.assigned(body);
    }

    /// ` = value`
    pub(super) fn assigned(&mut self, value: &Expression) {
        self.document.space();
        self.operator();
        self.value(value, self.is_line_before_word());
    }

    /// `pattern in iterable`
    pub(super) fn each(&mut self, pattern: &Pattern, iterable: &Expression) {
        self.pattern(pattern);
        self.document.space();
        self.operator();
        self.document.space();
        self.expression(iterable, Place::Inline);
    }

    pub(super) fn pattern(&mut self, pattern: &Pattern) {
        match pattern {
            Pattern::Name(_) => self.word(),
            Pattern::List(parts, _) => {
                self.enclosed(Brackets::LIST, parts.len(), |writer, index| {
                    writer.pattern(&parts[index]);
                })
            }
        }
    }

    /// `(a, b = 1, rest..)`
    pub(super) fn parameters(&mut self, parameters: &[FunctionParameter]) {
        self.enclosed(Brackets::LIST, parameters.len(), |writer, index| {
            let parameter = &parameters[index];
            writer.pattern(&parameter.pattern);
            if parameter.rest {
                writer.word();
            }
            if let Some(default) = &parameter.default {
                writer.assigned(default);
            }
        });
    }

    /// ` { … }`
    fn block_behind(&mut self, block: &Block) {
        self.document.space();
        self.block(block);
    }

    /// `{ … }`
    pub(super) fn block(&mut self, block: &Block) {
        let group = self.document.open();
        self.block_in(group, block);
        self.document.close(group);
    }

    /// `{ … }` in a group that decides about its lines: one, if it was written so and fits.
    pub(super) fn block_in(&mut self, group: Group, block: &Block) {
        // A comment before the brace goes behind it.
        self.operator();
        if block.statements.is_empty() && self.next_word() == "}" && !self.is_after_comment() {
            return self.word();
        }
        if self.has_lines(block.span) {
            self.document.force(group);
        }
        self.document.indent();
        self.statements(&block.statements, " ");
        self.document.dedent();
        let end = if block.statements.is_empty() { "" } else { " " };
        self.document.line(end, false);
        self.word();
    }
}
