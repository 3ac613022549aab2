//! Statements.

use std::rc::Rc;
use std::sync::Arc;

use crate::diagnostic::{Code, Diagnostic, Span};
use crate::language::function::At;
use crate::language::limits::exceeded;
use crate::language::resolve::pattern_names;
use crate::language::scope::{Binding, Scope};
use crate::language::session::{BranchKind, Mode, Session};
use crate::language::value::{Outcome, Value, failure};
use crate::syntax::tree::{
    Block, Expression, ExpressionKind, Name, Pattern, Statement, StatementKind,
};

impl Session {
    /// Runs a statement of the file. Where actions are not done yet, a definition that needs
    /// them is kept for later.
    pub(crate) fn top_statement(
        &mut self,
        statement: &Statement,
        scope: &Rc<Scope>,
    ) -> Outcome<()> {
        self.statement(statement, scope)?;
        if self.mode != Mode::Define {
            return Ok(());
        }
        let unknown = |name: &Name| {
            matches!(
                scope.find(&name.text),
                Some(Binding::Constant(value) | Binding::Variable(value)) if value.is_unknown()
            )
        };
        match &statement.kind {
            StatementKind::Let { pattern, .. } => {
                let names = pattern_names(pattern);
                if names.iter().any(|name| unknown(name)) {
                    let later = Rc::new(statement.clone());
                    for name in names {
                        let unit = Rc::clone(&self.unit);
                        scope.bind(&name.text, Binding::Lazy(Rc::clone(&later), unit));
                    }
                }
            }
            StatementKind::Field { name, .. } if unknown(name) => {
                let later = Rc::new(statement.clone());
                scope.bind(&name.text, Binding::Lazy(later, Rc::clone(&self.unit)));
                if self.is_in_main() {
                    self.postponed.push(statement.clone());
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Runs one statement; its value is that of an expression on its own, else nothing.
    pub(crate) fn statement(&mut self, statement: &Statement, scope: &Rc<Scope>) -> Outcome<Value> {
        match &statement.kind {
            StatementKind::Parameter { name, value, range } => {
                self.define_parameter(name, value, range.as_ref(), statement, scope)?;
            }
            StatementKind::Setting { name, value, range } => {
                self.define_setting(name, value, range.as_ref(), statement, scope)?;
            }
            StatementKind::Import { path, name } => {
                let module = self.import(name, statement.documentation.clone(), path.span)?;
                scope.bind(&name.text, Binding::Constant(module));
            }
            StatementKind::Function { name, function } => {
                self.define_function(name, function, statement, scope);
            }
            StatementKind::Field { .. } => self.define_field(statement, scope)?,
            StatementKind::Let { pattern, value } => {
                let found = self.usable(value, scope)?;
                self.bind(pattern, found, value.span, scope)?;
            }
            StatementKind::Variable { name, value } => {
                let found = self.usable(value, scope)?;
                scope.bind(&name.text, Binding::Variable(found));
            }
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
            // Tests are run by whoever asks for them, after everything else.
            StatementKind::Test { .. } | StatementKind::Error => {}
        }
        Ok(Value::Nothing)
    }

    /// The statements of a block in a scope of their own; the value of the last one.
    pub(crate) fn block(&mut self, block: &Block, scope: &Rc<Scope>) -> Outcome<Value> {
        let inner = Scope::inside(scope);
        let mut last = Value::Nothing;
        for statement in &block.statements {
            last = self.statement(statement, &inner)?;
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
        if self.graph.level > 0 {
            return self.expression(expression, scope);
        }
        match self.plain_condition(condition, scope)? {
            Some(true) => self.expression(consequence, scope),
            Some(false) => match alternative {
                Some(alternative) => self.expression(alternative, scope),
                None => Ok(Value::Nothing),
            },
            None => self.unknown_choice(consequence, alternative.as_ref(), scope),
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
            return self.branch(BranchKind::Unknown, |session| {
                let inner = Scope::inside(scope);
                session.bind(pattern, Value::Unknown, iterable.span, &inner)?;
                session.block(body, &inner).map(drop)
            });
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
                None => {
                    return self.branch(BranchKind::Unknown, |session| {
                        session.block(body, scope).map(drop)
                    });
                }
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
        let branch = self.branch;
        let assigned = scope.update(&name, |variable, age| match branch {
            Some(branch) if age < branch.since => match branch.kind {
                BranchKind::Unknown => {
                    *variable = Value::Unknown;
                    Ok(())
                }
                BranchKind::Traced => Err(outer_assignment(&name)),
            },
            _ => replace_element(variable, &path, new),
        });
        match assigned {
            Some(result) => result.at(target.span, "assigned here"),
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

/// The error for changing, where both branches of a condition are traced, what was there before.
fn outer_assignment(name: &str) -> Box<Diagnostic> {
    let mut error = failure(
        Code::NotAssignable,
        format!("`{name}` cannot be assigned here, where it is open whether this is meant"),
    );
    error.help = Some(format!(
        "the condition depends on the point or on parameters: write `{name} = if … then … else …`; \
         and a field's body changes nothing outside itself"
    ));
    error
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
            elements.change(place, |element| replace_element(element, rest, new))
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
