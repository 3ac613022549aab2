//! Expressions: where a line may end in them, and how their parts stand then.

use super::document::Group;
use super::writer::{Brackets, Writer};
use crate::syntax::tree::{
    Argument, BinaryOperator, Clause, Expression, ExpressionKind, Function, Name,
};

/// Stack that must be left for one more level of the tree, and how much is added where it is not.
const STACK_RESERVE: usize = 64 * 1024;
const STACK_GROWTH: usize = 4 * 1024 * 1024;

/// Where an expression stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Behind something: its further lines go one step to the right.
    Inline,
    /// At the start of a line that is indented for it.
    Indented,
}

/// Operators of one level, the operands between them, and how they are set.
struct Chain<'tree> {
    first: &'tree Expression,
    rest: Vec<&'tree Expression>,
    /// Whether lines are filled, instead of one operand a line.
    fills: bool,
    /// Whether spaces may be left out.
    may_be_tight: bool,
    /// Whether one operator is a `-`, with which a statement can begin.
    has_minus: bool,
}

impl Writer<'_> {
    /// An expression.
    pub(super) fn expression(&mut self, expression: &Expression, place: Place) {
        // They do not concern the groups that begin here.
        self.comments();
        stacker::maybe_grow(STACK_RESERVE, STACK_GROWTH, || {
            self.expression_kind(expression, place);
        });
    }

    fn expression_kind(&mut self, expression: &Expression, place: Place) {
        match &*expression.kind {
            ExpressionKind::Number(_)
            | ExpressionKind::Bool(_)
            | ExpressionKind::Text(_)
            | ExpressionKind::Name(_) => self.word(),
            ExpressionKind::List(elements) => self.list(elements),
            ExpressionKind::Comprehension { element, clauses } => {
                if is_bare(expression, element) {
                    let group = self.document.open();
                    self.comprehension(element, clauses);
                    self.document.close(group);
                } else {
                    let brackets = Brackets {
                        hugged: has_own_lines(element).then_some(0),
                        ..Brackets::SINGLE
                    };
                    self.enclosed(brackets, 1, |writer, _| {
                        writer.comprehension(element, clauses);
                    });
                }
            }
            ExpressionKind::Group(inner) => {
                let brackets = Brackets {
                    hugged: has_own_lines(inner).then_some(0),
                    ..Brackets::SINGLE
                };
                self.enclosed(brackets, 1, |writer, _| {
                    writer.expression(inner, Place::Indented);
                });
            }
            ExpressionKind::Unary { operand, .. } => {
                let is_word = self.next_word() == "not";
                self.word();
                if is_word {
                    self.document.space();
                }
                self.expression(operand, Place::Inline);
            }
            ExpressionKind::Binary {
                operator: BinaryOperator::Power,
                left: low,
                right: high,
            }
            | ExpressionKind::Interval { low, high } => {
                self.expression(low, Place::Inline);
                self.operator();
                self.expression(high, Place::Inline);
            }
            ExpressionKind::Binary { operator, .. } => {
                self.chain(&binary_chain(expression, *operator), place);
            }
            ExpressionKind::Comparison { first, rest } => {
                let chain = Chain {
                    first,
                    rest: rest.iter().map(|(_, operand)| operand).collect(),
                    fills: false,
                    may_be_tight: false,
                    has_minus: false,
                };
                self.chain(&chain, place);
            }
            ExpressionKind::Pipe { .. } => self.chain(&pipe_chain(expression), place),
            ExpressionKind::Steps { interval, step } => {
                self.expression(interval, Place::Inline);
                self.document.space();
                self.operator();
                self.document.space();
                self.expression(step, Place::Inline);
            }
            ExpressionKind::With { subject, bindings } => self.with(subject, bindings),
            ExpressionKind::Call { callee, arguments } => {
                self.expression(callee, Place::Inline);
                self.arguments(arguments);
            }
            ExpressionKind::Index { subject, index } => {
                self.expression(subject, Place::Inline);
                self.enclosed(Brackets::SINGLE, 1, |writer, _| {
                    writer.expression(index, Place::Indented);
                });
            }
            ExpressionKind::Property { subject, .. } => {
                self.expression(subject, Place::Inline);
                self.word();
                self.word();
            }
            ExpressionKind::Lambda(function) => self.lambda(function),
            ExpressionKind::If { .. } => self.conditional(expression, place),
            ExpressionKind::Block(block) => {
                self.begin_hugged_block();
                self.block(block);
            }
            // A text with errors is not formatted.
            ExpressionKind::Error => {}
        }
    }

    /// A value behind `=` or `->`: on the next line if that helps, or if it was written there and
    /// `stays` there.
    pub(super) fn value(&mut self, value: &Expression, stays: bool) {
        let breaks = match self.is_after_comment() {
            true => Breaks::Badly,
            false => breaks(value),
        };
        let group = match breaks {
            Breaks::Well => {
                self.document.space();
                return self.expression(value, Place::Inline);
            }
            Breaks::InNeed => self.document.open_shy(),
            Breaks::Badly => self.document.open(),
        };
        if breaks == Breaks::Badly && stays {
            self.document.force(group);
        }
        self.document.indent();
        self.document.line(" ", false);
        self.expression(value, Place::Indented);
        self.document.dedent();
        self.document.close(group);
    }

    fn list(&mut self, elements: &[Expression]) {
        let brackets = Brackets {
            fills: elements.iter().all(is_number),
            ..Brackets::LIST
        };
        self.enclosed(brackets, elements.len(), |writer, index| {
            writer.expression(&elements[index], Place::Inline);
        });
    }

    /// `e for x in xs if c`, with its lines in the group around it.
    fn comprehension(&mut self, element: &Expression, clauses: &[Clause]) {
        self.expression(element, Place::Inline);
        for clause in clauses {
            self.document.line(" ", false);
            self.word();
            self.document.space();
            match clause {
                Clause::For { pattern, iterable } => self.each(pattern, iterable),
                Clause::If(condition) => self.expression(condition, Place::Inline),
            }
        }
    }

    /// Operands with operators between them.
    fn chain(&mut self, chain: &Chain<'_>, place: Place) {
        let leads = self.is_in_brackets() || !chain.has_minus;
        let group = self.document.open();
        self.expression(chain.first, Place::Inline);
        if place == Place::Inline {
            self.document.indent();
        }
        for operand in &chain.rest {
            let gap = match chain.may_be_tight && self.is_next_tight() {
                true => "",
                false => " ",
            };
            if !leads {
                self.document.gap(gap);
                self.operator();
            }
            let place = match chain.fills {
                true => Some(self.document.fill(gap)),
                false => {
                    self.document.line(gap, false);
                    None
                }
            };
            if leads {
                self.operator();
                self.document.gap(gap);
            }
            self.expression(operand, Place::Inline);
            if let Some(place) = place {
                self.document.filled(place);
            }
        }
        if place == Place::Inline {
            self.document.dedent();
        }
        self.document.close(group);
    }

    /// `subject with {name = value, …}`
    fn with(&mut self, subject: &Expression, bindings: &[(Name, Expression)]) {
        self.expression(subject, Place::Inline);
        self.document.space();
        self.operator();
        self.document.space();
        self.enclosed(Brackets::LIST, bindings.len(), |writer, index| {
            let (_, value) = &bindings[index];
            // The name may be a path.
            while !matches!(writer.next_word(), "=" | "") {
                writer.word();
            }
            writer.assigned(value);
        });
    }

    fn arguments(&mut self, arguments: &[Argument]) {
        let bare = match arguments {
            [only] => match &*only.value.kind {
                ExpressionKind::Comprehension { element, clauses }
                    if is_bare(&only.value, element) =>
                {
                    Some((element, clauses))
                }
                _ => None,
            },
            _ => None,
        };
        let brackets = Brackets {
            hugged: match (arguments, bare) {
                (_, Some((element, _))) => has_own_lines(element).then_some(0),
                ([only], None) if is_list(&only.value) => Some(0),
                _ => arguments
                    .iter()
                    .position(|argument| has_own_lines(&argument.value)),
            },
            comma: bare.is_none(),
            ..Brackets::LIST
        };
        self.enclosed(brackets, arguments.len(), |writer, index| {
            let argument = &arguments[index];
            match (&argument.name, bare) {
                (Some(_), _) => {
                    writer.word();
                    writer.assigned(&argument.value);
                }
                (None, Some((element, clauses))) => writer.comprehension(element, clauses),
                (None, None) => writer.expression(&argument.value, Place::Inline),
            }
        });
    }

    /// `x -> e` or `(x, y) -> e`
    fn lambda(&mut self, function: &Function) {
        match self.next_word() {
            "(" => self.parameters(&function.parameters),
            _ => self.word(),
        }
        self.document.space();
        self.operator();
        self.value(&function.body, false);
    }

    /// `if c then a else b` or `if c { … } else { … }`, and what goes on behind `else` with `if`:
    /// all blocks have lines of their own or none.
    fn conditional(&mut self, expression: &Expression, place: Place) {
        let group = self.document.open();
        let mut present = expression;
        let mut indents = false;
        while let ExpressionKind::If {
            condition,
            consequence,
            alternative,
        } = &*present.kind
        {
            self.word();
            self.document.space();
            self.expression(condition, Place::Inline);
            self.document.space();
            let is_short = self.next_word() == "then";
            self.branch(group, consequence, is_short);
            let Some(alternative) = alternative else {
                break;
            };
            if is_short {
                if place == Place::Inline && !indents {
                    self.document.indent();
                    indents = true;
                }
                self.document.line(" ", false);
            } else {
                self.document.space();
            }
            match &*alternative.kind {
                ExpressionKind::If { .. } => {
                    self.operator();
                    self.document.space();
                }
                _ => self.branch(group, alternative, is_short),
            }
            present = alternative;
        }
        if indents {
            self.document.dedent();
        }
        self.document.close(group);
    }

    /// `then a` or `else a`, or a block, with the word `else` if it is one behind that.
    fn branch(&mut self, group: Group, value: &Expression, is_short: bool) {
        if self.next_word() != "{" {
            self.operator();
            self.document.space();
        }
        match &*value.kind {
            ExpressionKind::Block(block) if !is_short => self.block_in(group, block),
            _ => self.expression(value, Place::Inline),
        }
    }
}

/// How loosely an operator binds; those of one level stand in one chain.
fn level(operator: BinaryOperator) -> u8 {
    match operator {
        BinaryOperator::Or => 0,
        BinaryOperator::And => 1,
        BinaryOperator::Union => 2,
        BinaryOperator::Intersection => 3,
        BinaryOperator::Difference => 4,
        BinaryOperator::Add | BinaryOperator::Subtract => 5,
        BinaryOperator::Multiply
        | BinaryOperator::Divide
        | BinaryOperator::Modulo
        | BinaryOperator::MatrixMultiply => 6,
        BinaryOperator::Power => 7,
    }
}

/// All operands of the operators of one level that nest to the left.
fn binary_chain(expression: &Expression, operator: BinaryOperator) -> Chain<'_> {
    let level_here = level(operator);
    let (mut first, mut rest, mut has_minus) = (expression, Vec::new(), false);
    while let ExpressionKind::Binary {
        operator,
        left,
        right,
    } = &*first.kind
        && level(*operator) == level_here
    {
        has_minus |= *operator == BinaryOperator::Subtract;
        rest.push(right);
        first = left;
    }
    rest.reverse();
    Chain {
        first,
        rest,
        fills: level_here >= level(BinaryOperator::Add),
        may_be_tight: level_here == level(BinaryOperator::Multiply),
        has_minus,
    }
}

/// All calls of a pipeline.
fn pipe_chain(expression: &Expression) -> Chain<'_> {
    let (mut first, mut rest) = (expression, Vec::new());
    while let ExpressionKind::Pipe { left, right } = &*first.kind {
        rest.push(right);
        first = left;
    }
    rest.reverse();
    Chain {
        first,
        rest,
        fills: false,
        may_be_tight: false,
        has_minus: false,
    }
}

/// Whether a comprehension stands without brackets: then it begins with its element.
fn is_bare(comprehension: &Expression, element: &Expression) -> bool {
    comprehension.span.start == element.span.start
}

fn is_number(expression: &Expression) -> bool {
    match &*expression.kind {
        ExpressionKind::Number(_) => true,
        ExpressionKind::Unary { operand, .. } => {
            matches!(*operand.kind, ExpressionKind::Number(_))
        }
        _ => false,
    }
}

fn is_list(expression: &Expression) -> bool {
    matches!(
        &*expression.kind,
        ExpressionKind::List(_) | ExpressionKind::Comprehension { .. }
    )
}

/// Whether an expression is a block, or a function whose body is one.
fn has_own_lines(expression: &Expression) -> bool {
    match &*expression.kind {
        ExpressionKind::Block(_) => true,
        ExpressionKind::Lambda(function) => has_own_lines(&function.body),
        _ => false,
    }
}

/// Whether an expression is a call with a function among its arguments whose body is a block.
fn has_block_argument(expression: &Expression) -> bool {
    match &*expression.kind {
        ExpressionKind::Call { arguments, .. } => arguments
            .iter()
            .any(|argument| has_own_lines(&argument.value)),
        _ => false,
    }
}

/// How an expression looks that is too long for the rest of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Breaks {
    /// It is broken between its own brackets.
    Well,
    /// So is it, but it had better stand on the next line if it fits there.
    InNeed,
    /// It belongs on the next line.
    Badly,
}

fn breaks(expression: &Expression) -> Breaks {
    match &*expression.kind {
        ExpressionKind::List(_)
        | ExpressionKind::Group(_)
        | ExpressionKind::Pipe { .. }
        | ExpressionKind::Lambda(_)
        | ExpressionKind::Block(_) => Breaks::Well,
        ExpressionKind::Call { .. } if has_block_argument(expression) => Breaks::Well,
        ExpressionKind::Call { .. }
        | ExpressionKind::Comprehension { .. }
        | ExpressionKind::With { .. } => Breaks::InNeed,
        ExpressionKind::If { consequence, .. } => match &*consequence.kind {
            ExpressionKind::Block(_) => Breaks::Well,
            _ => Breaks::Badly,
        },
        ExpressionKind::Index { subject, .. } | ExpressionKind::Property { subject, .. } => {
            breaks(subject)
        }
        ExpressionKind::Unary { operand, .. } => breaks(operand),
        _ => Breaks::Badly,
    }
}
