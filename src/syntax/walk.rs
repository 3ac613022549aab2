//! One walk over a tree for all who ask what its names mean: scopes open and close, names are
//! bound and mentioned, in the order in which the program is evaluated.

use super::tree::{
    Argument, Block, Clause, Coordinates, Expression, ExpressionKind, Function, Name, Pattern,
    Statement, StatementKind, TextPart, Tree,
};

/// What a name is bound as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A `param`.
    Parameter,
    /// A `setting`.
    Setting,
    /// What is imported.
    Module,
    /// By `let`.
    Value,
    /// A `var`.
    Variable,
    /// A `fn`.
    Function,
    /// A `field`.
    Field,
    /// A coordinate or the point of a field.
    Coordinate,
    /// What an argument of a function is bound to.
    Argument,
    /// What a loop or a comprehension goes through.
    Loop,
}

/// Someone who is told what happens to names.
pub trait Visitor<'tree> {
    /// A scope opens inside the present one.
    fn open(&mut self) {}

    /// The innermost scope closes.
    fn close(&mut self) {}

    /// What follows is run later, when everything in the file is there: the body of a function.
    fn enter_function(&mut self) {}

    /// The end of what is run later.
    fn leave_function(&mut self) {}

    /// A statement follows.
    fn statement(&mut self, _statement: &'tree Statement) {}

    /// A name is bound in the innermost scope.
    fn bind(&mut self, name: &'tree Name, role: Role);

    /// A name is looked up.
    fn mention(&mut self, name: &'tree Name);

    /// `subject.name`, after the subject; `called` where arguments follow.
    fn property(&mut self, _subject: &'tree Expression, _name: &'tree Name, _called: bool) {}

    /// `with {name = …}`
    fn change(&mut self, _name: &'tree Name) {}

    /// `callee(name = …)`
    fn argument(&mut self, _callee: &'tree Expression, _name: &'tree Name) {}
}

/// Walks over a whole file, which is a scope.
pub fn walk<'tree>(tree: &'tree Tree, visitor: &mut impl Visitor<'tree>) {
    visitor.open();
    for one in &tree.statements {
        statement(one, visitor);
    }
    visitor.close();
}

fn pattern<'tree>(pattern: &'tree Pattern, role: Role, visitor: &mut impl Visitor<'tree>) {
    match pattern {
        Pattern::Name(name) => visitor.bind(name, role),
        Pattern::List(patterns, _) => {
            for inner in patterns {
                self::pattern(inner, role, visitor);
            }
        }
    }
}

fn statement<'tree>(statement: &'tree Statement, visitor: &mut impl Visitor<'tree>) {
    visitor.statement(statement);
    match &statement.kind {
        StatementKind::Parameter { name, value, range } => {
            expressions([value].into_iter().chain(range), visitor);
            visitor.bind(name, Role::Parameter);
        }
        StatementKind::Setting { name, value, range } => {
            expressions([value].into_iter().chain(range), visitor);
            visitor.bind(name, Role::Setting);
        }
        StatementKind::Import { name, .. } => visitor.bind(name, Role::Module),
        StatementKind::Test { body, .. } => {
            visitor.enter_function();
            block(body, visitor);
            visitor.leave_function();
        }
        StatementKind::Let {
            pattern: bound,
            value,
        } => {
            expression(value, visitor);
            pattern(bound, Role::Value, visitor);
        }
        StatementKind::Variable { name, value } => {
            expression(value, visitor);
            visitor.bind(name, Role::Variable);
        }
        StatementKind::Assignment { target, value } => {
            expression(value, visitor);
            expression(target, visitor);
        }
        StatementKind::Function { name, function } => {
            visitor.bind(name, Role::Function);
            self::function(function, visitor);
        }
        StatementKind::Field {
            name,
            coordinates,
            domain,
            body,
        } => {
            expressions(domain, visitor);
            visitor.open();
            match coordinates {
                Coordinates::Named(names) => {
                    for name in names {
                        visitor.bind(name, Role::Coordinate);
                    }
                }
                Coordinates::Point { name, .. } => visitor.bind(name, Role::Coordinate),
            }
            expression(body, visitor);
            visitor.close();
            visitor.bind(name, Role::Field);
        }
        StatementKind::For {
            pattern: bound,
            iterable,
            body,
        } => {
            expression(iterable, visitor);
            visitor.open();
            pattern(bound, Role::Loop, visitor);
            block(body, visitor);
            visitor.close();
        }
        StatementKind::While { condition, body } => {
            expression(condition, visitor);
            block(body, visitor);
        }
        StatementKind::Expression(inner) => expression(inner, visitor),
        StatementKind::Error => {}
    }
}

fn block<'tree>(block: &'tree Block, visitor: &mut impl Visitor<'tree>) {
    visitor.open();
    for inner in &block.statements {
        statement(inner, visitor);
    }
    visitor.close();
}

fn function<'tree>(function: &'tree Function, visitor: &mut impl Visitor<'tree>) {
    visitor.enter_function();
    visitor.open();
    for parameter in &function.parameters {
        expressions(&parameter.default, visitor);
        pattern(&parameter.pattern, Role::Argument, visitor);
    }
    expression(&function.body, visitor);
    visitor.close();
    visitor.leave_function();
}

fn expressions<'tree>(
    all: impl IntoIterator<Item = &'tree Expression>,
    visitor: &mut impl Visitor<'tree>,
) {
    for one in all {
        expression(one, visitor);
    }
}

fn expression<'tree>(expression: &'tree Expression, visitor: &mut impl Visitor<'tree>) {
    // Trees may be thousands of levels deep.
    stacker::maybe_grow(64 * 1024, 4 * 1024 * 1024, || {
        expression_kind(expression, visitor);
    });
}

fn expression_kind<'tree>(whole: &'tree Expression, visitor: &mut impl Visitor<'tree>) {
    use ExpressionKind as E;
    match &*whole.kind {
        E::Number(_) | E::Bool(_) | E::Error => {}
        E::Text(parts) => {
            for part in parts {
                if let TextPart::Interpolation { value, .. } = part {
                    expression(value, visitor);
                }
            }
        }
        E::Name(name) => visitor.mention(name),
        E::List(elements) => expressions(elements, visitor),
        E::Comprehension { element, clauses } => comprehension(element, clauses, visitor),
        E::Group(inner) | E::Unary { operand: inner, .. } => expression(inner, visitor),
        E::Property { subject, name } => {
            expression(subject, visitor);
            visitor.property(subject, name, false);
        }
        E::Binary { left, right, .. }
        | E::Interval {
            low: left,
            high: right,
        }
        | E::Steps {
            interval: left,
            step: right,
        }
        | E::Pipe { left, right }
        | E::Index {
            subject: left,
            index: right,
        } => expressions([left, right], visitor),
        E::Comparison { first, rest } => {
            expression(first, visitor);
            expressions(rest.iter().map(|(_, operand)| operand), visitor);
        }
        E::With { subject, bindings } => {
            expression(subject, visitor);
            for (name, value) in bindings {
                visitor.change(name);
                expression(value, visitor);
            }
        }
        E::Call { callee, arguments } => call(callee, arguments, visitor),
        E::Lambda(inner) => function(inner, visitor),
        E::If {
            condition,
            consequence,
            alternative,
        } => {
            let parts = [condition, consequence].into_iter().chain(alternative);
            expressions(parts, visitor);
        }
        E::Block(inner) => block(inner, visitor),
    }
}

fn call<'tree>(
    callee: &'tree Expression,
    arguments: &'tree [Argument],
    visitor: &mut impl Visitor<'tree>,
) {
    match &*callee.kind {
        ExpressionKind::Property { subject, name } => {
            expression(subject, visitor);
            visitor.property(subject, name, true);
        }
        _ => expression(callee, visitor),
    }
    for argument in arguments {
        if let Some(name) = &argument.name {
            visitor.argument(callee, name);
        }
        expression(&argument.value, visitor);
    }
}

fn comprehension<'tree>(
    element: &'tree Expression,
    clauses: &'tree [Clause],
    visitor: &mut impl Visitor<'tree>,
) {
    let Some((clause, rest)) = clauses.split_first() else {
        return expression(element, visitor);
    };
    match clause {
        Clause::For {
            pattern: bound,
            iterable,
        } => {
            expression(iterable, visitor);
            visitor.open();
            pattern(bound, Role::Loop, visitor);
            comprehension(element, rest, visitor);
            visitor.close();
        }
        Clause::If(condition) => {
            expression(condition, visitor);
            comprehension(element, rest, visitor);
        }
    }
}
