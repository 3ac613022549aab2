//! Statements.

use std::rc::Rc;
use std::sync::Arc;

use crate::diagnostic::{Code, Span};
use crate::language::function::At;
use crate::language::limits::exceeded;
use crate::language::scope::{Binding, Scope};
use crate::language::session::{Mode, Session};
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{Block, Expression, ExpressionKind, Pattern, Statement, StatementKind};

impl Session {
    /// Runs one statement; its value is that of an expression on its own, else nothing.
    pub(crate) fn statement(
        &mut self,
        statement: &Statement,
        scope: &Rc<Scope>,
        top: bool,
    ) -> Outcome<Value> {
        let lazy = top && self.mode == Mode::Define;
        match &statement.kind {
            StatementKind::Parameter { name, value, range } => {
                self.define_parameter(name, value, range.as_ref(), statement, scope)?;
            }
            StatementKind::Function { name, function } => {
                self.define_function(name, function, statement, scope);
            }
            StatementKind::Field { .. } => self.define_field(statement, scope)?,
            StatementKind::Let {
                pattern: Pattern::Name(name),
                value,
            } if lazy => scope.bind(&name.text, Binding::Lazy(value.clone())),
            StatementKind::Variable { name, value } if lazy => {
                scope.bind(&name.text, Binding::Lazy(value.clone()));
            }
            StatementKind::Let { pattern, value } => {
                let found = self.usable(value, scope)?;
                self.bind(pattern, found, value.span, scope)?;
            }
            StatementKind::Variable { name, value } => {
                let found = self.usable(value, scope)?;
                scope.bind(&name.text, Binding::Variable(found));
            }
            // What follows acts, or is about what acted: not asked for here.
            _ if lazy => {}
            StatementKind::Assignment { target, value } => self.assign(target, value, scope)?,
            StatementKind::For {
                pattern,
                iterable,
                body,
            } => self.for_loop(pattern, iterable, body, scope)?,
            StatementKind::While { condition, body } => self.while_loop(condition, body, scope)?,
            StatementKind::Expression(expression) => {
                return self.expression_statement(expression, scope);
            }
            StatementKind::Error => {}
        }
        Ok(Value::Nothing)
    }

    /// The statements of a block in a scope of their own; the value of the last one.
    pub(crate) fn block(&mut self, block: &Block, scope: &Rc<Scope>) -> Outcome<Value> {
        let inner = Scope::inside(scope);
        let mut last = Value::Nothing;
        for statement in &block.statements {
            last = self.statement(statement, &inner, false)?;
        }
        Ok(last)
    }

    /// Binds the names of a pattern to a value.
    pub(crate) fn bind(
        &mut self,
        pattern: &Pattern,
        value: Value,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        match pattern {
            Pattern::Name(name) => {
                scope.bind(&name.text, Binding::Constant(value));
                Ok(())
            }
            Pattern::List(patterns, place) => match value {
                Value::Unknown => patterns
                    .iter()
                    .try_for_each(|pattern| self.bind(pattern, Value::Unknown, span, scope)),
                Value::List(elements) if elements.len() == patterns.len() => patterns
                    .iter()
                    .zip(elements.iter())
                    .try_for_each(|(pattern, element)| {
                        self.bind(pattern, element.clone(), span, scope)
                    }),
                Value::List(elements) => {
                    let message = format!(
                        "{} names for a list of {} elements",
                        patterns.len(),
                        elements.len()
                    );
                    Err(failure(Code::LengthsDiffer, message)
                        .at(*place, "these names")
                        .at(span, "this list"))
                }
                other => Err(failure(
                    Code::WrongKind,
                    format!("expected a list to take apart, found {}", other.kind()),
                )
                .at(*place, "these names need a list")),
            },
        }
    }

    /// An expression on its own: an `if` here decides what is done, so its condition must be
    /// plain.
    fn expression_statement(
        &mut self,
        expression: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let ExpressionKind::If {
            condition,
            consequence,
            alternative,
        } = &*expression.kind
        else {
            return self.expression(expression, scope);
        };
        if self.tracing > 0 {
            return self.expression(expression, scope);
        }
        match self.plain_condition(condition, scope)? {
            Some(true) => self.expression(consequence, scope),
            Some(false) => match alternative {
                Some(alternative) => self.expression(alternative, scope),
                None => Ok(Value::Nothing),
            },
            None => {
                self.expression(consequence, scope)?;
                if let Some(alternative) = alternative {
                    self.expression(alternative, scope)?;
                }
                Ok(Value::Unknown)
            }
        }
    }

    fn for_loop(
        &mut self,
        pattern: &Pattern,
        iterable: &Expression,
        body: &Block,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        let Some(elements) = self.elements(iterable, scope)? else {
            let inner = Scope::inside(scope);
            self.bind(pattern, Value::Unknown, iterable.span, &inner)?;
            return self.block(body, &inner).map(drop);
        };
        for element in elements.iter() {
            self.step(iterable.span)?;
            let inner = Scope::inside(scope);
            self.bind(pattern, element.clone(), iterable.span, &inner)?;
            self.block(body, &inner)?;
        }
        Ok(())
    }

    fn while_loop(
        &mut self,
        condition: &Expression,
        body: &Block,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        loop {
            self.step(condition.span)?;
            match self.plain_condition(condition, scope)? {
                Some(true) => drop(self.block(body, scope)?),
                Some(false) => return Ok(()),
                None => return self.block(body, scope).map(drop),
            }
        }
    }

    fn assign(
        &mut self,
        target: &Expression,
        value: &Expression,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        let new = self.usable(value, scope)?;
        let mut path = Vec::new();
        let name = self.assignment_path(target, scope, &mut path)?;
        let Some(path) = path.into_iter().rev().collect::<Option<Vec<i64>>>() else {
            return Ok(()); // An unknown index changes an unknown element.
        };
        match scope.update(&name, |variable| replace_element(variable, &path, new)) {
            Some(result) => result.at(target.span, "this element"),
            None => Err(failure(
                Code::NotAssignable,
                format!("`{name}` is not a `var`, so it keeps its value"),
            )
            .at(target.span, "cannot be assigned")),
        }
    }

    /// The name at the bottom of `xs[i][j]`, with the indices, innermost first.
    fn assignment_path(
        &mut self,
        target: &Expression,
        scope: &Rc<Scope>,
        path: &mut Vec<Option<i64>>,
    ) -> Outcome<Arc<str>> {
        match &*target.kind {
            ExpressionKind::Name(name) => Ok(Arc::clone(&name.text)),
            ExpressionKind::Index { subject, index } => {
                path.push(self.whole_number(index, scope)?);
                self.assignment_path(subject, scope, path)
            }
            ExpressionKind::Property { subject, name } => {
                match ["x", "y", "z", "w"]
                    .iter()
                    .position(|axis| **axis == *name.text)
                {
                    Some(axis) => path.push(Some(axis as i64)),
                    None => {
                        let message = format!("the property `{}` cannot be assigned", name.text);
                        return Err(
                            failure(Code::NotAssignable, message).at(name.span, "not a component")
                        );
                    }
                }
                self.assignment_path(subject, scope, path)
            }
            _ => Err(failure(
                Code::NotAssignable,
                "only a name or an element of a list can be assigned",
            )
            .at(target.span, "cannot be assigned")),
        }
    }

    /// Counts one step of the program against its limit.
    pub(crate) fn step(&mut self, span: Span) -> Outcome<()> {
        self.steps += 1;
        if self.steps > self.limits.steps {
            return exceeded(
                Code::StepLimit,
                "the program takes too many steps",
                "steps",
                self.limits.steps,
            )
            .at(span, "still running here");
        }
        Ok(())
    }
}

fn replace_element(variable: &mut Value, path: &[i64], new: Value) -> Outcome<()> {
    let Some((&index, rest)) = path.split_first() else {
        *variable = new;
        return Ok(());
    };
    match variable {
        Value::Unknown => Ok(()),
        Value::List(elements) => {
            let place = element_place(index, elements.len())?;
            replace_element(&mut Rc::make_mut(elements)[place], rest, new)
        }
        other => Err(failure(
            Code::WrongKind,
            format!("expected a list, found {}", other.kind()),
        )),
    }
}

/// The place of element `index` in a list; negative indices count from the end.
pub(crate) fn element_place(index: i64, length: usize) -> Outcome<usize> {
    let place = if index < 0 {
        index + length as i64
    } else {
        index
    };
    if (0..length as i64).contains(&place) {
        return Ok(place as usize);
    }
    let mut error = failure(
        Code::IndexOutOfRange,
        format!(
            "the index {index} is outside a list of {length} element{}",
            if length == 1 { "" } else { "s" }
        ),
    );
    error.help = Some(match length {
        0 => "the list is empty".into(),
        1 => "the only index is 0 (or -1)".into(),
        _ => format!(
            "indices run from 0 to {}, or from -{length} to -1",
            length - 1
        ),
    });
    Err(error)
}
