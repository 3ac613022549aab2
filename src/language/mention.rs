//! Which names a part of a program mentions: what it can depend on.
//!
//! Every name counts wherever it stands, bound inside or not, so what is found is never too
//! little.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::resolve::{defined_names, pattern_names};
use crate::syntax::tree::{
    Block, Clause, Coordinates, Expression, ExpressionKind, Function, Statement, StatementKind,
    TextPart,
};

/// A set of names.
pub(super) type Names = FxHashSet<Arc<str>>;

/// The places of the statements that an expression needs, in order: those that bind or assign
/// a name that it mentions, and those that they need themselves.
pub(super) fn needed<'a>(
    statements: &[Statement],
    subject: impl IntoIterator<Item = &'a Expression>,
) -> Vec<usize> {
    let mut wanted = Names::default();
    for expression in subject {
        mentioned(expression, &mut wanted);
    }
    let uses: Vec<Uses> = statements.iter().map(Uses::of).collect();
    let mut needed = vec![false; statements.len()];
    loop {
        let before = wanted.len();
        let mut grown = false;
        for (place, uses) in uses.iter().enumerate() {
            if !needed[place] && uses.changed.iter().any(|name| wanted.contains(name)) {
                needed[place] = true;
                grown = true;
                wanted.extend(uses.mentioned.iter().cloned());
            }
        }
        if !grown && wanted.len() == before {
            break;
        }
    }
    (0..statements.len())
        .filter(|&place| needed[place])
        .collect()
}

/// The names that an expression mentions.
pub(super) fn mentioned(expression: &Expression, names: &mut Names) {
    let mut walker = Walker::default();
    walker.expression(expression);
    names.extend(walker.mentioned);
}

/// What a statement does with names.
struct Uses {
    /// Bound or assigned.
    changed: Names,
    mentioned: Names,
}

impl Uses {
    fn of(statement: &Statement) -> Uses {
        let mut walker = Walker::default();
        walker.statement(statement);
        let mut changed = walker.assigned;
        let bound = defined_names(statement);
        changed.extend(bound.into_iter().map(|name| Arc::clone(&name.text)));
        Uses {
            changed,
            mentioned: walker.mentioned,
        }
    }
}

/// What running a statement does with the names of its file.
pub(super) struct Effects {
    /// What it binds.
    pub(super) bound: Names,
    /// What it binds, and the `var`s that it assigns or that functions assign which it mentions.
    pub(super) changed: Names,
    /// What it mentions, whatever that stands for.
    pub(super) mentioned: Names,
}

/// The effects of the statements of a file. A name that also occurs inside as one of its own counts
/// as well, so what is found is never too little.
pub(super) fn effects(statements: &[Statement]) -> Vec<Effects> {
    let variables: Names = statements
        .iter()
        .filter_map(|statement| match &statement.kind {
            StatementKind::Variable { name, .. } => Some(Arc::clone(&name.text)),
            _ => None,
        })
        .collect();
    let walked: Vec<Walker> = statements
        .iter()
        .map(|statement| {
            let mut walker = Walker::default();
            walker.statement(statement);
            walker.assigned.retain(|name| variables.contains(name));
            walker
        })
        .collect();
    let assigning = assigning_functions(statements, &walked);
    let each = statements.iter().zip(walked);
    each.map(|(statement, walker)| {
        let bound: Names = names_of(statement);
        let mut changed = bound.clone();
        if !matches!(
            statement.kind,
            StatementKind::Function { .. } | StatementKind::Test { .. }
        ) {
            changed.extend(walker.assigned.iter().cloned());
            for (function, variables) in &assigning {
                if walker.mentioned.contains(function) {
                    changed.extend(variables.iter().cloned());
                }
            }
        }
        Effects {
            bound,
            changed,
            mentioned: walker.mentioned,
        }
    })
    .collect()
}

/// The functions of a file that assign its `var`s, directly or through others, and which.
fn assigning_functions(statements: &[Statement], walked: &[Walker]) -> Vec<(Arc<str>, Names)> {
    let mut functions: Vec<(Arc<str>, &Walker, Names)> = statements
        .iter()
        .zip(walked)
        .filter_map(|(statement, walker)| match &statement.kind {
            StatementKind::Function { name, .. } => {
                Some((Arc::clone(&name.text), walker, walker.assigned.clone()))
            }
            _ => None,
        })
        .collect();
    loop {
        let known: Vec<(Arc<str>, Names)> = functions
            .iter()
            .filter(|(_, _, assigned)| !assigned.is_empty())
            .map(|(name, _, assigned)| (Arc::clone(name), assigned.clone()))
            .collect();
        let mut grown = false;
        for (_, walker, assigned) in &mut functions {
            let before = assigned.len();
            for (name, variables) in &known {
                if walker.mentioned.contains(name) {
                    assigned.extend(variables.iter().cloned());
                }
            }
            grown |= assigned.len() > before;
        }
        if !grown {
            return known;
        }
    }
}

fn names_of(statement: &Statement) -> Names {
    let names = defined_names(statement);
    names.iter().map(|name| Arc::clone(&name.text)).collect()
}

#[derive(Default)]
struct Walker {
    mentioned: Names,
    assigned: Names,
}

impl Walker {
    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Parameter { value, range, .. }
            | StatementKind::Setting { value, range, .. } => {
                self.expression(value);
                range.iter().for_each(|range| self.expression(range));
            }
            StatementKind::Import { .. } | StatementKind::Error => {}
            StatementKind::Test { body, .. } => self.block(body),
            StatementKind::Let { value, .. } | StatementKind::Variable { value, .. } => {
                self.expression(value);
            }
            StatementKind::Assignment { target, value } => {
                self.target(target);
                self.expression(target);
                self.expression(value);
            }
            StatementKind::Function { function, .. } => self.function(function),
            StatementKind::Field {
                coordinates,
                domain,
                body,
                ..
            } => {
                if let Coordinates::Point { name, .. } = coordinates {
                    self.mentioned.insert(Arc::clone(&name.text));
                }
                domain.iter().for_each(|side| self.expression(side));
                self.expression(body);
            }
            StatementKind::For { iterable, body, .. } => {
                self.expression(iterable);
                self.block(body);
            }
            StatementKind::While { condition, body } => {
                self.expression(condition);
                self.block(body);
            }
            StatementKind::Expression(expression) => self.expression(expression),
        }
    }

    /// The name at the bottom of an assignment's target.
    fn target(&mut self, target: &Expression) {
        match &*target.kind {
            ExpressionKind::Name(name) => drop(self.assigned.insert(Arc::clone(&name.text))),
            ExpressionKind::Index { subject, .. } | ExpressionKind::Property { subject, .. } => {
                self.target(subject);
            }
            _ => {}
        }
    }

    fn block(&mut self, block: &Block) {
        block
            .statements
            .iter()
            .for_each(|statement| self.statement(statement));
    }

    fn function(&mut self, function: &Function) {
        for parameter in &function.parameters {
            for name in pattern_names(&parameter.pattern) {
                self.mentioned.insert(Arc::clone(&name.text));
            }
            let default = parameter.default.iter();
            default.for_each(|default| self.expression(default));
        }
        self.expression(&function.body);
    }

    fn expression(&mut self, expression: &Expression) {
        // Trees may be thousands of levels deep.
        stacker::maybe_grow(64 * 1024, 4 * 1024 * 1024, || {
            self.expression_kind(expression);
        });
    }

    fn expression_kind(&mut self, expression: &Expression) {
        use ExpressionKind as E;
        match &*expression.kind {
            E::Number(_) | E::Bool(_) | E::Error => {}
            E::Text(parts) => {
                for part in parts {
                    if let TextPart::Interpolation { value, .. } = part {
                        self.expression(value);
                    }
                }
            }
            E::Name(name) => drop(self.mentioned.insert(Arc::clone(&name.text))),
            E::List(elements) => elements.iter().for_each(|element| self.expression(element)),
            E::Comprehension { element, clauses } => {
                self.expression(element);
                for clause in clauses {
                    match clause {
                        Clause::For { iterable, .. } => self.expression(iterable),
                        Clause::If(condition) => self.expression(condition),
                    }
                }
            }
            E::Group(inner) | E::Unary { operand: inner, .. } => self.expression(inner),
            // The property may be a function of that name.
            E::Property { subject, name } => {
                self.mentioned.insert(Arc::clone(&name.text));
                self.expression(subject);
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
            } => {
                self.expression(left);
                self.expression(right);
            }
            E::Comparison { first, rest } => {
                self.expression(first);
                rest.iter()
                    .for_each(|(_, operand)| self.expression(operand));
            }
            E::With { subject, bindings } => {
                self.expression(subject);
                for (name, value) in bindings {
                    let first = name.text.split('.').next().unwrap_or(&name.text);
                    self.mentioned.insert(first.into());
                    self.expression(value);
                }
            }
            E::Call { callee, arguments } => {
                self.expression(callee);
                let values = arguments.iter().map(|argument| &argument.value);
                values.for_each(|value| self.expression(value));
            }
            E::Lambda(function) => self.function(function),
            E::If {
                condition,
                consequence,
                alternative,
            } => {
                self.expression(condition);
                self.expression(consequence);
                alternative.iter().for_each(|other| self.expression(other));
            }
            E::Block(block) => self.block(block),
        }
    }
}
